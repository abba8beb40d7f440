// Accuracy of the modes of a solid, beside the cost of their analysis. `--help` describes the
// arguments and the columns.

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <iterator>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "modal/analysis/solid_model.h"
#include "tests/audio/meshes.h"
#include "tests/bench/cpu_time.h"
#include "tests/bench/scale.h"
#include "tests/support/vibration_references.h"

namespace carom::bench {

using namespace modal;

namespace {

constexpr char kHelp[] =
    R"(usage: bench_modal_accuracy [--csv FILE] [--modes] [--short]
       ./bench modal_accuracy [--short] [-- [--csv FILE] [--modes]]

The first 10 elastic modes of free aluminium bodies, as analyseSolid finds them, for grids of more
and more degrees of freedom, against theory (tests/support/vibration_references.h):

  beam    0.4 x 0.03 x 0.01 m, nu = 0.33: Timoshenko's bending in both planes, Saint-Venant's torsion
          with warping, Love's rod; a mode is compared with the one of its kind, by its symmetry
  plate   0.3 x 0.3 x 0.002 m, nu = 0.3: Kirchhoff's plate, converged (Leissa's table is 0.2 to 1 %
          above it). Theory itself is 0.3 % or so above three-dimensional elasticity
  sphere  radius 0.1 m, nu = 0.25: Lamb. A sphere for the analysis is a mesh of 8192 triangles
  brick   0.2 x 0.16 x 0.12 m, nu = 0.3: three-dimensional elasticity by Ritz's method

  dof     degrees of freedom: three for each node
  cell    mm, its edges
  time    s of CPU, one thread: grid, matrices, modes, everything
  worst   % from theory, of the 10, and which one it is

  --csv FILE   writes the rows to FILE as well
  --modes      prints every mode
  --short      the two coarsest grids, and a sphere of fewer triangles
)";

constexpr std::size_t kModes = 10;
constexpr double kBar = 0.01;
constexpr std::size_t kFewSizes = 2;
constexpr std::size_t kSizes[] = {300, 600, 1200, 2500, 5000, 10000};

using Kinds = std::vector<std::vector<double>>;  // Hz, ascending, for each kind

struct Body {
  const char* name;
  SurfaceMesh surface;
  Material material;
  Kinds theory;
};

Material aluminium(double poissonsRatio) {
  Material material;
  material.name = "aluminium";
  material.density = 2700.0;
  material.youngsModulus = 70e9;
  material.poissonsRatio = poissonsRatio;
  return material;
}

Body beam() {
  const Material material = aluminium(0.33);
  const Vec3 edges(0.4, 0.03, 0.01);
  return {"beam",
          boxMesh(0.5 * edges),
          material,
          {test::stretchingFrequencies(material, edges.x(), edges.y(), edges.z(), kModes),
           test::bendingFrequencies(material, edges.x(), edges.y(), edges.z(), kModes),
           test::bendingFrequencies(material, edges.x(), edges.z(), edges.y(), kModes),
           test::twistingFrequencies(material, edges.x(), edges.y(), edges.z(), kModes)}};
}

Body plate() {
  const Material material = aluminium(0.3);
  return {"plate",
          boxMesh({0.15, 0.15, 0.001}),
          material,
          {test::squarePlateFrequencies(material, 0.3, 0.002, kModes)}};
}

Body sphere(const Scale& scale) {
  const Material material = aluminium(0.25);
  return {"sphere",
          ellipsoidMesh({0.1, 0.1, 0.1}, scale.of(5, 3)),
          material,
          {test::sphereFrequencies(material, 0.1, kModes)}};
}

Body brick(const Scale& scale) {
  const Material material = aluminium(0.3);
  const Vec3 edges(0.2, 0.16, 0.12);
  Body body{"brick", boxMesh(0.5 * edges), material, {{}}};
  const int terms = scale.of(10, 7);
  for (const test::BoxMode& mode : test::boxModes(material, edges, {terms, terms, terms}, kModes))
    body.theory[0].push_back(mode.frequency);
  return body;
}

// The mode's kind, of four as boxes have them: 1 is added if a reflection of y reverses the motion,
// 2 if one of z does. The corners suffice to decide.
std::size_t kindOf(const ModalModel& model, std::size_t mode) {
  double reversed[2] = {0.0, 0.0};  // share that each reflection reverses, less what it keeps
  const std::size_t corners = model.surface.vertices.size();
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto coordinate = static_cast<Eigen::Index>(axis + 1);
    for (std::size_t corner = 0; corner < corners; ++corner) {
      Vec3 mirrored = model.shape(mode, corner ^ (axis == 0 ? 2U : 4U));
      mirrored[coordinate] = -mirrored[coordinate];
      reversed[axis] -= mirrored.dot(model.shape(mode, corner));
    }
  }
  return (reversed[0] > 0.0 ? 1U : 0U) + (reversed[1] > 0.0 ? 2U : 0U);
}

struct Match {
  std::size_t kind = 0;
  double found = 0.0;   // Hz
  double theory = 0.0;  // Hz
  double error() const { return found / theory - 1.0; }
};

// Pairs each mode with the next theoretical one of its kind.
std::vector<Match> matched(const Body& body, const ModalModel& model) {
  std::vector<std::size_t> next(body.theory.size(), 0);
  std::vector<Match> matches;
  for (std::size_t mode = 0; mode < model.modes.size(); ++mode) {
    const std::size_t kind = body.theory.size() > 1 ? kindOf(model, mode) : 0;
    matches.push_back({kind, model.modes[mode].frequency, body.theory[kind][next[kind]++]});
  }
  return matches;
}

