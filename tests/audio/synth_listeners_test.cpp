#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "audio/dsp/spread_kernel.h"
#include "audio/propagation/hrtf.h"
#include "tests/audio/ball_drop.h"
#include "tests/support/click_spectrum.h"
#include "tests/support/constants.h"

// Tests listeners of every format against plain microphones at the same places.

namespace carom {

using namespace audio;

namespace {

using namespace test;

using std::numbers::pi;
using test::BallDrop;
using test::makeSynth;
using test::peakOf;
using test::renderPlanes;
using test::spectrumOf;

constexpr std::size_t kFrames = 4800;

using Samples = std::vector<double>;

SynthSettings keen() {
  SynthSettings settings;
  settings.audibleThreshold = 0.0;
  return settings;
}

ImpulseEvent hit(const Vec3& centre = {0.3, -0.2, 0.5}) {
  ImpulseEvent event = BallDrop{.time = 0.01, .centre = centre}.event();
  event.impulse = event.impulse.norm() * Vec3(0.48, -0.6, 0.64);
  event.bodyVelocity = {3.0, -2.0, 1.0};
  return event;
}

std::vector<Samples> heard(const std::vector<Listener>& listeners, const ImpulseEvent& event,
                           const SynthSettings& settings = keen(), std::size_t frames = kFrames) {
  Synth synth = makeSynth({}, listeners, settings);
  synth.schedule(event);
  return renderPlanes(synth, frames);
}

Samples heardAt(const Vec3& place, const ImpulseEvent& event,
                const SynthSettings& settings = keen()) {
  return heard({{"seat", place}}, event, settings)[0];
}

void expectNear(const Samples& made, const Samples& wanted, double tolerance) {
  ASSERT_EQ(made.size(), wanted.size());
  const double peak = peakOf(wanted);
  ASSERT_GT(peak, 0.0);
  double worst = 0.0;
  for (std::size_t n = 0; n < made.size(); ++n)
    worst = std::max(worst, std::abs(made[n] - wanted[n]));
  EXPECT_LT(worst, tolerance * peak);
}

/// A head with two equal ears, at which an echo, long after the onset, is louder the higher the
/// source is.
std::shared_ptr<const HrtfSet> madeHead() {
  HrtfMeasurements measurements;
  for (int i = 0; i < 200; ++i) {
    const double y = 1.0 - (2.0 * i + 1.0) / 200.0;
    const double angle = pi * (3.0 - std::sqrt(5.0)) * i;
    const double radius = std::sqrt(1.0 - y * y);
    HrtfMeasurement item;
    item.direction = Vec3(radius * std::sin(angle), y, radius * std::cos(angle));
    for (std::vector<float>& response : item.response) {
      response.assign(128, 0.0F);
      response[20] = 1.0F;
      response[70] = static_cast<float>(0.5 * y + 0.3 * item.direction.x());
    }
    measurements.items.push_back(item);
  }
  return std::make_shared<const HrtfSet>(*HrtfSet::create(measurements, kRate));
}

Listener turned(ListenerFormat format, const Vec3& place, const Quat& orientation) {
  Listener listener{"turned", place, orientation};
  listener.format = format;
  if (format == ListenerFormat::binaural) listener.hrtf = madeHead();
  return listener;
}

const Quat kTurn(Eigen::AngleAxisd(1.1, Vec3(0.6, 0.0, 0.8)));

TEST(SynthListeners, ASpacedPairIsTwoMicrophonesOnItsOwnXAxis) {
  for (const Quat& orientation : {Quat(Quat::Identity()), kTurn}) {
    Listener pair = turned(ListenerFormat::spacedPair, {1, 0.5, 1}, orientation);
    pair.spacing = 0.8;
    const auto both = heard({pair}, hit());
    ASSERT_EQ(both.size(), 2u);
    const Vec3 right = orientation.toRotationMatrix().col(0);
    expectNear(both[0], heardAt(pair.position - 0.4 * right, hit()), 1e-11);
    expectNear(both[1], heardAt(pair.position + 0.4 * right, hit()), 1e-11);
  }
}

TEST(SynthListeners, ACoincidentPairHearsTheMicrophoneInItsPlaceByItsPolarPattern) {
  SynthSettings still = keen();
  still.doppler = false;  // otherwise the direction changes within the click
  for (const double pattern : {0.3, 0.5, 1.0}) {
    Listener pair = turned(ListenerFormat::coincidentPair, {1, 0.5, 1}, kTurn);
    pair.halfAngle = 0.7;
    pair.pattern = pattern;
    const auto both = heard({pair}, hit(), still);
    const Samples omni = heardAt(pair.position, hit(), still);
    const Vec3 source = (hit().bodyPosition - pair.position).normalized();
    const Eigen::Matrix3d frame = kTurn.toRotationMatrix();
    for (const std::size_t channel : {0u, 1u}) {
      const double side = channel == 0 ? -1.0 : 1.0;
      // The listener looks along -Z; +X is at its right.
      const Vec3 axis = side * std::sin(0.7) * frame.col(0) - std::cos(0.7) * frame.col(2);
      Samples wanted = omni;
      for (double& sample : wanted)
        sample *= 1.0 - pattern + pattern * axis.dot(source);
      expectNear(both[channel], wanted, 1e-11);
    }
  }
}

TEST(SynthListeners, AFigureOfEightHearsWhatIsBehindItUpsideDown) {
  Listener eight{"eight", {0, 0, 1}};
  eight.pattern = 1.0;
  SynthSettings still = keen();
  still.doppler = false;
  const ImpulseEvent below = BallDrop{.time = 0.01}.event();
  ImpulseEvent above = BallDrop{.time = 0.01, .centre = {0, 0, 2}}.event();
  above.impulse = -above.impulse;                         // towards the listener as well
  const Samples front = heard({eight}, below, still)[0];  // the listener looks along -Z: down
  Samples back = heard({eight}, above, still)[0];
  for (double& sample : back)
    sample = -sample;
  expectNear(back, front, 1e-11);
}

TEST(SynthListeners, MovingAndTurningEverythingTogetherChangesNothing) {
  const Vec3 shift(12.0, -7.0, 3.0);
  ImpulseEvent moved = hit();
  moved.impulse = kTurn * moved.impulse;
  moved.normal = kTurn * moved.normal;
  moved.bodyVelocity = kTurn * moved.bodyVelocity;
  moved.position = kTurn * moved.position + shift;
  moved.bodyPosition = kTurn * moved.bodyPosition + shift;
  for (const ListenerFormat format : {ListenerFormat::mono, ListenerFormat::spacedPair,
                                      ListenerFormat::coincidentPair, ListenerFormat::binaural}) {
    const Quat orientation(Eigen::AngleAxisd(0.4, Vec3(0.0, 0.6, 0.8)));
    const auto here = heard({turned(format, {1, 0.5, 1}, orientation)}, hit());
    const auto there =
        heard({turned(format, kTurn * Vec3(1, 0.5, 1) + shift, kTurn * orientation)}, moved);
    ASSERT_EQ(here.size(), there.size());
    for (std::size_t channel = 0; channel < here.size(); ++channel)
      expectNear(there[channel], here[channel], 1e-9);
  }
}

TEST(SynthListeners, ChannelsComeInTheOrderOfTheListenersToTheBit) {
  const std::vector<Listener> listeners = {
      turned(ListenerFormat::spacedPair, {1, 0.5, 1}, kTurn),
      {"mono", {0, 0, 2}},
      turned(ListenerFormat::binaural, {-1, 0.5, 1}, Quat::Identity()),
      turned(ListenerFormat::coincidentPair, {0, 1, 0}, kTurn)};
  const auto together = heard(listeners, hit());
  ASSERT_EQ(together.size(), 7u);
  std::size_t channel = 0;
  for (const Listener& listener : listeners)
    for (const Samples& plane : heard({listener}, hit()))
      EXPECT_EQ(together[channel++], plane) << listener.name;
}

// --- Ears ---------------------------------------------------------------------------------------

double energyOf(const std::vector<std::complex<double>>& spectrum) {
  double sum = 0.0;
  for (const auto& value : spectrum)
    sum += std::norm(value);
  return sum;
}

// The set's whole response delays by its latency and by fractions of a sample, the synth by
// neither: they are compared as spectra in the band.
TEST(SynthListeners, EarsHearTheClickAtTheHeadsCentreThroughTheWholeResponse) {
  const auto set = defaultHrtf(kRate);
  if (!set) GTEST_SKIP() << set.error().message;
  std::vector<double> frequencies;
  for (double f = 100.0; f < kBand * kRate; f += 130.0)
    frequencies.push_back(f);
  SynthSettings still = keen();
  still.doppler = false;
  for (const Vec3& centre :
       {Vec3(0, 0, -2), Vec3(2, 0.3, 0.4), Vec3(-0.7, -1, 1), Vec3(0.1, 2, 1)}) {
    const ImpulseEvent event = hit(centre);
    const Vec3 place(0.2, 0.1, 0.0);
    Listener head = turned(ListenerFormat::binaural, place, kTurn);
    head.hrtf = *set;
    const auto ears = heard({head}, event, still);
    const auto click = spectrumOf(heardAt(place, event, still), kRate, frequencies);
    const SphereWeights where = (*set)->lookup(kTurn.conjugate() * (centre - place));
    for (const Ear ear : {Ear::left, Ear::right}) {
      Samples response((*set)->length());
      (*set)->blend(where, ear, response);
      auto error = spectrumOf(ears[ear == Ear::left ? 0 : 1], kRate, frequencies);
      auto through = spectrumOf(response, kRate, frequencies);
      for (std::size_t i = 0; i < frequencies.size(); ++i) {
        // spectrumOf is an integral over time; for a filter the factor 1 / rate is taken back.
        through[i] *=
            kRate * click[i] * std::polar(1.0, 2.0 * pi * frequencies[i] * (*set)->latency());
        error[i] -= through[i];
      }
      EXPECT_LT(10.0 * std::log10(energyOf(error) / energyOf(through)), -60.0) << centre;
    }
  }
}

// Simultaneous, equally loud clicks differ by their directions, and floating-point sums by their
// order.
TEST(SynthListeners, OrderOfSchedulingDoesNotChangeABitOfSimultaneousClicksAroundAHead) {
  Listener head = turned(ListenerFormat::binaural, Vec3::Zero(), Quat::Identity());
  std::vector<ImpulseEvent> events;
  for (const Vec3& direction : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1), Vec3(-1, 0, 0),
                                Vec3(0, -1, 0), Vec3(0, 0, -1)}) {
    BallDrop drop{.time = 0.01, .centre = 2.0 * direction};
    ImpulseEvent event = drop.event();
    event.impulse = -event.impulse.norm() * direction;
    event.bodyVelocity.setZero();
    events.push_back(event);
  }
  SynthSettings still = keen();
  still.doppler = false;
  const auto render = [&] {
    Synth synth = makeSynth({}, {head}, still);
    for (const ImpulseEvent& event : events)
      synth.schedule(event);
    return renderPlanes(synth, kFrames);
  };
  const auto wanted = render();
  std::mt19937_64 random(5);
  for (int turn = 0; turn < 20; ++turn) {
    std::shuffle(events.begin(), events.end(), random);
    ASSERT_TRUE(render() == wanted) << turn;
  }
}

