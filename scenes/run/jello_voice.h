#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "audio/propagation/pose_track.h"
#include "audio/radiation/deforming_source.h"
#include "carom/audio/listener.h"
#include "carom/audio/result.h"
#include "scenes/format/scene.h"

namespace carom::scenes {

/// The sound of a deforming body at the listeners, on the direct path only: without the images of a
/// room and its reverberation. The two ears of a binaural listener are apart, but no head is
/// between them. [one thread]
class JelloVoice {
 public:
  /// Creates the voice; `step` is the time between states, s. Errors: settings out of range.
  static Result<JelloVoice> create(const Scene& scene, double step);

  /// Time in s by which the mechanics must be ahead of the sound.
  double lookahead() const { return source_.lookahead(); }
  void add(std::span<const audio::DeformingState> states);
  /// Adds to `frames` samples of all channels, from sample `firstFrame` of the scene on.
  void addTo(std::span<float* const> channels, std::int64_t firstFrame, std::size_t frames);

 private:
  JelloVoice(const Scene& scene, audio::DeformingSource source);

  audio::DeformingSource source_;
  double sampleRate_;
  std::vector<Listener> listeners_;
  std::vector<audio::PoseTrack> tracks_;
};

}  // namespace carom::scenes
