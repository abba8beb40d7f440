// Cost of contacts: hundreds that slide at once, in real time, others that rest, and blows on what
// rings.

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <numbers>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "audio/contact/coupled_contact.h"
#include "carom/audio/material.h"
#include "carom/event_sound.h"
#include "tests/bench/figures.h"
#include "tests/bench/machine_yardstick.h"

namespace carom::bench {
namespace {

constexpr double kRate = 48000.0;      // Hz
constexpr double kStep = 1.0 / 240.0;  // s
constexpr std::size_t kStepFrames = 200;
constexpr BodyId kFloor = 100000;
constexpr double kRadius = 0.02;  // m

/// Wooden balls that slide over a wooden floor, each at its own speed, 2 m around the listener.
class Sliders {
 public:
  Sliders(BodyId count, std::size_t budget, double slowest)
      : count_(count), slowest_(slowest), sound_(makeSound(budget)) {
    const Material wood = *findMaterial("wood");
    for (BodyId id = 0; id < count; ++id)
      if (!sound_.setBody(id, {.material = wood, .mass = kMass, .radius = kRadius})) std::abort();
    if (!sound_.setBody(kFloor, {.material = wood}) || !sound_.prepareRendering(kRate))
      std::abort();
    render();  // starts the clock
    for (int step = 0; step < 60; ++step) {
      touch();
      render();
    }
  }

  void touch() {
    for (BodyId id = 0; id < count_; ++id)
      sound_.updateContact(contactOf(id));
    ++steps_;
    sound_.advanceTo(kStep * static_cast<double>(steps_));
  }
  void render() { sound_.render(channels_, kStepFrames); }
  SoundStatistics statistics() const { return sound_.statistics(); }

 private:
  static constexpr double kMass = 0.0237;  // kg

  static EventSound makeSound(std::size_t budget) {
    SoundSettings settings;
    settings.budget.slidingContacts = budget;
    settings.budget.voices = 65536;
    settings.budget.cpuShare = 1e6;
    Result<EventSound> sound = EventSound::create(settings);
    if (!sound) std::abort();
    return *std::move(sound);
  }

  ContactState contactOf(BodyId id) const {
    const double angle = 0.7 * static_cast<double>(id);
    const Vec3 along(std::cos(angle), 0.0, std::sin(angle));
    const double speed = slowest_ * (1.0 + 0.002 * static_cast<double>(id));
    const double time = kStep * static_cast<double>(steps_);
    const Vec3 place = Vec3(2.0 * std::sin(angle), -1.0, 2.0 * std::cos(angle)) +
                       speed * std::fmod(time, 1.0) * along;
    ContactState state;
    state.time = time;
    state.duration = kStep;
    state.body = id;
    state.other = kFloor;
    state.normal = Vec3::UnitY();
    state.position = place;
    state.normalLoad = 9.81 * kMass;
    state.appliedImpulse = kStep * state.normalLoad * (Vec3::UnitY() - 0.3 * along);
    state.slipVelocity = speed * along;
    state.radius = kRadius;
    state.bodyPosition = place + kRadius * Vec3::UnitY();
    state.bodyVelocity = state.slipVelocity;
    state.pathStart = state.pathEnd = -kRadius * Vec3::UnitY();
    state.otherPathStart = place;
    state.otherPathEnd = place + kStep * speed * along;
    return state;
  }

  BodyId count_;
  double slowest_;
  EventSound sound_;
  std::int64_t steps_ = 0;
  std::array<std::vector<float>, 2> samples_{std::vector<float>(kStepFrames),
                                             std::vector<float>(kStepFrames)};
  std::array<float*, 2> channels_{samples_[0].data(), samples_[1].data()};
};

/// Reports s of CPU time per second of sound.
void reportShare(benchmark::State& state) {
  reportTime(state, kStep);
}

Work sliding(BodyId count, std::size_t budget) {
  return [=](benchmark::State& state) {
    Sliders sliders(count, budget, 0.5);
    for (auto _ : state) {
      sliders.touch();
      sliders.render();
    }
    reportShare(state);
  };
}

/// The usual method of games: noise through a two-pole filter for each contact and channel.
void filteredNoise(benchmark::State& state) {
  constexpr std::size_t kFilters = 1000;
  std::vector<double> y1(kFilters), y2(kFilters), out(kStepFrames), noise(kStepFrames);
  std::uint32_t random = 1;
  for (auto _ : state) {
    for (double& sample : noise) {
      random = random * 1664525U + 1013904223U;
      sample = static_cast<double>(random) * 0x1p-32 - 0.5;
    }
    std::ranges::fill(out, 0.0);
    for (std::size_t i = 0; i < kFilters; ++i) {
      const double a1 = 1.6 + 1e-4 * static_cast<double>(i);
      for (std::size_t n = 0; n < kStepFrames; ++n) {
        const double y = noise[n] + a1 * y1[i] - 0.9 * y2[i];
        y2[i] = y1[i];
        y1[i] = y;
        out[n] += y;
      }
    }
    benchmark::DoNotOptimize(out.data());
  }
  reportShare(state);
}

Work leftOut(BodyId count, std::size_t budget) {
  return [=](benchmark::State& state) {
    Sliders sliders(count, budget, 0.5);
    for (auto _ : state) {
      sliders.touch();
      sliders.render();
    }
    const SoundStatistics all = sliders.statistics();
    const std::uint64_t lost =
        all.slidesLeftOut + all.queueFaults + all.noBus + all.stolen + all.overBudget;
    reportValue(state, static_cast<double>(lost) / static_cast<double>(all.slides + lost));
  };
}

void resting(benchmark::State& state) {
  constexpr BodyId kResting = 1000;
  Sliders sliders(kResting, 64, 0.0);
  for (auto _ : state)
    sliders.touch();
  reportTime(state, kResting);
}

/// Blows on plates of 64 modes up to 20 kHz, by bodies from 1/100 to 100 times their mass, that
/// between rigid bodies would last up to 1 ms.
class Blows {
 public:
  static constexpr std::size_t kBlows = 128;

