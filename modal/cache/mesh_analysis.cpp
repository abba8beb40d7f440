#include "carom/modal/mesh_analysis.h"

#include <algorithm>
#include <string>
#include <utility>

#include <Eigen/Geometry>

#include "modal/analysis/shell_model.h"
#include "modal/analysis/solid_model.h"
#include "modal/cache/model_claim.h"
#include "modal/cache/model_key.h"
#include "modal/mesh/mesh_detail.h"
#include "modal/radiation/mode_radiation.h"

namespace carom {

using namespace modal;

namespace {

/// Raised whenever anything in modal/ gives other numbers than before.
constexpr std::uint64_t kAnalysisVersion = 8;

/// Vertices of a body's surface, beyond which it is simplified before it is put on a grid.
constexpr std::size_t kMostBodyVertices = 30000;

/// Rough share of the modes in the time of an analysis; radiation takes the rest.
constexpr double kOfModes = 0.3;

void addSolid(ModelKey& key, const SolidSettings& solid) {
  key.add(solid.accuracy)
      .add(std::uint64_t{solid.grid.degreesOfFreedom.value_or(0)})
      .add(solid.grid.cellSize.value_or(0.0))
      .add(static_cast<std::uint64_t>(solid.maxModes));
}

void addShell(ModelKey& key, const ShellSettings& shell) {
  key.add(shell.thickness)
      .add(static_cast<std::uint64_t>(shell.springs))
      .add(std::uint64_t{shell.minVertices})
      .add(std::uint64_t{shell.maxVertices})
      .add(std::uint64_t{shell.maxModes});
}

ModelKey keyOf(const SurfaceMesh& mesh, const Material& material,
               const MeshAnalysisSettings& settings) {
  ModelKey key;
  key.add("mesh analysis").add(kAnalysisVersion).add(mesh).add(material);
  key.add(static_cast<std::uint64_t>(settings.body));
  if (settings.body == BodyModel::solid)
    addSolid(key, settings.solid);
  else
    addShell(key, settings.shell);
  key.add(std::uint64_t{settings.leastVertices}).add(std::uint64_t{settings.mostVertices});
  key.add(settings.medium.density).add(settings.medium.speedOfSound);
  key.add(std::uint64_t{settings.radiation.has_value()});
  if (settings.radiation) {
    key.add(std::uint64_t{settings.radiation->panels});
    key.add(static_cast<std::uint64_t>(settings.radiation->maxOrder));
  }
  return key;
}

/// Returns the key of a model's radiation.
ModelKey keyOf(const ModalModel& model, const RadiationSettings& settings) {
  ModelKey key;
  key.add("radiation").add(kAnalysisVersion).add(model.surface).add(model.material);
  key.add(model.medium.density).add(model.medium.speedOfSound).add(model.mass);
  for (const double coordinate : model.centreOfMass)  // multipoles are about it
    key.add(coordinate);
  for (const Mode& mode : model.modes)
    key.add(mode.frequency).add(mode.decayRate);
  for (const float component : model.shapes)
    key.add(static_cast<double>(component));
  key.add(std::uint64_t{settings.panels}).add(static_cast<std::uint64_t>(settings.maxOrder));
  return key;
}

/// Maps the progress of a part of the work to its share of the whole.
Progress partOf(const Progress& progress, double begin, double end) {
  if (!progress) return {};
  return [&progress, begin, end](std::string_view stage, double fraction) {
    return progress(stage, begin + (end - begin) * fraction);
  };
}

Result<SurfaceMesh> detailed(const SurfaceMesh& mesh, const MeshAnalysisSettings& settings) {
  if (mesh.vertices.size() > settings.mostVertices) return simplified(mesh, settings.mostVertices);
  return subdividedTo(mesh, settings.leastVertices);
}

Result<MeshAnalysis> analyseAsSolid(const SurfaceMesh& surface, const Material& material,
                                    const MeshAnalysisSettings& settings,
                                    const Progress& progress) {
  if (const Status solid = needSolid(checkMesh(surface)); !solid) return solid.error();
  const Result<SurfaceMesh> fine = detailed(surface, settings);
  if (!fine) return fine.error();
  // The body keeps more of its detail than its shapes: a thin wall's thickness is in it.
  const bool isDense = surface.vertices.size() > kMostBodyVertices;
  const Result<SurfaceMesh> simpler =
      isDense ? simplified(surface, kMostBodyVertices) : Result<SurfaceMesh>(SurfaceMesh{});
  if (!simpler) return simpler.error();
  Result<SolidAnalysis> found = analyseSolid(
      {.body = isDense ? *simpler : surface, .shapes = *fine}, material, settings.solid, progress);
  if (!found) return found.error();
  MeshAnalysis analysis;
  analysis.model = std::move(found->model);
  analysis.model.leftOut.above += static_cast<std::uint32_t>(found->modesBeyond);
  analysis.degreesOfFreedom = found->degreesOfFreedom;
  analysis.reachedAccuracy = found->reachedAccuracy;
  return analysis;
}

Result<MeshAnalysis> analyseAsShell(const SurfaceMesh& surface, const Material& material,
                                    const MeshAnalysisSettings& settings,
                                    const Progress& progress) {
  Result<ModalModel> model = shellModalModel(surface, material, settings.shell, progress);
  if (!model) return model.error();
  MeshAnalysis analysis;
  analysis.degreesOfFreedom =
      (settings.shell.springs == ShellSprings::axial ? 3U : 1U) * model->surface.vertices.size();
  analysis.model = *std::move(model);
  return analysis;
}

Result<MeshAnalysis> analysed(const SurfaceMesh& mesh, const Material& material,
                              const MeshAnalysisSettings& settings, const Progress& progress) {
  const SurfaceMesh surface = mended(mesh).surface;
  const auto analyse = settings.body == BodyModel::solid ? analyseAsSolid : analyseAsShell;
  Result<MeshAnalysis> analysis =
      analyse(surface, material, settings, partOf(progress, 0.0, kOfModes));
  if (!analysis) return analysis;
  ModalModel& model = analysis->model;
  model.medium = settings.medium;
  if (model.modes.empty()) return analysis;
  if (!settings.radiation) {
    findVolumes(model);
    return analysis;
  }
  const Result<RadiationReport> radiation =
      computeRadiation(model, *settings.radiation, partOf(progress, kOfModes, 1.0));
  if (!radiation) return radiation.error();
  analysis->radiation = *radiation;
  addRadiationDamping(model);
  return analysis;
}

std::filesystem::path folderOf(const ModelCache* cache) {
  return cache == nullptr ? std::filesystem::path() : cache->folder();
}

}  // namespace

Result<MeshAnalysis> analyseMesh(const SurfaceMesh& mesh, const Material& material,
                                 const MeshAnalysisSettings& settings, ModelCache* cache,
                                 const Progress& progress) {
  MeshReport report = checkMesh(mesh);
  for (const MeshFault fault : {MeshFault::empty, MeshFault::badIndex, MeshFault::notFinite})
    if (const MeshFinding* finding = report.find(fault)) return Error{finding->text};
  const ModelKey key = keyOf(mesh, material, settings);
  const auto fromCache = [&]() -> std::optional<MeshAnalysis> {
    std::optional<ModalModel> known = cache == nullptr ? std::nullopt : cache->find(key);
    if (!known) return std::nullopt;
    MeshAnalysis analysis;
    analysis.model = *std::move(known);
    analysis.findings = std::move(report.findings);
    analysis.isFromCache = true;
    return analysis;
  };
  if (auto known = fromCache()) return *std::move(known);
  const ModelClaim claim(folderOf(cache), key, progress);
  if (claim.isCancelled()) return Error{kCancelled};
  if (auto known = fromCache()) return *std::move(known);
  Result<MeshAnalysis> analysis = analysed(mesh, material, settings, progress);
  if (!analysis) return analysis;
  analysis->findings = std::move(report.findings);
  if (cache != nullptr) (void)cache->store(key, analysis->model);
  return analysis;
}

bool hasRadiation(const ModalModel& model) {
  return std::ranges::any_of(model.modes, [](const Mode& mode) {
    return mode.radiation.volume != 0.0 || !mode.radiation.multipoles.empty();
  });
}

Status addRadiation(ModalModel& model, const RadiationSettings& settings, ModelCache* cache,
                    const Progress& progress) {
  if (model.modes.empty() || hasRadiation(model)) return std::monostate{};
  if (model.surface.triangles.empty())
    return Error{
        "the model does not say how its modes radiate, and has no triangles to compute it from, so "
        "they would not be heard; expected triangles of its positions (\"indices\")"};
  const ModelKey key = keyOf(model, settings);
  const auto isKnown = [&] {
    std::optional<ModalModel> known = cache == nullptr ? std::nullopt : cache->find(key);
    if (known) model.modes = std::move(known->modes);
    return known.has_value();
  };
  if (isKnown()) return std::monostate{};
  const ModelClaim claim(folderOf(cache), key, progress);
  if (claim.isCancelled()) return Error{kCancelled};
  if (isKnown()) return std::monostate{};
  const Result<RadiationReport> radiation = computeRadiation(model, settings, progress);
  if (!radiation) return radiation.error();
  for (Mode& mode : model.modes)
    mode.radiation.decayRate = std::min(radiatedDecay(mode, model.medium), mode.decayRate);
  if (cache != nullptr) (void)cache->store(key, model);
  return std::monostate{};
}

}  // namespace carom
