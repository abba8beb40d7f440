// Worlds, sounds and processes that end in any order, and sounds that end in any callback.

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <BulletDynamics/Dynamics/btSimpleDynamicsWorld.h>
#include <BulletSoftBody/btDeformableBodySolver.h>
#include <BulletSoftBody/btDeformableMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btSoftMultiBodyDynamicsWorld.h>
#include <gtest/gtest.h>

#include "carom/event_sound.h"
#include "carom/sound.h"
#include "tests/bullet_bridge/any_world.h"
#include "tests/support/recording.h"
#include "tests/support/temporary_folder.h"

namespace carom {
namespace {

constexpr double kStep = 1.0 / 240.0;  // s

/// Settings that tell nobody anything.
SoundSettings quiet(SoundSettings settings = {}) {
  settings.onMessage = [](const std::string&) {};
  return settings;
}

/// A wooden ball that falls 5 cm onto a box, and lands after 0.1 s.
struct Drop : AnyWorld {
  explicit Drop(WorldKind kind = WorldKind::discrete) : AnyWorld(9.81, kind) {
    addGround(box({1.0, 1.0, 1.0}), 0.5, -1.0);
    ball = &add(sphere(0.1), {.mass = 3.0, .position = {0.0, 0.15, 0.0}, .restitution = 1.0});
  }

  Sound sound(const SoundSettings& settings = quiet()) {
    Result<Sound> made = Sound::attach(*world, settings);
    EXPECT_TRUE(made) << made.error().message;
    return *std::move(made);
  }
  /// The usual order at the end of a host: bodies, then the world; shapes and sound come later.
  void destroyWorld() {
    while (!bodies.empty())
      remove(*bodies.back());
    world.reset();
  }

