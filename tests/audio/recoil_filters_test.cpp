#include "audio/radiation/recoil_filters.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <limits>
#include <memory>
#include <numbers>
#include <span>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "audio/model/spherical_harmonics.h"
#include "carom/audio/absorption.h"
#include "carom/audio/synth.h"
#include "tests/audio/ball_drop.h"
#include "tests/audio/recoils.h"
#include "tests/support/click_spectrum.h"

namespace carom {

using namespace audio;
using namespace test;

namespace {

using Complex = std::complex<double>;
using std::numbers::pi;
using testing::HasSubstr;

constexpr double kAir = 1.2;      // kg/m^3
constexpr double kSpeed = 343.0;  // m/s

struct Case {
  double radius = 0.05;
  Vec3 listener = {0.7, -0.4, 0.9};
  double sampleRate = 48000.0;
  bool air = false;
};

constexpr double kMass = 0.3;
const Vec3 kPlace(0.1, 0.2, -0.1);
const Quat kTurned(Eigen::AngleAxisd(0.7, Vec3(1.0, -2.0, 0.5).normalized()));
const Vec3 kImpulse(0.02, -0.05, 0.03);
const Vec3 kArm(0.01, 0.02, -0.015);
const Eigen::Matrix3d kInverseInertia = Vec3(900.0, 700.0, 800.0).asDiagonal();

ImpulseEvent blow() {
  ImpulseEvent event;
  event.time = 0.05;
  event.body = kBall;
  event.other = kFloor;
  event.impulse = kImpulse;
  event.normal = kImpulse.normalized();
  event.position = kPlace + kArm;
  event.bodyPosition = kPlace;
  event.bodyOrientation = kTurned;
  event.approachSpeed = 0.5;
  event.effectiveMass = kMass;
  event.radius = 0.01;
  return event;
}

struct Heard {
  std::vector<double> samples;
  double bound = 0.0;
  double duration = 0.0;
};

Heard hear(const Case& setup, const SoundBody& body) {
  SynthSettings settings;
  settings.sampleRate = setup.sampleRate;
  settings.audibleThreshold = 0.0;
  settings.doppler = false;
  settings.airAbsorption = setup.air;
  Synth synth = *Synth::create(settings, {{"here", setup.listener}});
  EXPECT_TRUE(synth.setBody(kBall, body));
  EXPECT_TRUE(synth.setBody(kFloor, {.material = body.material}));
  Heard heard;
  heard.bound = synth.schedule(blow());
  heard.duration = synth.contactDuration(blow());
  for (int block = 0; block < 2000 && !synth.isSilent(); ++block) {
    heard.samples.resize(heard.samples.size() + 512);
    double* const channel = &heard.samples[heard.samples.size() - 512];
    synth.render<double>(std::span(&channel, 1), 512);
  }
  EXPECT_TRUE(synth.isSilent());
  return heard;
}

SoundBody bodyOf(const Case& setup) {
  SoundBody body{.material = *findMaterial("steel"), .mass = kMass, .radius = setup.radius};
  body.material.youngsModulus = 2e12;  // a short contact: the whole band sounds
  return body;
}

SoundBody shapedBody(const Case& setup, RigidRecoil recoil) {
  SoundBody body = bodyOf(setup);
  body.shape = std::make_shared<const RigidRadiator>(sphereRadiator(setup.radius));
  body.inverseInertia = kInverseInertia;
  body.recoil = std::make_shared<const RigidRecoil>(std::move(recoil));
  return body;
}

double peakOf(const std::vector<double>& samples) {
  double peak = 0.0;
  for (const double sample : samples)
    peak = std::max(peak, std::abs(sample));
  return peak;
}

TEST(RecoilFilters, RecoilOfASphereSoundsAsTheSphereAtAnyDistance) {
  for (const double radius : {0.003, 0.05, 1.0}) {
    for (const double distance : {1.1, 2.0, 100.0}) {
      const Case setup{.radius = radius,
                       .listener = kPlace + distance * radius * Vec3(0.6, 0.0, 0.8)};
      SoundBody sphere = bodyOf(setup);
      const Heard expected = hear(setup, sphere);
      const Heard got = hear(setup, shapedBody(setup, recoilOfSphere(radius)));
      ASSERT_EQ(got.samples.size(), expected.samples.size());
      double error = 0.0;
      for (std::size_t at = 0; at < got.samples.size(); ++at)
        error = std::max(error, std::abs(got.samples[at] - expected.samples[at]));
      EXPECT_LT(error, 1e-6 * peakOf(expected.samples)) << radius << ' ' << distance;
    }
  }
}

/// The spectrum of what is heard over that of the force, by the definition of RigidRecoil, with the
/// near field of the dipoles.
Complex transfer(const RigidRecoil& recoil, const Vec3& listener, double frequency) {
  const Vec3 to = kTurned.conjugate() * (listener - kPlace);
  const Vec3 impulse = kTurned.conjugate() * kImpulse;
  const Vec3 arm = kTurned.conjugate() * kArm;
  const Vec3 linear = impulse / kMass;
  const Vec3 angular = kInverseInertia * arm.cross(impulse);
  const Complex s = Complex(0.0, 2.0 * pi * frequency) * recoil.radius / kSpeed;
  std::vector<double> harmonics(16);
  const Vec3 unit = to.normalized();
  sphericalHarmonics<double>(unit.x(), unit.y(), unit.z(), 3, harmonics);
  Complex sum = 0.0;
  for (std::size_t term = 0; term < recoil.terms.size(); ++term) {
    const auto [motion, harmonic] = recoil.terms[term];
    const double strength = motion < 3 ? linear[motion] : recoil.radius * angular[motion - 3];
    Complex response = 0.0;
    for (std::size_t pole = 0; pole < recoil.poles.size(); ++pole) {
      const Complex residue(recoil.residues[term * recoil.poles.size() + pole]);
      response += residue / (s - recoil.poles[pole]) +
                  std::conj(residue) / (s - std::conj(recoil.poles[pole]));
    }
    const bool isDipole = harmonic >= 1 && harmonic <= 3;
    const Complex near = isDipole ? 1.0 + recoil.radius / (s * to.norm()) : Complex(1.0);
    sum += strength * harmonics[harmonic] * near * response;
  }
  return kAir * recoil.radius * recoil.radius / to.norm() * sum;
}

// Bodies of a few millimetres have most of their poles above the band.
TEST(RecoilFilters, SoundIsThatOfAllPolesHoweverManyLieAboveTheBand) {
  for (const double radius : {0.002, 0.01, 0.05, 0.5}) {
    const Case setup{.radius = radius, .listener = kPlace + 8.0 * radius * Vec3(0.36, 0.48, -0.8)};
    const RigidRecoil recoil = someRecoil(radius, 5);
    const Heard heard = hear(setup, shapedBody(setup, recoil));
    std::vector<double> frequencies;
    for (double frequency = 60.0; frequency < 19500.0; frequency *= 1.03)
      frequencies.push_back(frequency);
    const ClickCase click{.duration = heard.duration};
    const std::vector<Complex> force = forceSpectrum(click, frequencies);
    const std::vector<Complex> got = spectrumOf(heard.samples, setup.sampleRate, frequencies);
    double error = 0.0;
    double loudest = 0.0;
    for (std::size_t at = 0; at < frequencies.size(); ++at) {
      const double delay = 0.05 + ((setup.listener - kPlace).norm() - radius) / kSpeed;
      const Complex expected = force[at] * transfer(recoil, setup.listener, frequencies[at]) *
                               std::polar(1.0, -2.0 * pi * frequencies[at] * delay);
      error = std::max(error, std::abs(got[at] - expected));
      loudest = std::max(loudest, std::abs(expected));
    }
    EXPECT_LT(error, 3e-3 * loudest) << radius;
    EXPECT_GT(heard.bound, peakOf(heard.samples)) << radius;
    EXPECT_LT(heard.bound, 20.0 * peakOf(heard.samples)) << radius;
  }
}

// AirFilter is within 0.5 dB of the formula, and does not delay low frequencies.
TEST(RecoilFilters, TheAirAbsorbsOnTheWay) {
  Case setup{.listener = kPlace + 40.0 * Vec3(0.36, 0.48, -0.8)};
  const SoundBody body = shapedBody(setup, someRecoil(setup.radius, 5));
  const std::vector<double> frequencies = {200.0, 1000.0, 4000.0, 8000.0, 16000.0};
  const auto spectrum = [&] {
    return spectrumOf(hear(setup, body).samples, setup.sampleRate, frequencies);
  };
  const std::vector<Complex> without = spectrum();
  setup.air = true;
  const std::vector<Complex> with = spectrum();
  for (std::size_t at = 0; at < frequencies.size(); ++at) {
    const double loss = 40.0 * airAttenuation({}, frequencies[at]) * 10.0 / std::numbers::ln10;
    EXPECT_NEAR(20.0 * std::log10(std::abs(with[at] / without[at])), -loss, 0.5) << frequencies[at];
  }
  EXPECT_NEAR(std::arg(with[0] / without[0]), 0.0, 0.02);
}

TEST(RecoilFilters, WallsMirrorTheDirectionInWhichABodyIsHeard) {
  const Case setup{.radius = 0.05};
  const SoundBody body = shapedBody(setup, someRecoil(setup.radius, 5));
  SynthSettings settings;
  settings.audibleThreshold = 0.0;
  settings.doppler = false;
  settings.airAbsorption = false;
  settings.room.reflectors = {{.normal = Vec3::UnitX(), .offset = -2.0}};
  Synth both = *Synth::create(settings, {{"here", setup.listener}});
  ASSERT_TRUE(both.setBody(kBall, body));
  ASSERT_TRUE(both.setBody(kFloor, {.material = body.material}));
  (void)both.schedule(blow());
  std::vector<double> heard(8192);
  double* channel = heard.data();
  both.render<double>(std::span(&channel, 1), heard.size());

  std::vector<double> expected = hear(setup, body).samples;
  expected.resize(heard.size());
  Case behind = setup;  // the listener in the mirror hears what the wall sends back
  behind.listener.x() = -4.0 - setup.listener.x();
  const std::vector<double> image = hear(behind, body).samples;
  for (std::size_t at = 0; at < std::min(image.size(), expected.size()); ++at)
    expected[at] += image[at];
  for (std::size_t at = 0; at < heard.size(); ++at)
    ASSERT_NEAR(heard[at], expected[at], 1e-9 * peakOf(expected)) << at;
}

// The back of a figure of eight turns the sign of what it hears.
TEST(RecoilFilters, MicrophonesHearAsMuchFromBehindWithTheOtherSign) {
  const Case setup{.radius = 0.05};
  const SoundBody body = shapedBody(setup, someRecoil(setup.radius, 5));
  std::array<std::vector<double>, 2> heard;
  std::array<double, 2> bounds{};
  for (const bool fromBehind : {false, true}) {
    const Vec3 ahead = (kPlace - setup.listener) * (fromBehind ? -1.0 : 1.0);
    const Listener listener{.name = "here",
                            .position = setup.listener,
                            .orientation = Quat::FromTwoVectors(-Vec3::UnitZ(), ahead),
                            .pattern = 1.0};
    SynthSettings settings;
    settings.doppler = false;
    Synth synth = *Synth::create(settings, {listener});
    ASSERT_TRUE(synth.setBody(kBall, body));
    ASSERT_TRUE(synth.setBody(kFloor, {.material = body.material}));
    bounds.at(fromBehind ? 1 : 0) = synth.schedule(blow());
    std::vector<double>& samples = heard.at(fromBehind ? 1 : 0);
    samples.resize(8192);
    double* channel = samples.data();
    synth.render<double>(std::span(&channel, 1), samples.size());
  }
  const double peak = peakOf(heard[0]);
  EXPECT_GT(peak, 0.0);
  EXPECT_GT(bounds[0], peak);
  EXPECT_NEAR(bounds[1], bounds[0], 1e-9 * bounds[0]);
  for (std::size_t at = 0; at < heard[0].size(); ++at)
    ASSERT_NEAR(heard[1][at], -heard[0][at], 1e-9 * peak) << at;
}

TEST(RigidRecoil, RefusesWhatGrowsOrDoesNotFit) {
  const auto refusal = [](const auto& change) {
    RigidRecoil recoil = recoilOfSphere(0.1);
    change(recoil);
    const Status valid = validate(recoil);
    return valid ? std::string() : valid.error().message;
  };
  EXPECT_EQ(refusal([](RigidRecoil&) {}), "");
  EXPECT_THAT(refusal([](RigidRecoil& r) { r.radius = 0.0; }), HasSubstr("radius"));
  EXPECT_THAT(refusal([](RigidRecoil& r) { r.poles[0] = {0.0, 1.0}; }), HasSubstr("decay"));
  EXPECT_THAT(refusal([](RigidRecoil& r) { r.poles.clear(); }), HasSubstr("poles"));
  EXPECT_THAT(refusal([](RigidRecoil& r) { r.residues.pop_back(); }), HasSubstr("residue"));
  EXPECT_THAT(refusal([](RigidRecoil& r) { r.terms[0].motion = 6; }), HasSubstr("motion"));
  EXPECT_THAT(refusal([](RigidRecoil& r) { r.terms[0].harmonic = 625; }), HasSubstr("order"));
  EXPECT_THAT(
      refusal([](RigidRecoil& r) { r.residues[0] = std::numeric_limits<float>::infinity(); }),
      HasSubstr("finite"));
}

}  // namespace
}  // namespace carom
