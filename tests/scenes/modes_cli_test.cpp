// `carom modes` and `carom strike` as a user runs them.

#include <cmath>
#include <complex>
#include <cstddef>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/scenes/command.h"
#include "tests/support/constants.h"
#include "tests/support/recording.h"
#include "tests/support/temporary_folder.h"

namespace carom::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// Edges of the bar in these tests, in m.
constexpr double kLength = 0.2;
constexpr double kWidth = 0.02;
constexpr double kHeight = 0.01;

// Density in kg/m^3 and Young's modulus in Pa of carbon steel (audio/material.h).
constexpr double kDensity = 7850.0;
constexpr double kYoungsModulus = 210e9;

/// The bar as a box around the origin, with `unit` units of the file to the metre; without its
/// upper face if `open`.
std::string boxObj(double unit = 1.0, bool open = false) {
  std::string text;
  for (const int x : {-1, 1})
    for (const int y : {-1, 1})
      for (const int z : {-1, 1})
        text += "v " + std::to_string(0.5 * unit * kLength * x) + ' ' +
                std::to_string(0.5 * unit * kWidth * y) + ' ' +
                std::to_string(0.5 * unit * kHeight * z) + '\n';
  text += "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\n";
  return open ? text : text + "f 2 6 8 4\n";
}

/// Amplitude of a tone in a Hann window of `seconds` that begins at `from` (s).
double amplitudeOf(const Recording& recording, double frequency, double from, double seconds) {
  const double rate = recording.info.samplerate;
  const auto first = static_cast<std::size_t>(std::lround(from * rate));
  const auto count = static_cast<std::size_t>(std::lround(seconds * rate));
  std::complex<double> sum;
  for (std::size_t sample = 0; sample < count; ++sample) {
    const double window =
        1.0 - std::cos(2.0 * kPi * static_cast<double>(sample) / static_cast<double>(count));
    const double phase = 2.0 * kPi * frequency * static_cast<double>(first + sample) / rate;
    sum += window * recording.samples.at(first + sample) * std::polar(1.0, -phase);
  }
  return 2.0 * std::abs(sum) / static_cast<double>(count);
}

class ModesCli : public testing::Test {
 protected:
  ModesCli() { write("bar.obj", boxObj()); }

  std::string at(const std::string& name) const { return (folder_ / name).string(); }

  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return at(name);
  }

  /// The arguments of `carom modes` for a mesh of steel.
  std::vector<std::string> modes(const std::string& mesh,
                                 const std::vector<std::string>& options = {}) const {
    std::vector<std::string> command = {"modes", at(mesh), "--material", "carbon_steel"};
    command.insert(command.end(), options.begin(), options.end());
    return command;
  }

  std::vector<std::string> solid(const std::vector<std::string>& options = {}) const {
    std::vector<std::string> command = modes("bar.obj", {"--dofs", "600", "--modes", "5"});
    command.insert(command.end(), options.begin(), options.end());
    return command;
  }

  /// The arguments of `carom strike` with an impact from above on the end of the bar, where all
  /// bending modes move.
  std::vector<std::string> strike(const std::string& model,
                                  const std::vector<std::string>& options = {}) const {
    std::vector<std::string> command = {"strike",    at(model),   "--at", "0.1,0,0.005",
                                        "--impulse", "0,0,-0.05", "-o",   at("strike.wav")};
    command.insert(command.end(), options.begin(), options.end());
    return command;
  }

  /// Writes the bar's model to bar.carom_modes and returns its table.
  json barModel() const {
    return parsed(
        carom(solid({"--no-cache", "--panels", "200", "-o", at("bar.carom_modes"), "--json"})));
  }

  const TemporaryFolder folder_;
};

// carom modes

