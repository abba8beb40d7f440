#include "audio/synthesis/long_pulse.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include <Eigen/Dense>

#include "audio/dsp/spread_kernel.h"
#include "audio/synthesis/click_kernels.h"

namespace carom::audio {
namespace {

using Complex = std::complex<double>;

/// Samples: longer contacts are loud at frequencies so low that the table's rounding would be
/// heard.
constexpr double kMostTabulated = 400.0;
/// Bend of a track over its length: times on tracks that bend more are solved for one by one.
constexpr double kMostBend = 1e-3;

constexpr auto kRows = static_cast<double>(Raster::kRows);
constexpr std::size_t kPhases = 64;
constexpr std::size_t kKinds = 4;
constexpr auto kPoints = static_cast<Eigen::Index>(EdgeCorrection::kPoints);

/// Returns e^(i angle) of each angle.
Eigen::MatrixXcd wavesOf(const Eigen::MatrixXd& angles) {
  return (Complex(0.0, 1.0) * angles).array().exp();
}

using CorrectionTable = std::array<EdgeCorrection, kPhases + 1>;

/// Returns the part of repetition m of the edge's spectrum in the raster's sum at a frequency.
Complex repeated(double exponent, double omega, int m) {
  const Complex s(0.0, omega - 2.0 * std::numbers::pi * m);
  return std::tgamma(exponent + 1.0) * std::pow(s, -(exponent + 1.0));
}

CorrectionTable makeCorrections(double exponent) {
  constexpr int kRepeats = 300;
  constexpr Eigen::Index kFrequencies = 24;
  const Eigen::VectorXd omegas =
      Eigen::VectorXd::LinSpaced(kFrequencies, 0.0, 2.0 * std::numbers::pi * kBand / kRows);
  Eigen::MatrixXcd spectra(kFrequencies, 2 * kRepeats);
  Eigen::VectorXd repeats(2 * kRepeats);
  for (int m = 1; m <= kRepeats; ++m) {
    const Eigen::Index column = m - 1;
    repeats[column] = m;
    repeats[kRepeats + column] = -m;
    for (Eigen::Index i = 0; i < kFrequencies; ++i) {
      spectra(i, column) = repeated(exponent, omegas[i], m);
      spectra(i, kRepeats + column) = repeated(exponent, omegas[i], -m);
    }
  }
  CorrectionTable table;
  for (std::size_t row = 0; row <= kPhases; ++row) {
    const double phase = static_cast<double>(row) / kPhases;
    const Eigen::VectorXd turns = -2.0 * std::numbers::pi * phase * repeats;
    const Eigen::VectorXcd missing = -(spectra * wavesOf(turns));
    const Eigen::VectorXd times =
        Eigen::VectorXd::LinSpaced(kPoints, 0.0, static_cast<double>(kPoints - 1)).array() +
        (phase - static_cast<double>(EdgeCorrection::kBefore));
    const Eigen::MatrixXcd waves = wavesOf(-omegas * times.transpose());
    Eigen::MatrixXd both(waves.rows() + waves.rows(), kPoints);
    both << waves.real(), waves.imag();
    Eigen::VectorXd wanted(both.rows());
    wanted << missing.real(), missing.imag();
    const Eigen::VectorXd solved = both.colPivHouseholderQr().solve(wanted);
    std::copy_n(solved.data(), EdgeCorrection::kPoints, table[row].add.begin());
  }
  return table;
}

double exponentOf(EdgeKind kind) {
  constexpr std::array<double, kKinds> kExponents = {1.0, 1.5, 2.0, 3.0};
  return kExponents[static_cast<std::size_t>(kind)];
}

const std::array<CorrectionTable, kKinds>& corrections() {
  static const std::array<CorrectionTable, kKinds> tables = {
      makeCorrections(exponentOf(EdgeKind::corner)), makeCorrections(exponentOf(EdgeKind::root)),
      makeCorrections(exponentOf(EdgeKind::parabola)),
      makeCorrections(exponentOf(EdgeKind::cubic))};
  return tables;
}

/// The u of a time on the samples, and the rate at which it runs.
struct Place {
  double u = 0.0;
  double rate = 0.0;  // 1/samples
};

Place placeOf(const ClickTrack& track, double time) {
  const double since = time - track.start;
  const double rate =
      std::sqrt(std::max(0.0, track.length * track.length + 4.0 * track.bend * since));
  return {2.0 * since / (track.length + rate), 1.0 / rate};
}

void sampleOneByOne(const Pulse& pulse, const ClickTrack& track, SampleRange range,
                    Raster& raster) {
  for (std::size_t m = 0; m < Raster::kRows; ++m) {
    for (std::size_t n = range.begin; n < range.end; ++n) {
      const Place place = placeOf(track, static_cast<double>(n) + static_cast<double>(m) / kRows);
      raster.row(m)[n] = pulse.force(place.u) * track.gainAt(place.u) * place.rate / kRows;
    }
  }
}

double powerOf(EdgeKind kind, double base) {
  switch (kind) {
    case EdgeKind::corner:
      return base;
    case EdgeKind::root:
      return base * std::sqrt(base);
    case EdgeKind::parabola:
      return base * base;
    case EdgeKind::cubic:
      break;
  }
  return base * base * base;
}

void correctEdge(const PulseEdge& edge, const ClickTrack& track, Raster& raster) {
  const double place = kRows * track.at(edge.u);  // in steps of the raster
  const double nearest = edge.opens ? std::ceil(place) : std::floor(place);
  const EdgeCorrection correction = edgeCorrection(edge.kind, std::abs(nearest - place));
  const double step = 1.0 / (kRows * (track.length + 2.0 * track.bend * edge.u));
  const double scale = edge.coefficient * track.gainAt(edge.u) * powerOf(edge.kind, step) * step;
  const auto first = static_cast<std::size_t>(nearest);
  for (std::size_t i = 0; i < EdgeCorrection::kPoints; ++i) {
    const std::size_t point =
        edge.opens ? first + i - EdgeCorrection::kBefore : first + EdgeCorrection::kBefore - i;
    raster.row(point % Raster::kRows)[point / Raster::kRows] += scale * correction.add[i];
  }
}

}  // namespace

void Raster::reserve(std::size_t samples) {
  const std::size_t needed = kRows * (samples + 2 * kPad);
  if (values_.size() < needed) values_.resize(std::max(needed, 2 * values_.size()));
  corrections();  // made now, not while rendering
}

void Raster::clear(std::size_t samples) {
  stride_ = samples + 2 * kPad;
  std::fill_n(values_.begin(), kRows * stride_, 0.0);
}

EdgeCorrection edgeCorrection(EdgeKind kind, double phase) {
  const CorrectionTable& table = corrections()[static_cast<std::size_t>(kind)];
  const double place = std::clamp(phase, 0.0, 1.0) * kPhases;
  const auto row = std::min(static_cast<std::size_t>(place), kPhases - 1);
  const double share = place - static_cast<double>(row);
  EdgeCorrection between;
  for (std::size_t i = 0; i < EdgeCorrection::kPoints; ++i)
    between.add[i] = (1.0 - share) * table[row].add[i] + share * table[row + 1].add[i];
  return between;
}

void spreadLongPulse(const Pulse& pulse, const ClickTrack& track, const ClickKernels& kernels,
                     Raster& raster, std::span<double> x) {
  raster.clear(x.size());
  const SampleRange range{static_cast<std::size_t>(track.at(pulse.begin())),
                          static_cast<std::size_t>(track.at(pulse.end())) + 1};
  const bool isTabulated =
      track.length <= kMostTabulated && std::abs(track.bend) <= kMostBend * track.length;
  if (isTabulated) {
    kernels.sample(pulse.forceTable(), track, range, raster);
  } else {
    sampleOneByOne(pulse, track, range, raster);
  }
  for (const PulseEdge& edge : pulse.edges())
    correctEdge(edge, track, raster);
  kernels.collect(raster, x);
}

}  // namespace carom::audio
