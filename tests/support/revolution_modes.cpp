#include "tests/support/revolution_modes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

namespace carom::test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Vector2 = Eigen::Vector2d;

constexpr int kAlong = 4;  // orders of the elements; equal, so that those of a corner fit
constexpr int kAcross = 4;
constexpr double kSame = 1e-9;  // m, distance of nodes that are one

struct Rule {
  VectorXd at;  // from 0 to 1
  VectorXd weight;
};

Rule gaussRule(int points) {
  MatrixXd jacobi = MatrixXd::Zero(points, points);
  for (int row = 1; row < points; ++row)
    jacobi(row, row - 1) = jacobi(row - 1, row) = row / std::sqrt(4.0 * row * row - 1.0);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solved(jacobi);
  return {(solved.eigenvalues().array() + 1.0) / 2.0,
          solved.eigenvectors().row(0).array().square().transpose()};
}

// Lagrange's polynomials on Chebyshev's points from 0 to 1, by their coefficients in powers.
struct Lagrange {
  explicit Lagrange(int order) : nodes(order + 1) {
    MatrixXd powers(order + 1, order + 1);
    for (int node = 0; node <= order; ++node) {
      nodes[node] = 0.5 - 0.5 * std::cos(std::numbers::pi * node / order);
      for (int power = 0; power <= order; ++power)
        powers(node, power) = std::pow(nodes[node], power);
    }
    coefficients = powers.inverse();  // one column for each polynomial
  }
  VectorXd values(double at) const {
    VectorXd powers(nodes.size());
    for (Index power = 0; power < powers.size(); ++power)
      powers[power] = std::pow(at, static_cast<double>(power));
    return coefficients.transpose() * powers;
  }
  VectorXd slopes(double at) const {
    VectorXd powers = VectorXd::Zero(nodes.size());
    for (Index power = 1; power < powers.size(); ++power)
      powers[power] = static_cast<double>(power) * std::pow(at, static_cast<double>(power - 1));
    return coefficients.transpose() * powers;
  }
  VectorXd nodes;
  MatrixXd coefficients;
};

// A point of quadrature of an element: shape functions, and their slopes by radius and height.
struct SectionPoint {
  double radius = 0.0;
  double weight = 0.0;  // m^2
  VectorXd shapes, byRadius, byHeight;
};

struct SectionElement {
  std::vector<Index> nodes;
  std::vector<SectionPoint> points;
};

struct Section {
  std::vector<Vector2> nodes;
  std::vector<SectionElement> elements;
};

Index nodeAt(Section& section, const Vector2& at) {
  for (std::size_t node = 0; node < section.nodes.size(); ++node)
    if ((section.nodes[node] - at).norm() < kSame) return static_cast<Index>(node);
  section.nodes.push_back(at);
  return std::ssize(section.nodes) - 1;
}

SectionElement elementOf(Section& section, const SectionPart& part, int element) {
  static const Lagrange along(kAlong);
  static const Lagrange across(kAcross);
  static const Rule ruleAlong = gaussRule(kAlong + 2);
  static const Rule ruleAcross = gaussRule(kAcross + 2);
  const double step = 1.0 / part.elements;
  SectionElement made;
  std::vector<Vector2> places;
  for (int j = 0; j <= kAcross; ++j) {
    for (int i = 0; i <= kAlong; ++i) {
      places.push_back(part.at((element + along.nodes[i]) * step, across.nodes[j]));
      made.nodes.push_back(nodeAt(section, places.back()));
    }
  }
  for (Index i = 0; i < ruleAlong.at.size(); ++i) {
    for (Index j = 0; j < ruleAcross.at.size(); ++j) {
      const VectorXd a = along.values(ruleAlong.at[i]);
      const VectorXd b = across.values(ruleAcross.at[j]);
      const VectorXd slopeA = along.slopes(ruleAlong.at[i]);
      const VectorXd slopeB = across.slopes(ruleAcross.at[j]);
      const Index count = std::ssize(places);
      SectionPoint point;
      point.shapes.resize(count);
      MatrixXd slopes(count, 2);
      Vector2 at = Vector2::Zero();
      Eigen::Matrix2d map = Eigen::Matrix2d::Zero();
      for (Index node = 0; node < count; ++node) {
        const Index one = node % (kAlong + 1);
        const Index other = node / (kAlong + 1);
        point.shapes[node] = a[one] * b[other];
        slopes.row(node) << slopeA[one] * b[other], a[one] * slopeB[other];
        at += point.shapes[node] * places[static_cast<std::size_t>(node)];
        map += places[static_cast<std::size_t>(node)] * slopes.row(node);
      }
      const MatrixXd inPlane = slopes * map.inverse();
      point.radius = at.x();
      point.weight = std::abs(map.determinant()) * ruleAlong.weight[i] * ruleAcross.weight[j];
      point.byRadius = inPlane.col(0);
      point.byHeight = inPlane.col(1);
      made.points.push_back(std::move(point));
    }
  }
  return made;
}