TEST_F(ModesCli, ASlenderBarRingsAsEulerAndBernoulliSay) {
  const json bar = parsed(carom(solid({"--no-cache", "--no-radiation", "--json"})));
  // Both ends are free: cos x cosh x = 1 (Rossing and Fletcher, Principles of Vibration and Sound).
  const double root = 4.730040745;
  const auto bending = [&](double thickness) {
    return root * root / (2.0 * kPi * kLength * kLength) *
           std::sqrt(kYoungsModulus * thickness * thickness / 12.0 / kDensity);
  };
  ASSERT_EQ(bar.at("modes").size(), 5u);
  EXPECT_NEAR(bar["modes"][0].at("frequency_hz"), bending(kHeight), 0.02 * bending(kHeight));
  EXPECT_NEAR(bar["modes"][1].at("frequency_hz"), bending(kWidth), 0.04 * bending(kWidth));
  EXPECT_NEAR(bar.at("mass_kg"), kLength * kWidth * kHeight * kDensity, 1e-6);
  EXPECT_EQ(bar.at("left_out").at("rigid"), 6);
  EXPECT_EQ(bar.at("name"), "bar");
  EXPECT_EQ(bar.at("material"), "carbon_steel");
  EXPECT_EQ(bar.at("from_cache"), false);
  EXPECT_TRUE(bar.at("findings").empty());
}

TEST_F(ModesCli, DecayIsRayleighsDampingAndHeat) {
  const json bar = parsed(carom(solid({"--no-cache", "--no-radiation", "--json"})));
  const Material& steel = *findMaterial("carbon_steel");
  for (const json& mode : bar.at("modes")) {
    const double turning = 2.0 * kPi * mode.at("frequency_hz").get<double>();
    const double rate = 0.5 * (steel.dampingAlpha + steel.dampingBeta * turning * turning);
    EXPECT_NEAR(mode.at("decay_rate_per_s"), rate + mode.at("heat_decay_rate_per_s").get<double>(),
                1e-9 * rate);
  }
  const json& lowest = bar.at("modes").at(0);  // bends across its height
  const double frequency = lowest.at("frequency_hz");
  const double heat = kPi * frequency * thermoelasticLossFactor(steel, kHeight, frequency);
  EXPECT_NEAR(lowest.at("heat_decay_rate_per_s"), heat, 0.03 * heat);
}

TEST_F(ModesCli, TheTableHasTheNumbersOfTheJson) {
  const json bar = parsed(carom(solid({"--no-cache", "--no-radiation", "--json"})));
  const Outcome text = carom(solid({"--no-cache", "--no-radiation"}));
  EXPECT_EQ(text.code, 0);
  EXPECT_EQ(text.out.find("bar: carbon_steel, 0.314 kg, 5 modes\n"), 0u) << text.out;
  for (const json& mode : bar.at("modes")) {
    char frequency[32];
    std::snprintf(frequency, sizeof frequency, " %.2f ", mode.at("frequency_hz").get<double>());
    EXPECT_NE(text.out.find(frequency), std::string::npos) << text.out;
  }
  EXPECT_NE(text.out.find("left out: 6 rigid"), std::string::npos) << text.out;
  const std::string one =
      carom(modes("bar.obj", {"--dofs", "600", "--modes", "1", "--no-cache", "--no-radiation"}))
          .out;
  EXPECT_NE(one.find(", 1 mode\n"), std::string::npos) << one;
}

TEST_F(ModesCli, TheSecondRunComesFromTheCacheAndSaysTheSame) {
  const std::vector<std::string> command =
      solid({"--no-radiation", "--cache", at("cache"), "--json"});
  json first = parsed(carom(command));
  json second = parsed(carom(command));
  EXPECT_EQ(first.at("from_cache"), false);
  EXPECT_EQ(second.at("from_cache"), true);
  EXPECT_TRUE(first.contains("degrees_of_freedom"));
  EXPECT_EQ(first.at("modes"), second.at("modes"));
  std::vector<std::string> afresh = command;
  afresh.push_back("--no-cache");
  EXPECT_EQ(parsed(carom(afresh)).at("from_cache"), false);
  EXPECT_NE(carom(solid({"--no-radiation", "--cache", at("cache")})).out.find("from the cache"),
            std::string::npos);
}

// Half the size in every direction doubles the frequencies, as the elastic equations have no
// length.
TEST_F(ModesCli, SaysWhatItWillTakeUnlessItIsThereAlready) {
  const std::vector<std::string> options = {"--modes", "2",       "--panels",
                                            "200",     "--cache", at("cache")};
  const std::string said = carom(modes("bar.obj", options)).err;
  EXPECT_NE(said.find("bar.obj: 12 triangles; grids are refined until frequencies are within 1 %, "
                      "for at most half a minute and 4 GB; then 1 s for how up to 2 modes radiate"),
            std::string::npos)
      << said;
  EXPECT_EQ(carom(modes("bar.obj", options)).err, "");
}

