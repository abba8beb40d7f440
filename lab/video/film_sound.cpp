#include "lab/video/film_sound.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>
#include <utility>

#include "audio/propagation/pose_track.h"
#include "audio/run/run_player.h"
#include "carom/audio/limiter.h"

namespace carom::lab {

using namespace audio;

namespace {

constexpr std::size_t kSoundBlock = 4096;    // frames
constexpr double kFilmPrelude = 3.0;         // s, of the film, before its begin
constexpr double kMostEarPoses = 900.0;      // of the camera's ear: a track holds some more
constexpr double kQuietestPressure = 20e-6;  // Pa, 0 dB
constexpr double kSilentFullScale = 20.0;    // Pa, of a film in which nothing is heard
constexpr double kMeterFalls = 26.0;         // dB in a second
constexpr double kPeakStays = 1.2;           // s
constexpr double kMeterFloor = -200.0;       // dB

double decibelsOf(double pressure) {
  return pressure > 0.0 ? std::max(kMeterFloor, 20.0 * std::log10(pressure / kQuietestPressure))
                        : kMeterFloor;
}

ListenerPose poseAt(const CameraPath& camera, double time) {
  const CameraPose pose = camera.at(time);
  return {time, pose.position, pose.orientation};
}

/// Makes the camera's ear the only listener of a run.
Status putEar(HostWorld& world, const CameraPath& camera, const FilmTime& time,
              const FilmSoundSettings& settings) {
  Listener ear;
  ear.name = "camera";
  ear.format = settings.ear;
  ear.spacing = settings.earSpacing;
  const double begin = std::max(0.0, time.from - kFilmPrelude * time.speed);
  const double end = time.at(time.pictures);
  // A pose for each picture, unless these are more than a track holds.
  const double step = std::max(time.speed / time.rate, (end - begin) / kMostEarPoses);
  ListenerPose last = poseAt(camera, begin);
  ear.position = last.position;
  ear.orientation = last.orientation;
  std::vector<ListenerPose> path;
  for (std::size_t pose = 1; camera.moves() && last.time < end; ++pose) {
    path.push_back(poseAt(camera, begin + step * static_cast<double>(pose)));
    const double way = (path.back().position - last.position).norm();
    const double speed = way * time.speed / step;  // m/s, of the film
    if (speed > PoseTrack::kMaxSpeed) {
      std::ostringstream text;
      text << "the camera moves at " << std::lround(speed) << " m/s at " << std::setprecision(4)
           << last.time << " s, and its ear with it; expected at most " << PoseTrack::kMaxSpeed
           << " m/s, or --listener NAME";
      return Error{text.str()};
    }
    last = path.back();
  }
  world.listeners = {ear};
  world.paths = {std::move(path)};
  return std::monostate{};
}

/// Puts the peaks (Pa) of a film's pictures on a meter.
class Meter {
 public:
  Meter(std::size_t channels, int rate) : rate_(rate), states_(channels) {}

  std::vector<MeterLevel> show(const std::vector<double>& peaks) {
    std::vector<MeterLevel> levels;
    for (std::size_t channel = 0; channel < states_.size(); ++channel) {
      State& state = states_[channel];
      const double level = decibelsOf(peaks[channel]);
      state.level.now = std::max(level, state.level.now - kMeterFalls / rate_);
      const bool isOver = state.age++ > kPeakStays * rate_;
      if (level >= state.level.peak) state.age = 0;
      state.level.peak =
          std::max(level, isOver ? state.level.peak - kMeterFalls / rate_ : state.level.peak);
      levels.push_back(state.level);
    }
    return levels;
  }

