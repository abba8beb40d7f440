#pragma once

#include <complex>
#include <span>

#include "carom/audio/material.h"
#include "carom/audio/modal_model.h"
#include "carom/audio/synth_settings.h"
#include "carom/audio/vector.h"

namespace carom::audio {

// Transfer of a model's modes to pressure, by any of the models of ModalRadiation: Pa for a modal
// acceleration q'' of 1 m sqrt(kg) / s^2, less the delay r / c. All of this file: [any thread], no
// allocation.

/// Computes the transfers of the first `transfers.size()` modes to a point (m, model frame, from
/// the centre of mass, outside of the sphere about it that holds the body). Multipoles were
/// computed for the medium of the model: of another medium only the density is taken into account.
void modeTransfers(const ModalModel& model, ModalRadiation radiation, const Medium& medium,
                   const Vec3& point, std::span<std::complex<double>> transfers);

/// Computes the transfers of the first `transfers.size()` modes in the mean over all directions
/// (root of the mean square), at 1 m, as if that were far away.
void meanTransfers(const ModalModel& model, ModalRadiation radiation, const Medium& medium,
                   std::span<std::complex<double>> transfers);

}  // namespace carom::audio
