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

#include "audio/acceleration_noise.h"
#include "audio/click.h"
#include "audio/contact_drive.h"
#include "audio/hertz.h"
#include "audio/pose_track.h"
#include "audio/pulse.h"
#include "audio/radiation_bank.h"
#include "audio/ring_layer.h"
#include "audio/sound_paths.h"
#include "carom/audio/contact_state.h"
#include "carom/audio/impulse_event.h"
#include "carom/audio/result.h"
#include "carom/audio/sound_body.h"

namespace carom::audio {

/// The sound of one event, until the next `lay`.
struct LaidSound {
  double peak = 0.0;                         ///< Pa, of the clicks at any listener: an upper bound
  std::span<const Click> clicks = {};        ///< empty: no click to hear
  std::span<const SphereWeights> ears = {};  ///< where binaural ones come from; empty without heads
  std::span<const Ring> rings = {};          ///< empty: nothing rings
  std::span<const double> taps = {};         ///< of the rings
  /// What drives all of them, if that is no pulse: their nodes. Not kept: who plays it has a copy.
  std::span<const PulseNode> train = {};
};

/// Later than on the simulation clock, 0 <= fraction < 1.
struct SampleShift {
  std::int64_t whole = 0;  ///< leaves the bits of the samples as they are
  double fraction = 0.0;
  double stretch = 1.0;  ///< how much longer what lasts is there
};

struct ClickLayerCounters {
  std::uint64_t events = 0;           ///< laid, of bodies that can move or ring
  std::uint64_t immovable = 0;        ///< shares of bodies that neither move nor ring
  std::uint64_t rings = 0;            ///< of `events`, made a body ring that is heard
  std::uint64_t slides = 0;           ///< steps of a body that slides or rolls and is heard
  std::uint64_t inaudibleSlides = 0;  ///< likewise, left out: below the threshold everywhere
  std::uint64_t inaudible = 0;     ///< of `events`, left out: below the threshold at every listener
  std::uint64_t undersampled = 0;  ///< of `events`, contact shorter than 4 samples, naively sampled
  std::uint64_t rejected = 0;      ///< not finite, unknown body, no approach, over 20 s
};

/// From events to clicks and rings: what of the sound is decided when an event is known. It knows
/// bodies, listeners and rooms, and allocates as it likes: in real time it belongs to the thread of
/// the simulation. What it has laid is played by ClickPlayer and RingPlayer, which know neither.
/// See Synth for the model. [one thread]
class ClickLayer {
 public:
  explicit ClickLayer(std::shared_ptr<const SoundPaths> paths);

  Status setBody(BodyId id, const SoundBody& body);  ///< as Synth::setBody
  void removeBody(BodyId id);                        ///< its events are rejected from now on
  Status moveListener(std::size_t listener, const ListenerPose& pose);  ///< as Synth::moveListener
  /// The listener is there, and was so always: for what is too far away to have travelled to.
  Status placeListener(std::size_t listener, const ListenerPose& pose);
  /// Listeners are back where they were created, and await their first pose.
  void restartListeners();

  /// Lays one event over the samples. Not to be heard, or refused: no clicks, and counted.
  LaidSound lay(const ImpulseEvent& event, const SampleShift& shift = {});

  /// What a lasting contact changes of the damping of what rings: rings that are none (see Ring).
  LaidSound touch(const ContactState& contact, const SampleShift& shift = {});

  /// What a lasting contact sounds like where it slides or rolls over bumps: the share of its first
  /// body, or of the other one, which is to be asked for after it. One step after the other.
  LaidSound slide(const ContactState& contact, bool first, const SampleShift& shift = {});

  /// How loud a lasting contact may become, beside others: N s over m to the nearest microphone,
  /// more for what slides already; 0 for what does not slide.
  double slideRank(const ContactState& contact);
  /// It is not heard any more: what it slides later is a new slide.
  void endSlide(const ContactState& contact) { sliding_.erase({contact.body, contact.other}); }

  /// Whether `touch` or `slide` may have something to say: a body that rings, or is not smooth, was
  /// ever set.
  bool hearsTouches() const { return anyRings_ || anyTextures_; }