TEST(SynthListeners, EventsHandedOverTheirLeadTimeAheadAreNotLateAtAHead) {
  BallDrop drop;
  Synth synth = makeSynth(drop, {turned(ListenerFormat::binaural, {0, 0, 0.02}, kTurn)}, keen());
  for (const Vec3& direction : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1), Vec3(-1, 0, 0)}) {
    drop.time = synth.leadTime(synth.contactDuration(drop.event()));
    drop.centre = Vec3(0, 0, 0.02) + 0.011 * direction;
    synth.schedule(drop.event());
  }
  EXPECT_EQ(synth.counters().late, 0u);
}

TEST(SynthListeners, AHeadsPairOfChannelsSurvivesItsCreator) {
  Synth synth = [] {
    Listener head = turned(ListenerFormat::binaural, {0, 0, 1}, Quat::Identity());
    return makeSynth({}, {head}, keen());
  }();
  synth.schedule(hit());
  EXPECT_GT(peakOf(renderPlanes(synth, kFrames)[1]), 0.0);
}

// --- Bad input ----------------------------------------------------------------------------------

TEST(SynthListeners, RefusesListenersThatAreNot) {
  const auto refusal = [](auto change, ListenerFormat format) {
    Listener listener = turned(format, {0, 0, 1}, Quat::Identity());
    listener.name = "booth";
    change(listener);
    const auto synth = Synth::create({}, {{"fine", {0, 0, 1}}, listener});
    return synth ? std::string("accepted") : synth.error().message;
  };
  const auto says = [](const std::string& field) {
    return testing::AllOf(testing::HasSubstr("synth: listener 1 ('booth'): "),
                          testing::HasSubstr(field));
  };
  const auto mono = ListenerFormat::mono;
  const auto spaced = ListenerFormat::spacedPair;
  EXPECT_THAT(refusal([](Listener& l) { l.position.x() = kNaN; }, mono), says("position"));
  EXPECT_THAT(refusal([](Listener& l) { l.orientation.w() = kNaN; }, mono), says("orientation"));
  EXPECT_THAT(refusal([](Listener& l) { l.pattern = kNaN; }, mono), says("pattern"));
  EXPECT_THAT(refusal([](Listener& l) { l.spacing = kNaN; }, spaced), says("spacing"));
  EXPECT_THAT(refusal([](Listener& l) { l.halfAngle = kNaN; }, spaced), says("halfAngle"));
  EXPECT_THAT(refusal([](Listener& l) { l.format = static_cast<ListenerFormat>(9); }, mono),
              says("format"));
  Listener head = turned(ListenerFormat::binaural, {0, 0, 1}, Quat::Identity());
  SynthSettings other;
  other.sampleRate = 44100.0;
  const auto synth = Synth::create(other, {head});
  ASSERT_FALSE(synth);
  EXPECT_THAT(synth.error().message, testing::HasSubstr("are for 48000"));
}

}  // namespace
}  // namespace carom
