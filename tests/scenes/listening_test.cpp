// Effect of rooms and listeners on the sound of a scene, compared with clicks written by hand.

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <numbers>
#include <numeric>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "audio/propagation/hrtf.h"
#include "scenes/run/render.h"
#include "scenes/run/scene_sound.h"
#include "scenes/run/scene_stepper.h"
#include "tests/scenes/library.h"
#include "tests/support/constants.h"
#include "tests/support/temporary_folder.h"

namespace carom::test {

using namespace scenes;

namespace {

using Channels = std::vector<std::vector<float>>;

constexpr double kSpeedOfSound = 343.0;

Channels heard(const Scene& scene) {
  Result<SceneSound> sound = SceneSound::create(scene);
  EXPECT_TRUE(sound) << sound.error().message;
  if (!sound) return {};
  Channels all(sound->synth().channelCount());
  Channels block(all.size(), std::vector<float>(1024));
  while (const std::size_t count = sound->render(block)) {
    for (std::size_t channel = 0; channel < all.size(); ++channel) {
      const auto end = block[channel].begin() + static_cast<std::ptrdiff_t>(count);
      all[channel].insert(all[channel].end(), block[channel].begin(), end);
    }
  }
  return all;
}

Scene parsed(const std::string& text) {
  return orAbort(parseScene(text, "listening.json"));
}

constexpr const char* kMono = R"({"position": [3, 0.5, 0]})";

/// A steel ball that flies against a wall at x = 0 and hits it at 0.01 s with its centre at (0.01,
/// 0, 0): the scene's only click, a dipole along x.
Scene wallHit(const std::string& listener, const std::string& more = "") {
  return parsed(R"({"duration": 0.1, "gravity": [0, 0, 0], "bodies": [
    {"type": "plane", "name": "wall", "normal": [1, 0, 0], "offset": 0, "material": "steel"},
    {"type": "sphere", "radius": 0.01, "material": "steel", "position": [0.03, 0, 0],
     "velocity": [-2, 0, 0]}], "listeners": [)" +
                listener + "]" + more + "}");
}

/// The scene with the equations of the hand-out, sampled without a filter.
Scene simplified(Scene scene) {
  return asInTheHandOut(std::move(scene));
}

/// The hand-out's equation for the one click of wallHit(), in Pa.
struct OneClick {
  explicit OneClick(const Scene& scene) {
    const auto events = sceneEvents(scene);
    EXPECT_TRUE(events);
    EXPECT_EQ(events->size(), 2U);
    const ImpulseEvent& event =
        scene.bodies.at(events->at(0).body).name == "wall" ? events->at(1) : events->at(0);
    const auto& ball = std::get<SphereShape>(scene.bodies.at(event.body).shape);
    time = event.time;
    speed = event.impulse.norm() / ball.mass;
    Result<SceneSound> sound = SceneSound::create(scene);
    tau = sound->synth().contactDuration(event);
  }

  double pressure(double t, const Vec3& place) const {
    const Vec3 path = place - Vec3(0.01, 0.0, 0.0);
    const double u = (t - path.norm() / kSpeedOfSound - time) / tau - 0.5;
    const double slope = -12.0 * u * std::exp(-6.0 * u * u);
    const double jerk = std::numbers::pi / 2.0 * speed * slope / (tau * tau);
    const double cosine = path.x() / path.norm();
    return 1.20 * 1e-6 * cosine / (2.0 * kSpeedOfSound * path.norm()) * jerk;
  }

