#include "tests/support/ordinary_worlds.h"

#include <array>
#include <cmath>
#include <cstddef>

#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletDynamics/Vehicle/btRaycastVehicle.h>
#include <LinearMath/btConvexHullComputer.h>

#include "tests/support/random.h"

namespace carom {
namespace {

constexpr btScalar kWaterDensity = 1000;  // kg/m^3: the density of most bodies in applications

btVector3 at(double x, double y, double z) {
  return {btScalar(x), btScalar(y), btScalar(z)};
}

btQuaternion turned(Random& random) {
  const Quat turn = random.orientation();
  return {btScalar(turn.x()), btScalar(turn.y()), btScalar(turn.z()), btScalar(turn.w())};
}

btTransform placed(const btVector3& place, const btQuaternion& turn) {
  return btTransform(turn, place);
}

/// 125 cubes of 20 cm and 1 kg, as in Bullet's own first example: they fall in a lump and spill.
class FallingCubes : public OrdinaryWorld {
 public:
  FallingCubes() {
    addFloor();
    auto& cube = keep(std::make_unique<btBoxShape>(at(0.1, 0.1, 0.1)));
    Random random(1);
    for (int i = 0; i < 125; ++i) {
      const double jitter = random.between(-0.02, 0.02);
      add(1.0, cube,
          at(0.21 * (i % 5) + jitter, 1.0 + 0.21 * (i / 25), 0.21 * (i / 5 % 5) - jitter));
    }
  }
};

/// A wall of 300 bricks, and a ball of 1 m that is thrown into it after half a second.
class BrickWall : public OrdinaryWorld {
 public:
  BrickWall() {
    addFloor();
    auto& brick = keep(std::make_unique<btBoxShape>(at(0.2, 0.1, 0.1)));
    for (int row = 0; row < 15; ++row)
      for (int column = 0; column < 20; ++column)
        add(16.0, brick, at(0.4 * column + 0.2 * (row % 2) - 4.0, 0.1 + 0.2 * row, 0.0));
    ball_ = &add(200.0, keep(std::make_unique<btSphereShape>(btScalar(0.5))), at(0.0, 0.5, 12.0));
  }

 private:
  void drive() override {
    if (thrown_ || time() < 0.5) return;
    thrown_ = true;
    ball_->activate(true);
    ball_->setLinearVelocity(at(0.0, 3.0, -20.0));
  }

  btRigidBody* ball_ = nullptr;
  bool thrown_ = false;
};

/// A pyramid of boxes of 1 m, 20 wide at its foot.
class Pyramid : public OrdinaryWorld {
 public:
  Pyramid() {
    addFloor();
    auto& box = keep(std::make_unique<btBoxShape>(at(0.5, 0.5, 0.5)));
    for (int row = 0; row < 20; ++row)
      for (int column = 0; column < 20 - row; ++column)
        add(10.0, box, at(1.05 * column + 0.525 * row - 10.0, 0.5 + row, 0.0));
  }
};

/// 1200 boxes of half a metre in stacks of twelve, none of which falls asleep.
class StackedBoxes : public OrdinaryWorld {
 public:
  StackedBoxes() {
    addFloor();
    auto& box = keep(std::make_unique<btBoxShape>(at(0.25, 0.25, 0.25)));
    for (int stack = 0; stack < 100; ++stack)
      for (int storey = 0; storey < 12; ++storey)
        add(125.0, box, at(0.8 * (stack % 10), 0.25 + 0.5 * storey, 0.8 * (stack / 10)))
            .setActivationState(DISABLE_DEACTIVATION);
  }
};

/// 400 bodies of half a metre that lie side by side, awake.
template <class Shape>
class LyingAwake : public OrdinaryWorld {
 public:
  LyingAwake() {
    addFloor();
    auto& shape = keep(makeShape());
    for (int i = 0; i < 400; ++i)
      add(60.0, shape, at(0.7 * (i % 20), 0.25, 0.7 * (i / 20)))
          .setActivationState(DISABLE_DEACTIVATION);
  }

