// Cost of clicks: of the kernel that adds one to the samples, of the whole way from an event in to
// samples out, and of a dense scene, a room and the exact radiation beside the same without them.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <sys/resource.h>

#include "audio/dsp/spread_kernel.h"
#include "audio/synthesis/click_bus.h"
#include "audio/synthesis/click_kernels.h"
#include "audio/synthesis/long_pulse.h"
#include "carom/audio/synth.h"
#include "tests/bench/figures.h"
#include "tests/bench/machine_yardstick.h"
#include "tests/bench/scale.h"

namespace carom::bench {

using namespace audio;

namespace {

constexpr double kRate = 48000.0;
constexpr std::size_t kFrames = 4096;  // the naive loop's float buffer fits the first-level cache
constexpr std::size_t kClicks = 2 * kFrames;  // 96,000 in a second of sound
constexpr double kNaiveReach = 1.6;  // contact durations on either side; beyond, pulses are < 2e-7
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// First touches of clicks at random places in a buffer of kFrames, in samples, ascending.
std::vector<double> makeStarts() {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> place(0.05, 0.95);
  std::vector<double> starts(kClicks);
  for (double& start : starts)
    start = place(random) * kFrames;
  std::ranges::sort(starts);
  return starts;
}

/// Radius (m) of a steel ball whose contacts with steel at 1 m/s last `tau` s.
double radiusOf(double tau) {
  return tau / 7.76e-3;
}

/// The work of Synth on a click that has been scheduled, and on its bus.
class KernelRun {
 public:
  KernelRun(double tau, Radiation radiation)
      : samples_(tau * kRate),
        filter_(radiation == Radiation::exact ? 343.0 / (radiusOf(tau) * kRate) : kInfinity,
                RadiationFilter::Input::spread),
        near_(radiation == Radiation::exact ? 343.0 / kRate : 0.0),
        bus_(kernels_) {
    const std::size_t size = pulse_.ruleSize(2.0 * std::numbers::pi * samples_);
    if (size > 0 && size <= 48) nodes_ = pulse_.rule(size);
    x_.resize(static_cast<std::size_t>(samples_) + 100);
    placed_.reserve(nodes_.size(), x_.size());
    raster_.reserve(x_.size());
    bus_.reserve(ClickBus::kMaxFrames, x_.size());
  }

  void render(std::span<const double> starts, std::span<double> pressure) {
    bus_.restart({.radiation = &filter_}, 0);
    std::size_t next = 0;
    for (std::size_t done = 0; done < pressure.size(); done += ClickBus::kMaxFrames) {
      const auto end = static_cast<double>(done + ClickBus::kMaxFrames);
      for (; next < starts.size() && starts[next] < end; ++next)
        add(starts[next]);
      bus_.advance(pressure.subspan(done, ClickBus::kMaxFrames));
    }
  }

 private:
  void add(double start) {
    const double whole = std::floor(start);
    const ClickTrack track{.start = 8.0 + start - whole, .length = samples_, .gain = 1.0};
    const auto count = static_cast<std::size_t>(track.start + samples_) + 10;
    if (nodes_.empty()) {
      spreadLongPulse(pulse_, track, kernels_, raster_, {x_.data(), count});
    } else {
      kernels_.place(nodes_, track, placed_);
      kernels_.spread(placed_, nodes_.size(), {x_.data(), count});
    }
    bus_.add(static_cast<std::int64_t>(whole), {x_.data(), count}, 1.0, near_);
  }

