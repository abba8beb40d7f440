#include "bullet_bridge/tracking/impact_finder.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bullet_bridge/geometry/impact_time.h"

namespace carom::bullet {
namespace {

// Height difference, relative to the body's radius, up to which corners land together: it covers
// rounding.
constexpr double kTogether = 1e-4;
// Height above a contact, relative to the body's radius, at which the surface around it is probed;
// and 1 - the cosine of the angle by which a normal may be off.
constexpr double kProbeHeight = 0.1;
constexpr double kProbeSlack = 2e-4;
constexpr double kNotKnown = -1.0;  // m, instead of a gap

Vec3 nodeVelocity(const SubstepMotion& motion, MotionKind kind, const Vec3& arm) {
  return kind == MotionKind::actual ? Vec3(motion.velocityAfter + motion.angularAfter.cross(arm))
                                    : Vec3(motion.velocityBefore + motion.angularBefore.cross(arm));
}

// Speed (m/s, along the normal) that forces have added to a body in the substep. Forces that the
// solver has held, as on a body that lies on another, add none.
double gainOf(const SubstepMotion& motion, const Vec3& normal, double dt) {
  const double force = dt * motion.acceleration.dot(normal);
  const double change = (motion.velocityAfter - motion.velocityBefore).dot(normal);
  return force > 0.0 ? std::clamp(change, 0.0, force) : std::clamp(change, force, 0.0);
}

// FoundImpact::initialSpeed, in its two parts.
struct InitialApproach {
  double speed = 0.0;  // m/s, at the start of the substep
  double gain = 0.0;   // m/s^2, by which it grows on the way

