#pragma once

#include "carom/audio/impulse_event.h"
#include "carom/audio/material.h"
#include "carom/audio/sound_body.h"

namespace carom::audio {

// The pulse of the hand-out, and the sound source that an impact makes of a body, as pure
// functions. All of this file: [any thread], no allocation.

/// The Gaussian is cut this many contact durations from its centre: there S is 5e-17, and what is
/// cut off is below the rounding of the pulse's own peak.
inline constexpr double kPulseHalfWidth = 2.5;

/// Largest magnitude of dS/du, at u = 1/2 -+ 1/sqrt(12): sqrt(12) exp(-1/2).
inline constexpr double kPulsePeakSlope = 2.101083837941101;

/// S(u) of the hand-out's eq. 9: the force of the contact over time, 1 at its centre u = 1/2.
double gaussianPulse(double u);

/// dS/du of eq. 10 with t in contact durations; dS/dt is this divided by tau.
double gaussianPulseSlope(double u);

/// A rigid body that has been hit, as a source of sound: a dipole that acts while the contact
/// lasts. At the distance r in the direction n from it, far away and for long wavelengths,
///
///     p(t) = (n . dipole) / r * d/dt force(t - r/c)
///
/// where force is the contact's own pulse, of integral 1 over time (1/s).
struct Strike {
  Vec3 position = Vec3::Zero();  ///< m, world frame, of the body's centre at first touch
  Vec3 velocity = Vec3::Zero();  ///< m/s, world frame, mean over the contact
  Vec3 dipole = Vec3::Zero();    ///< Pa m s^2, world frame: along the impulse for a sphere
  double radius = 0.0;           ///< m, of the sphere with the same dipole; see SoundBody::shape
};

/// The change of a body's motion by an impact, body frame.
struct ImpactMotion {
  Vec3 linear = Vec3::Zero();   ///< m/s
  Vec3 angular = Vec3::Zero();  ///< rad/s
};

/// Returns the change of motion of a body that can move.
ImpactMotion impactMotion(const ImpulseEvent& event, const SoundBody& body);

/// Returns the Strike of an event. For a sphere, dipole = rho0 a^3 / (2 c) j/m, which is Howe 2002,
/// eq. 3.8.5 (the hand-out's eq. 1). For any other shape, it is rho0 (Vol I + M)(j/m) / (4 pi c)
/// with the added volume M and the rotation that the impact starts (Landau & Lifshitz, Fluid
/// Mechanics, section 74). Requires that `body` can move, and that the event is finite.
Strike makeStrike(const ImpulseEvent& event, const SoundBody& body, const Medium& medium);

}  // namespace carom::audio
