// `carom jello` as a user runs it.

#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/scenes/command.h"
#include "tests/support/recording.h"
#include "tests/support/temporary_folder.h"

namespace carom::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

/// A cube of jello in free space that is released from rest, stretched by a tenth along x.
std::string stretchedWorld(const std::string& head =
                               "RK4\n0.0005 20\n200 0.02 400 0.25\n"
                               "0.001953125\n0\n0\n") {
  std::ostringstream text;
  text << head;
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y)
      for (int z = 0; z < 8; ++z)
        text << 1.1 * (x / 7.0 - 0.5) << ' ' << y / 7.0 - 0.5 << ' ' << z / 7.0 - 0.5 << '\n';
  for (int index = 0; index < 512; ++index)
    text << "0 0 0\n";
  return text.str();
}

fs::path written(const fs::path& file, const std::string& text) {
  std::ofstream(file) << text;
  return file;
}

std::vector<std::vector<double>> rowsOf(const fs::path& file) {
  std::ifstream stream(file);
  std::string line;
  std::getline(stream, line);
  std::vector<std::vector<double>> rows;
  while (std::getline(stream, line)) {
    std::istringstream cells(line);
    rows.emplace_back();
    for (std::string cell; std::getline(cells, cell, ',');)
      rows.back().push_back(std::stod(cell));
  }
  return rows;
}

// An hour of steps of 10 ns would take years.
TEST(JelloCli, TellsWhichLimitHasEndedItAsJsonToo) {
  const TemporaryFolder folder;
  const fs::path world = written(folder / "my.w", stretchedWorld());
  for (const bool isHeard : {false, true}) {
    std::vector<std::string> arguments = {"jello",      world,  "--integrator", "rk4",
                                          "--dt",       "1e-8", "--seconds",    "3600",
                                          "--max-time", "0.2",  "--json"};
    if (isHeard) arguments.insert(arguments.end(), {"-o", folder / "my.wav"});
    const Outcome run = carom(arguments);
    EXPECT_EQ(run.code, 3);
    const json ended = json::parse(run.out).at("ended_early");
    EXPECT_EQ(ended.at("limit"), "time");
    EXPECT_THAT(run.err, HasSubstr(ended.at("what").get<std::string>()));
    EXPECT_LT(ended.at("time_s"), 3600.0);
  }
  EXPECT_FALSE(fs::exists(folder / "my.wav"));
}

TEST(JelloCli, TellsWhatItDidAndWritesSoundWayAndEnergies) {
  const TemporaryFolder folder;
  const fs::path world = written(folder / "my.w", stretchedWorld());
  const fs::path sound = folder / "my.wav";
  const fs::path trajectory = folder / "my.way";
  const fs::path energies = folder / "my.csv";
  const Outcome run = carom({"jello", world, "--seconds", "0.5", "-o", sound, "--trajectory",
                             trajectory, "--energy", energies, "--json"});
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(run.err, "");
  const json report = json::parse(run.out);
  EXPECT_EQ(report["integrator"], "rk4");
  EXPECT_EQ(report["dt_s"], 0.0005);
  EXPECT_EQ(report["steps"], 1000);
  EXPECT_EQ(report["stable"], true);
  EXPECT_TRUE(report["ended_early"].is_null());
  EXPECT_GT(report["dt_limit_s"], 0.0005);
  EXPECT_GT(report["steps_per_s"], 0.0);
  EXPECT_LT(report["energy_end_J"], report["energy_start_J"]);
  for (const double part : report["momentum"])
    EXPECT_LT(std::abs(part), 1e-12);

  const Recording recording = readRecording(sound);
  EXPECT_EQ(recording.info.samplerate, 48000);
  EXPECT_EQ(recording.info.channels, 1);
  EXPECT_EQ(recording.samples.size(), 24000u);
  double peak = 0.0;
  for (const double sample : recording.samples)
    peak = std::max(peak, std::abs(sample));
  EXPECT_NEAR(peak * 20.0, report["peak_pa"], 1e-5 * peak * 20.0);  // full scale is 20 Pa

  // There is a picture every 20 steps, including the first and the last state.
  const auto rows = rowsOf(energies);
  ASSERT_EQ(rows.size(), 51u);
  EXPECT_EQ(rows[1][0], 0.01);
  EXPECT_NEAR(rows.front()[5], report["energy_start_J"], 1e-9);
  EXPECT_NEAR(rows.back()[5], report["energy_end_J"], 1e-9);
  EXPECT_EQ(fs::file_size(trajectory), 8u + 4u + 4u + 8u + 51u * 512u * 12u);
  std::ifstream stream(trajectory, std::ios::binary);
  std::vector<char> head(24 + 12);
  stream.read(head.data(), static_cast<std::streamsize>(head.size()));
  EXPECT_EQ(std::string(head.data(), 8), "CAROMJT1");
  std::uint32_t points = 0;
  std::memcpy(&points, head.data() + 8, 4);
  EXPECT_EQ(points, 512u);
  double interval = 0.0;
  std::memcpy(&interval, head.data() + 16, 8);
  EXPECT_EQ(interval, 0.01);
  float x = 0.0F;
  std::memcpy(&x, head.data() + 24, 4);
  EXPECT_EQ(x, -0.55F);
}

