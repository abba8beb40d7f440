#include "native/scheduling/oscillation.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "native/math/contact_time.h"

namespace carom::native {
namespace {

constexpr double kPathRounding = 1e-15;  ///< of a position, relative to the way travelled

/// Taylor's coefficients up to y^17 and y^16: for |y| <= pi / 4 the next terms are below 1e-17.
constexpr int kTerms = 9;
constexpr std::array<double, kTerms> inverseFactorials(int first) {
  std::array<double, kTerms> coefficients{};
  double factorial = 1.0;
  for (int n = 0; n < 2 * kTerms; ++n) {
    if (n > 0) factorial *= n;
    if (n % 2 == first) coefficients[static_cast<std::size_t>(n / 2)] = 1.0 / factorial;
  }
  return coefficients;
}
constexpr std::array kOdd = inverseFactorials(1);
constexpr std::array kEven = inverseFactorials(0);

double alternating(const std::array<double, kTerms>& coefficients, double square) {
  double sum = 0.0;
  for (std::size_t k = coefficients.size(); k-- > 0;)
    sum = coefficients[k] - square * sum;
  return sum;
}

/// Returns the exact error of the rounded product (Dekker 1971, Numer. Math. 18, 224).
double lostBy(double product, double left, double right) {
  constexpr double kSplit = 134217729.0;  // 2^27 + 1
  const double leftHigh = kSplit * left - (kSplit * left - left);
  const double rightHigh = kSplit * right - (kSplit * right - right);
  const double leftLow = left - leftHigh;
  const double rightLow = right - rightHigh;
  return ((leftHigh * rightHigh - product) + leftHigh * rightLow + leftLow * rightHigh) +
         leftLow * rightLow;
}

/// The state of the point relative to the surface at one time.
struct Clearance {
  double middle = 0.0;        ///< m, above the middle of the oscillation
  double climb = 0.0;         ///< m/s, rate of change of `middle`
  double height = 0.0;        ///< m, above the surface
  double velocity = 0.0;      ///< m/s, rate of change of `height`
  double acceleration = 0.0;  ///< m/s^2
  double rounding = 0.0;      ///< m

  bool apart() const { return height > rounding; }
};

Clearance clearanceAt(const SmoothHeight& smooth, const NormalOscillation& oscillation,
                      const Instant& start, double wait) {
  const SineCosine phase = oscillation.at(after(start, wait));
  const double angular = oscillation.angularFrequency();
  const double shift = oscillation.amplitude * phase.sine;
  const double gained = wait * smooth.acceleration;
  const double way = wait * (std::abs(smooth.velocity) + 0.5 * std::abs(gained));
  Clearance here;
  here.middle = smooth.height + wait * (smooth.velocity + 0.5 * gained);
  here.climb = smooth.velocity + gained;
  here.height = here.middle - shift;
  here.velocity = here.climb - oscillation.amplitude * angular * phase.cosine;
  here.acceleration = smooth.acceleration + angular * angular * shift;
  here.rounding = smooth.rounding + kPathRounding * way;
  return here;
}

/// Duration in s in which the point cannot pass the surface.
double safeStep(const Clearance& here, const SmoothHeight& smooth, double reach, double angular) {
  if (here.middle > reach + here.rounding)
    return planeContactTime(here.middle - reach, here.climb, smooth.acceleration);
  const double most = angular * angular * reach;
  const double height = here.apart() ? here.height : std::max(here.height, 0.0);
  const double step = planeContactTime(height, here.velocity, smooth.acceleration - most);
  // A point at rest in touch that is drawn away is safe as long as its acceleration cannot have
  // changed sign.
  return step > 0.0 ? step : std::max(here.acceleration, 0.0) / (angular * most);
}

}  // namespace

SineCosine sineOfTurns(double turns) noexcept {
  const double quarters = std::floor(4.0 * turns + 0.5);
  const double angle = kWholeTurn * (turns - 0.25 * quarters);
  const double square = angle * angle;
  const double sine = angle * alternating(kOdd, square);
  const double cosine = alternating(kEven, square);
  const double quadrant = quarters - 4.0 * std::floor(0.25 * quarters);
  if (quadrant == 0.0) return {sine, cosine};
  if (quadrant == 1.0) return {cosine, -sine};
  if (quadrant == 2.0) return {-sine, -cosine};
  return {-cosine, sine};
}

SineCosine NormalOscillation::at(const Instant& instant) const noexcept {
  const double whole = frequency * instant.seconds;
  const double lost = lostBy(whole, frequency, instant.seconds) + frequency * instant.rest;
  return sineOfTurns((whole - std::floor(whole)) + (lost + turns));
}

double NormalOscillation::angularFrequency() const noexcept {
  return kWholeTurn * frequency;
}

double oscillatingContactTime(const SmoothHeight& smooth, const NormalOscillation& oscillation,
                              const Instant& start, double until) noexcept {
  const double reach = std::abs(oscillation.amplitude);
  const double angular = oscillation.angularFrequency();
  Clearance here = clearanceAt(smooth, oscillation, start, 0.0);
  if (!here.apart() && here.velocity == 0.0 && here.acceleration < 0.0) return 0.0;
  double wait = 0.0;
  while (wait <= until) {
    if (!here.apart() && here.velocity < 0.0) return wait;
    const double step = safeStep(here, smooth, reach, angular);
    if (!(step < kNever)) return kNever;
    const double next = wait + step;
    if (next == wait) return wait;
    wait = next;
    here = clearanceAt(smooth, oscillation, start, wait);
  }
  return kNever;
}

}  // namespace carom::native
