#include "command/modes_command.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iomanip>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "command/command_line.h"
#include "command/output/kept_inputs.h"
#include "command/output/output_target.h"
#include "command/progress_bar.h"
#include "command/terminal/terminal.h"
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "audio/io/partial_file.h"
#include "carom/modal/mesh_analysis.h"
#include "carom/modal/mesh_check.h"
#include "carom/modal/mesh_file.h"
#include "scenes/format/model_file.h"

namespace carom::command {

using namespace scenes;

using namespace audio;

namespace {

constexpr double kMillimetre = 1e-3;

double decayTime(const Mode& mode) {
  return std::log(1000.0) / mode.decayRate;  // s, by 60 dB
}

/// Returns the largest relative error of the frequencies; nothing, where none is known.
std::optional<double> worstError(const ModalModel& model) {
  double worst = 0.0;
  for (const Mode& mode : model.modes)
    worst = std::max(worst, mode.frequencyError);
  return worst > 0.0 ? std::optional(worst) : std::nullopt;
}

nlohmann::ordered_json modesJson(const MeshAnalysis& analysis) {
  const ModalModel& model = analysis.model;
  nlohmann::ordered_json object;
  object["name"] = model.name;
  object["material"] = model.material.name;
  object["mass_kg"] = model.mass;
  object["centre_of_mass_m"] = {model.centreOfMass.x(), model.centreOfMass.y(),
                                model.centreOfMass.z()};
  object["vertices"] = model.surface.vertices.size();
  if (analysis.degreesOfFreedom) object["degrees_of_freedom"] = *analysis.degreesOfFreedom;
  if (const auto error = worstError(model)) object["accuracy_reached"] = *error;
  object["modes"] = nlohmann::ordered_json::array();
  for (const Mode& mode : model.modes) {
    nlohmann::ordered_json entry;
    entry["frequency_hz"] = mode.frequency;
    if (mode.frequencyError > 0.0) entry["frequency_error"] = mode.frequencyError;
    entry["decay_rate_per_s"] = mode.decayRate;
    entry["radiation_decay_rate_per_s"] = mode.radiation.decayRate;
    entry["heat_decay_rate_per_s"] = mode.heatDecayRate;
    entry["volume_m2_per_sqrt_kg"] = mode.radiation.volume;
    entry["multipoles"] = mode.radiation.multipoles.size();
    object["modes"].push_back(std::move(entry));
  }
  object["left_out"] = {{"rigid", model.leftOut.rigid},
                        {"below_20_hz", model.leftOut.below},
                        {"above_20_khz_or_count", model.leftOut.above},
                        {"overdamped", model.leftOut.overdamped}};
  object["findings"] = nlohmann::ordered_json::array();
  for (const MeshFinding& finding : analysis.findings)
    object["findings"].push_back({{"fault", nameOf(finding.fault)}, {"text", finding.text}});
  object["from_cache"] = analysis.isFromCache;
  return object;
}

/// Returns the error of a mode's frequency in percent; a dash where it is not known.
std::string errorText(const Mode& mode) {
  if (mode.frequencyError <= 0.0) return "-";
  std::ostringstream text;
  text << std::fixed << std::setprecision(2) << 100.0 * mode.frequencyError;
  return text.str();
}

std::string modesText(const MeshAnalysis& analysis) {
  const ModalModel& model = analysis.model;
  std::ostringstream text;
  text << model.name << ": " << model.material.name << ", " << std::setprecision(4) << model.mass
       << " kg, " << model.modes.size() << (model.modes.size() == 1 ? " mode" : " modes")
       << (analysis.isFromCache ? ", from the cache" : "") << "\n\n"
       << "  mode   frequency   within    decay rate   by sound    by heat   60 dB in   radiates "
          "as\n"
       << "                Hz        %           1/s        1/s        1/s          s\n";
  text << std::fixed;
  for (std::size_t index = 0; index < model.modes.size(); ++index) {
    const Mode& mode = model.modes[index];
    const std::size_t count = mode.radiation.multipoles.size();
    const auto order = static_cast<int>(std::lround(std::sqrt(static_cast<double>(count)))) - 1;
    text << std::setw(6) << index + 1 << std::setw(12) << std::setprecision(2) << mode.frequency
         << std::setw(9) << errorText(mode) << std::setw(14) << std::setprecision(3)
         << mode.decayRate << std::setw(11) << mode.radiation.decayRate << std::setw(11)
         << mode.heatDecayRate << std::setw(11) << decayTime(mode) << "   "
         << (count == 0 ? "monopole" : "multipoles to order " + std::to_string(order)) << '\n';
  }
  text << "\nleft out: " << model.leftOut.rigid << " rigid, " << model.leftOut.below
       << " below 20 Hz, " << model.leftOut.above << " above 20 kHz or the number asked for, "
       << model.leftOut.overdamped << " overdamped\n";
  return text.str();
}

bool isOfSize(const MeshFinding& finding) {
  return finding.fault == MeshFault::tooLarge || finding.fault == MeshFault::tooSmall;
}

void warnOf(const std::string& file, const MeshFinding& finding) {
  warn(file + ": " + std::string(nameOf(finding.fault)) + ": " + finding.text);
}

// Warns of a size that is likely wrong: before the analysis, which would be in vain.
void warnOfSize(const std::string& file, const SurfaceMesh& mesh) {
  for (const MeshFinding& finding : checkMesh(mesh).findings)
    if (isOfSize(finding)) warnOf(file, finding);
}

// Warns of other findings that are no errors, but worth knowing; `sought` is the accuracy asked
// for.
void warnOf(const std::string& file, const MeshAnalysis& analysis, std::optional<double> sought) {
  for (const MeshFinding& finding : analysis.findings)
    if (!isOfSize(finding)) warnOf(file, finding);
  if (analysis.model.modes.empty())
    warn(file +
         ": no mode lies from 20 Hz to 20 kHz; is its size right? --scale says what one unit is");
  const std::optional<double> worst = worstError(analysis.model);
  if (sought && worst && *worst > *sought) {
    std::ostringstream text;
    text << file << ": the finest grid that half a minute and 4 GB allow";
    if (analysis.degreesOfFreedom)
      text << " (" << *analysis.degreesOfFreedom << " degrees of freedom)";
    text << " has errors of up to " << std::setprecision(2) << 100.0 * *worst << " %, and "
         << 100.0 * *sought << " % was asked for; --dofs takes a finer one";
    warn(text.str());
  }
  if (analysis.radiation && analysis.radiation->roughModes > 0)
    warn(file + ": the sound of " + std::to_string(analysis.radiation->roughModes) +
         " modes is rough, as it is computed on " + std::to_string(analysis.radiation->panels) +
         " panels; --panels takes more");
}

/// Returns how long an analysis may take, for who waits for it: its grids by their limit, its
/// radiation by what a mode was measured to take on 800 panels, with the cube of their number.
std::string priceOf(const MeshAnalysisSettings& settings, const SurfaceMesh& mesh) {
  constexpr double kSecondsPerMode = 0.42;
  constexpr double kMeasuredPanels = 800.0;
  std::ostringstream text;
  text << mesh.triangles.size() << " triangles";
  const SolidSettings& solid = settings.solid;
  if (settings.body == BodyModel::solid && !solid.grid.degreesOfFreedom)
    text << "; grids are refined until frequencies are within " << 100.0 * solid.accuracy
         << " %, for at most half a minute and 4 GB";
  if (settings.radiation) {
    const double seconds =
        kSecondsPerMode * static_cast<double>(solid.maxModes) *
        std::pow(static_cast<double>(settings.radiation->panels) / kMeasuredPanels, 3);
    text << "; then " << std::max(1.0, std::round(seconds)) << " s for how up to " << solid.maxModes
         << " modes radiate";
  }
  return text.str();
}

}  // namespace

ModesCommand::ModesCommand(CLI::App& app)
    : command_(app.add_subcommand(
          "modes",
          "Compute how a body rings, from its mesh\n"
          "Finds the modes of a solid or a shell of that material, their losses, and how they "
          "radiate. The model is for \"modes\" in scenes, for carom strike, and for hosts.")) {
  command_->add_option("MESH", mesh_, "OBJ, PLY, STL or glTF file (docs/meshes.md)")
      ->required()
      ->type_name("FILE");
  command_
      ->add_option(
          "--material", material_,
          "what it is made of: a name that 'carom materials' lists, or a file with its properties")
      ->required()
      ->type_name("MATERIAL|FILE.json");
  command_
      ->add_option("-o,--output", output_,
                   "model file to write; .glb or .gltf: glTF; '-' is standard output")
      ->check(fileName());
  command_->add_option("--scale", scale_, "metres in one unit of the mesh; 0.001: millimetres")
      ->check(numberRange(1e-6, 1e6, "metres"));
  CLI::Option* thickness =
      command_->add_option("--thickness", thickness_, "a shell of so many millimetres")
          ->check(numberRange(1e-3, 1e4, "millimetres"));
  command_->add_flag("--solid", solid_, "a solid body; the default")->excludes(thickness);
  command_->add_option("--springs", springs_, "of a shell: what they resist")
      ->check(oneOf({"transverse", "axial"}))
      ->needs(thickness)
      ->capture_default_str();
  CLI::Option* accuracy =
      command_
          ->add_option("--accuracy", accuracy_,
                       "of a solid: refine until frequencies are within so many percent, by their "
                       "own estimate")
          ->check(numberRange(1e-3, 50.0, "percent"))
          ->excludes(thickness)
          ->capture_default_str();
  command_->add_option("--dofs", degreesOfFreedom_, "degrees of freedom of a solid, about, instead")
      ->check(wholeNumberRange(192, 1e6))
      ->excludes(thickness)
      ->excludes(accuracy);
  command_->add_option("--modes", modes_, "at most so many")
      ->check(wholeNumberRange(1, 2000))
      ->capture_default_str();
  CLI::Option* silent = command_->add_flag("--no-radiation", noRadiation_,
                                           "leave out how they radiate: they are monopoles then");
  command_->add_option("--panels", panels_, "to compute with how they radiate")
      ->check(wholeNumberRange(100, 5000))
      ->excludes(silent)
      ->capture_default_str();
  command_->add_option("--cache", cacheFolder_, "folder of models computed before")
      ->check(folderName());
  command_->add_flag("--no-cache", noCache_, "compute it in any case");
  addResourceLimits(*command_, run_);
  command_->add_flag("--json", json_, "print one JSON object instead of text");
  command_->footer(
      "Examples:\n"
      "  carom modes scenes/library/meshes/wrench.obj --material carbon_steel -o "
      "wrench.carom_modes\n"
      "  carom modes bowl.stl --scale 0.001 --material glass --thickness 3 -o bowl.carom_modes\n"
      "  carom modes bell.glb --material bronze --modes 100 --json\n"
      "  carom modes bell.glb --material bell_metal.json");
}

bool ModesCommand::parsed() const {
  return command_->parsed();
}

int ModesCommand::run() const {
  if (!output_.empty() && output_ != kStandardOutput) {
    if (const Status kept = checkKept({{"--output", output_}}, {mesh_, material_}); !kept)
      return fail(kBadInput, kept.error().message);
    if (const Status valid = checkWritable(output_); !valid)
      return fail(kFailed, "--output: " + output_ + ": " + valid.error().message);
  }
  const Result<OutputTarget> target = OutputTarget::create(output_, "--output");
  if (!target) return fail(kBadInput, target.error().message);
  const Result<Material> material = materialOf(material_, "--material");
  if (!material) return fail(kBadInput, material.error().message);
  const Result<LoadedMesh> mesh = loadMesh(mesh_, {.scale = scale_});
  if (!mesh) return fail(kBadInput, mesh.error().message);
  warnOfSize(mesh_, mesh->surface);

  MeshAnalysisSettings settings;
  if (thickness_ > 0.0) settings.body = BodyModel::shell;
  settings.solid.accuracy = accuracy_ / 100.0;
  if (degreesOfFreedom_ > 0.0)
    settings.solid.grid.degreesOfFreedom = static_cast<std::size_t>(degreesOfFreedom_);
  settings.solid.maxModes = static_cast<Eigen::Index>(modes_);
  settings.shell.thickness = thickness_ * kMillimetre;
  settings.shell.springs = springs_ == "axial" ? ShellSprings::axial : ShellSprings::transverse;
  settings.shell.maxModes = static_cast<std::size_t>(modes_);
  if (noRadiation_)
    settings.radiation.reset();
  else
    settings.radiation->panels = static_cast<std::size_t>(panels_);

  ModelCache cache =
      cacheFolder_.empty() ? ModelCache() : ModelCache(std::filesystem::path(cacheFolder_));
  capMemory(run_.limits().memory);
  ResourceWatch watch(run_.limits());
  std::string limit;
  // A model from the cache makes no progress: it costs nothing.
  bool isPriceTold = talk().isQuiet() || talk().isJson;
  ProgressBar bar("modes of " + std::filesystem::path(mesh_).filename().string());
  Result<MeshAnalysis> analysis =
      analyseMesh(mesh->surface, *material, settings, noCache_ ? nullptr : &cache,
                  [&](std::string_view, double share) {
                    if (!std::exchange(isPriceTold, true))
                      std::fprintf(stderr, "carom: %s: %s\n", mesh_.c_str(),
                                   priceOf(settings, mesh->surface).c_str());
                    bar.show(share);
                    limit = watch.exceeded();
                    return limit.empty();
                  });
  bar.clear();
  if (!limit.empty()) return endedEarly(mesh_, watch, limit);
  if (!analysis) return fail(kBadInput, mesh_ + ": " + analysis.error().message);
  analysis->model.name = std::filesystem::path(mesh_).stem().string();
  const bool choosesGrid = degreesOfFreedom_ == 0.0 && settings.body == BodyModel::solid;
  warnOf(mesh_, *analysis, choosesGrid ? std::optional(settings.solid.accuracy) : std::nullopt);
  if (!output_.empty()) {
    if (const Status written = writeModel(target->path(), analysis->model); !written)
      return fail(kFailed, written.error().message);
    if (const Status sent = target->finish(); !sent) return fail(kFailed, sent.error().message);
  }
  return answer(json_ ? jsonText(modesJson(*analysis)) : modesText(*analysis));
}

}  // namespace carom::command
