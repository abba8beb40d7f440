#pragma once

#include <cstddef>
#include <memory>
#include <unordered_map>

#include "audio/run/host_run.h"
#include "carom/audio/surface_mesh.h"

class btCollisionShape;

namespace carom::plugin {

/// Returns how a Bullet shape looks, in the frame of the body, with `metres` to the world's unit.
/// Terrain and open meshes are given as their triangles, of which there are 200,000 at most; where
/// there is nothing to draw, the form is unknown. [simulation thread; not for each step]
audio::BodyForm formOf(const btCollisionShape& shape, double metres);

/// Reads the forms of bodies of which many look alike: equal meshes are one. [one thread]
class BodyForms {
 public:
  explicit BodyForms(double metres) : metres_(metres) {}

  /// Forgets which shape is where: a host may have changed it since.
  void beginReading() { forms_.clear(); }
  /// As formOf.
  const audio::BodyForm& of(const btCollisionShape& shape);

 private:
  std::shared_ptr<const SurfaceMesh> oneOf(std::shared_ptr<const SurfaceMesh> mesh);

  double metres_;
  std::unordered_map<const btCollisionShape*, audio::BodyForm> forms_;  // of the reading in hand
  std::unordered_multimap<std::size_t, std::weak_ptr<const SurfaceMesh>> meshes_;  // by hash
  std::size_t many_ = 64;  // of these, from which on those that are gone are forgotten
};

}  // namespace carom::plugin
