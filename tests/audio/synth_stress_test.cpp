#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <new>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "audio/model/hertz.h"
#include "audio/propagation/hrtf.h"
#include "tests/audio/ball_drop.h"
#include "tests/audio/ringing_box.h"
#include "tests/support/click_spectrum.h"
#include "tests/support/no_alloc_scope.h"
#include "tests/support/random.h"

// Tests everything at once: rooms, heads, many radii, moving listeners, reverberation. The output
// may depend on nothing but the events; rendering does not allocate; and the output is finite,
// whatever is hit.

namespace carom {

using namespace audio;

namespace {

using test::BallDrop;
using test::kBall;
using test::kFloor;
using test::makeSynth;
using test::NoAllocScope;
using test::peakOf;
using test::renderMono;
using test::renderPlanes;

using Samples = std::vector<double>;
template <class Sample>
using Planes = std::vector<std::vector<Sample>>;

constexpr BodyId kBalls = 200;  // with different radii; the floor comes after them

SoundBody ballOf(BodyId id) {
  return BallDrop{.radius = 0.002 * std::pow(1.02, id)}.ball();
}

std::shared_ptr<const HrtfSet> headAt(double sampleRate) {
  HrtfMeasurements measurements;
  measurements.sampleRate = sampleRate;
  for (int i = 0; i < 100; ++i) {
    const double y = 1.0 - (2.0 * i + 1.0) / 100.0;
    const double angle = 2.3999632297286533 * i;
    const double radius = std::sqrt(1.0 - y * y);
    HrtfMeasurement item;
    item.direction = Vec3(radius * std::sin(angle), y, radius * std::cos(angle));
    for (std::vector<float>& response : item.response) {
      response.assign(64, 0.0F);
      response[20] = 1.0F;
      response[30] = static_cast<float>(0.5 * y);
    }
    measurements.items.push_back(item);
  }
  return std::make_shared<const HrtfSet>(*HrtfSet::create(measurements, sampleRate));
}

std::vector<Listener> audience() {
  Listener head{"head", {1, 0.2, 1.5}};
  head.format = ListenerFormat::binaural;
  head.hrtf = headAt(48000.0);
  Listener pair{"pair", {-1, 0.5, 1.2}};
  pair.format = ListenerFormat::coincidentPair;
  return {head, {"mono", {0, 0, 2}}, pair};
}

SynthSettings roomWithEverything() {
  SynthSettings settings;
  settings.audibleThreshold = 0.0;
  settings.dissipative = true;
  const Absorption tiles{{0.05, 0.1, 0.1, 0.2, 0.3, 0.4, 0.4}};
  settings.room.reflectors = {{Vec3::UnitX(), -4.0, tiles}, {-Vec3::UnitX(), -5.0, tiles},
                              {Vec3::UnitY(), -3.0, tiles}, {-Vec3::UnitY(), -3.0, tiles},
                              {Vec3::UnitZ(), 0.0, {}},     {-Vec3::UnitZ(), -2.5, tiles}};
  settings.reverb = *reverbOfBox(settings.room, 343.0);
  return settings;
}

Synth busySynth(const SynthSettings& settings) {
  Synth synth = *Synth::create(settings, audience());
  for (BodyId id = 0; id < kBalls; ++id)
    EXPECT_TRUE(synth.setBody(id, ballOf(id)));
  EXPECT_TRUE(synth.setBody(kBalls, BallDrop{}.floor()));
  for (const double time : {-1.0, 1.0, 3.0})
    EXPECT_TRUE(synth.moveListener(1, {time, {0.3 * time, 0.1, 2.0}}));
  return synth;
}

ImpulseEvent hitOf(BodyId id, double time, Random& random) {
  const SoundBody ball = ballOf(id);
  BallDrop drop{.radius = ball.radius, .speed = random.logBetween(0.01, 5.0), .time = time};
  drop.centre = Vec3{random.between(-3, 3), random.between(-2, 2), random.between(0.3, 2)};
  ImpulseEvent event = drop.event();
  event.body = id;
  event.other = kBalls;
  event.impulse = 0.5 * event.impulse.norm() * random.between(1.0, 2.0) * random.direction();
  return event;
}

/// Bursts of events, of other radii each time, between which everything falls silent.
std::vector<ImpulseEvent> bursts() {
  Random random(11);
  std::vector<ImpulseEvent> events;
  for (int burst = 0; burst < 4; ++burst)
    for (int i = 0; i < 60; ++i) {
      const auto id = static_cast<BodyId>(random.below(static_cast<int>(kBalls)));
      events.push_back(hitOf(id, 0.02 + 0.12 * burst + random.between(0.0, 0.03), random));
    }
  return events;
}

constexpr std::size_t kStressFrames = 26000;

template <class Sample>
void renderInto(Synth& synth, Planes<Sample>& planes, std::size_t frames) {
  const Planes<Sample> part = renderPlanes<Sample>(synth, frames);
  for (std::size_t channel = 0; channel < part.size(); ++channel)
    planes[channel].insert(planes[channel].end(), part[channel].begin(), part[channel].end());
}

template <class Sample>
Planes<Sample> renderAll(const std::vector<ImpulseEvent>& events, std::size_t block) {
  Synth synth = busySynth(roomWithEverything());
  for (const ImpulseEvent& event : events)
    synth.schedule(event);
  Planes<Sample> planes(synth.channelCount());
  for (std::size_t begin = 0; begin < kStressFrames; begin += block)
    renderInto(synth, planes, std::min(block, kStressFrames - begin));
  EXPECT_EQ(synth.pendingClicks(), 0u);
  return planes;
}

/// Schedules each event only when its sound is about to begin, so that buses are made and used
/// again.
template <class Sample>
Planes<Sample> renderJustInTime(std::vector<ImpulseEvent> events, std::size_t block) {
  std::ranges::sort(events, {}, &ImpulseEvent::time);
  Synth synth = busySynth(roomWithEverything());
  Planes<Sample> planes(synth.channelCount());
  std::size_t next = 0;
  for (std::size_t begin = 0; begin < kStressFrames; begin += block) {
    const double horizon =
        synth.time() + static_cast<double>(block) / 48000.0 + synth.leadTime(1e-3);
    while (next < events.size() && events[next].time < horizon)
      synth.schedule(events[next++]);
    renderInto(synth, planes, std::min(block, kStressFrames - begin));
  }
  EXPECT_EQ(synth.counters().late, 0u);
  return planes;
}

template <class Sample>
class SynthStress : public testing::Test {};
using SampleTypes = testing::Types<float, double>;
TYPED_TEST_SUITE(SynthStress, SampleTypes);

TYPED_TEST(SynthStress, NothingButTheEventsDecidesTheBits) {
  std::vector<ImpulseEvent> events = bursts();
  const Planes<TypeParam> whole = renderAll<TypeParam>(events, kStressFrames);
  for (const auto& plane : whole)
    ASSERT_TRUE(std::ranges::any_of(plane, [](TypeParam sample) { return sample != 0; }));
  EXPECT_TRUE(renderJustInTime<TypeParam>(events, 97) == whole);
  std::shuffle(events.begin(), events.end(), std::mt19937_64(3));
  EXPECT_TRUE(renderAll<TypeParam>(events, 331) == whole);
  EXPECT_TRUE(renderJustInTime<TypeParam>(events, 2048) == whole);
}

TEST(SynthUnderStress, FloatIsTheRoundedDouble) {
  const Planes<float> single = renderAll<float>(bursts(), 512);
  const Planes<double> full = renderAll<double>(bursts(), 512);
  for (std::size_t channel = 0; channel < full.size(); ++channel)
    for (std::size_t sample = 0; sample < kStressFrames; ++sample)
      ASSERT_EQ(single[channel][sample], static_cast<float>(full[channel][sample]));
}

TEST(SynthUnderStress, LateEventsSoundTheSameInAnyBlocks) {
  const std::vector<ImpulseEvent> events = bursts();
  Planes<double> takes[2];
  for (const std::size_t run : {0u, 1u}) {
    Synth synth = busySynth(roomWithEverything());
    takes[run].resize(synth.channelCount());
    for (std::size_t part = 0; part < 5; ++part) {
      for (std::size_t index = part * 48; index < (part + 1) * 48; ++index)
        synth.schedule(events[index]);
      const std::size_t block = run == 0 ? 5000 : 41;
      for (std::size_t done = 0; done < 5000; done += block)
        renderInto(synth, takes[run], std::min(block, 5000 - done));
    }
    EXPECT_GT(synth.counters().late, 10u);
  }
  EXPECT_TRUE(takes[0] == takes[1]);
}

// The late event is over for the microphone beside the ball, but in time for the head far away.
TEST(SynthUnderStress, ALateEventIsWholeForWhomItIsNotLate) {
  Listener head{"head", {10, 2, 3}};
  head.format = ListenerFormat::binaural;
  head.hrtf = headAt(48000.0);
  const BallDrop drop{.time = 0.01};
  Planes<double> heard[2];
  for (const bool late : {false, true}) {
    Synth synth = makeSynth(drop, {{"beside", {0, 0, 0.1}}, head});
    if (!late) synth.schedule(drop.event());
    renderPlanes(synth, 1200);  // the head hears it after 0.041 s
    if (late) synth.schedule(drop.event());
    heard[late ? 1 : 0] = renderPlanes(synth, 2400);
  }
  for (const std::size_t ear : {1u, 2u}) {
    ASSERT_GT(peakOf(heard[0][ear]), 0.0);
    EXPECT_TRUE(heard[0][ear] == heard[1][ear]);
  }
  EXPECT_EQ(peakOf(heard[1][0]), 0.0);
}

TEST(SynthUnderStress, ASynthMovedWhileClicksArePendingGoesOn) {
  const std::vector<ImpulseEvent> events = bursts();
  Planes<double> wanted;
  {
    Synth synth = busySynth(roomWithEverything());
    for (const ImpulseEvent& event : events)
      synth.schedule(event);
    wanted = renderPlanes(synth, 8000);
  }
  Synth first = busySynth(roomWithEverything());
  for (const ImpulseEvent& event : events)
    first.schedule(event);
  Planes<double> made = renderPlanes(first, 1500);
  Synth second(std::move(first));
  renderInto(second, made, 2500);
  Synth third = busySynth({});
  third.schedule(events.front());
  third = std::move(second);
  renderInto(third, made, 4000);
  EXPECT_TRUE(made == wanted);
}

TEST(SynthUnderStress, SeekLeavesNothingBehind) {
  const std::vector<ImpulseEvent> events = bursts();
  SynthSettings settings = roomWithEverything();
  const auto play = [&](Synth& synth) {
    for (const double time : {-1.0, 1.0})
      EXPECT_TRUE(synth.moveListener(1, {time, {0.3 * time, 0.1, 2.0}}));
    for (const ImpulseEvent& event : events)
      synth.schedule(event);
    return renderPlanes(synth, 7000);
  };
  Synth synth = busySynth(settings);
  ASSERT_TRUE(synth.seek(0.0));
  const Planes<double> first = play(synth);
  ASSERT_FALSE(synth.isSilent());
  ASSERT_TRUE(synth.seek(0.0));
  EXPECT_TRUE(synth.isSilent());
  EXPECT_TRUE(play(synth) == first);
}

// --- Memory --------------------------------------------------------------------------------------

TEST(SynthUnderStress, RenderDoesNotAllocate) {
  Synth synth = busySynth(roomWithEverything());
  for (const ImpulseEvent& event : bursts())
    synth.schedule(event);
  Planes<float> planes(synth.channelCount(), std::vector<float>(480));
  std::vector<float*> channels;
  for (std::vector<float>& plane : planes)
    channels.push_back(plane.data());
  const NoAllocScope scope;
  for (int block = 0; block < 60; ++block)
    synth.render<float>(channels, 480);
  EXPECT_EQ(scope.allocations(), 0u);
  EXPECT_EQ(synth.pendingClicks(), 0u);
}

TEST(SynthUnderStress, After1e5EventsNothingIsAllocatedAnyMore) {
  SynthSettings settings;
  settings.audibleThreshold = 0.0;
  Synth synth = *Synth::create(settings, {{"seat", {0, 0, 1}}});
  constexpr BodyId kKinds = 8;
  for (BodyId id = 0; id < kKinds; ++id)
    ASSERT_TRUE(synth.setBody(id, ballOf(10 * id)));
  ASSERT_TRUE(synth.setBody(kBalls, BallDrop{}.floor()));
  Samples plane(240);
  double* const channels[] = {plane.data()};
  std::size_t events = 0;
  std::size_t allocations = 0;
  while (events < 100000) {
    const NoAllocScope scope;
    for (BodyId i = 0; i < 100; ++i, ++events) {
      const BodyId id = i % kKinds;
      ImpulseEvent event;
      event.time = synth.time() + 0.001 + 1e-5 * i;
      event.body = id;
      event.other = kBalls;
      event.impulse = Vec3(0, 0, 1e-3);
      event.approachSpeed = 1.0;
      event.effectiveMass = 1e-3;
      event.radius = 0.003;
      synth.schedule(event);
    }
    synth.render<double>(channels, plane.size());
    if (events > 2000) allocations += scope.allocations();
    ASSERT_LT(synth.pendingClicks(), 200u);
  }
  EXPECT_EQ(allocations, 0u);
  renderMono(synth, 9600);
  EXPECT_EQ(synth.pendingClicks(), 0u);
  EXPECT_TRUE(synth.isSilent());
}

// --- Impulse and energy --------------------------------------------------------------------------

// At low frequencies, far away, the second integral of a click's pressure is the impulse's,
// whatever the pulse and its place between two samples.
TEST(SynthImpulse, OfEveryPulseArrivesWholeAtAnyPhase) {
  for (const PulseShape pulse : {PulseShape::hertz, PulseShape::halfSine, PulseShape::gaussian,
                                 PulseShape::mitchellNetravali, PulseShape::courseGaussian}) {
    // The hand-out's pulse has pi/2 sqrt(pi/6) of the impulse, each of the others all of it.
    const double whole = pulse == PulseShape::courseGaussian ? 1.13662 : 1.0;
    for (const double phase : {0.0, 0.3, 0.71}) {
      test::ClickCase click{.pulse = pulse, .duration = 60e-6, .distance = 500.0};
      click.time += phase / click.sampleRate;
      const double frequency = 40.0;
      const double omega = 2.0 * 3.141592653589793 * frequency;
      const auto made = test::spectrumOf(test::renderClick(click), click.sampleRate, {frequency});
      // P = rho0 a^3 / (2 c r) i w (j / m) for wavelengths much larger than the body; 500 m away
      // the near field is in quadrature and c / (w r) = 0.3 % of it.
      const double wanted = 1.2 * 1e-6 / (2.0 * 343.0 * 500.0) * omega * 2.0 * whole;
      EXPECT_NEAR(std::abs(made[0]) / wanted, 1.0, 2e-5) << static_cast<int>(pulse);
    }
  }
}

TEST(SynthImpulse, ContactsThatLoseEnergyLastLongerAndLean) {
  SynthSettings settings;
  settings.audibleThreshold = 0.0;
  settings.comparison.radiation = Radiation::compact;
  settings.doppler = false;
  settings.dissipative = true;
  // The ball is so soft that the contact lasts a thousand samples.
  BallDrop drop{.radius = 0.05, .time = 0.02};
  drop.material.youngsModulus = 1e5;
  double lastDuration = 0.0;
  double lastLean = 1.0;
  for (const double restitution : {1.0, 0.7, 0.4, 0.1}) {
    Synth synth = makeSynth(drop, {{"seat", {0, 0, 0.1}}}, settings);
    ImpulseEvent event = drop.event();
    event.impulse = (1.0 + restitution) * drop.mass() * drop.speed * Vec3::UnitZ();
    const double duration = synth.contactDuration(event);
    EXPECT_GT(duration, lastDuration);
    synth.schedule(event);
    const Samples heard = renderMono(synth, 24000);
    // The force is the running sum of its slope; its impulse, its extent and the place of its peak
    // are measured.
    Samples force;
    double sum = 0.0;
    for (const double sample : heard)
      force.push_back(sum += sample);
    const double top = peakOf(force);
    const auto peak = std::ranges::max_element(force) - force.begin();
    const auto loud = [&](double value) { return value > 1e-3 * top; };
    const auto begin = std::ranges::find_if(force, loud) - force.begin();
    const auto end = std::find_if(force.rbegin(), force.rend(), loud).base() - force.begin();
    const double extent = static_cast<double>(end - begin) / 48000.0;
    // A body that loses nearly all of its speed creeps out of the contact without force.
    if (restitution > 0.3) {
      EXPECT_NEAR(extent / duration, 1.0, 0.03) << restitution;
    }
    const double lean = static_cast<double>(peak - begin) / static_cast<double>(end - begin);
    if (restitution == 1.0) {
      EXPECT_NEAR(lean, 0.5, 0.005);
    }
    EXPECT_LT(lean, lastLean + 1e-9) << restitution;
    lastDuration = duration;
    lastLean = lean;
    double impulse = 0.0;
    for (const double value : force)
      impulse += value;
    const double wanted =
        1.2 * std::pow(0.05, 3) / (2.0 * 343.0 * 0.1) * (1.0 + restitution) * drop.speed;
    EXPECT_NEAR(impulse / (48000.0 * 48000.0) / wanted, 1.0, 1e-3) << restitution;
  }
  EXPECT_LT(lastLean, 0.45);
}

// --- Extremes ------------------------------------------------------------------------------------

bool isTidy(double sample) {
  return sample == 0.0 || std::isnormal(sample);
}

TEST(SynthExtremes, WhateverIsHitTheSoundIsFiniteAndCounted) {
  Random random(19);
  for (const double rate : {8000.0, 48000.0, 192000.0}) {
    SynthSettings settings;
    settings.sampleRate = rate;
    settings.audibleThreshold = 0.0;
    settings.dissipative = random.chance(0.5);
    Listener head{"head", {0, 0, 0}};
    head.format = ListenerFormat::binaural;
    head.hrtf = headAt(rate);
    settings.room.reflectors = {{Vec3::UnitZ(), -1.0, {{0.1, 0.1, 0.2, 0.3, 0.4, 0.5, 0.5}}}};
    for (int turn = 0; turn < 60; ++turn) {
      Synth synth = *Synth::create(settings, {head, {"far", random.direction() * 1e5}});
      const double radius = random.logBetween(1e-6, 1e4);
      Material material = *findMaterial("steel");
      const BallDrop drop{.material = material, .radius = radius};
      ASSERT_TRUE(synth.setBody(kFloor, drop.floor()));
      ImpulseEvent event = drop.event();
      event.time = 0.01;
      event.approachSpeed = random.logBetween(1e-9, 1e6);
      event.bodyPosition = random.direction() * random.logBetween(1e-9, 1e5);
      event.bodyVelocity = random.direction() * random.logBetween(1e-9, 1e6);
      event.impulse = random.direction() * drop.mass() * event.approachSpeed * 1.5;
      // The material is given the stiffness for contacts of 1 ns to 0.3 s (another test has one of
      // 10 s).
      const double wanted = random.logBetween(1e-9, 0.3);
      material.youngsModulus *= std::pow(hertzDuration(event, material, material) / wanted, 2.5);
      SoundBody ball = drop.ball();
      ball.material = material;
      if (!synth.setBody(kBall, ball)) continue;  // no such material
      if (!synth.setBody(kFloor, {.material = material})) continue;
      synth.schedule(event);
      const SynthCounters& counters = synth.counters();
      EXPECT_EQ(counters.events + counters.rejected, 1u);
      for (int block = 0; block < 8; ++block)
        for (const Samples& plane : renderPlanes(synth, 3000))
          ASSERT_TRUE(std::ranges::all_of(plane, isTidy)) << radius << " " << wanted;
    }
  }
}

TEST(SynthExtremes, AContactOf10SecondsIsRenderedAndOneOfADayIsRefused) {
  SynthSettings settings;
  settings.audibleThreshold = 0.0;
  for (const double duration : {10.0, 86400.0, 1e7}) {
    Synth synth = *Synth::create(settings, {{"seat", {0, 0, 3}}});
    BallDrop drop{.radius = 0.5, .time = 0.01};
    const double made = hertzDuration(drop.event(), drop.material, drop.material);
    drop.material.youngsModulus *= std::pow(made / duration, 2.5);
    ASSERT_TRUE(synth.setBody(kBall, drop.ball()));
    ASSERT_TRUE(synth.setBody(kFloor, drop.floor()));
    ImpulseEvent event = drop.event();
    event.bodyVelocity = -event.impulse / (2.0 * drop.mass());
    synth.schedule(event);
    EXPECT_EQ(synth.counters().rejected, duration > 10.0 ? 1u : 0u) << duration;
    const Samples heard = renderMono(synth, 48000);
    EXPECT_TRUE(std::ranges::all_of(heard, isTidy));
    EXPECT_EQ(peakOf(heard) > 0.0, duration == 10.0);
  }
}

/// Returns the sound of a slow impact on a ball of 10 m, whose force is scaled.
Samples slowImpact(double scale) {
  const BallDrop drop{.radius = 10.0, .speed = 1e-3, .time = 0.01};
  SynthSettings settings;
  settings.audibleThreshold = 0.0;
  Synth synth = makeSynth(drop, {{"seat", {0, 0, 20}}}, settings);
  ImpulseEvent event = drop.event();
  event.impulse *= scale;
  synth.schedule(event);
  return renderMono(synth, 24000);
}

// Sound is linear. The filter of a large body takes up little in a sample: what it holds was
// dropped, again and again, where it was below 1e-15 Pa at first.
TEST(SynthExtremes, TheQuietestSoundOfALargeBodyIsALoudOneScaled) {
  constexpr double kScale = 1e-9;
  const Samples loud = slowImpact(1.0);
  const Samples quiet = slowImpact(kScale);
  const double peak = peakOf(loud);
  ASSERT_GT(peak, 0.0);
  ASSERT_GT(kScale * peak, 1e-12);
  for (std::size_t sample = 0; sample < loud.size(); ++sample)
    ASSERT_NEAR(quiet[sample], kScale * loud[sample], 1e-15) << sample;
}

// One long contact must not make the lines of all others as long.
TEST(SynthExtremes, AnEventTakesRoomForItselfAlone) {
  SynthSettings settings;
  settings.audibleThreshold = 0.0;
  Synth synth = busySynth(settings);
  BallDrop soft{.radius = 0.5, .time = 0.01};
  soft.material.youngsModulus *=
      std::pow(hertzDuration(soft.event(), soft.material, soft.material) / 5.0, 2.5);
  ASSERT_TRUE(synth.setBody(900, soft.ball()));
  ASSERT_TRUE(synth.setBody(901, soft.floor()));
  ImpulseEvent event = soft.event();
  event.body = 900;
  event.other = 901;
  event.bodyVelocity = -event.impulse / (2.0 * soft.mass());
  synth.schedule(event);
  const NoAllocScope scope;
  Random random(4);
  for (BodyId id = 0; id < kBalls; ++id)
    synth.schedule(hitOf(id, 0.02, random));
  EXPECT_LT(scope.bytes(), std::size_t{40} << 20U);
}

TEST(SynthExtremes, OutputsDecayToZeroWithoutSubnormals) {
  for (const double threshold : {0.0, kHearingThreshold}) {
    SynthSettings settings = roomWithEverything();
    settings.audibleThreshold = threshold;
    Synth synth = busySynth(settings);
    Random random(8);
    for (int i = 0; i < 50; ++i) {
      ImpulseEvent event = hitOf(static_cast<BodyId>(4 * i), 0.02, random);
      event.impulse *= random.logBetween(1e-12, 1.0);
      synth.schedule(event);
    }
    // The run goes 300 dB down, which takes a room five times its T60.
    for (int block = 0; block < 1000 && !synth.isSilent(); ++block)
      for (const std::vector<float>& plane : renderPlanes<float>(synth, 960))
        ASSERT_TRUE(std::ranges::all_of(plane, [](float sample) {
          return sample == 0.0F || std::isnormal(sample);
        })) << block;
    EXPECT_TRUE(synth.isSilent());
  }
}

// --- Lack of memory
// --------------------------------------------------------------------------------

struct BoxUnderBall {
  BallDrop drop = test::dropOnBox(0.01);
  Synth synth = *Synth::create({}, {{"seat", {0.0, 0.0, 1.0}}});

