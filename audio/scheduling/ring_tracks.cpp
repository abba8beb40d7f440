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
/// A ring that moves by less than this share of its distance, and turns by less (rad), is at rest.
constexpr double kStill = 1e-7;
constexpr int kMostLooks = 30;            ///< in which a time of emission is found
constexpr double kTimeTolerance = 1e-11;  ///< s
/// In a way of several paths, images count as of a body that keeps its velocity and does not turn:
constexpr double kImageTolerance = 1e-8;  ///< s
constexpr double kBefore = 0.01;          ///< s, over which that velocity is
/// Bounds of the rate at which a body's time goes by: beyond, it flies away at the speed of sound.
constexpr double kLeastRate = 0.1;
constexpr double kMostRate = 10.0;
/// Share of RingTracks::kLiveStill by which bodies and listeners may have moved before it is looked
/// at what is heard of that.
constexpr double kUnseen = 0.1;
/// s: time for which the next pose of a body is waited for.
constexpr double kPatience = 0.1;
/// Samples by which the clocks of simulation and samples may drift apart from one `advance` to the
/// next; beyond, one of them has leapt.
constexpr double kMostDrift = 256.0;
/// s by which what is heard of a live ring may be behind; beyond, its body has leapt away, and the
/// way there is not followed.
constexpr double kMostBehind = 60.0;
constexpr double kMostDelay = 1e10;  ///< s: who is farther away hears nothing
/// Poses of a body: as far back as sound of 100 m away has left it.
constexpr PoseTrackSettings kLivePoses{.capacity = 128};

/// Returns by how much (rad, or as a share of the distance) directions differ.
double angleBetween(const Vec3& one, const Vec3& other) {
  const double distance = std::max(one.norm(), other.norm());
  return distance > 0.0 ? (one - other).norm() / distance : 0.0;
}

bool isUnmoved(const ListenerPose& one, const ListenerPose& other) {
  return one.position == other.position && one.orientation.coeffs() == other.orientation.coeffs();
}

}  // namespace

RingTracks::RingTracks(std::shared_ptr<const SoundPaths> paths, const ListenerTracks& listeners,
                       ModalExciter& exciter)
    : paths_(std::move(paths)), listeners_(listeners), exciter_(exciter) {}

void RingTracks::followLive(std::size_t ways) {
  live_ = {.ways = ways};
}

bool RingTracks::move(BodyId body, const ListenerPose& pose) {
  if (live_) return moveLive(body, pose);
  const auto known = bodies_.find(body);
  if (known == bodies_.end()) {
    PoseTrack track;
    if (!track.restart(pose)) return false;
    bodies_.emplace(body, Body{std::move(track), pose});
    return true;
  }
  // A body that is put somewhere else, or thrown faster than a track goes, is there at once.
  PoseTrack& track = known->second.track;
  return track.append(pose) || (pose.time > track.lastTime() && track.restart(pose));
}

bool RingTracks::moveLive(BodyId id, const ListenerPose& pose) {
  live_->havePosesCome = true;
  const auto known = bodies_.find(id);
  if (!isPose(pose)) return false;
  if (known == bodies_.end()) return true;
  Body& body = known->second;
  const ListenerPose before = std::exchange(body.last, pose);
  if (pose.time == before.time) return true;
  const Vec3 velocity = (pose.position - before.position) / (pose.time - before.time);
  const bool hasStood = body.velocity && body.velocity->isZero(0.0) && pose.time > before.time;
  if (hasStood && isUnmoved(pose, before)) return true;  // nothing that the track does not know
  if (hasStood && before.time > body.track.lastTime()) body.track.append(before);
  const bool isJump =
      pose.time < before.time || (velocity - body.velocity.value_or(velocity)).norm() > kJump;
  body.velocity = velocity;
  if (!isJump && body.track.append(pose)) return true;
  jump(id);
  return body.track.restart(pose);
}

/// Has the ways of a body take no notice of how it came to where it is.
void RingTracks::jump(BodyId body) {
  for (Ring& ring : rings_)
    if (ring.body == body)
      for (Way& way : ring.ways)
        way.hasJumped = true;
}

