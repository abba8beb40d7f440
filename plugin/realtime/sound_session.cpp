#include "plugin/realtime/sound_session.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <span>
#include <string>
#include <utility>

#if CAROM_THREADS && __has_include(<pthread.h>)
#include <pthread.h>
#endif

#include "audio/model/immortal.h"
#include "audio/model/mutex.h"
#include "audio/scheduling/ring_tracks.h"
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

SynthSettings SoundSettings::defaultSynth() {
  SynthSettings synth;
  synth.lasting = LastingDetail::heard;
  return synth;
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

/// Moves a listener of a ContactSoundScheduler, or places it there if it has jumped, or cannot have
/// moved so.
struct Follower {
  std::size_t listener;
  const ListenerPose& pose;
  bool hasJumped;

  void operator()(ContactSoundScheduler& scheduler) const {
    if (hasJumped || !scheduler.moveListener(listener, pose))
      (void)scheduler.placeListener(listener, pose);
  }
};

/// Takes note that the outputs get to know a pose. Returns true if the listener has not come there
/// by moving, but has jumped.
bool takeOver(SoundSession::KnownPose& known) {
  const double passed = known.pose.time - known.before.time;
  const Vec3 before = std::exchange(known.velocity, Vec3::Zero());
  const bool isFirst = !std::exchange(known.isTold, true);
  const Vec3 way = known.pose.position - std::exchange(known.before, known.pose).position;
  if (isFirst || !(passed > 0.0)) return false;
  known.velocity = way / passed;
  return (known.velocity - before).norm() > RingTracks::kJump;
}

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

/// s: a day.
constexpr double kLongestKept = 86400.0;

/// Most sentences that one sound tells: a host that refuses nothing else need not read more.
constexpr std::size_t kMostMessages = 100;

/// A mark of the present thread: its address differs from those of others.
const void* presentThread() {
  static thread_local char mark = 0;
  return &mark;
}

/// The recordings under way, to be finished when the process exits without destroying their sounds.
class OpenRecordings {
 public:
  static OpenRecordings& instance() {
    static OpenRecordings& all = immortal([] { return OpenRecordings(); });
    return all;
  }
  void add(SoundSession& session) {
    const MutexLock lock(mutex_);
    if (!std::exchange(isAwaitingExit_, true)) {
      std::atexit([] { OpenRecordings::instance().finish(); });
      leaveForksAlone();
    }
    threads_[&session] = presentThread();
  }
  void remove(SoundSession& session) {
    const MutexLock lock(mutex_);
    threads_.erase(&session);
  }

 private:
  /// A fork has the recordings of its parent, which goes on with them: it must neither write into
  /// their files nor give them names, whether it steps the world, or ends by exit.
  static void leaveForksAlone() {
#if CAROM_THREADS && __has_include(<pthread.h>)
    pthread_atfork([] { instance().mutex_.lock(); }, [] { instance().mutex_.unlock(); },
                   [] {
                     instance().abandon();
                     instance().mutex_.unlock();
                   });
#endif
  }
  void abandon() {
    for (const auto& [session, thread] : threads_)
      session->abandonRecording();
    threads_.clear();
  }
  /// Finishes those of this thread: others may still be at work.
  void finish() {
    for (;;) {
      SoundSession* const session = take();
      if (session == nullptr) return;
      for (const Status& finished : {session->finishRecording(), session->finishRun()})
        if (!finished) std::fprintf(stderr, "carom: %s\n", finished.error().message.c_str());
    }
  }
  SoundSession* take() {
    const MutexLock lock(mutex_);
    const auto found = std::ranges::find(threads_, presentThread(),
                                         [](const auto& entry) { return entry.second; });
    if (found == threads_.end()) return nullptr;
    SoundSession* const session = found->first;
    threads_.erase(found);
    return session;
  }

  Mutex mutex_;
  std::map<SoundSession*, const void*> threads_;
  bool isAwaitingExit_ = false;
};

}  // namespace

