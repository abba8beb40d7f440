#include "modal/analysis/solid_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numbers>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "carom/audio/sound_body.h"
#include "modal/analysis/audible_modes.h"
#include "modal/analysis/dissection.h"
#include "modal/analysis/heat_losses.h"
#include "modal/analysis/solid_element.h"
#include "modal/mesh/mesh_edges.h"

namespace carom::modal {
namespace {

constexpr Eigen::Index kRigidModes = 6;
constexpr double kRigidShare = 1e-6;  // of the lowest elastic lambda; less is rounding

constexpr std::size_t kFirstGrid = 1200;  // degrees of freedom
constexpr double kGridGrowth = 2.2;       // of degrees of freedom, and of entries about as much
constexpr double kMostEntries = 12e6;     // of the stiffness
constexpr std::size_t kMostKinds = 64;    // of whole cells, whose matrices are kept
constexpr double kCoarserCell = 1.4;      // of a grid that a given one is compared with
constexpr double kGridShare = 0.5;        // of what is left to do
constexpr double kErrorOrder = 2.5;       // power of the cells' size
constexpr double kOrderMargin = 0.5;      // less than what was seen
constexpr double kLowestOrder = 2.0;
constexpr double kHighestOrder = 4.5;
// At a sharp inner edge stress is singular (Williams 1952, J. Appl. Mech. 19, 526), and smooth
// functions make it stiffer than it is: a frequency is too high by this, for each share of the
// mode's energy that is in the cells that the edge passes. The modes of a cup and a dish have 0.03
// to 0.14 (docs/modal.md), whatever the cells' size; so it is taken off, and the rest is told.
constexpr double kExcessAtOpenEdges = 0.085;
constexpr double kDoubtOfExcess = 0.7;  // of that excess
constexpr double kSamePair = 2e-3;      // of frequencies that are one pair's
constexpr double kInnerEdges = 0.03;    // of the body's length, together: shorter ones do not count
constexpr double kBestOrder = 2.5;  // with which an earlier change is taken to have gone on falling
constexpr double kLeastError = 5e-5;  // of the fill and of the solver
// Every grid leaves this error at sharp inner edges, as the cells there stay as large as the wall
// is thick.
constexpr double kErrorAtInnerEdges = 3e-3;
constexpr double kFinestAccuracy = 1e-5;
constexpr double kCoarsestAccuracy = 0.5;

// The nodes that share a cell with each node, in ascending order: the rows of its columns in a
// matrix.
class NodeGraph {
 public:
  explicit NodeGraph(const SplineMesh& mesh) : neighbours_(mesh.nodes.size()) {
    for (const SplineCell& cell : mesh.cells)
      for (const std::uint32_t node : cell.nodes)
        neighbours_[node].insert(neighbours_[node].end(), cell.nodes.begin(), cell.nodes.end());
    for (std::vector<std::uint32_t>& list : neighbours_) {
      std::sort(list.begin(), list.end());
      list.erase(std::unique(list.begin(), list.end()), list.end());
    }
  }

  std::size_t size() const { return neighbours_.size(); }
  const NodeNeighbours& neighbours() const { return neighbours_; }
  const std::vector<std::uint32_t>& of(std::size_t node) const { return neighbours_[node]; }
  std::size_t rank(std::size_t node, std::uint32_t neighbour) const {
    const std::vector<std::uint32_t>& list = neighbours_[node];
    return static_cast<std::size_t>(std::lower_bound(list.begin(), list.end(), neighbour) -
                                    list.begin());
  }

 private:
  NodeNeighbours neighbours_;
};

// The rows of a grid's matrices in the order in which they are best eliminated.
std::vector<int> eliminationOrder(const SplineMesh& grid, const NodeNeighbours& neighbours) {
  std::vector<int> order;
  order.reserve(3 * grid.nodes.size());
  for (const std::uint32_t node : dissectionOrder(neighbours, grid.functions))
    for (int axis = 0; axis < 3; ++axis)
      order.push_back(3 * static_cast<int>(node) + axis);
  return order;
}

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

