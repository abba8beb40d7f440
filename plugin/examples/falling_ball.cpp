// A steel ball falls on a floor. Writes ball.wav, two seconds.

#include <cstdio>

#include <btBulletDynamicsCommon.h>
#include <carom/sound.h>

namespace {

int fail(const carom::Error& error) {
  std::fprintf(stderr, "%s\n", error.message.c_str());
  return 1;
}

}  // namespace

int main() {
  // Bullet, as any application has it: a floor, and a ball of 1 cm half a metre above it.
  btStaticPlaneShape floorShape(btVector3(0, 1, 0), 0);
  btSphereShape ballShape(btScalar(0.01));
  btRigidBody floor(0, nullptr, &floorShape);
  btRigidBody ball(btScalar(0.033), nullptr, &ballShape);
  ball.setWorldTransform(btTransform(btQuaternion::getIdentity(), btVector3(0, btScalar(0.51), 0)));
  floor.setRestitution(btScalar(0.8));
  ball.setRestitution(btScalar(0.9));

  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  world.setGravity(btVector3(0, btScalar(-9.81), 0));
  world.addRigidBody(&floor);
  world.addRigidBody(&ball);

  // Carom: attached once. Materials are guessed from mass and volume unless they are set.
  carom::SoundSettings settings;
  settings.listeners = {{"ear", {0.6, 0.7, 0.4}}};  // m, one channel each
  settings.record = "ball.wav";                     // or settings.play = true
  carom::Result<carom::Sound> sound = carom::Sound::attach(world, settings);
  if (!sound) return fail(sound.error());
  const carom::Status set = sound->assign(ball, {.material = "steel"});
  if (!set) return fail(set.error());

  for (int frame = 0; frame < 120; ++frame)
    world.stepSimulation(btScalar(1.0 / 60.0), 10, btScalar(1.0 / 240.0));

  const carom::SoundStatistics heard = sound->statistics();
  const carom::Status closed = sound->close();
  if (!closed) return fail(closed.error());
  std::printf("ball.wav: %llu clicks\n", static_cast<unsigned long long>(heard.events));
  return 0;
}