// After its release the cube swings along x at its lowest frequency, and its volume with it.
TEST(JelloCli, SoundsAsItsVolumeSwings) {
  const TemporaryFolder folder;
  const fs::path world = written(folder / "my.w", stretchedWorld());
  const Outcome near = carom({"jello", world, "--seconds", "1", "-o", folder / "near.wav",
                              "--listener", "0,0,5", "--json"});
  const Outcome far = carom({"jello", world, "--seconds", "1", "-o", folder / "far.wav",
                             "--listener", "0,0,10", "--json"});
  ASSERT_EQ(near.code, 0) << near.err;
  ASSERT_EQ(far.code, 0) << far.err;
  // The sound is a monopole, since nothing pushes the cube: half as loud at twice the distance.
  EXPECT_NEAR(json::parse(near.out)["peak_pa"].get<double>() /
                  json::parse(far.out)["peak_pa"].get<double>(),
              2.0, 1e-3);
}

TEST(JelloCli, AnUnstableStepIsToldBeforeAndABlowUpKeepsWhatWas) {
  const TemporaryFolder folder;
  const fs::path world = written(folder / "my.w", stretchedWorld());
  const fs::path energies = folder / "my.csv";
  const Outcome run = carom({"jello", world, "--seconds", "2", "--integrator", "symplectic_euler",
                             "--dt", "0.004", "--energy", energies, "--json"});
  EXPECT_EQ(run.code, 1);
  EXPECT_THAT(run.err, HasSubstr("symplectic_euler is stable up to "));
  EXPECT_THAT(run.err, HasSubstr("the step is 4 ms"));
  EXPECT_THAT(run.err, HasSubstr("blew up at "));
  EXPECT_THAT(run.err, HasSubstr("what came before is written"));
  EXPECT_EQ(json::parse(run.out)["stable"], false);
  const auto rows = rowsOf(energies);
  ASSERT_FALSE(rows.empty());
  for (const auto& row : rows)
    for (const double cell : row)
      EXPECT_TRUE(std::isfinite(cell));
}

TEST(JelloCli, BackwardEulerIsStableWhereOthersAreNot) {
  const TemporaryFolder folder;
  const fs::path world = written(folder / "my.w", stretchedWorld());
  const Outcome run = carom({"jello", world, "--seconds", "0.4", "--integrator", "backward_euler",
                             "--dt", "0.02", "--json"});
  ASSERT_EQ(run.code, 0) << run.err;
  const json report = json::parse(run.out);
  EXPECT_TRUE(report["dt_limit_s"].is_null());
  EXPECT_EQ(report["steps"], 20);
  EXPECT_LT(report["energy_end_J"], report["energy_start_J"]);
}