SoundSession::SoundSession(const SoundSettings& soundSettings)
    : settings(soundSettings), hasAutomaticListener(soundSettings.listeners.empty()) {
  if (hasAutomaticListener) settings.listeners = {SoundSettings::defaultListener()};
  poses.resize(settings.listeners.size());
}

SoundSession::~SoundSession() {
  (void)told(finishRecording());
  (void)told(finishRun());
}

Status SoundSession::told(Status outcome) {
  if (!outcome) say(outcome.error().message);
  return outcome;
}

void SoundSession::say(const std::string& sentence) {
  if (messages.size() >= kMostMessages || !messages.insert(sentence).second) return;
  if (settings.onMessage)
    settings.onMessage(sentence);
  else
    std::fprintf(stderr, "carom: %s\n", sentence.c_str());
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
  if (capturer) release(capturer);
  captured = nullptr;
  Status finished = finishRecording();
  Status run = finishRun();
  runKeeper.reset();
  warnUnseen();
  return finished ? run : finished;
}

Status SoundSession::setBody(BodyId id, const SoundBody& body) {
  const auto refuse = [id](const std::string& why) {
    return Error{"sound body " + std::to_string(id) + ": " + why};
  };
  if (const Status valid = validate(body); !valid) return refuse(valid.error().message);
  const auto known = validModels.find(body.modal.get());
  const bool isKnown = known != validModels.end() && known->second.lock() == body.modal;
  if (body.modal != nullptr && !isKnown) {
    if (const Status valid = validate(*body.modal); !valid)
      return refuse("modal model: " + valid.error().message);
    std::erase_if(validModels, [](const auto& model) { return model.second.expired(); });
    validModels.insert_or_assign(body.modal.get(), body.modal);
  }
  const auto before = bodies.find(id);
  const bool hasOtherModes =
      body.modal != nullptr && before != bodies.end() && before->second.modal != body.modal;
  bodies.insert_or_assign(id, body);
  if (body.modal != nullptr)
    bodiesWithModes.insert(id);
  else
    bodiesWithModes.erase(id);
  forEachRun([&](RunRecorder& run) { run.setBody(id, body); });
  Status set = std::monostate{};
  forEachRecorder([&](SoundRecorder& each) {
    each.schedulePosted();
    if (Status taken = each.scheduler().setBody(id, body); !taken) set = std::move(taken);
  });
  if (!set) return set;
  if (bounds) (void)bounds->scheduler().setBody(id, body);
  if (engine) set = engine->setBody(id, body);
  if (hasOtherModes) tellTouches(id);
  return set;
}

/// Tells the outputs what touches a body whose modes are others now: it has been told once.
void SoundSession::tellTouches(BodyId id) {
  for (const ContactState& contact : touched.at(time)) {
    if (contact.body != id && contact.other != id) continue;
    forEachRun([&](RunRecorder& run) { run.updateContact(contact); });
    forEachRecorder([&](SoundRecorder& each) { each.updateContact(contact, false); });
    if (engine) engine->updateContact(contact);
  }
}

void SoundSession::removeBody(BodyId id) {
  bodies.erase(id);
  bodiesWithModes.erase(id);
  const std::vector<ContactState> ends = touched.remove(id, time);
  forEachRun([&](RunRecorder& run) {
    for (const ContactState& end : ends)
      run.updateContact(end);
    run.removeBody(id);
  });
  forEachRecorder([id](SoundRecorder& each) {
    each.schedulePosted();
    each.scheduler().removeBody(id);
  });
  if (engine) engine->removeBody(id);
  if (bounds) bounds->scheduler().removeBody(id);
}

void SoundSession::predict(double pressure) {
  predicted = std::max(predicted, pressure);
  if (engine) engine->predict(predicted);
}

void SoundSession::setPose(std::size_t listener, const Vec3& position, const Quat& orientation) {
  KnownPose& known = poses[listener];
  known.pose = {time, position, orientation};
  known.isKnown = known.isNew = true;
  havePosesChanged = true;
}

