#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "lab/view/view_run.h"
#include <btBulletDynamicsCommon.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "audio/run/run_encoder.h"
#include "audio/run/run_player.h"
#include "audio/run/run_writer.h"
#include "carom/event_sound.h"
#include "carom/sound.h"
#include "scenes/recording/recorded_run.h"
#include "scenes/run/render.h"
#include "tests/audio/ringing_box.h"
#include "tests/bullet_bridge/sphere_world.h"
#include "tests/scenes/damaged_runs.h"
#include "tests/support/ordinary_worlds.h"
#include "tests/support/recording.h"
#include "tests/support/temporary_folder.h"

// A host's run beside the recording that the same sound has made meanwhile: two ways from the same
// events to samples, one of them through a file.

namespace carom::test {
namespace {

using scenes::openRun;
using scenes::RecordedRun;
using scenes::RenderOptions;
using scenes::renderScene;
using scenes::runStepper;
using testing::HasSubstr;
using testing::SizeIs;

constexpr double kFrame = 1.0 / 60.0;

class HostRuns : public testing::Test {
 protected:
  SoundSettings settings() const {
    SoundSettings chosen;
    chosen.fullScale = 1.0;
    chosen.latency = 0.2;
    chosen.record = (folder_ / "sound.wav").string();
    chosen.onMessage = [](const std::string&) {};
    return chosen;
  }

  RecordedRun opened(const std::string& name = "host.run") const {
    Result<RecordedRun> run = openRun(folder_ / name);
    EXPECT_TRUE(run) << run.error().message;
    return run ? *std::move(run) : RecordedRun{};
  }

  /// Returns the samples (Pa) of a run, interleaved.
  std::vector<double> replayed(const RecordedRun& run) const {
    RenderOptions options;
    options.soundFile = folder_ / "replayed.wav";
    options.fullScale = 1.0;
    options.tail = 10.0;
    options.replay = [&run](double) { return runStepper(run.reader); };
    const auto report = renderScene(run.scene, options);
    EXPECT_TRUE(report) << report.error().message;
    return readRecording(folder_ / "replayed.wav").samples;
  }

  std::vector<double> recorded() const { return readRecording(folder_ / "sound.wav").samples; }

  const TemporaryFolder folder_;
};

/// Returns the largest difference of samples over the largest sample, in dB, over as many as both
/// have from `first` and `second` on.
double differenceOf(const std::vector<double>& samples, const std::vector<double>& others,
                    std::size_t first = 0, std::size_t second = 0) {
  double difference = 0.0;
  double peak = 0.0;
  for (std::size_t at = 0; first + at < samples.size() && second + at < others.size(); ++at) {
    difference = std::max(difference, std::abs(samples[first + at] - others[second + at]));
    peak = std::max(peak, std::abs(samples[first + at]));
  }
  EXPECT_GT(peak, 0.0);
  return 20.0 * std::log10(difference / peak);
}

TEST_F(HostRuns, OfOrdinaryWorldsSoundAsTheirRecordings) {
  constexpr double kSeconds = 0.5;
  for (const OrdinaryWorldKind& kind : ordinaryWorlds()) {
    if (kind.name == "falling_boxes") continue;  // 3000 of them: as falling_cubes, and long
    const std::unique_ptr<OrdinaryWorld> world = kind.make();
    Result<Sound> sound = Sound::attach(world->world(), settings());
    ASSERT_TRUE(sound) << sound.error().message;
    ASSERT_TRUE(sound->setListener({0.0, 4.0, 12.0}));
    ASSERT_TRUE(sound->recordRun(folder_ / "host.run"));
    while (world->time() < kSeconds)
      world->step(60.0);
    const bool isHeard = sound->statistics().peak > 0.0;
    ASSERT_TRUE(sound->close());
    const RecordedRun run = opened();
    EXPECT_NEAR(run.scene.duration, kSeconds, 0.02);
    const std::vector<double> samples = replayed(run);
    if (isHeard) {
      EXPECT_LT(differenceOf(recorded(), samples), -120.0) << kind.name;
    }
  }
}

/// A ball on a plane: the ball rings, and is called a marble.
class BallOnPlane {
 public:
  BallOnPlane() : ball(bullet.addBall({.position = {0.0, 0.3, 0.0}, .restitution = 0.8})) {
    bullet.addPlane(Vec3::UnitY(), 0.0, 0.8);
  }
  void stepTo(double time) {
    for (; time_ < time - 1e-9; time_ += kFrame)
      bullet.world.stepSimulation(btScalar(kFrame), 10, btScalar(kFrame));
  }

  SphereBulletWorld bullet{9.81};
  btRigidBody& ball;

