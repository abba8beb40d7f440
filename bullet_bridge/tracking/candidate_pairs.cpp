#include "bullet_bridge/tracking/candidate_pairs.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bullet_bridge/broad_phase/swept_bounds.h"

namespace carom::bullet {
namespace {

// Distance, relative to the sum of the radii, within which Bullet may have solved two spheres as
// touching, because of its rounding.
constexpr double kTouching = 1.0 + 1e-5;
constexpr double kAnyGap = std::numeric_limits<double>::infinity();

// Upper bound (m) of the travel of a body within which Bullet's solver may act: it acts where
// approach and rebound together would close the gap in one substep.
double reachOf(const SubstepMotion& motion, double dt) {
  return 2.0 * dt *
         (motion.velocityBefore.norm() + motion.velocityAfter.norm() +
          dt * motion.acceleration.norm());
}

// True if a body may touch a plane in the substep, or be acted on by Bullet's solver above it.
bool mayMeetPlane(const TrackedBody& body, const TrackedBody& plane, double dt) {
  if (plane.kind == BodyKind::kinematic) return true;  // Bullet may have put it ahead of its path
  const SubstepMotion& motion = body.current;
  const double height = motion.start.dot(plane.planeNormal) - plane.planeOffset - body.radius;
  const Vec3& planeVelocity = plane.current.velocityBefore;
  const double spin =
      body.shape == ContactShape::sphere
          ? 0.0
          : body.radius * (motion.angularBefore.norm() + motion.angularAfter.norm());
  const double approach =
      std::max(-(motion.velocityBefore - planeVelocity).dot(plane.planeNormal), 0.0) +
      std::max(-(motion.velocityAfter - planeVelocity).dot(plane.planeNormal), 0.0) +
      dt * std::abs(motion.acceleration.dot(plane.planeNormal)) + spin;
  // Bullet's friction may act on a contact that it holds even without load.
  return height <= std::max(2.0 * dt * approach, body.margin);
}

// True if Bullet may act on a body across any gap: by its continuous detection, or where it has put
// a kinematic body ahead of its path.
bool hasUnboundedReach(const TrackedBody& body) {
  return body.continuous || body.kind == BodyKind::kinematic;
}

// True for two spheres that stay apart on their paths, as most near pairs do; false for all other
// pairs.
bool stayApart(const TrackedBody& body, const TrackedBody& other, double dt) {
  if (body.shape != ContactShape::sphere || other.shape != ContactShape::sphere) return false;
  if (hasUnboundedReach(body) || hasUnboundedReach(other)) return false;
  const SubstepMotion& motion = body.current;
  const SubstepMotion& otherMotion = other.current;
  if (motion.acceleration != otherMotion.acceleration) return false;
  const Vec3 apart = motion.start - otherMotion.start;
  const Vec3 velocity = motion.velocityAfter - otherMotion.velocityAfter;
  const double touching = kTouching * (body.radius + other.radius);
  const double outside = apart.squaredNorm() - touching * touching;
  if (!(outside > 0.0)) return false;
  const double closing = -apart.dot(velocity);
  if (closing <= 0.0) return true;
  const double nearest = std::min(dt, closing / velocity.squaredNorm());
  return (apart + nearest * velocity).squaredNorm() > touching * touching;
}

}  // namespace

double solverRange(const ContactPair& pair) {
  if (hasUnboundedReach(*pair.body) || hasUnboundedReach(*pair.other)) return kAnyGap;
  if (pair.isOnPlane()) return pair.body->margin;
  if (!pair.isClosedForm()) return std::max(pair.body->margin, pair.other->margin);
  return (kTouching - 1.0) * (pair.body->radius + pair.other->radius);
}

std::span<const ContactPair> CandidatePairs::find(BodyTracker& tracker, double dt) {
  found_.clear();
  const auto moves = [](const TrackedBody& body) { return body.awake && !body.rests; };
  if (std::ranges::none_of(tracker.bodies(), moves)) return found_;
  gatherBodies(tracker, dt);
  findNear(tracker, dt);
  findOnPlanes(tracker, dt);
  return found_;
}

// Collects what every body may reach in this substep.
void CandidatePairs::gatherBodies(const BodyTracker& tracker, double dt) {
  boxes_.clear();
  planes_.clear();
  balls_.clear();
  const std::vector<TrackedBody>& bodies = tracker.bodies();
  const bool speculative = tracker.hasOtherShapes() || tracker.hasContinuous();
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const TrackedBody& body = bodies[i];
    if (!body.current.known || body.shape == ContactShape::none) continue;
    if (body.shape == ContactShape::plane) {
      planes_.push_back(&body);
      continue;
    }
    boxes_.push_back(body.rests ? boxAtRest(body) : sweptBox(body, dt, speculative));
    boxes_.back().body = static_cast<std::uint32_t>(i);
    if (tracker.hasPlanes())
      balls_.push_back({body.current.start,
                        body.radius + std::max(body.margin, reachOf(body.current, dt)), &body});
  }
}

void CandidatePairs::findNear(BodyTracker& tracker, double dt) {
  const std::vector<TrackedBody>& bodies = tracker.bodies();
  for (const auto& [first, second] : grid_.find(boxes_)) {
    if (stayApart(bodies[first], bodies[second], dt)) continue;
    tracker.complete(bodies[first]);
    tracker.complete(bodies[second]);
    found_.push_back(ContactPair::of(bodies[first], bodies[second]));
  }
}

void CandidatePairs::findOnPlanes(BodyTracker& tracker, double dt) {
  for (const TrackedBody* plane : planes_) {
    const double reach = reachOf(plane->current, dt) + plane->planeOffset;
    const bool anywhere = plane->kind == BodyKind::kinematic;
    for (const Ball& ball : balls_) {
      if (!anywhere && ball.centre.dot(plane->planeNormal) > ball.radius + reach) continue;
      if (!ball.body->awake && !plane->awake) continue;
      if (ball.body->rests && plane->kind == BodyKind::fixed) continue;
      if (!mayMeetPlane(*ball.body, *plane, dt)) continue;
      tracker.complete(*ball.body);
      found_.push_back({ball.body, plane});
    }
  }
}

}  // namespace carom::bullet
