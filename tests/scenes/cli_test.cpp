#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <future>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <pty.h>
#include <sys/stat.h>
#include <unistd.h>

#include "tests/scenes/command.h"
#include "tests/scenes/library.h"
#include "tests/support/recording.h"
#include "tests/support/temporary_folder.h"

namespace carom::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class Cli : public testing::Test {
 protected:
  std::string at(const std::string& name) const { return (folder_ / name).string(); }

  std::string fileWith(const std::string& text) const {
    std::ofstream(folder_ / "scene.json", std::ios::binary) << text;
    return at("scene.json");
  }

  const TemporaryFolder folder_;
};

// Exit codes

TEST_F(Cli, UsageErrorsAre2) {
  const std::string scene = library("two_balls");
  expectRefused({"frobnicate"}, 2);
  expectRefused({"--frobnicate"}, 2);
  expectRefused({"render"}, 2);
  expectRefused({"info"}, 2);
  expectRefused({"compare"}, 2);
  expectRefused({"record"}, 2);
  expectRefused({"record", scene}, 2);
  expectRefused({"record", library("bouncing_ball"), "-o", ""}, 2);
  expectRefused({"record", library("bouncing_ball"), "-o", at("run.carom"), "--stepper", "mujoco"},
                2);
  expectRefused({"replay"}, 2);
  expectRefused({"replay", scene}, 2);
  expectRefused({"render", scene, "-o"}, 2);
  expectRefused({"render", scene, "-o", ""}, 2);
  expectRefused({"render", scene, "-o", at("sound.wav"), "--events", ""}, 2);
  expectRefused({"render", scene, scene, "-o", at("sound.wav")}, 2);
  expectRefused({"render", scene, "-o", at("sound.wav"), "--frobnicate"}, 2);
  expectRefused({"render", scene, "-o", at("sound.wav"), "--stepper", "mujoco"}, 2);
  expectRefused({"render", scene, "-o", at("sound.wav"), "--format", "mp3"}, 2);
  expectRefused({"info", scene, "--step", "0.01"}, 2);
  expectRefused({"info", scene, "render", scene, "-o", at("sound.wav")}, 2);
  EXPECT_EQ(folder_.entries(), 0u);
}

TEST_F(Cli, StepsThatBulletCannotTakeAre2AndTheMessageSaysWhatItTakes) {
  for (const std::string step : {"nan", "NAN", "inf", "-inf", "0", "-0.01", "1", "1e-6", "1e999",
                                 "-1e999", "0.01x", "0,01", "x", "", "1/60", "0.01 0.02"}) {
    for (const std::vector<std::string>& command :
         {std::vector<std::string>{"compare", library("two_balls"), "--step=" + step},
          {"render", library("two_balls"), "-o", at("sound.wav"), "--step=" + step}}) {
      const Outcome outcome = carom(command);
      EXPECT_EQ(outcome.code, 2) << step;
      EXPECT_EQ(outcome.out, "") << step;
      EXPECT_NE(outcome.err.find("--step"), std::string::npos) << outcome.err;
      if (!step.empty()) {
        EXPECT_NE(outcome.err.find("from 1e-5 to 0.1"), std::string::npos) << outcome.err;
      }
    }
  }
  EXPECT_EQ(folder_.entries(), 0u);
}

TEST_F(Cli, AStepForTheNativeStepperIs2) {
  expectRefused({"render", library("bouncing_ball"), "-o", at("sound.wav"), "--step", "0.01"}, 2);
  expectRefused({"render", library("two_balls"), "-o", at("sound.wav"), "--stepper", "native",
                 "--step", "0.01"},
                2);
  EXPECT_EQ(folder_.entries(), 0u);
}

