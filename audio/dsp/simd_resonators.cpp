#include "audio/dsp/simd_resonators.h"

#include <algorithm>
#include <cassert>

// Targets whose vectors have no known size are left out, as arrays of vectors are kept in
// registers: on ARM that leaves NEON.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
// Highway compiles what follows once for each instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "audio/dsp/simd_resonators.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace carom::audio::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr std::size_t kWidth = ResonatorKernels::kWidth;
using Doubles = hn::CappedTag<double, kWidth>;
using Vector = hn::Vec<Doubles>;
constexpr std::size_t kLanes = hn::MaxLanes(Doubles());
/// Number of vectors in a group of kWidth resonators.
constexpr std::size_t kParts = kWidth / kLanes;
/// Samples computed at a time: few enough for their partial sums to stay in the fastest cache.
constexpr std::size_t kBlock = 128;
/// Vectors computed at a time: while one waits for its own last sample, the others fill the time.
constexpr std::size_t kInterleaved = 4;

/// The partial sums of a block.
struct alignas(64) PartialSums {
  double at[kBlock][kWidth];
};

/// The constants of kVectors vectors of resonators; b0 and b1 only where there is an input.
template <std::size_t kVectors>
struct Coefficients {
  Vector a1[kVectors];
  Vector a2[kVectors];
  Vector b0[kVectors];
  Vector b1[kVectors];
};

template <bool kDriven, std::size_t kVectors>
HWY_INLINE void load(const Resonators& r, const ResonatorInput& in, std::size_t first,
                     Coefficients<kVectors>& c) {
  const Doubles d;
  HWY_UNROLL(16)
  for (std::size_t i = 0; i < kVectors; ++i) {
    const std::size_t at = first + i * kLanes;
    c.a1[i] = hn::LoadU(d, r.a1 + at);
    c.a2[i] = hn::LoadU(d, r.a2 + at);
    if constexpr (kDriven) {
      c.b0[i] = hn::LoadU(d, in.b0 + at);
      c.b1[i] = hn::LoadU(d, in.b1 + at);
    }
  }
}

/// Returns the part of a sample that does not depend on the one before, for which it has to wait.
template <bool kDriven, std::size_t kVectors>
HWY_INLINE Vector known(const Coefficients<kVectors>& c, std::size_t i, Vector y2, Vector x0,
                        Vector x1) {
  if constexpr (kDriven)
    return hn::MulAdd(c.a2[i], y2, hn::MulAdd(c.b0[i], x0, hn::Mul(c.b1[i], x1)));
  else
    return hn::Mul(c.a2[i], y2);
}

/// Advances by one sample. With kBegin the partial sums start from 0.
template <bool kDriven, bool kBegin, std::size_t kVectors>
HWY_INLINE void step(const Coefficients<kVectors>& c, const double* x, Vector (&y1)[kVectors],
                     Vector (&y2)[kVectors], double* sums) {
  const Doubles d;
  const Vector x0 = kDriven ? hn::Set(d, *x) : hn::Zero(d);
  const Vector x1 = kDriven ? hn::Set(d, *(x - 1)) : hn::Zero(d);
  Vector sum[kParts];
  HWY_UNROLL(16)
  for (std::size_t part = 0; part < kParts; ++part)
    sum[part] = kBegin ? hn::Zero(d) : hn::LoadU(d, sums + part * kLanes);
  HWY_UNROLL(16)
  for (std::size_t i = 0; i < kVectors; ++i) {
    const Vector y = hn::MulAdd(c.a1[i], y1[i], known<kDriven>(c, i, y2[i], x0, x1));
    y2[i] = y1[i];
    y1[i] = y;
    sum[i % kParts] = hn::Add(sum[i % kParts], y);
  }
  HWY_UNROLL(16)
  for (std::size_t part = 0; part < kParts; ++part)
    hn::StoreU(sum[part], d, sums + part * kLanes);
}