TEST(JelloCli, RunsAScenesJelloAmongItsMarblesAndHearsBoth) {
  const TemporaryFolder folder;
  const fs::path scene = fs::path(CAROM_SOURCE_DIR) / "scenes/library/jello_and_marbles.json";
  const Outcome run =
      carom({"jello", scene, "--seconds", "0.4", "--integrator", "symplectic_euler", "--dt", "2e-4",
             "-o", folder / "jello.wav", "--trajectory", folder / "jello.way", "--json"});
  ASSERT_EQ(run.code, 0) << run.err;
  const json report = json::parse(run.out);
  EXPECT_EQ(report["steps"], 2000);
  EXPECT_GE(report["touches"], 2);
  const Recording recording = readRecording(folder / "jello.wav");
  EXPECT_EQ(recording.info.channels, 2);
  EXPECT_EQ(recording.info.frames, 19200);
  // There is a picture every 83 steps, and each has four balls besides the points.
  EXPECT_EQ(fs::file_size(folder / "jello.way"), 24u + (2000u / 83u + 1u) * 516u * 12u);
  const Outcome info = carom({"info", scene, "--json"});
  ASSERT_EQ(info.code, 0) << info.err;
  const json about = json::parse(info.out);
  EXPECT_EQ(about["jello"]["points"], 8);
  EXPECT_EQ(about["jello"]["integrator"], "auto");
  EXPECT_THAT(about["plan"]["needed"].get<std::vector<std::string>>(), testing::Contains("jello"));
}

TEST(JelloCli, AutoFindsAStepForTheErrorThatIsWanted) {
  const TemporaryFolder folder;
  const fs::path world = written(folder / "my.w", stretchedWorld());
  const Outcome run = carom(
      {"jello", world, "--seconds", "0.2", "--integrator", "auto", "--error", "1e-5", "--json"});
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(run.err, "");
  const json report = json::parse(run.out);
  EXPECT_LE(report["expected_error_m"], 1.001e-5);
  EXPECT_LT(report["dt_s"], report["dt_limit_s"]);
}

TEST(JelloCli, NonsenseIsOneSentenceAndNothingIsWritten) {
  const TemporaryFolder folder;
  const fs::path world = written(folder / "my.w", stretchedWorld());
  const fs::path sound = folder / "my.wav";
  const auto refused = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "jello");
    const Outcome run = carom(arguments);
    EXPECT_EQ(run.code, 2) << run.err;
    EXPECT_EQ(run.out, "");
    EXPECT_FALSE(fs::exists(sound));
    return run.err;
  };
  EXPECT_THAT(refused({"none.w"}), HasSubstr("none.w"));
  EXPECT_THAT(refused({world, "--dt", "0"}), HasSubstr("--dt"));
  EXPECT_THAT(refused({world, "--dt", "nan"}), HasSubstr("--dt"));
  EXPECT_THAT(refused({world, "--seconds", "-1"}), HasSubstr("--seconds"));
  EXPECT_THAT(refused({world, "--integrator", "rk5"}), HasSubstr("rk5"));
  EXPECT_THAT(refused({world, "--listener", "1,2"}), HasSubstr("--listener"));
  EXPECT_THAT(refused({world, "-o", folder / "my.mp3"}), HasSubstr("expected FILE.wav"));
  EXPECT_THAT(refused({world, "-o", sound, "--energy", sound}), HasSubstr("names that differ"));
  EXPECT_THAT(refused({world, "--energy", world}), HasSubstr("would take the place of"));
  EXPECT_THAT(refused({world, "--integrator", "auto", "--dt", "1e-3"}), HasSubstr("--dt"));
  EXPECT_THAT(refused({world, "--error", "1e-3"}), HasSubstr("--integrator"));
  EXPECT_THAT(refused({fs::path(CAROM_SOURCE_DIR) / "scenes/library/two_balls.json"}),
              HasSubstr("has no jello; expected a body of type \"jello\""));
  EXPECT_THAT(refused({written(folder / "bad.json", "{\"duration\": 1")}),
              HasSubstr("bad.json: line 1"));
  const fs::path torn = written(folder / "torn.w", stretchedWorld().substr(0, 5000));
  EXPECT_THAT(refused({torn, "-o", sound}), HasSubstr("torn.w: line "));
}

}  // namespace
}  // namespace carom::test
