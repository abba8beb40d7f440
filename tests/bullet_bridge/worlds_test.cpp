#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>
#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "carom/bullet/bullet_bridge.h"
#include "tests/bullet_bridge/any_world.h"

namespace carom {
namespace {

using Body = AnyWorld::Body;

// Tolerance in s: Bullet's float positions of some 0.1 m are rounded by so much at some m/s.
constexpr double kTime = kDoubleBullet ? 1e-9 : 1e-6;

// --- every kind of world ---

class EveryWorld : public testing::TestWithParam<WorldKind> {};

TEST_P(EveryWorld, TwoBallsMeetAtTheClosedFormTimeWithTheClosedFormImpulse) {
  AnyWorld world(0.0, GetParam());
  const btRigidBody& ball =
      world.add(world.sphere(0.05), {.mass = 0.2, .position = {-0.3, 0, 0}, .velocity = {3, 0, 0}});
  world.add(world.sphere(0.05), {.mass = 0.5, .restitution = 0.8});
  BulletBridge bridge = world.attach();
  world.step(1.0 / 240, 30);

  ASSERT_EQ(bridge.events().size(), 2u);
  const ImpulseEvent event = eventsOf(bridge, ball).front();
  EXPECT_NEAR(event.time, 0.2 / 3.0, kTime);
  EXPECT_NEAR(event.impulse.x(), -1.8 * 3.0 * 0.2 * 0.5 / 0.7, 1e-5);
  ASSERT_TRUE(event.hasAppliedImpulse);
  const Vec3 change = 0.2 * (vec(ball.getLinearVelocity()) - Vec3(3, 0, 0));
  EXPECT_NEAR((event.appliedImpulse - change).norm(), 0.0, 1e-5 * change.norm());
}

TEST_P(EveryWorld, ABallFallsOnAPlaneAtTheTimeOfBulletsParabola) {
  AnyWorld world(9.81, GetParam());
  world.addGround(world.plane());
  const btRigidBody& ball =
      world.add(world.sphere(0.05), {.mass = 0.3, .position = {0, 0.55, 0}, .restitution = 0.7});
  BulletBridge bridge = world.attach();
  const Fall exact = fallByHand(0.5, 9.81, 1.0 / 240);
  world.stepUntil(bridge, exact.time + 0.02, 1.0 / 240);
  const auto events = eventsOf(bridge, ball);
  ASSERT_EQ(events.size(), 1u);
  EXPECT_NEAR(events[0].time, exact.time, 10.0 * kTime);
  EXPECT_NEAR(events[0].impulse.y(), 1.7 * 0.3 * exact.speed, 1e-4);
}

TEST_P(EveryWorld, ABoxThatLandsFlatIsOneEventAndThenAContactThatBearsItsWeight) {
  AnyWorld world(9.81, GetParam());
  world.addGround(world.box({1, 0.5, 1}), 0.5, -0.5);
  const btRigidBody& box =
      world.add(world.box({0.1, 0.1, 0.1}),
                {.mass = 2, .position = {0.2, 0.2, 0.1}, .restitution = 0.0, .friction = 0.5});
  BulletBridge bridge = world.attach();
  const Fall exact = fallByHand(0.1, 9.81, 1.0 / 240);
  world.step(1.0 / 240, 240);
  const auto events = eventsOf(bridge, box);
  ASSERT_EQ(events.size(), 1u);
  EXPECT_NEAR(events[0].time, exact.time, 10.0 * kTime);
  EXPECT_NEAR(events[0].impulse.y(), 2.0 * exact.speed, 1e-3);
  EXPECT_NEAR((events[0].position - Vec3(0.2, 0, 0.1)).norm(), 0.0, 1e-4);
  ASSERT_FALSE(bridge.contacts().empty());
  EXPECT_NEAR(bridge.contacts().back().normalLoad, 2.0 * 9.81, 0.02 * 2.0 * 9.81);
}

INSTANTIATE_TEST_SUITE_P(Kinds, EveryWorld,
                         testing::Values(WorldKind::discrete, WorldKind::multithreaded,
                                         WorldKind::multibody, WorldKind::soft));

// --- multibodies ---

// A multibody with one link that hangs on a hinge along z at the origin, or with none.
struct Multibody {
  Multibody(AnyWorld& of, int links, double mass, const btVector3& inertia, bool fixedBase)
      : world(static_cast<btMultiBodyDynamicsWorld&>(*of.world)),
        body(links, btScalar(mass), inertia, fixedBase, false) {
    body.setLinearDamping(0);
    body.setAngularDamping(0);
  }
  ~Multibody() {
    world.removeMultiBody(&body);
    world.removeCollisionObject(collider.get());
  }

  void finish(int link, btCollisionShape& shape) {
    body.finalizeMultiDof();
    body.setHasSelfCollision(false);
    collider = std::make_unique<btMultiBodyLinkCollider>(&body, link);
    collider->setCollisionShape(&shape);
    collider->setRestitution(1);
    collider->setFriction(0);
    if (link < 0)
      body.setBaseCollider(collider.get());
    else
      body.getLink(link).m_collider = collider.get();
    world.addMultiBody(&body);
    const bool moves = link >= 0 || !body.hasFixedBase();
    world.addCollisionObject(collider.get(), moves ? 1 : 2, moves ? -1 : ~2);
    placeColliders();
  }

  void placeColliders() {
    btAlignedObjectArray<btQuaternion> rotations;
    btAlignedObjectArray<btVector3> origins;
    body.forwardKinematics(rotations, origins);
    body.updateCollisionObjectWorldTransforms(rotations, origins);
    world.updateSingleAabb(collider.get());
  }

