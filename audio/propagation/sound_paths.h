#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "audio/propagation/air_filter.h"
#include "audio/propagation/hrtf.h"
#include "audio/propagation/receiver.h"
#include "audio/propagation/reverb.h"
#include "carom/audio/absorption.h"
#include "carom/audio/listener.h"
#include "carom/audio/result.h"
#include "carom/audio/room.h"
#include "carom/audio/synth_settings.h"

namespace carom::audio {

/// All propagation paths from a source to the samples, as the settings and the listeners decide
/// them: receivers, and the images of a room's walls with their filters. Immutable, to be shared
/// between ContactSoundScheduler and the renderers. [any thread]
struct SoundPaths {
  struct Channel {
    std::uint32_t listener = 0;
    Receiver receiver;
    Vec3 place = Vec3::Zero();  ///< m, world frame: of the receiver, as long as the listener stands
    Ear ear = Ear::left;        ///< which ear of a binaural listener
    bool isEar = false;
  };
  struct Path {
    const Image* image = nullptr;  ///< null: direct
    std::uint32_t chain = 0;       ///< index into `chains`, the wall filters
  };

  SynthSettings settings;           ///< the reverberation with the air's share above 8 kHz
  std::vector<Listener> listeners;  ///< each head with its responses
  std::vector<Channel> channels;
  std::vector<Image> images;
  std::vector<std::vector<ReflectionFilter>> chains;  ///< the first is empty: the direct path
  std::vector<Path> paths;                            ///< the first is direct
  std::optional<AirFilter> air;                       ///< none: the air absorbs nothing
  std::map<std::size_t, Reverb> reverbs;  ///< by their channels, for listeners to copy; silent
  bool hasHeads = false;
  /// s: no ear hears a sound earlier than that before the middle of its head.
  double earliestEar = 0.0;
  std::size_t longestResponse = 0;  ///< samples, longest response of an ear; 0 without heads

  /// True if pulses enter a bus as force, for RadiationFilter; false if they enter as pressure.
  bool isFiltered() const {
    return settings.comparison.sampling == Sampling::bandLimited ||
           settings.comparison.radiation == Radiation::exact;
  }
};

/// Makes the paths. Refuses: sample rate or medium out of range, no listener, a listener or a room
/// that is not valid (see Listener and Room), a binaural listener whose responses cannot be loaded.
Result<std::shared_ptr<const SoundPaths>> makeSoundPaths(const SynthSettings& settings,
                                                         std::vector<Listener> listeners);

}  // namespace carom::audio
