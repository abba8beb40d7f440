#include "native/jello/jello_kernels.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "native/math/fused.h"

#if CAROM_SIMD
#include "native/jello/simd_jello.h"
#endif

namespace carom::native {
namespace {

/// Returns 1 / sqrt(x), within 5e-14.
double inverseRoot(double x) {
  const auto& [c0, c1, c2] = kInverseRootSeed;
  auto y = std::bit_cast<double>(kInverseRootBits - (std::bit_cast<std::uint64_t>(x) >> 1U));
  const double first = fused(-(x * y), y, 1.0);
  y *= fused(fused(c2, first, c1), first, c0);
  const double second = fused(-(x * y), y, 1.0);
  return fused(y * second, fused(0.375, second, 0.5), y);
}

using Push = std::array<double, 3>;

double dot(const Push& a, const Push& b) {
  return fused(a[2], b[2], fused(a[1], b[1], a[0] * b[0]));
}

/// Force in N by which the spring of kind `which` from point a to point b pushes a.
Push pushOf(const JelloSprings& springs, const JelloArrays& arrays, std::size_t which,
            std::size_t a, std::size_t b) {
  Push away{};
  for (std::size_t axis = 0; axis < 3; ++axis)
    away[axis] = arrays.positions[axis][a] - arrays.positions[axis][b];
  const double inverse = inverseRoot(dot(away, away));
  double strength = fused(springs.stiffness * springs.lengths[which], inverse, -springs.stiffness);
  if (springs.damping > 0.0) {
    Push speed{};
    for (std::size_t axis = 0; axis < 3; ++axis)
      speed[axis] = arrays.velocities[axis][a] - arrays.velocities[axis][b];
    strength = fused(-springs.damping, (dot(speed, away) * inverse) * inverse, strength);
  }
  for (double& one : away)
    one *= strength;
  return away;
}

/// Adds the springs along the rows of a plane: first to their first ends, then to the others.
void addAlong(const JelloSprings& springs, const JelloArrays& arrays, std::size_t which,
              std::size_t plane) {
  const std::size_t n = springs.count;
  const auto lead = static_cast<std::size_t>(springs.kinds[which].to[2]);
  std::vector<Push> pushes(n);
  for (std::size_t j = 0; j < n; ++j) {
    const std::size_t row = plane + j * n;
    for (std::size_t k = 0; k + lead < n; ++k)
      pushes[k] = pushOf(springs, arrays, which, row + k, row + k + lead);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (std::size_t k = 0; k + lead < n; ++k)
        arrays.forces[axis][row + k] += pushes[k][axis];
      for (std::size_t k = 0; k + lead < n; ++k)
        arrays.forces[axis][row + k + lead] -= pushes[k][axis];
    }
  }
}

/// Adds the springs to other rows, of the points [first, end) of a row, kind by kind; the sums of
/// the row itself are added last.
void addAcross(const JelloSprings& springs, const JelloArrays& arrays,
               const std::array<std::ptrdiff_t, 2>& place, std::ptrdiff_t first,
               std::ptrdiff_t end) {
  const auto n = static_cast<std::ptrdiff_t>(springs.count);
  const auto isIn = [n](std::ptrdiff_t at) { return at >= 0 && at < n; };
  const std::ptrdiff_t row = (place[0] * n + place[1]) * n;
  std::array<Push, kJelloBlock> sums{};
  for (std::size_t which = 0; which < kJelloSprings; ++which) {
    const auto& to = springs.kinds[which].to;
    const bool isAlong = to[0] == 0 && to[1] == 0;
    if (isAlong || !isIn(place[0] + to[0]) || !isIn(place[1] + to[1])) continue;
    for (std::ptrdiff_t k = first; k < end; ++k) {
      if (!isIn(k + to[2])) continue;
      const auto a = static_cast<std::size_t>(row + k);
      const auto b = static_cast<std::size_t>(row + k + (to[0] * n + to[1]) * n + to[2]);
      const Push push = pushOf(springs, arrays, which, a, b);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        sums[static_cast<std::size_t>(k - first)][axis] += push[axis];
        arrays.forces[axis][b] -= push[axis];
      }
    }
  }
  for (std::ptrdiff_t k = first; k < end; ++k)
    for (std::size_t axis = 0; axis < 3; ++axis)
      arrays.forces[axis][row + k] += sums[static_cast<std::size_t>(k - first)][axis];
}

