#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "carom/bullet/bullet_bridge.h"
#include "tests/bullet_bridge/any_world.h"

namespace carom {
namespace {

using Body = AnyWorld::Body;
using testing::AnyOf;
using testing::Each;
using testing::Field;
using testing::SizeIs;
using testing::Truly;

constexpr double kGravity = 9.81;
constexpr double kTime = kDoubleBullet ? 1e-9 : 1e-6;  // s, see worlds_test.cpp

std::vector<ContactState> contactsOf(const BulletBridge& bridge, const btCollisionObject& object) {
  std::vector<ContactState> contacts;
  for (const ContactState& contact : bridge.contacts()) {
    const BodyId id = *bridge.bodyId(object);
    if (contact.body == id || contact.other == id) contacts.push_back(contact);
  }
  return contacts;
}

double meanLoad(const std::vector<ContactState>& contacts, double from, double to) {
  double impulse = 0.0;
  for (const ContactState& contact : contacts) {
    const double middle = contact.time + 0.5 * contact.duration;
    if (middle >= from && middle < to) impulse += contact.normalLoad * contact.duration;
  }
  return impulse / (to - from);
}

/// Expects for each pair the phases begin, during ..., end, begin ..., without a gap in time.
void expectWholeLives(std::span<const ContactState> contacts) {
  std::map<std::pair<BodyId, BodyId>, const ContactState*> alive;
  for (const ContactState& contact : contacts) {
    const ContactState*& before = alive[std::minmax(contact.body, contact.other)];
    EXPECT_EQ(contact.phase == ContactPhase::begin, before == nullptr) << contact.time;
    if (before != nullptr) {
      EXPECT_NEAR(contact.time, before->time + before->duration, 1e-9);
    }
    before = contact.phase == ContactPhase::end ? nullptr : &contact;
  }
}

// --- what lies still ---

/// Thirty boxes that fall onto each other, awake.
class Boxes {
 public:
  /// Columns of boxes, whose centres lie up to `scatter` (m) off their column's.
  Boxes(int columns, double scatter, double stillSpeed)
      : world_(kGravity), bridge_(world_.attach({.stillSpeed = stillSpeed})) {
    world_.addGround(world_.box({5, 0.5, 5}), 0.5, -0.5);
    std::mt19937 random(4);
    std::uniform_real_distribution<double> offset(-scatter, scatter);
    for (int i = 0; i < 30; ++i) {
      const double height = 0.2 + 0.23 * (i / columns);
      btRigidBody& box =
          world_.add(world_.box({0.1, 0.1, 0.1}),
                     {.position = {offset(random) + 0.25 * (i % columns), height, offset(random)},
                      .restitution = 0.3,
                      .friction = 0.5});
      box.setActivationState(DISABLE_DEACTIVATION);
    }
  }
  void run(double time) { world_.stepUntil(bridge_, time, 1.0 / 120.0); }
  BulletBridge& bridge() { return bridge_; }

