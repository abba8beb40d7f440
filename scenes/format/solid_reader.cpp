#include "scenes/format/solid_reader.h"

#include <array>
#include <string>
#include <string_view>
#include <utility>

#include "scenes/format/mechanics_reader.h"
#include "scenes/values/scene_ranges.h"

namespace carom::scenes {

using namespace modal;
using namespace native;

namespace {

// scene.schema.json and docs/scenes.md repeat these; a test compares the schema.

constexpr NumberRange kHalfExtent{
    .noun = "a half extent", .min = 1e-6, .max = 1e4, .unit = "metres"};
constexpr NumberRange kHeight{.noun = "a height", .min = 2e-6, .max = 2e4, .unit = "metres"};
constexpr NumberRange kScale{.noun = "a scale", .min = 1e-6, .max = 1e6, .unit = "metres"};

void readBoxForm(const JsonNode& node, SolidShape& solid) {
  if (!node.expectObject("a box", {"type", "half_extents"})) return;
  solid.form = BoxForm{node.vector("half_extents", kHalfExtent)};
}

void readCylinderForm(const JsonNode& node, SolidShape& solid) {
  if (!node.expectObject("a cylinder", {"type", "radius", "height"})) return;
  CylinderForm cylinder;
  cylinder.radius = node.number("radius", kRadius);
  cylinder.height = node.number("height", kHeight);
  solid.form = cylinder;
}

struct MeasuresOfForm {
  template <class Form>
  SolidMeasures operator()(const Form& form) const {
    return measuresOf(form);
  }
  SolidMeasures operator()(const std::shared_ptr<const SolidMesh>& mesh) const {
    return measuresOf(mesh->surface);
  }
};

/// Sets the mass, centre of mass and inertia of a solid that can move.
void weigh(const JsonNode& entry, double density, SolidShape& solid) {
  const SolidMeasures measures = std::visit(MeasuresOfForm{}, solid.form);
  solid.centreOfMass = measures.centroid;
  solid.mass = entry.number("mass", kMass, density * measures.volume);
  solid.inertia = solid.mass / measures.volume * measures.inertia;
}

void refuseMotion(const JsonNode& entry) {
  for (const char* key : {"mass", "velocity", "spin"}) {
    if (const auto node = entry.find(key))
      node->fail("a solid that cannot move has no use for it; expected none, or \"movable\": true");
  }
}

}  // namespace

bool SolidReader::expectSolid(const JsonNode& entry) {
  return entry.expectObject(
      "a solid", {"type", "name", "shape", "material", "position", "rotation", "velocity", "spin",
                  "mass", "movable", "modes", "friction", "roughness", "normal_map"});
}

SolidShape SolidReader::read(const JsonNode& entry, double density) {
  SolidShape solid;
  const bool canMove = entry.boolean("movable", true);
  if (!canMove) refuseMotion(entry);
  const Vec3 origin = entry.vector("position", kPlace);
  solid.orientation = readRotation(entry);
  solid.velocity = entry.vector("velocity", kVelocity, Vec3::Zero());
  solid.spin = readSpin(entry);
  const auto shape = entry.require("shape", "a box, a cylinder or a mesh");
  if (shape && !entry.failed()) readShape(*shape, canMove, solid);
  if (entry.failed()) return solid;
  if (canMove) weigh(entry, density, solid);
  solid.position = origin + solid.orientation * solid.centreOfMass;
  return solid;
}

void SolidReader::readShape(const JsonNode& node, bool canMove, SolidShape& solid) {
  if (!node.isObject()) {
    node.failAs("a shape", "an object");
    return;
  }
  const auto type = node.require("type", R"(one of "box", "cylinder", "mesh")");
  if (!type) return;
  const std::size_t choice = type->choice("a type of shape", {"box", "cylinder", "mesh"});
  if (node.failed()) return;
  if (choice == 0) readBoxForm(node, solid);
  if (choice == 1) readCylinderForm(node, solid);
  if (choice == 2) readMesh(node, canMove, solid);
}

void SolidReader::readMesh(const JsonNode& node, bool canMove, SolidShape& solid) {
  if (!node.expectObject("a mesh", {"type", "file", "pieces", "scale"})) return;
  MeshShelf::Request request;
  const auto file = node.require("file", "the name of a mesh file");
  if (!file) return;
  request.file = folder_.fileOf(*file);
  if (const auto pieces = node.find("pieces")) {
    request.pieces = folder_.fileOf(*pieces);
    if (!canMove)
      pieces->fail(
          "a mesh that cannot move collides as it is; expected none, or \"movable\": true");
  }
  request.scale = node.number("scale", kScale, 1.0);
  if (node.failed()) return;
  const auto mesh = meshes_.get(request);
  if (!mesh) {
    file->fail(mesh.error().message);
  } else if (const Status valid = validate((*mesh)->surface, canMove); !valid) {
    file->fail(request.file.string() + ": the mesh " + valid.error().message);
  } else {
    solid.form = *mesh;
  }
}

}  // namespace carom::scenes