TEST_F(ModesCli, MaterialOfAFileRingsAsItsNumbersSay) {
  // Frequencies go as sqrt(E / density): a quarter of the density has twice those.
  const std::string light = write("light.json", R"({"like": "carbon_steel", "density": 1962.5})");
  const auto bar = [&](const std::string& material) {
    return parsed(carom({"modes", at("bar.obj"), "--material", material, "--dofs", "600", "--modes",
                         "2", "--no-cache", "--no-radiation", "--json"}));
  };
  const json made = bar(light);
  EXPECT_EQ(made.at("material"), "light");
  EXPECT_NEAR(made.at("modes").at(0).at("frequency_hz").get<double>() /
                  bar("carbon_steel").at("modes").at(0).at("frequency_hz").get<double>(),
              2.0, 1e-6);
}

TEST_F(ModesCli, ScaleIsTheSizeOfOneUnit) {
  const std::vector<std::string> options = {"--dofs", "600", "--no-cache", "--no-radiation",
                                            "--json"};
  write("mm.obj", boxObj(1000.0));
  const json metres = parsed(carom(modes("bar.obj", options)));
  std::vector<std::string> inMillimetres = options;
  inMillimetres.insert(inMillimetres.end(), {"--scale", "0.0005"});
  const json half = parsed(carom(modes("mm.obj", inMillimetres)));
  for (std::size_t mode = 0; mode < 5; ++mode) {
    const double frequency = metres["modes"][mode]["frequency_hz"];
    EXPECT_NEAR(half["modes"][mode]["frequency_hz"], 2.0 * frequency, 1e-3 * frequency);
  }
}

TEST_F(ModesCli, ASizeThatIsLikelyWrongIsToldOnceAndBeforeTheAnalysis) {
  write("mm.obj", boxObj(1000.0));
  const std::string said =
      carom(modes("mm.obj", {"--dofs", "600", "--no-cache", "--no-radiation"})).err;
  const std::size_t size = said.find("too_large");
  ASSERT_NE(size, std::string::npos) << said;
  EXPECT_LT(size, said.find("12 triangles")) << said;
  EXPECT_EQ(said.find("too_large", size + 1), std::string::npos) << said;
}

TEST_F(ModesCli, AnOpenMeshIsAShellOfTheThicknessGiven) {
  write("open.obj", boxObj(1.0, true));
  const std::vector<std::string> options = {"--no-cache", "--no-radiation", "--json"};
  std::vector<std::string> thin = options;
  thin.insert(thin.end(), {"--thickness", "1"});
  std::vector<std::string> thick = options;
  thick.insert(thick.end(), {"--thickness", "2", "--springs", "axial"});
  const Outcome shell = carom(modes("open.obj", thin));
  EXPECT_NE(shell.err.find("open"), std::string::npos) << shell.err;
  const double area = kLength * kWidth + 2.0 * kHeight * (kLength + kWidth);
  const double mass = parsed(shell).at("mass_kg");
  EXPECT_NEAR(mass, 1e-3 * area * kDensity, 1e-6);
  EXPECT_NEAR(parsed(carom(modes("open.obj", thick))).at("mass_kg"), 2.0 * mass, 1e-9);
}

TEST_F(ModesCli, WhatCannotBeHeardIsSaidAndNoError) {
  const Outcome outcome =
      carom(solid({"--no-cache", "--no-radiation", "--json", "--scale", "0.01"}));
  EXPECT_TRUE(parsed(outcome).at("modes").empty());
  EXPECT_NE(outcome.err.find("--scale"), std::string::npos) << outcome.err;
}

