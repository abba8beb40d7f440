// The game that all steps begin with, silent: a Bullet world of four bodies, its loop, its camera.

#pragma once

#include <btBulletDynamicsCommon.h>

struct Game {
  btBoxShape floorShape{btVector3(5, btScalar(0.5), 5)};
  btBoxShape crateShape{btVector3(btScalar(0.2), btScalar(0.2), btScalar(0.2))};
  btBoxShape barShape{btVector3(btScalar(0.15), btScalar(0.005), btScalar(0.02))};
  btSphereShape ballShape{btScalar(0.05)};
  btRigidBody floor{0, nullptr, &floorShape};
  btRigidBody crate = body(12, crateShape);             // kg
  btRigidBody bar = body(btScalar(0.942), barShape);    // as much as this bar has, of steel
  btRigidBody ball = body(btScalar(0.524), ballShape);  // as much as water: 1000 kg/m3

  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world{&dispatcher, &broadphase, &solver, &configuration};

  Game() {
    world.setGravity(btVector3(0, btScalar(-9.81), 0));
    put(floor, btVector3(0, btScalar(-0.5), 0), 0);
    put(crate, btVector3(btScalar(-0.6), btScalar(0.6), 0), btScalar(0.3));
    put(ball, btVector3(0, 1, 0), 0);
    put(bar, btVector3(btScalar(0.5), btScalar(0.8), 0), btScalar(0.5));
  }

  // A frame of 1/60 s, in substeps of 1/240 s.
  void step() { world.stepSimulation(btScalar(1.0 / 60.0), 4, btScalar(1.0 / 240.0)); }

  // Looks along -z, as OpenGL's cameras do, with y up.
  btTransform camera() const {
    return btTransform(btQuaternion::getIdentity(), btVector3(0, btScalar(0.8), 2));
  }

 private:
  static btRigidBody body(btScalar mass, btCollisionShape& shape) {
    btVector3 inertia;
    shape.calculateLocalInertia(mass, inertia);
    return btRigidBody(mass, nullptr, &shape, inertia);
  }

  void put(btRigidBody& what, const btVector3& where, btScalar tilt) {
    what.setWorldTransform(btTransform(btQuaternion(btVector3(0, 0, 1), tilt), where));
    what.setRestitution(btScalar(0.6));
    world.addRigidBody(&what);
  }
};
