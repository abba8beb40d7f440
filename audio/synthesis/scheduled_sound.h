#pragma once

#include <span>

#include "audio/model/pulse.h"
#include "audio/model/sphere_mesh.h"
#include "audio/synthesis/click.h"
#include "audio/synthesis/modal_excitation.h"
#include "audio/synthesis/noise_bed.h"

namespace carom::audio {

/// The sound of one body's share of an event, or of one step of a lasting contact, scheduled on the
/// samples of all channels. Borrows its arrays.
struct ScheduledSound {
  double peak = 0.0;                   ///< Pa, upper bound of the clicks at any listener
  std::span<const Click> clicks = {};  ///< empty: no click to hear
  /// Pa, upper bounds of the clicks by channel, over the loudest path; empty without clicks. Not
  /// carried to another thread.
  std::span<const double> peaks = {};
  /// Directions from which binaural channels hear the clicks; empty without heads.
  std::span<const SphereWeights> ears = {};
  std::span<const ModalExcitation> excitations = {};  ///< empty: nothing rings; all of one body
  std::span<const double> taps = {};                  ///< the taps that `excitations` refer to
  /// Nodes that drive all clicks and excitations, if no pulse does. A renderer keeps a copy.
  std::span<const PulseNode> train = {};
  double modalPeak = 0.0;  ///< Pa, estimate for what rings; does not cross to a renderer
  NoiseLevel noise = {};   ///< level of the bed of noise; then there is nothing else
  /// True for the sound of an event, whose fate is counted (SynthCounters); not for a step of a
  /// lasting contact, a change of damping, or the ringing of an event whose click comes apart.
  bool isEvent = false;
};

/// Takes scheduled sounds: a renderer, or a queue to another thread.
class SoundSink {
 public:
  /// Takes a sound, whose arrays are valid during the call only.
  virtual void add(const ScheduledSound& sound) = 0;

 protected:
  ~SoundSink() = default;
};

}  // namespace carom::audio