/// Advances kGroups groups of resonators, from `first` on, through a block: in registers, as far as
/// there are enough.
template <bool kDriven, bool kBegin, std::size_t kGroups>
void advance(const Resonators& r, const ResonatorInput& in, std::size_t first, std::size_t frames,
             PartialSums& sums) {
  const Doubles d;
  constexpr std::size_t kVectors = kGroups * kParts;
  Coefficients<kVectors> c;
  Vector y1[kVectors];
  Vector y2[kVectors];
  load<kDriven>(r, in, first, c);
  HWY_UNROLL(16)
  for (std::size_t i = 0; i < kVectors; ++i) {
    y1[i] = hn::LoadU(d, r.y1 + first + i * kLanes);
    y2[i] = hn::LoadU(d, r.y2 + first + i * kLanes);
  }
  std::size_t n = 0;
  for (; n + 1 < frames; n += 2) {  // two by two, so that y2 becomes y1 without being moved
    step<kDriven, kBegin>(c, kDriven ? in.x + n : nullptr, y1, y2, sums.at[n]);
    step<kDriven, kBegin>(c, kDriven ? in.x + n + 1 : nullptr, y1, y2, sums.at[n + 1]);
  }
  if (n < frames) step<kDriven, kBegin>(c, kDriven ? in.x + n : nullptr, y1, y2, sums.at[n]);
  HWY_UNROLL(16)
  for (std::size_t i = 0; i < kVectors; ++i) {
    hn::StoreU(y1[i], d, r.y1 + first + i * kLanes);
    hn::StoreU(y2[i], d, r.y2 + first + i * kLanes);
  }
}

/// The sum of a sample's partial sums, in the order of the plain kernels.
double total(const double* at) {
  static_assert(kWidth == 8);
  return ((at[0] + at[4]) + (at[2] + at[6])) + ((at[1] + at[5]) + (at[3] + at[7]));
}

#if HWY_TARGET != HWY_SCALAR
using Few = hn::CappedTag<double, 4>;
constexpr std::size_t kFew = hn::MaxLanes(Few());

/// Reduces the partial sums of sample n to two sums; with four lanes, those of sample n + 2 too.
HWY_INLINE hn::Vec<Few> halves(const PartialSums& sums, std::size_t n) {
  const Few d;
  const auto folded = [d](const double* at) {
    return hn::Add(hn::LoadU(d, at), hn::LoadU(d, at + kWidth / 2));
  };
  if constexpr (kFew == 4) {
    const auto here = folded(sums.at[n]);
    const auto there = folded(sums.at[n + 2]);
    return hn::Add(hn::ConcatLowerLower(d, there, here), hn::ConcatUpperUpper(d, there, here));
  } else {
    return hn::Add(folded(sums.at[n]), folded(sums.at[n] + 2));
  }
}
#endif

/// Adds up the partial sums of each sample, for several samples at a time.
void collect(const PartialSums& sums, std::span<double> out) {
  std::size_t n = 0;
#if HWY_TARGET != HWY_SCALAR
  const Few d;
  for (; n + kFew <= out.size(); n += kFew) {
    const auto even = halves(sums, n);
    const auto odd = halves(sums, n + 1);
    const auto sum = hn::Add(hn::InterleaveLower(d, even, odd), hn::InterleaveUpper(d, even, odd));
    hn::StoreU(hn::Add(hn::LoadU(d, &out[n]), sum), d, &out[n]);
  }
#endif
  for (; n < out.size(); ++n)
    out[n] += total(sums.at[n]);
}

/// Advances at most kMost groups from `first` on; returns where the next group begins.
template <bool kDriven, bool kBegin, std::size_t kMost>
std::size_t advanceSome(const Resonators& r, const ResonatorInput& in, std::size_t first,
                        std::size_t frames, PartialSums& sums) {
  if constexpr (kMost > 1) {
    if (r.count - first < kMost * kWidth)
      return advanceSome<kDriven, kBegin, kMost - 1>(r, in, first, frames, sums);
  }
  advance<kDriven, kBegin, kMost>(r, in, first, frames, sums);
  return first + kMost * kWidth;
}

template <bool kDriven>
void render(const Resonators& r, ResonatorInput in, std::span<double> out) {
  assert(r.count % kWidth == 0);
  if (r.count == 0) return;
  constexpr std::size_t kGroups = std::max(kInterleaved / kParts, std::size_t{1});
  PartialSums sums;
  while (!out.empty()) {
    const std::size_t frames = std::min(out.size(), kBlock);
    std::size_t first = advanceSome<kDriven, true, kGroups>(r, in, 0, frames, sums);
    while (first < r.count)
      first = advanceSome<kDriven, false, kGroups>(r, in, first, frames, sums);
    collect(sums, out.first(frames));
    out = out.subspan(frames);
    if (kDriven) in.x += frames;
  }
}

