#include <chrono>
#include <cmath>
#include <filesystem>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sndfile.h>

#include "tests/batch/batch_files.h"
#include "tests/scenes/command.h"

namespace carom::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// Plans a batch into FOLDER/NAME; returns that folder.
std::string planned(const TemporaryFolder& folder, const json& batch,
                    const std::string& name = "out", const json& scene = ballScene()) {
  const std::string out = (folder / name).string();
  const Outcome outcome =
      carom({"batch", "plan", writeBatch(folder, batch, scene).string(), "-o", out, "--json"});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  return out;
}

json made(const std::vector<std::string>& options, int code = 0) {
  std::vector<std::string> arguments = {"batch", "run", "--json"};
  arguments.insert(arguments.end(), options.begin(), options.end());
  const Outcome outcome = carom(arguments);
  EXPECT_EQ(outcome.code, code) << outcome.err;
  const json report = json::parse(outcome.out, nullptr, false);
  EXPECT_TRUE(report.is_object()) << outcome.out;
  return report;
}

std::string hashOf(const std::string& out, int code = 0) {
  const Outcome outcome = carom({"batch", "verify", out, "--json"});
  EXPECT_EQ(outcome.code, code) << outcome.err;
  return json::parse(outcome.out).value("content_hash", "");
}

std::vector<json> linesOf(const fs::path& file) {
  std::vector<json> lines;
  std::istringstream stream(contents(file));
  for (std::string line; std::getline(stream, line);)
    lines.push_back(json::parse(line));
  return lines;
}

TEST(BatchCommand, IsTheSameForAnyProcessesShardsAndRuns) {
  const TemporaryFolder folder;
  json batch = ballBatch(24);
  batch["branches"] = {{{"name", "steel"}},
                       {{"name", "wood"}, {"set", {{"/bodies/1/material", "wood"}}}}};
  const std::string one = planned(folder, batch, "one");
  const json report = made({one, "-j", "1"});
  EXPECT_EQ(report["done"], 24);
  EXPECT_EQ(report["failed"], 0);
  EXPECT_EQ(report["remaining"], 0);
  const std::string hash = report["content_hash"];
  EXPECT_EQ(hashOf(one), hash);
  EXPECT_EQ(made({planned(folder, batch, "two"), "-j", "2"})["content_hash"], hash);
  const std::string shards = planned(folder, batch, "shards");
  for (int shard = 0; shard < 7; ++shard)
    made({shards, "--shard", std::to_string(shard) + "/7"});
  EXPECT_EQ(hashOf(shards), hash);
  EXPECT_EQ(contents(fs::path(one) / "manifest.csv"), contents(fs::path(shards) / "manifest.csv"));
}

TEST(BatchCommand, ATrialLeavesWhatIsInTheFolder) {
  const TemporaryFolder folder;
  fs::create_directories(folder / "out" / "trial");
  write(folder / "out" / "trial" / "notes.txt", "mine");
  planned(folder, ballBatch(3));
  EXPECT_EQ(contents(folder / "out" / "trial" / "notes.txt"), "mine");
  std::size_t others = 0;
  for (const auto& entry : fs::directory_iterator(folder / "out"))
    others += entry.path().filename().string().starts_with("trial.") && entry.is_directory();
  EXPECT_EQ(others, 0U);
}

TEST(BatchCommand, GoesOnWhereItWasKilled) {
  const TemporaryFolder folder;
  const json batch = ballBatch(120);
  const std::string whole = planned(folder, batch, "whole");
  const std::string hash = made({whole})["content_hash"];
  const std::string out = planned(folder, batch, "killed");
  for (int kill = 0; kill < 10; ++kill) {
    const pid_t child = fork();
    if (child == 0) {
      const int null = openForWriting("/dev/null");
      become({"batch", "run", out, "-j", "2"}, null, null, RLIM_INFINITY);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10 + 7 * kill));
    ::kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
  }
  const json report = made({out});
  EXPECT_EQ(report["done"], 120);
  EXPECT_EQ(report["content_hash"], hash);
  EXPECT_EQ(hashOf(out), hash);
  for (const auto& entry : fs::recursive_directory_iterator(fs::path(out) / "samples"))
    EXPECT_EQ(entry.path().string().find(".partial"), std::string::npos) << entry.path();
}

