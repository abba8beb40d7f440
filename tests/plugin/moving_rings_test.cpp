#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdio>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "carom/audio/synth.h"
#include "carom/event_sound.h"
#include "carom/sound.h"
#include "tests/audio/ball_drop.h"
#include "tests/audio/ringing_box.h"
#include "tests/bullet_bridge/sphere_world.h"
#include "tests/plugin/offline_sound.h"
#include "tests/support/constants.h"
#include "tests/support/no_alloc_scope.h"

// Rings in real time, against what geometry says: a body's ring is a tone of known frequency and
// decay, and is heard over a distance, at an instant that is searched for.

namespace carom::test {
namespace {

constexpr double kStep = 1.0 / 240.0;
constexpr double kPitch = 1000.0;  // Hz
constexpr double kFading = 0.5;    // 1/s

struct Course {
  std::function<Vec3(double)> body = [](double) { return Vec3::Zero().eval(); };
  std::function<Vec3(double)> listener = [](double) { return Vec3(0.0, 1.0, 0.0); };
  std::function<Quat(double)> turned = [](double) { return Quat::Identity(); };
};

std::function<Vec3(double)> onLine(const Vec3& from, const Vec3& velocity) {
  return [=](double time) { return Vec3(from + time * velocity); };
}

SoundSettings oneEar() {
  SoundSettings settings;
  settings.clock = SoundClock::simulation;
  settings.listeners = {{"ear", {0.0, 1.0, 0.0}}};
  settings.synth.airAbsorption = false;
  return settings;
}

/// A body that is struck at 10 ms and rings in one mode, as a host of EventSound has it.
class StruckBox {
 public:
  explicit StruckBox(Course course, const SoundSettings& settings = oneEar(),
                     std::shared_ptr<const ModalModel> model = boxOf({{kPitch, kFading, 1e-3}}))
      : course_(std::move(course)), sound_(*EventSound::create(settings)) {
    SoundBody body = dropOnBox(kBlow).floor();
    body.modal = std::move(model);
    EXPECT_TRUE(sound_.setBody(kBall, dropOnBox(kBlow).ball()));
    EXPECT_TRUE(sound_.setBody(kFloor, body));
    EXPECT_TRUE(sound_.prepareRendering(kRate));
  }

  /// Steps on to a time (s), and takes what is ready.
  void stepTo(double end) {
    while (time_ + kStep <= end + 1e-9) {
      const double before = time_;
      time_ += kStep;
      if (before < kBlow && kBlow <= time_) sound_.post(blow());
      if (isTold) {
        EXPECT_TRUE(sound_.setListener(course_.listener(before), Quat::Identity(), 0));
        EXPECT_TRUE(sound_.moveBody(kFloor, {time_, course_.body(time_), course_.turned(time_)}));
      }
      sound_.advanceTo(time_ + leap);
      takeReady(sound_, samples_);
    }
  }
  void setCourse(Course course) { course_ = std::move(course); }
  const std::vector<float>& samples() const { return samples_[0]; }
  EventSound& sound() { return sound_; }
  bool isTold = true;
  double leap = 0.0;

  static constexpr double kBlow = 0.01;  // s

 private:
  ImpulseEvent blow() const {
    ImpulseEvent event = floorShare(dropOnBox(kBlow));
    event.bodyPosition = course_.body(kBlow);
    event.bodyOrientation = course_.turned(kBlow);
    event.position = event.bodyPosition + event.bodyOrientation * Vec3(0.0, 0.0, 0.01);
    event.impulse = event.bodyOrientation * event.impulse;
    event.normal = event.bodyOrientation * event.normal;
    return event;
  }

