#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <unordered_set>
#include <vector>

#include "audio/run/open_contacts.h"
#include "carom/audio/contact_state.h"
#include "carom/audio/impulse_event.h"
#include "carom/audio/listener.h"
#include "carom/audio/modal_model.h"
#include "carom/audio/result.h"
#include "carom/audio/sound_body.h"
#include "carom/sound_settings.h"
#include "plugin/realtime/audio_device.h"
#include "plugin/realtime/pressure_bounds.h"
#include "plugin/realtime/pulled_engine.h"
#include "plugin/realtime/recorded_samples.h"
#include "plugin/realtime/run_recorder.h"
#include "plugin/realtime/sound_engine.h"
#include "plugin/realtime/sound_recorder.h"
#include "plugin/realtime/sound_report.h"

namespace carom::plugin {

/// The state behind a SoundOutput, whose functions work on it: bodies, listeners, the engine for
/// samples that are pulled, and the recording. The vocabulary of EventSound feeds both. A session
/// of a Bullet world (WorldSession) adds where events come from. [simulation thread]
struct SoundSession : std::enable_shared_from_this<SoundSession> {
  /// The pose that setListener was given last.
  struct KnownPose {
    ListenerPose pose;
    bool isKnown = false;
    bool isNew = false;            ///< the outputs do not know it yet
    bool isTold = false;           ///< they know of one before
    ListenerPose before;           ///< that one
    Vec3 velocity = Vec3::Zero();  ///< m/s, as they do
  };

  /// m, bound of places: far below that beyond which a double cannot tell samples apart.
  static constexpr double kFarthest = 1e12;

  explicit SoundSession(const SoundSettings& soundSettings);
  virtual ~SoundSession();
  SoundSession(const SoundSession&) = delete;
  SoundSession& operator=(const SoundSession&) = delete;

  /// Checks the settings and counts the channels.
  Status prepare();
  /// Tells the sentence of an outcome that is an error, unless it has been told; see
  /// SoundSettings::onMessage. Returns the outcome.
  Status told(Status outcome);
  /// Tells a sentence, once.
  void say(const std::string& sentence);
  /// Returns an error if the session is closed.
  Status requireOpen() const;
  virtual Status close();

  Status setBody(BodyId id, const SoundBody& body);
  void removeBody(BodyId id);
  void tellTouches(BodyId id);
  /// Begins to bound the pressure of events, for a host that is told of them.
  void listen();
  void post(const ImpulseEvent& event);
  void updateContact(const ContactState& contact);
  /// Says where a body is at a time: as Synth::moveBody, for what rings.
  Status moveBody(BodyId id, const ListenerPose& pose);
  /// Returns the bodies that ring, each once.
  const std::vector<BodyId>& ringing();
  void advanceTo(double seconds) { advanceTo(seconds, seconds); }
  /// The same, where events from `settled` (s) on may still be posted.
  void advanceTo(double seconds, double settled);
  /// Predicts the peak (Pa) of the first blow, for an automatic level.
  void predict(double pressure);
  /// Sets the pose of a listener that there is, at the present time.
  void setPose(std::size_t listener, const Vec3& position, const Quat& orientation);

  /// Begins the outputs that the settings ask for. A device that is refused is told of, and no
  /// more. The recording comes last: once begun, it replaces the file, whatever comes of the rest.
  Status begin();
  Status play();
  Status makeEngine(const SoundSettings& engineSettings);
  void stop();
  Status record(const std::filesystem::path& file);
  Status finishRecording();
  Status capture();
  /// Begins to write the run, from its present state on.
  Status recordRun(const std::filesystem::path& file);
  Status finishRun();
  /// Begins to keep the last seconds of the run in memory; 0 ends it.
  Status keepRun(double seconds);
  Status saveRun(const std::filesystem::path& file);
  /// Forgets the recording, in a fork: its file is the parent's.
  void abandonRecording();
  virtual SoundStatistics statistics() const;
  /// As SoundOutput::report.
  virtual std::string report() const;
  /// Returns what a report says of any sound, without its bodies.
  SoundFacts facts() const;
  /// Place of the first listener, m.
  Vec3 listener() const;
  /// Says on stderr what a warning says, if nobody has asked for the statistics since it holds.
  void warnUnseen();

