#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <carom/audio/impulse_event.h>
#include <carom/audio/material.h>
#include <carom/audio/room.h>

namespace carom {

/// Hearing begins at 20 uPa (ISO 389-7 at 1 kHz, rounded); 120 dB above it is 20 Pa.
inline constexpr double kHearingThreshold = 20e-6;  ///< Pa

/// Radius in m that larger bodies are filtered with.
inline constexpr double kLargestFilteredRadius = 30.0;

/// The impulse of an event that decides its sound.
enum class ImpulseChoice : std::uint8_t {
  physical,  ///< ImpulseEvent::impulse
  applied,   ///< ImpulseEvent::appliedImpulse, if the mechanics has given one
};

/// The model by which a mode of vibration becomes pressure.
enum class ModalRadiation : std::uint8_t {
  /// By ModeRadiation::multipoles: each mode as loud in each direction as it physically is. A mode
  /// without multipoles is a monopole.
  directional,
  /// By the volume velocity of each mode alone. Bending modes move no volume, and are hardly heard.
  monopole,
  /// Alike for all modes of a body, as if its whole surface moved outwards together by the same
  /// energy: the modes' ratios and directions are not physical, and the sum is too loud.
  constant,
};

/// The way in which an impact makes a body ring.
enum class RingingContact : std::uint8_t {
  /// The modes take the force of a contact between rigid bodies, as if they did not give way: too
  /// loud where a body is light and lithe beside what hits it.
  pressed,
  /// Both bodies' modes give way while the contact's force acts: the force, its duration and what
  /// the modes take follow from the contact's stiffness, the bodies' mass and their modes together.
  /// No impact gives modes more energy than approaches. Impacts without ImpulseEvent::hasOtherPose
  /// leave out the modes of the other body.
  coupled,
};

/// The course of a contact force over time. See Pulse.
enum class PulseShape : std::uint8_t {
  hertz,              ///< the elastic contact of Hertz itself
  halfSine,           ///< pi/2 sin(pi u)
  gaussian,           ///< exponent 10, unit impulse
  mitchellNetravali,  ///< the cubic of Mitchell & Netravali 1988, B = C = 1/3; negative at its ends
  courseGaussian      ///< pi/2 exp(-6 (u - 1/2)^2): as gaussianPulse(), 13.7 % too much impulse
};

/// The way in which a pulse becomes samples.
enum class Sampling : std::uint8_t {
  bandLimited,  ///< the part of the pulse that samples can hold, at its exact time
  naive,        ///< the pulse's value at each sample: aliases where contacts are short
};

/// The model by which a body's acceleration becomes pressure.
enum class Radiation : std::uint8_t {
  exact,    ///< a rigid sphere at any frequency and distance
  compact,  ///< the limit of `exact` for long wavelengths, far away
};

/// Simplifications to compare the model with, for measuring what each costs and how far off it is.
/// An application leaves them alone: as they are here, all are exact.
struct ComparisonSettings {
  PulseShape pulse = PulseShape::hertz;
  Sampling sampling = Sampling::bandLimited;
  Radiation radiation = Radiation::exact;
};

/// The way in which lasting contacts, those that slide or roll, become sound.
enum class LastingDetail : std::uint8_t {
  /// Each as the train of impulses that its bumps give. What is scaled, compared or measured is
  /// this.
  exact,
  /// As much as is heard of them: what is 20 dB below the threshold of hearing in every third
  /// octave, or masked by the others, makes no sound; the loudest SynthSettings::slideVoices are
  /// exact, all others together are noise of their third octaves. As `exact` with heads or
  /// comparison models.
  heard,
};

/// The parts that a sound is the sum of.
enum class Stem : std::uint8_t {
  clicks,    ///< the recoil of bodies from impacts
  rings,     ///< vibration that impacts have caused
  contacts,  ///< all that lasting contacts give: recoil, and vibration that they have caused
};
inline constexpr std::size_t kStems = 3;  ///< number of stems

struct SynthSettings {
  double sampleRate = 48000.0;  ///< Hz, 8000 to 192000
  ImpulseChoice impulse = ImpulseChoice::physical;
  Medium medium = {};
  /// Pa. A click is left out and counted if its peak and that of its reverberation stay below this
  /// pressure at every listener.
  double audibleThreshold = kHearingThreshold;

  /// Contacts that lose energy last longer and are skewed: Pulse::dissipativeHertz at the event's
  /// own restitution, instead of `comparison.pulse`.
  bool dissipative = false;
  ModalRadiation modalRadiation = ModalRadiation::directional;
  RingingContact ringingContact = RingingContact::coupled;
  /// Loss factor, dimensionless, of the contact between two bodies that press on each other: how
  /// much of a mode's energy at the contact it absorbs (ModalExciter). 0: lasting contacts damp
  /// nothing.
  double contactLoss = 0.1;
  bool doppler = true;  ///< lets the path through the air change while a contact lasts
  /// Lets the air absorb sound on its way (airAttenuation of `medium`), the high frequencies most;
  /// where it would take less than 0.5 dB at 16 kHz (1.4 m in ordinary air) it is left out.
  bool airAbsorption = true;

  Room room = {};  ///< no reflectors: open air, which costs nothing
  std::optional<ReverbSettings> reverb =
      std::nullopt;  ///< reverberation of the same room; none costs nothing

