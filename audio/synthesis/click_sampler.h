#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "audio/synthesis/click.h"
#include "audio/synthesis/click_kernels.h"
#include "audio/synthesis/long_pulse.h"
#include "carom/audio/synth_settings.h"

namespace carom::audio {

/// The quantity of a contact's pulse that is put on the samples.
enum class Drive : std::uint8_t {
  force,     ///< shares of its impulse, to be filtered
  pressure,  ///< naive sampling of the compact model: the slope of the force, per sample
};

/// Puts a click's pulse on the samples, at its exact time: the input of a filter or a resonator.
/// [one thread] Nothing allocates but `reserve`.
class ClickSampler {
 public:
  ClickSampler(Sampling sampling, const ClickKernels& kernels)
      : sampling_(sampling), kernels_(&kernels) {}

  /// Makes room for clicks of so many samples and nodes (0: of long pulses).
  void reserve(std::size_t nodes, std::size_t samples);

  /// Fills x with click.samples values, and may write ClickKernels::kRoom behind them.
  void sample(const Click& click, Drive drive, std::span<double> x) noexcept;

 private:
  Sampling sampling_;
  const ClickKernels* kernels_;
  PlacedNodes placed_;
  Raster raster_;
};

}  // namespace carom::audio