TEST(BatchCommand, SamplesAreWhatRenderMakesOfTheirScene) {
  const TemporaryFolder folder;
  const std::string out = planned(folder, ballBatch(3));
  made({out});
  const fs::path sample = fs::path(out) / "samples/0000/000001";
  const json record = json::parse(contents(sample.string() + ".json"));
  write(folder / "scene.json", record["scene"].dump());
  const std::string wav = (folder / "scene.wav").string();
  const std::string csv = (folder / "scene.csv").string();
  ASSERT_EQ(carom({"render", (folder / "scene.json").string(), "-o", wav, "--events", csv}).code,
            0);
  EXPECT_EQ(contents(wav), contents(sample.string() + ".wav"));
  EXPECT_EQ(contents(csv), contents(sample.string() + ".events.csv"));
  EXPECT_EQ(record["parameters"]["height"], record["scene"]["bodies"][1]["position"][1]);
}

TEST(BatchCommand, ASampleIsTheSameWhateverTheCount) {
  const TemporaryFolder folder;
  const std::string few = planned(folder, ballBatch(3), "few");
  const std::string many = planned(folder, ballBatch(9), "many");
  made({few});
  made({many});
  for (const char* const name : {"000000.wav", "000002.wav", "000002.json"})
    EXPECT_EQ(contents(fs::path(few) / "samples/0000" / name),
              contents(fs::path(many) / "samples/0000" / name));
}

TEST(BatchCommand, RepeatMakesTheBytesOfASampleAgain) {
  const TemporaryFolder folder;
  json batch = ballBatch(3);
  batch["branches"] = {{{"name", "a"}},
                       {{"name", "b"}, {"set", {{"/bodies/1/material", "glass"}}}}};
  const std::string out = planned(folder, batch);
  made({out});
  const std::string again = (folder / "again.wav").string();
  ASSERT_EQ(carom({"batch", "repeat", out, "2", "--branch", "b", "-o", again}).code, 0);
  EXPECT_EQ(contents(again), contents(fs::path(out) / "samples/0000/000002.b.wav"));
  EXPECT_THAT(expectRefused({"batch", "repeat", out, "3", "-o", again}, 2), HasSubstr("below 3"));
  expectRefused({"batch", "repeat", out, "0", "--branch", "c", "-o", again}, 1);
}

TEST(BatchCommand, BranchesNeedNoParameters) {
  const TemporaryFolder folder;
  const json batch = {
      {"count", 1},
      {"branches", {{{"name", "a"}, {"set", {{"/bodies/1/position/1", -1}}}}, {{"name", "b"}}}}};
  const std::string out = planned(folder, batch);
  const json report = made({out}, 1);
  EXPECT_EQ(report["failed"], 1);
  EXPECT_EQ(linesOf(fs::path(out) / "manifest.jsonl").at(0)["branch"], "b");
  const std::string again = (folder / "again.wav").string();
  ASSERT_EQ(carom({"batch", "repeat", out, "0", "--branch", "b", "-o", again}).code, 0);
  EXPECT_EQ(contents(again), contents(fs::path(out) / "samples/0000/000000.b.wav"));
  const std::string plan = (fs::path(out) / "plan.json").string();
  EXPECT_THAT(expectRefused({"batch", "repeat", out, "0", "--branch", "b", "-o", plan}, 2),
              HasSubstr("would take the place of"));
}

