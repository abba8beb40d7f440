#include "bullet_bridge/tracking/impact_events.h"

#include <span>
#include <utility>

namespace carom::bullet {
namespace {

// The impact of which the events are made.
struct Source {
  const FoundImpact& found;
  const SubstepTime& substep;
};

ImpulseEvent eventOf(const FoundImpact& found, const ImpactSolution& solution) {
  ImpulseEvent event;
  event.body = found.motion.pair().body->id;
  event.other = found.motion.pair().other->id;
  event.impulse = solution.impulse;
  event.position = solution.position;
  event.normal = solution.normal;
  event.approachSpeed = solution.approachSpeed;
  event.effectiveMass = solution.effectiveMass;
  event.radius = found.radius;
  event.otherRadius = found.otherRadius;
  return event;
}

void setState(ImpulseEvent& event, const RigidMotion& motion, double s) {
  event.bodyPosition = motion.centre.positionAt(s);
  event.bodyVelocity = motion.centre.velocityAt(s);
  event.bodyOrientation = motion.orientationAt(s);
  event.bodyAngularVelocity = motion.angularVelocity;
}

ImpulseEvent otherShare(const ImpulseEvent& body) {
  ImpulseEvent other = body;
  std::swap(other.body, other.other);
  std::swap(other.radius, other.otherRadius);
  other.normal = -body.normal;
  other.impulse = -body.impulse;
  return other;
}

// Makes a point whose `impulseFraction` is still its impulse in N s.
ImpactPoint pointOf(const Source& source, const ImpactSolution& solution, double delay) {
  const FoundImpact& found = source.found;
  ImpactPoint point;
  point.impulseFraction = solution.impulse.norm();
  point.body = eventOf(found, solution);
  point.body.time = source.substep.start + found.offset + delay;
  point.other = otherShare(point.body);
  setState(point.body, found.motion.body(), found.s + delay);
  setState(point.other, found.motion.other(), found.s + delay);
  // The motions on which impacts are found leave out the orientation of spheres.
  const auto setOrientation = [&](ImpulseEvent& event, const TrackedBody& body,
                                  const RigidMotion& motion) {
    if (body.shape != ContactShape::sphere) return;
    RigidMotion turning = body.actual(source.substep.length);
    if (found.offset < 0.0) turning.angularVelocity = motion.angularVelocity;  // of the one before
    event.bodyOrientation = turning.orientationAt(found.offset + delay);
  };
  setOrientation(point.body, *found.motion.pair().body, found.motion.body());
  setOrientation(point.other, *found.motion.pair().other, found.motion.other());
  exchangePoses(point.body, point.other);
  return point;
}

}  // namespace

void ImpactEvents::set(Impact& impact, const FoundImpact& found, const SubstepTime& substep) {
  const PairInertia inertia(found.motion, found.s, multibodies_);
  ContactPoint mean;
  std::span<const ContactPoint> contacts = found.points;
  if (inertia.hasLink() && contacts.size() > 1) {
    mean = ImpactSolver::meanOf(contacts);
    contacts = {&mean, 1};
  }
  const std::span<const double> impulses = solver_.solve(contacts, inertia, impact.restitution);
  double whole = 0.0;
  impact.points.clear();
  for (std::size_t begin = 0; begin < contacts.size();) {
    std::size_t end = begin;
    while (end < contacts.size() && contacts[end].delay <= contacts[begin].delay + kSameImpact)
      ++end;
    const std::size_t count = end - begin;
    const ImpactSolution solution = ImpactSolver::sum(
        contacts.subspan(begin, count), impulses.subspan(begin, count), impact.restitution);
    if (solution.effectiveMass > 0.0) {
      // The first point is dated at first contact, even if the corners that follow carry all of its
      // impulse.
      const double delay = impact.points.empty() ? 0.0 : contacts[begin].delay;
      impact.points.push_back(pointOf({found, substep}, solution, delay));
      whole += impact.points.back().impulseFraction;
    }
    begin = end;
  }
  for (ImpactPoint& point : impact.points)
    point.impulseFraction /= whole;
}

}  // namespace carom::bullet
