#include "lab/fit/tap_model.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "carom/audio/modal_model.h"
#include "carom/modal/mesh_analysis.h"

namespace carom::test {
namespace {

using namespace lab;

std::vector<TapMode> twoModes() {
  TapMode low;
  low.frequency = 800.0;
  low.decayRate = 4.0;
  low.level = -6.0;
  low.confidence = 1.0;
  TapMode high = low;
  high.frequency = 2500.0;
  high.decayRate = 11.0;
  high.level = 0.0;
  return {low, high};
}

TEST(TapModel, CanBeUsedAndIsHeardWithTheLevelsOfTheTap) {
  const auto made = modelOfTap(twoModes(), {.material = *findMaterial("brass"), .mass = 0.3});
  ASSERT_TRUE(bool(made)) << made.error().message;
  const ModalModel& model = made->model;
  EXPECT_TRUE(bool(validate(model)));
  EXPECT_TRUE(hasRadiation(model));
  EXPECT_DOUBLE_EQ(model.mass, 0.3);
  // A blow j gives a mode the velocity shape . j; its pressure is that times w times the volume.
  const auto pressure = [&](std::size_t mode) {
    return model.shape(mode, 17).norm() * model.modes[mode].frequency *
           std::abs(model.modes[mode].radiation.volume);
  };
  EXPECT_NEAR(20.0 * std::log10(pressure(0) / pressure(1)), -6.0, 0.01);
  for (const Mode& mode : model.modes)
    EXPECT_LE(mode.radiation.decayRate, 0.101 * mode.decayRate);
}

TEST(TapModel, SphereHasTheMassAtTheDensity) {
  const auto made = modelOfTap(twoModes(), {.material = *findMaterial("brass"), .mass = 0.3});
  ASSERT_TRUE(bool(made));
  EXPECT_NEAR(signedVolume(made->model.surface) * 8530.0, 0.3, 0.02);
}

TEST(TapModel, NoAudibleModeIsAnError) {
  std::vector<TapMode> modes = twoModes();
  modes[0].frequency = 25000.0;
  EXPECT_FALSE(bool(modelOfTap({modes[0]}, {.material = *findMaterial("brass"), .mass = 0.3})));
}

}  // namespace
}  // namespace carom::test
