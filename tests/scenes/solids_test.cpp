// Solids: their mass, their motion in Bullet, and their events and sound.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <memory>
#include <numbers>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "bullet_bridge/geometry/to_vec3.h"
#include "scenes/format/mesh_shape.h"
#include "scenes/format/scene_loader.h"
#include "scenes/format/solid_shape.h"
#include "scenes/run/bullet_only.h"
#include "scenes/run/bullet_scene.h"
#include "scenes/run/bullet_solid.h"
#include "scenes/run/collision_corners.h"
#include "scenes/run/scene_sound.h"
#include "scenes/run/scene_stepper.h"
#include "scenes/run/solid_surface.h"
#include "tests/scenes/library.h"
#include "tests/support/temporary_folder.h"

namespace carom::test {

using namespace bullet;
using namespace scenes;

namespace {

using nlohmann::json;
using Matrix = Eigen::Matrix3d;

std::string meshFile(const std::string& name) {
  return (std::filesystem::path(CAROM_SOURCE_DIR) / "tests" / "scenes" / "meshes" / name).string();
}

json boxForm(double x, double y, double z) {
  return {{"type", "box"}, {"half_extents", {x, y, z}}};
}
json cylinderForm(double radius, double height) {
  return {{"type", "cylinder"}, {"radius", radius}, {"height", height}};
}
/// The shape of a mesh file in millimetres.
json meshForm(const std::string& name, const std::string& pieces = "") {
  json form = {{"type", "mesh"}, {"file", meshFile(name)}, {"scale", 0.001}};
  if (!pieces.empty()) form["pieces"] = meshFile(pieces);
  return form;
}

/// A solid without friction, as the impulses of events are.
json solidOf(const json& form, const json& position, const json& keys = json::object()) {
  json solid = {{"type", "solid"},
                {"shape", form},
                {"material", "steel"},
                {"position", position},
                {"friction", 0}};
  solid.update(keys);
  return solid;
}

json floorBlock() {
  return {{"type", "block"}, {"min", {-1, -1, -1}}, {"max", {1, 0, 1}}, {"material", "wood"}};
}

json floorPlane() {
  return {{"type", "plane"}, {"normal", {0, 1, 0}}, {"offset", 0}, {"material", "wood"}};
}

/// A scene on Bullet at steps of 1 ms, with a distant listener.
json documentOf(const json& bodies, double duration = 1.0) {
  return {{"duration", duration},
          {"stepper", {{"type", "bullet"}, {"step", 0.001}}},
          {"bodies", bodies.is_array() ? bodies : json::array({bodies})},
          {"listeners", {{{"position", {0, 5, 5}}}}}};
}

Scene sceneOf(const json& bodies, double duration = 1.0) {
  return orAbort(parseScene(documentOf(bodies, duration).dump(), "solids.json"));
}

Scene weightless(const json& bodies, double duration = 1.0) {
  Scene scene = sceneOf(bodies, duration);
  scene.gravity.setZero();
  return scene;
}

const SolidShape& solidIn(const Scene& scene, std::size_t body = 0) {
  return std::get<SolidShape>(scene.bodies.at(body).shape);
}

std::vector<ImpulseEvent> eventsOf(const Scene& scene) {
  auto events = sceneEvents(scene);
  EXPECT_TRUE(events) << events.error().message;
  return events ? *events : std::vector<ImpulseEvent>{};
}

/// The events of body 0.
std::vector<ImpulseEvent> sharesOf(const Scene& scene) {
  std::vector<ImpulseEvent> events = eventsOf(scene);
  std::erase_if(events, [](const ImpulseEvent& event) { return event.body != 0; });
  return events;
}

double restitution(const Scene& scene) {
  return restitutionOf(scene, scene.bodies.at(0), scene.bodies.at(1));
}

/// Inertia of a box of this mass and these whole edges, in kg m^2.
Matrix boxInertia(double mass, const Vec3& edges) {
  const Vec3 squares = edges.cwiseAbs2();
  return (mass / 12.0 *
          Vec3(squares.y() + squares.z(), squares.z() + squares.x(), squares.x() + squares.y()))
      .asDiagonal();
}

/// Inertia of a part in kg m^2 about a point at `offset` from its own centre (Huygens, Steiner).
Matrix steiner(const Matrix& inertia, double mass, const Vec3& offset) {
  return inertia + mass * (offset.squaredNorm() * Matrix::Identity() - offset * offset.transpose());
}

double relative(const Matrix& value, const Matrix& expected) {
  return (value - expected).norm() / expected.norm();
}

Matrix worldInertia(const btRigidBody& body) {
  const btMatrix3x3& inverse = body.getInvInertiaTensorWorld();
  Matrix matrix;
  for (int row = 0; row < 3; ++row)
    matrix.row(row) = toVec3(inverse[row]).transpose();
  return matrix.inverse();
}

Quat bulletOrientation(const btRigidBody& body) {
  const btQuaternion turn = body.getWorldTransform().getRotation();
  return Quat(static_cast<double>(turn.w()), static_cast<double>(turn.x()),
              static_cast<double>(turn.y()), static_cast<double>(turn.z()));
}

/// Energy of motion and of height above y = 0, in J.
double energy(const btRigidBody& body, double gravity) {
  const double mass = 1.0 / static_cast<double>(body.getInvMass());
  const Vec3 spin = toVec3(body.getAngularVelocity());
  const Vec3 velocity = toVec3(body.getLinearVelocity());
  return 0.5 * mass * velocity.squaredNorm() + 0.5 * spin.dot(worldInertia(body) * spin) +
         mass * gravity * static_cast<double>(body.getWorldTransform().getOrigin().y());
}

// --- Mass ----------------------------------------------------------------------------------------

// Published values of a regular tetrahedron of side s: V = s^3 / (6 sqrt 2), and I = m s^2 / 20
// about every axis through its centre.
TEST(SolidMeasures, RegularTetrahedronHasItsPublishedInertiaWhereverItIs) {
  const double half = 0.5;  // half the edge of the cube around it
  for (const Vec3& place : {Vec3(0, 0, 0), Vec3(5, -3, 2)}) {
    SurfaceMesh mesh;
    for (const Vec3& corner : {Vec3(1, 1, 1), Vec3(1, -1, -1), Vec3(-1, 1, -1), Vec3(-1, -1, 1)})
      mesh.vertices.push_back(place + half * corner);
    mesh.triangles = {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}};
    const SolidMeasures measures = measuresOf(mesh);
    const double side = std::sqrt(2.0);
    const double volume = side * side * side / (6.0 * std::sqrt(2.0));
    EXPECT_NEAR(measures.volume, volume, 1e-12);
    EXPECT_LT((measures.centroid - place).norm(), 1e-12);
    EXPECT_LT(relative(measures.inertia, volume * side * side / 20.0 * Matrix::Identity()), 1e-11);
  }
}

TEST(SolidMeasures, MeshOfABoxWeighsWhatTheBoxWeighs) {
  const Scene scene = sceneOf(
      {solidOf(meshForm("brick.obj"), {0, 1, 0}), solidOf(boxForm(0.03, 0.02, 0.05), {2, 1, 0})});
  const double mass = findMaterial("steel")->density * 0.06 * 0.04 * 0.1;
  for (const std::size_t body : {0U, 1U}) {
    EXPECT_NEAR(solidIn(scene, body).mass, mass, 1e-12 * mass);
    EXPECT_LT(relative(solidIn(scene, body).inertia, boxInertia(mass, {0.06, 0.04, 0.1})), 1e-12);
    EXPECT_LT(solidIn(scene, body).centreOfMass.norm(), 1e-15);
  }
}

TEST(SolidMeasures, CylinderTurnsAboutItsAxisLikeADisc) {
  const Scene scene = sceneOf({solidOf(cylinderForm(0.02, 0.1), {0, 1, 0}, {{"mass", 2.0}})});
  EXPECT_EQ(solidIn(scene).mass, 2.0);
  const double across = 2.0 * (3.0 * 0.0004 + 0.01) / 12.0;
  const Matrix expected = Vec3(across, 2.0 * 0.0004 / 2.0, across).asDiagonal();
  EXPECT_LT(relative(solidIn(scene).inertia, expected), 1e-13);
}

/// A box of l_shape.obj, which has two: centre and whole edges in m.
struct Part {
  Vec3 centre;
  Vec3 edges;
};
const Part kParts[] = {{{0.03, 0.01, 0.015}, {0.06, 0.02, 0.03}},
                       {{0.01, 0.05, 0.015}, {0.02, 0.06, 0.03}}};
// Centre of mass in m; both parts have the volume 36 cm^3.
const Vec3 kCentreOfL{0.02, 0.03, 0.015};

Matrix inertiaOfL(double mass) {
  Matrix inertia = Matrix::Zero();
  for (const Part& part : kParts)
    inertia += steiner(boxInertia(0.5 * mass, part.edges), 0.5 * mass, part.centre - kCentreOfL);
  return inertia;
}

TEST(SolidMeasures, AnLHasItsCentreOfMassBetweenItsArms) {
  const Scene scene = sceneOf({solidOf(meshForm("l_shape.obj"), {1, 2, 3})});
  const SolidShape& solid = solidIn(scene);
  const double mass = findMaterial("steel")->density * 72e-6;
  EXPECT_NEAR(solid.mass, mass, 1e-12 * mass);
  EXPECT_LT((solid.centreOfMass - kCentreOfL).norm(), 1e-15);
  EXPECT_LT((solid.position - (Vec3(1, 2, 3) + kCentreOfL)).norm(), 1e-15);
  EXPECT_LT(relative(solid.inertia, inertiaOfL(mass)), 1e-12);
}

TEST(SolidMeasures, GivenMassScalesTheInertiaAndNotTheForm) {
  const Scene light = sceneOf({solidOf(meshForm("l_shape.obj"), {0, 1, 0}, {{"mass", 0.1}})});
  EXPECT_EQ(solidIn(light).mass, 0.1);
  EXPECT_LT(relative(solidIn(light).inertia, inertiaOfL(0.1)), 1e-12);
  EXPECT_LT((solidIn(light).centreOfMass - kCentreOfL).norm(), 1e-15);
}

TEST(PrincipalAxes, OfAnLAreThoseOfAPlaneFigureByMohrsFormula) {
  const Matrix inertia = inertiaOfL(1.0);
  const PrincipalAxes axes = principalAxes(inertia);
  const Matrix turn = axes.toBody.toRotationMatrix();
  EXPECT_NEAR(turn.determinant(), 1.0, 1e-14);
  const Matrix back = turn * axes.inertia.asDiagonal() * turn.transpose();
  EXPECT_LT(relative(back, inertia), 1e-13);
  // Mohr's circle in the plane of the L: tan(2 angle) = 2 Ixy / (Ixx - Iyy).
  const double mean = 0.5 * (inertia(0, 0) + inertia(1, 1));
  const double reach = std::hypot(0.5 * (inertia(0, 0) - inertia(1, 1)), inertia(0, 1));
  EXPECT_NEAR(axes.inertia.minCoeff(), mean - reach, 1e-12 * mean);
}

TEST(PrincipalAxes, StayWhereTheyAreIfTheyAreAlready) {
  for (const Vec3& inertia : {Vec3(3, 1, 2), Vec3(1, 1, 1), Vec3(2, 2, 1)}) {
    const PrincipalAxes axes = principalAxes(inertia.asDiagonal());
    EXPECT_EQ(axes.toBody.coeffs(), Quat::Identity().coeffs());
    EXPECT_EQ(axes.inertia, inertia);
  }
}

// --- Bullet --------------------------------------------------------------------------------------

TEST(BulletSolids, StandWhereTheSceneSaysAndTurnAsTheTensorOfTheMeshDoes) {
  const Scene scene = sceneOf({solidOf(meshForm("l_shape.obj"), {1, 2, 3},
                                       {{"rotation", {{"axis", {1, 2, -1}}, {"angle", 70}}},
                                        {"velocity", {1, 0, 2}},
                                        {"spin", {3, 4, 5}}})});
  const BulletScene world(scene);
  const btRigidBody& body = world.body(0);
  const Quat turn(Eigen::AngleAxisd(70.0 * std::numbers::pi / 180.0, Vec3(1, 2, -1).normalized()));
  // Bullet is compiled in single precision.
  EXPECT_LT(
      (toVec3(body.getWorldTransform().getOrigin()) - Vec3(1, 2, 3) - turn * kCentreOfL).norm(),
      1e-6);
  EXPECT_LT(world.orientation(0, bulletOrientation(body)).angularDistance(turn), 1e-5);
  EXPECT_TRUE(world.hasTurnedFrames());
  const Matrix rotation = turn.toRotationMatrix();
  const Matrix expected =
      rotation * inertiaOfL(findMaterial("steel")->density * 72e-6) * rotation.transpose();
  EXPECT_LT(relative(worldInertia(body), expected), 1e-5);
  EXPECT_LT((toVec3(body.getLinearVelocity()) - Vec3(1, 0, 2)).norm(), 1e-6);
  EXPECT_LT((toVec3(body.getAngularVelocity()) - Vec3(3, 4, 5)).norm(), 1e-6);
}

/// Time in s in which a body in Bullet falls by `drop` from rest: its steps make it g dt / 2 faster
/// than in nature all the time.
double fallTime(double drop, double step) {
  return std::sqrt(0.25 * step * step + 2.0 * drop / 9.81) - 0.5 * step;
}

TEST(BulletSolids, WhatFallsFlatHitsWithTheImpulseOfAPoint) {
  const double drop = 0.2;
  const std::pair<json, double> forms[] = {{boxForm(0.03, 0.02, 0.05), 0.02},
                                           {meshForm("brick.obj"), 0.02},
                                           {cylinderForm(0.03, 0.04), 0.02}};
  for (const auto& [form, half] : forms) {
    const Scene scene = sceneOf({solidOf(form, {0, half + drop, 0}), floorPlane()}, 0.3);
    const std::vector<ImpulseEvent> events = sharesOf(scene);
    ASSERT_FALSE(events.empty());
    const ImpulseEvent& first = events.front();
    const double speed = std::sqrt(2.0 * 9.81 * drop);
    const double mass = solidIn(scene).mass;
    EXPECT_NEAR(first.time, fallTime(drop, 0.001), 2e-6) << form;
    EXPECT_NEAR(first.approachSpeed, speed, 1e-4) << form;
    EXPECT_NEAR(first.effectiveMass, mass, 1e-4 * mass) << form;
    EXPECT_NEAR(first.impulse.y(), (1.0 + restitution(scene)) * mass * speed, 3e-4 * mass * speed)
        << form;
    EXPECT_LT((first.bodyPosition - Vec3(0, half, 0)).norm(), 1e-5) << form;
    EXPECT_LT((first.normal - Vec3::UnitY()).norm(), 1e-6) << form;
    EXPECT_LT(first.bodyOrientation.angularDistance(Quat::Identity()), 1e-5) << form;
  }
}

// The mesh meets the floor with a corner: 1/m_eff = 1/m + (r x n) . I^-1 (r x n).
TEST(BulletSolids, MeshThatLandsOnACornerHasTheEffectiveMassOfItsOwnTensor) {
  const json turn = {{"axis", {0.3, 0.2, 1}}, {"angle", 33}};
  const Scene scene =
      sceneOf({solidOf(meshForm("l_shape.obj"), {0, 0.2, 0}, {{"rotation", turn}}), floorPlane()});
  const std::vector<ImpulseEvent> events = sharesOf(scene);
  ASSERT_FALSE(events.empty());
  const ImpulseEvent& first = events.front();
  const Matrix rotation =
      Eigen::AngleAxisd(33.0 * std::numbers::pi / 180.0, Vec3(0.3, 0.2, 1).normalized())
          .toRotationMatrix();
  const double mass = findMaterial("steel")->density * 72e-6;
  const Vec3 arm = (first.position - first.bodyPosition).cross(Vec3::UnitY());
  const Vec3 turned = rotation.transpose() * arm;
  const double inverse = 1.0 / mass + turned.dot(inertiaOfL(mass).inverse() * turned);
  EXPECT_NEAR(first.effectiveMass, 1.0 / inverse, 1e-3 / inverse);
  EXPECT_LT(first.effectiveMass, 0.9 * mass);
  EXPECT_LT(first.bodyOrientation.angularDistance(Quat(rotation)), 1e-5);
  // The contact is at the lowest corner of the mesh.
  const SurfaceMesh& mesh =
      std::get<std::shared_ptr<const SolidMesh>>(solidIn(scene).form)->surface;
  Vec3 lowest = Vec3::Constant(1.0);
  for (const Vec3& vertex : mesh.vertices) {
    const Vec3 place = rotation * vertex;
    if (place.y() < lowest.y()) lowest = place;
  }
  EXPECT_LT((first.position - Vec3(lowest.x(), 0.0, lowest.z())).norm(), 1e-5);
}

TEST(BulletSolids, MeshTurnedByTheSceneMovesAsTheSameMeshTurnedInItsFile) {
  const Quat turn(Eigen::AngleAxisd(50.0 * std::numbers::pi / 180.0, Vec3(1, 2, 3).normalized()));
  SurfaceMesh mesh = meshOf(meshFile("l_shape.obj"), 0.001)->surface;
  const TemporaryFolder folder;
  std::ofstream file(folder / "turned.obj");
  file.precision(17);
  for (const Vec3& vertex : mesh.vertices)
    file << "v " << (turn * vertex).transpose() << '\n';
  for (const auto& triangle : mesh.triangles)
    file << "f " << triangle[0] + 1 << ' ' << triangle[1] + 1 << ' ' << triangle[2] + 1 << '\n';
  file.close();
  const json turned = {{"type", "mesh"}, {"file", (folder / "turned.obj").string()}};
  const json motion = {{"spin", {1, -2, 3}}, {"velocity", {0.1, 0, 0}}};
  json rotated = motion;
  rotated["rotation"] = {{"axis", {1, 2, 3}}, {"angle", 50}};
  const auto byScene = sharesOf(
      sceneOf({solidOf(meshForm("l_shape.obj"), {0, 0.3, 0}, rotated), floorPlane()}, 0.6));
  const auto byFile = sharesOf(sceneOf({solidOf(turned, {0, 0.3, 0}, motion), floorPlane()}, 0.6));
  ASSERT_GE(byScene.size(), 2U);
  ASSERT_EQ(byScene.size(), byFile.size());
  for (std::size_t index = 0; index < 2; ++index) {
    const ImpulseEvent& one = byScene[index];
    const ImpulseEvent& other = byFile[index];
    EXPECT_NEAR(one.time, other.time, 1e-5);
    EXPECT_LT((one.impulse - other.impulse).norm(), 1e-3 * other.impulse.norm());
    EXPECT_LT((one.position - other.position).norm(), 1e-4);
    EXPECT_LT((one.bodyPosition - other.bodyPosition).norm(), 1e-5);
    EXPECT_LT(one.bodyOrientation.angularDistance(other.bodyOrientation * turn), 1e-3);
    EXPECT_LT((one.bodyAngularVelocity - other.bodyAngularVelocity).norm(),
              1e-3 * other.bodyAngularVelocity.norm());
  }
}

// Bullet's frame of a body is that of its principal axes, which are not those of an L.
TEST(BulletSolids, BothSharesOfACollisionKnowBothPoses) {
  const json ell = meshForm("l_shape.obj");
  const json askew = {{"rotation", {{"axis", {1, 0.3, 0.5}}, {"angle", 25}}}};
  const auto events = eventsOf(
      sceneOf({solidOf(ell, {0, 0.1, 0}), solidOf(ell, {0, 0.3, 0}, askew), floorPlane()}, 0.6));
  std::size_t collisions = 0;
  for (const ImpulseEvent& event : events) {
    if (event.body == 2 || event.other == 2) continue;
    const auto reaction = std::ranges::find_if(events, [&](const ImpulseEvent& other) {
      return other.time == event.time && other.body == event.other;
    });
    ASSERT_NE(reaction, events.end());
    ASSERT_TRUE(event.hasOtherPose);
    EXPECT_EQ(event.otherPosition, reaction->bodyPosition);
    EXPECT_LT(event.otherOrientation.angularDistance(reaction->bodyOrientation), 1e-12);
    ++collisions;
  }
  EXPECT_GT(collisions, 0U);
}

/// A falling shape, the floor below it, and the shape's rotation.
struct Bounce {
  json form;
  json floor;
  json turn;
};

// The tolerance is 2 % of the change, as Bullet's solver goes from corner to corner.
TEST(BulletSolids, MoveOnFromAnImpactAsItsEventSays) {
  const json askew = {{"rotation", {{"axis", {1, 0.3, 0.5}}, {"angle", 25}}}};
  const json flat = json::object();
  const json box = boxForm(0.03, 0.02, 0.05);
  const json ell = meshForm("l_shape.obj");
  for (const auto& [form, floor, turn] :
       {Bounce{box, floorPlane(), flat}, Bounce{box, floorBlock(), flat},
        Bounce{box, floorPlane(), askew}, Bounce{meshForm("brick.obj"), floorBlock(), askew},
        Bounce{ell, floorBlock(), flat}, Bounce{ell, floorPlane(), askew},
        Bounce{ell, floorBlock(), askew}}) {
    const Scene scene = sceneOf({solidOf(form, {0, 0.3, 0}, turn), floor}, 0.4);
    const std::vector<ImpulseEvent> events = sharesOf(scene);
    ASSERT_FALSE(events.empty());
    const ImpulseEvent& first = events.front();
    BulletScene world(scene);
    double time = 0.0;
    while (time < first.time) {
      world.world().stepSimulation(static_cast<btScalar>(scene.stepper.step), 0);
      time += scene.stepper.step;
    }
    world.world().stepSimulation(static_cast<btScalar>(scene.stepper.step), 0);
    time += scene.stepper.step;
    const Vec3 change = first.impulse / solidIn(scene).mass;
    const Vec3 fall = (time - first.time) * scene.gravity;
    const Vec3 after = toVec3(world.body(0).getLinearVelocity());
    EXPECT_LT((after - first.bodyVelocity - fall - change).norm(), 0.02 * change.norm())
        << form << floor["type"] << turn;
  }
}

/// State of body 0 at the end of a run, and its extremes during the run.
struct Settled {
  double height = 0.0;   // m, centre of mass
  double lowest = 1.0;   // m, lowest centre of mass of the run
  double speed = 0.0;    // m/s, vertical
  double tilting = 0.0;  // rad/s, about horizontal axes
  double energy = 0.0;   // largest energy of the run over the initial one
};

Settled settle(const Scene& scene) {
  BulletScene world(scene);
  const btRigidBody& body = world.body(0);
  const double start = energy(body, 9.81);
  Settled settled;
  for (double time = 0.0; time < scene.duration; time += scene.stepper.step) {
    world.world().stepSimulation(static_cast<btScalar>(scene.stepper.step), 0);
    settled.height = static_cast<double>(body.getWorldTransform().getOrigin().y());
    settled.lowest = std::min(settled.lowest, settled.height);
    settled.energy = std::max(settled.energy, energy(body, 9.81) / start);
  }
  settled.speed = std::abs(toVec3(body.getLinearVelocity()).y());
  settled.tilting = toVec3(body.getAngularVelocity()).cross(Vec3::UnitY()).norm();
  return settled;
}

/// A shape that falls askew onto a floor, and the heights at which its centre may come to rest.
struct Fall {
  std::string name;
  json form;
  json floor;
  std::vector<double> heights;  // m
};

void PrintTo(const Fall& fall, std::ostream* out) {
  *out << fall.name;
}

class FallingSolid : public testing::TestWithParam<Fall> {};

TEST_P(FallingSolid, NeverGainsEnergyAndComesToRestOnAFace) {
  const json askew = {{"rotation", {{"axis", {1, 0.3, 0.5}}, {"angle", 25}}}};
  const Fall& fall = GetParam();
  const Settled settled =
      settle(sceneOf({solidOf(fall.form, {0, 0.3, 0}, askew), fall.floor}, 4.0));
  EXPECT_LT(settled.energy, 1.0005);  // energy varies over the nodes of Bullet's parabola
  // There is no friction, so that the body may slide and spin about the vertical. Bullet lets a
  // resting body fall for a step before the contact acts, which gives the bound on the speed.
  EXPECT_LT(settled.speed, 9.81 * 0.001);
  EXPECT_LT(settled.tilting, 0.5);
  EXPECT_GT(settled.lowest, 0.9 * *std::ranges::min_element(fall.heights));
  const auto isThere = [&](double height) { return std::abs(settled.height - height) < 1e-4; };
  EXPECT_TRUE(std::ranges::any_of(fall.heights, isThere)) << settled.height;
}

std::vector<Fall> falls() {
  const json still = {{"movable", false}, {"material", "wood"}};
  const json slab = solidOf(boxForm(1, 0.5, 1), {0, -0.5, 0}, still);
  const json sheet = solidOf({{"type", "mesh"}, {"file", meshFile("sheet.obj")}, {"scale", 0.02}},
                             {-1, 0, -1}, still);
  const std::vector<double> box = {0.02, 0.03, 0.05};
  const std::vector<double> ell = {0.015, 0.02, 0.03};
  std::vector<Fall> list;
  for (const auto& [name, floor] : {std::pair{"plane", floorPlane()},
                                    {"block", floorBlock()},
                                    {"slab", slab},
                                    {"sheet", sheet}}) {
    list.push_back({std::string("box_on_") + name, boxForm(0.03, 0.02, 0.05), floor, box});
    list.push_back({std::string("hull_on_") + name, meshForm("brick.obj"), floor, box});
  }
  for (const auto& [name, floor] : {std::pair{"plane", floorPlane()}, {"block", floorBlock()}}) {
    list.push_back({std::string("l_on_") + name, meshForm("l_shape.obj"), floor, ell});
    list.push_back({std::string("l_of_pieces_on_") + name, meshForm("l_shape.obj", "l_pieces.obj"),
                    floor, ell});
  }
  list.push_back({"cylinder_on_plane", cylinderForm(0.02, 0.1), floorPlane(), {0.02, 0.05}});
  return list;
}

std::string fallName(const testing::TestParamInfo<Fall>& fall) {
  return fall.param.name;
}

INSTANTIATE_TEST_SUITE_P(Solids, FallingSolid, testing::ValuesIn(falls()), fallName);

// A bead flies into the notch of an L, which is between the hulls of its pieces but inside the hull
// of the whole.
TEST(BulletSolids, PiecesLeaveTheNotchOfAnLOpen) {
  const json bead = {{"type", "sphere"},
                     {"radius", 0.005},
                     {"material", "steel"},
                     {"position", {0.05, 0.2, 0.015}},
                     {"velocity", {0, -1, 0}}};
  const double way = 0.2 - 0.005;
  const json heavy = {{"mass", 1000}};
  const auto firstTouch = [&](const json& form) {
    const auto events = eventsOf(weightless({solidOf(form, {0, 0, 0}, heavy), bead}, 0.3));
    EXPECT_FALSE(events.empty());
    return events.empty() ? 0.0 : events.front().time;
  };
  // The arm along x is 20 mm high. The hull's edge runs from (60, 20) to (20, 80) mm, with a slope
  // of 3 : 2, and the bead touches it with its centre a radius away.
  EXPECT_NEAR(firstTouch(meshForm("l_shape.obj", "l_pieces.obj")), way - 0.02, 1e-5);
  const double edge = 0.02 + 1.5 * 0.01;
  EXPECT_NEAR(firstTouch(meshForm("l_shape.obj")), 0.2 - edge - 0.005 * std::sqrt(1.0 + 2.25),
              1e-5);
}

/// Speed (m/s) after 1 s of the first body, which starts at 1 m/s along a level floor.
double speedAfterASecond(const json& body, const json& floor) {
  const Scene scene = sceneOf({body, floor});
  BulletScene bullet(scene);
  for (int step = 0; step < 1000; ++step)
    bullet.world().stepSimulation(toBullet(0.001), 0);
  return toVec3(bullet.body(0).getLinearVelocity()).norm();
}

/// A box of wood, 2 cm high, that slides on the floor at 1 m/s; with the friction of its material.
json slidingBox(const json& keys = json::object()) {
  json box = solidOf(boxForm(0.05, 0.01, 0.05), {0, 0.01, 0},
                     {{"material", "wood"}, {"velocity", {1, 0, 0}}});
  box.erase("friction");
  box.update(keys);
  return box;
}

TEST(BulletSolids, BuiltInMaterialsHoldThemUpAsCoulombSays) {
  const json ice = {{"type", "plane"}, {"normal", {0, 1, 0}}, {"offset", 0}, {"material", "ice"}};
  // Wood on wood stops after v / (mu g) = 1 / (0.4 * 9.81) = 0.25 s. On ice the pair has the
  // geometric mean sqrt(0.4 * 0.05) = 0.1414, which leaves 1 - 0.1414 * 9.81 < 0; with a speed of
  // 3 m/s at the start 3 - 1.387 = 1.613 m/s.
  const json slab = solidOf(boxForm(1, 0.5, 1), {0, -0.5, 0},
                            {{"movable", false}, {"material", "wood"}, {"friction", 0.4}});
  for (const json& floor : {floorPlane(), floorBlock(), slab})
    EXPECT_LT(speedAfterASecond(slidingBox(), floor), 0.01) << floor;
  EXPECT_NEAR(speedAfterASecond(slidingBox({{"velocity", {3, 0, 0}}}), ice), 1.613, 0.02);
  EXPECT_NEAR(speedAfterASecond(slidingBox({{"velocity", {3, 0, 0}}, {"friction", 0}}), ice), 3.0,
              1e-3);
  // sqrt(0.1 * 0.05) = 0.0707: 3 - 0.694 m/s.
  EXPECT_NEAR(speedAfterASecond(slidingBox({{"velocity", {3, 0, 0}}, {"friction", 0.1}}), ice),
              2.306, 0.02);
}

TEST(BulletSolids, WoodBlocksOfTheLibraryComeToRest) {
  const Scene scene = libraryScene("wood_blocks");
  BulletScene bullet(scene);
  const auto placesAt = [&bullet](int steps) {
    for (int step = 0; step < steps; ++step)
      bullet.world().stepSimulation(toBullet(0.001), 0);
    std::vector<Vec3> places;
    for (std::size_t body = 1; body < 4; ++body)
      places.push_back(toVec3(bullet.body(body).getWorldTransform().getOrigin()));
    return places;
  };
  const std::vector<Vec3> before = placesAt(2000);
  const std::vector<Vec3> after = placesAt(1000);
  for (std::size_t body = 0; body < before.size(); ++body) {
    EXPECT_GT(after[body].y(), 0.0) << body;  // on the board
    EXPECT_LT((after[body] - before[body]).norm(), 5e-4) << body;
  }
}

TEST(BulletSolids, SpheresBesideThemHaveOnlyTheFrictionThatTheSceneNames) {
  json ball = {{"type", "sphere"},
               {"radius", 0.05},
               {"material", "wood"},
               {"position", {0, 0.05, 0}},
               {"velocity", {1, 0, 0}}};
  const json far = slidingBox({{"position", {0, 0.01, 9}}});
  const auto spinOf = [&](const json& floor) {
    BulletScene bullet(sceneOf({ball, floor, far}));
    for (int step = 0; step < 500; ++step)
      bullet.world().stepSimulation(toBullet(0.001), 0);
    return toVec3(bullet.body(0).getAngularVelocity()).norm();
  };
  const json slab = solidOf(boxForm(1, 0.5, 1), {0, -0.5, 0},
                            {{"movable", false}, {"material", "wood"}, {"friction", 0.4}});
  EXPECT_LT(spinOf(floorPlane()), 1e-3);
  EXPECT_LT(spinOf(slab), 1e-3);
  ball["friction"] = 0.4;
  EXPECT_LT(spinOf(floorPlane()), 1e-3);  // as on the native stepper: both need one that is named
  // It rolls at 5/7 of its speed: 14.3 rad/s.
  EXPECT_NEAR(spinOf(slab), 5.0 / 7.0 / 0.05, 0.1);
}

TEST(BulletSolids, CallbackSlotOfFrictionIsGivenBack) {
  const auto before = gCalculateCombinedFrictionCallback;
  {
    const BulletScene bullet(sceneOf({slidingBox(), floorPlane()}));
    EXPECT_NE(gCalculateCombinedFrictionCallback, before);
  }
  EXPECT_EQ(gCalculateCombinedFrictionCallback, before);
}

TEST(BulletSolids, BallOnAnImmovableMeshBouncesAsOnAPlane) {
  const json sheet = solidOf({{"type", "mesh"}, {"file", meshFile("sheet.obj")}}, {-40, 0, -60},
                             {{"movable", false}, {"material", "concrete"}});
  json plane = floorPlane();
  plane["material"] = "concrete";
  const json ball = {
      {"type", "sphere"}, {"radius", 0.01}, {"material", "steel"}, {"position", {0, 0.3, 0}}};
  const auto onMesh = sharesOf(sceneOf({ball, sheet}, 0.6));
  const auto onPlane = sharesOf(sceneOf({ball, plane}, 0.6));
  ASSERT_GE(onPlane.size(), 1U);
  ASSERT_GE(onMesh.size(), 1U);
  EXPECT_NEAR(onMesh[0].time, onPlane[0].time, 1e-6);
  EXPECT_NEAR(onMesh[0].impulse.y(), onPlane[0].impulse.y(), 1e-4 * onPlane[0].impulse.y());
}

// --- Steppers ------------------------------------------------------------------------------------

TEST(Solids, NeedBulletAndTheNativeStepperSaysSo) {
  Scene scene = sceneOf({solidOf(cylinderForm(1, 1), {0, 1, 0}, {{"name", "can"}})});
  EXPECT_TRUE(validateForNative(libraryScene("marble_steps")));
  const std::string reason = validateForNative(scene).error().message;
  EXPECT_TRUE(reason.starts_with("body \"can\": a movable cylinder needs the bullet stepper"));
  scene.stepper.type = StepperType::native;
  const auto stepper = makeStepper(scene);
  ASSERT_FALSE(stepper);
  EXPECT_EQ(stepper.error().message, "solids: " + reason);
  EXPECT_FALSE(nativeStepper(scene));
}

// --- Collision hulls -----------------------------------------------------------------------------

TEST(CollisionCorners, OfABoxWithStrayPointsInsideAreItsCorners) {
  std::vector<Vec3> points = {{0.1, 0.2, 0.3}, {0, 0, 0}};
  std::vector<Vec3> corners;
  for (const double x : {-1.0, 1.0})
    for (const double y : {-2.0, 2.0})
      for (const double z : {-3.0, 3.0})
        corners.emplace_back(x, y, z);
  points.insert(points.end(), corners.begin(), corners.end());
  const std::vector<Vec3> found = collisionCorners(points);
  EXPECT_EQ(found.size(), 8U);
  for (const Vec3& corner : corners)
    EXPECT_TRUE(std::ranges::find(found, corner) != found.end());
}

// A hexagonal lattice of 64 points on the unit sphere, each with its share of 4 pi / 64, covers it
// with circles of radius 0.275, which is the best possible. The test allows twice that.
TEST(CollisionCorners, OfASphereStayUnderTheirLimitAndNearIt) {
  std::vector<Vec3> points;
  const double golden = std::numbers::pi * (3.0 - std::sqrt(5.0));
  for (int index = 0; index < 500; ++index) {
    const double height = 1.0 - (2.0 * index + 1.0) / 500.0;
    const double radius = std::sqrt(1.0 - height * height);
    points.emplace_back(radius * std::cos(golden * index), height,
                        radius * std::sin(golden * index));
  }
  const std::vector<Vec3> corners = collisionCorners(points);
  EXPECT_EQ(corners.size(), kMostCorners);
  double worst = 0.0;  // largest distance of a point from its nearest corner
  for (const Vec3& point : points) {
    double nearest = 2.0;
    for (const Vec3& corner : corners)
      nearest = std::min(nearest, (corner - point).norm());
    worst = std::max(worst, nearest);
  }
  EXPECT_LT(worst, 0.55);
}

// --- Sound ---------------------------------------------------------------------------------------

std::vector<float> soundOf(const Scene& scene) {
  Result<SceneSound> sound = SceneSound::create(scene);
  EXPECT_TRUE(sound) << sound.error().message;
  std::vector<std::vector<float>> channels(1, std::vector<float>(4096));
  std::vector<float> samples;
  while (const std::size_t count = sound->render(channels))
    samples.insert(samples.end(), channels[0].begin(),
                   channels[0].begin() + static_cast<long>(count));
  return samples;
}

double levelOf(const std::vector<float>& samples) {
  double sum = 0.0;
  for (const float sample : samples)
    sum += static_cast<double>(sample) * static_cast<double>(sample);
  return 10.0 * std::log10(sum);
}

TEST(SolidSound, MeshOfABoxSoundsLikeTheBox) {
  const auto dropped = [](const json& form) {
    Scene scene = sceneOf({solidOf(form, {0, 0.2, 0}), floorPlane()}, 0.22);
    return levelOf(soundOf(scene));
  };
  const double box = dropped(boxForm(0.03, 0.02, 0.05));
  EXPECT_GT(box, -200.0);
  EXPECT_NEAR(dropped(meshForm("brick.obj")), box, 0.1);
}

// A thin plate carries far more air along than the sphere of its volume if it moves flat (8/3 a^3
// for a disc of radius a: Lamb, art. 102), and hardly any if it moves edgewise.
TEST(SolidSound, PlateIsLouderFlatThanOnItsEdge) {
  const auto dropped = [](double x, double y, double z) {
    Scene scene = sceneOf({solidOf(boxForm(x, y, z), {0, y + 0.2, 0}), floorPlane()}, 0.24);
    scene.listeners[0].position = Vec3(0, 5, 0);
    scene.sound.comparison.radiation = Radiation::compact;
    return levelOf(soundOf(scene));
  };
  EXPECT_GT(dropped(0.1, 0.002, 0.1), dropped(0.002, 0.1, 0.1) + 10.0);
}

/// Writes a closed sheet of cells by cells with waves across, 20 cm wide, and returns its file.
/// `height` and `thickness` are in widths.
std::filesystem::path writtenSheet(const std::filesystem::path& file, double height, double waves,
                                   double thickness, int cells = 17) {
  std::ofstream text(file);
  text.precision(17);
  for (const double above : {0.0, thickness})
    for (int row = 0; row <= cells; ++row)
      for (int column = 0; column <= cells; ++column) {
        const double x = static_cast<double>(row) / cells - 0.5;
        const double z = static_cast<double>(column) / cells - 0.5;
        const double turn = 2.0 * std::numbers::pi * waves;
        const double y = height * std::sin(turn * x + 0.3) * std::sin(1.1 * turn * z + 0.7) + above;
        text << "v " << 0.2 * x << ' ' << 0.2 * y << ' ' << 0.2 * z << '\n';
      }
  const auto corner = [cells](int side, int row, int column) {
    return (side * (cells + 1) + row) * (cells + 1) + column + 1;
  };
  const auto face = [&](int a, int b, int c, int d) {
    text << "f " << a << ' ' << b << ' ' << c << "\nf " << a << ' ' << c << ' ' << d << '\n';
  };
  for (int row = 0; row < cells; ++row)
    for (int column = 0; column < cells; ++column) {
      face(corner(1, row, column), corner(1, row, column + 1), corner(1, row + 1, column + 1),
           corner(1, row + 1, column));
      face(corner(0, row, column), corner(0, row + 1, column), corner(0, row + 1, column + 1),
           corner(0, row, column + 1));
    }
  for (int cell = 0; cell < cells; ++cell) {
    const auto wall = [&](int fromRow, int fromColumn, int toRow, int toColumn) {
      face(corner(0, fromRow, fromColumn), corner(0, toRow, toColumn), corner(1, toRow, toColumn),
           corner(1, fromRow, fromColumn));
    };
    wall(0, cell, 0, cell + 1);
    wall(cells, cell + 1, cells, cell);
    wall(cell + 1, 0, cell, 0);
    wall(cell, cells, cell + 1, cells);
  }
  return file;
}

// Where the waves do not survive on as many panels as are solved with, the recoil has no solution,
// and the sound is to the bit that of the sphere of equal dipole.
TEST(SolidSound, ShapeWhoseRecoilCannotBeSolvedClicksAsItsSphereAndSaysSo) {
  const TemporaryFolder folder;
  const json form = {{"type", "mesh"},
                     {"file", writtenSheet(folder.path() / "sheet.obj", 0.1, 3.5, 0.05)}};
  Scene scene = sceneOf({solidOf(form, {0, 0.1, 0}, {{"name", "sheet"}}), floorPlane()}, 0.2);
  const Result<SceneSound> sound = SceneSound::create(scene);
  ASSERT_TRUE(sound) << sound.error().message;
  ASSERT_EQ(sound->notes().size(), 1U);
  EXPECT_THAT(sound->notes()[0],
              testing::AllOf(testing::HasSubstr("sheet"), testing::HasSubstr("450 panels"),
                             testing::HasSubstr("expected a simpler mesh")));
  const std::vector<float> heard = soundOf(scene);
  EXPECT_GT(levelOf(heard), -200.0);
  scene.recoil = RecoilModel::sphere;
  EXPECT_EQ(SceneSound::create(scene)->notes(), std::vector<std::string>{});
  EXPECT_EQ(soundOf(scene), heard);
}

// Some 2700 triangles, of which no 1300 have its waves.
TEST(SolidSound, AFlowWithoutSolutionIsRefusedInWords) {
  const TemporaryFolder folder;
  const json form = {{"type", "mesh"},
                     {"file", writtenSheet(folder.path() / "sheet.obj", 0.1, 4.5, 0.01, 25)}};
  const Scene scene = sceneOf({solidOf(form, {0, 0.1, 0}), floorPlane()}, 0.2);
  const Result<SceneSound> sound = SceneSound::create(scene);
  ASSERT_FALSE(sound);
  EXPECT_THAT(sound.error().message, testing::HasSubstr("expected a simpler mesh"));
}

TEST(SolidSound, RecoilOfAShapeIsHeardUnlessTheSphereIsAskedFor) {
  Scene scene = sceneOf({solidOf(boxForm(0.1, 0.01, 0.02), {0, 0.1, 0}), floorPlane()}, 0.2);
  const std::vector<float> heard = soundOf(scene);
  scene.recoil = RecoilModel::sphere;
  EXPECT_NE(soundOf(scene), heard);
}

// ---- Pictures on meshes

constexpr double kPictureWidth = 0.225;   // m
constexpr double kPictureHeight = 0.150;  // m

/// Sound of a box that slides over a floor of 1 m x 2 m, of two triangles, with that normal map.
std::vector<float> slideOver(const std::filesystem::path& floor, json normalMap) {
  normalMap["strength"] = 0.01;  // so flat that the box stays on the floor
  normalMap["file"] =
      (std::filesystem::path(CAROM_SOURCE_DIR) / "scenes/library/textures/brick.png").string();
  const json plate = solidOf({{"type", "mesh"}, {"file", floor.string()}}, {0, 0, 0},
                             {{"movable", false}, {"normal_map", normalMap}});
  const json slider =
      solidOf(boxForm(0.02, 0.01, 0.03), {0.1, 0.01, -0.4}, {{"velocity", {0.3, 0, 1}}});
  Result<SceneSound> sound = SceneSound::create(sceneOf({slider, plate}, 0.25));
  EXPECT_TRUE(sound) << sound.error().message;
  std::vector<std::vector<float>> block(1, std::vector<float>(100'000));
  block[0].resize(sound->render(block));
  return block[0];
}

std::filesystem::path writtenFloor(const std::filesystem::path& file, double scale, double turn) {
  std::ofstream text(file);
  text.precision(17);
  for (const auto& [x, z] : {std::pair{-0.5, -1.0}, {-0.5, 1.0}, {0.5, 1.0}, {0.5, -1.0}}) {
    const Eigen::Vector2d at = scale * (Eigen::Rotation2Dd(turn) * Eigen::Vector2d(z, x));
    text << "v " << x << " 0 " << z << "\nvt " << at.x() / kPictureWidth << ' '
         << at.y() / kPictureHeight << '\n';
  }
  text << "f 1/1 2/2 3/3 4/4\n";
  return file;
}

TEST(TexturedMeshes, CoordinatesInTheFileLayThePictureOnTheBody) {
  const TemporaryFolder folder;
  const auto along = writtenFloor(folder / "along.obj", 1.0, 0.0);
  // The planar mapping is along z and x, too.
  const std::vector<float> planar = slideOver(along, {{"size", {kPictureWidth, kPictureHeight}}});
  const std::vector<float> same = slideOver(along, json::object());
  ASSERT_EQ(planar.size(), same.size());
  std::vector<float> difference = planar;
  for (std::size_t index = 0; index < planar.size(); ++index)
    difference[index] -= same[index];
  EXPECT_LT(levelOf(difference), levelOf(planar) - 60.0);
  // A turned picture gives another sound that is about as loud.
  const auto turned = slideOver(writtenFloor(folder / "turned.obj", 1.0, 1.0), json::object());
  for (std::size_t index = 0; index < planar.size(); ++index)
    difference[index] = turned[index] - same[index];
  EXPECT_GT(levelOf(difference), levelOf(planar) - 6.0);
  EXPECT_NEAR(levelOf(turned), levelOf(planar), 6.0);
}

TEST(TexturedMeshes, CoordinatesGoWithTheMeshOfABodyThatMoves) {
  const TemporaryFolder folder;
  // A wedge with a picture on it, whose centre of mass differs from the origin of its file.
  std::ofstream text(folder / "wedge.obj");
  text << "v 0 0 0\nv 0.1 0 0\nv 0 0 0.1\nv 0 0.1 0\nvt 0 0\nvt 1 0\nvt 0 1\n"
          "f 1/1 2/2 3/3\nf 1/1 3/2 4/3\nf 1/1 4/2 2/3\nf 2/1 4/2 3/3\n";
  text.close();
  const json form = {{"type", "mesh"}, {"file", (folder / "wedge.obj").string()}};
  const Scene scene = sceneOf(solidOf(form, {0, 0, 0}));
  EXPECT_TRUE(hasTextureCoordinates(solidIn(scene)));
  EXPECT_FALSE(
      hasTextureCoordinates(solidIn(sceneOf(solidOf(meshForm("l_shape.obj"), {0, 0, 0})))));
  const auto coordinates = TextureCoordinates::of(
      surfaceOf(solidIn(scene)),
      std::get<std::shared_ptr<const SolidMesh>>(solidIn(scene).form)->coordinates);
  ASSERT_TRUE(coordinates) << coordinates.error().message;
  // The point at a quarter of x and half of z on the bottom, seen from the centre of mass.
  const Vec3 point = Vec3(0.025, 0.0, 0.05) - Vec3(0.025, 0.025, 0.025);
  const Eigen::Vector2d at = coordinates->at(point).at.cwiseQuotient(coordinates->size());
  EXPECT_LT((at - Eigen::Vector2d(0.25, 0.5)).norm(), 1e-6);
}

}  // namespace
}  // namespace carom::test
