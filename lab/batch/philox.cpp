#include "lab/batch/philox.h"

#include <cmath>
#include <cstddef>
#include <numbers>

namespace carom::lab {
namespace {

__extension__ using Product = unsigned __int128;

constexpr int kRounds = 10;
constexpr std::uint64_t kMultiplier0 = 0xD2E7470EE14C6C93U;
constexpr std::uint64_t kMultiplier1 = 0xCA5A826395121157U;
constexpr std::uint64_t kBump0 = 0x9E3779B97F4A7C15U;  // golden ratio
constexpr std::uint64_t kBump1 = 0xBB67AE8584CAA73BU;  // square root of 3, less 1

std::uint64_t high(Product product) {
  return static_cast<std::uint64_t>(product >> 64U);
}
std::uint64_t low(Product product) {
  return static_cast<std::uint64_t>(product);
}

}  // namespace

std::array<std::uint64_t, 4> philox(std::array<std::uint64_t, 4> counter,
                                    std::array<std::uint64_t, 2> key) {
  for (int round = 0; round < kRounds; ++round) {
    const Product first = Product{kMultiplier0} * counter[0];
    const Product second = Product{kMultiplier1} * counter[2];
    counter = {high(second) ^ counter[1] ^ key[0], low(second), high(first) ^ counter[3] ^ key[1],
               low(first)};
    key[0] += kBump0;
    key[1] += kBump1;
  }
  return counter;
}

std::uint64_t RandomStream::word() {
  const std::size_t at = taken_ % block_.size();
  if (at == 0)
    block_ = philox({name_.index, name_.parameter, name_.attempt, taken_ / block_.size()},
                    {name_.seed, 0});
  ++taken_;
  return block_[at];
}

double RandomStream::uniform() {
  return static_cast<double>(word() >> 11U) * 0x1p-53;
}

double RandomStream::normal() {
  const double radius = std::sqrt(-2.0 * std::log1p(-uniform()));
  return radius * std::cos(2.0 * std::numbers::pi * uniform());
}

std::uint64_t RandomStream::below(std::uint64_t number) {
  // Lemire's method: the products whose lower half is below `biased` would come once too often.
  const std::uint64_t biased = (0 - number) % number;
  Product product = 0;
  do {
    product = Product{word()} * number;
  } while (low(product) < biased);
  return high(product);
}

}  // namespace carom::lab
