#include "audio/click_kernels.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "audio/spread_kernel.h"

namespace carom {
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

// Each node by itself, from the formula of the kernel and not its table.
TEST_P(Kernels, SpreadPulsesAsTheFormulaDoesUpToTheTablesInterpolation) {
  for (const std::size_t count : {2u, 3u, 8u, 13u, 48u}) {
    for (const double length : {0.01, 0.7, 5.3, 40.0}) {
      std::vector<PulseNode> nodes(count);
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
      placed.resize(count);
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

TEST_P(Kernels, EqualThePlainOnesToRounding) {
  const ClickKernels& plain = plainKernels();
  for (const std::size_t size : {1u, 7u, 8u, 31u, 32u, 33u, 256u}) {
    const std::vector<double> from = noise(size + 200 + kRoom);
    const std::vector<double> taps = noise(56);
    std::vector<double> to = noise(size + kRoom);
    std::vector<double> plainTo = to;
    kernels().add({from.data(), size}, 0.37, to.data());
    plain.add({from.data(), size}, 0.37, plainTo.data());
    kernels().filter(&from[100], taps, to.data(), size);
    plain.filter(&from[100], taps, plainTo.data(), size);
    for (std::size_t i = 0; i < to.size(); ++i)
      EXPECT_NEAR(to[i], plainTo[i], 1e-13) << size << ", " << i;  // nothing behind it either
  }
}

TEST_P(Kernels, GiveASampleTheSameBitsWhereverABufferBegins) {
  const std::vector<double> from = noise(600);
  const std::vector<double> taps = noise(56);
  std::vector<double> whole(256 + kRoom);
  kernels().filter(&from[100], taps, whole.data(), 256);
  for (const std::size_t begin : {1u, 3u, 8u, 100u, 255u}) {
    std::vector<double> part(256 + kRoom);
    kernels().filter(&from[100 + begin], taps, part.data(), 256 - begin);
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
