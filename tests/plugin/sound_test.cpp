#include "carom/sound.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/bullet_bridge/any_world.h"
#include "tests/bullet_bridge/sphere_world.h"
#include "tests/plugin/offline_sound.h"
#include "tests/support/temporary_folder.h"

namespace carom {
namespace {

// A steel ball that falls 0.2 m onto a floor, heard from right above it.
class DroppedBall : public testing::Test {
 protected:
  DroppedBall() {
    world_.addPlane(Vec3::UnitY(), 0.0, 1.0);
    ball_ = &world_.addBall({.radius = kRadius,
                             .mass = 8940.0 * 4.0 / 3.0 * 3.14159265 * std::pow(kRadius, 3),
                             .position = {0.0, kRadius + kDrop, 0.0},
                             .restitution = 0.8});
  }

  Sound attached(SoundSettings settings = {}) {
    settings.listeners = {{"above", {0.0, kHeight, 0.0}}};
    return test::attachOffline(world_.world, settings);
  }

  // Does what an application does: steps frame by frame and renders the frames that are ready.
  std::vector<float> play(Sound& sound, double seconds) {
    std::vector<std::vector<float>> samples(1);
    for (int frame = 0; frame < static_cast<int>(seconds * 60.0); ++frame) {
      world_.world.stepSimulation(btScalar(1.0 / 60.0), 10, btScalar(1.0 / 240.0));
      test::takeReady(sound, samples);
    }
    return samples[0];
  }