  const SoundPaths& paths() const { return *paths_; }
  const ClickLayerCounters& counters() const { return counters_; }
  double leadTime(double contactDuration) const;            ///< as Synth::leadTime
  double contactDuration(const ImpulseEvent& event) const;  ///< as Synth::contactDuration

 private:
  struct Body {
    SoundBody sound;
    const RadiationBank::Mix* filters = nullptr;            // null: it does not click
    const RingLayer::Source* rings = nullptr;               // null: it does not ring
    std::shared_ptr<const SurfaceTexture> rough = nullptr;  // of its material, once it has slid
  };
  /// A contact that loses energy.
  struct Lossy {
    Pulse pulse;
    double stretch = 1.0;  // of its duration over the elastic one's
  };
  /// What the clicks of one event have in common.
  struct Contact {
    double time = 0.0;      // s
    double duration = 0.0;  // s, on the clock of the samples
    const Pulse* pulse = nullptr;
    Strike strike;
    Vec3 dipoleBefore = Vec3::Zero();  // at its begin; the strike's is at its end
    double ahead = 0.0;  // m: the sound starts at the surface, and the filter lets it wait
    const RadiationBank::Mix* filters = nullptr;  // null: no click
    SampleShift shift;
    bool rings = false;
    std::span<const PulseNode> train = {};  // in place of the pulse
    double loudest = 0.0;                   // N s, about what of the train comes at once
  };
  /// The way of a contact's sound to one receiver, at its begin, middle and end.
  struct Way {
    std::array<double, 3> delays{};     // s
    std::array<double, 3> gains{};      // Pa s^2: of the slope of a force of integral 1
    double distance = 0.0;              // m, in the middle, not below the body's radius
    double stretch = 1.0;               // of time, in the middle, by the receiver's own motion
    SphereWeights ears;                 // where a binaural channel hears it from
    Vec3 towardsSource = Vec3::Zero();  // unit, world frame, at the begin
    double receiverGain = 1.0;          // likewise
  };

  /// Where a click or ring goes.
  struct Place {
    std::uint32_t chain = 0;
    std::uint32_t channel = 0;
    const Image* image = nullptr;
  };

  /// Of two bodies that slide or roll on each other.
  struct Sliding {
    ContactDrive drive;
    std::vector<PulseNode> nodes;  // of the step in hand
    bool sounds = false;           // in the step before
    /// Of each body, the latest.
    struct Side {
      bool isKnown = false;
      Vec3 end = Vec3::Zero();     // m, body frame: where the contact point's path ended
      Vec3 offset = Vec3::Zero();  // m, likewise: from where it is to where it is taken to be
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
  LaidSound layImpulse(const ImpulseEvent& event, const SampleShift& shift);
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
  LaidSound soundOf() const;
  static HertzContact hertzOf(const ContactState& contact, const Body& body, const Body& other);
  bool touchOne(const ContactState& contact, bool first, std::int64_t sample);
  void layRing(const Contact& contact, const Way& way, const Place& place);
  void chooseRule(Click& click) const;
  double boundOf(const Contact& contact, const Way& way) const;
  double tailOver(const Contact& contact) const;

  std::shared_ptr<const SoundPaths> paths_;
  const SynthSettings& settings_;  // of paths_
  std::vector<PoseTrack> tracks_;  // one per listener
  std::vector<bool> hasMoved_;     // likewise: a pose has come
  std::unordered_map<BodyId, Body> bodies_;
  ClickLayerCounters counters_;
  RadiationBank filters_;
  RingLayer rings_;
  mutable std::unordered_map<double, Lossy> lossy_;  // by restitution, made when first needed
  std::vector<Click> laid_;                          // of the event in hand
  std::vector<SphereWeights> laidEars_;              // of laid_, where there is a head
  std::vector<Ring> dampings_;                       // of the lasting contact in hand
  std::vector<double> dampingTaps_;                  // of these
  std::map<std::pair<BodyId, BodyId>, Sliding> sliding_;
  Sliding* slidingNow_ = nullptr;  // of the step in hand
  bool anyTextures_ = false;       // or roughness
  double peak_ = 0.0;              // Pa, a bound for them
  bool anyRings_ = false;
  double ringPeak_ = 0.0;  // Pa, for the rings
};

}  // namespace carom::audio
