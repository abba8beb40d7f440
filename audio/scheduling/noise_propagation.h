#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "audio/model/acceleration_noise.h"
#include "audio/model/third_octaves.h"
#include "audio/propagation/listener_tracks.h"
#include "audio/propagation/sound_paths.h"

namespace carom::audio {

/// Carries the noise of a contact's force to all channels, as powers by third octaves: what
/// ContactPropagation and RadiationFilter do with each impulse of it. The two bodies of a contact
/// are pushed by the same force, so their sounds add up as pressures; those over different paths as
/// powers. Heads are not known here, and listeners stand while the sound is under way, which moves
/// them by centimetres. [one thread]
class NoisePropagation {
 public:
  /// The tracks must outlive it.
  NoisePropagation(std::shared_ptr<const SoundPaths> paths, const ListenerTracks& tracks);

  /// Computes what is heard of a force (N^2) at `time` (s) that pushes one or two bodies, whose
  /// strikes are those of an impulse of 1 N s.
  void propagate(double time, std::span<const Strike> strikes, const BandPowers& force);

  /// Returns an upper bound of `overHearing` after the same `propagate`, at a small part of its
  /// cost.
  double boundOverHearing(double time, std::span<const Strike> strikes, const BandPowers& force);

  /// Pa^2, by channel and third octave: kThirdOctaves for each channel; behind them those of what
  /// is sent into the reverberation, if there is one.
  std::span<const double> powers() const { return powers_; }
  std::size_t channelCount() const { return powers_.size() / kThirdOctaves; }
  double power() const { return power_; }  ///< Pa^2, the sum of all
  double delay() const { return delay_; }  ///< s, mean over the channels
  /// Loudest third octave of any channel over the threshold of hearing, as a ratio of powers.
  double overHearing() const { return overHearing_; }
  /// Sum of the third octaves over the threshold of hearing, of the loudest channel.
  double loudness() const { return loudness_; }

 private:
  /// A body as it is heard over one path.
  struct Ray {
    double gain = 0.0;    // Pa s per N/s
    double near = 0.0;    // 1/s: speed of sound over distance
    double corner = 0.0;  // 1/s: speed of sound over radius
    double delay = 0.0;   // s
    double air = 0.0;     // m, over which the air absorbs
  };
  Ray rayOf(const Strike& strike, std::size_t channel, const Image* image) const;
  Ray sendOf(const Strike& strike) const;
  void add(std::span<const Ray> rays, std::span<const double> walls,
           std::span<double> powers) const;
  BandPowers withAir(BandPowers walls, double distance) const;
  void addTogether(const Ray& one, const Ray& other, std::span<const double> walls,
                   std::span<double> powers) const;
  void place(double time);
  void rate();

  std::shared_ptr<const SoundPaths> paths_;
  const ListenerTracks& tracks_;
  BandPowers air_{};                           // 1/m, attenuation of the energy in the air
  std::vector<BandPowers> walls_;              // by chain: squares of what the walls reflect
  std::vector<ListenerTracks::Place> places_;  // by channel
  double placedAt_ = 0.0;                      // s, of places_, if there are any
  std::uint64_t placedAfter_ = 0;              // ListenerTracks::changes
  const BandPowers* force_ = nullptr;
  std::vector<double> powers_;
  double power_ = 0.0;
  double delay_ = 0.0;
  double overHearing_ = 0.0;
  double loudness_ = 0.0;
};

}  // namespace carom::audio
