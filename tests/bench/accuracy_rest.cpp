#include "tests/bench/accuracy_rest.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>

#include "carom/bullet/bullet_bridge.h"
#include "tests/bench/pair_world.h"
#include "tests/support/random.h"

namespace carom::bench {
namespace {

constexpr double kHalf = 0.05;      // m, half extent or radius of a body
constexpr double kSpacing = 0.2;    // m
constexpr double kDuration = 10.0;  // s

void addGround(PairWorld& world, RestCase::Ground ground, double width) {
  if (ground == RestCase::Ground::plane) {
    world.add(std::make_shared<btStaticPlaneShape>(btVector3(0, 1, 0), btScalar(0)),
              {.restitution = 0.8, .friction = 0.5});
    return;
  }
  const btVector3 half = PairWorld::toBullet({0.5 * width + 1.0, 0.5, 0.5 * width + 1.0});
  world.add(std::make_shared<btBoxShape>(half),
            {.position = {0, -0.5, 0}, .restitution = 0.8, .friction = 0.5});
}

void addBodies(PairWorld& world, const RestCase& which, int side) {
  std::shared_ptr<btCollisionShape> shape;
  if (which.shape == RestCase::Shape::sphere) {
    shape = std::make_shared<btSphereShape>(btScalar(kHalf));
  } else {
    shape = std::make_shared<btBoxShape>(PairWorld::toBullet({kHalf, kHalf, kHalf}));
  }
  Random random(1);
  for (int i = 0; i < which.bodies; ++i) {
    const double angle = random.between(0.0, 3.0);
    btRigidBody& body =
        world.add(shape, {.mass = 0.5,
                          .position = {kSpacing * (i % side - 0.5 * side), kHalf,
                                       kSpacing * (i / side - 0.5 * side)},
                          .orientation = Quat(Eigen::AngleAxisd(angle, Vec3::UnitY())),
                          .restitution = 0.8,
                          .friction = 0.5});
    if (!which.maySleep) body.setActivationState(DISABLE_DEACTIVATION);
  }
}

double greatestSpeed(const PairWorld& world) {
  double speed = 0.0;
  for (const auto& body : world.bodies) {
    const double turning = kHalf * double(body->getAngularVelocity().length());
    speed = std::max(speed, turning + double(body->getLinearVelocity().length()));
  }
  return speed;
}

}  // namespace

std::string RestCase::name() const {
  return std::to_string(bodies) + (shape == Shape::sphere ? " spheres" : " boxes") +
         " at rest on " + (ground == Ground::plane ? "a plane" : "a box") +
         (maySleep ? "" : ", kept awake");
}

std::vector<RestCase> restCases(int bodies) {
  std::vector<RestCase> cases;
  for (const auto shape : {RestCase::Shape::sphere, RestCase::Shape::box}) {
    for (const auto ground : {RestCase::Ground::plane, RestCase::Ground::box}) {
      cases.push_back({shape, ground, bodies, false});
      cases.push_back({shape, ground, bodies, true});
      cases.push_back({shape, ground, 10 * bodies, true});
    }
  }
  return cases;
}

RestResult runRest(const RestCase& which, double dt) {
  const int side = int(std::ceil(std::sqrt(double(which.bodies))));
  PairWorld world(9.81);
  addGround(world, which.ground, kSpacing * side);
  addBodies(world, which, side);
  Result<BulletBridge> bridge = BulletBridge::attach(world.world);
  if (!bridge) std::abort();
  RestResult result;
  for (int step = 0; step < int(std::lround(kDuration / dt)); ++step) {
    world.world.stepSimulation(btScalar(dt), 0);
    result.speed = std::max(result.speed, greatestSpeed(world));
    result.events += int(bridge->events().size());
    bridge->clear();
  }
  result.unsupported = bridge->counters().unsupported > 0;
  return result;
}

}  // namespace carom::bench
