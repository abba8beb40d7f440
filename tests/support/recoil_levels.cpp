#include "tests/support/recoil_levels.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "tests/audio/meshes.h"
#include "tests/support/constants.h"

namespace carom::test {

using namespace audio;

namespace {

using Complex = std::complex<double>;

/// A body of revolution about z from its profile (radius, height), upwards on the outside.
SurfaceMesh revolved(const std::vector<std::pair<double, double>>& profile, int around) {
  SurfaceMesh mesh;
  const auto points = static_cast<int>(profile.size());
  for (int turn = 0; turn < around; ++turn) {
    const double angle = 2.0 * kPi * turn / around;
    for (const auto& [radius, height] : profile)
      mesh.vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle), height);
  }
  const auto index = [&](int turn, int point) {
    return static_cast<std::uint32_t>((turn % around) * points + point % points);
  };
  for (int turn = 0; turn < around; ++turn) {
    for (int point = 0; point < points; ++point) {
      const std::uint32_t here = index(turn, point);
      const std::uint32_t next = index(turn + 1, point + 1);
      mesh.triangles.push_back({here, index(turn + 1, point), next});
      mesh.triangles.push_back({here, next, index(turn, point + 1)});
    }
  }
  return welded(mesh, 1e-9);
}

std::vector<Vec3> evenDirections() {
  constexpr int kCount = 400;
  std::vector<Vec3> all;
  for (int spot = 0; spot < kCount; ++spot) {
    const double z = 1.0 - (2.0 * spot + 1.0) / kCount;
    const double across = std::sqrt(1.0 - z * z);
    all.emplace_back(across * std::cos(2.399963 * spot), across * std::sin(2.399963 * spot), z);
  }
  return all;
}

std::vector<double> levelsOf(const Multipoles& multipoles) {
  std::vector<double> levels;
  std::vector<double> harmonics(kRecoilHarmonics);
  for (const Vec3& d : evenDirections()) {
    sphericalHarmonics<double>(d.x(), d.y(), d.z(), RigidRecoil::kHighestOrder, harmonics);
    Complex sum = 0.0;
    for (std::size_t index = 0; index < kRecoilHarmonics; ++index)
      sum += harmonics[index] * multipoles[index];
    levels.push_back(std::abs(sum));
  }
  return levels;
}

}  // namespace

std::vector<RecoilShape> recoilShapes() {
  return {{"bar", boxMesh({0.5, 0.05, 0.05})},
          {"plate", boxMesh({0.5, 0.5, 0.025})},
          {"disc", revolved({{0.0, -0.01}, {0.5, -0.01}, {0.5, 0.01}, {0.0, 0.01}}, 32)},
          {"ring", revolved({{0.4, -0.025}, {0.5, -0.025}, {0.5, 0.025}, {0.4, 0.025}}, 32)}};
}

Multipoles multipolesOf(const RigidRecoil& recoil, const Motion& motion, double frequency) {
  Multipoles sum(kRecoilHarmonics, 0.0);
  const Complex s(0.0, frequency);
  for (std::size_t term = 0; term < recoil.terms.size(); ++term) {
    Complex response = 0.0;
    for (std::size_t pole = 0; pole < recoil.poles.size(); ++pole) {
      const Complex residue(recoil.residues[term * recoil.poles.size() + pole]);
      response += residue / (s - recoil.poles[pole]) +
                  std::conj(residue) / (s - std::conj(recoil.poles[pole]));
    }
    sum[recoil.terms[term].harmonic] += motion[recoil.terms[term].motion] * response;
  }
  return sum;
}

Multipoles multipolesOf(const modal::RecoilSamples& samples, const Motion& motion,
                        std::size_t index) {
  Multipoles sum(kRecoilHarmonics, 0.0);
  for (std::size_t each = 0; each < 6; ++each)
    for (std::size_t at = 0; at < samples.motions[each].harmonics.size(); ++at)
      sum[samples.motions[each].harmonics[at]] +=
          motion[each] * samples.motions[each].values[index][at];
  return sum;
}

double powerOf(const Multipoles& multipoles) {
  double sum = 0.0;
  for (const Complex& multipole : multipoles)
    sum += std::norm(multipole);
  return sum;
}

double worstDecibels(const Multipoles& got, const Multipoles& expected) {
  const std::vector<double> is = levelsOf(got);
  const std::vector<double> wanted = levelsOf(expected);
  const double loudest = *std::ranges::max_element(wanted);
  double worst = 0.0;
  for (std::size_t at = 0; at < wanted.size(); ++at)
    if (wanted[at] > 0.1 * loudest)
      worst = std::max(worst, std::abs(20.0 * std::log10(is[at] / wanted[at])));
  return worst;
}

}  // namespace carom::test
