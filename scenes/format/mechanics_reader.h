#pragma once

#include "modal/json/json_reader.h"
#include "scenes/format/scene.h"

namespace carom::scenes {

// The parts of a scene document that say how bodies move and touch, beyond positions, velocities
// and restitutions. Every error is recorded at its node, and what was read is then dropped with the
// scene. docs/scenes.md has the fields. All functions of this file: [any thread].

/// Reads "friction" of a material or a body, which then has no default friction; returns `absent`
/// if there is none.
ContactTraits readFriction(const modal::JsonNode& node, const ContactTraits& absent);

/// Reads the keys of a material that are in ContactTraits; ignores others. Those that are missing
/// are as in `absent`.
ContactTraits readContactTraits(const modal::JsonNode& material, const ContactTraits& absent);

/// Reads "spin" of a sphere.
Vec3 readSpin(const modal::JsonNode& sphere);

/// Reads "velocity" and "oscillation" of a plane.
void readMotion(const modal::JsonNode& entry, PlaneShape& plane);

/// Reads "rotation" of a block. Uses + - * / and sqrt only, so the bits are the same everywhere.
Quat readRotation(const modal::JsonNode& block);

/// Returns the gap at time 0 between the surfaces of a sphere and a wall, in m; negative if they
/// overlap, and minus infinity if the centre is inside a block. Exact, like all that follows from
/// it, for a block that is not rotated and a plane that does not shake.
double gapAtStart(const PlaneShape& plane, const Vec3& centre, double radius);
double gapAtStart(const BlockShape& block, const Vec3& centre, double radius);

/// Reads "mechanics" into `scene`, whose bodies are complete and in their places.
void readMechanics(const modal::JsonNode& node, Scene& scene);

}  // namespace carom::scenes
