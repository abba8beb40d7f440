#include <algorithm>
#include <cstdlib>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <pty.h>
#include <unistd.h>

#include "tests/scenes/command.h"
#include "tests/support/temporary_folder.h"

namespace carom::test {
namespace {

const std::vector<std::string> kCommands = {
    "render",    "record", "replay", "jello", "view",       "video",    "scenes",
    "materials", "info",   "events", "modes", "strike",     "fit",      "listen",
    "compare",   "report", "batch",  "help",  "completion", "stability"};

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

/// The words of a text with one space between them.
std::string onOneLine(const std::string& text) {
  std::istringstream words(text);
  std::string line;
  for (std::string word; words >> word;)
    line += word + ' ';
  return line;
}

/// Sets a variable of the environment while it lives.
class WithVariable {
 public:
  WithVariable(const char* name, const char* value) : name_(name) { setenv(name, value, 1); }
  WithVariable(const WithVariable&) = delete;
  WithVariable& operator=(const WithVariable&) = delete;
  ~WithVariable() { unsetenv(name_); }

 private:
  const char* name_;
};

// Help

TEST(Help, OfNothingIsAnOverviewOfAllCommands) {
  const Outcome outcome = carom({});
  EXPECT_EQ(outcome.code, 0);
  EXPECT_EQ(outcome.err, "");
  for (const std::string& command : kCommands)
    EXPECT_TRUE(has(outcome.out, "\n  " + command + " ")) << command;
  EXPECT_TRUE(has(outcome.out, "carom help COMMAND"));
}

TEST(Help, IsTheSameByCommandAndByOption) {
  EXPECT_EQ(carom({"help"}).out, carom({"--help"}).out);
  EXPECT_EQ(carom({"help", "batch", "run"}).out, carom({"batch", "run", "--help"}).out);
  for (const std::string& command : kCommands) {
    const Outcome help = carom({"help", command});
    EXPECT_EQ(help.code, 0) << command;
    EXPECT_EQ(help.err, "") << command;
    EXPECT_EQ(help.out, carom({command, "--help"}).out) << command;
    EXPECT_TRUE(has(help.out, "\nUsage: carom " + command)) << help.out;
    EXPECT_TRUE(has(help.out, "--quiet") && has(help.out, "--verbose")) << command;
    if (command != "help") {
      EXPECT_TRUE(has(help.out, "Example")) << command;
    }
  }
}

TEST(Help, SaysInWordsWhatAnOptionTakesAndWhatStandsWithoutIt) {
  const std::string help = onOneLine(carom({"help", "render"}).out);
  EXPECT_TRUE(has(help, "-o, --output FILE.wav")) << help;
  EXPECT_TRUE(has(help, "--tail SECONDS")) << help;
  EXPECT_TRUE(has(help, "a number of seconds from 0 to")) << help;
  EXPECT_TRUE(has(help, "--stepper native|bullet")) << help;
  EXPECT_TRUE(has(help, "--format float32|pcm16")) << help;
  EXPECT_TRUE(has(help, "default: float32")) << help;
  for (const std::string command : {"render", "replay", "jello", "strike", "modes", "video"}) {
    const std::string text = carom({"help", command}).out;
    for (const std::string type : {"TEXT:", "FLOAT", "UINT", " INT", "REQUIRED"})
      EXPECT_FALSE(has(text, type)) << command << ": " << type;
  }
}

TEST(Help, FitsIntoEightyColumnsWhereItIsNotOnATerminal) {
  for (const std::string& command : kCommands) {
    std::istringstream lines(carom({"help", command}).out);
    for (std::string line; std::getline(lines, line);)
      if (!line.starts_with("  carom ") && !line.starts_with("Usage:")) {
        EXPECT_LE(line.size(), 80u) << command << ": " << line;
      }
  }
}

TEST(Help, OfACommandThatIsNoneIs2) {
  EXPECT_TRUE(has(expectRefused({"help", "rendr"}, 2), R"(did you mean "render"?)"));
  EXPECT_TRUE(has(expectRefused({"help", "batch", "rn"}, 2), R"(did you mean "run"?)"));
}

// Suggestions

TEST(Suggestions, NameTheNearestCommandOptionAndWord) {
  const std::string scene = library("two_balls");
  for (const auto& [command, nearest] :
       std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{"rendr", scene}, "render"},
           {{"batch", "veryfy", "folder"}, "verify"},
           {{"render", "--stpper", "native", scene}, "--stepper"},
           {{"render", scene, "--outptu=a.wav"}, "--output"},
           {{"render", scene, "--stepper", "nativ"}, "native"},
           {{"render", "two_bals"}, "two_balls"},
           {{"info", "two_balls.jsn"}, "two_balls"},
           {{"scenes", "marble_step"}, "marble_steps"},
           {{"materials", "stel"}, "steel"},
           {{"modes", "a.obj", "--material", "brone"}, "bronze"},
           {{"strike", "a", "--at", "0,0,0", "--impulse", "0,0,1", "-o", "a.wav", "--hammer",
             "stel"},
            "steel"}}) {
    const std::string message = expectRefused(command, 2);
    EXPECT_TRUE(has(message, "did you mean \"" + nearest + "\"?")) << message;
  }
}

