#pragma once

#include <memory>
#include <numbers>
#include <vector>

#include "carom/audio/contact_state.h"
#include "carom/audio/impulse_event.h"
#include "carom/audio/material.h"
#include "carom/audio/modal_model.h"
#include "carom/audio/sound_body.h"
#include "carom/audio/synth.h"

namespace carom::lab {

// The bodies that sound in the cases of more than one file: an impact, a slide and a bell, each
// with the extremes that it can have. Only for the files of stability_*.cpp.

inline constexpr BodyId kBall = 1;     ///< the body that hits, slides or rolls
inline constexpr BodyId kPartner = 2;  ///< the floor, the other ball or the bell

/// A ball that hits an immovable floor of its material, or another ball, at the origin.
struct Impact {
  double radius = 0.01;     ///< m
  double density = 8000.0;  ///< kg/m^3
  double modulus = 2e11;    ///< Pa
  double speed = 1.0;       ///< m/s
  double restitution = 1.0;
  double time = 0.0;         ///< s
  double otherRadius = 0.0;  ///< m; 0: the floor

  double massOf(double size) const {
    return 4.0 / 3.0 * std::numbers::pi * size * size * size * density;
  }
  Material material() const;
  SoundBody ball() const;
  SoundBody other() const;
  double effectiveMass() const;
  double impulse() const { return (1.0 + restitution) * effectiveMass() * speed; }  ///< N s
  ImpulseEvent event() const;
  ImpulseEvent otherEvent() const;
};

inline constexpr double kWaveLength = 0.002;    ///< m, length of the floor's waves
inline constexpr float kWaveSteepness = 0.02F;  ///< largest slope of the waves

/// A ball that slides without turning, or rolls without sliding, over a floor of waves along x.
struct Slide {
  double sampleRate = 48000.0;  ///< Hz
  double radius = 0.005;        ///< m
  double modulus = 2e11;        ///< Pa
  double speed = 1.0;           ///< m/s
  double load = 5.0;            ///< N
  double step = 1.0 / 240.0;    ///< s, of one ContactState
  double begin = 0.0;           ///< s
  double duration = 0.5;        ///< s
  double distance = 3.0;        ///< m, height of the listener
  bool rolls = false;

  Material material() const;
  double mass() const;
  double length() const { return duration * speed; }
  ContactState stateAt(double time) const;
};

/// A tone that decays.
struct Tone {
  double frequency = 0.0;  ///< Hz
  double decayRate = 0.0;  ///< 1/s

  /// Returns the angular frequency of the damped tone, rad/s.
  double damped() const;
};

inline constexpr double kBellShape = 5.0;     ///< 1/sqrt(kg), of every point, along z
inline constexpr double kBellVolume = 1e-3;   ///< m^2/sqrt(kg)
inline constexpr double kBlowImpulse = 0.01;  ///< N s

/// Returns a tetrahedron that moves along z as a whole, in its one mode.
std::shared_ptr<const ModalModel> bellOf(const Tone& tone);

/// The impact of a grain on a bell: its contact is far shorter than a sample, and the grain itself
/// is silent.
struct Blow {
  Tone tone = {.frequency = 440.0, .decayRate = 1.0};
  double time = 0.0;  ///< s

  ImpulseEvent event() const;
};

/// Gives a synth the bodies of a source. Throws what it refuses.
void setBodies(Synth& synth, const Impact& impact);
void setBodies(Synth& synth, const Slide& slide);
void setBodies(Synth& synth, const Blow& blow);

/// Returns the states of a slide, in order of time.
std::vector<ContactState> statesOf(const Slide& slide);

}  // namespace carom::lab
