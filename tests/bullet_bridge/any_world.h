#pragma once

#include <cmath>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include <BulletCollision/CollisionDispatch/btCollisionDispatcherMt.h>
#include <BulletDynamics/Dynamics/btDiscreteDynamicsWorldMt.h>
#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <LinearMath/btThreads.h>
#include <btBulletDynamicsCommon.h>
#include <gtest/gtest.h>

#include "carom/bullet/bullet_bridge.h"
#include "tests/bullet_bridge/vectors.h"

namespace carom {

constexpr bool kDoubleBullet = sizeof(btScalar) == 8;

inline btTransform poseAt(const Vec3& position, const btQuaternion& turn = {0, 0, 0, 1}) {
  return btTransform(turn, bt(position));
}

enum class WorldKind { discrete, multithreaded, multibody, soft };
enum class BroadphaseKind { tree, sweep, simple };

/// One of Bullet's worlds with Bullet's defaults, as a host would build it. The kind decides the
/// world, its solver, its dispatcher and its collision configuration.
class AnyWorld {
 public:
  explicit AnyWorld(double gravity = 0.0, WorldKind kind = WorldKind::discrete,
                    BroadphaseKind broadphase = BroadphaseKind::tree) {
    build(kind, broadphase);
    world->setGravity(bt({0, -gravity, 0}));
  }
  ~AnyWorld() {
    while (!bodies.empty())
      remove(*bodies.back());
  }
  AnyWorld(const AnyWorld&) = delete;
  AnyWorld& operator=(const AnyWorld&) = delete;

  struct Body {
    double mass = 1.0;  ///< kg; 0 is immovable
    Vec3 position = Vec3::Zero();
    Vec3 velocity = Vec3::Zero();
    Vec3 spin = Vec3::Zero();
    double restitution = 1.0;  ///< for Bullet, which takes the product of both bodies'
    double friction = 0.0;
    btQuaternion turn{0, 0, 0, 1};
    btMotionState* mover = nullptr;  ///< moves the body, which is then kinematic
  };

  template <class Shape, class... Arguments>
  Shape& shape(Arguments&&... arguments) {
    auto made = std::make_unique<Shape>(std::forward<Arguments>(arguments)...);
    Shape& result = *made;
    shapes.push_back(std::move(made));
    return result;
  }
  btCollisionShape& sphere(double radius) { return shape<btSphereShape>(btScalar(radius)); }
  btCollisionShape& box(const Vec3& half) { return shape<btBoxShape>(bt(half)); }
  btCollisionShape& plane() { return shape<btStaticPlaneShape>(btVector3(0, 1, 0), btScalar(0)); }

