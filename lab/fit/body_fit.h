#pragma once

#include <vector>

#include "lab/fit/body_variants.h"
#include "lab/fit/mode_match.h"
#include "lab/fit/tap_modes.h"

#include "carom/audio/modal_model.h"
#include "carom/audio/result.h"

namespace carom::lab {

/// The unknowns that are free in a fit of frequencies beside their common factor, and their start.
struct BodyFitSettings {
  BodyVariant start;
  double poissonSpread = 0.1;  ///< 1, standard deviation of Poisson's ratio about the start's
  double wallThickness = 0.0;  ///< m, of the mesh
  bool freeThickness = false;
  ModeMatchSettings match;
};

/// The body whose frequencies are nearest to the measured ones.
struct BodyFit {
  ModeMatch match;  ///< the first one, with the comparison with chance; the rest needs it accepted
  BodyVariant variant;
  double factor = 1.0;       ///< measured over computed frequency
  double factorError = 0.0;  ///< 1, relative standard deviation; with what else was free
  bool isPoissonFitted = false;
  double poissonError = 0.0;
  double wallError = 0.0;  ///< m
  double residual = 0.0;   ///< 1, rms
};

/// Fits factor, Poisson's ratio and wall. The first match is with the Poisson's ratio that matches
/// best, as that moves twisting against bending by some percent. Errors: those of analyseMesh,
/// kCancelled. [any thread]
Result<BodyFit> fitBody(const std::vector<TapMode>& measured, const BodyVariants& variants,
                        const BodyFitSettings& settings);

}  // namespace carom::lab
