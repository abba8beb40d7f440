#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "lab/video/film_encoder.h"
#include "lab/view/view_run.h"

#include "audio/propagation/hrtf.h"
#include "carom/audio/listener.h"
#include "carom/audio/result.h"
#include "scenes/values/camera_key.h"

namespace carom::lab {

/// The programs that a film takes.
struct FilmTools {
  std::filesystem::path browser;       ///< Chromium
  std::filesystem::path encoder;       ///< ffmpeg
  std::filesystem::path pageTemplate;  ///< see findTemplate
  /// That of ProgramStart.
  void (*prepare)() = nullptr;
};

struct FilmSettings {
  FilmTools tools;
  std::filesystem::path output;
  FilmFormat format = FilmFormat::mp4;
  int width = 1280;                                     ///< pixels, even
  int height = 720;                                     ///< pixels, even
  int rate = 60;                                        ///< pictures in a second
  double from = 0.0;                                    ///< s, of the run
  double to = std::numeric_limits<double>::infinity();  ///< s, of the run; at most its end
  double speed = 1.0;                                   ///< of the run's time over that of the film
  double tail = 0.0;                      ///< s, of the film, behind the end of the stretch
  std::vector<scenes::CameraKey> camera;  ///< empty: the first view of the page
  std::optional<std::size_t> listener;    ///< of the run; empty: the ear is at the camera
  ListenerFormat ear = ListenerFormat::spacedPair;  ///< of the camera
  std::optional<HrtfMeasurements> head = {};        ///< of binaural ears
  std::optional<double> fullScale = {};             ///< Pa; empty: see FilmSoundSettings
  bool hasCaptions = false;  ///< the title, the time, and who has just met whom
  bool hasMeter = false;     ///< the level of the sound
  bool isLight = false;      ///< the page's light colours
  bool isLossless = false;   ///< see EncoderSettings
  /// Told of each stage; false ends the work.
  std::function<bool(std::string_view stage, double share)> progress = {};
};

/// A film that has been made.
struct FilmReport {
  std::filesystem::path file;
  std::uintmax_t bytes = 0;
  std::size_t pictures = 0;
  int rate = 0;
  double duration = 0.0;     ///< s, of the film
  std::size_t channels = 0;  ///< of the sound
  int sampleRate = 0;        ///< Hz
  double peak = 0.0;         ///< Pa, of the sound
  double fullScale = 0.0;    ///< Pa
};

/// Returns the number of pictures of a film of that stretch: of (to - from) / speed + tail seconds,
/// rounded, but at least one.
std::size_t pictureCount(const FilmSettings& settings, double runDuration);

/// Makes a film of a run: the pictures of its page (docs/view.md), one by one in a browser, and its
/// sound by RunPlayer, joined by ffmpeg. The file appears whole or not at all, and nothing else
/// stays, however it ends. Errors: each program's own, a camera that is too fast, the disk, and an
/// end by `progress`.
Result<FilmReport> makeFilm(ViewRun view, const FilmSettings& settings);

}  // namespace carom::lab