void RingTracks::forget(BodyId body) {
  const auto known = bodies_.find(body);
  if (known == bodies_.end()) return;
  for (Ring& ring : rings_)
    if (ring.body == body) ring.removed = known->second.track;
  bodies_.erase(known);
}

void RingTracks::clear() {
  bodies_.clear();
  rings_.clear();
}

void RingTracks::leap(double seconds) {
  for (auto& [id, body] : bodies_) {
    body.last.time += seconds;
    body.track.restart(body.last);
    body.velocity.reset();
  }
  for (Ring& ring : rings_) {
    ring.until += seconds;
    ring.struck.time += seconds;
    for (Way& way : ring.ways) {
      way.hasJumped = true;
      way.last.front().emitted += seconds;
    }
  }
}

bool RingTracks::follows(const ImpulseEvent& event) const {
  if (!isAdvanced_ || live_) return false;
  const auto body = bodies_.find(event.body);
  return listeners_.anyMoves() || (body != bodies_.end() && body->second.track.moves(event.time));
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
  ring.peak = std::max(blow.peak, loudnessOf(ring, blow.event.time));
  ring.until = std::max(ring.until, blow.until);
  ring.struck = {blow.event.time, blow.event.bodyPosition, blow.event.bodyOrientation.normalized()};
  ring.removed.reset();
  if (live_) return addLive(blow, ring);
  for (const ModalExcitation& excitation : exciter_.excitations()) {
    if (excitation.path == 0) continue;
    Way added = wayOf(excitation, blow.middle);
    const auto same = std::ranges::find_if(ring.ways, [&](const Way& way) {
      return way.channel == added.channel && way.path == added.path;
    });
    if (same == ring.ways.end())
      ring.ways.push_back(std::move(added));
    else
      same->last.front().leaving.setZero();  // sent anew, as ModalBank may have ended it meanwhile
  }
}

/// Returns the way of an excitation from the end of its drive on, up to which it goes on at the
/// rate of the blow; `middle` (s) is that of the contact.
RingTracks::Way RingTracks::wayOf(const ModalExcitation& excitation, double middle) const {
  const Click& drive = excitation.drive;
  const std::int64_t over = drive.first + static_cast<std::int64_t>(drive.samples);
  Way way{.channel = drive.channel,
          .path = excitation.path,
          .at = ModalBank::gridFrom(over),
          .rate = excitation.rate,
          .isMoving = true,
          .last = std::vector<Heard>(1)};
  const double sinceMiddle = static_cast<double>(way.at - drive.first) - drive.track.at(0.5);
  way.last.front().emitted = middle + way.rate * sinceMiddle / paths_->settings.sampleRate;
  return way;
}

void RingTracks::addLive(const Blow& blow, Ring& ring) {
  const auto known =
      bodies_.try_emplace(ring.body, Body{PoseTrack(ring.struck, kLivePoses), ring.struck}).first;
  Body& body = known->second;
  body.velocity.reset();
  if (ring.struck.time > body.last.time) {
    body.last = ring.struck;
    if (!body.track.append(ring.struck)) {
      body.track.restart(ring.struck);
      jump(ring.body);
    }
  }
  for (const ModalExcitation& excitation : exciter_.excitations()) {
    const auto isOf = [&](const Way& way) { return way.channel == excitation.drive.channel; };
    if (excitation.drive.channel < paths_->channels.size() && std::ranges::none_of(ring.ways, isOf))
      addLiveWay(blow, excitation, ring);
  }
}

/// Adds the way of all paths to a channel, from the end of the first excitation's drive on, as it
/// is heard from the begin of the contact on.
void RingTracks::addLiveWay(const Blow& blow, const ModalExcitation& excitation, Ring& ring) {
  Way way = wayOf(excitation, blow.middle);
  way.isMoving = false;
  way.jumps = listeners_.jumps(paths_->channels[way.channel].listener);
  way.last.assign(paths_->paths.size(), {.emitted = blow.event.time});
  SampleShift shift = blow.shift;
  shift.stretch = 1.0;
  const Click& drive = excitation.drive;
  const double begin = static_cast<double>(drive.first - shift.whole) + drive.track.at(0.0);
  const double seconds = (begin - shift.fraction) / paths_->settings.sampleRate;
  hear(ring, way, seconds);
  way.last = then_;
  way.seen = {poseOf(ring, seconds), listeners_.placeOf(paths_->channels[way.channel], seconds)};
  const double at = static_cast<double>(way.at - shift.whole) - shift.fraction;
  way.last.front().emitted = at / paths_->settings.sampleRate - way.last.front().delay;
  ring.ways.push_back(std::move(way));
}

