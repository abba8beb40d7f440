#include "audio/model/hertz.h"

#include <cassert>
#include <cmath>

namespace carom::audio {
namespace {

/// Johnson 1985, section 11.4, as printed there; integrating the contact equation gives 2.8683.
constexpr double kDurationFactor = 2.87;

}  // namespace

double hertzDuration(const ImpulseEvent& event, const Material& material, const Material& other) {
  const double curvature = 1.0 / event.radius + 1.0 / event.otherRadius;  // flat sides add 0
  assert(curvature > 0.0 && "two flat faces have no Hertz contact");
  const double modulus = contactModulus(material, other);
  const double ratio = event.effectiveMass / modulus;
  return kDurationFactor * std::pow(ratio * ratio * curvature / event.approachSpeed, 0.2);
}

double hertzWidth(const HertzContact& contact) {
  return 2.0 * std::cbrt(0.75 * contact.load * contact.radius / contact.modulus);
}

double hertzStiffness(const HertzContact& contact) {
  const double k = 4.0 / 3.0 * std::sqrt(contact.radius) * contact.modulus;
  return 1.5 * std::cbrt(k * k * contact.load);
}

}  // namespace carom::audio
