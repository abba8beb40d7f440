#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "carom/audio/result.h"
#include "carom/audio/sound_file.h"

namespace carom::audio {

/// A WAV file that grows, and that can be played at any moment: its header is brought up to date
/// with each `append`, so that a program that is killed, or a disk that is full, leaves all samples
/// but those of the append under way. Up to 4 GiB it has the bytes that libsndfile gives such a
/// file; beyond, its header becomes that of RF64 (EBU Tech 3306), in the same place. Errors are
/// the second half of a sentence. [one thread]
class WavStream {
 public:
  /// Bytes of samples beyond which a file is RF64: 32-bit lengths, less room for the header.
  static constexpr std::uint64_t kRiffLimit = 0xFFFFFFFFu - 4096u;

  struct Format {
    SampleFormat samples = SampleFormat::float32;
    int sampleRate = 48000;
    std::size_t channels = 1;
    double fullScale = 20.0;               ///< Pa, for the comment
    std::uint64_t riffLimit = kRiffLimit;  ///< bytes; less in tests
  };
  /// True if there can be a file of that format.
  static bool canWrite(const Format& format);
  /// Creates the file, or empties it.
  static Result<WavStream> create(const std::filesystem::path& path, const Format& format);

  /// Appends interleaved samples, 1.0 for full scale. After an error nothing more can be appended.
  Status append(std::span<const float> samples);
  /// Completes the file. To be called once.
  Status close();
  /// Frames that the header says.
  std::uint64_t frames() const { return frames_; }

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  WavStream(std::unique_ptr<std::FILE, Close> file, std::vector<char> header, const Format& format)
      : file_(std::move(file)), header_(std::move(header)), format_(format) {}

  std::size_t frameBytes() const;
  bool writeData(std::span<const float> samples);
  bool writeHeader();
  std::vector<char> headerNow() const;
  std::vector<char> rf64Header() const;
  std::size_t formatEnd() const;
  bool isRf64() const { return frames_ * frameBytes() > format_.riffLimit; }

  std::unique_ptr<std::FILE, Close> file_;
  std::vector<char> header_;  // as libsndfile writes it, for no samples
  Format format_;
  std::vector<short> shorts_;
  std::uint64_t bytes_ = 0;  // of samples that were written
  std::uint64_t frames_ = 0;
  std::uint64_t trailer_ = 0;  // bytes behind the samples
};

}  // namespace carom::audio
