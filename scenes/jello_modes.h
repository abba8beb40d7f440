#pragma once

#include <cstddef>
#include <optional>

#include "carom/audio/material.h"
#include "carom/audio/modal_model.h"
#include "carom/audio/result.h"
#include "carom/modal/analysis_settings.h"
#include "modal/mode_radiation.h"
#include "native/jello_world.h"

namespace carom::scenes {

struct JelloModesSettings {
  std::size_t modes = 60;  ///< the lowest that are not rigid; at least 1
  Medium medium = {};
  /// None: only the monopole of each mode.
  std::optional<RadiationSettings> radiation = std::nullopt;
};

/// A lattice as it is in the limit of small motion, for the synth: the modes of its springs about
/// rest, in its own frame, the middle of the box its origin. Damping is that of its springs, which
/// is in proportion to stiffness. Its surface is its outermost squares. Errors: a lattice that
/// cannot be run, one without stiffness, what lowestModes and computeRadiation refuse. [any thread
/// but the audio thread]
Result<ModalModel> jelloModalModel(const native::JelloLattice& lattice,
                                   const JelloModesSettings& settings = {},
                                   const Progress& progress = {});

}  // namespace carom::scenes
