#include "audio/propagation/listener_tracks.h"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

namespace carom::audio {

ListenerTracks::ListenerTracks(std::shared_ptr<const SoundPaths> paths)
    : paths_(std::move(paths)),
      hasMoved_(paths_->listeners.size(), false),
      jumps_(paths_->listeners.size(), 0) {
  for (const Listener& listener : paths_->listeners)
    tracks_.emplace_back(ListenerPose{0.0, listener.position, listener.orientation});
}

void ListenerTracks::restart() {
  for (std::size_t index = 0; index < tracks_.size(); ++index) {
    const Listener& listener = paths_->listeners[index];
    tracks_[index].restart({0.0, listener.position, listener.orientation});
  }
  hasMoved_.assign(tracks_.size(), false);
  ++changes_;
}

Status ListenerTracks::move(std::size_t listener, const ListenerPose& pose) {
  if (listener >= tracks_.size()) return noListener(listener);
  PoseTrack& track = tracks_[listener];
  const bool accepted = hasMoved_[listener] ? track.append(pose) : track.restart(pose);
  if (!accepted)
    return Error{
        "synth: pose of listener " + std::to_string(listener) + " at " + std::to_string(pose.time) +
        " s: expected finite values, a unit quaternion, a later time than the last pose's, "
        "and at most 180 m/s from there"};
  if (!hasMoved_[listener]) ++jumps_[listener];
  hasMoved_[listener] = true;
  ++changes_;
  return std::monostate{};
}

Status ListenerTracks::place(std::size_t listener, const ListenerPose& pose) {
  if (listener >= tracks_.size()) return noListener(listener);
  if (!tracks_[listener].restart(pose))
    return Error{"synth: pose of listener " + std::to_string(listener) +
                 ": expected finite values and a unit quaternion"};
  hasMoved_[listener] = true;
  ++jumps_[listener];
  ++changes_;
  return std::monostate{};
}

Error ListenerTracks::noListener(std::size_t listener) const {
  return Error{"synth: there is no listener " + std::to_string(listener) + "; there are " +
               std::to_string(tracks_.size())};
}

Arrival ListenerTracks::arrivalAt(const SoundPaths::Channel& channel, double time,
                                  const Vec3& from) const {
  if (hasMoved_[channel.listener]) {
    return arrivalOf(tracks_[channel.listener], {.time = time, .position = from},
                     paths_->settings.medium.speedOfSound, channel.receiver.offset);
  }
  Arrival arrival;
  const Vec3 towards = from - channel.place;
  arrival.distance = towards.norm();
  if (arrival.distance > 0.0) arrival.towardsSource = towards / arrival.distance;
  arrival.orientation = paths_->listeners[channel.listener].orientation;
  return arrival;
}

ListenerTracks::Place ListenerTracks::placeOf(const SoundPaths::Channel& channel,
                                              double time) const {
  if (!hasMoved_[channel.listener])
    return {channel.place, paths_->listeners[channel.listener].orientation};
  const ListenerPose pose = tracks_[channel.listener].at(time);
  return {pose.position + pose.orientation * channel.receiver.offset, pose.orientation};
}

double ListenerTracks::nearestDistance(double time, const Vec3& point) const {
  double nearest = std::numeric_limits<double>::infinity();
  for (const PoseTrack& track : tracks_)
    nearest = std::min(nearest, (track.at(time).position - point).norm());
  return nearest;
}

}  // namespace carom::audio