  static constexpr double kRadius = 0.01;  // m
  static constexpr double kDrop = 0.2;     // m
  static constexpr double kHeight = 0.5;   // m
  SphereBulletWorld world_{9.81};
  btRigidBody* ball_ = nullptr;
};

TEST_F(DroppedBall, ClicksWhenItLandsWithoutBeingToldAnything) {
  Sound sound = attached();
  const std::vector<float> samples = play(sound, 0.4);
  ASSERT_GT(samples.size(), std::size_t{12000});
  const auto loudest = std::max_element(samples.begin(), samples.end(),
                                        [](float a, float b) { return std::abs(a) < std::abs(b); });
  // Bullet's own path lands up to half a step early at the speed of the landing.
  const double landing = std::sqrt(2.0 * kDrop / 9.81) + (kHeight - kRadius) / 343.0;
  EXPECT_NEAR(static_cast<double>(loudest - samples.begin()) / 48000.0, landing, 1.0 / 240.0);
  // Steel on concrete, the materials suggested by the densities, has tau = 112.6 us. Hertz's force,
  // integrated apart from this code, through a sphere's response with its near field, up to 20 kHz,
  // gives 3.84 Pa. Bullet lands up to half a step early, and so a little slower, and no sample need
  // be at the peak.
  EXPECT_NEAR(std::abs(*loudest), 3.84F, 0.1F);
  EXPECT_EQ(sound.statistics().late, 0U);
}

TEST_F(DroppedBall, IsSilentBeforeItLands) {
  Sound sound = attached();
  const std::vector<float> samples = play(sound, 0.2);  // it lands at 0.202 s
  ASSERT_FALSE(samples.empty());
  EXPECT_TRUE(std::all_of(samples.begin(), samples.end(), [](float p) { return p == 0.0F; }));
}

// tau is inversely proportional to E*^(2/5): the softer ball sounds longer, and quieter by tau^2.
TEST_F(DroppedBall, SoundsAsTheMaterialThatIsSet) {
  Sound steel = attached();
  const std::vector<float> hard = play(steel, 0.35);
  SphereBulletWorld other(9.81);
  other.addPlane(Vec3::UnitY(), 0.0, 1.0);
  btRigidBody& ball = other.addBall({.radius = kRadius,
                                     .mass = 1.0 / static_cast<double>(ball_->getInvMass()),
                                     .position = {0.0, kRadius + kDrop, 0.0},
                                     .restitution = 0.8});
  SoundSettings settings;
  settings.listeners = {{"above", {0.0, kHeight, 0.0}}};
  Sound rubber = test::attachOffline(other.world, settings);
  ASSERT_TRUE(rubber.assign(ball, {.material = *findMaterial("rubber")}));
  for (int i = 0; i < 96; ++i)
    other.step(1.0 / 240.0);
  std::vector<float> soft(rubber.framesReady());
  float* channel = soft.data();
  rubber.render(std::span<float* const>(&channel, 1), soft.size());
  const auto peak = [](const std::vector<float>& samples) {
    float loudest = 0.0F;
    for (const float p : samples)
      loudest = std::max(loudest, std::abs(p));
    return loudest;
  };
  EXPECT_GT(peak(soft), 0.0F);
  EXPECT_LT(peak(soft), 1e-2F * peak(hard));
}

TEST_F(DroppedBall, RendersTheSameBitsWhateverTheBlocks) {
  Sound sound = attached();
  const std::vector<float> blocks = play(sound, 0.4);
  SphereBulletWorld again(9.81);
  again.addPlane(Vec3::UnitY(), 0.0, 1.0);
  again.addBall({.radius = kRadius,
                 .mass = 8940.0 * 4.0 / 3.0 * 3.14159265 * std::pow(kRadius, 3),
                 .position = {0.0, kRadius + kDrop, 0.0},
                 .restitution = 0.8});
  SoundSettings settings;
  settings.listeners = {{"above", {0.0, kHeight, 0.0}}};
  Sound whole = test::attachOffline(again.world, settings);
  for (int i = 0; i < 24; ++i) {
    again.world.stepSimulation(btScalar(1.0 / 60.0), 10, btScalar(1.0 / 240.0));
  }
  std::vector<float> once(whole.framesReady());
  float* channel = once.data();
  whole.render(std::span<float* const>(&channel, 1), once.size());
  EXPECT_EQ(once, blocks);
}

// A prop that is animated until it is dropped, or weighed after `attach`, sounds as it is when it
// hits.
TEST_F(DroppedBall, SoundsAsItIsOnceTheHostHasChangedIt) {
  const auto peakOf = [](const std::vector<float>& samples) {
    float peak = 0.0F;
    for (const float sample : samples)
      peak = std::max(peak, std::abs(sample));
    return peak;
  };
  const int flags = ball_->getCollisionFlags();
  ball_->setCollisionFlags(flags | btCollisionObject::CF_KINEMATIC_OBJECT);
  Sound sound = attached();
  ball_->setCollisionFlags(flags);
  EXPECT_NEAR(peakOf(play(sound, 0.4)), 3.84F, 0.1F);
  ASSERT_TRUE(sound.close());
  const auto dropAgain = [&](bool isChangedLater) {
    ball_->setWorldTransform(poseAt({0.0, kRadius + kDrop, 0.0}));
    ball_->setLinearVelocity(btVector3(0, 0, 0));
    const btScalar mass = btScalar(1.0) / ball_->getInvMass();
    const auto weigh = [&](btScalar wanted) {
      btVector3 inertia;
      ball_->getCollisionShape()->calculateLocalInertia(wanted, inertia);
      ball_->setMassProps(wanted, inertia);
    };
    if (!isChangedLater) weigh(mass / 5);
    Sound other = attached();
    if (isChangedLater) weigh(mass / 5);
    const float peak = peakOf(play(other, 0.4));
    EXPECT_TRUE(other.close());
    weigh(mass);
    return peak;
  };
  const float expected = dropAgain(false);
  EXPECT_NEAR(dropAgain(true), expected, 0.02F * expected);
}

TEST_F(DroppedBall, HearsABoxAsWell) {
  btBoxShape shape(btVector3(btScalar(0.05), btScalar(0.05), btScalar(0.05)));
  btRigidBody box(1, nullptr, &shape, btVector3(btScalar(2e-3), btScalar(2e-3), btScalar(2e-3)));
  box.setCenterOfMassTransform(
      btTransform(btQuaternion::getIdentity(), btVector3(1, btScalar(0.06), 0)));
  world_.world.addRigidBody(&box);
  Sound sound = attached();
  const std::vector<float> samples = play(sound, 0.19);  // box lands at 0.045 s, ball at 0.2 s
  EXPECT_GE(sound.statistics().events, 1U);
  EXPECT_EQ(sound.statistics().unsupportedContacts, 0U);
  // The box lands flat on a face: its contact is long and soft, but heard.
  EXPECT_GT(*std::max_element(samples.begin(), samples.end()), 5 * kHearingThreshold);
  world_.world.removeRigidBody(&box);
}

// A host may attach before it loads its level, whose bodies touch from the start.
TEST(Sounds, HearBodiesThatCameLaterSlideThoughTheyHitNothing) {
  const auto slidesOf = [](bool isLate) {
    AnyWorld world(9.81);
    world.addGround(world.box({50, 1, 50}), 0.4, -1.0);
    btCollisionShape& shape = world.box({0.1, 0.1, 0.1});
    const AnyWorld::Body there{.position = {0, 0.0995, 0}, .restitution = 0, .friction = 0.4};
    btRigidBody* box = isLate ? nullptr : &world.add(shape, there);
    Result<Sound> sound = Sound::attach(*world.world, {.listeners = {{"ear", {1, 1, 0}}}});
    EXPECT_TRUE(sound && sound->capture());
    world.step(1.0 / 60);
    if (isLate) box = &world.add(shape, there);
    world.step(1.0 / 60, 30);
    box->setLinearVelocity(btVector3(3, 0, 0));
    box->activate();
    world.step(1.0 / 60, 30);
    EXPECT_GT(sound->statistics().peak, 0.1);
    return sound->statistics().slides;
  };
  EXPECT_GT(slidesOf(false), 20U);
  EXPECT_EQ(slidesOf(true), slidesOf(false));
}

TEST_F(DroppedBall, LeavesAnOldFileAloneWhereItIsRefused) {
  const test::TemporaryFolder folder;
  SoundSettings settings;
  settings.record = folder / "kept.wav";
  std::ofstream(settings.record) << "kept";
  EXPECT_FALSE(Sound::attach(world_.world, settings, {.restSpeed = -1.0}));
  const Sound first = attached();
  EXPECT_FALSE(Sound::attach(world_.world, settings));  // a world has one sound
  EXPECT_EQ(test::contents(settings.record), "kept");
  EXPECT_EQ(folder.entries(), 1U);
}

TEST_F(DroppedBall, RefusesEverythingOnceItIsClosed) {
  const test::TemporaryFolder folder;
  Sound sound = attached();
  ASSERT_TRUE(sound.close());
  EXPECT_FALSE(sound.record(folder / "after.wav"));
  EXPECT_FALSE(sound.prepareRendering(48000.0));
  EXPECT_FALSE(sound.play());
  EXPECT_FALSE(sound.setListener({0.0, 1.0, 0.0}));
  EXPECT_FALSE(sound.setTimeScale(0.5));
  EXPECT_FALSE(sound.assign(UserIndex{1}, {.material = "steel"}));
  EXPECT_FALSE(sound.assign(*ball_, {.material = "steel"}));
  EXPECT_FALSE(sound.unassign(*ball_));
  EXPECT_FALSE(sound.unassign(UserIndex{1}));
  EXPECT_TRUE(sound.finishRecording());
  EXPECT_TRUE(sound.close());
  EXPECT_EQ(folder.entries(), 0U);
}

TEST_F(DroppedBall, IsRecordedByOneCallAndFinishedByItsDestructor) {
  const test::TemporaryFolder folder;
  {
    const auto sound = Sound::attach(world_.world, {.record = folder / "ball.wav"});
    ASSERT_TRUE(sound);
    world_.step(1.0 / 240.0, 96);
  }
  EXPECT_GT(test::contents(folder / "ball.wav").size(), 48000U);
  EXPECT_TRUE(Sound::attach(world_.world));  // the world is free again
}

TEST_F(DroppedBall, DetachesTheWorldOfASoundThatAnotherReplaces) {
  SphereBulletWorld other;
  Sound sound = attached();
  Sound replaced = test::attachOffline(other.world, {});
  replaced = std::move(sound);
  EXPECT_TRUE(Sound::attach(other.world));
  play(replaced, 0.3);
  EXPECT_EQ(replaced.statistics().events, 1U);
}

TEST_F(DroppedBall, RefusesWhatItCannotDo) {
  EXPECT_FALSE(Sound::attach(world_.world, {.latency = -1.0}));
  EXPECT_FALSE(Sound::attach(world_.world, {.latency = std::nan("")}));
  SoundSettings timeless;
  timeless.synth.sampleRate = 0.0;
  EXPECT_FALSE(Sound::attach(world_.world, timeless));
  EXPECT_FALSE(Sound::attach(world_.world, {}, {.restSpeed = -1.0}));
  Sound sound = attached();
  EXPECT_FALSE(Sound::attach(world_.world));  // a world has one sound
  btSphereShape shape(1);
  btRigidBody stranger(1, nullptr, &shape);
  EXPECT_FALSE(sound.assign(stranger, {.material = *findMaterial("steel")}));
  Material impossible = *findMaterial("steel");
  impossible.poissonsRatio = 0.5;
  EXPECT_FALSE(sound.assign(*ball_, {.material = impossible}));
}

}  // namespace
}  // namespace carom
