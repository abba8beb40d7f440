#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <numeric>
#include <string>
#include <utility>

#include <Eigen/Eigenvalues>

#include "carom/modal/gltf_audio.h"

namespace carom {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;
/// Relative difference of scales between directions that a chain of nodes in floats may come to.
constexpr double kUniform = 1e-4;

GltfMassProperties massPropertiesOf(const ModalModel& model) {
  GltfMassProperties properties;
  properties.mass = model.mass;
  properties.centreOfMass = model.centreOfMass;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(model.inertia);
  // Moments of a thin body come out as rounding below 0.
  properties.inertiaDiagonal = solver.eigenvalues().cwiseMax(0.0);
  Eigen::Matrix3d axes = solver.eigenvectors();
  if (axes.determinant() < 0.0) axes.col(0) *= -1.0;
  properties.inertiaOrientation = Quat(axes).normalized();
  return properties;
}

/// Returns the undamped frequency in Hz.
double naturalFrequency(double heard, double decayRate) {
  return std::hypot(kTwoPi * heard, decayRate) / kTwoPi;
}
double heardFrequency(const Mode& mode) {
  const double omega = kTwoPi * mode.frequency;
  return std::sqrt((omega - mode.decayRate) * (omega + mode.decayRate)) / kTwoPi;
}

Material materialOf(const GltfAudio& audio, const GltfModalModel& given, const Material& fallback) {
  Material material = fallback;
  if (!given.material) return material;
  const GltfAcousticMaterial& said = audio.materials[*given.material];
  if (!said.name.empty()) material.name = said.name;
  material.density = said.density.value_or(material.density);
  material.youngsModulus = said.youngsModulus.value_or(material.youngsModulus);
  material.poissonsRatio = said.poissonRatio.value_or(material.poissonsRatio);
  material.restitution = said.restitution.value_or(material.restitution);
  material.dampingAlpha = said.alpha.value_or(material.dampingAlpha);
  material.dampingBeta = said.beta.value_or(material.dampingBeta);
  return material;
}

SurfaceMesh surfaceOf(const GltfModalModel& given, double scale) {
  SurfaceMesh surface;
  for (const Eigen::Vector3f& position : given.positions)
    surface.vertices.emplace_back(scale * position.cast<double>());
  for (std::size_t at = 0; at + 2 < given.indices.size(); at += 3)
    surface.triangles.push_back({given.indices[at], given.indices[at + 1], given.indices[at + 2]});
  return surface;
}

/// Sets mass, centre and inertia; returns why there is no mass, or nothing if there is.
std::string setMass(ModalModel& model, const GltfModalModel& given, double scale) {
  if (given.massProperties) {
    const GltfMassProperties& properties = *given.massProperties;
    const Eigen::Matrix3d axes = properties.inertiaOrientation.normalized().toRotationMatrix();
    model.mass = properties.mass;
    model.centreOfMass = scale * properties.centreOfMass;
    model.inertia = axes * properties.inertiaDiagonal.asDiagonal() * axes.transpose();
    return {};
  }
  const double volume = signedVolume(model.surface);
  if (model.surface.triangles.empty() || !closedSurface(model.surface) || !(volume > 0.0))
    return "has no massProperties, and no closed surface from which its mass would follow";
  model.mass = model.material.density * volume;
  model.centreOfMass = volumeCentroid(model.surface);
  return {};
}

void addMode(ModalModel& model, const GltfModalModel& given, std::size_t index) {
  const double decayRate = given.decayRates[index];
  const double frequency = naturalFrequency(given.frequencies[index], decayRate);
  if (frequency < kLowestMode) {
    ++model.leftOut.below;
  } else if (frequency > kHighestMode) {
    ++model.leftOut.above;
  } else if (decayRate >= kTwoPi * frequency) {
    ++model.leftOut.overdamped;
  } else {
    Mode mode{.frequency = frequency, .decayRate = decayRate, .radiation = {}};
    if (!given.volumes.empty()) mode.radiation.volume = given.volumes[index];
    model.modes.push_back(std::move(mode));
    const std::size_t points = given.positions.size();
    for (std::size_t point = 0; point < points; ++point)
      for (const float component : given.shapes[index * points + point])
        model.shapes.push_back(component);
  }
}

}  // namespace

void addModalModel(GltfAudio& audio, const ModalModel& model) {
  const Material& material = model.material;
  GltfModalModel given;
  given.name = model.name;
  given.material = audio.materials.size();
  audio.materials.push_back({material.name, material.density, material.youngsModulus,
                             material.poissonsRatio, material.dampingAlpha, material.dampingBeta,
                             material.restitution});
  given.massProperties = massPropertiesOf(model);
  given.leftOut = model.leftOut;
  // A volume without the multipoles would tell a reader that the modes radiate evenly, by that
  // alone; with neither, it computes how they do.
  const bool hasMultipoles = std::ranges::any_of(
      model.modes, [](const Mode& mode) { return !mode.radiation.multipoles.empty(); });
  for (const Mode& mode : model.modes) {
    given.frequencies.push_back(static_cast<float>(heardFrequency(mode)));
    given.decayRates.push_back(static_cast<float>(mode.decayRate));
    if (!hasMultipoles) given.volumes.push_back(mode.radiation.volume);
  }
  for (const Vec3& vertex : model.surface.vertices)
    given.positions.emplace_back(vertex.cast<float>());
  for (std::size_t at = 0; at + 2 < model.shapes.size(); at += 3)
    given.shapes.emplace_back(model.shapes[at], model.shapes[at + 1], model.shapes[at + 2]);
  for (const auto& triangle : model.surface.triangles)
    given.indices.insert(given.indices.end(), triangle.begin(), triangle.end());
  GltfAudioNode& node = audio.nodes.emplace_back();
  node.name = model.name;
  node.modalModel = audio.models.size();
  audio.models.push_back(std::move(given));
}

Result<ModalModel> toModalModel(const GltfAudio& audio, std::size_t model, double scale,
                                const Material& fallback) {
  assert(model < audio.models.size());
  const GltfModalModel& given = audio.models[model];
  const auto refuse = [&](const std::string& why) {
    return Error{"modal model " + std::to_string(model) + " '" + given.name + "': " + why};
  };
  ModalModel made;
  made.name = given.name;
  made.material = materialOf(audio, given, fallback);
  made.surface = surfaceOf(given, scale);
  made.leftOut = given.leftOut.value_or(ModesLeftOut{});
  if (const std::string why = setMass(made, given, scale); !why.empty()) return refuse(why);

  std::vector<std::size_t> order(given.frequencies.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&given](std::size_t index) {
    return naturalFrequency(given.frequencies[index], given.decayRates[index]);
  });
  for (const std::size_t index : order)
    addMode(made, given, index);
  if (const Status valid = validate(made); !valid) return refuse(valid.error().message);
  return made;
}

Result<double> uniformScale(const GltfAudioNode& node) {
  const Eigen::Matrix3d linear = node.globalTransform.topLeftCorner<3, 3>();
  const double scale = std::cbrt(std::abs(linear.determinant()));
  const Eigen::Matrix3d gram = linear.transpose() * linear;
  const double off = (gram - scale * scale * Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(scale > 0.0) || !(off <= kUniform * scale * scale))
    return Error{"node '" + node.name +
                 "' scales differently in different directions; expected one scale, since modes "
                 "cannot follow"};
  return scale;
}

}  // namespace carom
