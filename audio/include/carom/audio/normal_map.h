#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string_view>

#include <Eigen/Core>

#include <carom/audio/result.h>
#include <carom/audio/surface_texture.h>

namespace carom {

/// The interpretation of a normal map's colours.
struct NormalMapSettings {
  Vec2 size = Vec2::Ones();  ///< m, 1e-6 to 1e6, of the whole picture: width, height
  bool greenIsDown = false;  ///< green grows downwards in the picture (Direct3D), not up (OpenGL)
  double strength = 1.0;     ///< 1, 0 to 1e6: factor on the slopes

  bool operator==(const NormalMapSettings&) const = default;
};

/// Reads the bumps of a PNG normal map in tangent space: red, green and blue are the x (right), y
/// (up) and z (outwards) of the surface's normal, from -1 to 1. 8 or 16 bits, as they are in the
/// file: no gamma. u runs along the picture's rows, v up from its lowest row. A side that is no
/// power of two is resampled to the next one.
///
/// Errors, which contain `name`: no PNG, damaged, grey (a height map has to be made a normal map
/// first), larger than 8192, normals that point inwards all over, settings out of range. [any
/// thread]
Result<SurfaceTexture> normalMapFromBytes(std::span<const std::byte> bytes, std::string_view name,
                                          const NormalMapSettings& settings);

/// Reads a normal map from a PNG file, as normalMapFromBytes does. [any thread; blocks on the disk]
Result<SurfaceTexture> readNormalMap(const std::filesystem::path& path,
                                     const NormalMapSettings& settings);

}  // namespace carom
