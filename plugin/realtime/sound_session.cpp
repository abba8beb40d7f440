#include "plugin/realtime/sound_session.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <span>
#include <string>
#include <utility>

#include "plugin/realtime/statistics_fields.h"

namespace carom {

using namespace audio;

Listener SoundSettings::defaultListener() {
  Listener listener;
  listener.name = "listener";
  listener.format = ListenerFormat::spacedPair;
  listener.spacing = 0.17;
  listener.halfAngle = 0.5 * std::numbers::pi;
  listener.pattern = 0.3;
  return listener;
}

namespace plugin {
namespace {

/// Bound of times (s): far below that beyond which a double cannot tell samples apart.
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
  const double loss = settings.synth.contactLoss;
  if (!(loss >= 0.0) || !std::isfinite(loss))
    return Error{"contact loss is " + std::to_string(loss) +
                 "; expected a loss factor, 0 or above"};
  return validate(settings.budget);
}

/// Moves a listener of a ContactSoundScheduler or a Synth, or places it there if it cannot have
/// moved so.
template <class Synthesis>
void follow(Synthesis& synthesis, std::size_t listener, const ListenerPose& pose) {
  if (!synthesis.moveListener(listener, pose)) (void)synthesis.placeListener(listener, pose);
}

}  // namespace

SoundSession::SoundSession(const SoundSettings& soundSettings)
    : settings(soundSettings), hasAutomaticListener(soundSettings.listeners.empty()) {
  if (hasAutomaticListener) settings.listeners = {SoundSettings::defaultListener()};
  poses.resize(settings.listeners.size());
}

Result<std::unique_ptr<SoundSession>> SoundSession::create(const SoundSettings& soundSettings) {
  auto session = std::make_unique<SoundSession>(soundSettings);
  if (const Status prepared = session->prepare(); !prepared) return prepared.error();
  return session;
}

Status SoundSession::prepare() {
  if (const Status valid = validate(settings); !valid)
    return Error{"sound: " + valid.error().message};
  const auto paths = makeSoundPaths(settings.synth, settings.listeners);
  if (!paths) return Error{"sound: " + paths.error().message};
  channels = (*paths)->channels.size();
  if (const auto limiter = makeLimiter(settings, channels); !limiter)
    return Error{"sound: " + limiter.error().message};
  return std::monostate{};
}

Status SoundSession::requireOpen() const {
  if (isClosed) return Error{"sound: it is closed; make another"};
  return std::monostate{};
}

Status SoundSession::close() {
  isClosed = true;
  stop();
  Status finished = finishRecording();
  warnUnseen();
  return finished;
}

Status SoundSession::setBody(BodyId id, const SoundBody& body) {
  const auto refuse = [id](const std::string& why) {
    return Error{"sound body " + std::to_string(id) + ": " + why};
  };
  if (const Status valid = validate(body); !valid) return refuse(valid.error().message);
  if (body.modal != nullptr && !validModels.contains(body.modal)) {
    if (const Status valid = validate(*body.modal); !valid)
      return refuse("modal model: " + valid.error().message);
    validModels.insert(body.modal);
  }
  bodies.insert_or_assign(id, body);
  if (recorder)
    if (Status set = recorder->synth().setBody(id, body); !set) return set;
  if (engine) return engine->scheduler().setBody(id, body);
  return std::monostate{};
}

void SoundSession::removeBody(BodyId id) {
  bodies.erase(id);
  if (recorder) recorder->synth().removeBody(id);
  if (engine) engine->scheduler().removeBody(id);
}

void SoundSession::predict(double pressure) {
  predicted = std::max(predicted, pressure);
  if (engine) engine->predict(predicted);
}

void SoundSession::setPose(std::size_t listener, const Vec3& position, const Quat& orientation) {
  poses[listener] = {.pose = {time, position, orientation}, .isKnown = true, .isNew = true};
  havePosesChanged = true;
}

void SoundSession::moveListeners() {
  if (!std::exchange(havePosesChanged, false)) return;
  for (std::size_t listener = 0; listener < poses.size(); ++listener) {
    KnownPose& known = poses[listener];
    if (!std::exchange(known.isNew, false)) continue;
    if (recorder) follow(recorder->synth(), listener, known.pose);
    if (engine) follow(engine->scheduler(), listener, known.pose);
  }
}

template <class Layer>
void SoundSession::bring(Layer& layer) const {
  for (const auto& [id, body] : bodies)
    (void)layer.setBody(id, body);  // has been accepted before
  for (std::size_t listener = 0; listener < poses.size(); ++listener)
    if (poses[listener].isKnown) (void)layer.placeListener(listener, poses[listener].pose);
}

void SoundSession::post(const ImpulseEvent& event) {
  moveListeners();
  if (recorder) recorder->synth().schedule(event);
  if (engine) engine->post(event);
}

void SoundSession::updateContact(const ContactState& contact) {
  if (recorder) recorder->synth().updateContact(contact);
  if (engine) engine->updateContact(contact);
}

void SoundSession::advanceTo(double seconds) {
  if (isClosed || !(std::abs(seconds) <= kLongestClock)) return;
  moveListeners();
  if (seconds < time) {
    for (KnownPose& known : poses)
      known.pose.time = seconds;
    if (engine) bring(engine->scheduler());
  }
  if (recorder && SoundRecorder::isLeap(time, seconds)) {
    recorder->startAt(seconds);
    bring(recorder->synth());
  }
  time = seconds;
  if (recorder) recorder->advanceTo(seconds);
  if (engine) engine->advanceTo(seconds);
}

Status SoundSession::makeEngine(const SoundSettings& engineSettings) {
  Result<std::unique_ptr<SoundEngine>> made = SoundEngine::create(engineSettings);
  if (!made) return Error{"sound: " + made.error().message};
  stop();
  engine = *std::move(made);
  hasPlayed = true;
  engine->gain().setGain(gain);
  engine->gain().setMuted(isMuted);
  engine->timeline().setScale(timeScale);
  engine->predict(predicted);
  bring(engine->scheduler());
  return std::monostate{};
}

void SoundSession::stop() {
  device.reset();
  if (engine) addEarlier(earlier, engine->statistics());
  engine.reset();
}

Status SoundSession::record(const std::filesystem::path& file) {
  if (recorder) return Error{file.string() + ": a recording is under way; finish it first"};
  Result<SoundRecorder> made = SoundRecorder::create(file, settings);
  if (!made) return made.error();
  recorder = *std::move(made);
  recorder->startAt(time);
  bring(recorder->synth());
  return std::monostate{};
}

Status SoundSession::finishRecording() {
  if (!recorder) return std::monostate{};
  Status finished = recorder->finish(time);
  addEarlier(earlier, recordingStatistics());
  recorder.reset();
  return finished;
}

SoundStatistics SoundSession::recordingStatistics() const {
  SoundStatistics all;
  if (!hasPlayed) static_cast<SynthCounters&>(all) = recorder->synth().counters();
  recorder->addLevels(all);
  return all;
}

SoundStatistics SoundSession::statistics() const {
  SoundStatistics all = engine ? engine->statistics() : SoundStatistics();
  addEarlier(all, earlier);
  if (recorder) addEarlier(all, recordingStatistics());
  hasShownWarning = hasShownWarning || !all.warning.empty();
  return all;
}

void SoundSession::warnUnseen() {
  if (std::exchange(hasShownWarning, true)) return;
  const std::string warning = SoundSession::statistics().warning;
  if (!warning.empty()) std::fprintf(stderr, "carom: %s\n", warning.c_str());
}

}  // namespace plugin
}  // namespace carom
