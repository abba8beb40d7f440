#include "tests/bench/fma_peak.h"

#include <cstddef>
#include <vector>

#include <benchmark/benchmark.h>

// Targets without a fixed vector size are disabled.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/bench/fma_peak.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace carom::bench::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Runs independent chains: more than two units times their latency, and as many as 16 registers
/// hold.
double work() {
  const hn::CappedTag<double, 8> d;
  constexpr std::size_t kChains = 12;
  constexpr std::size_t kRounds = 20000;
  hn::Vec<decltype(d)> chain[kChains];
  const auto factor = hn::Set(d, 0.5);
  const auto summand = hn::Set(d, 0.25);
  for (std::size_t i = 0; i < kChains; ++i)
    chain[i] = hn::Set(d, static_cast<double>(i));
  for (std::size_t round = 0; round < kRounds; ++round) {
    HWY_UNROLL(16)
    for (std::size_t i = 0; i < kChains; ++i)
      chain[i] = hn::MulAdd(chain[i], factor, summand);
  }
  auto sum = hn::Zero(d);
  for (std::size_t i = 0; i < kChains; ++i)
    sum = hn::Add(sum, chain[i]);
  benchmark::DoNotOptimize(hn::GetLane(sum));
  return static_cast<double>(kRounds * kChains * hn::Lanes(d));
}

FmaPeak fmaPeak() {
  return {hwy::TargetName(HWY_TARGET), HWY_NATIVE_FMA ? work : nullptr};
}

}  // namespace carom::bench::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace carom::bench {

HWY_EXPORT(fmaPeak);

std::span<const FmaPeak> fmaPeaks() {
  static const std::vector<FmaPeak> all = [] {
    std::vector<FmaPeak> found;
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
      hwy::GetChosenTarget().Update(target);
      if (const FmaPeak peak = HWY_DYNAMIC_DISPATCH(fmaPeak)(); peak.work) found.push_back(peak);
    }
    hwy::GetChosenTarget().DeInit();
    return found;
  }();
  return all;
}

}  // namespace carom::bench
#endif
