#include "audio/synthesis/simd_kernels.h"

#include <algorithm>
#include <bit>

#include "audio/dsp/spread_kernel.h"

// Highway compiles what follows once for each instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "audio/synthesis/simd_kernels.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace carom::audio::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr std::size_t kMostLanes = ClickKernels::kMostLanes;
using Doubles = hn::CappedTag<double, kMostLanes>;
using Indices = hn::RebindToSigned<Doubles>;

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
    const auto left = hn::MulAdd(u, far, hn::Set(d, track.start - kSpreadHalfWidth));
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

// Rows may start at any sample, vectors only at multiples of their length. So there is a buffer for
// each place within a vector at which a row may start: vectors are loaded from it exactly as they
// were stored, which is fast. Nodes whose rows start at the same sample are summed before. In the
// end the buffers are summed, each shifted by its place.
void spread(PlacedNodes& placed, std::size_t count, std::span<double> x) {
  const Doubles d;
  const std::size_t lanes = hn::Lanes(d);
  const double* table = SpreadTable::instance().row(0);
  // Each buffer has `lanes` zeros in front.
  const std::size_t length = (x.size() + kSpreadWidth + lanes) / lanes * lanes + lanes;
  double* const parts = placed.partial.data() + lanes;
  std::uint32_t used = 0;
  for (std::size_t i = 0; i < count; ++i)
    used |= 1U << (static_cast<std::size_t>(placed.first[i]) % lanes);
  for (std::uint32_t left = used; left != 0; left &= left - 1) {
    double* part = parts + static_cast<std::size_t>(std::countr_zero(left)) * length - lanes;
    for (std::size_t n = 0; n < length; n += lanes)
      hn::StoreU(hn::Zero(d), d, part + n);
  }
  for (std::size_t i = 0; i < count;) {
    const auto start = static_cast<std::size_t>(placed.first[i]);
    const std::size_t place = start % lanes;
    double* to = parts + place * length + start - place;
    std::size_t end = i + 1;
    while (end < count && placed.first[end] == placed.first[i])
      ++end;
    for (std::size_t n = 0; n < kSpreadWidth; n += 2 * lanes) {
      auto sum0 = hn::LoadU(d, to + n);
      auto sum1 = hn::LoadU(d, to + n + lanes);
      for (std::size_t node = i; node < end; ++node) {
        const double* row =
            table + static_cast<std::size_t>(placed.row[node]) * SpreadTable::kStride + n;
        const auto weight = hn::Set(d, placed.weight[node]);
        const auto nextWeight = hn::Set(d, placed.nextWeight[node]);
        sum0 = hn::MulAdd(weight, hn::Load(d, row), sum0);
        sum1 = hn::MulAdd(weight, hn::Load(d, row + lanes), sum1);
        sum0 = hn::MulAdd(nextWeight, hn::Load(d, row + SpreadTable::kStride), sum0);
        sum1 = hn::MulAdd(nextWeight, hn::Load(d, row + SpreadTable::kStride + lanes), sum1);
      }
      hn::StoreU(sum0, d, to + n);
      hn::StoreU(sum1, d, to + n + lanes);
    }
    i = end;
  }
  for (std::size_t at = 0; at < x.size(); at += lanes) {
    auto sum = hn::Zero(d);
    for (std::uint32_t left = used; left != 0; left &= left - 1) {
      const auto place = static_cast<std::size_t>(std::countr_zero(left));
      sum = hn::Add(sum, hn::LoadU(d, parts + place * length + at - place));
    }
    hn::StoreU(sum, d, x.data() + at);
  }
}

