#include "audio/ring.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "audio/resonator_kernels.h"
#include "audio/spread_kernel.h"
#include "audio/synth_settings.h"

namespace carom {
namespace {

std::size_t modesInBand(const ModalModel& model, double sampleRate) {
  const auto end = std::ranges::upper_bound(model.modes, kBand * sampleRate, {}, &Mode::frequency);
  return static_cast<std::size_t>(end - model.modes.begin());
}

}  // namespace

ResonatorSet::ResonatorSet(std::shared_ptr<const ModalModel> ofModel, const SynthSettings& settings)
    : model(std::move(ofModel)),
      modes(modesInBand(*model, settings.sampleRate)),
      padded((modes + ResonatorKernels::kWidth - 1) / ResonatorKernels::kWidth *
             ResonatorKernels::kWidth),
      a1(padded),
      a2(padded),
      pole(modes),
      dimming(modes, 1.0) {
  for (std::size_t mode = 0; mode < modes; ++mode) {
    const double omega = 2.0 * std::numbers::pi * model->modes[mode].frequency;
    const double sampleRate = settings.sampleRate;
    const double decay = model->modes[mode].decayRate;
    pole[mode] = {-decay, std::sqrt((omega - decay) * (omega + decay))};
    const TwoPole two = TwoPole::of(pole[mode].imag(), decay, sampleRate);
    a1[mode] = two.a1;
    a2[mode] = two.a2;
    if (settings.sampling == Sampling::bandLimited)
      dimming[mode] = spreadTransform(pole[mode] / sampleRate);
  }
}

}  // namespace carom
