#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "carom/audio/room.h"
#include "carom/audio/synth.h"
#include "carom/event_sound.h"
#include "carom/sound.h"
#include "plugin/bullet/shape_solver.h"
#include "tests/audio/ball_drop.h"
#include "tests/audio/meshes.h"
#include "tests/audio/recoils.h"
#include "tests/bullet_bridge/sphere_world.h"
#include "tests/plugin/offline_sound.h"
#include "tests/support/no_alloc_scope.h"
#include "tests/support/temporary_folder.h"

// Recoils of shapes in real time: the samples are those of Synth, which has no limits, whose own
// tests hold recoils against theory.

namespace carom::test {
namespace {

constexpr double kRate = 48000.0;    // Hz
constexpr double kStep = 1.0 / 240;  // s
constexpr double kRadius = 0.05;     // m
constexpr BodyId kFirst = 10;

/// Bodies of a shape each, which are hit one after another, and their sound.
struct Hits {
  std::size_t shapes = 1;
  std::size_t withRecoil = 1;  // the first ones
  int perStep = 1;
  int steps = 40;  // with hits; as many follow without
};

SoundBody shapedBody(std::size_t shape, bool hasRecoil) {
  SoundBody body = BallDrop{.radius = kRadius}.ball();
  body.material.youngsModulus = 2e12;  // a short contact: the whole band sounds
  body.shape = std::make_shared<const RigidRadiator>(sphereRadiator(kRadius));
  body.inverseInertia = Vec3(900.0, 700.0, 800.0).asDiagonal();
  if (hasRecoil)
    body.recoil =
        std::make_shared<const RigidRecoil>(someRecoil(kRadius, static_cast<unsigned>(shape) + 1));
  return body;
}

ImpulseEvent hit(const Hits& hits, int number, double time) {
  ImpulseEvent event = BallDrop{.radius = kRadius, .speed = 0.2, .time = time}.event();
  event.body = kFirst + static_cast<BodyId>(number) % static_cast<BodyId>(hits.shapes);
  event.other = kFloor;
  event.radius = 0.01;
  event.position = Vec3(0.03, 0.01 * (number % 5), -0.03);
  return event;
}

std::vector<Listener> twoEars() {
  return {{"left", {0.6, 0.5, 0.4}}, {"right", {-0.5, 0.6, 0.3}}};
}

SoundSettings liveSettings(std::size_t buses) {
  SoundSettings settings;
  settings.clock = SoundClock::simulation;
  settings.listeners = twoEars();
  settings.synth.lasting = LastingDetail::exact;  // nothing is masked
  settings.budget.buses = buses;
  settings.budget.cpuShare = 1e6;
  return settings;
}

using Samples = std::vector<std::vector<float>>;

template <class Layer>
void setBodies(Layer& layer, const Hits& hits) {
  for (std::size_t shape = 0; shape < hits.shapes; ++shape)
    EXPECT_TRUE(layer.setBody(kFirst + static_cast<BodyId>(shape),
                              shapedBody(shape, shape < hits.withRecoil)));
  EXPECT_TRUE(layer.setBody(kFloor, BallDrop{.radius = kRadius}.floor()));
}

struct Live {
  Samples samples;
  SoundStatistics statistics;
};

Live playedLive(const Hits& hits, const SoundSettings& settings) {
  EventSound sound = *EventSound::create(settings);
  setBodies(sound, hits);
  EXPECT_TRUE(sound.prepareRendering(kRate));
  Live live;
  for (int step = 1, number = 0; step <= 2 * hits.steps; ++step) {
    for (int one = 0; step <= hits.steps && one < hits.perStep; ++one)
      sound.post(hit(hits, number++, kStep * (step - 0.5)));
    sound.advanceTo(kStep * step);
    takeReady(sound, live.samples);
  }
  live.statistics = sound.statistics();
  return live;
}

Samples renderedWhole(const Hits& hits, const SoundSettings& settings, std::size_t frames) {
  Synth synth = *Synth::create(settings.synth, settings.listeners);
  setBodies(synth, hits);
  for (int step = 1, number = 0; step <= hits.steps; ++step)
    for (int one = 0; one < hits.perStep; ++one)
      (void)synth.schedule(hit(hits, number++, kStep * (step - 0.5)));
  Samples samples(2, std::vector<float>(frames));
  std::vector<float*> to = {samples[0].data(), samples[1].data()};
  synth.render<float>(to, frames);
  return samples;
}

double differenceOf(const Samples& some, const Samples& others) {
  double largest = 0.0;
  for (std::size_t channel = 0; channel < some.size(); ++channel)
    for (std::size_t frame = 0; frame < some[channel].size(); ++frame)
      largest = std::max(largest, std::abs(static_cast<double>(some[channel][frame]) -
                                           static_cast<double>(others[channel][frame])));
  return largest;
}

TEST(LiveRecoil, SoundsAsInTheOfflineRenderer) {
  const Hits hits{.shapes = 3, .withRecoil = 3};
  const SoundSettings settings = liveSettings(512);
  const Live live = playedLive(hits, settings);
  const Samples whole = renderedWhole(hits, settings, live.samples[0].size());
  EXPECT_GT(peakOf(live.samples[0]), 0.0);
  EXPECT_LT(differenceOf(live.samples, whole), 1e-6 * peakOf(live.samples[0]));
  EXPECT_EQ(live.statistics.noBus, 0U);
  EXPECT_EQ(live.statistics.queueFaults, 0U);
}

// 256 buses have room for two recoils to two channels; a third body clicks as its sphere.
TEST(LiveRecoil, BeyondTheBusesBodiesSoundAsTheirSpheres) {
  const SoundSettings settings = liveSettings(256);
  const Live live = playedLive({.shapes = 3, .withRecoil = 3}, settings);
  const Samples two =
      renderedWhole({.shapes = 3, .withRecoil = 2}, settings, live.samples[0].size());
  EXPECT_LT(differenceOf(live.samples, two), 1e-6 * peakOf(live.samples[0]));
  EXPECT_EQ(live.statistics.noBus, 0U);
}

TEST(LiveRecoil, ABodyThatGoesMakesRoomForAnother) {
  EventSound sound = *EventSound::create(liveSettings(128));  // room for one
  EXPECT_TRUE(sound.setBody(kFloor, BallDrop{.radius = kRadius}.floor()));
  EXPECT_TRUE(sound.setBody(kFirst, shapedBody(0, true)));
  sound.removeBody(kFirst);
  EXPECT_TRUE(sound.prepareRendering(kRate));
  EXPECT_TRUE(sound.setBody(kFirst, shapedBody(1, true)));
  sound.removeBody(kFirst);
  EXPECT_TRUE(sound.setBody(kFirst, shapedBody(2, true)));
  Samples samples;
  sound.post(hit({}, 0, 0.5 * kStep));
  for (int step = 1; step < 40; ++step) {
    sound.advanceTo(kStep * step);
    takeReady(sound, samples);
  }
  Synth synth = *Synth::create(liveSettings(128).synth, twoEars());
  EXPECT_TRUE(synth.setBody(kFloor, BallDrop{.radius = kRadius}.floor()));
  EXPECT_TRUE(synth.setBody(kFirst, shapedBody(2, true)));
  (void)synth.schedule(hit({}, 0, 0.5 * kStep));
  Samples whole(2, std::vector<float>(samples[0].size()));
  std::vector<float*> to = {whole[0].data(), whole[1].data()};
  synth.render<float>(to, samples[0].size());
  EXPECT_LT(differenceOf(samples, whole), 1e-6 * peakOf(samples[0]));
}

// More clicks than all queues hold: each event has a fate, and nothing is written beyond them.
TEST(LiveRecoil, AStormOfHitsIsLeftOutInPartAndCounted) {
  const Hits hits{.shapes = 5, .withRecoil = 5, .perStep = 1500, .steps = 20};
  const Live live = playedLive(hits, liveSettings(512));
  const SoundStatistics& all = live.statistics;
  EXPECT_EQ(all.posted, 30000U);
  EXPECT_GT(all.heard, 100U);
  EXPECT_GT(all.queueFaults + all.stolen, 100U);
  EXPECT_EQ(all.posted, all.heard + all.inaudible + all.masked + all.stolen + all.overBudget +
                            all.noBus + all.tooLong + all.ringsLeftOut + all.queueFaults +
                            all.lost + all.waiting + all.rejected + all.immovable + all.skipped);
}

TEST(LiveRecoil, ItIsHeardByWallsAsWell) {
  SoundSettings settings = liveSettings(4096);
  for (const Vec3& normal : {Vec3(Vec3::UnitZ()), Vec3(Vec3::UnitY())})
    settings.synth.room.reflectors.push_back({normal, -2.0, {}});
  const Hits hits{.shapes = 2, .withRecoil = 2};
  const Live live = playedLive(hits, settings);
  const Samples whole = renderedWhole(hits, settings, live.samples[0].size());
  EXPECT_LT(differenceOf(live.samples, whole), 1e-6 * peakOf(live.samples[0]));
}

TEST(LiveRecoil, RendersWithoutAllocation) {
  const Hits hits{.shapes = 3, .withRecoil = 3};
  EventSound sound = *EventSound::create(liveSettings(512));
  setBodies(sound, hits);
  EXPECT_TRUE(sound.prepareRendering(kRate));
  std::vector<float> left(200);
  std::vector<float> right(200);
  const std::vector<float*> to = {left.data(), right.data()};
  for (int step = 1; step <= 40; ++step) {
    for (int one = 0; one < 20; ++one)
      sound.post(hit(hits, 20 * step + one, kStep * (step - 0.5)));
    sound.advanceTo(kStep * step);
    const NoAllocScope scope;
    sound.render(to, 200);
    EXPECT_EQ(scope.allocations(), 0U);
  }
  EXPECT_GT(sound.statistics().heard, 100U);
}

// Boxes, each of its own shape, that fall on a plane.
class BoxWorld {
 public:
  explicit BoxWorld(int count) : scene_(9.81) {
    scene_.addPlane({0, 1, 0}, 0.0, 0.5);
    for (int number = 0; number < count; ++number) {
      shapes_.push_back(std::make_unique<btBoxShape>(
          btVector3(btScalar(0.05), btScalar(0.02 + 0.005 * number), btScalar(0.03))));
      btVector3 inertia;
      shapes_.back()->calculateLocalInertia(btScalar(0.5), inertia);
      bodies_.push_back(
          std::make_unique<btRigidBody>(btScalar(0.5), nullptr, shapes_.back().get(), inertia));
      bodies_.back()->setWorldTransform(
          btTransform(btQuaternion(btVector3(1, 0, 0), btScalar(0.3 + 0.1 * number)),
                      btVector3(btScalar(0.3 * number), btScalar(0.12 + 0.01 * number), 0)));
      bodies_.back()->setRestitution(btScalar(0.5));
      scene_.world.addRigidBody(bodies_.back().get());
    }
  }
  ~BoxWorld() {
    for (const auto& body : bodies_)
      scene_.world.removeRigidBody(body.get());
  }
  btDynamicsWorld& world() { return scene_.world; }
  void step(int count) { scene_.step(kStep, count); }

