#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include <carom/audio/absorption.h>
#include <carom/audio/result.h>
#include <carom/audio/vector.h>

namespace carom {

// Reflections as mirror images of the sources. All of this file: [any thread].

/// An infinite plane wall. The air is where the normal points: {x : normal . x >= offset}.
struct Reflector {
  Vec3 normal = Vec3::UnitZ();  ///< unit (to 1e-6), world frame, into the air
  double offset = 0.0;          ///< m, along the normal, from the world's origin
  Absorption absorption = {};
};

/// The air of a room is the intersection of its reflectors' half-spaces, so it is convex, and open
/// where no reflector closes it. Walls that end, edges that diffract and obstacles are not
/// modelled.
struct Room {
  std::vector<Reflector> reflectors;  ///< at most 1000
  int order = 1;                      ///< successive reflections, 0 to 32; above 1 only for a box
};

/// A mirror image: the transform that a path with `order` reflections applies to a source.
struct Image {
  Eigen::Matrix3d linear = Eigen::Matrix3d::Identity();  ///< orthogonal, determinant (-1)^order
  Vec3 shift = Vec3::Zero();                             ///< m, world frame
  /// Indices into Room::reflectors, ascending, one for each reflection: a wall that is hit twice is
  /// listed twice. The path passes these reflectors' filters in series; their order is of no
  /// consequence.
  std::vector<std::size_t> reflectors;
  int order = 0;  ///< == reflectors.size()

  /// Position (m, world frame) of the image of a source at `source`.
  Vec3 position(const Vec3& source) const { return linear * source + shift; }
  /// The image of a polar vector at the source (dipole, impulse, velocity), in its own unit. For
  /// one wall, D' = D - 2 (D . n) n: source and image together leave a rigid wall's normal velocity
  /// at 0.
  Vec3 vector(const Vec3& atSource) const { return linear * atSource; }
};

/// Returns all images up to `room.order`, each once, the lower orders first, without the direct
/// path. A box's images are the lattice of Allen & Berkley 1979 ("Image method for efficiently
/// simulating small-room acoustics"), 4 k^2 + 2 of order k, in any orientation; exact for rigid
/// walls.
///
/// Above order 1 it refuses every room but a box: six reflectors in three pairs, normals opposite
/// in a pair and perpendicular between pairs (1e-6), with air between. Refuses also: a normal that
/// is not of unit length, numbers that are not finite, absorption outside [0, 1], the same plane
/// twice, an order out of range.
Result<std::vector<Image>> makeImages(const Room& room);

/// True if the path of `image` from `source` to `listener` (m, world frame) exists.
///
/// Both must be in the air of every reflector: a listener behind a wall hears no reflection. For
/// order 1, so must the point of reflection, where the line from the image to the listener meets
/// the wall; in a room without a right angle it can lie behind another wall. In a box every image
/// of the lattice is heard. A point on a plane counts as in front of it, to 1e-6 m. `image` is one
/// of makeImages(room). Does not allocate.
bool isVisible(const Room& room, const Image& image, const Vec3& source, const Vec3& listener);

/// The measures of a room from which its decay times follow (sabineDecayTimes, eyringDecayTimes).
struct RoomMeasures {
  double volume = 0.0;        ///< m^3
  double surface = 0.0;       ///< m^2
  Absorption meanAbsorption;  ///< weighted by area
};

/// Returns the measures of a box, as defined at makeImages; refuses every other room.
Result<RoomMeasures> measureBox(const Room& room);

// Late reverberation.

/// The parameters of a statistical diffuse field.
struct ReverbSettings {
  double volume = 0.0;   ///< m^3, 0.1 to 1e6; sets the level
  double surface = 0.0;  ///< m^2, at least that of a sphere; the mean free path is 4 V / S
  DecayTimes decayTimes = {1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0};  ///< s, T60 per band, >= 0.05
  /// s, T60 at 16 kHz, >= 0.05; 0: the decay goes on as at 8 kHz, but for what the air absorbs more
  /// if SynthSettings::airAbsorption has it absorb.
  double decayTimeAt16kHz = 0.0;
  /// True if the decay times are those of walls and air together, as one measures them; false if
  /// the air's part is still to come, by SynthSettings::airAbsorption.
  bool includesAir = true;
  double onset = 0.0;           ///< s after the input, 0 to 1: when the tail begins; see onsetAfter
  double gain = 1.0;            ///< 1, >= 0: factor on the level of the diffuse field
  double speedOfSound = 343.0;  ///< m/s
  /// Pa, >= 1e-15. When the input is 0 and no delay line holds a sound that could be heard above
  /// this level, the tail is cut off and Reverb::isSilent.
  double silence = 1e-7;
};

/// Sabine's decay times in s: T60 = 24 ln(10) V / (c (S alpha + 4 m V)) (Kuttruff, Room Acoustics,
/// 5th ed. 2009, chapter 5). Infinity where nothing absorbs. `attenuation` is m, that of the energy
/// in air in 1/m, in the bands: airAttenuation. [any thread]
DecayTimes sabineDecayTimes(const RoomMeasures& room, double speedOfSound,
                            const std::array<double, kBandCount>& attenuation = {});

/// Eyring's decay times in s (1930): Sabine's formula with -ln(1 - alpha) in place of alpha; 0
/// where alpha is 1. [any thread]
DecayTimes eyringDecayTimes(const RoomMeasures& room, double speedOfSound,
                            const std::array<double, kBandCount>& attenuation = {});

/// Time in s after emission at which, on average, the reflection after the `order`th is due, which
/// is (order + 1) 4 V / (S c). A tail begins there if images up to that order come before it.
/// [any thread]
double onsetAfter(int order, double volume, double surface, double speedOfSound);

/// Returns the settings for the tail of a box: Eyring's decay times (at least 0.05 s), with the
/// onset after the images of `room.order`, without the air in it. Refuses a room that is not a box,
/// and a box whose walls absorb nothing in some band. [any thread]
Result<ReverbSettings> reverbOfBox(const Room& room, double speedOfSound);

}  // namespace carom
