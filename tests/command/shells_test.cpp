#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/scenes/command.h"
#include "tests/support/temporary_folder.h"

namespace carom::test {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::IsSupersetOf;
using testing::UnorderedElementsAre;

bool isInstalled(const std::string& program) {
  const std::string command = "command -v " + program + " >/dev/null 2>&1";
  return std::system(command.c_str()) == 0;  // NOLINT(concurrency-mt-unsafe): one thread
}

/// The lines that a command of the shell prints, standard error among them.
std::vector<std::string> printedBy(const std::string& command) {
  std::vector<std::string> lines;
  FILE* const pipe = popen((command + " 2>&1").c_str(), "r");
  if (pipe == nullptr) return lines;
  std::string text;
  std::array<char, 4096> piece{};
  while (const std::size_t size = std::fread(piece.data(), 1, piece.size(), pipe))
    text.append(piece.data(), size);
  pclose(pipe);
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);)
    lines.push_back(line);
  return lines;
}

/// Writes the completion of a shell, and asks shells for what they complete.
class Completion : public testing::Test {
 protected:
  void write(const std::string& shell) {
    const Outcome outcome = carom({"completion", shell});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    std::ofstream(folder_ / "completion") << outcome.out;
    std::ofstream(folder_ / "run.carom") << "";
    fs::create_directory(folder_ / "runs");
  }
  std::string inFolder(const std::string& command) const {
    return "cd '" + folder_.path().string() + "' && HOME='" + folder_.path().string() + "' PATH='" +
           fs::path(CAROM_COMMAND).parent_path().string() + "':\"$PATH\" " + command;
  }
  std::vector<std::string> inBash(const std::vector<std::string>& words) const {
    std::string list = "carom";
    for (const std::string& word : words)
      list += " '" + word + "'";
    std::ofstream(folder_ / "script")
        << "source ./completion\nCOMP_WORDS=(" << list << ")\nCOMP_CWORD=" << words.size()
        << "\n_carom\nprintf '%s\\n' \"${COMPREPLY[@]}\"\n";
    std::vector<std::string> found = printedBy(inFolder("bash ./script"));
    std::erase(found, "");
    return found;
  }
  std::vector<std::string> inFish(const std::string& line) const {
    std::vector<std::string> found =
        printedBy(inFolder("fish -c 'source ./completion; complete -C \"" + line + "\"'"));
    for (std::string& word : found)
      word = word.substr(0, word.find('\t'));
    return found;
  }
  /// The line after the tabulator key, in an interactive shell.
  std::string inZsh(const std::string& line) const {
    fs::remove(folder_ / "line");
    const std::vector<std::string> printed =
        printedBy(inFolder("zsh -f '" CAROM_SOURCE_DIR "/tests/command/press_tab.zsh' '" + line +
                           "' ./completion ./line"));
    EXPECT_THAT(printed, IsEmpty());
    std::string text = contents(folder_ / "line");
    while (text.ends_with('\n') || text.ends_with(' '))
      text.pop_back();
    return text;
  }

  const TemporaryFolder folder_;
};

TEST_F(Completion, OfBashOffersCommandsOptionsWordsFilesScenesAndMaterials) {
  if (!isInstalled("bash")) GTEST_SKIP() << "there is no bash";
  write("bash");
  EXPECT_THAT(inBash({"ren"}), ElementsAre("render"));
  EXPECT_THAT(inBash({""}), IsSupersetOf({"render", "scenes", "batch", "help"}));
  EXPECT_THAT(inBash({"render", "--ste"}), UnorderedElementsAre("--stems", "--step", "--stepper"));
  EXPECT_THAT(inBash({"render", "--stepper", ""}), UnorderedElementsAre("native", "bullet"));
  EXPECT_THAT(inBash({"render", "--stepper", "=", "n"}), ElementsAre("native"));
  EXPECT_THAT(inBash({"render", "--stepper", "="}), UnorderedElementsAre("native", "bullet"));
  EXPECT_THAT(inBash({"render", "marbles_in"}),
              UnorderedElementsAre("marbles_in_a_box", "marbles_in_a_room"));
  EXPECT_THAT(inBash({"render", "two_balls", "--tail", ""}), IsEmpty());
  EXPECT_THAT(inBash({"modes", "--material", "ste"}), ElementsAre("steel"));
  EXPECT_THAT(inBash({"batch", "re"}), UnorderedElementsAre("repeat", "report"));
  EXPECT_THAT(inBash({"batch", "run", "--sh"}), ElementsAre("--shard"));
  EXPECT_THAT(inBash({"batch", "run", "ru"}), ElementsAre("runs"));
  EXPECT_THAT(inBash({"help", "mat"}), ElementsAre("materials"));
  EXPECT_THAT(inBash({"replay", "run."}), ElementsAre("run.carom"));
  EXPECT_THAT(inBash({"listen", "-o", "a.wav", "--", "./com"}), ElementsAre("./completion"));
}

