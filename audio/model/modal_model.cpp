#include "carom/audio/modal_model.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "audio/model/positive.h"
#include "carom/audio/sound_body.h"

namespace carom {

using namespace audio;

namespace {

Status validateSurface(const SurfaceMesh& surface) {
  const auto finite = [](const Vec3& vertex) { return vertex.allFinite(); };
  if (surface.vertices.empty()) return Error{"surface has no vertices"};
  if (!std::ranges::all_of(surface.vertices, finite))
    return Error{"surface has a vertex that is not finite"};
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
  if (!(mode.decayRate >= 0.0 && mode.decayRate < 2.0 * std::numbers::pi * mode.frequency))
    return Error{"decay rate must be at least 0 and below 2 pi times the frequency (1/s)"};
  if (!std::isfinite(mode.radiation.volume)) return Error{"volume must be finite"};
  if (!isSquare(mode.radiation.multipoles.size()))
    return Error{"multipoles must be (order + 1)^2 in number"};
  for (const std::complex<double>& multipole : mode.radiation.multipoles)
    if (!std::isfinite(multipole.real()) || !std::isfinite(multipole.imag()))
      return Error{"multipoles must be finite"};
  return std::monostate{};
}

}  // namespace

Status validate(const ModalModel& model) {
  if (const Status valid = validate(model.material); !valid)
    return Error{"material '" + model.material.name + "': " + valid.error().message};
  if (!isPositive(model.mass)) return Error{"mass must be positive (kg)"};
  if (!model.centreOfMass.allFinite()) return Error{"centre of mass must be finite (m)"};
  if (!model.inertia.allFinite()) return Error{"inertia must be finite (kg m^2)"};
  if (!isPositive(model.medium.density))
    return Error{"density of the medium must be positive (kg/m^3)"};
  if (!isPositive(model.medium.speedOfSound)) return Error{"speed of sound must be positive (m/s)"};
  if (Status valid = validateSurface(model.surface); !valid) return valid;
  if (model.shapes.size() != 3 * model.modes.size() * model.surface.vertices.size())
    return Error{"shapes must have three numbers for each mode and vertex"};
  if (!std::ranges::all_of(model.shapes, [](float value) { return std::isfinite(value); }))
    return Error{"shapes must be finite"};
  for (std::size_t index = 0; index < model.modes.size(); ++index) {
    if (const Status valid = validate(model.modes[index]); !valid)
      return Error{"mode " + std::to_string(index) + ": " + valid.error().message};
    if (index > 0 && model.modes[index].frequency < model.modes[index - 1].frequency)
      return Error{"mode " + std::to_string(index) + ": modes must be ascending in frequency"};
  }
  return std::monostate{};
}

}  // namespace carom
