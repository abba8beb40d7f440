#include "carom/modal/mesh_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <map>
#include <set>
#include <span>
#include <utility>

#include "modal/mesh/mesh_edges.h"

namespace carom {

using namespace modal;

namespace {

using Triangle = std::array<std::uint32_t, 3>;

constexpr double kLargest = 10.0;    // m
constexpr double kSmallest = 1e-3;   // m
constexpr double kNoArea = 1e-12;    // relative to the extent squared
constexpr double kNoVolume = 1e-12;  // relative to the extent cubed

std::string numberText(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.4g", value);
  return text.data();
}

std::string placeText(const Vec3& point) {
  std::array<char, 96> text{};
  std::snprintf(text.data(), text.size(), "(%.4g, %.4g, %.4g) m", point.x(), point.y(), point.z());
  return text.data();
}

/// Returns "1 edge", "3 edges" and the like.
std::string countText(std::size_t count, const std::string& noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

bool repeatsCorner(const Triangle& triangle) {
  return triangle[0] == triangle[1] || triangle[1] == triangle[2] || triangle[2] == triangle[0];
}

double twiceArea(const SurfaceMesh& mesh, const Triangle& triangle) {
  const Vec3& first = mesh.vertices[triangle[0]];
  return (mesh.vertices[triangle[1]] - first).cross(mesh.vertices[triangle[2]] - first).norm();
}

Triangle sorted(Triangle triangle) {
  std::ranges::sort(triangle);
  return triangle;
}

/// Uses of an edge in one direction, less those in the other.
int balanceOf(std::span<const EdgeUse> uses) {
  int balance = 0;
  for (const EdgeUse& use : uses)
    balance += use.forward ? 1 : -1;
  return balance;
}

// ---- looking

/// A count of faults of one kind, and the place of the first.
struct Tally {
  std::size_t count = 0;
  Vec3 first = Vec3::Zero();

  void add(const Vec3& where) {
    if (count++ == 0) first = where;
  }
};

class Inspector {
 public:
  explicit Inspector(const SurfaceMesh& mesh) : mesh_(mesh) {}

  MeshReport report() {
    checkNumbers();
    if (!report_.findings.empty()) return std::move(report_);
    report_.extent = extentOf(mesh_);
    report_.area = surfaceArea(mesh_);
    report_.volume = signedVolume(mesh_);
    checkEdges();
    checkTriangles();
    checkParts();
    checkExtent();
    std::ranges::stable_sort(report_.findings, {}, &MeshFinding::fault);
    return std::move(report_);
  }

 private:
  void found(MeshFault fault, std::size_t count, std::string text) {
    if (count > 0) report_.findings.push_back({fault, count, std::move(text)});
  }

  void checkNumbers() {
    if (mesh_.triangles.empty())
      found(MeshFault::empty, 1, "the surface has no triangles; expected at least one");
    const auto inRange = [&](std::uint32_t vertex) { return vertex < mesh_.vertices.size(); };
    std::size_t bad = 0;
    std::size_t first = 0;
    for (std::size_t index = 0; index < mesh_.triangles.size(); ++index)
      if (!std::ranges::all_of(mesh_.triangles[index], inRange) && bad++ == 0) first = index;
    found(MeshFault::badIndex, bad,
          countText(bad, "triangle") + ", the first is number " + std::to_string(first) +
              ", with a vertex that is not among the " + std::to_string(mesh_.vertices.size()));
    const auto lost = [](const Vec3& vertex) { return !vertex.allFinite(); };
    const auto at = std::ranges::find_if(mesh_.vertices, lost) - mesh_.vertices.begin();
    const auto count = static_cast<std::size_t>(std::ranges::count_if(mesh_.vertices, lost));
    found(MeshFault::notFinite, count, "vertex " + std::to_string(at) + " is not finite");
  }

  void checkEdges() {
    const MeshEdges edges(mesh_);
    Tally open;
    Tally inconsistent;
    Tally nonManifold;
    for (std::size_t edge = 0; edge < edges.size(); ++edge) {
      const auto uses = edges[edge];
      const Vec3 middle = 0.5 * (mesh_.vertices[uses[0].low] + mesh_.vertices[uses[0].high]);
      if (uses.size() % 2 == 1) open.add(middle);
      if (uses.size() % 2 == 0 && balanceOf(uses) != 0) inconsistent.add(middle);
      if (uses.size() > 2) nonManifold.add(middle);
    }
    found(MeshFault::open, open.count,
          "the surface is open at " + countText(open.count, "edge") + ", the first at " +
              placeText(open.first));
    found(MeshFault::inconsistent, inconsistent.count,
          "neighbours face opposite ways at " + countText(inconsistent.count, "edge") +
              ", the first at " + placeText(inconsistent.first));
    found(MeshFault::nonManifold, nonManifold.count,
          "more than two triangles share each of " + countText(nonManifold.count, "edge") +
              ", the first at " + placeText(nonManifold.first));
    if (open.count + inconsistent.count == 0) checkVolume();
  }

  void checkVolume() {
    const double least = kNoVolume * std::pow(report_.extent, 3.0);
    if (std::abs(report_.volume) <= least) {
      found(MeshFault::noVolume, 1, "the surface is closed, but nothing is inside of it");
    } else if (report_.volume < 0.0) {
      found(MeshFault::insideOut, 1,
            "the surface is inside out: its volume is " + numberText(report_.volume) + " m^3");
    }
  }

  void checkTriangles() {
    const double least = kNoArea * report_.extent * report_.extent;
    Tally degenerate;
    Tally duplicate;
    std::set<Triangle> seen;
    for (const Triangle& triangle : mesh_.triangles) {
      const Vec3& where = mesh_.vertices[triangle[0]];
      if (!(twiceArea(mesh_, triangle) > least)) degenerate.add(where);
      if (!seen.insert(sorted(triangle)).second) duplicate.add(where);
    }
    found(MeshFault::degenerate, degenerate.count,
          countText(degenerate.count, "triangle") + " without area, the first at " +
              placeText(degenerate.first));
    found(MeshFault::duplicate, duplicate.count,
          countText(duplicate.count, "triangle") +
              " with the same corners as another one, the first at " + placeText(duplicate.first));
  }

  void checkParts() {
    const std::vector<std::uint32_t> part = partsOf(mesh_);
    std::map<std::uint32_t, std::size_t> sizes;
    for (const Triangle& triangle : mesh_.triangles)
      ++sizes[part[triangle[0]]];
    for (const auto& [name, size] : sizes)
      report_.parts.push_back(size);
    std::ranges::sort(report_.parts, std::greater());
    if (report_.parts.size() < 2) return;
    found(MeshFault::parts, report_.parts.size(),
          "the surface is in " + std::to_string(report_.parts.size()) +
              " parts that share no vertex, the largest of " +
              countText(report_.parts.front(), "triangle") + ", the smallest of " +
              std::to_string(report_.parts.back()));
  }

  void checkExtent() {
    const std::string size = numberText(report_.extent) + " m from end to end: ";
    if (report_.extent > kLargest)
      found(MeshFault::tooLarge, 1, size + "is it in millimetres? use --scale 0.001");
    if (report_.extent < kSmallest)
      found(MeshFault::tooSmall, 1, size + "is it in kilometres, or scaled twice? use --scale");
  }

  const SurfaceMesh& mesh_;
  MeshReport report_;
};

// ---- mending

/// Drops triangles that have a corner twice, and all but one of equal triangles that face the same
/// way.
void dropTriangles(MendedMesh& mesh) {
  std::set<Triangle> seen;
  std::vector<Triangle> kept;
  for (const Triangle& triangle : mesh.surface.triangles) {
    Triangle turned = triangle;
    std::rotate(turned.begin(), std::ranges::min_element(turned), turned.end());
    if (repeatsCorner(triangle)) {
      ++mesh.degenerate;
    } else if (!seen.insert(turned).second) {
      ++mesh.duplicate;
    } else {
      kept.push_back(triangle);
    }
  }
  mesh.surface.triangles = std::move(kept);
}

/// Returns the side of the triangle, 0 to 2, whose ends are those of the edge; 3 if there is none.
std::size_t sideOf(const Triangle& triangle, const EdgeUse& use) {
  for (std::size_t side = 0; side < 3; ++side) {
    const auto [low, high] = std::minmax(triangle[side], triangle[(side + 1) % 3]);
    if (low == use.low && high == use.high) return side;
  }
  return 3;
}

std::size_t longestSide(const SurfaceMesh& mesh, const Triangle& triangle) {
  std::array<double, 3> lengths{};
  for (std::size_t side = 0; side < 3; ++side)
    lengths[side] =
        (mesh.vertices[triangle[(side + 1) % 3]] - mesh.vertices[triangle[side]]).norm();
  return static_cast<std::size_t>(std::ranges::max_element(lengths) - lengths.begin());
}

/// Flips the longest edge of each needle. That edge carries the needle's third vertex: an edge from
/// there to the far corner of the neighbour makes two triangles with area of the two, and moves
/// nothing.
void flipNeedles(MendedMesh& mended) {
  SurfaceMesh& mesh = mended.surface;
  const double extent = extentOf(mesh);
  const MeshEdges edges(mesh);
  std::vector<bool> done(mesh.triangles.size(), false);
  for (std::size_t edge = 0; edge < edges.size(); ++edge) {
    const auto uses = edges[edge];
    if (uses.size() != 2 || balanceOf(uses) != 0) continue;
    for (const auto& [use, other] : {std::pair(uses[0], uses[1]), std::pair(uses[1], uses[0])}) {
      Triangle& needle = mesh.triangles[use.triangle];
      Triangle& neighbour = mesh.triangles[other.triangle];
      if (done[use.triangle] || done[other.triangle]) continue;
      const std::size_t side = sideOf(needle, use);
      if (twiceArea(mesh, needle) > kNoArea * extent * extent) continue;
      if (side != longestSide(mesh, needle)) continue;
      const std::uint32_t from = needle[side];
      const std::uint32_t to = needle[(side + 1) % 3];
      const std::uint32_t tip = needle[(side + 2) % 3];
      const std::uint32_t far = neighbour[(sideOf(neighbour, other) + 2) % 3];
      if (far == tip) continue;
      needle = {tip, from, far};
      neighbour = {far, to, tip};
      done[use.triangle] = done[other.triangle] = true;
      ++mended.flipped;
    }
  }
}

void turn(Triangle& triangle) {
  std::swap(triangle[1], triangle[2]);
}

/// The pieces of a surface that hang together by edges of two triangles, and the triangles that
/// face the other way than the first of their piece.
class Facing {
 public:
  explicit Facing(const SurfaceMesh& mesh)
      : neighbours_(mesh.triangles.size()),
        piece_(mesh.triangles.size(), kNone),
        against_(mesh.triangles.size(), false) {
    const MeshEdges edges(mesh);
    for (std::size_t edge = 0; edge < edges.size(); ++edge) {
      const auto uses = edges[edge];
      if (uses.size() != 2) continue;
      const bool same = uses[0].forward != uses[1].forward;
      neighbours_[uses[0].triangle].push_back({uses[1].triangle, same});
      neighbours_[uses[1].triangle].push_back({uses[0].triangle, same});
    }
    for (std::uint32_t first = 0; first < piece_.size(); ++first)
      if (piece_[first] == kNone) flood(first);
  }

  /// Returns the minority of each piece; for a band with one side, the choice is arbitrary.
  std::vector<std::uint32_t> toTurn() const {
    std::vector<std::size_t> sizes(pieces_, 0);
    std::vector<std::size_t> against(pieces_, 0);
    for (std::size_t index = 0; index < piece_.size(); ++index) {
      ++sizes[piece_[index]];
      if (against_[index]) ++against[piece_[index]];
    }
    std::vector<std::uint32_t> result;
    for (std::uint32_t index = 0; index < piece_.size(); ++index) {
      const std::uint32_t piece = piece_[index];
      const bool most = 2 * against[piece] > sizes[piece];
      if (against_[index] != most) result.push_back(index);
    }
    return result;
  }

 private:
  static constexpr std::uint32_t kNone = 0xffffffffU;
  struct Neighbour {
    std::uint32_t triangle;
    bool same;  // true if it faces the same way
  };

  void flood(std::uint32_t first) {
    piece_[first] = pieces_;
    std::vector<std::uint32_t> open = {first};
    while (!open.empty()) {
      const std::uint32_t here = open.back();
      open.pop_back();
      for (const Neighbour& next : neighbours_[here]) {
        if (piece_[next.triangle] != kNone) continue;
        piece_[next.triangle] = pieces_;
        against_[next.triangle] = against_[here] == next.same;
        open.push_back(next.triangle);
      }
    }
    ++pieces_;
  }

  std::vector<std::vector<Neighbour>> neighbours_;
  std::vector<std::uint32_t> piece_;
  std::vector<bool> against_;
  std::uint32_t pieces_ = 0;
};

/// One part of the surface by itself.
struct Part {
  std::vector<std::uint32_t> triangles;
  Vec3 low, high;

  bool holds(const Part& other) const {
    return (low.array() <= other.low.array()).all() && (high.array() >= other.high.array()).all();
  }
};

std::vector<Part> separate(const SurfaceMesh& mesh) {
  const std::vector<std::uint32_t> names = partsOf(mesh);
  std::map<std::uint32_t, Part> parts;
  for (std::uint32_t index = 0; index < mesh.triangles.size(); ++index) {
    const Vec3& first = mesh.vertices[mesh.triangles[index][0]];
    Part& part =
        parts.try_emplace(names[mesh.triangles[index][0]], Part{{}, first, first}).first->second;
    part.triangles.push_back(index);
    for (const std::uint32_t corner : mesh.triangles[index]) {
      part.low = part.low.cwiseMin(mesh.vertices[corner]);
      part.high = part.high.cwiseMax(mesh.vertices[corner]);
    }
  }
  std::vector<Part> result;
  result.reserve(parts.size());
  for (auto& [name, part] : parts)
    result.push_back(std::move(part));
  return result;
}

bool isInsideOut(const SurfaceMesh& mesh, const Part& part) {
  SurfaceMesh alone{mesh.vertices, {}};
  for (const std::uint32_t index : part.triangles)
    alone.triangles.push_back(mesh.triangles[index]);
  return closedSurface(alone) && signedVolume(alone) < 0.0;
}

/// Turns each outermost part that is inside out, and with it the parts that lie in its box.
void turnOutward(MendedMesh& mended) {
  constexpr std::size_t kMostParts = 1000;  // each is compared with each
  const std::vector<Part> parts = separate(mended.surface);
  if (parts.size() > kMostParts) return;
  std::vector<bool> turned(mended.surface.triangles.size(), false);
  for (const Part& part : parts) {
    const auto holdsIt = [&](const Part& other) { return &other != &part && other.holds(part); };
    if (std::ranges::any_of(parts, holdsIt) || !isInsideOut(mended.surface, part)) continue;
    for (const Part& inner : parts) {
      if (!part.holds(inner)) continue;
      for (const std::uint32_t index : inner.triangles)
        turned[index] = true;
    }
  }
  for (std::size_t index = 0; index < turned.size(); ++index) {
    if (!turned[index]) continue;
    turn(mended.surface.triangles[index]);
    ++mended.turned;
  }
}

constexpr std::array<std::pair<MeshFault, std::string_view>, 13> kNames = {{
    {MeshFault::empty, "empty"},
    {MeshFault::badIndex, "bad_index"},
    {MeshFault::notFinite, "not_finite"},
    {MeshFault::open, "open_surface"},
    {MeshFault::inconsistent, "inconsistent_orientation"},
    {MeshFault::insideOut, "inside_out"},
    {MeshFault::noVolume, "no_volume"},
    {MeshFault::degenerate, "degenerate_triangles"},
    {MeshFault::duplicate, "duplicate_triangles"},
    {MeshFault::parts, "disconnected_parts"},
    {MeshFault::nonManifold, "non_manifold_edges"},
    {MeshFault::tooLarge, "too_large"},
    {MeshFault::tooSmall, "too_small"},
}};

}  // namespace

std::string_view nameOf(MeshFault fault) {
  return std::ranges::find(kNames, fault, &std::pair<MeshFault, std::string_view>::first)->second;
}

const MeshFinding* MeshReport::find(MeshFault fault) const {
  const auto found = std::ranges::find(findings, fault, &MeshFinding::fault);
  return found != findings.end() ? &*found : nullptr;
}

MeshReport checkMesh(const SurfaceMesh& mesh) {
  return Inspector(mesh).report();
}

Status needSolid(const MeshReport& report) {
  std::string reasons;
  for (const MeshFinding& finding : report.findings)
    if (finding.fault <= MeshFault::noVolume)
      reasons += (reasons.empty() ? "" : "; ") + finding.text;
  if (reasons.empty()) return std::monostate{};
  return Error{"a solid needs a closed surface that faces outwards: " + reasons};
}

MendedMesh mended(const SurfaceMesh& mesh) {
  MendedMesh result;
  result.surface = mesh;
  dropTriangles(result);
  flipNeedles(result);
  for (const std::uint32_t index : Facing(result.surface).toTurn()) {
    turn(result.surface.triangles[index]);
    ++result.turned;
  }
  turnOutward(result);
  result.surface = withoutUnused(std::move(result.surface));
  return result;
}

}  // namespace carom
