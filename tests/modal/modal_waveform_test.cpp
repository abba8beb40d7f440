#include <cmath>
#include <cstdio>
#include <memory>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "tests/audio/meshes.h"
#include "tests/audio/ringing_box.h"
#include "tests/support/struck_model.h"

namespace carom::test {
namespace {

constexpr double kWaveformBar = -40.0;  // dB
constexpr std::size_t kFrames = 2400;   // 50 ms

struct ShellCase {
  const char* name;
  ShellSprings springs;
  double step;  // s, step of the coarser integration
};

class WaveformOfAShell : public testing::TestWithParam<ShellCase> {};

// Compares the network by its modes, all of them in the band, with direct integration in the limit
// of small steps, which is accurate enough if its finer step alone already is.
TEST_P(WaveformOfAShell, IsThatOfTheNetworkIntegratedDirectly) {
  ShellSettings settings{.thickness = 4e-3, .springs = GetParam().springs, .minVertices = 50};
  settings.maxModes = 1000;
  const StruckModel body = struckShell(ellipsoidMesh({0.4, 0.32, 0.26}, 2),
                                       *findMaterial("polycarbonate"), settings, {1, 2, 3});
  ASSERT_EQ(body.model->leftOut.above + body.model->leftOut.overdamped, 0u);
  const std::vector<double> coarse = directSound(body, GetParam().step, kFrames);
  const std::vector<double> fine = directSound(body, 0.5 * GetParam().step, kFrames);
  const std::vector<double> direct = limitOf(coarse, fine);
  EXPECT_LT(differenceInDecibels(fine, direct), kWaveformBar);
  EXPECT_LT(differenceInDecibels(modalSound(body, kFrames), direct), kWaveformBar);
}
INSTANTIATE_TEST_SUITE_P(BySprings, WaveformOfAShell,
                         testing::Values(ShellCase{"transverse", ShellSprings::transverse, 3e-6},
                                         ShellCase{"axial", ShellSprings::axial, 6e-6}),
                         [](const testing::TestParamInfo<ShellCase>& param) {
                           return param.param.name;
                         });

// Modes that are much higher than the contact excites add up in the attack: each of them is far off
// its resonance, and the resonators' outputs nearly cancel. The 60 modes reach to the top of the
// band; the low-pass leaves the audible rest.
TEST(ModalWaveform, AttackOfHighModesIsThatOfTheOscillators) {
  std::vector<Tone> tones;
  StruckModel body;
  const Eigen::Index count = 60;
  Eigen::VectorXd stiffness(count);
  for (Eigen::Index mode = 0; mode < count; ++mode) {
    tones.push_back(
        {1000.0 + 315.0 * static_cast<double>(mode), 300.0, mode % 3 == 0 ? 2e-3 : 1e-3});
    stiffness[mode] = std::pow(2.0 * std::numbers::pi * tones.back().frequency, 2.0);
  }
  body.model = boxOf(tones, -Vec3::UnitX());
  body.inward = -Vec3::UnitX();
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(count);
  body.direct.mass = ones.asDiagonal().toDenseMatrix().sparseView();
  body.direct.stiffness = stiffness.asDiagonal().toDenseMatrix().sparseView();
  body.direct.alpha = 600.0;
  body.direct.push = 5.0 * ones;
  body.direct.flow = ones;
  for (Eigen::Index mode = 0; mode < count; ++mode)
    body.direct.flow[mode] = tones[static_cast<std::size_t>(mode)].volume;
  constexpr std::size_t kAttack = 420;
  const std::vector<double> direct =
      limitOf(directSound(body, 0.5e-6, kAttack), directSound(body, 0.25e-6, kAttack));
  EXPECT_LT(differenceInDecibels(modalSound(body, kAttack), direct), kWaveformBar);
}

// A solid's modes above 20 kHz are not looked for. While the ball touches, they yield to it, and
// the volume that they move is part of the first millisecond.
TEST(ModalWaveform, AttackOfASolidHasWhatItsModesAboveTheBandDisplace) {
  StruckModel body =
      struckBox({0.06, 0.05, 0.04}, *findMaterial("polycarbonate"), 900, {1.0, 2.0, 3.0});
  ASSERT_FALSE(body.model->residualVolumes.empty());
  constexpr std::size_t kAttack = 420;
  const std::vector<double> direct =
      limitOf(directSound(body, 2e-6, kAttack), directSound(body, 1e-6, kAttack));
  const double whole = differenceInDecibels(modalSound(body, kAttack), direct);
  const double frequency = body.model->residualFrequency;
  ModalModel bare = *body.model;
  bare.residualVolumes.clear();
  bare.residualFrequency = 0.0;
  body.model = std::make_shared<const ModalModel>(bare);
  const double without = differenceInDecibels(modalSound(body, kAttack), direct);
  std::printf("attack of a solid: %.1f dB, without residual volumes %.1f dB (%.0f Hz)\n", whole,
              without, frequency);
  EXPECT_LT(whole, -26.0);
  EXPECT_GT(without, whole + 5.0);
}

}  // namespace
}  // namespace carom::test
