#include "scenes/values/aim.h"

#include "scenes/values/scene_ranges.h"

namespace carom::scenes {

using modal::JsonNode;
using modal::NumberRange;

namespace {

constexpr NumberRange kDirection{.noun = "a component of a direction", .min = -1e6, .max = 1e6};
constexpr double kParallel = 1e-6;  // sine of the angle between forward and up

/// Returns the unit vector; zero for zero.
Vec3 directionOf(const Vec3& vector) {
  const double largest = vector.cwiseAbs().maxCoeff();  // dividing by it avoids underflow
  return largest > 0.0 ? (vector / largest).normalized() : Vec3::Zero();
}

void readDirection(const JsonNode& node, Vec3& direction) {
  direction = node.vector(kDirection);
  if (direction.isZero(0.0)) node.fail("it has no direction; expected one component not 0");
}

}  // namespace

void readAim(const JsonNode& node, Aim& aim) {
  const auto target = node.find("looks_at");
  const auto forward = node.find("forward");
  if (target && forward) {
    node.fail(R"(both "looks_at" and "forward" say where it looks; expected one of the two)");
    return;
  }
  if (target) aim.target = target->vector(kPlace);
  if (forward) {
    aim.target.reset();
    readDirection(*forward, aim.forward);
  }
  if (const auto up = node.find("up")) readDirection(*up, aim.up);
}

std::optional<Quat> orientationTowards(const Vec3& forward, const Vec3& up) {
  const Vec3 ahead = directionOf(forward);
  const Vec3 right = ahead.cross(directionOf(up));
  if (right.norm() < kParallel) return std::nullopt;
  Eigen::Matrix3d frame;
  frame.col(0) = right.normalized();
  frame.col(1) = frame.col(0).cross(ahead);
  frame.col(2) = -ahead;
  return Quat(frame).normalized();
}

Quat orientationOf(const Aim& aim, const Vec3& position, const JsonNode& node) {
  if (node.failed()) return Quat::Identity();
  const Vec3 forward = aim.target ? Vec3(*aim.target - position) : aim.forward;
  if (forward.isZero(0.0)) {
    node.fail("the point that it looks at is where it stands; expected another");
    return Quat::Identity();
  }
  const auto orientation = orientationTowards(forward, aim.up);
  if (orientation) return *orientation;
  node.fail(
      "it looks along its up direction, so it has no right; expected \"up\" across where it "
      "looks, [0, 1, 0] if absent");
  return Quat::Identity();
}

}  // namespace carom::scenes
