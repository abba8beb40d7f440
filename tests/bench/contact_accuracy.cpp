#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <numbers>
#include <vector>

#include <unsupported/Eigen/FFT>

#include "audio/model/hertz.h"
#include "scenes/format/scene_loader.h"
#include "scenes/run/scene_sound.h"
#include "scenes/run/scene_stepper.h"
#include "tests/audio/ball_drop.h"
#include "tests/bench/table_program.h"
#include "tests/support/wavy_slide.h"

namespace carom::bench {

using namespace audio;
using namespace scenes;

namespace {

using test::WavySlide;

constexpr const char* kHelp =
    "Prints what slides and rolls against closed forms: pitch and level over a wavy floor, the "
    "same\n"
    "scene on steps of 1/60, 1/240 and 1/1000 s, a ball that rolls from push-off to rest.\n"
    "With --short, of the slides one instead of eight.\n";

/// A place (m) above the middle of the way, so far off that the ball moves at right angles to the
/// direction of the sound, without a Doppler shift.
Vec3 farAbove(double speed) {
  return {0.5 * speed * WavySlide::kDuration, 0.0, 30.0};
}
/// The audible part of the spectrum: dB below the loudest third octave.
constexpr double kHeard = 40.0;

double decibels(double ratio) {
  return 20.0 * std::log10(ratio);
}

void printPitch() {
  std::printf("a ball slides over waves of %g mm\n%8s %12s %12s %9s %9s\n", 1e3 * WavySlide::kWave,
              "m/s", "v/l, Hz", "heard, Hz", "error, %", "octaves");
  double before = 0.0;
  for (const double speed : {0.25, 0.5, 1.0, 2.0, 4.0}) {
    const double expected = speed / WavySlide::kWave;
    const double heard =
        test::loudestFrequency(test::soundOf({.speed = speed, .listener = farAbove(speed)}),
                               0.5 * expected, 1.5 * expected);
    std::printf("%8g %12g %12.2f %9.3f", speed, expected, heard, 100.0 * (heard / expected - 1.0));
    if (before > 0.0) std::printf(" %9.4f", std::log2(heard / before));
    std::printf("\n");
    before = heard;
  }
}

/// Share of the waves' amplitude that remains in the mean over Hertz's contact.
double averaged(double load) {
  const test::BallDrop drop{.radius = WavySlide().radius};
  const double x = std::numbers::pi / WavySlide::kWave *
                   hertzWidth({load, drop.radius, contactModulus(drop.material, drop.material)});
  return std::sin(x) / x;
}

/// Amplitude of a mass relative to the surface that shakes it through the contact's spring.
double following(double load, double frequency) {
  const test::BallDrop drop{.radius = WavySlide().radius};
  const double k =
      hertzStiffness({load, drop.radius, contactModulus(drop.material, drop.material)});
  const double decay = -std::log(drop.material.restitution);
  const double zeta = decay / std::hypot(std::numbers::pi, decay);
  const double r = 2.0 * std::numbers::pi * frequency / std::sqrt(k / drop.mass());
  return std::hypot(1.0, 2.0 * zeta * r) / std::hypot(1.0 - r * r, 2.0 * zeta * r);
}

void printLoad() {
  std::printf("\nthe load doubled, at 8 m/s\n%8s %16s %16s\n", "N", "heard, dB", "expected, dB");
  const double frequency = 8.0 / WavySlide::kWave;
  double level = 0.0;
  double expected = 0.0;
  for (const double load : {50.0, 100.0, 200.0}) {
    const double now = decibels(test::amplitudeAt(
        test::soundOf({.speed = 8.0, .load = load, .listener = farAbove(8.0)}), frequency));
    const double wanted = decibels(following(load, frequency) * averaged(load));
    if (level != 0.0) std::printf("%8g %16.3f %16.3f\n", load, now - level, wanted - expected);
    level = now;
    expected = wanted;
  }
}

/// Power spectrum, by frequency.
std::vector<double> powerOf(std::span<const double> sound) {
  std::size_t size = 1;
  while (size < sound.size())
    size *= 2;
  std::vector<double> padded(size, 0.0);
  for (std::size_t n = 0; n < sound.size(); ++n) {
    const double phase =
        2.0 * std::numbers::pi * static_cast<double>(n) / static_cast<double>(sound.size());
    padded[n] = sound[n] * (1.0 - std::cos(phase));
  }
  std::vector<std::complex<double>> spectrum;
  Eigen::FFT<double>().fwd(spectrum, padded);
  std::vector<double> power(size / 2);
  for (std::size_t k = 0; k < power.size(); ++k)
    power[k] = std::norm(spectrum[k]);
  return power;
}

/// Level of a third octave in dB.
double thirdOctave(const std::vector<double>& power, double centre) {
  const double perBin = WavySlide::kRate / (2.0 * static_cast<double>(power.size()));
  const double edge = std::exp2(1.0 / 6.0);
  double sum = 0.0;
  for (auto k = static_cast<std::size_t>(std::ceil(centre / edge / perBin));
       static_cast<double>(k) * perBin < centre * edge; ++k)
    sum += power[k];
  return 10.0 * std::log10(sum);
}

std::vector<double> soundOf(const Scene& scene) {
  Result<SceneSound> sound = SceneSound::create(scene);
  if (!sound) {
    std::fprintf(stderr, "bench_contact_accuracy: %s\n", sound.error().message.c_str());
    std::exit(1);
  }
  std::vector<std::vector<float>> block(1, std::vector<float>(4096));
  std::vector<double> all;
  while (const std::size_t frames = sound->render(block))
    all.insert(all.end(), block[0].begin(), block[0].begin() + static_cast<std::ptrdiff_t>(frames));
  return all;
}

Scene readScene(const std::string& bodies, const std::string& friction, double duration) {
  const std::string text = R"({"duration": )" + std::to_string(duration) + R"(,
    "materials": {"board": {"density": 706, "youngs_modulus": 1.26e10, "poissons_ratio": 0.424,
      "restitution": 0.3, )" +
                           friction + R"(
      "roughness": {"rms_height": 1e-6, "correlation_length": 1e-4}}},
    "stepper": {"type": "bullet"},
    "bodies": [{"type": "plane", "name": "floor", "normal": [0, 1, 0], "offset": 0,
      "material": "board"}, )" +
                           bodies + R"(],
    "listeners": [{"name": "ear", "position": [0, 1.5, 1.5]}]})";
  Result<Scene> scene = parseScene(text, "bench");
  if (!scene) {
    std::fprintf(stderr, "bench_contact_accuracy: %s\n", scene.error().message.c_str());
    std::exit(1);
  }
  return *std::move(scene);
}