void SoundSession::moveListeners() {
  if (!std::exchange(havePosesChanged, false)) return;
  for (std::size_t listener = 0; listener < poses.size(); ++listener) {
    KnownPose& known = poses[listener];
    if (!std::exchange(known.isNew, false)) continue;
    const Follower follow{listener, known.pose, takeOver(known)};
    forEachRun([&](RunRecorder& run) { run.moveListener(listener, known.pose); });
    forEachRecorder([&](SoundRecorder& each) { follow(each.scheduler()); });
    if (engine) follow(engine->scheduler());
    if (bounds) follow(bounds->scheduler());
  }
}

template <class Layer>
void SoundSession::bring(Layer& layer) const {
  for (const auto& [id, body] : bodies)
    (void)layer.setBody(id, body);  // has been accepted before
  for (std::size_t listener = 0; listener < poses.size(); ++listener)
    if (poses[listener].isKnown) (void)layer.placeListener(listener, poses[listener].pose);
}

void SoundSession::listen() {
  if (bounds) return;
  SynthSettings all = settings.synth;  // what is masked or faint has a bound, too
  all.lasting = LastingDetail::exact;
  all.audibleThreshold = 0.0;
  bounds = std::make_unique<PressureBounds>(*makeSoundPaths(all, settings.listeners));
  bring(bounds->scheduler());
}

void SoundSession::post(const ImpulseEvent& event) {
  moveListeners();
  forEachRun([&](RunRecorder& run) { run.post(event); });
  if (recorder) recorder->post(event, engine == nullptr);
  if (capturer) capturer->post(event, engine == nullptr && recorder == nullptr);
  if (engine) engine->post(event);
  if (recorder || capturer || engine) return;
  ++earlier.posted;
  ++earlier.skipped;
}

void SoundSession::updateContact(const ContactState& contact) {
  moveListeners();
  const auto rings = [this](BodyId id) { return bodiesWithModes.contains(id); };
  if (!bodiesWithModes.empty() && (rings(contact.body) || rings(contact.other)) &&
      bodies.contains(contact.body) && bodies.contains(contact.other))
    touched.note(contact);
  forEachRun([&](RunRecorder& run) { run.updateContact(contact); });
  if (recorder) recorder->updateContact(contact, engine == nullptr);
  if (capturer) capturer->updateContact(contact, engine == nullptr && recorder == nullptr);
  if (engine) engine->updateContact(contact);
}

Status SoundSession::moveBody(BodyId id, const ListenerPose& pose) {
  if (!bodies.contains(id)) return Error{"sound: there is no body " + std::to_string(id)};
  if (!isPose(pose) || !(std::abs(pose.time) <= kLongestClock) ||
      !(pose.position.norm() <= kFarthest))
    return Error{"sound: pose of body " + std::to_string(id) +
                 ": expected a place within 1e12 m of the origin and a quaternion of unit length"};
  forEachRun([&](RunRecorder& run) { run.moveBody(id, pose); });
  forEachRecorder([&](SoundRecorder& each) { (void)each.scheduler().moveBody(id, pose); });
  if (engine) engine->moveBody(id, pose);
  return std::monostate{};
}

const std::vector<BodyId>& SoundSession::ringing() {
  ringingBodies.clear();
  forEachRecorder([this](SoundRecorder& each) { each.scheduler().addRinging(ringingBodies); });
  if (engine) engine->scheduler().addRinging(ringingBodies);
  std::ranges::sort(ringingBodies);
  ringingBodies.erase(std::unique(ringingBodies.begin(), ringingBodies.end()), ringingBodies.end());
  return ringingBodies;
}

void SoundSession::advanceTo(double seconds, double settled) {
  if (isClosed || !(std::abs(seconds) <= kLongestClock)) return;
  moveListeners();
  if (seconds < time) {
    for (KnownPose& known : poses)
      known.pose.time = known.before.time = seconds;
    if (engine) {
      engine->scheduler().leap(seconds - time);
      bring(engine->scheduler());
    }
    if (bounds) bring(bounds->scheduler());
  }
  if (SoundRecorder::isLeap(time, seconds)) {
    if (!engine && (recorder || capturer)) ++earlier.jumps;
    forEachRecorder([&](SoundRecorder& each) {
      each.leapTo(seconds);
      bring(each.scheduler());
    });
    forEachRun([seconds](RunRecorder& run) { run.leapTo(seconds); });
  }
  time = seconds;
  forEachRun([=](RunRecorder& run) { run.advanceTo(seconds, settled); });
  forEachRecorder([seconds](SoundRecorder& each) { each.advanceTo(seconds); });
  tellFailure();
  if (engine) engine->advanceTo(seconds);
}

