#pragma once

#include <unordered_map>

#include "audio/model/pulse.h"
#include "carom/audio/impulse_event.h"
#include "carom/audio/sound_body.h"
#include "carom/audio/synth_settings.h"

namespace carom::audio {

/// The course of the force of impacts over time: how long a contact lasts, and by which pulse.
/// [one thread]
class ContactDurations {
 public:
  /// Keeps a reference to the settings.
  explicit ContactDurations(const SynthSettings& settings) : settings_(settings) {}

  /// Duration in s of the contact of two bodies; 0 if the event has none (nothing approaches, a
  /// radius or the effective mass is out of range).
  double durationOf(const ImpulseEvent& event, const SoundBody& body, const SoundBody& other) const;
  /// Stiffness in N/m^(3/2) of an event's contact: K of F = K d^(3/2) (Johnson 1985, eq. 4.23). The
  /// event has a duration above 0.
  static double stiffnessOf(const ImpulseEvent& event, const SoundBody& body,
                            const SoundBody& other);
  /// The pulse of an event, which lives as long as this object.
  const Pulse& pulseOf(const ImpulseEvent& event) const;

 private:
  /// The pulse of a contact that loses energy.
  struct Lossy {
    Pulse pulse;
    double stretch = 1.0;  // the duration over that of the elastic contact
  };
  const Lossy& lossyOf(const ImpulseEvent& event) const;

  const SynthSettings& settings_;
  mutable std::unordered_map<double, Lossy> lossy_;  // by restitution, made when first needed
};

}  // namespace carom::audio
