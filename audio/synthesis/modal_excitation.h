#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "audio/synthesis/click.h"
#include "carom/audio/impulse_event.h"
#include "carom/audio/modal_model.h"
#include "carom/audio/synth_settings.h"

namespace carom::audio {

/// Bound of a mode's decay rate over its frequency in rad/s: beyond, perturbation is not valid.
inline constexpr double kMostDamping = 0.5;
/// Reach in samples of a ring's rest (ResonatorSet::rest) to either side of its drive.
inline constexpr std::size_t kRestReach = 16;
/// Taps at -kRestReach to kRestReach samples.
template <class Number>
using RestTaps = std::array<Number, 2 * kRestReach + 1>;

/// The modes of a model as resonators at one sample rate, those within the band (kBand) of it.
/// Immutable, to be shared by all bodies of the model. [any thread]
///
/// y[n] = a1 y[n-1] + a2 y[n-2] + b0 x[n] + b1 x[n-1] has the poles exp((-decay +- i w) / rate), so
/// frequency and decay are the mode's own, to rounding.
struct ResonatorSet {
  ResonatorSet(std::shared_ptr<const ModalModel> ofModel, const SynthSettings& settings);

  std::shared_ptr<const ModalModel> model;
  std::uint32_t order = 0;  ///< number among all sets of a layer
  std::size_t modes = 0;    ///< number of modes in it, the first ones of the model
  std::size_t padded = 0;   ///< the length of the arrays: zeros behind the modes
  std::vector<double> a1;
  std::vector<double> a2;
  std::vector<std::complex<double>> pole;  ///< rad/s: -decay + i w damped, one for each mode
  std::vector<double> radiated;            ///< 1/s: the part of the decay that is sound
  /// Factor by which spreading the pulse on the samples (spreadKernel) attenuates each mode.
  std::vector<std::complex<double>> dimming;
  /// Correction for the errors that a mode's resonator, while it is driven, has below and above its
  /// own frequency: for a ring Re(A exp(s t)) the pulse on the samples goes through the taps
  /// Re(A rest) as well. The sum is the mode's response to the pulse at all frequencies of the
  /// band, less its value at 0 Hz; the resonator alone is right at its own frequency, and elsewhere
  /// it differs by the part that the samples fold back, and by how much more its own frequency is
  /// dimmed than others.
  std::vector<RestTaps<std::complex<double>>> rest;
  /// Taps for the pulse itself, 1/s^3: how the volume of the model's residual modes accelerates
  /// after a unit impulse, over the volume that a steady force of 1 displaces. The modes follow the
  /// force as one damped oscillator at ModalModel::residualFrequency does, and radiate as a sphere
  /// that breathes, of the surface's area. 0 where the model has none.
  RestTaps<double> residual{};
};

/// The excitation of a body's modes by one contact, as heard at one receiver, over one path. Like a
/// Click, it is made on the simulation's side and is independent of bodies, listeners and rooms.
///
/// Without a pulse, it is a change of what rings already. A change of damping: from its time on,
/// all resonators of the body have the taps as their a1 and a2. Or a motion of a bank (MovingRing):
/// over `length` samples, the factors by which the modes are heard become the taps; `path` is 0 for
/// a bank of all paths.
struct ModalExcitation {
  Click drive;  ///< the force's pulse and its time; no filters, no buses
  BodyId body = 0;
  const ResonatorSet* resonators = nullptr;
  std::size_t count = 0;    ///< number of resonators: all, or the first ones, padded
  std::size_t taps = 0;     ///< index of its first b0; its b1 begin `count` behind it
  RestTaps<double> rest{};  ///< taps for the pulse itself: ResonatorSet::rest
  bool isLeader = false;    ///< the first of an event that only rings, with which it is heard
  /// True if the ring is followed in its motion: behind its b1, the taps have the factors by which
  /// the modes are heard against the mean over all directions at 1 m, the real parts and then the
  /// imaginary ones. A blow's excitations are followed all, or none.
  bool isFollowed = false;
  std::uint32_t path = 0;    ///< if it is followed: 1 and its index in SoundPaths::paths
  std::uint32_t length = 0;  ///< samples of a motion
  double rate = 1.0;         ///< if it is followed: seconds of the body in a second of the receiver

  bool isMotion() const { return length > 0; }
  bool isDamping() const { return drive.pulse == nullptr && !isMotion(); }
  /// Number of arrays of `count` taps.
  std::size_t arrays() const { return isFollowed ? 4 : 2; }
};

}  // namespace carom::audio
