#include <cmath>
#include <complex>
#include <cstddef>
#include <string_view>

#include <gtest/gtest.h>

#include "carom/audio/panel_radiator.h"
#include "carom/modal/mesh_analysis.h"
#include "modal/radiation/mirror_part.h"
#include "modal/radiation/recoil_fit.h"
#include "modal/radiation/recoil_samples.h"
#include "tests/audio/meshes.h"
#include "tests/support/constants.h"
#include "tests/support/recoil_levels.h"

namespace carom::test {

using namespace audio;
using namespace modal;

namespace {

using Complex = std::complex<double>;

RigidRecoil recoilOf(const SurfaceMesh& mesh) {
  const Result<RigidRecoil> recoil = analyseRecoil(mesh);
  EXPECT_TRUE(recoil) << (recoil ? "" : recoil.error().message);
  return *recoil;
}

TEST(RigidRecoil, OfASphereIsTheClosedFormAndTurningIsSilent) {
  const SurfaceMesh mesh = ellipsoidMesh(Vec3::Ones(), 3);
  const RigidRecoil recoil = recoilOf(mesh);
  const double radius = recoil.radius;  // of the corners: a little more than the sphere's
  for (const double frequency : {0.02, 0.1, 0.33, 1.0, 1.9, 3.3, 5.1, 7.2, 9.0, 10.0}) {
    const Complex s(0.0, frequency / radius);
    const Complex advance = std::polar(1.0, -frequency * (radius - 1.0) / radius);
    const Complex closed = s / (2.0 + 2.0 * s + s * s) * advance / (radius * radius);
    Multipoles expected(kRecoilHarmonics, 0.0);
    expected[3] = 0.6 * std::sqrt(4.0 * kPi / 3.0) * closed;
    expected[2] = 0.8 * std::sqrt(4.0 * kPi / 3.0) * closed;
    const Motion moves = {0.6, 0.0, 0.8, 0.0, 0.0, 0.0};
    EXPECT_LT(worstDecibels(multipolesOf(recoil, moves, frequency), expected), 0.6) << frequency;
    const Multipoles turning = multipolesOf(recoil, {0.0, 0.0, 0.0, 1.0, 1.0, 1.0}, frequency);
    EXPECT_LT(powerOf(turning), 1e-3 * powerOf(expected)) << frequency;  // of the facets
  }
}

/// The plate of recoilShapes, solved once for all tests.
const SurfaceMesh& plate() {
  static const SurfaceMesh mesh = recoilShapes().at(1).mesh;
  return mesh;
}
const RigidRecoil& plateRecoil() {
  static const RigidRecoil recoil = recoilOf(plate());
  return recoil;
}

// The panel method for the added mass has oracles of its own: closed forms, in tests/audio.
TEST(RigidRecoil, LongWavesAreThoseOfTheAddedMass) {
  const RigidRadiator radiator = *panelRadiator(plate());
  const RigidRecoil& recoil = plateRecoil();
  const Vec3 way(0.5, -0.7, 0.3);
  const Vec3 dipole = radiator.dipole(way, Vec3::Zero()) / std::pow(recoil.radius, 3.0);
  for (const double frequency : {0.001, 0.01, 0.05}) {
    const Multipoles got =
        multipolesOf(recoil, {way.x(), way.y(), way.z(), 0.0, 0.0, 0.0}, frequency);
    const double level = std::sqrt(powerOf(got));
    const double expected = frequency * dipole.norm() / std::sqrt(12.0 * kPi);
    EXPECT_NEAR(20.0 * std::log10(level / expected), 0.0, 0.5) << frequency;
  }
}

// More panels, at a few frequencies, are the reference: ./bench recoil_accuracy has all four
// shapes.
TEST(RigidRecoil, FollowsFinerPanelsToOneDecibel) {
  const Result<RecoilSamples> reference =
      sampleRecoil(plate(), {.highest = 9.7, .spacing = 3.1, .panels = 700});
  ASSERT_TRUE(reference);
  for (std::size_t at = 0; at < reference->frequencies.size(); ++at) {
    const double frequency = reference->frequencies[at];
    for (const Motion& motion :
         {Motion{0.0, 0.0, 1.0, 0.0, 0.0, 0.0}, Motion{0.0, 0.0, 1.0, 2.0, 2.0, 0.0},
          Motion{0.5, -0.3, 0.4, 0.5, -1.0, 0.7}})
      EXPECT_LT(worstDecibels(multipolesOf(plateRecoil(), motion, frequency),
                              multipolesOf(*reference, motion, at)),
                1.0)
          << frequency;
  }
}

// Far above, a flat plate that is hit flat sends a plane wave from either side, and a wave of a
// wavelength of a hundredth of its size nothing else: 2 A (rho c)^2 |v|^2 / (4 pi).
TEST(RigidRecoil, PowerGoesOverIntoThatOfPlaneWaves) {
  const RigidRecoil& recoil = plateRecoil();
  const double area = 2.0 / (recoil.radius * recoil.radius);
  for (double low = 30.0; low < 300.0; low *= 1.2589) {
    double got = 0.0;
    double expected = 0.0;
    for (double frequency = low; frequency < 1.2589 * low; frequency *= 1.02) {
      got += powerOf(multipolesOf(recoil, {0.0, 0.0, 1.0, 0.0, 0.0, 0.0}, frequency)) / frequency;
      expected += area / std::pow(frequency, 3.0);
    }
    EXPECT_NEAR(10.0 * std::log10(got / expected), 0.0, 1.0) << low;
  }
}

TEST(RigidRecoil, PolesAreStableAndTheSameBitsComeEachTime) {
  EXPECT_TRUE(validate(plateRecoil()));
  for (const Complex& pole : plateRecoil().poles)
    EXPECT_LT(pole.real(), -0.5);
  const SurfaceMesh box = boxMesh({0.3, 0.2, 0.1});
  const RecoilSettings quick{.highest = 2.0, .panels = 60, .threads = 1};
  RecoilSettings together = quick;
  together.threads = 3;
  const RigidRadiator radiator = *panelRadiator(box);
  EXPECT_EQ(fitRecoil(*sampleRecoil(box, quick), radiator).residues,
            fitRecoil(*sampleRecoil(box, together), radiator).residues);
}

// A needle and a mesh of many triangles have no more panels than any other body.
TEST(RigidRecoil, PanelsAreBoundedWhateverTheShape) {
  const RecoilSettings quick{.highest = 0.4, .panels = 100};
  const SurfaceMesh needle = boxMesh({0.5, 0.005, 0.007});
  EXPECT_LE(sampleRecoil(needle, quick)->panels, 8 * quick.panels);
  SurfaceMesh egg = ellipsoidMesh(Vec3(1.0, 0.8, 0.6), 4);
  for (Vec3& vertex : egg.vertices)
    vertex.x() += 0.1 * vertex.y() * vertex.z() + 0.05 * vertex.x() * vertex.y();
  EXPECT_LE(sampleRecoil(egg, quick)->panels, quick.panels);
}

// What mirrors leave out must be nothing: a box that stands askew has none, and sounds the same in
// the direction that turns with it.
TEST(RigidRecoil, MirrorsChangeNothing) {
  const SurfaceMesh box = boxMesh({0.5, 0.35, 0.2});
  const Quat turn(Eigen::AngleAxisd(0.4, Vec3(1.0, 2.0, -1.0).normalized()));
  const SurfaceMesh askew = mapped(box, [&](const Vec3& vertex) { return turn * vertex; });
  EXPECT_EQ(mirrorPart(box).mirrors, (ExteriorSolver::Mirrors{true, true, true}));
  EXPECT_EQ(mirrorPart(askew).mirrors, (ExteriorSolver::Mirrors{}));
  const RecoilSettings settings{.highest = 6.0, .spacing = 2.0, .panels = 500};
  const RecoilSamples straight = *sampleRecoil(box, settings);
  const RecoilSamples other = *sampleRecoil(askew, settings);
  const Vec3 way(0.3, 0.5, 0.8);
  const Vec3 turned = turn * way;
  for (std::size_t at = 0; at < straight.frequencies.size(); ++at) {
    const double expected =
        powerOf(multipolesOf(straight, {way.x(), way.y(), way.z(), 0.0, 0.0, 0.0}, at));
    const double got =
        powerOf(multipolesOf(other, {turned.x(), turned.y(), turned.z(), 0.0, 0.0, 0.0}, at));
    EXPECT_NEAR(10.0 * std::log10(got / expected), 0.0, 0.25) << straight.frequencies[at];
  }
}

TEST(RigidRecoil, SaysWhyThereIsNoneAndCancels) {
  SurfaceMesh open = boxMesh({0.5, 0.5, 0.5});
  open.triangles.pop_back();
  EXPECT_FALSE(sampleRecoil(open, {}));
  const auto stop = [](std::string_view, double) { return false; };
  const SurfaceMesh box = boxMesh({0.5, 0.5, 0.5});
  const Result<RigidRecoil> cancelled = analyseRecoil(box, nullptr, stop);
  ASSERT_FALSE(cancelled);
  EXPECT_EQ(cancelled.error().message, kCancelled);
}

}  // namespace
}  // namespace carom::test
