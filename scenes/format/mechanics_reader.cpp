#include "scenes/format/mechanics_reader.h"

#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "native/math/contact_time.h"
#include "native/scheduling/box_contact.h"
#include "native/scheduling/oscillation.h"
#include "scenes/values/scene_ranges.h"

namespace carom::scenes {

using namespace modal;
using namespace native;

namespace {

// scene.schema.json and docs/scenes.md repeat these; a test compares the schema.

constexpr NumberRange kFriction{.noun = "a coefficient of friction", .min = 0.0, .max = 10.0};
constexpr NumberRange kRolling{
    .noun = "a coefficient of rolling friction", .min = 0.0, .max = 10.0};
constexpr NumberRange kPivoting{
    .noun = "an arm of pivoting friction", .min = 0.0, .max = 1.0, .unit = "metres"};
constexpr NumberRange kLawSpeed{
    .noun = "a restitution speed", .min = 1e-6, .max = 1e4, .unit = "m/s"};
constexpr NumberRange kSpin{
    .noun = "a component of spin", .min = -1e6, .max = 1e6, .unit = "rad/s"};
constexpr NumberRange kAmplitude{
    .noun = "a component of an amplitude", .min = -1e3, .max = 1e3, .unit = "metres"};
constexpr NumberRange kFrequency{
    .noun = "a frequency of oscillation", .min = 1e-3, .max = 1e4, .unit = "Hz"};
constexpr NumberRange kPhase{.noun = "a phase", .min = -1e3, .max = 1e3, .unit = "radians"};
constexpr NumberRange kAxis{.noun = "a component of an axis", .min = -1e6, .max = 1e6};
constexpr NumberRange kAngle{
    .noun = "an angle of rotation", .min = -360.0, .max = 360.0, .unit = "degrees"};
constexpr NumberRange kLength{.noun = "a length", .min = 0.0, .max = 1e6, .unit = "metres"};
constexpr NumberRange kHarmonic{
    .noun = "a harmonic strength", .min = -1e8, .max = 1e8, .unit = "1/s^2"};
constexpr NumberRange kInverseSquare{
    .noun = "an inverse square strength", .min = -1e15, .max = 1e15, .unit = "m^3/s^2"};
constexpr NumberRange kDragRate{.noun = "a rate of drag", .min = 0.0, .max = 1e4, .unit = "1/s"};
constexpr NumberRange kForceStep{
    .noun = "a step of forces", .min = 1e-6, .max = 0.1, .unit = "seconds"};

constexpr TextRange kBodyName{.noun = "the name of a body", .minLength = 1, .maxLength = 100};

// Connected rods share one linear system, so that they are limited; springs are mere sums.
constexpr std::size_t kMaxRods = 1000;
constexpr std::size_t kMaxSprings = 10000;
constexpr std::size_t kMaxFields = 100;

constexpr double kDegreesOfTurn = 360.0;

/// Returns the unit vector of a vector that is not zero; the
/// first division keeps tiny ones from underflow.
Vec3 unit(const Vec3& vector) {
  const Vec3 scaled = vector / vector.cwiseAbs().maxCoeff();
  return scaled / std::sqrt(dotInOrder(scaled, scaled));
}

/// The two ends of a spring or rod: a sphere, and another sphere or an anchor.
struct Ends {
  BodyId sphere = 0;
  BodyId other = kAnchor;
  Vec3 anchor = Vec3::Zero();  // m
};

/// Reads "mechanics" of one scene.
class MechanicsReader {
 public:
  explicit MechanicsReader(Scene& scene) : scene_(scene) {
    for (std::size_t index = 0; index < scene.bodies.size(); ++index)
      bodies_.emplace(scene.bodies[index].name, static_cast<BodyId>(index));
  }

  void read(const JsonNode& node);

 private:
  void readRod(const JsonNode& entry);
  void readSpring(const JsonNode& entry);
  void readField(const JsonNode& entry);
  void readDrag(const JsonNode& node);
  Ends readEnds(const JsonNode& entry, std::string_view noun) const;
  BodyId sphereOf(const JsonNode& name) const;
  const Vec3& placeOf(BodyId sphere) const {
    return std::get<SphereShape>(scene_.bodies[sphere].shape).position;
  }

