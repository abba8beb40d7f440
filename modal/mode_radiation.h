#pragma once

#include <cstddef>

#include "audio/modal_model.h"
#include "audio/result.h"
#include "modal/progress.h"

namespace carom {

/// How finely the sound around a body is computed.
struct RadiationSettings {
  /// Most panels, at least 100; half of them at least are used. Time grows with the cube, memory
  /// with the square.
  std::size_t panels = 800;
  /// The highest order of multipoles, 0 to 16 (kHighestMultipole). Most modes need less.
  int maxOrder = 12;

  bool operator==(const RadiationSettings&) const = default;
};

/// Fills in `radiation.volume` of every mode, and nothing else: the monopole of long waves, from
/// the mean of each triangle's corners. [any thread]
void findVolumes(ModalModel& model);

/// What the radiation of a model was computed with, and how far it can be trusted.
struct RadiationReport {
  std::size_t panels = 0;
  double goodUpTo = 0.0;       ///< Hz: above, six panels do not fit a wavelength in the air
  std::size_t roughModes = 0;  ///< how many are above, or have waves of less than six panels
  std::size_t cutModes = 0;    ///< how many would need a higher order; their power is right
  double thickness = 0.0;      ///< m, of the sheet that an open surface was taken for; 0: a solid
};

/// Fills in `radiation` of every mode, for the air (or other fluid) of `model.medium` around a body
/// that is alone and at rest: ModeRadiation is the definition. One steady solution outside for each
/// mode, at its own frequency (ExteriorSolver), then
///
///     c_lm = i^l integral (H d/dn + rho0 phi.n) j_l(k r) Y_lm dS
///
/// over the surface, H being the solution there. Orders that matter little are left out: those
/// that together hold less than 1e-4 of the mean square pressure on twice the enclosing sphere.
/// A mode that needs more than maxOrder (from k times the enclosing radius of about that number)
/// has the lower ones, scaled to its whole power: the level is right, the directions are blurred.
///
/// Not modelled: what the fluid does to the body, other bodies, and flow.
/// Measured errors of the pressure at 500 to 800 panels: 1 to 3 % for spheres, thin plates, discs
/// and slender bars of 12 sides; bars of 6 sides 5 %; a box 1 %, and 5 % at `goodUpTo`. Directions
/// where a mode's parts cancel are less exact. Rough modes are filled in all the same.
///
/// A surface that is open is taken for a sheet of the model's mass (RadiatingPanels).
///
/// Errors: a model that whyNot() refuses, settings out of range, a surface that panels cannot be
/// made of (RadiatingPanels), kCancelled. The model is then as it was. [any thread], allocates; 800
/// panels and 60 modes take 25 s.
Result<RadiationReport> computeRadiation(ModalModel& model, const RadiationSettings& settings = {},
                                         const Progress& progress = {});

}  // namespace carom
