#pragma once

#include <cstddef>
#include <filesystem>
#include <limits>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "carom/audio/result.h"
#include "carom/audio/sound_file.h"
#include "carom/sound_settings.h"

namespace carom::plugin {

/// True if a recording gets its full scale at its end.
bool hasAutomaticFile(const SoundSettings& settings);

/// The place for the samples of a SoundRecorder. [simulation thread]
class RecordedSamples {
 public:
  RecordedSamples() = default;
  RecordedSamples(const RecordedSamples&) = delete;
  RecordedSamples& operator=(const RecordedSamples&) = delete;
  virtual ~RecordedSamples() = default;

  /// Takes `frames` samples (Pa) of each channel. An error ends the recording.
  virtual Status write(std::span<const float* const> channels, std::size_t frames) = 0;
  /// Takes note that there are no more. Returns the first error since the beginning.
  virtual Status finish() = 0;
  virtual double peakPressure() const = 0;  ///< Pa, the largest so far
  virtual double fullScale() const = 0;  ///< Pa, of a sample of 1.0; infinite if samples are in Pa
};

/// The samples of a recording, in its file. With an automatic level it gets its full scale at the
/// end, for a peak of kAutomaticPeak.
class SamplesInFile final : public RecordedSamples {
 public:
  static constexpr double kAutomaticPeak = 0.707945784384138;  ///< -3 dB

  /// Refuses what SoundFileWriter refuses, and names that are not of a WAV file.
  static Result<std::unique_ptr<SamplesInFile>> create(const std::filesystem::path& file,
                                                       const SoundSettings& settings,
                                                       std::size_t channels);

  /// See SoundFileWriter::recovered.
  const std::vector<std::filesystem::path>& recovered() const { return file_.recovered(); }

  Status write(std::span<const float* const> channels, std::size_t frames) override {
    return file_.write(channels, frames);
  }
  Status finish() override { return file_.finish(); }
  double peakPressure() const override { return file_.peakPressure(); }
  double fullScale() const override { return file_.fullScale(); }

 private:
  explicit SamplesInFile(SoundFileWriter file) : file_(std::move(file)) {}

  SoundFileWriter file_;
};

/// Interleaved samples in memory, in Pa, until they are taken.
class SamplesInMemory final : public RecordedSamples {
 public:
  explicit SamplesInMemory(std::size_t channels) : channels_(channels) {}

  /// Frames that wait to be taken.
  std::size_t ready() const { return (samples_.size() - taken_) / channels_; }
  /// Moves the oldest frames to `samples`, as many as fit and there are. Returns their number.
  std::size_t take(std::span<float> samples);

  Status write(std::span<const float* const> channels, std::size_t frames) override;
  Status finish() override { return std::monostate{}; }
  double peakPressure() const override { return peak_; }
  double fullScale() const override { return std::numeric_limits<double>::infinity(); }

 private:
  std::size_t channels_;
  std::vector<float> samples_;
  std::size_t taken_ = 0;  // samples at the begin of samples_
  double peak_ = 0.0;      // Pa
};

}  // namespace carom::plugin
