#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <string>
#include <vector>

#include "audio/model/spherical_harmonics.h"
#include "carom/audio/rigid_radiator.h"
#include "carom/audio/surface_mesh.h"
#include "modal/radiation/recoil_samples.h"

namespace carom::test {

/// A body whose recoil is measured.
struct RecoilShape {
  std::string name;
  SurfaceMesh mesh;
};

/// Returns a bar 10:1:1, a plate 20:20:1, a disc 50:50:1 and a ring, 1 m wide: the recoil is the
/// same at any size.
std::vector<RecoilShape> recoilShapes();

/// Accelerations along x, y, z in m/s^2, and about them, times the radius.
using Motion = std::array<double, 6>;
/// h of RigidRecoil by harmonic, up to its highest order.
using Multipoles = std::vector<std::complex<double>>;
inline constexpr std::size_t kRecoilHarmonics = audio::harmonicCount(RigidRecoil::kHighestOrder);

/// Returns what a motion sends out, at k radius.
Multipoles multipolesOf(const RigidRecoil& recoil, const Motion& motion, double frequency);
/// Returns the same of one of the frequencies that were solved.
Multipoles multipolesOf(const modal::RecoilSamples& samples, const Motion& motion,
                        std::size_t index);

/// Returns the sum of squares: the integral over all directions.
double powerOf(const Multipoles& multipoles);

/// Returns the largest difference in dB, over 400 directions evenly spread, where the expected
/// level is within 20 dB of the loudest.
double worstDecibels(const Multipoles& got, const Multipoles& expected);

}  // namespace carom::test
