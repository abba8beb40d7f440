#pragma once

#include <array>

#include "audio/model/third_octaves.h"
#include "carom/audio/surface_texture.h"

namespace carom::audio {

/// The bumps of one surface as they pass a contact.
struct PassingBumps {
  const SurfaceTexture* texture = nullptr;  ///< null: none
  SurfaceTexture::Look look = {};
  double speed = 0.0;           ///< m/s, over the body
  double speedOnTexture = 0.0;  ///< m/s
};

/// A contact that slides or rolls, as ContactDrive follows it.
struct BumpyContact {
  double mass = 0.0;       ///< kg, of the pair along the normal
  double load = 0.0;       ///< N
  double stiffness = 0.0;  ///< N/m
  double damping = 0.0;    ///< N s/m
  double flatness = 1.0;   ///< 1, factor on the bumps
  std::array<PassingBumps, 2> bumps = {};
};

/// Estimates the power (N^2) of the force beyond the load, by third octaves, from the spectra of
/// the bumps: they push a mass on a spring and a dashpot. A force that would pull is limited, as
/// the mass leaves the surface. [any thread]
void estimateForce(const BumpyContact& contact, BandPowers& force);

}  // namespace carom::audio
