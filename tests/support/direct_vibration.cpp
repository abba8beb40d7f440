#include "tests/support/direct_vibration.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include <Eigen/SparseCholesky>

#include "tests/support/constants.h"

namespace carom::test {
namespace {

constexpr double kCut = 18750.0;  // Hz, where the gain is 1/2
constexpr double kReach = 60.0;   // samples at 48 kHz
constexpr double kWindow = 7.86;  // Kaiser's beta for -80 dB

// The Bessel function I0 by its power series, all of whose terms are positive.
double besselI0(double x) {
  double sum = 1.0;
  double term = 1.0;
  for (int k = 1; term > 1e-17 * sum; ++k) {
    term *= 0.25 * x * x / (k * k);
    sum += term;
  }
  return sum;
}

// Impulse response of a low-pass filter in 1/s, over time in s: a table that is interpolated
// linearly.
class LowPass {
 public:
  LowPass() {
    const double most = besselI0(kWindow);
    for (int entry = 0; entry <= kEntries; ++entry) {
      const double place = static_cast<double>(entry) / kEntries;
      const double window = besselI0(kWindow * std::sqrt(1.0 - place * place)) / most;
      const double angle = 2.0 * std::numbers::pi * kCut * place * kReach / kRate;
      table_.push_back(2.0 * kCut * window * (entry > 0 ? std::sin(angle) / angle : 1.0));
    }
  }

  double at(double t) const {
    const double place = std::abs(t) * kRate / kReach * kEntries;
    if (!(place < kEntries)) return 0.0;
    const auto entry = static_cast<std::size_t>(place);
    return std::lerp(table_[entry], table_[entry + 1], place - static_cast<double>(entry));
  }

 private:
  static constexpr int kEntries = 30000;
  std::vector<double> table_;
};

}  // namespace

std::vector<double> volumeAcceleration(const DrivenBody& body,
                                       const std::function<double(double)>& force, double step,
                                       double end) {
  const double half = 0.5 * step;
  const double stiff = half * (half + body.beta);
  const Eigen::SparseMatrix<double> matrix =
      (1.0 + half * body.alpha) * body.mass + stiff * body.stiffness;
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(matrix);
  Eigen::VectorXd u = Eigen::VectorXd::Zero(body.push.size());
  Eigen::VectorXd v = u;
  Eigen::VectorXd a = u;
  std::vector<double> heard = {0.0};
  const auto steps = static_cast<std::size_t>(std::ceil(end / step));
  for (std::size_t index = 1; index <= steps; ++index) {
    u += step * v + half * half * a;
    v += half * a;
    a = force(static_cast<double>(index) * step) * body.push - body.alpha * (body.mass * v) -
        body.stiffness * (u + body.beta * v);
    a = factor.solve(a).eval();
    u += half * half * a;
    v += half * a;
    heard.push_back(body.flow.dot(a));
  }
  return heard;
}

std::vector<double> inTheBand(const std::vector<double>& samples, double step, double start,
                              std::size_t frames) {
  const LowPass lowPass;
  std::vector<double> heard(frames, 0.0);
  const double reach = kReach / kRate;
  for (std::size_t frame = 0; frame < frames; ++frame) {
    const double now = static_cast<double>(frame) / kRate - start;
    const double first = std::max(0.0, std::ceil((now - reach) / step));
    const double last = std::floor((now + reach) / step);
    for (auto index = static_cast<std::size_t>(first);
         index < samples.size() && static_cast<double>(index) <= last; ++index)
      heard[frame] += step * lowPass.at(now - static_cast<double>(index) * step) * samples[index];
  }
  return heard;
}

double rms(const std::vector<double>& samples) {
  double sum = 0.0;
  for (const double sample : samples)
    sum += sample * sample;
  return std::sqrt(sum / static_cast<double>(samples.size()));
}

double differenceInDecibels(const std::vector<double>& samples,
                            const std::vector<double>& reference) {
  std::vector<double> difference = samples;
  for (std::size_t index = 0; index < difference.size(); ++index)
    difference[index] -= reference[index];
  return 20.0 * std::log10(rms(difference) / rms(reference));
}

}  // namespace carom::test