  double time = 0.0;   // s
  double speed = 0.0;  // m/s, the change by the impulse
  double tau = 0.0;    // s
};

/// The largest difference from the expected values, over the largest of these.
double error(const std::vector<float>& samples, const std::function<double(double)>& expected) {
  double largest = 0.0;
  double most = 0.0;
  for (std::size_t sample = 0; sample < samples.size(); ++sample) {
    const double value = expected(static_cast<double>(sample) / kRate);
    largest = std::max(largest, std::abs(static_cast<double>(samples[sample]) - value));
    most = std::max(most, std::abs(value));
  }
  EXPECT_GT(most, 1e-4);
  return largest / most;
}

constexpr double kFloat = 1e-5;  // rounding, and the tails that are cut

double energy(const std::vector<float>& samples) {
  return std::inner_product(samples.begin(), samples.end(), samples.begin(), 0.0);
}

/// Time in s by which half of the energy has arrived.
double middle(const std::vector<float>& samples) {
  const double half = 0.5 * energy(samples);
  double sum = 0.0;
  std::size_t sample = 0;
  while (sample < samples.size() && sum < half) {
    const double value = samples[sample++];
    sum += value * value;
  }
  return static_cast<double>(sample) / kRate;
}

/// Magnitude of the spectrum at one frequency, by the defining sum.
double spectrumAt(double frequency, const std::vector<float>& samples) {
  double real = 0.0;
  double imaginary = 0.0;
  for (std::size_t sample = 0; sample < samples.size(); ++sample) {
    const double phase = 2.0 * std::numbers::pi * frequency * static_cast<double>(sample) / kRate;
    real += static_cast<double>(samples[sample]) * std::cos(phase);
    imaginary += static_cast<double>(samples[sample]) * std::sin(phase);
  }
  return std::hypot(real, imaginary);
}

/// True if head-related responses are installed; tests of binaural sound need them.
bool hasHead() {
  return static_cast<bool>(defaultHrtf(kRate));
}

TEST(Listening, SceneWithoutSoundAndRoomIsWhatTheSynthMakesOfItsEvents) {
  Scene scene = libraryScene("marbles_in_a_box");
  scene.duration = 0.6;
  Result<Synth> synth = Synth::create({}, scene.listeners);
  ASSERT_TRUE(synth);
  for (std::size_t body = 0; body < scene.bodies.size(); ++body) {
    SoundBody sound{.material = scene.bodies[body].material};
    if (const auto* sphere = std::get_if<SphereShape>(&scene.bodies[body].shape)) {
      sound.mass = sphere->mass;
      sound.radius = sphere->radius;
    }
    ASSERT_TRUE(synth->setBody(static_cast<BodyId>(body), sound));
  }
  const auto events = sceneEvents(scene);
  ASSERT_TRUE(events);
  for (const ImpulseEvent& event : *events) {
    if (event.time <= scene.duration) synth->schedule(event);
  }
  Channels expected(2, std::vector<float>(28800));
  const std::vector<float*> pointers = {expected[0].data(), expected[1].data()};
  synth->render<float>(pointers, 28800);
  EXPECT_GT(energy(expected[0]), 0.0);
  EXPECT_EQ(heard(scene), expected);
}

TEST(Listening, WallAddsTheSoundThatItsMirrorImageOfTheListenerWouldHear) {
  const Scene scene = simplified(wallHit(kMono, R"(, "room": {"surfaces": {"wall": "rigid"}})"));
  const OneClick click(scene);
  const Channels channels = heard(scene);
  ASSERT_EQ(channels.size(), 1U);
  const Vec3 there(3.0, 0.5, 0.0);
  const Vec3 mirrored(-3.0, 0.5, 0.0);
  EXPECT_LT(error(channels[0],
                  [&](double t) { return click.pressure(t, there) + click.pressure(t, mirrored); }),
            kFloat);
}

TEST(Listening, WallThatAbsorbsAllLeavesTheDirectSound) {
  const Scene scene = simplified(wallHit(kMono, R"(, "room": {"surfaces": {"wall": "open"}})"));
  const OneClick click(scene);
  EXPECT_LT(error(heard(scene).at(0),
                  [&](double t) {
                    return click.pressure(t, {3.0, 0.5, 0.0});
                  }),
            kFloat);
}

TEST(Listening, HardFloorCancelsTheLowFrequenciesOfADropOntoIt) {
  Scene open = libraryScene("bouncing_ball");
  open.duration = 0.5;  // the first bounce
  Scene floor = open;
  floor.sound.room.reflectors = {Reflector{Vec3::UnitY(), 0.0, {}}};
  const std::vector<float> bare = heard(open).at(0);
  const std::vector<float> both = heard(floor).at(0);
  // The image is the same dipole upside down, 2 cm below. At low frequencies the sum of both is k
  // times the difference of their paths, 2 * 0.01 m * sin 45 degrees, of the dipole.
  for (const double frequency : {200.0, 500.0, 1000.0}) {
    const double left = 2.0 * std::numbers::pi * frequency / kSpeedOfSound * 0.02 * std::sqrt(0.5);
    EXPECT_NEAR(spectrumAt(frequency, both) / spectrumAt(frequency, bare) / left, 1.0, 0.1)
        << frequency;
  }
  EXPECT_GT(energy(both), 0.2 * energy(bare));  // high frequencies are not cancelled
}

TEST(Listening, MicrophonesOfASpacedPairHearFromTheirOwnPlaces) {
  // The listener looks along -z, so that its right is +x, away from the wall.
  const Scene scene =
      simplified(wallHit(R"({"format": "spaced_pair", "spacing": 0.6, "position": [2, 0.5, 0]})"));
  const OneClick click(scene);
  const Channels channels = heard(scene);
  ASSERT_EQ(channels.size(), 2U);
  EXPECT_LT(error(channels[0],
                  [&](double t) {
                    return click.pressure(t, {1.7, 0.5, 0.0});
                  }),
            kFloat);
  EXPECT_LT(error(channels[1],
                  [&](double t) {
                    return click.pressure(t, {2.3, 0.5, 0.0});
                  }),
            kFloat);
}

TEST(Listening, CardioidsOfACoincidentPairDifferInLevelAlone) {
  // The source is straight along -x, 45 degrees to the right of the listener's direction: on the
  // axis of the right cardioid and at a right angle to that of the left one.
  const Scene scene = simplified(
      wallHit(R"({"format": "coincident_pair", "position": [2.01, 0, 0], "forward": [-1, 0, 1]})"));
  const OneClick click(scene);
  const Channels channels = heard(scene);
  ASSERT_EQ(channels.size(), 2U);
  const auto whole = [&](double t) { return click.pressure(t, {2.01, 0.0, 0.0}); };
  EXPECT_LT(error(channels[1], whole), kFloat);
  EXPECT_LT(error(channels[0], [&](double t) { return 0.5 * whole(t); }), kFloat);
}

TEST(Listening, EarTowardsTheSourceHearsItEarlierAndLouder) {
  if (!hasHead()) GTEST_SKIP() << "no head-related responses here";
  // The source is towards -x, which is on the right of a listener that looks along +z.
  const Channels right =
      heard(wallHit(R"({"format": "binaural", "position": [2, 0, 0], "forward": [0, 0, 1]})"));
  ASSERT_EQ(right.size(), 2U);
  EXPECT_GT(energy(right[1]), 4.0 * energy(right[0]));
  EXPECT_GT(middle(right[0]) - middle(right[1]), 4e-4);
  EXPECT_LT(middle(right[0]) - middle(right[1]), 1e-3);
  const Channels left =
      heard(wallHit(R"({"format": "binaural", "position": [2, 0, 0], "forward": [0, 0, -1]})"));
  EXPECT_GT(energy(left[0]), 4.0 * energy(left[1]));
  const Channels front =
      heard(wallHit(R"({"format": "binaural", "position": [2, 0, 0], "looks_at": [0, 0, 0]})"));
  EXPECT_NEAR(energy(front[0]) / energy(front[1]), 1.0, 0.2);
}

TEST(Listening, WhoMovesAwayHearsTheClickLater) {
  const auto alongX = [](const std::string& path) {
    return simplified(wallHit(R"({"position": [5.01, 0, 0], "path": [)" + path + "]}"));
  };
  const Scene moving = alongX(R"({"time": 0.1, "position": [15.01, 0, 0]})");
  const OneClick click(moving);
  const double speed = 100.0;  // m/s
  // The sound arrives at t with 5 m + v t = c (t - t0).
  const double arrival = (5.0 + kSpeedOfSound * click.time) / (kSpeedOfSound - speed);
  EXPECT_GT(arrival, click.time + 5.0 / kSpeedOfSound + 0.005);
  const std::vector<float> samples = heard(moving).at(0);
  EXPECT_NEAR(middle(samples), arrival + 0.5 * click.tau, 2e-4);
}

TEST(Listening, AtTheEndOfItsPathAListenerStands) {
  // The listener gets there 5 ms before the click; at its former speed it would be 9 m farther on
  // at the end.
  const Scene arrived = simplified(
      wallHit(R"({"position": [2, 0, 0], "path": [{"time": 0.005, "position": [2.01, 0.5, 0]}]})"));
  const OneClick click(arrived);
  EXPECT_LT(error(heard(arrived).at(0),
                  [&](double t) {
                    return click.pressure(t, {2.01, 0.5, 0.0});
                  }),
            kFloat);
}

/// Frequency in Hz, near `frequency`, at which the spectrum of a fifth of a second around `time` is
/// largest. The window is a Hann window, since most of a click's spectrum is far above `frequency`
/// and would leak.
double loudestNear(double frequency, const std::vector<float>& samples, double time) {
  const auto begin = samples.begin() + std::lround((time - 0.1) * kRate);
  std::vector<float> part(begin, begin + std::lround(0.2 * kRate));
  for (std::size_t sample = 0; sample < part.size(); ++sample) {
    const double phase = static_cast<double>(sample) / static_cast<double>(part.size());
    part[sample] *= static_cast<float>(0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * phase));
  }
  double loudest = 0.0;
  double most = 0.0;
  for (double tried = frequency - 90.0; tried <= frequency + 90.0; tried += 1.0) {
    const double magnitude = spectrumAt(tried, part);
    if (magnitude > most) loudest = tried;
    most = std::max(most, magnitude);
  }
  return loudest;
}

