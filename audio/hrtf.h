#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "audio/sinc_kernel.h"
#include "audio/sphere_mesh.h"
#include "carom/audio/result.h"
#include "carom/audio/vector.h"

namespace carom {

enum class Ear { left, right };

/// What was measured at the ears of a head, for one direction of a distant source.
struct HrtfMeasurement {
  Vec3 direction = -Vec3::UnitZ();             ///< to the source, listener frame, of any length
  std::array<std::vector<float>, 2> response;  ///< left and right, of one length, any unit
  std::array<double, 2> delay = {0.0, 0.0};    ///< samples before the response, left and right
};

/// A set of measurements as a file holds them.
struct HrtfMeasurements {
  double sampleRate = 48000.0;  ///< Hz
  std::vector<HrtfMeasurement> items;
};

struct HrtfSettings {
  /// Of the mean energy of a response: all end where, in every one, less than this follows. What
  /// comes later is mostly the room and the noise of the measurement, and each sample costs.
  double tailEnergy = 1e-2;
};

/// Head-related impulse responses, made ready to render with: what turns the pressure that would
/// be in the middle of the head, were it not there, into the pressure at both ears.
///
/// Each response is split into a delay and a response aligned to its onset (where it first reaches
/// a tenth of its peak), and the two are interpolated each for itself: responses of neighbouring
/// directions that are added as they are would cancel each other where they arrive half a period
/// apart. At a measured direction the result is the measured response.
///
/// What is done to a set:
/// - resampled to the given rate, band-limited;
/// - the delay that all have in common is taken away (`latency` says what is left of it);
/// - cut where the rest of every response holds less than `HrtfSettings::tailEnergy`, and faded
///   out over 16 samples;
/// - scaled by one factor so that the mean energy of a frontal source from 200 Hz to 1 kHz, over
///   both ears, is that of the free field: gain 1;
/// - where nothing was measured within 30 degrees of straight up or straight down, a direction is
///   added there: the mean, of delays and of aligned responses, over the ring that is nearest.
///
/// Not modelled: distance (near the head, within a metre, both level differences and parallax
/// grow), the body below the head, and what a set did not measure: a loudspeaker gives little
/// below some 100 Hz, so levels down there are the set's.
///
/// Frame: the listener's, looking along -Z, +X right, +Y up. Immutable after loading, to be shared
/// between listeners and threads.
class HrtfSet {
 public:
  /// Reads a SOFA file (AES69, convention SimpleFreeFieldHRIR) with libmysofa. Files are not
  /// trusted: whatever is wrong with one becomes an Error that names it.
  /// @param path empty for the default set of libmysofa, MIT's KEMAR, found where it was when Carom
  ///   was built, or else in /usr/share/libmysofa and /usr/local/share/libmysofa
  /// @param sampleRate Hz, 8000 to 384000
  /// Errors: no such file, not a SOFA file, another convention, sizes that contradict each other,
  /// what `create` refuses, and a build without libmysofa. [any thread but the audio thread]
  static Result<HrtfSet> load(const std::filesystem::path& path, double sampleRate,
                              const HrtfSettings& settings = {});

  /// The same from measurements in memory. Refuses: sample rates outside 8000 to 384000 Hz, values
  /// that are not finite, a silent response, lengths that differ or exceed 16384, delays outside 0
  /// to 16384 samples, more than 20000 directions, directions that do not surround the listener,
  /// a tail energy outside 0 to 1.
  /// Of several measurements of one direction the farthest counts (by length of the direction).
  static Result<HrtfSet> create(const HrtfMeasurements& measurements, double sampleRate,
                                const HrtfSettings& settings = {});

  double sampleRate() const { return sampleRate_; }                 ///< Hz
  std::size_t directions() const { return mesh_.points().size(); }  ///< poles added are the last
  const Vec3& direction(std::size_t index) const { return mesh_.points()[index]; }  ///< unit
  const audio::SphereMesh& mesh() const { return mesh_; }

  /// Samples of an aligned response, and of a whole one with its delay in it.
  std::size_t alignedLength() const { return alignedLength_; }
  std::size_t length() const { return length_; }
  /// s, in a whole response as in an aligned one after its delay: the place of the sound that
  /// reaches the middle of the head at time 0, by the mean delay of a frontal source. Subtract it
  /// from the time of arrival at the middle of the head.
  double latency() const { return latency_; }

  /// s, at least 0: by how much the response of one direction is later than its aligned response.
  double delay(std::size_t index, Ear ear) const { return delays_[slot(index, ear)]; }
  /// Dimensionless, `alignedLength` samples.
  std::span<const float> aligned(std::size_t index, Ear ear) const;

  /// Neighbours of a direction (from the listener to the source, listener frame, any length) and
  /// their shares: continuous, see SphereMesh. [any thread; does not allocate]
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

/// The default set at a sample rate, for a binaural listener that names none. Loaded at the first
/// call and shared for as long as somebody holds it. Errors as HrtfSet::load.
/// [any thread but the audio thread: locks, reads a file]
Result<std::shared_ptr<const HrtfSet>> defaultHrtf(double sampleRate);

}  // namespace carom
