#pragma once

#include <cstddef>
#include <span>

#include <nlohmann/json_fwd.hpp>

#include "carom/audio/material.h"
#include "carom/audio/modal_model.h"

namespace carom::lab {

/// The evidence of one mode on the material's damping.
struct MeasuredDecay {
  double frequency = 0.0;  ///< Hz
  double decayRate = 0.0;  ///< 1/s, of the material alone: without radiation
  double weight = 1.0;     ///< inverse variance of its logarithm, up to a factor
};

/// A law of damping: the decay rate of a mode is (alpha + beta w^2) / 2 + eta(f) w / 2, with
/// eta(f) = lossFactor (f / 1 kHz)^lossExponent.
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
/// less (Huber). Where materials have no loss factor (hasLossFactor), Rayleigh's law is taken.
/// [any thread]
DampingFit fitDamping(std::span<const MeasuredDecay> decays);

/// True if Material can hold a loss factor.
bool hasLossFactor();

/// The one place where a law becomes a material's.
void setDamping(Material& material, const DampingLaw& law);

/// The one place where it becomes JSON: the fields of a material in a scene file.
void addDamping(nlohmann::ordered_json& material, const DampingLaw& law);

/// The bound of the relative error that a mode's frequency comes with; `otherwise` if it has none.
double frequencyErrorOf(const Mode& mode, double otherwise);

}  // namespace carom::lab
