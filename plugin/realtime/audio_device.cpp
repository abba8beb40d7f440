#include "plugin/realtime/audio_device.h"

#include <algorithm>
#include <string>
#include <utility>

#include <SDL.h>

namespace carom::plugin {
namespace {

constexpr int kChannels = 2;
/// Frames that the device asks for at once: 10.7 ms at 48 kHz.
constexpr Uint16 kDeviceBlock = 512;

}  // namespace

class AudioDevice::Impl {
 public:
  Impl() = default;
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    if (device_ != 0) SDL_CloseAudioDevice(device_);
    if (initialised_) SDL_QuitSubSystem(SDL_INIT_AUDIO);
  }

  Status open(double sampleRate, bool isRateFixed);
  double sampleRate() const { return sampleRate_; }
  void start(Fill fill) {
    fill_ = std::move(fill);
    SDL_PauseAudioDevice(device_, 0);
  }

 private:
  static void SDLCALL pull(void* self, Uint8* bytes, int length);

  bool initialised_ = false;
  SDL_AudioDeviceID device_ = 0;
  double sampleRate_ = 0.0;
  Fill fill_;
};

Status AudioDevice::Impl::open(double sampleRate, bool isRateFixed) {
  // SDL would take SIGINT and SIGTERM from the host, as it has audio tell of itself by events.
  SDL_SetHint(SDL_HINT_NO_SIGNAL_HANDLERS, "1");
  if (SDL_InitSubSystem(SDL_INIT_AUDIO) != 0)
    return Error{std::string("audio device: SDL finds none: ") + SDL_GetError()};
  initialised_ = true;
  SDL_AudioSpec wanted{};
  wanted.freq = static_cast<int>(sampleRate);
  wanted.format = AUDIO_F32SYS;
  wanted.channels = kChannels;
  wanted.samples = kDeviceBlock;
  wanted.callback = &Impl::pull;
  wanted.userdata = this;
  SDL_AudioSpec obtained{};
  const int changes = isRateFixed ? 0 : SDL_AUDIO_ALLOW_FREQUENCY_CHANGE;
  device_ = SDL_OpenAudioDevice(nullptr, 0, &wanted, &obtained, changes);
  if (device_ == 0)
    return Error{std::string("audio device: the default one cannot be opened: ") + SDL_GetError()};
  sampleRate_ = static_cast<double>(obtained.freq);
  return std::monostate{};
}

// SDL runs no callback before the device is unpaused, nor after it is closed.
void SDLCALL AudioDevice::Impl::pull(void* self, Uint8* bytes, int length) {
  auto* const samples = reinterpret_cast<float*>(bytes);
  const std::size_t frames = static_cast<std::size_t>(length) / (kChannels * sizeof(float));
  static_cast<Impl*>(self)->fill_(samples, frames);
}

Result<AudioDevice> AudioDevice::open(double sampleRate, bool isRateFixed) {
  auto impl = std::make_unique<Impl>();
  if (const Status opened = impl->open(sampleRate, isRateFixed); !opened) return opened.error();
  return AudioDevice(std::move(impl));
}

AudioDevice::AudioDevice(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
AudioDevice::AudioDevice(AudioDevice&&) noexcept = default;
AudioDevice& AudioDevice::operator=(AudioDevice&&) noexcept = default;
AudioDevice::~AudioDevice() = default;

double AudioDevice::sampleRate() const {
  return impl_->sampleRate();
}
void AudioDevice::start(Fill fill) {
  impl_->start(std::move(fill));
}

}  // namespace carom::plugin
