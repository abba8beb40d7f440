#include "native/jello/simd_jello.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include "native/math/fused.h"

// Highway compiles this file once for each instruction set. SIMD vectors of unknown length would
// not fit into the slack.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "native/jello/simd_jello.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace carom::native::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Doubles = hn::CappedTag<double, kJelloBlock>;
using Bits = hn::RebindToUnsigned<Doubles>;
using Vector = hn::Vec<Doubles>;

struct Vectors {
  Vector x;
  Vector y;
  Vector z;
};

HWY_INLINE Vectors loadedFrom(const std::array<const double*, 3>& arrays, std::ptrdiff_t at) {
  const Doubles d;
  return {hn::LoadU(d, arrays[0] + at), hn::LoadU(d, arrays[1] + at), hn::LoadU(d, arrays[2] + at)};
}

HWY_INLINE Vectors minus(const Vectors& a, const Vectors& b) {
  return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}

HWY_INLINE Vector dot(const Vectors& a, const Vectors& b) {
  return hn::MulAdd(a.z, b.z, hn::MulAdd(a.y, b.y, hn::Mul(a.x, b.x)));
}

HWY_INLINE Vector inverseRoot(Vector x) {
  const Doubles d;
  const Bits bits;
  const auto one = hn::Set(d, 1.0);
  Vector y = hn::BitCast(
      d, hn::Sub(hn::Set(bits, kInverseRootBits), hn::ShiftRight<1>(hn::BitCast(bits, x))));
  const Vector first = hn::NegMulAdd(hn::Mul(x, y), y, one);
  const auto& [c0, c1, c2] = kInverseRootSeed;
  y = hn::Mul(y,
              hn::MulAdd(hn::MulAdd(hn::Set(d, c2), first, hn::Set(d, c1)), first, hn::Set(d, c0)));
  const Vector second = hn::NegMulAdd(hn::Mul(x, y), y, one);
  return hn::MulAdd(hn::Mul(y, second), hn::MulAdd(hn::Set(d, 0.375), second, hn::Set(d, 0.5)), y);
}

template <bool kIsDamped>
HWY_INLINE Vectors pushOf(const JelloSprings& springs, Vector pull, const double* has,
                          const Vectors& away, const Vectors& speed) {
  const Doubles d;
  const Vector inverse = inverseRoot(dot(away, away));
  Vector strength = hn::MulSub(pull, inverse, hn::Set(d, springs.stiffness));
  if constexpr (kIsDamped)
    strength = hn::NegMulAdd(hn::Set(d, springs.damping),
                             hn::Mul(hn::Mul(dot(speed, away), inverse), inverse), strength);
  strength = hn::Mul(strength, hn::LoadU(d, has));
  return {hn::Mul(away.x, strength), hn::Mul(away.y, strength), hn::Mul(away.z, strength)};
}

/// Calls `put(k, push)` for the springs of one kind from the row at `a` to the row at `b`; k is the
/// first point in the row of a vector of pushes.
template <bool kIsDamped, typename Put>
HWY_INLINE void forRow(const JelloSprings& springs, const JelloArrays& arrays, std::size_t which,
                       std::ptrdiff_t a, std::ptrdiff_t b, Put put) {
  const Doubles d;
  const auto lanes = static_cast<std::ptrdiff_t>(hn::Lanes(d));
  const auto n = static_cast<std::ptrdiff_t>(springs.count);
  const Vector pull = hn::Set(d, springs.stiffness * springs.lengths[which]);
  const double* has = springs.hasOf(which);
  for (std::ptrdiff_t k = 0; k < n; k += lanes) {
    const Vectors away =
        minus(loadedFrom(arrays.positions, a + k), loadedFrom(arrays.positions, b + k));
    const Vectors speed = kIsDamped ? minus(loadedFrom(arrays.velocities, a + k),
                                            loadedFrom(arrays.velocities, b + k))
                                    : away;
    put(k, pushOf<kIsDamped>(springs, pull, has + k, away, speed));
  }
}