// Strains (radial, axial, hoop, and the shears r z, r theta, z theta) of the displacements
// u_r = U cos n theta, u_theta = V sin n theta, u_z = W cos n theta; columns are U, V, W by node.
MatrixXd strainsOf(const SectionPoint& point, int n) {
  const Index count = point.shapes.size();
  MatrixXd strains = MatrixXd::Zero(6, 3 * count);
  for (Index node = 0; node < count; ++node) {
    const double shape = point.shapes[node] / point.radius;
    const double r = point.byRadius[node];
    const double z = point.byHeight[node];
    const Index u = 3 * node;
    strains(0, u) = r;
    strains(1, u + 2) = z;
    strains(2, u) = shape;
    strains(2, u + 1) = n * shape;
    strains(3, u) = z;
    strains(3, u + 2) = r;
    strains(4, u) = -n * shape;
    strains(4, u + 1) = r - shape;
    strains(5, u + 1) = z;
    strains(5, u + 2) = -n * shape;
  }
  return strains;
}

// Rows: degrees of freedom of all nodes; columns: those that stay on the axis, where a body hangs
// together.
MatrixXd freedomOf(const Section& section, int n) {
  std::vector<std::pair<Index, Index>> kept;  // row, and the row that is its negative, or -1
  for (std::size_t node = 0; node < section.nodes.size(); ++node) {
    const Index u = 3 * static_cast<Index>(node);
    if (section.nodes[node].x() > kSame) {
      for (Index axis = 0; axis < 3; ++axis)
        kept.emplace_back(u + axis, -1);
    } else if (n == 0) {
      kept.emplace_back(u + 2, -1);
    } else if (n == 1) {
      kept.emplace_back(u, u + 1);
    }
  }
  MatrixXd freedom = MatrixXd::Zero(3 * std::ssize(section.nodes), std::ssize(kept));
  for (std::size_t column = 0; column < kept.size(); ++column) {
    freedom(kept[column].first, static_cast<Index>(column)) = 1.0;
    if (kept[column].second >= 0) freedom(kept[column].second, static_cast<Index>(column)) = -1.0;
  }
  return freedom;
}

std::vector<double> frequenciesOf(const Section& section, const Material& material, int n) {
  const double nu = material.poissonsRatio;
  const double mu = material.youngsModulus / (2.0 * (1.0 + nu));
  const double lambda = 2.0 * mu * nu / (1.0 - 2.0 * nu);
  Eigen::Matrix<double, 6, 6> law = Eigen::Matrix<double, 6, 6>::Zero();
  law.topLeftCorner<3, 3>().setConstant(lambda);
  law.diagonal() << lambda + 2.0 * mu, lambda + 2.0 * mu, lambda + 2.0 * mu, mu, mu, mu;
  const Index rows = 3 * std::ssize(section.nodes);
  MatrixXd stiffness = MatrixXd::Zero(rows, rows);
  MatrixXd mass = MatrixXd::Zero(rows, rows);
  for (const SectionElement& element : section.elements) {
    const Index count = std::ssize(element.nodes);
    MatrixXd ownStiffness = MatrixXd::Zero(3 * count, 3 * count);
    MatrixXd ownMass = MatrixXd::Zero(count, count);
    for (const SectionPoint& point : element.points) {
      const MatrixXd strains = strainsOf(point, n);
      const double weight = point.weight * point.radius;
      ownStiffness += weight * strains.transpose() * (law * strains);
      ownMass += material.density * weight * point.shapes * point.shapes.transpose();
    }
    for (Index i = 0; i < count; ++i) {
      for (Index j = 0; j < count; ++j) {
        const Index row = 3 * element.nodes[static_cast<std::size_t>(i)];
        const Index column = 3 * element.nodes[static_cast<std::size_t>(j)];
        stiffness.block<3, 3>(row, column) += ownStiffness.block<3, 3>(3 * i, 3 * j);
        mass.block<3, 3>(row, column).diagonal().array() += ownMass(i, j);
      }
    }
  }
  const MatrixXd freedom = freedomOf(section, n);
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> solved(
      freedom.transpose() * stiffness * freedom, freedom.transpose() * mass * freedom,
      Eigen::EigenvaluesOnly);
  std::vector<double> frequencies;
  for (const double square : solved.eigenvalues())
    frequencies.push_back(std::sqrt(std::max(square, 0.0)) / (2.0 * std::numbers::pi));
  return frequencies;
}

