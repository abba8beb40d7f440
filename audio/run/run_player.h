#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "audio/propagation/deforming_voice.h"
#include "audio/run/playable_run.h"
#include "carom/audio/listener.h"
#include "carom/audio/result.h"
#include "carom/audio/synth.h"

namespace carom::audio {

/// Plays a run that is in memory, from any time of it on, at any speed, with any part left out, for
/// an ear that moves as it plays or for a listener of the run.
///
///     seek      begins a new sound, with the choices made before
///     moveEar   at any time
///     render    the next samples, in Pa
///
/// From time 0 on, for the run's own listeners, the samples are those of SceneSound. At another
/// speed, what happens comes later or earlier and lasts longer or shorter, but nothing changes its
/// pitch, except that of what deforms. [one thread]
class RunPlayer {
 public:
  /// Speeds at which a run can be played.
  static constexpr double kSlowest = 1e-3;
  static constexpr double kFastest = 10.0;
  /// s: the mechanics are handed over so long ahead of the sound.
  static constexpr double kLookahead = 0.1;

  /// Errors: settings of the run that the synthesis refuses, such as the rate (Hz).
  static Result<RunPlayer> create(PlayableRun run, double sampleRate);

  const PlayableRun& run() const { return run_; }

  /// Has the run go on: it has no end until its duration, and portions are still to come. To be
  /// called before the first seek that plays such a run; without it, all is known.
  void setOpen(bool isOpen) { isOpen_ = isOpen; }
  /// Adds what has come. A sound that plays goes on into it, if it comes early enough: kLookahead
  /// and the time of a block before. Refuses bodies that the run has no room for.
  Status append(RunMore more);
  /// Takes back all portions from one on, and the bodies that came with them. A seek is needed.
  void cut(std::size_t portions);
  /// s of the run: all before it is known.
  double known() const { return run_.portions.empty() ? 0.0 : run_.portions.back().settledTime; }

  /// Sets the head of all binaural ears and listeners, at the player's rate.
  void setHead(std::shared_ptr<const HrtfSet> head) { head_ = std::move(head); }
  /// Sets the format of the ear. A binaural one needs a head.
  void setFormat(ListenerFormat format) { format_ = format; }
  /// Has a listener of the run be heard in place of the ear; empty: the ear.
  void follow(std::optional<std::size_t> listener) { followed_ = listener; }
  /// Sets which stems are heard.
  void setStems(const std::array<bool, kStems>& stems) { stems_ = stems; }
  /// Sets whether a body is heard.
  void setAudible(BodyId body, bool isAudible);
  /// Has nothing be heard but one collision, by the place of one of its events in eventsInOrder;
  /// empty: everything.
  void setOnly(std::optional<std::size_t> event) { only_ = event; }

  /// Puts the ear somewhere at once; a pose's time is not used. Refuses what is no pose.
  Status placeEar(const ListenerPose& pose);
  /// Moves the ear from where it is, from the next sample on. Refuses what is no pose.
  Status moveEar(const ListenerPose& pose);

  /// A place in the run to play from.
  struct Start {
    double time = 0.0;     ///< s
    double speed = 1.0;    ///< of the run's time over that of the sound
    double prelude = 0.0;  ///< s of sound before, which is made and dropped, so that it rings on
  };
  /// Begins a new sound. Refuses: a speed out of range, no head where one is needed, no such
  /// listener or event.
  Status seek(const Start& start);

  std::size_t channels() const { return channelCount_; }
  /// Renders the next samples of each channel; all after the end is what rings on. Requires
  /// channels.size() == channels(), and a seek before.
  void render(std::span<float* const> channels, std::size_t frames);

  /// Time in s of the run, of the next sample.
  double time() const;
  /// Number of events that were handed over too late to be heard whole, since the seek.
  std::uint64_t late() const { return synth_ ? synth_->counters().late : 0; }
  /// The sound since the last seek; null before one.
  const Synth* synth() const { return synth_ ? &*synth_ : nullptr; }

  /// The contact and the loudness of an event, as all listeners of the run would hear it.
  struct EventMeasure {
    double duration = 0.0;  ///< s, of the contact
    double peak = 0.0;      ///< Pa, as Synth::schedule returns it
  };
  /// Measures all events, in their order. Nothing is rendered; a new seek is needed afterwards.
  Result<std::vector<EventMeasure>> measureEvents();

 private:
  RunPlayer(PlayableRun run, double sampleRate);
  /// Returns when, on the synthesis' clock, a time (s) of the run is heard.
  double heardAt(double time) const { return start_.time + (time - start_.time) / start_.speed; }
  Result<std::vector<Listener>> chosenListeners() const;
  Status chooseListeners();
  bool isHeardSo() const;
  Status makeSynth();
  Status followPath(std::size_t listener);
  void tellEar();
  void orderEvents();
  double voiceBegin(double time) const;
  void addStates(const RunPortion& portion);
  void setBodies(const PlayableRun::Bodies& bodies);
  void bringBodies(double time);
  bool rings(const ContactState& contact) const;
  void runAhead(double heard);
  bool bodiesChange(std::size_t portion) const;
  void setBodiesUpTo(std::size_t portion);
  void moveBody(const BodyPose& pose);
  void take(std::size_t portion);
  void scheduleSettled();
  void renderBlock(std::size_t frames);
  void mixStems(std::size_t frames);
  /// Number of parts that the synthesis renders: the whole, and stems if some are left out.
  std::size_t parts() const { return isWhole_ ? 1 : 1 + kStems; }
  ImpulseEvent atSpeed(const ImpulseEvent& event) const;
  ContactState atSpeed(const ContactState& contact) const;

  PlayableRun run_;
  double sampleRate_;
  std::vector<std::size_t> firstEvents_;  // of each portion: the number of events before it
  std::vector<EventPlace> order_;
  bool isOrdered_ = false;  // order_ is that of the run
  bool isOpen_ = false;
  std::shared_ptr<const HrtfSet> head_;
  ListenerFormat format_ = ListenerFormat::mono;
  std::optional<std::size_t> followed_;
  std::array<bool, kStems> stems_ = {true, true, true};
  std::vector<bool> isMuted_;  // by body
  std::optional<std::size_t> only_;
  ListenerPose ear_;     // where it is to be
  ListenerPose placed_;  // where it was before it moved

  Start start_;
  std::vector<Listener> listeners_;  // that the synth has
  std::size_t firstChannel_ = 0;     // of the one that is heard
  std::size_t channelCount_ = 1;
  std::optional<Synth> synth_;
  bool hasStems_ = false;  // of the synth
  std::optional<DeformingVoice> voice_;
  double firstEvent_ = 0.0;  // s of the run: events before are not heard
  ImpulseEvent onlyEvent_;   // a share of the only collision
  std::size_t next_ = 0;     // portion
  std::size_t nextBodies_ = 0;
  std::vector<bool> isRinging_;             // by body, as it was set last
  double settled_ = 0.0;                    // s
  bool isWhole_ = true;                     // all stems are heard
  bool isMoved_ = false;                    // ear_ has not been told to the synth yet
  bool hasMoved_ = false;                   // since the seek
  double voiceBegin_ = 0.0;                 // s of the run: time 0 of voice_
  std::size_t states_ = 0;                  // of what deforms, that have been passed
  std::vector<ImpulseEvent> known_;         // not settled yet
  std::vector<std::vector<float>> planes_;  // of all channels of the synth
};

}  // namespace carom::audio
