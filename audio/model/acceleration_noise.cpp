#include "audio/model/acceleration_noise.h"

#include <cmath>
#include <numbers>

namespace carom::audio {
namespace {

constexpr double kExponent = 6.0;  // see eq. 9 in the header

double slopeAround(double fromCentre) {
  return -2.0 * kExponent * fromCentre * std::exp(-kExponent * fromCentre * fromCentre);
}

// Volume and added volume of the body times its change of velocity by the impact (m^3 m/s, world
// frame).
Vec3 pushedVolume(const ImpulseEvent& event, const SoundBody& body) {
  const ImpactMotion motion = impactMotion(event, body);
  return event.bodyOrientation * body.shape->dipole(motion.linear, motion.angular);
}

}  // namespace

double gaussianPulse(double u) {
  return std::exp(-kExponent * (u - 0.5) * (u - 0.5));
}

double gaussianPulseSlope(double u) {
  return slopeAround(u - 0.5);
}

ImpactMotion impactMotion(const ImpulseEvent& event, const SoundBody& body) {
  const Quat toBody = event.bodyOrientation.conjugate();
  const Vec3 impulse = toBody * event.impulse;
  const Vec3 arm = toBody * (event.position - event.bodyPosition);
  return {impulse / body.mass, body.inverseInertia * arm.cross(impulse)};
}

Strike makeStrike(const ImpulseEvent& event, const SoundBody& body, const Medium& medium) {
  Strike strike;
  strike.position = event.bodyPosition;
  strike.velocity = event.bodyVelocity + event.impulse / (2.0 * body.mass);
  if (body.shape) {
    strike.radius = body.shape->radius();
    strike.dipole =
        medium.density / (4.0 * std::numbers::pi * medium.speedOfSound) * pushedVolume(event, body);
  } else {
    strike.radius = body.radius;
    strike.dipole = medium.density * body.radius * body.radius * body.radius /
                    (2.0 * medium.speedOfSound * body.mass) * event.impulse;
  }
  return strike;
}

}  // namespace carom::audio
