#include "audio/contact/contact_drive.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "audio/model/hertz.h"

namespace carom::audio {
namespace {

/// Factor by which another axis must be nearer to the normal before a surface is projected along it
/// instead.
constexpr double kTurned = 1.2;
/// m: largest gap between the surfaces, so that they can meet again.
constexpr double kFarthestPoint = 1.0;
/// Share of a step's path: a gap this small between the end of the last path and the begin of this
/// one is closed within the step.
constexpr double kNear = 2e-3;
/// Share of a step's path: a path on the texture that is farther from where it should be has leapt
/// over a seam of the coordinates.
constexpr double kLeap = 0.5;
/// Upper bound of a path's length over its part along the surface: beyond it the path leads across
/// the surface and does not bend with it.
constexpr double kMostBent = 2.0;
/// Scan::axis of a surface that has texture coordinates.
constexpr int kUnwrapped = 3;
/// s: time constant with which bumps that take too much energy are flattened.
constexpr double kFlattening = 0.1;
/// Samples of the texture while a contact passes over the width that it averages over, and the most
/// nodes between two samples.
constexpr double kLooksPerWidth = 4.0;
constexpr double kMostStride = 8.0;
/// Least factor on the height of flattened bumps.
constexpr double kFlattest = 1e-3;
/// Largest stiffness, in masses over the squared duration of a node: as good as rigid.
constexpr double kStiffest = 1e3;
/// Least stiffness, as a share of the largest: as good as none.
constexpr double kSoftest = 1e-9;
/// Distance, as a share of their rms height, by which asperities give way for e times the load
/// (Persson 2007, Phys. Rev. Lett. 99, 125502, "Relation between interfacial separation and load").
constexpr double kSqueezed = 0.4;
/// m/s^2: bound of load over mass in the rattling of a body at rest, which rattles no more for
/// being pressed harder than by its weight.
constexpr double kHeaviest = 10.0;
/// N: least load in the stiffness of the contact, which would be 0 without load.
constexpr double kLightest = 1e-12;
/// Samples: allowance for rounding in the number of nodes of a step.
constexpr double kRounding = 1e-6;
/// Depth to which the load presses the bodies over the depth at which the dashpot acts in full.
constexpr double kGrip = 4.0;
/// Lower restitutions count as this one.
constexpr double kDeadest = 0.01;

int axisOf(const Vec3& normal, int before) {
  Eigen::Index nearest = 0;
  normal.cwiseAbs().maxCoeff(&nearest);
  if (before >= 0 && std::abs(normal[nearest]) < kTurned * std::abs(normal[before])) return before;
  return static_cast<int>(nearest);
}

/// True for a place that a path can have: a host's may be finite, and overflow where it is turned.
bool isPlace(const Vec3& point) {
  constexpr double kFarthest = 1e12;  // m
  return point.norm() <= kFarthest;
}

/// Projects a point onto the plane across the normal, with axes turned as little as possible from
/// those across `axis`. A ball's surface is unrolled instead, so that lengths stay along the great
/// circles through its pole.
Vec2 projected(const ScannedSurface& surface, const Vec3& point, int axis) {
  const int first = (axis + 1) % 3;
  const int second = (axis + 2) % 3;
  if (surface.ballRadius > 0.0 && std::isfinite(surface.ballRadius)) {
    const double height = std::abs(point[axis]);
    return surface.ballRadius *
           Vec2(std::atan2(point[first], height), std::atan2(point[second], height));
  }
  const Vec3& normal = surface.normal;
  const Vec3 u = (Vec3::Unit(first) - normal[first] * normal).normalized();
  const Vec3 v = std::copysign(1.0, normal[axis]) * normal.cross(u);
  return {u.dot(point), v.dot(point)};
}

}  // namespace

/// Smooths load and mass, which the mechanics scatters from step to step, and finds the width of
/// the contact.
void ContactDrive::settle(const Step& step) {
  const double share = mass_ == 0.0 ? 1.0 : -std::expm1(-step.duration / kSettling);
  load_ += share * (step.load - load_);
  mass_ += share * (step.mass - mass_);
  width_ = hertzWidth({load_, step.radius, step.modulus});
}

/// Computes the contact's spring and dashpot for nodes of dt (s).
void ContactDrive::tighten(const Step& step, double dt) {
  const double stiffest = kStiffest * mass_ / (dt * dt);
  double height = 0.0;
  for (std::size_t side = 0; side < scans_.size(); ++side) {
    const SurfaceTexture* texture = step.surfaces[side].texture;
    const double stretch = scans_[side].stretch;
    if (texture != nullptr && stretch > 0.0)
      height = std::hypot(height, texture->heightBelow(stretch * width_) / stretch);
  }
  const double load = std::max(load_, kLightest);
  const double hertz = hertzStiffness({load, step.radius, step.modulus});
  const double compliance = 1.0 / hertz + kSqueezed * height / load;
  const double before = spring_.stiffness;
  spring_.stiffness = std::clamp(1.0 / compliance, kSoftest * stiffest, stiffest);
  if (before > 0.0 && pressed_ > 0.0) pressed_ *= before / spring_.stiffness;  // the force stays
  const double turns = std::sqrt(spring_.stiffness / mass_) * dt;
  spring_.implicit = std::max(0.5, 1.0 - 0.5 / turns);
  // Damping of a linear spring for which the restitution is the ratio of the speeds after and
  // before half a swing.
  const double decay = -std::log(std::max(step.restitution, kDeadest));
  spring_.damping =
      2.0 * std::sqrt(spring_.stiffness * mass_) * decay / std::hypot(std::numbers::pi, decay);
  spring_.dt = dt;
  spring_.perForce = dt / mass_;
  spring_.fall = spring_.perForce * load_;
  spring_.grip = kGrip * spring_.stiffness / load;
  spring_.resistance = spring_.stiffness * spring_.implicit * dt + spring_.damping;
  spring_.yielding = 1.0 / (1.0 + spring_.perForce * spring_.resistance * spring_.implicit);
}

/// Finds where a surface without coordinates is sampled in the step, projected along an axis.
void ContactDrive::project(const ScannedSurface& surface, Scan& scan) {
  const int axis = axisOf(surface.normal, scan.axis);
  const Vec2 from = projected(surface, surface.from, axis);
  scan.along = projected(surface, surface.to, axis) - from;
  scan.climbed = scan.along;
  if (axis != scan.axis)
    scan.at = from;
  else if ((from - scan.at).norm() <= kNear * scan.along.norm())
    scan.along += from - scan.at;
  scan.axis = axis;
  scan.stretch = 1.0;
}

/// Finds where a surface with texture coordinates is sampled in the step.
void ContactDrive::unwrap(const ScannedSurface& surface, Scan& scan) {
  const TextureCoordinates::Patch from = surface.coordinates->at(surface.from);
  const Vec3 way = surface.to - surface.from;
  scan.along = from.perMetre * way;
  scan.climbed = from.tangents * way;
  // Over an edge the path leaves the plane of its triangle, and bends with the surface.
  if (const double bent = way.norm() / scan.climbed.norm(); bent < kMostBent) {
    scan.along *= bent;
    scan.climbed *= bent;
  }
  // Over several triangles of one sheet the path follows their coordinates; across a seam these
  // leap.
  const double length = scan.along.norm();
  const Vec2 to = surface.coordinates->at(surface.to).at;
  if ((to - from.at - scan.along).norm() <= kLeap * length) scan.along = to - from.at;
  const bool isFirst = scan.axis != kUnwrapped;
  const bool goesOn = (surface.from - scan.end).norm() <= kLeap * way.norm();
  if (isFirst || (goesOn && (from.at - scan.led).norm() > kLeap * length))
    scan.at = from.at;
  else if ((from.at - scan.at).norm() <= kNear * length)
    scan.along += from.at - scan.at;
  scan.axis = kUnwrapped;
  scan.end = surface.to;
  scan.led = from.at + scan.along;
  scan.stretch = from.stretch;
}

/// Finds where and how finely a surface is sampled in the step.
void ContactDrive::aim(const Step& step, const ScannedSurface& surface, Scan& scan) const {
  scan.texture = nullptr;
  if (surface.texture == nullptr) return;
  if (surface.coordinates != nullptr)
    unwrap(surface, scan);
  else
    project(surface, scan);
  const double length = scan.along.norm();
  const double stretch = scan.stretch;
  if (length == 0.0 || stretch == 0.0) return;
  scan.texture = surface.texture;
  const double perSample = length / (step.duration * step.sampleRate);
  scan.look = surface.texture->look(std::max(
      {stretch * width_, perSample, surface.texture->widthOf(1.0 / (stretch * step.radius))}));
}

/// True if the contact has gone farther than one at rest rattles in such steps.
bool ContactDrive::hasLeft(const Step& step) {
  const double falling = std::min(step.load / step.mass, kHeaviest);
  const double jitter = falling * step.duration * step.duration;
  bool left = false;
  for (Scan& scan : scans_) {
    scan.moved += scan.climbed;
    left = left || scan.moved.norm() > jitter;
  }
  if (left) return true;
  for (Scan& scan : scans_)
    scan.at += scan.along;
  return false;
}

/// Returns the mean force (N) between the bodies beyond the load, over a node in which the bumps
/// push at `pushed` (m/s): by the implicit trapezoidal rule, nearer to Euler's implicit one where
/// the spring is too stiff for it.
double ContactDrive::swing(double pushed) {
  const Spring& spring = spring_;
  double speed = speed_ - spring.fall;
  double force = 0.0;
  const double push = pushed - speed_ + spring.implicit * spring.fall;
  if (const double deep = pressed_ + spring.implicit * push * spring.dt; deep > 0.0) {
    // The dashpot comes in gradually as the bodies are pressed together, so that the force does not
    // jump (Hunt, Crossley 1975).
    const double grip = deep * spring.grip;
    if (grip >= 1.0) {
      force = (spring.stiffness * pressed_ + spring.resistance * push) * spring.yielding;
    } else {
      const double resistance = spring.resistance - (1.0 - grip) * spring.damping;
      force = (spring.stiffness * pressed_ + resistance * push) /
              (1.0 + spring.perForce * resistance * spring.implicit);
    }
    force = std::max(0.0, force);
    speed += spring.perForce * force;
  }
  const double mean = speed_ + spring.implicit * (speed - speed_);
  pressed_ = std::max(pressed_ + (pushed - mean) * spring.dt, -kFarthestPoint);
  speed_ = speed;
  return force - load_;
}

/// Adds up the energy that the bumps take (`taken`, J, in this step), and flattens them until it is
/// what the motion loses.
void ContactDrive::flatten(const Step& step, double taken) {
  flatness_ = flatter_;
  if (!std::isfinite(step.work)) return;
  // The means follow four times as fast as the bumps are flattened, so that flattening settles
  // without oscillation.
  const double share = -std::expm1(-4.0 * step.duration / kFlattening);
  given_ += share * (step.work / step.duration - given_);
  taken_ += share * (taken / step.duration - taken_);
  const double wanted =
      taken_ > 0.0 ? std::clamp(given_ / taken_, kFlattest * kFlattest, 1.0 / kFlattest) : 1.0;
  const double change = std::pow(wanted, 0.5 * std::min(1.0, step.duration / kFlattening));
  flatter_ = std::clamp(flatness_ * change, kFlattest, 1.0);
}

/// Finds the speed (m/s) at which the bumps push at each node.
void ContactDrive::scan(const Step& step, std::size_t count) {
  pushed_.assign(count, 0.0);
  for (const Scan& scan : scans_)
    if (scan.texture != nullptr) addPush(scan, step.duration);
}

/// Adds the speed (m/s) at which the bumps of one surface push: sampled as densely as the look
/// resolves, and linear between.
void ContactDrive::addPush(const Scan& scan, double duration) {
  const SurfaceTexture::Line line =
      scan.texture->line(scan.look, scan.at, scan.along, scan.climbed / duration);
  const std::size_t count = pushed_.size();
  const double each = 1.0 / static_cast<double>(count);
  const double perNode = scan.along.norm() * each;
  const auto stride = static_cast<std::size_t>(
      std::clamp(scan.texture->widthOf(scan.look) / (kLooksPerWidth * perNode), 1.0, kMostStride));
  double before = line.at(0.5 * each);
  for (std::size_t first = 0; first < count; first += stride) {
    const std::size_t next = std::min(stride, count - first);
    const double after = line.at((static_cast<double>(first + next) + 0.5) * each);
    const double rise = (after - before) / static_cast<double>(next);
    for (std::size_t i = 0; i < next; ++i)
      pushed_[first + i] += before + static_cast<double>(i) * rise;
    before = after;
  }
}

/// Follows the contact to where it is in the step; false if nothing moves.
bool ContactDrive::begin(const Step& step) {
  double farthest = 0.0;
  for (const ScannedSurface& surface : step.surfaces) {
    if (surface.texture == nullptr) continue;
    if (!isPlace(surface.from) || !isPlace(surface.to)) {
      restart();
      return false;
    }
    farthest = std::max(farthest, (surface.to - surface.from).norm());
  }
  const double fastest = farthest / step.duration;
  if (!(fastest >= (sounds_ ? 0.5 : 1.0) * kSlowest) || fastest > kFastest) {
    restart();
    return false;
  }
  settle(step);
  // A host's numbers may be finite, and too large.
  if (!std::isfinite(load_) || std::isnan(mass_) || std::isnan(width_)) {
    restart();
    return false;
  }
  for (std::size_t side = 0; side < scans_.size(); ++side)
    aim(step, step.surfaces[side], scans_[side]);
  return sounds_ || hasLeft(step);
}

bool ContactDrive::follow(const Step& step) {
  if (!begin(step)) return false;
  tighten(step, 1.0 / step.sampleRate);
  sounds_ = true;
  swings_ = false;
  for (Scan& scan : scans_) {
    scan.before = scan.at;
    scan.at += scan.along;
  }
  return true;
}

void ContactDrive::giveNodes(const Step& step, std::vector<PulseNode>& nodes) {
  nodes.clear();
  for (Scan& scan : scans_)
    scan.at = scan.before;
  push(step, nodes);
}

BumpyContact ContactDrive::contact(double duration) const {
  BumpyContact contact{.mass = mass_,
                       .load = load_,
                       .stiffness = spring_.stiffness,
                       .damping = spring_.damping,
                       .flatness = flatness_};
  for (std::size_t side = 0; side < scans_.size(); ++side) {
    const Scan& scan = scans_[side];
    contact.bumps[side] = {.texture = scan.texture,
                           .look = scan.look,
                           .speed = scan.climbed.norm() / duration,
                           .speedOnTexture = scan.along.norm() / duration};
  }
  return contact;
}

void ContactDrive::advance(const Step& step, std::vector<PulseNode>& nodes) {
  nodes.clear();
  if (begin(step)) push(step, nodes);
}

/// Computes the nodes of a step that has begun.
void ContactDrive::push(const Step& step, std::vector<PulseNode>& nodes) {
  // Nodes as dense as samples: what repeats at about the rate of the nodes is beyond hearing.
  const double samples = step.duration * step.sampleRate;
  const auto count = static_cast<std::size_t>(std::max(1.0, std::ceil(samples - kRounding)));
  const double each = 1.0 / static_cast<double>(count);
  const double dt = step.duration * each;
  tighten(step, dt);
  scan(step, count);
  if (!swings_) {
    speed_ = pushed_.front();
    pressed_ = load_ / spring_.stiffness;
  }
  sounds_ = swings_ = true;
  double taken = 0.0;
  nodes.reserve(count);
  for (std::size_t index = 0; index < count; ++index) {
    const double share = static_cast<double>(index) * each;
    const double height = flatness_ + share * (flatter_ - flatness_);
    const double pushed = height * pushed_[index];
    const double force = swing(pushed);
    taken += (force + load_) * pushed * dt;
    nodes.push_back({share, force * dt});
  }
  flatten(step, taken);
  for (Scan& scan : scans_)
    scan.at += scan.along;
}

}  // namespace carom::audio
