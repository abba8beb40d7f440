#include "carom/audio/modal_model.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "audio/model/positive.h"
#include "carom/audio/sound_body.h"

namespace carom {

using namespace audio;

namespace {

std::string whyNotSurface(const SurfaceMesh& surface) {
  const auto finite = [](const Vec3& vertex) { return vertex.allFinite(); };
  if (surface.vertices.empty()) return "surface has no vertices";
  if (!std::ranges::all_of(surface.vertices, finite))
    return "surface has a vertex that is not finite";
  for (const auto& triangle : surface.triangles)
    for (const std::uint32_t vertex : triangle)
      if (vertex >= surface.vertices.size())
        return "surface has a triangle of vertex " + std::to_string(vertex) + ", and there are " +
               std::to_string(surface.vertices.size());
  return {};
}

bool isSquare(std::size_t count) {
  const auto root = static_cast<std::size_t>(std::lround(std::sqrt(static_cast<double>(count))));
  return root * root == count;
}

std::string whyNot(const Mode& mode) {
  if (!(mode.frequency >= kLowestMode && mode.frequency <= kHighestMode))
    return "frequency must be from 20 to 20000 Hz";
  if (!(mode.decayRate >= 0.0 && mode.decayRate < 2.0 * std::numbers::pi * mode.frequency))
    return "decay rate must be at least 0 and below 2 pi times the frequency (1/s)";
  if (!std::isfinite(mode.radiation.volume)) return "volume must be finite";
  if (!isSquare(mode.radiation.multipoles.size()))
    return "multipoles must be (order + 1)^2 in number";
  for (const std::complex<double>& multipole : mode.radiation.multipoles)
    if (!std::isfinite(multipole.real()) || !std::isfinite(multipole.imag()))
      return "multipoles must be finite";
  return {};
}

}  // namespace

std::string whyNot(const ModalModel& model) {
  if (std::string reason = whyNot(model.material); !reason.empty())
    return "material '" + model.material.name + "': " + reason;
  if (!isPositive(model.mass)) return "mass must be positive (kg)";
  if (!model.centreOfMass.allFinite()) return "centre of mass must be finite (m)";
  if (!model.inertia.allFinite()) return "inertia must be finite (kg m^2)";
  if (!isPositive(model.medium.density)) return "density of the medium must be positive (kg/m^3)";
  if (!isPositive(model.medium.speedOfSound)) return "speed of sound must be positive (m/s)";
  if (std::string reason = whyNotSurface(model.surface); !reason.empty()) return reason;
  if (model.shapes.size() != 3 * model.modes.size() * model.surface.vertices.size())
    return "shapes must have three numbers for each mode and vertex";
  if (!std::ranges::all_of(model.shapes, [](float value) { return std::isfinite(value); }))
    return "shapes must be finite";
  for (std::size_t index = 0; index < model.modes.size(); ++index) {
    if (std::string reason = whyNot(model.modes[index]); !reason.empty())
      return "mode " + std::to_string(index) + ": " + reason;
    if (index > 0 && model.modes[index].frequency < model.modes[index - 1].frequency)
      return "mode " + std::to_string(index) + ": modes must be ascending in frequency";
  }
  return {};
}

}  // namespace carom