 private:
  static std::unique_ptr<Shape> makeShape() {
    if constexpr (std::is_same_v<Shape, btSphereShape>)
      return std::make_unique<btSphereShape>(btScalar(0.25));
    else
      return std::make_unique<btBoxShape>(at(0.25, 0.25, 0.25));
  }
};

/// Ten figures of eleven capsules each, with joints that Bullet limits, dropped on the floor.
class Ragdolls : public OrdinaryWorld {
 public:
  Ragdolls() {
    addFloor();
    Random random(2);
    for (int i = 0; i < 10; ++i)
      addFigure(at(1.5 * (i % 5), 1.0 + 0.7 * i, 1.5 * (i / 5)), random);
  }

 private:
  struct Part {
    double radius, height, mass;  // m, m, kg
    double x, y;                  // m, of the middle above the feet
    int parent;                   // -1: none
    double jointX, jointY;        // m, above the feet
  };

  void addFigure(const btVector3& feet, Random& random) {
    static constexpr std::array<Part, 11> kParts{{{0.15, 0.20, 15, 0.0, 1.00, -1, 0.0, 0.0},
                                                  {0.15, 0.28, 20, 0.0, 1.20, 0, 0.0, 1.10},
                                                  {0.10, 0.05, 5, 0.0, 1.60, 1, 0.0, 1.45},
                                                  {0.07, 0.45, 8, -0.18, 0.65, 0, -0.18, 0.90},
                                                  {0.05, 0.37, 5, -0.18, 0.20, 3, -0.18, 0.42},
                                                  {0.07, 0.45, 8, 0.18, 0.65, 0, 0.18, 0.90},
                                                  {0.05, 0.37, 5, 0.18, 0.20, 5, 0.18, 0.42},
                                                  {0.05, 0.33, 3, -0.32, 1.20, 1, -0.32, 1.40},
                                                  {0.04, 0.25, 2, -0.32, 0.83, 7, -0.32, 1.00},
                                                  {0.05, 0.33, 3, 0.32, 1.20, 1, 0.32, 1.40},
                                                  {0.04, 0.25, 2, 0.32, 0.83, 9, 0.32, 1.00}}};
    const btTransform figure = placed(feet, turned(random));
    std::array<btRigidBody*, kParts.size()> bodies{};
    for (std::size_t i = 0; i < kParts.size(); ++i) {
      const Part& part = kParts[i];
      auto& shape =
          keep(std::make_unique<btCapsuleShape>(btScalar(part.radius), btScalar(part.height)));
      const btTransform place = figure * placed(at(part.x, part.y, 0), btQuaternion::getIdentity());
      bodies[i] = &add(part.mass, shape, place);
      bodies[i]->setDamping(btScalar(0.05), btScalar(0.85));
      if (part.parent < 0) continue;
      const Part& parent = kParts[static_cast<std::size_t>(part.parent)];
      auto joint = std::make_unique<btConeTwistConstraint>(
          *bodies[static_cast<std::size_t>(part.parent)], *bodies[i],
          placed(at(part.jointX - parent.x, part.jointY - parent.y, 0),
                 btQuaternion::getIdentity()),
          placed(at(part.jointX - part.x, part.jointY - part.y, 0), btQuaternion::getIdentity()));
      joint->setLimit(btScalar(0.8), btScalar(0.8), btScalar(0.4));
      add(std::move(joint));
    }
  }
};

using Points = std::vector<btVector3>;

/// Reduces points to the corners of their hull.
Points cornersOf(const Points& points) {
  btConvexHullComputer hull;
  hull.compute(points.front().m_floats, sizeof(btVector3), static_cast<int>(points.size()), 0, 0);
  Points corners;
  for (int i = 0; i < hull.vertices.size(); ++i)
    corners.push_back(hull.vertices[i]);
  return corners;
}

/// Cuts a convex solid, given by its corners, along a plane through `middle`; returns the part in
/// front of it.
Points cut(const Points& corners, const btVector3& normal, const btVector3& middle) {
  Points part;
  const auto height = [&](const btVector3& point) { return normal.dot(point - middle); };
  for (const btVector3& a : corners) {
    if (height(a) >= 0) part.push_back(a);
    for (const btVector3& b : corners)
      if (height(a) > 0 && height(b) < 0)
        part.push_back(a.lerp(b, height(a) / (height(a) - height(b))));
  }
  return part.size() < 4 ? part : cornersOf(part);
}

btVector3 meanOf(const Points& points) {
  btVector3 sum(0, 0, 0);
  for (const btVector3& point : points)
    sum += point;
  return sum / btScalar(points.size());
}

/// Adds convex pieces about their middles, as btConvexHullShapes; their mass is that of water in
/// half of the box around them.
class ConvexPieces : public OrdinaryWorld {
 protected:
  btRigidBody& addPiece(Points corners, const btTransform& place) {
    const btVector3 middle = meanOf(corners);
    auto hull = std::make_unique<btConvexHullShape>();
    for (const btVector3& corner : corners)
      hull->addPoint(corner - middle, false);
    hull->setMargin(btScalar(0.005));
    hull->recalcLocalAabb();
    btVector3 low;
    btVector3 high;
    hull->getAabb(btTransform::getIdentity(), low, high);
    const btVector3 size = high - low;
    const btScalar mass = btScalar(0.5) * kWaterDensity * size.x() * size.y() * size.z();
    return add(static_cast<double>(mass), keep(std::move(hull)),
               place * placed(middle, btQuaternion::getIdentity()));
  }
};

/// A block of 2 m that has broken into a hundred shards, and falls apart from 1 m above the floor.
class Shards : public ConvexPieces {
 public:
  Shards() {
    addFloor();
    Points block;
    for (int corner = 0; corner < 8; ++corner)
      block.push_back(at(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 0.3 : -0.3));
    std::vector<Points> pieces{block};
    Random random(3);
    while (pieces.size() < 100)
      breakLargest(pieces, random);
    for (const Points& piece : pieces)
      addPiece(piece, placed(at(0.0, 2.0, 0.0), btQuaternion::getIdentity()));
  }