struct Sliding {
  const char* name;
  Scene scene;
  double from;  // s, begin of its sliding part
  double to;
};

constexpr double kPlacesApart = 0.05;  // m

/// Compares slides at several steps. The floor is rough by chance: from one slide a band of some
/// tens of hertz is known only to 1 dB or so, whatever the steps. Therefore several slides are
/// averaged; the first of them is shown by itself as well.
void printSteps(const Sliding& sliding, int places) {
  std::printf("\n%s: third octaves beside those at a step of 1/1000 s, dB\n", sliding.name);
  std::printf("%17s %17s %15s %d\n", "", "one slide", "mean of", places);
  std::printf("%8s %8s %8s %8s %8s %8s\n", "Hz", "level", "1/60", "1/240", "1/60", "1/240");
  std::vector<std::vector<double>> powers(6);  // per step: one slide, then the sum of all
  std::vector<double> rests;
  const std::array<double, 3> steps = {1.0 / 60.0, 1.0 / 240.0, 1.0 / 1000.0};
  for (int index = 0; index < 3 * places; ++index) {
    const auto which = static_cast<std::size_t>(index) % 3;
    Scene scene = sliding.scene;
    scene.stepper.step = steps[which];
    std::get<SolidShape>(scene.bodies[1].shape).position.z() += kPlacesApart * (index / 3);
    const std::vector<double> sound = soundOf(scene);
    const auto part = [&](double from, double to) {
      return std::span(sound).subspan(static_cast<std::size_t>(from * WavySlide::kRate),
                                      static_cast<std::size_t>((to - from) * WavySlide::kRate));
    };
    const auto slide = part(sliding.from, sliding.to);
    const auto rest = part(scene.duration - 0.3, scene.duration - 0.05);
    const std::vector<double> power = powerOf(slide);
    std::vector<double>& sum = powers[3 + which];
    sum.resize(power.size());
    std::ranges::transform(sum, power, sum.begin(), std::plus<>());
    if (index >= 3) continue;
    powers[which] = power;
    rests.push_back(
        decibels(test::rms({rest.begin(), rest.end()}) / test::rms({slide.begin(), slide.end()})));
  }
  std::array<double, 2> worst{};
  double loudest = -1e9;
  const auto centreOf = [](int band) { return 1000.0 * std::exp2(band / 3.0); };
  for (int band = -9; band <= 12; ++band)
    loudest = std::max(loudest, thirdOctave(powers[2], centreOf(band)));
  for (int band = -9; band <= 12; ++band) {
    const double centre = centreOf(band);
    const double reference = thirdOctave(powers[2], centre);
    if (reference < loudest - kHeard) continue;
    std::printf("%8.0f %8.1f", centre, reference - loudest);
    for (std::size_t which : {0U, 1U, 3U, 4U}) {
      const double beside = thirdOctave(powers[which / 3 * 3 + 2], centre);
      const double difference = thirdOctave(powers[which], centre) - beside;
      worst[which / 3] = std::max(worst[which / 3], std::abs(difference));
      std::printf(" %8.2f", difference);
    }
    std::printf("\n");
  }
  std::printf("%8s %17.2f %17.2f\nat the end, beside the slide: %.0f, %.0f and %.0f dB\n", "worst",
              worst[0], worst[1], rests[0], rests[1], rests[2]);
}

