#include "command/fit_command.h"

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <iterator>
#include <optional>
#include <sstream>
#include <string_view>
#include <utility>

#include "command/command_line.h"
#include "command/output/kept_inputs.h"
#include "command/output/output_target.h"
#include "command/progress_bar.h"
#include "lab/fit/fit_files.h"
#include "lab/fit/tap_fit.h"
#include "lab/fit/tap_model.h"
#include "lab/fit/tap_modes.h"
#include "lab/fit/tap_recording.h"
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "carom/modal/mesh_file.h"
#include "carom/modal/model_cache.h"

namespace carom::command {

namespace fs = std::filesystem;
using namespace scenes;
using namespace lab;

namespace {

constexpr const char* kUnknownStart = "ceramic";  // in the middle, between wood and steel

std::vector<std::string> wordsOf(const std::string& list) {
  std::vector<std::string> words;
  std::istringstream stream(list);
  for (std::string word; std::getline(stream, word, ',');)
    words.push_back(word);
  return words;
}

bool hasWord(const std::string& list, std::string_view word) {
  const std::vector<std::string> words = wordsOf(list);
  return std::ranges::find(words, word) != words.end();
}

CLI::Validator freeWords() {
  const auto check = [](const std::string& text) -> std::string {
    const std::vector<std::string> words = wordsOf(text);
    for (const std::string& word : words) {
      if (word != "thickness" && word != "scale")
        return "'" + word + "' cannot be free; expected thickness, scale, or thickness,scale";
    }
    return words.empty() ? "nothing is named; expected thickness, scale, or thickness,scale" : "";
  };
  return {check, "thickness|scale", "either, or both with a comma"};
}

}  // namespace

FitCommand::FitCommand(CLI::App& app)
    : command_(app.add_subcommand(
          "fit",
          "Find what an object is made of, and how it rings, by taps\n"
          "Reads the modes of a sound and fits what the object is made of: with its mesh the "
          "material, the model and the error; without it a model of the modes alone.")) {
  command_->add_option("TAP", taps_, "sound files, WAV or FLAC, of taps on one object")
      ->required()
      ->type_name("FILE.wav");
  addBody();
  command_->add_option("-o,--output", output_, "folder for material, model, table, picture, page")
      ->check(folderName());
  command_->add_option("--cache", cacheFolder_, "folder of models computed before")
      ->check(folderName());
  command_->add_flag("--no-cache", noCache_, "compute it in any case");
  addResourceLimits(*command_, run_);
  command_->add_flag("--json", json_, "print one JSON object instead of text");
  command_->footer(
      "Examples:\n"
      "  carom fit bowl.wav --mesh bowl.stl --scale 0.001 --mass 0.214 -o bowl\n"
      "  carom fit near.wav far.wav --mesh bar.obj --material aluminium --json\n"
      "  carom fit cup.wav --mesh cup.stl --material ceramic --free thickness -o cup\n"
      "  carom fit spanner.wav --mass 0.3 --material carbon_steel -o spanner");
}

void FitCommand::addBody() {
  CLI::Option* mesh =
      command_
          ->add_option("--mesh", mesh_,
                       "its shape: OBJ, PLY, STL or glTF file; without it, the modes of the "
                       "tap alone, with --mass")
          ->type_name("FILE");
  command_
      ->add_option(
          "--material", material_,
          "what it may be made of: a name that 'carom materials' lists, or a file; Young's modulus "
          "is looked for within a factor of 4 of its own")
      ->type_name("MATERIAL|FILE.json");
  command_->add_option("--free", free_, "what else may differ from the mesh")
      ->check(freeWords())
      ->needs(mesh);
  command_->add_option("--scale", scale_, "metres in one unit of the mesh; 0.001: millimetres")
      ->check(numberRange(1e-6, 1e6, "metres"))
      ->needs(mesh);
  CLI::Option* density = command_->add_option("--density", density_, "of the object")
                             ->check(numberRange(1e-3, 1e5, "kg/m^3"));
  command_->add_option("--mass", mass_, "of the object, weighed")
      ->check(numberRange(1e-9, 1e9, "kilograms"))
      ->excludes(density);
  command_->add_option("--radius", radius_, "of the ball that stands for it without a mesh")
      ->check(numberRange(1e-4, 1e3, "metres"))
      ->excludes(mesh);
  command_->add_option("--panels", panels_, "to compute with how modes radiate")
      ->check(wholeNumberRange(100, 5000))
      ->capture_default_str();
}

bool FitCommand::parsed() const {
  return command_->parsed();
}

Status FitCommand::checkOptions() const {
  if (mesh_.empty() && !(mass_ > 0.0))
    return Error{"without --mesh the mass of the object is needed; expected --mass KG"};
  if (hasWord(free_, "scale") && material_.empty())
    return Error{
        "--free scale: Young's modulus and size change all frequencies alike; expected --material, "
        "whose modulus is kept then"};
  if (Status valid =
          refuseStandardOutput(output_, "--output", "a fit is several files; expected a folder");
      !valid)
    return valid;
  if (!output_.empty() && fs::exists(output_) && !fs::is_directory(output_))
    return Error{"--output: " + output_ + " is a file; expected the name of a folder"};
  if (!output_.empty()) return checkKept();
  return std::monostate{};
}

/// Refuses a folder in which a file that is written would take the place of one that is read.
Status FitCommand::checkKept() const {
  std::vector<fs::path> read(taps_.begin(), taps_.end());
  read.insert(read.end(), {mesh_, material_});
  std::vector<WrittenFile> written;
  written.reserve(kFitFiles.size());
  for (const char* const name : kFitFiles)
    written.push_back({"--output", fs::path(output_) / name});
  return command::checkKept(written, read);
}

Result<Material> FitCommand::startMaterial() const {
  return materialOf(material_.empty() ? kUnknownStart : material_, "--material");
}

int FitCommand::readTaps(FitOutcome& outcome, ResourceWatch& watch) const {
  std::string limit;
  for (const std::string& file : taps_) {
    if (limit = watch.exceeded(); !limit.empty()) return endedEarly(file, watch, limit);
    const Result<TapRecording> recording = readTap(file);
    if (!recording) return fail(kBadInput, recording.error().message);
    Result<std::vector<TapSegment>> taps = tapsOf(*recording);
    if (!taps) return fail(kBadInput, taps.error().message);
    std::ranges::move(*taps, std::back_inserter(outcome.taps));
    outcome.files.push_back(file);
  }
  ProgressBar bar("listening to " + fs::path(taps_.front()).filename().string());
  Result<TapModes> found = tapModes(outcome.taps, {}, [&](std::string_view stage, double share) {
    bar.show(share, std::string(stage));
    limit = watch.exceeded();
    return limit.empty();
  });
  bar.clear();
  if (!limit.empty()) return endedEarly(taps_.front(), watch, limit);
  if (!found) return fail(kBadInput, taps_.front() + ": " + found.error().message);
  outcome.found = *std::move(found);
  return kDone;
}

int FitCommand::fitMesh(FitOutcome& outcome, ResourceWatch& watch) const {
  const Result<Material> start = startMaterial();
  if (!start) return fail(kBadInput, start.error().message);
  const Result<LoadedMesh> mesh = loadMesh(mesh_, {.scale = scale_});
  if (!mesh) return fail(kBadInput, mesh.error().message);
  if (!closedSurface(mesh->surface) || !(signedVolume(mesh->surface) > 0.0))
    return fail(kBadInput, mesh_ +
                               ": the surface is not closed, so that it has no inside; expected "
                               "the mesh of a solid, with both sides of its walls");
  TapFitSettings settings;
  settings.start = *start;
  settings.isStartKnown = !material_.empty();
  if (density_ > 0.0) settings.density = density_;
  if (mass_ > 0.0) settings.mass = mass_;
  settings.freeThickness = outcome.isThicknessFree;
  settings.freeScale = hasWord(free_, "scale");
  settings.radiation.panels = static_cast<std::size_t>(panels_);
  ModelCache cache = cacheFolder_.empty() ? ModelCache() : ModelCache(fs::path(cacheFolder_));
  std::string limit;
  ProgressBar bar("fitting " + fs::path(mesh_).filename().string());
  Result<TapFit> fit =
      fitTap(outcome.found.modes, mesh->surface, settings, noCache_ ? nullptr : &cache,
             [&](std::string_view stage, double share) {
               bar.show(share, std::string(stage));
               limit = watch.exceeded();
               return limit.empty();
             });
  bar.clear();
  if (!limit.empty()) return endedEarly(mesh_, watch, limit);
  if (!fit) return fail(kBadInput, mesh_ + ": " + fit.error().message);
  fit->model.name = outcome.name;
  outcome.fit = *std::move(fit);
  return kDone;
}

int FitCommand::modelAlone(FitOutcome& outcome) const {
  const Result<Material> start = startMaterial();
  if (!start) return fail(kBadInput, start.error().message);
  TapModelSettings settings{*start, mass_, radius_};
  if (density_ > 0.0) settings.material.density = density_;
  Result<TapModel> alone = modelOfTap(outcome.found.modes, settings);
  if (!alone) return fail(kBadInput, taps_.front() + ": " + alone.error().message);
  alone->model.name = outcome.name;
  outcome.alone = *std::move(alone);
  return kDone;
}

int FitCommand::run() const {
  if (const Status valid = checkOptions(); !valid) return fail(kBadInput, valid.error().message);
  capMemory(run_.limits().memory);
  FitOutcome outcome;
  outcome.name = fs::path(mesh_.empty() ? taps_.front() : mesh_).stem().string();
  outcome.isDensityKnown = !material_.empty() || density_ > 0.0 || mass_ > 0.0;
  outcome.isThicknessFree = hasWord(free_, "thickness");
  const std::string named = material_.empty() ? kUnknownStart : material_;
  if (findMaterial(named) != nullptr) outcome.builtIn = named;
  ResourceWatch watch(run_.limits());
  if (const int code = readTaps(outcome, watch); code != kDone) return code;
  if (const int code = mesh_.empty() ? modelAlone(outcome) : fitMesh(outcome, watch); code != kDone)
    return code;
  const bool isRefused = outcome.fit && !outcome.fit->accepted;
  if (!isRefused && !output_.empty()) {
    if (const Status written = writeFit(output_, outcome); !written)
      return fail(kFailed, written.error().message);
  }
  if (const int code = answer(json_ ? jsonText(fitJson(outcome)) : fitText(outcome)); code != kDone)
    return code;
  return isRefused ? fail(kBadInput, taps_.front() + " does not belong to " + mesh_ + ": " +
                                         outcome.fit->reason)
                   : kDone;
}

}  // namespace carom::command
