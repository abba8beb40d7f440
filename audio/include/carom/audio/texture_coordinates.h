#pragma once

#include <array>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include <carom/audio/result.h>
#include <carom/audio/surface_mesh.h>
#include <carom/audio/vector.h>

namespace carom {

namespace audio {
class SurfaceLocator;
}

/// Coordinates of a picture on a mesh: u to the right and v up across it for each corner of each
/// triangle, from 0 to 1 over the whole picture, which repeats beyond. Immutable, to be shared.
/// [any thread]
///
/// Slopes of a normal map are those of its tangent space: as steep on the surface as they are in
/// the picture, wherever the picture is stretched. Tangents are constant on each triangle, not
/// smoothed over neighbours.
class TextureCoordinates {
 public:
  TextureCoordinates(TextureCoordinates&&) noexcept;
  TextureCoordinates& operator=(TextureCoordinates&&) noexcept;
  ~TextureCoordinates();

  using Corners = std::array<Vec2, 3>;

  /// Makes the coordinates for a mesh in the body frame, from those of each triangle's corners, in
  /// the order of the corners. Errors: a mesh without triangles, or whose triangles name vertices
  /// that are not there; another number of corners; a number that is not finite; coordinates that
  /// lie in one line all over the mesh.
  static Result<TextureCoordinates> of(SurfaceMesh mesh, std::vector<Corners> corners);

  /// Width and height in m of the whole picture as it lies on the mesh, averaged over the mesh's
  /// area: to be the NormalMapSettings::size of a texture for it.
  const Vec2& size() const { return size_; }
  const SurfaceMesh& mesh() const { return *mesh_; }                ///< m, body frame
  const std::vector<Corners>& corners() const { return corners_; }  ///< of each triangle

  /// The picture around a point of the surface.
  struct Patch {
    Vec2 at = Vec2::Zero();  ///< m, place on a texture of size()
    /// Metres on the texture per metre in the body frame.
    Mat23 perMetre = Mat23::Zero();
    /// Rows: the two directions in the body frame along which slopes to the right and up are
    /// measured; orthogonal unit vectors.
    Mat23 tangents = Mat23::Zero();
    /// Metres on the texture per metre on the surface, averaged over directions; 0 where the
    /// coordinates of a triangle lie in one line, so that nothing of the texture can be seen.
    double stretch = 0.0;
  };
  /// Returns the patch at the point of the surface that is nearest to `point` (m, body frame).
  /// Allocates nothing.
  Patch at(const Vec3& point) const;

 private:
  TextureCoordinates(SurfaceMesh mesh, std::vector<Corners> corners);
  Patch patchOf(std::size_t triangle) const;

  // On the heap: the locator refers to it, also after a move of this object.
  std::unique_ptr<const SurfaceMesh> mesh_;
  std::vector<Corners> corners_;
  std::unique_ptr<const audio::SurfaceLocator> locator_;
  Vec2 size_ = Vec2::Ones();
};

}  // namespace carom