void ring(const Resonators& r, std::span<double> out) {
  render<false>(r, {}, out);
}

void drive(const Resonators& r, const ResonatorInput& in, std::span<double> out) {
  render<true>(r, in, out);
}

// The formula is explained at the plain version in resonator_kernels.cpp.
std::size_t flush(const Resonators& r, double threshold) {
  const Doubles d;
  const auto square = hn::Set(d, threshold * threshold);
  const auto minusFour = hn::Set(d, -4.0);
  std::size_t ringing = 0;
  for (std::size_t i = 0; i < r.count; i += kLanes) {
    const auto a1 = hn::LoadU(d, r.a1 + i);
    const auto a2 = hn::LoadU(d, r.a2 + i);
    const auto y1 = hn::LoadU(d, r.y1 + i);
    const auto y2 = hn::LoadU(d, r.y2 + i);
    const auto fourfold = hn::Mul(minusFour, a2);
    const auto least = hn::Mul(square, hn::NegMulAdd(a1, a1, fourfold));
    const auto left = hn::Mul(y1, hn::NegMulAdd(a1, y2, y1));
    const auto here = hn::Mul(fourfold, hn::NegMulAdd(hn::Mul(a2, y2), y2, left));
    const auto rings = hn::Gt(here, least);
    ringing += hn::CountTrue(d, rings);
    hn::StoreU(hn::IfThenElseZero(rings, y1), d, r.y1 + i);
    hn::StoreU(hn::IfThenElseZero(rings, y2), d, r.y2 + i);
  }
  return ringing;
}

double turn(const TurningModes& modes, double push) {
  assert(modes.count % kWidth == 0);
  const TurningModes m = modes;  // where the compiler sees that stores leave it alone
  const Doubles d;
  const auto pushed = hn::Set(d, push);
  Vector sum[kParts];
  HWY_UNROLL(16)
  for (std::size_t part = 0; part < kParts; ++part)
    sum[part] = hn::Zero(d);
  for (std::size_t first = 0; first < m.count; first += kWidth) {
    HWY_UNROLL(16)
    for (std::size_t part = 0; part < kParts; ++part) {
      const std::size_t i = first + part * kLanes;
      const auto turnRe = hn::LoadU(d, m.turnRe + i);
      const auto turnIm = hn::LoadU(d, m.turnIm + i);
      const auto oldRe = hn::LoadU(d, m.re + i);
      const auto oldIm = hn::LoadU(d, m.im + i);
      // The push comes last, as the force is known last.
      const auto freeRe = hn::NegMulAdd(turnIm, oldIm, hn::Mul(turnRe, oldRe));
      const auto freeIm = hn::MulAdd(turnIm, oldRe, hn::Mul(turnRe, oldIm));
      const auto re = hn::MulAdd(pushed, hn::LoadU(d, m.pushRe + i), freeRe);
      const auto im = hn::MulAdd(pushed, hn::LoadU(d, m.pushIm + i), freeIm);
      hn::StoreU(re, d, m.re + i);
      hn::StoreU(im, d, m.im + i);
      sum[part] = hn::MulAdd(hn::LoadU(d, m.giveRe + i), im, sum[part]);
      sum[part] = hn::MulAdd(hn::LoadU(d, m.giveIm + i), re, sum[part]);
    }
  }
  double sums[kWidth];
  HWY_UNROLL(16)
  for (std::size_t part = 0; part < kParts; ++part)
    hn::StoreU(sum[part], d, sums + part * kLanes);
  return total(sums);
}

ResonatorKernels resonatorKernels() {
  return {hwy::TargetName(HWY_TARGET), ring, drive, flush, turn};
}

}  // namespace carom::audio::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace carom::audio {

HWY_EXPORT(resonatorKernels);

std::vector<ResonatorKernels> simdResonators() {
#if (HWY_TARGETS & (HWY_TARGETS - 1)) == 0  // one, so that Highway's library has nothing to choose
  return {HWY_STATIC_DISPATCH(resonatorKernels)()};
#else
  std::vector<ResonatorKernels> all;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::GetChosenTarget().Update(target);
    all.push_back(HWY_DYNAMIC_DISPATCH(resonatorKernels)());
  }
  hwy::GetChosenTarget().DeInit();
  return all;
#endif
}

}  // namespace carom::audio
#endif