TEST(BatchCommand, WritesOverNothingThatIsOfNoBatch) {
  const TemporaryFolder folder;
  const std::string batch = writeBatch(folder, ballBatch(2)).string();
  const std::string here = folder.path().string();
  write(folder / "README.md", "mine");
  EXPECT_THAT(expectRefused({"batch", "plan", batch, "-o", here}, 1),
              HasSubstr("has a README.md that is of no batch"));
  EXPECT_EQ(contents(folder / "README.md"), "mine");
  fs::remove(folder / "README.md");
  fs::rename(batch, folder / "plan.json");
  EXPECT_THAT(expectRefused({"batch", "plan", (folder / "plan.json").string(), "-o", here}, 2),
              HasSubstr("would take the place of"));
}

TEST(BatchCommand, PackedAgainASampleIsInOneFileOnly) {
  const TemporaryFolder folder;
  const std::string out = planned(folder, ballBatch(6));
  made({out});
  ASSERT_EQ(carom({"batch", "pack", out, "--samples", "2"}).code, 0);
  write(fs::path(out) / "shards" / "mine.tar", "mine");
  ASSERT_EQ(carom({"batch", "pack", out, "--samples", "6"}).code, 0);
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(fs::path(out) / "shards"))
    names.push_back(entry.path().filename().string());
  EXPECT_THAT(names, testing::UnorderedElementsAre("train-000000.tar", "mine.tar"));
}

TEST(BatchCommand, SamplesThatFailAreRowsOfTheirOwn) {
  const TemporaryFolder folder;
  json batch = {
      {"parameters",
       {{{"name", "height"}, {"grid", {0.2, 0.1, -1, 0.3}}, {"at", "/bodies/1/position/1"}}}}};
  const std::string out = planned(folder, batch);
  const json report = made({out}, 1);
  EXPECT_EQ(report["done"], 3);
  EXPECT_EQ(report["failed"], 1);
  const std::vector<json> failures = linesOf(fs::path(out) / "failures.jsonl");
  ASSERT_EQ(failures.size(), 1U);
  EXPECT_EQ(failures[0]["index"], 2);
  EXPECT_EQ(failures[0]["failure"], "refused");
  EXPECT_THAT(failures[0]["message"].get<std::string>(), HasSubstr("at the start"));
  EXPECT_THAT(failures[0]["repeat"].get<std::string>(), HasSubstr("carom batch repeat"));
  EXPECT_EQ(linesOf(fs::path(out) / "manifest.jsonl").size(), 3U);
  hashOf(out, 1);
}

TEST(BatchCommand, OneThatNeverEndsIsEnded) {
  const TemporaryFolder folder;
  json batch = ballBatch(2);
  batch["parameters"] = {
      {{"name", "height"}, {"grid", {0.01, 0.2}}, {"at", "/bodies/1/position/1"}}};
  batch["limits"] = {{"events", 1}};  // the ball that falls has more
  const std::string out = planned(folder, batch);
  const json report = made({out}, 1);
  EXPECT_EQ(report["done"], 1);
  EXPECT_EQ(linesOf(fs::path(out) / "failures.jsonl").at(0)["failure"], "limit");
}

TEST(BatchCommand, DrawsAnewWhatIsRejected) {
  const TemporaryFolder folder;
  json batch = ballBatch(20);
  batch["parameters"][0]["uniform"] = {-0.5, 0.5};
  batch["reject_if"] = {{"overlap", true}, {"expression", "height > 0.4"}};
  const std::string out = planned(folder, batch);
  EXPECT_EQ(made({out})["done"], 20);
  int rejected = 0;
  for (const json& row : linesOf(fs::path(out) / "manifest.jsonl")) {
    const double height = row["parameters"]["height"];
    EXPECT_TRUE(height >= 0.01 && height <= 0.4);
    rejected += row["attempt"].get<int>();
  }
  EXPECT_GT(rejected, 5);
  batch["reject_if"] = {{"silent", 1e5}, {"attempts", 3}};
  batch["parameters"][0]["uniform"] = {0.1, 0.2};
  batch["count"] = 1;
  const std::string silent = planned(folder, batch, "silent");
  made({silent}, 1);
  const json failure = linesOf(fs::path(silent) / "failures.jsonl").at(0);
  EXPECT_EQ(failure["failure"], "rejected");
  EXPECT_THAT(failure["message"].get<std::string>(), HasSubstr("3 attempts"));
}

