#pragma once

#include <vector>

#include "audio/radiation/deforming_source.h"
#include "carom/audio/contact_state.h"
#include "carom/audio/impulse_event.h"
#include "carom/audio/listener.h"

namespace carom::audio {

/// The pose of a body, as Synth::moveBody takes it.
struct BodyPose {
  BodyId body = 0;
  ListenerPose pose;
};

/// The points of a jello at an instant, for pictures.
struct JelloPicture {
  double time = 0.0;          ///< s
  std::vector<float> points;  ///< m, world frame: x, y, z of each, as the lattice counts them
};

/// All that a mechanics has told in one step, or some.
struct RunPortion {
  double settledTime = 0.0;  ///< s: every event before it is known now
  std::vector<ImpulseEvent> events;
  std::vector<ContactState> contacts;
  std::vector<BodyPose> poses;
  std::vector<DeformingState> deformations;
  std::vector<JelloPicture> pictures;
  double seconds = 0.0;  ///< s, wall time in the mechanics; not kept in files
};

}  // namespace carom::audio
