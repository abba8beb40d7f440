#include "carom/audio/sound_body.h"

#include <cmath>

#include "audio/model/positive.h"

namespace carom {

using namespace audio;

std::string whyNot(const Material& material) {
  if (!isPositive(material.density)) return "density must be positive (kg/m^3)";
  if (!isPositive(material.youngsModulus)) return "Young's modulus must be positive (Pa)";
  if (!(material.poissonsRatio >= 0.0 && material.poissonsRatio < 0.5))
    return "Poisson's ratio must be at least 0 and below 0.5";
  if (!(material.restitution >= 0.0 && material.restitution <= 1.0))
    return "restitution must be from 0 to 1";
  if (!(material.dampingAlpha >= 0.0) || std::isinf(material.dampingAlpha))
    return "damping alpha must be at least 0 (1/s)";
  if (!(material.dampingBeta >= 0.0) || std::isinf(material.dampingBeta))
    return "damping beta must be at least 0 (s)";
  if (std::string reason = whyNot(material.roughness); !reason.empty())
    return "roughness: " + reason;
  return {};
}

std::string whyNot(const SoundBody& body) {
  if (std::string reason = whyNot(body.material); !reason.empty())
    return "material '" + body.material.name + "': " + reason;
  if (!(body.mass > 0.0)) return "mass must be positive (kg), infinite for an immovable body";
  if (std::isfinite(body.mass) && !isPositive(body.shape ? body.shape->radius() : body.radius))
    return "radius must be positive (m) for a body that can move";
  if (!body.inverseInertia.allFinite()) return "inverse inertia must be finite (1/(kg m^2))";
  if (!isPositive(body.edgeRadius)) return "edge radius must be positive (m)";
  if (body.modalOrigin && !body.modalOrigin->allFinite()) return "modal origin must be finite (m)";
  return {};
}

}  // namespace carom