void sample(const ForceTable& force, const ClickTrack& track, SampleRange range, Raster& raster) {
  const Doubles d;
  const Indices di;
  const hn::Rebind<float, Doubles> df;
  const hn::Rebind<std::uint32_t, Doubles> du32;
  const std::size_t lanes = hn::Lanes(d);
  const auto* const cells = reinterpret_cast<const std::int64_t*>(force.cells.data());
  const auto last = hn::Set(d, static_cast<double>(force.cells.size()));
  const auto one = hn::Set(d, 1.0);
  const auto curl = hn::Set(d, track.bend / track.length);
  const auto perSample = hn::Set(d, 1.0 / track.length);
  const auto perHalf = hn::Set(d, 0.5 / track.length);
  for (std::size_t m = 0; m < Raster::kRows; ++m) {
    const double from = 0.5 * static_cast<double>(m) - track.start;
    for (std::size_t n = range.begin; n < range.end; n += lanes) {
      const auto w = hn::Mul(hn::Iota(d, static_cast<double>(n) + from), perSample);
      const auto bent = hn::Mul(curl, w);
      const auto u =
          hn::Mul(w, hn::NegMulAdd(bent, hn::NegMulAdd(hn::Set(d, 2.0), bent, one), one));
      const auto rate = hn::Mul(
          perHalf, hn::NegMulAdd(bent, hn::NegMulAdd(hn::Set(d, 6.0), bent, hn::Set(d, 2.0)), one));
      const auto place = hn::Mul(hn::Sub(u, hn::Set(d, force.begin)), hn::Set(d, force.scale));
      const auto inside = hn::And(hn::Ge(place, hn::Zero(d)), hn::Lt(place, last));
      const auto cell = hn::Floor(hn::IfThenElseZero(inside, place));
      // Both numbers of a cell are gathered at once.
      const auto both = hn::BitCast(hn::RebindToUnsigned<Indices>(),
                                    hn::GatherIndex(di, cells, hn::ConvertTo(di, cell)));
      const auto value = hn::PromoteTo(d, hn::BitCast(df, hn::TruncateTo(du32, both)));
      const auto rise =
          hn::PromoteTo(d, hn::BitCast(df, hn::TruncateTo(du32, hn::ShiftRight<32>(both))));
      const auto gain = hn::MulAdd(hn::MulAdd(u, hn::Set(d, track.curve), hn::Set(d, track.slope)),
                                   u, hn::Set(d, track.gain));
      const auto share = hn::Sub(place, cell);
      const auto density = hn::Mul(hn::MulAdd(rise, share, value), hn::Mul(gain, rate));
      hn::StoreU(hn::IfThenElseZero(inside, density), d, raster.row(m) + n);
    }
  }
}

