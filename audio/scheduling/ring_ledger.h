#pragma once

#include <map>
#include <span>
#include <vector>

#include "audio/synthesis/modal_excitation.h"
#include "carom/audio/impulse_event.h"
#include "carom/audio/synth_settings.h"

namespace carom::audio {

/// Follows the energy of ringing bodies from the blows that gave it: what they radiate, what is
/// absorbed, what is left. Each blow counts by itself, as if the body had been at rest: on average,
/// over the phases in which blows meet a ring, that is so. [one thread]
class RingLedger {
 public:
  /// Gives the modes of a body so much energy (J, one for each resonator) at a time (s).
  void add(BodyId body, const ResonatorSet& resonators, double time,
           std::span<const double> energies);
  /// Sets what lasting contacts add to the decay rates (1/s) of these modes of a body, from `time`
  /// (s) on; empty: nothing touches it.
  void damp(BodyId body, const ResonatorSet& resonators, double time,
            std::span<const double> rates);

  /// Closes the books of a body that is removed: it rings on freely to its end, and counts in
  /// removed().
  void forget(BodyId body);

  const RingEnergy& removed() const { return removed_; }  ///< sum over bodies that were removed
  /// Returns what has become of the energy by `time` (s), body by body, in order of their numbers.
  std::vector<RingEnergy> at(double time) const;

 private:
  struct Ring {
    const ResonatorSet* resonators = nullptr;  // null until it is struck
    double time = 0.0;                         // s, up to which the energies are known
    std::vector<double> energies;              // J, one for each mode
    std::vector<double> damping;               // 1/s, of lasting contacts; empty: none
    const ResonatorSet* next = nullptr;        // that it will have once it is struck again
    std::vector<double> nextDamping;           // 1/s, of these
    RingEnergy sum;                            // all but what remains
  };
  static void advance(Ring& ring, double time);

  std::map<BodyId, Ring> rings_;
  RingEnergy removed_;
};

}  // namespace carom::audio
