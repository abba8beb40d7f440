#pragma once

#include "scenes/json_reader.h"
#include "scenes/scene.h"

namespace carom::scenes {

// The parts of a scene document that say how bodies move and touch, beyond places, velocities and
// restitutions. Every error is recorded at its node, and what was read is then dropped with the
// scene. docs/scenes.md has the fields. All of this file: [any thread].

/// Reads the keys of a material that are in ContactTraits; others are not looked at.
ContactTraits readContactTraits(const JsonNode& material);

/// Reads "spin" of a sphere.
Vec3 readSpin(const JsonNode& sphere);

/// Reads "velocity" and "shaking" of a plane.
void readMotion(const JsonNode& entry, PlaneShape& plane);

/// Reads "rotation" of a block: by + - * / and sqrt alone, so the same bits everywhere.
Quat readRotation(const JsonNode& block);

/// m, from the surface of a sphere to that of the wall at time 0; negative where they overlap, and
/// minus infinity where the centre is inside a block. Exact for the identity and a plane that does
/// not shake, like all that follows from it.
double gapAtStart(const PlaneShape& plane, const Vec3& centre, double radius);
double gapAtStart(const BlockShape& block, const Vec3& centre, double radius);

/// Reads "mechanics" into `scene`, whose bodies are complete and in their places.
void readMechanics(const JsonNode& node, Scene& scene);

}  // namespace carom::scenes
