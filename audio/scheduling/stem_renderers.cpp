#include "audio/scheduling/stem_renderers.h"

#include <algorithm>

namespace carom::audio {
namespace {

/// True for a change of damping or of the way to a listener: a change of what rings already, by
/// whatever it was made to ring.
bool isChange(const ScheduledSound& sound) {
  return sound.clicks.empty() && sound.noise.powers.empty() &&
         std::ranges::all_of(sound.excitations, [](const ModalExcitation& excitation) {
           return excitation.isDamping() || excitation.isMotion();
         });
}

}  // namespace

StemRenderers::StemRenderers(const std::shared_ptr<const SoundPaths>& paths)
    : channels_(paths->channels.size()), whole_(paths) {
  if (paths->settings.stems)
    for (std::unique_ptr<ClickRenderer>& stem : stems_)
      stem = std::make_unique<ClickRenderer>(paths);
}

void StemRenderers::add(const ScheduledSound& sound) {
  whole_.add(sound);
  if (!hasStems()) return;
  if (isChange(sound)) {
    stem(Stem::rings).add(sound);
    stem(Stem::contacts).add(sound);
    return;
  }
  if (!sound.isEvent) return stem(Stem::contacts).add(sound);
  ScheduledSound part = sound;
  part.excitations = {};
  if (!part.clicks.empty()) stem(Stem::clicks).add(part);
  part = sound;
  part.clicks = {};
  if (!part.excitations.empty()) stem(Stem::rings).add(part);
}

std::size_t StemRenderers::channelCount() const {
  return channels_ * (hasStems() ? 1 + kStems : 1);
}

void StemRenderers::seek(std::int64_t position) {
  whole_.seek(position);
  if (!hasStems()) return;
  for (const std::unique_ptr<ClickRenderer>& stem : stems_)
    stem->seek(position);
}

template <class Sample>
void StemRenderers::render(std::span<Sample* const> channels, std::size_t frames) noexcept {
  whole_.render<Sample>(channels.first(channels_), frames);
  if (!hasStems()) return;
  for (std::size_t index = 0; index < kStems; ++index)
    stems_[index]->render<Sample>(channels.subspan((1 + index) * channels_, channels_), frames);
}

template void StemRenderers::render<float>(std::span<float* const>, std::size_t) noexcept;
template void StemRenderers::render<double>(std::span<double* const>, std::size_t) noexcept;

}  // namespace carom::audio
