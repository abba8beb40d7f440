#include "tests/structure/type_names.h"

#include <cstddef>
#include <filesystem>
#include <regex>
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
using testing::Key;
using testing::UnorderedElementsAre;

std::vector<std::string> namesIn(const std::string& text) {
  TypeNames names;
  names.read(text, "a.h");
  std::vector<std::string> found;
  for (const auto& [name, places] : names.places())
    found.push_back(name);
  return found;
}

/// True for files of which a build has only one: the use of a library, or its replacement.
bool isAlternative(const std::string& place) {
  return place.ends_with("_absent.cpp") || place == "modal/analysis/sparse_factor_eigen.cpp";
}

/// The one-definition rule of the standard (C++20 [basic.def.odr]): two classes of one name in one
/// program are undefined behaviour that no compiler has to report, and one compiler did not: at -O0
/// a ball fell by the numbers of another layer's class. Benchmarks and tests are programs of their
/// own, but they link the layers, and the next one that links two of them should not be the first
/// to find out.
TEST(TypeNames, AreDefinedOnceInTheWholeRepository) {
  const fs::path root = CAROM_SOURCE_DIR;
  TypeNames names;
  std::size_t files = 0;
  for (const char* folder : {"audio", "native", "modal", "bullet_bridge", "plugin", "web", "scenes",
                             "lab", "command", "tests"}) {
    for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
      const std::string extension = entry.path().extension().string();
      const std::string place = entry.path().lexically_relative(root).generic_string();
      if ((extension != ".h" && extension != ".cpp") || isAlternative(place)) continue;
      ++files;
      names.read(contents(entry.path()), place);
    }
  }
  EXPECT_GT(files, 400u);
  EXPECT_GT(names.places().size(), 500u);
  for (const auto& [name, places] : names.places())
    EXPECT_EQ(places.size(), 1u) << name << " is defined in " << testing::PrintToString(places);
}

/// Every public type must be in that file: tests/install/layout.sh compares its layout under other
/// flags with this build's.
TEST(PublicTypes, AreAllInTheTestOfTheirLayout) {
  const fs::path root = CAROM_SOURCE_DIR;
  const std::string layout = contents(root / "tests/install/layout.cpp");
  TypeNames names;
  for (const char* folder : {"audio", "native", "modal", "bullet_bridge", "plugin"})
    for (const auto& entry : fs::recursive_directory_iterator(root / folder / "include"))
      if (entry.is_regular_file() && entry.path().filename() != "carom.h")
        names.read(contents(entry.path()), entry.path().string());
  std::size_t types = 0;
  for (const auto& [name, places] : names.places()) {
    const std::string inCarom = name.substr(std::string("carom::").size());
    const std::regex isEnumeration("enum class " + inCarom + "\\b");
    if (inCarom.find(':') != std::string::npos ||
        std::regex_search(contents(places.front()), isEnumeration) || inCarom == "Result")
      continue;
    ++types;
    EXPECT_NE(layout.find("LAYOUT(" + inCarom + ")"), std::string::npos) << name;
  }
  EXPECT_GT(types, 60u);
}

TEST(TypeNamesCheck, FindsWhatIsDefinedTwice) {
  TypeNames names;
  names.read("namespace carom {\nstruct alignas(64) Motion {\n  int x;\n};\n}", "native/motion.h");
  names.read("namespace carom { struct Motion { int x; int y; }; }",
             "bullet_bridge/geometry/motion.h");
  EXPECT_THAT(names.places(), ElementsAre(Key("carom::Motion")));
  EXPECT_THAT(names.places().at("carom::Motion"),
              ElementsAre("native/motion.h", "bullet_bridge/geometry/motion.h"));
}

TEST(TypeNamesCheck, TellsNamespacesApart) {
  EXPECT_THAT(namesIn("namespace carom::native { class Motion final : public Base<int> {}; }\n"
                      "namespace carom { namespace bullet { class Motion {}; } }"),
              ElementsAre("carom::bullet::Motion", "carom::native::Motion"));
}

TEST(TypeNamesCheck, FindsNestedAndTemplatesAndEnumerations) {
  EXPECT_THAT(namesIn("namespace a {\nclass Outer {\n public:\n  struct Inner {};\n private:\n"
                      "  enum class Kind : unsigned char { one };\n};\n"
                      "template <class T, int n>\nstruct Pair {};\n"
                      "class Outer::Impl {};\nunion Either { int x; };\n}"),
              UnorderedElementsAre("a::Outer", "a::Outer::Inner", "a::Outer::Kind", "a::Pair",
                                   "a::Outer::Impl", "a::Either"));
}

TEST(TypeNamesCheck, LeavesOutWhatNoOtherFileCanName) {
  EXPECT_THAT(namesIn("namespace a {\nnamespace {\nstruct Own {};\n}\n"
                      "class Declared;\nstruct Declared make(struct Other* other) { return {}; }\n"
                      "void f() {\n  struct Local {};\n  if (true) { struct Deeper {}; }\n}\n"
                      "const char* text = \"struct Quoted {\";  // struct Commented {\n"
                      "/* class Commented { */\n#define STRUCT struct Macro {\n"
                      "const char* raw = R\"(struct Raw {)\";\nchar brace = '{';\n"
                      "template <> struct Special<int> {};\nint many = 1'000'000;\n}"),
              IsEmpty());
}

}  // namespace
}  // namespace carom::test