  btMultiBodyDynamicsWorld& world;
  btMultiBody body;
  std::unique_ptr<btMultiBodyLinkCollider> collider;
};

// A pendulum whose link has its centre at `arm` m from the hinge and turns at `rate` rad/s.
std::unique_ptr<Multibody> pendulum(AnyWorld& world, btCollisionShape& shape, double mass,
                                    double arm, double rate) {
  auto made = std::make_unique<Multibody>(world, 1, 0.0, btVector3(0, 0, 0), true);
  btVector3 inertia;
  shape.calculateLocalInertia(btScalar(mass), inertia);
  made->body.setupRevolute(0, btScalar(mass), inertia, -1, {0, 0, 0, 1}, {0, 0, 1}, {0, 0, 0},
                           bt({arm, 0, 0}));
  made->finish(0, shape);
  made->body.setJointVel(0, btScalar(rate));
  return made;
}

TEST(MultibodyWorld, APendulumsBallHitsARigidBallAtTheClosedFormTimeWithThePendulumsMass) {
  for (const double dt : {1.0 / 240, 1.0 / 1000}) {
    AnyWorld world(0.0, WorldKind::multibody);
    const auto swing = pendulum(world, world.sphere(0.05), 0.4, 0.8, 3.0);
    const Vec3 target(0.75, 0.3, 0.0);
    world.add(world.sphere(0.05), {.mass = 0.7, .position = target, .restitution = 0.9});
    BulletBridge bridge = world.attach();
    world.stepUntil(bridge, 0.2, dt);

    const auto bob = [](double t) {
      return Vec3(0.8 * std::cos(3.0 * t), 0.8 * std::sin(3.0 * t), 0.0);
    };
    const double time =
        closingTime([&](double t) { return (bob(t) - target).norm() - 0.1; }, 0.0, 0.125);
    const auto events = eventsOf(bridge, *swing->collider);
    ASSERT_EQ(events.size(), 1u) << "step " << dt;
    // The link moves along an arc, which the bridge approximates by a parabola.
    EXPECT_NEAR(events[0].time, time, 2e-6) << "step " << dt;
    const Vec3 normal = (bob(time) - target).normalized();
    const Vec3 along(-std::sin(3.0 * time), std::cos(3.0 * time), 0.0);
    const double inertia = 0.4 * (0.8 * 0.8 + 0.4 * 0.05 * 0.05);
    const double slope = 0.8 * along.dot(normal);
    const double mass = 1.0 / (1.0 / 0.7 + slope * slope / inertia);
    EXPECT_NEAR(events[0].approachSpeed, -3.0 * slope, 1e-4);
    EXPECT_NEAR(events[0].effectiveMass, mass, 1e-3 * mass);
    EXPECT_NEAR(events[0].impulse.norm(), 1.9 * mass * -3.0 * slope, 2e-3);
    EXPECT_EQ(bridge.events().size(), 2u);
  }
}

TEST(MultibodyWorld, ASwingingRodHitsAWallWithItsEnd) {
  const double dt = 1.0 / 240;
  AnyWorld world(0.0, WorldKind::multibody);
  const Vec3 half(0.4, 0.02, 0.03);
  const auto rod = pendulum(world, world.box(half), 0.6, 0.4, -2.0);
  world.addGround(world.plane(), 0.0, -0.3);
  BulletBridge bridge = world.attach();
  world.stepUntil(bridge, 0.3, dt);

  const auto end = [](double t) { return -0.8 * std::sin(2.0 * t) - 0.02 * std::cos(2.0 * t); };
  const double time = closingTime([&](double t) { return end(t) + 0.3; }, 0.0, 0.5);
  const auto events = eventsOf(bridge, *rod->collider);
  ASSERT_FALSE(events.empty());
  EXPECT_NEAR(events[0].time, time, 5e-6);
  const double lever = 0.8 * std::cos(2.0 * time) - 0.02 * std::sin(2.0 * time);
  const double inertia = 0.6 * (0.4 * 0.4 + (0.8 * 0.8 + 0.04 * 0.04) / 12.0);
  EXPECT_NEAR(events[0].approachSpeed, 2.0 * lever, 1e-3);
  EXPECT_NEAR(events[0].effectiveMass, inertia / (lever * lever), 2e-3);
  EXPECT_NEAR(events[0].position.z(), 0.0, 1e-4);
}

TEST(MultibodyWorld, AFreeBaseFallsOnAPlaneLikeARigidBody) {
  for (const double dt : {1.0 / 60, 1.0 / 240}) {
    AnyWorld world(9.81, WorldKind::multibody);
    world.addGround(world.plane());
    btCollisionShape& shape = world.sphere(0.05);
    btVector3 inertia;
    shape.calculateLocalInertia(btScalar(0.3), inertia);
    Multibody base(world, 0, 0.3, inertia, false);
    base.body.setBasePos(btVector3(0, btScalar(0.55), 0));
    base.finish(-1, shape);
    base.collider->setRestitution(btScalar(0.5));
    BulletBridge bridge = world.attach();
    const Fall exact = fallByHand(0.5, 9.81, dt);
    world.stepUntil(bridge, exact.time + 0.05, dt);
    const auto events = eventsOf(bridge, *base.collider);
    ASSERT_EQ(events.size(), 1u) << "step " << dt;
    EXPECT_NEAR(events[0].time, exact.time, 20.0 * kTime) << "step " << dt;
    EXPECT_NEAR(events[0].approachSpeed, exact.speed, 1e-3 * exact.speed);
    EXPECT_NEAR(events[0].effectiveMass, 0.3, 1e-5);
    EXPECT_NEAR(events[0].impulse.y(), 1.5 * 0.3 * exact.speed, 1e-3);
  }
}

TEST(MultibodyWorld, APendulumThatGravityPullsHitsAtTheTimeOfBulletsOwnArc) {
  // The oracle integrates the joint as Bullet does, w += dt * a(q), q += dt * w, and searches the
  // parabola q(s) through its nodes.
  const double dt = 1.0 / 60;
  AnyWorld world(9.81, WorldKind::multibody);
  const auto swing = pendulum(world, world.sphere(0.05), 0.4, 0.8, 0.0);
  world.addGround(world.plane(), 0.0, -0.6);
  BulletBridge bridge = world.attach();
  world.stepUntil(bridge, 0.6, dt);

  const auto a = [](double q) {
    return -9.81 * 0.8 * std::cos(q) / (0.8 * 0.8 + 0.4 * 0.05 * 0.05);
  };
  const auto h = double(btScalar(dt));
  double q = 0.0;
  double w = 0.0;
  double start = 0.0;
  const auto height = [](double angle) { return 0.8 * std::sin(angle) + 0.6 - 0.05; };
  for (; height(q + h * (w + h * a(q))) > 0.0; start += h) {
    w += h * a(q);
    q += h * w;
  }
  const double rate = w + h * a(q);
  const double pull = a(q);
  const double s = closingTime(
      [&](double t) { return height(q + rate * t - pull * t * (h - t) / 2.0); }, 0.0, h);
  const auto events = eventsOf(bridge, *swing->collider);
  ASSERT_FALSE(events.empty());
  EXPECT_NEAR(events[0].time, start + s, 1.5e-5);
}

// --- soft bodies ---

TEST(SoftWorld, ASoftBodyMakesNoEventsAndDisturbsNone) {
  AnyWorld world(9.81, WorldKind::soft);
  auto& soft = static_cast<btSoftRigidDynamicsWorld&>(*world.world);
  soft.getWorldInfo().m_gravity = soft.getGravity();
  soft.getWorldInfo().m_broadphase = soft.getBroadphase();
  soft.getWorldInfo().m_dispatcher = soft.getDispatcher();
  soft.getWorldInfo().m_sparsesdf.Initialize();
  btSoftBody* cloth = btSoftBodyHelpers::CreatePatch(soft.getWorldInfo(), bt({2.5, 0.3, -0.5}),
                                                     bt({3.5, 0.3, -0.5}), bt({2.5, 0.3, 0.5}),
                                                     bt({3.5, 0.3, 0.5}), 6, 6, 0, true);
  cloth->setTotalMass(btScalar(0.2));
  soft.addSoftBody(cloth);
  world.addGround(world.box({5, 0.5, 5}), 0.0, -0.5);
  world.add(world.sphere(0.1), {.position = {3, 0.1, 0}, .restitution = 0.0});  // under the cloth
  const btRigidBody& ball = world.add(world.sphere(0.05), {.mass = 0.3, .position = {0, 0.55, 0}});
  BulletBridge bridge = world.attach();
  const Fall exact = fallByHand(0.5, 9.81, 1.0 / 240);
  world.stepUntil(bridge, exact.time + 0.05, 1.0 / 240);

  EXPECT_GT(bridge.counters().softContacts, 0u);
  EXPECT_GT(soft.getSoftBodyArray()[0]->m_rcontacts.size() + cloth->m_scontacts.size(), 0)
      << "the cloth touches nothing: choose another case";
  const auto events = eventsOf(bridge, ball);
  ASSERT_EQ(events.size(), 1u);
  EXPECT_NEAR(events[0].time, exact.time, 10.0 * kTime);
  for (const ImpulseEvent& event : bridge.events()) {
    EXPECT_NE(event.body, *bridge.bodyId(*cloth));
    EXPECT_NE(event.other, *bridge.bodyId(*cloth));
  }
  EXPECT_EQ(bridge.counters().unsupported, 0u);
  soft.removeSoftBody(cloth);
  delete cloth;  // NOLINT(cppcoreguidelines-owning-memory): Bullet's helper makes it so
}

// --- stepping by the host ---

TEST(Regimes, InterpolatedFramesChangeNothing) {
  AnyWorld world;
  const btRigidBody& ball =
      world.add(world.sphere(0.05), {.position = {-0.4, 0, 0}, .velocity = {3, 0, 0}});
  world.add(world.sphere(0.05), {});
  BulletBridge bridge = world.attach();
  std::mt19937 random(3);
  std::uniform_real_distribution<double> frame(0.001, 0.02);
  while (bridge.time() < 0.15)
    world.world->stepSimulation(btScalar(frame(random)), 10, btScalar(1.0 / 240));
  const auto events = eventsOf(bridge, ball);
  ASSERT_EQ(events.size(), 1u);
  EXPECT_NEAR(events[0].time, 0.1, 2.0 * kTime);
}

TEST(Regimes, TimeThatBulletDropsDoesNotPass) {
  AnyWorld world;
  const btRigidBody& ball =
      world.add(world.sphere(0.05), {.position = {-0.4, 0, 0}, .velocity = {3, 0, 0}});
  world.add(world.sphere(0.05), {});
  BulletBridge bridge = world.attach();
  for (int frame = 1; frame <= 20; ++frame) {
    world.world->stepSimulation(btScalar(0.1), 2, btScalar(1.0 / 240));  // 22 of 24 are dropped
    EXPECT_NEAR(bridge.time(), frame * 2.0 / 240, 1e-7);
  }
  const auto events = eventsOf(bridge, ball);
  ASSERT_EQ(events.size(), 1u);
  EXPECT_NEAR(events[0].time, 0.1, 2.0 * kTime);
}

TEST(Regimes, EveryStepMayHaveItsOwnLength) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> length(0.0005, 0.03);
  for (int trial = 0; trial < 20; ++trial) {
    AnyWorld world;
    const btRigidBody& ball =
        world.add(world.sphere(0.05), {.position = {0, 0, 0.45}, .velocity = {0, 0, -3}});
    world.add(world.box({0.2, 0.2, 0.1}), {.mass = 0});
    BulletBridge bridge = world.attach();
    while (bridge.time() < 0.2)
      world.step(length(random));
    const auto events = eventsOf(bridge, ball);
    ASSERT_EQ(events.size(), 1u) << trial;
    EXPECT_NEAR(events[0].time, 0.1, 2.0 * kTime) << trial;
    EXPECT_NEAR(events[0].impulse.z(), 6.0, 1e-4) << trial;
  }
}

TEST(Regimes, AForceThatTheHostsPreTickCallbackAppliesIsPartOfTheMotion) {
  AnyWorld world;
  world.addGround(world.plane());
  btRigidBody& ball = world.add(world.sphere(0.05), {.mass = 0.5, .position = {0, 0.55, 0}});
  ball.setUserIndex(7);
  world.world->setInternalTickCallback(
      [](btDynamicsWorld* ticked, btScalar) {
        btRigidBody* pushed = btRigidBody::upcast(ticked->getCollisionObjectArray()[1]);
        pushed->applyCentralForce(btVector3(0, btScalar(-0.5 * 40.0), 0));
      },
      nullptr, true);
  BulletBridge bridge = world.attach();
  const Fall exact = fallByHand(0.5, 40.0, 1.0 / 60);
  // Each call makes one substep, so that forces are cleared after each.
  world.stepUntil(bridge, exact.time + 0.02, 1.0 / 60);
  const auto events = eventsOf(bridge, ball);
  ASSERT_EQ(events.size(), 1u);
  EXPECT_NEAR(events[0].time, exact.time, 10.0 * kTime);
  EXPECT_NEAR(events[0].approachSpeed, exact.speed, 1e-4 * exact.speed);
}

TEST(Regimes, AHostThatSetsItsPreTickCallbackInEachFrameIsHeard) {
  const auto heard = [](bool takesSlot) {
    AnyWorld world(9.81);
    world.addGround(world.plane());
    btRigidBody& ball = world.add(world.sphere(0.05), {.position = {0, 0.4, 0}});
    BulletBridge bridge = world.attach();
    for (int step = 0; step < 240; ++step) {
      if (takesSlot)
        world.world->setInternalTickCallback([](btDynamicsWorld*, btScalar) {}, nullptr, true);
      world.step(1.0 / 240);
    }
    EXPECT_EQ(bridge.counters().substepsWithoutStart, takesSlot ? 240U : 0U);
    std::vector<double> times;
    for (const ImpulseEvent& event : eventsOf(bridge, ball))
      times.push_back(event.time);
    return times;
  };
  const std::vector<double> whole = heard(false);
  const std::vector<double> late = heard(true);
  ASSERT_FALSE(whole.empty());
  ASSERT_EQ(late.size(), whole.size());
  for (std::size_t at = 0; at < whole.size(); ++at)
    EXPECT_NEAR(late[at], whole[at], 1e-6);
}

struct PreTickSlot : btDynamicsWorld {
  static btInternalTickCallback of(btDynamicsWorld& world) {
    return world.*(&PreTickSlot::m_internalPreTickCallback);
  }
};
btInternalTickCallback slotBefore = nullptr;
int chainedTicks = 0;

// The host's callback calls the bridge's, and the bridge's calls the host's.
TEST(Regimes, AHostThatChainsPreTickCallbacksDoesNotCallItselfForEver) {
  AnyWorld world(9.81);
  world.add(world.sphere(0.05), {});
  std::optional<BulletBridge> bridge = world.attach();
  slotBefore = PreTickSlot::of(*world.world);
  chainedTicks = 0;
  world.world->setInternalTickCallback(
      [](btDynamicsWorld* ticked, btScalar dt) {
        ++chainedTicks;
        slotBefore(ticked, dt);
      },
      nullptr, true);
  world.step(1.0 / 240, 10);
  bridge.reset();
  world.step(1.0 / 240, 10);
  bridge = world.attach();
  world.step(1.0 / 240, 10);
  EXPECT_EQ(chainedTicks, 30);
}

struct NamedAction : btActionInterface {
  NamedAction(std::string& calls, char name) : calls_(calls), name_(name) {}
  void updateAction(btCollisionWorld* world, btScalar) override {
    calls_ += name_;
    if (leaves) static_cast<btDynamicsWorld*>(world)->removeAction(this);
    if (throws) throw std::runtime_error("an action of the host's");
  }
  void debugDraw(btIDebugDraw*) override {}
  bool leaves = false;
  bool throws = false;