TEST_F(Cli, BadScenesAre2ForEveryCommandAndTheMessageNamesThem) {
  fs::create_directory(folder_ / "directory");
  ASSERT_EQ(mkfifo((folder_ / "fifo").c_str(), 0600), 0);
  std::string garbage;
  for (int byte = 0; byte < 4096; ++byte)
    garbage += static_cast<char>(byte * 167 + byte / 7);
  std::vector<std::string> scenes = {at("missing.json"), at("directory"), at("fifo"), ""};
  int number = 0;
  for (const std::string& text :
       {std::string(), garbage, std::string(3, '\0'), std::string("{"), std::string("[]"),
        std::string("null"), std::string(100'000, '['), std::string("\xff\xfe{}"),
        std::string(R"({"duration": 1e999, "bodies": [], "listeners": []})"),
        std::string(R"({"duration": 1e308, "bodies": [], "listeners": []})"),
        std::string(R"({"duration": -1, "bodies": [], "listeners": []})"),
        std::string(R"({"duration": 1, "bodies": [{"type": "spheres", "count": 1e15}]})")}) {
    scenes.push_back(at("bad" + std::to_string(number++) + ".json"));
    std::ofstream(scenes.back(), std::ios::binary) << text;
  }
  const std::size_t before = folder_.entries();
  for (const std::string& scene : scenes) {
    for (const std::vector<std::string>& command :
         {std::vector<std::string>{"render", scene, "-o", at("sound.wav")},
          {"render", scene, "-o", at("sound.wav"), "--json", "--events", at("events.csv")},
          {"info", scene},
          {"compare", scene, "--json"}}) {
      const std::string message = expectRefused(command, 2);
      EXPECT_NE(message.find(scene), std::string::npos) << message;
    }
  }
  EXPECT_EQ(folder_.entries(), before);
}

TEST_F(Cli, OutputsThatCannotBeWrittenAre1AndNothingIsLeft) {
  fs::create_directory(folder_ / "directory");
  const std::string scene = library("two_balls");
  for (const std::string& target : {at("no/sound.wav"), at("directory"), at("directory/"),
                                    std::string("/proc/sound.wav"), std::string("/dev/full")}) {
    expectRefused({"render", scene, "-o", target}, 1);
    expectRefused({"render", scene, "-o", target, "--json", "--normalize"}, 1);
    expectRefused({"render", scene, "-o", at("sound.wav"), "--events", target}, 1);
    EXPECT_FALSE(fs::exists(folder_ / "sound.wav")) << target;
    EXPECT_EQ(folder_.entries(), 1u) << target;
  }
  EXPECT_TRUE(fs::is_character_file("/dev/full"));
}

TEST_F(Cli, AFullDiskIs1AndNothingIsLeft) {
  const RunSettings small = {.largestFile = 16'384};
  const std::string scene = library("two_balls");  // 192 kB of sound
  for (const std::vector<std::string>& options :
       {std::vector<std::string>{}, {"--normalize"}, {"--format", "pcm16"}, {"--json"}}) {
    std::vector<std::string> command = {"render",        scene,      "-o",
                                        at("sound.wav"), "--events", at("events.csv")};
    command.insert(command.end(), options.begin(), options.end());
    const Outcome outcome = carom(command, small);
    EXPECT_EQ(outcome.code, 1);
    EXPECT_EQ(outcome.out, "");
    EXPECT_NE(outcome.err.find(at("sound.wav")), std::string::npos) << outcome.err;
    EXPECT_EQ(folder_.entries(), 0u);
  }
}

TEST_F(Cli, ADiskThatIsTooFullForTheEventsAloneLeavesNoSoundEither) {
  // Half a second at 8 kHz in PCM16 is 8 kB; the events of forty balls are more.
  const std::string scene = fileWith(R"({
    "duration": 0.5, "sample_rate": 8000,
    "bodies": [
      {"type": "box", "min": [-0.1, 0, -0.1], "max": [0.1, 0.5, 0.1], "material": "steel"},
      {"type": "spheres", "count": 40, "radius": 0.01, "material": "steel",
       "min": [-0.1, 0, -0.1], "max": [0.1, 0.5, 0.1], "speed": 2}],
    "listeners": [{"position": [0, 1, 1]}]})");
  const std::vector<std::string> command = {"render",   scene,   "-o",       at("sound.wav"),
                                            "--format", "pcm16", "--events", at("events.csv")};
  ASSERT_EQ(carom(command).code, 0);
  ASSERT_LT(fs::file_size(at("sound.wav")), 16'384u);
  ASSERT_GT(fs::file_size(at("events.csv")), 16'384u);
  fs::remove(at("sound.wav"));
  fs::remove(at("events.csv"));
  const Outcome outcome = carom(command, {.largestFile = 16'384});
  EXPECT_EQ(outcome.code, 1);
  EXPECT_NE(outcome.err.find(at("events.csv")), std::string::npos) << outcome.err;
  EXPECT_EQ(folder_.entries(), 1u);
}

TEST_F(Cli, OneNameForTwoFilesIs2AndTheSceneSurvives) {
  fs::copy_file(libraryFile("two_balls"), folder_ / "scene.json");
  const std::string scene = at("scene.json");
  const std::string text = contents(scene);
  expectRefused({"render", scene, "-o", scene}, 2);
  expectRefused({"render", scene, "-o", at("./scene.json")}, 2);
  expectRefused({"render", scene, "-o", at("sound.wav"), "--events", scene}, 2);
  expectRefused({"render", scene, "-o", at("sound.wav"), "--events", at("sound.wav")}, 2);
  EXPECT_EQ(contents(scene), text);
  EXPECT_EQ(folder_.entries(), 1u);
}

TEST_F(Cli, AnAnswerThatCannotBeGivenIs1) {
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"info", library("two_balls")},
        {"info", library("two_balls"), "--json"},
        {"compare", library("two_balls")},
        {"render", library("two_balls"), "-o", at("sound.wav")}}) {
    const Outcome outcome = carom(command, {.out = "/dev/full"});
    EXPECT_EQ(outcome.code, 1);
    EXPECT_FALSE(outcome.err.empty());
  }
}

TEST_F(Cli, UsageErrorsNameTheWrongWord) {
  EXPECT_NE(carom({"frobnicate"}).err.find("frobnicate"), std::string::npos);
  EXPECT_NE(carom({"info", library("two_balls"), "--chatty"}).err.find("--chatty"),
            std::string::npos);
}

// Help

TEST_F(Cli, HelpOfEveryCommandHasAnExample) {
  EXPECT_EQ(carom({"--help"}).code, 0);
  for (const std::string command : {"render", "info", "compare", "record"}) {
    EXPECT_NE(carom({"--help"}).out.find("\n  " + command + " "), std::string::npos);
    const Outcome help = carom({command, "--help"});
    EXPECT_EQ(help.code, 0);
    EXPECT_EQ(help.err, "");
    EXPECT_NE(help.out.find("Example"), std::string::npos) << help.out;
    EXPECT_NE(help.out.find("\n  carom " + command + " "), std::string::npos);
  }
}

/// The lines of the help that begin with `carom COMMAND`, split into arguments.
std::vector<std::vector<std::string>> examplesOf(const std::string& command) {
  std::vector<std::vector<std::string>> examples;
  std::istringstream lines(carom({command, "--help"}).out);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::vector<std::string> arguments;
    for (std::string word; words >> word;)
      arguments.push_back(word);
    if (arguments.size() < 2 || arguments[0] != "carom" || arguments[1] != command) continue;
    examples.emplace_back(arguments.begin() + 1, arguments.end());
  }
  return examples;
}

TEST_F(Cli, ExamplesInTheHelpWorkAsTheyStand) {
  const std::string run = at("marbles.carom");
  ASSERT_EQ(carom({"record", library("marbles_in_a_box"), "-o", run}).code, 0);
  for (const std::string command : {"render", "info", "compare", "record", "replay"}) {
    const auto examples = examplesOf(command);
    ASSERT_FALSE(examples.empty());
    for (std::vector<std::string> example : examples) {
      for (std::string& word : example) {
        if (word.starts_with("scenes/")) word = (fs::path(CAROM_SOURCE_DIR) / word).string();
        if (word.ends_with(".wav") || word.ends_with(".csv") || word.ends_with(".carom"))
          word = at(word);
      }
      const Outcome outcome = carom(example, {.folder = folder_.path()});
      EXPECT_EQ(outcome.code, 0) << outcome.err;
      EXPECT_NE(outcome.out, "");
    }
  }
}

// Output

TEST_F(Cli, RenderJsonIsOneObjectWithTheDocumentedKeys) {
  for (const std::string_view name : {"two_balls", "newtons_cradle", "bouncing_ball"}) {
    const Outcome outcome = carom({"render", library(name), "-o", at("sound.wav"), "--json"});
    const json report = parsed(outcome);
    EXPECT_EQ(outcome.err.empty(), report.at("warnings").empty()) << outcome.err;
    EXPECT_EQ(report.at("file"), at("sound.wav"));
    EXPECT_TRUE(report.at("events").is_number_unsigned());
    for (const std::string key : {"duration_s", "peak_pa", "wall_s", "realtime_factor"}) {
      ASSERT_TRUE(report.at(key).is_number()) << key;
      EXPECT_GT(report.at(key).get<double>(), 0.0) << key;
    }
    const Recording recording = readRecording(folder_ / "sound.wav");
    EXPECT_EQ(report.at("sample_rate_hz"), recording.info.samplerate);
    EXPECT_EQ(report.at("channels"), recording.info.channels);
    EXPECT_NEAR(report.at("duration_s").get<double>(),
                static_cast<double>(recording.info.frames) / recording.info.samplerate, 1e-12);
    EXPECT_NEAR(report.at("peak_pa").get<double>() / (20.0 * recording.peak()), 1.0, 1e-7);
    EXPECT_NEAR(report.at("realtime_factor").get<double>() * report.at("wall_s").get<double>(),
                report.at("duration_s").get<double>(), 1e-9);
    EXPECT_TRUE(report.at("ended_early").is_null());
    EXPECT_TRUE(report.at("level_at_end_db").is_null() || report.at("level_at_end_db") <= -60.0);
    const json& plan = report.at("plan");
    ASSERT_TRUE(plan.at("needed").is_array());
    EXPECT_TRUE(std::ranges::all_of(plan.at("needed"), &json::is_string));
    ASSERT_TRUE(plan.at("left_out").is_array());
    for (const json& entry : plan.at("left_out"))
      EXPECT_TRUE(entry.at("stage").is_string() && entry.at("why").is_string());
  }
}

// Record and replay

TEST_F(Cli, ReplayOfARecordedSceneIsTheRenderedSceneByteForByte) {
  const std::string scene = library("marbles_in_a_room");  // with a head, from a file
  const std::string run = at("run.carom");
  ASSERT_EQ(carom({"render", scene, "-o", at("sound.wav"), "--events", at("a.csv")}).code, 0);
  ASSERT_EQ(carom({"record", scene, "-o", run}).code, 0);
  const Outcome outcome = carom({"replay", run, "-o", at("again.wav"), "--events", at("b.csv")});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_TRUE(contents(at("sound.wav")) == contents(at("again.wav")));
  EXPECT_TRUE(contents(at("a.csv")) == contents(at("b.csv")));
}

TEST_F(Cli, ReplayForOtherListenersIsTheSceneWithThem) {
  json scene = json::parse(contents(libraryFile("bouncing_ball")));
  scene["listeners"] = {{{"position", {-0.5, 0.25, 0.0}}}, {{"position", {1.0, 2.0, -3.0}}}};
  ASSERT_EQ(carom({"render", fileWith(scene.dump()), "-o", at("moved.wav")}).code, 0);
  const std::string run = at("run.carom");
  ASSERT_EQ(carom({"record", library("bouncing_ball"), "-o", run}).code, 0);
  const Outcome outcome = carom({"replay", run, "-o", at("replayed.wav"), "--listener",
                                 "-0.5,0.25,0", "--listener", "1,2,-3"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_TRUE(contents(at("moved.wav")) == contents(at("replayed.wav")));
}

TEST_F(Cli, RecordAndInfoJsonSayTheSameOfARecording) {
  const std::string run = at("run.carom");
  const json report = parsed(carom({"record", library("bouncing_ball"), "-o", run, "--json"}));
  EXPECT_EQ(report.at("file"), run);
  EXPECT_EQ(report.at("bytes"), fs::file_size(run));
  EXPECT_EQ(report.at("duration_s"), 4.0);
  EXPECT_EQ(report.at("spheres"), 1);
  EXPECT_EQ(report.at("collisions"), 28);
  EXPECT_GE(report.at("segments").get<int>(), 29);
  EXPECT_EQ(report.at("trajectory_hash").get<std::string>().size(), 16U);
  EXPECT_GT(report.at("wall_s").get<double>(), 0.0);
  json inside = parsed(carom({"info", run, "--json"}));
  EXPECT_EQ(inside.at("name"), "bouncing_ball");
  for (const auto& [key, value] : inside.at("recording").items())
    EXPECT_EQ(value, report.at(key)) << key;
  EXPECT_EQ(carom({"info", run}).code, 0);
}

TEST_F(Cli, BadRecordingsAre2AndTheMessageNamesThem) {
  const std::string run = at("run.carom");
  ASSERT_EQ(carom({"record", library("bouncing_ball"), "-o", run}).code, 0);
  std::string damaged = contents(run);
  damaged[damaged.size() / 2] ^= 1;
  std::ofstream(folder_ / "damaged.carom", std::ios::binary) << damaged;
  const std::size_t before = folder_.entries();
  for (const std::string& file : {at("missing.carom"), folder_.path().string(),
                                  library("bouncing_ball"), at("damaged.carom")}) {
    const std::string message = expectRefused({"replay", file, "-o", at("sound.wav")}, 2);
    EXPECT_NE(message.find(file), std::string::npos) << message;
  }
  expectRefused({"info", at("damaged.carom")}, 2);
  EXPECT_EQ(folder_.entries(), before);
}

TEST_F(Cli, ReplayRefusesTimesAndPlacesThatAreNone) {
  const std::string run = at("run.carom");
  ASSERT_EQ(carom({"record", library("bouncing_ball"), "-o", run}).code, 0);
  const std::vector<std::string> replay = {"replay", run, "-o", at("sound.wav")};
  for (const std::vector<std::string>& options : {std::vector<std::string>{"--from", "4"},
                                                  {"--from", "nan"},
                                                  {"--from", "-1"},
                                                  {"--to", "0"},
                                                  {"--from", "2", "--to", "1"},
                                                  {"--to", "inf"},
                                                  {"--listener", "1,2"},
                                                  {"--listener", "1,2,3,4"},
                                                  {"--listener", "1,2,x"},
                                                  {"--listener", "1,2,nan"},
                                                  {"--listener", ""},
                                                  {"--listener", "1,2,3,"},
                                                  {"--step", "0.01"}}) {
    std::vector<std::string> command = replay;
    command.insert(command.end(), options.begin(), options.end());
    const std::string message = expectRefused(command, 2);
    EXPECT_NE(message.find(options.front()), std::string::npos) << message;
  }
  expectRefused({"replay", run, "-o", run}, 2);
  EXPECT_EQ(folder_.entries(), 1U);
}

TEST_F(Cli, ASceneIsRecordedAndReplayedOnEitherStepper) {
  const std::string scene = library("two_balls");
  for (const std::string stepper : {"native", "bullet"}) {
    const Outcome recorded =
        carom({"record", scene, "-o", at("run.carom"), "--stepper", stepper, "--json"});
    EXPECT_EQ(parsed(recorded).at("duration_s"), 1.0) << stepper;
    EXPECT_EQ(carom({"render", scene, "-o", at("a.wav"), "--stepper", stepper}).code, 0);
    EXPECT_EQ(carom({"replay", at("run.carom"), "-o", at("b.wav")}).code, 0);
    EXPECT_TRUE(contents(at("a.wav")) == contents(at("b.wav"))) << stepper;
    EXPECT_TRUE(parsed(carom({"info", at("run.carom"), "--json"})).contains("recording"));
  }
}

TEST_F(Cli, ARecordingThatCannotBeWrittenIs1AndNothingIsLeft) {
  const std::string scene = library("marbles_in_a_box");
  expectRefused({"record", scene, "-o", at("no/run.carom")}, 1);
  const Outcome outcome = carom({"record", scene, "-o", at("run.carom")}, {.largestFile = 16'384});
  EXPECT_EQ(outcome.code, 1);
  EXPECT_NE(outcome.err.find(at("run.carom")), std::string::npos) << outcome.err;
  EXPECT_EQ(folder_.entries(), 0U);
  expectRefused({"record", scene, "-o", scene}, 2);
}

TEST_F(Cli, CompareJsonIsOneObjectWithTheDocumentedKeys) {
  const json report = parsed(carom(
      {"compare", library("newtons_cradle"), "--json", "--step", "0.016667", "--step", "0.002"}));
  const json& runs = report.at("runs");
  ASSERT_TRUE(runs.is_array());
  ASSERT_EQ(runs.size(), 2u);
  EXPECT_EQ(runs[0].at("step_s"), 0.016667);
  EXPECT_EQ(runs[1].at("step_s"), 0.002);
  for (const json& run : runs) {
    for (const std::string key : {"events_reference", "matched", "missed", "spurious"})
      EXPECT_TRUE(run.at(key).is_number_unsigned()) << key;
    EXPECT_TRUE(run.at("level_difference_db").is_number());
    for (const std::string key : {"time_error_us", "impulse_error", "global_time_difference_us"}) {
      ASSERT_TRUE(run.at(key).at("rms").is_number() && run.at(key).at("max").is_number()) << key;
      EXPECT_LE(run.at(key).at("rms").get<double>(), run.at(key).at("max").get<double>());
    }
    EXPECT_GT(run.at("events_reference").get<int>(), 0);
  }
}

TEST_F(Cli, CompareOfTwoBallsMatchesTheOneCollision) {
  const json report =
      parsed(carom({"compare", library("two_balls"), "--step", "0.016667", "--json"}));
  const json& run = report.at("runs").at(0);
  EXPECT_EQ(run.at("events_reference"), 1);
  EXPECT_EQ(run.at("matched"), 1);
  EXPECT_EQ(run.at("missed"), 0);
  EXPECT_EQ(run.at("spurious"), 0);
  EXPECT_LT(run.at("time_error_us").at("max").get<double>(), 1.0);
  EXPECT_LT(run.at("impulse_error").at("max").get<double>(), 1e-3);
}

TEST_F(Cli, CompareTakesThreeStepsUnlessToldOtherwise) {
  const json report = parsed(carom({"compare", library("two_balls"), "--json"}));
  EXPECT_EQ(report.at("runs").size(), 3u);
}

TEST_F(Cli, WhatNeverHappenedIsNullInJson) {
  json scene = json::parse(contents(libraryFile("two_balls")));
  scene["duration"] = 0.4;  // they touch at 0.4037 s
  const json report = parsed(carom({"compare", fileWith(scene.dump()), "--json"}));
  EXPECT_TRUE(report.at("runs").at(0).at("level_difference_db").is_null());
  EXPECT_EQ(report.at("runs").at(0).at("events_reference"), 0);
}

TEST_F(Cli, InfoOfEveryLibrarySceneSaysWhatIsInIt) {
  for (const std::string_view name : kLibrary) {
    const Outcome text = carom({"info", library(name)});
    EXPECT_EQ(text.code, 0);
    EXPECT_EQ(text.err, "");
    EXPECT_TRUE(text.out.starts_with(std::string(name) + "\n")) << text.out;
    const json report = parsed(carom({"info", library(name), "--json"}));
    EXPECT_EQ(report.at("name"), name);
    const json file = json::parse(contents(libraryFile(name)));
    EXPECT_EQ(report.at("duration_s"), file.at("duration"));
    EXPECT_EQ(report.at("stepper").at("type"), file.at("stepper").at("type"));
    EXPECT_EQ(report.at("listeners").size(), file.at("listeners").size());
    std::size_t spheres = 0;
    for (const json& body : file.at("bodies")) {
      if (body.at("type") == "sphere") ++spheres;
      if (body.at("type") == "spheres") spheres += body.at("count").get<std::size_t>();
    }
    EXPECT_EQ(report.at("spheres"), spheres);
    EXPECT_FALSE(report.at("plan").at("needed").empty());
    const json& estimate = report.at("estimate");
    for (const std::string key : {"steps", "degrees_of_freedom", "memory_bytes", "wall_s"})
      EXPECT_TRUE(estimate.at(key).is_number()) << key;
    // The estimate knows of no collisions on Bullet, nor where a run begins without any.
    const json& events = estimate.at("events");
    const bool isOnBullet = report.at("stepper").at("type") == "bullet";
    EXPECT_TRUE(events.is_null() || (events > 0.0 && !isOnBullet)) << name;
    EXPECT_TRUE(name != "marbles_in_a_box" || events > 1000.0);
    EXPECT_LT(estimate.at("wall_s"), 60.0) << name;
    EXPECT_TRUE(estimate.at("longest").is_string());
  }
}

TEST_F(Cli, WhatBulletCannotRunIsBadInputAndNamed) {
  const std::string scene = library("swinging_cradle");
  const std::string expected = "carom: " + scene +
                               ": the scene has restitution laws and rods, which Bullet's stepper "
                               "cannot do; expected the native stepper\n";
  const Outcome rendered = carom({"render", scene, "-o", at("sound.wav"), "--stepper", "bullet"});
  EXPECT_EQ(rendered.code, 2);
  EXPECT_EQ(rendered.err, expected);
  EXPECT_FALSE(fs::exists(at("sound.wav")));
  const Outcome compared = carom({"compare", scene});
  EXPECT_EQ(compared.code, 2);
  EXPECT_EQ(compared.err, expected);
}

TEST_F(Cli, FileNamesThatAreNotUtf8DoNotBreakTheJson) {
  const std::string name = at("a\xff\"b.wav");
  const json report = parsed(carom({"render", library("two_balls"), "-o", name, "--json"}));
  EXPECT_TRUE(fs::exists(name));
  EXPECT_NE(report.at("file").get<std::string>().find("\xef\xbf\xbd\"b.wav"), std::string::npos);
}

TEST_F(Cli, LongFileNamesArePrintedWhole) {
  std::string name = folder_.path().string();
  for (int level = 0; level < 4; ++level) {
    name += "/" + std::string(200, 'x');
    fs::create_directory(name);
  }
  name += "/sound.wav";
  const Outcome outcome = carom({"render", library("two_balls"), "-o", name});
  EXPECT_EQ(outcome.code, 0);
  EXPECT_TRUE(outcome.out.starts_with(name + ": 1 s, 1 channel at 48000 Hz\n")) << outcome.out;
}

TEST_F(Cli, ClippedSamplesAreToldOnStandardError) {
  const Outcome outcome = carom({"render", library("two_balls"), "-o", at("sound.wav"), "--format",
                                 "pcm16", "--no-limit", "--json"});
  const json report = parsed(outcome);
  ASSERT_GT(report.at("clipped_samples").get<int>(), 0);
  EXPECT_EQ(report.at("limiter"), false);
  EXPECT_EQ(report.at("largest_gain_reduction_db"), 0.0);
  EXPECT_NE(outcome.err.find(report.at("clipped_samples").dump() + " samples"), std::string::npos);
}

TEST_F(Cli, Pcm16IsLimitedAndFloatIsNotUnlessAsked) {
  const std::vector<std::string> render = {"render", library("two_balls"), "-o", at("sound.wav"),
                                           "--json"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), render.begin(), render.end());
    return carom(more);
  };
  const Outcome unasked = with({"--format", "pcm16"});
  json report = parsed(unasked);
  EXPECT_EQ(report.at("limiter"), true);
  EXPECT_EQ(report.at("clipped_samples"), 0);
  const double peak = report.at("peak_pa");
  EXPECT_NEAR(report.at("largest_gain_reduction_db").get<double>(), 20.0 * std::log10(peak / 20.0),
              1e-4);
  EXPECT_NE(unasked.err.find("turned down by up to"), std::string::npos) << unasked.err;
  report = parsed(with({}));
  EXPECT_EQ(report.at("limiter"), false);
  EXPECT_GT(readRecording(at("sound.wav")).peak(), 1.0);
  const Outcome asked = with({"--limit"});
  report = parsed(asked);
  EXPECT_EQ(report.at("limiter"), true);
  EXPECT_EQ(asked.err, "");
  EXPECT_LE(readRecording(at("sound.wav")).peak(), 1.0);
  report = parsed(with({"--format", "pcm16", "--normalize"}));
  EXPECT_EQ(report.at("limiter"), false);
}

TEST_F(Cli, PeakAboveFullScaleIsAWarningWithTheOptionThatMakesRoom) {
  const std::vector<std::string> render = {"render", library("two_balls"), "-o", at("sound.wav"),
                                           "--json"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), render.begin(), render.end());
    return carom(more);
  };
  for (const std::vector<std::string>& options :
       {std::vector<std::string>{}, {"--format", "pcm16"}, {"--format", "pcm16", "--no-limit"}}) {
    const Outcome loud = with(options);
    const json report = parsed(loud);
    ASSERT_GT(report.at("peak_pa").get<double>(), report.at("full_scale_pa").get<double>());
    ASSERT_EQ(report.at("warnings").size(), 1u);
    const std::string warning = report.at("warnings").at(0);
    EXPECT_EQ(loud.err, "carom: " + warning + "\n");
    EXPECT_NE(warning.find("dB above full scale, 20 Pa"), std::string::npos) << warning;
    const std::size_t option = warning.find("--full-scale ") + 13;
    std::vector<std::string> again = options;
    again.insert(again.end(),
                 {"--full-scale", warning.substr(option, warning.find("dB", option) + 2 - option)});
    const Outcome remedied = with(again);
    EXPECT_EQ(remedied.err, "");
    EXPECT_TRUE(parsed(remedied).at("warnings").empty());
    EXPECT_GT(readRecording(at("sound.wav")).peak(), 0.89);  // and within 1 dB of full scale
  }
  EXPECT_TRUE(parsed(with({"--limit"})).at("warnings").empty());
  EXPECT_TRUE(parsed(with({"--normalize"})).at("warnings").empty());
}

TEST_F(Cli, BodiesLighterThanMatterAreWarnedOfByName) {
  json scene = json::parse(contents(libraryFile("wood_blocks")));
  for (json& body : scene["bodies"])
    body.erase("modes");
  scene["duration"] = 0.01;
  scene["bodies"][3]["mass"] = 0.0024;  // a cube of 5 cm: 19.2 kg/m^3
  json ball = {{"type", "sphere"}, {"name", "ball"},       {"radius", 0.1},
               {"mass", 0.05},     {"material", "rubber"}, {"position", {0, 3, 0}}};  // 11.9
  scene["bodies"].push_back(ball);
  ball.update({{"name", "heavier"}, {"mass", 0.09}, {"position", {0, 5, 0}}});  // 21.5
  scene["bodies"].push_back(ball);
  const std::string file = fileWith(scene.dump());
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"info", file},
        {"render", file, "-o", at("sound.wav"), "--recoil", "sphere"}}) {
    std::vector<std::string> asJson = command;
    asJson.push_back("--json");
    const Outcome outcome = carom(asJson);
    const json report = parsed(outcome);
    ASSERT_EQ(report.at("warnings").size(), 2u) << report.at("warnings");
    std::string expected;
    for (const json& warning : report.at("warnings"))
      expected += "carom: " + warning.get<std::string>() + "\n";
    EXPECT_EQ(outcome.err, expected);
    EXPECT_EQ(carom(command).err, expected);
    EXPECT_NE(expected.find("cube has a density of 19.2 kg/m^3"), std::string::npos) << expected;
    EXPECT_NE(expected.find("ball has a density of 11.9 kg/m^3"), std::string::npos) << expected;
  }
}

