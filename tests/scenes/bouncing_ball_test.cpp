#include <algorithm>
#include <cmath>
#include <iostream>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "carom/audio/material.h"
#include "scenes/run/render.h"
#include "tests/scenes/library.h"
#include "tests/support/onset_detector.h"
#include "tests/support/recording.h"
#include "tests/support/temporary_folder.h"

namespace carom::test {

using namespace scenes;

namespace {

// The values of scenes/library/bouncing_ball.json, written again.
constexpr long double kRadius = 0.01L;      // m
constexpr long double kDropHeight = 0.5L;   // m, of the lowest point
constexpr long double kGravity = 9.81L;     // m/s^2
constexpr long double kRestSpeed = 0.005L;  // m/s, slower bounces are rest
constexpr long double kSoundSpeed = 343.0L;

struct Impact {
  long double time;   // s
  long double speed;  // m/s
};

/// Impacts of the textbook's bouncing ball: it meets the floor at v_0 = sqrt(2 g h), leaves impact
/// k (from 1) at v_k = e^k v_0 and is then 2 v_k / g in the air.
std::vector<Impact> analyticImpacts(long double restitution, long double slowest) {
  std::vector<Impact> impacts;
  long double time = std::sqrt(2.0L * kDropHeight / kGravity);
  for (long double speed = std::sqrt(2.0L * kGravity * kDropHeight); speed >= slowest;) {
    impacts.push_back({time, speed});
    speed *= restitution;
    time += 2.0L * speed / kGravity;
  }
  return impacts;
}

/// Duration tau of the contact of a sphere with a plane: R is the radius, m the mass of the sphere.
long double hertzTau(const Material& ball, const Material& floor, long double speed) {
  const auto compliance = [](const Material& material) {
    const long double nu = material.poissonsRatio;
    return (1.0L - nu * nu) / static_cast<long double>(material.youngsModulus);
  };
  const long double modulus = 1.0L / (compliance(ball) + compliance(floor));
  const long double mass = 4.0L / 3.0L * std::numbers::pi_v<long double> * kRadius * kRadius *
                           kRadius * static_cast<long double>(ball.density);
  return 2.87L * std::pow(mass * mass / (kRadius * modulus * modulus * speed), 0.2L);
}

long double distanceToListener() {
  return std::hypot(0.6L, 0.7L - kRadius, 0.37L);  // from the centre of the ball on the floor
}

class BouncingBall : public testing::Test {
 protected:
  const Material steel_ = *findMaterial("steel");
  const Material concrete_ = *findMaterial("concrete");
  const long double restitution_ =
      std::sqrt(static_cast<long double>(steel_.restitution) * concrete_.restitution);
  const std::vector<Impact> impacts_ = analyticImpacts(restitution_, kRestSpeed);

  /// Time at which the detector should report the onset: it is early by 0.0547 tau
  /// (onset_detector.h).
  double expectedOnset(const Impact& impact) const {
    return static_cast<double>(impact.time + distanceToListener() / kSoundSpeed -
                               0.0547L * hertzTau(steel_, concrete_, impact.speed));
  }

  /// Peak pressure in Pa: eq. (1) with the steepest jerk of eq. (10), at v = 1/sqrt(12), where the
  /// acceleration pulse changes the speed by (1 + e) times that of the impact.
  double expectedPeak(const Impact& impact) const {
    const long double tau = hertzTau(steel_, concrete_, impact.speed);
    const long double distance = distanceToListener();
    const long double cosine = (0.7L - kRadius) / distance;
    const long double slope = std::sqrt(12.0L) * std::exp(-0.5L);
    const long double jerk = std::numbers::pi_v<long double> / 2.0L * (1.0L + restitution_) *
                             impact.speed * slope / (tau * tau);
    return static_cast<double>(1.20L * kRadius * kRadius * kRadius * cosine /
                               (2.0L * kSoundSpeed * distance) * jerk);
  }
};

TEST_F(BouncingBall, IsHeardAtTheAnalyticTimesWithinOneSample) {
  const TemporaryFolder folder;
  const auto report = renderScene(asInTheHandOut(libraryScene("bouncing_ball")),
                                  {.soundFile = folder / "ball.wav"});
  ASSERT_TRUE(report) << report.error().message;
  const Recording recording = readRecording(folder / "ball.wav");
  const double rate = recording.info.samplerate;
  const std::vector<Onset> onsets = findOnsets(recording.channel(0), rate);

  ASSERT_EQ(impacts_.size(), 28u);  // from 3.13 m/s down to 6.1 mm/s
  ASSERT_EQ(onsets.size(), impacts_.size());
  double largest = 0.0;  // samples
  for (std::size_t impact = 0; impact < impacts_.size(); ++impact) {
    const double deviation = (onsets[impact].time - expectedOnset(impacts_[impact])) * rate;
    EXPECT_LT(std::abs(deviation), 1.0) << "impact " << impact;
    largest = std::max(largest, std::abs(deviation));
  }
  RecordProperty("largest_onset_deviation_samples", std::to_string(largest));
  std::cout << "largest onset deviation: " << largest << " samples\n";
}

TEST_F(BouncingBall, IsAsLoudAsTheEquationsSay) {
  const TemporaryFolder folder;
  const auto report = renderScene(asInTheHandOut(libraryScene("bouncing_ball")),
                                  {.soundFile = folder / "ball.wav"});
  ASSERT_TRUE(report) << report.error().message;
  const Recording recording = readRecording(folder / "ball.wav");
  const std::vector<Onset> onsets = findOnsets(recording.channel(0), recording.info.samplerate);
  ASSERT_EQ(onsets.size(), impacts_.size());
  for (std::size_t impact = 0; impact < impacts_.size(); ++impact) {
    // The loudest sample is at most half a sample away from the peak: up to 12 % lower, as tau is 5
    // samples or more.
    const double ratio = 20.0 * onsets[impact].peak / expectedPeak(impacts_[impact]);
    EXPECT_GT(ratio, 0.87) << "impact " << impact;
    EXPECT_LT(ratio, 1.0001) << "impact " << impact;
  }
}

TEST_F(BouncingBall, IsHeardLaterAndHalfAsLoudAtTwiceTheDistance) {
  const TemporaryFolder folder;
  Scene scene = asInTheHandOut(libraryScene("bouncing_ball"));
  scene.listeners.push_back({"far", {1.2, 0.01 + 2.0 * 0.69, 0.74}});
  const auto report = renderScene(scene, {.soundFile = folder / "ball.wav"});
  ASSERT_TRUE(report) << report.error().message;
  const Recording recording = readRecording(folder / "ball.wav");
  const double rate = recording.info.samplerate;
  const std::vector<Onset> near = findOnsets(recording.channel(0), rate);
  const std::vector<Onset> far = findOnsets(recording.channel(1), rate);
  ASSERT_EQ(near.size(), impacts_.size());
  ASSERT_EQ(far.size(), impacts_.size());
  const auto delay = static_cast<double>(distanceToListener() / kSoundSpeed);
  for (std::size_t impact = 0; impact < impacts_.size(); ++impact) {
    EXPECT_NEAR(far[impact].time - near[impact].time, delay, 0.5 / rate);
    EXPECT_NEAR(far[impact].peak / near[impact].peak, 0.5, 0.05);  // the top is between samples
  }
}

}  // namespace
}  // namespace carom::test
