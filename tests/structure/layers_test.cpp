#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <ostream>
#include <regex>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace carom::test {
namespace {

namespace fs = std::filesystem;
using testing::IsEmpty;
using testing::SizeIs;

/// A folder and the names that its files may include. Standard headers (<NAME> without a dot or a
/// slash) are open to all; every other name has to match here as it stands between the quotation
/// marks or brackets: so nothing is included by a relative path, nor by a macro.
struct Layer {
  std::string folder;
  std::string mayInclude;  // regular expression for the whole name
};

void PrintTo(const Layer& layer, std::ostream* out) {
  *out << layer.folder << '/';
}

/// The headers with the vocabulary of events, and those that replace what a standard library may
/// lack.
constexpr const char* kVocabulary =
    "carom/audio/(impulse_event|contact_state|material|sound_body|modal_model|rigid_radiator|"
    "surface_mesh|listener|vector|result)\\.h|audio/model/(decimal|immortal|mutex)\\.h";
constexpr const char* kEigen = "Eigen/[A-Za-z]+";
constexpr const char* kBullet =
    "(bt[A-Za-z]+\\.h|(LinearMath|BulletCollision|BulletDynamics)/[A-Za-z0-9/]+\\.h)";

/// The table of folders of the design.
std::vector<Layer> layers() {
  const std::string vocabulary = kVocabulary;
  const std::string eigen = kEigen;
  const std::string bullet = kBullet;
  return {
      {"audio", "(carom/)?audio/.*|" + eigen},
      {"native", "(carom/)?native/.*|" + vocabulary},
      {"modal", "(carom/)?(modal|audio)/.*|" + eigen},
      {"bullet_bridge", "bullet_bridge/.*|carom/bullet/.*|" + vocabulary + "|" + bullet},
      {"plugin",
       "plugin/.*|carom/[a-z_]+\\.h|(carom/)?audio/.*|bullet_bridge/.*|carom/bullet/.*|" + bullet},
      {"web",
       "web/.*|carom/carom\\.h|plugin/c_api/.*|audio/run/.*|audio/io/held_files\\.h|"
       "audio/propagation/hrtf\\.h|scenes/.*|carom_h_tables\\.inc"},
      {"scenes", "(?!(tests|lab|command)/).*"},
      {"lab", "(?!(tests|command)/).*"},
      {"command", "(?!tests/).*"},
  };
}

/// Files, and folders with their slash, that may include one more name.
const std::vector<Layer>& exceptions() {
  static const std::vector<Layer> list = {
      {"audio/io/sound_file.cpp", "sndfile\\.h"},
      {"audio/io/wav_stream.cpp", "sndfile\\.h"},
      {"audio/io/partial_file.cpp", "(dirent|fcntl|unistd)\\.h|sys/(file|stat)\\.h"},
      {"audio/synthesis/noise_bed.cpp", "unsupported/Eigen/FFT"},
      {"audio/propagation/air_filter.cpp", "unsupported/Eigen/FFT"},
      {"audio/propagation/sofa_file.cpp", "mysofa\\.h"},
      {"audio/run/zstd_frame.cpp", "zstd\\.h"},
      {"audio/io/normal_map.cpp", "png\\.h"},
      {"audio/model/surface_texture.cpp", "unsupported/Eigen/FFT"},
      {"audio/synthesis/simd_kernels.cpp", "hwy/[a-z_]+\\.h"},
      {"audio/dsp/simd_resonators.cpp", "hwy/[a-z_]+\\.h"},
      {"native/jello/simd_jello.cpp", "hwy/[a-z_]+\\.h"},
      {"native/jello/jello_implicit.cpp", kEigen},
      {"native/jello/jello_implicit.h", kEigen},
      {"native/jello/jello_limits.cpp", kEigen},
      {"modal/gltf/gltf_builder.h", "nlohmann/json\\.hpp"},
      {"modal/gltf/gltf_document.h", "nlohmann/json_fwd\\.hpp"},
      {"modal/gltf/gltf_document.cpp", "nlohmann/json\\.hpp"},
      {"modal/json/json_reader.h", "nlohmann/json_fwd\\.hpp"},
      {"modal/json/json_reader.cpp", "nlohmann/json\\.hpp"},
      {"modal/cache/model_claim.cpp", "(fcntl|unistd)\\.h|sys/file\\.h"},
      {"modal/mesh/assimp_reader.cpp", "assimp/[A-Za-z]+\\.(h|hpp)"},
      {"modal/mesh/mesh_simplify.cpp", "meshoptimizer\\.h"},
      {"modal/analysis/sparse_factor_mumps.cpp", "(dlfcn|dmumps_c)\\.h"},
      {"bullet_bridge/tracking/solved_contact.cpp", "BulletSoftBody/btSoftBody\\.h"},
      {"plugin/bullet/shape_solver.cpp", "(pthread|unistd)\\.h"},
      {"web/live_exports.cpp", "nlohmann/json\\.hpp"},
      {"plugin/realtime/audio_device.cpp", "SDL\\.h"},
      {"plugin/include/carom/carom.h", "std(def|int)\\.h"},
      {"plugin/examples/c_click.c", "stdio\\.h"},
      {"plugin/examples/c_host.c", "(math|stdio)\\.h"},
      {"plugin/examples/getting_started/", "game\\.h"},
      {"plugin/realtime/sound_session.cpp", "pthread\\.h"},
      {"plugin/listen/bullet_function.cpp", "(dlfcn|link)\\.h"},
      {"plugin/listen/heard_worlds.cpp", "unistd\\.h|sys/uio\\.h"},
      {"plugin/listen/listen_report.cpp", "(fcntl|unistd)\\.h"},
      {"plugin/listen/sound_library.cpp", "(dlfcn|unistd)\\.h"},
      {"plugin/pybullet/server_api.cpp", "dlfcn\\.h"},
      {"plugin/pybullet/server_sound.cpp", "unistd\\.h"}};
  return list;
}

bool isStandard(const std::string& name, char bracket) {
  return bracket == '<' && name.find_first_of("./") == std::string::npos;
}

bool matches(const std::string& name, const std::string& expression) {
  return std::regex_match(name, std::regex(expression));
}

bool mayInclude(const Layer& layer, const std::string& file, const std::string& name,
                char bracket) {
  if (isStandard(name, bracket) || matches(name, layer.mayInclude)) return true;
  return std::ranges::any_of(exceptions(), [&](const Layer& exception) {
    const bool holds = exception.folder.ends_with('/') && file.starts_with(exception.folder);
    return (holds || exception.folder == file) && matches(name, exception.mayInclude);
  });
}

/// Returns "FILE:LINE includes NAME" for each line of `text` that breaks the rules of `layer`.
std::vector<std::string> violations(const Layer& layer, const std::string& file,
                                    const std::string& text) {
  static const std::regex include(R"(^\s*#\s*(include|include_next|import)\b\s*(.)([^">]*).*)");
  std::vector<std::string> found;
  std::istringstream lines(text);
  std::size_t number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    std::smatch parts;
    if (!std::regex_match(line, parts, include)) continue;
    if (mayInclude(layer, file, parts[3], parts[2].str().front())) continue;
    found.push_back(file + ":" + std::to_string(number) + " includes " + parts[3].str());
  }
  return found;
}