Status SoundSession::makeEngine(const SoundSettings& engineSettings) {
  SoundSettings limited = engineSettings;
  limitAutomatic(limited);
  Result<std::unique_ptr<SoundEngine>> made = SoundEngine::create(limited);
  if (!made) return Error{"sound: " + made.error().message};
  stop();
  engine = *std::move(made);
  hasSounded = true;
  engine->gain().setGain(gain);
  engine->gain().setMuted(isMuted);
  engine->timeline().setScale(timeScale);
  engine->predict(predicted);
  bring(engine->scheduler());
  for (const ContactState& contact : touched.at(time))
    engine->updateContact(contact);
  return std::monostate{};
}

Status SoundSession::play() {
  if (device) return std::monostate{};
  if (engine)
    return Error{"sound: samples are pulled by the host (prepareRendering); stop before play"};
  // A head of the host's own is of one sample rate.
  const bool hasOwnHead = std::ranges::any_of(
      settings.listeners, [](const Listener& listener) { return listener.hrtf != nullptr; });
  Result<AudioDevice> opened = AudioDevice::open(settings.synth.sampleRate, hasOwnHead);
  if (!opened) return Error{"sound: " + opened.error().message};
  const SoundSettings wanted = deviceSettings(settings, opened->sampleRate());
  if (Status made = makeEngine(wanted); !made) return made;
  device = *std::move(opened);
  const bool isStereo = carom::channelCount(wanted.listeners.front()) == 2;
  device->start(
      [source = engine.get(), fold = StereoFold(channels, isStereo)](
          float* samples, std::size_t frames) mutable { fold(*source, samples, frames); });
  return std::monostate{};
}

Status SoundSession::begin() {
  if (settings.play) (void)told(play());
  return settings.record.empty() ? std::monostate{} : record(settings.record);
}

void SoundSession::stop() {
  device.reset();
  if (!engine) return;
  pulled.hide();
  SoundStatistics ended = engine->statistics();
  loseWaiting(ended);
  addEarlier(earlier, ended);
  engine.reset();
}

Status SoundSession::record(const std::filesystem::path& file) {
  if (recorder) return Error{file.string() + ": a recording is under way; finish it first"};
  Result<std::unique_ptr<SamplesInFile>> samples = SamplesInFile::create(file, settings, channels);
  if (!samples) return samples.error();
  for (const std::filesystem::path& left : (*samples)->recovered())
    say("what a program that ended early had recorded is in '" + left.string() + "'");
  recorder = std::make_unique<SoundRecorder>(*makeSoundPaths(settings.synth, settings.listeners),
                                             *std::move(samples), settings);
  hasToldFailure = false;
  hasSounded = true;
  OpenRecordings::instance().add(*this);
  recorder->startAt(time);
  bring(recorder->scheduler());
  for (const ContactState& contact : touched.at(time))
    recorder->updateContact(contact, false);
  return std::monostate{};
}

void SoundSession::abandonRecording() {
  (void)recorder.release();  // what destroys it would complete the file
  (void)runWriter.release();
}

Status SoundSession::finishRecording() {
  if (!recorder) return std::monostate{};
  if (!runWriter) OpenRecordings::instance().remove(*this);
  Status finished = recorder->finish();
  release(recorder);
  return finished;
}

void SoundSession::release(std::unique_ptr<SoundRecorder>& over) {
  SoundStatistics ended = over->statistics();
  loseWaiting(ended);
  addEarlier(earlier, ended);
  over.reset();
}

