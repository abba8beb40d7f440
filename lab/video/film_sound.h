#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "lab/video/camera_path.h"

#include "audio/propagation/hrtf.h"
#include "audio/run/playable_run.h"
#include "carom/audio/listener.h"
#include "carom/audio/result.h"

namespace carom::lab {

/// A stretch of a run as a film shows it: picture n has the run's time `from` + n * speed / rate,
/// but never one beyond the run's end.
struct FilmTime {
  double from = 0.0;         ///< s, of the run
  double speed = 1.0;        ///< of the run's time over that of the film
  int rate = 60;             ///< pictures in a second
  std::size_t pictures = 1;  ///< in the film

  double seconds() const { return static_cast<double>(pictures) / rate; }  ///< of the film
  /// The time (s) of the run at a picture.
  double at(std::size_t picture) const {
    return from + speed * static_cast<double>(picture) / rate;
  }
};

struct FilmSoundSettings {
  /// In place of the camera's ear: a listener of the run, by its index.
  std::optional<std::size_t> listener = std::nullopt;
  ListenerFormat ear = ListenerFormat::spacedPair;  ///< that goes with the camera
  double earSpacing = 0.17;                         ///< m, between the microphones of a pair
  std::shared_ptr<const HrtfSet> head = nullptr;    ///< of binaural ears, at kFilmSampleRate
  /// Pa that 1.0 stands for, above which sound is limited; empty: so that the peak is at kFilmPeak.
  std::optional<double> fullScale = std::nullopt;
  std::function<bool(double share)> progress = {};  ///< false ends the work
};

inline constexpr int kFilmSampleRate = 48000;  ///< Hz, the one that AAC and Opus both have
inline constexpr double kFilmPeak = -3.0;      ///< dB of full scale, of the loudest sample
inline constexpr double kFilmFade = 0.02;      ///< s, at the end of a film that is not silent there

/// The level of the sound while one picture is shown, for one channel, as a meter shows it.
struct MeterLevel {
  double now = 0.0;   ///< dB above 20 uPa, falling slowly
  double peak = 0.0;  ///< dB above 20 uPa, the highest of late
};

/// The sound of a film: sample k is heard at k / kFilmSampleRate.
struct FilmSound {
  std::size_t channels = 1;
  std::vector<float> samples;                   ///< interleaved, 1.0 for full scale
  double peak = 0.0;                            ///< Pa, before it is limited
  double fullScale = 0.0;                       ///< Pa
  std::vector<std::vector<MeterLevel>> levels;  ///< of each picture, of each channel
};

/// Renders the sound of a film by RunPlayer, as `carom replay` would, at the listener, or at an ear
/// that goes the way of the camera. From another time than 0 on, sound of at most 3 s before rings
/// into it. Errors: a camera faster than PoseTrack::kMaxSpeed, those of RunPlayer, and an end by
/// `progress`.
Result<FilmSound> renderFilmSound(audio::PlayableRun run, const CameraPath& camera,
                                  const FilmTime& time, const FilmSoundSettings& settings);

}  // namespace carom::lab