  Course course_;
  EventSound sound_;
  double time_ = 0.0;
  std::vector<std::vector<float>> samples_{1};
};

/// The tone about a time (s): its amplitude and phase, over 10 ms with a soft begin and end.
std::complex<double> toneAt(std::span<const float> samples, double time, double pitch = kPitch) {
  constexpr int kHalf = 240;
  const auto middle = static_cast<std::ptrdiff_t>(std::llround(time * kRate));
  std::complex<double> sum;
  for (int n = -kHalf; n <= kHalf; ++n) {
    const double window = 0.5 + 0.5 * std::cos(kPi * n / (kHalf + 1.0));
    const auto index = static_cast<std::size_t>(middle + n);
    const double since = static_cast<double>(index) / kRate;
    sum += window * static_cast<double>(samples[index]) *
           std::polar(2.0 / (kHalf + 1.0), -2.0 * kPi * pitch * since);
  }
  return sum;
}

double levelAt(std::span<const float> samples, double time) {
  return 20.0 * std::log10(std::abs(toneAt(samples, time)));
}

/// s: when what is heard at a time left the body.
double emissionOf(const Course& course, double time, double speedOfSound) {
  double early = time - 1.0;
  double late = time;
  for (int bisection = 0; bisection < 60; ++bisection) {
    const double middle = 0.5 * (early + late);
    const double distance = (course.listener(time) - course.body(middle)).norm();
    (distance > speedOfSound * (time - middle) ? late : early) = middle;
  }
  return early;
}

/// Cycles of the tone that are heard from one time to another, from the phase.
double cyclesHeard(std::span<const float> samples, double from, double to) {
  constexpr double kHop = 0.002;
  double cycles = kPitch * (to - from);
  const int hops = static_cast<int>(std::lround((to - from) / kHop));
  for (int hop = 0; hop < hops; ++hop) {
    const double time = from + hop * kHop;
    const auto turn = toneAt(samples, time + kHop) / toneAt(samples, time);
    cycles += std::arg(turn) / (2.0 * kPi);
  }
  return cycles;
}

/// Largest second difference of the samples between two times.
double edgeOf(std::span<const float> samples, double from, double to) {
  double edge = 0.0;
  for (auto n = static_cast<std::size_t>(from * kRate); n < static_cast<std::size_t>(to * kRate);
       ++n) {
    const double second = static_cast<double>(samples[n + 1]) -
                          2.0 * static_cast<double>(samples[n]) +
                          static_cast<double>(samples[n - 1]);
    edge = std::max(edge, std::abs(second));
  }
  return edge;
}

TEST(MovingRings, AListenerWhoWalksFromOneMetreToEightHears18DecibelsLess) {
  StruckBox walk({.listener = onLine({0.0, 1.0, 0.0}, {0.0, 3.5, 0.0})});
  StruckBox rest({});
  walk.stepTo(2.2);
  rest.stepTo(2.2);
  EXPECT_NEAR(levelAt(walk.samples(), 0.1) - levelAt(rest.samples(), 0.1), -20.0 * std::log10(1.35),
              0.1);
  EXPECT_NEAR(levelAt(walk.samples(), 2.0) - levelAt(rest.samples(), 2.0), -20.0 * std::log10(8.0),
              0.1);
}

TEST(MovingRings, AListenerWhoSetsOutLaterIsFollowed) {
  StruckBox walk({});
  StruckBox rest({});
  walk.stepTo(0.5);
  walk.setCourse({.listener = [](double time) {
    return Vec3(0.0, 1.0 + 3.5 * std::max(time - 0.5, 0.0), 0.0);
  }});
  walk.stepTo(1.2);
  rest.stepTo(1.2);
  EXPECT_NEAR(levelAt(walk.samples(), 0.4), levelAt(rest.samples(), 0.4), 1e-6);
  EXPECT_NEAR(levelAt(walk.samples(), 1.1) - levelAt(rest.samples(), 1.1),
              -20.0 * std::log10(1.0 + 3.5 * 0.6), 0.1);
}

TEST(MovingRings, AFlyByHasItsDopplerShift) {
  const Course course{.body = onLine({-5.0, 0.0, 0.0}, {10.0, 0.0, 0.0})};
  StruckBox box(course);
  box.stepTo(1.1);
  const double sound = oneEar().synth.medium.speedOfSound;
  for (const double from : {0.1, 0.2, 0.3, 0.7, 0.8}) {
    const double to = from + 0.1;
    const double emitted = emissionOf(course, to, sound) - emissionOf(course, from, sound);
    const double shift = cyclesHeard(box.samples(), from, to) / (kPitch * 0.1) - 1.0;
    const double wanted = emitted / 0.1 - 1.0;
    std::printf("from %.1f s: %.5f, %.5f\n", from, shift, wanted);
    EXPECT_NEAR(shift, wanted, 0.01 * 10.0 / sound);
  }
}

// A dipole along the body's z, which points at the listener when it is struck.
TEST(MovingRings, ABodyThatTurnsTurnsItsPattern) {
  ModalModel dipole = *boxOf({{kPitch, kFading, 1e-3}});
  dipole.modes.front().radiation.multipoles = {0.0, 0.0, 1e-4, 0.0};
  const auto model = std::make_shared<const ModalModel>(dipole);
  const auto turnedBy = [](double angle) {
    return Quat(Eigen::AngleAxisd(angle - 0.5 * kPi, Vec3::UnitX()));
  };
  StruckBox turning({.turned =
                         [&](double time) {
                           return turnedBy(kPi / 3.0 * std::clamp((time - 0.1) / 0.3, 0.0, 1.0));
                         }},
                    oneEar(), model);
  StruckBox rest({.turned = [&](double) { return turnedBy(0.0); }}, oneEar(), model);
  turning.stepTo(0.7);
  rest.stepTo(0.7);
  EXPECT_NEAR(levelAt(turning.samples(), 0.08), levelAt(rest.samples(), 0.08), 0.01);
  EXPECT_NEAR(levelAt(turning.samples(), 0.6) - levelAt(rest.samples(), 0.6),
              20.0 * std::log10(std::cos(kPi / 3.0)), 0.1);
}

TEST(MovingRings, TheSameMotionGivesTheSameBits) {
  const Course course{.body = onLine({-2.0, 0.3, 0.0}, {6.0, -0.5, 1.0}),
                      .listener = onLine({0.0, 1.0, 0.0}, {-1.0, 0.4, 0.0})};
  StruckBox once(course);
  StruckBox again(course);
  once.stepTo(0.6);
  again.stepTo(0.6);
  EXPECT_EQ(once.samples(), again.samples());
}

TEST(MovingRings, ABodyThatIsRemovedInFlightRingsOnWithoutAClick) {
  StruckBox box({.body = onLine({-2.0, 0.0, 0.0}, {4.0, 0.0, 0.0})});
  box.stepTo(0.3);
  box.sound().removeBody(kFloor);
  box.isTold = false;
  box.stepTo(0.8);
  const std::vector<float>& heard = box.samples();
  EXPECT_LT(edgeOf(heard, 0.25, 0.7), 1.6 * edgeOf(heard, 0.2, 0.25));
  EXPECT_GT(levelAt(heard, 0.7), levelAt(heard, 0.24) - 3.0);
}

TEST(MovingRings, AtRestEachStepSaysSoAndTheBitsAreThoseOfTheOfflineRenderer) {
  StruckBox box({});
  box.stepTo(0.6);
  SoundSettings settings = oneEar();
  Synth synth = *Synth::create(settings.synth, settings.listeners);
  SoundBody body = dropOnBox(StruckBox::kBlow).floor();
  body.modal = boxOf({{kPitch, kFading, 1e-3}});
  ASSERT_TRUE(synth.setBody(kBall, dropOnBox(StruckBox::kBlow).ball()));
  ASSERT_TRUE(synth.setBody(kFloor, body));
  ASSERT_TRUE(synth.moveListener(0, {0.0, {0.0, 1.0, 0.0}, Quat::Identity()}));
  synth.schedule(floorShare(dropOnBox(StruckBox::kBlow)));
  EXPECT_EQ(box.samples(), renderPlanes<float>(synth, box.samples().size())[0]);
}

// The fuzzer of EventSound's calls found a step without end: of a ring so far away that its sound
// never comes. A million kilometres away it comes after an hour, and is not waited for.
TEST(MovingRings, ABodyThatIsPutOutOfTheWorldHoldsNothingUp) {
  Course course;
  course.body = [](double time) {
    return Vec3(time < 0.2 || time > 1.0 ? 0.1 * time : 1e9, 0.0, 0.0);
  };
  StruckBox box(course, oneEar(), boxOf({{kPitch, 1e-9, 1e-3}}));
  box.stepTo(1.5);
  const auto loudest = [&](double from, double to) {
    double peak = 0.0;
    for (auto at = static_cast<std::size_t>(from * kRate);
         at < static_cast<std::size_t>(to * kRate); ++at)
      peak = std::max(peak, std::abs(static_cast<double>(box.samples().at(at))));
    return peak;
  };
  EXPECT_GT(loudest(0.1, 0.15), 0.0);
  EXPECT_LT(loudest(0.5, 0.9), 1e-6 * loudest(0.1, 0.15));
  EXPECT_GT(loudest(1.2, 1.4), 0.5 * loudest(0.1, 0.15));  // it is back
}

TEST(MovingRings, APlaceThatIsNoneIsRefused) {
  EventSound sound = *EventSound::create(oneEar());
  const auto drop = dropOnBox(StruckBox::kBlow);
  ASSERT_TRUE(sound.setBody(kBall, drop.ball()));
  EXPECT_TRUE(sound.moveBody(kBall, {0.0, Vec3(9e11, 0.0, 0.0), Quat::Identity()}));
  const Status refused = sound.moveBody(kBall, {0.0, Vec3(0.0, 1e200, 0.0), Quat::Identity()});
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("within 1e12 m"), std::string::npos);
}

TEST(MovingRings, AListenerWhoIsPutElsewhereHearsNoClickAndNoChirp) {
  StruckBox box({});
  box.stepTo(0.5);
  box.setCourse({.listener = [](double) { return Vec3(0.0, 4.0, 0.0); }});
  box.stepTo(1.0);
  const std::vector<float>& heard = box.samples();
  EXPECT_NEAR(levelAt(heard, 0.9) - levelAt(heard, 0.4),
              -20.0 * std::log10(4.0) - 0.5 * kFading * 20.0 / std::log(10.0), 0.1);
  EXPECT_LT(edgeOf(heard, 0.45, 0.9), 1.05 * edgeOf(heard, 0.4, 0.45));
  EXPECT_NEAR(cyclesHeard(heard, 0.45, 0.6), kPitch * 0.15, 0.02);
}

TEST(MovingRings, ABodyThatIsPutElsewhereIsHeardThereWithoutAClick) {
  StruckBox box({});
  box.stepTo(0.5);
  box.setCourse({.body = [](double) { return Vec3(0.0, 0.5, 0.0); }});
  box.stepTo(1.0);
  const std::vector<float>& heard = box.samples();
  EXPECT_NEAR(levelAt(heard, 0.9) - levelAt(heard, 0.4),
              20.0 * std::log10(2.0) - 0.5 * kFading * 20.0 / std::log(10.0), 0.1);
  EXPECT_LT(edgeOf(heard, 0.45, 0.9), 2.1 * edgeOf(heard, 0.4, 0.45));
  EXPECT_NEAR(cyclesHeard(heard, 0.45, 0.6), kPitch * 0.15, 0.02);
}

// A wall on the other side of the box: what comes from its mirror image is followed as well, though
// both sound in one bank, whose powers add up; how they interfere stays as it was at the blow.
TEST(MovingRings, AWalkByAWallIsAsLoudAsBothPathsTogether) {
  SoundSettings settings = oneEar();
  settings.synth.room.reflectors = {{.normal = Vec3::UnitY(), .offset = -2.0}};
  const auto distance = [](double time) { return 1.0 + 3.5 * std::max(time - 0.1, 0.0); };
  StruckBox walk({.listener = [&](double time) { return Vec3(0.0, distance(time), 0.0); }},
                 settings);
  StruckBox rest({}, settings);
  walk.stepTo(2.3);
  rest.stepTo(2.3);
  const auto level = [](double y) {
    return 10.0 * std::log10(1.0 / (y * y) + 1.0 / ((y + 4.0) * (y + 4.0)));
  };
  EXPECT_NEAR(levelAt(walk.samples(), 2.1) - levelAt(rest.samples(), 2.1),
              level(distance(2.1)) - level(1.0), 0.1);
}

TEST(MovingRings, GoOnWhenTheClockGoesBackOrTheSamplesAreNotTaken) {
  SoundSettings settings = oneEar();
  settings.clock = SoundClock::realTime;
  const Course course{.body = onLine({-2.0, 0.0, 0.0}, {4.0, 0.0, 0.0})};
  StruckBox box(course, settings);
  const auto run = [&](int steps, double& time, std::size_t frames, std::vector<float>& heard) {
    for (int step = 0; step < steps; ++step) {
      if (frames > 0) {
        std::vector<float> block(frames);
        float* const channel = block.data();
        box.sound().render(std::span(&channel, 1), frames);
        heard.insert(heard.end(), block.begin(), block.end());
      }
      time += kStep;
      EXPECT_TRUE(box.sound().moveBody(kFloor, {time, course.body(time), Quat::Identity()}));
      box.sound().advanceTo(time);
    }
  };
  std::vector<float> heard;
  double time = 0.0;
  run(20, time, 200, heard);
  ImpulseEvent event = floorShare(dropOnBox(time));
  event.bodyPosition = course.body(time);
  event.position = event.bodyPosition + Vec3(0.0, 0.0, 0.01);
  box.sound().post(event);
  run(60, time, 200, heard);
  const double edge = edgeOf(heard, 0.2, 0.3);
  const std::size_t begin = heard.size();
  time -= 0.2;  // the clock goes back
  run(60, time, 200, heard);
  run(40, time, 0, heard);  // the host is not asked for samples
  run(60, time, 200, heard);
  box.sound().pause();
  std::vector<float> paused(9600);
  float* const channel = paused.data();
  box.sound().render(std::span(&channel, 1), paused.size());  // and the simulation pauses
  heard.insert(heard.end(), paused.begin(), paused.end());
  run(60, time, 200, heard);
  const double from = static_cast<double>(begin) / kRate;
  const double to = static_cast<double>(heard.size()) / kRate - 0.01;
  EXPECT_GT(edge, 0.0);
  EXPECT_LT(edgeOf(heard, from, to), 4.0 * edge);  // 0.5 m away at the nearest, from 1 m
  EXPECT_GT(levelAt(heard, to - 0.1), -120.0);
  EXPECT_EQ(box.sound().statistics().jumps, 1U);
}

TEST(MovingRings, AreAsLongAndAsHighInSlowMotion) {
  SoundSettings settings = oneEar();
  settings.clock = SoundClock::realTime;
  EventSound sound = *EventSound::create(settings);
  SoundBody body = dropOnBox(0.0).floor();
  body.modal = boxOf({{kPitch, kFading, 1e-3}});
  ASSERT_TRUE(sound.setBody(kBall, dropOnBox(0.0).ball()));
  ASSERT_TRUE(sound.setBody(kFloor, body));
  ASSERT_TRUE(sound.setTimeScale(0.25));
  ASSERT_TRUE(sound.prepareRendering(kRate));
  std::vector<float> heard;
  for (int step = 1; step <= 240; ++step) {
    std::vector<float> block(200);
    float* const channel = block.data();
    sound.render(std::span(&channel, 1), block.size());
    heard.insert(heard.end(), block.begin(), block.end());
    const double time = step * 0.25 * kStep;
    if (step == 20) sound.post(floorShare(dropOnBox(time)));
    ASSERT_TRUE(sound.setListener(Vec3(0.0, 1.0 + 4.0 * time, 0.0), Quat::Identity(), 0));
    sound.advanceTo(time);
  }
  // 1 s has passed, a quarter of it in the world.
  const double shift = cyclesHeard(heard, 0.5, 0.9) / (kPitch * 0.4) - 1.0;
  EXPECT_NEAR(shift, -4.0 / settings.synth.medium.speedOfSound, 1.5e-3);
}

TEST(MovingRings, RenderingAllocatesNothingWhateverMoves) {
  SoundSettings settings = oneEar();
  settings.synth.room.reflectors = {{.normal = Vec3::UnitY(), .offset = -5.0}};
  EventSound sound = *EventSound::create(settings);
  SoundBody body = dropOnBox(0.0).floor();
  body.modal = boxOf({{kPitch, kFading, 1e-3}, {1700.0, 2.0, 1e-3}});
  ASSERT_TRUE(sound.setBody(kBall, dropOnBox(0.0).ball()));
  constexpr BodyId kFirst = 10;
  constexpr BodyId kMany = 300;
  for (BodyId id = kFirst; id < kFirst + kMany; ++id)
    ASSERT_TRUE(sound.setBody(id, body));
  ASSERT_TRUE(sound.prepareRendering(kRate));
  std::vector<float> block(480);
  float* const channel = block.data();
  std::size_t allocations = 0;
  for (int step = 1; step <= 240; ++step) {
    const double time = step * kStep;
    for (BodyId id = kFirst; id < kFirst + kMany; ++id) {
      const Vec3 place(0.01 * id, -3.0 * time, (step % 100 < 50 ? 1.0 : -1.0) * time);
      if (static_cast<BodyId>(step % 60) == id % 60) {
        ImpulseEvent event = floorShare(dropOnBox(time));
        event.body = id;
        event.bodyPosition = place;
        event.position = place + Vec3(0.0, 0.0, 0.01);
        sound.post(event);
      }
      ASSERT_TRUE(sound.moveBody(id, {time, place, Quat::Identity()}));
    }
    sound.advanceTo(time);
    while (sound.framesReady() > 0) {
      const NoAllocScope scope;
      sound.render(std::span(&channel, 1), std::min(sound.framesReady(), block.size()));
      allocations += scope.allocations();
    }
  }
  EXPECT_EQ(allocations, 0U);
  EXPECT_EQ(sound.statistics().silencedFrames, 0U);
  EXPECT_EQ(sound.statistics().ringing, settings.budget.ringingBodies);
}

// An ordinary world: a ball flies onto a bell, which no one says anything of any more.
class BellInAWorld : public testing::Test {
 protected:
  BellInAWorld() {
    bell_ = &world_.addBall({.radius = 0.1, .mass = 50.0});
    world_.addBall(
        {.radius = 0.02, .mass = 0.05, .position = {0.0, 0.0, 0.2}, .velocity = {0.0, 0.0, -2.0}});
  }