Status SoundSession::capture() {
  if (capturer) release(capturer);
  auto samples = std::make_unique<SamplesInMemory>(channels);
  SamplesInMemory* const memory = samples.get();
  capturer = std::make_unique<SoundRecorder>(*makeSoundPaths(settings.synth, settings.listeners),
                                             std::move(samples), settings);
  captured = memory;  // what lacks memory throws before
  hasSounded = true;
  capturer->startAt(time, settings.latency);
  bring(capturer->scheduler());
  for (const ContactState& contact : touched.at(time))
    capturer->updateContact(contact, false);
  return std::monostate{};
}

void SoundSession::bringTo(RunRecorder& run) {
  run.startAt(time);
  for (const auto& [id, body] : bodies)
    run.setBody(id, body);
  for (std::size_t listener = 0; listener < poses.size(); ++listener)
    if (poses[listener].isKnown) run.moveListener(listener, poses[listener].pose);
  describeBodies(run);
  for (const ContactState& contact : touched.at(time))
    run.updateContact(contact);
}

Status SoundSession::recordRun(const std::filesystem::path& file) {
  if (runWriter) return Error{file.string() + ": a run is being written; finish it first"};
  Result<std::unique_ptr<RunRecorder>> run = RunRecorder::toFile(file, settings);
  if (!run) return run.error();
  runWriter = *std::move(run);
  hasRecordedRun = true;
  OpenRecordings::instance().add(*this);
  bringTo(*runWriter);
  return std::monostate{};
}

Status SoundSession::finishRun() {
  if (!runWriter) return std::monostate{};
  if (!recorder) OpenRecordings::instance().remove(*this);
  Status finished = runWriter->finish();
  runWriter.reset();
  return finished;
}

Status SoundSession::keepRun(double seconds) {
  if (!(seconds >= 0.0 && seconds <= kLongestKept))
    return Error{"sound: a run of " + std::to_string(seconds) +
                 " s cannot be kept in memory; expected 0 to 86400 s"};
  runKeeper = seconds > 0.0 ? RunRecorder::inMemory(seconds, settings) : nullptr;
  if (runKeeper) {
    hasRecordedRun = true;
    bringTo(*runKeeper);
  }
  return std::monostate{};
}

Status SoundSession::saveRun(const std::filesystem::path& file) {
  if (!runKeeper) return Error{file.string() + ": no run is kept in memory; call keepRun before"};
  return runKeeper->save(file);
}

void SoundSession::tellFailure() {
  forEachRun([this](const RunRecorder& run) {
    if (run.failure()) say(run.failure()->message);
    if (run.lack()) say(run.lack()->message);
  });
  if (!recorder || !recorder->failure() || std::exchange(hasToldFailure, true)) return;
  say(recorder->failure()->message);
}

Vec3 SoundSession::listener() const {
  return poses.front().isKnown ? poses.front().pose.position : settings.listeners.front().position;
}

SoundFacts SoundSession::facts() const {
  return {.listener = listener(),
          .isListenerAutomatic = hasAutomaticListener,
          .isHeard = hasSounded,
          .isRun = hasRecordedRun,
          .isClosed = isClosed,
          .statistics = statistics()};
}

std::string SoundSession::report() const {
  SoundFacts facts = this->facts();
  facts.isHosted = true;
  for (const auto& [id, body] : bodies) {
    const bool isMovable = std::isfinite(body.mass);
    ++(isMovable ? facts.movable : facts.immovable);
    if (!isMovable) continue;
    if (body.modal) facts.compareMasses(body.mass, body.modal->mass);
    if (!body.material.name.empty()) ++facts.given[body.material.name];
  }
  return wordsOf(facts);
}

SoundStatistics SoundSession::statistics() const {
  SoundStatistics all = engine ? engine->statistics() : SoundStatistics();
  addEarlier(all, earlier);
  forEachRecorder([&all](const SoundRecorder& each) { addEarlier(all, each.statistics()); });
  hasShownWarning = hasShownWarning || !all.warning.empty();
  return all;
}

void SoundSession::warnUnseen() {
  if (std::exchange(hasShownWarning, true)) return;
  const std::string warning = SoundSession::statistics().warning;
  if (!warning.empty()) say(warning);
}

}  // namespace plugin
}  // namespace carom
