#pragma once

#include <cstddef>
#include <span>

#include <nlohmann/json_fwd.hpp>

#include "carom/audio/material.h"

namespace carom::lab {

/// The evidence of one mode on the material's damping.
struct MeasuredDecay {
  double frequency = 0.0;  ///< Hz
  double decayRate = 0.0;  ///< 1/s, of the material alone: without radiation
  double weight = 1.0;     ///< inverse variance of its logarithm, up to a factor
};

/// The four numbers of a material's damping (dampingRate).
struct DampingLaw {
  double alpha = 0.0;         ///< 1/s
  double beta = 0.0;          ///< s
  double lossFactor = 0.0;    ///< 1
  double lossExponent = 0.0;  ///< 1

  double decayRate(double frequency) const;  ///< 1/s, at a frequency in Hz
};

/// The laws that fit measured decays, and how well.
struct DampingFit {
  DampingLaw law;                   ///< the one that explains more
  bool isRayleigh = true;           ///< if false, it is the loss factor
  double rayleighResidual = 0.0;    ///< 1, rms of the logarithm of measured over fitted decay rate
  double lossFactorResidual = 0.0;  ///< 1
  std::size_t modes = 0;            ///< 0: there was nothing to fit, and the law is zero
};

/// Fits Rayleigh's two numbers and a loss factor with an exponent (0 if there are fewer than three
/// modes) by weighted least squares of relative deviations, in which single modes far off count
/// less (Huber). [any thread]
DampingFit fitDamping(std::span<const MeasuredDecay> decays);

/// Gives a material the law.
void setDamping(Material& material, const DampingLaw& law);

/// Adds the law to a material's JSON, with the keys of a scene file.
void addDamping(nlohmann::ordered_json& material, const DampingLaw& law);

}  // namespace carom::lab
