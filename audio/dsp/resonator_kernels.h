#pragma once

#include <cmath>
#include <cstddef>
#include <span>
#include <string_view>

namespace carom::audio {

/// The coefficients that make a recursion of two poles, y[n] = a1 y[n-1] + a2 y[n-2], one decaying
/// oscillation exp(-decayRate t) cos(w t + phase), exactly and at any sample rate.
struct TwoPole {
  double a1 = 0.0;  ///< 2 exp(-decayRate / rate) cos(w / rate)
  double a2 = 0.0;  ///< -exp(-2 decayRate / rate)

  /// Coefficients for a frequency w > 0 in rad/s, as it sounds (damped); decayRate >= 0 in 1/s;
  /// rate > w / pi in Hz.
  static TwoPole of(double w, double decayRate, double rate) {
    return {2.0 * std::exp(-decayRate / rate) * std::cos(w / rate),
            -std::exp(-2.0 * decayRate / rate)};
  }
};

/// Many resonators with two poles each, borrowed. Arrays of `count` elements; the elements that pad
/// them to a multiple of ResonatorKernels::kWidth are 0 in all arrays, and silent.
///
/// In double precision, as in single a resonator of 20 Hz at 192 kHz would be far out of tune.
struct Resonators {
  const double* a1 = nullptr;
  const double* a2 = nullptr;
  double* y1 = nullptr;   ///< y[n-1], in the unit of the output: pascals
  double* y2 = nullptr;   ///< y[n-2]
  std::size_t count = 0;  ///< a multiple of kWidth
};

/// One input to all resonators, borrowed.
struct ResonatorInput {
  const double* b0 = nullptr;  ///< gain of x[n] for each resonator
  const double* b1 = nullptr;  ///< gain of x[n-1] for each resonator
  const double* x = nullptr;   ///< one for each sample of output, and one more in front: x[-1]
};

/// Oscillations as complex numbers, each of which turns by a factor of its own in a step, borrowed.
/// Arrays as those of Resonators.
struct TurningModes {
  const double* turnRe = nullptr;  ///< the factor of a step
  const double* turnIm = nullptr;
  const double* pushRe = nullptr;  ///< what a push of 1 adds in a step
  const double* pushIm = nullptr;
  const double* giveRe = nullptr;  ///< with what factor one counts in the sum
  const double* giveIm = nullptr;
  double* re = nullptr;
  double* im = nullptr;
  std::size_t count = 0;  ///< a multiple of kWidth
};

/// The loops of a modal bank and of a contact, written once in plain C++ and once for each
/// instruction set that the compiler knows (Highway). [any thread] Nothing allocates.
///
/// A sample is the sum of kWidth partial sums, each of every kWidth-th resonator in their order,
/// whatever the instruction set. So it has the same bits however a run of samples is cut into
/// calls, and on all instruction sets that multiply and add in one rounding (FMA); likewise on all
/// that do not, among them the plain ones. The two groups differ by rounding.
///
/// A resonator that decays freely for long ends in denormal numbers, which are slow: `flush` at
/// least once in 128 samples keeps it from them, if the threshold is 1e-100 or more.
struct ResonatorKernels {
  static constexpr std::size_t kWidth = 8;
  /// Rounds a number of resonators up to the length of their arrays.
  static constexpr std::size_t padded(std::size_t count) {
    return (count + kWidth - 1) / kWidth * kWidth;
  }

  std::string_view name;  ///< name of the instruction set

  /// Free decay: out[n] += sum of y[n].
  void (*ring)(const Resonators& resonators, std::span<double> out);

  /// Driven: out[n] += sum of y[n], where y[n] = a1 y[n-1] + a2 y[n-2] + b0 x[n] + b1 x[n-1]. With
  /// silence as input the same bits as `ring`.
  void (*drive)(const Resonators& resonators, const ResonatorInput& input, std::span<double> out);

  /// Silences the resonators whose amplitude is not above the threshold, > 0, in the unit of the
  /// output, and those that are not finite; returns how many still ring. The amplitude is the A of
  /// y[n-1-k] = A exp(decayRate k / rate) cos(w k / rate + phase): what a free decay stays below.
  std::size_t (*flush)(const Resonators& resonators, double threshold);

  /// Moves the modes on by a step under a push. Returns the imaginary part of the sum of all of
  /// them, each times its factor `give`.
  double (*turn)(const TurningModes& modes, double push);
};

/// The kernels in plain C++: the reference.
const ResonatorKernels& plainResonators();
/// The fastest kernels that this machine runs and this build has.
const ResonatorKernels& fastestResonators();
/// All kernels that this machine runs, the plain ones last: for tests and measurements.
std::span<const ResonatorKernels> allResonators();

}  // namespace carom::audio
