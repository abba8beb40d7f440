#include "audio/radiation/recoil_filters.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/QR>

#include "audio/dsp/spread_kernel.h"
#include "audio/model/spherical_harmonics.h"

namespace carom::audio {
namespace {

using Complex = std::complex<double>;

constexpr double kTop = 2.0 * std::numbers::pi * kBand;  // rad/sample, end of the band
/// Poles up to this part of the band's end are kept, and at least so many.
constexpr double kBeyond = 1.5;
constexpr std::size_t kLeastPoles = 3;
constexpr Eigen::Index kFitted = 96;   // frequencies in the fit of poles that are left out
constexpr double kLowest = 1e-3;       // of the band's end
constexpr double kAtRest = 1e3;        // weight of the frequency 0
constexpr Eigen::Index kBounded = 40;  // frequencies at which a response is bounded

double frequencyOf(Eigen::Index index, Eigen::Index count) {
  return kTop *
         std::pow(kLowest, 1.0 - static_cast<double>(index) / static_cast<double>(count - 1));
}

/// Sets two rows, real and imaginary part, of the response of a pair of poles with a residue of 1
/// and of i.
void setRows(std::span<const Complex> poles, double omega, double weight,
             Eigen::Ref<Eigen::MatrixXd> rows) {
  const Complex s(0.0, omega);
  for (std::size_t pole = 0; pole < poles.size(); ++pole) {
    const auto column = static_cast<Eigen::Index>(2 * pole);
    const Complex one = weight / (s - poles[pole]);
    const Complex other = weight / (s - std::conj(poles[pole]));
    const Complex turned = Complex(0.0, 1.0) * (one - other);
    rows(0, column) = (one + other).real();
    rows(1, column) = (one + other).imag();
    rows(0, column + 1) = turned.real();
    rows(1, column + 1) = turned.imag();
  }
}

Eigen::MatrixXd responseRows(std::span<const Complex> poles) {
  Eigen::MatrixXd rows(2 * kFitted + 2, 2 * std::ssize(poles));
  for (Eigen::Index index = 0; index < kFitted; ++index) {
    const double omega = frequencyOf(index, kFitted);
    setRows(poles, omega, 1.0 / omega, rows.middleRows(2 * index, 2));
  }
  setRows(poles, 0.0, kAtRest / (kLowest * kTop), rows.bottomRows(2));
  return rows;
}

}  // namespace

RecoilFilters::RecoilFilters(std::shared_ptr<const RigidRecoil> recoil, double corner,
                             RadiationBank& bank)
    : recoil_(std::move(recoil)), corner_(corner) {
  std::vector<Complex> poles;
  for (const Complex& pole : recoil_->poles)
    poles.push_back(corner * pole);
  for (const RigidRecoil::Term& term : recoil_->terms)
    harmonics_ = std::max<std::size_t>(harmonics_, std::size_t{term.harmonic} + 1);
  while (harmonicCount(order_) < harmonics_)
    ++order_;
  harmonics_ = harmonicCount(order_);
  reduce(poles, corner);
  for (const Complex& pole : poles_)
    mixes_.push_back(&bank.ofPole(pole));
  responses_.resize(kBounded, 2 * std::ssize(poles_));
  for (Eigen::Index index = 0; index < kBounded; ++index) {
    const Complex s(0.0, frequencyOf(index, kBounded));
    for (std::size_t pole = 0; pole < poles_.size(); ++pole) {
      const Complex near =
          std::norm(poles_[pole]) / ((s - poles_[pole]) * (s - std::conj(poles_[pole])));
      responses_(index, static_cast<Eigen::Index>(2 * pole)) = s * near;
      responses_(index, static_cast<Eigen::Index>(2 * pole) + 1) = near;
    }
  }
}

/// Keeps the poles that matter in the band, and brings the residues to them.
void RecoilFilters::reduce(std::span<const Complex> poles, double corner) {
  for (const Complex& pole : poles)
    if (poles_.size() < kLeastPoles || std::abs(pole.imag()) < kBeyond * kTop)
      poles_.push_back(pole);
  const std::size_t terms = recoil_->terms.size();
  Eigen::MatrixXd wanted(2 * std::ssize(poles), static_cast<Eigen::Index>(terms));
  for (std::size_t term = 0; term < terms; ++term) {
    for (std::size_t pole = 0; pole < poles.size(); ++pole) {
      const Complex residue = corner * Complex(recoil_->residues[term * poles.size() + pole]);
      const auto row = static_cast<Eigen::Index>(2 * pole);
      wanted(row, static_cast<Eigen::Index>(term)) = residue.real();
      wanted(row + 1, static_cast<Eigen::Index>(term)) = residue.imag();
    }
  }
  if (poles_.size() < poles.size())
    wanted =
        (responseRows(poles_).colPivHouseholderQr().solve(responseRows(poles)) * wanted).eval();
  for (std::size_t term = 0; term < terms; ++term)
    for (std::size_t pole = 0; pole < poles_.size(); ++pole) {
      const auto row = static_cast<Eigen::Index>(2 * pole);
      residues_.emplace_back(wanted(row, static_cast<Eigen::Index>(term)),
                             wanted(row + 1, static_cast<Eigen::Index>(term)));
    }
}

void RecoilFilters::combine(const Vec3& linear, const Vec3& angular, Motion& motion) const {
  const double radius = recoil_->radius;
  const double area = radius * radius;
  const Vec3 turning = radius * angular;
  const std::array<double, 6> strength = {linear.x(),  linear.y(),  linear.z(),
                                          turning.x(), turning.y(), turning.z()};
  motion.residues.assign(harmonics_ * poles_.size(), 0.0);
  for (std::size_t term = 0; term < recoil_->terms.size(); ++term) {
    const double share = area * strength[recoil_->terms[term].motion];
    if (share == 0.0) continue;
    Complex* const to = &motion.residues[recoil_->terms[term].harmonic * poles_.size()];
    const Complex* const from = &residues_[term * poles_.size()];
    for (std::size_t pole = 0; pole < poles_.size(); ++pole)
      to[pole] += share * from[pole];
  }
}

void RecoilFilters::weigh(const Motion& motion, const Vec3& to, Weights& weights) const {
  const double distance = std::max(to.norm(), recoil_->radius);
  const Vec3 unit = to.norm() > 0.0 ? Vec3(to.normalized()) : Vec3::UnitZ();
  std::array<double, harmonicCount(RigidRecoil::kHighestOrder)> values;
  sphericalHarmonics<double>(unit.x(), unit.y(), unit.z(), order_, values);
  std::array<Complex, kMost> dipoles{};
  std::array<Complex, kMost> all{};
  const std::size_t count = poles_.size();
  for (std::size_t harmonic = 0; harmonic < harmonics_; ++harmonic) {
    const Complex* const from = &motion.residues[harmonic * count];
    const bool isDipole = harmonic >= 1 && harmonic <= 3;
    std::array<Complex, kMost>& sum = isDipole ? dipoles : all;
    for (std::size_t pole = 0; pole < count; ++pole)
      sum[pole] += values[harmonic] * from[pole];
  }
  // The near field of a dipole is c / (s distance) of its far field, which has no part at s = 0.
  const double near = corner_ * recoil_->radius / distance;
  for (std::size_t pole = 0; pole < count; ++pole) {
    const Complex at = poles_[pole];
    const Complex residue = all[pole] + dipoles[pole] * (1.0 + near / at);
    weights.far[pole] = 2.0 * residue.real() / std::norm(at);
    weights.near[pole] = -2.0 * (residue * std::conj(at)).real() / std::norm(at);
  }
}

double RecoilFilters::bound(const Weights& weights, double peakForce, double peakSlope) const {
  double sum = 0.0;
  double before = 0.0;
  double omegaBefore = 0.0;
  for (Eigen::Index index = 0; index < kBounded; ++index) {
    const double omega = frequencyOf(index, kBounded);
    Complex response = 0.0;
    for (std::size_t pole = 0; pole < poles_.size(); ++pole) {
      const auto column = static_cast<Eigen::Index>(2 * pole);
      response += weights.far[pole] * responses_(index, column) +
                  weights.near[pole] * responses_(index, column + 1);
    }
    // The spectrum of a force of integral 1, by its variation and by that of its slope.
    const double force =
        std::min({1.0, 2.0 * peakForce / omega, 4.0 * peakSlope / (omega * omega)});
    const double level = force * std::abs(response);
    sum += 0.5 * (level + before) * (omega - omegaBefore);
    before = level;
    omegaBefore = omega;
  }
  return sum / std::numbers::pi;
}

}  // namespace carom::audio
