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

/// How a picture lies on a mesh: u to the right and v up across it for each corner of each
/// triangle, from 0 to 1 over the whole picture, which repeats beyond. Immutable, to be shared.
/// [any thread]
///
/// Slopes of a normal map are those of its tangent space: as steep on the surface as they are in
/// the picture, wherever that is stretched. Its tangents are of each triangle, not smoothed over
/// neighbours.
class TextureCoordinates {
 public:
  TextureCoordinates(TextureCoordinates&&) noexcept;
  TextureCoordinates& operator=(TextureCoordinates&&) noexcept;
  ~TextureCoordinates();

  using Corners = std::array<Vec2, 3>;

  /// Of a mesh in the frame of its body, and for each of its triangles the coordinates of its
  /// corners, in their order. Errors: a mesh without triangles, or whose triangles name vertices
  /// that are not there; another number of corners; a number that is not finite; coordinates that
  /// lie in one line all over the mesh.
  static Result<TextureCoordinates> of(SurfaceMesh mesh, std::vector<Corners> corners);

  /// m, width and height of the whole picture as it lies on the mesh, in the mean over its area:
  /// NormalMapSettings::size of a texture for it.
  const Vec2& size() const { return size_; }

  /// The picture about a point of the surface.
  struct Patch {
    Vec2 at = Vec2::Zero();  ///< m, on a texture of size()
    /// 1: metres on the texture for metres in the frame of the body.
    Mat23 perMetre = Mat23::Zero();
    /// Unit: in the frame of the body, where slopes to the right and up are meant; orthogonal.
    Mat23 tangents = Mat23::Zero();
    /// 1: metres on the texture for one on the surface, in the mean over directions; 0 where the
    /// coordinates of a triangle lie in one line, and nothing can be seen.
    double stretch = 0.0;
  };
  /// At the point of the surface that is nearest to `point` (m, frame of the body). Allocates
  /// nothing.
  Patch at(const Vec3& point) const;

 private:
  TextureCoordinates(SurfaceMesh mesh, std::vector<Corners> corners);
  Patch patchOf(std::size_t triangle) const;

  std::unique_ptr<const SurfaceMesh> mesh_;  // stays where the locator looks for it
  std::vector<Corners> corners_;
  std::unique_ptr<const audio::SurfaceLocator> locator_;
  Vec2 size_ = Vec2::Ones();
};

}  // namespace carom
