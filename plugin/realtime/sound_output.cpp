#include "carom/sound_output.h"

#include <algorithm>
#include <string>
#include <utility>

#include "plugin/realtime/sound_session.h"

namespace carom {

using namespace plugin;

namespace {

SoundEngine* engineOf(const std::shared_ptr<SoundSession>& session) {
  return session != nullptr ? session->engine.get() : nullptr;
}

}  // namespace

SoundOutput::SoundOutput(std::shared_ptr<SoundSession> session) : session_(std::move(session)) {}
SoundOutput::SoundOutput(SoundOutput&&) noexcept = default;
SoundOutput& SoundOutput::operator=(SoundOutput&& other) noexcept {
  const std::shared_ptr<SoundSession> replaced = std::exchange(session_, std::move(other.session_));
  if (replaced != nullptr && replaced != session_) (void)replaced->told(replaced->close());
  return *this;
}
SoundOutput::~SoundOutput() {
  if (session_ != nullptr) (void)close();
}

Status SoundOutput::close() {
  const std::shared_ptr<SoundSession> session = session_;  // a callback may end this object
  if (session == nullptr) return movedFrom();
  return session->told(session->close());
}

Status SoundOutput::setListener(const Vec3& position, const Quat& orientation,
                                std::size_t listener) {
  return onOpen(session_, [&](SoundSession& session) -> Status {
    const auto& poses = session.poses;
    const ListenerPose pose = {session.time, position, orientation};
    if (listener >= poses.size())
      return Error{"sound: there is no listener " + std::to_string(listener) + "; there are " +
                   std::to_string(poses.size())};
    if (!isPose(pose) || !(position.norm() <= SoundSession::kFarthest))
      return Error{
          "sound: pose of listener " + std::to_string(listener) +
          ": expected a place within 1e12 m of the origin and a quaternion of unit length"};
    session.hasAutomaticListener = false;
    session.setPose(listener, position, orientation);
    return std::monostate{};
  });
}

double SoundOutput::time() const {
  return session_ ? session_->time : 0.0;
}

void SoundOutput::pause() {
  if (SoundEngine* const engine = engineOf(session_)) engine->timeline().pause();
}

Status SoundOutput::setTimeScale(double scale) {
  return onOpen(session_, [&](SoundSession& session) -> Status {
    if (!(scale >= 1e-3 && scale <= 1e3))
      return Error{"sound: a time scale of " + std::to_string(scale) + "; expected 0.001 to 1000"};
    session.timeScale = scale;
    if (session.engine) session.engine->timeline().setScale(scale);
    return std::monostate{};
  });
}

Status SoundOutput::play() {
  return onOpen(session_, [](SoundSession& session) { return session.play(); });
}

bool SoundOutput::isPlaying() const {
  return session_ && session_->device;
}

Status SoundOutput::prepareRendering(double sampleRate) {
  return onOpen(session_, [&](SoundSession& session) {
    SoundSettings settings = session.settings;
    settings.synth.sampleRate = sampleRate;
    Status made = session.makeEngine(settings);
    if (made) session.pulled.show(*session.engine);
    return made;
  });
}

void SoundOutput::stop() {
  if (session_) session_->stop();
}

Status SoundOutput::record(const std::filesystem::path& file) {
  return onOpen(session_, [&](SoundSession& session) { return session.record(file); });
}

Status SoundOutput::finishRecording() {
  if (!session_) return movedFrom();
  return session_->told(session_->finishRecording());
}

Status SoundOutput::capture() {
  return onOpen(session_, [](SoundSession& session) { return session.capture(); });
}

std::size_t SoundOutput::capturedFrames() const {
  return session_ && session_->captured ? session_->captured->ready() : 0;
}

std::size_t SoundOutput::takeCaptured(std::span<float> samples) {
  return session_ && session_->captured ? session_->captured->take(samples) : 0;
}

Status SoundOutput::recordRun(const std::filesystem::path& file) {
  return onOpen(session_, [&](SoundSession& session) { return session.recordRun(file); });
}

Status SoundOutput::finishRun() {
  if (!session_) return movedFrom();
  return session_->told(session_->finishRun());
}

Status SoundOutput::keepRun(double seconds) {
  return onOpen(session_, [&](SoundSession& session) { return session.keepRun(seconds); });
}

Status SoundOutput::saveRun(const std::filesystem::path& file) {
  return onOpen(session_, [&](SoundSession& session) { return session.saveRun(file); });
}

void SoundOutput::setGain(double gain) noexcept {
  if (!session_) return;
  session_->gain = gain;
  if (session_->engine) session_->engine->gain().setGain(gain);
}

void SoundOutput::setMuted(bool muted) noexcept {
  if (!session_) return;
  session_->isMuted = muted;
  if (session_->engine) session_->engine->gain().setMuted(muted);
}

SoundStatistics SoundOutput::statistics() const {
  return session_ ? session_->statistics() : SoundStatistics();
}

std::string SoundOutput::report() const {
  return session_ ? session_->report() : movedFrom().message + "\n";
}

std::size_t SoundOutput::channelCount() const {
  return session_ ? session_->channels : 0;
}

double SoundOutput::sampleRate() const {
  if (!session_) return 0.0;
  const SoundSettings& used = session_->engine ? session_->engine->settings() : session_->settings;
  return used.synth.sampleRate;
}

std::size_t SoundOutput::framesReady() const {
  const SoundEngine* const engine = engineOf(session_);
  if (engine == nullptr) return 0;
  const double ahead = (session_->time - session_->settings.latency) * sampleRate() +
                       static_cast<double>(engine->leapt() - engine->rendered());
  return ahead > 0.0 ? static_cast<std::size_t>(ahead) : 0;
}

std::size_t SoundOutput::outputDelay() const {
  const SoundEngine* const engine = engineOf(session_);
  return engine != nullptr ? engine->outputDelay() : 0;
}

void SoundOutput::render(std::span<float* const> channels, std::size_t frames) noexcept {
  const auto render = [&](SoundEngine* engine) {
    if (engine != nullptr) return engine->render(channels, frames);
    for (float* const channel : channels)
      std::fill_n(channel, frames, 0.0F);
  };
  if (session_ == nullptr) return render(nullptr);
  session_->pulled.pull(render);
}

void SoundOutput::renderInterleaved(float* samples, std::size_t frames) noexcept {
  const auto render = [&](SoundEngine* engine) {
    if (engine != nullptr) return engine->renderInterleaved(samples, frames);
    std::fill_n(samples, frames * channelCount(), 0.0F);
  };
  if (session_ == nullptr) return render(nullptr);
  session_->pulled.pull(render);
}

}  // namespace carom
