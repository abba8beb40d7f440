// `carom stability` as a user runs it.

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/scenes/command.h"
#include "tests/support/temporary_folder.h"

namespace carom::test {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;

TEST(StabilityCommand, RunsWhatIsAskedForAndSaysHowItEnded) {
  const Outcome outcome = carom({"stability", "--short", "--only", "hertz"});
  EXPECT_EQ(outcome.code, 0) << outcome.out;
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("hertz.stiffness"), HasSubstr("3 passed, 0 failed")));
  EXPECT_EQ(outcome.err, "");
}

TEST(StabilityCommand, WritesTheSameJsonIntoAFileAndOnStandardOutput) {
  const TemporaryFolder folder;
  const std::string file = (folder / "report.json").string();
  const Outcome outcome =
      carom({"stability", "--short", "--only", "native.mass_ratio", "--json", "-o", file});
  const json printed = parsed(outcome);
  EXPECT_EQ(printed, json::parse(contents(file)));
  EXPECT_EQ(printed["form"], "short");
  EXPECT_EQ(printed["failed"], 0);
  EXPECT_EQ(printed["cases"][0]["case"], "native.mass_ratio");
}

TEST(StabilityCommand, ListsWithoutRunning) {
  const json list = parsed(carom({"stability", "--list", "--json"}));
  ASSERT_GT(list["cases"].size(), 50U);
  EXPECT_FALSE(list["cases"][0].contains("measurements"));
}

TEST(StabilityCommand, RefusesAnUnknownPatternAndSaysWhatThereIs) {
  const std::string message = expectRefused({"stability", "--only", "marbles"}, 2);
  EXPECT_THAT(message,
              AllOf(HasSubstr("--only"), HasSubstr("'marbles'"), HasSubstr("native.galperin")));
}

TEST(StabilityCommand, RefusesAFileThatCannotBeWrittenBeforeItRuns) {
  expectRefused({"stability", "--short", "--only", "hertz", "-o", "/nowhere/report.json"}, 1);
  expectRefused({"stability", "--list", "-o", "list.json"}, 2);
}

}  // namespace
}  // namespace carom::test
