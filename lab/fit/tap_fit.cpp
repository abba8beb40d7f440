#include "lab/fit/tap_fit.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "lab/fit/body_fit.h"
#include "lab/fit/body_variants.h"
#include "lab/fit/wall_thickness.h"

#include "carom/modal/mesh_analysis.h"

namespace carom::lab {

namespace {

constexpr double kSlowestSound = 250.0;    // m/s, sqrt(E / density) of cork, about
constexpr double kFastestSound = 14000.0;  // m/s, more than diamond's in all but a few directions
constexpr double kStartRange = 4.0;        // of Young's modulus, around one that is known
constexpr double kAnalysedSound =
    1500.0;  // m/s: a soft body, none of whose modes is out of hearing
constexpr double kUsualPoisson = 0.28;
constexpr double kPoissonSpread = 0.1;  // of all solids, about 0.3
constexpr double kKnownPoissonSpread = 0.05;
constexpr double kClearDecay = 22.0;  // dB above the noise, for a decay to count
constexpr double kConfidentDecay = 0.45;
constexpr double kLeastMaterialShare = 0.1;  // of a decay, where the radiation computed is more
constexpr double kThinWall = 0.5;            // of the largest extent: more is no wall
/// Standard deviations above chance, in addition: more walls are tried, and one of them fits best.
constexpr double kFreeWallDistance = 1.5;
constexpr double kFinalRange = 0.03;  // of log factor, of the last match

double undamped(const TapMode& mode) {
  return std::hypot(mode.frequency, mode.decayRate / (2.0 * std::numbers::pi));
}

/// Returns the start with its density: given, or by mass and volume, or its own.
Material startOf(const SurfaceMesh& mesh, const TapFitSettings& settings) {
  Material material = settings.start;
  if (settings.density) material.density = *settings.density;
  if (settings.mass) material.density = *settings.mass / signedVolume(mesh);
  return material;
}

double extentOf(const SurfaceMesh& mesh) {
  Vec3 low = Vec3::Constant(1e300);
  Vec3 high = Vec3::Constant(-1e300);
  for (const Vec3& vertex : mesh.vertices) {
    low = low.cwiseMin(vertex);
    high = high.cwiseMax(vertex);
  }
  return mesh.vertices.empty() ? 0.0 : (high - low).maxCoeff();
}

/// Sets the bounds of the factor of frequencies, from the analysed material to any that is allowed.
void setFactorRange(ModeMatchSettings& match, const Material& start, const Material& analysed,
                    const TapFitSettings& settings) {
  const double sound = std::sqrt(analysed.youngsModulus / analysed.density);
  match.leastFactor = kSlowestSound / sound;
  match.mostFactor = kFastestSound / sound;
  if (!settings.isStartKnown || settings.freeScale) return;
  const double own = std::sqrt(start.youngsModulus / analysed.youngsModulus);
  match.leastFactor = own / std::sqrt(kStartRange);
  match.mostFactor = own * std::sqrt(kStartRange);
}

/// Returns the scale at which a body of the start's modulus has frequencies `factor` times those
/// analysed: frequencies fall with the size, and with the root of the density, which falls with its
/// cube where the mass is given, and with the walls' thickness: `thinner` is the mesh's volume over
/// that with the fitted walls.
double scaleOf(double factor, const Material& start, const Material& analysed,
               std::optional<double> thinner) {
  const double stiffer = std::sqrt(start.youngsModulus / analysed.youngsModulus);
  return thinner ? std::pow(factor / stiffer, 2.0) * *thinner : stiffer / factor;
}

SurfaceMesh scaledMesh(SurfaceMesh mesh, double scale) {
  for (Vec3& vertex : mesh.vertices)
    vertex *= scale;
  return mesh;
}

SurfaceMesh walledMesh(const SurfaceMesh& mesh, const BodyFit& body) {
  return body.variant.wall == 0.0 ? mesh : thickened(mesh, body.variant.wall);
}

/// Sets the material and the scale from the fitted body. `thinner` is the mesh's volume over that
/// with the fitted walls, where the mass is given, of which the start has the mesh's density.
void setBody(TapFit& fit, const BodyFit& body, const Material& start, const Material& analysed,
             const TapFitSettings& settings, std::optional<double> thinner) {
  fit.material = start;
  fit.material.poissonsRatio = body.variant.poissonsRatio;
  fit.isPoissonFitted = body.isPoissonFitted;
  fit.poissonError = body.poissonError;
  fit.thicknessError = body.wallError;
  fit.residual = body.residual;
  fit.material.density *= thinner.value_or(1.0);
  if (settings.freeScale) {
    fit.modulusError = (thinner ? 6.0 : 3.0) * body.factorError;
    fit.scale = scaleOf(body.factor, start, analysed, thinner);
    if (thinner) fit.material.density /= std::pow(fit.scale, 3.0);
  } else {
    fit.modulusError = 2.0 * body.factorError;
    fit.material.youngsModulus =
        analysed.youngsModulus * body.factor * body.factor * thinner.value_or(1.0);
  }
}

/// Returns what the material's damping is at modes that were matched, of all of them or of those
/// that are clear.
std::vector<MeasuredDecay> decaysOf(const TapFit& fit, bool isClearOnly) {
  std::vector<MeasuredDecay> decays;
  for (const FittedMode& mode : fit.modes) {
    const bool isClear =
        mode.measured.overNoise >= kClearDecay && mode.measured.confidence >= kConfidentDecay;
    if (!mode.index || (isClearOnly && !isClear)) continue;
    const double measured = mode.measured.decayRate;
    const double known = *mode.radiationDecay + fit.model.modes[*mode.index].heatDecayRate;
    const double rest = std::max(measured - known, kLeastMaterialShare * measured);
    const double error = mode.measured.decayError / measured;
    // A decay that is mostly radiation, or heat that flows, says little of the law.
    const double share = rest / measured;
    decays.push_back(
        {undamped(mode.measured), rest, share * share / (0.05 * 0.05 + error * error)});
  }
  return decays;
}

/// Fits the law of damping to the modes that are clear enough, or to all if none is.
void setDampingOf(TapFit& fit) {
  std::vector<MeasuredDecay> decays = decaysOf(fit, true);
  if (decays.empty()) decays = decaysOf(fit, false);
  if (decays.empty()) return;  // the material that it began with keeps its own
  fit.damping = fitDamping(decays);
  setDamping(fit.material, fit.damping.law);
}

/// Sets beside each mode of the tap what was computed for it.
void setModes(TapFit& fit, const std::vector<TapMode>& measured) {
  fit.modes.clear();
  for (std::size_t mode = 0; mode < measured.size(); ++mode) {
    FittedMode fitted;
    fitted.measured = measured[mode];
    fitted.index = fit.match.computed[mode];
    if (fitted.index) {
      const Mode& computed = fit.model.modes[*fitted.index];
      fitted.computed = computed.frequency;
      fitted.radiationDecay = computed.radiation.decayRate;
    }
    fit.modes.push_back(fitted);
  }
}

/// Puts the modes of a model in the order of their frequencies again.
void sortModes(ModalModel& model, std::vector<FittedMode>& fitted) {
  std::vector<std::size_t> order(model.modes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {},
                           [&](std::size_t mode) { return model.modes[mode].frequency; });
  const ModalModel before = model;
  const std::size_t numbers = 3 * model.surface.vertices.size();
  std::vector<std::size_t> place(order.size());
  for (std::size_t to = 0; to < order.size(); ++to) {
    place[order[to]] = to;
    model.modes[to] = before.modes[order[to]];
    std::copy_n(before.shapes.begin() + static_cast<std::ptrdiff_t>(order[to] * numbers), numbers,
                model.shapes.begin() + static_cast<std::ptrdiff_t>(to * numbers));
  }
  for (FittedMode& mode : fitted) {
    if (mode.index) mode.index = place[*mode.index];
  }
}

/// Gives the model the fitted damping, and the modes that were measured their own frequencies and
/// decays.
void setModel(TapFit& fit) {
  fit.model.material = fit.material;
  for (Mode& mode : fit.model.modes)
    mode.decayRate =
        fit.damping.law.decayRate(mode.frequency) + mode.radiation.decayRate + mode.heatDecayRate;
  for (FittedMode& mode : fit.modes) {
    if (!mode.index) continue;
    Mode& own = fit.model.modes[*mode.index];
    mode.computedDecay = own.decayRate;
    own.frequency = std::clamp(undamped(mode.measured), kLowestMode, kHighestMode);
    own.decayRate = mode.measured.decayRate;
    own.radiation.decayRate = std::min(own.radiation.decayRate, own.decayRate);
    own.heatDecayRate = std::min(own.heatDecayRate, own.decayRate);
  }
  sortModes(fit.model, fit.modes);
}

/// Computes the fitted body, with radiation, and matches it once more.
Status computeBody(TapFit& fit, const SurfaceMesh& mesh, const BodyFit& body,
                   const std::vector<TapMode>& measured, const TapFitSettings& settings,
                   ModelCache* cache, const Progress& progress) {
  Material undampedMaterial = fit.material;
  setDamping(undampedMaterial, {});
  MeshAnalysisSettings analysis;
  analysis.radiation = settings.radiation;
  const SurfaceMesh surface = scaledMesh(walledMesh(mesh, body), fit.scale);
  Result<MeshAnalysis> made = analyseMesh(surface, undampedMaterial, analysis, cache, progress);
  if (!made) return made.error();
  fit.model = std::move(made->model);
  ModeMatchSettings last;
  last.leastFactor = std::exp(-kFinalRange);
  last.mostFactor = std::exp(kFinalRange);
  last.scrambles = 0;
  ModeMatch match = matchModes(measured, linesOfModel(fit.model), last);
  match.chanceScore = fit.match.chanceScore;
  match.chanceDistance = fit.match.chanceDistance;
  fit.match = std::move(match);
  fit.accepted = fit.match.accepted;
  fit.reason = fit.match.reason;
  const double thickness = wallThickness(surface);
  if (thickness < kThinWall * extentOf(surface)) fit.thickness = thickness;
  fit.thicknessError *= fit.scale;
  return std::monostate{};
}

}  // namespace

Result<TapFit> fitTap(const std::vector<TapMode>& measured, const SurfaceMesh& mesh,
                      const TapFitSettings& settings, ModelCache* cache, const Progress& progress) {
  const Material start = startOf(mesh, settings);
  Material analysed = start;
  analysed.youngsModulus = kAnalysedSound * kAnalysedSound * analysed.density;
  analysed.thermal = {};
  const std::size_t most = std::clamp<std::size_t>(3 * measured.size() / 2 + 10, 20, 60);
  const BodyVariants variants(mesh, analysed, most, cache, progress);
  BodyFitSettings bodySettings;
  bodySettings.start.poissonsRatio =
      settings.isStartKnown ? std::clamp(start.poissonsRatio, 0.02, 0.47) : kUsualPoisson;
  bodySettings.poissonSpread = settings.isStartKnown ? kKnownPoissonSpread : kPoissonSpread;
  bodySettings.freeThickness = settings.freeThickness;
  bodySettings.wallThickness = settings.freeThickness ? wallThickness(mesh) : 0.0;
  setFactorRange(bodySettings.match, start, analysed, settings);
  if (settings.freeThickness) bodySettings.match.leastDistance += kFreeWallDistance;
  const Result<BodyFit> body = fitBody(measured, variants, bodySettings);
  if (!body) return body.error();
  TapFit fit;
  fit.match = body->match;
  fit.reason = body->match.reason;
  std::optional<double> thinner;
  if (settings.mass) thinner = signedVolume(mesh) / signedVolume(walledMesh(mesh, *body));
  setBody(fit, *body, start, analysed, settings, thinner);
  if (!body->match.accepted) {
    for (const TapMode& mode : measured)
      fit.modes.push_back({mode, {}, {}, {}, {}});
    return fit;
  }
  if (const Status computed = computeBody(fit, mesh, *body, measured, settings, cache, progress);
      !computed)
    return computed.error();
  setModes(fit, measured);
  setDampingOf(fit);
  setModel(fit);
  return fit;
}

}  // namespace carom::lab
