// What clicks cost: the kernel that adds one to a buffer, and the whole way from an event in to
// samples out, one listener, 48 kHz.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "audio/acceleration_noise.h"
#include "audio/synth.h"
#include "tests/bench/figures.h"

namespace carom::bench {
namespace {

constexpr double kRate = 48000.0;
constexpr std::size_t kFrames = 4096;  // fits the first cache in float
constexpr std::size_t kClicks = 1024;
constexpr double kNaiveReach = 1.6;  // contact durations on either side: S is 2e-7 there

/// Clicks of one duration at random places in a buffer of kFrames.
std::vector<Click> makeClicks(double tau) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> place(0.1, 0.9);
  std::vector<Click> clicks(kClicks);
  for (Click& click : clicks)
    click = {.time = place(random) * kFrames / kRate,
             .delay = 0.0,
             .duration = tau,
             .amplitude = place(random)};
  return clicks;
}

void addClicks(benchmark::State& state, double tau) {
  std::vector<SampledClick> clicks;
  for (const Click& click : makeClicks(tau))
    clicks.push_back(sampleClick(click, kRate, 0));
  std::vector<double> pressure(kFrames, 0.0);
  for ([[maybe_unused]] const auto iteration : state) {
    for (const SampledClick& click : clicks)
      addClick(click, 0, pressure);
    benchmark::DoNotOptimize(pressure.data());
    benchmark::ClobberMemory();
  }
  reportRate(state, kClicks);
}

/// The obvious loop: one exponential per sample, added to a float buffer.
void addNaively(const Click& click, std::span<float> pressure) {
  const double centre = (click.time + 0.5 * click.duration) * kRate;
  const double reach = kNaiveReach * click.duration * kRate;
  const auto begin = static_cast<std::size_t>(std::ceil(centre - reach));
  const auto end = static_cast<std::size_t>(std::floor(centre + reach)) + 1;
  for (std::size_t sample = begin; sample < end; ++sample) {
    const double u = (static_cast<double>(sample) - centre) / (click.duration * kRate);
    pressure[sample] += static_cast<float>(click.amplitude * -12.0 * u * std::exp(-6.0 * u * u));
  }
}

void addClicksNaively(benchmark::State& state, double tau) {
  const std::vector<Click> clicks = makeClicks(tau);
  std::vector<float> pressure(kFrames, 0.0F);
  for ([[maybe_unused]] const auto iteration : state) {
    for (const Click& click : clicks)
      addNaively(click, pressure);
    benchmark::DoNotOptimize(pressure.data());
    benchmark::ClobberMemory();
  }
  reportRate(state, kClicks);
}

void addKernelFigure(Figures& figures, double tau, double bar) {
  char name[64];
  std::snprintf(name, sizeof name, "kernel, tau %.0f us", tau * 1e6);
  figures.add({.name = name,
               .unit = "M clicks/s",
               .subject = [tau](benchmark::State& state) { addClicks(state, tau); },
               .yardstickName = "std::exp loop cut at 1.6 tau",
               .yardstick = [tau](benchmark::State& state) { addClicksNaively(state, tau); },
               .bar = Bar{Bar::Of::value, bar},
               .sense = Sense::higherIsBetter,
               .scale = 1e-6});
}

// --- From an event in to samples out -----------------------------------------------------------

constexpr BodyId kBall = 1;
constexpr BodyId kFloor = 2;
constexpr double kRadius = 0.005;  // m, of steel: tau is about 60 us
constexpr std::size_t kBlock = 512;

SoundBody steelBall() {
  const Material& steel = *findMaterial("steel");
  const double volume = 4.0 / 3.0 * std::numbers::pi * kRadius * kRadius * kRadius;
  return {.material = steel, .mass = volume * steel.density, .radius = kRadius};
}

/// A thousand impacts in a tenth of a second, in the order of time.
std::vector<ImpulseEvent> makeEvents() {
  const SoundBody ball = steelBall();
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::vector<ImpulseEvent> events(kClicks);
  for (ImpulseEvent& event : events) {
    event.time = 0.01 + 0.1 * unit(random);
    event.body = kBall;
    event.other = kFloor;
    event.approachSpeed = 0.1 + unit(random);
    event.effectiveMass = ball.mass;
    event.impulse = Vec3(0.0, 0.0, 1.9 * ball.mass * event.approachSpeed);
    event.radius = kRadius;
    event.bodyPosition = Vec3(unit(random), unit(random), kRadius);
  }
  std::ranges::sort(events, {}, &ImpulseEvent::time);
  return events;
}

Synth makeSynth() {
  auto synth = Synth::create({}, {{"seat", {0.0, 0.0, 1.5}}});
  if (!synth || !synth->setBody(kBall, steelBall()) ||
      !synth->setBody(kFloor, {.material = *findMaterial("steel")}))
    std::abort();
  return *std::move(synth);
}

void scheduleAndRender(benchmark::State& state) {
  const std::vector<ImpulseEvent> events = makeEvents();
  Synth synth = makeSynth();
  std::vector<float> samples(kBlock);
  float* const channels[] = {samples.data()};
  for ([[maybe_unused]] const auto iteration : state) {
    if (!synth.seek(0.0)) std::abort();
    for (const ImpulseEvent& event : events)
      synth.schedule(event);
    while (synth.pendingClicks() > 0)
      synth.render<float>(channels, kBlock);
    benchmark::DoNotOptimize(samples.data());
  }
  reportRate(state, static_cast<double>(events.size()));
}

/// The hand-out's equations straight through, without a queue: duration, geometry, exponentials.
void soundNaively(const ImpulseEvent& event, const SoundBody& ball, std::span<float> pressure) {
  const Vec3 towards = Vec3(0.0, 0.0, 1.5) - event.bodyPosition;
  const double r = towards.norm();
  const double modulus = contactModulus(ball.material, ball.material);
  const double tau =
      2.87 *
      std::pow(ball.mass * ball.mass / (kRadius * modulus * modulus * event.approachSpeed), 0.2);
  const double jerk = std::numbers::pi * event.impulse.norm() / (2.0 * ball.mass * tau * tau);
  const double cosine = event.impulse.dot(towards) / (event.impulse.norm() * r);
  const double radiated = 1.2 * kRadius * kRadius * kRadius * cosine / (2.0 * 343.0 * r);
  addNaively(
      {.time = event.time + r / 343.0, .delay = 0.0, .duration = tau, .amplitude = radiated * jerk},
      pressure);
}

void soundEventsNaively(benchmark::State& state) {
  const std::vector<ImpulseEvent> events = makeEvents();
  const SoundBody ball = steelBall();
  std::vector<float> pressure(static_cast<std::size_t>(0.13 * kRate), 0.0F);
  for ([[maybe_unused]] const auto iteration : state) {
    for (const ImpulseEvent& event : events)
      soundNaively(event, ball, pressure);
    benchmark::DoNotOptimize(pressure.data());
    benchmark::ClobberMemory();
  }
  reportRate(state, static_cast<double>(events.size()));
}

void addEndToEndFigure(Figures& figures) {
  figures.add({.name = "schedule and render",
               .unit = "M events/s",
               .subject = scheduleAndRender,
               .yardstickName = "equations 1 to 10 in one loop",
               .yardstick = soundEventsNaively,
               .bar = Bar{Bar::Of::value, 2.0},
               .sense = Sense::higherIsBetter,
               .scale = 1e-6});
}

}  // namespace
}  // namespace carom::bench

int main(int argc, char** argv) {
  carom::bench::Figures figures;
  carom::bench::addKernelFigure(figures, 10e-6, 10.0);
  carom::bench::addKernelFigure(figures, 50e-6, 10.0);
  carom::bench::addKernelFigure(figures, 200e-6, 8.0);
  carom::bench::addKernelFigure(figures, 1e-3, 3.0);
  carom::bench::addEndToEndFigure(figures);
  return figures.run(argc, argv);
}
