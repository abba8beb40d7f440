#include "lab/fit/subspace_modes.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include <Eigen/Dense>

namespace carom::lab {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;

constexpr Index kMostRows = 90;   // of a Hankel matrix
constexpr Index kMostPoles = 26;  // in one band
constexpr std::size_t kLeastOutputs = 14;
constexpr double kNoiseReserve = 2.5;  // eigenvalue over the edge of those of noise
constexpr double kNoisePower = 3.0;    // power over the noise where a ring is over
constexpr double kMostGrowth = 2.0;    // of exp(s t) over the window: no mode grows

/// Signals cut to one window.
struct BandWindow {
  std::vector<std::span<const Complex>> signals;
  std::vector<double> noise;
  Index count = 0;  // outputs of each

  BandWindow from(Index first) const {
    BandWindow later{{}, noise, count - first};
    for (const std::span<const Complex>& signal : signals)
      later.signals.push_back(signal.subspan(static_cast<std::size_t>(first)));
    return later;
  }
  Index rows() const { return std::min(kMostRows, count * 2 / 5); }
};

/// Returns the number of outputs after which a signal does not stand above its noise any more.
std::size_t heardOutputs(const BandSignal& signal) {
  const std::size_t size = signal.outputs.size();
  const std::size_t stretch = std::max<std::size_t>(4, size / 40);
  std::size_t heard = 0;
  for (std::size_t from = 0; from + stretch <= size; from += stretch) {
    double power = 0.0;
    for (std::size_t at = from; at < from + stretch; ++at)
      power += std::norm(signal.outputs[at]);
    if (power > kNoisePower * signal.noise * static_cast<double>(stretch)) heard = from + stretch;
  }
  return heard == 0 ? 0 : std::min(size, heard + stretch);
}

BandWindow windowOf(const std::vector<BandSignal>& signals) {
  std::size_t heard = 0;
  std::size_t least = static_cast<std::size_t>(-1);
  for (const BandSignal& signal : signals) {
    heard = std::max(heard, heardOutputs(signal));
    least = std::min(least, signal.outputs.size());
  }
  BandWindow window;
  if (heard == 0) return window;
  const std::size_t count = std::min(least, std::max(heard, kLeastOutputs));
  if (count < kLeastOutputs) return window;
  window.count = static_cast<Index>(count);
  for (const BandSignal& signal : signals) {
    window.signals.push_back(std::span(signal.outputs).first(count));
    window.noise.push_back(signal.noise);
  }
  return window;
}

/// Returns the sum of Hankel matrices times their adjoints, in units of the noise.
Eigen::MatrixXcd correlation(const BandWindow& window) {
  const Index rows = window.rows();
  const Index columns = window.count - rows + 1;
  Eigen::MatrixXcd sum = Eigen::MatrixXcd::Zero(rows, rows);
  for (std::size_t tap = 0; tap < window.signals.size(); ++tap) {
    Eigen::MatrixXcd hankel(rows, columns);
    for (Index column = 0; column < columns; ++column) {
      for (Index row = 0; row < rows; ++row)
        hankel(row, column) = window.signals[tap][static_cast<std::size_t>(row + column)];
    }
    sum += hankel * hankel.adjoint() / window.noise[tap];
  }
  return sum;
}

/// The signal subspace of a window: vectors in the order of their eigenvalues, the largest first.
struct Subspace {
  Eigen::MatrixXcd vectors;
  Index order = 0;  // eigenvalues above the noise
};

Subspace subspaceOf(const BandWindow& window) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXcd> solver(correlation(window));
  Subspace subspace;
  const Index rows = window.rows();
  subspace.vectors = solver.eigenvectors().rowwise().reverse();
  const double edge = std::sqrt(static_cast<double>(rows)) +
                      std::sqrt(static_cast<double>((window.count - rows + 1) *
                                                    static_cast<Index>(window.signals.size())));
  const Eigen::VectorXd values = solver.eigenvalues().reverse();
  const double least = std::max(kNoiseReserve * edge * edge, 1e-13 * values(0));
  while (subspace.order < rows && values(subspace.order) > least)
    ++subspace.order;
  subspace.order = std::min({subspace.order, kMostPoles, rows / 2});
  return subspace;
}

/// Solves for the shift of the subspace of that order; `error` is how far it is from invariant.
Eigen::MatrixXcd shiftOf(const Subspace& subspace, Index order, double* error) {
  const Index rows = subspace.vectors.rows();
  const auto upper = subspace.vectors.topLeftCorner(rows - 1, order);
  const auto lower = subspace.vectors.block(1, 0, rows - 1, order);
  const Eigen::RowVectorXcd last = subspace.vectors.row(rows - 1).head(order);
  // upper^H upper = 1 - last^H last, whose inverse is Sherman and Morrison's.
  double taken = 0.0;
  for (Index column = 0; column < order; ++column)
    taken += std::norm(last(column));
  const double rest = std::max(1e-9, 1.0 - taken);
  const Eigen::MatrixXcd crossed = upper.adjoint() * lower;
  Eigen::MatrixXcd shift = crossed + last.adjoint() * (last * crossed) / rest;
  if (error != nullptr) *error = (lower - upper * shift).norm();
  return shift;
}