  // Adds block(row function, column function), a 3 x 3 matrix or a number, for all pairs of a
  // cell's functions.
  template <class Block>
  void add(const SplineCell& cell, const Block& block) {
    for (std::size_t to = 0; to < cell.nodes.size(); ++to) {
      for (std::size_t from = 0; from < cell.nodes.size(); ++from) {
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

// Turns stiffness and pull from the grid's frame to the body's.
void turn(ElementMatrices& matrices, const Eigen::Matrix3d& axes) {
  for (Eigen::Index row = 0; row < matrices.stiffness.rows(); row += 3)
    for (Eigen::Index column = 0; column < matrices.stiffness.cols(); column += 3)
      matrices.stiffness.block<3, 3>(row, column) =
          (axes * matrices.stiffness.block<3, 3>(row, column) * axes.transpose()).eval();
  for (Eigen::Index row = 0; row < matrices.pull.size(); row += 3)
    matrices.pull.segment<3>(row) = (axes * matrices.pull.segment<3>(row)).eval();
}

// The matrices of a cell; `whole` is the inside of one that no surface cuts.
ElementMatrices elementOf(const SplineMesh& grid, const SplineCell& cell, const CellMoments& whole,
                          const Material& material) {
  ElementMatrices matrices = solidElement(
      sidesOf(grid, cell),
      cell.moments >= 0 ? grid.moments[static_cast<std::size_t>(cell.moments)] : whole, material);
  if (!grid.axes.isIdentity(0.0)) turn(matrices, grid.axes);
  return matrices;
}

void assemble(SolidSystem& system, const Material& material) {
  const SplineMesh& grid = system.grid;
  const NodeGraph graph(grid);
  BlockMatrix stiffness(graph, false);
  BlockMatrix mass(graph, true);
  system.pull.setZero(3 * std::ssize(grid.nodes));
  const CellMoments whole = momentsOf(-Vec3::Ones(), Vec3::Ones());
  std::map<std::array<int, 3>, ElementMatrices> wholes;  // by the kinds of a cell's sides
  ElementMatrices own;
  for (const SplineCell& cell : grid.cells) {
    const CellAxes sides = sidesOf(grid, cell);
    const std::array<int, 3> kinds = {sides[0]->kind, sides[1]->kind, sides[2]->kind};
    const auto known = cell.moments < 0 ? wholes.find(kinds) : wholes.end();
    if (known == wholes.end()) own = elementOf(grid, cell, whole, material);
    if (known == wholes.end() && cell.moments < 0 && wholes.size() < kMostKinds)
      wholes.emplace(kinds, own);
    const ElementMatrices& matrices = known == wholes.end() ? own : known->second;
    for (std::size_t function = 0; function < cell.nodes.size(); ++function)
      system.pull.segment<3>(3 * static_cast<Eigen::Index>(cell.nodes[function])) +=
          matrices.pull.segment<3>(3 * static_cast<Eigen::Index>(function));
    stiffness.add(cell, [&](std::size_t row, std::size_t column, std::size_t y, std::size_t x) {
      return matrices.stiffness(static_cast<Eigen::Index>(3 * row + y),
                                static_cast<Eigen::Index>(3 * column + x));
    });
    mass.add(cell, [&](std::size_t row, std::size_t column, std::size_t, std::size_t) {
      return matrices.mass(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(column));
    });
  }
  system.order = eliminationOrder(grid, graph.neighbours());
  system.stiffness = stiffness.take();
  system.mass = mass.take();
}

// The share of each mode's energy that is in the cells that an edge without a kink passes, the mean
// of both where two are a pair: how a pair is turned against the grid is no property of the body.
Eigen::VectorXd energyAtOpenEdges(const SplineMesh& grid, const EigenSolution& solution,
                                  const Material& material) {
  Eigen::VectorXd share = Eigen::VectorXd::Zero(solution.lambda.size());
  const CellMoments whole = momentsOf(-Vec3::Ones(), Vec3::Ones());
  Eigen::MatrixXd moved(3 * kCellFunctions, share.size());
  for (const std::uint32_t index : grid.openCells) {
    const SplineCell& cell = grid.cells[index];
    const ElementMatrices element = elementOf(grid, cell, whole, material);
    for (std::size_t function = 0; function < kCellFunctions; ++function)
      moved.middleRows<3>(3 * static_cast<Eigen::Index>(function)) =
          solution.vectors.middleRows<3>(3 * static_cast<Eigen::Index>(cell.nodes[function]));
    share += (element.stiffness * moved).cwiseProduct(moved).colwise().sum().transpose();
  }
  for (Eigen::Index mode = 0; mode < share.size(); ++mode)
    share[mode] = mode < kRigidModes ? 0.0 : share[mode] / solution.lambda[mode];
  for (Eigen::Index mode = kRigidModes; mode + 1 < share.size(); ++mode) {
    if (solution.lambda[mode + 1] > solution.lambda[mode] * (1.0 + 2.0 * kSamePair)) continue;
    share.segment<2>(mode).setConstant(share.segment<2>(mode).mean());
    ++mode;
  }
  return share.cwiseMin(1.0);
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

Eigen::MatrixXd shapesAtVertices(const SplineMesh& grid, const std::vector<Vec3>& vertices,
                                 const Eigen::MatrixXd& vectors) {
  Eigen::MatrixXd shapes = Eigen::MatrixXd::Zero(3 * std::ssize(vertices), vectors.cols());
  Eigen::Index row = 0;
  for (const Vec3& vertex : vertices) {
    const CellPoint point = locate(grid, vertex);
    for (std::size_t function = 0; function < point.weights.size(); ++function) {
      const auto node = static_cast<Eigen::Index>(grid.cells[point.cell].nodes[function]);
      shapes.middleRows<3>(row) += point.weights[function] * vectors.middleRows<3>(3 * node);
    }
    row += 3;
  }
  return shapes;
}

SolidAnalysis analysisOf(const SurfaceMesh& surface, const Material& material,
                         const SolidSystem& system, const EigenSolution& solution,
                         const Eigen::VectorXd& errors, const Eigen::VectorXd& excess) {
  SolidAnalysis analysis;
  analysis.model = rigidPart(surface, material, system);
  const Eigen::Index found = solution.lambda.size();
  const double rigidBelow = found > kRigidModes ? kRigidShare * solution.lambda[kRigidModes]
                                                : std::numeric_limits<double>::infinity();
  const EigenModes modes{solution.lambda,
                         shapesAtVertices(system.grid, surface.vertices, solution.vectors), errors,
                         excess, heatLosses(system.grid, solution, kRigidModes, material)};
  keepAudibleModes(analysis.model, modes, rigidBelow);
  if (solution.displacement.size() > 0) {
    const Eigen::VectorXd& moved = solution.displacement;
    keepResidual(analysis.model, modes,
                 {.displacement = shapesAtVertices(system.grid, surface.vertices, moved),
                  .shift = solution.shift,
                  .massMoment = moved.dot(system.mass * moved),
                  .hasRigidModes = true,
                  .pulls = solution.vectors.transpose() * system.pull},
                 rigidBelow);
  }
  analysis.degreesOfFreedom = 3 * system.grid.nodes.size();
  analysis.cellSize = system.grid.cellSize;
  analysis.modesBeyond = solution.below.value_or(found) - found;
  analysis.counted = solution.counted;
  analysis.solves = solution.solves;
  return analysis;
}

// Solves a body on finer and finer grids, and takes each frequency's error from its change.
class Refinement {
 public:
  Refinement(const SolidSurface& surface, const Material& material, const SolidSettings& settings,
             const Progress& progress)
      : surface_(surface), material_(material), settings_(settings), progress_(progress) {}

  Result<SolidAnalysis> run() {
    if (settings_.grid.cellSize || settings_.grid.degreesOfFreedom) return runOnGrid();
    std::size_t freedom = kFirstGrid;
    for (;;) {
      Result<SolidSystem> system = solidSystem(
          surface_.body, material_, {.degreesOfFreedom = freedom, .cellSize = {}}, looks());
      if (!system) return system.error();
      const double growth = static_cast<double>(system->stiffness.nonZeros()) * kGridGrowth;
      const bool isLast = growth > kMostEntries;
      if (const Status solved = solve(*system); !solved) return solved.error();
      if (isLast || (grids_ > 1 && worstError() <= settings_.accuracy)) {
        SolidAnalysis analysis =
            analysisOf(surface_.shapes, material_, *system, solution_, errors_, excess_);
        analysis.grids = grids_;
        analysis.reachedAccuracy = worstError() <= settings_.accuracy;
        return analysis;
      }
      freedom = static_cast<std::size_t>(kGridGrowth * static_cast<double>(freedom));
    }
  }

 private:
  Result<SolidAnalysis> runOnGrid() {
    const Result<SolidSystem> system =
        solidSystem(surface_.body, material_, settings_.grid, looks());
    if (!system) return system.error();
    const double size = system->grid.cellSize.maxCoeff();
    std::array<int, 3> before{};
    for (const double coarser : {kCoarserCell * kCoarserCell, kCoarserCell}) {
      const Result<SolidSystem> other = solidSystem(
          surface_.body, material_, {.degreesOfFreedom = {}, .cellSize = coarser * size}, looks());
      if (!other || other->grid.count == system->grid.count || other->grid.count == before)
        continue;
      before = other->grid.count;
      if (const Status solved = solve(*other); !solved) return solved.error();
    }
    if (const Status solved = solve(*system); !solved) return solved.error();
    SolidAnalysis analysis =
        analysisOf(surface_.shapes, material_, *system, solution_, errors_, excess_);
    analysis.grids = grids_;
    return analysis;
  }

  // Lets whoever watches cancel while a grid is made, which is no share of the work.
  Progress looks() const {
    if (!progress_) return {};
    return [this](std::string_view stage, double) { return progress_(stage, done_); };
  }

  // Finds the modes on a grid, and their errors if there was another before.
  Status solve(const SolidSystem& system) {
    const double highest = 2.0 * std::numbers::pi * kHighestMode;
    EigenSettings sought;
    sought.modes =
        std::min<Eigen::Index>(kRigidModes + settings_.maxModes, system.stiffness.rows() / 2);
    sought.highest = highest * highest;
    sought.load = system.pull;
    sought.order = system.order;
    // How many grids follow is not known; the next one takes longer than all before.
    const double begun = done_;
    done_ += kGridShare * (1.0 - begun);
    Progress part;
    if (progress_)
      part = [this, begun](std::string_view stage, double share) {
        return progress_(stage, begun + share * (done_ - begun));
      };
    Result<EigenSolution> solution = lowestModes(system.stiffness, system.mass, sought, part);
    if (!solution) return solution.error();
    const double size = std::cbrt(system.grid.cellSize.prod());
    const double fewest = kInnerEdges * extentOf(surface_.body);
    const double least = system.grid.innerEdges > fewest ? kErrorAtInnerEdges : kLeastError;
    errors_ = Eigen::VectorXd::Constant(solution->lambda.size(), grids_ > 0 ? 1.0 : 0.0);
    const double ratio = cellSize_ / size;
    // Cells were equal before, and are smaller beside inner edges now: what has gone is taken to be
    // no less than what is left.
    const bool isOtherKind = grids_ > 0 && system.grid.openEdges != openEdges_;
    Eigen::VectorXd excess =
        kExcessAtOpenEdges * energyAtOpenEdges(system.grid, *solution, material_);
    Eigen::VectorXd frequencies = solution->lambda.cwiseMax(0.0).cwiseSqrt();
    frequencies.array() *= 1.0 - excess.array();
    Eigen::VectorXd changes = Eigen::VectorXd::Zero(solution->lambda.size());
    for (Eigen::Index mode = kRigidModes; mode < changes.size() && (ratio > 1.0 || isOtherKind);
         ++mode) {
      // A mode that the grid before did not have lay above the band there.
      changes[mode] = mode < frequencies_.size()
                          ? std::abs(frequencies_[mode] / frequencies[mode] - 1.0)
                          : std::max(changes[mode - 1], highest / frequencies[mode] - 1.0);
      const double order = orderOf(mode, changes[mode], ratio);
      const double error = isOtherKind ? changes[mode]
                                       : std::max(changes[mode] / (std::pow(ratio, order) - 1.0),
                                                  errorLeft(mode, ratio));
      errors_[mode] = std::min(error + least + kDoubtOfExcess * excess[mode], 1.0);
    }
    changes_ = isOtherKind ? Eigen::VectorXd() : std::move(changes);
    ratio_ = ratio;
    openEdges_ = system.grid.openEdges;
    frequencies_ = std::move(frequencies);
    excess_ = std::move(excess);
    solution_ = *std::move(solution);
    cellSize_ = size;
    ++grids_;
    return std::monostate{};
  }

  // Returns what is left at best of the error that the change before has shown. The last change
  // alone may be next to nothing: a grid that is not finer than a bend's radius where it counts has
  // the bend as stiff as the coarser one had.
  double errorLeft(Eigen::Index mode, double ratio) const {
    if (grids_ < 2 || mode >= changes_.size() || !(ratio_ > 1.0)) return 0.0;
    return changes_[mode] / (std::pow(ratio_, kBestOrder) - 1.0) / std::pow(ratio, kBestOrder);
  }

  // Returns the power of the cells' size with which a mode's error falls: as its last two changes
  // have it, less a margin; kErrorOrder, where there is one change only. Where stress is singular a
  // small part of the error is left when the others have gone, which no changes show before.
  double orderOf(Eigen::Index mode, double change, double ratio) const {
    if (grids_ < 2 || mode >= changes_.size() || !(change > 0.0)) return kErrorOrder;
    const double seen = std::log(changes_[mode] / change) / std::log(ratio);
    return std::clamp(seen - kOrderMargin, kLowestOrder, kHighestOrder);
  }

  // Returns the largest error of an audible mode.
  double worstError() const {
    double worst = grids_ > 1 ? 0.0 : 1.0;
    const double highest = 2.0 * std::numbers::pi * kHighestMode;
    for (Eigen::Index mode = kRigidModes; mode < solution_.lambda.size(); ++mode)
      if (solution_.lambda[mode] <= highest * highest) worst = std::max(worst, errors_[mode]);
    return worst;
  }

  const SolidSurface& surface_;
  const Material& material_;
  const SolidSettings& settings_;
  const Progress& progress_;
  double openEdges_ = 0.0;  // m, of its grid
  EigenSolution solution_;
  Eigen::VectorXd excess_;       // of its frequencies, relative: what edges make them too high by
  Eigen::VectorXd frequencies_;  // rad/s, without that
  Eigen::VectorXd errors_;       // of its frequencies, relative; 0 where none are known
  Eigen::VectorXd changes_;      // of its frequencies since the grid before, relative
  double cellSize_ = 0.0;        // m, of its grid
  double ratio_ = 0.0;           // of that before to its own
  double done_ = 0.0;            // share of the work
  std::size_t grids_ = 0;
};

}  // namespace

Result<SolidSystem> solidSystem(const SurfaceMesh& surface, const Material& material,
                                const GridSettings& settings, const Progress& progress) {
  if (const Status valid = validate(material); !valid)
    return Error{"material '" + material.name + "': " + valid.error().message};
  Result<SplineMesh> grid = splineMesh(surface, settings);
  if (!grid) return grid.error();
  if (progress && !progress("matrices", 0.0)) return Error{kCancelled};
  SolidSystem system{*std::move(grid), {}, {}, {}, {}};
  assemble(system, material);
  return system;
}

Result<SolidAnalysis> analyseSolid(const SolidSurface& surface, const Material& material,
                                   const SolidSettings& settings, const Progress& progress) {
  if (settings.maxModes < 1) return Error{"at least 1 mode must be asked for"};
  if (!(settings.accuracy >= kFinestAccuracy && settings.accuracy <= kCoarsestAccuracy))
    return Error{"accuracy must be from 0.00001 to 0.5"};
  if (progress && !progress("grid", 0.0)) return Error{kCancelled};
  return Refinement(surface, material, settings, progress).run();
}

Result<SolidAnalysis> analyseSolid(const SurfaceMesh& surface, const Material& material,
                                   const SolidSettings& settings, const Progress& progress) {
  return analyseSolid({.body = surface, .shapes = surface}, material, settings, progress);
}

Result<ModalModel> solidModalModel(const SurfaceMesh& surface, const Material& material,
                                   const SolidSettings& settings, const Progress& progress) {
  Result<SolidAnalysis> analysis = analyseSolid(surface, material, settings, progress);
  if (!analysis) return analysis.error();
  return std::move(analysis->model);
}

}  // namespace carom::modal