void addSprings(const JelloSprings& springs, JelloSlabs slabs, const JelloArrays& arrays) {
  constexpr auto kBlock = static_cast<std::ptrdiff_t>(kJelloBlock);
  const auto n = static_cast<std::ptrdiff_t>(springs.count);
  for (auto i = static_cast<std::ptrdiff_t>(slabs.begin);
       i < static_cast<std::ptrdiff_t>(slabs.end); ++i) {
    for (std::size_t which = 0; which < kJelloSprings; ++which)
      if (springs.kinds[which].to[0] == 0 && springs.kinds[which].to[1] == 0)
        addAlong(springs, arrays, which, static_cast<std::size_t>(i * n * n));
    for (std::ptrdiff_t j = 0; j < n; ++j)
      for (std::ptrdiff_t k = 0; k < n; k += kBlock)
        addAcross(springs, arrays, {i, j}, k, std::min(k + kBlock, n));
  }
}

void addWall(const JelloWall& wall, std::size_t count, const JelloArrays& arrays) {
  const auto along = [&](const std::array<const double*, 3>& of, std::size_t at) {
    return fused(of[2][at], wall.normal[2],
                 fused(of[1][at], wall.normal[1], of[0][at] * wall.normal[0]));
  };
  for (std::size_t at = 0; at < count; ++at) {
    const double depth = wall.offset - along(arrays.positions, at);
    if (!(depth > 0.0)) continue;
    const double damped = wall.damping * along(arrays.velocities, at);
    const double push = std::max(0.0, fused(wall.stiffness, depth, -damped));
    for (std::size_t axis = 0; axis < 3; ++axis)
      arrays.forces[axis][at] = fused(push, wall.normal[axis], arrays.forces[axis][at]);
  }
}

void sum(const JelloSum& of) {
  for (std::size_t index = 0; index < of.count; ++index) {
    double total = of.base[index];
    for (std::size_t term = 0; term < of.terms; ++term)
      total = fused(of.factors[term], of.values[term][index], total);
    of.out[index] = total;
  }
}

void accelerate(const double* inverseMasses, double gravity, std::size_t count, double* forces) {
  for (std::size_t index = 0; index < count; ++index)
    forces[index] = fused(forces[index], inverseMasses[index], gravity);
}

bool areWithin(const double* values, double middle, double most, std::size_t count) {
  for (std::size_t index = 0; index < count; ++index)
    if (!(std::abs(values[index] - middle) <= most)) return false;
  return true;
}

}  // namespace

JelloSprings::JelloSprings(const JelloLattice& lattice)
    : count(lattice.count), stiffness(lattice.stiffness), damping(lattice.damping) {
  const Vec3 spacing = lattice.size / static_cast<double>(count - 1);
  for (std::size_t which = 0; which < kJelloSprings; ++which) {
    const auto& to = kinds[which].to;
    lengths[which] = spacing.cwiseProduct(Vec3(to[0], to[1], to[2])).norm();
  }
  const auto n = static_cast<std::ptrdiff_t>(count);
  for (std::ptrdiff_t lead = -1; lead <= 2; ++lead) {
    std::vector<double>& row = has[static_cast<std::size_t>(lead + 1)];
    for (std::ptrdiff_t k = 0; k < n; ++k)
      row.push_back(k + lead >= 0 && k + lead < n ? 1.0 : 0.0);
    row.resize(count + kJelloBlock);  // SIMD vectors reach beyond the row
  }
}

const JelloKernel& plainJelloKernel() {
  static const JelloKernel kernel{"plain", addSprings, addWall, sum, accelerate, areWithin};
  return kernel;
}

std::vector<JelloKernel> jelloKernels() {
#if CAROM_SIMD
  std::vector<JelloKernel> all = simdJelloKernels();
#else
  std::vector<JelloKernel> all;
#endif
  all.push_back(plainJelloKernel());
  return all;
}

const JelloKernel& jelloKernel() {
  static const JelloKernel kernel = jelloKernels().front();
  return kernel;
}

}  // namespace carom::native
