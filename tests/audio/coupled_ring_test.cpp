// Tests what is heard of impacts in which the struck body's modes take part.

#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "carom/audio/synth.h"
#include "tests/audio/ball_drop.h"
#include "tests/audio/ringing_box.h"
#include "tests/support/constants.h"

namespace carom::test {
namespace {

constexpr double kShape = 5.0;  // 1/sqrt(kg), of each mode of boxOf
constexpr double kDistance = 1.0;

Synth floorThatRings(const BallDrop& drop, const std::vector<Tone>& tones,
                     const SynthSettings& settings) {
  Synth synth = *Synth::create(settings, {{"seat", {0.0, 0.0, kDistance}}});
  SoundBody floor = drop.floor();
  floor.modal = boxOf(tones);
  EXPECT_TRUE(synth.setBody(kBall, {.material = drop.material}));  // its click is left out
  EXPECT_TRUE(synth.setBody(kFloor, floor));
  return synth;
}

SynthSettings coupled() {
  SynthSettings settings;
  settings.audibleThreshold = 0.0;
  settings.ringingContact = RingingContact::coupled;
  return settings;
}

/// The pressure of monopoles, by the equations of ball, Hertz's spring and modes in small steps of
/// the semi-implicit Euler method.
std::vector<double> integratedTogether(const BallDrop& drop, const std::vector<Tone>& tones,
                                       std::size_t frames) {
  const Material& steel = drop.material;
  const double modulus =
      0.5 * steel.youngsModulus / (1.0 - steel.poissonsRatio * steel.poissonsRatio);
  const double stiffness = 4.0 / 3.0 * std::sqrt(drop.radius) * modulus;
  constexpr int kSteps = 2000;  // in a sample
  const double h = 1.0 / (kRate * kSteps);
  const double gain = 1.20 / (4.0 * std::numbers::pi * kDistance);
  const double begin = drop.time + kDistance / 343.0;
  std::vector<double> q(tones.size(), 0.0);
  std::vector<double> v(tones.size(), 0.0);
  std::vector<double> heard(frames, 0.0);
  double approach = 0.0;
  double speed = drop.speed;
  for (std::size_t frame = static_cast<std::size_t>(begin * kRate); frame < frames; ++frame) {
    for (int step = 0; step < kSteps; ++step) {
      const double t = (static_cast<double>(frame) + static_cast<double>(step) / kSteps) / kRate;
      double depth = approach;
      for (const double coordinate : q)
        depth -= kShape * coordinate;
      const double force = t < begin || depth <= 0.0 ? 0.0 : stiffness * depth * std::sqrt(depth);
      for (std::size_t mode = 0; mode < tones.size(); ++mode) {
        const double omega = 2.0 * std::numbers::pi * tones[mode].frequency;
        const double acceleration =
            kShape * force - 2.0 * tones[mode].decayRate * v[mode] - omega * omega * q[mode];
        // The push is downwards, against the shapes.
        if (step == 0) heard[frame] -= gain * tones[mode].volume * acceleration;
        v[mode] += h * acceleration;
        q[mode] += h * v[mode];
      }
      if (t < begin) continue;
      speed -= h * force / drop.mass();
      approach += h * speed;
    }
  }
  return heard;
}

double rootMeanSquare(const std::vector<double>& samples, std::size_t from) {
  double sum = 0.0;
  for (std::size_t at = from; at < samples.size(); ++at)
    sum += samples[at] * samples[at];
  return std::sqrt(sum / static_cast<double>(samples.size() - from));
}

}  // namespace

TEST(CoupledRing, IsThatOfBallContactAndModesTogether) {
  const std::vector<Tone> tones = {{800.0, 10.0}, {3100.0, 20.0}, {7300.0, 40.0}};
  const BallDrop drop = dropOnBox(0.0100037);
  Synth synth = floorThatRings(drop, tones, coupled());
  synth.schedule(floorShare(drop));
  const std::vector<double> heard = renderMono(synth, 2400);
  const std::vector<double> wanted = integratedTogether(drop, tones, heard.size());
  std::vector<double> error(heard.size());
  for (std::size_t at = 0; at < heard.size(); ++at)
    error[at] = heard[at] - wanted[at];
  const auto rings = static_cast<std::size_t>((drop.time + kDistance / 343.0) * kRate) + 30;
  EXPECT_LT(rootMeanSquare(error, rings), 0.01 * rootMeanSquare(wanted, rings));
  // As a rigid body's contact, it would be much louder.
  SynthSettings pressed = coupled();
  pressed.ringingContact = RingingContact::pressed;
  Synth loud = floorThatRings(drop, tones, pressed);
  loud.schedule(floorShare(drop));
  EXPECT_GT(rootMeanSquare(renderMono(loud, 2400), rings), 1.05 * rootMeanSquare(wanted, rings));
}

TEST(CoupledRing, BothSharesAreOneImpactInTheBooks) {
  const BallDrop drop = dropOnBox(0.01);
  Synth synth = floorThatRings(drop, {{800.0, 10.0}, {3100.0, 20.0}}, coupled());
  ImpulseEvent ball = drop.event();
  ImpulseEvent floor = floorShare(drop);
  exchangePoses(ball, floor);
  synth.schedule(ball);
  synth.schedule(floor);
  const ContactEnergy energy = synth.contactEnergy(1.0);
  EXPECT_EQ(energy.impacts, 1U);
  EXPECT_EQ(energy.bound, 1U) << "an elastic impulse leaves the modes nothing";
  EXPECT_NEAR(energy.approach, 0.5 * drop.mass() * drop.speed * drop.speed, 1e-12);
  EXPECT_GT(energy.modes, 0.01 * energy.approach);
  EXPECT_LT(energy.modes, energy.approach);
  EXPECT_NEAR(energy.parting + energy.modes + energy.damped + energy.contacts, energy.approach,
              1e-9 * energy.approach);
}

// Whatever an event says, what is heard is a number.
TEST(CoupledRing, OfImpactsBeyondAllMeasureIsFinite) {
  const BallDrop drop = dropOnBox(0.01);
  for (const double speed : {1e-12, 1e-3, 1e3, 1e6})
    for (const double mass : {1e-15, 1e-6, 1.0, 1e6})
      for (const double share : {0.0, 1e-3, 1.0, 1e3}) {
        Synth synth = floorThatRings(drop, {{800.0, 10.0}, {15000.0, 20.0}}, coupled());
        ImpulseEvent event = floorShare(drop);
        event.approachSpeed = speed;
        event.effectiveMass = mass;
        event.impulse = Vec3(0.0, 0.0, -share * mass * speed);
        synth.schedule(event);
        for (const double sample : renderMono(synth, 960))
          ASSERT_TRUE(std::isfinite(sample)) << speed << " m/s, " << mass << " kg, " << share;
        const ContactEnergy energy = synth.contactEnergy(1.0);
        ASSERT_LE(energy.modes, energy.approach * (1.0 + 1e-9));
      }
}

// An impact on which modes have no effect has the bits that it has without them.
TEST(CoupledRing, OfSomethingTinyIsThatOfARigidContact) {
  BallDrop drop = dropOnBox(0.01);
  drop.radius = 0.0005;
  drop.centre.z() = 0.0105;
  const std::vector<Tone> tones = {{800.0, 10.0}, {3100.0, 20.0}};
  SynthSettings pressed = coupled();
  pressed.ringingContact = RingingContact::pressed;
  Synth one = floorThatRings(drop, tones, coupled());
  Synth other = floorThatRings(drop, tones, pressed);
  one.schedule(floorShare(drop));
  other.schedule(floorShare(drop));
  EXPECT_EQ(renderMono(one, 2400), renderMono(other, 2400));
  EXPECT_EQ(one.contactEnergy(1.0).impacts, 0U);
}

}  // namespace carom::test
