#pragma once

#include "carom/audio/material.h"
#include "scenes/json_reader.h"
#include "scenes/scene.h"

namespace carom::scenes {

// The part of a scene document that says what a body of type "jello" is. Every error is recorded at
// its node, and what was read is then dropped with the scene. docs/scenes.md has the fields.

/// Whether `entry` is an object with no key but a jello's. [any thread]
bool expectJello(const JsonNode& entry);

/// All of it but its name. [any thread]
JelloShape readJello(const JsonNode& entry);

/// What a lattice is like to someone who knocks on it: its density, and the Young's modulus that
/// its springs give it along its axes, in the mean, for small strains (of a lattice without end;
/// central forces make Poisson's ratio 1/4, after Cauchy: Love 1927, note B); at least 1 Pa. [any
/// thread]
Material jelloMaterial(const native::JelloLattice& lattice);

}  // namespace carom::scenes
