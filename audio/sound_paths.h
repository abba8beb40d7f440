#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "audio/hrtf.h"
#include "audio/receiver.h"
#include "carom/audio/absorption.h"
#include "carom/audio/listener.h"
#include "carom/audio/result.h"
#include "carom/audio/room.h"
#include "carom/audio/synth_settings.h"

namespace carom::audio {

/// All ways from a source to the samples, as the settings and the listeners decide them: receivers,
/// and the images of a room's walls with their filters. Immutable, to be shared between what lays
/// clicks and what plays them. [any thread]
struct SoundPaths {
  struct Channel {
    std::uint32_t listener = 0;
    Receiver receiver;
    Vec3 place = Vec3::Zero();  ///< m, world frame, as long as the listener stands
    Ear ear = Ear::left;        ///< of a binaural listener
    bool isEar = false;
  };
  struct Path {
    const Image* image = nullptr;  ///< null: direct
    std::uint32_t chain = 0;       ///< of wall filters
  };

  SynthSettings settings;
  std::vector<Listener> listeners;  ///< heads with their responses
  std::vector<Channel> channels;
  std::vector<Image> images;
  std::vector<std::vector<ReflectionFilter>> chains;  ///< the first is empty: the direct path
  std::vector<Path> paths;                            ///< the first is direct
  bool hasHeads = false;
  double earliestEar = 0.0;  ///< s before the middle of its head, no ear hears anything earlier
  std::size_t longestResponse = 0;  ///< samples, of any ear; 0 without heads

  /// Whether pulses are put in as force, for RadiationFilter, or as pressure.
  bool isFiltered() const {
    return settings.sampling == Sampling::bandLimited || settings.radiation == Radiation::exact;
  }
};

/// Refuses: sample rate or medium out of range, no listener, a listener or a room that is not valid
/// (see there), a binaural listener whose responses cannot be loaded.
Result<std::shared_ptr<const SoundPaths>> makeSoundPaths(const SynthSettings& settings,
                                                         std::vector<Listener> listeners);

}  // namespace carom::audio
