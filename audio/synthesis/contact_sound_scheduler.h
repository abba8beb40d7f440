#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "audio/contact/contact_drive.h"
#include "audio/model/acceleration_noise.h"
#include "audio/model/hertz.h"
#include "audio/model/pulse.h"
#include "audio/propagation/pose_track.h"
#include "audio/propagation/sound_paths.h"
#include "audio/radiation/radiation_bank.h"
#include "audio/synthesis/click.h"
#include "audio/synthesis/modal_exciter.h"
#include "carom/audio/contact_state.h"
#include "carom/audio/impulse_event.h"
#include "carom/audio/result.h"
#include "carom/audio/sound_body.h"

namespace carom::audio {

/// The sound of one event or of one step of a contact; valid until the next call of the
/// ContactSoundScheduler.
struct ScheduledSound {
  double peak = 0.0;                   ///< Pa, upper bound of the clicks at any listener
  std::span<const Click> clicks = {};  ///< empty: no click to hear
  /// Directions from which binaural channels hear the clicks; empty without heads.
  std::span<const SphereWeights> ears = {};
  std::span<const ModalExcitation> rings = {};  ///< empty: nothing rings
  std::span<const double> taps = {};            ///< the taps that `rings` refer to
  /// Nodes that drive all clicks and rings, if no pulse does. Borrowed: a player keeps a copy.
  std::span<const PulseNode> train = {};
};

/// Delay on the sample clock against the simulation clock: whole + fraction samples, with fraction
/// from 0 to below 1.
struct SampleShift {
  std::int64_t whole = 0;  ///< does not change the bits of the samples
  double fraction = 0.0;
  double stretch = 1.0;  ///< durations on the sample clock over those on the simulation clock
};

struct ContactSoundCounters {
  std::uint64_t events = 0;           ///< scheduled events of bodies that can move or ring
  std::uint64_t immovable = 0;        ///< shares of bodies that neither move nor ring
  std::uint64_t rings = 0;            ///< `events` that made a body ring audibly
  std::uint64_t slides = 0;           ///< steps in which a body that slides or rolls is heard
  std::uint64_t inaudibleSlides = 0;  ///< such steps left out: below the threshold everywhere
  std::uint64_t inaudible = 0;        ///< `events` left out: below the threshold at every listener
  std::uint64_t undersampled = 0;     ///< `events` sampled naively, contact shorter than 4 samples
  std::uint64_t rejected = 0;         ///< not finite, unknown body, no approach, over 20 s
};

/// Turns events into clicks and rings: the part of the synthesis that is decided when an event is
/// known. It knows bodies, listeners and rooms, and allocates freely: in real time it belongs to
/// the thread of the simulation. ClickRenderer and ModalBank, which know none of these, play its
/// clicks and rings. See Synth for the model. [one thread]
class ContactSoundScheduler {
 public:
  explicit ContactSoundScheduler(std::shared_ptr<const SoundPaths> paths);

  Status setBody(BodyId id, const SoundBody& body);  ///< as Synth::setBody
  void removeBody(BodyId id);                        ///< the body's events are rejected from now on
  Status moveListener(std::size_t listener, const ListenerPose& pose);  ///< as Synth::moveListener
  /// Teleports the listener and discards the history of its motion: as Synth::placeListener.
  Status placeListener(std::size_t listener, const ListenerPose& pose);
  /// Returns the listeners to where they were created, to await their first pose.
  void restartListeners();

  /// Schedules one event on the samples. Returns no clicks and no rings, and counts the event, if
  /// it is inaudible or invalid.
  ScheduledSound lay(const ImpulseEvent& event, const SampleShift& shift = {});

  /// Returns the changes that a lasting contact makes to the damping of ringing bodies, as rings
  /// without a pulse (see ModalExcitation).
  ScheduledSound updateContact(const ContactState& contact, const SampleShift& shift = {});

  /// Returns the sound of a lasting contact that slides or rolls over bumps: the share of its first
  /// body, or of the other body, which has to be asked for after the first one's. Steps come in
  /// order of time.
  ScheduledSound slide(const ContactState& contact, bool first, const SampleShift& shift = {});

  /// Rank of a lasting contact's possible loudness, for comparison with others: N s over m to the
  /// nearest listener, higher for a contact that slides already; 0 if it does not slide.
  double slideRank(const ContactState& contact);
  /// Ends the sound of a sliding contact: if it slides later, that is a new slide.
  void endSlide(const ContactState& contact) { sliding_.erase({contact.body, contact.other}); }

  /// True if `touch` or `slide` may return a sound: a body that rings or is not smooth has been
  /// set.
  bool hearsTouches() const { return anyRings_ || anyTextures_; }

  const SoundPaths& paths() const { return *paths_; }
  const ContactSoundCounters& counters() const { return counters_; }
  double leadTime(double contactDuration) const;            ///< as Synth::leadTime
  double contactDuration(const ImpulseEvent& event) const;  ///< as Synth::contactDuration