TEST(Listening, FlyByIsSharpAtFirstAndFlatAtLastByTheDopplerEffect) {
  const Channels channels = heard(libraryScene("fly_by"));
  ASSERT_EQ(channels.size(), 2U);
  // The middle of the pair is at (30 t - 36, 1, 6) m, the source at (0, 1, 0). The source's hits
  // alternate in direction, 100 pairs a second, which makes odd harmonics of 100 Hz. The test
  // follows the 21st.
  for (const double time : {0.25, 2.15}) {
    const Vec3 towards(36.0 - 30.0 * time, 0.0, -6.0);
    const double mach = 30.0 / kSpeedOfSound * towards.normalized().x();
    const double expected = 2100.0 * (1.0 + mach);
    for (const std::vector<float>& channel : channels)
      EXPECT_NEAR(loudestNear(expected, channel, time), expected, 2.0) << time;
    EXPECT_GT(std::abs(expected - 2100.0), 175.0);
  }
}

TEST(Listening, RoomOfABoxHasItsImagesAndItsReverberation) {
  const Scene room = libraryScene("marbles_in_a_room");
  EXPECT_EQ(imageCount(room), 24U);
  Scene scene = parsed(R"({"duration": 0.5, "gravity": [0, 0, 0], "bodies": [
    {"type": "box", "name": "hall", "min": [-4, 0, -3], "max": [4, 3, 3], "material": "concrete"},
    {"type": "sphere", "radius": 0.01, "material": "steel", "position": [0, 0.03, 0],
     "velocity": [0, -2, 0]}],
    "room": {"reverb": true},
    "listeners": [{"position": [2, 1.5, 1]}]})");
  ASSERT_TRUE(scene.sound.reverb);
  const auto tail = [](const std::vector<float>& samples) {
    return energy({samples.begin() + 14400, samples.end()});
  };
  const std::vector<float> wet = heard(scene).at(0);
  EXPECT_GT(tail(wet), 0.0);
  scene.sound.reverb.reset();
  EXPECT_LT(tail(heard(scene).at(0)), 1e-3 * tail(wet));
}

