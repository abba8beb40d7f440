#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "lab/report/report.h"
#include <nlohmann/json_fwd.hpp>

namespace carom::lab {

using namespace scenes;

/// Base64 (RFC 4648, section 4) of bytes. [any thread]
std::string base64(std::string_view bytes);

/// Returns what the page shows and plays of each variant, by the variant's id: "audio" (a data URI
/// of FLAC, or of WAV if libsndfile has no FLAC), "waveform" and "spectrogram", of the first
/// channel and at most the first kHeard seconds. All variants of a scene have one scale, in which
/// the reference's peak is a quarter: a variant louder by more than 12 dB is clipped.
nlohmann::ordered_json mediaJson(const SceneReport& report);

inline constexpr double kHeard = 2.0;  ///< s

/// The levels of a spectrogram: columns of `rows` bytes each, from the lowest frequency up.
struct Spectrogram {
  std::size_t columns = 0;
  std::size_t rows = 0;
  std::string data;
};

inline constexpr double kLowestShown = 50.0;    ///< Hz
inline constexpr double kQuietestShown = 0.0;   ///< dB above 20 uPa: byte 0
inline constexpr double kLoudestShown = 100.0;  ///< dB above 20 uPa: byte 255

/// Computes the levels in bands of equal ratio from kLowestShown to 0.45 of the sample rate, at
/// equal intervals of time. [any thread]
Spectrogram spectrogramOf(const std::vector<float>& samples, double sampleRate);

}  // namespace carom::lab