TEST_F(Cli, ManyLightBodiesAreCounted) {
  json scene = json::parse(contents(libraryFile("two_balls")));
  scene["bodies"] = json::array({{{"type", "spheres"},
                                  {"name", "foam"},
                                  {"count", 8},
                                  {"radius", 0.01},
                                  {"material", {{"like", "plastic"}, {"density", 15}}},
                                  {"min", {0, 0, 0}},
                                  {"max", {1, 1, 1}}}});
  const json warnings = parsed(carom({"info", fileWith(scene.dump()), "--json"})).at("warnings");
  ASSERT_EQ(warnings.size(), 6u);
  EXPECT_TRUE(warnings.at(4).get<std::string>().starts_with("foam.5 has"));
  EXPECT_EQ(warnings.at(5), "3 more bodies have a density below 20 kg/m^3");
}

TEST_F(Cli, FullScaleIsAPressureOrALevel) {
  for (const std::string fullScale : {"200", "2e2", "140dB", "140DB"}) {
    const json report = parsed(carom({"render", library("two_balls"), "-o", at("sound.wav"),
                                      "--full-scale", fullScale, "--json"}));
    EXPECT_NEAR(report.at("full_scale_pa").get<double>(), 200.0, 1e-9) << fullScale;
    EXPECT_NEAR(readRecording(at("sound.wav")).peak() * 200.0, report.at("peak_pa").get<double>(),
                1e-4);
  }
  for (const std::string fullScale : {"0.002", "200000", "40dB", "200dB"}) {
    EXPECT_EQ(
        carom({"render", library("two_balls"), "-o", at("sound.wav"), "--full-scale", fullScale})
            .code,
        0)
        << fullScale;
  }
}