  ComparisonSettings comparison = {};
  LastingDetail lasting = LastingDetail::exact;
  /// Contacts that are exact where LastingDetail is `heard`: the loudest, at each moment.
  std::size_t slideVoices = 4;
  /// Renders each Stem beside the whole, which stays the same to the bit; their sum is the whole to
  /// rounding. Of a Synth alone: engines that play do without.
  bool stems = false;
};

/// Counts of what became of events and lasting contacts. A Synth has room for everything, so those
/// from `stolen` to `slidesLeftOut` stay 0 there; they count what a real-time engine (VoiceBudget)
/// leaves out.
///
/// Each event that is scheduled has one fate: it is `immovable`, `rejected`, or one of `events`;
/// and each of these is heard, left out or lost, or still waits:
///
///     events = heard + inaudible + masked + stolen + overBudget + noBus + tooLong + ringsLeftOut
///              + lost + waitingEvents(counters)
///
/// The fate of an event that clicks and rings is that of its click. `late`, `rings`, `undersampled`
/// and `modalVoicesExhausted` say more of events that are counted elsewhere.
struct SynthCounters {
  std::uint64_t events = 0;           ///< scheduled events of bodies that can move or ring
  std::uint64_t rings = 0;            ///< `events` that made a body ring audibly
  std::uint64_t immovable = 0;        ///< shares of bodies that neither move nor ring: silent
  std::uint64_t inaudible = 0;        ///< `events` left out: below the threshold at every listener
  std::uint64_t late = 0;             ///< `events` that began before the next sample to be rendered
  std::uint64_t undersampled = 0;     ///< `events` sampled naively, shorter than 4 samples: aliased
  std::uint64_t rejected = 0;         ///< never sounded: the sum of the five below that say why
  std::uint64_t slides = 0;           ///< steps in which a body that slides or rolls is heard
  std::uint64_t inaudibleSlides = 0;  ///< such steps left out: below the threshold everywhere
  std::uint64_t stolen = 0;      ///< events left out: the quietest, where more waited than voices
  std::uint64_t overBudget = 0;  ///< events left out: the quietest, where they would cost too much
  std::uint64_t noBus = 0;       ///< events left out: more sizes and paths at once than buses
  std::uint64_t tooLong = 0;  ///< events left out: contact longer than VoiceBudget::longestContact
  /// Rings left out, by channel and path: more bodies ring than is allowed.
  std::uint64_t modalVoicesExhausted = 0;
  std::uint64_t slidesLeftOut = 0;  ///< slides left out: more slide at once than is allowed
  // `rejected`, by reason:
  /// A number of the event is not finite, or its orientation not of unit length.
  std::uint64_t rejectedNotFinite = 0;
  std::uint64_t rejectedUnknownBody = 0;  ///< a body was never set, was refused, or is removed
  /// Nothing approaches, or no mass stands against it: a speed or mass not above 0, a radius below.
  std::uint64_t rejectedNoContact = 0;
  std::uint64_t rejectedTooLong = 0;  ///< the contact would last more than 20 s
  /// Samples or pressures cannot hold its time, place or force: it could exceed 1e10 Pa.
  std::uint64_t rejectedTooFar = 0;
  // Steps of contacts, where SynthSettings::lasting is `heard`; `inaudibleSlides` counts such that
  // are below hearing.
  std::uint64_t slidesInBed = 0;   ///< heard as noise with others, not one by one
  std::uint64_t maskedSlides = 0;  ///< left out: too quiet beside others
  /// `events` left out where SynthSettings::lasting is `heard`: too quiet beside others.
  std::uint64_t masked = 0;
  std::uint64_t heard = 0;  ///< `events` whose sound has begun
  /// `events` whose sound was dropped while it waited, was not finite, or came when it was over.
  std::uint64_t lost = 0;
  std::uint64_t ringsLeftOut = 0;  ///< `events` that only ring, left out: see modalVoicesExhausted
  std::uint64_t rejectedSlides = 0;  ///< steps of contacts with a number out of range: not heard
  /// Frames of sounds that were not finite, or beyond 1e30 Pa, and so left out as they began. No
  /// event that is scheduled gives such; it would cost its own instant, and nothing after it.
  std::uint64_t silencedFrames = 0;
};
/// Energy in J that impacts have given to the modes of one body, and what has become of it, each
/// impact by itself: given = radiated + absorbed + remaining.
struct RingEnergy {
  BodyId body = 0;
  double given = 0.0;
  double radiated = 0.0;   ///< away as sound, by ModeRadiation::decayRate
  double absorbed = 0.0;   ///< by the body itself, and by what lay on it
  double remaining = 0.0;  ///< rings still
};

/// Energy in J of the impacts that were solved together with modes (RingingContact::coupled). What
/// approaches is what parts again, what the modes have got, what was damped meanwhile and what the
/// contacts have lost.
struct ContactEnergy {
  std::uint64_t impacts = 0;
  /// `impacts` in which the mechanics' impulse would take more energy than the modes leave: what
  /// rings gets no more than there is.
  std::uint64_t bound = 0;
  double approach = 0.0;                ///< of the bodies' relative motion along the normal, before
  double parting = 0.0;                 ///< of the same, after
  double modes = 0.0;                   ///< in the modes of both bodies when they part
  double damped = 0.0;                  ///< taken from the modes by their damping until they part
  double contacts = 0.0;                ///< lost in the contacts
  std::vector<RingEnergy> bodies = {};  ///< what has become of `modes`, by body
  RingEnergy removed;                   ///< the same, of all bodies that were removed; `body` is 0
};
/// Number of `events` whose sound has yet to begin.
std::uint64_t waitingEvents(const SynthCounters& counters);
SynthCounters& operator+=(SynthCounters& sum, const SynthCounters& more);
inline SynthCounters operator+(SynthCounters sum, const SynthCounters& more) {
  return sum += more;
}

}  // namespace carom
