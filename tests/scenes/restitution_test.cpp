// Restitutions of pairs of materials, from the scene file to the bounce, on both steppers.

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "lab/compare/compare.h"
#include <gtest/gtest.h>

#include "scenes/run/bullet_scene.h"
#include "scenes/run/scene_stepper.h"
#include "tests/scenes/library.h"

namespace carom::test {

using namespace lab;
using namespace scenes;

namespace {

/// A steel ball and a rubber ball fall onto a wooden floor from 0.3 m, far from each other, and a
/// glass ball in flight hits another one. `restitutions` is the text of the array.
Scene bounces(const std::string& restitutions) {
  return orAbort(parseScene(R"({
    "duration": 0.7,
    "restitutions": )" + restitutions +
                                R"(,
    "bodies": [
      {"type": "sphere", "name": "steel", "radius": 0.01, "material": "steel",
       "position": [0, 0.31, 0]},
      {"type": "sphere", "name": "rubber", "radius": 0.01, "material": "rubber",
       "position": [1, 0.31, 0]},
      {"type": "sphere", "name": "left", "radius": 0.01, "material": "glass",
       "position": [4, 100, 0], "velocity": [1, 0, 0]},
      {"type": "sphere", "name": "right", "radius": 0.01, "material": "glass",
       "position": [4.12, 100, 0]},
      {"type": "plane", "name": "floor", "normal": [0, 1, 0], "offset": 0, "material": "wood"}
    ],
    "listeners": [{"position": [0, 1, 1]}]
  })",
                            "bounces.json"));
}

/// The loss of two bodies at their collisions: the second approach speed over the first, and the
/// restitution that follows from the first impulse.
struct Bounce {
  double speedRatio = 0.0;
  double impulse = 0.0;
};

Bounce bounceOf(const Scene& scene, BodyId body) {
  const Result<std::vector<ImpulseEvent>> events = sceneEvents(scene);
  EXPECT_TRUE(events);
  std::vector<ImpulseEvent> own;
  for (const ImpulseEvent& event : *events) {
    if (event.body == body) own.push_back(event);
  }
  EXPECT_GE(own.size(), 1u);
  if (own.empty()) return {};
  Bounce bounce;
  bounce.impulse = own[0].impulse.norm() / (own[0].effectiveMass * own[0].approachSpeed) - 1.0;
  if (own.size() > 1) bounce.speedRatio = own[1].approachSpeed / own[0].approachSpeed;
  return bounce;
}

class PairRestitution : public testing::TestWithParam<StepperType> {};

TEST_P(PairRestitution, DecidesHowBodiesBounce) {
  const Scene scene = onStepper(bounces(R"([
      {"materials": ["wood", "steel"], "restitution": 0.5},
      {"materials": ["glass", "glass"], "restitution": 0.25}])"),
                                GetParam(), 1.0 / 1000.0);
  const bool native = GetParam() == StepperType::native;
  const double exact = native ? 1e-12 : 1e-6;  // of the impulse, which Bullet computes in float
  const double path = native ? 1e-12 : 0.05;   // of the speed, as Bullet's path differs
  const Bounce steel = bounceOf(scene, 0);
  EXPECT_NEAR(steel.impulse, 0.5, exact);
  EXPECT_NEAR(steel.speedRatio, 0.5, path);
  // The pair is not in the list: the geometric mean of 0.8 and 0.6.
  const Bounce rubber = bounceOf(scene, 1);
  EXPECT_NEAR(rubber.impulse, std::sqrt(0.48), exact);
  EXPECT_NEAR(rubber.speedRatio, std::sqrt(0.48), path);
  EXPECT_NEAR(bounceOf(scene, 2).impulse, 0.25, exact);
}

TEST_P(PairRestitution, ExtremesArePossible) {
  for (const double restitution : {0.0, 1.0}) {
    const Scene scene = onStepper(bounces(R"([{"materials": ["steel", "wood"], "restitution": )" +
                                          std::to_string(restitution) + "}]"),
                                  GetParam());
    EXPECT_NEAR(bounceOf(scene, 0).impulse, restitution, 1e-6);
  }
}

TEST_P(PairRestitution, OfMaterialsThatDoNotMeetChangesNothing) {
  const Scene plain = onStepper(bounces("[]"), GetParam());
  const auto events = sceneEvents(plain);
  const auto others = sceneEvents(onStepper(
      bounces(R"([{"materials": ["rubber", "steel"], "restitution": 0.5}])"), GetParam()));
  ASSERT_TRUE(events && others);
  ASSERT_EQ(events->size(), others->size());
  EXPECT_GE(events->size(), 8u);
  for (std::size_t event = 0; event < events->size(); ++event) {
    // For a pair that the scene does not list, Bullet multiplies two roots in float: about an ulp
    // away.
    const double allowed = GetParam() == StepperType::native ? 0.0 : 1e-5;
    EXPECT_NEAR((*events)[event].time, (*others)[event].time, allowed);
    EXPECT_NEAR(((*events)[event].impulse - (*others)[event].impulse).norm(), 0.0,
                allowed * (*events)[event].impulse.norm());
  }
}

