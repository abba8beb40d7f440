#include "audio/radiation/deforming_source.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "audio/model/immortal.h"
#include "audio/model/positive.h"

namespace carom::audio {
namespace {

constexpr double kPi = std::numbers::pi;
/// Half width of the reading kernel, in samples of the slower of both rates.
constexpr double kReadHalfWidth = 24.0;
/// Cut-off over the slower rate's Nyquist frequency: the middle of the fall.
constexpr double kCutoff = 0.9;
constexpr double kNearestEar = 1e-3;  // m
constexpr int kLooks = 4;             // iterations for the time at which the sound left

/// The reading kernel, a sinc under Nuttall's window with a continuous slope; x in samples of the
/// slower rate.
double kernelOf(double x) {
  constexpr std::array<double, 4> kTerms = {0.355768, 0.487396, 0.144232, 0.012604};
  double window = 0.0;
  for (std::size_t term = 0; term < kTerms.size(); ++term)
    window += kTerms[term] * std::cos(kPi / kReadHalfWidth * static_cast<double>(term) * x);
  const double angle = kPi * kCutoff * x;
  return window * kCutoff * (std::abs(angle) < 1e-8 ? 1.0 : std::sin(angle) / angle);
}

/// The same kernel from a table, off by less than 4e-7, which is -128 dB.
double kernelAt(double x) {
  constexpr double kFine = 1024.0;
  static const std::vector<double>& table = immortal([] {
    std::vector<double> values;
    for (int index = 0; index <= static_cast<int>(kReadHalfWidth * kFine); ++index)
      values.push_back(kernelOf(index / kFine));
    values.insert(values.end(), 2, 0.0);
    return values;
  });
  const double place = std::min(std::abs(x), kReadHalfWidth) * kFine;
  const double whole = std::floor(place);
  const double* values = table.data() + static_cast<std::ptrdiff_t>(whole);
  return values[0] + (place - whole) * (values[1] - values[0]);
}

/// Derivatives at equal steps of 1, of eighth order (Fornberg 1988), from values -4 to 4 steps off.
template <typename Value, typename At>
Value firstDerivative(At at) {
  constexpr std::array<double, 4> kTerms = {4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0};
  Value sum = 0.0 * at(0);
  for (int k = 4; k >= 1; --k)
    sum += kTerms[static_cast<std::size_t>(k) - 1] * (at(k) - at(-k));
  return sum;
}
template <typename Value, typename At>
Value secondDerivative(At at) {
  constexpr std::array<double, 4> kTerms = {8.0 / 5.0, -1.0 / 5.0, 8.0 / 315.0, -1.0 / 560.0};
  Value sum = 0.0 * at(0);
  // Differences from the middle, so that a constant gives 0 exactly.
  for (int k = 4; k >= 1; --k)
    sum += kTerms[static_cast<std::size_t>(k) - 1] * ((at(k) - at(0)) + (at(-k) - at(0)));
  return sum;
}

/// Number of states that a derivative needs after its own.
constexpr std::ptrdiff_t kDerivativeLead = 4;

}  // namespace

Result<DeformingSource> DeformingSource::create(const DeformingSettings& settings) {
  if (!isPositive(settings.step) || !isPositive(settings.sampleRate))
    return Error{"deforming source: step and sample rate must be positive (s, Hz)"};
  if (!isPositive(settings.medium.density) || !isPositive(settings.medium.speedOfSound))
    return Error{"deforming source: density and speed of sound must be positive"};
  return DeformingSource(settings);
}

DeformingSource::DeformingSource(const DeformingSettings& settings)
    : settings_(settings), period_(std::max(settings.step, 1.0 / settings.sampleRate)) {}

double DeformingSource::lookahead() const {
  return kReadHalfWidth * period_ + static_cast<double>(kDerivativeLead + 1) * settings_.step;
}

const DeformingState& DeformingSource::state(std::ptrdiff_t index) const {
  const std::ptrdiff_t place =
      std::clamp<std::ptrdiff_t>(index - first_, 0, std::ssize(states_) - 1);
  return states_[static_cast<std::size_t>(place)];
}

DeformingSource::Drive DeformingSource::driveAt(std::ptrdiff_t index) const {
  const double rate = 1.0 / settings_.step;
  const auto volume = [&](int lead) { return state(index + lead).volume; };
  const auto dipole = [&](int lead) { return state(index + lead).dipole; };
  return {rate * rate * secondDerivative<double>(volume), rate * firstDerivative<Vec3>(dipole),
          rate * rate * secondDerivative<Vec3>(dipole)};
}

void DeformingSource::add(const DeformingState& state) {
  states_.push_back(state);
  if (std::ssize(states_) > std::ssize(drives_) + kDerivativeLead)
    drives_.push_back(driveAt(first_ + std::ssize(drives_)));
}

Vec3 DeformingSource::placeAt(double time) const {
  const double at = std::clamp(time / settings_.step, 0.0, static_cast<double>(end() - 1));
  const double whole = std::floor(at);
  const auto index = static_cast<std::ptrdiff_t>(whole);
  const Vec3& from = state(index).position;
  return from + (at - whole) * (state(index + 1).position - from);
}

DeformingSource::Heard DeformingSource::at(const Vec3& ear, double time) const {
  if (states_.empty()) return {};
  const double c = settings_.medium.speedOfSound;
  double left = time;
  Vec3 way = ear - placeAt(left);
  for (int look = 0; look < kLooks; ++look) {
    left = time - std::max(way.norm(), kNearestEar) / c;
    way = ear - placeAt(left);
  }
  const double r = std::max(way.norm(), kNearestEar);
  const Vec3 n = way / r;
  const double reach = kReadHalfWidth * period_;
  const auto first = std::max(
      first_, static_cast<std::ptrdiff_t>(std::ceil(std::max(0.0, left - reach) / settings_.step)));
  const auto last =
      std::min(static_cast<std::ptrdiff_t>(std::floor((left + reach) / settings_.step)), end() - 1);
  const double near = 1.0 / (r * r);
  const double far = 1.0 / (r * c);
  double sum = 0.0;
  for (std::ptrdiff_t index = first; index <= last; ++index) {
    const auto place = static_cast<std::size_t>(index - first_);
    const Drive drive = place < drives_.size() ? drives_[place] : driveAt(index);
    const double x = (left - static_cast<double>(index) * settings_.step) / period_;
    sum += kernelAt(x) * (drive.monopole / r + far * n.dot(drive.far) + near * n.dot(drive.near));
  }
  return {settings_.medium.density / (4.0 * kPi) * settings_.step / period_ * sum, -way};
}

void DeformingSource::forgetBefore(double time) {
  const double reach =
      kReadHalfWidth * period_ + static_cast<double>(2 * kDerivativeLead) * settings_.step;
  const auto wanted =
      static_cast<std::ptrdiff_t>(std::floor(std::max(0.0, time - reach) / settings_.step));
  while (first_ < wanted && !drives_.empty()) {
    states_.pop_front();
    drives_.pop_front();
    ++first_;
  }
}

}  // namespace carom::audio
