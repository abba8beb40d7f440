#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include "audio/propagation/listener_tracks.h"
#include "audio/propagation/pose_track.h"
#include "audio/propagation/receiver.h"
#include "audio/propagation/sound_paths.h"
#include "audio/scheduling/modal_exciter.h"
#include "audio/scheduling/sample_time.h"
#include "audio/synthesis/scheduled_sound.h"
#include "carom/audio/impulse_event.h"
#include "carom/audio/sound_body.h"

namespace carom::audio {

/// Follows bodies that ring, and who hears them, for as long as that lasts: distance, delay, and
/// the direction in which they are heard.
///
/// From the end of a blow on, it goes from one time of the receiver to the next, and finds when the
/// sound that arrives then left the body, where that was and how it was turned, and so how each
/// mode is heard over each path. In the stretch between, transfers and time of emission change
/// linearly (MovingRing); so stretches are the shorter the more a direction turns in them. A body
/// without poses stands where it was struck; where nothing moves, nothing is sent. Not followed:
/// paths that walls blocked when the body was struck, and the reverberation.
///
/// In a live sound (`followLive`) poses come while it is heard, and all that rings may begin to
/// move later. So a blow is scheduled as of bodies at rest; once what is heard has changed by
/// kLiveStill, or comes from farther off or nearer by kLiveSlow, the bank of each channel is moved:
/// with one path as above; with several, which sound in one bank, by the root of the sum of the
/// squares of their transfers, and at the mean of their rates by the same squares. Who jumps, or
/// was put somewhere else, is heard there after a stretch without Doppler effect. [one thread]
class RingTracks {
 public:
  static constexpr int kLongest = 8;  ///< grids of ModalBank in a stretch

  /// In a live sound: the change since what was sent last (share of the distance, or rad) and the
  /// speed (share of that of sound) up to which what is heard counts as at rest.
  static constexpr double kLiveStill = 0.005;
  static constexpr double kLiveSlow = 3e-4;
  /// m/s: a change of a body's velocity from one step to the next that counts as a jump.
  static constexpr double kJump = 15.0;

  /// The tracks and the exciter must outlive it.
  RingTracks(std::shared_ptr<const SoundPaths> paths, const ListenerTracks& listeners,
             ModalExciter& exciter);

  /// Makes it that of a live sound, in which so many ways are followed at a time, one for each body
  /// and channel: of the loudest bodies. Before anything rings.
  void followLive(std::size_t ways);
  bool isLive() const { return live_.has_value(); }

  /// As Synth::moveBody. In a live sound poses of what does not ring are of no use; a time that
  /// goes back counts as a jump.
  bool move(BodyId body, const ListenerPose& pose);
  void forget(BodyId body);
  void clear();
  /// The clock of the simulation leaps by so much (s), in a live sound.
  void leap(double seconds);

  /// True if the ring of an event is followed from the event on: the body or a listener moves, as
  /// far as poses tell, and `advance` has been called. In a live sound it may be later.
  bool follows(const ImpulseEvent& event) const;

  /// A blow that makes a body ring, whose excitations the exciter holds.
  struct Blow {
    const ImpulseEvent& event;
    const SoundBody& sound;
    const ModalExciter::Source& source;
    double middle = 0.0;  ///< s, of the contact
    double until = 0.0;   ///< s, when its ring can be heard no more
    double peak = 0.0;    ///< Pa, estimate
    SampleShift shift = {};
  };
  void add(const Blow& blow);

  /// How far rings are to be sent, and to whom.
  struct Target {
    double time = 0.0;  ///< s, up to which poses and blows are known
    SampleShift shift;  ///< at that time
    SoundSink& sink;
  };
  /// Sends how all rings are heard, as far as that is known.
  void advance(const Target& target);
  /// The same of one body, to be called before it is struck at the target's time: so it cannot be
  /// heard how many blows are handed over from one `advance` to the next. Nothing in a live sound.
  void advance(BodyId body, const Target& target);

  /// Adds the bodies that ring, as far as they are there; one with two models comes twice.
  void addRinging(std::vector<BodyId>& bodies) const;

