// Bullet alone: one line for each impact, with its strength, from an action that runs after every
// substep. A ball and a box fall on a floor; what rests and what slides is not reported.

#include <algorithm>
#include <cstdio>
#include <map>
#include <utility>

#include <btBulletDynamicsCommon.h>

namespace {

struct HitVelocity {
  btVector3 linear;
  btVector3 angular;
};

class HitListener : public btActionInterface {
 public:
  explicit HitListener(btDynamicsWorld& world) : world_(world) {
    world.setInternalTickCallback(&HitListener::beforeSubstep, this, true);
    world.addAction(this);
  }
  ~HitListener() override {
    world_.removeAction(this);
    world_.setInternalTickCallback(nullptr, nullptr, true);
  }
  HitListener(const HitListener&) = delete;
  HitListener& operator=(const HitListener&) = delete;

  int hits() const { return hits_; }

  // Bullet calls it at the end of each substep: contacts and impulses are those of this substep.
  void updateAction(btCollisionWorld*, btScalar dt) override {
    time_ += dt;
    ++substep_;
    btDispatcher& dispatcher = *world_.getDispatcher();
    for (int index = 0; index < dispatcher.getNumManifolds(); ++index)
      look(*dispatcher.getManifoldByIndexInternal(index), dt);
  }
  void debugDraw(btIDebugDraw*) override {}

 private:
  using HitPair = std::pair<const btCollisionObject*, const btCollisionObject*>;

  // The velocities before the solver: the only ones that tell an approach.
  static void beforeSubstep(btDynamicsWorld* world, btScalar) {
    auto& self = *static_cast<HitListener*>(world->getWorldUserInfo());
    self.before_.clear();
    for (int index = 0; index < world->getNumCollisionObjects(); ++index)
      if (const auto* body = btRigidBody::upcast(world->getCollisionObjectArray()[index]))
        self.before_[body] = {body->getLinearVelocity(), body->getAngularVelocity()};
  }

  btVector3 velocity(const btRigidBody& body, const btVector3& point) {
    const HitVelocity& velocity = before_[&body];
    return velocity.linear + velocity.angular.cross(point - body.getCenterOfMassPosition());
  }

  void look(const btPersistentManifold& manifold, btScalar dt) {
    const auto* first = btRigidBody::upcast(manifold.getBody0());
    const auto* second = btRigidBody::upcast(manifold.getBody1());
    if (!first || !second) return;
    btScalar speed = 0;    // m/s, of the point that approaches fastest
    btScalar impulse = 0;  // N s
    for (int index = 0; index < manifold.getNumContacts(); ++index) {
      const btManifoldPoint& point = manifold.getContactPoint(index);
      if (point.getAppliedImpulse() <= 0) continue;  // the solver has had nothing to do there
      const btVector3 place = point.getPositionWorldOnB();
      const btVector3 normal = point.m_normalWorldOnB;
      const btScalar approach = (velocity(*second, place) - velocity(*first, place)).dot(normal);
      if (approach <= speed) continue;
      speed = approach;
      impulse = (1 + point.m_combinedRestitution) * approach /
                (first->computeImpulseDenominator(place, normal) +
                 second->computeImpulseDenominator(place, normal));
    }
    const btScalar support = 2 * world_.getGravity().length() * dt;  // what rests comes that fast
    if (speed <= support) return;
    const auto [hit, isNew] = last_.insert({HitPair(first, second), substep_});
    if (isNew || substep_ - hit->second > 2) {  // an impact may take three substeps
      ++hits_;
      std::printf("%.4f s: %.2f m/s, %.3f N s\n", double(time_), double(speed), double(impulse));
    }
    hit->second = substep_;
  }

  btDynamicsWorld& world_;
  std::map<const btRigidBody*, HitVelocity> before_;
  std::map<HitPair, long> last_;  // the latest substep in which the pair was hit
  btScalar time_ = 0;
  long substep_ = 0;
  int hits_ = 0;
};

}  // namespace

int main() {
  btBoxShape floorShape(btVector3(10, 1, 10));
  btSphereShape ballShape(btScalar(0.05));
  btBoxShape boxShape(btVector3(btScalar(0.1), btScalar(0.1), btScalar(0.1)));
  btVector3 inertia;
  boxShape.calculateLocalInertia(1, inertia);
  btRigidBody floor(0, nullptr, &floorShape);
  btRigidBody ball(1, nullptr, &ballShape);
  btRigidBody box(1, nullptr, &boxShape, inertia);
  const auto place = [](btRigidBody& body, btScalar x, btScalar y, btScalar restitution) {
    body.setWorldTransform(btTransform(btQuaternion::getIdentity(), btVector3(x, y, 0)));
    body.setRestitution(restitution);
  };
  place(floor, 0, -1, 1);
  place(ball, -1, btScalar(0.55), btScalar(0.9));
  place(box, 1, btScalar(0.6), btScalar(0.2));

  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  world.setGravity(btVector3(0, btScalar(-9.81), 0));
  for (btRigidBody* body : {&floor, &ball, &box})
    world.addRigidBody(body);

  HitListener listener(world);
  for (int frame = 0; frame < 60; ++frame)
    world.stepSimulation(btScalar(1.0 / 60.0), 4, btScalar(1.0 / 240.0));
  std::printf("%d hits\n", listener.hits());
  return 0;
}
