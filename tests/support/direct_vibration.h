#pragma once

#include <functional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/SparseCore>

namespace carom::test {

/// M u'' + (alpha M + beta K) u' + K u = f(t) push, at rest before, and the volume that it moves.
struct DrivenBody {
  Eigen::SparseMatrix<double> mass = {};       ///< kg
  Eigen::SparseMatrix<double> stiffness = {};  ///< N/m
  double alpha = 0.0;                          ///< 1/s
  double beta = 0.0;                           ///< s
  Eigen::VectorXd push = {};                   ///< 1, of each degree of freedom
  Eigen::VectorXd flow = {};                   ///< m^2: the volume is flow . u
};

/// flow . u'' in m^3/s^2 at 0, step, 2 step... until `end` (s), by the trapezoidal rule (Newmark
/// 1959, gamma 1/2, beta 1/4: no damping of its own, second order, stable at any step), the matrix
/// factorised once.
std::vector<double> volumeAcceleration(const DrivenBody& body,
                                       const std::function<double(double)>& force, double step,
                                       double end);

/// What a recording at 48 kHz has of evenly spaced samples: a sine cardinal under a Kaiser window
/// of 60 samples each way, flat to 17.5 kHz and below -80 dB from 20 kHz. Sample n of the result is
/// at n / 48000 s, `samples` begin at `start` (s) and are 0 before and after.
std::vector<double> inTheBand(const std::vector<double>& samples, double step, double start,
                              std::size_t frames);

double rms(const std::vector<double>& samples);
/// dB, of the difference over `reference`, rms.
double differenceInDecibels(const std::vector<double>& samples,
                            const std::vector<double>& reference);

}  // namespace carom::test
