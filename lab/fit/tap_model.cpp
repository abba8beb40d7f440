#include "lab/fit/tap_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <numbers>
#include <string>
#include <utility>

#include "carom/audio/surface_mesh.h"

namespace carom::lab {

namespace {

constexpr double kMostRadiated = 0.1;  // of a mode's decay
constexpr int kSplits = 3;             // of an octahedron: 258 vertices

/// Returns the mesh of a ball: an octahedron, each of whose triangles becomes four that often.
SurfaceMesh ballMesh(double radius) {
  SurfaceMesh mesh;
  mesh.vertices = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                    {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int split = 0; split < kSplits; ++split) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t from, std::uint32_t to) {
      const auto next = static_cast<std::uint32_t>(mesh.vertices.size());
      const auto added = middles.try_emplace(std::minmax(from, to), next);
      if (added.second)
        mesh.vertices.push_back((mesh.vertices[from] + mesh.vertices[to]).normalized());
      return added.first->second;
    };
    std::vector<std::array<std::uint32_t, 3>> finer;
    for (const auto& corner : mesh.triangles) {
      const std::array<std::uint32_t, 3> between = {
          middle(corner[0], corner[1]), middle(corner[1], corner[2]), middle(corner[2], corner[0])};
      finer.push_back({corner[0], between[0], between[2]});
      finer.push_back({corner[1], between[1], between[0]});
      finer.push_back({corner[2], between[2], between[1]});
      finer.push_back(between);
    }
    mesh.triangles = std::move(finer);
  }
  for (Vec3& vertex : mesh.vertices)
    vertex *= radius;
  return mesh;
}

/// Returns the volumes of the modes (m^2 / sqrt(kg)) up to a common factor: a blow gives each mode
/// the velocity shape . j, whose pressure is that times w and the volume.
std::vector<double> relativeVolumes(const std::vector<TapMode>& modes) {
  std::vector<double> volumes;
  volumes.reserve(modes.size());
  for (const TapMode& mode : modes)
    volumes.push_back(std::pow(10.0, mode.level / 20.0) / mode.frequency);
  return volumes;
}

/// The decay rate (1/s) by which a monopole of that volume loses its energy: power
/// rho w^4 V^2 Q^2 / (8 pi c) over twice the energy w^2 Q^2 / 2.
double monopoleDecay(const Mode& mode, const Medium& medium) {
  const double w = 2.0 * std::numbers::pi * mode.frequency;
  const double volume = mode.radiation.volume;
  return medium.density * w * w * volume * volume / (8.0 * std::numbers::pi * medium.speedOfSound);
}

void setVolumes(ModalModel& model, const std::vector<double>& relative, double radius) {
  const double breathing = 4.0 * std::numbers::pi * radius * radius / std::sqrt(model.mass);
  double factor = breathing / *std::ranges::max_element(relative);
  for (std::size_t mode = 0; mode < model.modes.size(); ++mode) {
    Mode& one = model.modes[mode];
    one.radiation.volume = relative[mode];
    const double most = kMostRadiated * one.decayRate / monopoleDecay(one, model.medium);
    factor = std::min(factor, std::sqrt(most));
  }
  for (Mode& mode : model.modes) {
    mode.radiation.volume *= factor;
    mode.radiation.decayRate = std::min(monopoleDecay(mode, model.medium), mode.decayRate);
  }
}

DampingFit dampingOf(const std::vector<TapMode>& modes) {
  std::vector<MeasuredDecay> decays;
  for (const TapMode& mode : modes) {
    const double error = mode.decayError / mode.decayRate;
    decays.push_back(
        {mode.frequency, mode.decayRate, mode.confidence / (0.05 * 0.05 + error * error)});
  }
  return fitDamping(decays);
}

}  // namespace

Result<TapModel> modelOfTap(const std::vector<TapMode>& modes, const TapModelSettings& settings) {
  std::vector<TapMode> audible;
  for (const TapMode& mode : modes) {
    if (mode.frequency >= kLowestMode && mode.frequency <= kHighestMode) audible.push_back(mode);
  }
  if (audible.empty()) return Error{"no mode of the tap lies from 20 Hz to 20 kHz"};
  TapModel made;
  made.damping = dampingOf(audible);
  ModalModel& model = made.model;
  model.material = settings.material;
  setDamping(model.material, made.damping.law);
  model.mass = settings.mass;
  const double sphere = 4.0 / 3.0 * std::numbers::pi;
  const double radius = settings.radius > 0.0
                            ? settings.radius
                            : std::cbrt(settings.mass / (sphere * settings.material.density));
  model.surface = ballMesh(radius);
  model.inertia = 0.4 * settings.mass * radius * radius * Eigen::Matrix3d::Identity();
  for (const TapMode& tap : audible) {
    Mode mode;
    mode.frequency = std::clamp(std::hypot(tap.frequency, tap.decayRate / (2.0 * std::numbers::pi)),
                                kLowestMode, kHighestMode);
    mode.decayRate = tap.decayRate;
    model.modes.push_back(mode);
    for (const Vec3& vertex : model.surface.vertices) {
      const Vec3 shape = vertex.normalized() / std::sqrt(settings.mass);
      for (Eigen::Index axis = 0; axis < 3; ++axis)
        model.shapes.push_back(static_cast<float>(shape(axis)));
    }
  }
  setVolumes(model, relativeVolumes(audible), radius);
  if (const Status valid = validate(model); !valid) return valid.error();
  return made;
}

}  // namespace carom::lab
