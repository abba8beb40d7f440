#include <chrono>
#include <cstring>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "carom/sound.h"
#include "tests/bullet_bridge/sphere_world.h"
#include "tests/plugin/offline_sound.h"
#include "tests/support/temporary_folder.h"

namespace carom {
namespace {

constexpr double kHullStep = 1.0 / 120.0;

btVector3 vectorOf(double x, double y, double z) {
  return {btScalar(x), btScalar(y), btScalar(z)};
}

// Hulls, each of its own shape, that fall on a plane and on each other.
class HullWorld {
 public:
  explicit HullWorld(int count) : scene_(9.81) {
    scene_.addPlane({0, 1, 0}, 0.0, 0.5);
    std::mt19937 random(7);
    const auto unit = [&random] { return static_cast<double>(random()) / 4294967296.0 - 0.5; };
    for (int number = 0; number < count; ++number) {
      auto hull = std::make_unique<btConvexHullShape>();
      for (int point = 0; point < 14; ++point)
        hull->addPoint(vectorOf(0.1 * unit(), 0.1 * unit(), 0.1 * unit()));
      hull->setMargin(btScalar(1e-3));
      add(std::move(hull), vectorOf(0.12 * (number % 3), 0.1 + 0.05 * number, 0.12 * (number % 2)));
    }
  }
  ~HullWorld() {
    while (!bodies_.empty())
      removeLast();
  }

  void add(std::unique_ptr<btCollisionShape> shape, const btVector3& place) {
    btVector3 inertia;
    shape->calculateLocalInertia(btScalar(0.2), inertia);
    auto body = std::make_unique<btRigidBody>(btScalar(0.2), nullptr, shape.get(), inertia);
    body->setWorldTransform(btTransform(btQuaternion::getIdentity(), place));
    body->setRestitution(btScalar(0.5));
    scene_.world.addRigidBody(body.get());
    bodies_.push_back(std::move(body));
    shapes_.push_back(std::move(shape));
  }

  void removeLast() {
    scene_.world.removeRigidBody(bodies_.back().get());
    bodies_.pop_back();
    shapes_.pop_back();
  }

  btDynamicsWorld& world() { return scene_.world; }
  std::size_t size() const { return bodies_.size(); }
  void step(int count) { scene_.step(kHullStep, count); }

