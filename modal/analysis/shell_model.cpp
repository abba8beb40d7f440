#include "modal/analysis/shell_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <set>
#include <string>
#include <tuple>
#include <utility>

#include <Eigen/Eigenvalues>

#include "audio/model/positive.h"
#include "carom/audio/sound_body.h"
#include "carom/modal/mesh_check.h"
#include "modal/analysis/audible_modes.h"
#include "modal/analysis/sparse_factor.h"
#include "modal/mesh/mesh_detail.h"
#include "modal/mesh/mesh_edges.h"

namespace carom::modal {

using namespace audio;

namespace {

using Triangle = std::array<std::uint32_t, 3>;

constexpr Eigen::Index kMostDegrees = 3000;  // degrees of freedom
constexpr double kRigid = 1e-10;             // relative to the bound of the largest eigenvalue
constexpr double kNoMass = 1e-12;            // relative to the mean mass

Error refused(const std::string& reason) {
  return Error{"shell: " + reason};
}

Status validate(const ShellSettings& settings) {
  if (!isPositive(settings.thickness)) return Error{"the thickness must be positive (m)"};
  if (settings.maxModes < 1) return Error{"at least 1 mode must be asked for"};
  if (settings.minVertices > settings.maxVertices)
    return Error{"the least number of vertices, " + std::to_string(settings.minVertices) +
                 ", is above the most, " + std::to_string(settings.maxVertices)};
  return std::monostate{};
}

Status validate(const MeshReport& report, const ShellSettings& settings) {
  for (const MeshFinding& finding : report.findings)
    if (finding.fault <= MeshFault::notFinite) return Error{finding.text};
  if (settings.thickness >= report.extent)
    return Error{"its thickness of " + std::to_string(1e3 * settings.thickness) +
                 " mm is not less than the whole body's extent of " +
                 std::to_string(1e3 * report.extent) + " mm"};
  return std::monostate{};
}

/// Keeps the first of the two sides of a sheet.
SurfaceMesh oneSided(SurfaceMesh mesh) {
  std::set<Triangle> seen;
  std::erase_if(mesh.triangles, [&](Triangle triangle) {
    std::ranges::sort(triangle);
    return !seen.insert(triangle).second;
  });
  return mesh;
}

Result<SurfaceMesh> preparedSurface(const SurfaceMesh& mesh, const ShellSettings& settings) {
  const SurfaceMesh clean = oneSided(mended(mesh).surface);
  const Result<SurfaceMesh> few = simplified(clean, settings.maxVertices);
  if (!few) return few.error();
  return subdividedTo(*few, settings.minVertices);
}

Vec3 areaVector(const SurfaceMesh& mesh, const Triangle& triangle) {
  const Vec3& first = mesh.vertices[triangle[0]];
  return 0.5 * (mesh.vertices[triangle[1]] - first).cross(mesh.vertices[triangle[2]] - first);
}

/// Returns the normals of the vertices; where the triangles of a vertex cancel, as on the rim of a
/// closed sheet, the last one's.
std::vector<Vec3> normalsOf(const SurfaceMesh& mesh) {
  std::vector<Vec3> sums(mesh.vertices.size(), Vec3::Zero());
  std::vector<Vec3> any(mesh.vertices.size(), Vec3::UnitZ());
  for (const Triangle& triangle : mesh.triangles) {
    const Vec3 area = areaVector(mesh, triangle);
    for (const std::uint32_t corner : triangle) {
      sums[corner] += area;
      if (area.norm() > 0.0) any[corner] = area.normalized();
    }
  }
  for (std::size_t vertex = 0; vertex < sums.size(); ++vertex)
    sums[vertex] = sums[vertex].norm() > 0.0 ? sums[vertex].normalized() : any[vertex];
  return sums;
}

Eigen::VectorXd massesOf(const SurfaceMesh& mesh, double perArea) {
  Eigen::VectorXd masses = Eigen::VectorXd::Zero(std::ssize(mesh.vertices));
  for (const Triangle& triangle : mesh.triangles)
    for (const std::uint32_t corner : triangle)
      masses[static_cast<Eigen::Index>(corner)] +=
          perArea * areaVector(mesh, triangle).norm() / 3.0;
  return masses;
}

/// Adds `block` at each end of the edge, and its opposite between the two.
template <class Block>
void addSpring(std::vector<Eigen::Triplet<double>>& entries, const EdgeUse& edge,
               const Block& block) {
  const Eigen::Index size = block.rows();
  const auto low = static_cast<Eigen::Index>(edge.low);
  const auto high = static_cast<Eigen::Index>(edge.high);
  for (const auto& [row, column, sign] : {std::tuple(low, low, 1.0), std::tuple(low, high, -1.0),
                                          std::tuple(high, low, -1.0), std::tuple(high, high, 1.0)})
    for (Eigen::Index i = 0; i < size; ++i)
      for (Eigen::Index j = 0; j < size; ++j)
        entries.emplace_back(static_cast<int>(row * size + i), static_cast<int>(column * size + j),
                             sign * block(i, j));
}

SparseMatrix stiffnessOf(const SurfaceMesh& mesh, ShellSprings springs, double constant) {
  const Eigen::Index perVertex = springs == ShellSprings::axial ? 3 : 1;
  std::vector<Eigen::Triplet<double>> entries;
  const MeshEdges edges(mesh);
  for (std::size_t index = 0; index < edges.size(); ++index) {
    const EdgeUse& edge = edges[index][0];
    const Vec3 along = (mesh.vertices[edge.high] - mesh.vertices[edge.low]).normalized();
    if (springs == ShellSprings::axial)
      addSpring(entries, edge, Eigen::Matrix3d(constant * along * along.transpose()));
    else
      addSpring(entries, edge, Eigen::Matrix<double, 1, 1>(constant));
  }
  const Eigen::Index size = perVertex * std::ssize(mesh.vertices);
  SparseMatrix stiffness(size, size);
  stiffness.setFromTriplets(entries.begin(), entries.end());
  return stiffness;
}

/// Masses (kg) of all degrees of freedom.
Eigen::VectorXd spreadMasses(const ShellNetwork& network) {
  const Eigen::Index perVertex = network.stiffness.rows() / network.masses.size();
  Eigen::VectorXd masses(network.stiffness.rows());
  for (Eigen::Index row = 0; row < masses.size(); ++row)
    masses[row] = network.masses[row / perVertex];
  return masses;
}

/// Upper bound of the eigenvalues of K phi = lambda M phi (Gershgorin).
double eigenvalueBound(const SparseMatrix& stiffness, const Eigen::VectorXd& masses) {
  double bound = 0.0;
  for (Eigen::Index column = 0; column < stiffness.outerSize(); ++column) {
    double sum = 0.0;
    for (SparseMatrix::InnerIterator entry(stiffness, column); entry; ++entry)
      sum += std::abs(entry.value());
    bound = std::max(bound, sum / masses[column]);
  }
  return bound;
}

struct SoughtModes {
  double rigidBelow = 0.0;      // rad^2/s^2
  std::size_t count = 0;        // of elastic ones
  const Eigen::VectorXd& load;  // N
};

/// Returns the rigid eigenvalues and those sought, ascending, with vectors of
/// which phi^T M phi = 1. All eigenvalues are computed: this is the one place to change for a
/// solver that finds only some. `response` gets the displacement under the load, rigid modes left
/// out.
EigenModes shellEigenModes(const SparseMatrix& stiffness, const Eigen::VectorXd& masses,
                           const SoughtModes& sought, StaticResponse& response) {
  const Eigen::VectorXd scale = masses.cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled =
      scale.asDiagonal() * Eigen::MatrixXd(stiffness) * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(scaled);
  const Eigen::VectorXd& lambda = solver.eigenvalues();
  const auto rigid = std::ranges::lower_bound(lambda, sought.rigidBelow) - lambda.begin();
  const Eigen::Index elastic = lambda.size() - rigid;
  const Eigen::MatrixXd vectors = scale.asDiagonal() * solver.eigenvectors().rightCols(elastic);
  const Eigen::VectorXd moved =
      (vectors.transpose() * sought.load).cwiseQuotient(lambda.tail(elastic));
  response.displacement = vectors * moved;
  response.massMoment = moved.squaredNorm();
  const Eigen::Index kept =
      std::min(lambda.size(), rigid + static_cast<Eigen::Index>(sought.count));
  return {lambda.head(kept), scale.asDiagonal() * solver.eigenvectors().leftCols(kept)};
}

/// Returns the components of forces along the normals.
Eigen::VectorXd onNormals(const Eigen::VectorXd& forces, const std::vector<Vec3>& normals) {
  Eigen::VectorXd along(std::ssize(normals));
  for (Eigen::Index vertex = 0; vertex < along.size(); ++vertex)
    along[vertex] = normals[static_cast<std::size_t>(vertex)].dot(forces.segment<3>(3 * vertex));
  return along;
}

/// Turns displacements along the normals into displacements in space.
Eigen::MatrixXd alongNormals(const Eigen::MatrixXd& heights, const std::vector<Vec3>& normals) {
  Eigen::MatrixXd shapes(3 * heights.rows(), heights.cols());
  for (Eigen::Index vertex = 0; vertex < heights.rows(); ++vertex)
    shapes.middleRows<3>(3 * vertex) =
        normals[static_cast<std::size_t>(vertex)] * heights.row(vertex);
  return shapes;
}

/// Sets mass, centre and inertia, exactly for flat triangles without thickness: the middles of the
/// sides stand for each triangle.
void setMass(ModalModel& model, double perArea) {
  Vec3 moment = Vec3::Zero();
  std::vector<std::pair<double, Vec3>> points;
  for (const Triangle& triangle : model.surface.triangles) {
    const double third = perArea * areaVector(model.surface, triangle).norm() / 3.0;
    for (std::size_t side = 0; side < 3; ++side) {
      const Vec3 middle = 0.5 * (model.surface.vertices[triangle[side]] +
                                 model.surface.vertices[triangle[(side + 1) % 3]]);
      points.emplace_back(third, middle);
      model.mass += third;
      moment += third * middle;
    }
  }
  model.centreOfMass = moment / model.mass;
  for (const auto& [mass, point] : points) {
    const Vec3 arm = point - model.centreOfMass;
    model.inertia +=
        mass * (arm.squaredNorm() * Eigen::Matrix3d::Identity() - arm * arm.transpose());
  }
}

}  // namespace

Result<ShellNetwork> shellNetwork(const SurfaceMesh& mesh, const Material& material,
                                  const ShellSettings& settings) {
  if (const Status valid = validate(settings); !valid) return refused(valid.error().message);
  if (const Status valid = validate(material); !valid)
    return refused("material '" + material.name + "': " + valid.error().message);
  if (const Status valid = validate(checkMesh(mesh), settings); !valid)
    return refused(valid.error().message);
  Result<SurfaceMesh> surface = preparedSurface(mesh, settings);
  if (!surface) return refused(surface.error().message);
  ShellNetwork network;
  network.springs = settings.springs;
  network.surface = *std::move(surface);
  network.normals = normalsOf(network.surface);
  network.masses = massesOf(network.surface, material.density * settings.thickness);
  if (!(network.masses.size() > 0 && network.masses.minCoeff() > kNoMass * network.masses.mean()))
    return refused("some vertex is of triangles without area; expected a cleaner mesh");
  network.stiffness =
      stiffnessOf(network.surface, settings.springs, material.youngsModulus * settings.thickness);
  return network;
}

Result<ModalModel> shellModalModel(const SurfaceMesh& mesh, const Material& material,
                                   const ShellSettings& settings, const Progress& progress) {
  const auto cancelled = [&](const char* stage, double fraction) {
    return progress && !progress(stage, fraction);
  };
  if (cancelled("springs", 0.0)) return Error{kCancelled};
  const Result<ShellNetwork> network = shellNetwork(mesh, material, settings);
  if (!network) return network.error();
  if (network->stiffness.rows() > kMostDegrees)
    return refused(std::to_string(network->stiffness.rows()) +
                   " degrees of freedom are too many; expected at most " +
                   std::to_string(kMostDegrees) + ": allow fewer vertices");
  if (cancelled("modes", 0.1)) return Error{kCancelled};
  const Eigen::VectorXd masses = spreadMasses(*network);
  const double rigidBelow = kRigid * eigenvalueBound(network->stiffness, masses);
  const bool isTransverse = settings.springs == ShellSprings::transverse;
  Eigen::VectorXd load = outwardLoad(network->surface);
  if (isTransverse) load = onNormals(load, network->normals);
  StaticResponse response;
  EigenModes modes =
      shellEigenModes(network->stiffness, masses, {rigidBelow, settings.maxModes, load}, response);
  if (isTransverse) {
    modes.shapes = alongNormals(modes.shapes, network->normals);
    response.displacement = alongNormals(response.displacement, network->normals);
  }
  ModalModel model;
  model.material = material;
  model.material.roughness = {};  // roughness is of the surface, not of what rings
  model.surface = network->surface;
  setMass(model, material.density * settings.thickness);
  keepAudibleModes(model, modes, rigidBelow);
  // A sheet displaces on one side what it leaves room for on the other.
  if (closedSurface(model.surface)) keepResidual(model, modes, response, rigidBelow);
  if (cancelled("modes", 1.0)) return Error{kCancelled};
  return model;
}

}  // namespace carom::modal