  Blows() {
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> share(0.0, 1.0);
    const auto between = [&](double low, double high) {  // evenly over the logarithm
      return low * std::pow(high / low, share(random));
    };
    while (impacts_.size() < kBlows) {
      std::vector<audio::ContactMode>& modes = modes_.emplace_back();
      const double plate = between(0.01, 10.0);  // kg
      const double lowest = between(50.0, 1000.0);
      const double spacing = std::min(0.8, (20000.0 / lowest - 1.0) / 63.0);
      for (int mode = 0; mode < 64; ++mode) {
        const double place = std::cos(2.0 * std::numbers::pi * share(random));
        modes.push_back({.frequency = 2.0 * std::numbers::pi * lowest * (1.0 + spacing * mode),
                         .decay = between(1.0, 100.0),
                         .shape = 2.0 * place / std::sqrt(plate)});
      }
      const double ball = plate * between(0.01, 100.0);
      audio::CoupledImpact impact{.stiffness = between(1e5, 1e10),
                                  .mass = ball * plate / (ball + plate),
                                  .speed = between(0.01, 10.0),
                                  .modes = {}};
      impact.impulse = impact.mass * impact.speed * (1.0 + share(random));
      if (audio::elasticDuration(impact) < 1e-3)
        impacts_.push_back(impact);
      else
        modes_.pop_back();
    }
    for (std::size_t blow = 0; blow < kBlows; ++blow)
      impacts_[blow].modes = modes_[blow];
  }

  double solve(std::size_t blow) { return contact_.solve(impacts_[blow]).impulse; }

 private:
  std::vector<std::vector<audio::ContactMode>> modes_;
  std::vector<audio::CoupledImpact> impacts_;
  audio::CoupledContact contact_;
};

/// The time of a blow, of which `share` (0 to 1) of all take less.
Work blowsWithin(double share) {
  return [=](benchmark::State& state) {
    Blows blows;
    std::vector<double> seconds(Blows::kBlows);
    for (auto _ : state) {
      for (std::size_t blow = 0; blow < Blows::kBlows; ++blow) {
        const auto begin = std::chrono::steady_clock::now();
        benchmark::DoNotOptimize(blows.solve(blow));
        const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;
        seconds[blow] = taken.count();
      }
    }
    std::ranges::sort(seconds);
    reportValue(state, seconds[static_cast<std::size_t>(share * (Blows::kBlows - 1))]);
  };
}

/// Adds the cost of 500 sliding contacts, of which `budget` may be heard, and the share that was
/// left out.
void addSliding(Figures& figures, const std::string& suffix, std::size_t budget,
                std::optional<Bar> bar) {
  figures.add({.name = "500 contacts slide" + suffix,
               .unit = "of a core",
               .subject = sliding(500, budget),
               .yardstickName = "noise through 1000 filters of two poles",
               .yardstick = filteredNoise,
               .bar = bar,
               .sense = Sense::lowerIsBetter});
  figures.add(besideItsBar({.name = "of these left out" + suffix,
                            .unit = "of the steps",
                            .subject = leftOut(500, budget),
                            .sense = Sense::lowerIsBetter,
                            .noise = 0.01}));
}

}  // namespace
}  // namespace carom::bench

int main(int argc, char** argv) {
  using namespace carom::bench;
  Figures figures;
  addSliding(figures, "", 500, Bar{Bar::Of::value, 1.0});
  addSliding(figures, ", 350 may", 350, Bar{Bar::Of::value, 1.0});
  addSliding(figures, ", 64 may", 64, std::nullopt);
  figures.add({.name = "a contact that rests, a step",
               .unit = "ns",
               .subject = resting,
               .yardstickName = kMachine,
               .yardstick = machineTime(),
               .sense = Sense::lowerIsBetter,
               .scale = 1e9});
  figures.add({.name = "a blow on 64 modes, in the median",
               .unit = "us",
               .subject = blowsWithin(0.5),
               .yardstickName = kMachine,
               .yardstick = machineTime(),
               .bar = Bar{Bar::Of::value, 20.0},
               .sense = Sense::lowerIsBetter,
               .scale = 1e6});
  figures.add({.name = "a blow on 64 modes, of which 95 % take less",
               .unit = "us",
               .subject = blowsWithin(0.95),
               .yardstickName = kMachine,
               .yardstick = machineTime(),
               .sense = Sense::lowerIsBetter,
               .scale = 1e6});
  return figures.run(argc, argv);
}