 private:
  double time_ = 0.0;
};

TEST_F(HostRuns, HaveRingsMaterialsThatChangeAndListenersThatMove) {
  BallOnPlane world;
  Result<Sound> sound = Sound::attach(world.bullet.world, settings());
  ASSERT_TRUE(sound);
  ASSERT_TRUE(sound->assign(world.ball, {.modes = boxOf({{900.0, 30.0}, {2300.0, 60.0}})}));
  ASSERT_TRUE(sound->recordRun(folder_ / "host.run"));
  for (int frame = 1; frame <= 120; ++frame) {
    if (frame == 60) {
      ASSERT_TRUE(
          sound->assign(world.ball, {.material = "steel", .modes = boxOf({{500.0, 20.0}})}));
    }
    ASSERT_TRUE(sound->setListener({0.02 * frame, 0.5, 1.0}));
    world.stepTo(frame * kFrame);
  }
  ASSERT_TRUE(sound->close());
  const RecordedRun run = opened();
  ASSERT_THAT(run.scene.paths, SizeIs(1));
  EXPECT_GT(run.scene.paths.front().poses.size(), 100U);
  // The recording heard each event with what was known of the listener's path then, the replay
  // knows all of it.
  EXPECT_LT(differenceOf(recorded(), replayed(run)), -60.0);
}

TEST_F(HostRuns, OfBodiesThatComeAndGoSoundAsTheirRecordings) {
  SphereBulletWorld bullet{9.81};
  bullet.addPlane(Vec3::UnitY(), 0.0, 0.8);
  Result<Sound> sound = Sound::attach(bullet.world, settings());
  ASSERT_TRUE(sound && sound->setListener({0.0, 1.0, 1.0}));
  ASSERT_TRUE(sound->recordRun(folder_ / "host.run"));
  for (int frame = 0; frame < 180; ++frame) {
    if (frame % 4 == 0)
      bullet.addBall({.radius = 0.02 + 0.001 * (frame % 7),
                      .position = {0.3 * (frame % 5), 0.2, 0.0},
                      .restitution = 0.7});
    if (frame % 4 == 2 && bullet.bodies.size() > 20) bullet.remove(*bullet.bodies[1]);
    bullet.world.stepSimulation(btScalar(kFrame), 10, btScalar(kFrame));
  }
  ASSERT_TRUE(sound->close());
  const RecordedRun run = opened();
  EXPECT_GT(run.scene.bodies.size(), 40U);
  EXPECT_LT(differenceOf(recorded(), replayed(run)), -120.0);
}

TEST_F(HostRuns, AreHeardFromAnotherSeat) {
  BallOnPlane world;
  Result<Sound> sound = Sound::attach(world.bullet.world, settings());
  ASSERT_TRUE(sound && sound->setListener({0.0, 1.0, 0.0}));
  ASSERT_TRUE(sound->recordRun(folder_ / "host.run"));
  world.stepTo(0.4);
  ASSERT_TRUE(sound->close());
  RecordedRun run = opened();
  run.scene.listeners = {{"near", {0.0, 1.05, 0.0}}, {"far", {0.0, 4.05, 0.0}}};
  run.scene.paths.clear();
  const std::vector<double> both = replayed(run);
  double near = 0.0;
  double far = 0.0;
  for (std::size_t at = 0; at + 1 < both.size(); at += 2) {
    near = std::max(near, std::abs(both[at]));
    far = std::max(far, std::abs(both[at + 1]));
  }
  // The ball's middle is 5 cm above the plane when it clicks, 1 m and 4 m below them. Nearby there
  // is a little more, by the near field.
  EXPECT_NEAR(near / far, 4.0, 0.3);
}

TEST_F(HostRuns, TellHowBodiesLookAndWhereTheyAre) {
  SphereBulletWorld bullet{9.81};
  bullet.addPlane(Vec3::UnitY(), -0.5, 0.5);
  btRigidBody& ball = bullet.addBall({.position = {0.0, 2.0, 0.0}});
  bullet.shapes.push_back(std::make_unique<btBoxShape>(btVector3(1, 2, 3)));
  btRigidBody box(0, nullptr, bullet.shapes.back().get());
  btConvexHullShape hull;
  for (int corner = 0; corner < 8; ++corner)
    hull.addPoint(
        btVector3(btScalar(corner & 1), btScalar(corner >> 1 & 1), btScalar(corner >> 2)));
  btRigidBody shard(1, nullptr, &hull, btVector3(1, 1, 1));
  shard.setCenterOfMassTransform(btTransform(btQuaternion::getIdentity(), btVector3(50, 0, 0)));
  bullet.world.addRigidBody(&box);
  bullet.world.addRigidBody(&shard);
  {
    Result<Sound> sound = Sound::attach(bullet.world, {});
    ASSERT_TRUE(sound && sound->recordRun(folder_ / "host.run"));
    for (int frame = 0; frame < 12; ++frame)
      bullet.world.stepSimulation(btScalar(kFrame), 10, btScalar(kFrame));
    ASSERT_TRUE(sound->close());
  }
  bullet.world.removeRigidBody(&box);
  bullet.world.removeRigidBody(&shard);

  using Kind = audio::BodyForm::Kind;
  const RecordedRun run = opened();
  ASSERT_NE(run.reader->host(), nullptr);
  std::vector<Kind> kinds;
  std::optional<BodyId> ballId;
  for (const audio::HostBody& body : run.reader->host()->bodies) {
    kinds.push_back(body.form.kind);
    if (body.form.kind == Kind::sphere) {
      ballId = body.id;
      EXPECT_NEAR(body.form.size.x(), 0.05, 1e-7);
    }
    if (body.form.kind == Kind::box) {
      EXPECT_LT((body.form.size - Vec3(1.0, 2.0, 3.0)).norm(), 1e-6);
    }
    if (body.form.kind == Kind::plane) {
      EXPECT_EQ(body.form.size, Vec3(0.0, 1.0, 0.0));
      EXPECT_NEAR(body.form.offset, -0.5, 1e-7);
    }
    if (body.form.kind == Kind::mesh) {
      EXPECT_NEAR(signedVolume(*body.form.mesh), 1.0, 1e-5);
    }
  }
  for (const Kind kind : {Kind::sphere, Kind::box, Kind::plane, Kind::mesh})
    EXPECT_THAT(kinds, testing::Contains(kind));
  ASSERT_TRUE(ballId);
  std::vector<ListenerPose> path;
  for (;;) {
    const auto portions = run.reader->next();
    ASSERT_TRUE(portions) << portions.error().message;
    if (portions->empty()) break;
    for (const audio::RunPortion& portion : *portions)
      for (const audio::BodyPose& pose : portion.poses)
        if (pose.body == *ballId) path.push_back(pose.pose);
  }
  ASSERT_THAT(path, SizeIs(13));
  EXPECT_LT((path.front().position - Vec3(0.0, 2.0, 0.0)).norm(), 1e-6);
  EXPECT_NEAR(path.back().time, 12 * kFrame, 1e-6);
  EXPECT_LT(
      (path.back().position - SphereBulletWorld::fromBullet(ball.getWorldTransform().getOrigin()))
          .norm(),
      1e-6);
}

TEST_F(HostRuns, ThatAreKeptInMemoryEndLikeTheWholeRecording) {
  SphereBulletWorld bullet{9.81};
  bullet.addPlane(Vec3::UnitY(), 0.0, 0.8);
  for (int ball = 0; ball < 12; ++ball)
    bullet.addBall({.radius = 0.02 + 0.002 * ball,
                    .position = {0.5 * ball, 0.4 + 0.1 * ball, 0.0},
                    .restitution = 1.0});
  Result<Sound> sound = Sound::attach(bullet.world, settings());
  ASSERT_TRUE(sound && sound->setListener({2.0, 1.0, 2.0}) && sound->keepRun(2.0));
  for (int frame = 0; frame < 480; ++frame) {
    bullet.world.stepSimulation(btScalar(kFrame), 10, btScalar(kFrame));
    if (frame == 200) {
      ASSERT_TRUE(sound->saveRun(folder_ / "early.run"));
    }
  }
  ASSERT_TRUE(sound->saveRun(folder_ / "host.run"));
  ASSERT_TRUE(sound->close());
  for (const auto& [name, end] :
       {std::pair("early.run", 201 * kFrame), std::pair("host.run", 8.0)}) {
    const RecordedRun run = opened(name);
    EXPECT_GE(run.scene.duration, 2.0);
    EXPECT_LE(run.scene.duration, 3.1);
    std::vector<double> whole = recorded();
    const auto rate = static_cast<double>(48'000 * 2);
    whole.resize(std::min(whole.size(), static_cast<std::size_t>(end * rate)));
    const std::vector<double> part = replayed(run);
    // The clicks of the first tenth of a second may have begun before, and the time from which
    // samples count is between two samples in general.
    const auto from =
        static_cast<std::size_t>(2 * std::llround((end - run.scene.duration) * 48'000.0));
    constexpr std::size_t kBegin = 9600;
    EXPECT_LT(differenceOf(whole, part, from + kBegin, kBegin), -40.0) << name;
  }
}

TEST_F(HostRuns, OfPostedEventsSoundAsTheirRecordings) {
  Result<EventSound> sound = EventSound::create(settings());
  ASSERT_TRUE(sound);
  BallDrop drop = dropOnBox(0.45);
  SoundBody floor = drop.floor();
  floor.modal = boxOf({{1000.0, 20.0}});
  constexpr BodyId kFar = 4'000'000'000;  // the host's ids are its own
  ASSERT_TRUE(sound->setBody(kBall, drop.ball()) && sound->setBody(kFar, floor));
  sound->advanceTo(100.0);  // what was before is not in the run
  ASSERT_TRUE(sound->finishRecording() && sound->record(folder_ / "sound.wav"));
  ASSERT_TRUE(sound->recordRun(folder_ / "host.run"));
  for (int frame = 1; frame <= 60; ++frame) {
    const double time = 100.0 + frame * kFrame;
    if (frame == 30) {
      for (ImpulseEvent event : {drop.event(), floorShare(drop)}) {
        event.time += 100.0;
        for (BodyId* const id : {&event.body, &event.other})
          if (*id == kFloor) *id = kFar;
        sound->post(event);
      }
    }
    sound->advanceTo(time);
  }
  ASSERT_TRUE(sound->close());
  const RecordedRun run = opened();
  EXPECT_NEAR(run.scene.duration, 1.0, 1e-9);
  EXPECT_LT(differenceOf(recorded(), replayed(run)), -120.0);
}

// A ball comes to lie on a box at 0.1 s, of which the sound is told once. The box is struck at 3.5
// s: what has begun in between is damped as what has heard of the ball.
TEST_F(HostRuns, AreDampedByWhatLayThereBefore) {
  SoundSettings chosen = settings();
  chosen.synth.contactLoss = 0.05;
  chosen.listeners = {{"ear", {0.0, 0.0, 1.0}}};
  Result<EventSound> sound = EventSound::create(chosen);
  ASSERT_TRUE(sound && sound->keepRun(1.0));
  BallDrop drop = dropOnBox(3.5);
  SoundBody floor = drop.floor();
  floor.modal = boxOf({{1000.0, 3.0, 1.0}});
  ASSERT_TRUE(sound->setBody(kBall, drop.ball()) && sound->setBody(kFloor, floor));
  ContactState contact;
  contact.body = kBall;
  contact.other = kFloor;
  contact.phase = ContactPhase::begin;
  contact.time = 0.1;
  contact.duration = kFrame;
  contact.normal = Vec3::UnitZ();
  contact.normalLoad = 1e-4;
  contact.otherPathStart = contact.otherPathEnd = Vec3(0.0, 0.0, 0.01);
  sound->updateContact(contact);
  sound->advanceTo(3.0);
  ASSERT_TRUE(sound->finishRecording());
  ASSERT_TRUE(sound->record(folder_ / "sound.wav") && sound->recordRun(folder_ / "late.run"));
  for (double time = 3.0 + kFrame; time < 4.5; time += kFrame) {
    if (std::abs(time - 3.5) < 0.5 * kFrame) sound->post(floorShare(drop));
    sound->advanceTo(time);
  }
  ASSERT_TRUE(sound->saveRun(folder_ / "kept.run") && sound->close());
  // 1/s, from the levels 0.1 and 0.3 s after the blow, at a time (s) of the samples.
  const auto decayAt = [](const std::vector<double>& samples, double blow) {
    const auto level = [&](double time) {
      double power = 0.0;
      const auto first = static_cast<std::size_t>(time * 48'000.0);
      for (std::size_t at = first; at < first + 480; ++at)
        power += samples.at(at) * samples.at(at);
      return std::sqrt(power);
    };
    return std::log(level(blow + 0.1) / level(blow + 0.3)) / 0.2;
  };
  EXPECT_GT(decayAt(recorded(), 0.5), 8.0);
  EXPECT_GT(decayAt(replayed(opened("late.run")), 0.5), 8.0);
  const RecordedRun kept = opened("kept.run");
  EXPECT_GT(decayAt(replayed(kept), kept.scene.duration - 1.0), 8.0);
  const auto view = lab::viewRecorded(folder_ / "late.run", false);
  ASSERT_TRUE(view) << view.error().message;
  Result<audio::RunPlayer> player = audio::RunPlayer::create(view->run, 48'000.0);
  ASSERT_TRUE(player && player->seek({.time = 0.45}));
  std::vector<float> samples(24'000);
  float* const channel = samples.data();
  player->render({&channel, 1}, samples.size());
  EXPECT_GT(decayAt({samples.begin(), samples.end()}, 0.05), 8.0);
}

// The sound takes orientations a little off unit length; the run's reader does not.
TEST_F(HostRuns, HaveWhatIsHeardThoughItIsNotQuiteInOrder) {
  Result<EventSound> sound = EventSound::create(settings());
  ASSERT_TRUE(sound);
  const BallDrop drop = dropOnBox(0.2);
  ASSERT_TRUE(sound->setBody(kBall, drop.ball()) && sound->setBody(kFloor, drop.floor()));
  ASSERT_TRUE(sound->recordRun(folder_ / "host.run"));
  for (int frame = 1; frame <= 60; ++frame) {
    if (frame == 10) {
      for (ImpulseEvent event : {drop.event(), floorShare(drop)}) {
        event.bodyOrientation.coeffs() *= 1.005;
        event.hasOtherPose = false;
        event.otherOrientation.coeffs().setZero();
        event.otherPosition.setConstant(std::nan(""));
        sound->post(event);
      }
    }
    if (frame == 20) {
      ImpulseEvent blownUp = drop.event();
      blownUp.time = 0.33;
      blownUp.impulse.setConstant(std::nan(""));
      sound->post(blownUp);
      blownUp = drop.event();
      blownUp.time = std::numeric_limits<double>::infinity();
      sound->post(blownUp);
    }
    sound->advanceTo(frame * kFrame);
  }
  ASSERT_TRUE(sound->close());
  const RecordedRun run = opened();
  EXPECT_NEAR(run.scene.duration, 1.0, 1e-9);
  EXPECT_LT(differenceOf(recorded(), replayed(run)), -120.0);
}

/// The path of the first listener of a run, from its beginning on.
std::vector<ListenerPose> pathOf(const RecordedRun& run) {
  const audio::HostWorld& world = run.reader->host()->world;
  const Listener& listener = world.listeners.front();
  std::vector<ListenerPose> path = {{0.0, listener.position, listener.orientation}};
  path.insert(path.end(), world.paths.front().begin(), world.paths.front().end());
  return path;
}

TEST_F(HostRuns, HaveAListenerStandStillWhereItIsSaidTo) {
  Result<EventSound> sound = EventSound::create(settings());
  ASSERT_TRUE(sound && sound->recordRun(folder_ / "host.run"));
  for (int frame = 1; frame <= 180; ++frame) {
    const double x = frame < 120 ? 1.0 : 21.0;
    ASSERT_TRUE(sound->setListener({x, 1.0, 0.0}));
    sound->advanceTo(frame * kFrame);
  }
  ASSERT_TRUE(sound->close());
  for (const ListenerPose& pose : pathOf(opened())) {
    if (pose.time < 118 * kFrame && pose.time > 0.0) {
      EXPECT_EQ(pose.position.x(), 1.0) << pose.time;
    }
    if (pose.time > 122 * kFrame + 0.12) {
      EXPECT_EQ(pose.position.x(), 21.0) << pose.time;
    }
  }
  // It leaves no earlier than a step before it jumps.
  double left = 0.0;
  for (const ListenerPose& pose : pathOf(opened()))
    if (pose.position.x() == 1.0) left = pose.time;
  EXPECT_GT(left, 118 * kFrame);
}

// A run that begins while a listener is on its way begins there.
TEST_F(HostRuns, ThatAreKeptBeginWhereTheirListenersAre) {
  Result<EventSound> sound = EventSound::create({});
  ASSERT_TRUE(sound && sound->keepRun(0.5) && sound->setListener({0.0, 1.0, 0.0}));
  for (int frame = 1; frame <= 600; ++frame) {
    if (frame == 241) {
      ASSERT_TRUE(sound->setListener({30.0, 1.0, 0.0}));
    }
    sound->advanceTo(frame * kFrame);
    if (frame < 230 || frame % 7 != 0) continue;
    ASSERT_TRUE(sound->saveRun(folder_ / "kept.run"));
    const std::vector<ListenerPose> path = pathOf(opened("kept.run"));
    for (std::size_t pose = 1; pose < path.size(); ++pose) {
      const double way = (path[pose].position - path[pose - 1].position).norm();
      EXPECT_LE(way, 171.0 * (path[pose].time - path[pose - 1].time)) << frame;
    }
  }
}

TEST_F(HostRuns, AreWholeWhereTheyAreSavedInTheMidstOfAStep) {
  Result<EventSound> sound = EventSound::create({});
  ASSERT_TRUE(sound && sound->keepRun(5.0));
  sound->advanceTo(0.5);
  const BallDrop drop = dropOnBox(0.5);
  ASSERT_TRUE(sound->setBody(kBall, drop.ball()) && sound->setBody(kFloor, drop.floor()));
  sound->post(drop.event());
  ASSERT_TRUE(sound->saveRun(folder_ / "host.run"));
  const RecordedRun run = opened();
  EXPECT_THAT(run.scene.bodies, SizeIs(2));
  EXPECT_FALSE(replayed(run).empty());
}

TEST_F(HostRuns, HaveWhatIsGoneByTheTimeTheyAreSaved) {
  enum class Gone { never, later, atOnce };
  std::vector<std::vector<double>> samples;
  for (const Gone gone : {Gone::never, Gone::later, Gone::atOnce}) {
    Result<EventSound> sound = EventSound::create({});
    ASSERT_TRUE(sound && sound->keepRun(2.0));
    const BallDrop drop = dropOnBox(9.0);
    ASSERT_TRUE(sound->setBody(kBall, drop.ball()) && sound->setBody(kFloor, drop.floor()));
    for (int step = 1; step <= 90; ++step)
      sound->advanceTo(0.1 * step);
    sound->post(drop.event());
    if (gone == Gone::atOnce) sound->removeBody(kBall);
    constexpr BodyId kShard = 100;
    ASSERT_TRUE(sound->setBody(kShard, drop.ball()));
    sound->advanceTo(9.1);
    if (gone == Gone::later) sound->removeBody(kBall);
    for (int step = 92; step <= 104; ++step)
      sound->advanceTo(0.1 * step);
    ASSERT_TRUE(sound->saveRun(folder_ / "host.run"));
    samples.push_back(replayed(opened()));
  }
  EXPECT_LT(differenceOf(samples[0], samples[1]), -300.0);
  EXPECT_LT(differenceOf(samples[0], samples[2]), -300.0);
}

// In a process of its own, whose files may not become larger than 200 kB.
TEST_F(HostRuns, ThatADiskCannotHoldAreKeptUpToThere) {
  const std::filesystem::path file = folder_ / "host.run";
  const pid_t child = fork();
  if (child == 0) {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit most{200'000, 200'000};
    setrlimit(RLIMIT_FSIZE, &most);
    SoundSettings silent;
    silent.onMessage = [](const std::string&) {};
    Result<EventSound> sound = EventSound::create(silent);
    if (!sound || !sound->recordRun(file)) _exit(2);
    BallDrop drop = dropOnBox(0.0);
    (void)sound->setBody(kBall, drop.ball());
    (void)sound->setBody(kFloor, drop.floor());
    std::mt19937 random(1);
    for (int step = 1; step <= 3000; ++step) {
      for (int event = 0; event < 20; ++event) {
        const double number = 1e-10 * static_cast<double>(random());
        drop.time = 0.01 * step - 0.005 + 1e-3 * number;
        drop.speed = 1.0 + number;
        drop.centre.x() = 1e-3 * number;
        sound->post(drop.event());
      }
      sound->advanceTo(0.01 * step);
    }
    const Status finished = sound->finishRun();
    const bool isTold = !finished && finished.error().message.find("the file has the run up to") !=
                                         std::string::npos;
    _exit(isTold ? 0 : 1);
  }
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), 0);
  EXPECT_LE(std::filesystem::file_size(file), 200'000U);
  const RecordedRun run = opened();
  EXPECT_GT(run.scene.duration, 0.1);
  double last = 0.0;
  auto portions = run.reader->next();
  for (; portions && !portions->empty(); portions = run.reader->next())
    last = portions->back().settledTime;
  EXPECT_TRUE(portions) << portions.error().message;
  EXPECT_NEAR(last, run.scene.duration, 1e-9);
}

// Bodies of one shape that come and go, as shots do.
TEST_F(HostRuns, HaveAShapeOnceHoweverManyBodiesComeWithIt) {
  const auto sizeOf = [this](int shots) {
    SphereBulletWorld bullet{9.81};
    bullet.addPlane(Vec3::UnitY(), 0.0, 1.0);
    btConvexHullShape hull;
    std::mt19937 random(7);
    const auto number = [&random] { return static_cast<btScalar>(random()) / 1e9F - 2; };
    for (int corner = 0; corner < 300; ++corner)
      hull.addPoint(btVector3(number(), number(), number()).normalized() * btScalar(0.05));
    Result<Sound> sound =
        Sound::attach(bullet.world, {}, {.radiators = RadiatorChoice::equivalentSphere});
    EXPECT_TRUE(sound && sound->recordRun(folder_ / "host.run"));
    btTransform place = btTransform::getIdentity();
    place.setOrigin(btVector3(0, btScalar(0.06), 0));
    for (int shot = 0; shot < shots; ++shot) {
      btRigidBody body(1, nullptr, &hull, btVector3(1, 1, 1));
      body.setWorldTransform(place);
      body.setLinearVelocity(btVector3(0, -2, 0));
      bullet.world.addRigidBody(&body);
      bullet.step(1.0 / 60, 4);
      bullet.world.removeRigidBody(&body);
    }
    EXPECT_TRUE(sound->close());
    return std::filesystem::file_size(folder_ / "host.run");
  };
  const auto one = sizeOf(1);
  EXPECT_LT(sizeOf(41) - one, 40 * one / 4);
}

// Bodies that come and go would be too many for a run at some time.
TEST_F(HostRuns, InMemoryHaveAsManyBodiesAsWereThereOfLate) {
  Result<EventSound> sound = EventSound::create({});
  ASSERT_TRUE(sound && sound->keepRun(1.0));
  constexpr BodyId kAtOnce = 1000;
  constexpr int kTimes = 210;
  const BallDrop drop = dropOnBox(kTimes - 0.05);
  for (int time = 0; time < kTimes; ++time) {
    for (BodyId id = 0; id < kAtOnce; ++id)
      ASSERT_TRUE(sound->setBody(id, id == kFloor ? drop.floor() : drop.ball()));
    sound->advanceTo(time + 0.9);
    if (time + 1 == kTimes) sound->post(drop.event());
    for (BodyId id = 0; id < kAtOnce; ++id)
      sound->removeBody(id);
    sound->advanceTo(time + 1.0);
  }
  ASSERT_TRUE(sound->saveRun(folder_ / "host.run"));
  const RecordedRun run = opened();
  EXPECT_LE(run.scene.bodies.size(), 5 * kAtOnce);
  const std::vector<double> samples = replayed(run);
  EXPECT_NE(samples, std::vector<double>(samples.size(), 0.0));
}

TEST_F(HostRuns, LeaveOutWhatIsTooMuchAtOnceAndSaySo) {
  std::vector<std::string> told;
  SoundSettings silent;
  silent.onMessage = [&told](const std::string& message) { told.push_back(message); };
  Result<EventSound> sound = EventSound::create(silent);
  ASSERT_TRUE(sound && sound->recordRun(folder_ / "host.run"));
  constexpr BodyId kMore = audio::kMostRunBodies + 10;
  const BallDrop drop = dropOnBox(0.25);
  for (BodyId id = 0; id < kMore; ++id)
    ASSERT_TRUE(sound->setBody(id, id == kFloor ? drop.floor() : drop.ball()));
  sound->advanceTo(0.1);
  ImpulseEvent leftOut = drop.event();
  leftOut.time = 0.15;
  leftOut.body = kMore - 1;
  sound->post(leftOut);
  sound->advanceTo(0.2);
  for (BodyId id = 10; id < 30; ++id)
    sound->removeBody(id);
  sound->advanceTo(0.24);
  ImpulseEvent kept = drop.event();
  kept.body = kMore - 1;  // has come to a number of a body that is gone
  sound->post(kept);
  sound->advanceTo(0.5);
  ASSERT_TRUE(sound->finishRun());
  EXPECT_THAT(told, testing::ElementsAre(HasSubstr("200000 bodies at once")));
  const RecordedRun run = opened();
  EXPECT_THAT(run.scene.bodies, SizeIs(audio::kMostRunBodies));
  std::vector<double> times;
  for (auto portions = run.reader->next(); portions && !portions->empty();
       portions = run.reader->next())
    for (const audio::RunPortion& portion : *portions)
      for (const ImpulseEvent& event : portion.events)
        times.push_back(event.time);
  EXPECT_THAT(times, testing::ElementsAre(0.25));
}

TEST_F(HostRuns, LeaveOutLeapsOfTheClock) {
  Result<EventSound> sound = EventSound::create(settings());
  ASSERT_TRUE(sound);
  const BallDrop drop = dropOnBox(0.0);
  ASSERT_TRUE(sound->setBody(kBall, drop.ball()) && sound->setBody(kFloor, drop.floor()));
  ASSERT_TRUE(sound->recordRun(folder_ / "host.run"));
  double now = 0.0;
  for (const double leap : {0.0, 1000.0, -500.0}) {
    now += leap;
    sound->advanceTo(now);
    for (int frame = 0; frame < 30; ++frame) {
      now += kFrame;
      if (frame == 15) {
        ImpulseEvent event = drop.event();
        event.time = now;
        sound->post(event);
      }
      sound->advanceTo(now);
    }
  }
  ASSERT_TRUE(sound->close());
  const RecordedRun run = opened();
  EXPECT_NEAR(run.scene.duration, 1.5, 1e-9);
  EXPECT_LT(differenceOf(recorded(), replayed(run)), -120.0);
}

TEST_F(HostRuns, OfOneWorldHaveTheSameBytes) {
  std::string first;
  for (int time = 0; time < 2; ++time) {
    BallOnPlane world;
    Result<Sound> sound = Sound::attach(world.bullet.world, {});
    ASSERT_TRUE(sound && sound->recordRun(folder_ / "host.run"));
    world.stepTo(1.0);
    ASSERT_TRUE(sound->close());
    std::string bytes = contents(folder_ / "host.run");
    if (time == 0)
      first = std::move(bytes);
    else
      EXPECT_TRUE(bytes == first);
  }
}

TEST_F(HostRuns, RefuseWhatCannotBe) {
  SphereBulletWorld bullet{9.81};
  std::vector<std::string> told;
  SoundSettings silent;
  silent.onMessage = [&told](const std::string& message) { told.push_back(message); };
  Result<Sound> sound = Sound::attach(bullet.world, silent);
  ASSERT_TRUE(sound);
  const auto refusal = [](const Status& status) {
    return status ? std::string("none") : status.error().message;
  };
  EXPECT_THAT(refusal(sound->recordRun(folder_ / "no" / "such" / "folder.run")),
              HasSubstr("folder.run: "));
  EXPECT_THAT(refusal(sound->saveRun(folder_ / "kept.run")), HasSubstr("call keepRun before"));
  for (const double seconds : {-1.0, 1e6, std::nan("")})
    EXPECT_THAT(refusal(sound->keepRun(seconds)), HasSubstr("expected 0 to 86400 s"));
  ASSERT_TRUE(sound->keepRun(1.0));
  EXPECT_THAT(refusal(sound->saveRun(folder_ / "kept.run")), HasSubstr("no step was made"));
  ASSERT_TRUE(sound->recordRun(folder_ / "host.run"));
  EXPECT_THAT(refusal(sound->recordRun(folder_ / "other.run")), HasSubstr("is being written"));
  EXPECT_THAT(refusal(sound->finishRun()), HasSubstr("no step was made"));
  EXPECT_TRUE(sound->finishRun());
  EXPECT_TRUE(sound->keepRun(0.0));
  EXPECT_THAT(refusal(sound->saveRun(folder_ / "kept.run")), HasSubstr("call keepRun before"));
  ASSERT_TRUE(sound->close());
  EXPECT_FALSE(sound->recordRun(folder_ / "host.run"));
  EXPECT_TRUE(std::filesystem::is_empty(folder_ / "."));
  EXPECT_THAT(told, testing::Not(testing::IsEmpty()));
}

// An end of a few bytes that is unpacked to the whole memory of a machine.
TEST_F(HostRuns, WithAnEndThatIsNoneAreRefused) {
  Result<EventSound> sound = EventSound::create({});
  ASSERT_TRUE(sound && sound->recordRun(folder_ / "host.run"));
  sound->advanceTo(0.1);
  ASSERT_TRUE(sound->close());
  std::string bytes = contents(folder_ / "host.run");
  std::size_t part = 12;
  while (bytes.at(part) != 'e') {
    std::uint32_t stored = 0;
    std::memcpy(&stored, bytes.data() + part + 1, sizeof stored);
    part += 17 + stored;
  }
  const std::vector<std::byte> brackets(10'000'000, std::byte{'['});
  const auto end = audio::packedPart('e', brackets);
  ASSERT_TRUE(end);
  bytes.replace(part, std::string::npos, reinterpret_cast<const char*>(end->data()), end->size());
  std::ofstream(folder_ / "host.run", std::ios::binary) << bytes;
  const RecordedRun run = opened();
  for (int parts = 0; parts < 10; ++parts) {
    const auto portions = run.reader->next();
    if (portions) continue;
    EXPECT_THAT(portions.error().message, HasSubstr("end is larger than it can be"));
    return;
  }
  ADD_FAILURE() << "its end was taken";
}

// A replay that stops before the end would not notice that the end is missing, so the reader looks
// for it when the file is opened.
TEST_F(HostRuns, WithoutTheirEndOrWithMoreAreRefused) {
  Result<EventSound> sound = EventSound::create({});
  ASSERT_TRUE(sound && sound->recordRun(folder_ / "host.run"));
  sound->advanceTo(0.1);
  ASSERT_TRUE(sound->close());
  const std::string whole = contents(folder_ / "host.run");
  const auto refusal = [this](const std::string& bytes) {
    std::ofstream(folder_ / "other.run", std::ios::binary) << bytes;
    const Result<RecordedRun> run = openRun(folder_ / "other.run");
    return run ? std::string("none") : run.error().message;
  };
  EXPECT_EQ(refusal(whole), "none");
  for (std::size_t cut = 1; cut < 32; ++cut)
    EXPECT_THAT(refusal(whole.substr(0, whole.size() - cut)), HasSubstr("ends before the run"));
  EXPECT_THAT(refusal(whole + "garbage"), HasSubstr("more behind the run's end"));
}

TEST_F(HostRuns, ThatWereCutOrChangedAreRefused) {
  BallOnPlane world;
  Result<Sound> sound = Sound::attach(world.bullet.world, {});
  ASSERT_TRUE(sound && sound->assign(world.ball, {.modes = boxOf({{900.0, 30.0}})}));
  ASSERT_TRUE(sound->recordRun(folder_ / "host.run"));
  world.stepTo(1.0);
  ASSERT_TRUE(sound->close());
  expectRefusedIfDamaged(contents(folder_ / "host.run"));
}

/// Plays the run of a page for its own listener. Returns so many samples, interleaved.
std::vector<double> played(const lab::ViewRun& view, std::size_t count) {
  auto player = audio::RunPlayer::create(view.run, view.scene.sampleRate);
  EXPECT_TRUE(player) << player.error().message;
  player->follow(0);
  EXPECT_TRUE(player->seek({}));
  const std::size_t channels = player->channels();
  const std::size_t frames = count / channels;
  std::vector<std::vector<float>> planes(channels, std::vector<float>(frames));
  std::vector<float*> to;
  for (std::vector<float>& plane : planes)
    to.push_back(plane.data());
  player->render(to, frames);
  EXPECT_EQ(player->late(), 0u);
  std::vector<double> samples;
  for (std::size_t frame = 0; frame < frames; ++frame)
    for (const std::vector<float>& plane : planes)
      samples.push_back(plane[frame]);
  return samples;
}

TEST_F(HostRuns, AreSeenAndHeardInAPage) {
  for (const OrdinaryWorldKind& kind : ordinaryWorlds()) {
    if (kind.name != "hull_stack" && kind.name != "ragdolls") continue;
    const std::unique_ptr<OrdinaryWorld> world = kind.make();
    Result<Sound> sound = Sound::attach(world->world(), settings());
    ASSERT_TRUE(sound) << sound.error().message;
    ASSERT_TRUE(sound->setListener({0.0, 4.0, 12.0}));
    ASSERT_TRUE(sound->recordRun(folder_ / "host.run"));
    while (world->time() < 0.6)
      world->step(60.0);
    ASSERT_TRUE(sound->close());
    const auto view = lab::viewRecorded(folder_ / "host.run", false);
    ASSERT_TRUE(view) << view.error().message;
    EXPECT_EQ(view->stepper, "host");
    std::vector<double> samples = recorded();
    samples.resize(std::min(samples.size(), 2 * static_cast<std::size_t>(0.6 * 48000.0)));
    EXPECT_LT(differenceOf(samples, played(*view, samples.size())), -120.0) << kind.name;
    // Where the bodies are drawn at the end is where Bullet has them.
    std::size_t moving = 0;
    const btCollisionObjectArray& objects = world->world().getCollisionObjectArray();
    std::vector<Vec3> places;
    for (int index = 0; index < objects.size(); ++index) {
      const btVector3& at = objects[index]->getWorldTransform().getOrigin();
      places.emplace_back(at.x(), at.y(), at.z());
    }
    for (const auto& poses : view->poses) {
      if (poses.size() < 2) continue;
      ++moving;
      const auto distance = [&](const Vec3& place) {
        return (place - poses.back().position).norm();
      };
      EXPECT_LT(distance(*std::ranges::min_element(places, {}, distance)), 0.01);
    }
    EXPECT_GT(moving, 5u) << kind.name;
    EXPECT_FALSE(view->events.empty());
  }
}

}  // namespace
}  // namespace carom::test
