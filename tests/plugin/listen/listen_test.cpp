#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/scenes/command.h"
#include "tests/support/recording.h"
#include "tests/support/temporary_folder.h"

namespace carom::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

constexpr const char* kUnheard =
    "steps no Bullet world that could be heard: it links Bullet statically, or does not use it";

class Listen : public testing::Test {
 protected:
  std::string at(const std::string& name) const { return (folder_ / name).string(); }

  /// Listens to a program, and records into heard.wav.
  Outcome listen(const std::vector<std::string>& program,
                 const std::vector<std::string>& options = {}) const {
    std::vector<std::string> words = {"listen", "-o", at("heard.wav")};
    words.insert(words.end(), options.begin(), options.end());
    words.emplace_back("--");
    words.insert(words.end(), program.begin(), program.end());
    return carom(words);
  }

  /// Returns what `carom listen --json` tells of a program.
  json heard(const std::vector<std::string>& program, int code = 0) const {
    const Outcome outcome = listen(program, {"--json"});
    EXPECT_EQ(outcome.code, code) << outcome.err;
    json object = json::parse(outcome.err, nullptr, false);
    EXPECT_TRUE(object.is_object()) << outcome.err;
    return object;
  }

  /// Runs a line of the shell in the folder; returns its exit code.
  int shell(const std::string& line) const {
    const int status =
        std::system(("cd '" + folder_.path().string() + "' && { " + line + "; } > out").c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

  const TemporaryFolder folder_;
};

std::string host(const std::string& name) {
  return std::string(CAROM_LISTEN_HOSTS) + "/" + name;
}

void expectSameSound(const fs::path& file, const fs::path& reference) {
  const Recording heard = readRecording(file);
  const Recording expected = readRecording(reference);
  EXPECT_GT(expected.peak(), 0.5);
  EXPECT_EQ(heard.comment, expected.comment);
  EXPECT_EQ(heard.info.samplerate, expected.info.samplerate);
  EXPECT_EQ(heard.info.channels, expected.info.channels);
  EXPECT_TRUE(heard.samples == expected.samples) << "sample for sample";
}

// The same sound as with Carom in the source

TEST_F(Listen, SilentExampleSoundsAsTheOneWithThreeLinesMore) {
  ASSERT_EQ(shell(CAROM_HELLO_WORLD), 0);
  const std::string printed = contents(folder_ / "out");
  const Outcome outcome = listen({CAROM_HELLO_WORLD_SILENT});
  EXPECT_EQ(outcome.code, 0);
  EXPECT_EQ(outcome.out, printed);
  EXPECT_THAT(outcome.err, testing::StartsWith("carom: " + at("heard.wav") + ": 2.5 s, "));
  EXPECT_THAT(outcome.err, HasSubstr(", 2 events, peak "));
  expectSameSound(folder_ / "heard.wav", folder_ / "hello_world.wav");
}

TEST_F(Listen, ProgramWithASoundOfItsOwnKeepsIt) {
  ASSERT_EQ(shell("carom=1 && " CAROM_HELLO_WORLD " && mv hello_world.wav reference.wav"), 0);
  const std::string line = "cd '" + folder_.path().string() + "' && " CAROM_HELLO_WORLD;
  EXPECT_EQ(listen({"sh", "-c", line}).code, 0);
  expectSameSound(folder_ / "hello_world.wav", folder_ / "reference.wav");
  expectSameSound(folder_ / "heard.wav", folder_ / "reference.wav");
}

struct World {
  std::string kind;
  std::string precision;
};

class ListenWorlds : public Listen, public testing::WithParamInterface<World> {};

TEST_P(ListenWorlds, SoundAsWithASoundInTheSource) {
  const auto& [kind, precision] = GetParam();
  ASSERT_EQ(shell(host("listen_attached_" + precision) + " " + kind + " destroy"), 0);
  const json object = heard({host("listen_host_" + precision), kind, "destroy"});
  EXPECT_EQ(object["bullet_precision"], precision);
  EXPECT_EQ(object["worlds"], 1);
  EXPECT_EQ(object["complete"], true);
  EXPECT_EQ(object["file"], at("heard.wav"));
  EXPECT_GE(object["events"], 4) << "two bodies land, with two shares each";
  EXPECT_THAT(object["messages"], testing::IsEmpty());
  const Recording recording = readRecording(folder_ / "heard.wav");
  EXPECT_EQ(object["duration_s"], static_cast<double>(recording.info.frames) / 48000.0);
  EXPECT_NEAR(recording.peak() * object["full_scale_pa"].get<double>(),
              object["peak_pa"].get<double>(), 1e-5 * object["peak_pa"].get<double>());
  expectSameSound(folder_ / "heard.wav", folder_ / "attached.wav");
}

std::vector<World> allWorlds() {
  std::vector<World> all;
  for (const std::string precision : {"float", "double"})
    for (const std::string kind :
         {"discrete", "mt", "multibody", "soft", "soft_multibody", "deformable"})
      all.push_back({kind, precision});
  return all;
}

INSTANTIATE_TEST_SUITE_P(, ListenWorlds, testing::ValuesIn(allWorlds()), [](const auto& world) {
  return world.param.kind + "_" + world.param.precision;
});

TEST_F(Listen, WorldOfALibraryThatTheProgramOpensForItselfAlone) {
  const json object = heard({host("listen_plugin_host"), CAROM_LISTEN_PLUGIN});
  EXPECT_EQ(object["worlds"], 1);
  EXPECT_EQ(object["complete"], true);
  EXPECT_GE(object["events"], 2);
  EXPECT_GT(readRecording(folder_ / "heard.wav").peak(), 0.5);
}

TEST_F(Listen, EachWorldHasAFile) {
  const json object = heard({host("listen_host_float"), "discrete", "destroy", "3"});
  EXPECT_EQ(object["worlds"], 3);
  EXPECT_EQ(object["recordings"][2]["file"], at("heard-3.wav"));
  expectSameSound(folder_ / "heard-2.wav", folder_ / "heard.wav");
  expectSameSound(folder_ / "heard-3.wav", folder_ / "heard.wav");
  EXPECT_EQ(folder_.entries(), 3u);
}

TEST_F(Listen, WorldsBeyondTheSixteenthAreNotHeardWhichIsTold) {
  const json object = heard({host("listen_host_float"), "discrete", "destroy", "18"});
  EXPECT_EQ(object["worlds"], 16);
  EXPECT_THAT(object["messages"].dump(), HasSubstr("only the first 16 of its worlds"));
  EXPECT_EQ(folder_.entries(), 16u);
}

TEST_F(Listen, OfSeveralProcessesTheFirstWithAWorldIsHeard) {
  const std::string program = host("listen_host_float") + " discrete destroy";
  const json object = heard({"sh", "-c", program + " && " + program + " 2; exit 5"}, 5);
  EXPECT_EQ(object["worlds"], 1);
  EXPECT_EQ(folder_.entries(), 1u);
}

// Ends

TEST_F(Listen, ExitWithoutAnEndOfTheWorldCompletesTheRecording) {
  ASSERT_EQ(shell(host("listen_attached_float") + " discrete destroy"), 0);
  const json object = heard({host("listen_host_float"), "discrete", "exit"}, 3);
  EXPECT_EQ(object["exit_code"], 3);
  EXPECT_EQ(object["complete"], true);
  expectSameSound(folder_ / "heard.wav", folder_ / "attached.wav");
}

TEST_F(Listen, AWorldWhoseMemoryGoesIsNotTouched) {
  const json object = heard({host("listen_host_float"), "discrete", "scrub"}, 3);
  EXPECT_TRUE(object["complete"]);
  EXPECT_GE(object["events"], 2);
}

TEST_F(Listen, ExitWhileAnotherThreadStepsCompletesTheRecording) {
  const json object = heard({host("listen_host_float"), "discrete", "thread"}, 3);
  EXPECT_EQ(object["complete"], true);
  EXPECT_GE(object["duration_s"], 1.0);
  EXPECT_EQ(folder_.entries(), 1u);
}

TEST_F(Listen, ForkThatStepsItsCopyOfTheWorldLeavesTheRecordingAlone) {
  const json object = heard({host("listen_host_float"), "discrete", "fork"}, 3);
  EXPECT_EQ(object["complete"], true);
  EXPECT_EQ(object["worlds"], 1);
  EXPECT_GE(object["duration_s"], 2.0) << "two times as many frames";
  EXPECT_EQ(folder_.entries(), 1u);
}

TEST_F(Listen, WhatAProgramRecordedBeforeItEndedWithoutAnExitIsKept) {
  for (const auto& [end, code] : {std::pair{"_exit", 3}, {"kill", 137}}) {
    const json object = heard({host("listen_host_float"), "discrete", end}, code);
    EXPECT_EQ(object["exit_code"], code);
    EXPECT_EQ(object["complete"], false);
    EXPECT_EQ(object["file"], at("heard.incomplete.wav"));
    EXPECT_EQ(object["events"], nullptr);
    EXPECT_GT(readRecording(folder_ / "heard.incomplete.wav").peak(), 0.0);
    EXPECT_EQ(folder_.entries(), 1u);
    fs::remove(folder_ / "heard.incomplete.wav");
    EXPECT_THAT(listen({host("listen_host_float"), "discrete", end}).err,
                HasSubstr("the program ended without an exit"));
    fs::remove(folder_ / "heard.incomplete.wav");
  }
}

TEST_F(Listen, SignalsGoToTheProgram) {
  for (const int signal : {SIGTERM, SIGINT, SIGHUP}) {
    const std::string mark = at("started");
    const pid_t process = fork();
    if (process == 0) {
      const std::string line = "trap 'exit 7' TERM INT HUP; touch " + mark +
                               "; for second in 1 2 3 4 5 6 7 8 9; do sleep 1; done";
      const std::string output = at("heard.wav");
      execl(CAROM_COMMAND, "carom", "listen", "-o", output.c_str(), "--", "sh", "-c", line.c_str(),
            nullptr);
      _exit(127);
    }
    while (!fs::exists(mark))
      usleep(1000);
    kill(process, signal);
    int status = 0;
    waitpid(process, &status, 0);
    EXPECT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 7);
    fs::remove(mark);
  }
}

// Programs that are not heard

TEST_F(Listen, ProgramWithoutBulletGetsASentenceAndNoFile) {
  const Outcome outcome = listen({"sh", "-c", "echo one; echo two >&2; exit 3"});
  EXPECT_EQ(outcome.code, 3);
  EXPECT_EQ(outcome.out, "one\n");
  EXPECT_EQ(outcome.err, std::string("two\ncarom: sh ") + kUnheard + "\n");
  const json object = heard({"true"});
  EXPECT_EQ(object["file"], nullptr);
  EXPECT_EQ(object["worlds"], 0);
  EXPECT_EQ(object["messages"][0], std::string("true ") + kUnheard);
  EXPECT_EQ(folder_.entries(), 0u);
}

TEST_F(Listen, AnotherVersionOfBulletIsLeftAlone) {
  const Outcome outcome = listen({host("listen_old_bullet_host")});
  EXPECT_EQ(outcome.code, 0);
  EXPECT_EQ(outcome.out, "3 steps\n");
  EXPECT_THAT(outcome.err, HasSubstr("its Bullet is 2.88 ("));
  EXPECT_THAT(outcome.err, HasSubstr("expected the shared libraries of Bullet 3."));
  EXPECT_EQ(folder_.entries(), 0u);
}

TEST_F(Listen, WhatCannotBeStartedOrWrittenIsRefusedBeforehand) {
  const std::string touch = at("started");
  EXPECT_THAT(listen({"no-such-program"}).err, HasSubstr("'no-such-program' cannot be started"));
  EXPECT_EQ(listen({"no-such-program"}).code, 2);
  EXPECT_EQ(listen({}).code, 2);
  EXPECT_EQ(carom({"listen", "--", "touch", touch}).code, 2);
  const Outcome lost = carom({"listen", "-o", at("missing/x.wav"), "--", "touch", touch});
  EXPECT_EQ(lost.code, 2);
  EXPECT_THAT(lost.err, HasSubstr("missing' does not exist"));
  for (const std::vector<std::string>& options :
       {std::vector<std::string>{"-o", at("x.mp3")},
        {"-o", at("x")},
        {"-o", folder_.path().string()},
        {"-o", at("x.wav"), "--listener", "1,2"},
        {"-o", at("x.wav"), "--listener", "1,2,3,0,0,0,0"},
        {"-o", at("x.wav"), "--listener", "1,2,nan"},
        {"-o", at("x.wav"), "--full-scale", "0"},
        {"-o", at("x.wav"), "--units", "0"}}) {
    std::vector<std::string> words = {"listen"};
    words.insert(words.end(), options.begin(), options.end());
    words.insert(words.end(), {"--", "touch", touch});
    const Outcome outcome = carom(words);
    EXPECT_EQ(outcome.code, 2) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr("expected")) << testing::PrintToString(options);
  }
  EXPECT_EQ(folder_.entries(), 0u);
}