  btRigidBody* ball = nullptr;
};

bool isFinished(const std::filesystem::path& file) {
  return std::filesystem::exists(file) && std::filesystem::file_size(file) > 20000U;
}

// ---- The world goes first

class EveryWorld : public testing::TestWithParam<WorldKind> {};

TEST_P(EveryWorld, MayGoBeforeItsSound) {
  const test::TemporaryFolder folder;
  Drop drop(GetParam());
  std::optional<Sound> sound = drop.sound(quiet({.record = folder / "drop.wav"}));
  drop.step(kStep, 48);
  const double time = sound->time();
  const std::uint64_t events = sound->statistics().events;
  EXPECT_GE(events, 1U);
  drop.destroyWorld();
  EXPECT_EQ(sound->time(), time);
  EXPECT_EQ(sound->statistics().events, events);
  EXPECT_FALSE(sound->assign(UserIndex{1}, {.material = "steel"}));
  EXPECT_TRUE(sound->setListener({0.0, 1.0, 0.0}));
  sound->prepare();
  EXPECT_TRUE(sound->close());
  EXPECT_TRUE(isFinished(folder / "drop.wav"));
}

TEST_P(EveryWorld, MayGoBeforeTheDestructorOfItsSound) {
  const test::TemporaryFolder folder;
  {
    Drop drop(GetParam());
    const Sound sound = drop.sound(quiet({.record = folder / "drop.wav"}));
    drop.step(kStep, 48);
    drop.destroyWorld();
  }
  EXPECT_TRUE(isFinished(folder / "drop.wav"));
  EXPECT_EQ(folder.entries(), 1U);
}

TEST_P(EveryWorld, HasItsOwnIslandManagerAgainAfterwards) {
  Drop drop(GetParam());
  auto& world = dynamic_cast<btDiscreteDynamicsWorld&>(*drop.world);
  const btSimulationIslandManager* const own = world.getSimulationIslandManager();
  Sound sound = drop.sound();
  world.getSimulationIslandManager()->setSplitIslands(false);
  ASSERT_TRUE(sound.close());
  EXPECT_EQ(world.getSimulationIslandManager(), own);
  EXPECT_FALSE(world.getSimulationIslandManager()->getSplitIslands()) << "set meanwhile";
}

/// The bits of all poses of a pile, some bodies of which fall asleep.
std::vector<btScalar> posesOfPile(WorldKind kind, bool isHeard) {
  AnyWorld pile(9.81, kind);
  pile.addGround(pile.box({5.0, 1.0, 5.0}), 0.5, -1.0);
  for (int i = 0; i < 24; ++i) {
    const Vec3 place(0.3 * (i % 5), 0.2 + 0.25 * i, 0.2 * (i % 3));
    pile.add(i % 2 == 0 ? pile.sphere(0.1) : pile.box({0.1, 0.08, 0.12}),
             {.position = place, .restitution = 0.5, .friction = 0.5});
  }
  pile.step(kStep, 100);
  std::optional<Sound> sound;
  if (isHeard)
    sound = *Sound::attach(*pile.world, quiet(), {.radiators = RadiatorChoice::equivalentSphere});
  pile.step(kStep, 300);
  sound.reset();
  pile.step(kStep, 100);
  std::vector<btScalar> poses;
  for (const auto& body : pile.bodies) {
    const btTransform& pose = body->getWorldTransform();
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 3; ++column)
        poses.push_back(pose.getBasis()[row][column]);
    for (int axis = 0; axis < 3; ++axis)
      poses.push_back(pose.getOrigin()[axis]);
  }
  return poses;
}

TEST_P(EveryWorld, MovesAsItDoesUnheard) {
  EXPECT_EQ(posesOfPile(GetParam(), true), posesOfPile(GetParam(), false));
}

INSTANTIATE_TEST_SUITE_P(, EveryWorld,
                         testing::Values(WorldKind::discrete, WorldKind::multithreaded,
                                         WorldKind::multibody, WorldKind::soft));

/// Runs `use` with the two worlds that no AnyWorld is.
template <class Use>
void withRarerWorlds(const Use& use) {
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  {
    btDbvtBroadphase broadphase;
    btMultiBodyConstraintSolver solver;
    use(std::make_unique<btSoftMultiBodyDynamicsWorld>(&dispatcher, &broadphase, &solver,
                                                       &configuration));
  }
  btDbvtBroadphase broadphase;
  btDeformableMultiBodyConstraintSolver solver;
  btDeformableBodySolver deformable;
  solver.setDeformableSolver(&deformable);
  use(std::make_unique<btDeformableMultiBodyDynamicsWorld>(&dispatcher, &broadphase, &solver,
                                                           &configuration, &deformable));
}

TEST(RarerWorlds, MayGoBeforeTheirSound) {
  withRarerWorlds([](std::unique_ptr<btDynamicsWorld> world) {
    btSphereShape shape(btScalar(0.1));
    btStaticPlaneShape floor(btVector3(0, 1, 0), 0);
    btRigidBody ball(btScalar(3.0), nullptr, &shape,
                     btVector3(btScalar(0.01), btScalar(0.01), btScalar(0.01)));
    btRigidBody ground(0, nullptr, &floor);
    ball.translate(btVector3(0, btScalar(0.15), 0));
    world->setGravity(btVector3(0, btScalar(-9.81), 0));
    world->addRigidBody(&ball);
    world->addRigidBody(&ground);
    Result<Sound> sound = Sound::attach(*world, quiet());
    ASSERT_TRUE(sound);
    int told = 0;
    ASSERT_TRUE(sound->onCollision([&told](const SoundCollision&) { ++told; }));
    for (int step = 0; step < 60; ++step)
      world->stepSimulation(btScalar(kStep), 0);
    EXPECT_GE(told, 1);
    world->removeRigidBody(&ball);
    world->removeRigidBody(&ground);
    world.reset();
    EXPECT_TRUE(sound->close());
  });
}

TEST(World, ThatCallsNoActionsIsRefusedWithTheReason) {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btSimpleDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  const Result<Sound> sound = Sound::attach(world, quiet());
  ASSERT_FALSE(sound);
  EXPECT_NE(sound.error().message.find("btSimpleDynamicsWorld"), std::string::npos);
}

TEST(World, ThatHasNoTaskSchedulerIsRefusedWithTheReason) {
  const Drop drop(WorldKind::multithreaded);
  btSetTaskScheduler(nullptr);
  const Result<Sound> sound = Sound::attach(*drop.world, quiet());
  btSetTaskScheduler(btGetSequentialTaskScheduler());
  ASSERT_FALSE(sound);
  EXPECT_NE(sound.error().message.find("btSetTaskScheduler"), std::string::npos);
  EXPECT_TRUE(Sound::attach(*drop.world, quiet()));
}

/// An island manager of the host's own, as a world may have by a class derived from it.
struct OwnManagerWorld : btDiscreteDynamicsWorld {
  struct Manager : btSimulationIslandManager {};
  using btDiscreteDynamicsWorld::btDiscreteDynamicsWorld;
  void replaceManager() {
    m_islandManager->~btSimulationIslandManager();
    btAlignedFree(m_islandManager);
    m_islandManager = new (btAlignedAlloc(sizeof(Manager), 16)) Manager;
  }
};

TEST(World, KeepsAnIslandManagerOfTheHosts) {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  OwnManagerWorld world(&dispatcher, &broadphase, &solver, &configuration);
  world.replaceManager();
  const btSimulationIslandManager* const own = world.getSimulationIslandManager();
  const Result<Sound> sound = Sound::attach(world, quiet());
  ASSERT_TRUE(sound);
  EXPECT_EQ(world.getSimulationIslandManager(), own);
}

// ---- The sound goes in a callback

/// Ends a sound, in the way that is tested, the first time that it is called.
struct Ending {
  std::optional<Sound> sound;
  bool destroys = false;
  int calls = 0;