  const Pulse& pulse_ = Pulse::of(PulseShape::hertz);
  double samples_;
  RadiationFilter filter_;
  double near_;
  const ClickKernels& kernels_ = fastestKernels();
  ClickBus bus_;
  std::span<const PulseNode> nodes_;  // empty if the click is long
  PlacedNodes placed_;
  Raster raster_;
  std::vector<double> x_;
};

void addClicks(benchmark::State& state, double tau, Radiation radiation) {
  const std::vector<double> starts = makeStarts();
  KernelRun run(tau, radiation);
  std::vector<double> pressure(kFrames, 0.0);
  for ([[maybe_unused]] const auto iteration : state) {
    run.render(starts, pressure);
    benchmark::DoNotOptimize(pressure.data());
    benchmark::ClobberMemory();
  }
  reportRate(state, kClicks);
}

/// The obvious loop: one exponential per sample, added to a float buffer.
void addNaively(double start, double samples, double amplitude, std::span<float> pressure) {
  const double centre = start + 0.5 * samples;
  const double reach = kNaiveReach * samples;
  const auto begin = static_cast<std::size_t>(std::max(0.0, std::ceil(centre - reach)));
  const auto end =
      std::min(pressure.size(), static_cast<std::size_t>(std::floor(centre + reach)) + 1);
  for (std::size_t sample = begin; sample < end; ++sample) {
    const double u = (static_cast<double>(sample) - centre) / samples;
    pressure[sample] += static_cast<float>(amplitude * -12.0 * u * std::exp(-6.0 * u * u));
  }
}

void addClicksNaively(benchmark::State& state, double tau) {
  const std::vector<double> starts = makeStarts();
  std::vector<float> pressure(kFrames, 0.0F);
  for ([[maybe_unused]] const auto iteration : state) {
    for (const double start : starts)
      addNaively(start, tau * kRate, 1.0, pressure);
    benchmark::DoNotOptimize(pressure.data());
    benchmark::ClobberMemory();
  }
  reportRate(state, kClicks);
}

/// The upper limit: the samples exist already and only have to be added.
void accumulateClicks(benchmark::State& state, double tau) {
  const std::vector<double> starts = makeStarts();
  const auto count = static_cast<std::size_t>(2.0 * kNaiveReach * tau * kRate) + 1;
  // Both arrays share one piece of memory: their relative alignment matters by a factor of two.
  std::vector<float> memory(kFrames + 2 * count, 1e-3F);
  const std::span<const float> click = std::span(memory).last(count);
  const std::span<float> pressure = std::span(memory).first(kFrames + count);
  for ([[maybe_unused]] const auto iteration : state) {
    for (const double start : starts) {
      float* const to = &pressure[static_cast<std::size_t>(start)];
      for (std::size_t i = 0; i < count; ++i)
        to[i] += click[i];
    }
    benchmark::DoNotOptimize(pressure.data());
    benchmark::ClobberMemory();
  }
  reportRate(state, kClicks);
}

std::string named(const char* what, double tau) {
  char name[64];
  std::snprintf(name, sizeof name, "%s, tau %.0f us", what, tau * 1e6);
  return name;
}

void addKernelFigures(Figures& figures, double tau, double bar) {
  const auto exact = [tau](benchmark::State& state) { addClicks(state, tau, Radiation::exact); };
  figures.add({.name = named("kernel", tau),
               .unit = "M clicks/s",
               .subject = exact,
               .yardstickName = "std::exp loop cut at 1.6 tau",
               .yardstick = [tau](benchmark::State& state) { addClicksNaively(state, tau); },
               .bar = Bar{Bar::Of::value, bar},
               .sense = Sense::higherIsBetter,
               .scale = 1e-6});
  figures.add({.name = named("kernel beside the limit", tau),
               .unit = "M clicks/s",
               .subject = exact,
               .yardstickName = "accumulate only",
               .yardstick = [tau](benchmark::State& state) { accumulateClicks(state, tau); },
               .sense = Sense::higherIsBetter,
               .scale = 1e-6});
  figures.add(
      {.name = named("exact beside compact", tau),
       .unit = "M clicks/s",
       .subject = exact,
       .yardstickName = "compact",
       .yardstick = [tau](benchmark::State& state) { addClicks(state, tau, Radiation::compact); },
       .bar = Bar{Bar::Of::ratio, 0.5},
       .sense = Sense::higherIsBetter,
       .scale = 1e-6});
}

// --- From an event in to samples out -----------------------------------------------------------

constexpr BodyId kFloor = 0;
constexpr double kRadius = 0.005;  // m; for steel, contacts last about 60 us
constexpr std::size_t kBlock = 512;
constexpr std::size_t kEvents = 20000;

SoundBody steelBall(double radius) {
  const Material& steel = *findMaterial("steel");
  const double volume = 4.0 / 3.0 * std::numbers::pi * radius * radius * radius;
  return {.material = steel, .mass = volume * steel.density, .radius = radius};
}

struct Traffic {
  std::size_t events = kEvents;
  double duration = 0.1;  // s
  std::size_t balls = 1;
  double smallest = kRadius;  // m
  double largest = kRadius;
};

double radiusOf(const Traffic& traffic, std::size_t ball) {
  const double share = static_cast<double>(ball) / static_cast<double>(traffic.balls);
  return traffic.smallest * std::pow(traffic.largest / traffic.smallest, share);
}

/// Impacts in a box of a metre, in the order of time.
std::vector<ImpulseEvent> makeEvents(const Traffic& traffic) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::vector<ImpulseEvent> events(traffic.events);
  for (ImpulseEvent& event : events) {
    const auto ball = static_cast<std::size_t>(unit(random) * static_cast<double>(traffic.balls));
    const double radius = radiusOf(traffic, ball);
    event.time = 0.01 + traffic.duration * unit(random);
    event.body = static_cast<BodyId>(ball + 1);
    event.other = kFloor;
    event.approachSpeed = 0.1 + unit(random);
    event.effectiveMass = steelBall(radius).mass;
    event.impulse = Vec3(0.0, 0.0, 1.9 * event.effectiveMass * event.approachSpeed);
    event.bodyVelocity = Vec3(0.0, 0.0, -event.approachSpeed);
    event.radius = radius;
    event.bodyPosition = Vec3(unit(random), unit(random), radius);
    event.position = event.bodyPosition - Vec3(0.0, 0.0, radius);
  }
  std::ranges::sort(events, {}, &ImpulseEvent::time);
  return events;
}

Synth makeSynth(const Traffic& traffic, const SynthSettings& settings,
                const std::vector<Listener>& listeners) {
  auto synth = Synth::create(settings, listeners);
  if (!synth || !synth->setBody(kFloor, {.material = *findMaterial("steel")})) std::abort();
  for (std::size_t ball = 0; ball < traffic.balls; ++ball) {
    const auto id = static_cast<BodyId>(ball + 1);
    if (!synth->setBody(id, steelBall(radiusOf(traffic, ball)))) std::abort();
  }
  return *std::move(synth);
}

/// Plays the events, scheduling them some blocks ahead, as a simulation would.
void play(Synth& synth, const std::vector<ImpulseEvent>& events,
          std::vector<std::vector<float>>& channels) {
  if (!synth.seek(0.0)) std::abort();
  std::vector<float*> pointers;
  for (std::vector<float>& channel : channels)
    pointers.push_back(channel.data());
  auto next = events.begin();
  while (next != events.end() || synth.pendingClicks() > 0) {
    for (; next != events.end() && next->time < synth.time() + 0.02; ++next)
      synth.schedule(*next);
    synth.render<float>(pointers, kBlock);
  }
}

struct Seats {
  SynthSettings settings = {};
  std::vector<Listener> listeners = {{"seat", {0.0, 0.0, 1.5}}};
};

void scheduleAndRender(benchmark::State& state, const Traffic& traffic, const Seats& seats) {
  const std::vector<ImpulseEvent> events = makeEvents(traffic);
  Synth synth = makeSynth(traffic, seats.settings, seats.listeners);
  std::vector<std::vector<float>> channels(synth.channelCount(), std::vector<float>(kBlock));
  for ([[maybe_unused]] const auto iteration : state) {
    play(synth, events, channels);
    benchmark::DoNotOptimize(channels.front().data());
  }
  reportRate(state, static_cast<double>(events.size()));
}

/// Evaluates the hand-out's equations directly, without a queue: duration, geometry, exponentials.
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
  addNaively((event.time + r / 343.0) * kRate, tau * kRate, radiated * jerk, pressure);
}