Layer layerOf(const std::string& folder) {
  const std::vector<Layer> all = layers();
  return *std::ranges::find(all, folder, &Layer::folder);
}

/// Violations of one line in a file of the folder.
std::vector<std::string> violations(const std::string& folder, const std::string& line) {
  return violations(layerOf(folder), folder + "/some.cpp", line);
}

bool isSource(const fs::path& path) {
  const std::string extension = path.extension().string();
  return extension == ".h" || extension == ".cpp" || extension == ".c" || extension == ".hpp" ||
         extension == ".inl";
}

class Layers : public testing::TestWithParam<Layer> {};

TEST_P(Layers, IncludeOnlyWhatLiesBelowThem) {
  const fs::path root = CAROM_SOURCE_DIR;
  std::size_t files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(root / GetParam().folder)) {
    if (!isSource(entry.path())) continue;
    ++files;
    const std::string file = entry.path().lexically_relative(root).generic_string();
    EXPECT_THAT(violations(GetParam(), file, contents(entry.path())), IsEmpty());
  }
  EXPECT_GT(files, 1u);
}

INSTANTIATE_TEST_SUITE_P(, Layers, testing::ValuesIn(layers()),
                         [](const auto& layer) { return layer.param.folder; });

/// A host's include path belongs to the host: a public header must include other Carom headers only
/// below carom/, never relative to itself or under a name that may be a folder of the host.
TEST(PublicHeaders, IncludeOneAnotherAsHostsDoAndNothingPrivate) {
  const fs::path root = CAROM_SOURCE_DIR;
  const std::regex quoted(R"(\s*#\s*include\s*".*)");
  const std::regex ours(R"(\s*#\s*include\s*<(audio|native|modal|bullet_bridge|plugin|scenes)/.*)");
  std::size_t headers = 0;
  for (const Layer& layer : layers()) {
    if (!fs::exists(root / layer.folder / "include")) continue;
    for (const auto& entry : fs::recursive_directory_iterator(root / layer.folder / "include")) {
      if (!entry.is_regular_file()) continue;
      ++headers;
      std::istringstream lines(contents(entry.path()));
      for (std::string line; std::getline(lines, line);)
        EXPECT_FALSE(std::regex_match(line, quoted) || std::regex_match(line, ours))
            << entry.path() << ": " << line;
    }
  }
  EXPECT_GT(headers, 20u);
  EXPECT_LE(headers, 40u) << "each of them is a promise to every host";
}

