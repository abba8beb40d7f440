#include "scenes/format/ringing_reader.h"

#include <cstddef>

#include "scenes/values/scene_ranges.h"

namespace carom::scenes {

using namespace modal;

namespace {

// scene.schema.json and docs/scenes.md repeat these; a test compares the schema.

constexpr NumberRange kThickness{.noun = "a thickness", .min = 1e-6, .max = 1e3, .unit = "metres"};
constexpr NumberRange kDegreesOfFreedom{
    .noun = "a number of degrees of freedom", .min = 192, .max = 1e6, .whole = true};
constexpr NumberRange kAccuracy{.noun = "an accuracy", .min = 1e-5, .max = 0.5};
constexpr NumberRange kModeCount{.noun = "a number of modes", .min = 1, .max = 2000, .whole = true};
constexpr TextRange kNodeName{.noun = "the name of a node", .minLength = 1, .maxLength = 1000};
constexpr NumberRange kPanels{.noun = "a number of panels", .min = 100, .max = 5000, .whole = true};

void readShell(const JsonNode& node, MeshAnalysisSettings& analysis) {
  analysis.body = BodyModel::shell;
  analysis.shell.thickness = node.number("thickness", kThickness);
  if (const auto springs = node.find("springs"))
    analysis.shell.springs = springs->choice("what springs resist", {"transverse", "axial"}) == 0
                                 ? ShellSprings::transverse
                                 : ShellSprings::axial;
  for (const char* key : {"dofs", "accuracy"})
    if (const auto found = node.find(key))
      found->fail("a shell has no use for it; expected none, or \"body\": \"solid\"");
}

void readSolid(const JsonNode& node, MeshAnalysisSettings& analysis) {
  analysis.solid.accuracy = node.number("accuracy", kAccuracy, analysis.solid.accuracy);
  if (const auto degrees = node.find("dofs")) {
    const double number = node.number("dofs", kDegreesOfFreedom);
    analysis.solid.grid.degreesOfFreedom = static_cast<std::size_t>(number);
    if (node.find("accuracy"))
      degrees->fail("there is an accuracy as well; expected one of the two");
  }
  for (const char* key : {"thickness", "springs"})
    if (const auto found = node.find(key))
      found->fail("a solid has no use for it; expected none, or \"body\": \"shell\"");
}

void readAnalysis(const JsonNode& node, MeshAnalysisSettings& analysis) {
  if (!node.expectObject("modes",
                         {"body", "thickness", "springs", "dofs", "accuracy", "count", "panels"}))
    return;
  const auto body = node.find("body");
  const bool shell = body && body->choice("a model of bodies", {"solid", "shell"}) == 1;
  if (shell)
    readShell(node, analysis);
  else
    readSolid(node, analysis);
  const double modes = node.number("count", kModeCount, 60.0);
  analysis.solid.maxModes = static_cast<Eigen::Index>(modes);
  analysis.shell.maxModes = static_cast<std::size_t>(modes);
  analysis.radiation->panels = static_cast<std::size_t>(node.number("panels", kPanels, 800.0));
}

void readFile(const JsonNode& node, const SceneFolder& folder, ModelFile& model) {
  if (!node.expectObject("modes from a file", {"file", "node"})) return;
  model.path = folder.fileOf(node.member("file"));
  if (const auto name = node.find("node")) model.node = name->text(kNodeName);
}

}  // namespace

std::optional<Ringing> readRinging(const JsonNode& entry, const SceneFolder& folder) {
  const auto node = entry.find("modes");
  if (!node) return std::nullopt;
  Ringing ringing;
  if (node->isString())
    ringing.model.path = folder.fileOf(*node);
  else if (node->isObject() && node->has("file"))
    readFile(*node, folder, ringing.model);
  else if (node->isObject())
    readAnalysis(*node, ringing.analysis);
  else
    node->failAs("modes",
                 "the name of a model file, or an object that says what to compute, or with "
                 "\"file\" and \"node\"");
  return ringing;
}

}  // namespace carom::scenes