TEST_F(Cli, FullScalesThatMakeNoSenseAre2) {
  for (const std::string fullScale :
       {"0", "-20", "nan", "inf", "1e999", "dB", "20 dBx", "500dB", "0dB", "20Pa", "x", ""}) {
    const Outcome outcome =
        carom({"render", library("two_balls"), "-o", at("sound.wav"), "--full-scale=" + fullScale});
    EXPECT_EQ(outcome.code, 2) << fullScale;
    EXPECT_NE(outcome.err.find("--full-scale"), std::string::npos) << outcome.err;
  }
  for (const std::vector<std::string>& both : {std::vector<std::string>{"--limit", "--no-limit"},
                                               {"--limit", "--normalize"},
                                               {"--full-scale", "20", "--normalize"}}) {
    std::vector<std::string> command = {"render", library("two_balls"), "-o", at("sound.wav")};
    command.insert(command.end(), both.begin(), both.end());
    const std::string message = expectRefused(command, 2);
    EXPECT_NE(message.find(both.front()), std::string::npos) << message;
  }
  EXPECT_EQ(folder_.entries(), 0u);
}

TEST_F(Cli, TheSteppersGiveDifferentSounds) {
  for (const std::string stepper : {"native", "bullet"}) {
    EXPECT_EQ(
        carom({"render", library("newtons_cradle"), "-o", at(stepper), "--stepper", stepper}).code,
        0);
  }
  EXPECT_EQ(carom({"render", library("newtons_cradle"), "-o", at("default")}).code, 0);
  EXPECT_EQ(contents(at("default")), contents(at("native")));
  EXPECT_NE(contents(at("default")), contents(at("bullet")));
}