TEST_F(ModesCli, WrongUseOfModesIs2WithOneSentenceAndNothingIsWritten) {
  write("open.obj", boxObj(1.0, true));
  write("text.obj", "no mesh at all\n");
  write("bad.json", R"({"like": "wood", "densty": 500})");
  const std::string mesh = at("bar.obj");
  const std::string before = contents(mesh);
  struct Refused {
    std::vector<std::string> command;
    std::string says;
  };
  const std::vector<std::string> output = {"-o", at("bar.carom_modes")};
  for (auto [command, says] : std::vector<Refused>{
           {{"modes"}, "MESH is required"},
           {{"modes", mesh}, "--material is required"},
           {{"modes", mesh, "--material", "unobtainium"}, "unknown material \"unobtainium\""},
           {{"modes", mesh, "--material", "wod"}, "did you mean \"wood\""},
           {{"modes", mesh, "--material", "oak"}, "did you mean \"red_oak\""},
           {{"modes", mesh, "--material", "absent.json"}, "absent.json"},
           {{"modes", mesh, "--material", at("bad.json")}, "bad.json: /densty: unknown key"},
           {modes("missing.obj"), "missing.obj"},
           {modes("text.obj"), "text.obj"},
           {modes("open.obj"), "closed"},
           {modes("open.obj", {"--solid"}), "closed"},
           {solid({"--thickness", "1"}), "--dofs"},
           {modes("bar.obj", {"--thickness", "1", "--solid"}), "--thickness excludes --solid"},
           {modes("bar.obj", {"--thickness", "0"}), "millimetres"},
           {modes("bar.obj", {"--thickness", "1000"}), "thick"},
           {modes("bar.obj", {"--springs", "axial"}), "--springs requires --thickness"},
           {modes("bar.obj", {"--thickness", "1", "--springs", "coil"}), "transverse or axial"},
           {modes("bar.obj", {"--dofs", "99"}), "from 192 to"},
           {modes("bar.obj", {"--modes", "0"}), "from 1 to 2000"},
           {modes("bar.obj", {"--modes", "1.5"}), "whole"},
           {modes("bar.obj", {"--panels", "99"}), "from 100 to 5000"},
           {modes("bar.obj", {"--panels", "200", "--no-radiation"}), "excludes"},
           {modes("bar.obj", {"--scale", "0"}), "metres"},
           {modes("bar.obj", {"--scale", "nan"}), "metres"},
           {modes("bar.obj", {"--cache", ""}), "names no folder"},
           {modes("bar.obj", {"-o", mesh}), "would take the place of"},
           {modes("bar.obj", {"-o", ""}), "names no file"}}) {
    if (command.back() != mesh && !command.back().empty())
      command.insert(command.end(), output.begin(), output.end());
    const std::string message = expectRefused(command, 2);
    EXPECT_NE(message.find(says), std::string::npos) << message;
  }
  EXPECT_EQ(folder_.entries(), 4u);
  EXPECT_EQ(contents(mesh), before);
}

TEST_F(ModesCli, ModelsThatCannotBeWrittenAre1AndNothingIsLeft) {
  for (const std::string& target :
       {at("no/bar.carom_modes"), folder_.path().string(), std::string("/dev/full")})
    expectRefused(solid({"--no-cache", "--no-radiation", "-o", target}), 1);
  const Outcome full = carom(solid({"--no-cache", "--no-radiation", "-o", at("bar.carom_modes")}),
                             {.largestFile = 4096});
  EXPECT_EQ(full.code, 1);
  EXPECT_EQ(full.out, "");
  EXPECT_NE(full.err.find(at("bar.carom_modes")), std::string::npos) << full.err;
  EXPECT_EQ(folder_.entries(), 1u);
}

// carom strike

TEST_F(ModesCli, AStruckBarSoundsAsItsTableSays) {
  const json bar = barModel();
  const json report =
      parsed(carom(strike("bar.carom_modes", {"--duration", "0.6", "--no-click", "--json"})));
  const Recording sound = readRecording(at("strike.wav"));
  EXPECT_EQ(report.at("modes"), 5);
  EXPECT_DOUBLE_EQ(report.at("duration_s"), 0.6);
  EXPECT_NEAR(report.at("peak_pa"), 20.0 * sound.peak(), 1e-5);
  EXPECT_EQ(sound.info.channels, 1);
  EXPECT_EQ(sound.info.samplerate, 48000);
  const double begin = 0.1;
  const double window = 0.2;
  int loud = 0;
  for (const json& mode : bar.at("modes")) {
    const double frequency = mode.at("frequency_hz");
    const double first = amplitudeOf(sound, frequency, begin, window);
    if (20.0 * first < 1e-6) continue;  // Pa: not excited by this impact
    ++loud;
    const double second = amplitudeOf(sound, frequency, begin + window, window);
    const double rate = mode.at("decay_rate_per_s");
    EXPECT_NEAR(std::log(first / second) / window, rate, 0.01 * rate) << frequency;
  }
  EXPECT_GE(loud, 2);
}