 private:
  AnyWorld world_;
  BulletBridge bridge_;
};

TEST(StillSpeed, ChangesNoCollision) {
  Boxes all(3, 0.05, 0.0);
  Boxes moving(3, 0.05, 1e-3);
  all.run(3.0);
  moving.run(3.0);
  const auto expected = all.bridge().events();
  const auto events = moving.bridge().events();
  ASSERT_GT(expected.size(), 50u);
  ASSERT_EQ(events.size(), expected.size());
  for (std::size_t i = 0; i < events.size(); ++i) {
    EXPECT_EQ(events[i].body, expected[i].body);
    EXPECT_NEAR(events[i].time, expected[i].time, kTime);
    EXPECT_NEAR((events[i].impulse - expected[i].impulse).norm(), 0.0,
                1e-6 * expected[i].impulse.norm());
  }
}

/// The contact states of one pair, summed up.
struct Course {
  int states = 0;
  double fastest = 0.0;  // m/s, by which the surfaces slide, or the contact moves over either
  double leastLoad = std::numeric_limits<double>::infinity();
  double greatestLoad = 0.0;
};

using Courses = std::map<std::pair<BodyId, BodyId>, Course>;

Courses coursesOf(std::span<const ContactState> states) {
  Courses courses;
  for (const ContactState& state : states) {
    Course& course = courses[{state.body, state.other}];
    ++course.states;
    course.fastest =
        std::max({course.fastest, state.slipVelocity.norm(),
                  (state.pathEnd - state.pathStart).norm() / state.duration,
                  (state.otherPathEnd - state.otherPathStart).norm() / state.duration});
    course.leastLoad = std::min(course.leastLoad, state.normalLoad);
    course.greatestLoad = std::max(course.greatestLoad, state.normalLoad);
  }
  return courses;
}

TEST(StillSpeed, OfWhatLiesStillNothingIsTold) {
  Boxes all(30, 0.0, 0.0);  // stacked boxes rock for ever in Bullet, these hardly
  Boxes moving(30, 0.0, 1e-3);
  for (Boxes* boxes : {&all, &moving}) {
    boxes->run(3.0);
    boxes->bridge().clear();
    boxes->run(4.0);
  }
  Courses told = coursesOf(moving.bridge().contacts());
  int still = 0;
  for (const auto& [pair, course] : coursesOf(all.bridge().contacts())) {
    if (course.fastest > 5e-4 || course.greatestLoad > 1.2 * course.leastLoad) continue;
    ++still;
    EXPECT_GE(course.states, 119);
    EXPECT_EQ(told[pair].states, 0) << pair.first << " on " << pair.second;
  }
  EXPECT_GE(still, 20);
  EXPECT_LT(moving.bridge().counters().searched, all.bridge().counters().searched);
}

// --- one impact, one event ---

struct Landing {
  double dt = 0.0;
  double restitution = 0.0;
};

void PrintTo(const Landing& landing, std::ostream* out) {
  *out << "step " << landing.dt << ", e " << landing.restitution;
}

class Lands : public testing::TestWithParam<Landing> {
 protected:
  // Expects one impact of a body that falls from rest by `fall` m onto the ground and lands all at
  // once, below its centre of mass.
  void expectOneImpact(AnyWorld& world, const btRigidBody& body, double fall = 0.4) const {
    BulletBridge bridge = world.attach();
    const Fall exact = fallByHand(fall, kGravity, GetParam().dt);
    world.stepUntil(bridge, exact.time + 0.05, GetParam().dt);
    bridge.flush();
    const auto events = eventsOf(bridge, body);
    ASSERT_EQ(events.size(), 1u);
    EXPECT_EQ(bridge.events().size(), 2u);
    EXPECT_NEAR(events[0].time, exact.time, 30.0 * kTime);
    const double mass = 1.0 / double(body.getInvMass());
    const double impulse = (1.0 + GetParam().restitution) * mass * exact.speed;
    EXPECT_NEAR(events[0].impulse.y(), impulse, 1e-3 * impulse);
    EXPECT_NEAR(events[0].effectiveMass, mass, 1e-3 * mass);
    EXPECT_NEAR(events[0].position.x(), 0.3, 1e-3);
    EXPECT_NEAR(events[0].position.y(), 0.0, 1e-3);
    EXPECT_NEAR(events[0].position.z(), 0.2, 1e-3);
  }
  Body falling(double height) const {
    return {.mass = 2, .position = {0.3, height, 0.2}, .restitution = GetParam().restitution};
  }
};

TEST_P(Lands, ABoxOnABox) {
  AnyWorld world(kGravity);
  world.addGround(world.box({1, 0.5, 1}), 0.0, -0.5);
  expectOneImpact(world, world.add(world.box({0.1, 0.05, 0.15}), falling(0.45)));
}

// Bullet holds a box on a plane by one of its corners, so that it turns over that corner and lands
// on the others later; these later impacts belong to Bullet's own motion. The first one is all at
// once.
TEST_P(Lands, ABoxOnAPlane) {
  AnyWorld world(kGravity);
  world.addGround(world.plane());
  btRigidBody& box = world.add(world.box({0.1, 0.05, 0.15}), falling(0.45));
  BulletBridge bridge = world.attach();
  const Fall exact = fallByHand(0.4, kGravity, GetParam().dt);
  while (bridge.counters().collisions == 0 && bridge.time() < 1.0)
    world.step(GetParam().dt);
  bridge.flush();
  const auto events = eventsOf(bridge, box);
  ASSERT_EQ(events.size(), 1u);
  EXPECT_NEAR(events[0].time, exact.time, 30.0 * kTime);
  const double impulse = (1.0 + GetParam().restitution) * 2.0 * exact.speed;
  EXPECT_NEAR(events[0].impulse.y(), impulse, 1e-3 * impulse);
  EXPECT_NEAR((events[0].position - Vec3(0.3, 0, 0.2)).norm(), 0.0, 1e-3);
}

TEST_P(Lands, ABoxThatDoesNotTurnOnAPlane) {
  AnyWorld world(kGravity);
  world.addGround(world.plane());
  btRigidBody& box = world.add(world.box({0.1, 0.05, 0.15}), falling(0.45));
  box.setAngularFactor(0);
  expectOneImpact(world, box);
}

TEST_P(Lands, ACompoundOfTwoSpheresOnBoth) {
  AnyWorld world(kGravity);
  world.addGround(world.box({1, 0.5, 1}), 0.0, -0.5);
  auto& pair = world.shape<btCompoundShape>();
  for (const double side : {-0.1, 0.1})
    pair.addChildShape(poseAt({side, 0, 0}), &world.sphere(0.05));
  expectOneImpact(world, world.add(pair, falling(0.45)));
}

TEST_P(Lands, ACompoundOfTwoBoxesOnBoth) {
  AnyWorld world(kGravity);
  world.addGround(world.box({1, 0.5, 1}), 0.0, -0.5);
  auto& table = world.shape<btCompoundShape>();
  for (const double side : {-0.1, 0.1})
    table.addChildShape(poseAt({side, 0, 0}), &world.box({0.02, 0.05, 0.1}));
  expectOneImpact(world, world.add(table, falling(0.45)));
}

INSTANTIATE_TEST_SUITE_P(Steps, Lands,
                         testing::Values(Landing{1.0 / 60, 0.5}, Landing{1.0 / 240, 0.5},
                                         Landing{1.0 / 1000, 0.5}, Landing{1.0 / 60, 0.0},
                                         Landing{1.0 / 240, 0.0}, Landing{1.0 / 1000, 0.0}));

TEST(Impacts, ABoxThatIsHardlyTiltedIsStillOneEvent) {
  for (const double dt : {1.0 / 60, 1.0 / 240}) {
    AnyWorld world(kGravity);
    world.addGround(world.box({1, 0.5, 1}), 0.0, -0.5);
    const double tilt = 2e-4;
    const double corner = 0.1 * std::cos(tilt) + 0.1 * std::sin(tilt);
    const btRigidBody& box = world.add(world.box({0.1, 0.1, 0.1}),
                                       {.mass = 2,
                                        .position = {0, 0.4 + corner, 0},
                                        .restitution = 0.3,
                                        .turn = btQuaternion(btVector3(0, 0, 1), btScalar(tilt))});
    BulletBridge bridge = world.attach();
    const Fall exact = fallByHand(0.4, kGravity, dt);
    world.stepUntil(bridge, exact.time + 0.05, dt);
    bridge.flush();
    const auto events = eventsOf(bridge, box);
    ASSERT_EQ(events.size(), 1u) << "step " << dt;
    EXPECT_NEAR(events[0].time, exact.time, 30.0 * kTime);
    EXPECT_NEAR(events[0].impulse.y(), 1.3 * 2.0 * exact.speed, 0.01 * 2.6 * exact.speed);
  }
}

TEST(Impacts, ARodThatLandsOnOneEndAndThenOnTheOtherMakesTwo) {
  for (const double dt : {1.0 / 60, 1.0 / 240, 1.0 / 1000}) {
    AnyWorld world(kGravity);
    world.addGround(world.box({2, 0.5, 2}), 0.5, -0.5);
    const btRigidBody& rod = world.add(world.shape<btCapsuleShapeX>(btScalar(0.02), btScalar(0.4)),
                                       {.mass = 0.5,
                                        .position = {0, 0.4, 0},
                                        .restitution = 0.0,
                                        .friction = 0.5,
                                        .turn = btQuaternion(btVector3(0, 0, 1), btScalar(0.4))});
    BulletBridge bridge = world.attach();
    world.step(dt, int(1.0 / dt));
    bridge.flush();
    auto events = eventsOf(bridge, rod);
    std::erase_if(events, [](const ImpulseEvent& event) { return event.approachSpeed < 0.3; });
    // Bullet may let the rod spring up from the second impact and fall once more.
    ASSERT_THAT(events, SizeIs(AnyOf(2, 3))) << "step " << dt;
    EXPECT_LT(events[0].position.x(), -0.1);
    EXPECT_GT(events[1].position.x(), 0.05);
    EXPECT_GT(events[1].time, events[0].time + 0.03);
    const double lowest = 0.4 - 0.2 * std::sin(0.4) - 0.02;
    EXPECT_NEAR(events[0].time, fallByHand(lowest, kGravity, dt).time, 50.0 * kTime);
  }
}

TEST(Impacts, ACradleWithGapsHandsTheBlowOnPairByPair) {
  AnyWorld world;
  world.world->getSolverInfo().m_splitImpulsePenetrationThreshold = btScalar(1e9);
  std::vector<btRigidBody*> balls;
  btCollisionShape& shape = world.sphere(0.05);
  for (int i = 0; i < 5; ++i) {
    const double place = i == 0 ? -0.2 : (i - 1) * 0.104;
    balls.push_back(&world.add(shape, {.mass = 0.5, .position = {place, 0, 0}}));
    balls.back()->setContactProcessingThreshold(0);
  }
  balls[0]->setLinearVelocity(btVector3(2, 0, 0));
  BulletBridge bridge = world.attach();
  world.step(1.0 / 1000, 200);
  ASSERT_EQ(bridge.events().size(), 8u);
  EXPECT_NEAR(bridge.events()[0].time, 0.05, kTime);
  for (std::size_t impact = 0; impact < 4; ++impact) {
    const ImpulseEvent& event = bridge.events()[2 * impact];
    EXPECT_EQ(std::min(event.body, event.other), impact);
    EXPECT_EQ(std::max(event.body, event.other), impact + 1);
    EXPECT_NEAR(event.impulse.norm(), 0.5 * 2.0, 1e-4);
  }
}

// --- rest ---

class RestsAt : public testing::TestWithParam<double> {};

TEST_P(RestsAt, EveryBodyIsSilentAndBearsItsWeight) {
  const double dt = GetParam();
  constexpr double kLow = 0.05 - 1e-6;  // Bullet holds only bodies that overlap, however little
  AnyWorld world(kGravity);
  world.addGround(world.box({3, 0.5, 3}), 0.5, -0.5);
  world.add(world.sphere(0.05), {.mass = 0.3, .position = {0, kLow, 0}, .friction = 0.5});
  world.add(world.box({0.1, 0.05, 0.2}), {.mass = 2, .position = {1, kLow, 0}, .friction = 0.5});
  world.add(world.shape<btCylinderShape>(btVector3(btScalar(0.1), btScalar(0.05), btScalar(0.1))),
            {.mass = 1, .position = {-1, kLow, 0}, .friction = 0.5});
  auto& table = world.shape<btCompoundShape>();
  for (const double side : {-0.1, 0.1})
    table.addChildShape(poseAt({side, 0, 0}), &world.box({0.02, 0.05, 0.1}));
  world.add(table, {.mass = 0.7, .position = {0, kLow, 1}, .friction = 0.5});
  BulletBridge bridge = world.attach();
  world.step(dt, int(1.5 / dt));
  EXPECT_TRUE(bridge.events().empty());
  EXPECT_EQ(bridge.counters().contactsBegun, 4u);
  expectWholeLives(bridge.contacts());
  for (std::size_t i = 1; i < 5; ++i) {
    const auto contacts = contactsOf(bridge, *world.bodies[i]);
    EXPECT_GE(contacts.size(), std::size_t(1.5 / dt) - 2) << "body " << i;
    const double weight = kGravity / double(world.bodies[i]->getInvMass());
    EXPECT_NEAR(meanLoad(contacts, 0.5, 1.5), weight, 0.01 * weight) << "body " << i;
    EXPECT_EQ(contacts.back().body, i);
    EXPECT_GT(contacts.back().normal.y(), 0.999);
  }
}

INSTANTIATE_TEST_SUITE_P(Steps, RestsAt, testing::Values(1.0 / 60, 1.0 / 240, 1.0 / 1000));

TEST(Rest, EndsWhenTheBodyFallsAsleepOrIsTakenAway) {
  for (const bool taken : {false, true}) {
    AnyWorld world(kGravity);
    world.addGround(world.plane());
    btRigidBody& ball = world.add(world.sphere(0.05), {.mass = 0.3, .position = {0, 0.05, 0}});
    BulletBridge bridge = world.attach();
    world.step(1.0 / 240, 60);
    const double until = bridge.time();
    if (taken)
      world.remove(ball);
    else
      ball.forceActivationState(ISLAND_SLEEPING);
    world.step(1.0 / 240, 60);
    EXPECT_EQ(bridge.contacts().back().phase, ContactPhase::end);
    EXPECT_EQ(bridge.contacts().back().normalLoad, 0.0);
    EXPECT_LT(bridge.contacts().back().time, until + 2.5 / 240);
    expectWholeLives(bridge.contacts());
    EXPECT_TRUE(bridge.events().empty());
    EXPECT_EQ(bridge.counters().contactsBegun, 1u);
  }
}

TEST(Rest, BeginsAgainWithoutAnEventWhenTheBodyIsWoken) {
  AnyWorld world(kGravity);
  world.addGround(world.plane());
  btRigidBody& ball = world.add(world.sphere(0.05), {.mass = 0.3, .position = {0, 0.05, 0}});
  BulletBridge bridge = world.attach();
  world.step(1.0 / 240, 60);
  ball.forceActivationState(ISLAND_SLEEPING);
  world.step(1.0 / 240, 60);
  ball.forceActivationState(ACTIVE_TAG);
  world.step(1.0 / 240, 60);
  EXPECT_TRUE(bridge.events().empty());
  EXPECT_EQ(bridge.counters().contactsBegun, 2u);
  EXPECT_NEAR(bridge.contacts().back().normalLoad, 0.3 * kGravity, 1e-3);
  expectWholeLives(bridge.contacts());
}

// Bullet sees no contact where rounding leaves a gap: it lets the upper box fall for a substep and
// catches it at g dt.
TEST(Rest, ABoxThatIsPutExactlyOnAnotherIsSilent) {
  for (const double dt : {1.0 / 60, 1.0 / 240, 1.0 / 1000}) {
    AnyWorld world(kGravity);
    world.addGround(world.box({1, 0.5, 1}), 0.5, -0.5);
    btCollisionShape& shape = world.box({0.1, 0.1, 0.1});
    for (int i = 0; i < 2; ++i)
      world.add(shape, {.position = {0, 0.1 + 0.2 * i, 0}, .restitution = 0, .friction = 0.5});
    BulletBridge bridge = world.attach();
    world.step(dt, int(0.5 / dt));
    EXPECT_TRUE(bridge.events().empty()) << "step " << dt;
  }
}

TEST(Rest, EachBoxOfAStackBearsThoseAbove) {
  for (const double dt : {1.0 / 60, 1.0 / 240}) {
    AnyWorld world(kGravity);
    world.addGround(world.box({1, 0.5, 1}), 0.5, -0.5);
    btCollisionShape& shape = world.box({0.1, 0.1, 0.1});
    for (int i = 0; i < 5; ++i)
      world.add(shape,
                {.mass = 1, .position = {0, 0.1 - 1e-6 + (0.2 - 1e-6) * i, 0}, .friction = 0.5});
    BulletBridge bridge = world.attach();
    world.step(dt, int(1.5 / dt));
    EXPECT_TRUE(bridge.events().empty()) << "step " << dt;
    for (BodyId below = 0; below < 5; ++below) {
      std::vector<ContactState> contacts;
      for (const ContactState& contact : bridge.contacts()) {
        if (std::min(contact.body, contact.other) == below &&
            std::max(contact.body, contact.other) == below + 1)
          contacts.push_back(contact);
      }
      const double weight = (5.0 - below) * kGravity;
      EXPECT_NEAR(meanLoad(contacts, 0.5, 1.5), weight, 0.02 * weight) << "below " << below;
    }
  }
}

TEST(Rest, ABallThatBouncesOutHasFewContactsAndWholeOnes) {
  for (const double dt : {1.0 / 60, 1.0 / 240, 1.0 / 1000}) {
    AnyWorld world(kGravity);
    world.addGround(world.plane());
    btRigidBody& ball =
        world.add(world.sphere(0.05), {.mass = 0.3, .position = {0, 0.35, 0}, .restitution = 0.5});
    ball.setActivationState(DISABLE_DEACTIVATION);
    BulletBridge bridge = world.attach();
    world.step(dt, int(3.0 / dt));
    expectWholeLives(bridge.contacts());
    EXPECT_GE(bridge.counters().contactsBegun, 1u);
    EXPECT_LE(bridge.counters().contactsBegun, bridge.counters().collisions + 1);
    EXPECT_EQ(bridge.contacts().back().phase, ContactPhase::during);
    EXPECT_NEAR(bridge.contacts().back().normalLoad, 0.3 * kGravity, 1e-3);
    // A contact has a load only after the free fall.
    for (const ContactState& contact : bridge.contacts()) {
      if (contact.normalLoad > 0.0) {
        EXPECT_GT(contact.time, fallByHand(0.3, kGravity, dt).time - dt);
      }
    }
  }
}

// --- sliding and rolling ---

double pathLength(const std::vector<ContactState>& contacts, bool onBody) {
  double length = 0.0;
  for (const ContactState& contact : contacts) {
    length += onBody ? (contact.pathEnd - contact.pathStart).norm()
                     : (contact.otherPathEnd - contact.otherPathStart).norm();
  }
  return length;
}

TEST(Sliding, ABlockSlowsDownAsFrictionHasIt) {
  for (const double dt : {1.0 / 240, 1.0 / 1000}) {
    AnyWorld world(kGravity);
    world.addGround(world.box({5, 0.5, 5}), 1.0, -0.5);
    const double start = 2.0;
    btRigidBody& block = world.add(
        world.box({0.1, 0.03, 0.1}),
        {.mass = 2, .position = {0, 0.03, 0}, .velocity = {start, 0, 0}, .friction = 0.3});
    BulletBridge bridge = world.attach();
    world.step(dt, int(0.5 / dt));
    EXPECT_TRUE(bridge.events().empty()) << "step " << dt;
    const auto contacts = contactsOf(bridge, block);
    const double weight = 2.0 * kGravity;
    EXPECT_NEAR(meanLoad(contacts, 0.1, 0.5), weight, 0.02 * weight);
    for (const ContactState& contact : contacts) {
      const double expected = start - 0.3 * kGravity * (contact.time + 0.5 * contact.duration);
      EXPECT_NEAR(contact.slipVelocity.x(), expected, 0.03) << "at " << contact.time;
      EXPECT_NEAR(contact.rollingVelocity.x(), 0.5 * expected, 0.02);
    }
    const double went = double(block.getWorldTransform().getOrigin().x());
    EXPECT_NEAR(pathLength(contacts, false), went, 0.01 * went);
  }
}

TEST(Rolling, ABallThatRollsDoesNotSlipAndDrawsAGreatCircle) {
  const double dt = 1.0 / 240;
  const double radius = 0.05;
  const double speed = 1.5;
  AnyWorld world(kGravity);
  world.addGround(world.plane(), 1.0);
  btRigidBody& ball = world.add(world.sphere(radius), {.mass = 0.3,
                                                       .position = {0, radius, 0},
                                                       .velocity = {speed, 0, 0},
                                                       .spin = {0, 0, -speed / radius},
                                                       .friction = 0.5});
  BulletBridge bridge = world.attach();
  world.step(dt, 120);
  EXPECT_TRUE(bridge.events().empty());
  const auto contacts = contactsOf(bridge, ball);
  ASSERT_GE(contacts.size(), 118u);
  for (const ContactState& contact : contacts) {
    EXPECT_NEAR(contact.slipVelocity.norm(), 0.0, 2e-3);
    EXPECT_NEAR((contact.rollingVelocity - Vec3(speed, 0, 0)).norm(), 0.0, 2e-3);
    for (const Vec3& point : {contact.pathStart, contact.pathEnd}) {
      EXPECT_NEAR(point.norm(), radius, 1e-4);
      EXPECT_NEAR(point.z(), 0.0, 1e-4);
    }
  }
  // The path consists of chords of speed * dt / radius = 1/8 rad, which are 0.07 % shorter than
  // their arcs.
  const double length = double(contacts.size()) * dt * speed;
  EXPECT_NEAR(pathLength(contacts, true), length, 2e-3 * length);
  EXPECT_NEAR(pathLength(contacts, false), length, 2e-3 * length);
}

TEST(Rolling, ASlidingBallGripsWhenFrictionHasSpunItUp) {
  const double dt = 1.0 / 1000;
  const double friction = 0.2;
  AnyWorld world(kGravity);
  world.addGround(world.plane(), 1.0);
  btRigidBody& ball = world.add(
      world.sphere(0.05),
      {.mass = 0.3, .position = {0, 0.05, 0}, .velocity = {2, 0, 0}, .friction = friction});
  BulletBridge bridge = world.attach();
  world.step(dt, 500);
  EXPECT_TRUE(bridge.events().empty());
  const double grips = 2.0 / (3.5 * friction * kGravity);
  for (const ContactState& contact : contactsOf(bridge, ball)) {
    const double middle = contact.time + 0.5 * dt;
    const double slip = std::max(0.0, 2.0 - 3.5 * friction * kGravity * middle);
    // The bound is one substep of friction: 3.5 mu g dt.
    EXPECT_NEAR(contact.slipVelocity.x(), slip, 0.008) << "at " << middle << ", grips " << grips;
    EXPECT_NEAR(contact.normalLoad, 0.3 * kGravity, 0.01 * 0.3 * kGravity);
  }
}

// --- meshes ---

/// A floor of squares of two triangles each, with x from -1 to 3 and z from -1 to 1, and a wall of
/// the same mesh at x = 2.
struct FloorMesh {
  FloorMesh() {
    for (int column = 0; column < 40; ++column) {
      for (int row = 0; row < 20; ++row)
        square({-1 + 0.1 * column, 0, -1 + 0.1 * row}, {0, 0, 0.1}, {0.1, 0, 0});
    }
    for (int row = 0; row < 20; ++row)
      square({2, 0, -1 + 0.1 * row}, {0, 0, 0.1}, {0, 0.3, 0});
  }
  void square(const Vec3& corner, const Vec3& first, const Vec3& second) {
    mesh.addTriangle(bt(corner), bt(corner + first), bt(corner + second));
    mesh.addTriangle(bt(corner + first + second), bt(corner + second), bt(corner + first));
  }
  btTriangleMesh mesh;
};

btRigidBody& addRollingBall(AnyWorld& world, const Vec3& velocity) {
  return world.add(world.sphere(0.05), {.mass = 0.3,
                                        .position = {0, 0.05, 0.03},
                                        .velocity = velocity,
                                        .spin = Vec3::UnitY().cross(velocity) / 0.05,
                                        .restitution = 0.0,
                                        .friction = 0.5});
}

// Bullet slows the ball down at the edges and lets it hop, even with its own remedy
// (btAdjustInternalEdgeContacts) or a processing threshold of 0. Therefore the ball does land
// again, on the faces, but it never hits an edge.
TEST(Meshes, ABallThatRollsOverInnerEdgesHitsNoneOfThemAndTheWallOnce) {
  for (const double dt : {1.0 / 60, 1.0 / 240, 1.0 / 1000}) {
    FloorMesh floor;
    AnyWorld world(kGravity);
    world.addGround(world.shape<btBvhTriangleMeshShape>(&floor.mesh, true), 1.0);
    const btRigidBody& ball = addRollingBall(world, 1.5 * Vec3(1, 0, 0.21).normalized());
    BulletBridge bridge = world.attach();
    while (ball.getWorldTransform().getOrigin().x() < btScalar(1.9) && bridge.time() < 5.0)
      world.step(dt);
    const auto before = eventsOf(bridge, ball);
    EXPECT_THAT(before, Each(Field(&ImpulseEvent::normal,
                                   Truly([](const Vec3& normal) { return normal.y() > 0.999; }))))
        << "step " << dt;
    world.stepUntil(bridge, bridge.time() + 0.2, dt);
    bridge.flush();
    EXPECT_EQ(
        std::ranges::count_if(eventsOf(bridge, ball),
                              [](const ImpulseEvent& event) { return event.normal.x() < -0.9; }),
        1)
        << "step " << dt;
  }
}

// --- the momentum balance ---

/// Compares the sum of the impulses that Bullet applied to each body, according to events and
/// contacts, with the body's change of momentum since the start.
class MomentumBalance {
 public:
  MomentumBalance(AnyWorld& world, BulletBridge& bridge) : world_(world), bridge_(bridge) {
    start();
  }