// ---- Bodies

// A wall about a middle line, of a thickness that may vary along it.
struct Wall {
  std::function<Vector2(double)> middle;
  std::function<double(double)> thickness;
};

SectionPart partOf(const Wall& wall, int elements) {
  const auto at = [wall](double along, double across) -> Vector2 {
    constexpr double kStep = 1e-5;
    const double before = std::max(along - kStep, 0.0);
    const double after = std::min(along + kStep, 1.0);
    const Vector2 way = (wall.middle(after) - wall.middle(before)).normalized();
    Vector2 place =
        wall.middle(along) + (across - 0.5) * wall.thickness(along) * Vector2(-way.y(), way.x());
    if (wall.middle(along).x() < kSame) place.x() = 0.0;
    return place;
  };
  return {at, elements};
}

// Along one side of the wall and back along the other.
std::vector<Vector2> outlineOf(const SectionPart& part, int edges) {
  std::vector<Vector2> outline;
  for (int edge = 0; edge <= edges; ++edge)
    outline.push_back(part.at(static_cast<double>(edge) / edges, 0.0));
  for (int edge = edges; edge >= 0; --edge)
    outline.push_back(part.at(static_cast<double>(edge) / edges, 1.0));
  return outline;
}

RevolvedBody walled(const char* name, const Wall& wall, int edges) {
  RevolvedBody body{.name = name, .section = {partOf(wall, 9)}, .outline = {}};
  body.outline = outlineOf(body.section.front(), edges);
  return body;
}

std::function<double(double)> evenly(double thickness) {
  return [thickness](double) { return thickness; };
}

struct CupSize {
  double radius = 0.0;  // m, outside
  double height = 0.0;  // m
  double wall = 0.0;    // m
  double bottom = 0.0;  // m
};

// Elements get smaller towards the corner inside, at which stress is singular.
RevolvedBody cup(const char* name, const CupSize& size) {
  const auto rectangle = [](const Vector2& low, const Vector2& high, bool upright) {
    return [=](double along, double across) -> Vector2 {
      const Vector2 share = upright ? Vector2(across, along) : Vector2(along, across);
      return low + share.cwiseProduct(high - low);
    };
  };
  const auto& [radius, height, wall, bottom] = size;
  const double inside = radius - wall;
  const double far = inside - 2.0 * wall;
  const double near = inside - 0.5 * wall;
  return {
      .name = name,
      .section = {{rectangle({0.0, 0.0}, {far, bottom}, false), 6},
                  {rectangle({far, 0.0}, {near, bottom}, false), 2},
                  {rectangle({near, 0.0}, {inside, bottom}, false), 2},
                  {rectangle({inside, 0.0}, {radius, bottom}, false), 1},
                  {rectangle({inside, bottom}, {radius, bottom + 0.5 * wall}, true), 2},
                  {rectangle({inside, bottom + 0.5 * wall}, {radius, bottom + 2.0 * wall}, true),
                   2},
                  {rectangle({inside, bottom + 2.0 * wall}, {radius, height}, true), 9}},
      .outline = {{0.0, 0.0},
                  {radius, 0.0},
                  {radius, height},
                  {inside, height},
                  {inside, bottom},
                  {0.0, bottom}}};
}

}  // namespace

