#include "carom/sound_output.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "plugin/realtime/sound_session.h"

namespace carom {

using namespace plugin;

namespace {

/// Bound of places (m): far below that beyond which a double cannot tell samples apart.
constexpr double kFarthest = 1e12;

/// Ceiling of the limiter behind an automatic level: -1 dB.
constexpr float kAutomaticCeiling = 0.8912509F;

/// Gives an automatic level its limiter, unless there is one.
void limitAutomatic(SoundSettings& settings) {
  if (settings.level != Level::automatic || settings.limiter) return;
  settings.limiter.emplace();
  settings.limiter->ceiling = kAutomaticCeiling;
}

/// Returns the settings for a device: with its rate, in real time, with a level and a limiter.
SoundSettings deviceSettings(SoundSettings settings, double sampleRate) {
  settings.synth.sampleRate = sampleRate;
  settings.clock = SoundClock::realTime;
  if (settings.level == Level::standard)
    settings.level = settings.fullScale ? Level::fixed : Level::automatic;
  limitAutomatic(settings);
  if (!settings.fullScale) settings.fullScale = kDeviceFullScale;
  if (!settings.limiter) settings.limiter.emplace();
  return settings;
}

/// Renders for a device that has only left and right: the first listener's channels.
class StereoFold {
 public:
  StereoFold(std::size_t channels, bool isStereo)
      : channels_(channels), right_(isStereo ? 1 : 0), block_(channels * kFrames) {}

  void operator()(SoundEngine& engine, float* samples, std::size_t frames) noexcept {
    for (std::size_t done = 0; done < frames;) {
      const std::size_t part = std::min(kFrames, frames - done);
      engine.renderInterleaved(block_.data(), part);
      for (std::size_t frame = 0; frame < part; ++frame) {
        samples[2 * (done + frame)] = block_[frame * channels_];
        samples[2 * (done + frame) + 1] = block_[frame * channels_ + right_];
      }
      done += part;
    }
  }

 private:
  static constexpr std::size_t kFrames = 256;
  std::size_t channels_;
  std::size_t right_;
  std::vector<float> block_;
};

}  // namespace

SoundOutput::SoundOutput(std::unique_ptr<SoundSession> session) : session_(std::move(session)) {}
SoundOutput::SoundOutput(SoundOutput&&) noexcept = default;
SoundOutput& SoundOutput::operator=(SoundOutput&&) noexcept = default;
SoundOutput::~SoundOutput() = default;

Status SoundOutput::close() {
  return session_->close();
}

Status SoundOutput::setListener(const Vec3& position, const Quat& orientation,
                                std::size_t listener) {
  if (Status open = session_->requireOpen(); !open) return open;
  const auto& poses = session_->poses;
  const ListenerPose pose = {session_->time, position, orientation};
  if (listener >= poses.size())
    return Error{"sound: there is no listener " + std::to_string(listener) + "; there are " +
                 std::to_string(poses.size())};
  if (!isPose(pose) || !(position.norm() <= kFarthest))
    return Error{"sound: pose of listener " + std::to_string(listener) +
                 ": expected a place within 1e12 m of the origin and a quaternion of unit length"};
  session_->hasAutomaticListener = false;
  session_->setPose(listener, position, orientation);
  return std::monostate{};
}

double SoundOutput::time() const {
  return session_->time;
}

void SoundOutput::pause() {
  if (session_->engine) session_->engine->timeline().pause();
}

Status SoundOutput::setTimeScale(double scale) {
  if (Status open = session_->requireOpen(); !open) return open;
  if (!(scale >= 1e-3 && scale <= 1e3))
    return Error{"sound: a time scale of " + std::to_string(scale) + "; expected 0.001 to 1000"};
  session_->timeScale = scale;
  if (session_->engine) session_->engine->timeline().setScale(scale);
  return std::monostate{};
}

Status SoundOutput::play() {
  SoundSession& session = *session_;
  if (Status open = session.requireOpen(); !open) return open;
  if (session.device) return std::monostate{};
  if (session.engine)
    return Error{"sound: samples are pulled by the host (prepareRendering); stop before play"};
  Result<AudioDevice> device = AudioDevice::open(session.settings.synth.sampleRate);
  if (!device) return Error{"sound: " + device.error().message};
  const SoundSettings settings = deviceSettings(session.settings, device->sampleRate());
  if (Status made = session.makeEngine(settings); !made) return made;
  session.device = *std::move(device);
  const bool isStereo = carom::channelCount(settings.listeners.front()) == 2;
  session.device->start(
      [engine = session.engine.get(), fold = StereoFold(session.channels, isStereo)](
          float* samples, std::size_t frames) mutable { fold(*engine, samples, frames); });
  return std::monostate{};
}

Status SoundOutput::prepareRendering(double sampleRate) {
  if (Status open = session_->requireOpen(); !open) return open;
  SoundSettings settings = session_->settings;
  settings.synth.sampleRate = sampleRate;
  limitAutomatic(settings);
  return session_->makeEngine(settings);
}

void SoundOutput::stop() {
  session_->stop();
}

Status SoundOutput::record(const std::filesystem::path& file) {
  if (Status open = session_->requireOpen(); !open) return open;
  return session_->record(file);
}

Status SoundOutput::finishRecording() {
  return session_->finishRecording();
}

void SoundOutput::setGain(double gain) noexcept {
  session_->gain = gain;
  if (session_->engine) session_->engine->gain().setGain(gain);
}

void SoundOutput::setMuted(bool muted) noexcept {
  session_->isMuted = muted;
  if (session_->engine) session_->engine->gain().setMuted(muted);
}

SoundStatistics SoundOutput::statistics() const {
  return session_->statistics();
}

std::size_t SoundOutput::channelCount() const {
  return session_->channels;
}

double SoundOutput::sampleRate() const {
  const SoundSettings& used = session_->engine ? session_->engine->settings() : session_->settings;
  return used.synth.sampleRate;
}

std::size_t SoundOutput::framesReady() const {
  if (!session_->engine) return 0;
  const double ahead = (session_->time - session_->settings.latency) * sampleRate() -
                       static_cast<double>(session_->engine->rendered());
  return ahead > 0.0 ? static_cast<std::size_t>(ahead) : 0;
}

std::size_t SoundOutput::outputDelay() const {
  return session_->engine ? session_->engine->outputDelay() : 0;
}

void SoundOutput::render(std::span<float* const> channels, std::size_t frames) noexcept {
  if (SoundEngine* const engine = session_->engine.get(); engine != nullptr)
    engine->render(channels, frames);
  else
    for (float* const channel : channels)
      std::fill_n(channel, frames, 0.0F);
}

void SoundOutput::renderInterleaved(float* samples, std::size_t frames) noexcept {
  if (SoundEngine* const engine = session_->engine.get(); engine != nullptr)
    engine->renderInterleaved(samples, frames);
  else
    std::fill_n(samples, frames * session_->channels, 0.0F);
}

}  // namespace carom