void soundEventsNaively(benchmark::State& state) {
  const std::vector<ImpulseEvent> events = makeEvents({});
  const SoundBody ball = steelBall(kRadius);
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
               .subject = [](benchmark::State& state) { scheduleAndRender(state, {}, {}); },
               .yardstickName = "equations 1 to 10 in one loop",
               .yardstick = soundEventsNaively,
               .bar = Bar{Bar::Of::value, 2.0},
               .sense = Sense::higherIsBetter,
               .scale = 1e-6});
}

// --- A dense scene ------------------------------------------------------------------------------

/// 100,000 collisions in a second, two shares of each, of a thousand balls of one size, as marbles
/// are. With --short the time is shorter and the density the same.
Traffic marbles(const Scale& scale) {
  return {.events = scale.of<std::size_t>(200000, 20000),
          .duration = scale.of(1.0, 0.1),
          .balls = 1000};
}
/// Traffic of marbles() with balls of a thousand sizes.
Traffic gravel(const Scale& scale) {
  Traffic traffic = marbles(scale);
  traffic.smallest = 0.001;
  traffic.largest = 0.01;
  return traffic;
}

Seats pairOfSeats() {
  return {.listeners = {{"left", {0.4, 0.5, 1.0}}, {"right", {0.6, 0.5, 1.0}}}};
}

