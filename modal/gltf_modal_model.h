#pragma once

#include <cstddef>

#include "audio/modal_model.h"
#include "audio/result.h"
#include "modal/gltf_audio.h"

namespace carom {

/// Adds the model, its material and a node that has both, which is what the draft can hold of it:
/// frequencies become those that are heard, sqrt(omega^2 - d^2) / (2 pi), and they, the vertices
/// and all else in accessors become floats. What went wrong shows as whyNot(GltfAudio), such as a
/// model without modes. What the draft has no place for goes into `extras`: restitution, the modes
/// that were left out, and each mode's volume. ModeRadiation::multipoles and the medium that they
/// are computed for do not go along. [any thread]
void addModalModel(GltfAudio& audio, const ModalModel& model);

/// The model as one that can be sounded; `audio` is as readGltfAudio gives it.
///
/// - `scale` is that of the node, which takes positions to metres: uniformScale(node). Modes are
///   those of the body as it stands in the scene, so nothing else changes.
/// - Frequencies become those without damping; modes outside of the audible band, and those that do
///   not oscillate, are left out and counted; the others are in ascending order.
/// - What the material does not say, and all of it if there is none, is as in `fallback`; so is the
///   restitution, unless it is in the extras.
/// - Without massProperties, mass and centre of mass follow from the density and the closed surface
///   of `indices`; the moments of inertia are 0 then. An error if the surface is none.
/// - Multipoles are empty, volumes 0 unless in the extras, the medium is the default one.
///
/// [any thread]
Result<ModalModel> toModalModel(const GltfAudio& audio, std::size_t model, double scale,
                                const Material& fallback);

/// The one factor by which a node scales, in all directions; an error if there is none, for modes
/// cannot follow then. [any thread]
Result<double> uniformScale(const GltfAudioNode& node);

}  // namespace carom