ListenerPose RingTracks::poseOf(const Ring& ring, double time) const {
  if (ring.removed) return ring.removed->at(time);
  const auto body = bodies_.find(ring.body);
  return body == bodies_.end() ? ring.struck : body->second.track.at(time);
}

/// Returns the time (s) of the receiver at a sample, on the clock of the simulation.
double RingTracks::timeOf(double sample, const Target& target) const {
  const double sampleRate = paths_->settings.sampleRate;
  const double unshifted = sample - static_cast<double>(target.shift.whole) - target.shift.fraction;
  if (target.shift.stretch == 1.0) return unshifted / sampleRate;
  return target.time + (unshifted / sampleRate - target.time) / target.shift.stretch;
}

/// The inverse of timeOf.
double RingTracks::sampleOf(double time, const Target& target) const {
  const double stretched = target.time + (time - target.time) * target.shift.stretch;
  return stretched * paths_->settings.sampleRate + static_cast<double>(target.shift.whole) +
         target.shift.fraction;
}

/// Finds what arrives at `time` (s) of the receiver over each path of a way, as then_.
void RingTracks::hear(const Ring& ring, const Way& way, double time) {
  const SoundPaths::Channel& channel = paths_->channels[way.channel];
  const ListenerTracks::Place place = listeners_.placeOf(channel, time);
  then_.resize(way.last.size());
  ListenerPose body;  // when what comes directly left it
  Vec3 velocity = Vec3::Zero();
  for (std::uint32_t index = 0; index < then_.size(); ++index) {
    Heard& heard = then_[index];
    heard = {.emitted = way.last.front().emitted};
    ModalRoute& route = heard.view.route;
    route.path = way.path != 0 ? way.path : index + 1;
    route.isFollowed = true;
    route.chain = paths_->paths[route.path - 1].chain;
    route.ear = channel.ear;
    if (channel.isEar) route.head = paths_->listeners[channel.listener].hrtf.get();
    for (int count = 0; count < kMostLooks; ++count) {
      if (index == 0) {
        body = poseOf(ring, heard.emitted);
      } else {
        body.position += (heard.emitted - body.time) * velocity;
        body.time = heard.emitted;
      }
      look(ring, body, {place, channel.receiver}, heard);
      const double emitted = time - heard.delay;
      const double tolerance = index == 0 ? kTimeTolerance : kImageTolerance;
      const bool isFound = std::abs(emitted - heard.emitted) <= tolerance;
      heard.emitted = emitted;
      if (isFound) break;
    }
    block(ring, body, place, heard);
    if (index == 0 && then_.size() > 1)
      velocity = (body.position - poseOf(ring, body.time - kBefore).position) / kBefore;
  }
}

/// Sets how the ring is heard if it was emitted with the body at that pose.
void RingTracks::look(const Ring& ring, const ListenerPose& body, const Hearing& at,
                      Heard& heard) const {
  ModalRoute& route = heard.view.route;
  const Image* const image = paths_->paths[route.path - 1].image;
  const ListenerTracks::Place& place = at.place;
  const Vec3 centre = body.position + body.orientation * ring.centre;
  const Vec3 towards = (image != nullptr ? image->position(centre) : centre) - place.position;
  const double distance = towards.norm();
  const Vec3 direction = distance > 0.0 ? Vec3(towards / distance) : Vec3::Zero();
  route.toReceiver = image != nullptr ? Vec3(image->linear.transpose() * -towards) : Vec3(-towards);
  heard.leaving = body.orientation.conjugate() * route.toReceiver;
  heard.arriving = place.orientation.conjugate() * direction;
  heard.view.orientation = body.orientation;
  heard.delay = std::max(distance, ring.source->radius) / paths_->settings.medium.speedOfSound;
  if (route.head != nullptr) {
    route.ears = route.head->lookup(heard.arriving);
    heard.delay += route.head->delayBetween(route.ears, route.ear);
  } else if (at.receiver.pattern != 0.0) {
    route.gain = gain(at.receiver, place.orientation, direction);
  }
}

