#pragma once

#include <cstddef>

#include "carom/audio/modal_model.h"
#include "carom/audio/result.h"
#include "carom/modal/analysis_settings.h"

namespace carom::modal {

/// Fills in `radiation.volume` of every mode, and nothing else: the monopole of long waves, from
/// the mean of each triangle's corners. [any thread]
void findVolumes(ModalModel& model);

/// Fills in `radiation` (defined at ModeRadiation) of every mode but its decay rate, of which the
/// mode's own then has no part, for the air (or other fluid) of
/// `model.medium` around a body that is alone and at rest. Each mode takes one steady solution
/// outside, at its own frequency (ExteriorSolver), then
///
///     c_lm = i^l integral (H d/dn + rho0 phi.n) j_l(k r) Y_lm dS
///
/// over the surface, H being the solution there. Orders that matter little are left out: those
/// that together hold less than 1e-4 of the mean square pressure on twice the enclosing sphere.
/// A mode that needs more than maxOrder (from k times the enclosing radius of about that number)
/// keeps the lower orders, scaled to its whole power: the level is right, the directions are
/// blurred.
///
/// Not modelled: the reaction of the fluid on the body, other bodies, and flow.
/// Measured errors of the pressure at 500 to 800 panels: 1 to 3 % for spheres, thin plates, discs
/// and slender bars of 12 sides; bars of 6 sides 5 %; a box 1 %, and 5 % at `goodUpTo`. Directions
/// where a mode's parts cancel are less exact. Rough modes are filled in all the same.
///
/// A surface that is open is taken for a sheet of the model's mass (RadiatingPanels).
///
/// Errors: a model that validate() refuses, settings out of range, a surface that panels cannot be
/// made of (RadiatingPanels), kCancelled. The model is then left as it was. [any thread],
/// allocates; 800 panels and 60 modes take 15 s of one processor, shared by
/// RadiationSettings::threads.
Result<RadiationReport> computeRadiation(ModalModel& model, const RadiationSettings& settings = {},
                                         const Progress& progress = {});

/// Returns the rate (1/s) at which a mode's amplitude falls by the sound it radiates into `medium`,
/// from its multipoles; 0 without. Its power w^4 Q^2 / (2 rho0 c) sum |c_lm|^2 is taken from its
/// energy w^2 Q^2 / 2: first order of perturbation, for losses that are small in a period.
/// [any thread]
double radiatedDecay(const Mode& mode, const Medium& medium);

/// Adds what a model's modes radiate to their decay rates, which have none of it yet, up to half of
/// critical damping. [any thread]
void addRadiationDamping(ModalModel& model);

}  // namespace carom::modal