TEST(Listening, ReportSaysWhichChannelsAreWhose) {
  Scene scene = wallHit(R"({"name": "near", "position": [1, 0, 0]},
    {"name": "pair", "format": "coincident_pair", "position": [2, 0, 0]},
    {"name": "walker", "position": [3, 0, 0], "path": [{"time": 1, "position": [4, 0, 0]}]})",
                        R"(, "room": {})");
  const TemporaryFolder folder;
  const auto report = renderScene(scene, {.soundFile = folder / "sound.wav"});
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_EQ(report->channels, 4U);
  EXPECT_EQ(report->images, 1U);
  EXPECT_FALSE(report->reverb);
  ASSERT_EQ(report->listeners.size(), 3U);
  EXPECT_EQ(report->listeners[1].name, "pair");
  EXPECT_EQ(report->listeners[1].first, 1U);
  EXPECT_EQ(report->listeners[1].count, 2U);
  EXPECT_EQ(report->listeners[2].first, 3U);
  EXPECT_TRUE(report->listeners[2].moves);
  EXPECT_FALSE(report->listeners[0].moves);
}

TEST(Listening, HeadThatCannotBeReadIsAnErrorThatNamesTheFile) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder / "head.sofa";
  std::ofstream(file) << "no SOFA file";
  Scene scene = wallHit(R"({"format": "binaural", "position": [2, 0, 0]})");
  scene.headFiles = {{0, file}};
  const Result<SceneSound> sound = SceneSound::create(scene);
  ASSERT_FALSE(sound);
  EXPECT_NE(sound.error().message.find(file.string()), std::string::npos) << sound.error().message;
}

TEST(Listening, LibraryScenesRunAsTheirFilesSay) {
  for (const std::string_view name : kLibrary) {
    const Scene scene = libraryScene(name);
    if (!scene.listeners.empty() && scene.listeners[0].format == ListenerFormat::binaural &&
        !hasHead()) {
      continue;
    }
    const Channels channels = heard(scene);
    EXPECT_EQ(channels.size(), channelsOf(scene)) << name;
    for (const std::vector<float>& channel : channels)
      EXPECT_GT(energy(channel), 0.0) << name;
  }
}

}  // namespace
}  // namespace carom::test
