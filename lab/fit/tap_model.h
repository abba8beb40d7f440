#pragma once

#include <vector>

#include "lab/fit/damping_law.h"
#include "lab/fit/tap_modes.h"

#include "carom/audio/material.h"
#include "carom/audio/modal_model.h"
#include "carom/audio/result.h"

namespace carom::lab {

/// The knowledge of an object of unknown shape.
struct TapModelSettings {
  Material material;    ///< for its contacts; its damping becomes that of the tap
  double mass = 0.0;    ///< kg, above 0
  double radius = 0.0;  ///< m; 0: of a ball of that mass and the material's density
};

/// The modes of a tap as a model that can be used at once.
struct TapModel {
  ModalModel model;
  DampingFit damping;  ///< of all decays, what is sound of them included
};

/// Makes a ball of the mass and the radius that rings with the modes of a tap: each mode moves the
/// whole surface along its normal, so that a blow excites all of them alike wherever it falls, and
/// displaces a volume (a monopole) such that a short blow is heard with the levels of the tap. How
/// loud that is nobody has measured: the loudest mode loses a tenth of its energy as sound, or the
/// ball breathes as a whole where that is less. Modes outside of 20 Hz to 20 kHz are left out.
/// Error: mass, radius or material out of range. [any thread]
Result<TapModel> modelOfTap(const std::vector<TapMode>& modes, const TapModelSettings& settings);

}  // namespace carom::lab
