#include "tests/bench/machine_yardstick.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>
#include <utility>

#include <benchmark/benchmark.h>

namespace carom::bench {
namespace {

constexpr std::size_t kNumbers = 512;  // 4 kB
constexpr int kSweeps = 40;
constexpr std::size_t kPlaces = 16384;  // 64 kB
constexpr int kHops = 4096;
constexpr std::size_t kSorted = 512;

}  // namespace

MachineWork::MachineWork() : numbers_(kNumbers), next_(kPlaces), unsorted_(kSorted) {
  // The raw numbers of the engine are the same on every platform, those of distributions are not.
  std::mt19937 random(1);
  for (double& number : unsorted_)
    number = static_cast<double>(random());
  for (std::uint32_t place = 0; place < kPlaces; ++place)
    next_[place] = place;
  // Sattolo's shuffle gives a single cycle.
  for (std::size_t last = kPlaces - 1; last > 0; --last)
    std::swap(next_[last], next_[random() % last]);
  sorted_ = unsorted_;
}

double MachineWork::pass() {
  return calculate() + static_cast<double>(chase()) + sort();
}

double MachineWork::calculate() {
  for (std::size_t i = 0; i < kNumbers; ++i)
    numbers_[i] = 0.5 + 0.75 * static_cast<double>(i) / kNumbers;
  // From these numbers the map leads to its fixed point 1, away from infinity and denormal numbers.
  for (int sweep = 0; sweep < kSweeps; ++sweep)
    for (double& number : numbers_)
      number = 0.25 * number * number + 0.5 * number + 0.25 / number;
  double sum = 0.0;
  for (const double number : numbers_)
    sum += number;
  return sum;
}

std::uint32_t MachineWork::chase() {
  for (int hop = 0; hop < kHops; ++hop)
    place_ = next_[place_];
  return place_;
}

double MachineWork::sort() {
  std::ranges::copy(unsorted_, sorted_.begin());
  std::ranges::sort(sorted_);
  return sorted_[kSorted / 2];
}

Work machineRate(double perPass) {
  return [perPass](benchmark::State& state) {
    MachineWork machine;
    for ([[maybe_unused]] const auto iteration : state)
      benchmark::DoNotOptimize(machine.pass());
    reportRate(state, perPass);
  };
}

Work machineTime(double perPass) {
  return [perPass](benchmark::State& state) {
    MachineWork machine;
    for ([[maybe_unused]] const auto iteration : state)
      benchmark::DoNotOptimize(machine.pass());
    reportTime(state, perPass);
  };
}

}  // namespace carom::bench
