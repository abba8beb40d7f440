#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include "audio/propagation/listener_tracks.h"
#include "audio/propagation/pose_track.h"
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
/// paths that walls blocked when the body was struck, and the reverberation. [one thread]
class RingTracks {
 public:
  static constexpr int kLongest = 8;  ///< grids of ModalBank in a stretch

  /// The tracks and the exciter must outlive it.
  RingTracks(std::shared_ptr<const SoundPaths> paths, const ListenerTracks& listeners,
             ModalExciter& exciter);

  /// As Synth::moveBody.
  bool move(BodyId body, const ListenerPose& pose);
  void forget(BodyId body);
  void clear();

  /// True if the ring of an event is followed: the body or a listener moves, as far as poses tell,
  /// and `advance` has been called.
  bool follows(const ImpulseEvent& event) const;

  /// A blow that makes a body ring, whose excitations the exciter holds.
  struct Blow {
    const ImpulseEvent& event;
    const SoundBody& sound;
    const ModalExciter::Source& source;
    double middle = 0.0;  ///< s, of the contact
    double until = 0.0;   ///< s, when its ring can be heard no more
  };
  void add(const Blow& blow);

  /// How far rings are to be sent, and to whom.
  struct Target {
    double time = 0.0;  ///< s, up to which poses and blows are known
    SampleShift shift;
    SoundSink& sink;
  };
  /// Sends how all rings are heard, as far as that is known.
  void advance(const Target& target);
  /// The same of one body, to be called before it is struck at the target's time: so it cannot be
  /// heard how many blows are handed over from one `advance` to the next.
  void advance(BodyId body, const Target& target);

 private:
  /// One way of a ring to one channel.
  struct Way {
    std::uint32_t channel = 0;
    std::uint32_t path = 0;
    std::int64_t at = 0;   // sample up to which it has been sent
    double emitted = 0.0;  // s, when what is heard at that sample left the body
    double rate = 1.0;     // seconds of the body in a second of the receiver, before that sample
    int grids = 1;         // length of the next stretch
    // When it was last sent; from the blow on, it is not known:
    Vec3 leaving = Vec3::Zero();   // m, body frame, to the receiver
    Vec3 arriving = Vec3::Zero();  // unit, listener frame, towards the body
  };
  struct Ring {
    BodyId body = 0;
    const ModalExciter::Source* source = nullptr;
    Vec3 centre = Vec3::Zero();        // m, body frame: centre of mass of the model
    double until = 0.0;                // s
    ListenerPose struck;               // where it was struck last
    std::optional<PoseTrack> removed;  // how it has moved, if it is no more
    std::vector<Way> ways;
  };
  /// What arrives at a time of the receiver.
  struct Heard {
    ListenerTracks::Place place;  // of the receiver
    double emitted = 0.0;         // s, when it left the body
    double delay = 0.0;           // s
    ModalRoute route;
    Quat orientation = Quat::Identity();  // of the body
    Vec3 leaving = Vec3::Zero();          // as Way::leaving
    Vec3 arriving = Vec3::Zero();         // as Way::arriving
  };
  Ring& ringOf(const Blow& blow);
  Way wayOf(const ModalExcitation& excitation, double middle) const;
  ListenerPose poseOf(const Ring& ring, double time) const;
  Heard heardAt(const Ring& ring, const Way& way, double time) const;
  void look(const Ring& ring, const Way& way, Heard& heard) const;
  bool advance(Ring& ring, const Target& target);
  bool sendStretch(const Ring& ring, Way& way, const Target& target);
  void send(const Ring& ring, const Heard& then, Way& way, SoundSink& sink);
  static double changeOf(const Heard& heard, const Way& way);

  std::shared_ptr<const SoundPaths> paths_;
  const ListenerTracks& listeners_;
  ModalExciter& exciter_;
  std::unordered_map<BodyId, PoseTrack> bodies_;
  bool isAdvanced_ = false;
  std::vector<Ring> rings_;
};

}  // namespace carom::audio
