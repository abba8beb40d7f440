#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace carom {

/// How a body's restitution depends on the speed of approach.
enum class SpeedLaw : std::uint8_t {
  constant,      ///< not at all
  viscoelastic,  ///< 1/e - 1 grows with v^(1/5): slow impacts lose little
  plastic,       ///< e falls with v^(-1/4) where something yields: above the law's speed
};

/// A body's restitution away from the speed at which it was measured.
///
/// viscoelastic: spheres whose stress has a part that grows with the rate of strain lose
/// 1 - e ~ v^(1/5) to first order (Kuwabara, Kono 1987, Jpn. J. Appl. Phys. 26, 1230; Ramirez,
/// Poeschel, Brilliantov, Schwager 1999, Phys. Rev. E 60, 4465, eq. 13). 1 / (1 + c v^(1/5)) is
/// the same to that order, and stays above 0 at every speed.
/// plastic: e ~ v^(-1/4) (Johnson 1985, Contact Mechanics, eq. 11.46).
struct RestitutionLaw {
  SpeedLaw law = SpeedLaw::constant;
  double speed = 1.0;  ///< m/s, > 0: at which restitution is what the body says; plastic: up to it

  friend bool operator==(const RestitutionLaw&, const RestitutionLaw&) = default;
};

/// x^(1/5) of x >= 0, to rounding, by Newton's method from above: the same bits everywhere, which
/// std::pow does not promise. [any thread]
inline double fifthRoot(double x) {
  if (!(x > 0.0)) return 0.0;
  double root = std::ldexp(1.0, static_cast<int>(std::floor(std::ilogb(x) / 5.0)) + 1);
  for (;;) {
    const double square = root * root;
    const double next = 0.2 * (4.0 * root + x / (square * square));
    if (!(next < root)) return root;
    root = next;
  }
}

/// Restitution at `approachSpeed` m/s, >= 0, of a body that has `restitution` at the law's speed:
/// from 0 to 1 as that is. [any thread]
inline double restitutionAt(double restitution, const RestitutionLaw& law, double approachSpeed) {
  if (law.law == SpeedLaw::viscoelastic) {
    const double loss = (1.0 - restitution) * fifthRoot(approachSpeed / law.speed);
    return restitution > 0.0 ? restitution / (restitution + loss) : 0.0;
  }
  if (law.law == SpeedLaw::plastic && approachSpeed > law.speed)
    return restitution * std::sqrt(std::sqrt(law.speed / approachSpeed));
  return restitution;
}

}  // namespace carom
