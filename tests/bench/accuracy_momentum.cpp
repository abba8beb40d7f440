#include "tests/bench/accuracy_momentum.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <vector>

#include "carom/bullet/bullet_bridge.h"
#include "tests/bench/pair_world.h"
#include "tests/bullet_bridge/delivery_time.h"
#include "tests/support/random.h"

namespace carom::bench {
namespace {

constexpr double kGravity = 9.81;  // m/s^2

Vec3 toVec3(const btVector3& v) {
  return {double(v.x()), double(v.y()), double(v.z())};
}

std::shared_ptr<btCollisionShape> randomShape(Random& random) {
  const double size = random.between(0.03, 0.1);
  switch (random.below(4)) {
    case 0:
      return std::make_shared<btBoxShape>(PairWorld::toBullet({size, 0.7 * size, 0.5 * size}));
    case 1:
      return std::make_shared<btCapsuleShape>(btScalar(0.5 * size), btScalar(size));
    default:
      return std::make_shared<btSphereShape>(btScalar(size));
  }
}

/// A body's velocity at the start, and the impulses that were reported for it.
struct Account {
  btRigidBody* body = nullptr;
  BodyId id = 0;
  Vec3 velocityAtStart = Vec3::Zero();
  Vec3 reported = Vec3::Zero();  // N s
  double magnitudes = 0.0;       // N s, sum of the magnitudes reported
};

class Scene {
 public:
  Scene(const MomentumCase& which, int number);
  void run(MomentumResult& result);

 private:
  void addBody(double friction);
  void step();
  void book(BodyId id, const Vec3& impulse);
  void takeApart();
  double imbalanceOf(const Account& account, const Vec3& fallen) const;

  bool told_;
  double dt_;
  Random random_;
  PairWorld world_{kGravity};
  std::vector<Account> accounts_;
  std::vector<BulletBridge> bridge_;  // holds one bridge
};

Scene::Scene(const MomentumCase& which, int number)
    : told_(which.only >= 0), dt_(which.step), random_(std::uint64_t(number)) {
  const double friction = which.friction ? 0.5 : 0.0;
  world_.add(std::make_shared<btStaticPlaneShape>(btVector3(0, 1, 0), btScalar(0)),
             {.restitution = 0.7, .friction = 1.0});
  const int bodies = 2 + random_.below(6);
  for (int i = 0; i < bodies; ++i)
    addBody(friction);
  Result<BulletBridge> bridge = BulletBridge::attach(world_.world);
  if (!bridge) std::abort();
  bridge_.push_back(*std::move(bridge));
  for (Account& account : accounts_)
    account.id = *bridge_.front().bodyId(*account.body);
}

void Scene::addBody(double friction) {
  const Vec3 from = random_.direction();
  const double speed = random_.between(0.5, 4.0);
  const double distance = random_.between(0.2, 0.6);
  btRigidBody& body =
      world_.add(randomShape(random_), {.mass = random_.between(0.1, 2.0),
                                        .position = Vec3(0, 0.8, 0) + distance * from,
                                        .orientation = random_.orientation(),
                                        .velocity = -speed * from,
                                        .angularVelocity = 5.0 * random_.direction(),
                                        .restitution = random_.between(0.2, 1.0),
                                        .friction = friction});
  body.setActivationState(DISABLE_DEACTIVATION);
  Account account;
  account.body = &body;
  account.velocityAtStart = toVec3(body.getLinearVelocity());
  accounts_.push_back(account);
}

void Scene::book(BodyId id, const Vec3& impulse) {
  for (Account& account : accounts_) {
    if (account.id != id) continue;
    account.reported += impulse;
    account.magnitudes += impulse.norm();
  }
}

void Scene::step() {
  world_.world.stepSimulation(btScalar(dt_), 0);
  BulletBridge& bridge = bridge_.front();
  for (const ImpulseEvent& event : bridge.events())
    book(event.body, event.appliedImpulse);
  for (const ContactState& contact : bridge.contacts()) {
    book(contact.body, contact.appliedImpulse);
    book(contact.other, -contact.appliedImpulse);
  }
  bridge.clear();
}

void Scene::takeApart() {
  world_.world.setGravity(btVector3(0, 0, 0));
  for (std::size_t i = 0; i < accounts_.size(); ++i) {
    btTransform pose = accounts_[i].body->getWorldTransform();
    pose.setOrigin(btVector3(btScalar(100 * i), btScalar(1000), 0));
    accounts_[i].body->setCenterOfMassTransform(pose);
  }
  for (int i = 0; i < stepsUntilDelivered(dt_); ++i)
    step();
}

double Scene::imbalanceOf(const Account& account, const Vec3& fallen) const {
  const double mass = 1.0 / double(account.body->getInvMass());
  const Vec3 changed =
      mass * (toVec3(account.body->getLinearVelocity()) - account.velocityAtStart - fallen);
  // A body that nothing has touched has only rounding to compare, so that the scale has a lower
  // bound.
  const double scale = std::max(account.magnitudes, mass * 0.5);
  const Vec3 lacking = changed - account.reported;
  if (told_) {
    std::fprintf(stderr, "  body %u (%s): sum of |J| %.6g N s, not reported (%.3g %.3g %.3g) N s\n",
                 account.id, account.body->getCollisionShape()->getName(), account.magnitudes,
                 lacking.x(), lacking.y(), lacking.z());
  }
  return lacking.norm() / scale;
}

void Scene::run(MomentumResult& result) {
  const int steps = int(random_.between(0.1, 1.0) / dt_);
  for (int i = 0; i < steps; ++i)
    step();
  takeApart();
  if (told_) std::fprintf(stderr, "  %d substeps of 1/%.0f s\n", steps, 1.0 / dt_);
  const Vec3 fallen = -kGravity * steps * double(btScalar(dt_)) * Vec3::UnitY();
  for (const Account& account : accounts_)
    result.imbalance = std::max(result.imbalance, imbalanceOf(account, fallen));
  result.collisions += int(bridge_.front().counters().collisions);
}

}  // namespace

MomentumResult runMomentum(const MomentumCase& which) {
  MomentumResult result;
  for (int number = 0; number < which.scenes; ++number) {
    if (which.only >= 0 && number != which.only) continue;
    const double before = result.imbalance;
    Scene(which, number).run(result);
    if (result.imbalance > before) result.worst = number;
  }
  return result;
}

}  // namespace carom::bench
