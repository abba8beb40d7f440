#pragma once

#include <functional>
#include <vector>

#include <Eigen/Core>

#include "carom/audio/material.h"
#include "carom/audio/surface_mesh.h"

namespace carom::test {

/// A part of a body of revolution's section: a map from the unit square to radius and height (m).
/// Parts that touch share whole sides of their squares.
struct SectionPart {
  std::function<Eigen::Vector2d(double along, double across)> at;
  int elements = 10;  ///< along; one across
};

/// A body of revolution about z.
struct RevolvedBody {
  const char* name = "";
  std::vector<SectionPart> section;
  /// m, radius and height of the section's corners, counter-clockwise in the plane of radius (to
  /// the right) and height (upwards); curves as many short edges. It may begin and end on the axis.
  std::vector<Eigen::Vector2d> outline;
};

/// Returns the lowest frequencies (Hz) of a free elastic body of revolution, ascending, those of
/// pairs twice: spectral elements of order 4 on its section, and Fourier's series about the
/// axis (Zienkiewicz and Taylor, The Finite Element Method, volume 2, on semi-analytical methods).
/// It has nothing in common with the grids of modal/analysis but elasticity itself.
std::vector<double> revolutionFrequencies(const RevolvedBody& body, const Material& material,
                                          std::size_t count);

/// Returns the body as triangles, its circles as so many sides.
SurfaceMesh revolvedMesh(const RevolvedBody& body, int sides);

/// Shells of ordinary size: a bowl, a spherical cap, a cup, a cone, a glass, a tube, a ring.
std::vector<RevolvedBody> revolvedBodies();
/// A dish, a pot and a lid, with sharp corners inside as the cup has one.
std::vector<RevolvedBody> otherCups();

}  // namespace carom::test