TEST(Suggestions, AreNotMadeForWordsThatNothingIsNear) {
  EXPECT_FALSE(has(expectRefused({"xylophone"}, 2), "did you mean"));
  EXPECT_FALSE(has(expectRefused({"render", "--xylophone", "x"}, 2), "did you mean"));
}

TEST(Suggestions, TheUnknownWordComesBeforeWhatFollowsFromIt) {
  const std::string message = expectRefused({"record", library("two_balls"), "--ouput", "a"}, 2);
  EXPECT_TRUE(has(message, "unknown option \"--ouput\" (did you mean \"--output\"?)")) << message;
}

// How much is said

TEST(Verbosity, ARenderingSaysItsPlanOnlyIfAsked) {
  const TemporaryFolder folder;
  const std::string file = (folder / "sound.wav").string();
  const Outcome plain = carom({"render", "bouncing_ball", "-o", file});
  EXPECT_EQ(plain.code, 0);
  EXPECT_LE(std::ranges::count(plain.out, '\n'), 6);
  for (const std::string part : {": 4 s, ", "events ", "peak "})
    EXPECT_TRUE(has(plain.out, part)) << plain.out;
  EXPECT_FALSE(has(plain.out, "left out"));
  const Outcome whole = carom({"render", "bouncing_ball", "-o", file, "--verbose"});
  EXPECT_TRUE(has(whole.out, "\nneeds ") && has(whole.out, "\nleft out  bullet_world: "));
  EXPECT_TRUE(has(carom({"info", "bouncing_ball"}).out, "stages; -v says which"));
  EXPECT_TRUE(has(carom({"info", "bouncing_ball", "-v"}).out, "\nleft out  bullet_world: "));
}

TEST(Verbosity, QuietSaysNothingButWarningsAndErrors) {
  const TemporaryFolder folder;
  const std::string file = (folder / "sound.wav").string();
  const Outcome quiet = carom({"render", "bouncing_ball", "-o", file, "-q"});
  EXPECT_EQ(quiet.code, 0);
  EXPECT_EQ(quiet.out + quiet.err, "");
  EXPECT_TRUE(std::filesystem::exists(file));
  const Outcome loud = carom({"render", "two_balls", "-o", file, "-q"});
  EXPECT_EQ(loud.out, "");
  EXPECT_TRUE(has(loud.err, "above full scale")) << loud.err;
  EXPECT_EQ(parsed(carom({"render", "bouncing_ball", "-o", file, "-q", "--json"})).at("file"),
            file);
  EXPECT_EQ(carom({"info", "bouncing_ball", "-q"}).out, "");
  EXPECT_NE(expectRefused({"info", "nowhere/at_all.json", "-q"}, 2), "");
  expectRefused({"info", "bouncing_ball", "-q", "-v"}, 2);
}

// Colour

TEST(Colour, IsOnlyForTerminalsUnlessItIsForced) {
  const auto isColoured = [](const Outcome& outcome) {
    return has(outcome.out + outcome.err, "\033[");
  };
  for (const std::vector<std::string>& command : std::vector<std::vector<std::string>>{
           {}, {"help", "render"}, {"rendr"}, {"materials"}, {"scenes"}, {"info", "nothing"}}) {
    EXPECT_FALSE(isColoured(carom(command)));
    const WithVariable forced("CLICOLOR_FORCE", "1");
    EXPECT_TRUE(isColoured(carom(command)));
    const WithVariable refused("NO_COLOR", "1");
    EXPECT_FALSE(isColoured(carom(command)));
  }
}

/// The text that the command writes to standard output when that is a terminal; no more of it than
/// a terminal takes before it is read.
std::string onTerminal(const std::vector<std::string>& command, const char* term) {
  int reader = -1;
  int terminal = -1;
  if (openpty(&reader, &terminal, nullptr, nullptr, nullptr) != 0) return {};
  const WithVariable variable("TERM", term);
  carom(command, {.outDescriptor = terminal});
  close(terminal);
  std::string text(1 << 16, '\0');
  const ssize_t size = read(reader, text.data(), text.size());
  close(reader);
  return text.substr(0, size > 0 ? static_cast<std::size_t>(size) : 0);
}

TEST(Colour, IsOnTerminalsThatHaveIt) {
  EXPECT_TRUE(has(onTerminal({"materials", "steel"}, "xterm"), "\033["));
  EXPECT_FALSE(has(onTerminal({"materials", "steel"}, "dumb"), "\033["));
  const WithVariable refused("NO_COLOR", "1");
  EXPECT_FALSE(has(onTerminal({"materials", "steel"}, "xterm"), "\033["));
}

}  // namespace
}  // namespace carom::test
