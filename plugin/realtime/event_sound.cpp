#include "carom/event_sound.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "plugin/realtime/audio_device.h"
#include "plugin/realtime/sound_engine.h"
#include "plugin/realtime/sound_recorder.h"

namespace carom {

using namespace audio;
using namespace plugin;

namespace {

/// Bounds of places (m) and times (s): far below those beyond which a double cannot tell samples
/// apart.
constexpr double kFarthest = 1e12;
constexpr double kLongestClock = 1e9;

Status validate(const VoiceBudget& budget) {
  constexpr std::size_t kMost = 65536;
  if (!(budget.cpuShare > 0.0)) return Error{"the CPU share of the budget must be above 0"};
  if (budget.voices < 1 || budget.voices > kMost)
    return Error{"the budget's voices must be 1 to 65536"};
  if (budget.buses < 1 || budget.buses > kMost)
    return Error{"the budget's buses must be 1 to 65536"};
  constexpr std::size_t kMostRinging = 4096;
  if (budget.ringingBodies < 1 || budget.ringingBodies > kMostRinging)
    return Error{"the budget's ringing bodies must be 1 to 4096"};
  if (budget.slidingContacts > kMostRinging)
    return Error{"the budget's sliding contacts must be 0 to 4096"};
  if (budget.modes < 1 || budget.modes > kMostRinging)
    return Error{"the budget's modes must be 1 to 4096"};
  if (!(budget.longestContact > 0.0 && budget.longestContact <= 1.0))
    return Error{"the budget's longest contact must be above 0 and at most 1 s"};
  return std::monostate{};
}

Status validate(const SoundSettings& settings) {
  if (!(settings.latency >= 0.0 && settings.latency <= 10.0))
    return Error{"latency is " + std::to_string(settings.latency) + "; expected 0 to 10 s"};
  const double fullScale = settings.fullScale.value_or(1.0);
  if (!(fullScale > 0.0) || !std::isfinite(fullScale) || !std::isfinite(1.0 / fullScale)) {
    return Error{"full scale is " + std::to_string(fullScale) +
                 "; expected a positive pressure (Pa)"};
  }
  return validate(settings.budget);
}

/// Returns the settings for a device: with its rate, in real time, with a full scale and a limiter.
SoundSettings deviceSettings(SoundSettings settings, double sampleRate) {
  settings.synth.sampleRate = sampleRate;
  settings.clock = SoundClock::realTime;
  if (!settings.fullScale) settings.fullScale = kDeviceFullScale;
  if (!settings.limiter) settings.limiter.emplace();
  return settings;
}

void add(SoundStatistics& sum, const SoundStatistics& more) {
  for (const auto count :
       {&SoundStatistics::events, &SoundStatistics::immovable, &SoundStatistics::rejected,
        &SoundStatistics::skipped, &SoundStatistics::inaudible, &SoundStatistics::stolen,
        &SoundStatistics::overBudget, &SoundStatistics::noBus, &SoundStatistics::tooLong,
        &SoundStatistics::modalVoicesExhausted, &SoundStatistics::queueFaults,
        &SoundStatistics::rings, &SoundStatistics::slides, &SoundStatistics::slidesInaudible,
        &SoundStatistics::slidesLeftOut, &SoundStatistics::late, &SoundStatistics::stalls,
        &SoundStatistics::jumps})
    sum.*count += more.*count;
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

Listener SoundSettings::defaultListener() {
  Listener listener;
  listener.name = "listener";
  listener.format = ListenerFormat::spacedPair;
  listener.spacing = 0.17;
  listener.halfAngle = 0.5 * std::numbers::pi;
  listener.pattern = 0.3;
  return listener;
}

class EventSound::Impl {
 public:
  explicit Impl(const SoundSettings& settings)
      : settings_(settings), poses_(settings.listeners.size()) {}
  ~Impl() { (void)finishRecording(); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  Status setBody(BodyId id, const SoundBody& body);
  void removeBody(BodyId id);
  Status setListener(std::size_t listener, const ListenerPose& pose);
  void post(const ImpulseEvent& event);
  void updateContact(const ContactState& contact);
  void advanceTo(double seconds);
  double time() const { return time_; }
  void pause() {
    if (engine_) engine_->timeline().pause();
  }
  Status setTimeScale(double scale);
  Status play();
  Status prepareRendering(double sampleRate);
  void stop();
  Status record(const std::filesystem::path& file);
  Status finishRecording();
  void setGain(double gain) noexcept;
  void setMuted(bool muted) noexcept;
  SoundStatistics statistics() const;
  std::size_t channelCount() const { return channels_; }
  double sampleRate() const;
  std::size_t framesReady() const;
  std::size_t outputDelay() const { return engine_ ? engine_->outputDelay() : 0; }
  SoundEngine* engine() { return engine_.get(); }

  Status prepare();

 private:
  struct Pose {
    ListenerPose pose;
    bool isKnown = false;
    bool isNew = false;  // the outputs do not know it yet
  };

  Status makeEngine(const SoundSettings& settings);
  template <class Layer>
  void bring(Layer& layer) const;
  template <class Layer>
  static void follow(Layer& layer, std::size_t listener, const ListenerPose& pose);
  void moveListeners();

  SoundSettings settings_;
  std::size_t channels_ = 0;
  double time_ = 0.0;  // s
  double timeScale_ = 1.0;
  double gain_ = 1.0;
  bool muted_ = false;
  std::map<BodyId, SoundBody> bodies_;
  std::set<std::shared_ptr<const ModalModel>> models_;  // found valid
  std::vector<Pose> poses_;                             // the latest, by listener
  bool haveMoved_ = false;                              // one of poses_ is new
  SoundStatistics before_;  // sums of engines and recordings that are over
  bool hasPlayed_ = false;  // there was an engine
  std::optional<SoundRecorder> recorder_;
  std::unique_ptr<SoundEngine> engine_;
  std::optional<AudioDevice> device_;  // destroyed before the engine that it pulls from
};

Status EventSound::Impl::prepare() {
  const auto paths = makeSoundPaths(settings_.synth, settings_.listeners);
  if (!paths) return Error{"sound: " + paths.error().message};
  channels_ = (*paths)->channels.size();
  if (const auto limiter = makeLimiter(settings_, channels_); !limiter)
    return Error{"sound: " + limiter.error().message};
  if (settings_.play)
    if (Status playing = play(); !playing) return playing;
  // The recording comes last: once begun, it replaces the file, whatever comes of the rest.
  if (!settings_.record.empty()) return record(settings_.record);
  return std::monostate{};
}

Status EventSound::Impl::setBody(BodyId id, const SoundBody& body) {
  const auto refuse = [id](const std::string& why) {
    return Error{"sound body " + std::to_string(id) + ": " + why};
  };
  if (const Status valid = validate(body); !valid) return refuse(valid.error().message);
  if (body.modal != nullptr && !models_.contains(body.modal)) {
    if (const Status valid = validate(*body.modal); !valid)
      return refuse("modal model: " + valid.error().message);
    models_.insert(body.modal);
  }
  bodies_.insert_or_assign(id, body);
  if (recorder_)
    if (Status set = recorder_->synth().setBody(id, body); !set) return set;
  if (engine_) return engine_->layer().setBody(id, body);
  return std::monostate{};
}

void EventSound::Impl::removeBody(BodyId id) {
  bodies_.erase(id);
  if (recorder_) recorder_->synth().removeBody(id);
  if (engine_) engine_->layer().removeBody(id);
}

/// Moves a listener of a ContactSoundScheduler or a Synth, or places it there if it cannot have
/// moved so.
template <class Layer>
void EventSound::Impl::follow(Layer& layer, std::size_t listener, const ListenerPose& pose) {
  if (!layer.moveListener(listener, pose)) (void)layer.placeListener(listener, pose);
}

/// Hands the poses that setListener was given last to the outputs, before something is heard there.
void EventSound::Impl::moveListeners() {
  if (!std::exchange(haveMoved_, false)) return;
  for (std::size_t listener = 0; listener < poses_.size(); ++listener) {
    Pose& known = poses_[listener];
    if (!std::exchange(known.isNew, false)) continue;
    if (recorder_) follow(recorder_->synth(), listener, known.pose);
    if (engine_) follow(engine_->layer(), listener, known.pose);
  }
}

template <class Layer>
void EventSound::Impl::bring(Layer& layer) const {
  for (const auto& [id, body] : bodies_)
    (void)layer.setBody(id, body);  // has been accepted before
  for (std::size_t listener = 0; listener < poses_.size(); ++listener)
    if (poses_[listener].isKnown) (void)layer.placeListener(listener, poses_[listener].pose);
}

Status EventSound::Impl::setListener(std::size_t listener, const ListenerPose& pose) {
  if (listener >= poses_.size())
    return Error{"sound: there is no listener " + std::to_string(listener) + "; there are " +
                 std::to_string(poses_.size())};
  if (!isPose(pose) || !(pose.position.norm() <= kFarthest))
    return Error{"sound: pose of listener " + std::to_string(listener) +
                 ": expected a place within 1e12 m of the origin and a quaternion of unit length"};
  poses_[listener] = {.pose = pose, .isKnown = true, .isNew = true};
  haveMoved_ = true;
  return std::monostate{};
}

void EventSound::Impl::post(const ImpulseEvent& event) {
  moveListeners();
  if (recorder_) recorder_->synth().schedule(event);
  if (engine_) engine_->post(event);
}

void EventSound::Impl::updateContact(const ContactState& contact) {
  if (recorder_) recorder_->synth().updateContact(contact);
  if (engine_) engine_->updateContact(contact);
}

void EventSound::Impl::advanceTo(double seconds) {
  if (!(std::abs(seconds) <= kLongestClock)) return;
  moveListeners();
  if (seconds < time_) {
    for (Pose& known : poses_)
      known.pose.time = seconds;
    if (engine_) bring(engine_->layer());
  }
  if (recorder_ && SoundRecorder::isLeap(time_, seconds)) {
    recorder_->startAt(seconds);
    bring(recorder_->synth());
  }
  time_ = seconds;
  if (recorder_) recorder_->advanceTo(seconds);
  if (engine_) engine_->advanceTo(seconds);
}

Status EventSound::Impl::setTimeScale(double scale) {
  if (!(scale >= 1e-3 && scale <= 1e3))
    return Error{"sound: a time scale of " + std::to_string(scale) + "; expected 0.001 to 1000"};
  timeScale_ = scale;
  if (engine_) engine_->timeline().setScale(scale);
  return std::monostate{};
}

Status EventSound::Impl::makeEngine(const SoundSettings& settings) {
  Result<std::unique_ptr<SoundEngine>> engine = SoundEngine::create(settings);
  if (!engine) return Error{"sound: " + engine.error().message};
  stop();
  engine_ = *std::move(engine);
  hasPlayed_ = true;
  engine_->gain().setGain(gain_);
  engine_->gain().setMuted(muted_);
  engine_->timeline().setScale(timeScale_);
  bring(engine_->layer());
  return std::monostate{};
}

Status EventSound::Impl::play() {
  if (engine_ && !device_)
    return Error{"sound: samples are pulled by the host (prepareRendering); stop before play"};
  if (device_) return std::monostate{};
  Result<AudioDevice> device = AudioDevice::open(settings_.synth.sampleRate);
  if (!device) return Error{"sound: " + device.error().message};
  if (Status made = makeEngine(deviceSettings(settings_, device->sampleRate())); !made) return made;
  device_ = *std::move(device);
  const bool isStereo = carom::channelCount(settings_.listeners.front()) == 2;
  device_->start(
      [engine = engine_.get(), fold = StereoFold(channels_, isStereo)](
          float* samples, std::size_t frames) mutable { fold(*engine, samples, frames); });
  return std::monostate{};
}

Status EventSound::Impl::prepareRendering(double sampleRate) {
  SoundSettings settings = settings_;
  settings.synth.sampleRate = sampleRate;
  return makeEngine(settings);
}

void EventSound::Impl::stop() {
  device_.reset();
  if (engine_) add(before_, engine_->statistics());
  engine_.reset();
}

Status EventSound::Impl::record(const std::filesystem::path& file) {
  if (recorder_) return Error{file.string() + ": a recording is under way; finish it first"};
  Result<SoundRecorder> made = SoundRecorder::create(file, settings_);
  if (!made) return made.error();
  recorder_ = *std::move(made);
  recorder_->startAt(time_);
  bring(recorder_->synth());
  return std::monostate{};
}

Status EventSound::Impl::finishRecording() {
  if (!recorder_) return std::monostate{};
  Status finished = recorder_->finish(time());
  if (!engine_) before_ = statistics();
  recorder_.reset();
  return finished;
}

void EventSound::Impl::setGain(double gain) noexcept {
  gain_ = gain;
  if (engine_) engine_->gain().setGain(gain);
}

void EventSound::Impl::setMuted(bool muted) noexcept {
  muted_ = muted;
  if (engine_) engine_->gain().setMuted(muted);
}

/// Includes the recording only if there was never an engine, which counts the same events.
SoundStatistics EventSound::Impl::statistics() const {
  if (engine_) {
    SoundStatistics all = engine_->statistics();
    add(all, before_);
    return all;
  }
  SoundStatistics all = before_;
  if (!recorder_ || hasPlayed_) return all;
  const SynthCounters recorded = recorder_->synth().counters();
  all.events += recorded.events;
  all.immovable += recorded.immovable;
  all.rejected += recorded.rejected;
  all.inaudible += recorded.inaudible;
  all.rings += recorded.rings;
  all.slides += recorded.slides;
  all.slidesInaudible += recorded.inaudibleSlides;
  all.late += recorded.late;
  return all;
}

double EventSound::Impl::sampleRate() const {
  return engine_ ? engine_->settings().synth.sampleRate : settings_.synth.sampleRate;
}

std::size_t EventSound::Impl::framesReady() const {
  if (!engine_) return 0;
  const double ahead =
      (time() - settings_.latency) * sampleRate() - static_cast<double>(engine_->rendered());
  return ahead > 0.0 ? static_cast<std::size_t>(ahead) : 0;
}

Result<EventSound> EventSound::create(const SoundSettings& settings) {
  if (const Status valid = validate(settings); !valid)
    return Error{"sound: " + valid.error().message};
  auto impl = std::make_unique<Impl>(settings);
  if (const Status prepared = impl->prepare(); !prepared) return prepared.error();
  return EventSound(std::move(impl));
}

EventSound::EventSound(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
EventSound::EventSound(EventSound&&) noexcept = default;
EventSound& EventSound::operator=(EventSound&&) noexcept = default;
EventSound::~EventSound() = default;

Status EventSound::setBody(BodyId id, const SoundBody& body) {
  return impl_->setBody(id, body);
}
void EventSound::removeBody(BodyId id) {
  impl_->removeBody(id);
}
Status EventSound::setListener(const Vec3& position, const Quat& orientation,
                               std::size_t listener) {
  return impl_->setListener(listener, {impl_->time(), position, orientation});
}
void EventSound::post(const ImpulseEvent& event) {
  impl_->post(event);
}
void EventSound::updateContact(const ContactState& contact) {
  impl_->updateContact(contact);
}
void EventSound::advanceTo(double seconds) {
  impl_->advanceTo(seconds);
}
double EventSound::time() const {
  return impl_->time();
}
void EventSound::pause() {
  impl_->pause();
}
Status EventSound::setTimeScale(double scale) {
  return impl_->setTimeScale(scale);
}
Status EventSound::play() {
  return impl_->play();
}
Status EventSound::prepareRendering(double sampleRate) {
  return impl_->prepareRendering(sampleRate);
}
void EventSound::stop() {
  impl_->stop();
}
Status EventSound::record(const std::filesystem::path& file) {
  return impl_->record(file);
}
Status EventSound::finishRecording() {
  return impl_->finishRecording();
}
void EventSound::setGain(double gain) noexcept {
  impl_->setGain(gain);
}
void EventSound::setMuted(bool muted) noexcept {
  impl_->setMuted(muted);
}
SoundStatistics EventSound::statistics() const {
  return impl_->statistics();
}
std::size_t EventSound::channelCount() const {
  return impl_->channelCount();
}
double EventSound::sampleRate() const {
  return impl_->sampleRate();
}
std::size_t EventSound::framesReady() const {
  return impl_->framesReady();
}
std::size_t EventSound::outputDelay() const {
  return impl_->outputDelay();
}

void EventSound::render(std::span<float* const> channels, std::size_t frames) noexcept {
  if (SoundEngine* const engine = impl_->engine(); engine != nullptr)
    engine->render(channels, frames);
  else
    for (float* const channel : channels)
      std::fill_n(channel, frames, 0.0F);
}

void EventSound::renderInterleaved(float* samples, std::size_t frames) noexcept {
  if (SoundEngine* const engine = impl_->engine(); engine != nullptr)
    engine->renderInterleaved(samples, frames);
  else
    std::fill_n(samples, frames * impl_->channelCount(), 0.0F);
}

}  // namespace carom