 private:
  struct State {
    MeterLevel level = {kMeterFloor, kMeterFloor};
    int age = 0;  // pictures since the peak
  };
  double rate_;
  std::vector<State> states_;
};

/// Renders all samples, in Pa.
Status renderPressure(RunPlayer& player, std::size_t frames, const FilmSoundSettings& settings,
                      FilmSound& sound) {
  sound.channels = player.channels();
  std::vector<std::vector<float>> planes(sound.channels, std::vector<float>(kSoundBlock));
  std::vector<float*> pointers;
  for (std::vector<float>& plane : planes)
    pointers.push_back(plane.data());
  sound.samples.reserve(frames * sound.channels);
  for (std::size_t done = 0; done < frames;) {
    const std::size_t count = std::min(kSoundBlock, frames - done);
    player.render(pointers, count);
    for (std::size_t frame = 0; frame < count; ++frame)
      for (const std::vector<float>& plane : planes)
        sound.samples.push_back(plane[frame]);
    done += count;
    if (settings.progress &&
        !settings.progress(static_cast<double>(done) / static_cast<double>(frames)))
      return Error{"the sound has been ended"};
  }
  return std::monostate{};
}

std::size_t frameOf(const FilmTime& time, std::size_t picture) {
  return static_cast<std::size_t>(
      std::llround(static_cast<double>(picture) * kFilmSampleRate / time.rate));
}

void measureLevels(const FilmTime& time, FilmSound& sound) {
  Meter meter(sound.channels, time.rate);
  for (std::size_t picture = 0; picture < time.pictures; ++picture) {
    std::vector<double> peaks(sound.channels, 0.0);
    for (std::size_t frame = frameOf(time, picture); frame < frameOf(time, picture + 1); ++frame)
      for (std::size_t channel = 0; channel < sound.channels; ++channel)
        peaks[channel] = std::max(
            peaks[channel],
            std::abs(static_cast<double>(sound.samples[frame * sound.channels + channel])));
    sound.peak = std::max(sound.peak, *std::ranges::max_element(peaks));
    sound.levels.push_back(meter.show(peaks));
  }
}

/// Turns pressures into shares of full scale.
void scale(FilmSound& sound, std::optional<double> fullScale) {
  const double automatic =
      sound.peak > 0.0 ? sound.peak * std::pow(10.0, -kFilmPeak / 20.0) : kSilentFullScale;
  sound.fullScale = fullScale.value_or(automatic);
  for (float& sample : sound.samples)
    sample = static_cast<float>(static_cast<double>(sample) / sound.fullScale);
}

/// Limits what exceeds full scale, without a delay.
Status limit(FilmSound& sound) {
  if (!(sound.peak > sound.fullScale)) return std::monostate{};
  Result<Limiter> limiter =
      Limiter::create({.sampleRate = kFilmSampleRate, .channels = sound.channels});
  if (!limiter) return limiter.error();
  const std::size_t late = limiter->latency() * sound.channels;
  sound.samples.resize(sound.samples.size() + late, 0.0F);
  std::vector<float> frame(sound.channels);
  std::vector<float*> pointers;
  for (float& sample : frame)
    pointers.push_back(&sample);
  for (std::size_t at = 0; at < sound.samples.size(); at += sound.channels) {
    const auto place = sound.samples.begin() + static_cast<std::ptrdiff_t>(at);
    std::copy_n(place, sound.channels, frame.begin());
    limiter->process(pointers, 1);
    std::ranges::copy(frame, place);
  }
  sound.samples.erase(sound.samples.begin(),
                      sound.samples.begin() + static_cast<std::ptrdiff_t>(late));
  return std::monostate{};
}

/// Fades the last moment, so that the end is no click.
void fadeOut(FilmSound& sound) {
  const std::size_t frames = sound.samples.size() / sound.channels;
  const auto fades = std::min(frames, static_cast<std::size_t>(kFilmFade * kFilmSampleRate));
  for (std::size_t left = 0; left < fades; ++left)
    for (std::size_t channel = 0; channel < sound.channels; ++channel)
      sound.samples[(frames - 1 - left) * sound.channels + channel] *=
          static_cast<float>(left) / static_cast<float>(fades);
}

}  // namespace

Result<FilmSound> renderFilmSound(PlayableRun run, const CameraPath& camera, const FilmTime& time,
                                  const FilmSoundSettings& settings) {
  if (!settings.listener)
    if (Status put = putEar(run.world, camera, time, settings); !put) return put.error();
  Result<RunPlayer> player = RunPlayer::create(std::move(run), kFilmSampleRate);
  if (!player) return player.error();
  player->setHead(settings.head);
  player->follow(settings.listener.value_or(0));
  const double before = std::min(kFilmPrelude, time.from / time.speed);
  if (Status sought = player->seek({.time = time.from, .speed = time.speed, .prelude = before});
      !sought)
    return sought.error();
  FilmSound sound;
  if (Status rendered = renderPressure(*player, frameOf(time, time.pictures), settings, sound);
      !rendered)
    return rendered.error();
  measureLevels(time, sound);
  scale(sound, settings.fullScale);
  if (Status limited = limit(sound); !limited) return limited.error();
  fadeOut(sound);
  return sound;
}

}  // namespace carom::lab
