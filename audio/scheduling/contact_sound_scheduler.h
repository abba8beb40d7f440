#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "audio/propagation/listener_tracks.h"
#include "audio/propagation/sound_paths.h"
#include "audio/scheduling/contact_duration.h"
#include "audio/scheduling/contact_propagation.h"
#include "audio/scheduling/coupled_impacts.h"
#include "audio/scheduling/heard_clicks.h"
#include "audio/scheduling/heard_slides.h"
#include "audio/scheduling/modal_exciter.h"
#include "audio/scheduling/noise_propagation.h"
#include "audio/scheduling/ring_tracks.h"
#include "audio/scheduling/sample_time.h"
#include "audio/scheduling/slide_tracker.h"
#include "audio/scheduling/sounding_bodies.h"
#include "audio/synthesis/scheduled_sound.h"
#include "carom/audio/contact_state.h"
#include "carom/audio/impulse_event.h"
#include "carom/audio/result.h"
#include "carom/audio/sound_body.h"

namespace carom::audio {

/// Turns events and lasting contacts into sounds on the samples: the half of the synthesis that is
/// decided as soon as an event is known.
///
///     ImpulseEvent  -- ContactDurations -->  ContactSource  -- ContactPropagation -->
///     ScheduledSound ContactState  -- SlideTracker  -->  ContactSource  -- ContactPropagation -->
///     ScheduledSound ContactState  -- ModalExciter  -->  changes of damping
///
/// It knows bodies, listeners and rooms, and allocates freely: in real time it belongs to the
/// thread of the simulation. ClickRenderer, which knows none of these, renders what it schedules.
/// See Synth for the model. [one thread]
class ContactSoundScheduler {
 public:
  explicit ContactSoundScheduler(std::shared_ptr<const SoundPaths> paths);

  Status setBody(BodyId id, const SoundBody& body) { return bodies_.set(id, body); }
  void removeBody(BodyId id);  ///< the body's events are rejected from now on
  /// As Synth::moveListener and Synth::placeListener.
  Status moveListener(std::size_t listener, const ListenerPose& pose) {
    return listeners_.move(listener, pose);
  }
  Status placeListener(std::size_t listener, const ListenerPose& pose) {
    return listeners_.place(listener, pose);
  }
  /// Returns the listeners to where they were created, to await their first pose, and forgets what
  /// rings, moves and touches.
  void restart() {
    listeners_.restart();
    rings_.clear();
    exciter_.forgetContacts();
    released_.clear();
    coupled_.forgetLast();
    heardClicks_ = {};
  }
  /// Has rings followed as those of a live sound: see RingTracks::followLive.
  void followLive(std::size_t ways) { rings_.followLive(ways); }
  /// Limits how many recoils are heard: see SoundingBodies::limitRecoils.
  void limitRecoils(std::size_t most) { bodies_.limitRecoils(most); }
  /// Has steps of contacts that last longer (s, on the samples) be sent in parts, each as a sound.
  void limitSteps(double longest) { longestStep_ = longest; }
  Status moveBody(BodyId id, const ListenerPose& pose);  ///< as Synth::moveBody
  /// Adds the bodies whose motion is of use, as they ring.
  void addRinging(std::vector<BodyId>& bodies) const { rings_.addRinging(bodies); }
  /// The clock of the simulation leaps by so much (s); what rings goes on.
  void leap(double seconds) { rings_.leap(seconds); }
  /// Schedules how rings are heard of which all is known at `time` (s), as Synth::advanceTo.
  void advanceTo(double time, const SampleShift& shift, SoundSink& sink) {
    if (!released_.empty()) undampReleased(time, shift, sink);
    stretch_ = std::clamp(shift.stretch, kLeastStretch, kMostStretch);
    rings_.advance({time, shift, sink});
  }

  /// Schedules one event. Nothing comes, and the event is counted, if it is inaudible or invalid.
  void schedule(const ImpulseEvent& event, const SampleShift& shift, SoundSink& sink);

  /// Schedules one step of a lasting contact: first the changes that it makes to the damping of
  /// bodies that ring, as excitations without a pulse, then the sound of either body if it slides
  /// or rolls over bumps. Steps come in order of time.
  void updateContact(const ContactState& contact, const SampleShift& shift, SoundSink& sink);
  /// Schedules what contacts of the same time add up to (LastingDetail::heard), once all are known;
  /// a contact of a later time does likewise.
  void finishMoment(SoundSink& sink) { heard_.close(sink); }
  /// True if the scheduler itself chooses which lasting contacts have voices
  /// (LastingDetail::heard).
  bool choosesSlides() const { return choosesSlides_; }
  /// Schedules the changes of damping alone, and ends the slide if there is one.
  void updateDamping(const ContactState& contact, const SampleShift& shift, SoundSink& sink);

