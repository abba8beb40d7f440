// Cost of lasting contacts: hundreds that slide at once, in real time, and others that rest.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

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
  return figures.run(argc, argv);
}
