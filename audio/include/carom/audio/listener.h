#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <numbers>
#include <optional>
#include <string>

#include <carom/audio/result.h>
#include <carom/audio/vector.h>

namespace carom {

/// Head-related impulse responses, prepared for rendering: see loadHrtf. Immutable, to be shared.
class HrtfSet;

/// The kind of receiver: microphones or a head. Channels are in the order left, right.
enum class ListenerFormat {
  mono,            ///< one microphone, one channel
  spacedPair,      ///< two microphones `spacing` apart: A/B, or ORTF with cardioids
  coincidentPair,  ///< two directional microphones in one place, turned apart: X/Y, Blumlein
  binaural         ///< two ears of a head, through its measured responses: for headphones
};

/// A place in the air where pressure is heard, and the format in which it is heard. A default
/// listener is one omnidirectional microphone, one channel.
///
/// The listener's own frame is that of OpenAL, glTF and Web Audio: it looks along its -Z, +Y is
/// up and +X is to its right. With the identity orientation it looks along the world's -Z.
struct Listener {
  std::string name;
  Vec3 position = Vec3::Zero();         ///< m, world frame: the microphone, the middle of a
                                        ///< pair, or the middle between the ears
  Quat orientation = Quat::Identity();  ///< listener frame to world frame, unit length
  ListenerFormat format = ListenerFormat::mono;
  /// Distance in m between the microphones of a spaced pair. Half a metre makes a source at the
  /// side 1.5 ms earlier in one channel, about enough to move its image all the way into one
  /// loudspeaker; 0.17 is ORTF.
  double spacing = 0.5;
  /// Angle in rad from straight ahead to the axis of either microphone of a pair, outwards. A
  /// quarter turn between the two is X/Y; 55 degrees each is ORTF. No effect on omnidirectional
  /// microphones.
  double halfAngle = std::numbers::pi / 4.0;
  /// Directional pattern of each microphone, as `Receiver::pattern`: 0 omnidirectional, 0.5
  /// cardioid, 1 figure of eight. Empty: cardioid in a coincident pair, omnidirectional otherwise.
  /// A binaural listener does not use it.
  std::optional<double> pattern = std::nullopt;
  /// Binaural only: the responses of the head, shared with other listeners. Null: the default set.
  std::shared_ptr<const HrtfSet> hrtf = nullptr;
};
static_assert(alignof(Listener) == alignof(double));  // its size depends on the standard library

/// Position and orientation of a listener at one instant.
struct ListenerPose {
  double time = 0.0;                    ///< s, simulation clock
  Vec3 position = Vec3::Zero();         ///< m, world frame
  Quat orientation = Quat::Identity();  ///< listener frame to world frame, unit length
};

// The layout is the same for every host, whatever vector instructions it is compiled with.
static_assert(sizeof(ListenerPose) == 64 && alignof(ListenerPose) == alignof(double));

/// True if the pose is finite and its orientation of unit length within 1e-6. [any thread]
bool isPose(const ListenerPose& pose);

/// Number of channels that the listener fills: 1 for mono, 2 otherwise. [any thread]
std::size_t channelCount(const Listener& listener);

/// Refuses a listener with values out of range; the message begins with the field. [any thread]
Status validate(const Listener& listener);

/// Loads the responses in a SOFA file (AES69, convention SimpleFreeFieldHRIR), for
/// `Listener::hrtf`, at the sample rate of the sound (Hz, 8000 to 384000). An empty path stands for
/// the default set, which is also that of a binaural listener without `hrtf`. Errors: no such file,
/// no SOFA file, another convention, sizes that contradict each other, a head that is not
/// surrounded by measurements, a sample rate out of range, and a build without libmysofa.
/// [any thread but the audio thread: reads a file]
Result<std::shared_ptr<const HrtfSet>> loadHrtf(const std::filesystem::path& path,
                                                double sampleRate);

}  // namespace carom