 private:
  SphereBulletWorld scene_;
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
};

SoundSettings hullSettings() {
  SoundSettings settings;
  settings.listeners = {{"ear", {0.6, 0.7, 0.4}}};
  settings.budget.cpuShare = 1e6;  // goes by measured time otherwise
  return settings;
}

// Returns the samples of a WAV file of float samples.
std::vector<float> samplesOf(const std::string& file) {
  const std::size_t chunk = file.find("data");
  EXPECT_NE(chunk, std::string::npos);
  std::uint32_t size = 0;
  std::memcpy(&size, file.data() + chunk + 4, sizeof size);
  std::vector<float> samples(size / sizeof(float));
  std::memcpy(samples.data(), file.data() + chunk + 8, samples.size() * sizeof(float));
  return samples;
}

enum class Before { nothing, prepared, waited };

// Returns the file that is recorded of many hulls.
std::string recordedHulls(Before before) {
  const test::TemporaryFolder folder;
  HullWorld hulls(12);
  SoundSettings settings = hullSettings();
  settings.record = folder / "hulls.wav";
  Result<Sound> sound = Sound::attach(hulls.world(), settings);
  EXPECT_TRUE(sound);
  if (before == Before::prepared) sound->prepare();
  if (before == Before::waited) std::this_thread::sleep_for(std::chrono::milliseconds(300));
  hulls.step(60);
  EXPECT_GT(sound->statistics().events, 20U);
  if (before == Before::prepared) {
    EXPECT_EQ(sound->statistics().shapesSolvedInStep, 0U);
  }
  EXPECT_TRUE(sound->close());
  return test::contents(settings.record);
}

// Solved before all, shapes come to the recording in another order, and with them the buses of
// their sizes: sums round differently.
TEST(BackgroundShapes, ARecordingWaitsForThem) {
  const std::string file = recordedHulls(Before::nothing);
  EXPECT_GT(file.size(), 10000U);
  EXPECT_TRUE(recordedHulls(Before::waited) == file);
  EXPECT_TRUE(recordedHulls(Before::nothing) == file);
  const std::vector<float> waiting = samplesOf(file);
  const std::vector<float> prepared = samplesOf(recordedHulls(Before::prepared));
  ASSERT_EQ(waiting.size(), prepared.size());
  for (std::size_t sample = 0; sample < waiting.size(); ++sample)
    ASSERT_NEAR(waiting[sample], prepared[sample], 1e-5F) << sample;
}

std::vector<float> pulledHulls(bool isPrepared) {
  HullWorld hulls(8);
  Sound sound = test::attachOffline(hulls.world(), hullSettings());
  if (isPrepared) sound.prepare();
  std::vector<std::vector<float>> samples(1);
  for (int step = 0; step < 50; ++step) {
    hulls.step(1);
    test::takeReady(sound, samples);
  }
  return samples[0];
}

TEST(BackgroundShapes, TheSimulationsClockWaitsForThem) {
  const std::vector<float> samples = pulledHulls(true);
  EXPECT_GT(samples.size(), 1000U);
  EXPECT_EQ(pulledHulls(false), samples);
}

// Real time waits for no shape: the steps do not, and all are solved in the end.
TEST(BackgroundShapes, RealTimeDoesNotWait) {
  HullWorld hulls(12);
  Result<Sound> sound = Sound::attach(hulls.world(), hullSettings());
  ASSERT_TRUE(sound);
  ASSERT_TRUE(sound->prepareRendering(48000.0));
  EXPECT_EQ(sound->statistics().solvedShapes + sound->statistics().shapesPending, 12U);
  for (int turn = 0; turn < 24000 && sound->statistics().shapesPending > 0; ++turn) {
    hulls.step(1);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  EXPECT_EQ(sound->statistics().solvedShapes, 12U);
  EXPECT_EQ(sound->statistics().shapesSolvedInStep, 0U);
}

TEST(BackgroundShapes, PrepareWaitsForAll) {
  HullWorld hulls(6);
  Result<Sound> sound = Sound::attach(hulls.world(), hullSettings());
  ASSERT_TRUE(sound);
  sound->prepare();
  EXPECT_EQ(sound->statistics().solvedShapes, 6U);
  EXPECT_EQ(sound->statistics().shapesPending, 0U);
}

// The thread solves a copy: the host may delete body and shape at any time, and close at any time.
TEST(BackgroundShapes, BodiesAndShapesMayGoMeanwhile) {
  for (const bool isRecorded : {false, true}) {
    const test::TemporaryFolder folder;
    HullWorld hulls(20);
    SoundSettings settings = hullSettings();
    if (isRecorded) settings.record = folder / "gone.wav";
    Result<Sound> sound = Sound::attach(hulls.world(), settings);
    ASSERT_TRUE(sound);
    hulls.step(2);
    while (hulls.size() > 5)
      hulls.removeLast();
    hulls.step(40);
    while (hulls.size() > 0)
      hulls.removeLast();
    hulls.step(2);
    EXPECT_EQ(sound->statistics().events > 0, isRecorded);
    EXPECT_TRUE(sound->close());
  }
}

// Bodies are forgotten, with what they wait for, once many have left the world.
TEST(BackgroundShapes, ManyBodiesMayGoMeanwhile) {
  for (const bool isRecorded : {false, true}) {
    const test::TemporaryFolder folder;
    HullWorld hulls(90);
    SoundSettings settings = hullSettings();
    if (isRecorded) settings.record = folder / "gone.wav";
    Result<Sound> sound = Sound::attach(hulls.world(), settings);
    ASSERT_TRUE(sound);
    hulls.step(1);
    while (hulls.size() > 5)
      hulls.removeLast();
    hulls.step(30);
    EXPECT_TRUE(sound->close());
  }
}

TEST(BackgroundShapes, TheSoundMayCloseMeanwhile) {
  HullWorld hulls(20);
  Result<Sound> closed = Sound::attach(hulls.world(), hullSettings());
  ASSERT_TRUE(closed);
  EXPECT_TRUE(closed->close());
  EXPECT_LT(closed->statistics().solvedShapes, 20U);
  closed->prepare();
  const Result<Sound> destroyed = Sound::attach(hulls.world(), hullSettings());
  EXPECT_TRUE(destroyed);
}

// Two hundred bodies share a shape, of which there is one surface.
TEST(BackgroundShapes, BodiesOfOneShapeHaveOneSolution) {
  SphereBulletWorld scene;
  btBoxShape box(vectorOf(0.05, 0.04, 0.03));
  std::vector<std::unique_ptr<btRigidBody>> bodies;
  for (int number = 0; number < 200; ++number) {
    bodies.push_back(std::make_unique<btRigidBody>(btScalar(1), nullptr, &box, vectorOf(1, 1, 1)));
    bodies.back()->setWorldTransform(
        btTransform(btQuaternion::getIdentity(), vectorOf(number, 0, 0)));
    scene.world.addRigidBody(bodies.back().get());
  }
  Result<Sound> sound = Sound::attach(scene.world, hullSettings());
  ASSERT_TRUE(sound);
  sound->prepare();
  EXPECT_EQ(sound->statistics().solvedShapes, 1U);
  for (const auto& body : bodies)
    scene.world.removeRigidBody(body.get());
}

}  // namespace
}  // namespace carom