  // `nodeSpeed` (m/s) is the approach after the solver.
  InitialApproach(double nodeSpeed, const SubstepMotion& body, const SubstepMotion& other,
                  const Vec3& normal, double dt) {
    const double added = gainOf(other, normal, dt) - gainOf(body, normal, dt);
    speed = std::max(0.0, nodeSpeed - added);
    gain = std::max(0.0, added / dt);
  }
  // After a gap (m) at the start of the substep.
  double after(double gap) const {
    return std::hypot(speed, std::sqrt(2.0 * gain * std::max(0.0, gap)));
  }
};

// Returns how long ago (s) a point of one body passed the tangent plane of the other. `apart(t)` is
// their distance along the normal t ago; apart(0) <= 0.
template <class Apart>
double timeSincePassage(Apart apart, double longest) {
  // The Illinois method: a secant whose end that stays counts half (Dowell and Jarratt 1971).
  constexpr int kMost = 60;
  constexpr double kEnough = 1e-13;  // relative to the longest
  double inside = 0.0;
  double outside = longest;
  double below = apart(inside);
  double above = apart(outside);
  if (above <= 0.0) return 0.0;
  bool wasOutside = false;
  bool wasInside = false;
  for (int step = 0; step < kMost && outside - inside > kEnough * longest; ++step) {
    const double secant = inside - below * (outside - inside) / (above - below);
    const double middle = step < kMost / 2 ? secant : 0.5 * (inside + outside);
    const double there = apart(middle);
    const bool isOutside = there > 0.0;
    if (isOutside && wasOutside) below *= 0.5;
    if (!isOutside && wasInside) above *= 0.5;
    (isOutside ? outside : inside) = middle;
    (isOutside ? above : below) = there;
    wasOutside = isOutside;
    wasInside = !isOutside;
    if (there == 0.0) break;
  }
  return inside;
}

void setBefore(TrackedBody& body, const TrackedBody& now, const SubstepMotion& previous) {
  body = now;
  body.current = previous;
  body.planeOffset += (previous.start - now.current.start).dot(now.planeNormal);
}

RigidMotion motionOf(const SubstepMotion& motion, double dt) {
  return {motion.actual(dt), motion.orientation, motion.angularAfter};
}

}  // namespace

double approachWithNode(const PairMotion& motion, MotionKind kind, const Proximity& closest,
                        double s) {
  const SubstepMotion& body = motion.pair().body->current;
  const SubstepMotion& other = motion.pair().other->current;
  const Vec3 arm = closest.point - motion.body().centre.positionAt(s);
  const Vec3 otherArm = closest.point - motion.other().centre.positionAt(s);
  return (nodeVelocity(other, kind, otherArm) - nodeVelocity(body, kind, arm)).dot(closest.normal);
}

double approachAtNode(const ContactPair& pair, MotionKind kind, const Vec3& point,
                      const Vec3& normal) {
  const SubstepMotion& body = pair.body->current;
  const SubstepMotion& other = pair.other->current;
  return (nodeVelocity(other, kind, point - other.start) -
          nodeVelocity(body, kind, point - body.start))
      .dot(normal);
}

FoundImpact& ImpactFinder::begin(const PairMotion& motion) {
  found_ = {.motion = motion};
  return found_;
}

// False for a contact with an internal edge. Bullet takes a body that slides or rolls over the edge
// between two triangles in a plane to hit that edge; neither that edge nor one inside a compound is
// part of the surface. There, the path along the contact's normal does not lead away from the
// surface as fast as it should.
bool ImpactFinder::isOnSurface(const PairMotion& now, const SolvedPoint& point) {
  const auto hasInternalEdges = [](const btCollisionShape& shape) {
    return shape.isConcave() || shape.isCompound();
  };
  const btCollisionShape& body = *now.pair().body->object->getCollisionShape();
  const btCollisionShape& other = *now.pair().other->object->getCollisionShape();
  const double height = kProbeHeight * now.pair().body->radius;
  if (hasInternalEdges(other) &&
      !pointsOutwards({&other, now.other()}, point.position, point.normal, height))
    return false;
  const Vec3 onBody = point.position + point.gap * point.normal;
  return !hasInternalEdges(body) ||
         pointsOutwards({&body, now.body()}, onBody, -point.normal, height);
}

bool ImpactFinder::pointsOutwards(const MovingShape& shape, const Vec3& place, const Vec3& normal,
                                  double height) {
  const auto distanceAt = [&](double above) {
    RigidMotion motion;
    motion.centre.position = place + above * normal;
    const bool followed = probe_.set({&probeShape_, motion}, shape, 0.0, 3.0 * height);
    return followed ? probe_.proximityAt(0.0).gap : kNever;
  };
  const double low = distanceAt(height);
  const double high = distanceAt(2.0 * height);
  return !(high - low < (1.0 - kProbeSlack) * height);
}

// Sets the points of the impact, with the corners that follow close behind the first, since Bullet
// will solve them together. False if no point approaches.
bool ImpactFinder::collectPoints(const Proximity& closest, const ImpactWindow& window) {
  FoundImpact& found = found_;
  points_.clear();
  const auto add = [&](const Vec3& point) {
    const double speed = found.motion.approachSpeedAt(point, closest.normal, found.s);
    if (speed > 0.0) points_.push_back({point, closest.normal, speed});
  };
  if (!found.motion.pair().isClosedForm()) {
    const double together = std::max(window.depth, kTogether * found.motion.pair().body->radius);
    for (const Vec3& point : found.motion.pieces().patchAt(found.s, closest, together))
      add(point);
  }
  found.radius = found.motion.radiusAt(PairSide::body, found.s, closest);
  found.otherRadius = found.motion.radiusAt(PairSide::other, found.s, closest);
  keepOutermost(closest.normal);
  for (ContactPoint& point : points_)
    point.delay = delayOf(point, closest);
  std::erase_if(points_, [&](const ContactPoint& point) { return point.delay > window.latest; });
  std::sort(points_.begin(), points_.end(),
            [](const ContactPoint& a, const ContactPoint& b) { return a.delay < b.delay; });
  if (points_.empty()) add(closest.point);
  if (points_.empty()) return false;
  points_.front().delay = 0.0;  // the first contact itself
  found.points = points_;
  return true;
}

// Keeps the outermost of many points in a plane, which hold the others between them.
void ImpactFinder::keepOutermost(const Vec3& normal) {
  constexpr std::size_t kMost = 8;
  if (points_.size() <= kMost) return;
  const Vec3 right = normal.unitOrthogonal();
  const Vec3 ahead = normal.cross(right);
  for (std::size_t kept = 0; kept < kMost; ++kept) {
    const double angle = 2.0 * std::numbers::pi * static_cast<double>(kept) / double{kMost};
    const Vec3 towards = std::cos(angle) * right + std::sin(angle) * ahead;
    const auto outermost =
        std::max_element(points_.begin() + static_cast<std::ptrdiff_t>(kept), points_.end(),
                         [&](const ContactPoint& a, const ContactPoint& b) {
                           return a.position.dot(towards) < b.position.dot(towards);
                         });
    std::swap(points_[kept], *outermost);
  }
  points_.resize(kMost);
}

// Time (s) until a corner of one body meets the face of the other that was met first, at found_.s.
double ImpactFinder::delayOf(const ContactPoint& point, const Proximity& closest) const {
  const bool faceOnOther = std::isinf(found_.otherRadius) || !std::isinf(found_.radius);
  const RigidMotion& body = found_.motion.body();
  const RigidMotion& other = found_.motion.other();
  const Vec3 bodyPoint =
      body.poseAt(found_.s).toLocal(faceOnOther ? point.position : closest.point);
  const Pose otherPose = other.poseAt(found_.s);
  const Vec3 otherPoint = otherPose.toLocal(faceOnOther ? closest.otherPoint : point.position);
  const Vec3 faceNormal =
      (faceOnOther ? otherPose : body.poseAt(found_.s)).rotation.transpose() * closest.normal;
  double delay = 0.0;
  for (int step = 0; step < 4; ++step) {
    const Pose bodyThen = body.poseAt(found_.s + delay);
    const Pose otherThen = other.poseAt(found_.s + delay);
    const Vec3 normal = (faceOnOther ? otherThen : bodyThen).rotation * faceNormal;
    const Vec3 corner = faceOnOther ? bodyThen.toWorld(bodyPoint) : otherThen.toWorld(otherPoint);
    const double height = (bodyThen.toWorld(bodyPoint) - otherThen.toWorld(otherPoint)).dot(normal);
    const double speed = found_.motion.approachSpeedAt(corner, normal, found_.s + delay);
    if (!(speed > 0.0)) break;
    delay = std::max(0.0, delay + height / speed);
  }
  return delay;
}

const FoundImpact* ImpactFinder::alongPath(const PairMotion& now, double gap,
                                           const Substep& substep) {
  FoundImpact& found = begin(now);
  found.s = found.offset = now.impactTime(substep.dt);
  if (found.s == kNever || (gap < 0.0 && !(found.s > 0.0))) return nullptr;
  const Proximity closest = now.proximityAt(found.s);
  found.nodeSpeed = approachWithNode(now, MotionKind::actual, closest, found.s);
  if (!(found.nodeSpeed > substep.restSpeed)) return nullptr;
  const ContactPair& pair = now.pair();
  const InitialApproach initial(found.nodeSpeed, pair.body->current, pair.other->current,
                                closest.normal, substep.dt);
  // The gap costs more than all else, and is of no use to what is too fast for rest.
  const bool isFast = initial.speed > substep.restSpeed;
  found.initialSpeed = initial.after(isFast ? 0.0 : gap < 0.0 ? now.proximityAt(0.0).gap : gap);
  const double rest = substep.dt - found.s;  // the next node solves what is down by then
  return collectPoints(closest, {found.nodeSpeed * rest, rest}) ? &found_ : nullptr;
}

const FoundImpact* ImpactFinder::speculative(const PairMotion& now, const Proximity& start,
                                             const SolvedContact& solved, const Substep& substep) {
  if (!(solved.impulse > 0.0)) return nullptr;
  double deepest = start.gap;
  double nodeSpeed = approachAtNode(now.pair(), MotionKind::contactFree, start.point, start.normal);
  for (const SolvedPoint& point : solved.points) {
    if (!(point.impulse > 0.0)) continue;
    const double speed =
        approachAtNode(now.pair(), MotionKind::contactFree, point.position, point.normal);
    if (speed > substep.restSpeed && !isOnSurface(now, point)) continue;
    deepest = std::max(deepest, point.gap);
    nodeSpeed = std::max(nodeSpeed, speed);
  }
  if (!(nodeSpeed > substep.restSpeed)) return nullptr;
  // Bullet acts on gaps that approach and rebound, which is no faster, would close in a substep;
  // but it has put a kinematic body where its path leads only some substeps later.
  const double ahead = std::max(now.pair().body->arrival, now.pair().other->arrival);
  const double horizon = std::min(2.0 * start.gap / nodeSpeed, 2.5 * substep.dt + ahead);
  FoundImpact& found =
      begin(PairMotion(now.pair(), MotionKind::contactFree, substep.dt, horizon, freePieces_));
  found.nodeSpeed = nodeSpeed;
  found.solved = true;
  found.s = found.offset = found.motion.impactTime(horizon);
  if (found.s == kNever) return nullptr;
  const ImpactWindow window{deepest - start.gap, 2.0 * substep.dt};
  return collectPoints(found.motion.proximityAt(found.s), window) ? &found_ : nullptr;
}

std::optional<double> ImpactFinder::approachAtEnd(const PreviousSubstep& previous,
                                                  const Vec3& point, const Vec3& normal) {
  if (!previous.body.known || !previous.other.known) return std::nullopt;
  const auto velocityAt = [&point, dt = previous.dt](const SubstepMotion& motion) {
    return nodeVelocity(motion, MotionKind::actual,
                        point - motion.start - dt * motion.velocityAfter);
  };
  return (velocityAt(previous.other) - velocityAt(previous.body)).dot(normal);
}

const FoundImpact* ImpactFinder::before(const ContactPair& now, const Substep& substep,
                                        const PreviousSubstep& previous) {
  if (!previous.body.known || !previous.other.known) return nullptr;
  setBefore(bodyBefore_, *now.body, previous.body);
  setBefore(otherBefore_, *now.other, previous.other);
  const PairMotion then({&bodyBefore_, &otherBefore_}, MotionKind::actual, previous.dt, previous.dt,
                        freePieces_);
  if (!then.isFollowed()) return nullptr;
  if (now.isClosedForm() && !(then.proximityAt(0.0).gap > 0.0)) return nullptr;
  if (alongPath(then, kNotKnown, {previous.dt, substep.restSpeed}) == nullptr) return nullptr;
  found_.motion = PairMotion(now, then.body(), then.other());
  found_.offset = found_.s - previous.dt;
  found_.since = -previous.dt;
  found_.solved = true;
  return &found_;
}

const FoundImpact* ImpactFinder::overlapping(const PairMotion& now, const Substep& substep) {
  FoundImpact& found =
      begin(PairMotion(now.pair(), MotionKind::contactFree, substep.dt, 0.0, freePieces_));
  const Proximity closest = found.motion.proximityAt(0.0);
  found.nodeSpeed =
      approachAtNode(now.pair(), MotionKind::contactFree, closest.point, closest.normal);
  found.solved = true;
  if (!(found.nodeSpeed > substep.restSpeed)) return nullptr;
  return collectPoints(closest, {}) ? &found_ : nullptr;
}

const FoundImpact* ImpactFinder::newPoints(const PairMotion& now, const Proximity& start,
                                           const SolvedContact& solved, const Substep& substep,
                                           const PreviousSubstep& previous) {
  points_.clear();
  const SolvedPoint* deepest = nullptr;
  double nodeSpeed = 0.0;
  for (const SolvedPoint& point : solved.points) {
    const double speed =
        approachAtNode(now.pair(), MotionKind::contactFree, point.position, point.normal);
    if (speed <= 0.0 || (point.gap > 0.0 && !(point.impulse > 0.0))) continue;
    if (speed > substep.restSpeed && !isOnSurface(now, point)) continue;
    points_.push_back({point.position, point.normal, speed});
    if (speed <= substep.restSpeed) continue;
    nodeSpeed = std::max(nodeSpeed, speed);
    if (deepest == nullptr || point.gap < deepest->gap) deepest = &point;
  }
  if (deepest == nullptr) return nullptr;

  FoundImpact& found =
      begin(PairMotion(now.pair(), MotionKind::contactFree, substep.dt, 0.0, freePieces_));
  found.nodeSpeed = nodeSpeed;
  found.solved = true;
  Proximity closest = start;
  closest.gap = deepest->gap;
  closest.normal = deepest->normal;
  closest.otherPoint = deepest->position;
  closest.point = deepest->position + deepest->gap * deepest->normal;
  found.radius = now.radiusAt(PairSide::body, 0.0, closest);
  found.otherRadius = now.radiusAt(PairSide::other, 0.0, closest);
  found.points = points_;
  if (deepest->gap < 0.0 && previous.body.known && previous.other.known) {
    dateBack(closest, previous);
  }
  return &found_;
}

// Dates the impact back to when the deepest of its points met the other surface, in the substep
// before.
void ImpactFinder::dateBack(const Proximity& closest, const PreviousSubstep& previous) {
  FoundImpact& found = found_;
  const RigidMotion body = motionOf(previous.body, previous.dt);
  const RigidMotion other = motionOf(previous.other, previous.dt);
  const Pose bodyNow = body.poseAt(previous.dt);
  const Pose otherNow = other.poseAt(previous.dt);
  const Vec3 bodyPoint = bodyNow.toLocal(closest.point);
  const Vec3 otherPoint = otherNow.toLocal(closest.otherPoint);
  const Vec3 otherNormal = otherNow.rotation.transpose() * closest.normal;
  const auto apart = [&](double ago) {
    const Pose bodyThen = body.poseAt(previous.dt - ago);
    const Pose otherThen = other.poseAt(previous.dt - ago);
    return (bodyThen.toWorld(bodyPoint) - otherThen.toWorld(otherPoint))
        .dot(otherThen.rotation * otherNormal);
  };
  const double ago = timeSincePassage(apart, previous.dt);
  const Vec3 arm = closest.point - bodyNow.position;
  const Vec3 otherArm = closest.point - otherNow.position;
  const double nodeSpeed = (nodeVelocity(previous.other, MotionKind::actual, otherArm) -
                            nodeVelocity(previous.body, MotionKind::actual, arm))
                               .dot(closest.normal);
  found.initialSpeed =
      InitialApproach(nodeSpeed, previous.body, previous.other, closest.normal, previous.dt)
          .after(apart(previous.dt));
  found.motion = PairMotion(found.motion.pair(), body, other);
  found.s = previous.dt - ago;
  found.offset = -ago;
  const Pose bodyThen = body.poseAt(found.s);
  for (ContactPoint& point : points_) {
    point.position = bodyThen.toWorld(bodyNow.toLocal(point.position));
    const double speed = found.motion.approachSpeedAt(point.position, point.normal, found.s);
    if (speed > 0.0) point.approachSpeed = speed;
  }
}

}  // namespace carom::bullet