TEST_F(Completion, OfBashHasEveryOptionOfTheHelpAndNoOther) {
  if (!isInstalled("bash")) GTEST_SKIP() << "there is no bash";
  write("bash");
  for (const std::string command : {"render", "replay", "modes", "video", "report", "events"}) {
    std::set<std::string> expected;
    std::istringstream lines(carom({command, "--help"}).out);
    for (std::string line; std::getline(lines, line);) {
      if (!line.starts_with("  ") || line.starts_with("      --") == line.starts_with("  -"))
        continue;
      std::istringstream words(line);
      for (std::string word; words >> word && word.starts_with('-');)
        if (word.starts_with("--")) expected.insert(word.substr(0, word.find(',')));
    }
    const std::vector<std::string> offered = inBash({command, "--"});
    EXPECT_EQ(std::set<std::string>(offered.begin(), offered.end()), expected) << command;
    EXPECT_GT(expected.size(), 5u) << command;
  }
}

TEST_F(Completion, OfFishOffersCommandsOptionsWordsFilesScenesAndMaterials) {
  if (!isInstalled("fish")) GTEST_SKIP() << "there is no fish";
  write("fish");
  EXPECT_THAT(inFish("carom ren"), ElementsAre("render"));
  EXPECT_THAT(inFish("carom render --ste"), UnorderedElementsAre("--stems", "--step", "--stepper"));
  EXPECT_THAT(inFish("carom render --stepper n"), ElementsAre("native"));
  EXPECT_THAT(inFish("carom render marbles_in"),
              UnorderedElementsAre("marbles_in_a_box", "marbles_in_a_room"));
  EXPECT_THAT(inFish("carom modes --material ste"), ElementsAre("steel"));
  EXPECT_THAT(inFish("carom batch re"), UnorderedElementsAre("repeat", "report"));
  EXPECT_THAT(inFish("carom batch run --sh"), ElementsAre("--shard"));
  EXPECT_THAT(inFish("carom help mat"), ElementsAre("materials"));
  EXPECT_THAT(inFish("carom replay run."), ElementsAre("run.carom"));
}

TEST_F(Completion, OfZshCompletesCommandsOptionsWordsFilesScenesAndMaterials) {
  if (!isInstalled("zsh")) GTEST_SKIP() << "there is no zsh";
  write("zsh");
  EXPECT_EQ(inZsh("carom ren"), "carom render");
  EXPECT_EQ(inZsh("carom render --confi"), "carom render --confine");
  EXPECT_EQ(inZsh("carom render --stepper n"), "carom render --stepper native");
  EXPECT_EQ(inZsh("carom render two_b"), "carom render two_balls");
  EXPECT_EQ(inZsh("carom modes --material ste"), "carom modes --material steel");
  EXPECT_EQ(inZsh("carom batch ver"), "carom batch verify");
  EXPECT_EQ(inZsh("carom batch run --repa"), "carom batch run --repair");
  EXPECT_EQ(inZsh("carom help mat"), "carom help materials");
  EXPECT_EQ(inZsh("carom replay run."), "carom replay run.carom");
}

TEST(ManualPages, AreThereForTheProgramAndEveryCommandAndFormatWithoutAWarning) {
  const TemporaryFolder folder;
  ASSERT_EQ(carom({"help", "--write-pages", folder.path().string()}).code, 0);
  std::vector<fs::path> pages;
  for (const auto& entry : fs::directory_iterator(folder / "man/man1"))
    pages.push_back(entry.path());
  const Outcome overview = carom({});
  for (const fs::path& page : pages) {
    const std::string name = page.stem().string();
    if (name != "carom") {
      EXPECT_NE(overview.out.find("\n  " + name.substr(6) + " "), std::string::npos) << name;
    }
    const std::string text = contents(page);
    EXPECT_TRUE(text.starts_with(".TH CAROM")) << name;
    for (const char* section : {".SH NAME\n", ".SH SYNOPSIS\n", ".SH OPTIONS\n", ".SH SEE ALSO\n"})
      EXPECT_NE(text.find(section), std::string::npos) << name << section;
  }
  EXPECT_EQ(pages.size(), 21u);
  if (!isInstalled("man")) GTEST_SKIP() << "there is no man";
  for (const fs::path& page : pages)
    EXPECT_THAT(printedBy("LC_ALL=C.UTF-8 MANROFFSEQ='' MANWIDTH=80 man --warnings -E UTF-8 -l "
                          "-Tutf8 -Z '" +
                          page.string() + "' 2>&1 >/dev/null | cat"),
                IsEmpty())
        << page;
}

TEST(ManualPages, HaveTheDayOfThePackageAndNoOther) {
  const TemporaryFolder folder;
  setenv("SOURCE_DATE_EPOCH", "1000000000", 1);
  ASSERT_EQ(carom({"help", "--write-pages", folder.path().string()}).code, 0);
  unsetenv("SOURCE_DATE_EPOCH");
  const std::string page = contents(folder / "man/man1/carom-render.1");
  EXPECT_EQ(page.substr(0, page.find('\n')).find("CAROM\\-RENDER 1 \"2001-09-09\""), 4u) << page;
}

}  // namespace
}  // namespace carom::test