/// Silences what a wall blocks.
void RingTracks::block(const Ring& ring, const ListenerPose& body,
                       const ListenerTracks::Place& place, Heard& heard) const {
  ModalRoute& route = heard.view.route;
  const Image* const image = paths_->paths[route.path - 1].image;
  if (image == nullptr) return;
  const Vec3 centre = body.position + body.orientation * ring.centre;
  if (!isVisible(paths_->settings.room, *image, centre, place.position)) route.gain = 0.0;
}

void RingTracks::advance(const Target& target) {
  isAdvanced_ = true;
  if (live_) return advanceLive(target);
  std::erase_if(rings_, [&](Ring& ring) { return !advance(ring, target); });
}

void RingTracks::advance(BodyId body, const Target& target) {
  if (live_) return;
  std::erase_if(rings_, [&](Ring& ring) { return ring.body == body && !advance(ring, target); });
}

/// Sends all stretches of a ring; false if it is over.
bool RingTracks::advance(Ring& ring, const Target& target) {
  for (Way& way : ring.ways) {
    while (sendStretch(ring, way, target)) {
    }
  }
  return !isOver(ring);
}

bool RingTracks::isOver(const Ring& ring) const {
  return std::ranges::all_of(ring.ways,
                             [&](const Way& way) { return way.last.front().emitted > ring.until; });
}

void RingTracks::advanceLive(const Target& target) {
  moving_.clear();
  receivers_.clear();
  for (const SoundPaths::Channel& channel : paths_->channels)
    receivers_.push_back(listeners_.placeOf(channel, target.time));
  for (Ring& ring : rings_) {
    for (Way& way : ring.ways)
      anchor(way, target);
    if (isAtRest(ring, target)) {
      for (Way& way : ring.ways)
        stand(way, target);
    } else {
      moving_.push_back(&ring);
    }
  }
  std::size_t ways = 0;
  for (const Ring* const ring : moving_)
    ways += ring->ways.size();
  if (ways > live_->ways) sortByLoudness(target.time);
  ways = 0;
  for (Ring* const ring : moving_) {
    ways += ring->ways.size();
    if (ways > live_->ways)
      leaveOut(*ring, target);
    else
      advance(*ring, {knownUntil(*ring, target.time), target.shift, target.sink});
  }
  if (std::erase_if(rings_, [&](const Ring& ring) { return isOver(ring); }) == 0) return;
  std::erase_if(bodies_, [&](const auto& entry) {
    return std::ranges::find(rings_, entry.first, &Ring::body) == rings_.end();
  });
}

/// Puts the loudest rings first into moving_.
void RingTracks::sortByLoudness(double time) {
  for (Ring* const ring : moving_)
    ring->loudness = loudnessOf(*ring, time);
  std::ranges::sort(moving_, [](const Ring* one, const Ring* other) {
    return one->loudness != other->loudness ? one->loudness > other->loudness
                                            : one->body < other->body;
  });
}

/// Returns the time (s) up to which it is known where the body of a ring is.
double RingTracks::knownUntil(const Ring& ring, double time) const {
  const auto body = bodies_.find(ring.body);
  if (!live_->havePosesCome || ring.removed || body == bodies_.end()) return time;
  return std::min(time, std::max(body->second.last.time, time - kPatience));
}

/// Returns an estimate (Pa) of how loud a ring is, which falls evenly in dB.
double RingTracks::loudnessOf(const Ring& ring, double time) const {
  const double silence = ModalBank::silence(paths_->settings);
  if (!(ring.peak > silence) || !(time < ring.until)) return 0.0;
  const double left = (ring.until - time) / (ring.until - ring.struck.time);
  return silence * std::pow(ring.peak / silence, std::min(left, 1.0));
}

