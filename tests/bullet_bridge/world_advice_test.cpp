#include "carom/bullet/world_advice.h"

#include <cmath>
#include <functional>
#include <random>

#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/bullet_bridge/sphere_world.h"

namespace carom {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using Ball = SphereBulletWorld::Ball;

constexpr double kStep = 1.0 / 240;
constexpr double kGravity = 9.81;
double number(btScalar value) {
  return static_cast<double>(value);
}

constexpr double kFloat = 1e-6;  // relative rounding of numbers in Bullet

std::vector<Advice> adviceFor(const SphereBulletWorld& world, double step = kStep,
                              const AdviceSettings& settings = {}) {
  Result<std::vector<Advice>> list = recommend(world.world, step, settings);
  EXPECT_TRUE(list);
  return *std::move(list);
}

std::vector<AdviceKind> kindsOf(const std::vector<Advice>& list) {
  std::vector<AdviceKind> kinds;
  kinds.reserve(list.size());
  for (const Advice& advice : list)
    kinds.push_back(advice.kind);
  return kinds;
}

Tuning tuned(SphereBulletWorld& world, double step, const AdviceSettings& settings = {}) {
  Result<Tuning> tuning = tune(world.world, step, settings);
  EXPECT_TRUE(tuning);
  return *std::move(tuning);
}

/// A world with balls of 40 cm over a floor, for which there is nothing to advise.
struct WellSetWorld : SphereBulletWorld {
  WellSetWorld() : SphereBulletWorld(kGravity) {
    addPlane(Vec3::UnitY(), 0.0, 1.0);
    btContactSolverInfo& info = world.getSolverInfo();
    info.m_splitImpulsePenetrationThreshold = 0;
    info.m_restitutionVelocityThreshold = btScalar(2 * kGravity * kStep);
    for (int i = 0; i < 3; ++i) {
      balls.push_back(&addBall({.radius = 0.2, .position = {double(i), 1, 0}}));
      balls.back()->setContactProcessingThreshold(0);
    }
  }
  std::vector<btRigidBody*> balls;
};

struct GlobalsRestored {
  ~GlobalsRestored() {
    gDbvtMargin = margin;
    gContactBreakingThreshold = breaking;
  }
  btScalar margin = gDbvtMargin;
  btScalar breaking = gContactBreakingThreshold;
};

TEST(WorldAdvice, AWellSetWorldGetsNone) {
  EXPECT_THAT(adviceFor(WellSetWorld()), IsEmpty());
  EXPECT_THAT(adviceFor(WellSetWorld(), kStep, {.processWide = true}), IsEmpty());
}

TEST(WorldAdvice, ADefaultWorldIsToldOfTheThreeThatBendBounces) {
  SphereBulletWorld world(kGravity);
  world.addPlane(Vec3::UnitY(), 0.0, 1.0);
  world.addBall({.radius = 0.2});
  EXPECT_THAT(kindsOf(adviceFor(world)),
              ElementsAre(AdviceKind::splitImpulseThreshold, AdviceKind::speculativeContact,
                          AdviceKind::restitutionThreshold));
}

TEST(WorldAdvice, RefusesAStepOrAHeightThatIsNone) {
  WellSetWorld world;
  for (const double bad : {0.0, -1.0, double(NAN), double(INFINITY)}) {
    EXPECT_FALSE(recommend(world.world, bad));
    EXPECT_FALSE(tune(world.world, bad));
    const auto height = recommend(world.world, kStep, {.dropHeight = bad});
    ASSERT_FALSE(height);
    EXPECT_THAT(height.error().message, HasSubstr("dropHeight"));
  }
}

// --- each setting, and its numbers by hand ---

struct Case {
  const char* name;
  AdviceKind kind;
  std::function<void(WellSetWorld&)> spoil;
  double current, advised;
  std::size_t bodies;
  const char* says;
};

void PrintTo(const Case& given, std::ostream* out) {
  *out << given.name;
}

class EachSetting : public testing::TestWithParam<Case> {};

TEST_P(EachSetting, GetsItsAdviceAndNoOther) {
  const GlobalsRestored restore;
  WellSetWorld world;
  GetParam().spoil(world);
  const std::vector<Advice> list = adviceFor(world);
  ASSERT_THAT(kindsOf(list), ElementsAre(GetParam().kind));
  const Advice& advice = list.front();
  EXPECT_NEAR(advice.current, GetParam().current, kFloat * std::abs(GetParam().current));
  EXPECT_NEAR(advice.advised, GetParam().advised, kFloat * std::abs(GetParam().advised));
  EXPECT_EQ(advice.bodies, GetParam().bodies);
  EXPECT_THAT(advice.reason, HasSubstr(GetParam().says));
  EXPECT_EQ(advice.reason.back(), '.');
}

void addHull(WellSetWorld& world, double half, double margin) {
  auto hull = std::make_unique<btConvexHullShape>();
  for (const double x : {-half, half})
    for (const double y : {-half, half})
      for (const double z : {-half, half})
        hull->addPoint(btVector3(btScalar(x), btScalar(y), btScalar(z)));
  hull->setMargin(btScalar(margin));
  world.balls[0]->setCollisionShape(hull.get());
  world.shapes.push_back(std::move(hull));
}

INSTANTIATE_TEST_SUITE_P(
    , EachSetting,
    testing::Values(
        Case{"split impulse off", AdviceKind::splitImpulse,
             [](WellSetWorld& w) { w.world.getSolverInfo().m_splitImpulse = 0; }, 0, 1, 0, "20 %"},
        Case{"split impulse for deep ones only", AdviceKind::splitImpulseThreshold,
             [](WellSetWorld& w) {
               w.world.getSolverInfo().m_splitImpulsePenetrationThreshold = btScalar(-0.04);
               w.world.getSolverInfo().m_erp2 = btScalar(0.1);
             },
             -0.04, 0, 0, "less than 40 mm: it adds up to 10 %"},
        // The distance is 0.02 of the reach sqrt(3) r, 6.93 mm; the speeds are 240 times that and
        // half of it.
        Case{"speculative contacts", AdviceKind::speculativeContact,
             [](WellSetWorld& w) { w.balls[1]->setContactProcessingThreshold(BT_LARGE_FLOAT); },
             number(BT_LARGE_FLOAT), 0, 1,
             "6.93 mm, before the bodies touch: bounces are up to 1.66 m/s too slow, "
             "and all below 0.831 m/s vanish"},
        // The fall is 0.2^2 / (2 g) = 2.04 mm.
        Case{"restitution threshold", AdviceKind::restitutionThreshold,
             [](WellSetWorld& w) {
               w.world.getSolverInfo().m_restitutionVelocityThreshold = btScalar(0.2);
             },
             0.2, 2 * kGravity / 240, 0, "below 0.2 m/s, a fall of 2.04 mm"},
        Case{"no write-back", AdviceKind::impulseWriteBack,
             [](WellSetWorld& w) { w.world.getSolverInfo().m_solverMode = SOLVER_SIMD; }, 256, 260,
             0, "reads 0"},
        Case{"fixed contact distances", AdviceKind::relativeBreakingDistance,
             [](WellSetWorld& w) {
               static_cast<btCollisionDispatcher*>(w.world.getDispatcher())->setDispatcherFlags(0);
             },
             0, 2, 3, "20 mm whatever the size of the bodies, which is up to 5 %"},
        Case{"large contact distances", AdviceKind::breakingDistance,
             [](WellSetWorld&) { gContactBreakingThreshold = btScalar(0.1); }, 0.1, 0.02, 0,
             "10 %"},
        // The way is 120 m/s / 240 = 0.5 m in a step; the ball is 0.4 m thick.
        Case{"coarse step", AdviceKind::coarseStep,
             [](WellSetWorld& w) { w.balls[2]->setLinearVelocity(btVector3(0, 0, 120)); }, kStep,
             0.4 / 120, 1, "goes 0.5 m in a step, more than its thickness of 0.4 m"},
        // The hull has half edges of 0.2 m, which the margin inflates by 0.04 m.
        Case{"hull margin", AdviceKind::hullMargin, [](WellSetWorld& w) { addHull(w, 0.2, 0.04); },
             0.04, 0.01, 1, "40 mm outside"},
        // The volume grows by the factor (1 + 2 x 0.3 / 0.4)^3 = 15.6.
        Case{"broadphase margin", AdviceKind::broadphaseMargin,
             [](WellSetWorld&) { gDbvtMargin = btScalar(0.3); }, 0.3, 0.02, 0, "15.6 times"},
        // The way is 20 m/s / 240 = 83 mm in a step; 40 mm are allowed, which is 9.6 m/s.
        Case{"continuous collision", AdviceKind::continuousCollision,
             [](WellSetWorld& w) {
               w.balls[0]->setCcdMotionThreshold(btScalar(0.01));
               w.balls[0]->setLinearVelocity(btVector3(0, 0, 20));
             },
             0.01, 0, 1, "Above 9.6 m/s"}));

TEST(WorldAdvice, ContinuousCollisionThatNeverFiresIsNoMatter) {
  WellSetWorld world;
  world.balls[0]->setCcdMotionThreshold(btScalar(0.01));  // 3.1 m/s are 13 mm in a step
  EXPECT_THAT(adviceFor(world), IsEmpty());
}

TEST(WorldAdvice, SmallBodiesAreToldOfTheStepTheMarginsAndTheBroadphase) {
  SphereBulletWorld world(kGravity);
  for (int i = 0; i < 5; ++i)
    world.addBall({.radius = 0.005, .position = {0.1 * i, 1, 0}});
  const std::vector<Advice> list = adviceFor(world);
  ASSERT_THAT(kindsOf(list),
              ElementsAre(AdviceKind::splitImpulseThreshold, AdviceKind::speculativeContact,
                          AdviceKind::restitutionThreshold, AdviceKind::coarseStep,
                          AdviceKind::broadphaseMargin));
  EXPECT_NEAR(list[3].advised, 0.01 / std::sqrt(2 * kGravity * 0.5), 1e-8);
  EXPECT_EQ(list[3].bodies, 5u);
  EXPECT_THAT(list[4].reason, HasSubstr("1.33e+03 times"));  // (1 + 0.1 / 0.01)^3
}

// --- multibodies ---

struct WorldWithLink : WellSetWorld {
  WorldWithLink() {
    body.finalizeMultiDof();
    shapes.push_back(std::make_unique<btSphereShape>(btScalar(0.2)));
    collider.setCollisionShape(shapes.back().get());
    collider.setContactProcessingThreshold(0);
    body.setBaseCollider(&collider);
    world.addCollisionObject(&collider);
  }
  ~WorldWithLink() { world.removeCollisionObject(&collider); }
  btMultiBody body{0, 1, btVector3(1, 1, 1), false, false};
  btMultiBodyLinkCollider collider{&body, -1};
};

// The depth is 3.13 m/s / 240 = 13.1 mm.
TEST(WorldAdvice, LinksAreToldToDoWithoutTheirPushButTuneLeavesItUnlessAsked) {
  WorldWithLink world;
  const std::vector<Advice> list = adviceFor(world);
  ASSERT_THAT(kindsOf(list), ElementsAre(AdviceKind::linkPush));
  EXPECT_NEAR(list[0].current, 0.2, 1e-7);
  EXPECT_EQ(list[0].advised, 0.0);
  EXPECT_EQ(list[0].bodies, 1u);
  EXPECT_THAT(list[0].reason, HasSubstr("stays inside by up to 13.1 mm"));
  EXPECT_THAT(tuned(world, kStep).applied, IsEmpty());
  EXPECT_THAT(tuned(world, kStep, {.leaveLinksInside = true}).applied, SizeIs(1));
  EXPECT_EQ(world.world.getSolverInfo().m_erp2, 0);
  EXPECT_THAT(adviceFor(world), IsEmpty());
}

TEST(WorldAdvice, LinksNeedARestitutionThresholdAboveWhatGravityAddsInAStep) {
  WorldWithLink world;
  world.world.getSolverInfo().m_erp2 = 0;
  world.world.getSolverInfo().m_restitutionVelocityThreshold = btScalar(0.9 * kGravity * kStep);
  const std::vector<Advice> list = adviceFor(world);
  ASSERT_THAT(kindsOf(list), ElementsAre(AdviceKind::restitutionThreshold));
  EXPECT_NEAR(list[0].advised, 2 * kGravity * kStep, 1e-7);
  EXPECT_THAT(list[0].reason, HasSubstr("bounce for ever"));
}

TEST(WorldAdvice, AFixedMultibodyDoesNotCount) {
  WorldWithLink world;
  world.body.setFixedBase(true);
  EXPECT_THAT(adviceFor(world), IsEmpty());
}

// --- tune ---

TEST(WorldAdvice, TuneLeavesOnlyWhatItCannotApply) {
  SphereBulletWorld world(kGravity);
  world.addPlane(Vec3::UnitY(), 0.0, 1.0);
  for (int i = 0; i < 5; ++i)
    world.addBall({.radius = 0.005, .position = {0.1 * i, 1, 0}});
  world.world.getSolverInfo().m_splitImpulse = 0;
  world.world.getSolverInfo().m_solverMode = SOLVER_SIMD;
  const Tuning tuning = tuned(world, kStep);
  EXPECT_THAT(tuning.applied, SizeIs(5));
  EXPECT_THAT(tuning.changes, SizeIs(4 + 5));
  const std::vector<Advice> left = adviceFor(world);
  EXPECT_THAT(kindsOf(left), ElementsAre(AdviceKind::coarseStep, AdviceKind::broadphaseMargin));
  for (const Advice& advice : left)
    EXPECT_FALSE(advice.applicable);
  EXPECT_THAT(tuned(world, kStep).changes, IsEmpty());
}

TEST(WorldAdvice, TuneChangesGlobalsOnlyWhenAsked) {
  const GlobalsRestored restore;
  SphereBulletWorld world(kGravity);
  world.addBall({.radius = 0.005});
  gContactBreakingThreshold = btScalar(0.1);
  tuned(world, kStep);
  EXPECT_EQ(gDbvtMargin, restore.margin);
  EXPECT_EQ(gContactBreakingThreshold, btScalar(0.1));
  const Tuning tuning = tuned(world, kStep, {.processWide = true});
  EXPECT_NEAR(double(gDbvtMargin), 0.0005, 1e-9);
  EXPECT_NEAR(double(gContactBreakingThreshold), 0.02, 1e-9);
  undo(world.world, tuning);
  EXPECT_EQ(gDbvtMargin, restore.margin);
  EXPECT_EQ(gContactBreakingThreshold, btScalar(0.1));
}

TEST(WorldAdvice, UndoSetsEveryBodyBackAndSkipsThoseThatHaveLeft) {
  SphereBulletWorld world(kGravity);
  btRigidBody& first = world.addBall({.position = {0, 1, 0}});
  btRigidBody& second = world.addBall({.position = {1, 1, 0}});
  btRigidBody& leaving = world.addBall({.position = {2, 1, 0}});
  second.setContactProcessingThreshold(btScalar(0.25));
  const btContactSolverInfo& info = world.world.getSolverInfo();
  const Tuning tuning = tuned(world, kStep);
  EXPECT_EQ(first.getContactProcessingThreshold(), 0);
  EXPECT_EQ(second.getContactProcessingThreshold(), 0);
  EXPECT_EQ(info.m_splitImpulsePenetrationThreshold, 0);
  world.remove(leaving);
  undo(world.world, tuning);
  EXPECT_EQ(first.getContactProcessingThreshold(), BT_LARGE_FLOAT);
  EXPECT_EQ(second.getContactProcessingThreshold(), btScalar(0.25));
  EXPECT_EQ(info.m_splitImpulsePenetrationThreshold, btScalar(-0.04f));
  EXPECT_EQ(info.m_restitutionVelocityThreshold, btScalar(0.2f));
}

TEST(WorldAdvice, TuneReachesContactsThatExist) {
  SphereBulletWorld world(kGravity);
  world.addPlane(Vec3::UnitY(), 0.0, 1.0);
  world.addBall({.position = {0, 0.05, 0}});
  world.step(kStep);
  const btDispatcher& dispatcher = *world.world.getDispatcher();
  ASSERT_EQ(dispatcher.getNumManifolds(), 1);
  const Tuning tuning = tuned(world, kStep);
  auto& manifold =
      *static_cast<const btCollisionDispatcher&>(dispatcher).getManifoldByIndexInternal(0);
  EXPECT_EQ(manifold.getContactProcessingThreshold(), 0);
  undo(world.world, tuning);
  EXPECT_EQ(manifold.getContactProcessingThreshold(), BT_LARGE_FLOAT);
}

// --- effect of the advice ---

struct Rebounds {
  double slowest = INFINITY;  // relative to the right speed
  double fastest = 0.0;
};

// Rebounds of a ball of 5 cm from half a metre, at sixteen phases of the step, with restitution
// 0.9.
Rebounds reboundsAt(double step, bool tuneIt) {
  Rebounds rebounds;
  for (int phase = 0; phase < 16; ++phase) {
    SphereBulletWorld world(kGravity);
    world.addPlane(Vec3::UnitY(), 0.0, 1.0);
    const double fall = 0.5 + 3.0 * step * phase / 16.0;
    btRigidBody& ball =
        world.addBall({.mass = 0.3, .position = {0, 0.05 + fall, 0}, .restitution = 0.9});
    if (tuneIt) tuned(world, step);
    const double speed = std::sqrt(2.0 * kGravity * fall);
    double fastest = 0.0;
    for (double time = 0.0; time < speed / kGravity + 0.01; time += step) {
      world.step(step);
      fastest = std::max(fastest, double(ball.getLinearVelocity().y()));
    }
    rebounds.slowest = std::min(rebounds.slowest, fastest / (0.9 * speed));
    rebounds.fastest = std::max(rebounds.fastest, fastest / (0.9 * speed));
  }
  return rebounds;
}

TEST(WorldAdvice, ABallBouncesAtTheRightSpeedAfterTuneAndNotBefore) {
  const Rebounds coarse = reboundsAt(1.0 / 1000, false);
  EXPECT_LT(coarse.slowest, 0.6);
  EXPECT_GT(coarse.fastest, 1.05);
  EXPECT_LT(reboundsAt(1.0 / 8000, false).fastest, 0.02) << "it bounced: nothing to mend";
  for (const double step : {1.0 / 1000, 1.0 / 8000}) {
    const Rebounds right = reboundsAt(step, true);
    EXPECT_GT(right.slowest, 0.995) << step;
    EXPECT_LT(right.fastest, 1.005) << step;
  }
}

double energyGain(bool tuneIt) {
  SphereBulletWorld world;
  for (const int axis : {0, 1, 2})
    for (const double side : {1.0, -1.0})
      world.addPlane(side * Vec3::Unit(axis), -0.5, 1.0);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> speed(-2.0, 2.0);
  for (int i = 0; i < 300; ++i) {
    const int row = i / 7 % 7;
    const int layer = i / 49;
    const Vec3 place = 0.14 * (Vec3(i % 7, row, layer) - Vec3(3, 3, 3));
    btRigidBody& ball = world.addBall(
        {.position = place, .velocity = {speed(random), speed(random), speed(random)}});
    ball.setActivationState(DISABLE_DEACTIVATION);
  }
  if (tuneIt) tuned(world, 1.0 / 1000);
  const auto energy = [&] {
    double sum = 0.0;
    for (const auto& body : world.bodies)
      sum += 0.5 * double(body->getLinearVelocity().length2());
    return sum;
  };
  const double before = energy();
  world.step(1.0 / 1000, 1000);
  return energy() / before;
}

TEST(WorldAdvice, AnElasticGasKeepsItsEnergyAfterTuneAndNotBefore) {
  EXPECT_GT(energyGain(false), 2.0);
  EXPECT_NEAR(energyGain(true), 1.0, 0.01);
}

// Tests the side effect of which the header warns.
TEST(WorldAdvice, ContactPointsAtAGapKeepTheirOldImpulseAfterTune) {
  SphereBulletWorld world(kGravity);
  world.addPlane(Vec3::UnitY(), 0.0, 1.0);
  world.addBall({.position = {0, 0.06, 0}, .velocity = {0, -3, 0}, .restitution = 0.9});
  const double step = 1.0 / 8000;
  tuned(world, step);
  const btDispatcher& dispatcher = *world.world.getDispatcher();
  int stale = 0;
  for (int i = 0; i < 60; ++i) {
    world.step(step);
    for (int m = 0; m < dispatcher.getNumManifolds(); ++m) {
      const auto& manifold = *world.world.getDispatcher()->getManifoldByIndexInternal(m);
      for (int point = 0; point < manifold.getNumContacts(); ++point) {
        const btManifoldPoint& contact = manifold.getContactPoint(point);
        if (contact.getDistance() > 0 && contact.getAppliedImpulse() > 1) ++stale;
      }
    }
  }
  EXPECT_GT(stale, 0);
}

}  // namespace
}  // namespace carom
