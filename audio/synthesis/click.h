#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

#include "audio/model/pulse.h"
#include "audio/model/sphere_mesh.h"
#include "audio/radiation/radiation_bank.h"
#include "audio/synthesis/click_kernels.h"

namespace carom::audio {

/// Largest number of nodes by which a pulse is sampled; one that needs more is sampled as a long
/// pulse.
inline constexpr std::size_t kMostNodes = 48;
/// Largest number of nodes of an impact that has a course of its own.
inline constexpr std::size_t kMostImpactNodes = 256;

/// Sum of the magnitudes of a block of samples (Pa) from which on it can be no sound.
inline constexpr double kNoSound = 1e30;

/// True if these samples can be sound: none is infinite, huge or no number.
inline bool canBeSound(std::span<const double> samples) noexcept {
  double sum = 0.0;
  for (const double sample : samples)
    sum += std::abs(sample);
  return sum <= kNoSound;
}

/// The sound of one contact of one body at one receiver, over one path: scheduled on the samples of
/// its buses, and independent of bodies, listeners and rooms. The objects that it points to are
/// immutable, and live as long as the ContactSoundScheduler that made it, except for the nodes of a
/// train (ScheduledSound::train). It fits two cache lines, since many clicks wait.
struct alignas(64) Click {
  std::int64_t first = 0;  ///< sample of the bus at which it begins
  ClickTrack track;        ///< counted from that sample
  double near = 0.0;       ///< weight of the filter's near part over its far part
  const Pulse* pulse = nullptr;
  std::span<const PulseNode> nodes;  ///< empty: the pulse is long, or its sampling is naive
  const RadiationBank::Mix* filters = nullptr;
  std::array<std::uint32_t, 4> buses{};  ///< the renderer's, one for each filter
  std::uint32_t chain = 0;               ///< index into SoundPaths::chains, the wall filters
  std::uint32_t channel = 0;             ///< index; the number of channels: the reverberation
  std::uint32_t samples = 0;
  std::uint16_t air = 0;  ///< AirFilter::codeOf its distance; 0: the air is left out
  bool isLeader = false;  ///< the first click of an event, with which the event is heard
};
static_assert(sizeof(Click) == 128);

}  // namespace carom::audio