/// True if neither the body nor a listener has moved by as much as could be heard.
bool RingTracks::isAtRest(const Ring& ring, const Target& target) const {
  const auto known = bodies_.find(ring.body);
  const bool isThere = !ring.removed && known != bodies_.end();
  const ListenerPose body = isThere ? known->second.last : poseOf(ring, target.time);
  return std::ranges::all_of(ring.ways, [&](const Way& way) {
    if (way.rate != 1.0 || way.hasJumped) return false;
    const Places now{body, receivers_[way.channel]};
    if (now == way.seen) return true;
    const double least = kUnseen * kLiveStill;
    const double moved = (now.body.position - way.seen.body.position).norm() +
                         (now.receiver.position - way.seen.receiver.position).norm();
    return moved <= least * way.last.front().leaving.norm() &&
           now.body.orientation.angularDistance(way.seen.body.orientation) <= least &&
           now.receiver.orientation.angularDistance(way.seen.receiver.orientation) <= least;
  });
}

/// Finds whether a clock has leapt, and a way with it.
void RingTracks::anchor(Way& way, const Target& target) const {
  const std::uint64_t jumps = listeners_.jumps(paths_->channels[way.channel].listener);
  way.hasJumped = way.hasJumped || std::exchange(way.jumps, jumps) != jumps;
  const Heard& lead = way.last.front();
  const double sample = sampleOf(lead.emitted + lead.delay, target);
  if (std::abs(sample - static_cast<double>(way.at)) <= kMostDrift) return;
  way.hasJumped = true;
  way.at = std::max(way.at, ModalBank::gridFrom(std::llround(sample)));
  way.last.front().emitted = timeOf(static_cast<double>(way.at), target) - lead.delay;
}

/// Brings a way at rest to the present.
void RingTracks::stand(Way& way, const Target& target) const {
  const double sample = sampleOf(target.time + way.last.front().delay, target);
  const std::int64_t at = ModalBank::gridFrom(static_cast<std::int64_t>(sample)) - ModalBank::kGrid;
  way.at = std::max(way.at, at);
  Heard& lead = way.last.front();
  lead.emitted = timeOf(static_cast<double>(way.at), target) - lead.delay;
}

/// Leaves a ring as it is heard, without Doppler effect.
void RingTracks::leaveOut(Ring& ring, const Target& target) {
  for (Way& way : ring.ways) {
    way.hasJumped = true;
    if (way.rate != 1.0) sendStretch(ring, way, target);
    way.hasJumped = true;
    stand(way, target);
  }
}

/// Sends the next stretch of a way, if anything changes in it. Returns false if not all of it is
/// known yet, or the ring is over.
bool RingTracks::sendStretch(const Ring& ring, Way& way, const Target& target) {
  if (way.last.front().emitted > ring.until) return false;
  if (way.hasJumped) way.grids = kLongest;
  const double still = live_ ? kLiveStill : kStill;
  const SoundPaths::Channel& channel = paths_->channels[way.channel];
  for (;; way.grids /= 2) {
    const std::int64_t length = way.grids * ModalBank::kGrid;
    const double seconds =
        static_cast<double>(length) / (paths_->settings.sampleRate * target.shift.stretch);
    // Quickly, as most steps end in the midst of a stretch.
    if (live_ && way.last.front().emitted + way.rate * seconds > target.time) return false;
    const double time = timeOf(static_cast<double>(way.at + length), target);
    hear(ring, way, time);
    const Heard& next = then_.front();
    if (next.emitted > target.time || !(next.delay <= kMostDelay)) return false;
    if (live_ && next.emitted < target.time - kMostBehind) {
      // As quiet as it is there, at once: its body may be back before its sound has come.
      send(ring, way, 1.0, target.sink);
      way.seen = {poseOf(ring, target.time), listeners_.placeOf(channel, target.time)};
      way.last = then_;
      way.last.front().delay = 0.0;
      way.hasJumped = true;
      stand(way, target);
      return false;
    }
    double rate = paths_->settings.doppler && !way.hasJumped ? rateOf(way, seconds) : 1.0;
    const double turn = changeOf(way);
    const double bend = std::abs(rate - way.rate) * static_cast<double>(length);
    if (way.grids > 1 && !way.hasJumped && (turn > kMostTurn || bend > kMostBend)) continue;
    const bool isSlow = std::abs(rate - 1.0) <= (live_ ? kLiveSlow : kStill);
    const bool isStill = turn <= still && isSlow;
    if (isStill || (live_ && isSlow)) rate = 1.0;
    const bool isSent = !isStill || way.rate != 1.0;
    if (isSent) send(ring, way, rate, target.sink);
    if (live_ && isSent)
      way.seen = {poseOf(ring, then_.front().emitted), listeners_.placeOf(channel, time)};
    // A ring that is not live goes on as the bank has it.
    const double emitted = way.last.front().emitted + way.rate * seconds;
    if (isSent) way.last = then_;
    for (std::size_t path = 0; path < then_.size(); ++path)
      way.last[path].delay = then_[path].delay;
    way.last.front().emitted = live_ ? then_.front().emitted : emitted;
    way.at += length;
    way.hasJumped = false;
    if (turn < kCoarser * kMostTurn && bend < kCoarser * kMostBend)
      way.grids = std::min(2 * way.grids, kLongest);
    return true;
  }
}

