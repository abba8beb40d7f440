#pragma once

#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include "carom/audio/rigid_radiator.h"
#include "tests/support/random.h"

namespace carom::test {

/// The recoil of a rigid sphere: cos(theta) s / (s^2 + 2 s + 2) along each axis, in units of its
/// radius (Morse and Ingard 1968, section 7.1), taken apart by hand.
inline RigidRecoil recoilOfSphere(double radius) {
  RigidRecoil recoil;
  recoil.radius = radius;
  recoil.poles = {{-1.0, 1.0}};
  const auto share = static_cast<float>(0.5 * std::sqrt(4.0 * std::numbers::pi / 3.0));
  recoil.terms = {{0, 3}, {1, 1}, {2, 2}};  // x, y, z
  recoil.residues.assign(3, {share, share});
  return recoil;
}

/// A recoil like that of a shape: twenty poles, six motions, multipoles up to the third order, at
/// rest at the frequency 0.
inline RigidRecoil someRecoil(double radius, unsigned seed) {
  Random random(seed);
  RigidRecoil recoil;
  recoil.radius = radius;
  for (int pole = 0; pole < 20; ++pole)
    recoil.poles.emplace_back(-0.8, 0.4 + 0.8 * pole);
  for (std::uint16_t motion = 0; motion < 6; ++motion) {
    for (std::uint16_t harmonic = 0; harmonic < 16; ++harmonic) {
      recoil.terms.push_back({motion, harmonic});
      std::vector<std::complex<double>> residues;
      double atRest = 0.0;
      for (std::size_t pole = 0; pole + 1 < recoil.poles.size(); ++pole) {
        const double real = random.between(-1.0, 1.0);
        residues.emplace_back(real, random.between(-1.0, 1.0));
        atRest += 2.0 * (-residues.back() / recoil.poles[pole]).real();
      }
      residues.emplace_back(0.5 * atRest * recoil.poles.back());  // 2 Re(-R / P) is -atRest
      for (const std::complex<double>& residue : residues)
        recoil.residues.emplace_back(residue);
    }
  }
  return recoil;
}

}  // namespace carom::test