// Options

TEST_F(Listen, FullScaleListenerAndUnitsAreThoseOfTheOptions) {
  const std::vector<std::string> program = {host("listen_host_float"), "discrete", "destroy"};
  EXPECT_EQ(listen(program, {"--full-scale", "100", "--listener", "0,1,1"}).code, 0);
  const Recording near = readRecording(folder_ / "heard.wav");
  EXPECT_EQ(near.comment, "full scale 100 Pa");
  EXPECT_EQ(listen(program, {"--full-scale", "100", "--listener", "0,2,20,0,0,0,2"}).code, 0);
  const Recording far = readRecording(folder_ / "heard.wav");
  EXPECT_LT(far.peak(), 0.2 * near.peak());
  EXPECT_GT(far.peak(), 0.0);
  const json loud =
      json::parse(listen(program, {"--json", "--full-scale", "1", "--units", "1"}).err);
  EXPECT_THAT(loud["messages"].dump(), HasSubstr("--full-scale"));
}

TEST_F(Listen, WithoutADeviceToPlayOnAMessageSaysSoAndTheFileIsWritten) {
  setenv("SDL_AUDIODRIVER", "none-such", 1);
  const Outcome outcome = listen({host("listen_host_float"), "discrete", "destroy"}, {"--play"});
  unsetenv("SDL_AUDIODRIVER");
  EXPECT_EQ(outcome.code, 0);
  EXPECT_THAT(outcome.err, HasSubstr("device"));
  EXPECT_GT(readRecording(folder_ / "heard.wav").peak(), 0.5);
}

