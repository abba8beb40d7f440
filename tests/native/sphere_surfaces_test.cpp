// Tests how SphereStepper moves spheres about boxes and oscillating planes.

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "carom/native/sphere_stepper.h"
#include "native/scheduling/box_contact.h"
#include "tests/native/sphere_worlds.h"
#include "tests/support/constants.h"

namespace carom {
namespace {

using namespace test;

constexpr BodyId kBox = 500;

/// A box with its top at y = 0.
Box table(double halfWidth, double restitution = 1.0) {
  Box box;
  box.id = kBox;
  box.centre = {0.0, -0.1, 0.0};
  box.halfExtents = {halfWidth, 0.1, halfWidth};
  box.restitution = restitution;
  return box;
}

SphereWorld ballOverTable(double height, double restitution) {
  SphereWorld world = droppedBall(height, restitution);
  world.planes.clear();
  world.boxes = {table(0.5, restitution)};
  return world;
}

// ---- Boxes

TEST(BoxesOfSpheres, ABounceOnAFaceIsThatOnAPlane) {
  SphereWorld onPlane = droppedBall(1.0, 0.8);
  onPlane.spheres[0].velocity = {0.1, 0.0, 0.05};
  SphereWorld onBox = onPlane;
  onBox.planes.clear();
  onBox.boxes = {table(10.0, 0.8)};
  SphereStepper plane = stepperOf(onPlane);
  SphereStepper box = stepperOf(onBox);
  const auto expected = eventsUntil(plane, 10.0);
  const auto events = eventsUntil(box, 10.0);
  ASSERT_EQ(events.size(), expected.size());
  ASSERT_GT(events.size(), 40U);
  for (std::size_t k = 0; k < events.size(); ++k) {
    EXPECT_NEAR(events[k].time, expected[k].time, 1e-13);
    EXPECT_NEAR(events[k].approachSpeed, expected[k].approachSpeed, 1e-13);
    EXPECT_EQ(events[k].normal, expected[k].normal);
    EXPECT_EQ(events[k].radius, expected[k].radius);
    EXPECT_EQ(events[k].otherRadius, expected[k].otherRadius);
  }
  EXPECT_NEAR(box.state(0).position.x(), plane.state(0).position.x(), 1e-12);
  EXPECT_NEAR(box.state(0).position.y(), 0.05, 1e-15);
}

TEST(BoxesOfSpheres, TheBoxesShareOfAnEventIsFilled) {
  SphereWorld world = ballOverTable(1.0, 0.5);
  world.spheres[0].position.x() = 0.5 + 0.03;  // beyond the edge: 3-4-5
  world.boxes[0].velocity = {0.0, 0.0, 0.5};
  SphereStepper stepper = stepperOf(world);
  const auto events = eventsUntil(stepper, 0.46);
  ASSERT_EQ(events.size(), 2U);
  EXPECT_NEAR(events[0].time, std::sqrt(2.0 * 1.01 / 9.81), 1e-15) << "1.05 to 0.04";
  EXPECT_LT((events[0].normal - Vec3(0.6, 0.8, 0.0)).norm(), 1e-13);
  const double fall = 9.81 * events[0].time;
  EXPECT_NEAR(events[0].approachSpeed, 0.8 * fall, 1e-13);
  EXPECT_NEAR(events[0].impulse.y(), 0.8 * 1.5 * 0.2 * 0.8 * fall, 1e-13);
  EXPECT_EQ(events[0].radius, 0.05);
  EXPECT_EQ(events[0].otherRadius, 0.0) << "an edge is sharp";
  EXPECT_EQ(events[1].radius, 0.0);
  EXPECT_EQ(events[1].body, kBox);
  EXPECT_EQ(events[1].impulse, -events[0].impulse);
  EXPECT_LT((events[1].position - Vec3(0.5, 0.0, 0.0)).norm(), 1e-13);
  EXPECT_LT((events[1].bodyPosition - Vec3(0.0, -0.1, 0.5 * events[1].time)).norm(), 1e-15);
  EXPECT_EQ(events[1].bodyVelocity, Vec3(0.0, 0.0, 0.5));
}

// Three balls fall as a tower, and all contacts are resolved together: then the box's share of its
// contact is not the last event.
TEST(BoxesOfSpheres, OnlyTheBoxesShareSaysWhereTheBoxIs) {
  SphereWorld world = ballOverTable(0.3, 0.9);
  world.spheres.push_back(sphereAt(2, {0.0, 0.45, 0.0}));
  world.spheres.push_back(sphereAt(3, {0.0, 0.55, 0.0}));
  world.simultaneous = Simultaneous::hertz;
  for (Sphere& sphere : world.spheres)
    sphere.stiffness = 6e9;
  world.boxes[0].stiffness = 6e9;
  world.boxes[0].orientation = Quat(0.8, 0.0, 0.6, 0.0);  // turned about the vertical
  SphereStepper stepper = stepperOf(world);
  const auto events = eventsUntil(stepper, 0.26);
  ASSERT_EQ(events.size(), 6U);
  for (const ImpulseEvent& event : events) {
    const bool ofTheBox = event.body == kBox;
    const double height = ofTheBox ? -0.1 : 0.1 * event.body - 0.05;
    EXPECT_NEAR(event.bodyPosition.y(), height, 1e-9) << event.body;
    EXPECT_EQ(event.bodyOrientation.y(), ofTheBox ? 0.6 : 0.0) << event.body;
  }
}

TEST(BoxesOfSpheres, OffACornerTheVelocityIsMirrored) {
  SphereWorld world;
  world.spheres = {sphereAt(1, {0.0, 0.0, 0.0})};
  world.boxes = {table(0.5)};
  const Vec3 corner(0.5, 0.0, 0.5);
  const Vec3 normal = Vec3(2.0, 1.0, 2.0) / 3.0;
  const Vec3 velocity(-1.0, -2.0, 0.5);
  world.spheres[0].position = corner + 0.05 * normal - 0.7 * velocity;
  world.spheres[0].velocity = velocity;
  SphereStepper stepper = stepperOf(world);
  const auto events = eventsUntil(stepper, 1.0);
  ASSERT_EQ(events.size(), 2U);
  EXPECT_NEAR(events[0].time, 0.7, 1e-14);
  const Vec3 expected = velocity - 2.0 * velocity.dot(normal) * normal;
  EXPECT_LT((stepper.state(0).velocity - expected).norm(), 1e-13);
}

TEST(BoxesOfSpheres, ABallOnATableStaysSilentAndWhereItIs) {
  for (const double error : {-1e-12, -1e-17, 0.0, 1e-17, 1e-13, 1e-9}) {
    SphereStepper stepper = stepperOf(ballOverTable(error, 0.7));
    EXPECT_TRUE(eventsUntil(stepper, 10.0).empty()) << error;
    EXPECT_NEAR(stepper.state(0).position.y(), 0.05, 1e-9);
    EXPECT_EQ(stepper.kineticEnergy(), 0.0);
    EXPECT_LE(stepper.counters().restContacts, 2U);
  }
}

/// A frictionless ball that slides over an edge at speed v leaves it at once when v^2 > g r, and
/// otherwise where v^2 + 2 g r (1 - cos a) = g r cos a.
TEST(BoxesOfSpheres, ABallThatSlidesOffATableLeavesItsEdgeWhereItMust) {
  for (const double speed : {0.05, 0.3, 0.6, 0.69, 0.71, 1.5}) {
    SphereWorld world = ballOverTable(0.0, 0.5);
    world.spheres[0].velocity = {speed, 0.0, 0.1 * speed};
    const double g = 9.81;
    const double r = 0.05;
    const double cosine = std::min(1.0, (speed * speed / (g * r) + 2.0) / 3.0);
    const double sine = std::sqrt(1.0 - cosine * cosine);
    const double leaving = std::sqrt(speed * speed + 2.0 * g * r * (1.0 - cosine));
    SphereStepper stepper = stepperOf(world);
    const double energy = energyOf(stepper);
    EXPECT_TRUE(eventsUntil(stepper, 0.5 / speed).empty()) << speed;
    EXPECT_NEAR(stepper.state(0).position.x(), 0.5, 1e-12);
    EXPECT_NEAR(stepper.state(0).position.y(), 0.05, 1e-15);
    // At 0.3 m below the top the ball is in free flight.
    double time = 0.5 / speed;
    while (stepper.state(0).position.y() > -0.3) {
      time += 1e-3;
      EXPECT_TRUE(eventsUntil(stepper, time).empty()) << speed;
    }
    const SphereState state = stepper.state(0);
    const double y = state.position.y();
    const double down = std::sqrt(leaving * sine * leaving * sine + 2.0 * g * (r * cosine - y));
    const double flight = (down - leaving * sine) / g;
    const double x = 0.5 + r * sine + leaving * cosine * flight;
    EXPECT_NEAR(state.velocity.x(), leaving * cosine, 2e-3) << speed;
    EXPECT_NEAR(state.velocity.y(), -down, 2e-3) << speed;
    EXPECT_NEAR(state.position.x(), x, 2e-3) << speed;
    EXPECT_NEAR(state.velocity.z(), 0.1 * speed, 1e-3) << speed;
    EXPECT_NEAR(energyOf(stepper), energy, 1e-7) << speed;
  }
}

TEST(BoxesOfSpheres, ABallSlidesOverTilesWithoutASound) {
  SphereWorld world = ballOverTable(0.0, 0.9);
  world.boxes.clear();
  for (BodyId tile = 0; tile < 10; ++tile) {
    Box box = table(0.05);
    box.id = kBox + tile;
    box.centre.x() = 0.1 * tile;
    world.boxes.push_back(box);
  }
  world.spheres[0].velocity = {0.3, 0.0, 0.01};
  SphereStepper stepper = stepperOf(world);
  EXPECT_TRUE(eventsUntil(stepper, 2.5).empty());
  EXPECT_NEAR(stepper.state(0).position.x(), 0.75, 1e-6);
  EXPECT_NEAR(stepper.state(0).position.y(), 0.05, 1e-9);
  EXPECT_LT(stepper.counters().restContacts, 200U);
}

TEST(BoxesOfSpheres, ATableThatIsPulledAwayLetsTheBallFall) {
  SphereWorld world = ballOverTable(0.0, 0.5);
  world.boxes[0].velocity = {-1.0, 0.0, 0.0};
  SphereStepper stepper = stepperOf(world);
  EXPECT_TRUE(eventsUntil(stepper, 0.5).empty());
  EXPECT_NEAR(stepper.state(0).position.y(), 0.05, 1e-15);
  EXPECT_TRUE(eventsUntil(stepper, 1.0).empty());
  // The edge leaves faster than g r allows the ball to follow: it falls freely at once.
  EXPECT_NEAR(stepper.state(0).position.y(), 0.05 - 0.5 * 9.81 * 0.25, 1e-6);
  EXPECT_NEAR(stepper.state(0).position.x(), 0.0, 1e-9);
}

TEST(BoxesOfSpheres, ALiftCarriesItsBall) {
  SphereWorld world = ballOverTable(0.0, 0.5);
  world.boxes[0].velocity = {0.0, 0.25, 0.0};
  world.restSpeed = 0.3;
  SphereStepper stepper = stepperOf(world);
  EXPECT_TRUE(eventsUntil(stepper, 4.0).empty());
  EXPECT_NEAR(stepper.state(0).position.y(), 1.05, 1e-12);
}

TEST(BoxesOfSpheres, BallsOnANeedleAnEdgeAndACornerEnd) {
  for (const Vec3& halfExtents : {Vec3(0.5, 0.0, 0.0), Vec3(0.0, 0.0, 0.0), Vec3(0.3, 0.3, 0.3)}) {
    for (const double aside : {0.0, 1e-9, 1e-3}) {
      SphereWorld world = ballOverTable(0.0, 0.5);
      world.boxes[0].centre = Vec3::Zero();
      world.boxes[0].halfExtents = halfExtents;
      world.boxes[0].orientation = Quat(Eigen::AngleAxisd(0.25 * kPi, Vec3::UnitX()));
      const double top = halfExtents.y() * std::sqrt(2.0);
      world.spheres[0].position = {0.1 * halfExtents.x(),
                                   top + 0.05 * std::sqrt(1.0 - aside * aside), 0.05 * aside};
      world.spheres[0].position += Vec3(0.0, 1e-12, 0.0);
      SphereStepper stepper = stepperOf(world);
      const double energy = energyOf(stepper);
      stepper.advanceTo(1.0);
      EXPECT_TRUE(valid(stepper));
      EXPECT_NEAR(energyOf(stepper), energy, 2e-7);
      if (aside == 0.0) {
        EXPECT_EQ(stepper.kineticEnergy(), 0.0) << "it sleeps";
      }
      if (aside == 1e-3 && halfExtents.y() == 0.0) {
        EXPECT_LT(stepper.state(0).position.y(), top) << "it slid off";
      }
      EXPECT_LT(stepper.counters().restContacts, 200'000U);
    }
  }
}

TEST(BoxesOfSpheres, AnElasticBallAmongTiltedBoxesKeepsItsEnergyOverThousandsOfCollisions) {
  SplitMix random(4);
  SphereWorld world;
  world.gravity = kEarthGravity;
  world.restSpeed = 0.0;
  world.planes = boxOf(1.0, 1.0);
  for (BodyId k = 0; k < 12; ++k) {
    Box box;
    box.id = kBox + k;
    box.centre = random.inCube(0.8);
    box.halfExtents = {random.between(0.05, 0.2), random.between(0.05, 0.2),
                       k % 3 == 0 ? 0.0 : random.between(0.05, 0.2)};
    box.orientation = Quat{random.between(-1.0, 1.0), random.between(-1.0, 1.0),
                           random.between(-1.0, 1.0), random.between(-1.0, 1.0)}
                          .normalized();
    world.boxes.push_back(box);
  }
  for (BodyId id = 0; world.spheres.size() < 8; ++id) {
    world.spheres.push_back(sphereAt(id, random.inCube(0.9), random.inCube(2.0)));
    if (!SphereStepper::create(world)) world.spheres.pop_back();
  }
  SphereStepper stepper = stepperOf(world);
  const double energy = stepper.kineticEnergy();
  const double whole = energyOf(stepper);
  int faces = 0;
  int edges = 0;
  for (int step = 1; step <= 400; ++step) {
    for (const ImpulseEvent& event : stepper.advanceTo(1.0 * step)) {
      if (event.other < kBox || event.other >= kFirstPlane) continue;
      ++(event.otherRadius == 0.0 ? edges : faces);
    }
    ASSERT_TRUE(valid(stepper)) << step;
  }
  EXPECT_NEAR(energyOf(stepper), whole, 1e-11 * energy);
  EXPECT_GT(faces, 500);
  EXPECT_GT(edges, 500);
}

SphereWorld heapAmongBoxes(std::uint64_t seed) {
  SphereWorld world = gasInBox(3, 0.6, seed);
  world.gravity = kEarthGravity;
  Box step;
  step.id = kBox;
  step.centre = {0.0, -0.105, 0.0};
  step.halfExtents = {0.04, 0.001, 0.2};
  step.restitution = 0.6;
  Box tilted = step;
  tilted.id = kBox + 1;
  tilted.centre = {-0.08, -0.04, -0.08};
  tilted.halfExtents = {0.0, 0.002, 0.002};
  tilted.orientation = Quat(Eigen::AngleAxisd(0.7, Vec3(0.6, 0.0, 0.8)));
  world.boxes = {step, tilted};
  std::erase_if(world.spheres, [&](const Sphere& sphere) {
    SphereWorld one = world;
    one.spheres = {sphere};
    return !SphereStepper::create(one);
  });
  return world;
}

TEST(BoxesOfSpheres, AHeapOverBoxesComesToRestAndLosesEnergyOnly) {
  for (std::uint64_t seed = 1; seed <= 12; seed += 11) {
    const SphereWorld world = heapAmongBoxes(seed);
    SphereStepper stepper = stepperOf(world);
    double lowest = energyOf(stepper);
    const double start = lowest;
    for (int step = 1; step <= 300; ++step) {
      stepper.advanceTo(0.01 * step);
      ASSERT_TRUE(valid(stepper));
      EXPECT_LE(energyOf(stepper), lowest + 1e-5 * std::abs(start));
      lowest = std::min(lowest, energyOf(stepper));
    }
    EXPECT_GT(stepper.counters().collisions, 100U);
    EXPECT_LT(stepper.counters().restContacts, 3'000'000U);
  }
}

TEST(BoxesOfSpheres, SmallStepsAndListingOrderChangeNoBit) {
  SphereWorld world = heapAmongBoxes(9);
  world.planes[0].oscillation = {{0.0005, 0.0, 0.0}, 20.0, 0.3};
  SphereStepper big = stepperOf(world);
  std::reverse(world.spheres.begin(), world.spheres.end());
  std::reverse(world.boxes.begin(), world.boxes.end());
  std::reverse(world.planes.begin(), world.planes.end());
  SphereStepper small = stepperOf(world);
  const auto expected = big.advanceTo(0.5);
  std::vector<ImpulseEvent> events;
  for (int step = 1; step <= 512; ++step) {
    const auto more = small.advanceTo(step / 1024.0);
    events.insert(events.end(), more.begin(), more.end());
  }
  ASSERT_EQ(events.size(), expected.size());
  ASSERT_GT(events.size(), 100U);
  for (std::size_t k = 0; k < events.size(); ++k) {
    ASSERT_EQ(events[k].time, expected[k].time) << k;
    ASSERT_EQ(events[k].impulse, expected[k].impulse) << k;
  }
}

TEST(MovingPlanes, ABallInAClosingGapGainsTwiceTheWallsSpeedEachTime) {
  SphereWorld world;
  world.spheres = {sphereAt(1, {0.0, 0.0, 0.0}, {1.0, 0.0, 0.0})};
  Plane piston{kFirstPlane, -Vec3::UnitX(), -1.0, 1.0};
  piston.velocity = {-0.01, 3.0, 0.0};
  world.planes = {piston, {kFirstPlane + 1, Vec3::UnitX(), -0.05, 1.0}};
  world.restSpeed = 0.0;
  SphereStepper stepper = stepperOf(world);
  const auto events = eventsUntil(stepper, 60.0);
  int hits = 0;
  double speed = 1.0;
  double room = 0.95;  // of the ball's centre, between the fixed wall and the piston
  double time = 0.0;
  for (const ImpulseEvent& event : events) {
    if (event.body != 1 || event.other != kFirstPlane) continue;
    // The ball flies from the fixed wall to the piston, which approaches.
    time = hits == 0 ? room / (1.0 + 0.01) : time + 2.0 * (room - 0.01 * time) / (speed + 0.01);
    EXPECT_NEAR(event.time, time, 1e-11);
    EXPECT_NEAR(event.approachSpeed, speed + 0.01, 1e-12);
    speed += 0.02;
    ++hits;
  }
  EXPECT_GT(hits, 40);
}

// ---- Oscillating planes

SphereWorld ballOnOscillator(double amplitude, double frequency, double restitution) {
  SphereWorld world = droppedBall(0.0, restitution);
  world.planes[0].oscillation = {{0.0, amplitude, 0.0}, frequency, 0.0};
  return world;
}

TEST(OscillatingPlanes, BelowOneGABallStaysWithinMicrometresAndSilent) {
  for (const double share : {0.1, 0.5, 0.95}) {
    for (const double frequency : {5.0, 50.0}) {
      const double angular = 2.0 * kPi * frequency;
      const double amplitude = share * 9.81 / (angular * angular);
      SphereStepper stepper = stepperOf(ballOnOscillator(amplitude, frequency, 0.5));
      double farthest = 0.0;
      // At the start the plane moves up with amplitude * angular, which causes one real collision.
      stepper.advanceTo(1.0);
      for (int step = 1; step <= 2000; ++step) {
        const double time = 1.0 + step / 1900.0;
        EXPECT_TRUE(stepper.advanceTo(time).empty()) << time;
        const double gap =
            stepper.state(0).position.y() - 0.05 - amplitude * std::sin(angular * time);
        EXPECT_GT(gap, -1e-12);
        farthest = std::max(farthest, gap);
      }
      EXPECT_LT(farthest, 2e-6) << share << " " << frequency;
      EXPECT_TRUE(valid(stepper));
      EXPECT_LT(stepper.counters().restContacts, 20'000U);
    }
  }
}

TEST(OscillatingPlanes, AboveOneGABallIsThrownWhereTheAccelerationPassesG) {
  const double frequency = 10.0;
  const double angular = 2.0 * kPi * frequency;
  const double amplitude = 1.2 * 9.81 / (angular * angular);
  SphereWorld world = ballOnOscillator(amplitude, frequency, 0.0);
  world.planes[0].oscillation.phase = -0.5 * kPi;  // starts at its lowest point, at rest
  world.spheres[0].position.y() -= amplitude;
  SphereStepper stepper = stepperOf(world);
  // The ball leaves where sin(phase) = 1 / 1.2, and flies until it meets the plane again.
  const double leaving = std::asin(1.0 / 1.2) / angular;
  const double height = amplitude / 1.2;
  const double speed = amplitude * angular * std::cos(angular * leaving);
  double landing = leaving + 1e-3;
  const auto gap = [&](double t) {
    const double flight = t - leaving;
    return height + flight * (speed - 0.5 * 9.81 * flight) - amplitude * std::sin(angular * t);
  };
  while (gap(landing) > 0.0)
    landing += 1e-7;
  const auto events = eventsUntil(stepper, 0.025 + landing + 1e-3);
  ASSERT_EQ(events.size(), 2U);
  EXPECT_NEAR(events[0].time, 0.025 + landing, 1e-4);
  EXPECT_GT(events[0].approachSpeed, 0.005);
}

/// A ball that leaves with g T / 2 comes back after T with the same speed. At a phase at which the
/// plane has v = (1 - e) / (1 + e) g T / 2, the impact restores just that speed.
TEST(OscillatingPlanes, ABallBouncesOncePerPeriodWhereThePlaneGivesBackWhatIsLost) {
  const double period = 0.1;
  const double angular = 2.0 * kPi / period;
  for (const double e : {0.3, 0.6, 0.8}) {
    const double wanted = (1.0 - e) / (1.0 + e) * 0.5 * 9.81 * period;
    const double phase = 0.6;  // stable: a ball that is late meets a slower plane
    const double amplitude = wanted / (angular * std::cos(phase));
    SphereWorld world = droppedBall(0.0, e);
    world.spheres[0].restitution = e;
    world.planes[0].restitution = e;
    world.planes[0].oscillation = {{0.0, amplitude, 0.0}, 1.0 / period, phase};
    world.spheres[0].position.y() = 0.05 + amplitude * std::sin(phase) + 1e-15;
    world.spheres[0].velocity.y() = -0.5 * 9.81 * period;
    SphereStepper stepper = stepperOf(world);
    const auto events = eventsUntil(stepper, 20.05 * period);
    ASSERT_GE(events.size(), 2U * 20U) << e;
    for (std::size_t bounce = 0; bounce < 20; ++bounce) {
      EXPECT_NEAR(events[2 * bounce].time, static_cast<double>(bounce) * period, 1e-9) << e;
      EXPECT_NEAR(events[2 * bounce].approachSpeed, wanted + 0.5 * 9.81 * period, 1e-8) << e;
    }
  }
}

/// The oracle follows each flight in small steps, from position and velocity of the last event.
TEST(OscillatingPlanes, EveryContactIsTheFirstOfItsFlight) {
  SplitMix random(6);
  int contacts = 0;
  for (int run = 0; run < 60; ++run) {
    SphereWorld world = droppedBall(random.between(0.05, 0.3), 1.0);
    const double e = random.between(0.5, 1.0);
    world.spheres[0].restitution = e;
    world.planes[0].restitution = e;
    const double frequency = random.between(5.0, 60.0);
    const double amplitude = random.between(0.3, 1.0) / (2.0 * kPi * frequency);
    world.planes[0].oscillation = {{0.01, amplitude, 0.0}, frequency, random.between(0.0, 6.0)};
    world.planes[0].velocity = {0.0, random.between(-0.05, 0.05), 0.0};
    const Oscillation& oscillation = world.planes[0].oscillation;
    const double angular = 2.0 * kPi * frequency;
    const auto surface = [&](double t) {
      return world.planes[0].velocity.y() * t +
             amplitude * std::sin(angular * t + oscillation.phase);
    };
    world.spheres[0].position.y() += amplitude;
    SphereStepper stepper = stepperOf(world);
    double from = 0.0;
    double y = world.spheres[0].position.y();
    double v = 0.0;
    for (int step = 1; step <= 100; ++step) {
      const auto events = stepper.advanceTo(0.01 * step);
      if (stepper.counters().restContacts > 0) break;
      for (const ImpulseEvent& event : events) {
        if (event.body != 1) continue;
        const double flight = event.time - from;
        for (int k = 1; k < 1000; ++k) {
          const double t = flight * k / 1000.0;
          ASSERT_GT(y + t * (v - 0.5 * 9.81 * t) - 0.05 - surface(from + t), -1e-12) << run;
        }
        ASSERT_NEAR(event.bodyPosition.y() - 0.05, surface(event.time), 1e-12);
        const double wall =
            world.planes[0].velocity.y() +
            amplitude * angular * std::cos(angular * event.time + oscillation.phase);
        ASSERT_NEAR(event.approachSpeed, wall - event.bodyVelocity.y(), 1e-11);
        y = event.bodyPosition.y();
        v = wall + e * event.approachSpeed;
        from = event.time;
        ++contacts;
      }
    }
  }
  EXPECT_GT(contacts, 100);
}

TEST(OscillatingPlanes, AnElasticOrUnforgivingWorldEndsOnThemToo) {
  for (const double e : {0.0, 0.5, 1.0}) {
    for (const double restSpeed : {0.0, 0.005}) {
      SphereWorld world = ballOnOscillator(0.0001, 30.0, e);  // 0.36 g
      world.restSpeed = restSpeed;
      SphereStepper stepper = stepperOf(world);
      stepper.advanceTo(1.0);
      EXPECT_TRUE(valid(stepper));
      EXPECT_LT(stepper.counters().collisions + stepper.counters().restContacts, 120'000U);
    }
  }
}

// ---- create

class SurfacesAreRefused : public ::testing::TestWithParam<Refusal> {};

TEST_P(SurfacesAreRefused, WithAMessageThatSaysWhatAndWhere) {
  SphereWorld world = ballOverTable(1.0, 0.5);
  world.planes = {floorPlane()};
  world.planes[0].offset = -1.0;
  GetParam().spoil(world);
  const Result<SphereStepper> stepper = SphereStepper::create(world);
  ASSERT_FALSE(stepper);
  EXPECT_NE(stepper.error().message.find(GetParam().message), std::string::npos)
      << stepper.error().message;
}

INSTANTIATE_TEST_SUITE_P(
    All, SurfacesAreRefused,
    ::testing::Values(
        Refusal{"CentreNan", [](SphereWorld& w) { w.boxes[0].centre.x() = kNaN; },
                "box 500: centre is (nan"},
        Refusal{"NegativeExtent", [](SphereWorld& w) { w.boxes[0].halfExtents.z() = -0.5; },
                "box 500: a half extent is -0.5 m; it must not be below 0"},
        Refusal{"ExtentNan", [](SphereWorld& w) { w.boxes[0].halfExtents.y() = kNaN; },
                "box 500: halfExtents is ("},
        Refusal{"Orientation", [](SphereWorld& w) { w.boxes[0].orientation.w() = 2.0; },
                "box 500: orientation has length 2; it must be 1"},
        Refusal{"OrientationNan", [](SphereWorld& w) { w.boxes[0].orientation.x() = kNaN; },
                "box 500: orientation has length nan"},
        Refusal{"Restitution", [](SphereWorld& w) { w.boxes[0].restitution = -0.1; },
                "box 500: restitution is -0.1"},
        Refusal{"BoxVelocity", [](SphereWorld& w) { w.boxes[0].velocity.x() = kNaN; },
                "box 500: velocity is (nan"},
        Refusal{"SameIds", [](SphereWorld& w) { w.boxes[0].id = 1; }, "id 1 is used twice"},
        Refusal{"SphereInside", [](SphereWorld& w) { w.spheres[0].position.y() = -0.1; },
                "sphere 1: overlaps box 500 by 0.05"},
        Refusal{"SphereOverAnEdge",
                [](SphereWorld& w) {
                  w.spheres[0].position = {0.53, 0.039, 0.0};
                },
                "sphere 1: overlaps box 500 by 0.00"},
        Refusal{"PlaneVelocity", [](SphereWorld& w) { w.planes[0].velocity.y() = kNaN; },
                "plane 1000000: velocity is (0, nan"},
        Refusal{"Amplitude", [](SphereWorld& w) { w.planes[0].oscillation.amplitude.x() = kNaN; },
                "plane 1000000: amplitude of oscillation is (nan"},
        Refusal{"Frequency",
                [](SphereWorld& w) {
                  w.planes[0].oscillation = {Vec3::UnitX(), 0.0, 0.0};
                },
                "plane 1000000: frequency of oscillation is 0 Hz; it must be finite and above 0"},
        Refusal{"Phase", [](SphereWorld& w) { w.planes[0].oscillation.phase = kNaN; },
                "plane 1000000: phase of oscillation is nan"},
        Refusal{"OscillatesIntoTheSphere",
                [](SphereWorld& w) {
                  w.planes[0].oscillation = {{0.0, 2.1, 0.0}, 1.0, 1.5707963267948966};
                },
                "sphere 1: overlaps plane 1000000 by 0.1"}),
    [](const auto& refusal) { return std::string(refusal.param.name); });

}  // namespace
}  // namespace carom
