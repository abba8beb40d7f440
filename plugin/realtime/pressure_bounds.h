#pragma once

#include <memory>
#include <span>

#include "audio/propagation/sound_paths.h"
#include "audio/scheduling/contact_sound_scheduler.h"

namespace carom::plugin {

/// Upper bounds of the pressure of events at each listener, for a host that asks for them event by
/// event: those by which a scheduler decides what is inaudible. [simulation thread]
class PressureBounds {
 public:
  explicit PressureBounds(const std::shared_ptr<const audio::SoundPaths>& paths)
      : scheduler_(paths) {}

  /// Takes bodies and poses, as the scheduler of an output does.
  audio::ContactSoundScheduler& scheduler() { return scheduler_; }
  /// Adds the bound (Pa) of the click of one share to those of its collision, one by listener.
  void add(const ImpulseEvent& share, std::span<double> peaks);

 private:
  audio::ContactSoundScheduler scheduler_;
};

}  // namespace carom::plugin
