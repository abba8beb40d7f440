#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "lab/video/child_process.h"

#include "carom/audio/result.h"

namespace carom::lab {

/// The kind of a film's file: H.264 and AAC in MP4, or VP9 and Opus in WebM.
enum class FilmFormat { mp4, webm };

/// The settings of ffmpeg for one film.
struct EncoderSettings {
  std::filesystem::path program;   ///< ffmpeg
  std::filesystem::path output;    ///< is written, whatever its name ends with
  std::filesystem::path sound;     ///< samples, 32-bit floats, interleaved
  std::filesystem::path messages;  ///< gets what ffmpeg says
  FilmFormat format = FilmFormat::mp4;
  int rate = 60;             ///< pictures in a second
  int sampleRate = 48000;    ///< Hz
  std::size_t channels = 2;  ///< of the sound
  bool isLossless = false;   ///< mp4 only: nothing is lost in the pictures after their JPEG
};

/// ffmpeg, which gets pictures one after another and makes a film of them. Picture n is shown from
/// time n / rate on, and sample k of the sound is heard at k / sampleRate. Errors are the second
/// half of a sentence about ffmpeg. [one thread]
class FilmEncoder {
 public:
  static Result<FilmEncoder> start(const EncoderSettings& settings, void (*prepare)());

  /// Adds the next picture, a JPEG.
  Status add(std::span<const std::byte> picture);
  /// Completes the file; to be called once, after the last picture.
  Status finish();

 private:
  FilmEncoder(Descriptor pictures, ChildProcess process, std::filesystem::path messages)
      : pictures_(std::move(pictures)),
        process_(std::move(process)),
        messages_(std::move(messages)) {}
  Error failure();

  Descriptor pictures_;
  ChildProcess process_;
  std::filesystem::path messages_;
};

}  // namespace carom::lab
