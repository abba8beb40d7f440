#pragma once

#include <functional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/SparseCore>

namespace carom::test {

/// A body that obeys M u'' + (alpha M + beta K) u' + K u = f(t) push, at rest before, and the
/// volume that it displaces.
struct DrivenBody {
  Eigen::SparseMatrix<double> mass = {};       ///< kg
  Eigen::SparseMatrix<double> stiffness = {};  ///< N/m
  double alpha = 0.0;                          ///< 1/s
  double beta = 0.0;                           ///< s
  Eigen::VectorXd push = {};                   ///< 1, for each degree of freedom
  Eigen::VectorXd flow = {};                   ///< m^2; the displaced volume is flow . u
};

/// The volume's acceleration flow . u'' in m^3/s^2 at 0, step, 2 step... until `end` (s). The
/// trapezoidal rule (Newmark 1959, gamma 1/2, beta 1/4) adds no damping, is of second order and
/// stable at any step; the matrix is factorised once.
std::vector<double> volumeAcceleration(const DrivenBody& body,
                                       const std::function<double(double)>& force, double step,
                                       double end);

/// Resamples evenly spaced samples to 48 kHz and to the band of a recording: by a sine cardinal
/// under a Kaiser window of 60 samples each way, flat to 17.5 kHz and below -80 dB from 20 kHz.
/// Sample n of the result is at n / 48000 s; `samples` begin at `start` (s) and are 0 before and
/// after.
std::vector<double> inTheBand(const std::vector<double>& samples, double step, double start,
                              std::size_t frames);

double rms(const std::vector<double>& samples);
/// RMS of the difference over that of `reference`, in dB.
double differenceInDecibels(const std::vector<double>& samples,
                            const std::vector<double>& reference);

}  // namespace carom::test
