#pragma once

#include <cstdint>
#include <optional>

#include <carom/audio/material.h>
#include <carom/audio/reverb_settings.h>
#include <carom/audio/room.h>

namespace carom {

/// Hearing begins at 20 uPa (ISO 389-7 at 1 kHz, rounded); 120 dB above it is 20 Pa.
inline constexpr double kHearingThreshold = 20e-6;  ///< Pa

/// m: larger bodies are filtered as of this radius.
inline constexpr double kLargestFilteredRadius = 30.0;

/// Which of the two impulses of an event sounds.
enum class ImpulseChoice : std::uint8_t {
  physical,  ///< ImpulseEvent::impulse
  applied,   ///< ImpulseEvent::appliedImpulse, if the mechanics has given one
};

/// How a contact force rises and falls. See Pulse.
enum class PulseShape : std::uint8_t {
  hertz,              ///< the elastic contact of Hertz itself: the default
  halfSine,           ///< pi/2 sin(pi u)
  gaussian,           ///< exponent 10, unit impulse
  mitchellNetravali,  ///< the cubic of Mitchell & Netravali 1988, B = C = 1/3; pulls at its ends
  handOut             ///< pi/2 exp(-6 (u - 1/2)^2): as gaussianPulse(), 13.7 % too much impulse
};

/// How a pulse becomes samples.
enum class Sampling : std::uint8_t {
  bandLimited,  ///< what the samples can hold of it, at its exact time
  naive,        ///< its value at each sample: aliases where contacts are short; for comparisons
};

/// How a body's acceleration becomes pressure.
enum class Radiation : std::uint8_t {
  exact,    ///< a rigid sphere's, at any frequency and distance
  compact,  ///< its limit for long wavelengths, far away
};

/// How a mode of vibration becomes pressure.
enum class ModalRadiation : std::uint8_t {
  /// As ModeRadiation::multipoles have it: every mode in every direction as loud as it is. A mode
  /// without them is a monopole.
  directional,
  /// Its volume velocity alone. Bending modes move no volume, and are hardly heard.
  monopole,
  /// Every mode of a body alike, as if its whole surface moved outwards together by the same
  /// energy: the modes' ratios and directions are not physical, and the whole is too loud.
  constant,
};

struct SynthSettings {
  double sampleRate = 48000.0;  ///< Hz, 8000 to 192000
  ImpulseChoice impulse = ImpulseChoice::physical;
  Medium medium = {};
  /// Pa. A click whose peak stays below it at every listener, and whose reverberation does, is left
  /// out, and counted.
  double audibleThreshold = kHearingThreshold;

  PulseShape pulse = PulseShape::hertz;
  /// Contacts that lose energy last longer and are skewed: Pulse::dissipativeHertz at the event's
  /// own restitution, instead of `pulse`.
  bool dissipative = false;
  Sampling sampling = Sampling::bandLimited;
  Radiation radiation = Radiation::exact;
  ModalRadiation modalRadiation = ModalRadiation::directional;
  /// 1, loss factor of what two bodies in lasting contact press together: how much of a mode's
  /// energy at the contact goes into it (RingLayer). 0: touching damps nothing.
  double contactLoss = 0.1;
  bool doppler = true;  ///< the way through the air may change while a contact lasts

  Room room = {};                        ///< no reflectors: open air, which costs nothing
  std::optional<ReverbSettings> reverb;  ///< of the same room; none costs nothing
};

struct SynthCounters {
  std::uint64_t events = 0;     ///< scheduled, of bodies that can move or ring
  std::uint64_t rings = 0;      ///< of `events`, made a body ring that is heard
  std::uint64_t immovable = 0;  ///< shares of bodies that neither move nor ring: silent
  std::uint64_t inaudible = 0;  ///< of `events`, left out: below the threshold at every listener
  std::uint64_t late = 0;       ///< of `events`, began before the first sample still to be rendered
  std::uint64_t undersampled =
      0;  ///< of `events`, contact shorter than 4 samples where sampling is naive: aliased
  std::uint64_t rejected = 0;  ///< not finite, unknown body, no approach, over 20 s: never sounded
  std::uint64_t slides = 0;    ///< steps in which a body that slides or rolls is heard
  std::uint64_t inaudibleSlides = 0;  ///< likewise, left out: below the threshold everywhere
};

}  // namespace carom
