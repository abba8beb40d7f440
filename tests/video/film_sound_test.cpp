#include "lab/video/film_sound.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "lab/video/film.h"
#include "lab/view/view_run.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scenes/format/scene_loader.h"
#include "scenes/run/render.h"

namespace carom::lab {

using namespace scenes;

namespace {

using testing::HasSubstr;

constexpr double kSoundSpeed = 343.0;  // m/s
/// s, at which the ball of bouncing_ball.json touches the floor for the first time: it falls 0.5 m.
const double kTouch = std::sqrt(2.0 * 0.5 / 9.81);
const Vec3 kTouchPlace(0.0, 0.01, 0.0);  // m, of the ball's centre

Scene ballScene(double duration) {
  const auto file =
      std::filesystem::path(CAROM_SOURCE_DIR) / "scenes/library" / "bouncing_ball.json";
  Result<Scene> scene = loadScene(file);
  EXPECT_TRUE(scene) << scene.error().message;
  scene->duration = duration;
  return *std::move(scene);
}

CameraPath cameraAt(const Vec3& position) {
  CameraKey key;
  key.position = position;
  return CameraPath({key});
}

FilmTime timeOf(double seconds, int rate = 60, double speed = 1.0, double from = 0.0) {
  return {.from = from,
          .speed = speed,
          .rate = rate,
          .pictures = static_cast<std::size_t>(std::lround(seconds * rate))};
}

FilmSound soundOf(const Scene& scene, const CameraPath& camera, const FilmTime& time,
                  const FilmSoundSettings& settings = {}) {
  Result<ViewRun> view = viewScene(scene);
  EXPECT_TRUE(view) << view.error().message;
  Result<FilmSound> sound = renderFilmSound(std::move(view->run), camera, time, settings);
  EXPECT_TRUE(sound) << sound.error().message;
  return *std::move(sound);
}

/// Keeps the first channel of a rendering.
class FirstChannel : public RenderSink {
 public:
  Status write(std::span<const float* const> channels, std::size_t frames) override {
    samples.insert(samples.end(), channels[0], channels[0] + frames);
    return std::monostate{};
  }
  void add(const ImpulseEvent&, const EventSound&) override {}

