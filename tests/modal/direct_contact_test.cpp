// Tests the contact that is coupled with a body's modes against direct integration of its mesh.

#include "tests/support/direct_contact.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "audio/contact/coupled_contact.h"
#include "tests/audio/meshes.h"

namespace carom::test {
namespace {

constexpr double kHighest = 20e3;  // Hz

class BlowOnAPlate : public testing::TestWithParam<double> {
 protected:
  static PatchedBody plate() {
    Material material = *findMaterial("steel");
    material.dampingAlpha = 0.0;  // which would brake the rigid motion
    return patchedSolid(boxMesh({0.09, 0.07, 0.003}), material, 600,
                        {.centre = {0.031, 0.022, 0.003}, .radius = 0.008, .wall = 0.006});
  }
};

// Few modes stand for all that lies above the known ones.
TEST_P(BlowOnAPlate, IsThatOfTheMeshIntegratedDirectly) {
  const PatchedBody body = plate();
  PatchModes patch = modesOf(body, kHighest);
  const std::size_t known = patch.modes.size();
  audio::addModesBeyond(patch.modes, 0, known);
  DirectBlow blow{.mass = GetParam() * body.mass.sum() / 3.0};
  audio::CoupledImpact impact{.mass = 1.0 / (patch.mobility + 1.0 / blow.mass),
                              .speed = blow.speed,
                              .modes = patch.modes,
                              .beyond = patch.modes.size() - known};
  const double duration = 4.0 / kHighest;  // four periods
  impact.stiffness = 1.25 * impact.mass * std::pow(2.9432 / duration, 2.5);
  impact.impulse = 2.0 * impact.mass;
  blow.stiffness = impact.stiffness;
  audio::CoupledContact contact;
  const audio::ContactCourse& course = contact.solve(impact);
  const DirectCourse direct = integrate(body, patch, blow, duration / 400.0, 1.1 * course.duration);
  ASSERT_EQ(course.touches, 1U);
  ASSERT_EQ(direct.touches, 1U);
  double impulse = 0.0;
  double peak = 0.0;
  for (const double force : direct.force) {
    impulse += direct.step * force;
    peak = std::max(peak, force);
  }
  const double step = 2.0 * course.nodes.front().u * course.duration;
  double solved = 0.0;
  for (const audio::PulseNode& node : course.nodes)
    solved = std::max(solved, node.weight / step);
  EXPECT_NEAR(course.impulse, impulse, 0.005 * impulse);
  EXPECT_NEAR(solved, peak, 0.01 * peak);
  const double modes = course.energy.modes + course.energy.beyond;
  EXPECT_NEAR(modes, direct.modes, 0.01 * direct.modes);
  EXPECT_NEAR(course.energy.rigid, direct.rigid, 0.01 * course.energy.approach);
}
INSTANTIATE_TEST_SUITE_P(ByMass, BlowOnAPlate, testing::Values(0.01, 1.0, 100.0));

// A ball on a block that hardly gives way: Hertz's own contact, whose duration is known.
TEST(DirectContact, OfAStiffBlockIsHertzs) {
  Material stiff = *findMaterial("steel");
  stiff.dampingAlpha = 0.0;
  stiff.youngsModulus *= 1e4;
  const PatchedBody body = patchedSolid(boxMesh({0.05, 0.05, 0.05}), stiff, 200,
                                        {.centre = {0.0, 0.0, 0.05}, .radius = 0.02, .wall = 0.1});
  const PatchModes patch = modesOf(body, 1e8);
  const DirectBlow blow{.mass = 0.1, .stiffness = 1e8, .gravity = 0.0};
  const audio::CoupledImpact impact{.stiffness = blow.stiffness,
                                    .mass = 1.0 / (patch.mobility + 1.0 / blow.mass),
                                    .speed = blow.speed,
                                    .impulse = 0.0,
                                    .modes = {}};
  const double duration = elasticDuration(impact);
  const DirectCourse course = integrate(body, patch, blow, 1e-3 * duration, 1.1 * duration);
  const double lasts = static_cast<double>(std::ranges::count_if(
                           course.force, [](double force) { return force > 0.0; })) *
                       course.step;
  EXPECT_NEAR(lasts, duration, 3e-3 * duration);
  EXPECT_NEAR(course.rigid, 0.5 * impact.mass, 1e-3 * impact.mass);
  EXPECT_NEAR(course.modes, 0.0, 1e-3 * impact.mass);
}

}  // namespace
}  // namespace carom::test