void playDenseScene(benchmark::State& state, const Traffic& traffic) {
  const std::vector<ImpulseEvent> events = makeEvents(traffic);
  const Seats seats = pairOfSeats();
  Synth synth = makeSynth(traffic, seats.settings, seats.listeners);
  std::vector<std::vector<float>> channels(2, std::vector<float>(kBlock));
  for ([[maybe_unused]] const auto iteration : state)
    play(synth, events, channels);
}

void renderDenseScene(benchmark::State& state, const Traffic& traffic) {
  playDenseScene(state, traffic);
  reportRate(state, traffic.duration);
}

/// Measures the largest memory of the whole process, in MB.
void memoryOfDenseScene(benchmark::State& state, const Traffic& traffic) {
  playDenseScene(state, traffic);
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  reportValue(state, static_cast<double>(usage.ru_maxrss) / 1024.0);
}

Figure denseFigure(const char* balls, const Traffic& traffic) {
  return {.name = std::string("100,000 collisions/s, 2 listeners, balls of ") + balls,
          .unit = "x real time",
          .subject = [=](benchmark::State& state) { renderDenseScene(state, traffic); },
          .yardstickName = kMachine,
          .yardstick = machineRate(),
          .bar = Bar{Bar::Of::value, 5.0},
          .sense = Sense::higherIsBetter};
}

void addDenseFigures(Figures& figures, const Scale& scale) {
  figures.add(denseFigure("one size", marbles(scale)));
  figures.add(denseFigure("1000 sizes", gravel(scale)));
  figures.add(besideItsBar(
      {.name = "memory of that process, its events included",
       .unit = "MB",
       .subject = [=](benchmark::State& state) { memoryOfDenseScene(state, gravel(scale)); },
       .bar = Bar{Bar::Of::value, 200.0},
       .sense = Sense::lowerIsBetter}));
}

// --- A room -------------------------------------------------------------------------------------

Seats boxedSeat() {
  Seats seats;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      Reflector wall{.normal = -side * Vec3::Unit(axis), .offset = side > 0.0 ? -3.0 : -2.0};
      wall.absorption.coefficients.fill(0.1);
      seats.settings.room.reflectors.push_back(wall);
    }
  }
  return seats;
}

void addRoomFigure(Figures& figures) {
  figures.add(
      {.name = "all six first-order images of a box",
       .unit = "M events/s",
       .subject = [](benchmark::State& state) { scheduleAndRender(state, {}, boxedSeat()); },
       .yardstickName = "the direct path alone",
       .yardstick = [](benchmark::State& state) { scheduleAndRender(state, {}, {}); },
       .bar = Bar{Bar::Of::ratio, 1.0 / 7.0},
       .sense = Sense::higherIsBetter,
       .scale = 1e-6});
}

}  // namespace
}  // namespace carom::bench

int main(int argc, char** argv) {
  carom::bench::Figures figures;
  carom::bench::addKernelFigures(figures, 10e-6, 10.0);
  carom::bench::addKernelFigures(figures, 50e-6, 10.0);
  carom::bench::addKernelFigures(figures, 200e-6, 8.0);
  carom::bench::addKernelFigures(figures, 1e-3, 3.0);
  carom::bench::addEndToEndFigure(figures);
  carom::bench::addDenseFigures(figures, carom::bench::scaleOf(argc, argv));
  carom::bench::addRoomFigure(figures);
  return figures.run(argc, argv);
}
