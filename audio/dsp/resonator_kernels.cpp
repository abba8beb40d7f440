#include "audio/dsp/resonator_kernels.h"

#include <cassert>
#include <utility>
#include <vector>

#include "audio/model/immortal.h"
#if CAROM_SIMD
#include "audio/dsp/simd_resonators.h"
#endif

namespace carom::audio {
namespace {

constexpr std::size_t kWidth = ResonatorKernels::kWidth;

/// Adds up the partial sums of every kWidth-th resonator, in the order of all kernels.
double total(const double (&sums)[kWidth]) {
  static_assert(kWidth == 8);
  return ((sums[0] + sums[4]) + (sums[2] + sums[6])) + ((sums[1] + sums[5]) + (sums[3] + sums[7]));
}

/// Advances all resonators by one sample and returns their sum; `input` gives the input of each.
template <class Input>
double advance(const Resonators& r, Input input) {
  double sums[kWidth] = {};
  for (std::size_t i = 0; i < r.count; ++i) {
    const double y = r.a1[i] * r.y1[i] + (r.a2[i] * r.y2[i] + input(i));
    r.y2[i] = std::exchange(r.y1[i], y);
    sums[i % kWidth] += y;
  }
  return total(sums);
}

void ring(const Resonators& r, std::span<double> out) {
  assert(r.count % kWidth == 0);
  for (double& sample : out)
    sample += advance(r, [](std::size_t) { return 0.0; });
}

void drive(const Resonators& r, const ResonatorInput& in, std::span<double> out) {
  assert(r.count % kWidth == 0);
  const double* x = in.x;
  for (double& sample : out) {
    sample += advance(r, [&](std::size_t i) { return in.b0[i] * x[0] + in.b1[i] * x[-1]; });
    ++x;
  }
}

// Compares squared amplitudes: with r^2 = -a2, c = cos(w / rate) = a1 / (2 r) and A, phase as of
// y[n-1], r y[n-2] is A cos(phase - w / rate), and so
// y1^2 - 2 c y1 (r y2) + (r y2)^2 = A^2 (1 - c^2).
std::size_t flush(const Resonators& r, double threshold) {
  std::size_t ringing = 0;
  for (std::size_t i = 0; i < r.count; ++i) {
    const double a1 = r.a1[i];
    const double a2 = r.a2[i];
    const double y1 = r.y1[i];
    const double y2 = r.y2[i];
    const double least = threshold * threshold * (-4.0 * a2 - a1 * a1);
    const double here = -4.0 * a2 * (y1 * (y1 - a1 * y2) - a2 * y2 * y2);
    if (here > least) {
      ++ringing;
    } else {
      r.y1[i] = r.y2[i] = 0.0;
    }
  }
  return ringing;
}

double turn(const TurningModes& m, double push) {
  assert(m.count % kWidth == 0);
  double sums[kWidth] = {};
  for (std::size_t i = 0; i < m.count; ++i) {
    const double re = m.turnRe[i] * m.re[i] - m.turnIm[i] * m.im[i] + push * m.pushRe[i];
    const double im = m.turnRe[i] * m.im[i] + m.turnIm[i] * m.re[i] + push * m.pushIm[i];
    m.re[i] = re;
    m.im[i] = im;
    sums[i % kWidth] += m.giveRe[i] * im + m.giveIm[i] * re;
  }
  return total(sums);
}

std::vector<ResonatorKernels> makeAll() {
  std::vector<ResonatorKernels> all;
#if CAROM_SIMD
  all = simdResonators();
#endif
  all.push_back({"plain", ring, drive, flush, turn});
  return all;
}

}  // namespace

std::span<const ResonatorKernels> allResonators() {
  static const std::vector<ResonatorKernels>& all = immortal(makeAll);
  return all;
}

const ResonatorKernels& fastestResonators() {
  return allResonators().front();
}

const ResonatorKernels& plainResonators() {
  return allResonators().back();
}

}  // namespace carom::audio
