#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "carom/audio/result.h"

namespace carom::lab {

/// The limits of a recording that can be analysed.
inline constexpr double kShortestTap = 0.05;    ///< s
inline constexpr double kLowestTapRate = 8000;  ///< Hz
inline constexpr double kLongestTapFile = 600;  ///< s

/// A sound file with a tap in it.
struct TapRecording {
  std::string name;                           ///< of the file, for messages
  double sampleRate = 0.0;                    ///< Hz
  std::vector<std::vector<double>> channels;  ///< 1.0: full scale
};

/// Reads a sound file: WAV, FLAC and what else libsndfile knows. Errors, each one sentence that
/// begins with the file's name: it is missing or no sound, has fewer than kLowestTapRate samples a
/// second, is shorter than kShortestTap or longer than kLongestTapFile, is silent, or has samples
/// that are not finite. [any thread; blocks on the disk]
Result<TapRecording> readTap(const std::filesystem::path& file);

/// One tap: what stands before it, and its ring.
struct TapSegment {
  double sampleRate = 0.0;     ///< Hz
  double onset = 0.0;          ///< s, in the recording
  std::vector<double> before;  ///< the background before the onset, without its mean; may be empty
  /// From the onset on, to the next blow or to the end, without the mean of the background.
  std::vector<double> ring;
  /// Index in `ring` from which on it can be analysed: clipping and the blow itself are over.
  std::size_t begin = 0;
  std::size_t clipped = 0;  ///< samples at full scale after the onset

  double beginTime() const { return static_cast<double>(begin) / sampleRate; }  ///< s
  /// The part of `ring` that can be analysed.
  std::span<const double> free() const { return std::span(ring).subspan(begin); }
};

/// Finds the loudest tap in one channel of a recording: the level rises by 10 dB, or the recording
/// begins in its ring and falls by 6 dB. Errors (second half of a sentence): no onset; less than
/// kShortestTap after it. [any thread]
Result<TapSegment> findTap(std::span<const double> samples, double sampleRate);

/// Finds the tap in each channel that is not silent. Errors: those of findTap, with the name of the
/// recording, if no channel has one. [any thread]
Result<std::vector<TapSegment>> tapsOf(const TapRecording& recording);

}  // namespace carom::lab
