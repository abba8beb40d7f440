#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "audio/dsp/sinc_kernel.h"
#include "audio/model/sphere_mesh.h"
#include "carom/audio/result.h"
#include "carom/audio/vector.h"

namespace carom {

enum class Ear { left, right };

/// The responses measured at the ears of a head, for one direction of a distant source.
struct HrtfMeasurement {
  Vec3 direction = -Vec3::UnitZ();             ///< to the source, listener frame, of any length
  std::array<std::vector<float>, 2> response;  ///< left and right, of one length, any unit
  std::array<double, 2> delay = {0.0, 0.0};    ///< samples before the response, left and right
};

/// A set of measurements as a file holds them.
struct HrtfMeasurements {
  static constexpr std::size_t kMostDirections = 20000;
  static constexpr std::size_t kMostSamples = 16384;       ///< of a response
  static constexpr std::size_t kMostTogether = 1U << 25U;  ///< samples of all responses

  double sampleRate = 48000.0;  ///< Hz
  std::vector<HrtfMeasurement> items;
};

struct HrtfSettings {
  /// Share of the mean energy of a response: all responses end where, in every one, less than this
  /// follows. Later samples hold mostly the room and the noise of the measurement, and each sample
  /// costs.
  double tailEnergy = 1e-2;
};

/// Head-related impulse responses, prepared for rendering: they turn the pressure that would be in
/// the middle of the head, were it not there, into the pressure at both ears.
///
/// Each response is split into a delay and a response aligned to its onset (where it first reaches
/// a tenth of its peak), and the two are interpolated separately: responses of neighbouring
/// directions that are added as they are would cancel each other where they arrive half a period
/// apart. At a measured direction the result is the measured response.
///
/// Processing of a set:
/// - it is resampled to the given rate, band-limited;
/// - the delay that all responses have in common is removed (`latency` is the part of it that is
///   left);
/// - responses are cut where the rest of every one holds less than `HrtfSettings::tailEnergy`, and
///   faded out over 16 samples;
/// - they are scaled by one factor so that the mean energy of a frontal source from 200 Hz to
///   1 kHz, over both ears, is that of the free field: gain 1;
/// - where nothing was measured within 30 degrees of straight up or straight down, a direction is
///   added there: the mean, of delays and of aligned responses, over the nearest ring.
///
/// Not modelled: distance (near the head, within a metre, both level differences and parallax
/// grow), the body below the head, and frequencies that a set did not measure: a loudspeaker gives
/// little below some 100 Hz, so levels down there are the set's.
///
/// Frame: the listener's, looking along -Z, +X right, +Y up. Immutable after loading, to be shared
/// between listeners and threads.
class HrtfSet {
 public:
  /// Reads a SOFA file (AES69, convention SimpleFreeFieldHRIR) with libmysofa. Files are not
  /// trusted: any fault of one becomes an Error that names it.
  /// @param path empty for the default set of libmysofa, MIT's KEMAR, found where it was when Carom
  ///   was built, or else in /usr/share/libmysofa and /usr/local/share/libmysofa
  /// @param sampleRate Hz, 8000 to 384000
  /// Errors: no such file, not a SOFA file, another convention, sizes that contradict each other,
  /// what `create` refuses, and a build without libmysofa. [any thread but the audio thread]
  static Result<HrtfSet> load(const std::filesystem::path& path, double sampleRate,
                              const HrtfSettings& settings = {});

  /// Makes a set from measurements in memory. Refuses: sample rates outside 8000 to 384000 Hz,
  /// values that are not finite, a silent response, lengths that differ or exceed 16384, delays
  /// outside 0 to 16384 samples, more than 20000 directions, more than 33.5 million samples of all
  /// responses together (at the wanted rate, if that is the higher one), directions that do not
  /// surround the listener, a tail energy outside 0 to 1. If a direction was measured several
  /// times, the farthest measurement counts (by length of the direction).
  static Result<HrtfSet> create(const HrtfMeasurements& measurements, double sampleRate,
                                const HrtfSettings& settings = {});

  double sampleRate() const { return sampleRate_; }                 ///< Hz
  std::size_t directions() const { return mesh_.points().size(); }  ///< poles added are the last
  const Vec3& direction(std::size_t index) const { return mesh_.points()[index]; }  ///< unit
  const audio::SphereMesh& mesh() const { return mesh_; }

  /// Length in samples of an aligned response, and of a whole one with its delay in it.
  std::size_t alignedLength() const { return alignedLength_; }
  std::size_t length() const { return length_; }
  /// Latency in s of a whole response, and of an aligned one after its delay: the place of the
  /// sound that reaches the middle of the head at time 0, by the mean delay of a frontal source.
  /// Subtract it from the time of arrival at the middle of the head.
  double latency() const { return latency_; }

  /// Delay in s, at least 0, of the response of one direction over its aligned response.
  double delay(std::size_t index, Ear ear) const { return delays_[slot(index, ear)]; }
  /// Returns the delay in s of an ear between directions, against that of the middle of the head.
  double delayBetween(const audio::SphereWeights& where, Ear ear) const noexcept {
    double delay = -latency_;
    for (std::size_t i = 0; i < where.index.size(); ++i)
      delay += where.weight[i] * this->delay(where.index[i], ear);
    return delay;
  }
  /// The aligned response of one direction: dimensionless, `alignedLength` samples.
  std::span<const float> aligned(std::size_t index, Ear ear) const;

  /// Returns the neighbours of a direction (from the listener to the source, listener frame, any
  /// length) and their weights: continuous, see SphereMesh. [any thread; does not allocate]
  audio::SphereWeights lookup(const Vec3& direction) const noexcept {
    return mesh_.weights(direction);
  }

  /// Writes the aligned response between directions to the first `alignedLength` samples of
  /// `response`, for callers that delay by themselves, and returns its delay in s.
  /// [any thread; does not allocate]
  double blendAligned(const audio::SphereWeights& where, Ear ear,
                      std::span<double> response) const noexcept;

  /// Writes the whole response between directions, with its delay in it to fractions of a sample
  /// (windowed sinc, 32 taps: flat within 0.01 dB to 0.42 of the sample rate), to the first
  /// `length` samples of `response`. [any thread; does not allocate]
  void blend(const audio::SphereWeights& where, Ear ear, std::span<double> response) const noexcept;

 private:
  friend class HrtfBuilder;
  explicit HrtfSet(audio::SphereMesh mesh);
  static std::size_t slot(std::size_t index, Ear ear) {
    return 2 * index + static_cast<std::size_t>(ear);
  }

  audio::SphereMesh mesh_;
  audio::SincKernel kernel_;
  double sampleRate_ = 0.0;
  double latency_ = 0.0;
  std::size_t alignedLength_ = 0;
  std::size_t length_ = 0;
  std::vector<double> delays_;
  std::vector<float> aligned_;
};

/// Returns the default set at a sample rate, for a binaural listener that names none. Loaded at the
/// first call and shared for as long as it is in use. Errors as HrtfSet::load.
/// [any thread but the audio thread: locks, reads a file]
Result<std::shared_ptr<const HrtfSet>> defaultHrtf(double sampleRate);

}  // namespace carom
