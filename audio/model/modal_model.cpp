#include "carom/audio/modal_model.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "carom/audio/sound_body.h"

namespace carom {

using namespace audio;

namespace {

// The ranges of a model's numbers; docs/model_file.md repeats them.
constexpr double kLeastMass = 1e-21;  // kg
constexpr double kMostMass = 1e18;    // kg
constexpr double kFarthest = 1e9;     // m
constexpr double kLargest = 1e30;     // of what has no limit in nature, either way

bool isWithin(double value, double most) {
  return std::abs(value) <= most;
}
bool allWithin(const auto& matrix, double most) {
  return matrix.allFinite() && matrix.cwiseAbs().maxCoeff() <= most;
}

Status validateMedium(const Medium& medium) {
  if (!(medium.density >= 1e-3 && medium.density <= 1e4))
    return Error{"density of the medium must be from 1e-3 to 1e4 (kg/m^3)"};
  if (!(medium.speedOfSound >= 1.0 && medium.speedOfSound <= 1e4))
    return Error{"speed of sound must be from 1 to 1e4 (m/s)"};
  return std::monostate{};
}

Status validateSurface(const SurfaceMesh& surface) {
  const auto isPlace = [](const Vec3& vertex) { return allWithin(vertex, kFarthest); };
  if (surface.vertices.empty()) return Error{"surface has no vertices; expected one at least"};
  if (!std::ranges::all_of(surface.vertices, isPlace))
    return Error{"surface has a vertex out of range; expected coordinates from -1e9 to 1e9 (m)"};
  for (const auto& triangle : surface.triangles)
    for (const std::uint32_t vertex : triangle)
      if (vertex >= surface.vertices.size())
        return Error{"surface has a triangle of vertex " + std::to_string(vertex) +
                     ", and there are " + std::to_string(surface.vertices.size())};
  return std::monostate{};
}

bool isSquare(std::size_t count) {
  const auto root = static_cast<std::size_t>(std::lround(std::sqrt(static_cast<double>(count))));
  return root * root == count;
}

Status validate(const Mode& mode) {
  if (!(mode.frequency >= kLowestMode && mode.frequency <= kHighestMode))
    return Error{"frequency must be from 20 to 20000 Hz"};
  if (!(mode.frequencyError >= 0.0 && mode.frequencyError <= 1.0))
    return Error{"frequency error must be from 0 to 1"};
  if (!(mode.decayRate >= 0.0 && mode.decayRate < 2.0 * std::numbers::pi * mode.frequency))
    return Error{"decay rate must be at least 0 and below 2 pi times the frequency (1/s)"};
  if (!(mode.radiation.decayRate >= 0.0 && mode.radiation.decayRate <= mode.decayRate))
    return Error{"radiation's decay rate must be from 0 to the decay rate (1/s)"};
  if (!(mode.heatDecayRate >= 0.0 && mode.heatDecayRate <= mode.decayRate))
    return Error{"heat's decay rate must be from 0 to the decay rate (1/s)"};
  if (!isWithin(mode.radiation.volume, kLargest))
    return Error{"volume must be from -1e30 to 1e30 (m^2/kg^(1/2))"};
  if (!isSquare(mode.radiation.multipoles.size()))
    return Error{"multipoles must be (order + 1)^2 in number"};
  for (const std::complex<double>& multipole : mode.radiation.multipoles)
    if (!isWithin(multipole.real(), kLargest) || !isWithin(multipole.imag(), kLargest))
      return Error{"multipoles must be from -1e30 to 1e30"};
  return std::monostate{};
}

}  // namespace

Status validate(const ModalModel& model) {
  if (const Status valid = validate(model.material); !valid)
    return Error{"material '" + model.material.name + "': " + valid.error().message};
  if (!(model.mass >= kLeastMass && model.mass <= kMostMass))
    return Error{"mass must be from 1e-21 to 1e18 (kg)"};
  if (!allWithin(model.centreOfMass, kFarthest))
    return Error{"centre of mass must be from -1e9 to 1e9 on each axis (m)"};
  if (!allWithin(model.inertia, kLargest))
    return Error{"inertia must be from -1e30 to 1e30 (kg m^2)"};
  if (Status valid = validateMedium(model.medium); !valid) return valid;
  if (Status valid = validateSurface(model.surface); !valid) return valid;
  if (model.shapes.size() != 3 * model.modes.size() * model.surface.vertices.size())
    return Error{"shapes must have three numbers for each mode and vertex"};
  if (!std::ranges::all_of(model.shapes, [](float value) { return isWithin(value, kLargest); }))
    return Error{"shapes must be from -1e30 to 1e30 (kg^(-1/2))"};
  if (!model.residualVolumes.empty()) {
    if (model.residualVolumes.size() != 3 * model.surface.vertices.size())
      return Error{"residual volumes must be three numbers for each vertex, or none"};
    if (!std::ranges::all_of(model.residualVolumes,
                             [](float value) { return isWithin(value, kLargest); }))
      return Error{"residual volumes must be from -1e30 to 1e30 (m^3/N)"};
    if (!(model.residualFrequency > 0.0 && model.residualFrequency <= kLargest))
      return Error{"residual frequency must be above 0 and up to 1e30 (Hz)"};
  } else if (model.residualFrequency != 0.0) {
    return Error{"residual frequency must be 0 without residual volumes (Hz)"};
  }
  for (std::size_t index = 0; index < model.modes.size(); ++index) {
    if (const Status valid = validate(model.modes[index]); !valid)
      return Error{"mode " + std::to_string(index) + ": " + valid.error().message};
    if (index > 0 && model.modes[index].frequency < model.modes[index - 1].frequency)
      return Error{"mode " + std::to_string(index) + ": modes must be ascending in frequency"};
  }
  return std::monostate{};
}

}  // namespace carom
