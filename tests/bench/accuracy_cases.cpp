#include "tests/bench/accuracy_cases.h"

#include <cmath>
#include <cstdio>
#include <memory>
#include <utility>

namespace carom::bench {
namespace {

constexpr double kDensity = 1000.0;  // kg/m^3

std::string described(const char* format, double a, double b, double c) {
  char text[128];
  std::snprintf(text, sizeof text, format, a, b, c);
  return text;
}

// ---- spheres

constexpr double kRadii[] = {0.002, 0.01, 0.05, 0.5};  // m
constexpr int kPhases = 32;

// Parameters of a run, by its place in the list of radii, speeds and phases.
struct SphereRun {
  double radius = 0.0;  // m
  double speed = 0.0;   // m/s
  double phase = 0.0;   // fraction of a substep
};

constexpr double kSpeeds[] = {0.5, 2.0, 5.0};  // m/s
constexpr int kSphereRuns = 4 * 3 * kPhases;

SphereRun sphereRun(int run) {
  return {kRadii[run / kPhases % 4], kSpeeds[run / kPhases / 4], double(run % kPhases) / kPhases};
}

std::shared_ptr<btCollisionShape> sphereOf(double radius) {
  return std::make_shared<btSphereShape>(btScalar(radius));
}

double sphereMass(double radius) {
  return kDensity * 4.19 * radius * radius * radius;
}

std::string buildDrop(PairWorld& world, Random& random, int run, double dt) {
  const SphereRun how = sphereRun(run);
  const double gap = how.speed * dt * (2.0 + how.phase);
  const Vec3 sideways(random.between(-1, 1), 0, random.between(-1, 1));
  world.add(sphereOf(how.radius), {.mass = sphereMass(how.radius),
                                   .position = {0.1, how.radius + gap, 0},
                                   .velocity = how.speed * (0.5 * sideways - Vec3::UnitY()),
                                   .restitution = random.between(0.5, 1.0),
                                   .friction = 0.3});
  world.add(std::make_shared<btStaticPlaneShape>(btVector3(0, 1, 0), btScalar(0)),
            {.friction = 0.5});
  return described("r %g m, v %g m/s, phase %g", how.radius, how.speed, how.phase);
}

// `miss` is the distance by which the moving centre passes the other, in sums of the radii.
std::string buildSpherePair(PairWorld& world, Random& random, int run, double dt, double miss) {
  const SphereRun how = sphereRun(run);
  const double sum = how.radius * (1.0 + random.between(0.5, 1.0));
  const double along = sum * std::sqrt(1.0 - miss * miss);
  const Vec3 direction = random.direction();
  const Vec3 aside = direction.cross(random.direction()).normalized();
  const double lead = how.speed * dt * (2.0 + how.phase);
  world.add(sphereOf(how.radius), {.mass = sphereMass(how.radius),
                                   .position = -(along + lead) * direction + miss * sum * aside,
                                   .velocity = how.speed * direction,
                                   .restitution = random.between(0.5, 1.0),
                                   .friction = 0.3});
  world.add(sphereOf(sum - how.radius),
            {.mass = sphereMass(how.radius) * random.between(0.1, 10), .friction = 0.5});
  return described("r %g m, v %g m/s, phase %g", how.radius, how.speed, how.phase);
}

PairCase spherePairs(const std::string& name, double miss) {
  return {.name = name,
          .runs = kSphereRuns,
          .barMax = 1.0,
          .barImpulse = 1e-3,
          .build = [miss](PairWorld& world, Random& random, int run, double dt) {
            return buildSpherePair(world, random, run, dt, miss);
          }};
}

// ---- other shapes

struct SizedShape {
  std::shared_ptr<btCollisionShape> shape;
  double reach = 0.0;  // m, distance of its farthest point from its centre
};

std::shared_ptr<btConvexShape> ballHull(Random& random, double size, double margin) {
  auto hull = std::make_shared<btConvexHullShape>();
  const int points = 8 + random.below(7);
  const Vec3 stretch(random.between(0.5, 1), random.between(0.5, 1), random.between(0.5, 1));
  for (int i = 0; i < points; ++i)
    hull->addPoint(PairWorld::toBullet(size * random.direction().cwiseProduct(stretch)));
  hull->setMargin(btScalar(margin));
  return hull;
}

SizedShape boxShape(Random& random) {
  const Vec3 half(random.between(0.03, 0.1), random.between(0.03, 0.1), random.between(0.03, 0.1));
  return {std::make_shared<btBoxShape>(PairWorld::toBullet(half)), half.norm()};
}

SizedShape capsuleShape(Random& random) {
  const double radius = random.between(0.02, 0.06);
  const double length = random.between(0.05, 0.2);
  return {std::make_shared<btCapsuleShape>(btScalar(radius), btScalar(length)),
          radius + 0.5 * length};
}

SizedShape cylinderShape(Random& random) {
  const double radius = random.between(0.03, 0.1);
  const double half = random.between(0.03, 0.1);
  const btVector3 extents{btScalar(radius), btScalar(half), btScalar(radius)};
  return {std::make_shared<btCylinderShape>(extents), std::hypot(radius, half)};
}

// A hull, small with a margin of 1 mm or large with Bullet's 4 cm.
SizedShape hullShape(Random& random) {
  const bool large = random.below(2) == 1;
  const double size = large ? 0.5 : 0.1;
  const double margin = large ? 0.04 : 0.001;
  return {ballHull(random, size, margin), size + margin};
}

SizedShape sphereShape(Random& random) {
  const double radius = random.between(0.03, 0.1);
  return {sphereOf(radius), radius};
}

// A compound that owns its children, which btCompoundShape does not.
struct Compound : btCompoundShape {
  void take(std::shared_ptr<btCollisionShape> child, const Vec3& position, const Quat& turned) {
    addChildShape(btTransform(btQuaternion(btScalar(turned.x()), btScalar(turned.y()),
                                           btScalar(turned.z()), btScalar(turned.w())),
                              PairWorld::toBullet(position)),
                  child.get());
    children.push_back(std::move(child));
  }
  std::vector<std::shared_ptr<btCollisionShape>> children;
};

// A dumb-bell: a box and a capsule in random orientations, and a ball between them.
SizedShape compoundShape(Random& random) {
  auto compound = std::make_shared<Compound>();
  const Vec3 end = random.between(0.08, 0.15) * random.direction();
  const SizedShape box = boxShape(random);
  const SizedShape capsule = capsuleShape(random);
  compound->take(box.shape, end, random.orientation());
  compound->take(capsule.shape, -end, random.orientation());
  compound->take(sphereOf(0.05), Vec3::Zero(), Quat::Identity());
  return {compound, end.norm() + std::max(box.reach, capsule.reach)};
}

struct Kind {
  std::string name;
  SizedShape (*make)(Random& random);
};

const Kind kBox{"box", boxShape};
const Kind kCapsule{"capsule", capsuleShape};
const Kind kCylinder{"cylinder", cylinderShape};
const Kind kHull{"hull", hullShape};
const Kind kCompound{"compound", compoundShape};
const Kind kSphere{"sphere", sphereShape};

constexpr double kSpin = 8.0;  // rad/s

BodyStart tumbling(Random& random) {
  BodyStart start;
  start.mass = random.between(0.2, 2.0);
  start.orientation = random.orientation();
  start.angularVelocity = kSpin * random.direction();
  start.restitution = random.between(0.3, 0.9);
  start.friction = 0.4;
  return start;
}

std::string buildOnGround(PairWorld& world, Random& random, double dt, const Kind& kind,
                          bool plane) {
  const SizedShape shape = kind.make(random);
  const double speed = random.between(1.0, 5.0);
  const double lead = dt * random.between(2.0, 3.0) + 0.005;
  BodyStart start = tumbling(random);
  start.position = {random.between(-1, 1), shape.reach + speed * lead, random.between(-1, 1)};
  start.velocity =
      speed * Vec3(random.between(-0.5, 0.5), -1, random.between(-0.5, 0.5)).normalized();
  world.add(shape.shape, start);
  if (plane) {
    world.add(std::make_shared<btStaticPlaneShape>(btVector3(0, 1, 0), btScalar(0)), {});
  } else {
    world.add(std::make_shared<btBoxShape>(btVector3(5, btScalar(0.5), 5)),
              {.position = {0, -0.5, 0}});
  }
  return described("v %g m/s, reach %g m, lead %g s", speed, shape.reach, lead);
}

std::string buildPair(PairWorld& world, Random& random, double dt, const Kind& first,
                      const Kind& second) {
  const SizedShape moving = first.make(random);
  const SizedShape other = second.make(random);
  const double speed = random.between(1.0, 5.0);
  const double lead = dt * random.between(2.0, 3.0) + 0.005;
  const Vec3 direction = random.direction();
  const double reach = moving.reach + other.reach;
  BodyStart start = tumbling(random);
  start.position = (reach + speed * lead) * direction + 0.15 * reach * random.inCube();
  start.velocity = -speed * direction;
  world.add(moving.shape, start);
  world.add(other.shape, tumbling(random));
  return described("v %g m/s, reach %g m, lead %g s", speed, reach, lead);
}

PairCase shapeCase(std::string name) {
  return {.name = std::move(name),
          .runs = 200,
          .firstOnly = true,
          .duration = 1.0,
          .barRms = 5.0,
          .barMax = 50.0,
          .build = nullptr};
}

PairCase onGround(const Kind& kind, bool plane) {
  PairCase made = shapeCase(kind.name + (plane ? " on plane" : " on box"));
  made.build = [kind, plane](PairWorld& world, Random& random, int, double dt) {
    return buildOnGround(world, random, dt, kind, plane);
  };
  return made;
}

PairCase pairOf(const Kind& first, const Kind& second) {
  PairCase made = shapeCase(first.name + " and " + second.name);
  made.build = [first, second](PairWorld& world, Random& random, int, double dt) {
    return buildPair(world, random, dt, first, second);
  };
  return made;
}

}  // namespace

std::vector<PairCase> sphereCases() {
  return {{.name = "sphere on plane",
           .runs = kSphereRuns,
           .barMax = 1.0,
           .barImpulse = 1e-3,
           .build = buildDrop},
          spherePairs("spheres head-on", 0.0),
          spherePairs("spheres at 30 degrees", 0.5),
          spherePairs("spheres grazing at 0.9 d", 0.9)};
}

std::vector<PairCase> shapeCases() {
  std::vector<PairCase> cases;
  for (const Kind& kind : {kBox, kCapsule, kCylinder, kHull, kCompound})
    cases.push_back(onGround(kind, true));
  for (const Kind& kind : {kSphere, kBox, kCapsule, kCylinder, kHull, kCompound})
    cases.push_back(onGround(kind, false));
  const std::pair<Kind, Kind> pairs[] = {
      {kBox, kBox},        {kCapsule, kCapsule}, {kHull, kHull},     {kCompound, kCompound},
      {kBox, kCapsule},    {kBox, kCylinder},    {kBox, kHull},      {kCapsule, kCylinder},
      {kCapsule, kHull},   {kCompound, kBox},    {kCompound, kHull}, {kSphere, kBox},
      {kSphere, kCapsule}, {kSphere, kCylinder}, {kSphere, kHull}};
  for (const auto& [first, second] : pairs)
    cases.push_back(pairOf(first, second));
  return cases;
}

}  // namespace carom::bench
