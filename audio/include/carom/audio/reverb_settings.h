#pragma once

#include <array>

#include <carom/audio/absorption.h>
#include <carom/audio/result.h>
#include <carom/audio/room.h>

namespace carom {

/// The parameters of a statistical diffuse field.
struct ReverbSettings {
  double volume = 0.0;   ///< m^3, 0.1 to 1e6; sets the level
  double surface = 0.0;  ///< m^2, at least that of a sphere; the mean free path is 4 V / S
  DecayTimes decayTimes = {1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0};  ///< s, T60 per band, >= 0.05
  double onset = 0.0;           ///< s after the input, 0 to 1: when the tail begins; see onsetAfter
  double gain = 1.0;            ///< 1, >= 0: factor on the level of the diffuse field
  double speedOfSound = 343.0;  ///< m/s
  /// Pa, >= 1e-15. When the input is 0 and no delay line holds a sound that could be heard above
  /// this level, the tail is cut off and Reverb::isSilent.
  double silence = 1e-7;
};

/// Sabine's decay times in s: T60 = 24 ln(10) V / (c (S alpha + 4 m V)) (Kuttruff, Room Acoustics,
/// 5th ed. 2009, chapter 5). Infinity where nothing absorbs. `airAttenuation` is m, the attenuation
/// of the energy in air in 1/m, in the bands. [any thread]
DecayTimes sabineDecayTimes(const RoomMeasures& room, double speedOfSound,
                            const std::array<double, kBandCount>& airAttenuation = {});

/// Eyring's decay times in s (1930): Sabine's formula with -ln(1 - alpha) in place of alpha; 0
/// where alpha is 1. [any thread]
DecayTimes eyringDecayTimes(const RoomMeasures& room, double speedOfSound,
                            const std::array<double, kBandCount>& airAttenuation = {});

/// Time in s after emission at which, on average, the reflection after the `order`th is due, which
/// is (order + 1) 4 V / (S c). A tail begins there if images up to that order come before it.
/// [any thread]
double onsetAfter(int order, double volume, double surface, double speedOfSound);

/// Returns the settings for the tail of a box: Eyring's decay times (at least 0.05 s), with the
/// onset after the images of `room.order`. Refuses a room that is not a box, and a box in which a
/// band is never absorbed. [any thread]
Result<ReverbSettings> reverbOfBox(const Room& room, double speedOfSound);

}  // namespace carom
