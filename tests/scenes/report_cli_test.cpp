#include <filesystem>
#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/scenes/command.h"

namespace carom::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

TEST(CliReport, WritesPageTableAndNumbers) {
  const TemporaryFolder folder;
  const Outcome outcome =
      carom({"report", library("two_balls"), "--runs", "1", "-o", (folder / "report").string()});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("two_balls: "));
  EXPECT_THAT(outcome.out, HasSubstr("wrote "));
  EXPECT_GT(fs::file_size(folder / "report" / "index.html"), 300000u);
  EXPECT_GT(fs::file_size(folder / "report" / "report.csv"), 1000u);
  const auto json =
      nlohmann::json::parse(contents(folder / "report" / "report.json"), nullptr, false);
  ASSERT_TRUE(json.is_object());
  EXPECT_EQ(json.at("scenes").size(), 1u);
}

TEST(CliReport, PrintsTheJsonThatItWrites) {
  const TemporaryFolder folder;
  const nlohmann::json printed = parsed(carom({"report", library("two_balls"), "--runs", "1",
                                               "--json", "-o", (folder / "report").string()}));
  EXPECT_EQ(printed,
            nlohmann::json::parse(contents(folder / "report" / "report.json"), nullptr, false));
}

TEST(CliReport, RefusesWhatItCannotUse) {
  const TemporaryFolder folder;
  const std::string out = (folder / "report").string();
  const std::string scene = library("two_balls");
  EXPECT_THAT(expectRefused({"report", "-o", out}, 2), HasSubstr("SCENE"));
  EXPECT_THAT(expectRefused({"report", scene}, 2), HasSubstr("--output"));
  EXPECT_THAT(expectRefused({"report", "missing.json", "-o", out}, 2), HasSubstr("missing.json"));
  EXPECT_THAT(expectRefused({"report", scene, scene, "-o", out}, 2),
              HasSubstr("expected scenes of different names"));
  EXPECT_THAT(expectRefused({"report", scene, "-o", out, "--runs", "0"}, 2), HasSubstr("--runs"));
  EXPECT_THAT(expectRefused({"report", scene, "-o", out, "--runs", "1.5"}, 2), HasSubstr("--runs"));
  EXPECT_THAT(expectRefused({"report", scene, "-o", out, "--budget", "nan"}, 2),
              HasSubstr("--budget"));
  EXPECT_THAT(expectRefused({"report", scene, "-o", (folder / "no" / "where").string()}, 2),
              HasSubstr("there is no folder"));
  std::ofstream(folder / "file") << "x";
  EXPECT_THAT(expectRefused({"report", scene, "-o", (folder / "file").string()}, 2),
              HasSubstr("expected a folder"));
  EXPECT_FALSE(fs::exists(out));
}

TEST(CliReport, LeavesNothingBehindWhereADiskIsFull) {
  const TemporaryFolder folder;
  const std::string out = (folder / "report").string();
  const Outcome outcome =
      carom({"report", library("two_balls"), "--runs", "1", "-o", out}, {.largestFile = 50000});
  EXPECT_EQ(outcome.code, 1);
  EXPECT_FALSE(outcome.err.empty());
  EXPECT_TRUE(!fs::exists(out) || fs::is_empty(out));
}

}  // namespace
}  // namespace carom::test
