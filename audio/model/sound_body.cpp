#include "carom/audio/sound_body.h"

#include <cmath>

#include "audio/model/positive.h"

namespace carom {

using namespace audio;

Status validate(const Material& material) {
  if (!isPositive(material.density)) return Error{"density must be positive (kg/m^3)"};
  if (!isPositive(material.youngsModulus)) return Error{"Young's modulus must be positive (Pa)"};
  if (!(material.poissonsRatio >= 0.0 && material.poissonsRatio < 0.5))
    return Error{"Poisson's ratio must be at least 0 and below 0.5"};
  if (!(material.restitution >= 0.0 && material.restitution <= 1.0))
    return Error{"restitution must be from 0 to 1"};
  if (!(material.dampingAlpha >= 0.0) || std::isinf(material.dampingAlpha))
    return Error{"damping alpha must be at least 0 (1/s)"};
  if (!(material.dampingBeta >= 0.0) || std::isinf(material.dampingBeta))
    return Error{"damping beta must be at least 0 (s)"};
  if (!(material.lossFactor >= 0.0 && material.lossFactor <= 2.0))
    return Error{"loss factor must be from 0 to 2"};
  if (!(std::abs(material.lossExponent) <= 2.0)) return Error{"loss exponent must be from -2 to 2"};
  const auto& [expansion, conductivity, heatCapacity] = material.thermal;
  for (const double property : {expansion, conductivity, heatCapacity})
    if (!(property >= 0.0) || std::isinf(property))
      return Error{"thermal expansion, conductivity and heat capacity must be at least 0"};
  if (const Status valid = validate(material.roughness); !valid)
    return Error{"roughness: " + valid.error().message};
  return std::monostate{};
}

Status validate(const SoundBody& body) {
  if (const Status valid = validate(body.material); !valid)
    return Error{"material '" + body.material.name + "': " + valid.error().message};
  if (!(body.mass > 0.0))
    return Error{"mass must be positive (kg), infinite for an immovable body"};
  if (std::isfinite(body.mass) && !isPositive(body.shape ? body.shape->radius() : body.radius))
    return Error{"radius must be positive (m) for a body that can move"};
  if (!body.inverseInertia.allFinite()) return Error{"inverse inertia must be finite (1/(kg m^2))"};
  if (!isPositive(body.edgeRadius)) return Error{"edge radius must be positive (m)"};
  if (body.modalOrigin && !body.modalOrigin->allFinite())
    return Error{"modal origin must be finite (m)"};
  if (body.recoil != nullptr)
    if (const Status valid = validate(*body.recoil); !valid) return valid.error();
  return std::monostate{};
}

}  // namespace carom
