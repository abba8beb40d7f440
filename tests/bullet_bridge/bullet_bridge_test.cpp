#include "carom/bullet/bullet_bridge.h"

#include <cmath>
#include <random>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "carom/bullet/world_advice.h"
#include "tests/bullet_bridge/sphere_world.h"
#include "tests/support/no_alloc_scope.h"

namespace carom {
namespace {

using Ball = SphereBulletWorld::Ball;

BulletBridge attached(SphereBulletWorld& world) {
  Result<BulletBridge> bridge = BulletBridge::attach(world.world);
  EXPECT_TRUE(bridge);
  return *std::move(bridge);
}

std::vector<ImpulseEvent> eventsOf(const BulletBridge& bridge, BodyId body) {
  std::vector<ImpulseEvent> events;
  for (const ImpulseEvent& event : bridge.events()) {
    if (event.body == body) events.push_back(event);
  }
  return events;
}

// The first collision of a ball that falls freely onto the plane y = 0 on Bullet's own path, found
// by stepping symplectic Euler by hand and then bisecting the parabola through the nodes.
struct Drop {
  double time = 0.0;
  double speed = 0.0;
};

Drop dropByHand(double height, double velocity, double gravity, double dt) {
  double y = height;
  double v = velocity;
  for (double start = 0.0;; start += dt) {
    const double next = v - gravity * dt;
    const auto path = [&](double s) { return y + next * s + gravity * s * (dt - s) / 2.0; };
    if (path(dt) <= 0.0) {
      double low = 0.0;
      double high = dt;
      for (int i = 0; i < 200; ++i) {
        const double middle = 0.5 * (low + high);
        (path(middle) > 0.0 ? low : high) = middle;
      }
      return {start + low, -(next + gravity * (dt / 2.0 - low))};
    }
    y = path(dt);
    v = next;
  }
}

struct DropCase {
  double radius, restitution, height, dt;
};

class BallOnPlane : public testing::TestWithParam<DropCase> {};

// The project's bars are 1 us and 0.1 %. Bullet in float holds a position of 0.5 m to 3e-8 m and
// accumulates that error over the steps, so that the bound here is due to float and not to the
// method.
TEST_P(BallOnPlane, IsReportedOnceAtItsExactTimeAtEverySubStepPhase) {
  const DropCase drop = GetParam();
  for (int phase = 0; phase < 32; ++phase) {
    SphereBulletWorld world(9.81);
    const double dt = double(btScalar(drop.dt));
    const double gap = drop.height + 9.81 * dt * drop.dt * phase;
    world.addPlane(Vec3::UnitY(), 0.0, 1.0);
    world.addBall({.radius = drop.radius,
                   .mass = 0.3,
                   .position = {0.1, drop.radius + gap, 0.0},
                   .restitution = drop.restitution});
    BulletBridge bridge = attached(world);
    const Drop exact = dropByHand(gap, 0.0, 9.81, dt);
    while (bridge.time() < exact.time + 3.0 * dt)
      world.step(drop.dt);
    bridge.flush();  // Bullet may still be braking the ball above the plane

    const auto events = eventsOf(bridge, 1);
    ASSERT_EQ(events.size(), 1u) << "phase " << phase;
    EXPECT_NEAR(events[0].time, exact.time, 1e-6 * (sizeof(btScalar) == 8 ? 1e-3 : 30.0));
    EXPECT_NEAR(events[0].approachSpeed, exact.speed, 1e-3 * exact.speed);
    EXPECT_NEAR(events[0].impulse.y(), (1.0 + drop.restitution) * 0.3 * exact.speed,
                1e-3 * events[0].impulse.y());
    EXPECT_NEAR(events[0].position.y(), 0.0, 1e-5);
    EXPECT_EQ(events[0].normal, Vec3::UnitY());
  }
}

INSTANTIATE_TEST_SUITE_P(
    SizesAndSteps, BallOnPlane,
    testing::Values(DropCase{0.05, 0.9, 0.5, 1.0 / 60}, DropCase{0.05, 0.9, 0.5, 1.0 / 240},
                    DropCase{0.05, 0.5, 0.5, 1.0 / 1000}, DropCase{0.005, 0.9, 0.1, 1.0 / 60},
                    DropCase{0.005, 0.9, 0.1, 1.0 / 240}, DropCase{0.5, 0.9, 1.0, 1.0 / 240},
                    DropCase{0.5, 0.9, 1.0, 1.0 / 1000}));

// Without gravity the exact collision follows from the starting state alone, whatever Bullet does.
TEST(BulletBridge, ObliquePairsCollideAtTheClosedFormTimeWithTheClosedFormImpulse) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (const double dt : {1.0 / 60, 1.0 / 240, 1.0 / 1000}) {
    for (int trial = 0; trial < 40; ++trial) {
      const double miss = 0.06 * uniform(random);  // m; below 0.1 m the balls touch
      const double distance = 0.3 + 0.1 * uniform(random);
      const double along = std::sqrt(0.1 * 0.1 - miss * miss);
      const double time = (distance - along) / 3.0;

      SphereBulletWorld world;
      world.addBall({.mass = 0.2, .position = {-distance, miss, 0}, .velocity = {3, 0, 0}});
      world.addBall({.mass = 0.5, .restitution = 0.8});
      BulletBridge bridge = attached(world);
      while (bridge.time() < time + 3.0 * dt)
        world.step(dt);

      ASSERT_EQ(bridge.events().size(), 2u) << "step " << dt << ", trial " << trial;
      const ImpulseEvent event = eventsOf(bridge, 0).front();
      const double approach = 3.0 * along / 0.1;
      // Drift of Bullet's own path: float positions are off by some 1e-8 m a step.
      const double drift = sizeof(btScalar) == 8 ? 1e-12 : 5e-8 * (time / dt + 1.0);
      EXPECT_NEAR(event.time, time, 1e-6 + drift);
      EXPECT_NEAR(event.approachSpeed, approach, 1e-4 * approach);
      EXPECT_NEAR(event.impulse.norm(), 1.8 * (0.2 * 0.5 / 0.7) * approach, 2e-4 * approach);
      EXPECT_NEAR(event.effectiveMass, 0.2 * 0.5 / 0.7, 1e-6);
      EXPECT_NEAR(event.normal.x(), -along / 0.1, 1e-4);
      EXPECT_NEAR(event.normal.y(), miss / 0.1, 1e-4);
    }
  }
}

TEST(BulletBridge, TheTwoSharesAreEqualAndOpposite) {
  SphereBulletWorld world;
  world.addBall({.radius = 0.03, .position = {-0.2, 0.02, 0}, .velocity = {2, 0, 0}});
  world.addBall({.radius = 0.05});
  BulletBridge bridge = attached(world);
  world.step(1.0 / 240, 60);
  ASSERT_EQ(bridge.events().size(), 2u);
  const ImpulseEvent& a = bridge.events()[0];
  const ImpulseEvent& b = bridge.events()[1];
  EXPECT_EQ(a.time, b.time);
  EXPECT_EQ(a.body, b.other);
  EXPECT_EQ(a.other, b.body);
  EXPECT_EQ(a.impulse, -b.impulse);
  EXPECT_EQ(a.normal, -b.normal);
  EXPECT_EQ(a.radius, b.otherRadius);
  EXPECT_EQ(a.position, b.position);
  EXPECT_NEAR((a.bodyPosition - b.bodyPosition).norm(), 0.08, 1e-7);
}

// Bullet loses the bounce of a large ball at fine steps altogether; the event is reported and
// right.
TEST(BulletBridge, AnImpactThatBulletDoesNotBounceIsStillReportedOnce) {
  SphereBulletWorld world(9.81);
  world.addPlane(Vec3::UnitY(), 0.0, 1.0);
  const btRigidBody& ball =
      world.addBall({.radius = 0.5, .position = {0, 1.5, 0}, .restitution = 0.9});
  BulletBridge bridge = attached(world);
  world.step(1.0 / 1000, 1000);
  ASSERT_LT(std::abs(ball.getLinearVelocity().y()), 0.1f) << "Bullet bounced: choose another case";
  const auto events = eventsOf(bridge, 1);
  ASSERT_EQ(events.size(), 1u);
  const Drop exact = dropByHand(1.0, 0.0, 9.81, double(btScalar(1.0 / 1000)));
  EXPECT_NEAR(events[0].time, exact.time, 3e-5);
  EXPECT_NEAR(events[0].impulse.norm(), 1.9 * exact.speed, 1e-3 * 1.9 * exact.speed);
  EXPECT_EQ(bridge.counters().lostRebound, 1u);
  EXPECT_EQ(bridge.counters().speculative, 1u);
}

TEST(BulletBridge, CountsWhatBulletNeverSaw) {
  SphereBulletWorld world;
  world.addBall({.radius = 0.005, .position = {0.0, 0.5, 0.0}, .velocity = {0.0, -60.0, 0.0}});
  world.addBall({.radius = 0.005});
  BulletBridge bridge = attached(world);
  world.step(1.0 / 60, 4);  // a metre a step: no overlap at any node
  EXPECT_EQ(eventsOf(bridge, 0).size(), 1u);
  EXPECT_EQ(bridge.counters().unsolved, 1u);
  EXPECT_EQ(bridge.counters().lostRebound, 0u);
}

TEST(BulletBridge, CountsImpactsThatAreTooSlowForBulletToBounce) {
  SphereBulletWorld world;
  world.addBall({.position = {-0.11, 0, 0}, .velocity = {0.15, 0, 0}});
  world.addBall({});
  BulletBridge bridge = attached(world);
  world.step(1.0 / 240, 60);
  const auto events = eventsOf(bridge, 0);
  ASSERT_EQ(events.size(), 1u);
  EXPECT_NEAR(events[0].impulse.norm(), 0.5 * 0.15, 1e-6) << "without restitution";
  EXPECT_EQ(bridge.counters().belowThreshold, 1u);
}

// The balls bounce for ever in a closed box. The world is tuned, because by default Bullet makes
// them faster and faster and their impacts more frequent. Bullet itself allocates by malloc, which
// the scope does not see.
TEST(BulletBridge, AllocatesNothingPerStepOnceItIsWarm) {
  SphereBulletWorld world;
  for (int axis = 0; axis < 3; ++axis) {
    world.addPlane(Vec3::Unit(axis), -0.5, 1.0);
    world.addPlane(-Vec3::Unit(axis), -0.5, 1.0);
  }
  std::mt19937 random(9);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (int i = 0; i < 125; ++i) {
    const int row = i / 5 % 5;
    const int layer = i / 25;
    const Vec3 cell(i % 5 - 2, row - 2, layer - 2);
    world.addBall({.position = 0.18 * cell,
                   .velocity = 3.0 * Vec3(uniform(random), uniform(random), uniform(random))});
  }
  ASSERT_TRUE(tune(world.world, 1.0 / 240));
  BulletBridge bridge = attached(world);
  const auto step = [&] {
    world.step(1.0 / 240);
    bridge.clear();
  };
  for (int i = 0; i < 4000; ++i)
    step();
  const std::uint64_t before = bridge.counters().collisions;
  const test::NoAllocScope scope;
  for (int i = 0; i < 250; ++i)
    step();
  EXPECT_EQ(scope.allocations(), 0u);
  EXPECT_GT(bridge.counters().collisions, before + 250);
}

TEST(BulletBridge, RestIsSilent) {
  for (const double dt : {1.0 / 60, 1.0 / 240, 1.0 / 1000}) {
    SphereBulletWorld floor(9.81);
    floor.addPlane(Vec3::UnitY(), 0.0, 0.8);
    floor.addBall({.position = {0, 0.05, 0}});
    floor.addBall({.radius = 0.005, .position = {0.3, 0.005, 0}});
    SphereBulletWorld groove(9.81);  // two contacts at once
    groove.addPlane(Vec3(1, 1, 0).normalized(), 0.0, 0.8);
    groove.addPlane(Vec3(-1, 1, 0).normalized(), 0.0, 0.8);
    groove.addBall({.position = {0, 0.05 * std::sqrt(2.0), 0}});
    for (SphereBulletWorld* world : {&floor, &groove}) {
      BulletBridge bridge = attached(*world);
      world->step(dt, static_cast<int>(10.0 / dt));
      EXPECT_TRUE(bridge.events().empty()) << "step " << dt;
      EXPECT_EQ(bridge.counters().substeps, static_cast<std::uint64_t>(10.0 / dt));
    }
  }
}

TEST(BulletBridge, ABallThatTheHostPushesDownFromRestIsHeardAtTheNode) {
  SphereBulletWorld world(9.81);
  world.addPlane(Vec3::UnitY(), 0.0, 1.0);
  btRigidBody& ball = world.addBall({.position = {0, 0.05, 0}, .restitution = 0.5});
  BulletBridge bridge = attached(world);
  world.step(1.0 / 240, 24);
  ASSERT_TRUE(bridge.events().empty());
  const double pushed = bridge.time();
  ball.setLinearVelocity(btVector3(0, -2, 0));
  world.step(1.0 / 240, 3);
  const auto events = eventsOf(bridge, 1);
  ASSERT_EQ(events.size(), 1u);
  EXPECT_NEAR(events[0].time, pushed, 2e-5);  // it rests with a gap or overlap of some um
  EXPECT_NEAR(events[0].approachSpeed, 2.0, 0.03);
}

// The spheres overlap for less than a step and part again between two nodes, so that Bullet never
// sees their contact.
TEST(BulletBridge, AGrazingHitBetweenTwoNodesIsReported) {
  const double dt = 1.0 / 60;
  SphereBulletWorld world;
  const double miss = 0.0995;  // m, below 0.1 m they touch: the chord is 0.4 steps long
  world.addBall({.position = {-0.315, miss, 0}, .velocity = {3, 0, 0}});
  world.addBall({});
  BulletBridge bridge = attached(world);
  world.step(dt, 12);
  ASSERT_EQ(bridge.events().size(), 2u);
  const double along = std::sqrt(0.1 * 0.1 - miss * miss);
  EXPECT_NEAR(bridge.events()[0].time, (0.315 - along) / 3.0, 2e-5);  // grazing multiplies rounding
  EXPECT_NEAR(bridge.events()[0].approachSpeed, 3.0 * along / 0.1, 1e-3);
}

// 5 mm balls at 30 m/s move 50 diameters a step: Bullet lets them through.
TEST(BulletBridge, BallsThatTunnelAreReportedAsTheyWouldHaveHit) {
  SphereBulletWorld world;
  world.addBall({.radius = 0.005, .position = {-0.76, 0, 0}, .velocity = {30, 0, 0}});
  const btRigidBody& other = world.addBall({.radius = 0.005});
  BulletBridge bridge = attached(world);
  world.step(1.0 / 60, 4);
  ASSERT_EQ(other.getLinearVelocity().x(), 0) << "Bullet did not tunnel: choose another case";
  ASSERT_EQ(bridge.events().size(), 2u);
  EXPECT_NEAR(bridge.events()[0].time, 0.75 / 30.0, 1e-6);
}

TEST(BulletBridge, PairsThatBulletDoesNotLetCollideAreSilent) {
  for (const bool byMask : {true, false}) {
    SphereBulletWorld world;
    btRigidBody& ball = world.addBall({.position = {-0.3, 0, 0}, .velocity = {3, 0, 0}});
    btRigidBody& other = world.addBall({});
    if (byMask) {
      world.world.removeRigidBody(&other);
      world.world.addRigidBody(&other, 2, 2);
    } else {
      ball.setIgnoreCollisionCheck(&other, true);
    }
    BulletBridge bridge = attached(world);
    world.step(1.0 / 240, 60);
    EXPECT_TRUE(bridge.events().empty()) << byMask;
  }
}

// A plain sum of steps of 0.1 s in double precision would be off by 0.5 us.
TEST(BulletBridge, TheClockOfADayIsTheSumOfItsStepsWithinANanosecond) {
  SphereBulletWorld world;
  const BulletBridge bridge = attached(world);
  constexpr int kSteps = 864'000;
  world.step(0.1, kSteps);
  const double step = btScalar(0.1);
  EXPECT_NEAR(bridge.time(), kSteps * step, 1e-9);
}

TEST(BulletBridge, SubstepsOfOneCallEachHaveTheirOwnTime) {
  SphereBulletWorld world;
  world.addPlane(Vec3::UnitY(), 0.0, 1.0);
  world.addBall({.position = {0, 0.35, 0}, .velocity = {0, -3, 0}});
  BulletBridge bridge = attached(world);
  world.world.stepSimulation(btScalar(0.2), 100, btScalar(1.0 / 500));
  ASSERT_EQ(bridge.events().size(), 2u);
  EXPECT_NEAR(bridge.events()[0].time, 0.1, 3e-6);
}

TEST(BulletBridge, IdsFollowTheWorldsOrderAndSurviveRemovalOfOthers) {
  SphereBulletWorld world;
  btRigidBody& first = world.addBall({.position = {-9, 0, 0}});
  btRigidBody& left = world.addBall({.position = {-0.3, 0, 0}, .velocity = {3, 0, 0}});
  btRigidBody& right = world.addBall({});
  BulletBridge bridge = attached(world);
  EXPECT_EQ(*bridge.bodyId(first), 0u);
  EXPECT_EQ(*bridge.bodyId(right), 2u);
  world.step(1.0 / 240, 2);
  world.remove(first);  // reorders Bullet's array
  btRigidBody& late = world.addBall({.position = {9, 0, 0}});
  world.step(1.0 / 240, 40);
  EXPECT_EQ(*bridge.bodyId(left), 1u);
  EXPECT_EQ(*bridge.bodyId(right), 2u);
  EXPECT_EQ(*bridge.bodyId(late), 3u);
  ASSERT_EQ(bridge.events().size(), 2u);
  EXPECT_EQ(std::minmax(bridge.events()[0].body, bridge.events()[1].body),
            (std::pair<const BodyId&, const BodyId&>(1u, 2u)));
  EXPECT_NEAR(bridge.events()[0].time, 0.2 / 3.0, 2e-6);
}

int hostTicks = 0;

TEST(BulletBridge, TheHostsTickCallbackAndUserInfoKeepWorkingAndAreRestored) {
  SphereBulletWorld world;
  world.addBall({});
  int info = 5;
  hostTicks = 0;
  const auto hostTick = [](btDynamicsWorld* ticked, btScalar) {
    hostTicks += *static_cast<int*>(ticked->getWorldUserInfo());
  };
  world.world.setInternalTickCallback(hostTick, &info, true);
  {
    const BulletBridge bridge = attached(world);
    world.step(1.0 / 240, 3);
    EXPECT_EQ(hostTicks, 15);
  }
  world.step(1.0 / 240, 2);
  EXPECT_EQ(hostTicks, 25);
}

TEST(BulletBridge, ACallbackThatTheHostSetsLaterRunsAndTheBridgeComesBack) {
  SphereBulletWorld world;
  world.addBall({.position = {-0.5, 0, 0}, .velocity = {3, 0, 0}});
  world.addBall({});
  BulletBridge bridge = attached(world);
  world.step(1.0 / 240, 5);
  hostTicks = 0;
  world.world.setInternalTickCallback([](btDynamicsWorld*, btScalar) { ++hostTicks; }, nullptr,
                                      true);
  world.step(1.0 / 240, 50);
  EXPECT_EQ(hostTicks, 50);
  EXPECT_EQ(bridge.counters().substepsWithoutStart, 1u);
  EXPECT_EQ(bridge.events().size(), 2u);
}

TEST(BulletBridge, WorldsAreIndependentAndEachTakesOneBridge) {
  SphereBulletWorld one;
  SphereBulletWorld two;
  one.addBall({.position = {-0.3, 0, 0}, .velocity = {3, 0, 0}});
  one.addBall({});
  two.addBall({});
  BulletBridge bridgeOne = attached(one);
  BulletBridge bridgeTwo = attached(two);
  const Result<BulletBridge> again = BulletBridge::attach(one.world);
  ASSERT_FALSE(again);
  EXPECT_THAT(again.error().message, testing::HasSubstr("has a bridge already"));
  one.step(1.0 / 240, 40);
  two.step(1.0 / 240, 20);
  EXPECT_EQ(bridgeOne.events().size(), 2u);
  EXPECT_TRUE(bridgeTwo.events().empty());
  EXPECT_EQ(bridgeTwo.counters().substeps, 20u);
}

TEST(BulletBridge, RefusesARestSpeedThatIsNone) {
  SphereBulletWorld world;
  for (const double bad : {-1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    const Result<BulletBridge> bridge = BulletBridge::attach(world.world, {.restSpeed = bad});
    ASSERT_FALSE(bridge);
    EXPECT_THAT(bridge.error().message, testing::HasSubstr("expected a finite number of m/s"));
  }
}

TEST(BulletBridge, ABallThatDropsOnABoxIsReportedOnceAtItsExactTime) {
  SphereBulletWorld world;
  world.shapes.push_back(std::make_unique<btBoxShape>(btVector3(1, btScalar(0.1), 1)));
  btRigidBody box(0, nullptr, world.shapes.back().get());
  box.setRestitution(1);
  world.world.addRigidBody(&box);
  const btRigidBody& ball = world.addBall({.position = {0, 0.3, 0}, .velocity = {0, -3, 0}});
  BulletBridge bridge = attached(world);
  world.step(1.0 / 240, 30);
  const auto events = eventsOf(bridge, *bridge.bodyId(ball));
  ASSERT_EQ(events.size(), 1u);
  EXPECT_NEAR(events[0].time, 0.05, 1e-6);
  EXPECT_NEAR(events[0].impulse.y(), 6.0, 1e-5);
  EXPECT_EQ(events[0].radius, double(btScalar(0.05)));
  EXPECT_EQ(events[0].otherRadius, std::numeric_limits<double>::infinity());
  EXPECT_EQ(bridge.counters().unsupported, 0u);
  world.world.removeRigidBody(&box);
}

TEST(BulletBridge, ATeleportedBallMakesNoEventOnTheWayAndTheRightOneAfter) {
  SphereBulletWorld world;
  world.addPlane(Vec3::UnitY(), 0.0, 1.0);
  btRigidBody& ball = world.addBall({.position = {0, 5, 0}, .velocity = {0, -3, 0}});
  BulletBridge bridge = attached(world);
  world.step(1.0 / 240, 24);
  btTransform pose = btTransform::getIdentity();
  pose.setOrigin(btVector3(1, btScalar(0.2), 0));
  ball.setCenterOfMassTransform(pose);
  const double teleported = bridge.time();
  world.step(1.0 / 240, 24);
  const auto events = eventsOf(bridge, 1);
  ASSERT_EQ(events.size(), 1u);
  EXPECT_NEAR(events[0].time, teleported + 0.05, 2e-6);
  EXPECT_NEAR(events[0].position.x(), 1.0, 1e-6);
}

}  // namespace
}  // namespace carom
