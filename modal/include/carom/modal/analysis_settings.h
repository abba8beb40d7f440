#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string_view>

#include <carom/audio/material.h>

namespace carom {

/// A callback that a long computation calls now and then with the stage that it is at
/// ("factorisation") and the share of the whole that is done, 0 to 1. The computation goes on while
/// the answer is true; false cancels it, which is an Error of its own. It may be empty. [the thread
/// that computes]
using Progress = std::function<bool(std::string_view stage, double fraction)>;

/// The message of an Error after Progress has said false.
inline constexpr const char* kCancelled = "cancelled";

/// The resolution of a solid's grid, where it is not to be chosen by accuracy.
struct GridSettings {
  /// Degrees of freedom, three for each function: the grid is made as fine as comes near this from
  /// below; at least 192, which one cell has.
  std::optional<std::size_t> degreesOfFreedom;
  /// Longest edge of a cell in m; if it is set, degreesOfFreedom is not used.
  std::optional<double> cellSize;

  bool operator==(const GridSettings&) const = default;
};

/// The settings of the analysis of a solid.
struct SolidSettings {
  /// Largest relative error of the frequencies, by the analysis's own estimate
  /// (Mode::frequencyError), 1e-5 to 0.5: the grid is refined until all modes have it, or the
  /// effort reaches its limit (SolidAnalysis::reachedAccuracy). Not used if the grid is set.
  double accuracy = 0.01;
  GridSettings grid;
  std::ptrdiff_t maxModes = 60;  ///< elastic modes up to kHighestMode; the lowest are kept

  bool operator==(const SolidSettings&) const = default;
};

/// The kind of motion that the springs along the edges resist.
enum class ShellSprings {
  /// One degree of freedom for each vertex, its displacement along the vertex normal; a spring
  /// pulls with k times the difference of the two. Ren and Lin's chapter has it so: N numbers for N
  /// vertices, K the weighted graph Laplacian. This is a membrane, more or less: a flat sheet
  /// sounds.
  transverse,
  /// Three degrees of freedom for each vertex; a spring resists a change of its length, to first
  /// order, as in Raghuvanshi and Lin. Nothing resists the bending of a flat sheet, nor of the flat
  /// sides of a body, and that motion, at 0 Hz, is counted among the rigid modes and not sounded.
  axial,
};

/// The settings of a thin shell from a triangle mesh.
struct ShellSettings {
  double thickness = 2e-3;  ///< m, positive, less than the body's extent
  ShellSprings springs = ShellSprings::transverse;
  std::size_t minVertices = 200;   ///< a coarser mesh is subdivided, perhaps to twice as many
  std::size_t maxVertices = 1000;  ///< a denser one is simplified first; at least minVertices
  std::size_t maxModes = 100;      ///< the lowest modes that are not rigid; at least 1

  bool operator==(const ShellSettings&) const = default;
};

/// The resolution with which the sound around a body is computed.
struct RadiationSettings {
  /// Largest number of panels, at least 100; half of them at least are used. Time grows with the
  /// cube, memory with the square.
  std::size_t panels = 800;
  /// The highest order of multipoles, 0 to 16 (kHighestMultipole). Most modes need less.
  int maxOrder = 12;
  /// Modes that are solved at a time, each in a thread of its own: 0 for as many as the machine has
  /// processors and a gigabyte suffices for. Results do not depend on it.
  std::size_t threads = 0;

  bool operator==(const RadiationSettings&) const = default;
};

/// The resolution that a model's radiation was computed with, and how far it can be trusted.
struct RadiationReport {
  std::size_t panels = 0;
  double goodUpTo = 0.0;       ///< Hz; above it, six panels do not fit a wavelength in the air
  std::size_t roughModes = 0;  ///< modes above goodUpTo, or with waves of less than six panels
  std::size_t cutModes = 0;    ///< modes that would need a higher order; their power is right
  double thickness = 0.0;      ///< m, of the sheet for which an open surface was taken; 0: a solid
};

enum class BodyModel : std::uint8_t {
  solid,  ///< finite elements of the enclosed volume, for results that have to be right
  shell,  ///< masses and springs on the surface, a game's model for open or thin bodies
};

/// All settings that determine the modes of a mesh.
struct MeshAnalysisSettings {
  BodyModel body = BodyModel::solid;
  SolidSettings solid = {};  ///< used if the body is a solid
  ShellSettings shell = {};  ///< used if the body is a shell
  /// Numbers of vertices of a solid's surface: a coarser mesh is subdivided, so that shapes are
  /// followed between its vertices; a finer one is simplified, as each vertex costs 12 bytes for
  /// each mode.
  std::size_t leastVertices = 500;
  std::size_t mostVertices = 3000;
  /// If absent, modes have only their volume: all but monopoles are silent, unless modes are
  /// rendered as `constant`.
  std::optional<RadiationSettings> radiation = RadiationSettings{};
  Medium medium = {};

  bool operator==(const MeshAnalysisSettings&) const = default;
};

}  // namespace carom
