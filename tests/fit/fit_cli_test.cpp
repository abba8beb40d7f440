// `carom fit` as a user runs it.

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "lab/fit/fit_files.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sndfile.h>

#include "carom/audio/modal_model_file.h"
#include "scenes/format/material_reader.h"
#include "tests/fit/synthetic_tap.h"
#include "tests/scenes/command.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/vibration_references.h"

namespace carom::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

void writeSound(const std::filesystem::path& file, const std::vector<double>& samples,
                int sampleRate = 48000, int encoding = SF_FORMAT_PCM_16) {
  SF_INFO info = {};
  info.samplerate = sampleRate;
  info.channels = 1;
  info.format = (file.extension() == ".flac" ? SF_FORMAT_FLAC : SF_FORMAT_WAV) | encoding;
  SNDFILE* const sound = sf_open(file.c_str(), SFM_WRITE, &info);
  ASSERT_NE(sound, nullptr);
  sf_writef_double(sound, samples.data(), static_cast<sf_count_t>(samples.size()));
  sf_close(sound);
}

/// A bar of 0.2 x 0.02 x 0.01 m; without its upper face if `open`.
std::string barObj(bool open) {
  std::string text;
  for (const int x : {-1, 1})
    for (const int y : {-1, 1})
      for (const int z : {-1, 1})
        text += "v " + std::to_string(0.1 * x) + ' ' + std::to_string(0.01 * y) + ' ' +
                std::to_string(0.005 * z) + '\n';
  text += "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\n";
  return open ? text : text + "f 2 6 8 4\n";
}

class FitCommandLine : public testing::Test {
 protected:
  void SetUp() override {
    writeSound(folder_ / "tap.wav", synthesised({{440.0, 3.0, 0.3}, {1210.0, 8.0, 0.3}},
                                                {.seconds = 1.0, .noise = 1e-3}));
    std::ofstream(folder_ / "bar.obj") << barObj(false);
    std::ofstream(folder_ / "open.obj") << barObj(true);
  }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  void expectRefused(const std::vector<std::string>& words, const std::string& why) {
    std::vector<std::string> arguments = {"fit"};
    arguments.insert(arguments.end(), words.begin(), words.end());
    const Outcome outcome = carom(arguments);
    EXPECT_EQ(outcome.code, 2) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr(why));
  }
  TemporaryFolder folder_;
};

TEST_F(FitCommandLine, RefusesWhatIsNoTap) {
  writeSound(folder_ / "silence.wav", std::vector<double>(48000, 0.0));
  writeSound(folder_ / "short.wav", std::vector<double>(1000, 0.1));
  writeSound(folder_ / "slow.wav", std::vector<double>(6000, 0.1), 6000);
  writeSound(folder_ / "steady.wav",
             synthesised({{1000.0, 0.0, 0.5}}, {.seconds = 1.0, .onset = -1.0}));
  std::ofstream(folder_ / "text.wav") << "no sound";
  expectRefused({path("none.wav"), "--mass", "1"}, "no such file");
  expectRefused({path("text.wav"), "--mass", "1"}, "not a sound file");
  expectRefused({path("silence.wav"), "--mass", "1"}, "silent");
  expectRefused({path("short.wav"), "--mass", "1"}, "too short");
  expectRefused({path("slow.wav"), "--mass", "1"}, "samples a second are too few");
  expectRefused({path("steady.wav"), "--mass", "1"}, "no onset");
  writeSound(folder_ / "huge.wav", std::vector<double>(48000, 1e30), 48000, SF_FORMAT_FLOAT);
  expectRefused({path("huge.wav"), "--mass", "1"}, "samples beyond 1e6");
}

TEST_F(FitCommandLine, EndsAtItsLimitWithOrWithoutAMesh) {
  for (const bool hasMesh : {false, true}) {
    std::vector<std::string> words = {"fit", path("tap.wav"), "--max-time", "0.001",
                                      "-o",  path("out")};
    if (hasMesh)
      words.insert(words.end(), {"--mesh", path("bar.obj")});
    else
      words.insert(words.end(), {"--mass", "1"});
    const Outcome outcome = carom(words);
    EXPECT_EQ(outcome.code, 3) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr("--max-time"));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
  }
}

TEST_F(FitCommandLine, ATapIsNeverReplacedByWhatIsWritten) {
  const std::string before = contents(folder_ / "tap.wav");
  expectRefused({path("tap.wav"), "--mass", "1", "-o", path(".")}, "which is read");
  EXPECT_EQ(contents(folder_ / "tap.wav"), before);
}

TEST_F(FitCommandLine, RefusesWhatCannotBeFitted) {
  expectRefused({path("tap.wav")}, "--mass");
  expectRefused({path("tap.wav"), "--mesh", path("open.obj")}, "not closed");
  expectRefused({path("tap.wav"), "--mesh", path("bar.obj"), "--free", "colour"}, "cannot be free");
  expectRefused({path("tap.wav"), "--mesh", path("bar.obj"), "--free", "scale"}, "--material");
  expectRefused({path("tap.wav"), "--mesh", path("bar.obj"), "--material", "steal"},
                "unknown material");
}

TEST_F(FitCommandLine, ATapThatIsNotTheMeshsIsRefusedAndNothingIsWritten) {
  const Outcome outcome = carom({"fit", path("tap.wav"), "--mesh", path("bar.obj"), "-o",
                                 path("out"), "--no-cache", "--json"});
  EXPECT_EQ(outcome.code, 2);
  const json answer = json::parse(outcome.out);
  EXPECT_FALSE(answer["accepted"].get<bool>());
  EXPECT_FALSE(answer["reason"].get<std::string>().empty());
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out" / "index.html"));
}

