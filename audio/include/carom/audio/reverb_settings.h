#pragma once

#include <array>

#include <carom/audio/absorption.h>
#include <carom/audio/result.h>
#include <carom/audio/room.h>

namespace carom {

/// A diffuse field as statistics see it.
struct ReverbSettings {
  double volume = 0.0;   ///< m^3, 0.1 to 1e6; sets the level
  double surface = 0.0;  ///< m^2, at least a sphere's; with the volume the mean free path 4 V / S
  DecayTimes decayTimes = {1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0};  ///< s, T60 per band, >= 0.05
  double onset = 0.0;  ///< s after the input, 0 to 1: where the tail begins; see onsetAfter
  double gain = 1.0;   ///< 1, >= 0, times the level of the diffuse field
  double speedOfSound = 343.0;  ///< m/s
  /// Pa, >= 1e-15. When the input is 0 and no line holds what could be heard above it, the tail is
  /// cut off, and isSilent.
  double silence = 1e-7;
};

/// s: T60 = 24 ln(10) V / (c (S alpha + 4 m V)), Sabine's (Kuttruff, Room Acoustics, 5th ed. 2009,
/// chapter 5). Infinity where nothing absorbs. `airAttenuation` is m, 1/m, of the energy, in the
/// bands. [any thread]
DecayTimes sabineDecayTimes(const RoomMeasures& room, double speedOfSound,
                            const std::array<double, kBandCount>& airAttenuation = {});

/// As Sabine's with -ln(1 - alpha) in place of alpha (Eyring 1930): 0 where alpha is 1.
/// [any thread]
DecayTimes eyringDecayTimes(const RoomMeasures& room, double speedOfSound,
                            const std::array<double, kBandCount>& airAttenuation = {});

/// s, after emission: when on average the reflection after the `order`th is due,
/// (order + 1) 4 V / (S c): where a tail leaves off from images up to that order. [any thread]
double onsetAfter(int order, double volume, double surface, double speedOfSound);

/// The tail of a box: Eyring's times (0.05 s where it is less), begun where the images of
/// `room.order` leave off. Refuses what is not a box, and a box in which a band is never absorbed.
/// [any thread]
Result<ReverbSettings> reverbOfBox(const Room& room, double speedOfSound);

}  // namespace carom