// Sound, rooms and listeners

TEST_F(Cli, SoundOptionsDoWhatTheKeysOfTheSceneDo) {
  const std::vector<std::vector<std::string>> choices = {{"--pulse", "pulse", "half_sine"},
                                                         {"--pulse", "pulse", "course_gaussian"},
                                                         {"--sampling", "sampling", "naive"},
                                                         {"--radiation", "radiation", "compact"}};
  EXPECT_EQ(carom({"render", library("newtons_cradle"), "-o", at("plain.wav")}).code, 0);
  for (const auto& choice : choices) {
    json scene = json::parse(contents(libraryFile("newtons_cradle")));
    scene["sound"][choice[1]] = choice[2];
    EXPECT_EQ(carom({"render", fileWith(scene.dump()), "-o", at("key.wav")}).code, 0);
    EXPECT_EQ(
        carom({"render", library("newtons_cradle"), "-o", at("option.wav"), choice[0], choice[2]})
            .code,
        0);
    EXPECT_EQ(contents(at("option.wav")), contents(at("key.wav"))) << choice[2];
    EXPECT_NE(contents(at("option.wav")), contents(at("plain.wav"))) << choice[2];
    // The option also sets the default back.
    const std::string back = choice[1] == "pulse"      ? "hertz"
                             : choice[1] == "sampling" ? "band_limited"
                                                       : "exact";
    EXPECT_EQ(carom({"render", at("scene.json"), "-o", at("back.wav"), choice[0], back}).code, 0);
    EXPECT_EQ(contents(at("back.wav")), contents(at("plain.wav"))) << choice[2];
  }
  json scene = json::parse(contents(libraryFile("newtons_cradle")));
  scene["sound"]["dissipative"] = true;
  EXPECT_EQ(carom({"render", fileWith(scene.dump()), "-o", at("key.wav")}).code, 0);
  EXPECT_EQ(
      carom({"render", library("newtons_cradle"), "-o", at("option.wav"), "--pulse", "dissipative"})
          .code,
      0);
  EXPECT_EQ(contents(at("option.wav")), contents(at("key.wav")));
  EXPECT_EQ(carom({"render", at("scene.json"), "-o", at("back.wav"), "--pulse", "hertz"}).code, 0);
  EXPECT_EQ(contents(at("back.wav")), contents(at("plain.wav")));
}

