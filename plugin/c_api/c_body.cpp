#include "plugin/c_api/c_body.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <string>
#include <utility>

#include "audio/radiation/panel_mesh.h"
#include "carom/audio/surface_mesh.h"
#include "plugin/c_api/c_handles.h"
#include "plugin/c_api/c_structs.h"

namespace carom::plugin {

using namespace audio;

namespace {

using Eigen::Matrix3d;

/// Largest distance of a mesh's centroid from the origin, as a share of the cube root of the
/// volume, with which the library computes its inertia.
constexpr double kOffCentre = 0.05;

Status validate(const carom_body& input) {
  if (input.shape < CAROM_SHAPE_SPHERE || input.shape > CAROM_SHAPE_MESH)
    return Error{"shape is " + std::to_string(input.shape) +
                 "; expected a CAROM_SHAPE_..., 0 to 2"};
  if (input.reserved != 0) return Error{"reserved is not 0"};
  if (!(input.mass > 0.0))
    return Error{"mass is " + std::to_string(input.mass) + "; expected kg, > 0, or INFINITY"};
  return std::monostate{};
}

Result<Material> materialOf(const carom_body& input) {
  return input.own_material != nullptr ? materialFrom(input.own_material)
                                       : materialNamed(input.material);
}

Result<SurfaceMesh> boxMesh(const double (&halfExtents)[3]) {
  const Vec3 half(halfExtents[0], halfExtents[1], halfExtents[2]);
  if (!half.allFinite() || !(half.minCoeff() > 0.0))
    return Error{"half_extents must be positive (m)"};
  SurfaceMesh box;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 sign((corner & 1) != 0 ? 1.0 : -1.0, (corner & 2) != 0 ? 1.0 : -1.0,
                    (corner & 4) != 0 ? 1.0 : -1.0);
    box.vertices.push_back(sign.cwiseProduct(half));
  }
  box.triangles = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}, {0, 1, 5}, {0, 5, 4},
                   {2, 6, 7}, {2, 7, 3}, {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};
  return box;
}

Result<SurfaceMesh> meshOf(const carom_body& input) {
  return meshFrom({.size = sizeof(carom_mesh),
                   .vertices = input.vertices,
                   .vertex_count = input.vertex_count,
                   .triangles = input.triangles,
                   .triangle_count = input.triangle_count});
}

Result<SurfaceMesh> surfaceOf(const carom_body& input) {
  return input.shape == CAROM_SHAPE_BOX ? boxMesh(input.half_extents) : meshOf(input);
}

/// Inertia (kg m^2) about the origin of a solid of even density.
Result<Matrix3d> evenInertia(const SurfaceMesh& solid, double mass) {
  const double volume = signedVolume(solid);
  const double distance = volumeCentroid(solid).norm();
  if (!(distance <= kOffCentre * std::cbrt(volume)))
    return Error{"inertia is not given, and the centroid of the mesh lies " +
                 std::to_string(distance) +
                 " m from the origin, which must be the centre of mass: move it there, or give it"};
  const Matrix3d moment = secondMoment(solid, Vec3::Zero());
  return Matrix3d(mass / volume * (moment.trace() * Matrix3d::Identity() - moment));
}

/// True if a matrix is diagonal, also with an infinite diagonal, for which Eigen's own test fails.
bool isDiagonal(const Matrix3d& matrix) {
  const auto offDiagonal = [&](int row) {
    return matrix(row, (row + 1) % 3) != 0.0 || matrix(row, (row + 2) % 3) != 0.0;
  };
  return !offDiagonal(0) && !offDiagonal(1) && !offDiagonal(2);
}

/// True if a symmetric matrix is positive definite, by its leading minors (Sylvester).
bool isPositiveDefinite(const Matrix3d& matrix) {
  return matrix(0, 0) > 0.0 && matrix.topLeftCorner<2, 2>().determinant() > 0.0 &&
         matrix.determinant() > 0.0;
}

Result<Matrix3d> inverseOf(const Matrix3d& inertia) {
  const Error wrong{"inertia must be symmetric and positive definite (kg m^2)"};
  const Vec3 moments = inertia.diagonal();
  if (isDiagonal(inertia) && moments.minCoeff() > 0.0)
    return Matrix3d(moments.cwiseInverse().asDiagonal());
  if (!inertia.allFinite() || !inertia.isApprox(inertia.transpose(), 1e-9)) return wrong;
  if (!isPositiveDefinite(inertia)) return wrong;
  return Matrix3d(inertia.inverse());
}

Result<Matrix3d> inverseInertiaOf(const carom_body& input, const SurfaceMesh& solid) {
  const Matrix3d inertia = Eigen::Map<const Matrix3d>(input.inertia).transpose();
  if (inertia.cwiseEqual(0.0).all()) {
    const Result<Matrix3d> even = evenInertia(solid, input.mass);
    return even ? inverseOf(*even) : even;
  }
  return inverseOf(inertia);
}

}  // namespace

Status CBodyReader::readSolid(const carom_body& input, SoundBody& body) {
  const Result<SurfaceMesh> surface = surfaceOf(input);
  if (!surface) return surface.error();
  const Result<SurfaceMesh> solid = cleanSurface(*surface);
  if (!solid) return solid.error();
  const Result<Matrix3d> inverse = inverseInertiaOf(input, *solid);
  if (!inverse) return inverse.error();
  body.radius = std::cbrt(0.75 / std::numbers::pi * signedVolume(*solid));
  if (choice_ == RadiatorChoice::equivalentSphere) return std::monostate{};
  const Result<RigidRadiator>& radiator = cache_->radiatorOf(*surface);
  if (!radiator) return radiator.error();
  body.shape = std::shared_ptr<const RigidRadiator>(cache_, &*radiator);
  body.inverseInertia = *inverse;
  return std::monostate{};
}

Result<SoundBody> CBodyReader::read(const carom_body* input) {
  const Result<carom_body> read = readStruct(input, defaultBody(), "carom_body");
  if (!read) return read.error();
  if (const Status valid = validate(*read); !valid)
    return Error{"carom_body: " + valid.error().message};
  Result<Material> material = materialOf(*read);
  if (!material) return Error{"carom_body: " + material.error().message};
  SoundBody body{.material = *std::move(material),
                 .mass = read->mass,
                 .radius = read->radius,
                 .edgeRadius = read->edge_radius,
                 .texture = sharedFrom(read->texture),
                 .textureCoordinates = sharedFrom(read->texture_coordinates),
                 .modal = sharedFrom(read->modes)};
  if (read->modes_origin != nullptr)
    body.modalOrigin = Vec3(read->modes_origin[0], read->modes_origin[1], read->modes_origin[2]);
  if (read->shape != CAROM_SHAPE_SPHERE && std::isfinite(read->mass)) {
    const Status solid = readSolid(*read, body);
    if (!solid) return Error{"carom_body: " + solid.error().message};
  }
  return body;
}

}  // namespace carom::plugin