  template <class Action>
  void forEachRecorder(const Action& action) const {
    if (recorder) action(*recorder);
    if (capturer) action(*capturer);
  }
  template <class Action>
  void forEachRun(const Action& action) const {
    if (runWriter) action(*runWriter);
    if (runKeeper) action(*runKeeper);
  }
  bool keepsRuns() const { return runWriter != nullptr || runKeeper != nullptr; }
  /// Tells a run of all that there is.
  void bringTo(RunRecorder& run);
  /// Tells a run how bodies are called, drawn and where they are, as far as that is known.
  virtual void describeBodies(RunRecorder& run) { (void)run; }
  /// Adds what became of the events of a recorder that is over, and lets it go.
  void release(std::unique_ptr<SoundRecorder>& over);
  /// Tells of a recording that has just failed.
  void tellFailure();
  /// Hands the poses that setListener was given last to the outputs, before something is heard
  /// there.
  void moveListeners();
  /// Brings all bodies and poses to a ContactSoundScheduler or a Synth that does not know them.
  template <class Layer>
  void bring(Layer& layer) const;

  SoundSettings settings;
  std::size_t channels = 0;
  double time = 0.0;  ///< s
  double timeScale = 1.0;
  double gain = 1.0;
  bool isMuted = false;
  bool isClosed = false;
  std::map<BodyId, SoundBody> bodies;
  std::unordered_set<BodyId> bodiesWithModes;
  audio::OpenContacts touched;  ///< contacts under way, of bodies with modes
  std::map<const ModalModel*, std::weak_ptr<const ModalModel>> validModels;
  std::vector<KnownPose> poses;  ///< by listener
  bool havePosesChanged = false;
  std::vector<BodyId> ringingBodies;     ///< scratch
  bool hasAutomaticListener = false;     ///< none was set, and setListener was not called yet
  double predicted = 0.0;                ///< Pa, peak of the first blow; 0 if nothing is predicted
  mutable bool hasShownWarning = false;  ///< to the host, or on stderr
  SoundStatistics earlier;               ///< sums of engines and recordings that are over
  bool hasSounded = false;               ///< there was an engine, or a recording
  bool hasRecordedRun = false;           ///< a run was written, or kept in memory
  std::set<std::string> messages;        ///< those that have been told
  std::unique_ptr<PressureBounds> bounds;
  std::unique_ptr<RunRecorder> runWriter;   ///< to a file
  std::unique_ptr<RunRecorder> runKeeper;   ///< in memory
  std::unique_ptr<SoundRecorder> recorder;  ///< to a file
  std::unique_ptr<SoundRecorder> capturer;  ///< to memory
  SamplesInMemory* captured = nullptr;      ///< those of `capturer`
  bool hasToldFailure = false;              ///< of the recording
  std::unique_ptr<SoundEngine> engine;
  PulledEngine pulled;                ///< the same, where the host's audio thread renders
  std::optional<AudioDevice> device;  ///< destroyed before the engine that it pulls from
};

/// The refusal of a SoundOutput without a session.
inline Error movedFrom() {
  return Error{"sound: this object was moved from; use the one that it was moved to"};
}

/// Runs `action`, which returns a Status, unless the sound is moved from or closed, and tells what
/// is refused.
template <class Session, class Action>
Status onOpen(const std::shared_ptr<Session>& session, const Action& action) {
  if (session == nullptr) return movedFrom();
  Status open = session->requireOpen();
  return session->told(open ? action(*session) : open);
}

}  // namespace carom::plugin
