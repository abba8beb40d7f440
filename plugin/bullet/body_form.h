#pragma once

#include "audio/run/host_run.h"

class btCollisionShape;

namespace carom::plugin {

/// Returns how a Bullet shape looks, in the frame of the body, with `metres` to the world's unit.
/// Terrain and open meshes are given as their triangles, of which there are 200,000 at most; where
/// there is nothing to draw, the form is unknown. [simulation thread; not for each step]
audio::BodyForm formOf(const btCollisionShape& shape, double metres);

}  // namespace carom::plugin
