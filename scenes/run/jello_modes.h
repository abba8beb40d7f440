#pragma once

#include <cstddef>
#include <optional>

#include "carom/audio/material.h"
#include "carom/audio/modal_model.h"
#include "carom/audio/result.h"
#include "carom/modal/analysis_settings.h"
#include "modal/radiation/mode_radiation.h"
#include "native/jello/jello_world.h"

namespace carom::scenes {

struct JelloModesSettings {
  std::size_t modes = 60;  ///< number of the lowest modes that are not rigid; at least 1
  Medium medium = {};
  /// nullopt: each mode has its monopole only.
  std::optional<RadiationSettings> radiation = std::nullopt;
};

/// Returns the modal model of a lattice in the limit of small motion, for the synth: the modes of
/// its springs about rest, in its own frame with the origin in the middle of the box. Damping is
/// that of the springs, which is proportional to stiffness. The surface is made of the outermost
/// squares. Errors: a lattice that cannot be run, one without stiffness, what lowestModes and
/// computeRadiation refuse. [any thread but the audio thread]
Result<ModalModel> jelloModalModel(const native::JelloLattice& lattice,
                                   const JelloModesSettings& settings = {},
                                   const Progress& progress = {});

}  // namespace carom::scenes
