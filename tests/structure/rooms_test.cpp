#include <filesystem>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace carom::test {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr std::size_t kMostFiles = 35;

/// The rooms that each room includes. A room is a folder of sources; the public headers of a layer
/// are one, whatever folders they are in.
using Rooms = std::map<std::string, std::set<std::string>>;

std::string roomOf(const std::string& file) {
  const std::size_t include = file.find("/include/");
  return include != std::string::npos ? file.substr(0, include + 8)
                                      : fs::path(file).parent_path().generic_string();
}

/// Returns the graph of rooms of these files, given as path in the repository and text.
Rooms roomsOf(const std::map<std::string, std::string>& files) {
  static const std::regex include(R"(^\s*#\s*include\s*["<]([^">]+)[">].*)");
  std::map<std::string, std::string> fileOf;  // as it stands in an #include
  for (const auto& [file, text] : files) {
    const std::size_t at = file.find("/include/");
    fileOf[at == std::string::npos ? file : file.substr(at + 9)] = file;
  }
  Rooms rooms;
  for (const auto& [file, text] : files) {
    std::set<std::string>& below = rooms[roomOf(file)];
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      std::smatch parts;
      if (!std::regex_match(line, parts, include)) continue;
      const auto included = fileOf.find(parts[1]);
      if (included != fileOf.end() && roomOf(included->second) != roomOf(file))
        below.insert(roomOf(included->second));
    }
  }
  return rooms;
}

/// Removes rooms that include none of those left until nothing changes: what is left lies on
/// circles, or includes one.
std::vector<std::string> onCircles(Rooms rooms) {
  const auto isFree = [&](const std::set<std::string>& below) {
    for (const std::string& room : below)
      if (rooms.contains(room)) return false;
    return true;
  };
  for (auto room = rooms.begin(); room != rooms.end();) {
    if (isFree(room->second)) {
      rooms.erase(room);
      room = rooms.begin();
    } else {
      ++room;
    }
  }
  std::vector<std::string> left;
  for (const auto& [room, below] : rooms)
    left.push_back(room);
  return left;
}

/// Returns the sources of all layers, examples aside, as path in the repository and text.
std::map<std::string, std::string> sources() {
  const fs::path root = CAROM_SOURCE_DIR;
  std::map<std::string, std::string> files;
  for (const char* layer :
       {"audio", "native", "modal", "bullet_bridge", "plugin", "web", "scenes", "lab", "command"}) {
    for (const auto& entry : fs::recursive_directory_iterator(root / layer)) {
      const std::string extension = entry.path().extension().string();
      if (extension != ".h" && extension != ".cpp") continue;
      files[entry.path().lexically_relative(root).generic_string()] = contents(entry.path());
    }
  }
  return files;
}

TEST(Rooms, DoNotIncludeOneAnotherInACircle) {
  const std::map<std::string, std::string> files = sources();
  EXPECT_GT(files.size(), 400u);
  EXPECT_THAT(onCircles(roomsOf(files)), IsEmpty());
}

TEST(Rooms, HoldAtMost35Files) {
  std::map<std::string, std::size_t> count;
  for (const auto& [file, text] : sources())
    ++count[fs::path(file).parent_path().generic_string()];
  for (const auto& [room, files] : count)
    EXPECT_LE(files, kMostFiles) << room;
}

TEST(RoomsCheck, FindsACircleAndWhatIncludesIt) {
  EXPECT_THAT(onCircles(roomsOf({{"a/x/one.h", "#include \"a/y/two.h\"\n"},
                                 {"a/y/two.h", "#include <carom/a/three.h>\n"},
                                 {"a/include/carom/a/three.h", ""},
                                 {"b/main.cpp", "#include \"a/x/one.h\"\n"}})),
              IsEmpty());
  EXPECT_THAT(onCircles(roomsOf({{"a/x/one.h", "#include \"a/y/two.h\"\n"},
                                 {"a/y/two.h", ""},
                                 {"a/y/two.cpp", "# include \"a/x/one.h\"\n"},
                                 {"a/z/free.h", ""},
                                 {"b/main.cpp", "#include \"a/x/one.h\"\n"}})),
              ElementsAre("a/x", "a/y", "b"));
}

}  // namespace
}  // namespace carom::test
