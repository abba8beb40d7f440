#pragma once

#include <cstddef>
#include <deque>

#include "carom/audio/material.h"
#include "carom/audio/result.h"
#include "carom/audio/vector.h"

namespace carom::audio {

/// The quantities of a deforming body that move the air, at one instant.
struct DeformingState {
  double volume = 0.0;           ///< m^3, enclosed
  Vec3 position = Vec3::Zero();  ///< m, world frame, of its middle
  /// m^4/s, world frame: volume plus added volume, times velocity; RigidRadiator::dipole is the
  /// same of the acceleration.
  Vec3 dipole = Vec3::Zero();
};

struct DeformingSettings {
  double step = 0.0;            ///< s, > 0, between states, of which the first is at time 0
  double sampleRate = 48000.0;  ///< Hz, > 0, of the sound that is computed
  Medium medium = {};
};

/// The sound of a body that deforms, and is small against the wavelength: monopole of its volume
/// and dipole of its motion,
///
///     p = rho / (4 pi) (V'' / r + n . D'' / (r c) + n . D' / r^2)  at t - r / c
///
/// (Pierce 1989, Acoustics, sections 4.1 and 4.3), n from the body to the listener; a distance
/// below a millimetre counts as one. The states are taken for samples of a band-limited signal:
/// derivatives are of eighth order in the step (1 % off at half of the steps' Nyquist frequency),
/// and their values are resampled by a windowed sinc (Nuttall's four terms, -93 dB; it falls off
/// from 80 % of the lower of both Nyquist frequencies on). Before the first state everything is as
/// in that state. [one thread]
class DeformingSource {
 public:
  /// Errors: settings out of range.
  static Result<DeformingSource> create(const DeformingSettings& settings);

  /// Adds the next state.
  void add(const DeformingState& state);
  /// Time in s after the departure of sound up to which states are needed for it.
  double lookahead() const;

  struct Heard {
    double pressure = 0.0;              ///< Pa
    Vec3 towardsSource = Vec3::Zero();  ///< m, world frame, from the ear to the source
  };
  /// Returns the sound at `ear` (m, world frame) and `time` (s). Right if there are states until
  /// `lookahead` after that; with fewer, the last state is held.
  Heard at(const Vec3& ear, double time) const;

  /// Drops states that are needed only for sound that left before `time` (s).
  void forgetBefore(double time);

 private:
  /// The source strengths of a state.
  struct Drive {
    double monopole = 0.0;     // m^3/s^2: V''
    Vec3 near = Vec3::Zero();  // m^4/s^2: D'
    Vec3 far = Vec3::Zero();   // m^4/s^3: D''
  };

  explicit DeformingSource(const DeformingSettings& settings);
  const DeformingState& state(std::ptrdiff_t index) const;
  Drive driveAt(std::ptrdiff_t index) const;
  Vec3 placeAt(double time) const;
  std::ptrdiff_t end() const { return first_ + std::ssize(states_); }

  DeformingSettings settings_;
  double period_;             // s, of the lower of both rates
  std::ptrdiff_t first_ = 0;  // index of the first state that is kept
  std::deque<DeformingState> states_;
  std::deque<Drive> drives_;  // sources of states_, without the last ones, which await later states
};

}  // namespace carom::audio
