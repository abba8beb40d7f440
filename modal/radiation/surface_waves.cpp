#include "modal/radiation/surface_waves.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "audio/model/spherical_harmonics.h"

namespace carom::modal {

using namespace audio;

namespace {

/// A Slope that counts as a number: sphericalHarmonics differentiates with it.
struct Dual : Slope {
  Dual() = default;
  explicit Dual(double number) : Slope{number, 0.0} {}
  Dual(double number, double change) : Slope{number, change} {}
};
Dual operator+(const Dual& a, const Dual& b) {
  return {a.value + b.value, a.slope + b.slope};
}
Dual operator-(const Dual& a, const Dual& b) {
  return {a.value - b.value, a.slope - b.slope};
}
Dual operator*(const Dual& a, const Dual& b) {
  return {a.value * b.value, a.slope * b.value + a.value * b.slope};
}
Dual operator*(double a, const Dual& b) {
  return {a * b.value, a * b.slope};
}

// Returns j_0 to j_order at z >= 0, by the recurrence downwards from where they vanish (Miller).
std::vector<double> sphericalBessels(int order, double z) {
  std::vector<double> values(static_cast<std::size_t>(order) + 1, 0.0);
  values[0] = 1.0;
  if (z < 1e-12) return values;
  const int start =
      std::max(order, static_cast<int>(z)) + 20 + static_cast<int>(std::sqrt(40.0 * (order + z)));
  double above = 0.0;
  double here = 1e-280;
  double first = 0.0;
  for (int l = start; l >= 0; --l) {
    if (l <= order) values[static_cast<std::size_t>(l)] = here;
    first = l == 1 ? here : first;
    if (l > 0) above = std::exchange(here, (2.0 * l + 1.0) / z * here - above);
    if (std::abs(here) > 1e200) {
      for (double& value : values)
        value *= 1e-300;
      above *= 1e-300;
      here *= 1e-300;
      first *= 1e-300;
    }
  }
  const double j0 = std::sin(z) / z;
  const double j1 = (j0 - std::cos(z)) / z;
  const double scale = std::abs(j0) > std::abs(j1) ? j0 / here : j1 / first;
  for (double& value : values)
    value *= scale;
  return values;
}

}  // namespace

SurfaceWaves::SurfaceWaves(double waveNumber, int order, double smallest)
    : waveNumber_(waveNumber), order_(order), smallest_(smallest), waves_(harmonicCount(order)) {}

std::span<const Slope> SurfaceWaves::at(const Vec3& point, const Vec3& normal) {
  const double distance = std::max(point.norm(), smallest_);
  const Vec3 unit = point / distance;
  const double outward = unit.dot(normal);
  const Vec3 turn = (normal - outward * unit) / distance;
  std::vector<Dual> harmonics(waves_.size());
  sphericalHarmonics<Dual>({unit.x(), turn.x()}, {unit.y(), turn.y()}, {unit.z(), turn.z()}, order_,
                           harmonics);
  const double z = waveNumber_ * distance;
  const std::vector<double> bessel = sphericalBessels(order_ + 1, z);
  std::size_t index = 0;
  for (int l = 0; l <= order_; ++l) {
    const auto degree = static_cast<std::size_t>(l);
    const Dual radial(bessel[degree],
                      waveNumber_ * outward * (l / z * bessel[degree] - bessel[degree + 1]));
    for (int m = -l; m <= l; ++m, ++index)
      waves_[index] = radial * harmonics[index];
  }
  return waves_;
}

void SurfaceWaves::turnPhases(std::span<std::complex<double>> coefficients) {
  using Complex = std::complex<double>;
  const std::array<Complex, 4> powers = {Complex(1, 0), {0, 1}, {-1, 0}, {0, -1}};
  std::size_t index = 0;
  for (std::size_t l = 0; index < coefficients.size(); ++l)
    for (std::size_t m = 0; m <= 2 * l && index < coefficients.size(); ++m)
      coefficients[index++] *= powers[l % 4];
}

}  // namespace carom::modal