  void start() {
    bridge_.clear();
    before_.clear();
    for (const auto& body : world_.bodies)
      before_.push_back(momentum(*body));
  }

  void expectClosed() {
    bridge_.flush();
    const double duration = bridge_.time();
    for (std::size_t i = 0; i < before_.size(); ++i) {
      const btRigidBody& body = *world_.bodies[i];
      if (body.getInvMass() == 0) continue;
      double size = 0.0;
      const Vec3 applied = appliedTo(*bridge_.bodyId(body), size);
      const Vec3 force = vec(body.getGravity()) / double(body.getInvMass());
      const Vec3 change = momentum(body) - before_[i];
      size += change.norm() + duration * force.norm();
      EXPECT_NEAR((applied + duration * force - change).norm(), 0.0, 1e-5 * size) << "body " << i;
    }
  }

 private:
  static Vec3 momentum(const btRigidBody& body) {
    if (body.getInvMass() == 0) return Vec3::Zero();
    return vec(body.getLinearVelocity()) / double(body.getInvMass());
  }
  Vec3 appliedTo(BodyId id, double& size) const {
    Vec3 sum = Vec3::Zero();
    for (const ImpulseEvent& event : bridge_.events()) {
      if (event.body != id) continue;
      sum += event.appliedImpulse;
      size += event.appliedImpulse.norm();
    }
    for (const ContactState& contact : bridge_.contacts()) {
      if (contact.body != id && contact.other != id) continue;
      sum += (contact.body == id ? 1.0 : -1.0) * contact.appliedImpulse;
      size += contact.appliedImpulse.norm();
    }
    return sum;
  }