std::vector<double> revolutionFrequencies(const RevolvedBody& body, const Material& material,
                                          std::size_t count) {
  constexpr int kHarmonics = 14;
  Section section;
  for (const SectionPart& part : body.section)
    for (int element = 0; element < part.elements; ++element)
      section.elements.push_back(elementOf(section, part, element));
  std::vector<double> all;
  double lowestBefore = 0.0;
  for (int n = 0; n < kHarmonics; ++n) {
    const std::vector<double> found = frequenciesOf(section, material, n);
    // A wall that bends in more waves is stiffer; it only stretches less up to some number of them.
    std::sort(all.begin(), all.end());
    const bool isAbove = n > 2 && all.size() >= count && found.front() > all[count - 1];
    if (isAbove && found.front() > lowestBefore) break;
    lowestBefore = found.front();
    // Two motions of a rigid body are of n = 0, and two pairs of n = 1.
    const std::size_t rigid = n < 2 ? 2 : 0;
    for (std::size_t mode = rigid; mode < std::min(found.size(), rigid + count); ++mode)
      all.insert(all.end(), n == 0 ? 1 : 2, found[mode]);
  }
  std::sort(all.begin(), all.end());
  all.resize(std::min(all.size(), count));
  return all;
}

SurfaceMesh revolvedMesh(const RevolvedBody& body, int sides) {
  SurfaceMesh mesh;
  std::vector<std::vector<std::uint32_t>> rings;
  for (const Vector2& corner : body.outline) {
    std::vector<std::uint32_t> ring;
    const bool isOnAxis = corner.x() < kSame;
    for (int side = 0; side < sides; ++side) {
      if (side == 0 || !isOnAxis) {
        const double angle = 2.0 * std::numbers::pi * side / sides;
        mesh.vertices.emplace_back(corner.x() * std::cos(angle), corner.x() * std::sin(angle),
                                   corner.y());
      }
      ring.push_back(static_cast<std::uint32_t>(mesh.vertices.size() - 1));
    }
    rings.push_back(std::move(ring));
  }
  const bool isClosed = body.outline.front().x() > kSame;
  const std::size_t strips = rings.size() - (isClosed ? 0 : 1);
  for (std::size_t strip = 0; strip < strips; ++strip) {
    const auto& low = rings[strip];
    const auto& high = rings[(strip + 1) % rings.size()];
    for (std::size_t side = 0; side < low.size(); ++side) {
      const std::size_t next = (side + 1) % low.size();
      if (low[side] != low[next]) mesh.triangles.push_back({low[side], low[next], high[side]});
      if (high[side] != high[next]) mesh.triangles.push_back({low[next], high[next], high[side]});
    }
  }
  if (signedVolume(mesh) > 0.0) return mesh;
  for (auto& triangle : mesh.triangles)
    std::swap(triangle[1], triangle[2]);
  return mesh;
}

std::vector<RevolvedBody> revolvedBodies() {
  constexpr double kHalfTurn = std::numbers::pi;
  const Wall bowl{[](double along) -> Vector2 {
                    const double angle = 0.5 * kHalfTurn * along;
                    return {0.0559 * std::sin(angle), -0.0434 * std::cos(angle)};
                  },
                  evenly(0.0032)};
  const Wall cap{[](double along) -> Vector2 {
                   const double angle = 50.0 / 180.0 * kHalfTurn * along;
                   return {0.06 * std::sin(angle), -0.06 * std::cos(angle)};
                 },
                 evenly(0.002)};
  const Wall cone{[](double along) -> Vector2 {
                    return {0.02 + 0.04 * along, 0.08 * along};
                  },
                  evenly(0.002)};
  // A glass without its stem: steep, narrower towards the rim, and thicker at the bottom.
  const Wall glass{[](double along) -> Vector2 {
                     const double angle = 0.72 * kHalfTurn * along;
                     return {0.038 * std::sin(angle), -0.055 * std::cos(angle)};
                   },
                   [](double along) { return 0.003 - 0.0016 * along; }};
  const Wall tube{[](double along) -> Vector2 { return {0.015, 0.15 * along}; }, evenly(0.002)};
  const Wall ring{[](double along) -> Vector2 { return {0.05, 0.012 * along}; }, evenly(0.005)};
  return {
      walled("bowl", bowl, 40), walled("cap", cap, 32),     cup("cup", {0.04, 0.09, 0.003, 0.003}),
      walled("cone", cone, 1),  walled("glass", glass, 40), walled("tube", tube, 1),
      walled("ring", ring, 1)};
}

std::vector<RevolvedBody> otherCups() {
  return {cup("dish", {0.06, 0.025, 0.0025, 0.0025}), cup("pot", {0.08, 0.07, 0.002, 0.003}),
          cup("lid", {0.05, 0.012, 0.003, 0.002})};
}

}  // namespace carom::test
