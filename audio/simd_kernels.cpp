#include "audio/simd_kernels.h"

#include <algorithm>

#include "audio/spread_kernel.h"

// Highway compiles what follows once for each instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "audio/simd_kernels.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace carom::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// At most eight lanes: what is padded is padded for that.
using Doubles = hn::CappedTag<double, 8>;
using Indices = hn::RebindToSigned<Doubles>;

constexpr double kHalfWidth = 0.5 * static_cast<double>(kSpreadWidth);
constexpr double kPhases = static_cast<double>(SpreadTable::kPhases);

void place(std::span<const PulseNode> nodes, const ClickTrack& track, PlacedNodes& placed) {
  const Doubles d;
  const Indices di;
  const std::size_t lanes = hn::Lanes(d);
  const auto phases = hn::Set(d, kPhases);
  const auto one = hn::Set(d, 1.0);
  for (std::size_t i = 0; i < nodes.size(); i += lanes) {
    hn::Vec<Doubles> u;
    hn::Vec<Doubles> weight;
    hn::LoadInterleaved2(d, &nodes[i].u, u, weight);
    const auto far = hn::MulAdd(u, hn::Set(d, track.bend), hn::Set(d, track.length));
    const auto left = hn::MulAdd(u, far, hn::Set(d, track.start - kHalfWidth));
    const auto gain = hn::MulAdd(hn::MulAdd(u, hn::Set(d, track.curve), hn::Set(d, track.slope)), u,
                                 hn::Set(d, track.gain));
    const auto first = hn::Ceil(left);
    const auto phase = hn::Mul(hn::Sub(first, left), phases);  // 0 <= phase < kPhases
    const auto row = hn::Floor(phase);
    const auto between = hn::Sub(phase, row);
    const auto scaled = hn::Mul(weight, gain);
    hn::StoreU(hn::Mul(scaled, hn::Sub(one, between)), d, &placed.weight[i]);
    hn::StoreU(hn::Mul(scaled, between), d, &placed.nextWeight[i]);
    hn::StoreU(hn::ConvertTo(di, first), di, &placed.first[i]);
    hn::StoreU(hn::ConvertTo(di, row), di, &placed.row[i]);
  }
}

// A vector of samples at a time, of all nodes that reach it.
void spread(const PlacedNodes& placed, std::size_t count, std::span<double> x) {
  const Doubles d;
  const auto lanes = static_cast<std::int64_t>(hn::Lanes(d));
  const double* table = SpreadTable::instance().row(0);
  std::size_t begin = 0;
  std::size_t end = 0;
  for (std::int64_t at = 0; at < std::ssize(x); at += lanes) {
    while (begin < count && placed.first[begin] + static_cast<std::int64_t>(kSpreadWidth) <= at)
      ++begin;
    end = std::max(begin, end);
    while (end < count && placed.first[end] < at + lanes)
      ++end;
    auto sum = hn::Zero(d);
    auto nextSum = hn::Zero(d);
    for (std::size_t i = begin; i < end; ++i) {
      const double* row = table + placed.row[i] * static_cast<std::int64_t>(SpreadTable::kStride) +
                          at - placed.first[i];
      sum = hn::MulAdd(hn::Set(d, placed.weight[i]), hn::LoadU(d, row), sum);
      nextSum = hn::MulAdd(hn::Set(d, placed.nextWeight[i]),
                           hn::LoadU(d, row + SpreadTable::kStride), nextSum);
    }
    hn::StoreU(hn::Add(sum, nextSum), d, x.data() + at);
  }
}

void add(std::span<const double> from, double gain, double* HWY_RESTRICT to) {
  const Doubles d;
  const std::size_t lanes = hn::Lanes(d);
  const auto factor = hn::Set(d, gain);
  const std::size_t whole = from.size() - from.size() % lanes;
  for (std::size_t i = 0; i < whole; i += lanes)
    hn::StoreU(hn::MulAdd(factor, hn::LoadU(d, &from[i]), hn::LoadU(d, to + i)), d, to + i);
  if (whole == from.size()) return;
  const auto rest = hn::FirstN(d, from.size() - whole);
  const auto sum =
      hn::MulAdd(factor, hn::MaskedLoad(rest, d, &from[whole]), hn::LoadU(d, to + whole));
  hn::BlendedStore(sum, rest, d, to + whole);
}

// Four vectors of samples at a time, each sample's sum in the order of the taps.
void filter(const double* HWY_RESTRICT from, std::span<const double> taps, double* HWY_RESTRICT to,
            std::size_t count) {
  const Doubles d;
  const std::size_t lanes = hn::Lanes(d);
  for (std::size_t at = 0; at < count; at += 4 * lanes) {
    auto sum0 = hn::Zero(d);
    auto sum1 = hn::Zero(d);
    auto sum2 = hn::Zero(d);
    auto sum3 = hn::Zero(d);
    const double* input = from + at;
    for (const double tap : taps) {
      const auto weight = hn::Set(d, tap);
      sum0 = hn::MulAdd(weight, hn::LoadU(d, input), sum0);
      sum1 = hn::MulAdd(weight, hn::LoadU(d, input + lanes), sum1);
      sum2 = hn::MulAdd(weight, hn::LoadU(d, input + 2 * lanes), sum2);
      sum3 = hn::MulAdd(weight, hn::LoadU(d, input + 3 * lanes), sum3);
      --input;
    }
    double sums[4 * 8];
    hn::StoreU(sum0, d, sums);
    hn::StoreU(sum1, d, sums + lanes);
    hn::StoreU(sum2, d, sums + 2 * lanes);
    hn::StoreU(sum3, d, sums + 3 * lanes);
    const std::size_t here = std::min(4 * lanes, count - at);
    for (std::size_t i = 0; i < here; ++i)
      to[at + i] += sums[i];
  }
}

ClickKernels kernels() {
  return {hwy::TargetName(HWY_TARGET), place, spread, add, filter};
}

}  // namespace carom::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace carom {

HWY_EXPORT(kernels);

std::vector<ClickKernels> simdKernels() {
  std::vector<ClickKernels> all;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::GetChosenTarget().Update(target);
    all.push_back(HWY_DYNAMIC_DISPATCH(kernels)());
  }
  hwy::GetChosenTarget().DeInit();
  return all;
}

}  // namespace carom
#endif
