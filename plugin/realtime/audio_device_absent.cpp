#include <utility>

#include "plugin/realtime/audio_device.h"

// Takes the place of audio_device.cpp in a build without SDL.

namespace carom::plugin {

class AudioDevice::Impl {};

Result<AudioDevice> AudioDevice::open(double, bool) {
  return Error{
      "audio device: this build has none (CAROM_DEVICE is off); "
      "pull samples with prepareRendering and render"};
}

AudioDevice::AudioDevice(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
AudioDevice::AudioDevice(AudioDevice&&) noexcept = default;
AudioDevice& AudioDevice::operator=(AudioDevice&&) noexcept = default;
AudioDevice::~AudioDevice() = default;

double AudioDevice::sampleRate() const {
  return 0.0;
}
void AudioDevice::start(Fill) {}  // NOLINT(performance-unnecessary-value-param): as declared

}  // namespace carom::plugin
