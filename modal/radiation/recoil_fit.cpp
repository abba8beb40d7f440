#include "modal/radiation/recoil_fit.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>
#include <vector>

#include <Eigen/Dense>

namespace carom::modal {
namespace {

using Complex = std::complex<double>;
using RealRows = Eigen::MatrixXd;

constexpr double kDamping = 0.8;      // c / radius
constexpr double kSpacing = 0.8;      // c / radius
constexpr double kDense = 11.6;       // c / radius, up to which poles are that dense
constexpr double kWiden = 1.5;        // ratio of the poles above
constexpr double kWideDamping = 0.4;  // of their frequency
constexpr int kWidePoles = 6;
constexpr double kRidge = 1e-4;
constexpr double kAtRest = 1e3;  // weight of h(0) = 0
constexpr double kTailWeight = 0.2;
constexpr double kTailStep = 1.15;  // ratio of the frequencies above the samples
constexpr int kTailRounds = 12;
constexpr double kDipole = 0.1;   // of the level, from where on the dipole is that of long waves
constexpr double kSilent = 1e-4;  // of the largest residue: a term below is left out
constexpr double kStill = 1e-6;   // of the loudest motion: one that moves no air

std::vector<Complex> commonPoles() {
  std::vector<Complex> poles;
  double frequency = 0.5 * kSpacing;
  while (frequency < kDense) {
    poles.emplace_back(-kDamping, frequency);
    frequency += kSpacing;
  }
  frequency = kDense;
  for (int pole = 0; pole < kWidePoles; ++pole) {
    frequency *= kWiden;
    poles.emplace_back(-kWideDamping * frequency, frequency);
  }
  return poles;
}

/// Returns the response of each pair of poles at a frequency, for a residue of 1 and for one of i.
Eigen::VectorXcd responses(const std::vector<Complex>& poles, double frequency) {
  const Complex s(0.0, frequency);
  Eigen::VectorXcd values(2 * std::ssize(poles));
  for (std::size_t pole = 0; pole < poles.size(); ++pole) {
    const auto column = static_cast<Eigen::Index>(2 * pole);
    const Complex one = 1.0 / (s - poles[pole]);
    const Complex other = 1.0 / (s - std::conj(poles[pole]));
    values[column] = one + other;
    values[column + 1] = Complex(0.0, 1.0) * (one - other);
  }
  return values;
}

/// The dipole of long waves by harmonic, over s': a unit acceleration in units of the radius.
Eigen::VectorXcd dipoleOf(const RigidRadiator& low, std::size_t motion, double radius,
                          const std::vector<std::size_t>& harmonics) {
  const auto axis = static_cast<Eigen::Index>(motion % 3);
  const Vec3 unit = Vec3::Unit(axis);
  const Vec3 none = Vec3::Zero();
  const double scale = motion < 3 ? std::pow(radius, 3.0) : std::pow(radius, 4.0);
  const Vec3 dipole = low.dipole(motion < 3 ? unit : none, motion < 3 ? none : unit) / scale;
  const double share = std::sqrt(4.0 / 3.0 * std::numbers::pi) / (4.0 * std::numbers::pi);
  Eigen::VectorXcd values = Eigen::VectorXcd::Zero(std::ssize(harmonics));
  for (std::size_t index = 0; index < harmonics.size(); ++index) {
    const auto at = static_cast<Eigen::Index>(index);
    if (harmonics[index] == 1) values[at] = share * dipole.y();
    if (harmonics[index] == 2) values[at] = share * dipole.z();
    if (harmonics[index] == 3) values[at] = share * dipole.x();
  }
  return values;
}

/// The fit of one motion.
class MotionFit {
 public:
  MotionFit(const std::vector<Complex>& poles, const RecoilSamples& samples, std::size_t motion)
      : poles_(poles), samples_(samples), motion_(samples.motions[motion]) {
    const double power =
        samples.beam(static_cast<Eigen::Index>(motion), static_cast<Eigen::Index>(motion));
    findTail(std::max(power, 0.0));
  }

  /// Returns two rows for each pole, the residue's real and imaginary part, and a column for each
  /// harmonic.
  Eigen::MatrixXd residues(const Eigen::VectorXcd& dipole) {
    const auto unknowns = 2 * std::ssize(poles_);
    const auto fixed = static_cast<Eigen::Index>(motion_.values.size()) + 2;
    const auto tail = std::ssize(tail_);
    matrix_.setZero(2 * (fixed + tail) + 1 + unknowns, unknowns);
    right_.setZero(matrix_.rows(), std::ssize(motion_.harmonics));
    next_ = 0;
    // Where multipoles are louder at the first sample, rounding alone may be left of the dipole.
    if (dipole.norm() * samples_.frequencies.front() > kDipole * levelAt(0))
      for (const double frequency : {0.003, 0.03})
        add(frequency, Complex(0.0, frequency) * dipole, 1.0);
    for (std::size_t index = 0; index < motion_.values.size(); ++index)
      add(samples_.frequencies[index], valuesAt(index), 1.0);
    const Eigen::Index before = next_;
    for (const Tail& one : tail_)
      add(one.frequency, guessAt(one), kTailWeight);
    for (std::size_t pole = 0; pole < poles_.size(); ++pole) {
      const Complex atRest = -1.0 / poles_[pole];
      matrix_(next_, static_cast<Eigen::Index>(2 * pole)) = 2.0 * kAtRest * atRest.real();
      matrix_(next_, static_cast<Eigen::Index>(2 * pole) + 1) = -2.0 * kAtRest * atRest.imag();
    }
    ++next_;
    matrix_.bottomRows(unknowns).diagonal().setConstant(kRidge);
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> solver(matrix_);
    Eigen::MatrixXd residues = solver.solve(right_);
    for (int round = 0; round < kTailRounds; ++round) {
      next_ = before;
      for (const Tail& one : tail_)
        setRight(scaled(fitAt(residues, one.frequency), one.level), kTailWeight / one.level);
      residues = solver.solve(right_);
    }
    return residues;
  }

