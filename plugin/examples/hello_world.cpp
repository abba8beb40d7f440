// A sphere falls on the ground, as in Bullet's own hello world. hello_world.cpp is
// hello_world_silent.cpp and three lines of Carom: see `diff`.

#include <cstdio>

#include <btBulletDynamicsCommon.h>
#include <carom/sound.h>

int main() {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  world.setGravity(btVector3(0, -10, 0));

  btBoxShape groundShape(btVector3(50, 50, 50));
  btRigidBody ground(0, nullptr, &groundShape);
  ground.setWorldTransform(btTransform(btQuaternion::getIdentity(), btVector3(0, -56, 0)));
  world.addRigidBody(&ground);

  btSphereShape sphereShape(1);
  const btScalar mass = 1;
  btVector3 inertia(0, 0, 0);
  sphereShape.calculateLocalInertia(mass, inertia);
  btRigidBody sphere(mass, nullptr, &sphereShape, inertia);
  sphere.setWorldTransform(btTransform(btQuaternion::getIdentity(), btVector3(2, 10, 0)));
  world.addRigidBody(&sphere);

  auto sound = carom::Sound::attach(world, {.record = "hello_world.wav"});
  for (int frame = 0; frame < 150; ++frame) {
    world.stepSimulation(btScalar(1.0 / 60.0), 10);
    const btVector3& place = sphere.getWorldTransform().getOrigin();
    std::printf("sphere at %.3f %.3f %.3f\n", place.x(), place.y(), place.z());
  }

  if (!sound || !sound->close()) return 1;
  world.removeRigidBody(&sphere);
  world.removeRigidBody(&ground);
  return 0;
}
