#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "audio/contact/coupled_contact.h"
#include "audio/scheduling/contact_duration.h"
#include "audio/scheduling/sounding_bodies.h"
#include "carom/audio/impulse_event.h"
#include "carom/audio/synth_settings.h"

namespace carom::audio {

/// Solves the impacts of bodies that ring (CoupledContact), each once for both of its shares.
/// [one thread]
class CoupledImpacts {
 public:
  struct Course {
    /// u: share of the duration; weight: share of the impulse, of sum 1. Valid until the next call.
    std::span<const PulseNode> nodes;
    double duration = 0.0;  ///< s
    double rings = 1.0;     ///< share of the event's impulse that makes modes ring
  };
  /// Returns the course of the event's contact; null if the modes of the two hardly matter, so that
  /// the contact is that of rigid bodies.
  const Course* courseOf(const ImpulseEvent& event, const SoundingBody& body,
                         const SoundingBody& other);

  /// Sum over all impacts.
  const ContactEnergy& energy() const { return energy_; }

 private:
  bool isSameImpact(const ImpulseEvent& event) const;
  void solve(const ImpulseEvent& event, const SoundingBody& body, const SoundingBody& other);

  CoupledContact contact_;
  std::vector<ContactMode> modes_;
  std::vector<PulseNode> nodes_;
  ImpulseEvent solvedFor_;  // the share for which course_ was found
  bool isCoupled_ = false;
  Course course_;
  ContactEnergy energy_;
};

}  // namespace carom::audio
