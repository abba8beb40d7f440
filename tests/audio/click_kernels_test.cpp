#include "audio/synthesis/click_kernels.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "audio/dsp/spread_kernel.h"

namespace carom {

using namespace audio;

namespace {

constexpr std::size_t kRoom = ClickKernels::kRoom;

class Kernels : public testing::TestWithParam<std::size_t> {
 protected:
  const ClickKernels& kernels() const { return allKernels()[GetParam()]; }
  double uniform() { return std::uniform_real_distribution<double>(-1.0, 1.0)(random_); }
  std::vector<double> noise(std::size_t count) {
    std::vector<double> values(count);
    for (double& value : values)
      value = uniform();
    return values;
  }

 private:
  std::mt19937_64 random_{5};
};

// The expected sum takes each node by itself, from the formula of the kernel and not from its
// table.
TEST_P(Kernels, SpreadPulsesAsTheFormulaDoesUpToTheTablesInterpolation) {
  for (const std::size_t count : {2u, 3u, 8u, 13u, 48u}) {
    for (const double length : {0.01, 0.7, 5.3, 40.0}) {
      std::vector<PulseNode> padded(count + Pulse::kRulePadding, {0.3, 1e9});
      const std::span<PulseNode> nodes = std::span(padded).first(count);
      for (std::size_t i = 0; i < count; ++i)
        nodes[i] = {(static_cast<double>(i) + 0.5 + 0.3 * uniform()) / static_cast<double>(count),
                    1.0 + uniform()};
      const ClickTrack track{.start = 8.0 + 0.5 * (1.0 + uniform()),
                             .length = length,
                             .bend = 0.01 * length,
                             .gain = 3.0,
                             .slope = -0.4,
                             .curve = 0.2};
      const auto samples = static_cast<std::size_t>(std::ceil(track.at(1.0))) + 9;
      PlacedNodes placed;
      placed.reserve(count, samples);
      std::vector<double> x(samples + kRoom, 77.0);
      kernels().place(nodes, track, placed);
      kernels().spread(placed, count, {x.data(), samples});
      for (std::size_t n = 0; n < samples; ++n) {
        double expected = 0.0;
        for (const PulseNode& node : nodes)
          expected += node.weight * track.gainAt(node.u) *
                      spreadKernel(static_cast<double>(n) - track.at(node.u));
        EXPECT_NEAR(x[n], expected, 1e-5 * static_cast<double>(count)) << n;
      }
    }
  }
}

PaddedTaps paddedTaps(const std::vector<double>& taps) {
  PaddedTaps padded;
  std::ranges::copy(taps, padded.first());
  return padded;
}

// Counts of inputs: the filter has two algorithms, one for few inputs and one for many.
constexpr std::size_t kHeld[] = {1, 7, 20, 55, 56, 57, 190};

TEST_P(Kernels, FilterAndConvolveAsTheSumsThatTheyAre) {
  const std::vector<double> taps = noise(PaddedTaps::kTaps);
  for (const std::size_t size : {1u, 7u, 31u, 32u, 33u, 150u}) {
    for (const std::size_t heldSize : kHeld) {
      std::vector<double> from(400, 0.0);
      const std::vector<double> held = noise(heldSize);
      std::ranges::copy(held, from.begin() + 60);
      std::vector<double> filtered = noise(size + kRoom);
      const std::vector<double> before = filtered;
      std::vector<double> convolved(size + kRoom);
      kernels().filter(paddedTaps(taps), &from[100],
                       {-40, static_cast<std::ptrdiff_t>(heldSize) - 40}, {filtered.data(), size});
      kernels().convolve(taps, &from[100], {convolved.data(), size});
      for (std::size_t n = 0; n < size; ++n) {
        double sum = 0.0;
        for (std::size_t k = 0; k < taps.size(); ++k)
          sum += taps[k] * from[100 + n - k];
        EXPECT_NEAR(filtered[n], before[n] + sum, 1e-13) << size << ", " << heldSize << ", " << n;
        EXPECT_NEAR(convolved[n], sum, 1e-13);
      }
      for (std::size_t n = size; n < filtered.size(); ++n)
        EXPECT_EQ(filtered[n], before[n]) << "nothing behind it";
    }
  }
}

// The expected values take each sample by itself, from the pulse and the formula of the kernel,
// without the edges' corrections.
TEST_P(Kernels, SampleAndCollectPulsesAsTheirFormulasDo) {
  const Pulse& pulse = Pulse::of(PulseShape::hertz);
  for (const double length : {10.0, 33.3, 120.0}) {
    const ClickTrack track{.start = 8.0 + 0.5 * (1.0 + uniform()),
                           .length = length,
                           .bend = 9e-4 * length,
                           .gain = 3.0,
                           .slope = -0.4,
                           .curve = 0.2};
    const auto samples = static_cast<std::size_t>(std::ceil(track.at(1.0))) + 9;
    Raster raster;
    raster.reserve(samples);
    raster.clear(samples);
    kernels().sample(pulse.forceTable(), track, {8, samples - 8}, raster);
    std::vector<double> x(samples + kRoom, 77.0);
    kernels().collect(raster, {x.data(), samples});
    std::vector<double> expected(samples, 0.0);
    for (std::size_t half = 16; half < 2 * samples - 16; ++half) {
      const double time = 0.5 * static_cast<double>(half);
      double u = 0.5;  // found by bisection
      for (double step = 0.5; step > 1e-13; step *= 0.5)
        u += track.at(u) < time ? step : -step;
      const double density = track.length + 2.0 * track.bend * u;
      const double value = 0.5 * pulse.force(u) * track.gainAt(u) / density;
      EXPECT_NEAR(raster.row(half % 2)[half / 2], value, 1e-5 / length) << length << " " << time;
      for (std::size_t n = 0; n < samples; ++n)
        expected[n] += raster.row(half % 2)[half / 2] * spreadKernel(static_cast<double>(n) - time);
    }
    for (std::size_t n = 0; n < samples; ++n)
      EXPECT_NEAR(x[n], expected[n], 1e-13) << length << " " << n;
  }
}

TEST_P(Kernels, AddWhatIsThereAndNothingBehindIt) {
  for (const std::size_t size : {1u, 7u, 8u, 31u, 32u, 33u, 256u}) {
    const std::vector<double> from = noise(size);
    std::vector<double> to = noise(size + kRoom);
    const std::vector<double> before = to;
    kernels().add(from, 0.37, to.data());
    for (std::size_t i = 0; i < to.size(); ++i)
      EXPECT_NEAR(to[i], before[i] + (i < size ? 0.37 * from[i] : 0.0), 1e-15) << size;
  }
}

TEST_P(Kernels, GiveASampleTheSameBitsWhereverABufferBegins) {
  const PaddedTaps taps = paddedTaps(noise(PaddedTaps::kTaps));
  std::vector<double> from(600, 0.0);
  std::ranges::copy(noise(180), from.begin() + 60);
  std::vector<double> whole(256);
  kernels().filter(taps, &from[100], {-40, 140}, whole);
  for (const std::size_t begin : {1u, 3u, 8u, 100u, 255u}) {
    std::vector<double> part(256 - begin);
    const auto off = static_cast<std::ptrdiff_t>(begin);
    kernels().filter(taps, &from[100 + begin], {-40 - off, 140 - off}, part);
    for (std::size_t i = begin; i < 256; ++i)
      EXPECT_EQ(part[i - begin], whole[i]);
  }
}

INSTANTIATE_TEST_SUITE_P(All, Kernels, testing::Range<std::size_t>(0, allKernels().size()),
                         [](const auto& tested) {
                           return std::string(allKernels()[tested.param].name);
                         });

}  // namespace
}  // namespace carom