/// Returns the order at which the subspace is nearest to invariant, not below that of the last
/// order whose error is within a factor of the least one (several orders may be all but exact).
Index esterOrder(const Subspace& subspace) {
  std::vector<double> errors;
  for (Index order = 1; order <= subspace.order; ++order) {
    double error = 0.0;
    shiftOf(subspace, order, &error);
    errors.push_back(error / std::sqrt(static_cast<double>(order)));
  }
  if (errors.empty()) return 0;
  const double least = *std::ranges::min_element(errors);
  Index order = subspace.order;
  while (order > 1 && errors[static_cast<std::size_t>(order - 1)] > std::max(3.0 * least, 0.12))
    --order;
  return order;
}

std::vector<Complex> polesOf(const Subspace& subspace, Index order, double rate) {
  if (order < 1) return {};
  const Eigen::ComplexEigenSolver<Eigen::MatrixXcd> solver(shiftOf(subspace, order, nullptr),
                                                           false);
  std::vector<Complex> poles;
  for (const Complex& factor : solver.eigenvalues()) {
    if (std::abs(factor) > 1e-6) poles.push_back(rate * std::log(factor));
  }
  return poles;
}

/// Returns the amplitudes of the poles in each signal, one column for each, by least squares.
Eigen::MatrixXcd amplitudesOf(const BandWindow& window, const std::vector<Complex>& poles,
                              double rate) {
  Eigen::MatrixXcd basis(window.count, static_cast<Index>(poles.size()));
  for (Index pole = 0; pole < basis.cols(); ++pole) {
    for (Index at = 0; at < window.count; ++at)
      basis(at, pole) =
          std::exp(poles[static_cast<std::size_t>(pole)] * (static_cast<double>(at) / rate));
  }
  Eigen::MatrixXcd signals(window.count, static_cast<Index>(window.signals.size()));
  for (Index tap = 0; tap < signals.cols(); ++tap) {
    for (Index at = 0; at < window.count; ++at)
      signals(at, tap) =
          window.signals[static_cast<std::size_t>(tap)][static_cast<std::size_t>(at)];
  }
  return basis.colPivHouseholderQr().solve(signals);
}

/// True if two poles are one as far as a window of `length` (s) can tell.
bool isSame(const Complex& pole, const Complex& other, double length) {
  const double decay = std::max(-pole.real(), 0.5 / length);
  return std::abs(pole.imag() - other.imag()) < 0.3 * decay + 0.3 / length &&
         std::abs(pole.real() - other.real()) < 0.4 * decay + 0.4 / length;
}

/// Returns the poles of other orders and of a later window, one list for each.
std::vector<std::vector<Complex>> otherPoles(const BandWindow& window, const Subspace& subspace,
                                             Index order, double rate) {
  std::vector<std::vector<Complex>> others;
  const Index most = std::min(window.rows() / 2, kMostPoles + 2);
  others.push_back(polesOf(subspace, std::min(order + 2, most), rate));
  if (order > 2) others.push_back(polesOf(subspace, order - 1, rate));
  const BandWindow later = window.from(std::max<Index>(1, window.count / 12));
  if (later.count >= static_cast<Index>(kLeastOutputs)) {
    const Subspace late = subspaceOf(later);
    others.push_back(polesOf(late, std::max(late.order, std::min(order, later.rows() / 2)), rate));
  }
  return others;
}

double stabilityOf(const Complex& pole, const std::vector<std::vector<Complex>>& others,
                   double length) {
  double found = 0.0;
  for (const std::vector<Complex>& poles : others) {
    if (std::ranges::any_of(poles,
                            [&](const Complex& other) { return isSame(pole, other, length); }))
      found += 1.0;
  }
  return others.empty() ? 0.0 : found / static_cast<double>(others.size());
}

/// Returns the energy of exp(s t) over `count` outputs.
double energyOf(const Complex& pole, Index count, double rate) {
  const double factor = std::exp(2.0 * pole.real() / rate);
  if (std::abs(factor - 1.0) < 1e-9) return static_cast<double>(count);
  return (1.0 - std::pow(factor, static_cast<double>(count))) / (1.0 - factor);
}

}  // namespace

std::vector<BandPole> subspaceModes(const std::vector<BandSignal>& signals, double rate) {
  const BandWindow window = windowOf(signals);
  if (window.count == 0) return {};
  const Subspace subspace = subspaceOf(window);
  const Index order = esterOrder(subspace);
  if (order == 0) return {};
  std::vector<Complex> poles = polesOf(subspace, order, rate);
  const double length = static_cast<double>(window.count) / rate;
  std::erase_if(poles,
                [&](const Complex& pole) { return pole.real() * length > std::log(kMostGrowth); });
  if (poles.empty()) return {};
  const Eigen::MatrixXcd amplitudes = amplitudesOf(window, poles, rate);
  const auto others = otherPoles(window, subspace, order, rate);
  std::vector<BandPole> found;
  for (Index at = 0; at < amplitudes.rows(); ++at) {
    BandPole pole;
    pole.s = poles[static_cast<std::size_t>(at)];
    pole.length = length;
    pole.stability = stabilityOf(pole.s, others, length);
    for (Index tap = 0; tap < amplitudes.cols(); ++tap) {
      pole.amplitudes.push_back(amplitudes(at, tap));
      const double energy = std::norm(amplitudes(at, tap)) * energyOf(pole.s, window.count, rate);
      pole.energyRatio =
          std::max(pole.energyRatio, energy / window.noise[static_cast<std::size_t>(tap)]);
    }
    found.push_back(std::move(pole));
  }
  return found;
}

}  // namespace carom::lab