 private:
  static btScalar extentOf(const Points& piece) {
    btVector3 low = piece.front();
    btVector3 high = piece.front();
    for (const btVector3& corner : piece) {
      low.setMin(corner);
      high.setMax(corner);
    }
    return (high - low).length();
  }
  static void breakLargest(std::vector<Points>& pieces, Random& random) {
    std::size_t largest = 0;
    for (std::size_t i = 1; i < pieces.size(); ++i)
      if (extentOf(pieces[i]) > extentOf(pieces[largest])) largest = i;
    const Points whole = pieces[largest];
    const Vec3 direction = random.direction();
    const btVector3 normal = at(direction.x(), direction.y(), direction.z());
    pieces[largest] = cut(whole, normal, meanOf(whole));
    pieces.push_back(cut(whole, -normal, meanOf(whole)));
  }
};

/// 200 boulders of 20 to 60 corners that lie on each other in a heap.
class HullStack : public ConvexPieces {
 public:
  HullStack() {
    addFloor();
    Random random(4);
    for (int i = 0; i < 200; ++i) {
      const int corners = 20 + random.below(40);
      Points points;
      for (int corner = 0; corner < corners; ++corner) {
        const Vec3 point = random.direction();
        points.push_back(at(0.4 * point.x(), 0.25 * point.y(), 0.3 * point.z()));
      }
      addPiece(cornersOf(points), placed(at(0.9 * (i % 5) + random.between(-0.05, 0.05),
                                            0.3 + 0.55 * (i / 25), 0.7 * (i / 5 % 5)),
                                         btQuaternion::getIdentity()));
    }
  }
};

/// A car of 800 kg that drives over hills, through crates.
class Vehicle : public OrdinaryWorld {
 public:
  Vehicle() {
    addHills();
    auto& chassis = keep(std::make_unique<btBoxShape>(at(1.0, 0.5, 2.0)));
    btRigidBody& body = add(800.0, chassis, at(0.0, 4.0, -20.0));
    body.setActivationState(DISABLE_DEACTIVATION);
    rayCaster_ = std::make_unique<btDefaultVehicleRaycaster>(&world());
    vehicle_ = std::make_unique<btRaycastVehicle>(tuning_, &body, rayCaster_.get());
    vehicle_->setCoordinateSystem(0, 1, 2);
    world().addVehicle(vehicle_.get());
    for (int wheel = 0; wheel < 4; ++wheel)
      vehicle_->addWheel(at(wheel & 1 ? 1.0 : -1.0, 0.0, wheel & 2 ? 1.6 : -1.6), at(0, -1, 0),
                         at(-1, 0, 0), btScalar(0.6), btScalar(0.5), tuning_, wheel >= 2);
    auto& crate = keep(std::make_unique<btBoxShape>(at(0.4, 0.4, 0.4)));
    for (int i = 0; i < 60; ++i)
      add(30.0, crate, at(1.0 * (i % 6) - 2.5, 3.0 + 0.9 * (i / 6 % 2), 2.0 * (i / 12) - 12.0));
  }
  ~Vehicle() override { world().removeVehicle(vehicle_.get()); }

