#include "audio/scheduling/contact_duration.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "audio/model/hertz.h"
#include "audio/model/positive.h"

namespace carom::audio {
namespace {

/// Number of restitutions that have a dissipative pulse of their own; further ones are rounded to
/// steps of 1 / kFewRestitutions.
constexpr std::size_t kMostRestitutions = 256;
constexpr double kFewRestitutions = 64.0;

bool isContact(const ImpulseEvent& event) {
  return event.radius >= 0.0 && event.otherRadius >= 0.0 && isPositive(event.approachSpeed) &&
         isPositive(event.effectiveMass);
}

/// Returns the event with the bodies' edge radii where a radius is 0, and for two flat faces: edges
/// are blunt, and flat faces touch first where they are not flat.
ImpulseEvent blunted(ImpulseEvent event, const SoundBody& body, const SoundBody& other) {
  const bool flat = std::isinf(event.radius) && std::isinf(event.otherRadius);
  if (event.radius == 0.0 || flat) event.radius = body.edgeRadius;
  if (event.otherRadius == 0.0 || flat) event.otherRadius = other.edgeRadius;
  return event;
}

double restitutionOf(const ImpulseEvent& event) {
  const double bounce = event.impulse.norm() / (event.effectiveMass * event.approachSpeed) - 1.0;
  return std::clamp(bounce, kLowestRestitution, 1.0);
}

}  // namespace

double ContactDurations::durationOf(const ImpulseEvent& event, const SoundBody& body,
                                    const SoundBody& other) const {
  if (!isContact(event)) return 0.0;
  const double elastic = hertzDuration(blunted(event, body, other), body.material, other.material);
  return settings_.dissipative ? elastic * lossyOf(event).stretch : elastic;
}

double ContactDurations::stiffnessOf(const ImpulseEvent& event, const SoundBody& body,
                                     const SoundBody& other) {
  const ImpulseEvent blunt = blunted(event, body, other);
  const double curvature = 1.0 / blunt.radius + 1.0 / blunt.otherRadius;
  return 4.0 / 3.0 * contactModulus(body.material, other.material) / std::sqrt(curvature);
}

const Pulse& ContactDurations::pulseOf(const ImpulseEvent& event) const {
  return settings_.dissipative ? lossyOf(event).pulse : Pulse::of(settings_.comparison.pulse);
}

/// Returns the dissipative pulse of the event's restitution, made once for each; beyond
/// kMostRestitutions, the one of the nearest of a few.
const ContactDurations::Lossy& ContactDurations::lossyOf(const ImpulseEvent& event) const {
  double restitution = restitutionOf(event);
  if (lossy_.size() >= kMostRestitutions && !lossy_.contains(restitution))
    restitution = std::round(restitution * kFewRestitutions) / kFewRestitutions;
  if (const auto known = lossy_.find(restitution); known != lossy_.end()) return known->second;
  Lossy made{Pulse::dissipativeHertz(restitution), dissipativeDuration(restitution)};
  return lossy_.emplace(restitution, std::move(made)).first->second;
}

}  // namespace carom::audio
