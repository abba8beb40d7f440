#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "audio/propagation/pose_track.h"
#include "audio/propagation/sound_paths.h"
#include "carom/audio/result.h"

namespace carom::audio {

/// The motion of all listeners, as it becomes known. [one thread]
class ListenerTracks {
 public:
  explicit ListenerTracks(std::shared_ptr<const SoundPaths> paths);

  Status move(std::size_t listener, const ListenerPose& pose);   ///< as Synth::moveListener
  Status place(std::size_t listener, const ListenerPose& pose);  ///< as Synth::placeListener
  /// Returns the listeners to where they were created, to await their first pose.
  void restart();

  /// Returns how the wave that leaves `from` (m, world frame) at `time` (s) arrives at a channel.
  /// For a listener at rest nothing has to be solved.
  Arrival arrivalAt(const SoundPaths::Channel& channel, double time, const Vec3& from) const;

  /// Where a channel's receiver is.
  struct Place {
    Vec3 position = Vec3::Zero();  ///< m, world frame
    Quat orientation = Quat::Identity();
  };
  Place placeOf(const SoundPaths::Channel& channel, double time) const;
  bool anyMoves() const { return std::ranges::find(hasMoved_, true) != hasMoved_.end(); }
  /// Number of times at which a listener was put somewhere, with no way to there.
  std::uint64_t jumps(std::size_t listener) const { return jumps_[listener]; }
  /// Number of changes so far: as long as it stays, what is known of a moment does.
  std::uint64_t changes() const { return changes_; }

  /// Distance (m) from a point (world frame) to the nearest listener at `time` (s).
  double nearestDistance(double time, const Vec3& point) const;

 private:
  Error noListener(std::size_t listener) const;

  std::shared_ptr<const SoundPaths> paths_;
  std::vector<PoseTrack> tracks_;     // one per listener
  std::vector<bool> hasMoved_;        // one per listener: a pose has come
  std::vector<std::uint64_t> jumps_;  // one per listener
  std::uint64_t changes_ = 0;
};

}  // namespace carom::audio
