#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "audio/dsp/spread_kernel.h"
#include "audio/model/hertz.h"
#include "tests/audio/ball_drop.h"
#include "tests/support/click_spectrum.h"
#include "tests/support/constants.h"

// Tests listeners and bodies that move while a contact lasts, against closed forms and against
// pressure that is computed from the time of emission for each of very many samples.

namespace carom {

using namespace audio;

namespace {

using namespace test;

using std::numbers::pi;
using test::kBall;
using test::kFloor;
using test::peakOf;
using test::renderMono;
using test::spectrumOf;
using Complex = std::complex<double>;
using Samples = std::vector<double>;

constexpr double kC = 343.0;
constexpr double kMass = 0.1;     // kg
constexpr double kRadius = 0.01;  // m
constexpr double kTime = 0.02;    // s, time of first touch

/// An impact along `axis` on a body whose mean velocity during the contact is `velocity`.
ImpulseEvent hitAlong(const Vec3& axis, const Vec3& velocity, double time = kTime) {
  ImpulseEvent event;
  event.time = time;
  event.body = kBall;
  event.other = kFloor;
  event.normal = Vec3::UnitZ();
  event.impulse = 2.0 * kMass * axis;
  event.approachSpeed = 1.0;
  event.effectiveMass = kMass;
  event.radius = kRadius;
  event.bodyPosition = velocity * (time - kTime);
  event.bodyVelocity = velocity - event.impulse / (2.0 * kMass);
  return event;
}

/// Returns a synth whose material is so stiff that contacts last `duration` s.
Synth synthFor(double duration, const std::vector<Listener>& listeners, SynthSettings settings) {
  settings.audibleThreshold = 0.0;
  settings.airAbsorption = false;
  Material material = *findMaterial("steel");
  const double made = hertzDuration(hitAlong(Vec3::UnitX(), Vec3::Zero()), material, material);
  material.youngsModulus *= std::pow(made / duration, 2.5);
  Synth synth = *Synth::create(settings, listeners);
  EXPECT_TRUE(synth.setBody(kBall, {.material = material, .mass = kMass, .radius = kRadius}));
  EXPECT_TRUE(synth.setBody(kFloor, {.material = material}));
  return synth;
}

/// Moves the listener at a constant velocity; it is at `place` at the time kTime.
void moveEvenly(Synth& synth, const Vec3& place, const Vec3& velocity) {
  for (const double time : {-1.0, 0.5, 1.5})
    ASSERT_TRUE(synth.moveListener(0, {time, place + (time - kTime) * velocity}));
}

struct Ride {
  double duration;  // s
  Vec3 place;       // m, the listener's when the contact begins
  Vec3 velocity;    // m/s, the listener's or the body's
  // Bounds in dB of what the change of loudness adds to the error and of what the parabola leaves.
  double ofListener;
  double ofBody;
};

void PrintTo(const Ride& ride, std::ostream* out) {
  *out << ride.duration * 1e3 << " ms at " << ride.velocity.norm() << " m/s from "
       << ride.place.transpose();
}

const Vec3 kAxis = Vec3(0.8, 0.0, 0.6);
constexpr double kStrength = 1.20 * kRadius * kRadius * kRadius / (2.0 * kC) * 2.0;  // Pa m s^2
constexpr double kFine = 64.0 * kRate;

struct Grid {
  double begin;  // s
  Samples pressure;
};

/// Pressure at the moving microphone: the field of a dipole at rest, at each instant.
Grid atMovingListener(const Ride& ride) {
  const Pulse& pulse = Pulse::of(PulseShape::hertz);
  Grid grid{kTime, Samples(static_cast<std::size_t>(kFine * (0.05 + 3.0 * ride.duration)))};
  for (std::size_t n = 0; n < grid.pressure.size(); ++n) {
    const double t = grid.begin + static_cast<double>(n) / kFine;
    const Vec3 way = ride.place + (t - kTime) * ride.velocity;
    const double r = way.norm();
    const double u = (t - r / kC - kTime) / ride.duration;
    grid.pressure[n] =
        kStrength * kAxis.dot(way) / (r * r) * pulse.slope(u) / (ride.duration * ride.duration);
  }
  return grid;
}

/// The moving body's field by Lowson 1965, "The sound field for singularities in motion", eq. 12,
/// without its near field: d/dt of dipole . n / r * force / (1 - M), all at the time of emission,
/// which is a root of a quadratic equation. The derivative is left to the spectrum.
Grid momentOfMovingBody(const Ride& ride) {
  const Pulse& pulse = Pulse::of(PulseShape::hertz);
  Grid grid{kTime, Samples(static_cast<std::size_t>(kFine * (0.05 + 3.0 * ride.duration)))};
  const double mach2 = ride.velocity.squaredNorm() / (kC * kC);
  for (std::size_t n = 0; n < grid.pressure.size(); ++n) {
    // The delay s solves c s = |place - v (T - s)|, where T is the time since first touch.
    const double since = static_cast<double>(n) / kFine;
    const Vec3 now = ride.place - since * ride.velocity;
    const double b = now.dot(ride.velocity) / (kC * kC);
    const double c = now.squaredNorm() / (kC * kC);
    const double delay = (b + std::sqrt(b * b + (1.0 - mach2) * c)) / (1.0 - mach2);
    const Vec3 way = now + delay * ride.velocity;
    const double r = way.norm();
    const double u = (since - delay) / ride.duration;
    grid.pressure[n] = kStrength * kAxis.dot(way) / (r * r) * pulse.force(u) / ride.duration /
                       (1.0 - way.dot(ride.velocity) / (r * kC));
  }
  return grid;
}

std::vector<double> frequenciesFor(double duration) {
  std::vector<double> frequencies;
  frequencies.reserve(240);
  const double low = 0.02 / duration;
  const double edge = kBand * kRate;
  for (int i = 0; i < 240; ++i)
    frequencies.push_back(low * std::pow(edge / low, i / 239.0));
  return frequencies;
}

double energyOf(const std::vector<Complex>& spectrum, const std::vector<double>& frequencies) {
  double sum = 0.0;
  for (std::size_t i = 1; i < spectrum.size(); ++i)
    sum += 0.5 * (std::norm(spectrum[i]) + std::norm(spectrum[i - 1])) *
           (frequencies[i] - frequencies[i - 1]);
  return sum;
}

/// Energy of the error in the band, in dB relative to the expected signal's.
double errorOf(const Samples& made, const Grid& wanted, bool derive, double duration) {
  const std::vector<double> frequencies = frequenciesFor(duration);
  std::vector<Complex> error = spectrumOf(made, kRate, frequencies);
  std::vector<Complex> exact = spectrumOf(wanted.pressure, kFine, frequencies);
  for (std::size_t i = 0; i < exact.size(); ++i) {
    const double omega = 2.0 * pi * frequencies[i];
    exact[i] *= std::polar(1.0, -omega * wanted.begin) * (derive ? Complex(0.0, omega) : 1.0);
    error[i] -= exact[i];
  }
  return 10.0 * std::log10(energyOf(error, frequencies) / energyOf(exact, frequencies));
}

SynthSettings compact() {
  SynthSettings settings;
  settings.comparison.radiation = Radiation::compact;
  return settings;
}

class Rides : public testing::TestWithParam<Ride> {};

TEST_P(Rides, AMovingListenerHearsTheFieldItMovesThrough) {
  const Ride& ride = GetParam();
  Synth synth = synthFor(ride.duration, {{"moving", ride.place}}, compact());
  moveEvenly(synth, ride.place, ride.velocity);
  synth.schedule(hitAlong(kAxis, Vec3::Zero()));
  const double error =
      errorOf(renderMono(synth, 9600), atMovingListener(ride), false, ride.duration);
  RecordProperty("error_dB", std::to_string(error));
  EXPECT_LT(error, ride.ofListener);
}

TEST_P(Rides, AMovingBodySoundsLikeAMovingDipole) {
  const Ride& ride = GetParam();
  Synth synth = synthFor(ride.duration, {{"seat", ride.place}}, compact());
  synth.schedule(hitAlong(kAxis, ride.velocity));
  const double error =
      errorOf(renderMono(synth, 9600), momentOfMovingBody(ride), true, ride.duration);
  RecordProperty("error_dB", std::to_string(error));
  EXPECT_LT(error, ride.ofBody);
}

INSTANTIATE_TEST_SUITE_P(SynthMotion, Rides,
                         testing::Values(Ride{1e-3, {3, 0, 0}, {0, 0, 0}, -85.0, -85.0},
                                         Ride{1e-3, {3, 0, 0}, {-30, 0, 0}, -50.0, -80.0},
                                         Ride{1e-3, {3, 0, 0}, {30, 0, 0}, -50.0, -80.0},
                                         Ride{5e-3, {3, 1, 0}, {-10, 0, 0}, -48.0, -80.0},
                                         Ride{5e-3, {3, 1, 0}, {-30, 0, 0}, -38.0, -80.0},
                                         Ride{20e-3, {10, 1, 0}, {3, 0, 0}, -55.0, -80.0},
                                         Ride{20e-3, {10, 1, 0}, {30, 0, 0}, -35.0, -80.0},
                                         Ride{20e-3, {10, 1, 0}, {-30, 0, 0}, -35.0, -80.0},
                                         Ride{20e-3, {3, 1, 0}, {0, 30, 0}, -26.0, -61.0},
                                         Ride{20e-3, {3, 1, 0}, {-30, 0, 0}, -26.0, -71.0}));

// --- Clicks in a row ----------------------------------------------------------------------------

constexpr double kTone = 2500.0;  // Hz

// While the listener moves straight on, the level of each click follows its distance, and its time
// the Doppler shift of the rhythm: nothing jumps at poses, samples or blocks.
TEST(SynthMotion, ARowOfClicksShiftsInTimeAndLevelAsOnePiece) {
  constexpr double kPeriod = 0.0193;
  constexpr int kClicks = 40;
  for (const double speed : {-12.0, 12.0}) {  // away, towards
    Synth synth = synthFor(100e-6, {{"moving", {20, 0, 0}}}, compact());
    for (int frame = -2; frame < 70; ++frame) {
      const double time = frame / 60.0;
      ASSERT_TRUE(synth.moveListener(0, {time, Vec3(20.0 - speed * time, 0, 0)}));
    }
    for (int click = 0; click < kClicks; ++click)
      synth.schedule(hitAlong(Vec3::UnitX(), Vec3::Zero(), kPeriod * click));
    const Samples all = renderMono(synth, 48000);
    Complex first;
    for (int click = 0; click < kClicks; ++click) {
      // The arrival t solves |x(t)| = c (t - t_e) with x(t) = 20 - speed t.
      const double left = kPeriod * click;
      const double arrival = (20.0 + kC * left) / (kC + speed);
      const double distance = 20.0 - speed * arrival;
      const auto begin = static_cast<std::size_t>((arrival - 0.002) * kRate);
      const Samples own(all.begin() + static_cast<std::ptrdiff_t>(begin),
                        all.begin() + static_cast<std::ptrdiff_t>(begin + 400));
      ASSERT_GT(peakOf(own), 0.0);
      const double since = arrival - static_cast<double>(begin) / kRate;
      const Complex value =
          spectrumOf(own, kRate, {kTone})[0] * distance * std::polar(1.0, 2.0 * pi * kTone * since);
      if (click == 0) first = value;
      EXPECT_NEAR(std::abs(value / first), 1.0, 1e-4) << click;
      // In 2 ns (the bound, s) sound travels less than a micrometre.
      EXPECT_NEAR(std::arg(value / first) / (2.0 * pi * kTone), 0.0, 2e-9) << click;
    }
  }
}

// The Doppler factor is measured as the time between the pressure's two lobes, over the same at
// rest.
TEST(SynthMotion, TheContactIsHeardShorterOrLongerByTheDopplerFactor) {
  constexpr double kDuration = 10e-3;
  const auto lobes = [&](double listenerSpeed, double bodySpeed) {
    Synth synth = synthFor(kDuration, {{"moving", {40, 0, 0}}}, compact());
    moveEvenly(synth, {40, 0, 0}, {listenerSpeed, 0, 0});
    synth.schedule(hitAlong(Vec3::UnitX(), {bodySpeed, 0, 0}));
    const Samples heard = renderMono(synth, 14400);
    const auto [low, high] = std::ranges::minmax_element(heard);
    return static_cast<double>(low - high) / kRate;  // s
  };
  const double rest = lobes(0.0, 0.0);
  ASSERT_GT(rest, 0.3 * kDuration);
  const double sample = 1.5 / kRate;
  for (const double speed : {-30.0, 30.0}) {
    EXPECT_NEAR(lobes(speed, 0.0), rest / (1.0 - speed / kC), sample) << speed;
    EXPECT_NEAR(lobes(0.0, speed), rest * (1.0 - speed / kC), sample) << speed;
  }
}

TEST(SynthMotion, WithoutDopplerAClickIsThatOfTheFirstTouch) {
  SynthSettings still = compact();
  still.doppler = false;
  Synth moving = synthFor(5e-3, {{"moving", {3, 1, 0}}}, still);
  moveEvenly(moving, {3, 1, 0}, {0, 0, 0});
  moving.schedule(hitAlong(kAxis, {30, 0, 0}));
  Synth resting = synthFor(5e-3, {{"seat", {3, 1, 0}}}, still);
  resting.schedule(hitAlong(kAxis, Vec3::Zero()));
  EXPECT_EQ(renderMono(moving, 9600), renderMono(resting, 9600));
}

TEST(SynthMotion, TheFirstPoseMayBeOfAnyTimeAndPlace) {
  for (const double time : {-5.0, 0.0, 0.016}) {
    Synth moved = synthFor(1e-3, {{"moving", {300, 0, 0}}}, compact());
    ASSERT_TRUE(moved.moveListener(0, {time, {3, 1, 0}}));
    moved.schedule(hitAlong(kAxis, Vec3::Zero()));
    Synth there = synthFor(1e-3, {{"seat", {3, 1, 0}}}, compact());
    there.schedule(hitAlong(kAxis, Vec3::Zero()));
    EXPECT_EQ(renderMono(moved, 9600), renderMono(there, 9600)) << time;
    EXPECT_FALSE(moved.moveListener(0, {time, {3, 1, 0}})) << "not later";
    EXPECT_FALSE(moved.moveListener(0, {time + 0.01, {9, 1, 0}})) << "600 m/s";
    EXPECT_FALSE(moved.moveListener(1, {time + 0.01, {3, 1, 0}})) << "no such listener";
  }
}

TEST(SynthMotion, AReplayAfterSeekGivesTheSameBits) {
  Synth synth = synthFor(1e-3, {{"moving", {3, 0, 0}}}, {});
  Samples takes[2];
  for (Samples& take : takes) {
    ASSERT_TRUE(synth.seek(0.0));
    for (int frame = 0; frame < 6; ++frame) {
      const double time = frame / 60.0;
      ASSERT_TRUE(synth.moveListener(0, {time, {3.0 + time, 5.0 * time, 0}}));
      synth.schedule(hitAlong(kAxis, {0, 3, 0}, time + 0.02));
      for (const double sample : renderMono(synth, 800))
        take.push_back(sample);
    }
  }
  EXPECT_GT(peakOf(takes[0]), 0.0);
  EXPECT_EQ(takes[0], takes[1]);
}

}  // namespace
}  // namespace carom
