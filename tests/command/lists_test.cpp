#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "carom/audio/material.h"
#include "tests/scenes/command.h"
#include "tests/support/csv.h"
#include "tests/support/temporary_folder.h"

namespace carom::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::vector<std::string> linesOf(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);)
    lines.push_back(line);
  return lines;
}

/// The scenes of the source tree, by name.
std::map<std::string, fs::path> sceneFiles() {
  std::map<std::string, fs::path> files;
  for (const char* folder : {"scenes/library", "scenes/shows"})
    for (const auto& entry : fs::directory_iterator(fs::path(CAROM_SOURCE_DIR) / folder))
      if (entry.path().extension() == ".json") files[entry.path().stem().string()] = entry.path();
  return files;
}

// Scenes

TEST(ScenesCommand, ListsEverySceneOfTheLibraryWithItsFile) {
  const std::map<std::string, fs::path> files = sceneFiles();
  ASSERT_GT(files.size(), 20u);
  std::vector<std::string> names;
  for (const auto& [name, file] : files)
    names.push_back(name);
  EXPECT_EQ(linesOf(carom({"scenes", "-q"}).out), names);
  const json list = parsed(carom({"scenes", "--json"})).at("scenes");
  ASSERT_EQ(list.size(), files.size());
  for (const json& scene : list) {
    const fs::path file = files.at(scene.at("name"));
    EXPECT_TRUE(fs::equivalent(scene.at("file").get<std::string>(), file));
    const json text = json::parse(contents(file));
    EXPECT_EQ(scene.at("description"), text.at("description"));
    EXPECT_EQ(scene.at("duration_s"), text.at("duration"));
  }
}

TEST(ScenesCommand, HasALineOfAtMostEightyLettersForEachScene) {
  const Outcome outcome = carom({"scenes"});
  const std::vector<std::string> lines = linesOf(outcome.out);
  EXPECT_EQ(outcome.code, 0);
  ASSERT_EQ(lines.size(), sceneFiles().size());
  for (const std::string& line : lines) {
    EXPECT_LE(line.size(), 80u) << line;
    EXPECT_GT(line.size(), 40u) << line;
  }
}

TEST(ScenesCommand, PrintsThePathOfOneScene) {
  const std::string path = carom({"scenes", "--paths", "two_balls"}).out;
  ASSERT_TRUE(path.ends_with('\n'));
  EXPECT_TRUE(fs::equivalent(path.substr(0, path.size() - 1), libraryFile("two_balls")));
}

TEST(LibraryScenes, AreFoundByTheirNamesByEveryCommandThatTakesOne) {
  const TemporaryFolder folder;
  const auto at = [&](const char* name) { return (folder / name).string(); };
  ASSERT_EQ(carom({"render", library("two_balls"), "-o", at("file.wav")}).code, 0);
  ASSERT_EQ(carom({"render", "two_balls", "-o", at("name.wav")}).code, 0);
  ASSERT_EQ(carom({"render", "two_balls.json", "-o", at("json.wav")}).code, 0);
  EXPECT_EQ(contents(at("file.wav")), contents(at("name.wav")));
  EXPECT_EQ(contents(at("file.wav")), contents(at("json.wav")));
  for (const std::vector<std::string>& command : std::vector<std::vector<std::string>>{
           {"info", "two_balls"},
           {"compare", "two_balls"},
           {"events", "two_balls"},
           {"record", "two_balls", "-o", at("run.carom")},
           {"jello", "jello_drop", "--seconds", "0.01"},
           {"report", "two_balls", "-o", at("report"), "--no-view", "--runs", "1"}})
    EXPECT_EQ(carom(command).code, 0) << command.front();
}

TEST(LibraryScenes, GiveWayToAFileOfTheSameName) {
  const TemporaryFolder folder;
  json scene = json::parse(contents(libraryFile("two_balls")));
  scene["duration"] = 0.125;
  std::ofstream(folder / "two_balls") << scene.dump();
  const json own = parsed(carom({"info", "two_balls", "--json"}, {.folder = folder.path()}));
  EXPECT_EQ(own.at("duration_s"), 0.125);
  const json theirs = parsed(carom({"info", "two_balls", "--json"}));
  EXPECT_EQ(theirs.at("duration_s"), 1.0);
}

