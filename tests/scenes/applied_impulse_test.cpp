#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "scenes/run/bullet_scene.h"
#include "scenes/run/scene_sound.h"
#include "scenes/run/scene_stepper.h"
#include "tests/scenes/library.h"

namespace carom::test {

using namespace scenes;

namespace {

/// Two balls that meet off centre: at steps of 1/60 s, Bullet's impulse differs from the physical
/// one.
Scene twoBalls(ImpulseChoice impulse) {
  Scene scene = libraryScene("two_balls");
  scene.sound.impulse = impulse;
  return scene;
}

/// Change of a body's momentum by Bullet over the duration of the scene, in N s.
Vec3 momentumChange(const Scene& scene, std::size_t body) {
  BulletScene world(scene);
  const btRigidBody& rigid = world.body(body);
  const btVector3 before = rigid.getLinearVelocity();
  const auto steps = static_cast<int>(std::ceil(scene.duration / scene.stepper.step));
  for (int step = 0; step < steps; ++step)
    world.world().stepSimulation(static_cast<btScalar>(scene.stepper.step), 0);
  const btVector3 change = (rigid.getLinearVelocity() - before) / rigid.getInvMass();
  return {static_cast<double>(change.x()), static_cast<double>(change.y()),
          static_cast<double>(change.z())};
}

// The scene has one collision, and nothing else changes momenta.
TEST(AppliedImpulse, IsWhatBulletDidToTheBody) {
  const Scene scene = twoBalls(ImpulseChoice::applied);
  const Result<std::vector<ImpulseEvent>> events = sceneEvents(scene);
  ASSERT_TRUE(events) << events.error().message;
  ASSERT_EQ(events->size(), 2u);
  for (const ImpulseEvent& event : *events) {
    ASSERT_TRUE(event.hasAppliedImpulse);
    const Vec3 change = momentumChange(scene, event.body);
    EXPECT_LT((event.appliedImpulse - change).norm(), 1e-5 * change.norm());
    // Without a difference between the two impulses, the test could not tell one from the other.
    EXPECT_GT((event.impulse - change).norm(), 0.05 * change.norm());
  }
}

std::vector<float> soundOf(const Scene& scene) {
  Result<SceneSound> sound = SceneSound::create(scene);
  EXPECT_TRUE(sound) << sound.error().message;
  std::vector<std::vector<float>> block(1, std::vector<float>(48000));
  const std::size_t frames = sound->render(block);
  block[0].resize(frames);
  return block[0];
}

double peakOf(const std::vector<float>& samples) {
  double peak = 0.0;
  for (const float sample : samples)
    peak = std::max(peak, static_cast<double>(std::abs(sample)));
  return peak;
}

TEST(AppliedImpulse, IsWhatASceneSoundsOfThatWantsIt) {
  const double physical = peakOf(soundOf(twoBalls(ImpulseChoice::physical)));
  const double applied = peakOf(soundOf(twoBalls(ImpulseChoice::applied)));
  ASSERT_GT(physical, 0.0);
  EXPECT_GT(std::abs(applied / physical - 1.0), 0.01);
}

}  // namespace
}  // namespace carom::test
