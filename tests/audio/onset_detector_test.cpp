#include "tests/support/onset_detector.h"

#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "tests/audio/ball_drop.h"
#include "tests/support/constants.h"

namespace carom::test {
namespace {

/// Adds a click. The pulse is written out again here, so that the detector is not tested with the
/// code that it judges.
void addJerk(std::vector<double>& samples, double onset, double tau, double peak) {
  const double top = std::sqrt(12.0) * std::exp(-0.5);
  for (std::size_t sample = 0; sample < samples.size(); ++sample) {
    const double v = (static_cast<double>(sample) / kRate - onset) / tau - 0.5;
    samples[sample] += peak * -12.0 * v * std::exp(-6.0 * v * v) / top;
  }
}

struct Bounce {
  double time;   // s
  double speed;  // m/s
};

/// A steel ball of 1 cm that bounces from 3 m/s down to 5 mm/s.
std::vector<Bounce> bouncesOf(double restitution) {
  std::vector<Bounce> bounces;
  double time = 0.0123;
  for (double speed = 3.0; speed > 5e-3; speed *= restitution) {
    bounces.push_back({time, speed});
    time += 2.0 * restitution * speed / 9.81;
  }
  return bounces;
}

void expectEachFound(const std::vector<Onset>& onsets, const std::vector<Bounce>& bounces) {
  ASSERT_EQ(onsets.size(), bounces.size());
  for (std::size_t bounce = 0; bounce < bounces.size(); ++bounce)
    EXPECT_NEAR(onsets[bounce].time, bounces[bounce].time, 1.0 / kRate) << bounce;
}

std::vector<double> recordingOf(const std::vector<Bounce>& bounces, double sign) {
  std::vector<double> samples(static_cast<std::size_t>((bounces.back().time + 0.01) * kRate), 0.0);
  for (const Bounce& bounce : bounces)
    addJerk(samples, bounce.time, 77.6e-6 * std::pow(bounce.speed, -0.2),
            sign * 0.5 * std::pow(bounce.speed, 1.4));
  return samples;
}

TEST(OnsetDetector, FindsEveryBounceOfASteelBallWithinOneSample) {
  for (const double restitution : {0.5, 0.8, 0.9}) {
    const std::vector<Bounce> bounces = bouncesOf(restitution);
    expectEachFound(findOnsets(recordingOf(bounces, 1.0), kRate), bounces);
  }
}

TEST(OnsetDetector, DoesNotMindTheSign) {
  const std::vector<Bounce> bounces = bouncesOf(0.8);
  expectEachFound(findOnsets(recordingOf(bounces, -1.0), kRate), bounces);
}

TEST(OnsetDetector, KeepsOneSampleAtEveryPhaseAndDuration) {
  for (double tau = 60e-6; tau <= 250e-6; tau += 10e-6) {
    for (double phase = 0.0; phase < 1.0; phase += 0.09) {
      std::vector<double> samples(1000, 0.0);
      const double onset = (300.0 + phase) / kRate;
      addJerk(samples, onset, tau, 0.01);
      const std::vector<Onset> found = findOnsets(samples, kRate);
      ASSERT_EQ(found.size(), 1u);
      EXPECT_NEAR(found.front().time, onset, 1.0 / kRate);
    }
  }
}

TEST(OnsetDetector, IsEarlyByTheStatedPartOfTheDuration) {
  // The clicks are 300 samples long, so that interpolation between samples has no effect.
  const double tau = 300.0 / kRate;
  std::vector<double> samples(6000, 0.0);
  addJerk(samples, 0.05, tau, 1.0);
  const std::vector<Onset> found = findOnsets(samples, kRate, {.gap = tau});
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NEAR((found.front().time - 0.05) / tau, -0.0547, 1e-4);
  EXPECT_NEAR(found.front().peak, 1.0, 1e-3);
}

TEST(OnsetDetector, IgnoresANoiseFloor) {
  std::vector<Bounce> bounces = bouncesOf(0.8);
  std::erase_if(bounces, [](const Bounce& bounce) { return bounce.speed < 0.3; });
  std::vector<double> samples = recordingOf(bounces, 1.0);
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0.0, 1e-3);
  for (double& sample : samples)
    sample += noise(random);
  expectEachFound(findOnsets(samples, kRate), bounces);
}

TEST(OnsetDetector, FindsNothingInSilence) {
  EXPECT_TRUE(findOnsets(std::vector<double>(1000, 0.0), kRate).empty());
  EXPECT_TRUE(findOnsets(std::vector<double>(), kRate).empty());
}

TEST(OnsetDetector, FindsTheClicksOfTheSynth) {
  BallDrop drop;
  SynthSettings settings;
  settings.audibleThreshold = 0.0;
  Synth synth = makeSynth(drop, {{"above", {0, 0, 1.0}}}, settings);
  std::vector<Bounce> bounces = bouncesOf(0.9);
  for (Bounce& bounce : bounces) {
    drop.time = bounce.time;
    drop.speed = bounce.speed;
    synth.schedule(drop.event());
    bounce.time += 1.0 / settings.medium.speedOfSound;
  }
  const auto frames = static_cast<std::size_t>((bounces.back().time + 0.01) * kRate);
  expectEachFound(findOnsets(renderMono(synth, frames), kRate), bounces);
}

}  // namespace
}  // namespace carom::test