void collect(const Raster& raster, std::span<double> x) {
  const Doubles d;
  const std::size_t lanes = hn::Lanes(d);
  const RasterTaps& taps = rasterTaps();
  for (std::size_t at = 0; at < x.size(); at += 2 * lanes) {
    auto sum0 = hn::Zero(d);
    auto sum1 = hn::Zero(d);
    auto half0 = hn::Zero(d);
    auto half1 = hn::Zero(d);
    const double* const whole = raster.row(0) + at + kRasterCentre;
    const double* const between = raster.row(1) + at + kRasterCentre;
    for (std::size_t q = 0; q < kSpreadWidth; ++q) {
      const auto weight = hn::Set(d, taps[0][q]);
      const auto halfWeight = hn::Set(d, taps[1][q]);
      sum0 = hn::MulAdd(weight, hn::LoadU(d, whole - q), sum0);
      sum1 = hn::MulAdd(weight, hn::LoadU(d, whole - q + lanes), sum1);
      half0 = hn::MulAdd(halfWeight, hn::LoadU(d, between - q), half0);
      half1 = hn::MulAdd(halfWeight, hn::LoadU(d, between - q + lanes), half1);
    }
    hn::StoreU(hn::Add(sum0, half0), d, x.data() + at);
    hn::StoreU(hn::Add(sum1, half1), d, x.data() + at + lanes);
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
  // The rest goes through a whole vector, as a masked load may read the elements that it leaves
  // out.
  double rest[kMostLanes] = {};
  std::ranges::copy(from.subspan(whole), rest);
  hn::StoreU(hn::MulAdd(factor, hn::LoadU(d, rest), hn::LoadU(d, to + whole)), d, rest);
  std::copy_n(rest, from.size() - whole, to + whole);
}

// Filters four vectors of samples at a time. Each sample is the sum over its inputs in their order;
// the loop is over inputs where these are few, and over taps where they are many: the products are
// the same, but for zeros.
void filter(const PaddedTaps& taps, const double* HWY_RESTRICT from, HeldInput held,
            std::span<double> to) {
  const Doubles d;
  const auto lanes = static_cast<std::ptrdiff_t>(hn::Lanes(d));
  constexpr auto kTaps = static_cast<std::ptrdiff_t>(PaddedTaps::kTaps);
  const double* const first = taps.first();
  for (std::ptrdiff_t at = 0; at < std::ssize(to); at += 4 * lanes) {
    auto sum0 = hn::Zero(d);
    auto sum1 = hn::Zero(d);
    auto sum2 = hn::Zero(d);
    auto sum3 = hn::Zero(d);
    const std::ptrdiff_t begin = std::max(held.begin, at - kTaps + 1);
    const std::ptrdiff_t end = std::min(held.end, at + 4 * lanes);
    const auto step = [&](double factor, const double* values) {
      const auto weight = hn::Set(d, factor);
      sum0 = hn::MulAdd(weight, hn::LoadU(d, values), sum0);
      sum1 = hn::MulAdd(weight, hn::LoadU(d, values + lanes), sum1);
      sum2 = hn::MulAdd(weight, hn::LoadU(d, values + 2 * lanes), sum2);
      sum3 = hn::MulAdd(weight, hn::LoadU(d, values + 3 * lanes), sum3);
    };
    if (end - begin < kTaps) {
      for (std::ptrdiff_t i = begin; i < end; ++i)
        step(from[i], first + at - i);
    } else {
      for (std::ptrdiff_t tap = kTaps - 1; tap >= 0; --tap)
        step(first[tap], from + at - tap);
    }
    double sums[4 * kMostLanes];
    hn::StoreU(sum0, d, sums);
    hn::StoreU(sum1, d, sums + lanes);
    hn::StoreU(sum2, d, sums + 2 * lanes);
    hn::StoreU(sum3, d, sums + 3 * lanes);
    const auto here = static_cast<std::size_t>(std::min(4 * lanes, std::ssize(to) - at));
    for (std::size_t i = 0; i < here; ++i)
      to[static_cast<std::size_t>(at) + i] += sums[i];
  }
}

// Convolves as `filter` does, but with any number of taps, without zeros around them.
void convolve(std::span<const double> taps, const double* HWY_RESTRICT from, std::span<double> to) {
  const Doubles d;
  const std::size_t lanes = hn::Lanes(d);
  for (std::size_t at = 0; at < to.size(); at += 4 * lanes) {
    auto sum0 = hn::Zero(d);
    auto sum1 = hn::Zero(d);
    auto sum2 = hn::Zero(d);
    auto sum3 = hn::Zero(d);
    for (std::size_t tap = taps.size(); tap-- > 0;) {
      const auto weight = hn::Set(d, taps[tap]);
      const double* input = from + at - tap;
      sum0 = hn::MulAdd(weight, hn::LoadU(d, input), sum0);
      sum1 = hn::MulAdd(weight, hn::LoadU(d, input + lanes), sum1);
      sum2 = hn::MulAdd(weight, hn::LoadU(d, input + 2 * lanes), sum2);
      sum3 = hn::MulAdd(weight, hn::LoadU(d, input + 3 * lanes), sum3);
    }
    double sums[4 * kMostLanes];
    hn::StoreU(sum0, d, sums);
    hn::StoreU(sum1, d, sums + lanes);
    hn::StoreU(sum2, d, sums + 2 * lanes);
    hn::StoreU(sum3, d, sums + 3 * lanes);
    const std::size_t here = std::min(4 * lanes, to.size() - at);
    for (std::size_t i = 0; i < here; ++i)
      to[at + i] = sums[i];
  }
}

ClickKernels kernels() {
  return {hwy::TargetName(HWY_TARGET), place, spread, sample, collect, add, filter, convolve};
}

}  // namespace carom::audio::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace carom::audio {

HWY_EXPORT(kernels);

std::vector<ClickKernels> simdKernels() {
#if (HWY_TARGETS & (HWY_TARGETS - 1)) == 0  // one, so that Highway's library has nothing to choose
  return {HWY_STATIC_DISPATCH(kernels)()};
#else
  std::vector<ClickKernels> all;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::GetChosenTarget().Update(target);
    all.push_back(HWY_DYNAMIC_DISPATCH(kernels)());
  }
  hwy::GetChosenTarget().DeInit();
  return all;
#endif
}

}  // namespace carom::audio
#endif