 private:
  static constexpr int kSide = 65;

  void addHills() {
    heights_.resize(std::size_t{kSide} * kSide);
    for (int z = 0; z < kSide; ++z)
      for (int x = 0; x < kSide; ++x)
        heights_[static_cast<std::size_t>(z * kSide + x)] =
            static_cast<float>(0.5 * std::sin(0.4 * x) * std::cos(0.3 * z));
    auto field = std::make_unique<btHeightfieldTerrainShape>(
        kSide, kSide, heights_.data(), btScalar(1), btScalar(-1), btScalar(1), 1, PHY_FLOAT, false);
    add(0.0, keep(std::move(field)), at(0.0, 0.0, 0.0));
  }
  void drive() override {
    for (int wheel = 0; wheel < 2; ++wheel)
      vehicle_->applyEngineForce(btScalar(2500), wheel);
  }

  std::vector<float> heights_;
  btRaycastVehicle::btVehicleTuning tuning_;
  std::unique_ptr<btVehicleRaycaster> rayCaster_;
  std::unique_ptr<btRaycastVehicle> vehicle_;
};

/// A spiral of 200 dominoes, of which the first is pushed.
class Dominoes : public OrdinaryWorld {
 public:
  Dominoes() {
    addFloor();
    auto& domino = keep(std::make_unique<btBoxShape>(at(0.1, 0.2, 0.03)));
    double angle = 0.0;
    for (int i = 0; i < 200; ++i) {
      const double radius = 1.0 + 0.08 * angle;
      angle += 0.2 / radius;
      const btQuaternion turn(btVector3(0, 1, 0), btScalar(-angle));
      btRigidBody& placedBody = add(
          3.0, domino, placed(at(radius * std::cos(angle), 0.2, radius * std::sin(angle)), turn));
      if (i == 0) first_ = &placedBody;
    }
  }

 private:
  void drive() override {
    if (pushed_) return;
    pushed_ = true;
    const btVector3 along = first_->getWorldTransform().getBasis() * btVector3(0, 0, 1);
    first_->applyImpulse(btScalar(3) * along, at(0, 0.2, 0));
  }

