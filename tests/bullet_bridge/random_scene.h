#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <btBulletDynamicsCommon.h>

#include "carom/audio/vector.h"
#include "carom/bullet/bullet_bridge.h"
#include "tests/support/random.h"

namespace carom {

/// A random Bullet world, as unlikely as a host may make it and the same for the same seed: 2 to 20
/// bodies of any shape, 1 mm to 10 m large, with mass ratios to 1e6 : 1, at up to 300 m/s and
/// spinning, most of them thrown at one place, some asleep, some kinematic; over a ground of any
/// kind or none; in steps of 1/30 to 1/2000 s. Between steps the host adds, removes, teleports,
/// kicks, freezes and wakes bodies.
class RandomScene {
 public:
  explicit RandomScene(std::uint64_t seed);
  ~RandomScene();

  btDiscreteDynamicsWorld& world() { return world_; }
  double step() const { return step_; }  ///< s, duration of one substep
  int calls() const { return calls_; }   ///< number of calls of advance() for the scene

  /// Lets the host interfere, then calls stepSimulation once, with one substep or several.
  void advance();
  /// Takes all bodies far apart and stops them, then steps: nothing can collide any longer.
  void calm(int steps);
  /// Number of bodies that there have been.
  int bodiesEver() const { return bodiesEver_; }

 private:
  struct Body {
    std::shared_ptr<btCollisionShape> shape;
    double reach = 0.0;  // m
    std::unique_ptr<btRigidBody> body;
    Vec3 drift = Vec3::Zero();  // m/s, velocity of a kinematic body
  };

  static btDefaultCollisionConstructionInfo smallPools();
  void addGround();
  void addBody();
  void place(Body& body);
  void setUp(Body& body);
  void removeBody(std::size_t which);
  void interfere();
  void moveKinematic();

  Random random_;
  btDefaultCollisionConfiguration configuration_{smallPools()};
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_{&dispatcher_, &broadphase_, &solver_, &configuration_};
  std::vector<Body> bodies_;
  Body ground_;
  double step_ = 0.0;
  int calls_ = 0;
  int substeps_ = 1;  // substeps of a call
  int bodiesEver_ = 0;
  double size_ = 1.0;   // m, size of a typical body of the scene
  double speed_ = 1.0;  // m/s, typical speed in the scene
};

struct RandomSceneResult {
  std::uint64_t substeps = 0;
  std::uint64_t collisions = 0;
  std::uint64_t contacts = 0;     ///< states of lasting contacts
  std::uint64_t unsupported = 0;  ///< scenes in which the bridge met a shape that it does not know
  std::uint64_t digest = 0;       ///< checksum of all events; the same for the same seed
  std::string failure;            ///< empty if no check failed
};

/// Runs the scene of a seed with a bridge and checks everything in its reports that can be checked
/// without knowing what happened: numbers are finite and consistent, events are in time and in
/// pairs, and the counts are complete.
RandomSceneResult runRandomScene(std::uint64_t seed, const BulletBridgeSettings& settings = {});

}  // namespace carom