/// Returns at which rate the body's time goes by from the last stretch to then_: with several
/// paths, the mean by their powers.
double RingTracks::rateOf(const Way& way, double seconds) const {
  const auto rateOfPath = [&](std::size_t path) {
    const Heard& lead = way.last.front();
    // Sound that is heard at one sample has left the body the earlier, the longer its path.
    const double before = lead.emitted + (lead.delay - way.last[path].delay);
    const double rate = (then_[path].emitted - before) / seconds;
    return std::clamp(rate, kLeastRate, kMostRate);
  };
  if (then_.size() == 1)
    return std::clamp((then_[0].emitted - way.last[0].emitted) / seconds, kLeastRate, kMostRate);
  double sum = 0.0;
  double powers = 0.0;
  for (std::size_t path = 0; path < then_.size(); ++path) {
    const double gain = then_[path].view.route.gain;
    const double power = gain * gain / then_[path].leaving.squaredNorm();
    if (!(power > 0.0) || !std::isfinite(power)) continue;
    sum += power * rateOfPath(path);
    powers += power;
  }
  return powers > 0.0 ? sum / powers : 1.0;
}

/// Sends the next stretch of a way, of `way.grids`, at the end of which it is heard as then_.
void RingTracks::send(const Ring& ring, Way& way, double rate, SoundSink& sink) {
  if (!std::exchange(way.isMoving, true)) begin(ring, way, sink);
  views_.clear();
  for (const Heard& heard : then_)
    views_.push_back(heard.view);
  exciter_.move({.body = ring.body,
                 .first = way.at,
                 .length = static_cast<std::uint32_t>(way.grids * ModalBank::kGrid),
                 .channel = way.channel,
                 .path = way.path,
                 .rate = rate},
                views_, *ring.source);
  sink.add({.excitations = exciter_.excitations(), .taps = exciter_.taps()});
  way.rate = rate;
}

/// Has the bank of a way know how it has been heard so far.
void RingTracks::begin(const Ring& ring, const Way& way, SoundSink& sink) {
  views_.clear();
  for (const Heard& heard : way.last)
    views_.push_back(heard.view);
  exciter_.move({.body = ring.body,
                 .first = way.at - ModalBank::kGrid,
                 .length = static_cast<std::uint32_t>(ModalBank::kGrid),
                 .channel = way.channel,
                 .path = way.path},
                views_, *ring.source);
  sink.add({.excitations = exciter_.excitations(), .taps = exciter_.taps()});
}

/// Returns by how much (rad, or as a share of the distance) then_ is heard differently from when
/// the way was last sent.
double RingTracks::changeOf(const Way& way) const {
  double change = 0.0;
  for (std::size_t path = 0; path < then_.size(); ++path) {
    change = std::max({change, angleBetween(then_[path].leaving, way.last[path].leaving),
                       (then_[path].arriving - way.last[path].arriving).norm()});
  }
  return change;
}

void RingTracks::addRinging(std::vector<BodyId>& bodies) const {
  for (const Ring& ring : rings_)
    if (!ring.removed) bodies.push_back(ring.body);
}

}  // namespace carom::audio