  btRigidBody* first_ = nullptr;
  bool pushed_ = false;
};

/// 3000 boxes of 0.2 m to 2 m that rain into a heap.
class FallingBoxes : public OrdinaryWorld {
 public:
  FallingBoxes() {
    addFloor();
    Random random(5);
    std::vector<btBoxShape*> boxes;
    for (int i = 0; i < 10; ++i) {
      const double half = random.logBetween(0.1, 0.6);
      const double width = half * random.between(0.5, 1.0);
      boxes.push_back(&keep(std::make_unique<btBoxShape>(at(half, width, half))));
    }
    for (int i = 0; i < 3000; ++i) {
      btBoxShape& box = *boxes[static_cast<std::size_t>(random.below(10))];
      const btVector3 size = btScalar(2) * box.getHalfExtentsWithMargin();
      const btScalar mass = kWaterDensity / 2 * size.x() * size.y() * size.z();
      const btVector3 place = at(1.3 * (i % 15), 1.0 + 1.4 * (i / 225), 1.3 * (i / 15 % 15));
      add(static_cast<double>(mass), box, placed(place, turned(random)));
    }
  }
};

/// Balls of one size, poured into a box of four walls.
template <int count, int millimetres, int density>
class Balls : public OrdinaryWorld {
 public:
  Balls() {
    const double radius = 1e-3 * millimetres;
    const double half = 11.0 * radius;
    addFloor();
    auto& wall = keep(std::make_unique<btBoxShape>(at(half + 0.2, 4.0 * half, 0.1)));
    for (int side = 0; side < 4; ++side) {
      const btQuaternion turn(btVector3(0, 1, 0), btScalar(side) * SIMD_HALF_PI);
      const btTransform around = placed(at(0, 0, 0), turn);
      add(0.0, wall, around * placed(at(0.0, 4.0 * half, half + 0.1), btQuaternion::getIdentity()));
    }
    const double mass = density * 4.0 / 3.0 * 3.141592653589793 * std::pow(radius, 3);
    auto& ball = keep(std::make_unique<btSphereShape>(btScalar(radius)));
    Random random(6);
    for (int i = 0; i < count; ++i) {
      const auto jitter = [&] { return random.between(-0.1, 0.1) * radius; };
      const double x = 2.2 * radius * (i % 8 - 3.5) + jitter();
      const double z = 2.2 * radius * (i / 8 % 8 - 3.5) + jitter();
      add(mass, ball, at(x, 4.0 * radius + 2.2 * radius * (i / 64), z))
          .setRestitution(btScalar(0.5));
    }
  }
};

template <class World>
std::unique_ptr<OrdinaryWorld> make() {
  return std::make_unique<World>();
}

constexpr std::array kWorlds{
    OrdinaryWorldKind{"falling_cubes", false, make<FallingCubes>},
    OrdinaryWorldKind{"brick_wall", false, make<BrickWall>},
    OrdinaryWorldKind{"pyramid", false, make<Pyramid>},
    OrdinaryWorldKind{"stacked_boxes", true, make<StackedBoxes>},
    OrdinaryWorldKind{"resting_spheres", true, make<LyingAwake<btSphereShape>>},
    OrdinaryWorldKind{"resting_boxes", true, make<LyingAwake<btBoxShape>>},
    OrdinaryWorldKind{"ragdolls", false, make<Ragdolls>},
    OrdinaryWorldKind{"shards", false, make<Shards>},
    OrdinaryWorldKind{"hull_stack", false, make<HullStack>},
    OrdinaryWorldKind{"vehicle", false, make<Vehicle>},
    OrdinaryWorldKind{"dominoes", false, make<Dominoes>},
    OrdinaryWorldKind{"falling_boxes", false, make<FallingBoxes>},
    OrdinaryWorldKind{"falling_balls", false, make<Balls<1000, 50, 7800>>},
    OrdinaryWorldKind{"marbles", false, make<Balls<200, 8, 2500>>},
};

}  // namespace

OrdinaryWorld::OrdinaryWorld() {
  world_.setGravity(at(0.0, -9.81, 0.0));
}

OrdinaryWorld::~OrdinaryWorld() {
  for (const auto& constraint : constraints_)
    world_.removeConstraint(constraint.get());
  for (const auto& body : bodies_)
    world_.removeRigidBody(body.get());
}

void OrdinaryWorld::step(double rate) {
  drive();
  world_.stepSimulation(static_cast<btScalar>(1.0 / rate), 0);
  time_ += 1.0 / rate;
}

btRigidBody& OrdinaryWorld::add(double mass, btCollisionShape& shape, const btTransform& place) {
  btVector3 inertia(0, 0, 0);
  if (mass > 0.0) shape.calculateLocalInertia(btScalar(mass), inertia);
  btRigidBody::btRigidBodyConstructionInfo info(btScalar(mass), nullptr, &shape, inertia);
  info.m_startWorldTransform = place;
  bodies_.push_back(std::make_unique<btRigidBody>(info));
  world_.addRigidBody(bodies_.back().get());
  return *bodies_.back();
}

btRigidBody& OrdinaryWorld::add(double mass, btCollisionShape& shape, const btVector3& place) {
  return add(mass, shape, placed(place, btQuaternion::getIdentity()));
}

btRigidBody& OrdinaryWorld::addFloor() {
  return add(0.0, keep(std::make_unique<btBoxShape>(at(50.0, 1.0, 50.0))), at(0.0, -1.0, 0.0));
}

void OrdinaryWorld::add(std::unique_ptr<btTypedConstraint> constraint) {
  world_.addConstraint(constraint.get(), true);
  constraints_.push_back(std::move(constraint));
}

std::span<const OrdinaryWorldKind> ordinaryWorlds() {
  return kWorlds;
}

}  // namespace carom
