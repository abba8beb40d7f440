// A program outside of the repository that uses each component of an installed Carom.

#include <cstdio>

#include <btBulletDynamicsCommon.h>

#include <carom/audio/modal_model_file.h>
#include <carom/audio/synth.h>
#include <carom/bullet/world_advice.h>
#include <carom/event_sound.h>
#include <carom/modal/mesh_analysis.h>
#include <carom/native/sphere_stepper.h>
#include <carom/sound.h>

namespace {

/// Reports that a component did not do what its headers say.
int fail(const char* component) {
  std::fprintf(stderr, "carom::%s does not work\n", component);
  return 1;
}

/// True if two spheres that meet head-on make one collision with two events.
bool nativeWorks() {
  carom::SphereWorld world;
  for (const carom::BodyId id : {0U, 1U}) {
    carom::Sphere sphere;
    sphere.id = id;
    sphere.radius = 0.01;  // m
    sphere.mass = 1.0;     // kg
    sphere.position = {0.1 * id, 0, 0};
    sphere.velocity = {-1.0 * id, 0, 0};
    world.spheres.push_back(sphere);
  }
  carom::Result<carom::SphereStepper> stepper = carom::SphereStepper::create(world);
  return stepper && stepper->advanceTo(0.2).size() == 2;
}

/// True if a steel box of 4 x 6 x 10 cm has modes, and its model's file gives back as many.
bool modalAnalyses() {
  carom::SurfaceMesh box;
  for (const double x : {0.0, 0.04})
    for (const double y : {0.0, 0.06})
      for (const double z : {0.0, 0.1})
        box.vertices.emplace_back(x, y, z);
  box.triangles = {{0, 1, 3}, {0, 3, 2}, {4, 6, 7}, {4, 7, 5}, {0, 4, 5}, {0, 5, 1},
                   {2, 3, 7}, {2, 7, 6}, {0, 2, 6}, {0, 6, 4}, {1, 5, 7}, {1, 7, 3}};
  carom::MeshAnalysisSettings settings;
  settings.radiation.reset();  // would take seconds
  settings.solid.maxModes = 6;
  const carom::Result<carom::MeshAnalysis> analysis =
      carom::analyseMesh(box, *carom::findMaterial("steel"), settings);
  if (!analysis || analysis->model.modes.empty()) return false;
  const char* const file = "consumer.carom_modes";
  if (!carom::writeModalModel(file, analysis->model)) return false;
  const carom::Result<carom::ModalModel> read = carom::readModalModel(file);
  return read && read->modes.size() == analysis->model.modes.size();
}

/// True if a ball that falls 10 cm without a bounce clicks once in 0.2 s.
bool pluginHears(btDynamicsWorld& world) {
  carom::SoundSettings settings;
  settings.clock = carom::SoundClock::simulation;
  carom::Result<carom::Sound> sound = carom::Sound::attach(world, settings);
  if (!sound || !sound->prepareRendering(48000.0)) return false;
  for (int step = 0; step < 48; ++step)
    world.stepSimulation(btScalar(1.0 / 240.0), 0);
  return sound->statistics().events == 1 && sound->close();
}

}  // namespace

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

  if (!carom::Synth::create({}, {carom::Listener()})) return fail("audio");
  if (!modalAnalyses()) return fail("modal");
  if (!nativeWorks()) return fail("native");
  if (!carom::recommend(world, 1.0 / 240.0)) return fail("bullet");
  if (!pluginHears(world)) return fail("plugin");
  std::puts("all components work");
  return 0;
}