// The ring after the impact is proportional to the impulse, except for the effect of the contact's
// duration, which depends on it: 50 us are short at 1.3 kHz, but a harder blow is shorter, and
// leaves more of itself to the modes above 20 kHz, of which such a contact lasts one period.
TEST_F(ModesCli, TwiceAsHardIsTwiceAsLoud) {
  const double frequency = barModel().at("modes").at(0).at("frequency_hz");
  const std::vector<std::string> options = {"--duration", "0.4", "--no-click"};
  ASSERT_EQ(carom(strike("bar.carom_modes", options)).code, 0);
  const double once = amplitudeOf(readRecording(at("strike.wav")), frequency, 0.1, 0.2);
  std::vector<std::string> harder = strike("bar.carom_modes", options);
  harder[5] = "0,0,-0.1";
  ASSERT_EQ(carom(harder).code, 0);
  const double twice = amplitudeOf(readRecording(at("strike.wav")), frequency, 0.1, 0.2);
  ASSERT_GT(once, 0.0);
  EXPECT_LT(twice / once, 2.0);
  EXPECT_GT(twice / once, 1.96);
}

TEST_F(ModesCli, GltfIsAModelToo) {
  barModel();
  const json own = parsed(carom(strike("bar.carom_modes", {"--duration", "0.1", "--json"})));
  ASSERT_EQ(carom(solid({"--no-cache", "--panels", "200", "-o", at("bar.glb")})).code, 0);
  EXPECT_EQ(contents(at("bar.glb")).substr(0, 4), "glTF");
  const json other = parsed(carom(strike("bar.glb", {"--duration", "0.1", "--json"})));
  EXPECT_EQ(other.at("modes"), 5);
  EXPECT_NEAR(other.at("contact_s"), own.at("contact_s"), 0.01 * own.at("contact_s").get<double>());
}

TEST_F(ModesCli, WithoutADurationItEndsWhenItIsSilent) {
  barModel();
  const json whole = parsed(carom(strike("bar.carom_modes", {"--json"})));
  EXPECT_GT(whole.at("duration_s"), 0.5);
  EXPECT_LT(whole.at("duration_s"), 60.0);
  const Recording sound = readRecording(at("strike.wav"));
  EXPECT_LT(20.0 * std::abs(sound.samples.back()), 2e-5);
  EXPECT_GT(whole.at("peak_pa"), 0.1);
}

TEST_F(ModesCli, AStrikeThatIsHardlyHeardSaysHowItWouldBe) {
  barModel();
  const std::string said = carom(strike("bar.carom_modes", {"--full-scale", "1e5"})).err;
  EXPECT_NE(said.find("dB of full scale, hardly heard: --normalize"), std::string::npos) << said;
  EXPECT_EQ(carom(strike("bar.carom_modes", {"--normalize"})).err, "");
}

TEST_F(ModesCli, WrongUseOfStrikeIs2WithOneSentenceAndNothingIsWritten) {
  barModel();
  const std::string model = at("bar.carom_modes");
  const std::string before = contents(model);
  const auto hit = [&](const std::string& place, const std::string& impulse) {
    return std::vector<std::string>{"strike",    model,   "--at", place,
                                    "--impulse", impulse, "-o",   at("strike.wav")};
  };
  fs::copy_file(model, at("model.wav"));
  write("cut.carom_modes", before.substr(0, before.size() / 2));
  write("no.glb", "no glTF");
  const std::size_t files = folder_.entries();
  struct Refused {
    std::vector<std::string> command;
    std::string says;
  };
  for (const auto& [command, says] : std::vector<Refused>{
           {{"strike"}, "MODEL is required"},
           {{"strike", model, "--impulse", "0,0,1", "-o", at("strike.wav")}, "--at is required"},
           {{"strike", model, "--at", "0,0,0", "-o", at("strike.wav")}, "--impulse is required"},
           {{"strike", model, "--at", "0,0,0", "--impulse", "0,0,1"}, "--output is required"},
           {hit("nonsense", "0,0,1"), "expected three numbers"},
           {hit("0,0", "0,0,1"), "expected three numbers"},
           {hit("0,0,0,0", "0,0,1"), "expected three numbers"},
           {hit("0,0,nan", "0,0,1"), "expected three numbers"},
           {hit("0,0,0", "0,0,0"), "nothing hits"},
           {hit("0,0,0", "0,0,inf"), "expected three numbers"},
           {strike("missing.carom_modes"), "missing.carom_modes"},
           {strike("bar.obj"), "no modal model"},
           {strike("cut.carom_modes"), "cut.carom_modes"},
           {strike("no.glb"), "no.glb"},
           {strike("bar.carom_modes", {"--hammer", "cheese"}), "unknown material \"cheese\""},
           {strike("bar.carom_modes", {"--hammer-mass", "0"}), "kilograms"},
           {strike("bar.carom_modes", {"--hammer-radius", "0"}), "metres"},
           {strike("bar.carom_modes", {"--listener", "0,0,0"}), "--listener"},
           {strike("bar.carom_modes", {"--modal-radiation", "loud"}), "monopole or constant"},
           {strike("bar.carom_modes", {"--duration", "0"}), "seconds"},
           {strike("bar.carom_modes", {"--sample-rate", "7999"}), "Hz"},
           {strike("bar.carom_modes", {"--full-scale", "1", "--normalize"}), "excludes"},
           {{"strike", model, "--at", "0,0,0", "--impulse", "0,0,1", "-o", at("a.mp3")}, "WAV"},
           {{"strike", at("model.wav"), "--at", "0,0,0", "--impulse", "0,0,1", "-o",
             at("model.wav")},
            "would take the place of"}}) {
    const std::string message = expectRefused(command, 2);
    EXPECT_NE(message.find(says), std::string::npos) << message;
  }
  EXPECT_EQ(folder_.entries(), files);
  EXPECT_EQ(contents(model), before);
  EXPECT_EQ(contents(at("model.wav")), before);
}