 private:
  /// A frequency above the samples, and the root of the power there.
  struct Tail {
    double frequency = 0.0;
    double level = 0.0;
  };

  double levelAt(std::size_t index) const { return valuesAt(index).norm(); }

  Eigen::VectorXcd valuesAt(std::size_t index) const {
    return Eigen::Map<const Eigen::VectorXcd>(motion_.values[index].data(),
                                              std::ssize(motion_.values[index]));
  }

  /// Lets the power over that of the beam go on by its power law in the last octave, up to 1.
  void findTail(double beam) {
    const double last = samples_.frequencies.back();
    const auto half = static_cast<std::size_t>(
        std::ranges::lower_bound(samples_.frequencies, 0.5 * last) - samples_.frequencies.begin());
    const double octave = last / samples_.frequencies[half];
    const double top = levelAt(samples_.frequencies.size() - 1) * last;
    const double rise = std::log(std::max(top, 1e-300) /
                                 std::max(levelAt(half) * samples_.frequencies[half], 1e-300)) /
                        std::log(octave);
    const double most = std::sqrt(beam);
    double frequency = last * kTailStep;
    while (frequency < 60.0 * last) {
      const double onwards = top * std::pow(frequency / last, std::clamp(rise, 0.0, 1.0));
      const double level = rise > 0.0 && onwards < most ? onwards : most;
      tail_.push_back({frequency, level / frequency});
      frequency *= kTailStep;
    }
  }

  void add(double frequency, const Eigen::VectorXcd& values, double weight) {
    const double level = values.norm();
    if (level <= 0.0) {
      next_ += 2;
      return;
    }
    const Eigen::VectorXcd row = responses(poles_, frequency);
    matrix_.row(next_) = weight / level * row.real();
    matrix_.row(next_ + 1) = weight / level * row.imag();
    setRight(values, weight / level);
  }

  void setRight(const Eigen::VectorXcd& values, double weight) {
    right_.row(next_++) = weight * values.real();
    right_.row(next_++) = weight * values.imag();
  }

  /// The pattern of the last sample, as it would go on without delay.
  Eigen::VectorXcd guessAt(const Tail& tail) const {
    const std::size_t last = motion_.values.size() - 1;
    const Eigen::VectorXcd pattern =
        (Complex(0.0, 1.0) * valuesAt(last)).real().cast<Complex>() * Complex(0.0, -1.0);
    return scaled(pattern, tail.level);
  }

  Eigen::VectorXcd fitAt(const Eigen::MatrixXd& residues, double frequency) const {
    return residues.transpose().cast<Complex>() * responses(poles_, frequency);
  }

  static Eigen::VectorXcd scaled(const Eigen::VectorXcd& values, double level) {
    const double norm = values.norm();
    return norm > 0.0 ? Eigen::VectorXcd(level / norm * values) : values;
  }

  const std::vector<Complex>& poles_;
  const RecoilSamples& samples_;
  const RecoilSamples::Motion& motion_;
  std::vector<Tail> tail_;
  Eigen::MatrixXd matrix_;
  Eigen::MatrixXd right_;
  Eigen::Index next_ = 0;
};

double loudness(const RecoilSamples::Motion& motion) {
  double most = 0.0;
  for (const std::vector<Complex>& values : motion.values)
    for (const Complex& value : values)
      most = std::max(most, std::abs(value));
  return most;
}

}  // namespace

RigidRecoil fitRecoil(const RecoilSamples& samples, const RigidRadiator& low) {
  RigidRecoil recoil;
  recoil.radius = samples.radius;
  recoil.poles = commonPoles();
  double loudest = 0.0;
  for (const RecoilSamples::Motion& motion : samples.motions)
    loudest = std::max(loudest, loudness(motion));
  for (std::size_t motion = 0; motion < samples.motions.size(); ++motion) {
    if (loudness(samples.motions[motion]) <= kStill * loudest) continue;
    const std::vector<std::size_t>& harmonics = samples.motions[motion].harmonics;
    const Eigen::MatrixXd residues =
        MotionFit(recoil.poles, samples, motion)
            .residues(dipoleOf(low, motion, samples.radius, harmonics));
    const double least = kSilent * residues.cwiseAbs().maxCoeff();
    for (Eigen::Index column = 0; column < residues.cols(); ++column) {
      if (residues.col(column).cwiseAbs().maxCoeff() <= least) continue;
      recoil.terms.push_back(
          {static_cast<std::uint16_t>(motion),
           static_cast<std::uint16_t>(harmonics[static_cast<std::size_t>(column)])});
      for (Eigen::Index pole = 0; pole < std::ssize(recoil.poles); ++pole)
        recoil.residues.emplace_back(static_cast<float>(residues(2 * pole, column)),
                                     static_cast<float>(residues(2 * pole + 1, column)));
    }
  }
  return recoil;
}

}  // namespace carom::modal
