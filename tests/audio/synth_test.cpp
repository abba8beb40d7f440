#include "carom/audio/synth.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "audio/model/acceleration_noise.h"
#include "tests/audio/ball_drop.h"
#include "tests/support/constants.h"
#include "tests/support/no_alloc_scope.h"

namespace carom {

using namespace audio;

namespace {

using namespace test;

using test::BallDrop;
using test::kFloor;
using test::makeSynth;
using test::NoAllocScope;
using test::peakOf;
using test::renderMono;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
const Listener kAbove{"above", {0.0, 0.0, 1.0}};

// --- The seed document's equations (1) to (10), written out again in long double ---------------

struct SeedCollision {
  long double radius1, mass1, young1, poisson1;
  long double young2, poisson2;              // plane: infinite radius and mass
  long double speed, restitution, time;      // m/s, 1, s
  long double listener[3], centre[3], n[3];  // m; n from the plane to the sphere
};

long double seedPressure(const SeedCollision& s, long double t, long double c) {
  const long double pi = std::numbers::pi_v<long double>;
  const long double modulus = 1.0L / ((1.0L - s.poisson1 * s.poisson1) / s.young1 +
                                      (1.0L - s.poisson2 * s.poisson2) / s.young2);  // (5)
  const long double tau =
      2.87L * powl(s.mass1 * s.mass1 / (s.radius1 * modulus * modulus * s.speed), 0.2L);  // (4)
  long double r = 0.0L;
  long double along = 0.0L;
  for (int axis = 0; axis < 3; ++axis) {
    const long double d = s.listener[axis] - s.centre[axis];
    r += d * d;
    along += d * s.n[axis];
  }
  r = sqrtl(r);
  const long double j = (1.0L + s.restitution) * s.mass1 * s.speed;
  const long double retarded = t - r / c - s.time - tau / 2.0L;
  const long double pulse = expl(-6.0L / (tau * tau) * retarded * retarded);  // (9)
  const long double slope = -12.0L / (tau * tau) * retarded * pulse;          // (10)
  const long double jerk = pi / (2.0L * s.mass1 * tau) * j * slope;           // (8)
  const long double a3 = s.radius1 * s.radius1 * s.radius1;
  return 1.20L * a3 * (along / r) / (2.0L * c * r) * jerk;  // (1)
}

struct SeedCase {
  double radius, speed, restitution, time;
  double speedOfSound;
  Vec3 centre, normal, listener;
};

class SeedEquations : public testing::TestWithParam<SeedCase> {};

TEST_P(SeedEquations, AreReproducedToDoublePrecision) {
  const SeedCase& given = GetParam();
  const Material& glass = *findMaterial("glass");
  const Material& plastic = *findMaterial("plastic");
  BallDrop drop{.material = glass,
                .radius = given.radius,
                .speed = given.speed,
                .time = given.time,
                .centre = given.centre};
  ImpulseEvent event = drop.event();
  event.normal = given.normal;
  event.impulse = (1.0 + given.restitution) * drop.mass() * given.speed * given.normal;

  SynthSettings settings;
  settings.medium.speedOfSound = given.speedOfSound;
  settings.comparison.pulse = PulseShape::courseGaussian;
  settings.comparison.sampling = Sampling::naive;
  settings.comparison.radiation = Radiation::compact;
  settings.doppler = false;
  settings.airAbsorption = false;
  Synth synth = makeSynth(drop, {{"seat", given.listener}}, settings);
  ASSERT_TRUE(synth.setBody(kFloor, {.material = plastic}));
  synth.schedule(event);
  const std::vector<double> rendered = renderMono(synth, 4800);

  SeedCollision seed{given.radius, drop.mass(),       62e9L,      0.20, 2.4e9L, 0.37,
                     given.speed,  given.restitution, given.time, {},   {},     {}};
  for (int axis = 0; axis < 3; ++axis) {
    seed.listener[axis] = given.listener[axis];
    seed.centre[axis] = given.centre[axis];
    seed.n[axis] = given.normal[axis];
  }
  const double peak = peakOf(rendered);
  ASSERT_GT(peak, 1e-4);
  for (std::size_t sample = 0; sample < rendered.size(); ++sample) {
    const long double t = static_cast<long double>(sample) / 48000.0L;
    const auto wanted = static_cast<double>(seedPressure(seed, t, given.speedOfSound));
    EXPECT_NEAR(rendered[sample], wanted, 1e-12 * peak) << sample;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Synth, SeedEquations,
    testing::Values(SeedCase{0.01, 1.0, 0.9, 0.02, 343.0, {0, 0, 0.01}, {0, 0, 1}, {0, 0, 1}},
                    SeedCase{0.02, 3.7, 0.5, 0.0371, 330.0, {1, -2, 0.5}, {0.6, 0, 0.8}, {0, 1, 2}},
                    SeedCase{
                        0.005, 0.2, 1.0, 0.0012345, 343.0, {0, 0, 0}, {0, 1, 0}, {0.3, -0.1, 0}},
                    SeedCase{0.05, 8.0, 0.0, 0.05, 343.0, {5, 0, 0}, {1, 0, 0}, {0, 3, 0}}));

// --- Signs, delays, superposition ---------------------------------------------------------------

std::size_t firstLoud(const std::vector<double>& samples) {
  const double level = 0.1 * peakOf(samples);
  const auto found = std::ranges::find_if(samples, [&](double s) { return std::abs(s) > level; });
  return static_cast<std::size_t>(found - samples.begin());
}

TEST(Synth, PushedTowardsTheListenerIsPositiveFirst) {
  const BallDrop drop{.time = 0.01};
  Synth above = makeSynth(drop, {{"", {0, 0, 1}}});
  Synth below = makeSynth(drop, {{"", {0, 0, -1}}});
  above.schedule(drop.event());
  below.schedule(drop.event());
  const std::vector<double> heardAbove = renderMono(above, 2400);
  const std::vector<double> heardBelow = renderMono(below, 2400);
  EXPECT_GT(heardAbove[firstLoud(heardAbove)], 0.0);
  EXPECT_LT(heardBelow[firstLoud(heardBelow)], 0.0);
}

/// Returns where the pulse passes through zero between its two lobes, in samples.
double middleOf(const std::vector<double>& samples) {
  const auto top = std::ranges::max_element(samples);
  auto next = top;
  while (*next > 0.0)
    ++next;
  const double before = *(next - 1);
  return static_cast<double>(next - samples.begin()) - 1.0 + before / (before - *next);
}

TEST(Synth, DelayIsThatOfTheWayThroughTheAirToAThousandthOfASample) {
  const Material& plastic = *findMaterial("plastic");
  const BallDrop drop{.material = plastic, .radius = 0.05, .time = 0.01};
  SynthSettings settings;
  settings.sampleRate = 192000.0;
  settings.comparison.radiation = Radiation::compact;
  settings.doppler = false;
  settings.airAbsorption = false;
  const double tau = makeSynth(drop, {kAbove}, settings).contactDuration(drop.event());
  for (const double distance : {0.3, 1.0, 1.7321, 3.14159}) {
    Synth synth = makeSynth(drop, {{"", {0, 0, distance}}}, settings);
    synth.schedule(drop.event());
    const double expected = (0.01 + 0.5 * tau + distance / 343.0) * settings.sampleRate;
    EXPECT_NEAR(middleOf(renderMono(synth, 9600)), expected, 1e-3) << distance;
  }
}

TEST(Synth, ClicksSuperpose) {
  const BallDrop first{.time = 0.0101};
  const BallDrop second{.speed = 0.3, .time = 0.01015, .centre = {0.2, 0.0, 0.1}};
  Synth alone = makeSynth(first, {kAbove});
  Synth other = makeSynth(first, {kAbove});
  Synth both = makeSynth(first, {kAbove});
  alone.schedule(first.event());
  other.schedule(second.event());
  both.schedule(first.event());
  both.schedule(second.event());
  const std::vector<double> a = renderMono(alone, 1200);
  const std::vector<double> b = renderMono(other, 1200);
  const std::vector<double> sum = renderMono(both, 1200);
  for (std::size_t sample = 0; sample < sum.size(); ++sample)
    EXPECT_NEAR(sum[sample], a[sample] + b[sample], 1e-12 * peakOf(sum));
}

TEST(Synth, EachListenerHasItsOwnChannel) {
  const BallDrop drop{.time = 0.01};
  const std::vector<Listener> seats = {
      {"left", {-1, 0, 1}}, {"aside", {1, 0, 0}}, {"far", {0, 0, 3}}};
  Synth synth = makeSynth(drop, seats);
  synth.schedule(drop.event());
  std::vector<std::vector<double>> planes(3, std::vector<double>(2400));
  std::vector<double*> channels = {planes[0].data(), planes[1].data(), planes[2].data()};
  synth.render<double>(channels, 2400);
  EXPECT_EQ(peakOf(planes[1]), 0.0);  // at a right angle to the impulse
  for (const std::size_t channel : {0u, 2u}) {
    Synth mono = makeSynth(drop, {seats[channel]});
    mono.schedule(drop.event());
    EXPECT_EQ(planes[channel], renderMono(mono, 2400));
  }
}

// --- Determinism --------------------------------------------------------------------------------

std::vector<ImpulseEvent> manyEvents(std::size_t count) {
  std::mt19937_64 random(7);
  const auto uniform = [&random] { return static_cast<double>(random() >> 11U) * 0x1.0p-53; };
  std::vector<ImpulseEvent> events;
  for (std::size_t index = 0; index < count; ++index) {
    const BallDrop drop{.speed = 0.01 + 3.0 * uniform(),
                        .time = 0.005 + 0.1 * uniform(),
                        .centre = {uniform(), uniform(), uniform()}};
    events.push_back(drop.event());
    events.back().impulse = Vec3(uniform() - 0.5, uniform() - 0.5, uniform() - 0.5) * 0.01;
  }
  return events;
}

constexpr std::size_t kFrames = 9000;
const std::vector<Listener> kSeats = {{"a", {0, 0, 2}}, {"b", {2, -1, 0}}, {"c", {0.5, 0.5, 0.5}}};

template <class Sample>
using Planes = std::vector<std::vector<Sample>>;

template <class Sample>
void renderBlock(Synth& synth, Planes<Sample>& planes, std::size_t begin, std::size_t frames) {
  std::vector<Sample*> channels;
  for (std::vector<Sample>& plane : planes)
    channels.push_back(plane.data() + begin);
  synth.render<Sample>(channels, frames);
}

template <class Sample>
Planes<Sample> renderInBlocks(const std::vector<ImpulseEvent>& events, std::size_t block) {
  Synth synth = makeSynth({}, kSeats);
  for (const ImpulseEvent& event : events)
    synth.schedule(event);
  Planes<Sample> planes(kSeats.size(), std::vector<Sample>(kFrames));
  for (std::size_t begin = 0; begin < kFrames; begin += block)
    renderBlock(synth, planes, begin, std::min(block, kFrames - begin));
  EXPECT_EQ(synth.pendingClicks(), 0u);
  return planes;
}

template <class Sample>
class SynthOf : public testing::Test {};
using Samples = testing::Types<float, double>;
TYPED_TEST_SUITE(SynthOf, Samples);

TYPED_TEST(SynthOf, BlockSizeDoesNotChangeABit) {
  const std::vector<ImpulseEvent> events = manyEvents(300);
  const Planes<TypeParam> whole = renderInBlocks<TypeParam>(events, kFrames);
  for (const std::size_t block : {1u, 7u, 64u, 255u, 4096u})
    EXPECT_TRUE(renderInBlocks<TypeParam>(events, block) == whole) << block;
}

TYPED_TEST(SynthOf, OrderOfSchedulingDoesNotChangeABit) {
  std::vector<ImpulseEvent> events = manyEvents(300);
  const Planes<TypeParam> whole = renderInBlocks<TypeParam>(events, 512);
  std::shuffle(events.begin(), events.end(), std::mt19937_64(3));
  EXPECT_TRUE(renderInBlocks<TypeParam>(events, 512) == whole);
  std::ranges::reverse(events);
  EXPECT_TRUE(renderInBlocks<TypeParam>(events, 512) == whole);
}

TEST(Synth, EventsHandedOverJustInTimeGiveTheSameBits) {
  std::vector<ImpulseEvent> events = manyEvents(300);
  const Planes<double> whole = renderInBlocks<double>(events, kFrames);
  std::ranges::sort(events, {}, &ImpulseEvent::time);
  Synth synth = makeSynth({}, kSeats);
  Planes<double> planes(kSeats.size(), std::vector<double>(kFrames));
  std::size_t next = 0;
  constexpr std::size_t kBlock = 90;
  for (std::size_t begin = 0; begin < kFrames; begin += kBlock) {
    const double horizon = synth.time() + kBlock / 48000.0 + synth.leadTime(300e-6);
    while (next < events.size() && events[next].time < horizon)
      synth.schedule(events[next++]);
    renderBlock(synth, planes, begin, kBlock);
  }
  EXPECT_EQ(synth.counters().late, 0u);
  EXPECT_TRUE(planes == whole);
}

TEST(Synth, FloatIsTheRoundedDouble) {
  const std::vector<ImpulseEvent> events = manyEvents(50);
  const Planes<float> single = renderInBlocks<float>(events, 512);
  const Planes<double> full = renderInBlocks<double>(events, 512);
  for (std::size_t sample = 0; sample < kFrames; ++sample)
    EXPECT_EQ(single[1][sample], static_cast<float>(full[1][sample]));
}

TEST(Synth, LateEventsSoundTheSameInAnyBlocks) {
  const std::vector<ImpulseEvent> events = manyEvents(60);
  Planes<double> planes[2];
  for (const std::size_t run : {0u, 1u}) {
    planes[run].assign(kSeats.size(), std::vector<double>(kFrames));
    Synth synth = makeSynth({}, kSeats);
    renderBlock(synth, planes[run], 0, 3000);
    renderBlock(synth, planes[run], 3000, 0);
    for (const ImpulseEvent& event : events) {
      synth.schedule(event);
      if (run == 1) renderBlock(synth, planes[run], 3000, 0);
    }
    EXPECT_GT(synth.counters().late, 10u);
    const std::size_t block = run == 0 ? 6000 : 50;
    for (std::size_t begin = 3000; begin < kFrames; begin += block)
      renderBlock(synth, planes[run], begin, block);
  }
  EXPECT_TRUE(planes[0] == planes[1]);
}

// --- Long clocks --------------------------------------------------------------------------------

std::vector<double> clickAt(double eventTime, double clock) {
  const BallDrop drop{.time = eventTime};
  Synth synth = makeSynth(drop, {kAbove});
  EXPECT_TRUE(synth.seek(clock));
  EXPECT_EQ(synth.time(), clock);
  synth.schedule(drop.event());
  EXPECT_EQ(synth.counters().late, 0u);
  return renderMono(synth, 9600);
}

TEST(Synth, ClickAfterADayHasTheSameShape) {
  constexpr double kDay = 86400.0;
  // The subtraction is exact, so both events fall on the same place between two samples.
  const double time = (kDay + 0.1) - kDay;
  const std::vector<double> early = clickAt(time, 0.0);
  const std::vector<double> late = clickAt(kDay + 0.1, kDay);
  const double peak = peakOf(early);
  ASSERT_GT(peak, 0.0);
  for (std::size_t sample = 0; sample < early.size(); ++sample)
    EXPECT_NEAR(late[sample], early[sample], 1e-12 * peak);
}

TEST(Synth, OnlyTheRoundingOfTheTimeItselfIsLostAfterADay) {
  constexpr double kDay = 86400.0;
  const std::vector<double> early = clickAt(0.1, 0.0);
  const std::vector<double> late = clickAt(kDay + 0.1, kDay);
  // The bound is half a unit in the last place of 86400 s, times the steepest slope (12 / tau^2)
  // over the peak.
  const BallDrop drop;
  const double tau = makeSynth(drop, {kAbove}).contactDuration(drop.event());
  const double bound = 0x1.0p-37 * 12.0 / tau / kPulsePeakSlope;
  EXPECT_LT(bound, 1e-6);
  for (std::size_t sample = 0; sample < early.size(); ++sample)
    EXPECT_NEAR(late[sample], early[sample], 1.01 * bound * peakOf(early));
}

TEST(Synth, SeekRefusesWhatTheClockCannotHold) {
  Synth synth = makeSynth({}, {kAbove});
  EXPECT_FALSE(synth.seek(1e13));
  EXPECT_FALSE(synth.seek(kNaN));
  EXPECT_EQ(synth.time(), 0.0);
}

TEST(Synth, SeekDropsWhatHasNotSounded) {
  const BallDrop drop{.time = 0.01};
  Synth synth = makeSynth(drop, {kAbove});
  synth.schedule(drop.event());
  EXPECT_EQ(synth.pendingClicks(), 1u);
  ASSERT_TRUE(synth.seek(0.0));
  EXPECT_EQ(synth.pendingClicks(), 0u);
  EXPECT_EQ(peakOf(renderMono(synth, 4800)), 0.0);
}

// --- Counters and bad input ---------------------------------------------------------------------

TEST(Synth, LateEventIsHeardFromTheClockOnAndCounted) {
  const BallDrop drop{.time = 0.02};
  SynthSettings compact;  // without a recursion nothing depends on samples long past
  compact.comparison.radiation = Radiation::compact;
  Synth onTime = makeSynth(drop, {kAbove}, compact);
  onTime.schedule(drop.event());
  const std::vector<double> whole = renderMono(onTime, 2400);

  const std::size_t middle = firstLoud(whole) + 2;
  Synth late = makeSynth(drop, {kAbove}, compact);
  renderMono(late, middle);
  late.schedule(drop.event());
  const std::vector<double> rest = renderMono(late, whole.size() - middle);
  EXPECT_EQ(late.counters().late, 1u);
  EXPECT_EQ(late.counters().events, 1u);
  for (std::size_t sample = 0; sample < rest.size(); ++sample)
    EXPECT_EQ(rest[sample], whole[middle + sample]);
}

TEST(Synth, EventThatIsOverIsLateAndTakesNoRoom) {
  const BallDrop drop{.time = 0.02};
  Synth synth = makeSynth(drop, {kAbove});
  renderMono(synth, 4800);
  synth.schedule(drop.event());
  EXPECT_EQ(synth.counters().late, 1u);
  EXPECT_EQ(synth.pendingClicks(), 0u);
}

TEST(Synth, EventHandedOverItsLeadTimeAheadIsNotLate) {
  BallDrop drop;
  Synth synth = makeSynth(drop, {{"touching", {0, 0, drop.radius}}});
  drop.time = synth.leadTime(synth.contactDuration(drop.event()));
  synth.schedule(drop.event());
  EXPECT_EQ(synth.counters().late, 0u);
}

TEST(Synth, InaudibleClicksAreLeftOutAndCounted) {
  const BallDrop drop{.speed = 1e-5, .time = 0.01};
  Synth synth = makeSynth(drop, {kAbove});
  synth.schedule(drop.event());
  EXPECT_EQ(synth.counters().events, 1u);
  EXPECT_EQ(synth.counters().inaudible, 1u);
  EXPECT_EQ(synth.pendingClicks(), 0u);

  SynthSettings all;
  all.audibleThreshold = 0.0;
  Synth keen = makeSynth(drop, {kAbove}, all);
  keen.schedule(drop.event());
  EXPECT_EQ(keen.counters().inaudible, 0u);
  const double peak = peakOf(renderMono(keen, 2400));
  EXPECT_GT(peak, 0.0);
  EXPECT_LT(peak, kHearingThreshold);
}

TEST(Synth, ClickAudibleAtOneListenerIsRenderedAtAll) {
  const BallDrop drop{.speed = 0.003, .time = 0.01};
  Synth synth = makeSynth(drop, {{"near", {0, 0, 0.1}}, {"far", {0, 0, 1000.0}}});
  synth.schedule(drop.event());
  EXPECT_EQ(synth.counters().inaudible, 0u);
  EXPECT_EQ(synth.pendingClicks(), 2u);
}

TEST(Synth, ContactsShorterThanFourSamplesAreCounted) {
  const BallDrop small{.radius = 0.001, .time = 0.01};
  const BallDrop large{.radius = 0.05, .time = 0.01};
  for (const BallDrop& drop : {small, large}) {
    SynthSettings naive;
    naive.comparison.sampling = Sampling::naive;
    Synth synth = makeSynth(drop, {kAbove}, naive);
    synth.schedule(drop.event());
    const bool isShort = synth.contactDuration(drop.event()) < 4.0 / 48000.0;
    EXPECT_EQ(synth.counters().undersampled, isShort ? 1u : 0u) << drop.radius;
    EXPECT_EQ(isShort, drop.radius < 0.01);
  }
}

TEST(Synth, ShareOfAnImmovableBodyIsSilent) {
  const BallDrop drop{.time = 0.01};
  Synth synth = makeSynth(drop, {kAbove});
  ImpulseEvent share = drop.event();
  std::swap(share.body, share.other);
  std::swap(share.radius, share.otherRadius);
  share.impulse = -share.impulse;
  synth.schedule(share);
  EXPECT_EQ(synth.counters().immovable, 1u);
  EXPECT_EQ(synth.counters().events, 0u);
  EXPECT_EQ(peakOf(renderMono(synth, 2400)), 0.0);
}

std::vector<ImpulseEvent> brokenEvents() {
  const ImpulseEvent good = BallDrop{.time = 0.01}.event();
  std::vector<ImpulseEvent> broken;
  const auto add = [&](auto change) {
    broken.push_back(good);
    change(broken.back());
  };
  add([](ImpulseEvent& e) { e.time = kNaN; });
  add([](ImpulseEvent& e) { e.time = kInfinity; });
  add([](ImpulseEvent& e) { e.time = 1e300; });
  add([](ImpulseEvent& e) { e.impulse.y() = kNaN; });
  add([](ImpulseEvent& e) { e.impulse.z() = kInfinity; });
  add([](ImpulseEvent& e) {
    e.impulse.z() = 1e308;
    e.impulse.x() = 1e308;
  });
  add([](ImpulseEvent& e) { e.position.x() = kNaN; });
  add([](ImpulseEvent& e) { e.normal.x() = kNaN; });
  add([](ImpulseEvent& e) { e.bodyPosition.x() = kNaN; });
  add([](ImpulseEvent& e) { e.bodyPosition.x() = 1e300; });
  add([](ImpulseEvent& e) { e.bodyOrientation.w() = kNaN; });
  add([](ImpulseEvent& e) { e.bodyVelocity.x() = kNaN; });
  add([](ImpulseEvent& e) { e.bodyAngularVelocity.x() = kInfinity; });
  add([](ImpulseEvent& e) {
    e.hasOtherPose = true;
    e.otherPosition.x() = kNaN;
  });
  add([](ImpulseEvent& e) {
    e.hasOtherPose = true;
    e.otherOrientation.w() = 1e20;
  });
  add([](ImpulseEvent& e) { e.approachSpeed = kNaN; });
  add([](ImpulseEvent& e) { e.approachSpeed = 0.0; });
  add([](ImpulseEvent& e) { e.approachSpeed = -1.0; });
  add([](ImpulseEvent& e) { e.effectiveMass = kInfinity; });
  add([](ImpulseEvent& e) { e.effectiveMass = 0.0; });
  add([](ImpulseEvent& e) { e.radius = kNaN; });
  add([](ImpulseEvent& e) { e.radius = -0.01; });
  add([](ImpulseEvent& e) { e.otherRadius = kNaN; });
  add([](ImpulseEvent& e) { e.body = 77; });
  add([](ImpulseEvent& e) { e.other = 77; });
  return broken;
}

// A sharp or flat place touches as a ball of the edge radius would.
TEST(Synth, EdgesAndFlatFacesAreBluntedToTheEdgeRadius) {
  Synth synth = makeSynth({}, {kAbove});
  const SoundBody blunt;  // has the default edge radius
  ImpulseEvent rounded = BallDrop{.time = 0.01}.event();
  rounded.radius = blunt.edgeRadius;
  const double asBall = synth.contactDuration(rounded);
  ASSERT_GT(asBall, 0.0);
  ImpulseEvent corner = rounded;
  corner.radius = 0.0;
  EXPECT_DOUBLE_EQ(synth.contactDuration(corner), asBall);
  // Two equal balls have half the radius between them, and Hertz's duration is as R^(-1/5).
  ImpulseEvent faces = rounded;
  faces.radius = kInfinity;
  EXPECT_NEAR(synth.contactDuration(faces), asBall * std::pow(2.0, 0.2), 1e-9 * asBall);
}

TEST(Synth, TheAppliedImpulseSoundsWhereItIsChosenAndGiven) {
  ImpulseEvent event = BallDrop{.time = 0.01}.event();
  const auto peak = [&](ImpulseChoice choice) {
    SynthSettings settings;
    settings.impulse = choice;
    settings.doppler = false;  // a body that is hit less is faster during the contact
    Synth synth = makeSynth({}, {kAbove}, settings);
    synth.schedule(event);
    return peakOf(renderMono(synth, 4800));
  };
  const double physical = peak(ImpulseChoice::physical);
  EXPECT_DOUBLE_EQ(peak(ImpulseChoice::applied), physical) << "none is given";
  event.appliedImpulse = 0.25 * event.impulse;
  event.hasAppliedImpulse = true;
  EXPECT_DOUBLE_EQ(peak(ImpulseChoice::physical), physical);
  EXPECT_NEAR(peak(ImpulseChoice::applied), 0.25 * physical, 1e-6 * physical);
}

TEST(Synth, BrokenEventsAreRejectedAndNeverSound) {
  Synth synth = makeSynth({}, {kAbove});
  const std::vector<ImpulseEvent> broken = brokenEvents();
  for (std::size_t index = 0; index < broken.size(); ++index) {
    synth.schedule(broken[index]);
    const SynthCounters& counts = synth.counters();
    EXPECT_EQ(counts.rejected, index + 1) << "event " << index;
    EXPECT_EQ(counts.rejectedNotFinite + counts.rejectedUnknownBody + counts.rejectedNoContact +
                  counts.rejectedTooLong + counts.rejectedTooFar,
              index + 1)
        << "event " << index << " has no reason, or two";
  }
  EXPECT_EQ(synth.counters().rejectedUnknownBody, 2u);
  EXPECT_EQ(synth.counters().events, 0u);
  EXPECT_EQ(peakOf(renderMono(synth, 4800)), 0.0);
}

TEST(Synth, ListenerInsideABodyHearsAFinitePressure) {
  const BallDrop drop{.time = 0.01};
  Synth synth = makeSynth(drop, {{"inside", {0, 0, 1e-9}}, {"centre", {0, 0, 0}}});
  synth.schedule(drop.event());
  const double inside = peakOf(renderMono(synth, 2400));
  Synth surface = makeSynth(drop, {{"surface", {0, 0, drop.radius}}});
  surface.schedule(drop.event());
  EXPECT_DOUBLE_EQ(inside, peakOf(renderMono(surface, 2400)));
}

TEST(Synth, RefusesSettingsOutOfRange) {
  const auto refused = [](const SynthSettings& settings, std::vector<Listener> seats) {
    return !Synth::create(settings, std::move(seats));
  };
  SynthSettings settings;
  EXPECT_FALSE(refused(settings, {kAbove}));
  EXPECT_TRUE(refused(settings, {}));
  EXPECT_TRUE(refused(settings, {{"lost", {0, kNaN, 0}}}));
  for (const double rate : {0.0, 7999.0, 192001.0, kNaN, kInfinity}) {
    SynthSettings changed;
    changed.sampleRate = rate;
    EXPECT_TRUE(refused(changed, {kAbove})) << rate;
  }
  for (const double value : {0.0, -1.0, kNaN, kInfinity}) {
    SynthSettings changed;
    changed.medium.density = value;
    EXPECT_TRUE(refused(changed, {kAbove})) << value;
    changed = {};
    changed.medium.speedOfSound = value;
    EXPECT_TRUE(refused(changed, {kAbove})) << value;
  }
  settings.audibleThreshold = kNaN;
  EXPECT_TRUE(refused(settings, {kAbove}));
  settings = {};
  const auto synth = Synth::create(settings, {{"lost", {0, kNaN, 0}}});
  EXPECT_NE(synth.error().message.find("'lost'"), std::string::npos);
}

TEST(Synth, RefusesBodiesOutOfRange) {
  Synth synth = makeSynth({}, {kAbove});
  const SoundBody good = BallDrop{}.ball();
  EXPECT_TRUE(synth.setBody(9, good));
  const auto refused = [&](auto change) {
    SoundBody body = good;
    change(body);
    return !synth.setBody(9, body);
  };
  EXPECT_TRUE(refused([](SoundBody& b) { b.mass = 0.0; }));
  EXPECT_TRUE(refused([](SoundBody& b) { b.mass = kNaN; }));
  EXPECT_TRUE(refused([](SoundBody& b) { b.radius = 0.0; }));
  EXPECT_TRUE(refused([](SoundBody& b) { b.radius = kInfinity; }));
  EXPECT_TRUE(refused([](SoundBody& b) { b.material.density = 0.0; }));
  EXPECT_TRUE(refused([](SoundBody& b) { b.material.youngsModulus = -1.0; }));
  EXPECT_TRUE(refused([](SoundBody& b) { b.material.poissonsRatio = 0.5; }));
  EXPECT_TRUE(refused([](SoundBody& b) { b.material.restitution = 1.1; }));
  EXPECT_FALSE(refused([](SoundBody& b) {
    b.mass = kInfinity;
    b.radius = 0.0;
  }));
}

// --- The real-time promise ----------------------------------------------------------------------

TEST(Synth, RenderDoesNotAllocate) {
  Synth synth = makeSynth({}, kSeats);
  for (const ImpulseEvent& event : manyEvents(500))
    synth.schedule(event);
  std::vector<float> planes[3];
  for (std::vector<float>& plane : planes)
    plane.resize(512);
  float* const channels[3] = {planes[0].data(), planes[1].data(), planes[2].data()};
  const NoAllocScope scope;
  for (int block = 0; block < 20; ++block)
    synth.render<float>(channels, 512);
  EXPECT_EQ(scope.allocations(), 0u);
}

TEST(NoAllocScope, SeesAnAllocation) {
  const NoAllocScope scope;
  void* const memory = ::operator new(100);  // a compiler may leave out a new-expression
  EXPECT_EQ(scope.allocations(), 1u);
  ::operator delete(memory);
}

TEST(Synth, ForgetsWhatHasSounded) {
  BallDrop drop;
  Synth synth = makeSynth(drop, {kAbove});
  for (int second = 0; second < 20; ++second) {
    for (int click = 0; click < 50; ++click) {
      drop.time = second + 0.01 + 0.015 * click;
      synth.schedule(drop.event());
    }
    renderMono(synth, 48000);
    EXPECT_EQ(synth.pendingClicks(), 0u);
  }
  EXPECT_EQ(synth.counters().events, 1000u);
  EXPECT_EQ(synth.counters().late, 0u);
}

TEST(Synth, RenderOfNoFramesChangesNothing) {
  const BallDrop drop{.time = 0.01};
  Synth synth = makeSynth(drop, {kAbove});
  synth.schedule(drop.event());
  double untouched = 42.0;
  double* const channels[] = {&untouched};
  synth.render<double>(channels, 0);
  EXPECT_EQ(untouched, 42.0);
  EXPECT_EQ(synth.time(), 0.0);
  EXPECT_EQ(synth.pendingClicks(), 1u);
}

TEST(Synth, RenderOverwritesWhatWasThere) {
  Synth synth = makeSynth({}, {kAbove});
  std::vector<double> samples(1000, 5.0);
  double* const channels[] = {samples.data()};
  synth.render<double>(channels, samples.size());
  EXPECT_EQ(peakOf(samples), 0.0);
  EXPECT_EQ(synth.time(), 1000.0 / 48000.0);
}

}  // namespace
}  // namespace carom
