// The recoil of rigid bodies as it is rendered, beside the exterior problem solved on more panels
// at other frequencies. `--help` describes the arguments.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <utility>
#include <vector>

#include "carom/modal/mesh_analysis.h"
#include "modal/radiation/recoil_samples.h"
#include "tests/bench/table_program.h"
#include "tests/support/recoil_levels.h"

namespace carom::bench {
namespace {

using namespace modal;
using namespace test;

constexpr char kHelp[] =
    R"(usage: bench_recoil_accuracy [--short]
       ./bench recoil_accuracy [--short]

The recoil of a bar, a plate, a disc and a ring (analyseRecoil), each hit in four ways, beside the
exterior problem solved on about twice as many panels, at frequencies in between: a row for each.

  up to ka 10  largest difference in dB over frequencies and 400 directions, of those within 20 dB of
               the loudest; a is the radius of the enclosing sphere
  12.5, 14-16  difference of the power over all directions, ka 11.2 to 14.1 and 14.1 to 16

Some minutes.

  --short   the plate alone, beside few frequencies: half a minute
)";

/// The limits of the power's bands, k radius.
constexpr double kBand = 11.2;
constexpr double kNextBand = 14.1;

const std::vector<std::pair<const char*, Motion>>& blows() {
  static const std::vector<std::pair<const char*, Motion>> all = {
      {"flat", {0.0, 0.0, 1.0, 0.0, 0.0, 0.0}},
      {"flat, at a corner", {0.0, 0.0, 1.0, 2.0, 2.0, 0.0}},
      {"on the edge", {1.0, 0.0, 0.0, 0.0, 0.0, 0.0}},
      {"oblique", {0.5, -0.3, 0.4, 0.5, -1.0, 0.7}}};
  return all;
}

/// Powers over a band: as rendered, and the reference's.
struct BandPower {
  double got = 0.0;
  double expected = 0.0;

  double decibels() const { return 10.0 * std::log10(got / expected); }
};

void printRow(const RecoilShape& shape, const RigidRecoil& recoil, const RecoilSamples& reference,
              const std::pair<const char*, Motion>& blow) {
  const auto& [name, motion] = blow;
  double worst = 0.0;
  BandPower third;
  BandPower above;
  for (std::size_t at = 0; at < reference.frequencies.size(); ++at) {
    const double frequency = reference.frequencies[at];
    const Multipoles expected = multipolesOf(reference, motion, at);
    const Multipoles got = multipolesOf(recoil, motion, frequency);
    if (frequency <= 10.0) worst = std::max(worst, worstDecibels(got, expected));
    if (frequency < kBand) continue;
    BandPower& band = frequency < kNextBand ? third : above;
    band.got += powerOf(got);
    band.expected += powerOf(expected);
  }
  std::printf("%-6s %-18s %12.2f %12.2f %12.2f\n", shape.name.c_str(), name, worst,
              third.decibels(), above.decibels());
  std::fflush(stdout);
}

int run(const Scale& scale) {
  std::printf("%-6s %-18s %12s %12s %12s\n", "body", "blow", "up to ka 10", "12.5", "14-16");
  RecoilSettings settings{.highest = 15.6, .spacing = 0.47, .panels = 1000};
  if (scale.isShort) settings = {.highest = 15.6, .spacing = 3.0, .panels = 500};
  std::vector<RecoilShape> shapes = recoilShapes();
  if (scale.isShort) shapes = {shapes.at(1)};
  for (const RecoilShape& shape : shapes) {
    const Result<RigidRecoil> recoil = analyseRecoil(shape.mesh);
    const Result<RecoilSamples> reference = sampleRecoil(shape.mesh, settings);
    if (!recoil || !reference) {
      std::fprintf(stderr, "%s: %s\n", shape.name.c_str(),
                   (recoil ? reference.error() : recoil.error()).message.c_str());
      return 1;
    }
    for (const auto& blow : blows())
      printRow(shape, *recoil, *reference, blow);
  }
  return 0;
}

}  // namespace
}  // namespace carom::bench

int main(int argc, char** argv) {
  return carom::bench::TableProgram{"bench_recoil_accuracy", carom::bench::kHelp, carom::bench::run}
      .main(argc, argv);
}