HWY_INLINE void add(const Vectors& push, const std::array<double*, 3>& forces, std::ptrdiff_t at) {
  const Doubles d;
  hn::StoreU(hn::Add(hn::LoadU(d, forces[0] + at), push.x), d, forces[0] + at);
  hn::StoreU(hn::Add(hn::LoadU(d, forces[1] + at), push.y), d, forces[1] + at);
  hn::StoreU(hn::Add(hn::LoadU(d, forces[2] + at), push.z), d, forces[2] + at);
}

HWY_INLINE void subtract(const Vectors& push, const std::array<double*, 3>& forces,
                         std::ptrdiff_t at) {
  const Doubles d;
  hn::StoreU(hn::Sub(hn::LoadU(d, forces[0] + at), push.x), d, forces[0] + at);
  hn::StoreU(hn::Sub(hn::LoadU(d, forces[1] + at), push.y), d, forces[1] + at);
  hn::StoreU(hn::Sub(hn::LoadU(d, forces[2] + at), push.z), d, forces[2] + at);
}

/// Adds the springs along the rows of a plane. Both ends of a spring are in one row: so first all
/// pushes of some rows are computed, then added to all first ends, then to the others.
template <bool kIsDamped>
void addAlong(const JelloSprings& springs, const JelloArrays& arrays, std::size_t which,
              std::ptrdiff_t plane) {
  constexpr std::ptrdiff_t kRows = 8;
  constexpr std::size_t kLength = kMostJelloPoints + kJelloBlock;
  const Doubles d;
  const auto lanes = static_cast<std::ptrdiff_t>(hn::Lanes(d));
  const auto n = static_cast<std::ptrdiff_t>(springs.count);
  const std::ptrdiff_t lead = springs.kinds[which].to[2];
  double pushes[kRows][3][kLength];
  for (std::ptrdiff_t first = 0; first < n; first += kRows) {
    const std::ptrdiff_t rows = std::min(kRows, n - first);
    for (std::ptrdiff_t j = 0; j < rows; ++j) {
      const std::ptrdiff_t a = plane + (first + j) * n;
      forRow<kIsDamped>(springs, arrays, which, a, a + lead,
                        [&](std::ptrdiff_t k, const Vectors& push) {
                          hn::StoreU(push.x, d, pushes[j][0] + k);
                          hn::StoreU(push.y, d, pushes[j][1] + k);
                          hn::StoreU(push.z, d, pushes[j][2] + k);
                        });
    }
    const auto pushAt = [&](std::ptrdiff_t j, std::ptrdiff_t k) {
      return Vectors{hn::LoadU(d, pushes[j][0] + k), hn::LoadU(d, pushes[j][1] + k),
                     hn::LoadU(d, pushes[j][2] + k)};
    };
    for (std::ptrdiff_t j = 0; j < rows; ++j)
      for (std::ptrdiff_t k = 0; k < n; k += lanes)
        add(pushAt(j, k), arrays.forces, plane + (first + j) * n + k);
    for (std::ptrdiff_t j = 0; j < rows; ++j)
      for (std::ptrdiff_t k = 0; k < n; k += lanes)
        subtract(pushAt(j, k), arrays.forces, plane + (first + j) * n + k + lead);
  }
}

