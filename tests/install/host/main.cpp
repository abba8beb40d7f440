// A host whose own folders have the names of Carom's: it finds its own file in its own folder, and
// Carom's below <carom/>.

#include <cstdio>

#include <btBulletDynamicsCommon.h>

#include "audio/volume.h"
#include <carom/sound.h>

int main() {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  btStaticPlaneShape floorShape(btVector3(0, 1, 0), 0);
  btSphereShape ballShape(btScalar(0.01));
  btRigidBody floor(0, nullptr, &floorShape);
  btRigidBody ball(btScalar(0.03), nullptr, &ballShape);
  ball.setWorldTransform(btTransform(btQuaternion::getIdentity(), btVector3(0, btScalar(0.11), 0)));
  world.addRigidBody(&floor);
  world.addRigidBody(&ball);
  carom::SoundSettings settings;
  settings.clock = carom::SoundClock::simulation;
  carom::Result<carom::Sound> sound = carom::Sound::attach(world, settings);
  if (!sound || !sound->prepareRendering(48000.0)) return 1;
  for (int step = 0; step < 48; ++step)
    world.stepSimulation(btScalar(1.0 / 240.0), 0);
  if (kVolume != 11 || sound->statistics().events != 1 || !sound->close()) return 1;
  std::puts("the host works");
  return 0;
}
