#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "carom/audio/result.h"
#include "native/jello/jello_world.h"

namespace carom::native {

/// The content of a world file of the classic assignment (J. Barbic, "The jello cube", USC CSCI
/// 520): a lattice of 8 x 8 x 8 points, 1/7 apart at rest, in a room from -2 to 2 on each axis,
/// with a force field over it and perhaps an inclined plane.
struct JelloFile {
  JelloIntegrator integrator = JelloIntegrator::rungeKutta4;
  double step = 0.0;              ///< s, 1e-8 to 1
  std::size_t stepsPerFrame = 1;  ///< steps for each picture, >= 1
  JelloWorld world;
};

/// Reads the text of a world file; `name` is its name in messages. Numbers are separated by any
/// white space. Integrators are "Euler" and "RK4", or as nameOf calls them. The plane is a x + b y
/// + c z + d = 0; the jello is on the side where the mean of its points is. Errors, one sentence
/// with name and line: what is missing, is no number or out of range, or is left over at the end.
/// [any thread]
Result<JelloFile> jelloFromText(std::string_view text, const std::string& name);

/// Writes a world file; reading it gives the same numbers. Error: a property that such a file
/// cannot express, such as another lattice or room, gravity, balls, a second plane, or a number
/// that is out of its range. [any thread]
Result<std::string> jelloText(const JelloFile& file);

}  // namespace carom::native
