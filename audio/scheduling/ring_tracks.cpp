#include "audio/scheduling/ring_tracks.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "audio/propagation/hrtf.h"
#include "audio/propagation/receiver.h"
#include "audio/synthesis/modal_bank.h"

namespace carom::audio {
namespace {

/// By how much the direction may turn within a stretch (rad), and how far the delay may be from a
/// straight line (samples, times 8), before stretches become shorter; and the share of both at
/// which they become longer.
constexpr double kMostTurn = 0.06;
constexpr double kMostBend = 0.05;
constexpr double kCoarser = 0.25;
/// What moves less than this share of its distance, and turns by less (rad), is at rest.
constexpr double kStill = 1e-7;
constexpr int kMostLooks = 30;            ///< in which a time of emission is found
constexpr double kTimeTolerance = 1e-11;  ///< s
/// Bounds of the rate at which a body's time goes by: beyond, it flies away at the speed of sound.
constexpr double kLeastRate = 0.1;
constexpr double kMostRate = 10.0;

}  // namespace

RingTracks::RingTracks(std::shared_ptr<const SoundPaths> paths, const ListenerTracks& listeners,
                       ModalExciter& exciter)
    : paths_(std::move(paths)), listeners_(listeners), exciter_(exciter) {}

bool RingTracks::move(BodyId body, const ListenerPose& pose) {
  const auto known = bodies_.find(body);
  if (known == bodies_.end()) {
    PoseTrack track;
    if (!track.restart(pose)) return false;
    bodies_.emplace(body, std::move(track));
    return true;
  }
  // What is put somewhere else, or thrown faster than a track goes, is there at once.
  return known->second.append(pose) ||
         (pose.time > known->second.lastTime() && known->second.restart(pose));
}

void RingTracks::forget(BodyId body) {
  const auto track = bodies_.find(body);
  if (track == bodies_.end()) return;
  for (Ring& ring : rings_)
    if (ring.body == body) ring.removed = track->second;
  bodies_.erase(track);
}

void RingTracks::clear() {
  bodies_.clear();
  rings_.clear();
}

bool RingTracks::follows(const ImpulseEvent& event) const {
  if (!isAdvanced_) return false;
  const auto track = bodies_.find(event.body);
  return listeners_.anyMoves() || (track != bodies_.end() && track->second.moves(event.time));
}

/// Returns the ring of the body that was struck, a new one if it is silent.
RingTracks::Ring& RingTracks::ringOf(const Blow& blow) {
  const auto isOf = [&](const Ring& ring) {
    return ring.body == blow.event.body && ring.source == &blow.source;
  };
  auto ring = std::ranges::find_if(rings_, isOf);
  if (ring == rings_.end()) ring = rings_.insert(rings_.end(), Ring{});
  return *ring;
}

void RingTracks::add(const Blow& blow) {
  Ring& ring = ringOf(blow);
  const ModalModel& model = *blow.source.resonators->model;
  ring.body = blow.event.body;
  ring.source = &blow.source;
  ring.centre = model.centreOfMass - blow.sound.modalOrigin.value_or(model.centreOfMass);
  ring.until = std::max(ring.until, blow.until);
  ring.struck = {blow.event.time, blow.event.bodyPosition, blow.event.bodyOrientation.normalized()};
  ring.removed.reset();
  for (const ModalExcitation& excitation : exciter_.excitations()) {
    if (excitation.path == 0) continue;
    const Way added = wayOf(excitation, blow.middle);
    const auto same = std::ranges::find_if(ring.ways, [&](const Way& way) {
      return way.channel == added.channel && way.path == added.path;
    });
    if (same == ring.ways.end())
      ring.ways.push_back(added);
    else
      same->leaving.setZero();  // sent anew, as ModalBank may have ended the ring in between
  }
}

/// Returns the way of an excitation from the end of its drive on, up to which it goes on at the
/// rate of the blow; `middle` (s) is that of the contact.
RingTracks::Way RingTracks::wayOf(const ModalExcitation& excitation, double middle) const {
  const Click& drive = excitation.drive;
  const std::int64_t over = drive.first + static_cast<std::int64_t>(drive.samples);
  Way way{.channel = drive.channel,
          .path = excitation.path - 1,
          .at = ModalBank::gridFrom(over),
          .rate = excitation.rate};
  const double sinceMiddle = static_cast<double>(way.at - drive.first) - drive.track.at(0.5);
  way.emitted = middle + way.rate * sinceMiddle / paths_->settings.sampleRate;
  return way;
}

ListenerPose RingTracks::poseOf(const Ring& ring, double time) const {
  if (ring.removed) return ring.removed->at(time);
  const auto track = bodies_.find(ring.body);
  return track == bodies_.end() ? ring.struck : track->second.at(time);
}

/// Returns what arrives at `time` (s) of the receiver.
RingTracks::Heard RingTracks::heardAt(const Ring& ring, const Way& way, double time) const {
  const SoundPaths::Channel& channel = paths_->channels[way.channel];
  Heard heard;
  heard.place = listeners_.placeOf(channel, time);
  heard.emitted = way.emitted;
  heard.route.isFollowed = true;
  heard.route.path = way.path + 1;
  heard.route.chain = paths_->paths[way.path].chain;
  heard.route.ear = channel.ear;
  if (channel.isEar) heard.route.head = paths_->listeners[channel.listener].hrtf.get();
  for (int count = 0; count < kMostLooks; ++count) {
    look(ring, way, heard);
    const double emitted = time - heard.delay;
    const bool isFound = std::abs(emitted - heard.emitted) <= kTimeTolerance;
    heard.emitted = emitted;
    if (isFound) break;
  }
  return heard;
}

/// Sets how the ring is heard if it was emitted when `heard` says.
void RingTracks::look(const Ring& ring, const Way& way, Heard& heard) const {
  const SoundPaths::Channel& channel = paths_->channels[way.channel];
  const Image* const image = paths_->paths[way.path].image;
  const ListenerTracks::Place& place = heard.place;
  const ListenerPose body = poseOf(ring, heard.emitted);
  const Vec3 centre = body.position + body.orientation * ring.centre;
  const Vec3 towards = (image != nullptr ? image->position(centre) : centre) - place.position;
  const double distance = towards.norm();
  const Vec3 direction = distance > 0.0 ? Vec3(towards / distance) : Vec3::Zero();
  ModalRoute& route = heard.route;
  route.toReceiver = image != nullptr ? Vec3(image->linear.transpose() * -towards) : Vec3(-towards);
  heard.leaving = body.orientation.conjugate() * route.toReceiver;
  heard.arriving = place.orientation.conjugate() * direction;
  heard.orientation = body.orientation;
  heard.delay = std::max(distance, ring.source->radius) / paths_->settings.medium.speedOfSound;
  if (route.head != nullptr) {
    route.ears = route.head->lookup(heard.arriving);
    heard.delay += route.head->delayBetween(route.ears, channel.ear);
  } else if (channel.receiver.pattern != 0.0) {
    route.gain = gain(channel.receiver, place.orientation, direction);
  }
  const bool isBlocked =
      image != nullptr && !isVisible(paths_->settings.room, *image, centre, place.position);
  if (isBlocked) route.gain = 0.0;
}

void RingTracks::advance(const Target& target) {
  isAdvanced_ = true;
  std::erase_if(rings_, [&](Ring& ring) { return !advance(ring, target); });
}

void RingTracks::advance(BodyId body, const Target& target) {
  std::erase_if(rings_, [&](Ring& ring) { return ring.body == body && !advance(ring, target); });
}

/// Sends all stretches of a ring; false if it is over.
bool RingTracks::advance(Ring& ring, const Target& target) {
  bool goesOn = false;
  for (Way& way : ring.ways) {
    while (sendStretch(ring, way, target)) {
    }
    goesOn = goesOn || way.emitted <= ring.until;
  }
  return goesOn;
}

/// Sends the next stretch of a way, if anything changes in it. Returns false if not all of it is
/// known yet, or the ring is over.
bool RingTracks::sendStretch(const Ring& ring, Way& way, const Target& target) {
  const double sampleRate = paths_->settings.sampleRate;
  if (way.emitted > ring.until) return false;
  for (;; way.grids /= 2) {
    const std::int64_t length = way.grids * ModalBank::kGrid;
    const auto sample = static_cast<double>(way.at + length - target.shift.whole);
    Heard then = heardAt(ring, way, (sample - target.shift.fraction) / sampleRate);
    if (then.emitted > target.time) return false;
    const double seconds = static_cast<double>(length) / sampleRate;
    if (paths_->settings.doppler)
      then.route.rate = std::clamp((then.emitted - way.emitted) / seconds, kLeastRate, kMostRate);
    const double turn = changeOf(then, way);
    const double bend = std::abs(then.route.rate - way.rate) * static_cast<double>(length);
    if (way.grids > 1 && (turn > kMostTurn || bend > kMostBend)) continue;
    const bool isStill = turn <= kStill && std::abs(then.route.rate - 1.0) <= kStill;
    if (isStill) then.route.rate = 1.0;
    if (!isStill || way.rate != 1.0) send(ring, then, way, target.sink);
    way.at += length;
    way.emitted += way.rate * seconds;  // as the bank has it
    if (turn < kCoarser * kMostTurn && bend < kCoarser * kMostBend)
      way.grids = std::min(2 * way.grids, kLongest);
    return true;
  }
}

/// Sends the next stretch of a way, of `way.grids`, at the end of which it is heard as `then`.
void RingTracks::send(const Ring& ring, const Heard& then, Way& way, SoundSink& sink) {
  exciter_.move({.body = ring.body,
                 .orientation = then.orientation,
                 .first = way.at,
                 .length = static_cast<std::uint32_t>(way.grids * ModalBank::kGrid),
                 .channel = way.channel},
                then.route, *ring.source);
  sink.add({.excitations = exciter_.excitations(), .taps = exciter_.taps()});
  way.rate = then.route.rate;
  way.leaving = then.leaving;
  way.arriving = then.arriving;
}

/// Returns by how much (rad, or as a share of the distance) a way is heard differently from when it
/// was last sent.
double RingTracks::changeOf(const Heard& heard, const Way& way) {
  const double distance = std::max(heard.leaving.norm(), way.leaving.norm());
  const double left = distance > 0.0 ? (heard.leaving - way.leaving).norm() / distance : 0.0;
  return std::max(left, (heard.arriving - way.arriving).norm());
}

}  // namespace carom::audio