/// Adds the springs to other rows, in blocks of kJelloBlock points, whatever the width of a SIMD
/// vector, so that each point's sum has one order. Each row is loaded once and its own sums stay in
/// registers; another row is only met again, off by a point, when its earlier stores have gone
/// through.
template <bool kIsDamped>
void addAcross(const JelloSprings& springs, const JelloArrays& arrays, std::ptrdiff_t i,
               std::ptrdiff_t j) {
  const Doubles d;
  constexpr auto kLanes = static_cast<std::ptrdiff_t>(hn::MaxLanes(Doubles()));
  constexpr auto kBlock = static_cast<std::ptrdiff_t>(kJelloBlock);
  constexpr std::ptrdiff_t kParts = kBlock / kLanes;
  const auto n = static_cast<std::ptrdiff_t>(springs.count);
  for (std::ptrdiff_t k = 0; k < n; k += kBlock) {
    const std::ptrdiff_t a = (i * n + j) * n + k;
    Vectors positions[kParts];
    Vectors velocities[kParts];
    Vectors sums[kParts];
    for (std::ptrdiff_t part = 0; part < kParts; ++part) {
      positions[part] = loadedFrom(arrays.positions, a + part * kLanes);
      velocities[part] =
          kIsDamped ? loadedFrom(arrays.velocities, a + part * kLanes) : positions[part];
      sums[part] = {hn::Zero(d), hn::Zero(d), hn::Zero(d)};
    }
    for (std::size_t which = 0; which < kJelloSprings; ++which) {
      const auto& to = springs.kinds[which].to;
      if ((to[0] == 0 && to[1] == 0) || i + to[0] >= n || j + to[1] < 0 || j + to[1] >= n) continue;
      const std::ptrdiff_t lead = (to[0] * n + to[1]) * n + to[2];
      const Vector pull = hn::Set(d, springs.stiffness * springs.lengths[which]);
      const double* has = springs.hasOf(which) + k;
      for (std::ptrdiff_t part = 0; part < kParts; ++part) {
        const std::ptrdiff_t b = a + part * kLanes + lead;
        const Vectors away = minus(positions[part], loadedFrom(arrays.positions, b));
        const Vectors speed =
            kIsDamped ? minus(velocities[part], loadedFrom(arrays.velocities, b)) : away;
        const Vectors push = pushOf<kIsDamped>(springs, pull, has + part * kLanes, away, speed);
        Vectors& sum = sums[part];
        sum = {hn::Add(sum.x, push.x), hn::Add(sum.y, push.y), hn::Add(sum.z, push.z)};
        subtract(push, arrays.forces, b);
      }
    }
    for (std::ptrdiff_t part = 0; part < kParts; ++part)
      add(sums[part], arrays.forces, a + part * kLanes);
  }
}

template <bool kIsDamped>
void addAll(const JelloSprings& springs, JelloSlabs slabs, const JelloArrays& arrays) {
  const auto n = static_cast<std::ptrdiff_t>(springs.count);
  const auto end = static_cast<std::ptrdiff_t>(slabs.end);
  for (auto i = static_cast<std::ptrdiff_t>(slabs.begin); i < end; ++i) {
    for (std::size_t which = 0; which < kJelloSprings; ++which)
      if (springs.kinds[which].to[0] == 0 && springs.kinds[which].to[1] == 0)
        addAlong<kIsDamped>(springs, arrays, which, i * n * n);
    for (std::ptrdiff_t j = 0; j < n; ++j)
      addAcross<kIsDamped>(springs, arrays, i, j);
  }
}

void addSprings(const JelloSprings& springs, JelloSlabs slabs, const JelloArrays& arrays) {
  if (springs.damping > 0.0)
    addAll<true>(springs, slabs, arrays);
  else
    addAll<false>(springs, slabs, arrays);
}

/// Adds the terms a SIMD vector at a time, and the last few values one by one: both are exactly
/// rounded, so the bits do not depend on the width.
template <std::size_t kTerms>
void sumOf(const JelloSum& of) {
  const Doubles d;
  Vector factors[kTerms];
  for (std::size_t term = 0; term < kTerms; ++term)
    factors[term] = hn::Set(d, of.factors[term]);
  std::size_t index = 0;
  for (; index + hn::Lanes(d) <= of.count; index += hn::Lanes(d)) {
    Vector total = hn::LoadU(d, of.base + index);
    for (std::size_t term = 0; term < kTerms; ++term)
      total = hn::MulAdd(factors[term], hn::LoadU(d, of.values[term] + index), total);
    hn::StoreU(total, d, of.out + index);
  }
  for (; index < of.count; ++index) {
    double total = of.base[index];
    for (std::size_t term = 0; term < kTerms; ++term)
      total = fused(of.factors[term], of.values[term][index], total);
    of.out[index] = total;
  }
}