/// Compares a ball on a wavy plane, moved by Bullet's mechanics, with closed forms.
void printRoll() {
  std::printf(
      "\na ball of 5 mm rolls down a slope of 10 degrees, over waves of %g mm: 50 ms each\n"
      "%8s %10s %10s %9s %12s %12s %10s\n",
      1e3 * WavySlide::kWave, "s", "v/l, Hz", "heard, Hz", "error, %", "level, dB", "expected, dB",
      "error, dB");
  const std::string text = R"({"duration": 2, "gravity": [0, -9.661, 1.7035],
    "materials": {"m": {"density": 8940, "youngs_modulus": 1.234e11, "poissons_ratio": 0.34,
      "restitution": 0, "friction": 1}},
    "stepper": {"type": "bullet", "step": 0.002},
    "bodies": [{"type": "plane", "name": "floor", "normal": [0, 1, 0], "offset": 0,
      "material": "m"}, {"type": "sphere", "name": "ball", "radius": 0.005, "material": "m",
      "position": [0, 0.005, 0]}],
    "listeners": [{"name": "ear", "position": [0, 40, 0]}]})";
  const Result<Scene> scene = parseScene(text, "bench");
  if (!scene) std::exit(1);
  const auto stepper = makeStepper(*scene);
  if (!stepper) std::exit(1);
  SynthSettings settings;
  settings.audibleThreshold = 0.0;
  Synth synth = *Synth::create(settings, scene->listeners);
  const auto& shape = std::get<SphereShape>(scene->bodies[1].shape);
  SoundBody floor{.material = scene->bodies[0].material};
  floor.texture = test::wavyFloor(1e-4F);
  if (!synth.setBody(0, floor) ||
      !synth.setBody(
          1, {.material = scene->bodies[1].material, .mass = shape.mass, .radius = shape.radius}))
    std::exit(1);
  (void)(*stepper)->advanceTo(scene->duration);
  for (const ContactState& contact : (*stepper)->contacts())
    synth.updateContact(contact);
  const std::vector<double> sound =
      test::rendered(synth, static_cast<std::size_t>(scene->duration * WavySlide::kRate));
  constexpr double kWindow = 0.05;
  const double delay = 40.0 / settings.medium.speedOfSound;
  double reference = 0.0;
  double worstPitch = 0.0;
  double worstLevel = 0.0;
  for (double time = 0.5; time + kWindow + delay < scene->duration; time += kWindow) {
    const auto first = static_cast<std::size_t>((time + delay) * WavySlide::kRate);
    const auto count = static_cast<std::size_t>(kWindow * WavySlide::kRate);
    const std::vector<double> window(sound.begin() + static_cast<std::ptrdiff_t>(first),
                                     sound.begin() + static_cast<std::ptrdiff_t>(first + count));
    // The ball is accelerated by 5/7 of the pull along the slope; straight above there is no
    // Doppler shift.
    const double speed = 5.0 / 7.0 * 1.7035 * (time + 0.5 * kWindow);
    const double pitch = speed / WavySlide::kWave;
    const std::vector<double> power = powerOf(window);
    const double perBin = WavySlide::kRate / (2.0 * static_cast<double>(power.size()));
    double sum = 0.0;
    double moment = 0.0;
    for (std::size_t k = 1; k < power.size(); ++k) {
      sum += power[k];
      moment += power[k] * static_cast<double>(k) * perBin;
    }
    const double heard = moment / sum;
    // The force is m v s w and the pressure its slope: the amplitude grows with the cube of the
    // speed.
    const double level = 10.0 * std::log10(sum);
    const double expected =
        60.0 * std::log10(speed) + decibels(following(shape.mass * 9.661, pitch));
    if (reference == 0.0) reference = level - expected;
    const double error = level - expected - reference;
    worstPitch = std::max(worstPitch, std::abs(heard / pitch - 1.0));
    worstLevel = std::max(worstLevel, std::abs(error));
    std::printf("%8.2f %10.1f %10.1f %9.2f %12.2f %12.2f %10.2f\n", time, pitch, heard,
                100.0 * (heard / pitch - 1.0), level - reference, expected, error);
  }
  std::printf("worst: %.2f %%, %.2f dB\n", 100.0 * worstPitch, worstLevel);
}

int run(const Scale& scale) {
  const int places = scale.of(8, 1);  // slides, one beside the other
  printPitch();
  printLoad();
  const std::string box = R"({"type": "solid", "name": "box", "shape": {"type": "box",
    "half_extents": [0.05, 0.03, 0.04]}, "material": "board", )";
  printSteps({"a box slides without friction, at 1 m/s",
              readScene(box + R"("position": [-2, 0.03, 0], "velocity": [1, 0, 0]})",
                        R"("friction": 0,)", 4.0),
              0.2, 3.6},
             places);
  printSteps({"a box slides to rest, from 2 m/s",
              readScene(box + R"("position": [-1, 0.03, 0], "velocity": [2, 0, 0]})",
                        R"("friction": 0.15,)", 2.5),
              0.1, 1.2},
             places);
  printRoll();
  return 0;
}

}  // namespace
}  // namespace carom::bench

int main(int argc, char** argv) {
  return carom::bench::TableProgram{"bench_contact_accuracy", carom::bench::kHelp,
                                    carom::bench::run}
      .main(argc, argv);
}