TEST_F(Cli, SoundOptionsThatMakeNoSenseAre2AndTheMessageSaysWhatWould) {
  for (const auto& [option, accepted] :
       {std::pair{"--pulse", "hertz"}, {"--sampling", "naive"}, {"--radiation", "compact"}}) {
    const std::string message =
        expectRefused({"render", library("two_balls"), "-o", at("sound.wav"), option, "best"}, 2);
    EXPECT_NE(message.find(option), std::string::npos) << message;
    EXPECT_NE(message.find(accepted), std::string::npos) << message;
  }
}

TEST_F(Cli, ReportsSayWhoHearsWhatThroughWhichWalls) {
  json scene = json::parse(contents(libraryFile("fly_by")));
  scene["bodies"].push_back(
      {{"type", "plane"}, {"normal", {0, 1, 0}}, {"offset", 0}, {"material", "concrete"}});
  scene["room"] = {{"reverb", {{"t60", 0.5}, {"volume", 100}, {"surface", 130}}}};
  scene["duration"] = 0.1;
  const std::string file = fileWith(scene.dump());
  const json info = parsed(carom({"info", file, "--json"}));
  const json render = parsed(carom({"render", file, "-o", at("sound.wav"), "--json"}));
  for (const json& report : {info, render}) {
    const json& listener = report.at("listeners").at(0);
    EXPECT_EQ(listener.at("name"), "ortf");
    EXPECT_EQ(listener.at("format"), "spaced_pair");
    EXPECT_EQ(listener.at("channels"), (json{0, 1}));
    EXPECT_EQ(listener.at("moves"), true);
    EXPECT_EQ(report.at("images"), 1);
    EXPECT_EQ(report.at("reverb").at("volume_m3"), 100.0);
    EXPECT_EQ(report.at("reverb").at("t60_s").size(), 7u);
  }
  EXPECT_EQ(info.at("sound").at("pulse"), "hertz");
  const json plain = parsed(carom({"info", library("two_balls"), "--json"}));
  EXPECT_EQ(plain.at("images"), 0);
  EXPECT_TRUE(plain.at("reverb").is_null());
  EXPECT_EQ(plain.at("listeners").at(0).at("channels"), (json::array({0})));
  const std::string text = carom({"render", file, "-o", at("sound.wav"), "-v"}).out;
  EXPECT_NE(text.find("channels  0, 1: ortf, spaced_pair, moves\n"), std::string::npos) << text;
  EXPECT_NE(text.find("room      1 image of each source, reverberation of 100 m^3, T60 0.5 s\n"),
            std::string::npos)
      << text;
  EXPECT_NE(carom({"info", file}).out.find(": ortf, spaced_pair, moves\n"), std::string::npos);
}

