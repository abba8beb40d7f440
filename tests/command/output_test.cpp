#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/scenes/command.h"
#include "tests/support/recording.h"
#include "tests/support/temporary_folder.h"

namespace carom::test {
namespace {

namespace fs = std::filesystem;

// The name of a sound that was not named

TEST(SoundWithoutAName, IsCalledAsItsSceneAndLiesInTheCurrentFolder) {
  const TemporaryFolder folder;
  ASSERT_EQ(carom({"render", library("two_balls"), "-o", (folder / "a.wav").string()}).code, 0);
  ASSERT_EQ(carom({"render", "two_balls"}, {.folder = folder.path()}).code, 0);
  EXPECT_EQ(contents(folder / "two_balls.wav"), contents(folder / "a.wav"));
  ASSERT_EQ(carom({"record", "two_balls", "-o", "run.carom"}, {.folder = folder.path()}).code, 0);
  ASSERT_EQ(carom({"replay", "run.carom"}, {.folder = folder.path()}).code, 0);
  EXPECT_EQ(contents(folder / "run.wav"), contents(folder / "a.wav"));
}

TEST(SoundWithoutAName, ReplacesWhatCaromHasWrittenAndNothingElse) {
  const TemporaryFolder folder;
  const RunSettings here = {.folder = folder.path()};
  ASSERT_EQ(carom({"render", "two_balls"}, here).code, 0);
  const std::string sound = contents(folder / "two_balls.wav");
  ASSERT_EQ(carom({"render", "two_balls", "--format", "pcm16"}, here).code, 0);
  EXPECT_NE(contents(folder / "two_balls.wav"), sound);
  std::ofstream(folder / "two_balls.wav") << "not made by Carom";
  const Outcome refused = carom({"render", "two_balls"}, here);
  EXPECT_EQ(refused.code, 2);
  EXPECT_NE(refused.err.find("'two_balls.wav' is there already"), std::string::npos) << refused.err;
  EXPECT_EQ(contents(folder / "two_balls.wav"), "not made by Carom");
  EXPECT_EQ(carom({"render", "two_balls", "-o", "two_balls.wav"}, here).code, 0);
}

// Standard output

TEST(StandardOutput, GetsTheBytesOfTheFileAndStandardErrorTheAnswer) {
  const TemporaryFolder folder;
  const auto at = [&](const char* name) { return (folder / name).string(); };
  for (const std::vector<std::string>& command : std::vector<std::vector<std::string>>{
           {"render", "bouncing_ball"},
           {"render", "bouncing_ball", "--normalize", "--format", "pcm16"},
           {"record", "bouncing_ball"},
           {"jello", "jello_drop", "--seconds", "0.05"}}) {
    std::vector<std::string> named = command;
    named.insert(named.end(), {"-o", at("file")});
    std::vector<std::string> streamed = command;
    streamed.insert(streamed.end(), {"-o", "-"});
    ASSERT_EQ(carom(named).code, 0) << command.front();
    const Outcome outcome = carom(streamed);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(outcome.out.size(), fs::file_size(at("file"))) << command.front();
    EXPECT_EQ(outcome.out, contents(at("file"))) << command.front();
    EXPECT_FALSE(outcome.err.empty()) << command.front();
    streamed.emplace_back("--json");
    const Outcome asJson = carom(streamed);
    EXPECT_EQ(asJson.out, contents(at("file")));
    EXPECT_TRUE(nlohmann::json::parse(asJson.err, nullptr, false).is_object()) << asJson.err;
    streamed.back() = "-q";
    EXPECT_EQ(carom(streamed).err, "");
  }
}

TEST(StandardOutput, LeavesNothingInTheFolderForTemporaryFiles) {
  const TemporaryFolder folder;
  setenv("TMPDIR", folder.path().c_str(), 1);
  const Outcome whole = carom({"render", "bouncing_ball", "-o", "-"}, {.out = "/dev/null"});
  const Outcome full = carom({"render", "bouncing_ball", "-o", "-"}, {.out = "/dev/full"});
  unsetenv("TMPDIR");
  EXPECT_EQ(whole.code, 0);
  EXPECT_EQ(full.code, 1);
  EXPECT_NE(full.err.find("standard output cannot be written"), std::string::npos) << full.err;
  EXPECT_EQ(folder.entries(), 0u);
}

/// Runs the command by a shell, which may close streams. Returns the exit code.
int byShell(const std::string& words) {
  const int status = std::system((std::string(CAROM_COMMAND) + ' ' + words).c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

// The next file that is opened would get the number of a stream that is closed.
TEST(StandardStreams, ThatAreClosedTakeNothingAndGoIntoNoFile) {
  const TemporaryFolder folder;
  EXPECT_EQ(byShell("render two_balls -o - >&- 2>/dev/null"), 1);
  EXPECT_EQ(byShell("record two_balls -o - >&- 2>/dev/null"), 1);
  const std::string loud = "render two_balls --full-scale 0.002 -o ";  // it warns of that
  const std::string open = (folder / "open.wav").string();
  const std::string closed = (folder / "closed.wav").string();
  EXPECT_EQ(byShell(loud + open + " >/dev/null 2>/dev/null"), 0);
  EXPECT_EQ(byShell(loud + closed + " <&- >/dev/null 2>&-"), 0);
  EXPECT_EQ(contents(open), contents(closed));
}

// A reader that has gone ends the program, and leaves no partial file.
TEST(StandardStreams, WhoseReaderHasGoneLeaveNothing) {
  const TemporaryFolder folder;
  setenv("TMPDIR", folder.path().c_str(), 1);
  byShell("render two_balls -o - 2>&1 >/dev/null | true");
  byShell("render two_balls -o " + (folder / "a.wav").string() + " 2>&1 | true");
  unsetenv("TMPDIR");
  for (const auto& entry : fs::directory_iterator(folder.path()))
    EXPECT_EQ(entry.path().filename(), "a.wav");
}

TEST(StandardOutput, IsRefusedWhereItIsATerminal) {
  int reader = -1;
  int terminal = -1;
  ASSERT_EQ(openpty(&reader, &terminal, nullptr, nullptr, nullptr), 0);
  const Outcome outcome = carom({"render", "two_balls", "-o", "-"}, {.outDescriptor = terminal});
  close(terminal);
  close(reader);
  EXPECT_EQ(outcome.code, 2);
  EXPECT_NE(outcome.err.find("standard output is a terminal"), std::string::npos) << outcome.err;
}

TEST(StandardOutput, IsRefusedInOneSentenceWhereItMakesNoSense) {
  const TemporaryFolder folder;
  for (const std::vector<std::string>& command : std::vector<std::vector<std::string>>{
           {"render", "two_balls", "-o", "-", "--stems"},
           {"render", "two_balls", "-o", "-", "--keep-partial"},
           {"render", "two_balls", "-o", "a.wav", "--events", "-"},
           {"report", "two_balls", "-o", "-"},
           {"video", "two_balls", "-o", "-"},
           {"jello", "jello_drop", "--energy", "-"},
           {"stability", "-o", "-"},
           {"listen", "-o", "-", "--", "true"},
           {"fit", "a.wav", "--mass", "1", "-o", "-"},
           {"batch", "plan", "a.json", "-o", "-"}}) {
    const Outcome outcome = carom(command, {.folder = folder.path()});
    EXPECT_EQ(outcome.code, 2) << command.front();
    EXPECT_EQ(outcome.out, "") << command.front();
    EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1) << outcome.err;
    EXPECT_NE(outcome.err.find("standard output"), std::string::npos) << outcome.err;
  }
  EXPECT_EQ(folder.entries(), 0u);
}

}  // namespace
}  // namespace carom::test
