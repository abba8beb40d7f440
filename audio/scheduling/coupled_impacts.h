#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "audio/contact/coupled_contact.h"
#include "audio/scheduling/contact_duration.h"
#include "audio/scheduling/ring_ledger.h"
#include "audio/scheduling/sounding_bodies.h"
#include "carom/audio/impulse_event.h"
#include "carom/audio/synth_settings.h"

namespace carom::audio {

/// Solves the impacts of bodies that ring (CoupledContact), each once for both of its shares.
/// [one thread]
class CoupledImpacts {
 public:
  explicit CoupledImpacts(double sampleRate) : sampleRate_(sampleRate) {}

  struct Course {
    /// u: share of the duration; weight: share of the impulse, of sum 1; kMostImpactNodes at most.
    /// Valid until the next call.
    std::span<const PulseNode> nodes;
    double duration = 0.0;  ///< s
    double rings = 1.0;     ///< share of the event's impulse that makes modes ring
  };
  /// Returns the course of the event's contact; null if the modes of the two hardly matter, so that
  /// the contact is that of rigid bodies.
  const Course* courseOf(const ImpulseEvent& event, const SoundingBody& body,
                         const SoundingBody& other);

  /// Sets what lasting contacts add to the decay rates (1/s) of a body's modes, for the books.
  void damp(BodyId body, const ResonatorSet& resonators, double time,
            std::span<const double> rates) {
    rings_.damp(body, resonators, time, rates);
  }
  void forget(BodyId body) { rings_.forget(body); }  ///< one that is removed
  /// Has an impact like the last one count as another: the sound begins anew.
  void forgetLast() { solvedFor_ = {}; }
  /// Sum over all impacts, as of a time (s).
  ContactEnergy energyAt(double time) const;

 private:
  bool isSameImpact(const ImpulseEvent& event) const;
  void solve(const ImpulseEvent& event, const SoundingBody& body, const SoundingBody& other);
  void keepNodes(const ContactCourse& course);
  void enter(const ImpulseEvent& event, const SoundingBody& body, const SoundingBody& other,
             const ContactCourse& course);

  double sampleRate_;  // Hz
  CoupledContact contact_;
  std::vector<ContactMode> modes_;
  std::vector<PulseNode> nodes_;
  ImpulseEvent solvedFor_;  // the share for which course_ was found
  bool isCoupled_ = false;
  Course course_;
  ContactEnergy energy_;
  RingLedger rings_;
};

}  // namespace carom::audio
