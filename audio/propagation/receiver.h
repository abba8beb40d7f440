#pragma once

#include <array>
#include <cstddef>

#include "carom/audio/listener.h"
#include "carom/audio/vector.h"

namespace carom::audio {

/// One microphone of a listener: one channel.
///
/// Model: a first-order microphone in a plane wave, gain = (1 - p) + p cos(angle between the axis
/// and the source), the same at all frequencies; negative behind a figure of eight, where pressure
/// is heard with the opposite sign. Real directional microphones sense the pressure gradient: near
/// the source, within a wavelength or so, they lift the low frequencies (proximity effect), and
/// their pattern narrows at high ones. Neither is modelled, and neither is the microphone in the
/// way of the sound.
struct Receiver {
  Vec3 offset = Vec3::Zero();  ///< m, from the listener's position, listener frame
  Vec3 axis = -Vec3::UnitZ();  ///< unit, listener frame: where it is most sensitive
  double pattern = 0.0;        ///< 0 omnidirectional, 0.5 cardioid, 1 figure of eight
};

/// A listener's receivers in the order of its channels, as `receiversOf` returns them.
struct Receivers {
  std::array<Receiver, 2> items;
  std::size_t count = 0;

  const Receiver* begin() const { return items.data(); }
  const Receiver* end() const { return items.data() + count; }
  std::size_t size() const { return count; }
  const Receiver& operator[](std::size_t channel) const { return items[channel]; }
};

/// Returns a listener's receivers: left, then right for a pair. The two ears of a binaural listener
/// are omnidirectional and both in the middle of the head: the effect of its shape on level and
/// delay is in the responses of its HrtfSet, and must not be counted twice. [any thread; does not
/// allocate]
Receivers receiversOf(const Listener& listener);

/// The pattern in force: `listener.pattern`, or the default of its format. [any thread]
double patternOf(const Listener& listener);

/// The factor on the pressure of a plane wave, -1 to 1.
/// @param orientation of the listener, listener frame to world frame
/// @param towardsSource world frame, from the receiver to the source, of any length; when it is
///   zero there is no direction and only the omnidirectional share, 1 - pattern, is left
/// [any thread; does not allocate]
double gain(const Receiver& receiver, const Quat& orientation, const Vec3& towardsSource);

}  // namespace carom::audio
