// A library that links Bullet, which a program without Bullet opens for itself alone.

#include <btBulletDynamicsCommon.h>

extern "C" __attribute__((visibility("default"))) void runListenPlugin() {
  btDefaultCollisionConfiguration parts;
  btCollisionDispatcher dispatcher(&parts);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &parts);
  world.setGravity(btVector3(0, -10, 0));
  btStaticPlaneShape groundShape(btVector3(0, 1, 0), 0);
  btRigidBody ground(0, nullptr, &groundShape);
  world.addRigidBody(&ground);
  btSphereShape ballShape(btScalar(0.1));
  btVector3 inertia(0, 0, 0);
  ballShape.calculateLocalInertia(1, inertia);
  btRigidBody ball(1, nullptr, &ballShape, inertia);
  ball.setWorldTransform(btTransform(btQuaternion::getIdentity(), btVector3(0, 1, 0)));
  world.addRigidBody(&ball);
  for (int frame = 0; frame < 60; ++frame)
    world.stepSimulation(btScalar(1.0 / 60.0), 10);
  world.removeRigidBody(&ball);
  world.removeRigidBody(&ground);
}
