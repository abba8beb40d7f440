#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

#include "audio/dsp/resonator_kernels.h"
#include "audio/synthesis/modal_excitation.h"

namespace carom::audio {

/// How the modes of a ringing body are heard over one path from a moment on: complex factors, mode
/// by mode, and how fast the body's time goes by.
struct RingMotion {
  /// Real parts of the factors, then as many imaginary ones; padding behind the modes in both.
  std::span<const double> transfers;
  std::uint32_t length = 0;  ///< samples over which the factors change to these
  double rate = 1.0;         ///< seconds of the body in a second of the receiver
};

/// The modes of one body as one channel hears them over one path, while the body or the listener
/// moves.
///
/// A mode sounds as Re(H A): A is its free oscillation, in Pa as it would be heard 1 m away in the
/// mean over all directions, and H the factor by which it is heard otherwise (distance, direction,
/// walls, ear). Over a stretch H changes linearly, and A goes on with its poles to the power of the
/// rate of the body's time, which is the Doppler effect. Where the stretch begins, H = H0 and A =
/// A0; so there are resonators that begin with H0 A0, and others that begin with the change (H1 -
/// H0) A0, and their output grows over the stretch from nothing. A and H are kept apart from the
/// resonators, since a mode that is not heard now, at a node of its pattern, may be later.
/// [one thread; only `reserve` allocates]
class MovingRing {
 public:
  explicit MovingRing(std::pmr::memory_resource* memory) : states_(memory), numbers_(memory) {}
  MovingRing(MovingRing&&) noexcept = default;

  /// Makes room for that many resonators.
  void reserve(std::size_t count);

  /// Begins with silence of the first `count` resonators of a set, heard as `motion` says.
  void begin(const ResonatorSet& set, std::size_t count, const RingMotion& motion) noexcept;
  /// Changes the coefficients (a1, then a2), at the sample `now` as all that follows.
  void damp(std::span<const double> taps, std::int64_t now) noexcept;
  void move(const RingMotion& motion, std::int64_t now) noexcept;
  /// Adds the oscillations of resonators of the set's own, of which the last two samples were y
  /// (those of now - 1, then those of now - 2), heard and tuned as `motion` says.
  void join(std::span<const double> y, const RingMotion& motion, std::int64_t now) noexcept;
  /// The same of what is heard as the ring is now, and not tuned.
  void join(std::span<const double> y, std::int64_t now) noexcept;
  /// Goes on, in place of silence, with the sound of resonators with its own coefficients, of which
  /// the last two samples were y, heard as the ring is now.
  void adopt(std::span<const double> y, std::int64_t now) noexcept;

  /// Silences what is below the threshold (Pa); to be called at least once in 128 samples. Returns
  /// false if nothing is left, now or for the motion to come.
  bool settle(const ResonatorKernels& kernels, double threshold, std::int64_t now) noexcept;
  /// Adds the next samples, from `now` on: at most kMostSamples.
  void ring(const ResonatorKernels& kernels, std::int64_t now, std::span<double> out) noexcept;
  static constexpr std::size_t kMostSamples = 64;

  /// Sets to 0 what is not finite, or beyond `most`.
  void forgetAbove(double most) noexcept;
  std::size_t active() const { return active_; }

 private:
  using Complex = std::complex<double>;

  void add(std::size_t mode, const Complex& pole, std::span<const double> y,
           const Complex& heard) noexcept;
  void setPoles(std::span<const double> a1, std::span<const double> a2) noexcept;
  void advance(std::int64_t now) noexcept;
  void restart() noexcept;
  bool forgetBelow(double threshold) noexcept;
  Resonators resonators(std::span<double> y) const noexcept;

  const ResonatorSet* set_ = nullptr;
  std::size_t count_ = 0;
  std::size_t modes_ = 0;
  std::size_t active_ = 0;  // only the first so many of the resonators may sound
  /// The state of a mode at the sample since_.
  struct State {
    Complex oscillation;  // A
    Complex heard;        // H
    Complex next;         // H at the end of the stretch
    Complex logPole;      // logarithm of its pole in a sample, at a rate of 1
  };
  std::pmr::vector<State> states_;
  std::int64_t since_ = 0;
  double length_ = 0.0;  // samples of the stretch from since_ on; 0: nothing changes
  double rate_ = 1.0;
  std::pmr::vector<double> numbers_;  // of which these are thirds, one array behind the other:
  std::span<double> tuned_;           // a1, a2
  std::span<double> y_;               // y1, y2
  std::span<double> change_;          // y1, y2
  std::array<double, kMostSamples> growing_{};
};

}  // namespace carom::audio
