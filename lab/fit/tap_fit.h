#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "lab/fit/damping_law.h"
#include "lab/fit/mode_match.h"
#include "lab/fit/tap_modes.h"

#include "carom/audio/material.h"
#include "carom/audio/modal_model.h"
#include "carom/audio/result.h"
#include "carom/audio/surface_mesh.h"
#include "carom/modal/analysis_settings.h"
#include "carom/modal/model_cache.h"

namespace carom::lab {

/// The knowledge of an object beside its mesh, and what is to be found.
struct TapFitSettings {
  /// Density, Poisson's ratio, restitution and the rest begin as this one's; Young's modulus is
  /// looked for within a factor of 4 of it if `isStartKnown`, or else among all solids, with a
  /// Poisson's ratio about 0.28.
  Material start;
  bool isStartKnown = false;
  std::optional<double> density;  ///< kg/m^3; in place of the start's
  std::optional<double> mass;     ///< kg; gives the density, by the volume of the mesh
  bool freeThickness = false;     ///< walls may be thicker or thinner than the mesh's
  /// The size may be another than the mesh's; Young's modulus is the start's then, as both change
  /// all frequencies alike.
  bool freeScale = false;
  RadiationSettings radiation = {};
};

/// A mode of the tap beside the computed one.
struct FittedMode {
  TapMode measured;
  std::optional<std::size_t> index;      ///< in TapFit::model, of the mode that it is
  std::optional<double> computed;        ///< Hz, with the fitted material
  std::optional<double> computedDecay;   ///< 1/s, by the fitted law, with radiation
  std::optional<double> radiationDecay;  ///< 1/s, the computed part that is sound
};

/// A body as a tap shows it.
struct TapFit {
  bool accepted = false;
  std::string reason;  ///< one sentence: why not; empty if accepted
  Material material;   ///< density, E, Poisson's ratio, damping; named as the start
  DampingFit damping;
  double modulusError = 0.0;      ///< 1, relative standard deviation of E, or of the scale cubed
  bool isPoissonFitted = false;   ///< the tap shows Poisson's ratio; or else it is the start's
  double poissonError = 0.0;      ///< 1, standard deviation if fitted
  double scale = 1.0;             ///< size of the object over the mesh's
  double thickness = 0.0;         ///< m, median wall of the fitted body; 0: there is none
  double thicknessError = 0.0;    ///< m, if fitted
  ModeMatch match;                ///< the last one, with the fitted body
  double residual = 0.0;          ///< 1, rms relative deviation of the frequencies after the fit
  std::vector<FittedMode> modes;  ///< all of the tap's, ascending
  /// The body as fitted. Modes that the tap has ring with the frequency and decay that were
  /// measured, all others with those of the material; no level is fitted.
  ModalModel model;
};

/// Fits a body to the modes of a tap: a match with the mesh's modes, then Young's modulus over
/// density, Poisson's ratio (if the frequencies then fit better by an F-test at 1 %), wall
/// thickness or scale if they are free, by weighted least squares with sensitivities from analyses
/// of changed bodies; then the damping, from what is left of the decays without the computed
/// radiation. A tap that does not belong to the mesh gives accepted false and the reason.
///
/// Errors: those of analyseMesh; kCancelled. [any thread but the audio thread]; some four
/// analyses, and one with radiation.
Result<TapFit> fitTap(const std::vector<TapMode>& measured, const SurfaceMesh& mesh,
                      const TapFitSettings& settings, ModelCache* cache = nullptr,
                      const Progress& progress = {});

}  // namespace carom::lab