 private:
  std::string& calls_;
  char name_;
};

TEST(Regimes, ActionsThatLeaveOrThrowLeaveNothingOfOursBehind) {
  for (const bool throws : {false, true}) {
    AnyWorld world(9.81);
    world.add(world.sphere(0.05), {});
    std::optional<BulletBridge> bridge = world.attach();
    std::string calls;
    NamedAction action(calls, 'a');
    (throws ? action.throws : action.leaves) = true;
    world.world->addAction(&action);
    for (int step = 0; step < 5; ++step) {
      try {
        world.step(1.0 / 240);
      } catch (const std::runtime_error&) {
      }
    }
    if (throws) world.world->removeAction(&action);
    bridge.reset();
    world.step(1.0 / 240, 3);
    EXPECT_TRUE(world.attach().isAttached());
  }
}

TEST(Regimes, TheHostsActionsKeepTheirOrder) {
  AnyWorld world(9.81);
  std::optional<BulletBridge> bridge = world.attach();
  std::string calls;
  std::vector<std::unique_ptr<NamedAction>> actions;
  for (const char name : {'a', 'b', 'c', 'd'}) {
    actions.push_back(std::make_unique<NamedAction>(calls, name));
    world.world->addAction(actions.back().get());
  }
  world.step(1.0 / 240, 2);
  bridge.reset();
  world.step(1.0 / 240, 2);
  EXPECT_EQ(calls, "abcdabcdabcdabcd");
  for (const auto& action : actions)
    world.world->removeAction(action.get());
}

// --- bodies that come and go ---

// Without the start of the substep, nothing would tell of those that have gone.
TEST(Regimes, BodiesThatAreDeletedBeforeTheSlotIsTakenAreForgotten) {
  AnyWorld world(9.81);
  world.addGround(world.plane());
  std::vector<btRigidBody*> boxes;
  for (int box = 0; box < 8; ++box)
    boxes.push_back(&world.add(world.box({0.1, 0.1, 0.1}), {.position = {0.5 * box, 0.1, 0}}));
  BulletBridge bridge = world.attach();
  world.step(1.0 / 60, 40);
  for (btRigidBody* const box : boxes)
    world.remove(*box);
  world.world->setInternalTickCallback([](btDynamicsWorld*, btScalar) {}, nullptr, true);
  world.step(1.0 / 60, 3);
  EXPECT_EQ(bridge.counters().substepsWithoutStart, 1U);
}

btRigidBody* victim = nullptr;
void removeVictim(btDynamicsWorld* world, btScalar) {
  if (victim != nullptr) world->removeRigidBody(victim);
  victim = nullptr;
}

struct RemovingAction : btActionInterface {
  void updateAction(btCollisionWorld* world, btScalar dt) override {
    removeVictim(static_cast<btDynamicsWorld*>(world), dt);
  }
  void debugDraw(btIDebugDraw*) override {}
};

enum class Moment { preTick, postTick, actionBefore, actionAfter };

class RemovalInside : public testing::TestWithParam<Moment> {};

// The removed body precedes the others in the world's array, which Bullet reorders; the collision
// of the last body falls into that very substep.
TEST_P(RemovalInside, AStepDoesNotDisturbTheOthers) {
  AnyWorld world;
  btRigidBody& removed = world.add(world.sphere(0.05), {.position = {5, 0, 0}});
  world.add(world.sphere(0.05), {.position = {5, 0.09, 0}});  // overlaps: in contact from the start
  world.add(world.sphere(0.05), {});
  btRigidBody& ball =
      world.add(world.sphere(0.05), {.position = {-0.406, 0, 0}, .velocity = {3, 0, 0}});
  RemovingAction action;
  if (GetParam() == Moment::actionBefore) world.world->addAction(&action);
  if (GetParam() == Moment::preTick)
    world.world->setInternalTickCallback(removeVictim, nullptr, true);
  if (GetParam() == Moment::postTick) world.world->setInternalTickCallback(removeVictim);
  BulletBridge bridge = world.attach();
  if (GetParam() == Moment::actionAfter) world.world->addAction(&action);
  world.step(1.0 / 240, 24);  // the next step has the collision
  victim = &removed;
  world.step(1.0 / 240);
  ASSERT_EQ(victim, nullptr);
  EXPECT_TRUE(bridge.bodyId(ball));
  world.step(1.0 / 240, 3);
  const auto events = eventsOf(bridge, ball);
  ASSERT_EQ(events.size(), 1u);
  EXPECT_NEAR(events[0].time, 0.102, 2.0 * kTime);
  world.world->removeAction(&action);
}

INSTANTIATE_TEST_SUITE_P(Moments, RemovalInside,
                         testing::Values(Moment::preTick, Moment::postTick, Moment::actionBefore,
                                         Moment::actionAfter));

TEST(Regimes, ABodyThatIsRemovedDuringItsImpactIsHeardOnce) {
  AnyWorld world;
  btRigidBody& ball =
      world.add(world.sphere(0.05), {.position = {-0.4, 0, 0}, .velocity = {3, 0, 0}});
  const btRigidBody& other = world.add(world.sphere(0.05), {});
  BulletBridge bridge = world.attach();
  const auto collisions = [&] { return bridge.counters().collisions; };
  while (collisions() == 0)
    world.step(1.0 / 240);
  world.remove(ball);
  world.step(1.0 / 240, 20);
  EXPECT_EQ(eventsOf(bridge, other).size(), 1u);
  EXPECT_EQ(bridge.events().size(), 2u);
  EXPECT_EQ(bridge.counters().delivered, 1u);
}

class EveryBroadphase : public testing::TestWithParam<BroadphaseKind> {};

TEST_P(EveryBroadphase, ANewBodyAtAnOldAddressIsAnotherBody) {
  AnyWorld world(9.81, WorldKind::discrete, GetParam());
  world.addGround(world.plane());
  btCollisionShape& shape = world.sphere(0.05);
  alignas(btRigidBody) std::array<std::byte, sizeof(btRigidBody)> memory{};
  const auto make = [&](double height) {
    btRigidBody::btRigidBodyConstructionInfo info(1, nullptr, &shape);
    info.m_startWorldTransform = poseAt({0, height, 0});
    info.m_restitution = 1;
    auto* body = new (memory.data()) btRigidBody(info);  // NOLINT(cppcoreguidelines-owning-memory)
    world.world->addRigidBody(body);
    return body;
  };
  btRigidBody* first = make(0.05);
  BulletBridge bridge = world.attach();
  world.step(1.0 / 240, 50);  // it rests
  const BodyId firstId = *bridge.bodyId(*first);
  world.world->removeRigidBody(first);
  first->~btRigidBody();

  btRigidBody* second = make(0.55);
  const double start = bridge.time();
  EXPECT_FALSE(bridge.bodyId(*second)) << "it has not been stepped yet";
  world.step(1.0 / 240, 90);
  EXPECT_NE(*bridge.bodyId(*second), firstId);
  const auto events = eventsOf(bridge, *second);
  ASSERT_EQ(events.size(), 1u);
  EXPECT_NEAR(events[0].time, start + fallByHand(0.5, 9.81, 1.0 / 240).time, 10.0 * kTime);
  for (const ContactState& contact : bridge.contacts()) {
    EXPECT_TRUE(contact.body == firstId || contact.phase == ContactPhase::begin ||
                contact.time > 0.6);
  }
  world.world->removeRigidBody(second);
  second->~btRigidBody();
}

INSTANTIATE_TEST_SUITE_P(Broadphases, EveryBroadphase,
                         testing::Values(BroadphaseKind::tree, BroadphaseKind::sweep,
                                         BroadphaseKind::simple));

// The new one has the size of the old one, the same parts, and as many changes behind it.
TEST(Regimes, ANewCompoundAtAnOldAddressIsAnotherShape) {
  AnyWorld world;
  btCollisionShape& part = world.sphere(0.1);
  alignas(btCompoundShape) std::array<std::byte, sizeof(btCompoundShape)> memory{};
  const auto make = [&](const Vec3& axis) {
    auto* compound =
        new (memory.data()) btCompoundShape;  // NOLINT(cppcoreguidelines-owning-memory)
    compound->addChildShape(poseAt(0.2 * axis), &part);
    compound->addChildShape(poseAt(-0.2 * axis), &part);
    return compound;
  };
  btCompoundShape* const lying = make(Vec3::UnitX());
  btRigidBody& body = world.add(*lying, {});
  const btRigidBody& ball =
      world.add(world.sphere(0.1), {.position = {0, 1, 0}, .velocity = {0, -1, 0}});
  BulletBridge bridge = world.attach();
  world.step(1.0 / 240, 10);
  lying->~btCompoundShape();
  btCompoundShape* const standing = make(Vec3::UnitY());
  body.setCollisionShape(standing);
  world.step(1.0 / 240, 240);
  const auto events = eventsOf(bridge, ball);
  ASSERT_EQ(events.size(), 1u);
  EXPECT_NEAR(events[0].time, 0.6, 10.0 * kTime);
  world.remove(body);
  standing->~btCompoundShape();
}

// The frame's balls keep the bounding box of the whole.
TEST(Regimes, AChildThatIsTurnedInItsPlaceIsSeen) {
  AnyWorld world;
  btCompoundShape frame;
  for (const double x : {-2.0, 2.0})
    for (const double y : {-2.0, 2.0})
      for (const double z : {-2.0, 2.0})
        frame.addChildShape(poseAt({x, y, z}), &world.sphere(0.05));
  frame.addChildShape(poseAt(Vec3::Zero()), &world.box({1, 0.1, 0.1}));
  btRigidBody& body = world.add(frame, {.mass = 0});
  const btRigidBody& ball =
      world.add(world.sphere(0.1), {.position = {0, 1.8, 0}, .velocity = {0, -1, 0}});
  BulletBridge bridge = world.attach();
  world.step(1.0 / 240, 24);
  frame.updateChildTransform(8, poseAt(Vec3::Zero(), {btVector3(0, 0, 1), SIMD_HALF_PI}));
  world.world->updateSingleAabb(&body);
  world.step(1.0 / 240, 240);
  const auto events = eventsOf(bridge, ball);
  ASSERT_EQ(events.size(), 1u);
  EXPECT_NEAR(events[0].time, 0.7, 1e-4);
  world.remove(body);
}

// A place whose coordinates change their signs is another one.
TEST(Regimes, AChildThatIsPutOppositeIsSeen) {
  AnyWorld world;
  btCompoundShape frame;
  for (const double x : {-2.0, 2.0})
    for (const double y : {-2.0, 2.0})
      for (const double z : {-2.0, 2.0})
        frame.addChildShape(poseAt({x, y, z}), &world.sphere(0.05));
  frame.addChildShape(poseAt({0.5, 0.25, 0}), &world.box({0.3, 0.1, 0.3}));
  btRigidBody& body = world.add(frame, {.mass = 0});
  const btRigidBody& ball =
      world.add(world.sphere(0.1), {.position = {-0.5, 0.8, 0}, .velocity = {0, -1, 0}});
  BulletBridge bridge = world.attach();
  world.step(1.0 / 240, 24);
  frame.updateChildTransform(8, poseAt({-0.5, -0.25, 0}));
  world.world->updateSingleAabb(&body);
  world.step(1.0 / 240, 240);
  const auto events = eventsOf(bridge, ball);
  ASSERT_EQ(events.size(), 1u);
  EXPECT_NEAR(events[0].time, 0.85, 1e-4);
  world.remove(body);
}

// A host that changes a body's filters does so.
TEST(Regimes, ABodyWithANewProxyIsTheSame) {
  AnyWorld world(9.81);
  world.addGround(world.plane());
  btRigidBody& ball = world.add(world.sphere(0.05), {.position = {0, 0.5, 0}});
  BulletBridge bridge = world.attach();
  world.step(1.0 / 240, 10);
  const BodyId before = *bridge.bodyId(ball);
  world.world->refreshBroadphaseProxy(&ball);
  EXPECT_EQ(bridge.bodyOf(before), &ball);
  world.step(1.0 / 240, 10);
  EXPECT_EQ(*bridge.bodyId(ball), before);
}

// A host that sets a player's velocity in each frame has it hit the wall once, and press on it.
TEST(Regimes, APlayerWhoWalksAgainstAWallHitsItOnce) {
  for (const ImpactSearch search : {ImpactSearch::paths, ImpactSearch::contacts})
    for (const int substeps : {1, 4})
      for (const bool isBall : {true, false}) {
        AnyWorld world;
        btCollisionShape& shape = isBall ? world.sphere(0.5) : world.box({0.5, 0.5, 0.5});
        btRigidBody& player = world.add(shape, {.position = {-1, 0, 0}, .restitution = 0.0});
        world.add(world.box({0.5, 5, 5}), {.mass = 0, .position = {1, 0, 0}});
        player.setAngularFactor(0);
        BulletBridge bridge = world.attach({.search = search});
        std::size_t contacts = 0;
        for (int frame = 0; frame < 120; ++frame) {
          player.setLinearVelocity(btVector3(2, 0, 0));
          bridge.clear();
          const std::size_t before = bridge.counters().collisions;
          world.step(1.0 / (60 * substeps), substeps);
          if (frame > 35) {
            EXPECT_EQ(bridge.counters().collisions, before) << frame;
          }
          contacts += bridge.contacts().size();
        }
        EXPECT_EQ(bridge.counters().collisions, 1u) << substeps << ' ' << isBall;
        EXPECT_GT(contacts, 60u);
      }
}

// A body at rest that impulses push down, as a gravity of the host's own does, hits nothing.
TEST(Regimes, ABodyThatIsHeldDownByImpulsesLies) {
  for (const ImpactSearch search : {ImpactSearch::paths, ImpactSearch::contacts}) {
    AnyWorld world;
    world.addGround(world.plane());
    btRigidBody& crate =
        world.add(world.box({0.5, 0.5, 0.5}), {.position = {0, 0.5, 0}, .restitution = 0.0});
    BulletBridge bridge = world.attach({.search = search});
    for (int frame = 0; frame < 120; ++frame) {
      crate.activate();
      crate.applyCentralImpulse(btVector3(0, btScalar(-9.81 / 60), 0));
      world.step(1.0 / 60, 1);
    }
    EXPECT_LE(bridge.counters().collisions, 1u);
  }
}

// A conveyor: its surface has a velocity, and it stays where it is.
TEST(Regimes, WhatRidesOnABeltDoesNotSlip) {
  AnyWorld world(9.81);
  btDefaultMotionState state(poseAt({0, -0.5, 0}));
  btRigidBody& belt =
      world.add(world.box({50, 0.5, 5}),
                {.mass = 0, .position = {0, -0.5, 0}, .friction = 1.0, .mover = &state});
  btRigidBody& crate = world.add(world.box({0.2, 0.2, 0.2}),
                                 {.position = {0, 0.2, 0}, .restitution = 0.0, .friction = 1.0});
  world.world->setInternalTickCallback(
      [](btDynamicsWorld* of, btScalar) {
        static_cast<btRigidBody*>(of->getWorldUserInfo())->setLinearVelocity(btVector3(1, 0, 0));
      },
      &belt, true);
  BulletBridge bridge = world.attach();
  world.step(1.0 / 240, 240);
  EXPECT_NEAR(crate.getLinearVelocity().x(), 1.0, 0.01);
  bridge.clear();
  world.step(1.0 / 240, 24);
  ASSERT_FALSE(bridge.contacts().empty());
  for (const ContactState& contact : bridge.contacts())
    EXPECT_LT(contact.slipVelocity.norm(), 0.02);
}

// A host's action changes velocities that the solver has left, whether it is there before the
// bridge or comes after it.
TEST(Regimes, AnActionThatPushesMakesNoDifferenceBeforeTheBridge) {
  struct Thrust final : btActionInterface {
    btRigidBody* body = nullptr;
    void updateAction(btCollisionWorld*, btScalar dt) override {
      body->applyCentralImpulse(btVector3(20 * dt, 0, 0));
    }
    void debugDraw(btIDebugDraw*) override {}
  };
  const auto hit = [](bool isBefore) {
    AnyWorld world;
    btRigidBody& ball = world.add(world.sphere(0.25), {.position = {-1, 0, 0}, .restitution = 0.5});
    world.add(world.box({0.5, 5, 5}), {.mass = 0, .position = {1, 0, 0}});
    Thrust thrust;
    thrust.body = &ball;
    if (isBefore) world.world->addAction(&thrust);
    BulletBridge bridge = world.attach();
    if (!isBefore) world.world->addAction(&thrust);
    world.step(1.0 / 60, 30);
    const auto events = eventsOf(bridge, ball);
    world.world->removeAction(&thrust);
    EXPECT_FALSE(events.empty());
    return events.empty() ? ImpulseEvent{} : events.front();
  };
  const ImpulseEvent before = hit(true);
  const ImpulseEvent after = hit(false);
  EXPECT_EQ(before.time, after.time);
  EXPECT_EQ(before.approachSpeed, after.approachSpeed);
  EXPECT_EQ(before.impulse, after.impulse);
}

// Bullet stops bodies at a ghost object, unless it is told not to.
TEST(Regimes, AGhostThatBulletTakesForSolidIsHit) {
  for (const bool isSolid : {true, false}) {
    AnyWorld world;
    btGhostObject ghost;
    ghost.setCollisionShape(&world.box({0.5, 5, 5}));
    ghost.setWorldTransform(poseAt({1, 0, 0}));
    ghost.setRestitution(0);
    if (!isSolid)
      ghost.setCollisionFlags(ghost.getCollisionFlags() |
                              btCollisionObject::CF_NO_CONTACT_RESPONSE);
    const btRigidBody& ball =
        world.add(world.sphere(0.25), {.position = {-0.5, 0, 0}, .velocity = {2, 0, 0}});
    world.world->addCollisionObject(&ghost);
    BulletBridge bridge = world.attach();
    world.step(1.0 / 240, 120);
    const auto events = eventsOf(bridge, ball);
    ASSERT_EQ(events.size(), isSolid ? 1u : 0u);
    if (isSolid) {
      EXPECT_NEAR(events[0].time, 0.375, 10.0 * kTime);
      EXPECT_NEAR(events[0].impulse.x(), -2.0, 1e-4);
    }
    world.world->removeCollisionObject(&ghost);
  }
}

TEST(Regimes, ASleepingBodyIsHitAtTheExactTimeAndWakes) {
  AnyWorld world;
  const btRigidBody& ball =
      world.add(world.sphere(0.05), {.position = {-0.4, 0, 0}, .velocity = {3, 0, 0}});
  btRigidBody& sleeper = world.add(world.sphere(0.05), {});
  sleeper.forceActivationState(ISLAND_SLEEPING);
  BulletBridge bridge = world.attach();
  world.step(1.0 / 240, 40);
  EXPECT_TRUE(sleeper.isActive());
  ASSERT_EQ(bridge.events().size(), 2u);
  const ImpulseEvent event = eventsOf(bridge, ball).front();
  EXPECT_NEAR(event.time, 0.1, 2.0 * kTime);
  EXPECT_NEAR(event.impulse.x(), -3.0, 1e-5);
}

TEST(Regimes, ABodyThatIsPutToSleepInFlightFallsSilentAndGoesOnWhenItIsWoken) {
  AnyWorld world;
  btRigidBody& ball =
      world.add(world.sphere(0.05), {.position = {-0.4, 0, 0}, .velocity = {3, 0, 0}});
  world.add(world.box({0.05, 1, 1}), {.mass = 0});
  BulletBridge bridge = world.attach();
  world.step(1.0 / 240, 12);
  const double went = bridge.time();
  ball.forceActivationState(ISLAND_SLEEPING);
  world.step(1.0 / 240, 40);
  EXPECT_TRUE(bridge.events().empty());
  const double slept = bridge.time() - went;
  ball.forceActivationState(ACTIVE_TAG);
  ball.setLinearVelocity(btVector3(3, 0, 0));
  world.step(1.0 / 240, 30);
  const auto events = eventsOf(bridge, ball);
  ASSERT_EQ(events.size(), 1u);
  EXPECT_NEAR(events[0].time, 0.1 + slept, 2.0 * kTime);
}

TEST(Regimes, ABodyMayBeKinematicForAWhile) {
  AnyWorld world;
  btRigidBody& ball =
      world.add(world.sphere(0.05), {.position = {-0.4, 0, 0}, .velocity = {3, 0, 0}});
  world.add(world.sphere(0.05), {.mass = 0});
  BulletBridge bridge = world.attach();
  world.step(1.0 / 240, 12);
  const double went = bridge.time();
  const int flags = ball.getCollisionFlags();
  ball.setCollisionFlags(flags | btCollisionObject::CF_KINEMATIC_OBJECT);
  world.step(1.0 / 240, 20);  // it stands still, as the host does not move it
  ball.setCollisionFlags(flags);
  ball.setLinearVelocity(btVector3(3, 0, 0));
  const double held = bridge.time() - went;
  world.step(1.0 / 240, 30);
  const auto events = eventsOf(bridge, ball);
  ASSERT_EQ(events.size(), 1u);
  EXPECT_NEAR(events[0].time, 0.1 + held, 2.0 * kTime);
  EXPECT_NEAR(events[0].impulse.x(), -6.0, 1e-4);
}

TEST(Regimes, WorldsThatTakeTurnsKeepTheirOwnTime) {
  AnyWorld fast;
  AnyWorld slow(0.0, WorldKind::multibody);
  for (AnyWorld* world : {&fast, &slow}) {
    world->add(world->sphere(0.05), {.position = {-0.4, 0, 0}, .velocity = {3, 0, 0}});
    world->add(world->sphere(0.05), {});
  }
  BulletBridge fastBridge = fast.attach();
  BulletBridge slowBridge = slow.attach();
  for (int turn = 0; turn < 30; ++turn) {
    fast.step(1.0 / 240, 4);
    slow.step(1.0 / 60);
  }
  for (const BulletBridge* bridge : {&fastBridge, &slowBridge}) {
    ASSERT_EQ(bridge->events().size(), 2u);
    EXPECT_NEAR(bridge->events()[0].time, 0.1, 2.0 * kTime);
  }
}

TEST(Regimes, ABridgeThatComesBackInTheMiddleOfAnImpactStartsAfresh) {
  AnyWorld world;
  world.add(world.sphere(0.05), {.position = {-0.4, 0, 0}, .velocity = {3, 0, 0}});
  btRigidBody& wall = world.add(world.box({0.05, 1, 1}), {.mass = 0});
  {
    BulletBridge bridge = world.attach();
    while (bridge.counters().collisions == 0)
      world.step(1.0 / 240);
  }
  world.step(1.0 / 240, 5);
  BulletBridge again = world.attach();
  EXPECT_EQ(again.time(), 0.0);
  wall.setWorldTransform(poseAt({-1.0, 0, 0}));
  const double way = double(world.bodies[0]->getWorldTransform().getOrigin().x()) + 1.0 - 0.1;
  const double speed = -double(world.bodies[0]->getLinearVelocity().x());
  world.world->updateSingleAabb(&wall);
  world.stepUntil(again, way / speed + 0.02, 1.0 / 240);
  ASSERT_EQ(again.events().size(), 2u);
  EXPECT_NEAR(again.events()[0].time, way / speed, 2.0 * kTime);
}

// --- callbacks and user data of the host ---

std::array<int, 4> calls{};

bool countAdded(btManifoldPoint&, const btCollisionObjectWrapper*, int, int,
                const btCollisionObjectWrapper*, int, int) {
  ++calls[0];
  return false;
}
bool countProcessed(btManifoldPoint&, void*, void*) {
  ++calls[1];
  return false;
}
void countStarted(btPersistentManifold* const&) {
  ++calls[2];
}
void countEnded(btPersistentManifold* const&) {
  ++calls[3];
}

std::array<int, 4> callsWithBridge(bool bridged) {
  AnyWorld world(9.81);
  world.addGround(world.box({1, 0.5, 1}), 0.5, -0.5);
  btRigidBody& box =
      world.add(world.box({0.1, 0.1, 0.1}),
                {.position = {0, 0.3, 0}, .spin = {1, 0, 2}, .restitution = 0.5, .friction = 0.5});
  box.setCollisionFlags(box.getCollisionFlags() | btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
  int mark = 0;
  box.setUserPointer(&mark);
  box.setUserIndex(11);
  box.setUserIndex2(12);
  box.setUserIndex3(13);
  calls = {};
  gContactAddedCallback = countAdded;
  gContactProcessedCallback = countProcessed;
  gContactStartedCallback = countStarted;
  gContactEndedCallback = countEnded;
  std::unique_ptr<BulletBridge> bridge;
  if (bridged) bridge = std::make_unique<BulletBridge>(world.attach());
  world.step(1.0 / 240, 200);
  EXPECT_EQ(gContactAddedCallback, countAdded);
  EXPECT_EQ(gContactProcessedCallback, countProcessed);
  EXPECT_EQ(gContactStartedCallback, countStarted);
  EXPECT_EQ(gContactEndedCallback, countEnded);
  gContactAddedCallback = nullptr;
  gContactProcessedCallback = nullptr;
  gContactStartedCallback = nullptr;
  gContactEndedCallback = nullptr;
  EXPECT_EQ(box.getUserPointer(), &mark);
  EXPECT_EQ(box.getUserIndex(), 11);
  EXPECT_EQ(box.getUserIndex2(), 12);
  EXPECT_EQ(box.getUserIndex3(), 13);
  return calls;
}

TEST(Host, ContactCallbacksRunAsWithoutABridgeAndUserDataStays) {
  const auto without = callsWithBridge(false);
  EXPECT_THAT(without, testing::Each(testing::Gt(0)));
  EXPECT_EQ(callsWithBridge(true), without);
}

bool withoutBounce(btManifoldPoint& point, const btCollisionObjectWrapper*, int, int,
                   const btCollisionObjectWrapper*, int, int) {
  point.m_combinedRestitution = 0;
  return true;
}

TEST(Host, AContactCallbackMayTakeTheBounceAway) {
  AnyWorld world(0.0);
  world.addGround(world.box({1, 0.5, 1}), 0.0, -0.5);
  btRigidBody& ball =
      world.add(world.sphere(0.1), {.mass = 3.0, .position = {0, 0.2, 0}, .velocity = {0, -2, 0}});
  ball.setCollisionFlags(ball.getCollisionFlags() | btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
  gContactAddedCallback = withoutBounce;
  BulletBridge bridge = world.attach();
  world.step(1.0 / 1000, 100);
  gContactAddedCallback = nullptr;
  ASSERT_EQ(bridge.events().size(), 2u);
  EXPECT_NEAR(bridge.events()[0].impulse.norm(), 3.0 * 2.0, 1e-4);
}

TEST(Host, TheMotionIsThatOfAWorldWithoutABridge) {
  std::array<btTransform, 2> ends;
  for (const bool bridged : {false, true}) {
    AnyWorld world(9.81);
    world.addGround(world.box({1, 0.5, 1}), 0.5, -0.5);
    btCollisionShape& shape = world.box({0.1, 0.07, 0.05});
    for (int i = 0; i < 4; ++i) {
      world.add(shape, {.position = {0.02 * i, 0.2 + 0.2 * i, 0},
                        .spin = {1.0 * i, 2, 3},
                        .restitution = 0.5,
                        .friction = 0.5});
    }
    std::unique_ptr<BulletBridge> bridge;
    if (bridged) bridge = std::make_unique<BulletBridge>(world.attach());
    world.step(1.0 / 240, 300);
    ends[bridged ? 1 : 0] = world.bodies.back()->getWorldTransform();
  }
  EXPECT_EQ(ends[0].getOrigin(), ends[1].getOrigin());
  EXPECT_EQ(ends[0].getBasis(), ends[1].getBasis());
}

// --- bodies moved by the host ---

// A motion state by which the host moves a body for each frame.
struct Mover : btMotionState {
  void getWorldTransform(btTransform& to) const override { to = pose; }
  void setWorldTransform(const btTransform&) override {}
  btTransform pose = btTransform::getIdentity();
};

constexpr double kFrame = 1.0 / 60;  // s; four substeps

void playFrames(AnyWorld& world, Mover& mover, int frames,
                const std::function<btTransform(double)>& path) {
  for (int frame = 1; frame <= frames; ++frame) {
    mover.pose = path(frame * kFrame);
    world.world->stepSimulation(btScalar(kFrame), 8, btScalar(kFrame / 4));
  }
}

struct Push {
  double speed = 0.0;  // m/s
  double gap = 0.0;    // m
};

// In the frame's first substep Bullet moves the floor to its place at the end of the frame, and
// lets it collide there: the ball is gone when the steady path comes to where it was.
class MovingFloor : public testing::TestWithParam<std::string> {
 protected:
  static double heightOf(const std::string& kind) { return kind == "plane" ? 0.0 : 0.1; }
  static btCollisionShape& make(AnyWorld& world, const std::string& kind) {
    if (kind == "plane") return world.plane();
    return kind == "box" ? world.box({0.3, 0.1, 0.3}) : world.sphere(0.1);
  }

  static void checkPush(const Push& push) {
    SCOPED_TRACE("speed " + std::to_string(push.speed) + ", gap " + std::to_string(push.gap));
    AnyWorld world;
    Mover mover;
    const double from = -push.gap - heightOf(GetParam());
    const auto path = [&](double t) { return poseAt({0, from + push.speed * t, 0}); };
    mover.pose = path(0.0);
    world.add(make(world, GetParam()), {.mass = 0, .mover = &mover});
    const btRigidBody& ball =
        world.add(world.sphere(0.05), {.mass = 0.5, .position = {0, 0.05, 0}, .restitution = 0.6});
    BulletBridge bridge = world.attach();
    const double time = push.gap / push.speed;
    playFrames(world, mover, int(time / kFrame) + 3, path);
    bridge.flush();
    const auto events = eventsOf(bridge, ball);
    ASSERT_EQ(events.size(), 1u);
    EXPECT_NEAR(events[0].time, time, 20.0 * kTime);
    EXPECT_NEAR(events[0].approachSpeed, push.speed, 1e-4 * push.speed);
    EXPECT_NEAR(events[0].impulse.y(), 1.6 * 0.5 * push.speed, 1e-3 * push.speed);
  }
};

TEST_P(MovingFloor, HitsWhenItsSteadyPathTouches) {
  for (const double speed : {0.37, 1.3, 4.1}) {
    for (int phase = 0; phase < 16; ++phase)
      checkPush({speed, 0.2 + speed * kFrame * (phase + 0.3) / 16});
  }
}

INSTANTIATE_TEST_SUITE_P(Shapes, MovingFloor, testing::Values("plane", "box", "sphere"));

TEST(Kinematic, ATurningPaddleHitsWhenItsFaceReachesTheBall) {
  AnyWorld world;
  Mover mover;
  const double rate = 2.0;  // rad/s
  const auto path = [&](double t) {
    return poseAt(Vec3::Zero(), btQuaternion(btVector3(0, 0, 1), btScalar(rate * t)));
  };
  world.add(world.box({0.5, 0.05, 0.2}), {.mass = 0, .mover = &mover});
  const btRigidBody& ball =
      world.add(world.sphere(0.05), {.mass = 0.5, .position = {0.35, 0.25, 0}});
  BulletBridge bridge = world.attach();
  const double time = closingTime(
      [&](double t) { return 0.25 * std::cos(rate * t) - 0.35 * std::sin(rate * t) - 0.1; }, 0.0,
      0.4);
  playFrames(world, mover, int(time / kFrame) + 3, path);
  bridge.flush();
  const auto events = eventsOf(bridge, ball);
  ASSERT_EQ(events.size(), 1u);
  EXPECT_NEAR(events[0].time, time, 20.0 * kTime);
  const double arm = 0.35 * std::cos(rate * time) + 0.25 * std::sin(rate * time);
  EXPECT_NEAR(events[0].approachSpeed, rate * arm, 1e-3);
  EXPECT_NEAR(events[0].impulse.norm(), 2.0 * 0.5 * rate * arm, 1e-3);
}

TEST(Kinematic, OneThatIsPutElsewhereMakesNoEventOnTheWay) {
  AnyWorld world;
  Mover mover;
  btRigidBody& paddle = world.add(world.sphere(0.1), {.mass = 0, .mover = &mover});
  world.add(world.sphere(0.05), {.position = {1, 0, 0}});
  BulletBridge bridge = world.attach();
  world.step(1.0 / 60, 3);
  // The host also sets the interpolation transform, to tell Bullet that this jump has no velocity.
  mover.pose = poseAt({2, 0, 0});
  paddle.setWorldTransform(mover.pose);
  paddle.setInterpolationWorldTransform(mover.pose);
  world.step(1.0 / 60, 6);
  EXPECT_TRUE(bridge.events().empty());
  EXPECT_TRUE(bridge.contacts().empty());
}

// --- continuous detection ---

struct CcdCase {
  double speed, dt, restitution;
};

class Ccd : public testing::TestWithParam<CcdCase> {};

// Bullet stops the ball at the wall and acts on it there over two substeps, without restitution in
// the first one.
TEST_P(Ccd, AFastBallHitsAWallOnceAtTheExactTime) {
  const auto [speed, dt, restitution] = GetParam();
  for (int phase = 0; phase < 8; ++phase) {
    AnyWorld world;
    const double distance = 2.0 + 0.13 * speed * dt * phase;
    btRigidBody& ball = world.add(world.sphere(0.05), {.mass = 0.3,
                                                       .position = {-distance - 0.1, 0, 0},
                                                       .velocity = {speed, 0, 0},
                                                       .restitution = restitution});
    world.add(world.box({0.05, 1, 1}), {.mass = 0});
    ball.setCcdMotionThreshold(btScalar(0.02));
    ball.setCcdSweptSphereRadius(btScalar(0.04));
    BulletBridge bridge = world.attach();
    world.stepUntil(bridge, distance / speed + 6.0 * dt, dt);
    bridge.flush();
    ASSERT_LT(ball.getWorldTransform().getOrigin().x(), 0) << "tunnelled: choose another case";
    const auto events = eventsOf(bridge, ball);
    ASSERT_EQ(events.size(), 1u) << "phase " << phase;
    EXPECT_NEAR(events[0].time, distance / speed, 3.0 * kTime) << "phase " << phase;
    EXPECT_NEAR(events[0].impulse.x(), -(1.0 + restitution) * 0.3 * speed, 1e-4 * speed);
    Vec3 applied = events[0].appliedImpulse;
    for (const ContactState& contact : bridge.contacts())
      applied += contact.appliedImpulse;
    const Vec3 change = 0.3 * (vec(ball.getLinearVelocity()) - Vec3(speed, 0, 0));
    EXPECT_NEAR((applied - change).norm(), 0.0, 1e-5 * change.norm()) << "phase " << phase;
  }
}

INSTANTIATE_TEST_SUITE_P(Speeds, Ccd,
                         testing::Values(CcdCase{60, 1.0 / 60, 0.5}, CcdCase{60, 1.0 / 60, 1.0},
                                         CcdCase{200, 1.0 / 240, 0.8}, CcdCase{20, 1.0 / 60, 0.0}));

}  // namespace
}  // namespace carom