// Materials

TEST(MaterialsCommand, ListsEveryBuiltInMaterialWithItsProperties) {
  std::vector<std::string> names;
  for (const Material& material : builtInMaterials())
    names.push_back(material.name);
  EXPECT_EQ(linesOf(carom({"materials", "-q"}).out), names);
  const json list = parsed(carom({"materials", "--json"})).at("materials");
  ASSERT_EQ(list.size(), names.size());
  for (std::size_t row = 0; row < names.size(); ++row) {
    const Material& material = builtInMaterials()[row];
    EXPECT_EQ(list[row].at("name"), material.name);
    EXPECT_EQ(list[row].at("density_kg_m3"), material.density);
    EXPECT_EQ(list[row].at("youngs_modulus_pa"), material.youngsModulus);
    EXPECT_EQ(list[row].at("poissons_ratio"), material.poissonsRatio);
    EXPECT_EQ(list[row].at("restitution"), material.restitution);
  }
  EXPECT_EQ(linesOf(carom({"materials"}).out).size(), names.size() + 2);  // and two of a heading
}

TEST(MaterialsCommand, TellsOfOneMaterialOrOfAFile) {
  const Outcome steel = carom({"materials", "steel"});
  EXPECT_EQ(steel.code, 0);
  EXPECT_TRUE(steel.out.starts_with("steel\n")) << steel.out;
  EXPECT_NE(steel.out.find("kg/m^3"), std::string::npos);
  EXPECT_EQ(parsed(carom({"materials", "glass", "--json"})).at("name"), "glass");
  const TemporaryFolder folder;
  std::ofstream(folder / "own.json") << R"({"like": "steel", "density": 7000})";
  const json own = parsed(carom({"materials", (folder / "own.json").string(), "--json"}));
  EXPECT_EQ(own.at("density_kg_m3"), 7000.0);
  EXPECT_TRUE(own.at("damping_within_factor").is_null());  // it is called "own"
  EXPECT_THAT(steel.out, testing::HasSubstr("docs/materials.md\n"));
  const std::string file = (folder / "own.json").string();
  EXPECT_THAT(carom({"materials", file}).out, testing::EndsWith(" " + file + "\n"));
}

// docs/materials.md has a row of eight cells for each, of which the last but one is the factor.
TEST(MaterialsCommand, DampingIsAsSureAsThePageSays) {
  const std::string page = contents(fs::path(CAROM_SOURCE_DIR) / "docs" / "materials.md");
  std::map<std::string, int> factors;
  for (const std::string& line : linesOf(page.substr(page.find("\n## Damping\n")))) {
    std::vector<std::string> cells;
    std::istringstream row(line);
    for (std::string cell; std::getline(row, cell, '|');)
      cells.push_back(cell);
    if (cells.size() == 9 && cells[1].starts_with(" `"))
      factors[cells[1].substr(2, cells[1].size() - 4)] = std::stoi(cells[7]);
  }
  const json list = parsed(carom({"materials", "--json"})).at("materials");
  EXPECT_EQ(factors.size(), list.size());
  for (const json& material : list)
    EXPECT_EQ(material.at("damping_within_factor"), factors[material.at("name")])
        << material.at("name");
}

// Events

/// A collision as a test reads it from the rows of an events file.
struct Heard {
  double time = 0.0;
  double impulse = 0.0;
  double peak = 0.0;
  std::set<std::string> bodies;
};

/// Reads an events file without the program's help: the loudest collision first.
std::vector<Heard> loudestFirst(const fs::path& file) {
  const auto rows = parseCsv(contents(file));
  const auto column = [&](const std::string& name) {
    return static_cast<std::size_t>(std::ranges::find(rows.front(), name) - rows.front().begin());
  };
  std::map<std::string, Heard> byNumber;
  for (std::size_t row = 1; row < rows.size(); ++row) {
    const auto& cells = rows[row];
    Heard& heard = byNumber[cells[column("collision")]];
    heard.time = numberOf(cells[column("time_s")]);
    heard.peak = std::max(heard.peak, numberOf(cells[column("peak_pa")]));
    heard.impulse = std::hypot(numberOf(cells[column("jx_Ns")]), numberOf(cells[column("jy_Ns")]),
                               numberOf(cells[column("jz_Ns")]));
    heard.bodies = {cells[column("body")], cells[column("other")]};
  }
  std::vector<Heard> all;
  for (const auto& [number, heard] : byNumber)
    all.push_back(heard);
  std::ranges::sort(all, [](const Heard& one, const Heard& other) {
    return std::pair(-one.peak, one.time) < std::pair(-other.peak, other.time);
  });
  return all;
}

