#include "audio/scheduling/sounding_bodies.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>

namespace carom::audio {
namespace {

/// All rough surfaces share one noise pattern, sampled at different places.
constexpr std::uint64_t kRoughSeed = 1;

}  // namespace

const SurfaceTexture* SoundingBody::texture() {
  if (sound.texture != nullptr) return sound.texture.get();
  const Roughness& roughness = sound.material.roughness;
  if (roughTexture == nullptr && roughness.rmsHeight > 0.0)
    roughTexture =
        std::make_shared<const SurfaceTexture>(*SurfaceTexture::rough(roughness, kRoughSeed));
  return roughTexture.get();
}

const TextureCoordinates* SoundingBody::textureCoordinates() const {
  return sound.texture != nullptr ? sound.textureCoordinates.get() : nullptr;
}

SoundingBodies::SoundingBodies(std::shared_ptr<const SoundPaths> paths, ModalExciter& exciter)
    : paths_(std::move(paths)),
      exciter_(exciter),
      filters_(paths_->settings.comparison.sampling == Sampling::bandLimited
                   ? RadiationFilter::Input::spread
                   : RadiationFilter::Input::bare) {}

Status SoundingBodies::set(BodyId id, const SoundBody& body) {
  const auto refuse = [id](const std::string& why) {
    return Error{"sound body " + std::to_string(id) + ": " + why};
  };
  if (const Status valid = validate(body); !valid) return refuse(valid.error().message);
  if (body.modal != nullptr && !exciter_.knows(*body.modal))
    if (const Status valid = validate(*body.modal); !valid)
      return refuse("modal model: " + valid.error().message);
  SoundingBody known{.sound = body};
  if (std::isfinite(body.mass))
    known.filters = &filtersOf(body.shape ? body.shape->radius() : body.radius);
  if (known.filters != nullptr) known.recoil = recoilOf(body);
  if (body.modal != nullptr) known.modes = &exciter_.sourceOf(body.modal);
  anyModes_ = anyModes_ || known.modes != nullptr;
  anyTexture_ = anyTexture_ || body.texture != nullptr || body.material.roughness.rmsHeight > 0.0;
  // Making a texture takes some 20 ms, for which the first slide of a live host shall not wait.
  if (paths_->settings.lasting == LastingDetail::heard) known.texture();
  bodies_.insert_or_assign(id, std::move(known));
  return std::monostate{};
}

SoundingBody* SoundingBodies::find(BodyId id) {
  const auto entry = bodies_.find(id);
  return entry == bodies_.end() ? nullptr : &entry->second;
}

const SoundingBody* SoundingBodies::find(BodyId id) const {
  const auto entry = bodies_.find(id);
  return entry == bodies_.end() ? nullptr : &entry->second;
}

/// Returns the radiation filters for a radius (m); the compact model has one for all radii.
const RadiationBank::Mix& SoundingBodies::filtersOf(double radius) {
  const SynthSettings& settings = paths_->settings;
  if (settings.comparison.radiation == Radiation::compact)
    return filters_.mixOf(std::numeric_limits<double>::infinity());
  return filters_.mixOf(settings.medium.speedOfSound /
                        (std::min(radius, kLargestFilteredRadius) * settings.sampleRate));
}

/// Returns the recoil's filters, made once for all bodies that share it; null without one, for
/// comparisons, for bodies larger than those that are filtered, and beyond the limit.
std::shared_ptr<const RecoilFilters> SoundingBodies::recoilOf(const SoundBody& body) {
  const SynthSettings& settings = paths_->settings;
  const bool isCompared = settings.comparison.radiation != Radiation::exact ||
                          settings.comparison.sampling != Sampling::bandLimited;
  if (body.recoil == nullptr || body.shape == nullptr || isCompared) return nullptr;
  if (body.recoil->radius > kLargestFilteredRadius) return nullptr;
  if (const auto known = recoils_.find(body.recoil); known != recoils_.end()) return known->second;
  if (recoils_.size() >= mostRecoils_) {
    // Recoils that no body has any more make room for others.
    std::erase_if(recoils_, [](const auto& entry) { return entry.second.use_count() == 1; });
    if (recoils_.size() >= mostRecoils_) return nullptr;
  }
  const double corner = settings.medium.speedOfSound / (body.recoil->radius * settings.sampleRate);
  return recoils_
      .emplace(body.recoil, std::make_shared<const RecoilFilters>(body.recoil, corner, filters_))
      .first->second;
}

}  // namespace carom::audio
