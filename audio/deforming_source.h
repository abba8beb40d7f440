#pragma once

#include <cstddef>
#include <deque>

#include "carom/audio/material.h"
#include "carom/audio/result.h"
#include "carom/audio/vector.h"

namespace carom::audio {

/// What a body that deforms does to the air, at one instant.
struct DeformingState {
  double volume = 0.0;           ///< m^3, enclosed
  Vec3 position = Vec3::Zero();  ///< m, world frame, of its middle
  /// m^4/s, world frame: its volume and its added volume times its velocity, as
  /// RigidRadiator::dipole says of its acceleration.
  Vec3 dipole = Vec3::Zero();
};

struct DeformingSettings {
  double step = 0.0;            ///< s, > 0, between states, of which the first is at time 0
  double sampleRate = 48000.0;  ///< Hz, > 0, at which it is listened to
  Medium medium = {};
};

/// The sound of a body that deforms, and is small against the wavelength: monopole of its volume
/// and dipole of its motion,
///
///     p = rho / (4 pi) (V'' / r + n . D'' / (r c) + n . D' / r^2)  at t - r / c
///
/// (Pierce 1989, Acoustics, sections 4.1 and 4.3), n from the body to the listener, who is no
/// nearer than a millimetre. The states are taken for samples of something band-limited:
/// derivatives are of eighth order in the step (1 % off at half of the steps' Nyquist frequency),
/// and what they give is resampled by a windowed sinc (Nuttall's four terms, -93 dB; it falls off
/// from 80 % of the lower of both Nyquist frequencies on). Before the first state everything is as
/// there. [one thread]
class DeformingSource {
 public:
  /// Errors: settings out of range.
  static Result<DeformingSource> create(const DeformingSettings& settings);

  /// The next state.
  void add(const DeformingState& state);
  /// s, beyond when sound leaves for which states are needed.
  double lookahead() const;

  struct Heard {
    double pressure = 0.0;              ///< Pa
    Vec3 towardsSource = Vec3::Zero();  ///< m, world frame, from the ear
  };
  /// At `time` (s) and place (m, world frame). Right if there are states until `lookahead` after
  /// that; with fewer it is as if all stayed as it is.
  Heard at(const Vec3& ear, double time) const;

  /// Sound that left before is not asked for any more.
  void forgetBefore(double time);

 private:
  /// What a state does to the air.
  struct Drive {
    double monopole = 0.0;     // m^3/s^2
    Vec3 near = Vec3::Zero();  // m^4/s^2
    Vec3 far = Vec3::Zero();   // m^4/s^3
  };

  explicit DeformingSource(const DeformingSettings& settings);
  const DeformingState& state(std::ptrdiff_t index) const;
  Drive driveAt(std::ptrdiff_t index) const;
  Vec3 placeAt(double time) const;
  std::ptrdiff_t end() const { return first_ + std::ssize(states_); }

  DeformingSettings settings_;
  double period_;             // s, of the slower of both rates
  std::ptrdiff_t first_ = 0;  // of all, that is kept
  std::deque<DeformingState> states_;
  std::deque<Drive> drives_;  // of the same, but the last that wait for others
};

}  // namespace carom::audio
