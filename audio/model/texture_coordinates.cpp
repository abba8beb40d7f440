#include "carom/audio/texture_coordinates.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>

#include <Eigen/Geometry>

#include "audio/model/positive.h"
#include "audio/model/surface_locator.h"

namespace carom {

using namespace audio;

namespace {

Status validate(const SurfaceMesh& mesh, const std::vector<TextureCoordinates::Corners>& corners) {
  if (mesh.triangles.empty()) return Error{"the mesh has no triangles"};
  if (corners.size() != mesh.triangles.size())
    return Error{std::to_string(corners.size()) + " triangles have coordinates; expected all " +
                 std::to_string(mesh.triangles.size())};
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t vertex : triangle)
      if (vertex >= mesh.vertices.size())
        return Error{"a triangle names vertex " + std::to_string(vertex) + " of " +
                     std::to_string(mesh.vertices.size())};
  for (const Vec3& vertex : mesh.vertices)
    if (!vertex.allFinite()) return Error{"a vertex is not finite"};
  for (std::size_t index = 0; index < corners.size(); ++index)
    for (const Vec2& corner : corners[index])
      if (!corner.allFinite())
        return Error{"a coordinate of triangle " + std::to_string(index) + " is not finite"};
  return std::monostate{};
}

}  // namespace

TextureCoordinates::TextureCoordinates(SurfaceMesh mesh, std::vector<Corners> corners)
    : mesh_(std::make_unique<const SurfaceMesh>(std::move(mesh))),
      corners_(std::move(corners)),
      locator_(std::make_unique<const SurfaceLocator>(*mesh_)) {}

TextureCoordinates::TextureCoordinates(TextureCoordinates&&) noexcept = default;
TextureCoordinates& TextureCoordinates::operator=(TextureCoordinates&&) noexcept = default;
TextureCoordinates::~TextureCoordinates() = default;

Result<TextureCoordinates> TextureCoordinates::of(SurfaceMesh mesh, std::vector<Corners> corners) {
  if (const Status valid = validate(mesh, corners); !valid)
    return Error{"texture coordinates: " + valid.error().message};
  TextureCoordinates made(std::move(mesh), std::move(corners));
  double area = 0.0;
  Vec2 pictures = Vec2::Zero();  // m, area times pictures per metre
  bool isSeen = false;
  for (std::size_t index = 0; index < made.mesh_->triangles.size(); ++index) {
    const auto& [a, b, c] = made.mesh_->triangles[index];
    const std::vector<Vec3>& vertices = made.mesh_->vertices;
    const double twice = (vertices[b] - vertices[a]).cross(vertices[c] - vertices[a]).norm();
    const Patch patch = made.patchOf(index);
    if (!isPositive(twice) || !patch.perMetre.allFinite()) continue;
    area += 0.5 * twice;
    pictures += 0.5 * twice * patch.perMetre.rowwise().norm();
    isSeen = isSeen || patch.stretch > 0.0;
  }
  const Vec2 size = area * pictures.cwiseInverse();
  if (!isSeen || !isPositive(size.x()) || !isPositive(size.y()))
    return Error{"texture coordinates: they lie in one line all over the mesh"};
  made.size_ = size;
  return made;
}

/// Returns the patch of a triangle without its `at`; lengths on the texture are by the present
/// size_.
TextureCoordinates::Patch TextureCoordinates::patchOf(std::size_t triangle) const {
  const auto& [a, b, c] = mesh_->triangles[triangle];
  const Vec3 first = mesh_->vertices[b] - mesh_->vertices[a];
  const Vec3 second = mesh_->vertices[c] - mesh_->vertices[a];
  const Vec3 across = first.cross(second);
  const Corners& corners = corners_[triangle];
  const Vec2 alongFirst = size_.cwiseProduct(corners[1] - corners[0]);
  const Vec2 alongSecond = size_.cwiseProduct(corners[2] - corners[0]);
  const double turned = alongFirst.x() * alongSecond.y() - alongFirst.y() * alongSecond.x();
  Patch patch;
  // The map is made of the edges that are dual to the triangle's own.
  patch.perMetre = (alongFirst * second.cross(across).transpose() +
                    alongSecond * across.cross(first).transpose()) /
                   across.squaredNorm();
  const double stretch = std::sqrt(std::abs(turned) / across.norm());
  if (!isPositive(stretch) || !patch.perMetre.allFinite()) return patch;
  patch.stretch = stretch;
  // To the right v stays the same, and up is the side on which v grows, in a mirrored picture too.
  const double side = std::copysign(1.0, turned);
  const Vec3 right = side * (alongSecond.y() * first - alongFirst.y() * second).normalized();
  patch.tangents.row(0) = right;
  patch.tangents.row(1) = side * across.normalized().cross(right);
  return patch;
}

TextureCoordinates::Patch TextureCoordinates::at(const Vec3& point) const {
  const SurfacePoint found = locator_->nearest(point);
  Patch patch = patchOf(found.triangle);
  const auto& triangle = mesh_->triangles[found.triangle];
  const Corners& corners = corners_[found.triangle];
  for (std::size_t index = 0; index < corners.size(); ++index) {
    // In a triangle without area the locator finds one vertex, thrice.
    const auto corner = std::ranges::find(triangle, found.vertices[index]) - triangle.begin();
    patch.at +=
        found.weights[index] * size_.cwiseProduct(corners[static_cast<std::size_t>(corner)]);
  }
  return patch;
}

}  // namespace carom
