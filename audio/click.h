#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "audio/click_kernels.h"
#include "audio/pulse.h"
#include "audio/radiation_bank.h"
#include "audio/sphere_mesh.h"

namespace carom::audio {

/// Beyond this index a double, and so a time, skips whole samples: 5900 years at 48 kHz.
inline constexpr double kExactSamples = 0x1.0p+53;

/// A pulse that takes more nodes than these is sampled as a long one.
inline constexpr std::size_t kMostNodes = 48;

/// What one contact of one body sounds like at one receiver, over one path: laid over the samples
/// of its buses, and free of bodies, listeners and rooms. What it points to is immutable, and lives
/// as long as the ClickLayer that laid it. Two lines of the cache: many wait.
struct alignas(64) Click {
  std::int64_t first = 0;  ///< sample of the bus
  ClickTrack track;        ///< from that sample on
  double near = 0.0;       ///< weight of near over far
  const Pulse* pulse = nullptr;
  std::span<const PulseNode> nodes;  ///< empty: it is long, or its sampling is naive
  const RadiationBank::Mix* filters = nullptr;
  std::array<std::uint32_t, 4> buses{};  ///< one for each filter; the player's
  std::uint32_t chain = 0;               ///< of wall filters, SoundPaths::chains
  std::uint32_t channel = 0;             ///< the number of channels: into the reverberation
  std::uint32_t samples = 0;
};

}  // namespace carom::audio
