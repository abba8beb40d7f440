#pragma once

#include "carom/audio/material.h"
#include "modal/json/json_reader.h"
#include "scenes/format/scene.h"

namespace carom::scenes {

// The part of a scene document that says what a body of type "jello" is. Every error is recorded at
// its node, and what was read is then dropped with the scene. docs/scenes.md has the fields.

/// True if `entry` is an object with no key but a jello's. [any thread]
bool expectJello(const modal::JsonNode& entry);

/// Reads a jello, all but its name. [any thread]
JelloShape readJello(const modal::JsonNode& entry);

/// Returns the equivalent material of a lattice for contacts: its density, and the Young's modulus
/// that its springs give it along its axes, in the mean, for small strains (for an infinite
/// lattice; central forces make Poisson's ratio 1/4, after Cauchy: Love 1927, note B); at least 1
/// Pa. [any thread]
Material jelloMaterial(const native::JelloLattice& lattice);

}  // namespace carom::scenes