  void operator()() {
    if (++calls > 1) return;
    if (destroys)
      sound.reset();
    else
      EXPECT_TRUE(sound->close());
  }
};

/// A place in a host's code that a substep calls.
struct Place {
  const char* name;
  std::function<void(Drop&, Ending&)> install;
};

/// An action that calls a function, or moves the ball upwards.
struct Acting : btActionInterface {
  explicit Acting(std::function<void()> wanted) : act(std::move(wanted)) {}
  void updateAction(btCollisionWorld*, btScalar) override { act(); }
  void debugDraw(btIDebugDraw*) override {}
  std::function<void()> act;
};

struct Mover : btDefaultMotionState {
  explicit Mover(const btTransform& at, std::function<void()> wanted)
      : btDefaultMotionState(at), move(std::move(wanted)) {}
  void setWorldTransform(const btTransform& pose) override {
    btDefaultMotionState::setWorldTransform(pose);
    move();
  }
  std::function<void()> move;
};

/// The state of a test, which global callbacks call.
struct Owned {
  std::vector<std::unique_ptr<Acting>> actions;
  std::vector<std::unique_ptr<Mover>> movers;
  std::function<void()> onContact;
};
Owned& owned() {
  static Owned all;
  return all;
}

void onTick(btDynamicsWorld* world, btScalar) {
  (*static_cast<std::function<void()>*>(world->getWorldUserInfo()))();
}

void addAction(Drop& drop, std::function<void()> act) {
  owned().actions.push_back(std::make_unique<Acting>(std::move(act)));
  drop.world->addAction(owned().actions.back().get());
}

std::vector<Place> places() {
  return {
      {"preTick",
       [](Drop& drop, Ending& end) {
         owned().onContact = [&end] { end(); };
         drop.world->setInternalTickCallback(&onTick, &owned().onContact, true);
       }},
      {"postTick",
       [](Drop& drop, Ending& end) {
         owned().onContact = [&end] { end(); };
         drop.world->setInternalTickCallback(&onTick, &owned().onContact, false);
       }},
      {"action", [](Drop& drop, Ending& end) { addAction(drop, [&end] { end(); }); }},
      {"contact",
       [](Drop&, Ending& end) {
         owned().onContact = [&end] { end(); };
         gContactStartedCallback = [](btPersistentManifold* const&) { owned().onContact(); };
       }},
      {"motionState",
       [](Drop& drop, Ending& end) {
         owned().movers.push_back(
             std::make_unique<Mover>(drop.ball->getWorldTransform(), [&end] { end(); }));
         drop.ball->setMotionState(owned().movers.back().get());
         end.calls = 0;
       }},
      {"collision",
       [](Drop&, Ending& end) {
         EXPECT_TRUE(end.sound->onCollision([&end](const SoundCollision&) { end(); }));
       }},
  };
}

struct EndCase {
  Place place;
  bool isInstalledFirst;  // before the sound is attached
  bool destroys;
};

void PrintTo(const EndCase& end, std::ostream* out) {
  *out << end.place.name;
}

class EndedIn : public testing::TestWithParam<EndCase> {
 protected:
  ~EndedIn() override {
    gContactStartedCallback = nullptr;
    owned() = Owned();
  }
};

/// Steps a drop whose last action counts its calls; ends the sound on the way.
void runEnding(const EndCase& wanted, const std::filesystem::path& file) {
  Drop drop;
  Ending end{.sound = std::nullopt, .destroys = wanted.destroys};
  int acted = 0;
  if (wanted.isInstalledFirst) wanted.place.install(drop, end);
  end.calls = 0;
  end.sound = drop.sound(quiet({.record = file}));
  if (!wanted.isInstalledFirst) wanted.place.install(drop, end);
  addAction(drop, [&acted] { ++acted; });
  drop.step(kStep, 30);
  EXPECT_GE(end.calls, 1);
  EXPECT_EQ(acted, 30) << "an action was left out";
  EXPECT_TRUE(isFinished(file) || std::filesystem::exists(file));
  const double time = end.sound ? end.sound->time() : 0.0;
  EXPECT_TRUE(Sound::attach(*drop.world, quiet())) << "the world is not free again";
  drop.step(kStep, 30);
  EXPECT_EQ(acted, 60);
  if (end.sound) {
    EXPECT_EQ(end.sound->time(), time) << "it still follows the world";
    EXPECT_FALSE(end.sound->setTimeScale(1.0));
  }
  gContactStartedCallback = nullptr;
}

TEST_P(EndedIn, LeavesTheWorldAsItWas) {
  const test::TemporaryFolder folder;
  runEnding(GetParam(), folder / "drop.wav");
  EXPECT_EQ(folder.entries(), 1U);
}

std::vector<EndCase> endCases() {
  std::vector<EndCase> all;
  for (const Place& place : places())
    for (const bool destroys : {false, true})
      for (const bool first : {false, true})
        if (!first || std::string(place.name) != "collision")
          all.push_back({place, first, destroys});
  return all;
}

INSTANTIATE_TEST_SUITE_P(, EndedIn, testing::ValuesIn(endCases()), [](const auto& param) {
  return std::string(param.param.place.name) + (param.param.isInstalledFirst ? "First" : "Last") +
         (param.param.destroys ? "Destroyed" : "Closed");
});

TEST(Sound, MayBeReplacedWithinItsOwnCallback) {
  Drop drop;
  std::optional<Sound> sound = drop.sound();
  int told = 0;
  ASSERT_TRUE(sound->onCollision([&](const SoundCollision&) {
    ++told;
    sound.reset();
  }));
  drop.step(kStep, 60);
  EXPECT_EQ(told, 1);
  sound = drop.sound();
  drop.ball->translate(btVector3(0, btScalar(0.05), 0));
  ASSERT_TRUE(sound->onCollision([&told](const SoundCollision&) { ++told; }));
  drop.step(kStep, 240);
  EXPECT_GE(told, 2);
}

TEST(Sound, EndedInAStepLeavesTheWorldFreeAlthoughItIsNotSteppedAgain) {
  Drop drop;
  std::optional<Sound> sound = drop.sound();
  drop.world->setInternalTickCallback([](btDynamicsWorld*, btScalar) {}, nullptr, true);
  addAction(drop, [&sound] { sound.reset(); });
  drop.step(kStep);
  drop.destroyWorld();
  owned() = Owned();
}

// ---- Everything goes in exit

/// A host whose sound, world and bodies are static, or are never destroyed.
[[noreturn]] void exitWithStatics(const std::string& file) {
  static std::optional<Sound>
      sound;  // older than all that is made in the steps, and than the world
  static Drop drop;
  sound = drop.sound(quiet({.record = file}));
  drop.step(kStep, 48);
  std::exit(0);  // NOLINT(concurrency-mt-unsafe)
}

[[noreturn]] void exitWithoutDestructors(const std::string& file) {
  auto* const drop = new Drop;
  auto* const sound = new Sound(drop->sound(quiet({.record = file})));
  drop->step(kStep, 48);
  std::exit(sound->time() > 0.0 ? 0 : 1);  // NOLINT(concurrency-mt-unsafe)
}

[[noreturn]] void die(const std::string& file) {
  Drop drop;
  const Sound sound = drop.sound(quiet({.record = file}));
  drop.step(kStep, 48);
  std::_Exit(0);
}

TEST(ExitDeathTest, OfStaticObjectsFinishesTheRecording) {
  const test::TemporaryFolder folder;
  EXPECT_EXIT(exitWithStatics(folder / "drop.wav"), testing::ExitedWithCode(0), "");
  EXPECT_TRUE(isFinished(folder / "drop.wav"));
  EXPECT_EQ(folder.entries(), 1U);
}

TEST(ExitDeathTest, WithoutDestructorsFinishesTheRecording) {
  const test::TemporaryFolder folder;
  EXPECT_EXIT(exitWithoutDestructors(folder / "drop.wav"), testing::ExitedWithCode(0), "");
  EXPECT_TRUE(isFinished(folder / "drop.wav"));
  EXPECT_EQ(folder.entries(), 1U);
}

TEST(ExitDeathTest, OfAKilledProcessLeavesSoundThatTheNextRunGivesAName) {
  const test::TemporaryFolder folder;
  EXPECT_EXIT(die(folder / "drop.wav"), testing::ExitedWithCode(0), "");
  EXPECT_EQ(folder.entries(), 1U);
  EXPECT_FALSE(std::filesystem::exists(folder / "drop.wav"));
  std::ofstream(folder / "drop.wav.bak.partial") << "the host's own";
  std::ofstream(folder / "other.wav.12ab.partial") << "of another recording";
  Drop drop;
  std::vector<std::string> told;
  SoundSettings settings = quiet({.record = folder / "drop.wav"});
  settings.onMessage = [&told](const std::string& sentence) { told.push_back(sentence); };
  Sound sound = drop.sound(settings);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_NE(told[0].find("drop.incomplete.wav'"), std::string::npos) << told[0];
  EXPECT_EQ(folder.entries(), 4U) << "these three, and the one that is written";
  // The host handed over 48 steps less the latency; the last 0.1 s of them may be lost.
  const test::Recording left = test::readRecording(folder / "drop.incomplete.wav");
  EXPECT_GT(static_cast<double>(left.info.frames) / 48000.0, 48 * kStep - 0.05 - 0.1);
  EXPECT_GT(left.peak(), 0.0);
  ASSERT_TRUE(sound.close());
  EXPECT_EQ(folder.entries(), 4U);
}

TEST(Recording, OfTheSameNameByAnotherIsLeftAlone) {
  const test::TemporaryFolder folder;
  Drop drop;
  Drop other;
  Sound sound = drop.sound(quiet({.record = folder / "drop.wav"}));
  Sound second = other.sound(quiet({.record = folder / "drop.wav"}));
  EXPECT_EQ(folder.entries(), 2U);
  drop.step(kStep, 48);
  EXPECT_TRUE(second.close());
  EXPECT_TRUE(sound.close());
  EXPECT_EQ(folder.entries(), 1U);
}

// An impulse that the solver applied is known one to three substeps after the impact; by then the
// body, or the world, may be gone.
TEST(AppliedImpulses, OfABodyThatCameAndWentAreHeard) {
  for (const bool isWorldDestroyed : {false, true}) {
    std::uint64_t posted = 0;
    for (int steps = 1; steps <= 8; ++steps) {
      SCOPED_TRACE(steps);
      const test::TemporaryFolder folder;
      Drop drop;
      SoundSettings settings = quiet({.record = folder / "drop.wav"});
      settings.synth.impulse = ImpulseChoice::applied;
      Sound sound = drop.sound(settings);
      drop.step(kStep, 2);
      btRigidBody& late = drop.add(drop.sphere(0.1),
                                   {.mass = 3.0, .position = {0.5, 0.11, 0.0}, .restitution = 0.0});
      late.setLinearVelocity(btVector3(0.0, -2.0, 0.0));
      drop.step(kStep, steps);
      if (isWorldDestroyed)
        drop.destroyWorld();
      else
        drop.remove(late);
      ASSERT_TRUE(sound.close());
      EXPECT_EQ(sound.statistics().rejected, 0U);
      posted += sound.statistics().posted;
      EXPECT_EQ(sound.statistics().heard + sound.statistics().immovable, sound.statistics().posted);
    }
    EXPECT_GT(posted, 0U);
  }
}

// ---- Objects that were moved from

template <class Kind>
void expectNothing(Kind& moved) {
  float samples[4] = {1.0F, 1.0F, 1.0F, 1.0F};
  float* const channel = samples;
  EXPECT_FALSE(moved.close());
  EXPECT_FALSE(moved.setListener({0.0, 0.0, 0.0}));
  EXPECT_EQ(moved.time(), 0.0);
  moved.pause();
  EXPECT_FALSE(moved.setTimeScale(1.0));
  EXPECT_FALSE(moved.play());
  EXPECT_FALSE(moved.isPlaying());
  EXPECT_FALSE(moved.prepareRendering(48000.0));
  moved.stop();
  EXPECT_FALSE(moved.record("never.wav"));
  EXPECT_FALSE(moved.finishRecording());
  moved.setGain(1.0);
  moved.setMuted(true);
  EXPECT_EQ(moved.statistics().events, 0U);
  EXPECT_EQ(moved.channelCount(), 0U);
  EXPECT_EQ(moved.sampleRate(), 0.0);
  EXPECT_EQ(moved.framesReady(), 0U);
  EXPECT_EQ(moved.outputDelay(), 0U);
  moved.render({&channel, 1}, 4);
  EXPECT_EQ(samples[3], 0.0F);
  moved.renderInterleaved(samples, 4);
}

// The fuzzer of Sound's calls found an engine that was pulled from when it was gone.
TEST(Pulling, MayGoOnWhileASoundIsStoppedPreparedAndClosed) {
  constexpr std::size_t kFrames = 64;
  for (int round = 0; round < 10; ++round) {
    Result<EventSound> sound = EventSound::create(quiet());
    ASSERT_TRUE(sound);
    ASSERT_TRUE(sound->prepareRendering(48000.0));
    std::vector<float> block(kFrames * sound->channelCount());
    std::atomic<bool> ends = false;
    std::atomic<int> blocks = 0;
    std::thread audio([&] {
      while (!ends) {
        std::ranges::fill(block, 1.0F);
        sound->renderInterleaved(block.data(), kFrames);
        ++blocks;
      }
    });
    const auto awaitBlocks = [&blocks] {
      for (const int seen = blocks; blocks < seen + 2;)
        std::this_thread::yield();
    };
    awaitBlocks();
    sound->stop();
    awaitBlocks();
    EXPECT_TRUE(sound->prepareRendering(44100.0));
    awaitBlocks();
    EXPECT_TRUE(sound->close());
    awaitBlocks();
    ends = true;
    audio.join();
    EXPECT_EQ(block, std::vector<float>(block.size(), 0.0F));
  }
}

TEST(MovedFrom, SoundRefusesEverything) {
  Drop drop;
  Sound sound = drop.sound();
  const Sound taken = std::move(sound);
  expectNothing(sound);  // NOLINT(bugprone-use-after-move): the subject of the test
  EXPECT_FALSE(sound.assign(*drop.ball, {}));
  EXPECT_FALSE(sound.assign(*drop.ball->getCollisionShape(), {}));
  EXPECT_FALSE(sound.assign(UserIndex{1}, {}));
  EXPECT_FALSE(sound.unassign(*drop.ball));
  EXPECT_FALSE(sound.unassign(*drop.ball->getCollisionShape()));
  EXPECT_FALSE(sound.unassign(UserIndex{1}));
  EXPECT_FALSE(sound.onCollision(nullptr));
  sound.prepare();
  drop.step(kStep, 48);
  EXPECT_NEAR(taken.time(), 48 * kStep, 1e-6);
}

TEST(MovedFrom, EventSoundRefusesEverything) {
  Result<EventSound> made = EventSound::create(quiet());
  ASSERT_TRUE(made);
  const EventSound taken = *std::move(made);
  EventSound& sound = *made;  // NOLINT(bugprone-use-after-move)
  expectNothing(sound);
  EXPECT_FALSE(sound.setBody(0, {}));
  sound.removeBody(0);
  sound.post({});
  sound.updateContact({});
  sound.advanceTo(1.0);
}

// ---- What is told

TEST(Messages, TellARefusalOnceWhetherItIsLookedAtOrNot) {
  Drop drop;
  std::vector<std::string> told;
  SoundSettings settings;
  settings.onMessage = [&told](const std::string& sentence) { told.push_back(sentence); };
  Sound sound = drop.sound(settings);
  EXPECT_TRUE(told.empty());
  for (int i = 0; i < 3; ++i)
    (void)sound.assign(*drop.ball, {.material = "cheese"});
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0], sound.assign(*drop.ball, {.material = "cheese"}).error().message);
  (void)Sound::attach(*drop.world, settings);
  EXPECT_EQ(told.size(), 2U) << "a world has one sound";
  (void)EventSound::create({.latency = -1.0, .onMessage = settings.onMessage});
  EXPECT_EQ(told.size(), 3U);
}

TEST(Messages, GoToStandardErrorUnlessAskedFor) {
  testing::internal::CaptureStderr();
  (void)EventSound::create({.latency = -1.0});
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            "carom: sound: latency is -1.000000; expected 0 to 10 s\n");
}

}  // namespace
}  // namespace carom