struct AccuracyRow {
  const Body* body = nullptr;
  std::size_t degreesOfFreedom = 0;
  Vec3 cellSize = Vec3::Zero();  // m, edges of a cell
  double seconds = 0.0;
  std::vector<Match> matches;

  const Match& worst() const {
    return *std::max_element(matches.begin(), matches.end(), [](const Match& a, const Match& b) {
      return std::abs(a.error()) < std::abs(b.error());
    });
  }
};

/// Rows for all sizes; a size for which there is no grid is reported to the error stream instead.
std::vector<AccuracyRow> measure(const Body& body, const Scale& scale) {
  std::vector<AccuracyRow> rows;
  for (const std::size_t size : std::span(kSizes).first(scale.of(std::size(kSizes), kFewSizes))) {
    SolidSettings settings;
    settings.grid.degreesOfFreedom = size;
    settings.maxModes = kModes;
    const double start = cpuSeconds();
    const Result<SolidAnalysis> analysis = analyseSolid(body.surface, body.material, settings);
    const double seconds = cpuSeconds() - start;
    if (!analysis || analysis->model.modes.size() < kModes) {
      std::fprintf(stderr, "%s, %zu: %s\n", body.name, size,
                   analysis ? "modes are missing" : analysis.error().message.c_str());
      continue;
    }
    const bool again = !rows.empty() && rows.back().degreesOfFreedom == analysis->degreesOfFreedom;
    if (again) continue;
    rows.push_back({&body, analysis->degreesOfFreedom, analysis->cellSize, seconds,
                    matched(body, analysis->model)});
  }
  return rows;
}

void printModes(const AccuracyRow& row) {
  static constexpr const char* kKinds[] = {"stretching", "bending edgewise", "bending flatwise",
                                           "twisting"};
  for (const Match& match : row.matches)
    std::printf("      %10.2f Hz, theory %10.2f, %+.3f %%%s%s\n", match.found, match.theory,
                100.0 * match.error(), row.body->theory.size() > 1 ? ", " : "",
                row.body->theory.size() > 1 ? kKinds[match.kind] : "");
}

void printRows(const std::vector<AccuracyRow>& rows, bool withModes) {
  for (const AccuracyRow& row : rows) {
    const Vec3 cell = 1e3 * row.cellSize;
    const auto mode = static_cast<std::size_t>(&row.worst() - row.matches.data()) + 1;
    std::printf("%-8s %8zu   %5.2f x %5.2f x %5.2f %9.2f %+9.3f %5zu\n", row.body->name,
                row.degreesOfFreedom, cell.x(), cell.y(), cell.z(), row.seconds,
                100.0 * row.worst().error(), mode);
    if (withModes) printModes(row);
  }
  std::fflush(stdout);
}

bool holds(const AccuracyRow& row) {
  return std::abs(row.worst().error()) <= kBar;
}

// Prints the size from which on the errors are within the bar.
void printSummary(const std::vector<AccuracyRow>& rows) {
  auto first = rows.end();
  while (first != rows.begin() && holds(*(first - 1)))
    --first;
  if (first == rows.end())
    std::printf("%s: not within %g %%\n", rows.front().body->name, 100.0 * kBar);
  else
    std::printf("%s: within %g %% from %zu degrees of freedom on, %.2f s\n", first->body->name,
                100.0 * kBar, first->degreesOfFreedom, first->seconds);
}

bool writeCsv(const char* path, const std::vector<std::vector<AccuracyRow>>& all) {
  std::FILE* const file = std::fopen(path, "w");
  if (file == nullptr) return false;
  std::fprintf(file, "body,degrees_of_freedom,cell_x_m,cell_y_m,cell_z_m,cpu_s,worst_error\n");
  for (const std::vector<AccuracyRow>& rows : all) {
    for (const AccuracyRow& row : rows)
      std::fprintf(file, "%s,%zu,%.6g,%.6g,%.6g,%.4g,%.4g\n", row.body->name, row.degreesOfFreedom,
                   row.cellSize.x(), row.cellSize.y(), row.cellSize.z(), row.seconds,
                   row.worst().error());
  }
  return std::fclose(file) == 0;
}

int run(const char* csv, bool withModes, const Scale& scale) {
  const std::vector<Body> bodies = {beam(), plate(), sphere(scale), brick(scale)};
  std::vector<std::vector<AccuracyRow>> all;
  std::printf("%-8s %8s %25s %9s %9s %5s\n", "body", "dof", "cell, mm", "time, s", "worst, %",
              "mode");
  for (const Body& body : bodies) {
    all.push_back(measure(body, scale));
    if (all.back().empty()) return 1;
    printRows(all.back(), withModes);
  }
  std::printf("\n");
  for (const std::vector<AccuracyRow>& rows : all)
    printSummary(rows);
  if (csv == nullptr || writeCsv(csv, all)) return 0;
  std::fprintf(stderr, "bench_modal_accuracy: cannot write %s: %s\n", csv, std::strerror(errno));
  return 1;
}

}  // namespace
}  // namespace carom::bench

int main(int argc, char** argv) {
  const char* csv = nullptr;
  bool withModes = false;
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (argument == "--help") {
      std::fputs(carom::bench::kHelp, stdout);
      return 0;
    }
    if (argument == "--short") continue;
    if (argument == "--modes") {
      withModes = true;
    } else if (argument == "--csv" && i + 1 < argc) {
      csv = argv[++i];
    } else {
      std::fprintf(stderr, "bench_modal_accuracy: what is '%s'?\n\n%s", argv[i],
                   carom::bench::kHelp);
      return 2;
    }
  }
  return carom::bench::run(csv, withModes, carom::bench::scaleOf(argc, argv));
}
