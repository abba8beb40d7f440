#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "carom/audio/absorption.h"
#include "tests/audio/ball_drop.h"
#include "tests/support/click_spectrum.h"
#include "tests/support/constants.h"
#include "tests/support/random.h"

// Tests the room around a click: against clicks in open air that are mirrored, filtered and added
// here, by hand, and against the formulas of a diffuse field.

namespace carom {
namespace {

using namespace test;

using std::numbers::pi;
using test::BallDrop;
using test::makeSynth;
using test::peakOf;
using test::renderMono;
using test::renderPlanes;
using test::spectrumOf;

constexpr double kSpeedOfSound = 343.0;
constexpr std::size_t kRoomFrames = 6000;

using Samples = std::vector<double>;

SynthSettings keen() {
  SynthSettings settings;
  settings.audibleThreshold = 0.0;
  return settings;
}

/// An impact that is not along any axis, of a body that moves and goes on moving.
ImpulseEvent obliqueHit(double time, const Vec3& centre) {
  ImpulseEvent event = BallDrop{.time = time, .centre = centre}.event();
  event.impulse = event.impulse.norm() * Vec3(0.48, -0.6, 0.64);
  event.bodyVelocity = {3.0, -2.0, 1.0};
  return event;
}

Samples heard(const ImpulseEvent& event, const Vec3& listener, const SynthSettings& settings,
              std::size_t frames = kRoomFrames) {
  Synth synth = makeSynth({}, {{"seat", listener}}, settings);
  synth.schedule(event);
  return renderMono(synth, frames);
}

/// Mirrors everything of the event that has a place or a direction in the plane normal . x =
/// offset.
ImpulseEvent mirrored(ImpulseEvent event, const Vec3& normal, double offset) {
  const auto flip = [&](const Vec3& vector) -> Vec3 {
    return vector - 2.0 * normal.dot(vector) * normal;
  };
  const auto move = [&](const Vec3& point) -> Vec3 {
    return point + 2.0 * (offset - normal.dot(point)) * normal;
  };
  event.impulse = flip(event.impulse);
  event.normal = flip(event.normal);
  event.bodyVelocity = flip(event.bodyVelocity);
  event.position = move(event.position);
  event.bodyPosition = move(event.bodyPosition);
  return event;
}

Samples plus(Samples sum, const Samples& other) {
  for (std::size_t n = 0; n < sum.size(); ++n)
    sum[n] += other[n];
  return sum;
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

Absorption absorbing(const std::array<double, kBandCount>& coefficients) {
  return {coefficients};
}

const Absorption kCarpet = absorbing({0.02, 0.06, 0.14, 0.37, 0.6, 0.65, 0.65});
const Absorption kPanel = absorbing({0.3, 0.2, 0.15, 0.1, 0.1, 0.1, 0.1});

/// The published form of the filter, H(z) = (b0 + b1 z^-1) / (1 + a1 z^-1), as its difference
/// equation.
Samples reflectedBy(const Absorption& absorption, const Samples& in) {
  const ReflectionFilter f = reflectionFilter(absorption, kRate);
  Samples out(in.size());
  for (std::size_t n = 0; n < in.size(); ++n)
    out[n] = f.b0 * in[n] + (n > 0 ? f.b1 * in[n - 1] - f.a1 * out[n - 1] : 0.0);
  return out;
}

TEST(SynthRoom, WithoutReflectorsIsOpenAirToTheBit) {
  const ImpulseEvent event = obliqueHit(0.01, {0.3, -0.2, 0.5});
  const Samples open = heard(event, {1, 0, 1}, keen());
  for (const int order : {0, 1, 4}) {
    SynthSettings settings = keen();
    settings.room.order = order;
    EXPECT_EQ(heard(event, {1, 0, 1}, settings), open);
  }
  SynthSettings unheard = keen();
  unheard.room.reflectors = {{Vec3::UnitZ(), 0.0, {}}};
  unheard.room.order = 0;
  EXPECT_EQ(heard(event, {1, 0, 1}, unheard), open);
}

class MirrorFloor : public testing::TestWithParam<Radiation> {};

TEST_P(MirrorFloor, SoundsLikeTheMirroredEventInOpenAir) {
  SynthSettings open = keen();
  open.comparison.radiation = GetParam();
  SynthSettings floored = open;
  const Vec3 normal = Vec3(0.2, -0.1, 1.0).normalized();
  floored.room.reflectors = {{normal, -0.4, {}}};
  for (const Vec3& listener : {Vec3(1, 0.5, 1), Vec3(-3, 2, 0.9), Vec3(0.31, -0.2, 0.55)}) {
    const ImpulseEvent event = obliqueHit(0.01, {0.3, -0.2, 0.5});
    const Samples wanted =
        plus(heard(event, listener, open), heard(mirrored(event, normal, -0.4), listener, open));
    expectNear(heard(event, listener, floored), wanted, 1e-9);
  }
}

INSTANTIATE_TEST_SUITE_P(SynthRoom, MirrorFloor,
                         testing::Values(Radiation::exact, Radiation::compact));

TEST(SynthRoom, AnAbsorbingWallFiltersTheMirroredClickByItsPublishedEquation) {
  const ImpulseEvent event = obliqueHit(0.01, {0.3, -0.2, 0.5});
  const Vec3 listener(1, 0.5, 1);
  for (const Absorption& absorption : {kCarpet, kPanel}) {
    SynthSettings floored = keen();
    floored.room.reflectors = {{Vec3::UnitZ(), 0.1, absorption}};
    const Samples image = heard(mirrored(event, Vec3::UnitZ(), 0.1), listener, keen());
    expectNear(heard(event, listener, floored),
               plus(heard(event, listener, keen()), reflectedBy(absorption, image)), 1e-9);
  }
}

TEST(SynthRoom, AWallThatTakesEverythingLeavesTheDirectSound) {
  const ImpulseEvent event = obliqueHit(0.01, {0.3, -0.2, 0.5});
  SynthSettings floored = keen();
  floored.room.reflectors = {{Vec3::UnitZ(), 0.1, absorbing({1, 1, 1, 1, 1, 1, 1})}};
  expectNear(heard(event, {1, 0, 1}, floored), heard(event, {1, 0, 1}, keen()), 1e-6);
}

TEST(SynthRoom, WhoStandsBehindAWallHearsNoReflection) {
  SynthSettings floored = keen();
  floored.room.reflectors = {{Vec3::UnitZ(), 0.0, {}}};
  const ImpulseEvent above = obliqueHit(0.01, {0, 0, 0.5});
  const ImpulseEvent below = obliqueHit(0.01, {0, 0, -0.5});
  EXPECT_EQ(heard(above, {1, 0, -0.3}, floored), heard(above, {1, 0, -0.3}, keen()));
  EXPECT_EQ(heard(below, {1, 0, 0.3}, floored), heard(below, {1, 0, 0.3}, keen()));
  EXPECT_NE(heard(above, {1, 0, 0.3}, floored), heard(above, {1, 0, 0.3}, keen()));
}

// The room is a table over a floor: the floor's point of reflection lies under the table.
TEST(SynthRoom, AWallHidesTheReflectionOfAnotherBehindIt) {
  const ImpulseEvent event = obliqueHit(0.01, {0, 0, 1});
  const Reflector floor{Vec3::UnitZ(), 0.0, {}};
  const Reflector table{Vec3(0.1, 0.0, 1.0).normalized(), 0.6, {}};
  SynthSettings only = keen();
  only.room.reflectors = {table};
  SynthSettings both = keen();
  both.room.reflectors = {floor, table};
  EXPECT_EQ(heard(event, {4, 0, 1}, both), heard(event, {4, 0, 1}, only));
}

TEST(SynthRoom, ABoxOfOrder2IsTheSumOverMirrorsOfMirrors) {
  // The walls' filters commute, so that their order on a path does not matter.
  const std::array<Vec3, 6> normals = {Vec3::UnitX(),  -Vec3::UnitX(), Vec3::UnitY(),
                                       -Vec3::UnitY(), Vec3::UnitZ(),  -Vec3::UnitZ()};
  const std::array<double, 6> offsets = {-2.0, -2.5, -1.5, -3.0, 0.0, -2.4};
  SynthSettings boxed = keen();
  boxed.room.order = 2;
  for (std::size_t wall = 0; wall < 6; ++wall)
    boxed.room.reflectors.push_back({normals[wall], offsets[wall], wall < 2 ? kCarpet : kPanel});
  const ImpulseEvent event = obliqueHit(0.01, {0.3, -0.2, 0.5});
  const Vec3 listener(1.1, 0.7, 1.6);

  Samples wanted = heard(event, listener, keen());
  std::vector<Vec3> places;  // images heard so far: two ways around a right angle end in one image
  for (std::size_t one = 0; one < 6; ++one) {
    const ImpulseEvent first = mirrored(event, normals[one], offsets[one]);
    const Absorption& near = boxed.room.reflectors[one].absorption;
    wanted = plus(wanted, reflectedBy(near, heard(first, listener, keen())));
    for (std::size_t two = 0; two < 6; ++two) {
      if (two == one) continue;
      const ImpulseEvent second = mirrored(first, normals[two], offsets[two]);
      const auto isThere = [&](const Vec3& p) { return (p - second.bodyPosition).norm() < 1e-9; };
      if (std::ranges::any_of(places, isThere)) continue;
      places.push_back(second.bodyPosition);
      const Absorption& far = boxed.room.reflectors[two].absorption;
      wanted = plus(wanted, reflectedBy(far, reflectedBy(near, heard(second, listener, keen()))));
    }
  }
  EXPECT_EQ(places.size(), 18u);  // 4 k^2 + 2
  expectNear(heard(event, listener, boxed), wanted, 1e-9);
}

// Far away, a dipole at height h and its image at -h differ by the phase 2 k h cos: relative to the
// dipole alone there remains |1 - exp(-2 i k h cos)| = 2 |sin(k h cos)|.
TEST(SynthRoom, AVerticalDipoleOnARigidFloorNearlyCancelsAtLowFrequencies) {
  constexpr double kFar = 2000.0;  // m
  constexpr double kHeight = 0.05;
  const double up = 30.0 * pi / 180.0;
  const Vec3 listener = kFar * Vec3(std::cos(up), 0.0, std::sin(up));
  SynthSettings open = keen();
  open.doppler = false;
  SynthSettings floored = open;
  floored.room.reflectors = {{Vec3::UnitZ(), 0.0, {}}};
  BallDrop drop{.time = -kFar / kSpeedOfSound + 0.01, .centre = {0, 0, kHeight}};
  const ImpulseEvent event = drop.event();
  std::vector<double> frequencies;
  for (double f = 50.0; f < 19000.0; f *= 1.21)
    frequencies.push_back(f);
  const auto both = spectrumOf(heard(event, listener, floored), kRate, frequencies);
  const auto alone = spectrumOf(heard(event, listener, open), kRate, frequencies);
  for (std::size_t i = 0; i < frequencies.size(); ++i) {
    const double phase = 2.0 * pi * frequencies[i] / kSpeedOfSound * kHeight * std::sin(up);
    EXPECT_NEAR(std::abs(both[i] / alone[i]), 2.0 * std::abs(std::sin(phase)), 3e-4)
        << frequencies[i];
  }
  EXPECT_LT(std::abs(both[0] / alone[0]), 0.05);
}

// --- Reverberation ------------------------------------------------------------------------------

ReverbSettings hall() {
  return {.volume = 240.0, .surface = 260.0, .onset = 0.03, .speedOfSound = kSpeedOfSound};
}

/// Renders the tail alone: far away nothing else is heard, and a diffuse field is as loud there.
Samples tailOf(const ImpulseEvent& event, const SynthSettings& settings, std::size_t frames) {
  return heard(event, event.bodyPosition + Vec3(0.0, 0.0, 1e5), settings, frames);
}

double energyOf(std::span<const double> samples) {
  double sum = 0.0;
  for (const double sample : samples)
    sum += sample * sample;
  return sum / kRate;  // Pa^2 s
}

// Barron and Lee: the tail's energy is 4 pi c / V exp(-6 ln 10 t / T) per second for unit energy at
// 1 m; a dipole's, averaged over all directions, is a third of that on its axis.
TEST(SynthReverb, TheTailIsAsLoudAsADiffuseField) {
  SynthSettings settings = keen();
  settings.reverb = hall();
  SynthSettings open = keen();
  double decibels = 0.0;
  constexpr int kEvents = 6;
  for (int i = 0; i < kEvents; ++i) {
    const BallDrop drop{.radius = 0.01 + 0.002 * i, .time = 0.01};
    const auto clickOf = [&](const SynthSettings& with, double distance) {
      Synth synth = makeSynth(drop, {{"seat", {0, 0, distance}}}, with);
      ImpulseEvent event = drop.event();
      event.bodyVelocity = -event.impulse / (2.0 * drop.mass());  // its mean velocity is 0
      synth.schedule(event);
      return renderMono(synth, 48000);
    };
    // At 10 m the near field is small, and the level falls with the inverse of the distance.
    const double send = 100.0 * energyOf(clickOf(open, 10.0)) / 3.0;
    const Samples tail = clickOf(settings, 1e5);
    const double from = 0.1;
    const double to = 0.8;
    const double rate = 6.0 * std::numbers::ln10 / 1.0;
    const double wanted = send * 4.0 * pi * kSpeedOfSound / 240.0 *
                          (std::exp(-rate * from) - std::exp(-rate * to)) / rate;
    const auto begin = static_cast<std::size_t>((0.01 + from) * kRate);
    const auto end = static_cast<std::size_t>((0.01 + to) * kRate);
    decibels += 10.0 * std::log10(energyOf(std::span(tail).subspan(begin, end - begin)) / wanted);
  }
  EXPECT_NEAR(decibels / kEvents, 0.0, 1.0);
}

TEST(SynthReverb, BeginsNoEarlierThanItsOnset) {
  SynthSettings settings = keen();
  settings.reverb = hall();
  const Samples tail = tailOf(BallDrop{.time = 0.01}.event(), settings, 12000);
  const double peak = peakOf(tail);
  ASSERT_GT(peak, 0.0);
  // The tail begins half of the first mean free time early, as the lines have different lengths.
  const double mean = 4.0 * 240.0 / (260.0 * kSpeedOfSound);
  const auto first = static_cast<std::size_t>((0.01 + 0.03 - 0.5 * mean) * kRate);
  EXPECT_LT(peakOf(Samples(tail.begin(), tail.begin() + static_cast<std::ptrdiff_t>(first))),
            1e-6 * peak);
}

TEST(SynthReverb, OpenAirHasNone) {
  EXPECT_LT(peakOf(tailOf(BallDrop{.time = 0.01}.event(), keen(), 12000)), 1e-30);
}

TEST(SynthReverb, EndsInSilence) {
  SynthSettings settings = keen();
  settings.reverb = hall();
  Synth synth = makeSynth({}, {{"seat", {0, 0, 1}}}, settings);
  synth.schedule(BallDrop{.time = 0.01}.event());
  for (int second = 0; second < 6 && !synth.isSilent(); ++second)
    renderMono(synth, 48000);
  EXPECT_TRUE(synth.isSilent());
  EXPECT_EQ(peakOf(renderMono(synth, 4800)), 0.0);
}

TEST(SynthReverb, EveryChannelOfEveryListenerHasATailOfItsOwnLevel) {
  SynthSettings settings = keen();
  settings.reverb = hall();
  Listener pair{"pair", {0, 0, 1e5}};
  pair.format = ListenerFormat::spacedPair;
  Synth synth = makeSynth({}, {{"mono", {0, 0, 1e5}}, pair}, settings);
  synth.schedule(BallDrop{.time = 0.01}.event());
  const auto planes = renderPlanes(synth, 48000);
  ASSERT_EQ(planes.size(), 3u);
  const double mono = energyOf(planes[0]);
  ASSERT_GT(mono, 0.0);
  for (const Samples& plane : planes)
    EXPECT_NEAR(10.0 * std::log10(energyOf(plane) / mono), 0.0, 1.5);
  EXPECT_NE(planes[1], planes[2]);
}

// The power that a source gives to a room is that of its far field: the pressure that a dipole's
// near field adds at 1 m carries none.
TEST(SynthReverb, TheNearFieldDoesNotFeedIt) {
  SynthSettings settings = keen();
  settings.reverb = hall();
  SynthSettings compact = settings;
  compact.comparison.radiation = Radiation::compact;
  // The contact lasts some 20 ms, with nearly all of its sound below 50 Hz, where the ball is
  // compact.
  BallDrop soft{.radius = 0.05, .time = 0.05};
  soft.material.youngsModulus = 4e3;
  const double tau = makeSynth(soft, {{"seat", {}}}).contactDuration(soft.event());
  ASSERT_GT(tau, 0.01);
  const auto energy = [&](const SynthSettings& with) {
    Synth synth = makeSynth(soft, {{"seat", {0, 0, 1e5}}}, with);
    synth.schedule(soft.event());
    return energyOf(renderMono(synth, 48000));
  };
  EXPECT_NEAR(10.0 * std::log10(energy(settings) / energy(compact)), 0.0, 0.3);
}

// At a right angle to the impulse no sound reaches the listener directly, but the room is full of
// it.
TEST(SynthReverb, IsHeardWhereTheDirectSoundIsNot) {
  SynthSettings settings;
  settings.reverb = hall();
  const ImpulseEvent event = BallDrop{.speed = 3.0, .time = 0.01}.event();
  const Samples beside = heard(event, {1, 0, 0}, settings, 24000);
  EXPECT_GT(peakOf(beside), kHearingThreshold);
  EXPECT_GT(peakOf(tailOf(event, settings, 24000)), kHearingThreshold);
  // An event that is too faint even for the room is left out.
  Synth synth = makeSynth({}, {{"seat", {1, 0, 0}}}, settings);
  synth.schedule(BallDrop{.speed = 1e-6, .time = 0.01}.event());
  EXPECT_EQ(synth.counters().inaudible, 1u);
}

// --- Bad input ----------------------------------------------------------------------------------

TEST(SynthRoom, RefusesRoomsAndReverberationThatAreNot) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  const auto refusal = [](const SynthSettings& settings) {
    const auto synth = Synth::create(settings, {{"seat", {0, 0, 1}}});
    return synth ? std::string("accepted") : synth.error().message;
  };
  SynthSettings bad;
  bad.room.reflectors = {{Vec3(0, 0, kNaN), 0.0, {}}};
  EXPECT_THAT(refusal(bad), testing::HasSubstr("synth: room: reflector 0: its normal"));
  bad.room.reflectors = {{Vec3::UnitZ(), kNaN, {}}};
  EXPECT_THAT(refusal(bad), testing::HasSubstr("offset"));
  bad.room.reflectors = {{Vec3::UnitZ(), 0.0, absorbing({kNaN, 0, 0, 0, 0, 0, 0})}};
  EXPECT_THAT(refusal(bad), testing::HasSubstr("absorption"));
  bad.room.reflectors = {{Vec3::UnitZ(), 0.0, {}}};
  bad.room.order = 2;
  EXPECT_THAT(refusal(bad), testing::HasSubstr("needs a box"));
  for (double ReverbSettings::*field :
       {&ReverbSettings::volume, &ReverbSettings::surface, &ReverbSettings::onset,
        &ReverbSettings::gain, &ReverbSettings::speedOfSound, &ReverbSettings::silence}) {
    SynthSettings settings;
    settings.reverb = hall();
    (*settings.reverb).*field = kNaN;
    EXPECT_THAT(refusal(settings), testing::HasSubstr("synth: reverberation: "));
    EXPECT_THAT(refusal(settings), testing::HasSubstr("nan, must be"));
  }
  SynthSettings settings;
  settings.reverb = hall();
  settings.reverb->decayTimes[3] = kNaN;
  EXPECT_THAT(refusal(settings), testing::HasSubstr("decayTimes[3]"));
}

}  // namespace
}  // namespace carom
