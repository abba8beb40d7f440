#pragma once

#include "carom/audio/impulse_event.h"
#include "carom/audio/material.h"

namespace carom::audio {

/// Duration of an elastic contact after Hertz (Johnson 1985, section 11.4; Chadwick, Zheng, James
/// 2012, eq. 6; the seed's eq. 4 and 5), in seconds:
///
///     tau = 2.87 (m^2 / (R E*^2 V))^(1/5),   1/R = 1/R1 + 1/R2
///
/// with the event's effective mass m, approach speed V and radii, and the contact modulus E* of
/// the two materials. Frictionless, elastic, small contact patch; 2.87 rounds 2.8683.
/// At least one of the two radii must be finite. [any thread]
double hertzDuration(const ImpulseEvent& event, const Material& material, const Material& other);

/// Two bodies that press on each other.
struct HertzContact {
  double load = 0.0;     ///< N, >= 0
  double radius = 0.0;   ///< m, > 0: 1/R = 1/R1 + 1/R2
  double modulus = 0.0;  ///< Pa, > 0, see contactModulus; infinite: rigid
};

/// Diameter of the contact circle in m: 2 a (Johnson 1985, eq. 4.22). [any thread]
double hertzWidth(const HertzContact& contact);

/// Stiffness of the contact in N/m: dF/dd of F = K d^(3/2) at the load, K = 4/3 sqrt(R) E* (Johnson
/// 1985, eq. 4.23). [any thread]
double hertzStiffness(const HertzContact& contact);

}  // namespace carom::audio