TEST(LayersCheck, FindsEveryIncludeThatPointsUpOrAcross) {
  for (const auto& [folder, name] : std::vector<std::pair<std::string, std::string>>{
           {"audio", "\"native/sphere_stepper.h\""},
           {"audio", "\"scenes/format/scene.h\""},
           {"audio", "<btBulletDynamicsCommon.h>"},
           {"audio", "<nlohmann/json.hpp>"},
           {"audio", "<sndfile.h>"},
           {"audio", "\"synth.h\""},
           {"audio", "\"../scenes/scene.h\""},
           {"audio", "CONFIGURED_HEADER"},
           {"native", "\"carom/audio/synth.h\""},
           {"native", "\"audio/scheduling/contact_sound_scheduler.h\""},
           {"native", "\"bullet_bridge/geometry/motion.h\""},
           {"native", "<LinearMath/btVector3.h>"},
           {"bullet_bridge", "\"carom/audio/synth.h\""},
           {"plugin", "<carom/modal/mesh_file.h>"},
           {"bullet_bridge", "\"native/math/contact_time.h\""},
           {"bullet_bridge", "\"plugin/sound.h\""},
           {"plugin", "\"native/sphere_stepper.h\""},
           {"plugin", "\"scenes/format/scene.h\""},
           {"plugin", "<CLI/CLI.hpp>"},
           {"scenes", "\"tests/support/recording.h\""},
           {"scenes", "\"lab/report/report.h\""},
           {"lab", "\"command/command_line.h\""},
           {"plugin", "\"tests/support/recording.h\""},
           {"audio", "<tests/support/recording.h>"}}) {
    for (const std::string directive : {"#include ", "  #  include ", "#import "})
      EXPECT_THAT(violations(folder, directive + name), SizeIs(1)) << folder << ' ' << name;
  }
}

TEST(LayersCheck, AllowsWhatTheTableAllows) {
  for (const auto& [folder, name] : std::vector<std::pair<std::string, std::string>>{
           {"audio", "<vector>"},
           {"audio", "<Eigen/Core>"},
           {"audio", "\"audio/model/hertz.h\""},
           {"audio", "<carom/audio/synth.h>"},
           {"native", "\"carom/audio/impulse_event.h\""},
           {"native", "\"native/scheduling/event_scheduler.h\""},
           {"bullet_bridge", "<btBulletDynamicsCommon.h>"},
           {"bullet_bridge", "<BulletCollision/CollisionShapes/btSphereShape.h>"},
           {"bullet_bridge", "\"carom/audio/material.h\""},
           {"plugin", "\"carom/audio/synth.h\""},
           {"plugin", "\"carom/bullet/bullet_bridge.h\""},
           {"scenes", "\"native/sphere_stepper.h\""},
           {"command", "<CLI/CLI.hpp>"}}) {
    EXPECT_THAT(violations(folder, "#include " + name), IsEmpty()) << folder << ' ' << name;
  }
}

TEST(LayersCheck, NamesTheFileAndTheLine) {
  EXPECT_THAT(violations("native", "#pragma once\n\n#include \"scenes/run/plan.h\"\n"),
              testing::ElementsAre("native/some.cpp:3 includes scenes/run/plan.h"));
}

TEST(LayersCheck, IgnoresIncludesThatAreNone) {
  EXPECT_THAT(violations("audio", "// #include \"scenes/run/plan.h\"\nincluded(\"scenes/x.h\");\n"),
              IsEmpty());
}

}  // namespace
}  // namespace carom::test
