#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <functional>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "audio/model/hertz.h"
#include "audio/model/pulse.h"
#include "carom/audio/absorption.h"
#include "carom/audio/synth.h"
#include "tests/audio/ball_drop.h"
#include "tests/audio/ringing_box.h"
#include "tests/support/constants.h"
#include "tests/support/no_alloc_scope.h"

// Rings in motion, against the sum of the modes evaluated sample by sample: for each sample, the
// instant at which what is heard has left the body is searched for, and the pressure is that of the
// modes' accelerations then, over the distance and in the direction from where the body was.

namespace carom::test {

using namespace audio;

namespace {

constexpr double kSound = 343.0;   // m/s
constexpr double kDensity = 1.20;  // kg/m^3
constexpr double kBlow = 0.01;     // s
constexpr double kPosesPerSecond = 240.0;
constexpr double kGrowth = 5.0;  // 1/sqrt(kg): shape of all modes of boxOf

/// A mode as it is heard: a monopole, or a dipole along the body's z.
struct HeardMode {
  Tone tone;
  bool isDipole = false;
};

/// Motion of the body and of the listener, as functions of time.
struct Course {
  std::function<Vec3(double)> body = [](double) { return Vec3::Zero().eval(); };
  std::function<Quat(double)> turned = [](double) { return Quat::Identity(); };
  std::function<Vec3(double)> listener = [](double) { return Vec3(0.0, 1.0, 0.0); };
  bool bodyMoves = false;
  bool listenerMoves = false;
};

std::function<Vec3(double)> line(const Vec3& from, const Vec3& velocity) {
  return [=](double time) { return Vec3(from + time * velocity); };
}

Vec3 velocityOf(const Course& course, double time) {
  constexpr double kStep = 1e-5;
  return (course.body(time + kStep) - course.body(time - kStep)) / (2.0 * kStep);
}

std::shared_ptr<const ModalModel> modelOf(const std::vector<HeardMode>& modes) {
  std::vector<Tone> tones;
  for (const HeardMode& mode : modes)
    tones.push_back(mode.tone);
  ModalModel model = *boxOf(tones);
  for (std::size_t mode = 0; mode < modes.size(); ++mode) {
    if (!modes[mode].isDipole) continue;
    // A far field of volume rho / (4 pi) cos(angle to z) / r, of which Y_10 is sqrt(3 / (4 pi))
    // cos.
    const double far = kDensity * modes[mode].tone.volume / (4.0 * kPi);
    model.modes[mode].radiation.multipoles = {0.0, 0.0, far * std::sqrt(4.0 * kPi / 3.0), 0.0};
  }
  return std::make_shared<const ModalModel>(std::move(model));
}

/// The blow: a force along the body's z, at the end of the box.
ImpulseEvent blowOf(const Course& course, double time = kBlow) {
  ImpulseEvent event = floorShare(dropOnBox(time));
  event.bodyPosition = course.body(time);
  event.bodyOrientation = course.turned(time);
  event.bodyVelocity = velocityOf(course, time);
  event.position = event.bodyPosition + event.bodyOrientation * Vec3(0.0, 0.0, 0.01);
  event.impulse = event.bodyOrientation * event.impulse;
  event.normal = event.bodyOrientation * event.normal;
  return event;
}

SynthSettings plainSettings() {
  SynthSettings settings;
  settings.ringingContact = RingingContact::pressed;
  settings.airAbsorption = false;
  settings.medium.speedOfSound = kSound;
  settings.medium.density = kDensity;
  return settings;
}

Synth synthOf(const std::vector<HeardMode>& modes, const Course& course,
              const SynthSettings& settings = plainSettings()) {
  Listener listener{"seat", course.listener(0.0)};
  Synth synth = *Synth::create(settings, {listener});
  SoundBody body = dropOnBox(kBlow).floor();
  body.modal = modelOf(modes);
  EXPECT_TRUE(synth.setBody(kBall, {.material = body.material}));
  EXPECT_TRUE(synth.setBody(kFloor, body));
  return synth;
}

/// Hands over all poses up to `end` (s).
void giveCourse(Synth& synth, const Course& course, double end) {
  synth.advanceTo(0.0);
  const auto count = static_cast<int>(std::ceil(end * kPosesPerSecond)) + 1;
  for (int index = 0; index <= count; ++index) {
    const double time = index / kPosesPerSecond;
    if (course.bodyMoves) {
      EXPECT_TRUE(synth.moveBody(kFloor, {time, course.body(time), course.turned(time)}));
    }
    if (course.listenerMoves) {
      EXPECT_TRUE(synth.moveListener(0, {time, course.listener(time), Quat::Identity()}));
    }
  }
}

std::vector<double> heardOf(Synth synth, const Course& course, std::size_t frames) {
  const double end = static_cast<double>(frames) / kRate + 0.05;
  giveCourse(synth, course, end);
  synth.schedule(blowOf(course));
  synth.advanceTo(end);
  return renderMono(synth, frames);
}

/// One mode's coordinate under the force of the blow: integrated (Runge-Kutta) while the contact
/// lasts, exactly after it.
class Oscillator {
 public:
  Oscillator(const Tone& tone, double impulse, double duration)
      : omega_(2.0 * kPi * tone.frequency), decay_(tone.decayRate), duration_(duration) {
    const Pulse& pulse = Pulse::of(PulseShape::hertz);
    const auto acceleration = [&](double t, double q, double v) {
      return kGrowth * impulse * pulse.force(t / duration) / duration - 2.0 * decay_ * v -
             omega_ * omega_ * q;
    };
    constexpr int kSteps = 4000;
    const double h = duration / kSteps;
    for (int step = 0; step < kSteps; ++step) {
      const double t = step * h;
      const double a1 = acceleration(t, q_, v_);
      const double a2 = acceleration(t + h / 2, q_ + h / 2 * v_, v_ + h / 2 * a1);
      const double a3 = acceleration(t + h / 2, q_ + h / 2 * (v_ + h / 2 * a1), v_ + h / 2 * a2);
      const double a4 = acceleration(t + h, q_ + h * (v_ + h / 2 * a2), v_ + h * a3);
      q_ += h * v_ + h * h / 6 * (a1 + a2 + a3);
      v_ += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
    }
  }