TEST_F(Listen, ProgramHasTheSignalsTheLimitsAndThePreloadedLibrariesOfItsUser) {
  const std::string print = "ulimit -d; grep SigBlk /proc/self/status";
  ASSERT_EQ(shell("sh -c \"" + print + "\""), 0);
  EXPECT_EQ(listen({"sh", "-c", print}).out, contents(folder_ / "out"));
  setenv("LD_PRELOAD", "libm.so.6", 1);
  const Outcome outcome = listen({"sh", "-c", "echo $LD_PRELOAD"});
  unsetenv("LD_PRELOAD");
  EXPECT_EQ(outcome.out, std::string(CAROM_LISTEN_PRELOADED) + ":libm.so.6\n");
}

// The preloaded library

TEST_F(Listen, PreloadedLibraryTakesThePlaceOfSixNamesAndNeedsNoBullet) {
  ASSERT_EQ(shell(CAROM_NM " -D --defined-only " CAROM_LISTEN_PRELOADED), 0);
  std::istringstream lines(contents(folder_ / "out"));
  std::vector<std::string> names;
  for (std::string line; std::getline(lines, line);)
    names.push_back(line.substr(line.rfind(' ') + 1));
  EXPECT_THAT(names, testing::UnorderedElementsAre(
                         "_ZN23btDiscreteDynamicsWorld14stepSimulationEfif",
                         "_ZN23btDiscreteDynamicsWorld14stepSimulationEdid",
                         "_ZN23btDiscreteDynamicsWorldD1Ev", "_ZN23btDiscreteDynamicsWorldD2Ev",
                         "_ZN34btDeformableMultiBodyDynamicsWorld14stepSimulationEfif",
                         "_ZN34btDeformableMultiBodyDynamicsWorld14stepSimulationEdid"));
  ASSERT_EQ(shell(CAROM_NM " -D --undefined-only -C " CAROM_LISTEN_PRELOADED), 0);
  EXPECT_THAT(contents(folder_ / "out"), testing::Not(HasSubstr(" bt")));
}

// docs/listen.md

/// The lines of the page that begin a command, in their order.
std::vector<std::string> commandsOfThePage() {
  std::ifstream page(fs::path(CAROM_SOURCE_DIR) / "docs" / "listen.md");
  std::vector<std::string> commands;
  for (std::string line; std::getline(page, line);)
    if (line.starts_with("    $ ")) commands.push_back(line.substr(6));
  return commands;
}

TEST_F(Listen, CommandsOfThePageWorkAsTheyStand) {
  fs::create_directory_symlink(fs::path(CAROM_SOURCE_DIR) / "plugin", folder_ / "plugin");
  const std::string path = "PATH='" + fs::path(CAROM_COMMAND).parent_path().string() + "':$PATH ";
  const std::vector<std::string> commands = commandsOfThePage();
  EXPECT_GE(commands.size(), 4u);
  for (const std::string& command : commands)
    EXPECT_EQ(shell("export " + path + "&& " + command + " 2> err"), 0)
        << command << '\n'
        << contents(folder_ / "err");
  EXPECT_GT(readRecording(folder_ / "hello.wav").peak(), 0.5);
}

}  // namespace
}  // namespace carom::test
