#include "scenes/format/jello_reader.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <Eigen/Geometry>

#include "scenes/format/mechanics_reader.h"
#include "scenes/values/scene_ranges.h"

namespace carom::scenes {

using namespace modal;
using namespace native;

namespace {

// scene.schema.json and docs/scenes.md repeat these; a test compares the schema.

constexpr NumberRange kPoints{.noun = "a number of points",
                              .min = 2.0,
                              .max = static_cast<double>(kMostJelloPoints),
                              .whole = true};
constexpr NumberRange kSize{.noun = "a size", .min = 1e-6, .max = 1e4, .unit = "metres"};
constexpr NumberRange kPointMass{.noun = "a mass", .min = 1e-18, .max = 1e18, .unit = "kilograms"};
constexpr NumberRange kForce{
    .noun = "a component of a force", .min = -1e12, .max = 1e12, .unit = "newtons"};
constexpr NumberRange kJelloStep{.noun = "a step", .min = 1e-7, .max = 0.1, .unit = "seconds"};
constexpr NumberRange kError{.noun = "an error", .min = 1e-9, .max = 1.0, .unit = "metres"};
constexpr std::size_t kMostGridPoints = 128;

std::size_t cubed(std::size_t count) {
  return count * count * count;
}

std::vector<Vec3> readVectors(const JsonNode& node, const NumberRange& component) {
  std::vector<Vec3> vectors;
  for (const JsonNode& entry : node.elements("a list of vectors", 0, cubed(kMostJelloPoints))) {
    if (entry.failed()) break;
    vectors.push_back(entry.vector(component));
  }
  return vectors;
}

/// Records an error unless there is one vector for each point of the lattice.
void expectCount(const JsonNode& node, std::size_t count, std::size_t points) {
  if (node.failed() || count == cubed(points)) return;
  const std::string side = std::to_string(points);
  node.fail(std::to_string(count) + " vectors; expected " + side + " x " + side + " x " + side +
            ", one for each point");
}

void readPlaces(const JsonNode& entry, JelloShape& jello) {
  const auto positions = entry.find("positions");
  if (!positions) {
    jello.positions =
        restingPoints(jello.lattice, entry.vector("position", kPlace), readRotation(entry));
    return;
  }
  for (const char* key : {"position", "rotation"})
    if (const auto node = entry.find(key))
      node->fail("the jello has \"positions\" of its points; expected one of the two");
  jello.positions = readVectors(*positions, kPlace);
  expectCount(*positions, jello.positions.size(), jello.lattice.count);
}

void readVelocities(const JsonNode& entry, JelloShape& jello) {
  if (const auto velocities = entry.find("velocities")) {
    for (const char* key : {"velocity", "spin"})
      if (const auto node = entry.find(key))
        node->fail("the jello has \"velocities\" of its points; expected one of the two");
    jello.velocities = readVectors(*velocities, kVelocity);
    expectCount(*velocities, jello.velocities.size(), jello.lattice.count);
    return;
  }
  const Vec3 velocity = entry.vector("velocity", kVelocity, Vec3::Zero());
  const Vec3 spin = readSpin(entry);
  Vec3 middle = Vec3::Zero();
  for (const Vec3& point : jello.positions)
    middle += point / static_cast<double>(jello.positions.size());
  for (const Vec3& point : jello.positions)
    jello.velocities.emplace_back(velocity + spin.cross(point - middle));
}

void readContact(const JsonNode& node, JelloPenalty& contact) {
  if (!node.expectObject("a contact of jello", {"stiffness", "damping"})) return;
  contact.stiffness = node.number("stiffness", kStiffness, contact.stiffness);
  contact.damping = node.number("damping", kDamping, contact.damping);
}

void readField(const JsonNode& node, JelloField& field) {
  if (!node.expectObject("a field of forces", {"min", "max", "forces"})) return;
  const auto forces = node.require("forces", "an array of vectors (newtons)");
  if (!forces) return;
  field.forces = readVectors(*forces, kForce);
  if (node.failed()) return;
  field.count = static_cast<std::size_t>(std::lround(std::cbrt(field.forces.size())));
  if (field.count == 0 || field.count > kMostGridPoints ||
      cubed(field.count) != field.forces.size()) {
    forces->fail(std::to_string(field.forces.size()) +
                 " forces; expected as many as a cube of 1 to 128 along each axis");
    return;
  }
  if (field.count == 1 && !node.find("min") && !node.find("max")) return;  // the same everywhere
  field.min = node.vector("min", kPlace);
  field.max = node.vector("max", kPlace);
  if (!node.failed() && (field.max - field.min).minCoeff() <= 0.0)
    node.find("max")->fail("is not above \"min\"; expected max > min on every axis");
}

void readStepping(const JsonNode& entry, JelloShape& jello) {
  if (const auto integrator = entry.find("integrator")) {
    // The words are in the order of JelloIntegrator.
    const std::size_t choice =
        integrator->choice("an integrator", {"explicit_euler", "symplectic_euler", "midpoint",
                                             "rk4", "backward_euler", "leapfrog", "auto"});
    if (choice < kJelloIntegrators) jello.integrator = static_cast<JelloIntegrator>(choice);
  }
  jello.step = entry.number("step", kJelloStep, 0.0);
  jello.error = entry.number("error", kError, jello.error);
  const auto step = entry.find("step");
  if (step && !jello.integrator)
    step->fail("goes with an integrator; expected \"integrator\" other than \"auto\", or no step");
  const auto error = entry.find("error");
  if (error && step) error->fail("the jello has a step; expected one of the two");
}

}  // namespace

bool expectJello(const JsonNode& entry) {
  return entry.expectObject(
      "a jello", {"type", "name", "points", "size", "mass", "stiffness", "damping", "contact",
                  "field", "position", "rotation", "positions", "velocity", "spin", "velocities",
                  "integrator", "step", "error"});
}

JelloShape readJello(const JsonNode& entry) {
  JelloShape jello;
  JelloLattice& lattice = jello.lattice;
  lattice.count =
      static_cast<std::size_t>(entry.number("points", kPoints, static_cast<double>(lattice.count)));
  lattice.size = entry.vector("size", kSize);
  const double mass = entry.number("mass", kPointMass);
  if (entry.failed()) return jello;
  lattice.pointMass = mass / static_cast<double>(cubed(lattice.count));
  lattice.stiffness = entry.number("stiffness", kStiffness);
  lattice.damping = entry.number("damping", kDamping, 0.0);
  // The default contact has the stiffness of two springs and their damping, so that the same step
  // suits both.
  jello.contact = {2.0 * lattice.stiffness, lattice.damping};
  if (const auto contact = entry.find("contact")) readContact(*contact, jello.contact);
  if (const auto field = entry.find("field")) readField(*field, jello.field);
  if (entry.failed()) return jello;
  readPlaces(entry, jello);
  if (entry.failed()) return jello;
  readVelocities(entry, jello);
  readStepping(entry, jello);
  return jello;
}

Material jelloMaterial(const JelloLattice& lattice) {
  const Vec3 spacing = lattice.size / static_cast<double>(lattice.count - 1);
  Vec3 stiffness = Vec3::Zero();  // Pa, for strains along each axis
  for (const JelloSpring& spring : jelloSprings()) {
    const Vec3 way = spacing.cwiseProduct(Vec3(spring.to[0], spring.to[1], spring.to[2]));
    const Vec3 squares = way.cwiseProduct(way);
    stiffness +=
        lattice.stiffness / spacing.prod() / way.squaredNorm() * squares.cwiseProduct(squares);
  }
  const double poisson = 0.25;
  Material material;
  material.name = "jello";
  material.density =
      lattice.pointMass * std::pow(static_cast<double>(lattice.count), 3) / lattice.size.prod();
  // A lattice without springs gets 1 Pa: contact mechanics needs some stiffness.
  material.youngsModulus =
      std::max(1.0, stiffness.mean() * (1.0 + poisson) * (1.0 - 2.0 * poisson) / (1.0 - poisson));
  material.poissonsRatio = poisson;
  material.restitution = 0.5;
  return material;
}

}  // namespace carom::scenes