  struct Motion {
    double velocity = 0.0;
    double acceleration = 0.0;
  };
  /// The motion so long after the first touch; none before the contact is over, and nothing is
  /// compared there.
  Motion at(double time) const {
    const double since = time - duration_;
    if (since < 0.0) return {};
    return freely(q_, v_, since);
  }

 private:
  Motion freely(double q, double v, double since) const {
    const double w = std::sqrt(omega_ * omega_ - decay_ * decay_);
    const double envelope = std::exp(-decay_ * since);
    const double c = envelope * std::cos(w * since);
    const double s = envelope * std::sin(w * since);
    const double position = q * c + (v + decay_ * q) / w * s;
    const double velocity = v * c - (omega_ * omega_ * q + decay_ * v) / w * s;
    return {velocity, -omega_ * omega_ * position - 2.0 * decay_ * velocity};
  }

  double omega_;
  double decay_;
  double duration_;
  double q_ = 0.0;
  double v_ = 0.0;
};

/// A wall without absorption: the plane y = offset, with the air on its side of smaller y.
struct Mirror {
  double offset = 0.0;
  Vec3 operator()(const Vec3& point) const {
    return {point.x(), 2.0 * offset - point.y(), point.z()};
  }
  static Vec3 vector(const Vec3& v) { return {v.x(), -v.y(), v.z()}; }
};

/// Returns when what is heard at `time` (s) at a place left the source.
double emissionOf(const std::function<Vec3(double)>& source, const Vec3& ear, double time) {
  double early = time - 1.0;
  double late = time;
  for (int bisection = 0; bisection < 60; ++bisection) {
    const double middle = 0.5 * (early + late);
    ((ear - source(middle)).norm() > kSound * (time - middle) ? late : early) = middle;
  }
  return early;
}

/// Adds the sum of the modes, sample by sample, over the direct path or by a mirror.
void addModes(const std::vector<HeardMode>& modes, const Course& course, double duration,
              std::vector<double>& heard, const Mirror* mirror = nullptr) {
  std::vector<Oscillator> oscillators;
  for (const HeardMode& mode : modes)
    oscillators.emplace_back(mode.tone, floorShare(dropOnBox(kBlow)).impulse.z(), duration);
  const auto source = [&](double time) {
    const Vec3 at = course.body(time);
    return mirror != nullptr ? (*mirror)(at) : at;
  };
  for (std::size_t frame = 0; frame < heard.size(); ++frame) {
    const double time = static_cast<double>(frame) / kRate;
    const Vec3 ear = course.listener(time);
    const double emitted = emissionOf(source, ear, time);
    const Vec3 way = ear - source(emitted);
    const double distance = way.norm();
    Vec3 axis = course.turned(emitted) * Vec3::UnitZ();
    if (mirror != nullptr) axis = Mirror::vector(axis);
    for (std::size_t mode = 0; mode < modes.size(); ++mode) {
      const Oscillator::Motion motion = oscillators[mode].at(emitted - kBlow);
      const double strength = kDensity * modes[mode].tone.volume / (4.0 * kPi * distance);
      heard[frame] += modes[mode].isDipole
                          ? strength * axis.dot(way) / distance *
                                (motion.acceleration + kSound / distance * motion.velocity)
                          : strength * motion.acceleration;
    }
  }
}

/// Error (dB) of what is heard against what is wanted, from the end of the contact on, as it is
/// smeared by the band limit.
double errorOf(const std::vector<double>& heard, const std::vector<double>& wanted,
               double firstDistance) {
  const auto from = static_cast<std::size_t>((kBlow + firstDistance / kSound) * kRate) + 30;
  double error = 0.0;
  double sum = 0.0;
  for (std::size_t n = from; n < heard.size(); ++n) {
    error += (heard[n] - wanted[n]) * (heard[n] - wanted[n]);
    sum += wanted[n] * wanted[n];
  }
  EXPECT_GT(sum, 0.0);
  return 10.0 * std::log10(error / sum);
}

double durationOf(const std::vector<HeardMode>& modes, const Course& course) {
  return synthOf(modes, course).contactDuration(blowOf(course));
}

/// Returns the error (dB) of a course in open air; without its poses nothing would be right.
double errorInAir(const char* name, const std::vector<HeardMode>& modes, const Course& course,
                  std::size_t frames) {
  const std::vector<double> heard = heardOf(synthOf(modes, course), course, frames);
  std::vector<double> wanted(frames, 0.0);
  addModes(modes, course, durationOf(modes, course), wanted);
  const double first = (course.listener(kBlow) - course.body(kBlow)).norm();
  const double error = errorOf(heard, wanted, first);
  Synth left = synthOf(modes, course);
  left.schedule(blowOf(course));
  const double unfollowed = errorOf(renderMono(left, frames), wanted, first);
  std::printf("%s: %.1f dB, not followed %.1f dB\n", name, error, unfollowed);
  EXPECT_GT(unfollowed, -10.0);
  return error;
}

const std::vector<HeardMode> kMonopoles = {
    {{440.0, 1.5, 1e-3}}, {{1300.0, 2.5, 1e-3}}, {{3100.0, 4.0, 1e-3}}};
const std::vector<HeardMode> kDipoles = {
    {{440.0, 3.0, 1e-3}, true}, {{2500.0, 6.0, 1e-3}, true}, {{4000.0, 9.0, 1e-3}, true}};

TEST(MovingRing, AListenerWhoWalksAwayHearsItFainterAndLower) {
  Course walk;
  walk.listener = line({0.0, 1.0, 0.0}, {0.0, 3.5, 0.0});
  walk.listenerMoves = true;
  EXPECT_LT(errorInAir("walk", kMonopoles, walk, 96000), -40.0);
}

// One mode alone, so that all that is heard at a time has lost as much: by the distance over which
// it has come.
TEST(MovingRing, TheAirAbsorbsByTheDistanceOfTheMoment) {
  Course walk;
  walk.listener = line({0.0, 4.0, 0.0}, {0.0, 8.0, 0.0});
  walk.listenerMoves = true;
  const std::vector<HeardMode> mode = {{{7000.0, 2.0, 1e-3}}};
  constexpr std::size_t kFrames = 48000;
  const std::vector<double> clear = heardOf(synthOf(mode, walk), walk, kFrames);
  SynthSettings settings = plainSettings();
  settings.airAbsorption = true;
  const std::vector<double> heard = heardOf(synthOf(mode, walk, settings), walk, kFrames);
  std::vector<double> wanted = clear;
  for (std::size_t frame = 0; frame < kFrames; ++frame) {
    const double distance = walk.listener(static_cast<double>(frame) / kRate).y();
    wanted[frame] *= std::exp(-0.5 * airAttenuation(settings.medium, 7000.0) * distance);
  }
  EXPECT_LT(errorOf(heard, wanted, 4.0), -50.0);
  EXPECT_GT(errorOf(heard, clear, 4.0), -30.0);
}

TEST(MovingRing, FliesByWithDopplerEffect) {
  Course fly;
  fly.body = line({-3.0, 0.0, 0.0}, {10.0, 0.0, 0.0});
  fly.turned = [](double) { return Quat(Eigen::AngleAxisd(0.3 * kPi, Vec3::UnitY())); };
  fly.bodyMoves = true;
  EXPECT_LT(errorInAir("fly-by", kDipoles, fly, 32000), -40.0);
}

TEST(MovingRing, TurnsItsPatternOutOfANode) {
  Course spin;
  spin.body = [](double) { return Vec3(0.0, -0.5, 0.0); };
  spin.turned = [](double time) {
    return Quat(Eigen::AngleAxisd(20.0 * (time - kBlow), Vec3::UnitX()));
  };
  spin.bodyMoves = true;
  EXPECT_LT(errorInAir("spin", kDipoles, spin, 32000), -40.0);
}

TEST(MovingRing, IsHeardInAWallsMirrorAsItMoves) {
  Course fly;
  fly.body = line({-2.0, -0.5, 0.3}, {5.0, 1.0, 0.0});
  fly.turned = [](double time) { return Quat(Eigen::AngleAxisd(6.0 * time, Vec3::UnitX())); };
  fly.listener = line({0.0, 0.5, 0.0}, {-1.0, 0.4, 0.3});
  fly.bodyMoves = fly.listenerMoves = true;
  const Mirror mirror{2.0};
  SynthSettings settings = plainSettings();
  settings.room.reflectors = {{.normal = -Vec3::UnitY(), .offset = -mirror.offset}};
  constexpr std::size_t kFrames = 32000;
  const std::vector<double> heard = heardOf(synthOf(kDipoles, fly, settings), fly, kFrames);
  std::vector<double> wanted(kFrames, 0.0);
  addModes(kDipoles, fly, durationOf(kDipoles, fly), wanted);
  addModes(kDipoles, fly, durationOf(kDipoles, fly), wanted, &mirror);
  const double last = (fly.listener(kBlow) - mirror(fly.body(kBlow))).norm();
  const double error = errorOf(heard, wanted, last);
  std::printf("image: %.1f dB\n", error);
  EXPECT_LT(error, -40.0);
}

Course fastFlight() {
  Course fly;
  fly.body = line({-1.0, -0.4, 0.3}, {8.0, 1.0, 0.0});
  fly.turned = [](double time) { return Quat(Eigen::AngleAxisd(9.0 * time, Vec3::UnitX())); };
  fly.bodyMoves = true;
  return fly;
}

// A body at rest whose poses are known costs nothing and changes nothing, in a room, too.
TEST(MovingRing, ABodyAtRestHasTheBitsOfOneWithoutPoses) {
  Course still;
  still.body = [](double) { return Vec3(0.2, -0.5, 0.1); };
  still.bodyMoves = true;
  SynthSettings settings = plainSettings();
  settings.room.reflectors = {{.normal = -Vec3::UnitY(), .offset = -2.0}};
  constexpr std::size_t kFrames = 9600;
  Synth unfollowed = synthOf(kDipoles, still, settings);
  unfollowed.schedule(blowOf(still));
  const std::vector<double> wanted = renderMono(unfollowed, kFrames);
  EXPECT_GT(peakOf(wanted), 1e-3);
  EXPECT_EQ(heardOf(synthOf(kDipoles, still, settings), still, kFrames), wanted);
}

TEST(MovingRing, WithoutAnAdvanceNothingIsFollowed) {
  const Course fly = fastFlight();
  const auto render = [&](bool hasPoses) {
    Synth synth = synthOf(kDipoles, fly);
    if (hasPoses) {
      EXPECT_TRUE(synth.moveBody(kFloor, {0.0, fly.body(0.0), fly.turned(0.0)}));
      EXPECT_TRUE(synth.moveBody(kFloor, {0.1, fly.body(0.1), fly.turned(0.1)}));
    }
    synth.schedule(blowOf(fly));
    return renderMono(synth, 9600);
  };
  EXPECT_EQ(render(true), render(false));
}

// Neither the sizes of blocks nor how far ahead the poses are handed over can be heard.
TEST(MovingRing, BitsDoNotDependOnBlocksAndSteps) {
  const Course fly = fastFlight();
  constexpr std::size_t kFrames = 9600;
  const std::vector<double> whole = heardOf(synthOf(kDipoles, fly), fly, kFrames);
  EXPECT_GT(peakOf(whole), 1e-3);
  for (const std::size_t block : {1u, 63u, 500u}) {
    Synth synth = synthOf(kDipoles, fly);
    synth.advanceTo(0.0);
    int poses = 0;
    bool isStruck = false;
    std::vector<double> heard;
    while (heard.size() < kFrames) {
      const std::size_t frames = std::min(block, kFrames - heard.size());
      const double ahead = static_cast<double>(heard.size() + frames) / kRate + 0.02;
      for (; (poses - 1) / kPosesPerSecond < ahead; ++poses) {
        const double time = poses / kPosesPerSecond;
        ASSERT_TRUE(synth.moveBody(kFloor, {time, fly.body(time), fly.turned(time)}));
      }
      if (!std::exchange(isStruck, true)) synth.schedule(blowOf(fly));
      synth.advanceTo(ahead);
      const std::vector<double> part = renderMono(synth, frames);
      heard.insert(heard.end(), part.begin(), part.end());
    }
    EXPECT_EQ(heard, whole) << block;
  }
}

// A body that is removed glides on as its last poses say, for a tenth of a second.
TEST(MovingRing, RingsOnWhereABodyWasThatIsRemoved) {
  Course fly;
  fly.bodyMoves = true;
  const double last = 24.0 / kPosesPerSecond;
  const std::function<Vec3(double)> path = line({-0.5, -0.4, 0.3}, {5.0, 1.0, 0.0});
  fly.body = [=](double time) { return path(std::min(time, last + 0.1)); };
  constexpr std::size_t kFrames = 14400;
  Synth synth = synthOf(kDipoles, fly);
  synth.advanceTo(0.0);
  for (double pose = 0.0; pose <= 24.0; pose += 1.0) {
    const double time = pose / kPosesPerSecond;
    ASSERT_TRUE(synth.moveBody(kFloor, {time, fly.body(time), Quat::Identity()}));
  }
  synth.schedule(blowOf(fly));
  synth.advanceTo(last);
  synth.removeBody(kFloor);
  synth.advanceTo(0.4);
  std::vector<double> wanted(kFrames, 0.0);
  addModes(kDipoles, fly, durationOf(kDipoles, fly), wanted);
  const double first = (fly.listener(kBlow) - fly.body(kBlow)).norm();
  const double error = errorOf(renderMono(synth, kFrames), wanted, first);
  std::printf("removed: %.1f dB\n", error);
  EXPECT_LT(error, -40.0);
}

// The damping is that of a dashpot at the contact, as for bodies at rest (synth_ring_test.cpp).
TEST(MovingRing, IsDampedByContactsInMotion) {
  const std::vector<HeardMode> modes = {{{1000.0, 3.0, 1e-3}, true}};
  const Course fly = fastFlight();
  constexpr std::size_t kFrames = 24000;
  constexpr double kFrom = 0.2;  // s, on the grid of the resonators
  constexpr double kTo = 0.4;
  SynthSettings settings = plainSettings();
  settings.contactLoss = 0.05;
  Synth synth = synthOf(modes, fly, settings);
  giveCourse(synth, fly, 0.6);
  synth.schedule(blowOf(fly));
  ContactState contact;
  contact.body = kBall;
  contact.other = kFloor;
  contact.normal = Vec3::UnitZ();
  contact.otherPathStart = contact.otherPathEnd = Vec3(0.0, 0.0, 0.01);
  contact.duration = kTo - kFrom;
  contact.time = kFrom;
  contact.position = fly.listener(kFrom);  // so that nothing is delayed
  contact.phase = ContactPhase::begin;
  contact.normalLoad = 1e-4;
  synth.updateContact(contact);
  contact.time = kTo;
  contact.position = fly.listener(kTo);
  contact.phase = ContactPhase::end;
  contact.normalLoad = 0.0;
  synth.updateContact(contact);
  synth.advanceTo(0.6);
  const std::vector<double> heard = renderMono(synth, kFrames);

  const Material& steel = *findMaterial("steel");
  const double modulus =
      steel.youngsModulus / (2.0 * (1.0 - steel.poissonsRatio * steel.poissonsRatio));
  const double depth = std::pow(1e-4 / (4.0 / 3.0 * std::sqrt(0.5e-3) * modulus), 2.0 / 3.0);
  const double dashpot = 0.05 * 1.5 * 1e-4 / depth / (2.0 * kPi * 1000.0);
  const double added = kGrowth * kGrowth * dashpot / 2.0;
  ASSERT_GT(added, 5.0);
  std::vector<double> wanted(kFrames, 0.0);
  addModes(modes, fly, durationOf(modes, fly), wanted);
  const auto emitted = [&](double time) { return emissionOf(fly.body, fly.listener(time), time); };
  for (std::size_t n = 0; n < kFrames; ++n) {
    const double touched =
        std::clamp(static_cast<double>(n) / kRate, kFrom, kTo);  // s, of the listener
    wanted[n] *= std::exp(-added * (emitted(touched) - emitted(kFrom)));
  }
  const double first = (fly.listener(kBlow) - fly.body(kBlow)).norm();
  const double error = errorOf(heard, wanted, first);
  std::printf("damped: %.1f dB\n", error);
  EXPECT_LT(error, -40.0);
}

TEST(MovingRing, FallsSilentOnTheMove) {
  const Course fly = fastFlight();
  std::vector<HeardMode> modes = kDipoles;
  for (HeardMode& mode : modes)
    mode.tone.decayRate *= 15.0;
  Synth synth = synthOf(modes, fly);
  giveCourse(synth, fly, 1.1);
  synth.schedule(blowOf(fly));
  synth.advanceTo(1.1);
  static_cast<void>(renderMono(synth, 4800));  // the slowest mode has lost 40 dB
  EXPECT_FALSE(synth.isSilent());
  static_cast<void>(renderMono(synth, 43200));  // and 390 dB
  EXPECT_TRUE(synth.isSilent());
}

TEST(MovingRing, RendersWithoutAllocation) {
  const Course fly = fastFlight();
  Synth synth = synthOf(kDipoles, fly);
  giveCourse(synth, fly, 0.5);
  synth.schedule(blowOf(fly));
  synth.advanceTo(0.5);
  std::vector<double> samples(19200);
  double* const channel = samples.data();
  const NoAllocScope scope;
  synth.render<double>({&channel, 1}, samples.size());
  EXPECT_EQ(scope.allocations(), 0u);
}

TEST(MovingRing, RefusesPosesThatAreNone) {
  Synth synth = synthOf(kDipoles, {});
  const ListenerPose pose{1.0, Vec3::Zero(), Quat::Identity()};
  EXPECT_TRUE(synth.moveBody(kFloor, pose));
  EXPECT_TRUE(synth.moveBody(kBall, pose));  // does not ring: nothing comes of it
  EXPECT_FALSE(synth.moveBody(99, pose));
  EXPECT_FALSE(synth.moveBody(kFloor, pose));  // not later
  EXPECT_FALSE(synth.moveBody(kFloor, {2.0, Vec3(kNaN, 0.0, 0.0), Quat::Identity()}));
  EXPECT_FALSE(synth.moveBody(kFloor, {2.0, Vec3::Zero(), Quat(2.0, 0.0, 0.0, 0.0)}));
  EXPECT_TRUE(synth.moveBody(kFloor, {2.0, Vec3::Zero(), Quat::Identity()}));
}

}  // namespace
}  // namespace carom::test
