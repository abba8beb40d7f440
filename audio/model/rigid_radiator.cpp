#include "carom/audio/rigid_radiator.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <complex>
#include <cstdint>
#include <numbers>
#include <string>
#include <variant>

namespace carom {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

// Carlson's R_D(x, y, z) by duplication (Carlson 1979, algorithm 4): each turn brings the arguments
// closer together by a factor of 4, and the rest is his series to the fifth order. At most one of
// x, y is 0.
double carlsonRd(double x, double y, double z) {
  double sum = 0.0;
  double weight = 1.0;
  while (true) {
    const double mean = (x + y + 3.0 * z) / 5.0;
    const double dx = 1.0 - x / mean;
    const double dy = 1.0 - y / mean;
    const double dz = 1.0 - z / mean;
    if (std::abs(dx) < 1e-3 && std::abs(dy) < 1e-3 && std::abs(dz) < 1e-3) {
      const double xy = dx * dy;
      const double zz = dz * dz;
      const double e2 = xy - 6.0 * zz;
      const double e3 = (3.0 * xy - 8.0 * zz) * dz;
      const double e4 = 3.0 * (xy - zz) * zz;
      const double e5 = xy * zz * dz;
      const double series = 1.0 - 3.0 / 14.0 * e2 + e3 / 6.0 + 9.0 / 88.0 * e2 * e2 -
                            3.0 / 22.0 * e4 - 9.0 / 52.0 * e2 * e3 + 3.0 / 26.0 * e5;
      return 3.0 * sum + weight * series / (mean * std::sqrt(mean));
    }
    const double rootX = std::sqrt(x);
    const double rootY = std::sqrt(y);
    const double rootZ = std::sqrt(z);
    const double lambda = rootX * rootY + rootY * rootZ + rootZ * rootX;
    sum += weight / (rootZ * (z + lambda));
    weight *= 0.25;
    x = 0.25 * (x + lambda);
    y = 0.25 * (y + lambda);
    z = 0.25 * (z + lambda);
  }
}

// Lamb's alpha0, beta0, gamma0 (art. 114); their sum is 2.
Vec3 lambIntegrals(const Vec3& semiAxes) {
  const Vec3 square = semiAxes.cwiseAbs2();
  const double factor = 2.0 / 3.0 * semiAxes.prod();
  return factor * Vec3(carlsonRd(square.y(), square.z(), square.x()),
                       carlsonRd(square.z(), square.x(), square.y()),
                       carlsonRd(square.x(), square.y(), square.z()));
}

// Added volume for turning about the third axis over the displaced volume (Lamb, art. 115), from
// the semi-axes b and c across that axis and their integrals.
double turningPerVolume(double b, double c, double beta, double gamma) {
  const double difference = b * b - c * c;
  const double sum = b * b + c * c;
  if (std::abs(difference) < 1e-8 * sum) return 0.0;
  return 0.2 * difference * difference * (gamma - beta) / (2.0 * difference + sum * (beta - gamma));
}

Eigen::Matrix3d crossing(const Vec3& v) {
  Eigen::Matrix3d matrix;
  matrix << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return matrix;
}

}  // namespace

double RigidRadiator::radius() const {
  const double pushed = volume + addedVolume.topLeftCorner<3, 3>().trace() / 3.0;
  return std::cbrt(pushed / (2.0 * std::numbers::pi));
}

Vec3 RigidRadiator::dipole(const Vec3& linear, const Vec3& angular) const {
  return volume * (linear + angular.cross(centroid)) + addedVolume.topLeftCorner<3, 3>() * linear +
         addedVolume.topRightCorner<3, 3>() * angular;
}

// A turn about the new origin is a turn about the old one and the shift origin x omega.
RigidRadiator RigidRadiator::about(const Vec3& origin) const {
  Matrix6 motion = Matrix6::Identity();
  motion.topRightCorner<3, 3>() = crossing(origin);
  RigidRadiator moved = *this;
  moved.centroid -= origin;
  moved.addedVolume = motion.transpose() * addedVolume * motion;
  return moved;
}

RigidRadiator RigidRadiator::turned(const Eigen::Matrix3d& rotation) const {
  Matrix6 both = Matrix6::Zero();
  both.topLeftCorner<3, 3>() = rotation;
  both.bottomRightCorner<3, 3>() = rotation;
  RigidRadiator result = *this;
  result.centroid = rotation * centroid;
  result.addedVolume = both * addedVolume * both.transpose();
  return result;
}

Status validate(const RigidRecoil& recoil) {
  const auto isGrowing = [](const std::complex<double>& pole) {
    return !(pole.real() < 0.0 && pole.imag() > 0.0 && std::isfinite(std::norm(pole)));
  };
  constexpr std::uint32_t kHarmonics =
      (RigidRecoil::kHighestOrder + 1) * (RigidRecoil::kHighestOrder + 1);
  if (!(recoil.radius > 0.0 && std::isfinite(recoil.radius)))
    return Error{"recoil: radius is not a finite number above 0"};
  if (recoil.poles.empty() || recoil.poles.size() > RigidRecoil::kMostPoles)
    return Error{"recoil: " + std::to_string(recoil.poles.size()) + " poles; expected 1 to " +
                 std::to_string(RigidRecoil::kMostPoles)};
  if (std::ranges::any_of(recoil.poles, isGrowing))
    return Error{"recoil: a pole does not decay, or is not above the real axis"};
  if (recoil.residues.size() != recoil.terms.size() * recoil.poles.size())
    return Error{"recoil: expected a residue for each term and pole"};
  for (const RigidRecoil::Term& term : recoil.terms)
    if (term.motion > 5 || term.harmonic >= kHarmonics)
      return Error{"recoil: a term's motion is above 5, or its order above " +
                   std::to_string(RigidRecoil::kHighestOrder)};
  for (const std::complex<float>& residue : recoil.residues)
    if (!std::isfinite(residue.real()) || !std::isfinite(residue.imag()))
      return Error{"recoil: a residue is not finite"};
  return std::monostate{};
}

RigidRadiator sphereRadiator(double radius) {
  assert(radius > 0.0);
  RigidRadiator sphere;
  sphere.volume = 4.0 / 3.0 * std::numbers::pi * radius * radius * radius;
  sphere.addedVolume.topLeftCorner<3, 3>().diagonal().setConstant(0.5 * sphere.volume);
  return sphere;
}

// Uses Lamb's alpha / (2 - alpha), with 2 - alpha as the sum of the other two: nothing cancels for
// a disc.
RigidRadiator ellipsoidRadiator(const Vec3& semiAxes) {
  assert(semiAxes.minCoeff() > 0.0);
  RigidRadiator ellipsoid;
  ellipsoid.volume = 4.0 / 3.0 * std::numbers::pi * semiAxes.prod();
  const Vec3 lamb = lambIntegrals(semiAxes);
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const Eigen::Index next = (axis + 1) % 3;
    const Eigen::Index last = (axis + 2) % 3;
    ellipsoid.addedVolume(axis, axis) = ellipsoid.volume * lamb[axis] / (lamb[next] + lamb[last]);
    ellipsoid.addedVolume(axis + 3, axis + 3) =
        ellipsoid.volume * turningPerVolume(semiAxes[next], semiAxes[last], lamb[next], lamb[last]);
  }
  return ellipsoid;
}

}  // namespace carom