TEST_F(Cli, ListenersBehindAWallAreToldOnStandardError) {
  json scene = json::parse(contents(libraryFile("marbles_in_a_room")));
  scene["duration"] = 0.1;
  scene["listeners"] = {{{"name", "guest"}, {"position", {0, 1, 0}}},
                        {{"name", "cellar"}, {"position", {0, -0.5, 0}}}};
  const Outcome inside = carom({"render", fileWith(scene.dump()), "-o", at("sound.wav")});
  EXPECT_EQ(inside.code, 0);
  EXPECT_EQ(inside.err,
            "carom: cellar stands behind room.bottom, out of the room: it hears no reflections "
            "there\n");
  scene.erase("room");
  EXPECT_EQ(carom({"render", fileWith(scene.dump()), "-o", at("sound.wav")}).err, "");
}

TEST_F(Cli, HeadThatIsNoSofaFileIs1AndNothingIsLeft) {
  json scene = json::parse(contents(libraryFile("two_balls")));
  scene["listeners"][0].update({{"format", "binaural"}, {"sofa", "head.sofa"}});
  std::ofstream(folder_ / "head.sofa") << "no SOFA file";
  const std::string file = fileWith(scene.dump());
  const std::string message = expectRefused({"render", file, "-o", at("sound.wav")}, 1);
  EXPECT_NE(message.find(at("head.sofa")), std::string::npos) << message;
  EXPECT_EQ(folder_.entries(), 2u);
  fs::remove(folder_ / "head.sofa");
  const std::string absent = expectRefused({"render", file, "-o", at("sound.wav")}, 2);
  EXPECT_NE(absent.find("/listeners/0/sofa"), std::string::npos) << absent;
  EXPECT_NE(absent.find(at("head.sofa").substr(0, 20)), std::string::npos) << absent;
}