  Sound attached() {
    Sound sound =
        attachOffline(world_.world, oneEar(), {.radiators = RadiatorChoice::equivalentSphere});
    EXPECT_TRUE(
        sound.assign(*bell_, {.material = "steel", .modes = boxOf({{kPitch, kFading, 1e-3}})}));
    return sound;
  }

  std::vector<float> play(Sound& sound, double seconds,
                          const std::function<void(int, double)>& eachFrame) {
    std::vector<std::vector<float>> samples(1);
    for (int frame = 0; frame < static_cast<int>(seconds * 60.0); ++frame) {
      eachFrame(frame, frame / 60.0);
      world_.world.stepSimulation(btScalar(1.0 / 60.0), 10, btScalar(kStep));
      takeReady(sound, samples);
    }
    return samples[0];
  }

  SphereBulletWorld world_;
  btRigidBody* bell_ = nullptr;
};

TEST_F(BellInAWorld, IsHeardFainterByAListenerWhoWalksAway) {
  Sound sound = attached();
  const std::vector<float> walking = play(sound, 2.4, [&](int, double time) {
    ASSERT_TRUE(sound.setListener(Vec3(0.0, 1.0 + 3.5 * time, 0.0), Quat::Identity(), 0));
  });
  EXPECT_GT(levelAt(walking, 0.3), -100.0);
  // The ring loses by its decay, and by the distance.
  const double fading = 1.7 * kFading * 20.0 / std::log(10.0);
  EXPECT_NEAR(levelAt(walking, 2.0) - levelAt(walking, 0.3),
              20.0 * std::log10((1.0 + 3.5 * 0.3) / 8.0) - fading, 0.3);
}

TEST_F(BellInAWorld, HasADopplerShiftWhereItFliesBy) {
  for (const auto& body : world_.bodies)
    body->setLinearVelocity(body->getLinearVelocity() + btVector3(10, 0, 0));
  bell_->setWorldTransform(btTransform(btQuaternion::getIdentity(), btVector3(-5, 0, 0)));
  world_.bodies.back()->setWorldTransform(
      btTransform(btQuaternion::getIdentity(), btVector3(-5, 0, btScalar(0.2))));
  Sound sound = attached();
  Course course;
  const std::vector<float> heard = play(sound, 1.2, [](int, double) {});
  const double speed = static_cast<double>(bell_->getLinearVelocity().x());
  course.body = onLine({-5.0, 0.0, 0.0}, {speed, 0.0, 0.0});
  const double velocity = oneEar().synth.medium.speedOfSound;
  for (const double from : {0.2, 0.3, 0.7, 0.8}) {
    const double to = from + 0.1;
    const double emitted = emissionOf(course, to, velocity) - emissionOf(course, from, velocity);
    const double shift = cyclesHeard(heard, from, to) / (kPitch * 0.1) - 1.0;
    EXPECT_NEAR(shift, emitted / 0.1 - 1.0, 0.01 * 10.0 / velocity);
  }
}
}  // namespace
}  // namespace carom::test