 private:
  /// The sound that arrives over one path at a time of the receiver.
  struct Heard {
    double emitted = 0.0;  // s, when it left the body
    double delay = 0.0;    // s
    ModalExciter::View view = {};
    Vec3 leaving = Vec3::Zero();   // m, body frame, to the receiver
    Vec3 arriving = Vec3::Zero();  // unit, listener frame, towards the body
  };
  /// A receiver, and where it is.
  struct Hearing {
    const ListenerTracks::Place& place;
    const Receiver& receiver;
  };
  struct Places {
    ListenerPose body;
    ListenerTracks::Place receiver;
    bool operator==(const Places& other) const {
      return body.position == other.body.position &&
             body.orientation.coeffs() == other.body.orientation.coeffs() &&
             receiver.position == other.receiver.position &&
             receiver.orientation.coeffs() == other.receiver.orientation.coeffs();
    }
  };
  /// One way of a ring to one channel: over one path, or over all of them in one bank.
  struct Way {
    std::uint32_t channel = 0;
    std::uint32_t path = 0;   // ModalExcitation::path; 0 for all
    std::int64_t at = 0;      // sample up to which it has been sent
    double rate = 1.0;        // seconds of the body in a second of the receiver, before that sample
    int grids = 1;            // length of the next stretch
    bool isMoving = false;    // its bank has been moved, or is so from the blow on
    bool hasJumped = false;   // since the last stretch
    std::uint64_t jumps = 0;  // of its listener, as of the last stretch
    Places seen = {};         // when it was last sent, in a live sound
    /// By path: delays and the first one's emission as of `at`, all else when it was last sent.
    /// From a blow in motion on, that is not known.
    std::vector<Heard> last;
  };
  struct Ring {
    BodyId body = 0;
    const ModalExciter::Source* source = nullptr;
    Vec3 centre = Vec3::Zero();        // m, body frame: centre of mass of the model
    double until = 0.0;                // s
    ListenerPose struck;               // where it was struck last
    double peak = 0.0;                 // Pa, then
    double loudness = 0.0;             // Pa, for sortByLoudness
    std::optional<PoseTrack> removed;  // how it has moved, if it is no more
    std::vector<Way> ways;
  };
  /// The motion of a body.
  struct Body {
    PoseTrack track;
    ListenerPose last;
    std::optional<Vec3> velocity{};  // m/s, from the pose before the last; none after a blow
  };
  /// The state that only a live sound has.
  struct Live {
    std::size_t ways = 0;
    bool havePosesCome = false;
  };

  bool moveLive(BodyId body, const ListenerPose& pose);
  void jump(BodyId body);
  Ring& ringOf(const Blow& blow);
  Way wayOf(const ModalExcitation& excitation, double middle) const;
  void addLive(const Blow& blow, Ring& ring);
  void addLiveWay(const Blow& blow, const ModalExcitation& excitation, Ring& ring);
  double timeOf(double sample, const Target& target) const;
  double sampleOf(double time, const Target& target) const;
  ListenerPose poseOf(const Ring& ring, double time) const;
  void hear(const Ring& ring, const Way& way, double time);
  void look(const Ring& ring, const ListenerPose& body, const Hearing& at, Heard& heard) const;
  void block(const Ring& ring, const ListenerPose& body, const ListenerTracks::Place& place,
             Heard& heard) const;
  bool advance(Ring& ring, const Target& target);
  void advanceLive(const Target& target);
  bool isOver(const Ring& ring) const;
  bool isAtRest(const Ring& ring, const Target& target) const;
  double knownUntil(const Ring& ring, double time) const;
  void sortByLoudness(double time);
  double loudnessOf(const Ring& ring, double time) const;
  void stand(Way& way, const Target& target) const;
  void anchor(Way& way, const Target& target) const;
  void leaveOut(Ring& ring, const Target& target);
  bool sendStretch(const Ring& ring, Way& way, const Target& target);
  double rateOf(const Way& way, double seconds) const;
  double changeOf(const Way& way) const;
  void begin(const Ring& ring, const Way& way, SoundSink& sink);
  void send(const Ring& ring, Way& way, double rate, SoundSink& sink);

  std::shared_ptr<const SoundPaths> paths_;
  const ListenerTracks& listeners_;
  ModalExciter& exciter_;
  std::optional<Live> live_;
  std::unordered_map<BodyId, Body> bodies_;
  bool isAdvanced_ = false;
  std::vector<Ring> rings_;
  std::vector<Heard> then_;                // of the stretch in hand, by path
  std::vector<ModalExciter::View> views_;  // scratch
  // Scratch, of a live sound:
  std::vector<Ring*> moving_;
  std::vector<ListenerTracks::Place> receivers_;  // by channel
};

}  // namespace carom::audio