  BoxUnderBall() {
    SoundBody box = drop.floor();
    box.modal = test::boxOf({{1000.0, 20.0, 1e-3}, {3000.0, 40.0, 1e-3}});
    EXPECT_TRUE(synth.setBody(kBall, drop.ball()));
    EXPECT_TRUE(synth.setBody(kFloor, box));
  }
  /// The box moves and is struck.
  void post(double now) {
    EXPECT_TRUE(synth.moveBody(kFloor, {now, {0.0, 0.0, 0.01}, Quat::Identity()}));
    synth.schedule(drop.event());
    synth.schedule(test::floorShare(drop));
  }
};

TEST(SynthStress, WhicheverAllocationFailsTheRestIsRendered) {
  BoxUnderBall whole;
  whole.post(0.0);
  const double loudest = peakOf(renderMono(whole.synth, 4800));
  ASSERT_GT(loudest, 0.0);
  std::size_t pieces = 0;
  for (bool hasFailed = true; hasFailed; ++pieces) {
    BoxUnderBall lacking;
    try {
      const test::FailingAllocation failing(pieces);
      lacking.post(0.0);
      hasFailed = failing.hasFailed();
    } catch (const std::bad_alloc&) {
      lacking.post(0.001);  // once more, with memory; part of it may be heard twice
    }
    const double peak = peakOf(renderMono(lacking.synth, 4800));
    EXPECT_GT(peak, 0.99 * loudest) << "after " << pieces << " pieces";
    EXPECT_LT(peak, 2.01 * loudest) << "after " << pieces << " pieces";
  }
  EXPECT_GT(pieces, 20u);
}

}  // namespace
}  // namespace carom
