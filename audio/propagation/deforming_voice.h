#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "audio/propagation/pose_track.h"
#include "audio/radiation/deforming_source.h"
#include "carom/audio/listener.h"
#include "carom/audio/result.h"

namespace carom::audio {

/// The sound of a deforming body at the listeners, on the direct path only: without the images of a
/// room and its reverberation. The two ears of a binaural listener are apart, but no head is
/// between them. [one thread]
class DeformingVoice {
 public:
  /// Longest travel time of sound through the air that is still heard, s.
  static constexpr double kLongestWay = 1.0;

  /// Creates the voice of listeners that stand still. Errors: settings out of range.
  static Result<DeformingVoice> create(const DeformingSettings& settings,
                                       const std::vector<Listener>& listeners);

  /// Has a listener move along a track.
  void follow(std::size_t listener, PoseTrack track) { tracks_.at(listener) = std::move(track); }
  /// The track of a listener, to which poses can be appended.
  PoseTrack& track(std::size_t listener) { return tracks_.at(listener); }

  /// Time in s by which the mechanics must be ahead of the sound.
  double lookahead() const { return source_.lookahead(); }
  void add(std::span<const DeformingState> states);
  /// Adds to `frames` samples of all channels, from sample `firstFrame` (of time 0 on) on.
  void addTo(std::span<float* const> channels, std::int64_t firstFrame, std::size_t frames);

 private:
  DeformingVoice(DeformingSource source, double sampleRate, const std::vector<Listener>& listeners);

  DeformingSource source_;
  double sampleRate_;
  std::vector<Listener> listeners_;
  std::vector<PoseTrack> tracks_;
};

}  // namespace carom::audio