  Scene& scene_;
  std::unordered_map<std::string_view, BodyId> bodies_;
};

void MechanicsReader::read(const JsonNode& node) {
  if (!node.expectObject("a description of the mechanics",
                         {"simultaneous", "rods", "springs", "fields", "drag", "force_step"})) {
    return;
  }
  SceneMechanics& mechanics = scene_.mechanics;
  if (const auto choice = node.find("simultaneous")) {
    const bool hertz =
        choice->choice("a way of simultaneous contacts", {"reflections", "hertz"}) == 1;
    mechanics.simultaneous = hertz ? Simultaneous::hertz : Simultaneous::reflections;
  }
  const auto each = [&](std::string_view key, std::string_view noun, std::size_t max,
                        void (MechanicsReader::*readOne)(const JsonNode&)) {
    const auto list = node.find(key);
    if (!list) return;
    for (const JsonNode& entry : list->elements(noun, 0, max)) {
      if (!node.failed()) (this->*readOne)(entry);
    }
  };
  each("rods", "a list of rods", kMaxRods, &MechanicsReader::readRod);
  each("springs", "a list of springs", kMaxSprings, &MechanicsReader::readSpring);
  each("fields", "a list of fields", kMaxFields, &MechanicsReader::readField);
  if (const auto drag = node.find("drag")) readDrag(*drag);
  mechanics.forceStep = node.number("force_step", kForceStep, 0.0);
}

void MechanicsReader::readRod(const JsonNode& entry) {
  if (!entry.expectObject("a rod", {"bodies", "anchor"})) return;
  const Ends ends = readEnds(entry, "rod");
  if (entry.failed()) return;
  const Vec3& end = ends.other == kAnchor ? ends.anchor : placeOf(ends.other);
  if (placeOf(ends.sphere) == end) {
    entry.find("anchor")->fail("the rod has length 0; expected an anchor away from the centre of " +
                               inQuotes(scene_.bodies[ends.sphere].name));
    return;
  }
  scene_.mechanics.rods.push_back({ends.sphere, ends.other, ends.anchor});
}

void MechanicsReader::readSpring(const JsonNode& entry) {
  if (!entry.expectObject("a spring", {"bodies", "anchor", "length", "stiffness", "damping"})) {
    return;
  }
  const Ends ends = readEnds(entry, "spring");
  scene_.mechanics.springs.push_back({.sphere = ends.sphere,
                                      .other = ends.other,
                                      .anchor = ends.anchor,
                                      .length = entry.number("length", kLength),
                                      .stiffness = entry.number("stiffness", kStiffness),
                                      .damping = entry.number("damping", kDamping, 0.0)});
}

/// Reads the ends: one body and an anchor, or two bodies.
Ends MechanicsReader::readEnds(const JsonNode& entry, std::string_view noun) const {
  Ends ends;
  const auto bodies = entry.require("bodies", "an array of one or two names of spheres");
  if (!bodies) return ends;
  const std::vector<JsonNode> names = bodies->elements("a list of ends", 1, 2);
  if (entry.failed()) return ends;
  const auto anchor = entry.find("anchor");
  if ((names.size() == 1) != anchor.has_value()) {
    entry.fail(std::string("the ") + std::string(noun) +
               (anchor ? " joins two bodies and has an anchor; expected one of these"
                       : " has one body and no anchor; expected an \"anchor\", or two bodies"));
    return ends;
  }
  ends.sphere = sphereOf(names[0]);
  if (anchor) {
    ends.anchor = anchor->vector(kPlace);
    return ends;
  }
  ends.other = sphereOf(names[1]);
  if (!entry.failed() && ends.other == ends.sphere)
    names[1].fail("the " + std::string(noun) + " begins and ends at one body; expected another");
  return ends;
}

BodyId MechanicsReader::sphereOf(const JsonNode& name) const {
  const std::string text = name.text(kBodyName);
  if (name.failed()) return 0;
  const auto place = bodies_.find(text);
  if (place == bodies_.end()) {
    name.fail("there is no body " + inQuotes(text) +
              "; expected the name of a sphere, as \"NAME\", or \"GROUP.1\" of a group");
    return 0;
  }
  if (std::holds_alternative<SphereShape>(scene_.bodies[place->second].shape)) return place->second;
  name.fail(inQuotes(text) + " cannot move; expected the name of a sphere");
  return 0;
}

void MechanicsReader::readField(const JsonNode& entry) {
  if (!entry.expectObject("a field", {"centre", "harmonic", "inverse_square"})) return;
  scene_.mechanics.fields.push_back(
      {.centre = entry.vector("centre", kPlace, Vec3::Zero()),
       .harmonic = entry.number("harmonic", kHarmonic, 0.0),
       .inverseSquare = entry.number("inverse_square", kInverseSquare, 0.0)});
}

void MechanicsReader::readDrag(const JsonNode& node) {
  if (!node.expectObject("a drag", {"rate", "wind"})) return;
  scene_.mechanics.drag = {.rate = node.number("rate", kDragRate),
                           .wind = node.vector("wind", kVelocity, Vec3::Zero())};
}

Oscillation readOscillation(const JsonNode& node) {
  if (!node.expectObject("an oscillation", {"amplitude", "frequency", "phase"})) return {};
  return {.amplitude = node.vector("amplitude", kAmplitude),
          .frequency = node.number("frequency", kFrequency),
          .phase = node.number("phase", kPhase, 0.0)};
}

/// Returns the displacement of a oscillating plane at time 0 along its normal, m.
double shiftAtStart(const PlaneShape& plane) {
  const double amplitude = dotInOrder(plane.normal, plane.oscillation.amplitude);
  return amplitude == 0.0 ? 0.0
                          : amplitude * sineOfTurns(plane.oscillation.phase / kWholeTurn).sine;
}

}  // namespace

ContactTraits readFriction(const JsonNode& node, const ContactTraits& absent) {
  ContactTraits contact = absent;
  if (const auto friction = node.find("friction")) {
    contact.friction = friction->number(kFriction);
    contact.defaultFriction = 0.0;
  }
  return contact;
}

ContactTraits readContactTraits(const JsonNode& material, const ContactTraits& absent) {
  ContactTraits contact = readFriction(material, absent);
  contact.rollingFriction = material.number("rolling_friction", kRolling, absent.rollingFriction);
  contact.pivotingFriction =
      material.number("pivoting_friction", kPivoting, absent.pivotingFriction);
  RestitutionLaw& law = contact.restitutionLaw;
  if (const auto choice = material.find("restitution_law")) {
    constexpr std::array<SpeedLaw, 3> kLaws = {SpeedLaw::constant, SpeedLaw::viscoelastic,
                                               SpeedLaw::plastic};
    law.law =
        kLaws.at(choice->choice("a law of restitution", {"constant", "viscoelastic", "plastic"}));
    if (law.law == SpeedLaw::constant) law = {};
  }
  const auto speed = material.find("restitution_speed");
  if (!speed) return contact;
  law.speed = speed->number(kLawSpeed);
  if (law.law == SpeedLaw::constant)
    speed->fail(
        "a constant restitution has no use for it; expected none, or \"restitution_law\": "
        "\"viscoelastic\" or \"plastic\"");
  return contact;
}

Vec3 readSpin(const JsonNode& sphere) {
  return sphere.vector("spin", kSpin, Vec3::Zero());
}

void readMotion(const JsonNode& entry, PlaneShape& plane) {
  plane.velocity = entry.vector("velocity", kVelocity, Vec3::Zero());
  if (const auto oscillation = entry.find("oscillation"))
    plane.oscillation = readOscillation(*oscillation);
}

Quat readRotation(const JsonNode& block) {
  const auto node = block.find("rotation");
  if (!node || !node->expectObject("a rotation", {"axis", "angle"})) return Quat::Identity();
  const Vec3 axis = node->vector("axis", kAxis);
  const double angle = node->number("angle", kAngle);
  if (!node->failed() && axis.isZero(0.0))
    node->find("axis")->fail("the axis has no direction; expected one component not 0");
  if (node->failed()) return Quat::Identity();
  const SineCosine half = sineOfTurns(0.5 * angle / kDegreesOfTurn);
  const Vec3 imaginary = half.sine * unit(axis);
  const double length = std::sqrt(half.cosine * half.cosine + dotInOrder(imaginary, imaginary));
  return {half.cosine / length, imaginary.x() / length, imaginary.y() / length,
          imaginary.z() / length};
}

double gapAtStart(const PlaneShape& plane, const Vec3& centre, double radius) {
  const double gap = plane.normal.dot(centre) - plane.offset - radius;
  return plane.oscillation.amplitude.isZero(0.0) ? gap : gap - shiftAtStart(plane);
}

double gapAtStart(const BlockShape& block, const Vec3& centre, double radius) {
  const Vec3 inBlock = along(columnsOf(block.orientation), centre - block.centre);
  const BoxNearest nearest = nearestOf(block.halfExtents, inBlock);
  if (nearest.feature == BoxFeature::inside) return -std::numeric_limits<double>::infinity();
  return nearest.distance - radius;
}

void readMechanics(const JsonNode& node, Scene& scene) {
  MechanicsReader(scene).read(node);
}

}  // namespace carom::scenes