 private:
  SphereBulletWorld scene_;
  std::vector<std::unique_ptr<btBoxShape>> shapes_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
};

/// The radius of the sphere that holds a surface.
double radiusOf(const SurfaceMesh& surface) {
  double radius = 0.0;
  for (const Vec3& vertex : surface.vertices)
    radius = std::max(radius, vertex.norm());
  return radius;
}

SoundSettings recordingTo(const std::string& file) {
  SoundSettings settings;
  settings.listeners = twoEars();
  settings.record = file;
  return settings;
}

std::string recordedBoxes(const WorldSoundSettings& worldSettings, std::chrono::milliseconds wait) {
  const TemporaryFolder folder;
  BoxWorld boxes(3);
  const SoundSettings settings = recordingTo(folder / "boxes.wav");
  Result<Sound> sound = Sound::attach(boxes.world(), settings, worldSettings);
  EXPECT_TRUE(sound);
  std::this_thread::sleep_for(wait);
  boxes.step(120);
  EXPECT_GT(sound->statistics().heard, 2U);
  EXPECT_TRUE(sound->close());
  return contents(settings.record);
}

TEST(WorldRecoil, ARecordingWaitsForItAndHearsIt) {
  std::atomic<int> solved = 0;
  WorldSoundSettings worldSettings;
  worldSettings.recoil = [&](const SurfaceMesh& surface, const std::function<bool()>& goesOn) {
    EXPECT_TRUE(goesOn());
    ++solved;
    return Result<RigidRecoil>(someRecoil(radiusOf(surface), 3));
  };
  const std::string atOnce = recordedBoxes(worldSettings, std::chrono::milliseconds(0));
  EXPECT_EQ(solved, 3);
  EXPECT_GT(atOnce.size(), 10000U);
  EXPECT_EQ(recordedBoxes(worldSettings, std::chrono::milliseconds(300)), atOnce);
  EXPECT_NE(recordedBoxes({}, std::chrono::milliseconds(0)), atOnce);
}

// In real time nobody waits: a solver that takes for ever is told to end with the sound.
TEST(WorldRecoil, RealTimeDoesNotWaitAndEndsWhatIsUnderWay) {
  std::atomic<bool> hasBegun = false;
  std::atomic<bool> hasEnded = false;
  WorldSoundSettings worldSettings;
  worldSettings.recoil = [&](const SurfaceMesh&, const std::function<bool()>& goesOn) {
    hasBegun = true;
    while (goesOn())
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    hasEnded = true;
    return Result<RigidRecoil>(Error{"cancelled"});
  };
  BoxWorld boxes(3);
  SoundSettings settings;
  settings.listeners = twoEars();
  Result<Sound> sound = Sound::attach(boxes.world(), settings, worldSettings);
  ASSERT_TRUE(sound);
  ASSERT_TRUE(sound->prepareRendering(kRate));
  std::vector<float> left(200);
  std::vector<float> right(200);
  const std::vector<float*> to = {left.data(), right.data()};
  for (int step = 0; step < 120; ++step) {
    boxes.step(1);
    sound->render(to, 200);
  }
  while (!hasBegun)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(sound->statistics().shapesPending, 3U);
  EXPECT_GT(sound->statistics().heard, 2U);
  EXPECT_TRUE(sound->close());
  EXPECT_TRUE(hasEnded);
}

TEST(WorldRecoil, OneThatCannotBeSolvedIsToldOnceAndTheSphereIsHeard) {
  std::vector<std::string> messages;
  WorldSoundSettings worldSettings;
  worldSettings.recoil = [](const SurfaceMesh&, const std::function<bool()>&) {
    return Result<RigidRecoil>(Error{"too thin"});
  };
  const TemporaryFolder folder;
  BoxWorld boxes(3);
  SoundSettings settings = recordingTo(folder / "boxes.wav");
  settings.onMessage = [&](const std::string& message) { messages.push_back(message); };
  Result<Sound> sound = Sound::attach(boxes.world(), settings, worldSettings);
  ASSERT_TRUE(sound);
  boxes.step(120);
  EXPECT_EQ(sound->statistics().shapesPending, 0U);
  EXPECT_EQ(sound->statistics().unsolvedBodies, 0U);
  EXPECT_TRUE(sound->close());
  EXPECT_EQ(std::ranges::count_if(messages,
                                  [](const std::string& message) {
                                    return message.find("too thin") != std::string::npos;
                                  }),
            1);
  EXPECT_EQ(contents(settings.record), recordedBoxes({}, std::chrono::milliseconds(0)));
}

// The thread and the caller never solve a recoil at the same time.
TEST(ShapeSolver, SolvesARecoilOfEachShapeOneAtATime) {
  std::atomic<int> underWay = 0;
  std::atomic<int> solved = 0;
  plugin::ShapeSolver solver([&](const SurfaceMesh& surface, const std::function<bool()>&) {
    EXPECT_EQ(underWay.fetch_add(1), 0);
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    EXPECT_EQ(underWay.fetch_sub(1), 1);
    ++solved;
    return Result<RigidRecoil>(someRecoil(radiusOf(surface), 1));
  });
  std::vector<plugin::ShapeSolver::ShapeId> shapes;
  for (int number = 0; number < 12; ++number)
    shapes.push_back(solver.request(boxMesh({1.0, 0.5 + 0.01 * number, 0.3}), number));
  solver.finishAll();
  EXPECT_EQ(solver.pending(), 0U);
  EXPECT_EQ(solved, 12);
  for (const plugin::ShapeSolver::ShapeId shape : shapes) {
    ASSERT_NE(solver.recoil(shape), nullptr);
    EXPECT_TRUE(*solver.recoil(shape));
  }
  EXPECT_FALSE(solver.finish(shapes[0]));
}

// A broken recoil would be refused with the body; it is as one that could not be solved.
TEST(ShapeSolver, ARecoilThatIsNoneIsAnError) {
  plugin::ShapeSolver solver([](const SurfaceMesh&, const std::function<bool()>&) {
    return Result<RigidRecoil>(RigidRecoil());
  });
  const auto shape = solver.request(boxMesh({1.0, 0.5, 0.3}), 1.0);
  EXPECT_TRUE(solver.finish(shape));
  ASSERT_NE(solver.recoil(shape), nullptr);
  EXPECT_FALSE(*solver.recoil(shape));
  EXPECT_TRUE(solver.isComplete(shape));
}

}  // namespace
}  // namespace carom::test