TEST(BatchCommand, BodiesThatOverlapOrFlyAwayAreDrawnAnew) {
  const TemporaryFolder folder;
  // A box of 10 cm beside another: they overlap where they are less than 10 cm apart.
  json scene = ballScene();
  scene["stepper"] = {{"type", "bullet"}};
  const json box = {{"type", "solid"},
                    {"shape", {{"type", "box"}, {"half_extents", {0.05, 0.05, 0.05}}}},
                    {"material", "wood"},
                    {"position", {0, 0.5, 0}},
                    {"velocity", {0, 0, 0}}};
  scene["bodies"][1] = box;
  scene["bodies"].push_back(box);
  scene["sound"] = {{"recoil", "sphere"}};
  json batch = {
      {"count", 12},
      {"parameters", {{{"name", "apart"}, {"uniform", {0, 0.3}}, {"at", "/bodies/2/position/0"}}}},
      {"reject_if", {{"overlap", true}}}};
  const auto rowsOf = [&](const std::string& name) {
    const std::string out = planned(folder, batch, name, scene);
    EXPECT_EQ(made({out})["done"], 12);
    return linesOf(fs::path(out) / "manifest.jsonl");
  };
  for (const json& row : rowsOf("apart"))
    EXPECT_GT(row["parameters"]["apart"].get<double>(), 0.098);
  batch = {
      {"count", 12},
      {"parameters", {{{"name", "speed"}, {"uniform", {0, 20}}, {"at", "/bodies/1/velocity/2"}}}},
      {"reject_if", {{"out_of_reach", 4}}}};
  scene["bodies"].erase(2);
  // It is 1 m away at most at first, and flies for half a second.
  for (const json& row : rowsOf("fast"))
    EXPECT_LT(row["parameters"]["speed"].get<double>(), 10.0);
}

TEST(BatchCommand, ASampleThatEatsMemoryIsLostAlone) {
  const TemporaryFolder folder;
  json scene = ballScene();
  const json ear = scene["listeners"][0];
  scene["listeners"] = json::array();
  for (int listener = 0; listener < 256; ++listener) {
    scene["listeners"].push_back(ear);
    scene["listeners"].back()["name"] = "ear " + std::to_string(listener);
  }
  // A minute at 256 places has 2.9 GB.
  const json batch = {
      {"count", 3},
      {"parameters", {{{"name", "duration"}, {"grid", {0.2, 60, 0.1}}, {"at", "/duration"}}}},
      {"limits", {{"memory", 600e6}}}};
  const std::string out = planned(folder, batch, "out", scene);
  const json report = made({out}, 1);
  EXPECT_EQ(report["done"], 2);
  EXPECT_EQ(report["failed"], 1);
  const std::vector<json> failures = linesOf(fs::path(out) / "failures.jsonl");
  ASSERT_EQ(failures.size(), 1U);
  EXPECT_EQ(failures[0]["index"], 1);
  EXPECT_EQ(failures[0]["failure"], "limit");
  EXPECT_THAT(failures[0]["message"].get<std::string>(), HasSubstr("memory"));
}

