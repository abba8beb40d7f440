#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "carom/sound.h"

namespace carom::test {

/// Attaches a sound that is pulled as fast as its world steps.
inline Sound attachOffline(btDynamicsWorld& world, SoundSettings settings,
                           const WorldSoundSettings& worldSettings = {}) {
  settings.clock = SoundClock::simulation;
  Result<Sound> sound = Sound::attach(world, settings, worldSettings);
  EXPECT_TRUE(sound) << sound.error().message;
  const Status prepared = sound->prepareRendering(settings.synth.sampleRate);
  EXPECT_TRUE(prepared);
  return *std::move(sound);
}

/// Renders all frames that are ready and appends them to the channels.
inline void takeReady(SoundOutput& sound, std::vector<std::vector<float>>& channels) {
  constexpr std::size_t kBlock = 512;
  channels.resize(sound.channelCount());
  while (const std::size_t frames = std::min(sound.framesReady(), kBlock)) {
    std::vector<float*> to;
    for (std::vector<float>& channel : channels) {
      channel.resize(channel.size() + frames);
      to.push_back(channel.data() + channel.size() - frames);
    }
    sound.render(to, frames);
  }
}

inline double peakOf(std::span<const float> samples) {
  float peak = 0.0F;
  for (const float sample : samples)
    peak = std::max(peak, std::abs(sample));
  return static_cast<double>(peak);
}

}  // namespace carom::test
