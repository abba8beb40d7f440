#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <new>
#include <string_view>
#include <vector>

#include "native/jello_world.h"

namespace carom::native {

/// Memory that begins where a line of the cache does, as vectors like it.
template <typename Value>
struct JelloAllocator {
  using value_type = Value;
  static constexpr std::align_val_t kLine{64};

  JelloAllocator() = default;
  template <typename Other>
  explicit JelloAllocator(const JelloAllocator<Other>&) {}
  Value* allocate(std::size_t count) {
    return static_cast<Value*>(::operator new(count * sizeof(Value), kLine));
  }
  void deallocate(Value* values, std::size_t) { ::operator delete(values, kLine); }
  bool operator==(const JelloAllocator&) const = default;
};
using JelloValues = std::vector<double, JelloAllocator<double>>;

/// Points along a row that are taken together: no vector is wider.
inline constexpr std::size_t kJelloBlock = 8;
/// Doubles in front of and behind each array of coordinates that may be read, and are numbers: a
/// block from the last point on, led on by two.
inline constexpr std::size_t kJelloSlack = 2 * kJelloBlock;

/// Of the approximation of 1 / sqrt(x), by e = 1 - x y^2 of what its bits give for y: 1 / sqrt(1 -
/// e) is s[0] + s[1] e + s[2] e^2 within 2.5e-5 (minimax, where -0.0692 < e < 0.0676). One step of
/// Householder's method then leaves 4e-14.
inline constexpr std::array<double, 3> kInverseRootSeed = {1.00000021, 0.50109592, 0.37550221};
inline constexpr std::uint64_t kInverseRootBits = 0x5FE6EB50C7B537A9;

/// What springs do to the points of a lattice, whose arrays are x, y and z apart.
struct JelloSprings {
  std::size_t count = 0;   ///< points along each axis
  double stiffness = 0.0;  ///< N/m
  double damping = 0.0;    ///< N s/m; 0: velocities are not read
  std::array<JelloSpring, kJelloSprings> kinds = jelloSprings();
  std::array<double, kJelloSprings> lengths{};  ///< m, of `kinds`
  /// 1 where a spring that leads z by -1, 0, 1 or 2 points has both of its ends, for each point of
  /// a row along z, else 0.
  std::array<std::vector<double>, 4> has;

  explicit JelloSprings(const JelloLattice& lattice);
  const double* hasOf(std::size_t which) const {
    const int lead = kinds[which].to[2];
    return has[lead < 0 ? 0 : static_cast<std::size_t>(lead) + 1].data();
  }
};

/// m, m/s and N, each with kJelloSlack around.
struct JelloArrays {
  std::array<const double*, 3> positions{};
  std::array<const double*, 3> velocities{};
  std::array<double*, 3> forces{};
};

/// Of a lattice, planes of points across x: those from `begin` to before `end`.
struct JelloSlabs {
  std::size_t begin = 0;
  std::size_t end = 0;
};

/// out = base + factors[0] terms[0] + ..., in this order, each fused; `out` may be `base`.
struct JelloSum {
  static constexpr std::size_t kMost = 4;
  double* out = nullptr;
  const double* base = nullptr;
  std::size_t count = 0;
  std::size_t terms = 0;
  std::array<double, kMost> factors{};
  std::array<const double*, kMost> values{};
};

/// A plane, and how it pushes back what is beyond it.
struct JelloWall {
  std::array<double, 3> normal{};
  double offset = 0.0;     ///< m
  double stiffness = 0.0;  ///< N/m
  double damping = 0.0;    ///< N s/m
};

/// Adds forces. One for each instruction set, all with the same bits: every
/// operation is exactly rounded, fused multiplications too, and each point's sum in one order.
///
/// 1 / |L| is found without a division, from the bits of L^2 (inverseRoot): within 5e-14, which is
/// a spring that is so little unlike Hooke's, and as much on both of its ends.
struct JelloKernel {
  std::string_view name;
  /// Of the springs that begin in `slabs`; they end there, or up to two beyond.
  void (*addSprings)(const JelloSprings& springs, JelloSlabs slabs, const JelloArrays& arrays);
  /// Of a wall on the first `count` points.
  void (*addWall)(const JelloWall& wall, std::size_t count, const JelloArrays& arrays);
  void (*sum)(const JelloSum& sum);
  /// forces = forces inverseMasses + gravity, fused: m/s^2, along one axis.
  void (*accelerate)(const double* inverseMasses, double gravity, std::size_t count,
                     double* forces);
  /// Whether all of them are within -most to most; NaN is not.
  bool (*areWithin)(const double* values, double middle, double most, std::size_t count);
};

/// In portable C++: what the others are held to.
const JelloKernel& plainJelloKernel();
/// The fastest on this machine. [any thread]
const JelloKernel& jelloKernel();
/// All that this machine can run, the widest first; the plain one is the last.
std::vector<JelloKernel> jelloKernels();

}  // namespace carom::native
