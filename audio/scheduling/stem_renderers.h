#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "audio/propagation/sound_paths.h"
#include "audio/synthesis/click_renderer.h"
#include "audio/synthesis/scheduled_sound.h"

namespace carom::audio {

/// Renders a sound, and with SynthSettings::stems its parts beside it, each by a renderer of its
/// own: the whole has the same bits with stems and without. [one thread]
class StemRenderers final : public SoundSink {
 public:
  explicit StemRenderers(const std::shared_ptr<const SoundPaths>& paths);

  void add(const ScheduledSound& sound) override;
  /// Renders the channels of the whole, and behind them those of each stem.
  template <class Sample>
  void render(std::span<Sample* const> channels, std::size_t frames) noexcept;
  void seek(std::int64_t position);

  const ClickRenderer& whole() const { return whole_; }
  std::size_t channelCount() const;

 private:
  bool hasStems() const { return stems_.front() != nullptr; }
  ClickRenderer& stem(Stem stem) { return *stems_[static_cast<std::size_t>(stem)]; }

  std::size_t channels_;  // of the whole
  ClickRenderer whole_;
  std::array<std::unique_ptr<ClickRenderer>, kStems> stems_;  // all, or none
};

}  // namespace carom::audio
