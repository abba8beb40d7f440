#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string_view>

#include <carom/audio/material.h>

namespace carom {

/// Told now and then what a long computation is at ("factorisation"), and how much of the whole is
/// done, 0 to 1. It goes on while the answer is true; false cancels it, which is an Error of its
/// own. Empty: nobody wants to know. [the thread that computes]
using Progress = std::function<bool(std::string_view stage, double fraction)>;

/// The message of an Error after Progress has said false.
inline constexpr const char* kCancelled = "cancelled";

/// How fine the grid of a solid is.
struct VoxelSettings {
  /// Three for each node: the grid is made as fine as comes near it from below.
  std::size_t degreesOfFreedom = 20000;
  /// m, longest edge of a cell; degreesOfFreedom is then not looked at.
  std::optional<double> cellSize;
  /// Rows of samples across a cell, each way, in the cells that the surface cuts.
  int rows = 6;

  bool operator==(const VoxelSettings&) const = default;
};

/// How a solid is analysed.
struct SolidSettings {
  VoxelSettings grid;
  std::ptrdiff_t maxModes = 60;  ///< elastic ones up to kHighestMode; the lowest are kept

  bool operator==(const SolidSettings&) const = default;
};

/// The kind of motion that the springs along the edges resist.
enum class ShellSprings {
  /// One degree of freedom for each vertex, its displacement along the vertex normal; a spring
  /// pulls with k times the difference of the two. As in Ren and Lin's chapter: N numbers for N
  /// vertices, K the weighted graph Laplacian. A membrane, more or less: a flat sheet sounds.
  transverse,
  /// Three degrees of freedom; a spring resists a change of its length, to first order. As in
  /// Raghuvanshi and Lin: nothing resists the bending of a flat sheet, nor of the flat sides of a
  /// body, and that motion, at 0 Hz, is counted among the rigid modes and not sounded.
  axial,
};

/// A thin shell from a triangle mesh.
struct ShellSettings {
  double thickness = 2e-3;  ///< m, positive, less than the body's extent
  ShellSprings springs = ShellSprings::transverse;
  std::size_t minVertices = 200;   ///< a coarser mesh is subdivided; may give up to twice as many
  std::size_t maxVertices = 1000;  ///< a denser one is simplified first; at least minVertices
  std::size_t maxModes = 100;      ///< the lowest ones that are not rigid; at least 1

  bool operator==(const ShellSettings&) const = default;
};

/// How finely the sound around a body is computed.
struct RadiationSettings {
  /// Most panels, at least 100; half of them at least are used. Time grows with the cube, memory
  /// with the square.
  std::size_t panels = 800;
  /// The highest order of multipoles, 0 to 16 (kHighestMultipole). Most modes need less.
  int maxOrder = 12;

  bool operator==(const RadiationSettings&) const = default;
};

/// The resolution that a model's radiation was computed with, and how far it can be trusted.
struct RadiationReport {
  std::size_t panels = 0;
  double goodUpTo = 0.0;       ///< Hz: above, six panels do not fit a wavelength in the air
  std::size_t roughModes = 0;  ///< how many are above, or have waves of less than six panels
  std::size_t cutModes = 0;    ///< how many would need a higher order; their power is right
  double thickness = 0.0;      ///< m, of the sheet that an open surface was taken for; 0: a solid
};

enum class BodyModel : std::uint8_t {
  solid,  ///< finite elements of what the surface encloses: what has to be right
  shell,  ///< masses and springs on the surface: a game's model, for what is open or thin
};

/// All that decides what the modes of a mesh become.
struct MeshAnalysisSettings {
  BodyModel body = BodyModel::solid;
  SolidSettings solid = {};  ///< of a solid
  ShellSettings shell = {};  ///< of a shell
  /// The surface of a solid's model: a coarser mesh is subdivided, so that shapes are followed
  /// between its vertices; a finer one is simplified, as each vertex costs 12 bytes for each mode.
  std::size_t leastVertices = 500;
  std::size_t mostVertices = 3000;
  /// None: modes have their volume alone, and all but monopoles are silent, or constant.
  std::optional<RadiationSettings> radiation = RadiationSettings{};
  Medium medium = {};

  bool operator==(const MeshAnalysisSettings&) const = default;
};

}  // namespace carom
