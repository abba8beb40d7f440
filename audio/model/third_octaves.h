#pragma once

#include <array>
#include <cstddef>

namespace carom::audio {

// Noise by third octaves: of a contact's force, and of its sound. All of this file: [any thread],
// no allocation.

/// Number of third octaves, of 50 Hz to 16 kHz.
inline constexpr std::size_t kThirdOctaves = 26;
/// Width of a third octave over its centre (IEC 61260-1, base 10).
inline constexpr double kThirdOctaveWidth = 0.2307681;

/// A power in each third octave: N^2 of a force, Pa^2 of a pressure.
using BandPowers = std::array<double, kThirdOctaves>;

/// Exact centres in Hz, 10^(n/10) (IEC 61260-1).
const std::array<double, kThirdOctaves>& thirdOctaves();

/// Power in Pa^2 of a pure tone at the threshold of hearing, free field, from the front (ISO
/// 226:2003, table 1; ISO 389-7:2005 at 16 kHz). Noise of a third octave is heard from about the
/// same power on, as a third octave is about as wide as what the ear sums up.
const BandPowers& hearingThreshold();

}  // namespace carom::audio
