#pragma once

#include <cstddef>
#include <functional>
#include <memory>

#include "carom/audio/result.h"

namespace carom::plugin {

/// The default audio device, by SDL.
class AudioDevice {
 public:
  /// A function that overwrites `frames` frames of two samples each, left and right, from -1 to 1.
  /// Called from the device's thread. Must not throw.
  using Fill = std::function<void(float* samples, std::size_t frames)>;

  /// Opens the device, as yet silent; asks for that rate (Hz), and takes the device's own if it has
  /// another, unless the rate is fixed: SDL converts it then. Refuses: no device, a build without
  /// SDL.
  static Result<AudioDevice> open(double sampleRate, bool isRateFixed);
  AudioDevice(AudioDevice&&) noexcept;
  AudioDevice& operator=(AudioDevice&&) noexcept;
  ~AudioDevice();  ///< waits for a `fill` that is under way

  double sampleRate() const;  ///< Hz
  /// Begins to play. To be called once.
  void start(Fill fill);

 private:
  class Impl;
  explicit AudioDevice(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace carom::plugin
