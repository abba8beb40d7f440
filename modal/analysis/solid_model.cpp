#include "modal/analysis/solid_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "carom/audio/sound_body.h"
#include "modal/analysis/audible_modes.h"
#include "modal/analysis/solid_element.h"

namespace carom::modal {
namespace {

constexpr Eigen::Index kRigidModes = 6;
constexpr double kRigidShare = 1e-6;  // of the lowest elastic lambda; less is rounding

// The nodes that share a cell with each node, in ascending order: the rows of its columns in a
// matrix.
class NodeGraph {
 public:
  explicit NodeGraph(const VoxelMesh& mesh) : neighbours_(mesh.nodes.size()) {
    for (const VoxelCell& cell : mesh.cells)
      for (const std::uint32_t node : cell.nodes)
        neighbours_[node].insert(neighbours_[node].end(), cell.nodes.begin(), cell.nodes.end());
    for (std::vector<std::uint32_t>& list : neighbours_) {
      std::sort(list.begin(), list.end());
      list.erase(std::unique(list.begin(), list.end()), list.end());
    }
  }

  std::size_t size() const { return neighbours_.size(); }
  const std::vector<std::uint32_t>& of(std::size_t node) const { return neighbours_[node]; }
  std::size_t rank(std::size_t node, std::uint32_t neighbour) const {
    const std::vector<std::uint32_t>& list = neighbours_[node];
    return static_cast<std::size_t>(std::lower_bound(list.begin(), list.end(), neighbour) -
                                    list.begin());
  }

 private:
  std::vector<std::vector<std::uint32_t>> neighbours_;
};

// A matrix of 3 x 3 blocks between neighbours. Each block is stored as a whole, or only its
// diagonal.
class BlockMatrix {
 public:
  BlockMatrix(const NodeGraph& graph, bool diagonalBlocks)
      : graph_(graph), stored_(diagonalBlocks ? 1 : 3) {
    const auto rows = static_cast<Eigen::Index>(3 * graph.size());
    matrix_.resize(rows, rows);
    std::size_t entries = 0;
    for (std::size_t node = 0; node < graph.size(); ++node)
      entries += 3 * stored_ * graph.of(node).size();
    matrix_.resizeNonZeros(static_cast<Eigen::Index>(entries));
    int* start = matrix_.outerIndexPtr();
    int* row = matrix_.innerIndexPtr();
    *start = 0;
    for (std::size_t node = 0; node < graph.size(); ++node) {
      for (std::size_t axis = 0; axis < 3; ++axis, ++start) {
        start[1] = start[0] + static_cast<int>(stored_ * graph.of(node).size());
        for (const std::uint32_t neighbour : graph.of(node))
          for (std::size_t other = 0; other < stored_; ++other)
            *row++ = static_cast<int>(3 * std::size_t{neighbour} + (diagonalBlocks ? axis : other));
      }
    }
    std::fill_n(matrix_.valuePtr(), entries, 0.0);
  }

  // Adds block(row corner, column corner), a 3 x 3 matrix or a number, for all pairs of corners.
  template <class Block>
  void add(const VoxelCell& cell, const Block& block) {
    for (std::size_t to = 0; to < 8; ++to) {
      for (std::size_t from = 0; from < 8; ++from) {
        const std::size_t rank = graph_.rank(cell.nodes[to], cell.nodes[from]);
        for (std::size_t axis = 0; axis < 3; ++axis) {
          double* const at = matrix_.valuePtr() +
                             matrix_.outerIndexPtr()[3 * std::size_t{cell.nodes[to]} + axis] +
                             stored_ * rank;
          for (std::size_t other = 0; other < stored_; ++other)
            at[other] += block(from, to, other, axis);
        }
      }
    }
  }

  SparseMatrix take() {
    SparseMatrix taken;
    taken.swap(matrix_);
    return taken;
  }

