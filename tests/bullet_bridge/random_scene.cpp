#include "tests/bullet_bridge/random_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btScaledBvhTriangleMeshShape.h>

#include "tests/bullet_bridge/sphere_world.h"

namespace carom {
namespace {

constexpr double kSmallest = 0.001;  // m
constexpr double kLargest = 10.0;    // m

btVector3 toBullet(const Vec3& v) {
  return SphereBulletWorld::toBullet(v);
}

btTransform poseOf(const Vec3& position, const Quat& turned) {
  const btQuaternion rotation(btScalar(turned.x()), btScalar(turned.y()), btScalar(turned.z()),
                              btScalar(turned.w()));
  return btTransform(rotation, toBullet(position));
}

using Shape = std::shared_ptr<btCollisionShape>;

// A shape that keeps alive the others that it refers to.
template <class Base>
struct Owning : Base {
  using Base::Base;
  std::vector<std::shared_ptr<void>> owned;
};

Vec3 proportions(Random& random, double size) {
  return size *
         Vec3{random.logBetween(0.1, 1), random.logBetween(0.1, 1), random.logBetween(0.1, 1)};
}

Shape randomCylinder(Random& random, double size) {
  const Vec3 half = proportions(random, size);
  const double radius = half.x();
  switch (random.below(3)) {
    case 0:
      return std::make_shared<btCylinderShape>(toBullet({radius, half.y(), radius}));
    case 1:
      return std::make_shared<btCylinderShapeX>(toBullet({half.y(), radius, radius}));
    default:
      return std::make_shared<btCylinderShapeZ>(toBullet({radius, radius, half.y()}));
  }
}

Shape randomHull(Random& random, double size) {
  auto hull = std::make_shared<btConvexHullShape>();
  const Vec3 extent = proportions(random, size);
  const int points = 4 + random.below(12);
  for (int i = 0; i < points; ++i)
    hull->addPoint(toBullet(random.inCube().cwiseProduct(extent)));
  if (random.chance(0.5)) hull->setMargin(btScalar(0.01 * size));
  return hull;
}

Shape randomMultiSphere(Random& random, double size) {
  std::array<btVector3, 4> centres;
  std::array<btScalar, 4> radii{};
  const int count = 1 + random.below(4);
  for (std::size_t i = 0; i < 4; ++i) {
    centres[i] = toBullet(0.5 * size * random.inCube());
    radii[i] = btScalar(random.between(0.1, 0.5) * size);
  }
  return std::make_shared<btMultiSphereShape>(centres.data(), radii.data(), count);
}

Shape randomConvex(Random& random, double size);

// A scaled convex shape; btUniformScalingShape takes no other shapes.
Shape randomScaled(Random& random, double size) {
  const double factor = random.logBetween(0.2, 5.0);
  auto inner = std::dynamic_pointer_cast<btConvexShape>(randomConvex(random, size / factor));
  auto scaled = std::make_shared<Owning<btUniformScalingShape>>(inner.get(), btScalar(factor));
  scaled->owned.push_back(inner);
  return scaled;
}

Shape randomConvex(Random& random, double size) {
  switch (random.below(8)) {
    case 0:
      return std::make_shared<btSphereShape>(btScalar(size));
    case 1:
      return std::make_shared<btBoxShape>(toBullet(proportions(random, size)));
    case 2:
      return std::make_shared<btCapsuleShape>(btScalar(size * random.between(0.1, 0.5)),
                                              btScalar(size * random.between(0.1, 1.5)));
    case 3:
      return randomCylinder(random, size);
    case 4:
      return std::make_shared<btConeShape>(btScalar(size * random.between(0.2, 1)),
                                           btScalar(size * random.between(0.2, 1)));
    case 5:
      return randomHull(random, size);
    case 6:
      return randomMultiSphere(random, size);
    default: {
      Shape stretched = std::make_shared<btBoxShape>(toBullet(proportions(random, size)));
      stretched->setLocalScaling(toBullet(proportions(random, 1.0)));
      return stretched;
    }
  }
}

Shape randomCompound(Random& random, double size) {
  auto compound = std::make_shared<Owning<btCompoundShape>>();
  const int children = 1 + random.below(4);
  for (int i = 0; i < children; ++i) {
    const Shape child = randomConvex(random, 0.5 * size);
    const Vec3 where = 0.6 * size * random.inCube();
    compound->addChildShape(poseOf(where, random.orientation()), child.get());
    compound->owned.push_back(child);
  }
  return compound;
}

Shape randomShape(Random& random, double size) {
  const int kind = random.below(10);
  if (kind < 2) return randomCompound(random, size);
  if (kind < 3) return randomScaled(random, size);
  return randomConvex(random, size);
}

// ---- grounds, about the origin, as wide as `width`

constexpr int kCells = 8;  // cells along a side

Shape bumpyMesh(Random& random, double width, bool scaled) {
  auto triangles = std::make_shared<btTriangleMesh>();
  std::array<std::array<btVector3, kCells + 1>, kCells + 1> points;
  for (int i = 0; i <= kCells; ++i) {
    for (int j = 0; j <= kCells; ++j) {
      const double height = random.between(-0.03, 0.03);
      points[std::size_t(i)][std::size_t(j)] =
          toBullet(width * Vec3(double(i) / kCells - 0.5, height, double(j) / kCells - 0.5));
    }
  }
  for (std::size_t i = 0; i < kCells; ++i) {
    for (std::size_t j = 0; j < kCells; ++j) {
      triangles->addTriangle(points[i][j], points[i][j + 1], points[i + 1][j]);
      triangles->addTriangle(points[i + 1][j], points[i][j + 1], points[i + 1][j + 1]);
    }
  }
  auto mesh = std::make_shared<Owning<btBvhTriangleMeshShape>>(triangles.get(), true);
  mesh->owned.push_back(triangles);
  if (!scaled) return mesh;
  auto stretched =
      std::make_shared<Owning<btScaledBvhTriangleMeshShape>>(mesh.get(), toBullet({1.3, 0.7, 1.1}));
  stretched->owned.push_back(mesh);
  return stretched;
}

Shape heightField(Random& random, double width) {
  constexpr int kSide = kCells + 1;
  auto heights = std::make_shared<std::vector<btScalar>>();  // btScalar even for PHY_FLOAT
  for (int i = 0; i < kSide * kSide; ++i)
    heights->push_back(btScalar(width * random.between(-0.03, 0.03)));
  auto field = std::make_shared<Owning<btHeightfieldTerrainShape>>(
      kSide, kSide, heights->data(), btScalar(1), btScalar(-0.03 * width), btScalar(0.03 * width),
      1, PHY_FLOAT, false);
  field->owned.push_back(heights);
  field->setLocalScaling(toBullet({width / kCells, 1, width / kCells}));
  return field;
}

Shape randomGround(Random& random, double width) {
  switch (random.below(6)) {
    case 0:
      return nullptr;
    case 1:
      return std::make_shared<btStaticPlaneShape>(
          toBullet((Vec3::UnitY() + 0.1 * random.inCube()).normalized()), btScalar(0));
    case 2:
      return bumpyMesh(random, width, false);
    case 3:
      return bumpyMesh(random, width, true);
    case 4:
      return heightField(random, width);
    default:
      return std::make_shared<btBoxShape>(toBullet(width * Vec3(0.5, 0.1, 0.5)));
  }
}

double reachOf(const btCollisionShape& shape) {
  btVector3 centre;
  btScalar radius = 0;
  shape.getBoundingSphere(centre, radius);
  return double(centre.length() + radius);
}

}  // namespace

btDefaultCollisionConstructionInfo RandomScene::smallPools() {
  btDefaultCollisionConstructionInfo info;
  info.m_defaultMaxPersistentManifoldPoolSize = 64;
  info.m_defaultMaxCollisionAlgorithmPoolSize = 64;
  return info;
}

RandomScene::RandomScene(std::uint64_t number) : random_(number) {
  step_ = double(btScalar(1.0 / random_.logBetween(30, 2000)));
  calls_ = 10 + random_.below(31);
  if (random_.chance(0.2)) substeps_ = 1 + random_.below(4);
  calls_ = std::max(10 / substeps_, calls_ / substeps_);
  size_ = random_.logBetween(kSmallest, kLargest);
  speed_ = random_.logBetween(0.01, 300.0);
  world_.setGravity(btVector3(0, btScalar(random_.chance(0.7) ? -9.81 : 0.0), 0));
  solver_.reset();
  addGround();
  const int count = 2 + random_.below(19);
  for (int i = 0; i < count; ++i)
    addBody();
}

RandomScene::~RandomScene() {
  for (const Body& body : bodies_)
    world_.removeRigidBody(body.body.get());
  if (ground_.body) world_.removeRigidBody(ground_.body.get());
}

void RandomScene::addGround() {
  ground_.shape = randomGround(random_, 40.0 * size_);
  if (!ground_.shape) return;
  ground_.body = std::make_unique<btRigidBody>(btScalar(0), nullptr, ground_.shape.get());
  ground_.body->setRestitution(btScalar(random_.between(0, 1)));
  ground_.body->setFriction(btScalar(random_.between(0, 1)));
  world_.addRigidBody(ground_.body.get());
  ++bodiesEver_;
}

// Adds a body, in most cases of the scene's size, in some of another.
void RandomScene::addBody() {
  const double size = random_.chance(0.8)
                          ? std::clamp(size_ * random_.logBetween(0.3, 3.0), kSmallest, kLargest)
                          : random_.logBetween(kSmallest, kLargest);
  Body body;
  body.shape = randomShape(random_, size);
  body.reach = reachOf(*body.shape);
  const bool fixed = random_.chance(0.1);
  const btScalar mass = fixed ? btScalar(0) : btScalar(random_.logBetween(1e-3, 1e3));
  btVector3 inertia(0, 0, 0);
  if (!fixed) body.shape->calculateLocalInertia(mass, inertia);
  body.body = std::make_unique<btRigidBody>(mass, nullptr, body.shape.get(), inertia);
  place(body);
  setUp(body);
  world_.addRigidBody(body.body.get());
  ++bodiesEver_;
  bodies_.push_back(std::move(body));
}

// Places a body somewhere around the middle of the scene and sends it there.
void RandomScene::place(Body& body) {
  const double speed = std::min(300.0, speed_ * random_.logBetween(0.1, 3.0));
  const double duration = step_ * calls_ * substeps_;
  Vec3 from = random_.direction();
  from.y() = std::abs(from.y());
  const double distance = body.reach + size_ + speed * random_.between(0.0, duration);
  const Vec3 aim = size_ * random_.inCube() + Vec3(0, size_, 0);
  body.body->setCenterOfMassTransform(poseOf(aim + distance * from, random_.orientation()));
  body.body->setLinearVelocity(toBullet(-speed * from));
  const double spin = random_.chance(0.5) ? 0.0 : random_.logBetween(0.1, 300.0);
  body.body->setAngularVelocity(toBullet(spin * random_.direction()));
  body.drift = -speed * from;
}

void RandomScene::setUp(Body& body) {
  btRigidBody& rigid = *body.body;
  rigid.setRestitution(btScalar(random_.between(0, 1)));
  rigid.setFriction(btScalar(random_.chance(0.3) ? 0 : random_.between(0, 1)));
  if (random_.chance(0.1)) rigid.setRollingFriction(btScalar(0.1));
  if (random_.chance(0.1)) rigid.setDamping(btScalar(0.1), btScalar(0.1));
  if (random_.chance(0.1)) {
    rigid.setCcdMotionThreshold(btScalar(body.reach));
    rigid.setCcdSweptSphereRadius(btScalar(0.2 * body.reach));
  }
  if (random_.chance(0.08)) {
    rigid.setCollisionFlags(rigid.getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
    rigid.setActivationState(DISABLE_DEACTIVATION);
  } else if (random_.chance(0.1)) {
    rigid.setLinearVelocity(btVector3(0, 0, 0));
    rigid.setAngularVelocity(btVector3(0, 0, 0));
    rigid.setActivationState(ISLAND_SLEEPING);
  }
}

void RandomScene::removeBody(std::size_t which) {
  world_.removeRigidBody(bodies_[which].body.get());
  bodies_.erase(bodies_.begin() + std::ptrdiff_t(which));
}

// Does something that a host may do between steps.
void RandomScene::interfere() {
  if (bodies_.empty() || random_.chance(0.05)) return addBody();
  const auto which = std::size_t(random_.below(int(bodies_.size())));
  Body& body = bodies_[which];
  switch (random_.below(7)) {
    case 0:
      return removeBody(which);
    case 1:
      return place(body);  // teleports it
    case 2:
      return body.body->setLinearVelocity(toBullet(speed_ * random_.direction()));
    case 3:
      return body.body->forceActivationState(ISLAND_SLEEPING);
    case 4:
      return body.body->activate(true);
    case 5:
      return body.body->applyCentralForce(toBullet(
          speed_ / step_ / double(body.body->getInvMass() + btScalar(1e-3)) * random_.direction()));
    default:
      world_.removeRigidBody(body.body.get());  // and back: another body for Bullet
      world_.addRigidBody(body.body.get());
      ++bodiesEver_;
  }
}

void RandomScene::moveKinematic() {
  for (Body& body : bodies_) {
    if (!body.body->isKinematicObject()) continue;
    btTransform pose = body.body->getWorldTransform();
    pose.setOrigin(pose.getOrigin() + toBullet(step_ * substeps_ * body.drift));
    body.body->setWorldTransform(pose);
  }
}

void RandomScene::advance() {
  if (random_.chance(0.1)) interfere();
  moveKinematic();
  if (substeps_ == 1) {
    world_.stepSimulation(btScalar(step_), 0);
  } else {
    world_.stepSimulation(btScalar(step_ * substeps_), 2 * substeps_, btScalar(step_));
  }
}

void RandomScene::calm(int steps) {
  world_.setGravity(btVector3(0, 0, 0));
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    btRigidBody& body = *bodies_[i].body;
    const Vec3 place(1000.0 + 200.0 * double(i), 5000.0, 0);
    body.setCenterOfMassTransform(poseOf(place, Quat::Identity()));
    body.setLinearVelocity(btVector3(0, 0, 0));
    body.setAngularVelocity(btVector3(0, 0, 0));
    body.setGravity(btVector3(0, 0, 0));
    body.clearForces();
  }
  for (int i = 0; i < steps; ++i)
    world_.stepSimulation(btScalar(step_), 0);
}

}  // namespace carom