TEST(EventsCommand, ListsTheLoudestCollisionsOfASceneARunAndAnEventsFile) {
  const TemporaryFolder folder;
  const auto at = [&](const char* name) { return (folder / name).string(); };
  ASSERT_EQ(carom({"render", "marbles_in_a_box", "-o", at("a.wav"), "--events", at("a.csv")}).code,
            0);
  ASSERT_EQ(carom({"record", "marbles_in_a_box", "-o", at("run.carom")}).code, 0);
  const std::vector<Heard> expected = loudestFirst(folder / "a.csv");
  ASSERT_GT(expected.size(), 100u);
  for (const std::string& file : {std::string("marbles_in_a_box"), at("run.carom"), at("a.csv")}) {
    const json report = parsed(carom({"events", file, "--loudest", "5", "--json"}));
    EXPECT_EQ(report.at("collisions"), expected.size());
    const json& listed = report.at("listed");
    ASSERT_EQ(listed.size(), 5u) << file;
    for (std::size_t row = 0; row < 5; ++row) {
      EXPECT_EQ(listed[row].at("peak_pa"), expected[row].peak) << file;
      EXPECT_EQ(listed[row].at("time_s"), expected[row].time);
      EXPECT_NEAR(listed[row].at("impulse_Ns").get<double>(), expected[row].impulse,
                  1e-12 * expected[row].impulse);
      EXPECT_EQ((std::set<std::string>{listed[row].at("body"), listed[row].at("other")}),
                expected[row].bodies);
    }
  }
}

TEST(EventsCommand, ListsAllInOrderOfTimeUnlessToldOtherwise) {
  const json listed = parsed(carom({"events", "newtons_cradle", "--json"})).at("listed");
  ASSERT_EQ(listed.size(), 5u);
  EXPECT_TRUE(std::ranges::is_sorted(
      listed, {}, [](const json& row) { return row.at("time_s").get<double>(); }));
  const std::string text = carom({"events", "newtons_cradle"}).out;
  EXPECT_EQ(linesOf(text).size(), 7u) << text;
}

TEST(EventsCommand, RefusesFilesThatAreNoEventsAndSaysWhere) {
  const TemporaryFolder folder;
  const std::string file = (folder / "a.csv").string();
  const std::string header =
      "time_s,body,other,jx_Ns,jy_Ns,jz_Ns,px_m,py_m,pz_m,nx,ny,nz,approach_speed_m_s,"
      "effective_mass_kg,duration_s,collision,peak_pa,heard\n";
  for (const auto& [text, says] : std::vector<std::pair<std::string, std::string>>{
           {"", "no column time_s"},
           {"a,b\n1,2\n", "no column time_s"},
           {header + "1,a\n", "line 2: 2 cells; expected 18"},
           {header + "x,a,b,0,0,0,0,0,0,0,0,0,1,1,1,1,1,1\n", "line 2: column time_s"},
           {header + "nan,a,b,0,0,0,0,0,0,0,0,0,1,1,1,1,1,1\n", "expected a number"},
           {header + "1,a,b,0,0,0,0,0,0,0,0,0,1,1,1,-1,1,1\n", "column collision"},
           {header + "1,\"a,b,0,0,0", "never closed"}}) {
    std::ofstream(file, std::ios::binary) << text;
    const std::string message = expectRefused({"events", file}, 2);
    EXPECT_NE(message.find(file), std::string::npos) << message;
    EXPECT_NE(message.find(says), std::string::npos) << message;
  }
  std::ofstream(file, std::ios::binary) << header;
  EXPECT_EQ(parsed(carom({"events", file, "--json"})).at("collisions"), 0);
}

}  // namespace
}  // namespace carom::test