INSTANTIATE_TEST_SUITE_P(Steppers, PairRestitution,
                         testing::Values(StepperType::native, StepperType::bullet),
                         [](const auto& stepper) {
                           return stepper.param == StepperType::native ? "native" : "bullet";
                         });

TEST(PairRestitutionInBullet, IsHeldAgainstTheReferenceCollisionByCollision) {
  const Scene scene = bounces(R"([
      {"materials": ["wood", "steel"], "restitution": 0.5},
      {"materials": ["rubber", "wood"], "restitution": 0.9},
      {"materials": ["glass", "glass"], "restitution": 0.25}])");
  const std::vector<double> steps = {1.0 / 60.0, 1.0 / 240.0, 1.0 / 1000.0};
  const Result<CompareReport> report = compareScene(scene, steps);
  ASSERT_TRUE(report);
  for (const CompareRun& run : report->runs) {
    EXPECT_GE(run.local.reference, 4u);
    EXPECT_EQ(run.local.missed, 0u) << run.step;
    EXPECT_EQ(run.local.spurious, 0u) << run.step;
    EXPECT_LT(run.local.impulseError.max, 1e-3) << run.step;
  }
}

/// Bullet's world for a scene; speed() is the vertical velocity of body 0, a steel ball, in m/s.
class Drop {
 public:
  explicit Drop(const Scene& scene) : scene_(scene), world_(scene_) {}
  void step() { world_.world().stepSimulation(btScalar(1.0 / 240.0), 0); }
  double speed() const { return static_cast<double>(world_.body(0).getLinearVelocity().y()); }

 private:
  Scene scene_;
  BulletScene world_;
};

TEST(PairRestitutionInBullet, WorldsSideBySideKeepTheirOwn) {
  const CalculateCombinedCallback before = gCalculateCombinedRestitutionCallback;
  const Scene plain = bounces("[]");
  auto soft =
      std::make_unique<Drop>(bounces(R"([{"materials": ["steel", "wood"], "restitution": 0.25}])"));
  EXPECT_NE(gCalculateCombinedRestitutionCallback, before);
  auto hard =
      std::make_unique<Drop>(bounces(R"([{"materials": ["steel", "wood"], "restitution": 0.95}])"));
  Drop other(plain);
  double softest = 0.0;
  double hardest = 0.0;
  double plainest = 0.0;
  for (int step = 0; step < 80; ++step) {
    for (Drop* drop : {soft.get(), hard.get(), &other})
      drop->step();
    softest = std::max(softest, soft->speed());
    hardest = std::max(hardest, hard->speed());
    plainest = std::max(plainest, other.speed());
  }
  const double impact = std::sqrt(2.0 * 9.81 * 0.3);
  EXPECT_NEAR(softest / impact, 0.25, 0.04);
  EXPECT_NEAR(hardest / impact, 0.95, 0.04);
  EXPECT_NEAR(plainest / impact, std::sqrt(0.9 * 0.6), 0.04);
  soft.reset();  // the world that was made first ends first
  EXPECT_NE(gCalculateCombinedRestitutionCallback, before);
  hard.reset();
  EXPECT_EQ(gCalculateCombinedRestitutionCallback, before);
}

btScalar halfOfAll(const btCollisionObject*, const btCollisionObject*) {
  return btScalar(0.5);
}

TEST(PairRestitutionInBullet, BodiesOfOthersAreLeftToWhatWasThere) {
  const CalculateCombinedCallback before = gCalculateCombinedRestitutionCallback;
  gCalculateCombinedRestitutionCallback = halfOfAll;
  {
    const Drop drop(bounces(R"([{"materials": ["steel", "wood"], "restitution": 0.25}])"));
    btSphereShape shape(btScalar(0.1));
    const btRigidBody ball(1, nullptr, &shape);
    const btRigidBody floor(0, nullptr, &shape);
    EXPECT_EQ(gCalculateCombinedRestitutionCallback(&ball, &floor), btScalar(0.5));
  }
  EXPECT_EQ(gCalculateCombinedRestitutionCallback, halfOfAll);
  gCalculateCombinedRestitutionCallback = before;
}

TEST(PairRestitutionInBullet, ScenesWithoutPairsLeaveTheSlotAlone) {
  const CalculateCombinedCallback before = gCalculateCombinedRestitutionCallback;
  const Drop drop(bounces("[]"));
  EXPECT_EQ(gCalculateCombinedRestitutionCallback, before);
}

}  // namespace
}  // namespace carom::test
