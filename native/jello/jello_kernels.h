#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <new>
#include <string_view>
#include <vector>

#include "native/jello/jello_world.h"

namespace carom::native {

/// An allocator of memory that begins at a cache line, which suits SIMD vectors.
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

/// Number of points along a row that are processed together: no SIMD vector is wider.
inline constexpr std::size_t kJelloBlock = 8;
/// Number of doubles in front of and behind each array of coordinates that may be read and hold
/// finite numbers: a block from the last point on, shifted by two.
inline constexpr std::size_t kJelloSlack = 2 * kJelloBlock;

/// Coefficients s of the approximation of 1 / sqrt(x). With y from the bits of x and e = 1 - x y^2,
/// 1 / sqrt(1 - e) is s[0] + s[1] e + s[2] e^2 within 2.5e-5 (minimax, where -0.0692 < e < 0.0676).
/// One step of Householder's method then leaves 4e-14.
inline constexpr std::array<double, 3> kInverseRootSeed = {1.00000021, 0.50109592, 0.37550221};
inline constexpr std::uint64_t kInverseRootBits = 0x5FE6EB50C7B537A9;

/// The springs of a lattice, whose arrays hold x, y and z apart.
struct JelloSprings {
  std::size_t count = 0;   ///< points along each axis
  double stiffness = 0.0;  ///< N/m
  double damping = 0.0;    ///< N s/m; 0: velocities are not read
  std::array<JelloSpring, kJelloSprings> kinds = jelloSprings();
  std::array<double, kJelloSprings> lengths{};  ///< m, at rest, by index of `kinds`
  /// For each point of a row along z: 1 where a spring that leads z by -1, 0, 1 or 2 points has
  /// both of its ends, otherwise 0.
  std::array<std::vector<double>, 4> has;

  explicit JelloSprings(const JelloLattice& lattice);
  const double* hasOf(std::size_t which) const {
    const int lead = kinds[which].to[2];
    return has[lead < 0 ? 0 : static_cast<std::size_t>(lead) + 1].data();
  }
};

/// Arrays of positions (m), velocities (m/s) and forces (N), each with kJelloSlack around.
struct JelloArrays {
  std::array<const double*, 3> positions{};
  std::array<const double*, 3> velocities{};
  std::array<double*, 3> forces{};
};

/// Planes of points across x of a lattice: those from `begin` to before `end`.
struct JelloSlabs {
  std::size_t begin = 0;
  std::size_t end = 0;
};

/// The sum out = base + factors[0] values[0] + ..., of `terms` terms in this order, each fused;
/// `out` may be `base`.
struct JelloSum {
  static constexpr std::size_t kMost = 4;
  double* out = nullptr;
  const double* base = nullptr;
  std::size_t count = 0;
  std::size_t terms = 0;
  std::array<double, kMost> factors{};
  std::array<const double*, kMost> values{};
};

/// A plane and its penalty on points beyond it.
struct JelloWall {
  std::array<double, 3> normal{};
  double offset = 0.0;     ///< m
  double stiffness = 0.0;  ///< N/m
  double damping = 0.0;    ///< N s/m
};

/// The functions of one instruction set that add forces. All sets give the same bits: every
/// operation is exactly rounded, fused multiplications too, and each point's sum has one order.
///
/// 1 / |L| is found without a division, from the bits of L^2 (inverseRoot): within 5e-14. This
/// makes the spring differ by as little from Hooke's, and equally at both of its ends.
struct JelloKernel {
  std::string_view name;
  /// Adds the forces of the springs that begin in `slabs`; they end there, or up to two slabs
  /// beyond.
  void (*addSprings)(const JelloSprings& springs, JelloSlabs slabs, const JelloArrays& arrays);
  /// Adds the forces of a wall on the first `count` points.
  void (*addWall)(const JelloWall& wall, std::size_t count, const JelloArrays& arrays);
  void (*sum)(const JelloSum& sum);
  /// Turns forces into accelerations (m/s^2) along one axis: forces = forces inverseMasses +
  /// gravity, fused.
  void (*accelerate)(const double* inverseMasses, double gravity, std::size_t count,
                     double* forces);
  /// True if all values differ from `middle` by at most `most`; NaN never does.
  bool (*areWithin)(const double* values, double middle, double most, std::size_t count);
};

/// Kernel in portable C++: the reference for the others.
const JelloKernel& plainJelloKernel();
/// Fastest kernel on this machine. [any thread]
const JelloKernel& jelloKernel();
/// All kernels that this machine can run, the widest first; the plain one is the last.
std::vector<JelloKernel> jelloKernels();

}  // namespace carom::native