TEST(BatchCommand, StemsLieBesideTheSoundWhichStaysAsItIs) {
  const TemporaryFolder folder;
  json batch = ballBatch(2);
  const std::string plain = planned(folder, batch, "plain");
  batch["outputs"] = {{"stems", true}};
  const std::string parted = planned(folder, batch, "parted");
  made({plain});
  const std::string hash = made({parted})["content_hash"];
  EXPECT_EQ(hashOf(parted), hash);
  const fs::path sample = fs::path("samples/0000/000001");
  const auto fileOf = [&](const std::string& out, const std::string& ending) {
    return contents(fs::path(out) / (sample.string() + ending));
  };
  EXPECT_EQ(fileOf(plain, ".wav"), fileOf(parted, ".wav"));
  // A ball that neither rings nor slides is its clicks.
  EXPECT_EQ(fileOf(parted, ".clicks.wav"), fileOf(parted, ".wav"));
  EXPECT_EQ(fileOf(parted, ".rings.wav"), fileOf(parted, ".contacts.wav"));
  EXPECT_NE(fileOf(parted, ".rings.wav"), fileOf(parted, ".wav"));
  const std::vector<json> rows = linesOf(fs::path(parted) / "manifest.jsonl");
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows[1]["clicks_file"], sample.string() + ".clicks.wav");
  EXPECT_EQ(rows[1]["clicks_sha256"], rows[1]["sha256"]);
  // Damage to a stem is found.
  write(fs::path(parted) / (sample.string() + ".rings.wav"), "x");
  EXPECT_NE(hashOf(parted, 1), hash);
}

TEST(BatchCommand, PosesAndContactsDoNotChangeTheSound) {
  const TemporaryFolder folder;
  json batch = ballBatch(2);
  const std::string plain = planned(folder, batch, "plain");
  batch["outputs"] = {{"poses", 100}, {"contacts", true}};
  const std::string shown = planned(folder, batch, "shown");
  made({plain});
  made({shown});
  const fs::path sample = fs::path("samples/0000/000001");
  EXPECT_EQ(contents(fs::path(plain) / (sample.string() + ".wav")),
            contents(fs::path(shown) / (sample.string() + ".wav")));
  // The ball falls freely at first: y = h - g t^2 / 2.
  const double height =
      json::parse(contents(fs::path(shown) / (sample.string() + ".json")))["parameters"]["height"];
  std::istringstream poses(contents(fs::path(shown) / (sample.string() + ".poses.csv")));
  std::string line;
  std::getline(poses, line);
  EXPECT_EQ(line, "time_s,body,x_m,y_m,z_m,qw,qx,qy,qz");
  for (int row = 0; row < 8; ++row) {
    std::getline(poses, line);
    std::istringstream cells(line);
    std::vector<std::string> values;
    for (std::string cell; std::getline(cells, cell, ',');)
      values.push_back(cell);
    const double time = 0.01 * row;
    EXPECT_NEAR(std::stod(values[0]), time, 1e-12);
    EXPECT_EQ(values[1], "ball");
    if (height - 0.5 * 9.81 * time * time < 0.011) break;
    // Between poses 1/240 s apart a chord lies g / 8 / 240^2 off the parabola at most.
    EXPECT_NEAR(std::stod(values[3]), height - 0.5 * 9.81 * time * time, 2.2e-5);
  }
}

TEST(BatchCommand, FlacHoldsTheSamplesToTheLastOf24Bits) {
  const TemporaryFolder folder;
  json batch = ballBatch(1);
  const std::string wav = planned(folder, batch, "wav");
  batch["outputs"] = {{"format", "flac"}};
  const std::string flac = planned(folder, batch, "flac");
  made({wav});
  made({flac});
  const json row = linesOf(fs::path(flac) / "manifest.jsonl").at(0);
  EXPECT_EQ(row["full_scale_pa"], row["peak_pa"]);
  const auto samplesOf = [](const fs::path& file, double fullScale) {
    SF_INFO info = {};
    SNDFILE* const sound = sf_open(file.c_str(), SFM_READ, &info);
    EXPECT_NE(sound, nullptr) << file;
    std::vector<double> samples(static_cast<std::size_t>(info.frames * info.channels));
    sf_read_double(sound, samples.data(), info.frames * info.channels);
    sf_close(sound);
    for (double& sample : samples)
      sample *= fullScale;
    return samples;
  };
  const auto exact = samplesOf(fs::path(wav) / "samples/0000/000000.wav", 20.0);
  const auto packed = samplesOf(fs::path(flac) / "samples/0000/000000.flac", row["full_scale_pa"]);
  ASSERT_EQ(exact.size(), packed.size());
  // One step, as what is below is cut off, and the roundings of two floats, each of half of its
  // last digit: the sample over the one full scale, and over the other.
  const double step = row["peak_pa"].get<double>() / 8388607.0;
  for (std::size_t at = 0; at < exact.size(); ++at)
    ASSERT_NEAR(exact[at], packed[at], 1.01 * step + 1.2e-7 * std::abs(exact[at])) << at;
}