TEST_F(FitCommandLine, WithoutAMeshTheModesAreAModel) {
  const Outcome outcome = carom({"fit", path("tap.wav"), "--mass", "0.2", "--material", "brass",
                                 "-o", path("out"), "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json answer = json::parse(outcome.out);
  ASSERT_EQ(answer["modes"].size(), 2u);
  EXPECT_NEAR(answer["modes"][0]["measured_hz"].get<double>(), 440.0, 0.05);
  const auto model = readModalModel(folder_ / "out" / "model.carom_modes");
  ASSERT_TRUE(bool(model));
  EXPECT_EQ(model->modes.size(), 2u);
  EXPECT_TRUE(bool(scenes::loadMaterial(folder_ / "out" / "material.json")));
  for (const char* name : {"modes.csv", "spectrum.png", "tap.wav", "measured.wav", "index.html"})
    EXPECT_TRUE(std::filesystem::exists(folder_ / "out" / name)) << name;
  for (const auto& entry : std::filesystem::directory_iterator(folder_ / "out"))
    EXPECT_THAT(lab::kFitFiles, testing::Contains(entry.path().filename().string()));
}

/// A free bar.
struct Bar {
  double length = 0.2;
  double width = 0.02;
  double height = 0.01;
};

Material steel() {
  return {"steel", 7800.0, 200e9, 0.3, 0.9};
}

/// The bar's bending in both planes, as Timoshenko's beam.
std::vector<TapPartial> partialsOf(const Bar& bar) {
  std::vector<TapPartial> partials;
  for (const auto& [depth, width] : {std::pair(bar.height, bar.width), {bar.width, bar.height}})
    for (const double frequency : bendingFrequencies(steel(), bar.length, depth, width, 4))
      if (frequency < 18000.0)
        partials.push_back({frequency, 4.0 + 1e-3 * frequency, 0.1, 1e-3 * frequency});
  return partials;
}

class FitOfABar : public FitCommandLine {
 protected:
  void SetUp() override {
    FitCommandLine::SetUp();
    std::ofstream(folder_ / "steel.json")
        << json({{"like", "carbon_steel"}, {"density", 7800}, {"youngs_modulus", 200e9}});
  }
  void writeTap(const std::string& name, const std::vector<TapPartial>& partials) const {
    writeSound(folder_ / name, synthesised(partials, {.seconds = 2.0, .noise = 3e-4}));
  }
  /// Returns what is told of the taps, with the mesh of the bar of 0.2 m.
  json fitted(std::vector<std::string> words) const {
    words.insert(words.begin(), "fit");
    for (const std::string& word :
         {std::string("--mesh"), path("bar.obj"), std::string("--panels"), std::string("200"),
          std::string("--no-cache"), std::string("--json")})
      words.push_back(word);
    const Outcome outcome = carom(words);
    EXPECT_EQ(outcome.code, 0) << outcome.err << outcome.out;
    return json::parse(outcome.out, nullptr, false);
  }
};

TEST_F(FitOfABar, FindsTheModulus) {
  writeTap("bar.wav", partialsOf({}));
  const json answer = fitted(
      {path("bar.wav"), "--material", "carbon_steel", "--density", "7800", "-o", path("out")});
  EXPECT_TRUE(answer.at("accepted").get<bool>());
  EXPECT_NEAR(answer.at("material").at("youngs_modulus").get<double>() / 200e9, 1.0, 0.01);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "out" / "fitted.wav"));
}

// Each of two taps, one of them in FLAC, has half of the modes, too few for the mesh by itself.
TEST_F(FitOfABar, TakesSeveralTapsOfOneBody) {
  const std::vector<TapPartial> all = partialsOf({});
  std::vector<TapPartial> some;
  std::vector<TapPartial> others;
  for (std::size_t mode = 0; mode < all.size(); ++mode)
    (mode % 2 == 0 ? some : others).push_back(all[mode]);
  writeTap("some.wav", some);
  writeTap("others.flac", others);
  const json answer = fitted(
      {path("some.wav"), path("others.flac"), "--material", "carbon_steel", "--density", "7800"});
  EXPECT_TRUE(answer.at("accepted").get<bool>());
  EXPECT_EQ(answer.at("match").at("matched"), all.size());
  EXPECT_NEAR(answer.at("material").at("youngs_modulus").get<double>() / 200e9, 1.0, 0.01);
}

TEST_F(FitOfABar, FindsTheScaleOfAKnownMaterial) {
  writeTap("bar.wav", partialsOf({.length = 0.23, .width = 0.023, .height = 0.0115}));
  const json answer =
      fitted({path("bar.wav"), "--material", path("steel.json"), "--free", "scale"});
  EXPECT_TRUE(answer.at("accepted").get<bool>());
  EXPECT_NEAR(answer.at("scale").get<double>(), 1.15, 0.005);
  EXPECT_NEAR(answer.at("material").at("youngs_modulus").get<double>(), 200e9, 1e6);
}

// The body is by 1 mm thicker all around than its mesh, so that its bending is stiffer by 20 and by
// 10 % in the two planes: a modulus alone cannot say so.
TEST_F(FitOfABar, FindsHowMuchThickerTheBodyIs) {
  writeTap("bar.wav", partialsOf({.length = 0.202, .width = 0.022, .height = 0.012}));
  const json answer =
      fitted({path("bar.wav"), "--material", path("steel.json"), "--free", "thickness"});
  EXPECT_TRUE(answer.at("accepted").get<bool>());
  EXPECT_NEAR(answer.at("thickness_m").get<double>(), 0.012, 1e-4);
  EXPECT_NEAR(answer.at("material").at("youngs_modulus").get<double>() / 200e9, 1.0, 0.01);
}

}  // namespace
}  // namespace carom::test
