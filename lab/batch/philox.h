#pragma once

#include <array>
#include <cstdint>

namespace carom::lab {

/// Returns the block of a counter-based generator, Philox4x64-10: four random words for each pair
/// of counter and key, in any order and without a state. (Salmon, Moraes, Dror and Shaw, "Parallel
/// random numbers: as easy as 1, 2, 3", SC 2011, section 3.3.) [any thread]
std::array<std::uint64_t, 4> philox(std::array<std::uint64_t, 4> counter,
                                    std::array<std::uint64_t, 2> key);

/// The names that a random value has. Equal names give equal values, whatever else is drawn.
struct RandomName {
  std::uint64_t seed = 0;
  std::uint64_t index = 0;      ///< of the sample
  std::uint64_t parameter = 0;  ///< hash of the parameter's name
  std::uint64_t attempt = 0;    ///< of the sample
};

/// The random numbers of one name, one after the other. [one thread]
class RandomStream {
 public:
  explicit RandomStream(const RandomName& name) : name_(name) {}

  std::uint64_t word();
  double uniform();                           ///< from 0, below 1: a multiple of 2^-53
  double normal();                            ///< mean 0, deviation 1, by Box and Muller
  std::uint64_t below(std::uint64_t number);  ///< from 0, below `number`, which is > 0; unbiased

 private:
  RandomName name_;
  std::array<std::uint64_t, 4> block_{};
  std::uint64_t taken_ = 0;
};

}  // namespace carom::lab
