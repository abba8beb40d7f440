#pragma once

#include <memory>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include <btBulletDynamicsCommon.h>

namespace carom {

/// A Bullet world as an application has it: bodies of everyday sizes and masses, Bullet's own
/// default settings, and nothing that was made for sound.
class OrdinaryWorld {
 public:
  OrdinaryWorld();
  virtual ~OrdinaryWorld();
  OrdinaryWorld(const OrdinaryWorld&) = delete;
  OrdinaryWorld& operator=(const OrdinaryWorld&) = delete;

  btDiscreteDynamicsWorld& world() { return world_; }
  /// Makes one frame of the application, of 1/`rate` seconds and as many substeps.
  void step(double rate);
  double time() const { return time_; }  ///< s, of all frames so far

 protected:
  /// Drives what the application drives, before each frame.
  virtual void drive() {}

  btRigidBody& add(double mass, btCollisionShape& shape, const btTransform& place);
  btRigidBody& add(double mass, btCollisionShape& shape, const btVector3& place);
  btRigidBody& addFloor();  ///< a box of 100 m, 2 m thick, whose top is at 0
  void add(std::unique_ptr<btTypedConstraint> constraint);
  /// Keeps a shape for as long as the world lives.
  template <class Shape>
  Shape& keep(std::unique_ptr<Shape> shape) {
    Shape& kept = *shape;
    shapes_.push_back(std::move(shape));
    return kept;
  }

 private:
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_{&dispatcher_, &broadphase_, &solver_, &configuration_};
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
  std::vector<std::unique_ptr<btTypedConstraint>> constraints_;
  double time_ = 0.0;
};

struct OrdinaryWorldKind {
  std::string_view name;
  /// True if all bodies lie still, awake, from the beginning.
  bool rests = false;
  std::unique_ptr<OrdinaryWorld> (*make)() = nullptr;
};

/// Returns all ordinary worlds, in a fixed order.
std::span<const OrdinaryWorldKind> ordinaryWorlds();

}  // namespace carom
