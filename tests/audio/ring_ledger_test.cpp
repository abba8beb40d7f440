#include "audio/scheduling/ring_ledger.h"

#include <complex>
#include <limits>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "carom/audio/synth_settings.h"
#include "tests/audio/ringing_box.h"

namespace carom::test {

using namespace audio;

namespace {

/// Two modes, of whose decay a part is sound.
std::shared_ptr<const ModalModel> bell() {
  ModalModel model = *boxOf({{500.0, 10.0}, {2000.0, 30.0}});
  model.modes[0].radiation.decayRate = 4.0;
  model.modes[1].radiation.decayRate = 30.0;
  return std::make_shared<const ModalModel>(std::move(model));
}

/// The energy of one mode, by Euler's method in small steps.
struct Course {
  double energy = 0.0;
  double radiated = 0.0;
  double absorbed = 0.0;

  void ring(double duration, double radiation, double rest) {
    constexpr int kSteps = 200000;
    const double h = duration / kSteps;
    for (int step = 0; step < kSteps; ++step) {
      const double middle = energy * (1.0 - (radiation + rest) * h);
      radiated += 2.0 * radiation * middle * h;
      absorbed += 2.0 * rest * middle * h;
      energy -= 2.0 * (radiation + rest) * middle * h;
    }
  }
};

TEST(RingLedger, FollowsBlowsAndDampingByContacts) {
  const ResonatorSet set(bell(), {});
  RingLedger ledger;
  ledger.add(7, set, 1.0, std::vector{2.0, 0.5});
  ledger.damp(7, set, 1.05, std::vector{6.0, 0.0});
  ledger.add(7, set, 1.08, std::vector{1.0, 0.0});
  ledger.damp(7, set, 1.1, std::vector{0.0, 0.0});
  Course low{2.0};
  low.ring(0.05, 4.0, 6.0);
  low.ring(0.03, 4.0, 12.0);
  low.energy += 1.0;
  low.ring(0.02, 4.0, 12.0);
  low.ring(0.02, 4.0, 6.0);
  Course high{0.5};
  high.ring(0.12, 30.0, 0.0);
  const std::vector<RingEnergy> bodies = ledger.at(1.12);
  ASSERT_EQ(bodies.size(), 1U);
  const RingEnergy& body = bodies.front();
  EXPECT_EQ(body.body, 7U);
  EXPECT_DOUBLE_EQ(body.given, 3.5);
  EXPECT_NEAR(body.radiated, low.radiated + high.radiated, 1e-8);
  EXPECT_NEAR(body.absorbed, low.absorbed, 1e-8);
  EXPECT_NEAR(body.remaining, low.energy + high.energy, 1e-8);
  EXPECT_NEAR(body.radiated + body.absorbed + body.remaining, body.given, 1e-14);
}

TEST(RingLedger, KnowsWhatTouchedABodyBeforeItWasStruckAndWhatLetItGo) {
  const ResonatorSet set(bell(), {});
  RingLedger ledger;
  ledger.damp(7, set, 0.5, std::vector{6.0, 0.0});
  EXPECT_TRUE(ledger.at(0.6).empty());
  ledger.add(7, set, 1.0, std::vector{2.0, 0.0});
  ledger.damp(7, set, 1.05, {});
  Course low{2.0};
  low.ring(0.05, 4.0, 12.0);
  low.ring(0.07, 4.0, 6.0);
  const RingEnergy body = ledger.at(1.12).front();
  EXPECT_NEAR(body.radiated, low.radiated, 1e-8);
  EXPECT_NEAR(body.absorbed, low.absorbed, 1e-8);
  EXPECT_NEAR(body.remaining, low.energy, 1e-8);
}

// The contact goes on while the body gets another model, which is damped from its first blow on.
TEST(RingLedger, KnowsWhatTouchesABodyWithAnotherModel) {
  const ResonatorSet before(bell(), {});
  const ResonatorSet set(bell(), {});
  RingLedger ledger;
  ledger.add(7, before, 0.1, std::vector{1.0, 0.0});
  ledger.damp(7, before, 0.2, std::vector{9.0, 0.0});
  ledger.damp(7, set, 0.5, std::vector{6.0, 0.0});
  ledger.add(7, set, 1.0, std::vector{2.0, 0.0});
  Course low{2.0};
  low.ring(0.05, 4.0, 12.0);
  EXPECT_NEAR(ledger.at(1.05).front().remaining, low.energy, 1e-8);
}

TEST(RingLedger, WhatTouchedARemovedBodyTouchesItNoMore) {
  const ResonatorSet set(bell(), {});
  RingLedger ledger;
  ledger.add(1, set, 0.0, std::vector{2.0, 0.0});
  ledger.damp(1, set, 0.0, std::vector{90.0, 0.0});
  ledger.forget(1);
  EXPECT_NEAR(ledger.removed().radiated, 0.4 * 2.0, 1e-12);
}

TEST(RingLedger, InTheEndNothingRemains) {
  const ResonatorSet set(bell(), {});
  RingLedger ledger;
  ledger.add(1, set, 0.0, std::vector{2.0, 0.5});
  ledger.add(2, set, 0.5, std::vector{0.0, 1.0});
  const std::vector<RingEnergy> bodies = ledger.at(std::numeric_limits<double>::infinity());
  ASSERT_EQ(bodies.size(), 2U);
  EXPECT_NEAR(bodies[0].radiated, 0.4 * 2.0 + 0.5, 1e-12);
  EXPECT_NEAR(bodies[0].absorbed, 0.6 * 2.0, 1e-12);
  EXPECT_NEAR(bodies[1].radiated, 1.0, 1e-12);
  EXPECT_EQ(bodies[1].remaining, 0.0);
}

// Numbers of bodies are used again, so what was removed must neither stay nor be taken for another.
TEST(RingLedger, RemovedBodiesRingToTheirEnd) {
  const ResonatorSet set(bell(), {});
  RingLedger ledger;
  ledger.add(1, set, 0.0, std::vector{2.0, 0.0});
  ledger.forget(1);
  ledger.forget(9);
  EXPECT_TRUE(ledger.at(0.0).empty());
  ledger.add(1, set, 0.1, std::vector{0.0, 1.0});
  ASSERT_EQ(ledger.at(0.1).size(), 1U);
  EXPECT_EQ(ledger.at(0.1).front().given, 1.0);
  EXPECT_EQ(ledger.removed().given, 2.0);
  EXPECT_NEAR(ledger.removed().radiated, 0.4 * 2.0, 1e-12);
  EXPECT_NEAR(ledger.removed().absorbed, 0.6 * 2.0, 1e-12);
  EXPECT_EQ(ledger.removed().remaining, 0.0);
}

// In water, and in what is denser still, a mode cannot lose more than it has.
TEST(RingLedger, DenseMediaDampAsFarAsCounts) {
  for (const double density : {400.0, 1000.0, 1e4}) {
    SynthSettings settings;
    settings.medium.density = density;
    const ResonatorSet set(bell(), settings);
    for (std::size_t mode = 0; mode < set.modes; ++mode) {
      EXPECT_GT(set.pole[mode].imag(), 0.0) << density;
      EXPECT_LE(-set.pole[mode].real(), std::abs(set.pole[mode]) / 2.0 * (1.0 + 1e-12));
      EXPECT_GE(set.radiated[mode], 0.0);
      EXPECT_LE(set.radiated[mode], -set.pole[mode].real());
    }
  }
}

// In a medium of another density, sound takes as much more or less.
TEST(RingLedger, ThinnerAirTakesLess) {
  SynthSettings settings;
  settings.medium.density = 0.6;
  const ResonatorSet set(bell(), settings);
  EXPECT_DOUBLE_EQ(set.radiated[0], 2.0);
  EXPECT_DOUBLE_EQ(set.pole[0].real(), -8.0);
  RingLedger ledger;
  ledger.add(1, set, 0.0, std::vector{1.0, 0.0});
  EXPECT_NEAR(ledger.at(1e9).front().radiated, 0.25, 1e-12);
}

}  // namespace
}  // namespace carom::test