  AnyWorld& world_;
  BulletBridge& bridge_;
  std::vector<Vec3> before_;
};

btCollisionShape& anyShape(AnyWorld& world, int kind) {
  const auto size = [](double v) { return btScalar(v); };
  switch (kind % 6) {
    case 0:
      return world.sphere(0.06);
    case 1:
      return world.box({0.08, 0.05, 0.06});
    case 2:
      return world.shape<btCapsuleShape>(size(0.04), size(0.1));
    case 3:
      return world.shape<btCylinderShape>(btVector3(size(0.06), size(0.05), size(0.06)));
    case 4:
      return world.shape<btConeShape>(size(0.06), size(0.12));
    default:
      break;
  }
  auto& dumbbell = world.shape<btCompoundShape>();
  for (const double side : {-0.07, 0.07})
    dumbbell.addChildShape(poseAt({side, 0, 0}), &world.sphere(0.05));
  return dumbbell;
}

void addCrowd(AnyWorld& world, unsigned seed, double friction) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const auto any = [&](double size) {
    return Vec3(size * uniform(random), size * uniform(random), size * uniform(random));
  };
  for (int i = 0; i < 12; ++i) {
    const int layer = i / 3;
    const Vec3 place = Vec3(0.2 * (i % 3), 0.2 + 0.25 * layer, 0.1 * (i % 2)) + any(0.03);
    world.add(anyShape(world, i), {.mass = 0.5 + 0.1 * i,
                                   .position = place,
                                   .velocity = any(1.0),
                                   .spin = any(5.0),
                                   .restitution = 0.6,
                                   .friction = friction});
  }
}

struct Crowd {
  WorldKind kind = WorldKind::discrete;
  double dt = 0.0;
  double friction = 0.0;
  bool continuous = false;
};

class Momentum : public testing::TestWithParam<Crowd> {};

TEST_P(Momentum, OfEventsAndContactsIsThatOfEveryBody) {
  const Crowd crowd = GetParam();
  for (unsigned seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    AnyWorld world(kGravity, crowd.kind);
    world.addGround(world.box({5, 0.5, 5}), 1.0, -0.5);
    addCrowd(world, seed, crowd.friction);
    for (const auto& body : world.bodies) {
      if (crowd.continuous && body->getInvMass() > 0) {
        body->setCcdMotionThreshold(btScalar(1e-3));
        body->setCcdSweptSphereRadius(btScalar(0.03));
      }
    }
    BulletBridge bridge = world.attach();
    MomentumBalance balance(world, bridge);
    world.step(crowd.dt, int(0.2 * seed / crowd.dt) + 1);
    balance.expectClosed();
  }
}

INSTANTIATE_TEST_SUITE_P(
    Crowds, Momentum,
    testing::Values(Crowd{.dt = 1.0 / 240}, Crowd{.dt = 1.0 / 60, .friction = 0.7},
                    Crowd{.dt = 1.0 / 240, .friction = 0.7},
                    Crowd{.dt = 1.0 / 1000, .friction = 0.7},
                    Crowd{.dt = 1.0 / 60, .friction = 0.7, .continuous = true},
                    Crowd{.kind = WorldKind::multibody, .dt = 1.0 / 240, .friction = 0.7},
                    Crowd{.kind = WorldKind::multithreaded, .dt = 1.0 / 240, .friction = 0.7}));

// --- time of delivery ---

TEST(Delivery, NothingIsHandedOutLaterThatIsDatedBeforeTheSettledTime) {
  for (const EventDelivery delivery : {EventDelivery::complete, EventDelivery::prompt}) {
    for (const double dt : {1.0 / 60, 1.0 / 240}) {
      AnyWorld world(kGravity);
      world.addGround(world.box({5, 0.5, 5}), 1.0, -0.5);
      addCrowd(world, 1, 0.5);
      BulletBridge bridge = world.attach({.delivery = delivery});
      double settled = bridge.settledTime();
      for (int step = 0; step < int(2.0 / dt); ++step) {
        world.step(dt);
        for (const ImpulseEvent& event : bridge.events())
          EXPECT_GE(event.time, settled - 1e-12);
        EXPECT_GE(bridge.settledTime(), settled);
        EXPECT_LE(bridge.settledTime(), bridge.time());
        EXPECT_GE(bridge.settledTime(), bridge.time() - std::max(0.02, 3.0 * dt) - 2.0 * dt);
        settled = bridge.settledTime();
        bridge.clear();
      }
    }
  }
}

TEST(Delivery, PromptAndCompleteTellOfTheSameImpacts) {
  std::vector<std::vector<ImpulseEvent>> told;
  for (const EventDelivery delivery : {EventDelivery::complete, EventDelivery::prompt}) {
    AnyWorld world(kGravity);
    world.addGround(world.box({5, 0.5, 5}), 1.0, -0.5);
    addCrowd(world, 2, 0.5);
    BulletBridge bridge = world.attach({.delivery = delivery});
    world.step(1.0 / 240, 400);
    bridge.flush();
    EXPECT_EQ(bridge.counters().delivered, bridge.counters().collisions);
    EXPECT_EQ(bridge.events().size(), 2 * bridge.counters().delivered);
    told.emplace_back(bridge.events().begin(), bridge.events().end());
    std::ranges::sort(told.back(), {}, [](const ImpulseEvent& event) {
      return std::tuple(event.time, event.body, event.other);
    });
    for (const ImpulseEvent& event : told.back())
      EXPECT_EQ(event.hasAppliedImpulse, delivery == EventDelivery::complete);
  }
  ASSERT_EQ(told[0].size(), told[1].size());
  ASSERT_GT(told[0].size(), 20u);
  for (std::size_t i = 0; i < told[0].size(); ++i) {
    EXPECT_EQ(told[0][i].time, told[1][i].time);
    EXPECT_EQ(told[0][i].body, told[1][i].body);
    EXPECT_EQ(told[0][i].impulse, told[1][i].impulse);
  }
}

}  // namespace
}  // namespace carom
