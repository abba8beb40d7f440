#include "tests/support/free_bar.h"

#include <cmath>
#include <numbers>

#include "carom/audio/material.h"
#include "tests/support/constants.h"
#include "tests/support/special_functions.h"

namespace carom::test {
namespace {

using Complex = std::complex<double>;
constexpr int kSlices = 2000;

// Derivative of the Hankel function: H1^(2)'(z) = H0 - H1 / z.
Complex hankelSlope(double z) {
  const Complex zeroth(test::besselJ(0, z), -test::besselY(0, z));
  const Complex first(test::besselJ(1, z), -test::besselY(1, z));
  return zeroth - first / z;
}

// Radiation of a section over that of a small one; 1 if it is small against the wavelength.
Complex sectionFactor(double z) {
  if (z < 1e-4) return 1.0;
  return 1.0 / (Complex(0.0, 0.5 * kPi) * z * z * hankelSlope(z));
}

}  // namespace

double FreeBar::mass() const {
  return material.density * kPi * radius * radius * length;
}

double FreeBar::turnInertia() const {
  return mass() * (length * length / 12.0 + radius * radius / 4.0);
}

// Even shapes have the deflection cos(p x) and the rotation g sin(p x), odd ones sin and -g cos.
// The equations of motion give two p^2 and their g. The ends are free of moment and shear force
// where the determinant is 0, which gives omega.
double BendingMode::determinant(double omega) {
  const double nu = bar_.material.poissonsRatio;
  const double young = bar_.material.youngsModulus;
  const double shear = 6.0 * (1.0 + nu) / (7.0 + 6.0 * nu) * young / (2.0 * (1.0 + nu));
  const double rho = bar_.material.density;
  const double slow = rho * omega * omega / shear;
  const double fast = rho * omega * omega / young;
  const double bend = 4.0 * rho * omega * omega / (young * bar_.radius * bar_.radius);
  const double root = std::sqrt((slow - fast) * (slow - fast) + 4.0 * bend);
  const double half = 0.5 * bar_.length;
  Complex moment[2];
  Complex force[2];
  for (int part = 0; part < 2; ++part) {
    const Complex square = 0.5 * (slow + fast + (part == 0 ? root : -root));
    const Complex p = std::sqrt(square);
    const Complex g = (slow - square) / p;
    wave_[part] = p;
    turn_[part] = even_ ? g : -g;
    moment[part] = g * p * (even_ ? std::cos(p * half) : std::sin(p * half));
    force[part] = (p + g) * (even_ ? std::sin(p * half) : std::cos(p * half));
  }
  amount_[0] = moment[1];
  amount_[1] = -moment[0];
  // The second wave number is imaginary, and so is the whole second part of an odd shape.
  const Complex value = moment[0] * force[1] - moment[1] * force[0];
  return even_ ? value.real() : value.imag();
}

BendingMode::BendingMode(const FreeBar& bar, int number) : bar_(bar), even_(number % 2 == 1) {
  // The search starts below, as Euler and Bernoulli's frequency is too high, by less than a half
  // here.
  const double beta = (number + 0.5) * kPi / bar.length;
  const double thin =
      beta * beta * 0.5 * bar.radius * std::sqrt(bar.material.youngsModulus / bar.material.density);
  double low = 0.7 * thin;
  double high = 1.02 * thin;
  const bool rising = determinant(low) < 0.0;
  for (int bisection = 0; bisection < 60; ++bisection) {
    const double middle = 0.5 * (low + high);
    ((determinant(middle) < 0.0) == rising ? low : high) = middle;
  }
  omega_ = low;
  static_cast<void>(determinant(omega_));
  const double perLength = bar.mass() / bar.length;
  double energy = 0.0;
  for (int slice = 0; slice < kSlices; ++slice) {
    const double x = bar.length * ((slice + 0.5) / kSlices - 0.5);
    Complex rotation = 0.0;
    for (int part = 0; part < 2; ++part)
      rotation += amount_[part] * turn_[part] *
                  (even_ ? std::sin(wave_[part] * x) : std::cos(wave_[part] * x));
    const double w = deflection(x);
    energy += perLength * bar.length / kSlices *
              (w * w + 0.25 * bar.radius * bar.radius * std::norm(rotation));
  }
  for (Complex& amount : amount_)
    amount /= std::sqrt(energy);
}

double BendingMode::deflection(double x) const {
  Complex sum = 0.0;
  for (int part = 0; part < 2; ++part)
    sum += amount_[part] * (even_ ? std::cos(wave_[part] * x) : std::sin(wave_[part] * x));
  // The real or the imaginary part is 0: see `determinant`.
  return sum.real() + sum.imag();
}

std::complex<double> lineOfDipoles(const FreeBar& bar,
                                   const std::function<double(double)>& acceleration, double omega,
                                   const Vec3& listener, double endLoss) {
  const Medium air;
  const double k = omega / air.speedOfSound;
  const double length = bar.length - 2.0 * endLoss * bar.radius;
  Complex sum = 0.0;
  for (int slice = 0; slice < kSlices; ++slice) {
    const double x = length * ((slice + 0.5) / kSlices - 0.5);
    const Vec3 way = listener - Vec3(x, 0.0, 0.0);
    const double r = way.norm();
    const double across = std::hypot(way.y(), way.z()) / r;
    const double mass =
        2.0 * air.density * kPi * bar.radius * bar.radius * length / kSlices * acceleration(x);
    sum += mass * sectionFactor(k * bar.radius * across) * way.y() / (4.0 * kPi * r * r) *
           Complex(1.0 / r, k) * std::polar(1.0, -k * r);
  }
  return sum;
}

}  // namespace carom::test