void sum(const JelloSum& of) {
  if (of.terms == 1)
    sumOf<1>(of);
  else if (of.terms == 2)
    sumOf<2>(of);
  else if (of.terms == 3)
    sumOf<3>(of);
  else
    sumOf<4>(of);
}

void accelerate(const double* inverseMasses, double gravity, std::size_t count, double* forces) {
  const Doubles d;
  const Vector added = hn::Set(d, gravity);
  std::size_t index = 0;
  for (; index + hn::Lanes(d) <= count; index += hn::Lanes(d))
    hn::StoreU(hn::MulAdd(hn::LoadU(d, forces + index), hn::LoadU(d, inverseMasses + index), added),
               d, forces + index);
  for (; index < count; ++index)
    forces[index] = fused(forces[index], inverseMasses[index], gravity);
}

bool areWithin(const double* values, double middle, double most, std::size_t count) {
  const Doubles d;
  const Vector centre = hn::Set(d, middle);
  const Vector bound = hn::Set(d, most);
  auto good = hn::FirstN(d, hn::Lanes(d));
  std::size_t index = 0;
  for (; index + hn::Lanes(d) <= count; index += hn::Lanes(d))
    good = hn::And(good, hn::Le(hn::Abs(hn::Sub(hn::LoadU(d, values + index), centre)), bound));
  bool rest = hn::AllTrue(d, good);
  for (; index < count; ++index)
    rest = rest && std::abs(values[index] - middle) <= most;
  return rest;
}

void addWall(const JelloWall& wall, std::size_t count, const JelloArrays& arrays) {
  const Doubles d;
  const Vectors normal = {hn::Set(d, wall.normal[0]), hn::Set(d, wall.normal[1]),
                          hn::Set(d, wall.normal[2])};
  for (std::size_t first = 0; first < count; first += hn::Lanes(d)) {
    const auto at = static_cast<std::ptrdiff_t>(first);
    const Vector depth =
        hn::Sub(hn::Set(d, wall.offset), dot(loadedFrom(arrays.positions, at), normal));
    const auto isBeyond = hn::And(hn::Gt(depth, hn::Zero(d)), hn::FirstN(d, count - first));
    if (hn::AllFalse(d, isBeyond)) continue;
    const Vector damped =
        hn::Mul(hn::Set(d, wall.damping), dot(loadedFrom(arrays.velocities, at), normal));
    const Vector push = hn::IfThenElseZero(
        isBeyond, hn::Max(hn::Zero(d), hn::MulSub(hn::Set(d, wall.stiffness), depth, damped)));
    double* const* forces = arrays.forces.data();
    hn::StoreU(hn::MulAdd(push, normal.x, hn::LoadU(d, forces[0] + at)), d, forces[0] + at);
    hn::StoreU(hn::MulAdd(push, normal.y, hn::LoadU(d, forces[1] + at)), d, forces[1] + at);
    hn::StoreU(hn::MulAdd(push, normal.z, hn::LoadU(d, forces[2] + at)), d, forces[2] + at);
  }
}

std::optional<JelloKernel> kernel() {
#if HWY_NATIVE_FMA || defined(__wasm__)  // there the plain kernel rounds twice as well
  return JelloKernel{hwy::TargetName(HWY_TARGET), addSprings, addWall, sum, accelerate, areWithin};
#else
  return std::nullopt;
#endif
}

}  // namespace carom::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace carom::native {

HWY_EXPORT(kernel);

std::vector<JelloKernel> simdJelloKernels() {
#if (HWY_TARGETS & (HWY_TARGETS - 1)) == 0  // one, so that Highway's library has nothing to choose
  const auto only = HWY_STATIC_DISPATCH(kernel)();
  return only ? std::vector<JelloKernel>{*only} : std::vector<JelloKernel>{};
#else
  std::vector<JelloKernel> all;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::GetChosenTarget().Update(target);
    if (const auto one = HWY_DYNAMIC_DISPATCH(kernel)()) all.push_back(*one);
  }
  hwy::GetChosenTarget().DeInit();
  return all;
#endif
}

}  // namespace carom::native
#endif