TEST_F(ModesCli, SoundsThatCannotBeWrittenAre1AndNothingIsLeft) {
  barModel();
  const std::size_t files = folder_.entries();
  std::vector<std::string> command = strike("bar.carom_modes");
  EXPECT_EQ(carom(command, {.largestFile = 16'384}).code, 1);
  command.back() = at("no/strike.wav");
  expectRefused(command, 1);
  EXPECT_EQ(folder_.entries(), files);
}

// Help

TEST_F(ModesCli, HelpHasExamples) {
  for (const std::string command : {"modes", "strike"}) {
    EXPECT_NE(carom({"--help"}).out.find("\n  " + command + " "), std::string::npos);
    const Outcome help = carom({command, "--help"});
    EXPECT_EQ(help.code, 0);
    EXPECT_EQ(help.err, "");
    EXPECT_NE(help.out.find("\n  carom " + command + " "), std::string::npos) << help.out;
  }
}

// The whole way: a mesh, its model, and a scene that names the model.
TEST_F(ModesCli, ASceneRingsByAModelFile) {
  barModel();
  const std::string scene = R"({
    "duration": 0.6, "stepper": {"type": "bullet", "step": 0.001},
    "bodies": [
      {"type": "plane", "normal": [0, 1, 0], "offset": 0, "material": "concrete"},
      {"type": "solid", "name": "bar", "shape": {"type": "mesh", "file": "bar.obj"},
       "material": "carbon_steel", "position": [0, 0.1, 0],
       "rotation": {"axis": [0, 0, 1], "angle": 20}MODES}],
    "listeners": [{"position": [0, 0.5, 0.5]}]})";
  const auto with = [&](const std::string& modes) {
    std::string text = scene;
    return text.replace(text.find("MODES"), 5, modes);
  };
  const auto tail = [&](const std::string& file) {
    const Outcome outcome = carom({"render", file, "-o", at("sound.wav")});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    const Recording sound = readRecording(at("sound.wav"));
    double sum = 0.0;
    EXPECT_GE(sound.samples.size(), 28800U);
    for (std::size_t sample = 14400; sample < 28800; ++sample)  // the second half of the scene
      sum += sound.samples[sample] * sound.samples[sample];
    return sum;
  };
  const double dry = tail(write("dry.json", with("")));
  const double ringing = tail(write("rings.json", with(R"(, "modes": "bar.carom_modes")")));
  EXPECT_GT(ringing, 10.0 * dry);
  const std::size_t files = folder_.entries();
  const std::string absent = write("absent.json", with(R"(, "modes": "absent.carom_modes")"));
  const std::string message = expectRefused({"render", absent, "-o", at("new.wav")}, 1);
  EXPECT_NE(message.find("bar: "), std::string::npos) << message;
  EXPECT_NE(message.find("absent.carom_modes"), std::string::npos) << message;
  EXPECT_EQ(folder_.entries(), files + 1);
}

}  // namespace
}  // namespace carom::test
