#include "audio/model/acceleration_noise.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/audio/ball_drop.h"

namespace carom {

using namespace audio;

namespace {

using test::BallDrop;

const Medium kAir;

TEST(GaussianPulse, HoldsThirteenPointSevenPercentTooMuchImpulse) {
  // Eq. 6 holds for the half-sine, whose integral over u is 2/pi; the Gaussian's is larger.
  double integral = 0.0;
  constexpr double kStep = 1e-3;
  for (double u = -2.0; u < 3.0; u += kStep)
    integral += kStep * gaussianPulse(u);
  EXPECT_NEAR(integral / (2.0 / std::numbers::pi), 1.137, 5e-4);
}

TEST(GaussianPulse, SlopeIsItsDerivative) {
  constexpr double kStep = 1e-5;
  for (double u = -1.0; u < 2.0; u += 0.0137) {
    const double difference = (gaussianPulse(u + kStep) - gaussianPulse(u - kStep)) / (2 * kStep);
    EXPECT_NEAR(gaussianPulseSlope(u), difference, 1e-8);
  }
}

TEST(GaussianPulse, PeakSlopeBoundsItAndIsReached) {
  double largest = 0.0;
  for (double u = 0.0; u < 1.0; u += 1e-6)
    largest = std::max(largest, std::abs(gaussianPulseSlope(u)));
  EXPECT_NEAR(largest, kPulsePeakSlope, 1e-10);
}

TEST(GaussianPulse, IsCutBelowTheRoundingOfItsPeak) {
  EXPECT_LT(std::abs(gaussianPulseSlope(0.5 + kPulseHalfWidth)),
            kPulsePeakSlope * std::numeric_limits<double>::epsilon() * 4.0);
}

// The seed's eq. 1 with eq. 6: the strike is rho0 a^3 / (2 c) times the velocity that the impulse
// gives.
TEST(Strike, OfASphereIsItsVelocityTimesHalfTheAirOfItsCube) {
  const BallDrop drop{.radius = 0.02, .speed = 1.5};
  const Strike strike = makeStrike(drop.event(), drop.ball(), kAir);
  const double expected = 1.2 * 0.02 * 0.02 * 0.02 / (2.0 * 343.0) * 3.0;
  EXPECT_NEAR(strike.dipole.z(), expected, 1e-12 * expected);
  EXPECT_EQ(strike.dipole.x(), 0.0);
  EXPECT_EQ(strike.radius, 0.02);
  EXPECT_NEAR(strike.velocity.norm(), 0.0, 1e-12) << "it turns back in the middle of the contact";
}

TEST(Strike, OfASphereAsAnyShapeIsThatOfTheSphere) {
  const BallDrop drop{.radius = 0.02};
  SoundBody shaped = drop.ball();
  shaped.radius = 0.0;
  shaped.shape = std::make_shared<const RigidRadiator>(sphereRadiator(0.02));
  const Strike sphere = makeStrike(drop.event(), drop.ball(), kAir);
  const Strike other = makeStrike(drop.event(), shaped, kAir);
  EXPECT_NEAR((sphere.dipole - other.dipole).norm(), 0.0, 1e-12 * sphere.dipole.norm());
  EXPECT_NEAR(other.radius, 0.02, 1e-12);
}

// A flat body pushed flatwise moves far more air than one pushed edgewise, however it is turned.
TEST(Strike, TurnsWithTheBody) {
  BallDrop drop;
  SoundBody disc = drop.ball();
  disc.shape = std::make_shared<const RigidRadiator>(ellipsoidRadiator({0.05, 0.05, 0.005}));
  ImpulseEvent event = drop.event();
  const Vec3 flatwise = makeStrike(event, disc, kAir).dipole;
  event.bodyOrientation = Quat(Eigen::AngleAxisd(0.5 * std::numbers::pi, Vec3::UnitX()));
  const Vec3 edgewise = makeStrike(event, disc, kAir).dipole;
  EXPECT_GT(flatwise.z(), 5.0 * edgewise.z());
  event.bodyOrientation = Quat(Eigen::AngleAxisd(0.7, Vec3::UnitZ()));
  EXPECT_NEAR((makeStrike(event, disc, kAir).dipole - flatwise).norm(), 0.0,
              1e-12 * flatwise.norm());
}

// A sphere whose centre of mass is not its middle, hit off its centre, also swings its middle.
TEST(Strike, OfABodyThatTurnsHoldsTheSwingOfItsVolume) {
  const BallDrop drop{.radius = 0.02};
  const Vec3 middle{0.01, 0.0, 0.0};
  SoundBody loaded = drop.ball();
  loaded.shape = std::make_shared<const RigidRadiator>(sphereRadiator(0.02).about(-middle));
  loaded.inverseInertia = 3e3 * Eigen::Matrix3d::Identity();
  ImpulseEvent event = drop.event();
  event.position = event.bodyPosition + Vec3(0.015, 0.0, -0.01);
  // The expected dipole, by hand: from the velocity of the sphere's middle, as a point of a rigid
  // body that was hit there.
  const Vec3 turn = 3e3 * (event.position - event.bodyPosition).cross(event.impulse);
  const Vec3 velocity = event.impulse / loaded.mass + turn.cross(middle);
  const Vec3 expected = 1.2 * std::pow(0.02, 3) / (2.0 * 343.0) * velocity;
  const Vec3 dipole = makeStrike(event, loaded, kAir).dipole;
  EXPECT_NEAR((dipole - expected).norm(), 0.0, 1e-10 * expected.norm());
}

}  // namespace
}  // namespace carom
