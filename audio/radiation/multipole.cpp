#include "audio/radiation/multipole.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace carom::audio {

DirectionHarmonics::DirectionHarmonics(const Vec3& direction, int order) : order_(order) {
  assert(order >= 0 && order <= kHighestMultipole);
  const double length = direction.norm();
  const Vec3 unit = length > 0.0 ? Vec3(direction / length) : Vec3::UnitZ();
  sphericalHarmonics<double>(unit.x(), unit.y(), unit.z(), order, values_);
}

int multipoleOrder(const ModeRadiation& radiation) {
  int order = -1;
  while (harmonicCount(order + 1) <= radiation.multipoles.size())
    ++order;
  return order;
}

std::complex<double> multipoleTransfer(const ModeRadiation& radiation,
                                       const DirectionHarmonics& direction, double waveNumber,
                                       double distance) {
  assert(waveNumber > 0.0 && distance > 0.0);
  const std::complex<double>* coefficient = radiation.multipoles.data();
  const double* harmonic = direction.values().data();
  const std::size_t count = std::min(radiation.multipoles.size(), direction.values().size());
  RadialFunctions radial(waveNumber * distance);
  double re = 0.0;
  double im = 0.0;
  std::size_t done = 0;
  for (std::size_t end = 1, width = 3; done < count; end += width, width += 2) {
    double partRe = 0.0;
    double partIm = 0.0;
    for (; done < end; ++done) {
      partRe += coefficient[done].real() * harmonic[done];
      partIm += coefficient[done].imag() * harmonic[done];
    }
    const std::complex<double> r = radial.value();
    re += r.real() * partRe - r.imag() * partIm;
    im += r.real() * partIm + r.imag() * partRe;
    radial.next();
  }
  return {re / distance, im / distance};
}

double monopoleTransfer(const ModeRadiation& radiation, double density, double distance) {
  return density * radiation.volume / (4.0 * std::numbers::pi * distance);
}

// The harmonics are orthonormal, and the sphere has 4 pi of solid angle.
double meanTransfer(const ModeRadiation& radiation) {
  double sum = 0.0;
  for (const std::complex<double>& coefficient : radiation.multipoles)
    sum += std::norm(coefficient);
  return std::sqrt(sum / (4.0 * std::numbers::pi));
}

double enclosingRadius(const SurfaceMesh& surface, const Vec3& centre) {
  double radius = 0.0;
  for (const auto& triangle : surface.triangles)
    for (const std::uint32_t corner : triangle)
      radius = std::max(radius, (surface.vertices[corner] - centre).norm());
  return radius;
}

}  // namespace carom::audio
