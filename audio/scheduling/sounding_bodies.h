#pragma once

#include <cstddef>
#include <limits>
#include <map>
#include <memory>
#include <unordered_map>

#include "audio/propagation/sound_paths.h"
#include "audio/radiation/radiation_bank.h"
#include "audio/radiation/recoil_filters.h"
#include "audio/scheduling/modal_exciter.h"
#include "carom/audio/impulse_event.h"
#include "carom/audio/result.h"
#include "carom/audio/sound_body.h"

namespace carom::audio {

/// A body as it sounds.
struct SoundingBody {
  SoundBody sound;
  const RadiationBank::Mix* filters = nullptr;  ///< null: it does not click
  /// The recoil of a body that is no sphere; null: as the sphere of `filters`.
  std::shared_ptr<const RecoilFilters> recoil = nullptr;
  const ModalExciter::Source* modes = nullptr;  ///< null: it does not ring
  /// Texture made of the material's roughness when it is first asked for.
  std::shared_ptr<const SurfaceTexture> roughTexture = nullptr;

  bool isSilent() const { return filters == nullptr && modes == nullptr; }
  /// Radius in m; 0 unless the body is a sphere.
  double ballRadius() const { return sound.shape == nullptr ? sound.radius : 0.0; }
  /// Returns the body's texture, or one made from its material's roughness; null if it is smooth.
  const SurfaceTexture* texture();
  /// Returns the coordinates of the body's own texture; null for roughness, the same all over.
  const TextureCoordinates* textureCoordinates() const;
};

/// The bodies that a synthesis knows, each with its filters and modes. [one thread]
class SoundingBodies {
 public:
  /// The exciter, which must outlive the bodies, makes the sources of their modes.
  SoundingBodies(std::shared_ptr<const SoundPaths> paths, ModalExciter& exciter);

  /// Lets that many recoils be heard at a time, of the bodies that are set first; those of further
  /// shapes are heard as their spheres. Without limit unless called.
  void limitRecoils(std::size_t most) { mostRecoils_ = most; }

  Status set(BodyId id, const SoundBody& body);  ///< as Synth::setBody
  void remove(BodyId id) { bodies_.erase(id); }
  /// Returns nullptr if there is no such body.
  SoundingBody* find(BodyId id);
  const SoundingBody* find(BodyId id) const;

  bool anyModes() const { return anyModes_; }      ///< a body that rings has been set
  bool anyTexture() const { return anyTexture_; }  ///< a body that is not smooth has been set

 private:
  const RadiationBank::Mix& filtersOf(double radius);
  std::shared_ptr<const RecoilFilters> recoilOf(const SoundBody& body);

  std::shared_ptr<const SoundPaths> paths_;
  ModalExciter& exciter_;
  RadiationBank filters_;
  std::map<std::shared_ptr<const RigidRecoil>, std::shared_ptr<const RecoilFilters>> recoils_;
  std::size_t mostRecoils_ = std::numeric_limits<std::size_t>::max();
  std::unordered_map<BodyId, SoundingBody> bodies_;
  bool anyModes_ = false;
  bool anyTexture_ = false;
};

}  // namespace carom::audio