  std::vector<float> samples;
};

/// Returns the time (s) of the first sample above a hundredth of the peak.
double onsetOf(const FilmSound& sound) {
  const auto isLoud = [](float sample) { return std::abs(sample) > 0.007F; };
  const auto first = std::ranges::find_if(sound.samples, isLoud);
  return static_cast<double>(first - sound.samples.begin()) /
         static_cast<double>(sound.channels * kFilmSampleRate);
}

TEST(FilmSounds, AreThoseThatTheSceneIsRenderedTo) {
  const Scene scene = ballScene(1.0);
  FirstChannel rendered;
  ASSERT_TRUE(renderScene(scene, {}, rendered));
  const FilmSound sound = soundOf(scene, cameraAt(Vec3::Zero()), timeOf(0.9), {.listener = 0});
  ASSERT_EQ(sound.channels, 1u);
  ASSERT_EQ(sound.samples.size(), 43'200u);
  const std::size_t whole = sound.samples.size() - 960;  // before the fade
  double most = 0.0;
  double peak = 0.0;
  for (std::size_t frame = 0; frame < whole; ++frame) {
    const double heard = static_cast<double>(sound.samples[frame]) * sound.fullScale;
    most = std::max(most, std::abs(heard - static_cast<double>(rendered.samples.at(frame))));
    peak = std::max(peak, std::abs(heard));
  }
  EXPECT_NEAR(peak, sound.peak, 1e-6 * peak);
  EXPECT_LT(most, 1e-6 * peak);  // float samples, scaled twice
}

TEST(FilmSounds, ComeToTheCameraThroughTheAir) {
  for (const Vec3& place : {Vec3(0.3, 0.5, 0.0), Vec3(3.0, 4.0, 12.0)}) {
    const double way = (place - kTouchPlace).norm() / kSoundSpeed;
    const FilmSound sound =
        soundOf(ballScene(0.6), cameraAt(place), timeOf(0.5), {.ear = ListenerFormat::mono});
    EXPECT_NEAR(onsetOf(sound), kTouch + way, 1e-4) << place.transpose();
  }
}

TEST(FilmSounds, AreLaterInSlowMotionButTheirWayIsNot) {
  const Vec3 place(3.0, 4.0, 12.0);
  const double way = (place - kTouchPlace).norm() / kSoundSpeed;
  const FilmSound slow =
      soundOf(ballScene(0.6), cameraAt(place), timeOf(4.0, 60, 0.1), {.ear = ListenerFormat::mono});
  EXPECT_NEAR(onsetOf(slow), kTouch / 0.1 + way, 1e-4);
  const FilmSound cut = soundOf(ballScene(0.6), cameraAt(place), timeOf(1.0, 60, 0.1, 0.3),
                                {.ear = ListenerFormat::mono});
  EXPECT_NEAR(onsetOf(cut), (kTouch - 0.3) / 0.1 + way, 1e-4);
}

TEST(FilmSounds, FollowTheCamera) {
  // The camera goes away at up to 30 m/s while the sound is on its way; where they meet is solved
  // by bisection.
  CameraKey first;
  first.position = {0.0, 5.0, 0.5};
  CameraKey last = first;
  last.time = 0.5;
  last.position = {0.0, 5.0, 10.5};
  const CameraPath camera({first, last});
  double low = kTouch;
  double high = kTouch + 0.2;
  while (high - low > 1e-9) {
    const double middle = 0.5 * (low + high);
    const double way = (camera.at(middle).position - kTouchPlace).norm();
    (middle - kTouch < way / kSoundSpeed ? low : high) = middle;
  }
  const FilmSound sound =
      soundOf(ballScene(0.6), camera, timeOf(0.5, 240), {.ear = ListenerFormat::mono});
  EXPECT_NEAR(onsetOf(sound), low, 1e-4);
}

TEST(FilmSounds, OfACameraThatIsTooFastAreRefused) {
  CameraKey first;
  CameraKey last;
  last.time = 0.1;
  last.position = {30.0, 0.0, 0.0};
  Result<ViewRun> view = viewScene(ballScene(0.6));
  ASSERT_TRUE(view);
  const auto sound = renderFilmSound(view->run, CameraPath({first, last}), timeOf(0.5), {});
  ASSERT_FALSE(sound);
  EXPECT_THAT(sound.error().message, HasSubstr("180 m/s"));
  EXPECT_TRUE(renderFilmSound(view->run, CameraPath({first, last}), timeOf(0.5), {.listener = 0}));
}

TEST(FilmSounds, HaveTheirPeakBelowFullScale) {
  const FilmSound sound = soundOf(ballScene(0.6), cameraAt({0.3, 0.5, 0.0}), timeOf(0.5));
  EXPECT_EQ(sound.channels, 2u);
  const float peak = std::abs(
      *std::ranges::max_element(sound.samples, {}, [](float sample) { return std::abs(sample); }));
  EXPECT_NEAR(peak, std::pow(10.0, kFilmPeak / 20.0), 1e-5);
  EXPECT_NEAR(sound.fullScale * std::pow(10.0, kFilmPeak / 20.0), sound.peak, 1e-9);
  EXPECT_EQ(sound.samples.back(), 0.0F);
}

TEST(FilmSounds, AreLimitedInTheirPlace) {
  const auto make = [](std::optional<double> fullScale) {
    return soundOf(ballScene(0.6), cameraAt({0.3, 0.5, 0.0}), timeOf(0.5),
                   {.ear = ListenerFormat::mono, .fullScale = fullScale});
  };
  const FilmSound whole = make({});
  const FilmSound limited = make(0.5 * whole.peak);
  ASSERT_EQ(limited.samples.size(), whole.samples.size());
  const auto loudest = [](const FilmSound& sound) {
    return std::ranges::max_element(sound.samples, {},
                                    [](float sample) { return std::abs(sample); }) -
           sound.samples.begin();
  };
  EXPECT_LE(std::abs(limited.samples[static_cast<std::size_t>(loudest(limited))]), 1.0F);
  EXPECT_NEAR(static_cast<double>(loudest(limited)), static_cast<double>(loudest(whole)), 3.0);
}

TEST(FilmSounds, HaveALevelForEachPicture) {
  const FilmSound sound = soundOf(ballScene(0.6), cameraAt({0.3, 0.5, 0.0}), timeOf(0.5),
                                  {.ear = ListenerFormat::mono});
  ASSERT_EQ(sound.levels.size(), 30u);
  const double loud = 20.0 * std::log10(sound.peak / 20e-6);
  // The touch is at 0.3193 s, its sound 1.7 ms later: while picture 19 is shown.
  EXPECT_LT(sound.levels[18][0].now, 0.0);
  EXPECT_NEAR(sound.levels[19][0].now, loud, 1e-6);
  EXPECT_NEAR(sound.levels[25][0].peak, loud, 1e-6);
  EXPECT_NEAR(sound.levels[25][0].now, loud - 6.0 * 26.0 / 60.0, 1.0);
}

TEST(Films, HaveAsManyPicturesAsFitTheirTime) {
  FilmSettings settings;
  settings.rate = 24;
  EXPECT_EQ(pictureCount(settings, 4.0), 96u);
  settings.to = 1.02;
  EXPECT_EQ(pictureCount(settings, 4.0), 24u);
  settings.from = 0.52;
  settings.speed = 0.1;
  EXPECT_EQ(pictureCount(settings, 4.0), 120u);
  settings.tail = 1.0;
  EXPECT_EQ(pictureCount(settings, 4.0), 144u);
  settings.to = 0.5201;
  settings.speed = 1.0;
  settings.tail = 0.0;
  EXPECT_EQ(pictureCount(settings, 4.0), 1u);
}

}  // namespace
}  // namespace carom::lab