// Progress

/// The text that a run writes to standard error when that is a terminal. The kernel hands over a
/// terminal's text in pieces and with delay, so another thread reads it to its end during the run.
std::string onTerminal(const std::vector<std::string>& command) {
  int reader = -1;
  int terminal = -1;
  if (openpty(&reader, &terminal, nullptr, nullptr, nullptr) != 0) return {};
  std::future<std::string> text = std::async(std::launch::async, [reader] {
    std::string all;
    std::array<char, 4096> piece{};
    for (ssize_t size = 0; (size = read(reader, piece.data(), piece.size())) > 0;) {
      all.append(piece.data(), static_cast<std::size_t>(size));
    }
    return all;
  });
  EXPECT_EQ(carom(command, {.err = terminal}).code, 0);
  close(terminal);  // the reader gets what is left, and then the end
  std::string shown = text.get();
  close(reader);
  return shown;
}

TEST_F(Cli, ProgressIsShownOnATerminalAndNowhereElse) {
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"render", library("two_balls"), "-o", at("sound.wav"),
                                 "--normalize"},
        {"compare", library("two_balls"), "--step", "0.01"}}) {
    const std::string shown = onTerminal(command);
    EXPECT_NE(shown.find("100 %"), std::string::npos) << shown;
    EXPECT_TRUE(shown.ends_with("\r\033[K")) << shown;  // the line is cleared
    const Outcome piped = carom(command);
    EXPECT_EQ(piped.err, "");
    EXPECT_EQ(piped.out.find('\r'), std::string::npos);
    EXPECT_EQ(piped.out.find('\033'), std::string::npos);
  }
}

}  // namespace
}  // namespace carom::test
