#include "plugin/realtime/sound_engine.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "carom/audio/synth.h"
#include "tests/audio/ball_drop.h"
#include "tests/support/constants.h"
#include "tests/support/no_alloc_scope.h"
#include "tests/support/random.h"

namespace carom {

using namespace audio;
using namespace plugin;

namespace {

using namespace test;

using test::BallDrop;
using Planes = std::vector<std::vector<float>>;

constexpr double kStep = 1.0 / 240.0;
constexpr BodyId kBodies = 40;
constexpr BodyId kEngineFloor = 1000;

SoundBody ballOf(BodyId id) {
  return BallDrop{.radius = 0.003 * std::pow(1.05, id)}.ball();
}

ImpulseEvent hit(BodyId id, double time, double speed) {
  ImpulseEvent event = BallDrop{.radius = ballOf(id).radius, .speed = speed, .time = time}.event();
  event.body = id;
  event.other = kEngineFloor;
  return event;
}

template <class Layer>
void introduce(Layer& layer) {
  for (BodyId id = 0; id < kBodies; ++id)
    EXPECT_TRUE(layer.setBody(id, ballOf(id)));
  EXPECT_TRUE(layer.setBody(kEngineFloor, BallDrop{}.floor()));
}

SoundSettings settings(SoundClock clock) {
  SoundSettings wanted;
  wanted.clock = clock;
  wanted.listeners = {SoundSettings::defaultListener()};
  wanted.synth.lasting = LastingDetail::exact;  // as the offline renderer
  wanted.listeners.front().position = {0.3, 0.2, 1.0};
  wanted.budget.cpuShare = 1e6;  // independent of this machine's load
  return wanted;
}

std::unique_ptr<SoundEngine> makeEngine(const SoundSettings& wanted) {
  std::unique_ptr<SoundEngine> engine = *SoundEngine::create(wanted);
  introduce(engine->scheduler());
  return engine;
}

/// Random events, by steps.
std::vector<std::vector<ImpulseEvent>> steps(int count, double perSecond, std::uint64_t seed) {
  Random random(seed);
  std::vector<std::vector<ImpulseEvent>> all(static_cast<std::size_t>(count));
  for (int step = 0; step < count; ++step)
    while (random.chance(perSecond * kStep / (1.0 + perSecond * kStep)))
      all[static_cast<std::size_t>(step)].push_back(hit(static_cast<BodyId>(random.below(kBodies)),
                                                        kStep * (step + random.between(0.0, 1.0)),
                                                        random.logBetween(0.05, 3.0)));
  return all;
}

void render(SoundEngine& engine, Planes& planes, std::size_t frames) {
  std::vector<float*> to;
  for (std::vector<float>& plane : planes) {
    plane.resize(plane.size() + frames);
    to.push_back(plane.data() + plane.size() - frames);
  }
  engine.render(to, frames);
}

/// Renders all events offline, as much later as they were played.
Planes offline(const std::vector<std::vector<ImpulseEvent>>& all, const SoundSettings& wanted,
               std::int64_t shift, std::size_t frames) {
  Synth synth = *Synth::create(wanted.synth, wanted.listeners);
  introduce(synth);
  EXPECT_TRUE(synth.seek(-static_cast<double>(shift) / kRate));
  for (const auto& step : all)
    for (const ImpulseEvent& event : step)
      synth.schedule(event);
  return test::renderPlanes<float>(synth, frames);
}

// With two threads, blocks of every size and irregular steps every bit is the offline renderer's.
TEST(SoundEngine, TwoThreadsGiveTheBitsOfTheOfflineRenderer) {
  const SoundSettings wanted = settings(SoundClock::simulation);
  const auto all = steps(480, 2000.0, 5);  // two seconds, and 4000 collisions
  const auto engine = makeEngine(wanted);
  const auto frames = static_cast<std::size_t>(kRate * 1.9);
  Planes planes(2);
  std::atomic<std::int64_t> allowed{0};  // frames whose events have all been posted
  std::thread audio([&] {
    Random random(9);
    while (planes[0].size() < frames) {
      const auto block = std::min<std::size_t>(static_cast<std::size_t>(1 + random.below(700)),
                                               frames - planes[0].size());
      while (allowed.load(std::memory_order_acquire) <
             static_cast<std::int64_t>(planes[0].size() + block))
        std::this_thread::yield();
      render(*engine, planes, block);
    }
  });
  for (std::size_t step = 0; step < all.size(); ++step) {
    const double time = kStep * static_cast<double>(step + 1);
    while (static_cast<double>(engine->rendered()) < (time - 0.1) * kRate)
      std::this_thread::yield();  // or the queue would overflow
    for (const ImpulseEvent& event : all[step])
      engine->post(event);
    engine->advanceTo(time);
    allowed.store(static_cast<std::int64_t>((time - 0.02) * kRate), std::memory_order_release);
  }
  allowed.store(static_cast<std::int64_t>(frames), std::memory_order_release);
  audio.join();
  const SoundStatistics statistics = engine->statistics();
  EXPECT_EQ(statistics.late + statistics.queueFaults + statistics.stolen + statistics.overBudget,
            0U);
  EXPECT_GT(statistics.events, 3000U);
  EXPECT_TRUE(planes == offline(all, wanted, 0, frames));
}

// In real time the sound lags by the look-ahead, a whole number of samples.
TEST(SoundEngine, RealTimeGivesTheBitsOfTheOfflineRendererLater) {
  const SoundSettings wanted = settings(SoundClock::realTime);
  auto all = steps(480, 2000.0, 6);
  const auto engine = makeEngine(wanted);
  Planes planes(2);
  render(*engine, planes, 200);
  all[0].clear();
  std::int64_t shift = 0;
  for (std::size_t step = 0; step < all.size(); ++step) {
    for (const ImpulseEvent& event : all[step])
      engine->post(event);
    const double time = kStep * static_cast<double>(step + 1);
    engine->advanceTo(time);
    if (step == 0) shift = engine->timeline().shiftAt(time).whole;
    render(*engine, planes, 200);  // one step by the sound card's clock
  }
  EXPECT_NEAR(static_cast<double>(shift), kRate * wanted.latency, 3 * 200.0);
  EXPECT_EQ(engine->timeline().shiftAt(2.0).whole, shift);
  const SoundStatistics statistics = engine->statistics();
  EXPECT_EQ(statistics.late + statistics.stalls + statistics.jumps + statistics.queueFaults, 0U);
  EXPECT_TRUE(planes == offline(all, wanted, shift, planes[0].size()));
}

TEST(SoundEngine, RenderingAllocatesNothingWhateverComes) {
  SoundSettings wanted = settings(SoundClock::realTime);
  wanted.fullScale = 1.0;
  wanted.limiter.emplace();
  wanted.budget = {.cpuShare = 0.5, .voices = 64, .buses = 16, .longestContact = 0.01};
  const auto engine = makeEngine(wanted);
  Random random(3);
  std::array<float, std::size_t{2} * 512> block{};
  std::size_t allocations = 0;
  for (int step = 0; step < 500; ++step) {
    for (int i = random.chance(0.02) ? 3000 : random.below(20); i > 0; --i)
      engine->post(hit(static_cast<BodyId>(random.below(kBodies)),
                       kStep * (step + random.between(-5.0, 5.0)), random.logBetween(0.01, 10.0)));
    engine->advanceTo(kStep * (step + 1));
    engine->gain().setGain(random.between(0.0, 2.0));
    const test::NoAllocScope scope;
    engine->renderInterleaved(block.data(), static_cast<std::size_t>(random.below(512)));
    allocations += scope.allocations();
  }
  EXPECT_EQ(allocations, 0U);
  const SoundStatistics statistics = engine->statistics();
  EXPECT_GT(statistics.stolen, 0U);
  EXPECT_GT(statistics.noBus, 0U);
  EXPECT_GT(statistics.late, 0U);
}

// The loudest events of a burst cross the queue; their sound is that of the offline renderer.
TEST(SoundEngine, OfABurstTheLoudestCross) {
  SoundSettings wanted = settings(SoundClock::simulation);
  wanted.budget.voices = 100;
  const auto engine = makeEngine(wanted);
  std::vector<ImpulseEvent> burst;
  burst.reserve(20000);
  for (int i = 0; i < 20000; ++i)
    burst.push_back(hit(7, 0.1 + 1e-7 * i, 0.05 * std::pow(1.0003, i)));
  std::vector<ImpulseEvent> loudest(burst.end() - 100, burst.end());
  Random random(4);
  for (std::size_t i = burst.size(); i > 1; --i)
    std::swap(burst[i - 1], burst[static_cast<std::size_t>(random.below(static_cast<int>(i)))]);
  for (const ImpulseEvent& event : burst)
    engine->post(event);
  engine->advanceTo(0.12);
  Planes planes(2);
  for (int block = 0; block < 150; ++block)
    render(*engine, planes, 64);
  EXPECT_EQ(engine->statistics().stolen, 19900U);
  EXPECT_EQ(engine->statistics().queueFaults, 0U);
  EXPECT_TRUE(planes == offline({loudest}, wanted, 0, planes[0].size()));
}

TEST(SoundEngine, CountsWhatAQueueThatNobodyEmptiesCannotHold) {
  SoundSettings wanted = settings(SoundClock::simulation);
  wanted.budget.voices = 100;
  // The queue has no room for what rings and slides, which clicks could take.
  wanted.budget.ringingBodies = 1;
  wanted.budget.modes = 1;
  wanted.budget.slidingContacts = 0;
  const auto engine = makeEngine(wanted);
  for (int step = 0; step < 20; ++step) {
    for (int i = 0; i < 50; ++i)
      engine->post(hit(7, 0.01 * step, 1.0));
    engine->advanceTo(0.01 * step);
  }
  const SoundStatistics statistics = engine->statistics();
  EXPECT_GT(statistics.queueFaults, 0U);
  EXPECT_LT(statistics.queueFaults, 1000U);
  EXPECT_EQ(statistics.events, 1000U);
}

/// States of balls that slide along x without turning, each at its own speed, over one step.
std::vector<ContactState> slides(int step, BodyId balls) {
  std::vector<ContactState> all;
  for (BodyId id = 0; id < balls; ++id) {
    const double radius = ballOf(id).radius;
    const double speed = 0.5 + 0.02 * static_cast<double>(id);
    const Vec3 place(speed * kStep * step, 0.01 * static_cast<double>(id), 0.0);
    const Vec3 way = speed * kStep * Vec3::UnitX();
    ContactState state;
    state.time = kStep * step;
    state.duration = kStep;
    state.phase = step == 0 ? ContactPhase::begin : ContactPhase::during;
    state.body = id;
    state.other = kEngineFloor;
    state.normal = Vec3::UnitZ();
    state.position = place;
    state.normalLoad = 9.81 * ballOf(id).mass;
    state.appliedImpulse = kStep * state.normalLoad * (Vec3::UnitZ() - 0.2 * Vec3::UnitX());
    state.slipVelocity = speed * Vec3::UnitX();
    state.radius = radius;
    state.bodyPosition = place + radius * Vec3::UnitZ();
    state.bodyVelocity = state.slipVelocity;
    state.pathStart = state.pathEnd = -radius * Vec3::UnitZ();
    state.otherPathStart = place;
    state.otherPathEnd = place + way;
    all.push_back(state);
  }
  return all;
}

TEST(SoundEngine, SlidesHaveTheBitsOfTheOfflineRenderer) {
  SoundSettings wanted = settings(SoundClock::simulation);
  wanted.budget.slidingContacts = kBodies;
  const auto engine = makeEngine(wanted);
  Synth synth = *Synth::create(wanted.synth, wanted.listeners);
  introduce(synth);
  Planes planes(2);
  Random random(11);
  constexpr int kSteps = 120;
  for (int step = 0; step < kSteps; ++step) {
    for (const ContactState& state : slides(step, kBodies)) {
      engine->updateContact(state);
      synth.updateContact(state);
    }
    const double time = kStep * (step + 1);
    engine->advanceTo(time);
    while (static_cast<double>(planes[0].size()) < (time - 0.02) * kRate)
      render(*engine, planes, static_cast<std::size_t>(1 + random.below(100)));
  }
  EXPECT_TRUE(planes == test::renderPlanes<float>(synth, planes[0].size()));
  EXPECT_GT(*std::ranges::max_element(planes[0]), 1e-4F);
  const SoundStatistics statistics = engine->statistics();
  EXPECT_EQ(statistics.slides, synth.counters().slides);
  EXPECT_GT(statistics.slides, 100U * kBodies);
  EXPECT_EQ(statistics.slidesLeftOut + statistics.queueFaults + statistics.late, 0U);
}

// If more contacts slide than may be heard, the rest is left out and counted.
TEST(SoundEngine, OfTooManyThatSlideTheLoudestAreHeard) {
  SoundSettings wanted = settings(SoundClock::simulation);
  wanted.budget.slidingContacts = 1;
  wanted.synth.audibleThreshold = 0.0;
  const auto engine = makeEngine(wanted);
  for (const ContactState& state : slides(0, 10))
    engine->updateContact(state);
  engine->advanceTo(kStep);
  EXPECT_EQ(engine->statistics().slides, 1U);
  EXPECT_EQ(engine->statistics().slidesLeftOut, 9U);
}

TEST(SoundEngine, SlidesAllocateNothingWhileTheyAreRendered) {
  SoundSettings wanted = settings(SoundClock::realTime);
  wanted.budget = {.voices = 64, .buses = 64, .slidingContacts = 8};
  const auto engine = makeEngine(wanted);
  std::array<float, std::size_t{2} * 512> block{};
  std::size_t allocations = 0;
  Random random(5);
  for (int step = 0; step < 500; ++step) {
    for (const ContactState& state : slides(step, kBodies))
      if (random.chance(0.7)) engine->updateContact(state);
    engine->advanceTo(kStep * (step + 1));
    const test::NoAllocScope scope;
    engine->renderInterleaved(block.data(), static_cast<std::size_t>(random.below(512)));
    allocations += scope.allocations();
  }
  EXPECT_EQ(allocations, 0U);
  EXPECT_GT(engine->statistics().slidesLeftOut, 0U);
}

double largestStep(const std::vector<float>& samples) {
  double largest = 0.0;
  for (std::size_t i = 1; i < samples.size(); ++i)
    largest = std::max(largest, std::abs(static_cast<double>(samples[i] - samples[i - 1])));
  return largest;
}

// A click shows best in a tone, whose own steps are 2 pi f / rate.
TEST(OutputGain, ChangesWithoutAClick) {
  OutputGain gain(kRate);
  std::vector<float> samples;
  const double ownStep = 2.0 * 3.14159265 * 100.0 / kRate;
  for (int block = 0; block < 200; ++block) {
    if (block == 50) gain.setMuted(true);
    if (block == 100) gain.setMuted(false);
    if (block == 120) gain.setGain(0.1);
    if (block == 122) gain.setGain(0.7);  // before the ramp has ended
    std::array<float, 64> part{};
    for (std::size_t i = 0; i < part.size(); ++i)
      part[i] = static_cast<float>(std::sin(ownStep * static_cast<double>(samples.size() + i)));
    float* const channel = part.data();
    gain.apply(std::span(&channel, 1), part.size());
    samples.insert(samples.end(), part.begin(), part.end());
  }
  EXPECT_LT(largestStep(samples), ownStep + 1.1 / (OutputGain::kRamp * kRate));
  EXPECT_TRUE(std::all_of(samples.begin() + 5120, samples.begin() + 6400,
                          [](float p) { return p == 0.0F; }));
  for (std::size_t i = 9600; i < samples.size(); ++i)
    EXPECT_FLOAT_EQ(samples[i],
                    0.7F * static_cast<float>(std::sin(ownStep * static_cast<double>(i))));
}

TEST(OutputGain, IsClampedAndIgnoresWhatIsNoNumber) {
  OutputGain gain(kRate);
  std::vector<float> samples(4000, 1.0F);
  float* const channel = samples.data();
  gain.setGain(std::nan(""));
  gain.apply(std::span(&channel, 1), 10);
  EXPECT_EQ(samples[9], 1.0F);
  gain.setGain(1e30);
  gain.apply(std::span(&channel, 1), samples.size());
  EXPECT_EQ(samples.back(), OutputGain::kMost);
  gain.setGain(-5.0);
  std::ranges::fill(samples, 1.0F);
  gain.apply(std::span(&channel, 1), samples.size());
  EXPECT_EQ(samples.back(), 0.0F);
}

}  // namespace
}  // namespace carom