  /// Rank of a lasting contact's possible loudness, for comparison with others: N s over m to the
  /// nearest listener, higher for a contact that slides already; 0 if it does not slide.
  double slideRank(const ContactState& contact);
  /// True if a lasting contact may be heard: a body that rings or is not smooth has been set.
  bool hearsContacts() const { return bodies_.anyModes() || bodies_.anyTexture(); }

  /// Pa, at any listener, of what was scheduled last, heard or not: ContactPropagation::peak.
  double lastPeak() const { return propagation_.peak(); }
  const SoundPaths& paths() const { return *paths_; }
  const SynthCounters& counters() const { return counters_; }
  ContactEnergy contactEnergy(double time) const { return coupled_.energyAt(time); }
  /// Sets the counters back to earlier ones: what was scheduled since is counted elsewhere.
  void setCounters(const SynthCounters& earlier) { counters_ = earlier; }
  double leadTime(double contactDuration) const;            ///< as Synth::leadTime
  double contactDuration(const ImpulseEvent& event) const;  ///< as Synth::contactDuration

 private:
  /// One step of a contact that slides or rolls.
  struct SlideStep {
    const ContactState& contact;
    const SampleShift& shift;
    Slide& slide;
    /// As the slide's drive takes it, with LastingDetail::heard.
    const ContactDrive::Step* drive = nullptr;
  };

  void scheduleImpulse(const ImpulseEvent& event, const SampleShift& shift, SoundSink& sink);
  void reject(std::uint64_t SynthCounters::*reason);
  bool isHeard(const ContactSource& source, const ScheduledSound& sound);
  ContactSource sourceOf(const ImpulseEvent& event, const SoundingBody& body, double rings = 1.0);
  const CoupledImpacts::Course* courseOf(const ImpulseEvent& event);
  void damp(const ContactState& contact, const SampleShift& shift, SoundSink& sink);
  std::optional<std::int64_t> dampedFrom(double time, const Vec3& place, const SampleShift& shift);
  void undampReleased(double time, const SampleShift& shift, SoundSink& sink);
  bool updateModes(const ContactState& contact, bool first, std::int64_t sample);
  void updateSlide(const ContactState& contact, const SampleShift& shift, SoundSink& sink);
  void hearSlide(const ContactState& contact, const SampleShift& shift, SoundSink& sink);
  void hearRinging(const SlideStep& step, SoundSink& sink);
  bool estimate(const SlideStep& step);
  void sound(const SlideStep& step, SoundSink& sink);
  bool rings(const ContactState& contact) const;
  /// A part of a step that has a sound of its own.
  struct SlidePart {
    std::size_t index = 0;
    std::size_t count = 1;
    std::span<const PulseNode> nodes;
  };
  void scheduleSlide(const SlideStep& step, bool first, SoundSink& sink);
  void schedulePart(const SlideStep& step, bool first, const SlidePart& part, SoundSink& sink);
  bool isInaudible(const ContactState& contact, double loudest);
  bool isInaudible(const ContactState& contact, double loudest, bool first);

  std::shared_ptr<const SoundPaths> paths_;
  const SynthSettings& settings_;  // settings of paths_
  ListenerTracks listeners_;
  ModalExciter exciter_;
  SoundingBodies bodies_;
  ContactDurations durations_;
  CoupledImpacts coupled_;
  ContactPropagation propagation_;
  SlideTracker slides_;
  RingTracks rings_;
  NoisePropagation noise_;
  HeardSlides heard_;
  HeardClicks heardClicks_;
  bool choosesSlides_;
  /// Bodies that what is gone has damped, and their modes: they ring freely from the next sound on.
  std::vector<std::pair<ModalExciter::Damped, const ResonatorSet*>> released_;
  double longestStep_ = std::numeric_limits<double>::infinity();  // s
  std::vector<PulseNode> partNodes_;
  double stretch_ = 1.0;  // how long a second of the simulation lasts on the samples, s
  SynthCounters counters_;
};

}  // namespace carom::audio
