// The library that `carom listen` preloads. Its functions take the place of those of Bullet that a
// program steps and destroys worlds with: they tell the library with the sound, and call Bullet's
// own. A call of a virtual function finds them as well, since the tables of classes are filled by
// the same names; and those of derived classes call these (btMultiBodyDynamicsWorld,
// btSoftRigidDynamicsWorld, btDiscreteDynamicsWorldMt), but for
// btDeformableMultiBodyDynamicsWorld, whose steps are its own.
//
// A sound is attached at the first step, not when a world is made: by then the world's derived
// class is complete, and the program has set its callbacks.

#include <cstdio>
#include <cstdlib>

#include "plugin/listen/bullet_function.h"
#include "plugin/listen/listen_protocol.h"
#include "plugin/listen/sound_library.h"

// Bullet's names, by which the compiler makes Bullet's symbols, for both of its scalars at once.
// Nothing of Bullet is included here, nor linked.
class __attribute__((visibility("default"))) btDiscreteDynamicsWorld {
 public:
  ~btDiscreteDynamicsWorld();
  int stepSimulation(float timeStep, int maxSubSteps, float fixedTimeStep);
  int stepSimulation(double timeStep, int maxSubSteps, double fixedTimeStep);
};
class __attribute__((visibility("default"))) btDeformableMultiBodyDynamicsWorld {
 public:
  int stepSimulation(float timeStep, int maxSubSteps, float fixedTimeStep);
  int stepSimulation(double timeStep, int maxSubSteps, double fixedTimeStep);
};

namespace carom::listen {
namespace {

// Never destroyed: worlds may be static.
SoundLibrary& floatLibrary() {
  static SoundLibrary& library = *new SoundLibrary({"float", kFloatLibrary});
  return library;
}
SoundLibrary& doubleLibrary() {
  static SoundLibrary& library = *new SoundLibrary({"double", kDoubleLibrary});
  return library;
}
SoundLibrary& libraryFor(float /*scalar*/) {
  return floatLibrary();
}
SoundLibrary& libraryFor(double /*scalar*/) {
  return doubleLibrary();
}

/// Returns the function of Bullet that a symbol of this library stands for.
template <class Function>
Function bulletFunction(const char* name, const void* world) {
  void* const found = findBulletFunction(name, world);
  if (found == nullptr) {
    std::fprintf(stderr, "carom: listen: Bullet's own function %s is not found\n", name);
    std::abort();
  }
  return reinterpret_cast<Function>(found);
}

/// Tells the library with the sound of a step from its beginning to its end, however it ends.
class HeardStep {
 public:
  HeardStep(const SoundFunctions* functions, void* world) : functions_(functions), world_(world) {
    if (functions_ != nullptr) functions_->beforeStep(world_);
  }
  HeardStep(const HeardStep&) = delete;
  HeardStep& operator=(const HeardStep&) = delete;
  ~HeardStep() {
    if (functions_ != nullptr) functions_->afterStep(world_);
  }

 private:
  const SoundFunctions* functions_;
  void* world_;
};

template <class Scalar>
int step(const char* name, void* world, Scalar timeStep, int maxSubSteps, Scalar fixedTimeStep) {
  using Step = int (*)(void*, Scalar, int, Scalar);
  const auto bulletStep = bulletFunction<Step>(name, world);
  const void* const address = reinterpret_cast<const void*>(bulletStep);
  const HeardStep heard(libraryFor(timeStep).open(address, name), world);
  return bulletStep(world, timeStep, maxSubSteps, fixedTimeStep);
}

void endWorld(void* world) {
  for (const SoundLibrary* library : {&floatLibrary(), &doubleLibrary()})
    if (const SoundFunctions* const functions = library->opened()) functions->worldEnds(world);
}

}  // namespace
}  // namespace carom::listen

int btDiscreteDynamicsWorld::stepSimulation(float timeStep, int maxSubSteps, float fixedTimeStep) {
  return carom::listen::step("_ZN23btDiscreteDynamicsWorld14stepSimulationEfif", this, timeStep,
                             maxSubSteps, fixedTimeStep);
}
int btDiscreteDynamicsWorld::stepSimulation(double timeStep, int maxSubSteps,
                                            double fixedTimeStep) {
  return carom::listen::step("_ZN23btDiscreteDynamicsWorld14stepSimulationEdid", this, timeStep,
                             maxSubSteps, fixedTimeStep);
}
int btDeformableMultiBodyDynamicsWorld::stepSimulation(float timeStep, int maxSubSteps,
                                                       float fixedTimeStep) {
  return carom::listen::step("_ZN34btDeformableMultiBodyDynamicsWorld14stepSimulationEfif", this,
                             timeStep, maxSubSteps, fixedTimeStep);
}
int btDeformableMultiBodyDynamicsWorld::stepSimulation(double timeStep, int maxSubSteps,
                                                       double fixedTimeStep) {
  return carom::listen::step("_ZN34btDeformableMultiBodyDynamicsWorld14stepSimulationEdid", this,
                             timeStep, maxSubSteps, fixedTimeStep);
}

// Bullet's deleting destructor, and those of derived classes, call this one. It is called while the
// world is whole but for what derived classes add.
btDiscreteDynamicsWorld::~btDiscreteDynamicsWorld() {
  using Destroy = void (*)(void*);
  const auto destroy =
      carom::listen::bulletFunction<Destroy>("_ZN23btDiscreteDynamicsWorldD2Ev", this);
  carom::listen::endWorld(this);
  destroy(this);
}