 private:
  const NodeGraph& graph_;
  std::size_t stored_;
  SparseMatrix matrix_;
};

// Turns the stiffness from the grid's frame to the body's.
void turn(ElementMatrices& matrices, const Eigen::Matrix3d& axes) {
  for (int row = 0; row < 24; row += 3)
    for (int column = 0; column < 24; column += 3)
      matrices.stiffness.block<3, 3>(row, column) =
          (axes * matrices.stiffness.block<3, 3>(row, column) * axes.transpose()).eval();
}

void assemble(SolidSystem& system, const Material& material) {
  const VoxelMesh& grid = system.grid;
  const NodeGraph graph(grid);
  BlockMatrix stiffness(graph, false);
  BlockMatrix mass(graph, true);
  const auto elementOn = [&](std::span<const CellBox> inside) {
    ElementMatrices matrices = solidElement(grid.cellSize, inside, material);
    if (!grid.axes.isIdentity(0.0)) turn(matrices, grid.axes);
    return matrices;
  };
  const ElementMatrices whole = elementOn({});
  ElementMatrices cut;
  for (const VoxelCell& cell : grid.cells) {
    if (cell.boxCount > 0)
      cut = elementOn(std::span(grid.boxes).subspan(cell.firstBox, cell.boxCount));
    const ElementMatrices& matrices = cell.boxCount > 0 ? cut : whole;
    stiffness.add(cell, [&](std::size_t row, std::size_t column, std::size_t y, std::size_t x) {
      return matrices.stiffness(static_cast<Eigen::Index>(3 * row + y),
                                static_cast<Eigen::Index>(3 * column + x));
    });
    mass.add(cell, [&](std::size_t row, std::size_t column, std::size_t, std::size_t) {
      return matrices.mass(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(column));
    });
  }
  system.stiffness = stiffness.take();
  system.mass = mass.take();
}

// Takes mass, centre and inertia from the mass matrix: exact for rigid motion of the grid, and for
// overlapping bodies.
ModalModel rigidPart(const SurfaceMesh& surface, const Material& material,
                     const SolidSystem& system) {
  ModalModel model;
  model.material = material;
  model.material.roughness = {};  // roughness is of the surface, not of what rings
  model.surface = surface;
  const auto count = static_cast<Eigen::Index>(system.grid.nodes.size());
  // A column moves all nodes along x, by 1 or by one of their coordinates.
  Eigen::MatrixXd moved = Eigen::MatrixXd::Zero(3 * count, 4);
  for (Eigen::Index node = 0; node < count; ++node)
    moved.row(3 * node) << 1.0, system.grid.nodes[static_cast<std::size_t>(node)].transpose();
  const Eigen::Matrix4d moments = moved.transpose() * (system.mass * moved);
  model.mass = moments(0, 0);
  model.centreOfMass = moments.topRightCorner<1, 3>().transpose() / model.mass;
  const Eigen::Matrix3d second = moments.bottomRightCorner<3, 3>() -
                                 model.mass * model.centreOfMass * model.centreOfMass.transpose();
  model.inertia = second.trace() * Eigen::Matrix3d::Identity() - second;
  return model;
}

/// Calls share(row of the vertex, row of the node, weight) for the nodes that a vertex moves with.
template <class Share>
void eachShare(const VoxelMesh& grid, const std::vector<Vec3>& vertices, const Share& share) {
  Eigen::Index row = 0;
  for (const Vec3& vertex : vertices) {
    const CellPoint point = locate(grid, vertex);
    for (std::size_t corner = 0; corner < 8; ++corner) {
      const auto node = static_cast<Eigen::Index>(grid.cells[point.cell].nodes[corner]);
      share(row, 3 * node, point.weights[corner]);
    }
    row += 3;
  }
}

Eigen::MatrixXd shapesAtVertices(const VoxelMesh& grid, const std::vector<Vec3>& vertices,
                                 const Eigen::MatrixXd& vectors) {
  Eigen::MatrixXd shapes = Eigen::MatrixXd::Zero(3 * std::ssize(vertices), vectors.cols());
  eachShare(grid, vertices, [&](Eigen::Index vertex, Eigen::Index node, double weight) {
    shapes.middleRows<3>(vertex) += weight * vectors.middleRows<3>(node);
  });
  return shapes;
}

/// Returns the forces on the nodes of forces on the vertices.
Eigen::VectorXd loadOnNodes(const VoxelMesh& grid, const std::vector<Vec3>& vertices,
                            const Eigen::VectorXd& load) {
  Eigen::VectorXd onNodes = Eigen::VectorXd::Zero(3 * std::ssize(grid.nodes));
  eachShare(grid, vertices, [&](Eigen::Index vertex, Eigen::Index node, double weight) {
    onNodes.segment<3>(node) += weight * load.segment<3>(vertex);
  });
  return onNodes;
}

}  // namespace

Result<SolidSystem> solidSystem(const SurfaceMesh& surface, const Material& material,
                                const VoxelSettings& settings) {
  if (const Status valid = validate(material); !valid)
    return Error{"material '" + material.name + "': " + valid.error().message};
  Result<VoxelMesh> grid = voxelMesh(surface, settings);
  if (!grid) return grid.error();
  SolidSystem system{*std::move(grid), {}, {}};
  const double scale = system.grid.volume / system.grid.sampled;
  Material scaled = material;
  scaled.density *= scale;
  scaled.youngsModulus *= scale;
  assemble(system, scaled);
  return system;
}

Result<SolidAnalysis> analyseSolid(const SurfaceMesh& surface, const Material& material,
                                   const SolidSettings& settings, const Progress& progress) {
  if (settings.maxModes < 1) return Error{"at least 1 mode must be asked for"};
  if (progress && !progress("grid", 0.0)) return Error{kCancelled};
  const Result<SolidSystem> system = solidSystem(surface, material, settings.grid);
  if (!system) return system.error();
  const double highest = 2.0 * std::numbers::pi * kHighestMode;
  EigenSettings sought;
  sought.modes = kRigidModes + settings.maxModes;
  sought.highest = highest * highest;
  sought.load = loadOnNodes(system->grid, surface.vertices, outwardLoad(surface));
  const Result<EigenSolution> solution =
      lowestModes(system->stiffness, system->mass, sought, progress);
  if (!solution) return solution.error();
  SolidAnalysis analysis;
  analysis.model = rigidPart(surface, material, *system);
  const Eigen::Index found = solution->lambda.size();
  const double rigidBelow = found > kRigidModes ? kRigidShare * solution->lambda[kRigidModes]
                                                : std::numeric_limits<double>::infinity();
  const EigenModes modes{solution->lambda,
                         shapesAtVertices(system->grid, surface.vertices, solution->vectors)};
  keepAudibleModes(analysis.model, modes, rigidBelow);
  if (solution->displacement.size() > 0) {
    const Eigen::VectorXd& moved = solution->displacement;
    keepResidual(analysis.model, modes,
                 {.displacement = shapesAtVertices(system->grid, surface.vertices, moved),
                  .shift = solution->shift,
                  .massMoment = moved.dot(system->mass * moved),
                  .hasRigidModes = true},
                 rigidBelow);
  }
  analysis.degreesOfFreedom = 3 * system->grid.nodes.size();
  analysis.cellSize = system->grid.cellSize;
  analysis.modesBeyond = solution->below.value_or(found) - found;
  analysis.counted = solution->counted;
  analysis.solves = solution->solves;
  return analysis;
}

Result<ModalModel> solidModalModel(const SurfaceMesh& surface, const Material& material,
                                   const SolidSettings& settings, const Progress& progress) {
  Result<SolidAnalysis> analysis = analyseSolid(surface, material, settings, progress);
  if (!analysis) return analysis.error();
  return std::move(analysis->model);
}

}  // namespace carom::modal
