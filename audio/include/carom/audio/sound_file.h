#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include <carom/audio/result.h>

namespace carom {

/// Default pressure in Pa that a sample value of 1.0 (0 dBFS) stands for: 120 dB peak above the
/// threshold of hearing, 20 uPa.
inline constexpr double kFullScalePressure = 20.0;

enum class SampleFormat { float32, pcm16 };

struct SoundFileSettings {
  double sampleRate = 48000.0;  ///< Hz; written as the nearest whole number
  std::size_t channels = 1;
  SampleFormat format = SampleFormat::float32;
  /// Pressure in Pa, above 0, that 1.0 in the file stands for. Levels of two files are comparable
  /// if it is the same.
  double fullScalePressure = kFullScalePressure;
  /// Turns down peaks that exceed full scale (Limiter, with its default times), all channels
  /// together; the limiter's delay is removed again. Otherwise float files keep louder peaks as
  /// they are, and PCM16 clips and counts them. Not together with `normalize`.
  bool limit = false;
  /// Scales the file so that its loudest sample is 0 dBFS: levels of two files are then no longer
  /// comparable, and `fullScalePressure` is not used.
  bool normalize = false;
  double normalizedPeak = 1.0;  ///< with `normalize`: the loudest sample, above 0
  /// Pa, 0 or above, with `normalize`: full scale is no less, and what is quieter stays so.
  double leastFullScale = 0.0;
  /// For sound that nobody can make again. What was written before an error, or before the program
  /// died, is kept, and can be played: under the file's name if no other file has it, or else
  /// beside it, as `NAME.incomplete.wav`, `NAME.incomplete-2.wav` and so on. Not normalised: its
  /// full scale is kFullScalePressure with `normalize`, as its comment says. Otherwise it is
  /// removed.
  bool keepIncomplete = false;
};

/// Writes pascals to a WAV file, with its full scale in the comment (ICMT): "full scale 20 Pa".
/// Beyond 4 GiB it is a file of RF64 (EBU Tech 3306), which has the comment once it is finished.
///
/// The file appears under its name, whole and on the disk, when `finish` succeeds; until then, and
/// if it never does, a file that had the name before stays. Meanwhile the sound is in
/// `NAME.wav.<hex>.partial`, or `NAME.wav.<hex>.partial.wav` with
/// SoundFileSettings::keepIncomplete, which can be played at any moment up to the latest `write`.
/// Where a program ends without finishing it, by whatever signal, the next writer of the same name
/// settles it: removes the former, gives the latter a name (`recovered`). Files of programs that
/// still run are left alone, also of those on other hosts, where the file system has locks (flock).
/// A full disk, and a limit of file sizes (a host has to ignore SIGXFSZ then), are errors of
/// `write`.
class SoundFileWriter {
 public:
  /// Refuses: a folder that does not exist or cannot be written, channel counts libsndfile lacks.
  static Result<SoundFileWriter> create(const std::filesystem::path& path,
                                        const SoundFileSettings& settings);
  SoundFileWriter(SoundFileWriter&&) noexcept;
  SoundFileWriter& operator=(SoundFileWriter&&) noexcept;
  ~SoundFileWriter();

  /// Appends `frames` samples of each channel, in Pa. One that is not finite becomes silence, and
  /// is counted. Refuses another number of channels. After any other error the file is over: see
  /// SoundFileSettings::keepIncomplete.
  Status write(std::span<const float* const> channels, std::size_t frames);
  /// Closes the file and gives it its name. To be called once.
  Status finish();

  /// Pa that 1.0 stands for; with `normalize` as far as is known yet, final after `finish`.
  double fullScale() const;
  double peakPressure() const;           ///< Pa, largest magnitude written so far, before limiting
  std::uint64_t clippedSamples() const;  ///< samples beyond full scale, PCM16 only
  std::uint64_t samplesNotFinite() const;  ///< samples that were written as silence
  /// Sound that programs which died have left under the same name, where it is now.
  const std::vector<std::filesystem::path>& recovered() const;
  /// Largest reduction of gain by the limiter in dB, 0 or more. Includes the last samples only
  /// after `finish`.
  double gainReduction() const;

 private:
  struct State;
  explicit SoundFileWriter(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace carom
