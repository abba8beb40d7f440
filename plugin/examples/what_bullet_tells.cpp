// Bullet alone: what its contact callback, its contacts after a step and its contacts after a frame
// say of impacts whose strength is known. docs/bullet_collision_sounds.md quotes what it prints.

#include <cmath>
#include <cstdio>
#include <utility>

#include <btBulletDynamicsCommon.h>

namespace {

constexpr btScalar kGravity = btScalar(9.81);

int processed = 0;           // calls of the callback
int processedWithForce = 0;  // those in which the impulse was not 0

bool onContact(btManifoldPoint& point, void*, void*) {
  ++processed;
  if (point.getAppliedImpulse() != 0) ++processedWithForce;
  return false;
}

// A body of 1 kg above a floor.
struct OneBody {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world{&dispatcher, &broadphase, &solver, &configuration};
  btBoxShape floorShape{btVector3(10, 1, 10)};
  btRigidBody floor{0, nullptr, &floorShape};
  btRigidBody body;

  OneBody(btCollisionShape& shape, btScalar height, btScalar restitution)
      : body(1, nullptr, &shape, inertia(shape)) {
    world.setGravity(btVector3(0, -kGravity, 0));
    put(floor, -1, 1);
    put(body, height, restitution);
  }

  // N s, as Bullet has it at this moment, of all contacts.
  btScalar impulse() {
    btScalar sum = 0;
    for (int index = 0; index < dispatcher.getNumManifolds(); ++index) {
      const btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(index);
      for (int point = 0; point < manifold.getNumContacts(); ++point)
        sum += manifold.getContactPoint(point).getAppliedImpulse();
    }
    return sum;
  }

 private:
  static btVector3 inertia(const btCollisionShape& shape) {
    btVector3 inertia;
    shape.calculateLocalInertia(1, inertia);
    return inertia;
  }
  void put(btRigidBody& object, btScalar height, btScalar restitution) {
    object.setWorldTransform(btTransform(btQuaternion::getIdentity(), btVector3(0, height, 0)));
    object.setRestitution(restitution);
    world.addRigidBody(&object);
  }
};

// A ball falls by half a metre; its first impact, and the speed with which it leaves.
void fall(btScalar step) {
  btSphereShape shape(btScalar(0.05));
  OneBody fallen(shape, btScalar(0.55), btScalar(0.9));
  processed = processedWithForce = 0;
  while (fallen.impulse() == 0)
    fallen.world.stepSimulation(step, 1, step);
  const double speed = std::sqrt(2 * double(kGravity) * 0.5);
  std::printf(
      "1/%.0f s: callback %s, after the step %.2f N s of %.2f, leaves at %.2f m/s of %.2f\n",
      1 / double(step), processedWithForce > 0 ? "has the impulse" : "says 0",
      double(fallen.impulse()), 1.9 * speed, double(fallen.body.getLinearVelocity().y()),
      0.9 * speed);
}

// Two hundred balls from different heights, for a second each, at 60 frames of four substeps.
void poll() {
  int impacts = 0;
  int seen = 0;
  for (int ball = 0; ball < 200; ++ball) {
    btSphereShape shape(btScalar(0.05));
    OneBody polled(shape, btScalar(0.55) + btScalar(0.001) * btScalar(ball), btScalar(0.9));
    const auto count = [](btDynamicsWorld* world, btScalar) {
      auto& self = *static_cast<std::pair<OneBody*, int*>*>(world->getWorldUserInfo());
      if (self.first->impulse() > 1) ++*self.second;
    };
    std::pair<OneBody*, int*> counter(&polled, &impacts);
    polled.world.setInternalTickCallback(count, &counter);
    for (int frame = 0; frame < 60; ++frame) {
      polled.world.stepSimulation(btScalar(1.0 / 60.0), 4, btScalar(1.0 / 240.0));
      if (polled.impulse() > 1) ++seen;
    }
  }
  std::printf("%d impacts; contacts read once a frame show %d of them\n", impacts, seen);
}

// A box that lies still: the callback for a second, and the impulse after it has fallen asleep.
void rest() {
  btBoxShape shape(btVector3(btScalar(0.1), btScalar(0.1), btScalar(0.1)));
  OneBody resting(shape, btScalar(0.1), 0);
  processed = 0;
  for (int frame = 0; frame < 60; ++frame)
    resting.world.stepSimulation(btScalar(1.0 / 60.0), 4, btScalar(1.0 / 240.0));
  const int calls = processed;
  for (int frame = 0; frame < 540; ++frame)
    resting.world.stepSimulation(btScalar(1.0 / 60.0), 4, btScalar(1.0 / 240.0));
  std::printf("at rest: %d calls in a second; %s, and its contacts still say %.4f N s\n", calls,
              resting.body.isActive() ? "awake" : "asleep", double(resting.impulse()));
}

}  // namespace

int main() {
  gContactProcessedCallback = onContact;
  fall(btScalar(1.0 / 60.0));
  fall(btScalar(1.0 / 240.0));
  fall(btScalar(1.0 / 1000.0));
  poll();
  rest();
  return 0;
}
