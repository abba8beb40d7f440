#include "modal/analysis/audible_modes.h"

#include <cmath>
#include <numbers>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace carom::test {

using namespace modal;

namespace {

using testing::DoubleNear;
using testing::SizeIs;

double lambdaAt(double hertz) {
  return std::pow(2.0 * std::numbers::pi * hertz, 2.0);
}

ModalModel oneVertex() {
  ModalModel model;
  model.material = *findMaterial("steel");
  model.material.dampingAlpha = 0.0;
  model.material.dampingBeta = 0.0;
  model.mass = 1.0;
  model.surface.vertices = {Vec3::Zero()};
  return model;
}

EigenModes modesAt(const std::vector<double>& lambdas) {
  EigenModes found;
  found.lambda = Eigen::Map<const Eigen::VectorXd>(lambdas.data(), std::ssize(lambdas));
  found.shapes = Eigen::MatrixXd::Zero(3, std::ssize(lambdas));
  for (Eigen::Index mode = 0; mode < found.shapes.cols(); ++mode)
    found.shapes(0, mode) = static_cast<double>(mode + 1);
  return found;
}

TEST(AudibleModes, KeepsTheAudibleBandAndCountsTheRest) {
  ModalModel model = oneVertex();
  keepAudibleModes(model,
                   modesAt({-1e-4, 1e-3, lambdaAt(19.9), lambdaAt(20.1), lambdaAt(19999.0),
                            lambdaAt(20001.0), lambdaAt(30000.0)}),
                   1.0);
  ASSERT_THAT(model.modes, SizeIs(2));
  EXPECT_THAT(model.modes[0].frequency, DoubleNear(20.1, 1e-9));
  EXPECT_EQ(model.shape(0, 0), Vec3(4.0, 0.0, 0.0));
  EXPECT_EQ(model.shape(1, 0), Vec3(5.0, 0.0, 0.0));
  EXPECT_EQ(model.leftOut.rigid, 2u);
  EXPECT_EQ(model.leftOut.below, 1u);
  EXPECT_EQ(model.leftOut.above, 2u);
  EXPECT_TRUE(validate(model));
}

// Each of the two terms alone gives half of the critical damping at 1 kHz; the ratio falls with
// frequency for alpha and rises for beta.
TEST(AudibleModes, DecayIsRayleighs) {
  const double omega = 2.0 * std::numbers::pi * 1000.0;
  ModalModel byMass = oneVertex();
  byMass.material.dampingAlpha = omega;  // xi = alpha / (2 omega) = 1/2
  keepAudibleModes(byMass, modesAt({lambdaAt(400.0), lambdaAt(1000.0)}), 1.0);
  EXPECT_EQ(byMass.leftOut.overdamped, 1u);
  ASSERT_THAT(byMass.modes, SizeIs(1));
  EXPECT_NEAR(byMass.modes[0].decayRate, 0.5 * omega, 1e-9 * omega);

  ModalModel byStiffness = oneVertex();
  byStiffness.material.dampingBeta = 1.0 / omega;  // xi = beta omega / 2 = 1/2
  keepAudibleModes(byStiffness, modesAt({lambdaAt(1000.0), lambdaAt(2500.0)}), 1.0);
  EXPECT_EQ(byStiffness.leftOut.overdamped, 1u);
  ASSERT_THAT(byStiffness.modes, SizeIs(1));
  EXPECT_NEAR(byStiffness.modes[0].decayRate, 0.5 * omega, 1e-9 * omega);
}

}  // namespace
}  // namespace carom::test