TEST(BatchCommand, DamagedFilesAreFoundAndMadeAnew) {
  const TemporaryFolder folder;
  const std::string out = planned(folder, ballBatch(4));
  const std::string hash = made({out})["content_hash"];
  const fs::path file = fs::path(out) / "samples/0000/000002.wav";
  std::string bytes = contents(file);
  bytes[bytes.size() / 2] ^= 1;
  write(file, bytes);
  fs::remove(fs::path(out) / "samples/0000/000001.events.csv");
  const json check = json::parse(carom({"batch", "verify", out, "--json"}).out);
  EXPECT_EQ(check["damaged"], 1);
  EXPECT_EQ(check["missing"], 1);
  EXPECT_EQ(check["whole"], 2);
  made({out, "--repair"});
  EXPECT_EQ(hashOf(out), hash);
}

TEST(BatchCommand, AFullDiskEndsTheRunAndLosesNothing) {
  const TemporaryFolder folder;
  const std::string out = planned(folder, ballBatch(6));
  // Sounds are of 96 kB, rows and events smaller.
  const Outcome full = carom({"batch", "run", out}, {.largestFile = 50'000});
  EXPECT_EQ(full.code, 1);
  EXPECT_THAT(full.err, HasSubstr("cannot be written"));
  const json report = made({out});
  EXPECT_EQ(report["done"], 6);
  EXPECT_EQ(report["failed"], 0);
}

TEST(BatchCommand, AFolderThatGoesEndsTheRun) {
  const TemporaryFolder folder;
  const std::string out = planned(folder, ballBatch(2000));
  const int err = openForWriting(folder / "err");
  const pid_t child = fork();
  if (child == 0) become({"batch", "run", out, "-j", "2"}, err, err, RLIM_INFINITY);
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  fs::rename(out, folder / "gone");
  int status = 0;
  waitpid(child, &status, 0);
  ::close(err);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 1);
  // A file may have been opened already when its folder goes, and then it cannot be given its name;
  // or no sample may have begun, and then there is no list of them.
  EXPECT_THAT(contents(folder / "err"),
              AllOf(HasSubstr(out + "/"),
                    AnyOf(HasSubstr("cannot be written"), HasSubstr("cannot be given its name"),
                          HasSubstr("cannot be read"))));
  EXPECT_FALSE(fs::exists(out));
}

TEST(BatchCommand, RefusesWhatIsNoPlan) {
  const TemporaryFolder folder;
  EXPECT_THAT(expectRefused({"batch", "run", folder.path().string()}, 2), HasSubstr("plan.json"));
  write(folder / "plan.json", "{}");
  expectRefused({"batch", "verify", folder.path().string()}, 2);
  write(folder / "bad.json", "{");
  EXPECT_THAT(
      expectRefused(
          {"batch", "plan", (folder / "bad.json").string(), "-o", (folder / "out").string()}, 2),
      HasSubstr("bad.json"));
  EXPECT_FALSE(fs::exists(folder / "out"));
  expectRefused({"batch"}, 2);
  const std::string out = planned(folder, ballBatch(2));
  expectRefused({"batch", "run", out, "--shard", "2/2"}, 2);
  expectRefused({"batch", "run", out, "-j", "0"}, 2);
}

}  // namespace
}  // namespace carom::test
