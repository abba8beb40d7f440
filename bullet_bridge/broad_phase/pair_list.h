#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace carom::bullet {

/// The pairs found so far; the list keeps its memory for the next substep.
class PairList {
 public:
  using Pair = std::pair<std::uint32_t, std::uint32_t>;  ///< the lower number first

  void clear() { count_ = 0; }
  /// Makes room for that many calls of `addIf`.
  void reserve(std::size_t more) {
    if (pairs_.size() < count_ + more) pairs_.resize(2 * (count_ + more));
  }
  void addIf(bool wanted, std::uint32_t a, std::uint32_t b) {
    const std::uint32_t lower = std::min(a, b);
    pairs_[count_] = {lower, a + b - lower};  // std::max would bring a branch back
    count_ += wanted ? 1 : 0;
  }
  std::span<const Pair> pairs() const { return {pairs_.data(), count_}; }

 private:
  std::vector<Pair> pairs_;
  std::size_t count_ = 0;
};

}  // namespace carom::bullet