  btRigidBody& add(btCollisionShape& of, const Body& is) {
    btVector3 inertia(0, 0, 0);
    if (is.mass > 0.0) of.calculateLocalInertia(btScalar(is.mass), inertia);
    btRigidBody::btRigidBodyConstructionInfo info(btScalar(is.mass), is.mover, &of, inertia);
    info.m_startWorldTransform = poseAt(is.position, is.turn);
    bodies.push_back(std::make_unique<btRigidBody>(info));
    btRigidBody& body = *bodies.back();
    body.setRestitution(btScalar(is.restitution));
    body.setFriction(btScalar(is.friction));
    body.setLinearVelocity(bt(is.velocity));
    body.setAngularVelocity(bt(is.spin));
    if (is.mover != nullptr) {
      body.setCollisionFlags(body.getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
      body.setActivationState(DISABLE_DEACTIVATION);
    }
    world->addRigidBody(&body);
    return body;
  }
  btRigidBody& addGround(btCollisionShape& of, double friction = 0.0, double top = 0.0) {
    return add(of, {.mass = 0, .position = {0, top, 0}, .friction = friction});
  }

  void remove(btRigidBody& body) {
    world->removeRigidBody(&body);
    std::erase_if(bodies, [&](const auto& owned) { return owned.get() == &body; });
  }

  void step(double dt, int count = 1) {
    for (int i = 0; i < count; ++i)
      world->stepSimulation(btScalar(dt), 0);
  }
  void stepUntil(const BulletBridge& bridge, double time, double dt) {
    while (bridge.time() < time)
      step(dt);
  }

  BulletBridge attach(const BulletBridgeSettings& settings = {}) {
    Result<BulletBridge> bridge = BulletBridge::attach(*world, settings);
    EXPECT_TRUE(bridge);
    return *std::move(bridge);
  }

 private:
  static std::unique_ptr<btBroadphaseInterface> made(BroadphaseKind kind) {
    if (kind == BroadphaseKind::sweep)
      return std::make_unique<btAxisSweep3>(btVector3(-100, -100, -100), btVector3(100, 100, 100));
    if (kind == BroadphaseKind::simple) return std::make_unique<btSimpleBroadphase>();
    return std::make_unique<btDbvtBroadphase>();
  }

  void build(WorldKind kind, BroadphaseKind broadphase) {
    configuration_ = kind == WorldKind::soft
                         ? std::make_unique<btSoftBodyRigidBodyCollisionConfiguration>()
                         : std::make_unique<btDefaultCollisionConfiguration>();
    broadphase_ = made(broadphase);
    if (kind == WorldKind::multithreaded) return buildMultithreaded();
    dispatcher_ = std::make_unique<btCollisionDispatcher>(configuration_.get());
    if (kind == WorldKind::multibody) {
      auto solver = std::make_unique<btMultiBodyConstraintSolver>();
      world = std::make_unique<btMultiBodyDynamicsWorld>(dispatcher_.get(), broadphase_.get(),
                                                         solver.get(), configuration_.get());
      solver_ = std::move(solver);
      return;
    }
    solver_ = std::make_unique<btSequentialImpulseConstraintSolver>();
    if (kind == WorldKind::soft) {
      world = std::make_unique<btSoftRigidDynamicsWorld>(dispatcher_.get(), broadphase_.get(),
                                                         solver_.get(), configuration_.get());
    } else {
      world = std::make_unique<btDiscreteDynamicsWorld>(dispatcher_.get(), broadphase_.get(),
                                                        solver_.get(), configuration_.get());
    }
  }

  void buildMultithreaded() {
    btSetTaskScheduler(btGetSequentialTaskScheduler());
    dispatcher_ = std::make_unique<btCollisionDispatcherMt>(configuration_.get());
    auto pool = std::make_unique<btConstraintSolverPoolMt>(2);
    world = std::make_unique<btDiscreteDynamicsWorldMt>(dispatcher_.get(), broadphase_.get(),
                                                        pool.get(), nullptr, configuration_.get());
    solver_ = std::move(pool);
  }

  std::unique_ptr<btCollisionConfiguration> configuration_;
  std::unique_ptr<btCollisionDispatcher> dispatcher_;
  std::unique_ptr<btBroadphaseInterface> broadphase_;
  std::unique_ptr<btConstraintSolver> solver_;

 public:
  std::unique_ptr<btDiscreteDynamicsWorld> world;
  std::vector<std::unique_ptr<btCollisionShape>> shapes;
  std::vector<std::unique_ptr<btRigidBody>> bodies;
};

inline std::vector<ImpulseEvent> eventsOf(const BulletBridge& bridge,
                                          const btCollisionObject& object) {
  std::vector<ImpulseEvent> events;
  for (const ImpulseEvent& event : bridge.events()) {
    if (event.body == *bridge.bodyId(object)) events.push_back(event);
  }
  return events;
}

/// Returns the time in [low, high] at which a gap that is positive at `low` and not at `high`
/// closes, by bisection.
inline double closingTime(const std::function<double(double)>& gap, double low, double high) {
  for (int i = 0; i < 200; ++i) {
    const double middle = 0.5 * (low + high);
    (gap(middle) > 0.0 ? low : high) = middle;
  }
  return low;
}

/// The free fall of a body from rest by `height`, by hand as Bullet steps it (symplectic Euler):
/// its time and final speed, on the parabolas through the nodes.
struct Fall {
  double time = 0.0;   // s
  double speed = 0.0;  // m/s
};

inline Fall fallByHand(double height, double gravity, double step) {
  const auto dt = double(btScalar(step));
  double y = height;
  double v = 0.0;
  for (double start = 0.0;; start += dt) {
    const double next = v - gravity * dt;
    const auto path = [&](double s) { return y + next * s + gravity * s * (dt - s) / 2.0; };
    if (path(dt) <= 0.0) {
      const double s = closingTime(path, 0.0, dt);
      return {start + s, -(next + gravity * (dt / 2.0 - s))};
    }
    y = path(dt);
    v = next;
  }
}

}  // namespace carom