 private:
  struct Body {
    SoundBody sound;
    const RadiationBank::Mix* filters = nullptr;            // null: it does not click
    const ModalExciter::Source* rings = nullptr;            // null: it does not ring
    std::shared_ptr<const SurfaceTexture> rough = nullptr;  // made of its roughness when it slides
  };
  /// The pulse of a contact that loses energy.
  struct Lossy {
    Pulse pulse;
    double stretch = 1.0;  // the duration over that of the elastic contact
  };
  /// The data that the clicks of one event share.
  struct Contact {
    double time = 0.0;      // s
    double duration = 0.0;  // s, on the clock of the samples
    const Pulse* pulse = nullptr;
    Strike strike;
    Vec3 dipoleBefore = Vec3::Zero();  // dipole at the begin; strike.dipole is that at the end
    // m, subtracted from the distance: sound starts at the surface, and the filter delays it
    double ahead = 0.0;
    const RadiationBank::Mix* filters = nullptr;  // null: no click
    SampleShift shift;
    bool rings = false;
    std::span<const PulseNode> train = {};  // nodes in place of the pulse
    double loudest = 0.0;  // N s, sum of the nodes that come at about the same time
  };
  /// The propagation path of a contact's sound to one receiver, at its begin, middle and end.
  struct Way {
    std::array<double, 3> delays{};     // s
    std::array<double, 3> gains{};      // Pa s^2, per slope of a force of integral 1
    double distance = 0.0;              // m, in the middle, not below the body's radius
    double stretch = 1.0;               // time stretch by the receiver's own motion, in the middle
    SphereWeights ears;                 // direction from which a binaural channel hears it
    Vec3 towardsSource = Vec3::Zero();  // unit, world frame, at the begin
    double receiverGain = 1.0;          // at the begin
  };

  /// The path and the channel of a click or ring.
  struct Place {
    std::uint32_t chain = 0;
    std::uint32_t channel = 0;
    const Image* image = nullptr;
  };

  /// The state of two bodies that slide or roll on each other.
  struct Sliding {
    ContactDrive drive;
    std::vector<PulseNode> nodes;  // nodes of the current step
    bool sounds = false;           // the previous step had nodes
    /// The latest state of the contact on one of the bodies.
    struct Side {
      bool isKnown = false;
      Vec3 end = Vec3::Zero();  // m, body frame: where the contact point's path ended
      // m, body frame: from the contact point to the point that is used in its place
      Vec3 offset = Vec3::Zero();
      std::optional<Vec3> dipole;  // Strike::dipole
    };
    std::array<Side, 2> sides;
  };

  Error noListener(std::size_t listener) const;
  const RadiationBank::Mix& filtersOf(double radius);
  const Body* findBody(BodyId id) const;
  Body* findBody(BodyId id);
  double restitutionOf(const ImpulseEvent& event) const;
  const Pulse& pulseOf(const ImpulseEvent& event) const;
  const Lossy& lossyOf(const ImpulseEvent& event) const;
  ScheduledSound layImpulse(const ImpulseEvent& event, const SampleShift& shift);
  Contact contactOf(const ImpulseEvent& event, const Body& body, double duration,
                    const SampleShift& shift);
  bool layContact(const Contact& contact);
  bool laySend(const Contact& contact);
  Arrival arrivalAt(const SoundPaths::Channel& channel, double time, const Vec3& from) const;
  static Vec3 dipoleAt(const Contact& contact, std::size_t part);
  bool findWay(const Contact& contact, const SoundPaths::Channel& channel, const Image* image,
               Way& way) const;
  bool isPlaceable(const Contact& contact, const Way& way) const;
  Click placed(const Contact& contact, const Way& way) const;
  void layClick(const Contact& contact, const Way& way, const Place& place);
  Click ringDrive(const Contact& contact, Way way, const Place& place) const;
  bool isDriven(const ContactState& contact) const;
  Sliding* advanced(const ContactState& contact, double stretch);
  static void fadeIn(std::vector<PulseNode>& nodes, double duration);
  static void follow(const ContactState& contact, Sliding& sliding);
  static ImpulseEvent slidingEvent(const ContactState& contact, bool first, const Vec3& offset);
  static bool isMoving(const ContactState& contact);
  static double massOf(const ContactState& contact, const Body& body, const Body& other);
  static double workOf(const ContactState& contact);
  double steepestImpulse(const ContactState& contact);
  bool isInaudible(const ContactState& contact, double loudest, const Body& body,
                   const Body& other);
  const SurfaceTexture* textureOf(Body& body);
  static const TextureCoordinates* coordinatesOf(const Body& body);
  static double ballRadius(const Body& body);
  static double contactRadius(const ContactState& contact, const Body& body, const Body& other);
  ScheduledSound soundOf() const;
  static HertzContact hertzOf(const ContactState& contact, const Body& body, const Body& other);
  bool touchOne(const ContactState& contact, bool first, std::int64_t sample);
  void layRing(const Contact& contact, const Way& way, const Place& place);
  void chooseRule(Click& click) const;
  double boundOf(const Contact& contact, const Way& way) const;
  double tailOver(const Contact& contact) const;

  std::shared_ptr<const SoundPaths> paths_;
  const SynthSettings& settings_;  // settings of paths_
  std::vector<PoseTrack> tracks_;  // one per listener
  std::vector<bool> hasMoved_;     // one per listener: a pose has come
  std::unordered_map<BodyId, Body> bodies_;
  ContactSoundCounters counters_;
  RadiationBank filters_;
  ModalExciter rings_;
  mutable std::unordered_map<double, Lossy> lossy_;  // by restitution, made when first needed
  std::vector<Click> laid_;                          // clicks of the current event
  std::vector<SphereWeights> laidEars_;              // directions of laid_, if there is a head
  std::vector<ModalExcitation> dampings_;            // changes by the current lasting contact
  std::vector<double> dampingTaps_;                  // taps of dampings_
  std::map<std::pair<BodyId, BodyId>, Sliding> sliding_;
  Sliding* slidingNow_ = nullptr;  // the pair of the current step
  bool anyTextures_ = false;       // a body with a texture or roughness has been set
  double peak_ = 0.0;              // Pa, upper bound of laid_
  bool anyRings_ = false;
  double ringPeak_ = 0.0;  // Pa, upper bound of the rings
};

}  // namespace carom::audio
