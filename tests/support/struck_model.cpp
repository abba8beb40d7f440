#include "tests/support/struck_model.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <map>
#include <numbers>
#include <utility>

#include "modal/analysis/solid_model.h"
#include "modal/radiation/mode_radiation.h"
#include "tests/audio/meshes.h"
#include "tests/support/constants.h"

namespace carom::test {

using namespace modal;

namespace {

using Eigen::Index;

template <class T>
T valueOf(Result<T> result) {
  if (!result) std::abort();
  return *std::move(result);
}

double seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// Vector area of each vertex in m^2: the integral of the outward normal, for displacements that are
// linear between the vertices.
std::vector<Vec3> vertexAreas(const SurfaceMesh& mesh) {
  std::vector<Vec3> areas(mesh.vertices.size(), Vec3::Zero());
  for (const auto& [first, second, third] : mesh.triangles) {
    const Vec3& at = mesh.vertices[first];
    const Vec3 sixth = (mesh.vertices[second] - at).cross(mesh.vertices[third] - at) / 6.0;
    for (const std::uint32_t corner : {first, second, third})
      areas[corner] += sixth;
  }
  return areas;
}

std::uint32_t farthest(const SurfaceMesh& mesh, const Vec3& side) {
  const auto found = std::ranges::max_element(mesh.vertices, {},
                                              [&](const Vec3& vertex) { return vertex.dot(side); });
  return static_cast<std::uint32_t>(found - mesh.vertices.begin());
}

// Few panels are enough, as the volume velocity does not depend on them and monopoles need no more.
std::shared_ptr<const ModalModel> withVolumes(ModalModel model) {
  static_cast<void>(valueOf(computeRadiation(model, {.panels = 100, .maxOrder = 0})));
  return std::make_shared<const ModalModel>(std::move(model));
}

// Returns forces on the nodes of a grid that are forces on a point of the body.
void addForce(Eigen::VectorXd& forces, const SplineMesh& grid, const Vec3& at, const Vec3& force) {
  const CellPoint point = locate(grid, at);
  for (std::size_t function = 0; function < point.weights.size(); ++function)
    forces.segment<3>(3 * static_cast<Index>(grid.cells[point.cell].nodes[function])) +=
        point.weights[function] * force;
}

}  // namespace

StruckModel struckShell(const SurfaceMesh& mesh, const Material& material,
                        const ShellSettings& settings, const Vec3& side) {
  const ShellNetwork network = valueOf(shellNetwork(mesh, material, settings));
  const std::vector<Vec3> areas = vertexAreas(network.surface);
  const bool axial = settings.springs == ShellSprings::axial;
  const Index perVertex = axial ? 3 : 1;
  StruckModel body;
  body.vertex = farthest(network.surface, side);
  body.inward = -network.normals[body.vertex];
  DrivenBody& direct = body.direct;
  direct = {
      .stiffness = network.stiffness, .alpha = material.dampingAlpha, .beta = material.dampingBeta};
  const Index rows = network.stiffness.rows();
  Eigen::VectorXd masses(rows);
  direct.push = direct.flow = Eigen::VectorXd::Zero(rows);
  for (std::size_t vertex = 0; vertex < areas.size(); ++vertex) {
    const Index row = perVertex * static_cast<Index>(vertex);
    const Vec3& normal = network.normals[vertex];
    masses.segment(row, perVertex).setConstant(network.masses[static_cast<Index>(vertex)]);
    const bool hit = vertex == body.vertex;
    if (axial) {
      direct.flow.segment<3>(row) = areas[vertex];
      if (hit) direct.push.segment<3>(row) = body.inward;
    } else {
      direct.flow[row] = areas[vertex].dot(normal);
      if (hit) direct.push[row] = body.inward.dot(normal);
    }
  }
  if (!axial) direct.push -= masses * (direct.push.sum() / masses.sum());
  direct.mass = masses.asDiagonal().toDenseMatrix().sparseView();
  const double start = seconds();
  ModalModel model = valueOf(shellModalModel(mesh, material, settings));
  body.analysisTime = seconds() - start;
  body.model = withVolumes(std::move(model));
  return body;
}

StruckModel struckBox(const Vec3& half, const Material& material, std::size_t degreesOfFreedom,
                      const Vec3& side) {
  SolidSettings settings;
  settings.grid.degreesOfFreedom = degreesOfFreedom;
  settings.maxModes = 2000;
  SurfaceMesh skin = boxMesh(half);
  for (int split = 0; split < 4; ++split)
    skin = splitMesh(skin);
  SolidSystem system = valueOf(solidSystem(skin, material, settings.grid));
  StruckModel body;
  body.vertex = farthest(skin, side);
  body.inward = -Vec3::UnitZ();
  const Index rows = system.stiffness.rows();
  body.direct = {.mass = system.mass,
                 .stiffness = system.stiffness,
                 .alpha = material.dampingAlpha,
                 .beta = material.dampingBeta,
                 .push = Eigen::VectorXd::Zero(rows),
                 .flow = system.pull};
  addForce(body.direct.push, system.grid, skin.vertices[body.vertex], body.inward);
  const double start = seconds();
  ModalModel model = valueOf(solidModalModel(skin, material, settings));
  body.analysisTime = seconds() - start;
  body.model = withVolumes(std::move(model));
  return body;
}

BallStrike strikeOf(const StruckModel& body) {
  return {.ball = *findMaterial("steel"),
          .body = body.model->material,
          .at = body.model->surface.vertices[body.vertex] - body.model->centreOfMass,
          .inward = body.inward,
          .time = kStrikeTime};
}

std::vector<double> modalSound(const StruckModel& body, std::size_t frames) {
  const BallStrike strike = strikeOf(body);
  SynthSettings settings;
  settings.ringingContact = RingingContact::pressed;  // by a force that is given
  settings.modalRadiation = ModalRadiation::monopole;
  settings.audibleThreshold = 0.0;
  Synth synth =
      valueOf(Synth::create(settings, {{.name = "seat", .position = {kDistance, 0.0, 0.0}}}));
  const SoundBody ball{.material = strike.ball};
  const SoundBody struck{.material = strike.body, .modal = body.model};
  if (!synth.setBody(1, ball) || !synth.setBody(2, struck)) std::abort();
  synth.schedule(strike.event());
  // The low-pass filter looks ahead and needs samples after the last frame.
  std::vector<double> samples(frames + 100);
  double* const channel = samples.data();
  synth.render<double>({&channel, 1}, samples.size());
  return inTheBand(samples, 1.0 / kRate, 0.0, frames);
}

std::vector<double> directSound(const StruckModel& body, double step, std::size_t frames) {
  const HertzContact contact(strikeOf(body));
  const double end = static_cast<double>(frames + 100) / kRate;
  std::vector<double> samples = volumeAcceleration(
      body.direct, [&](double t) { return contact.force(t); }, step, end - kStrikeTime);
  const Medium air;
  for (double& sample : samples)
    sample *= air.density / (4.0 * std::numbers::pi * kDistance);
  return inTheBand(samples, step, kStrikeTime + kDistance / air.speedOfSound, frames);
}

std::vector<double> limitOf(const std::vector<double>& atStep, const std::vector<double>& atHalf) {
  std::vector<double> limit = atHalf;
  for (std::size_t index = 0; index < limit.size(); ++index)
    limit[index] += (atHalf[index] - atStep[index]) / 3.0;
  return limit;
}

}  // namespace carom::test
