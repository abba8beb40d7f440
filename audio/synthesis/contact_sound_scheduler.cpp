#include "audio/synthesis/contact_sound_scheduler.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include "audio/dsp/spread_kernel.h"
#include "audio/model/hertz.h"
#include "audio/model/positive.h"

namespace carom::audio {
namespace {

/// Samples: shorter contacts alias if they are sampled naively; docs/acceleration_noise.md has the
/// error.
constexpr double kWellSampled = 4.0;
/// Samples: half the width of the kernel that puts instants on samples.
constexpr auto kReach = static_cast<std::int64_t>(kSpreadWidth / 2);
/// s: a longer contact has nothing in the audible band, and would take memory without end.
constexpr double kLongestContact = 20.0;
/// Number of restitutions that have a dissipative pulse of their own; further ones are rounded to
/// steps of 1 / kFewRestitutions.
constexpr std::size_t kMostRestitutions = 256;
constexpr double kFewRestitutions = 64.0;
/// Bounds of the factor by which motion may stretch a click in time; beyond them the click is that
/// of bodies at rest.
constexpr double kLeastStretch = 0.1;
constexpr double kMostStretch = 10.0;
/// Upper bound of a head-related response over the free field, at any frequency.
constexpr double kLoudestEar = 4.0;
/// Peaks of a diffuse field over the root of its mean square.
constexpr double kTailPeaks = 4.0;
/// Upper bound of friction over load, for mechanics that reports more.
constexpr double kMostFriction = 2.0;
/// s: a longer step does not tell how its contact moved.
constexpr double kLongestStep = 1.0;
/// Factor in ContactSoundScheduler::slideRank for a contact that slides already: it is not given up
/// for one that is hardly louder.
constexpr double kSlidesOn = 2.0;
/// m: least distance to a listener in ContactSoundScheduler::slideRank.
constexpr double kNearest = 0.1;
/// s: time in which a slide fades in.
constexpr double kFadingIn = 1e-3;
/// Time constant (s) and largest offset (m) of the contact point in ContactSoundScheduler::follow.
constexpr double kTurning = 0.03;
constexpr double kFarthestOffset = 1.0;
/// Energy that rolling loses, over load times path, where the mechanics knows of no loss.
constexpr double kRollingLoss = 0.01;
/// All rough surfaces share one noise pattern, sampled at different places.
constexpr std::uint64_t kRoughSeed = 1;

/// Number of consecutive nodes of a train that are taken to come at once.
constexpr std::size_t kAtOnce = 4;

/// Returns about the largest impulse (N s) of a train that comes at once, as there is one node to a
/// sample or less.
double loudestOf(std::span<const PulseNode> train) {
  double loudest = 0.0;
  double sum = 0.0;
  for (std::size_t index = 0; index < train.size(); ++index) {
    sum += std::abs(train[index].weight);
    if (index >= kAtOnce) sum -= std::abs(train[index - kAtOnce].weight);
    loudest = std::max(loudest, sum);
  }
  return loudest;
}

bool isFinite(const ImpulseEvent& event) {
  return std::isfinite(event.time) && event.impulse.allFinite() && event.position.allFinite() &&
         event.normal.allFinite() && event.bodyPosition.allFinite() &&
         event.bodyOrientation.coeffs().allFinite() && event.bodyVelocity.allFinite() &&
         event.bodyAngularVelocity.allFinite();
}

bool isContact(const ImpulseEvent& event) {
  return event.radius >= 0.0 && event.otherRadius >= 0.0 && isPositive(event.approachSpeed) &&
         isPositive(event.effectiveMass);
}

// Returns the event with the bodies' edge radii where a radius is 0, and for two flat faces: edges
// are blunt, and flat faces touch first where they are not flat.
ImpulseEvent blunted(ImpulseEvent event, const SoundBody& body, const SoundBody& other) {
  const bool flat = std::isinf(event.radius) && std::isinf(event.otherRadius);
  if (event.radius == 0.0 || flat) event.radius = body.edgeRadius;
  if (event.otherRadius == 0.0 || flat) event.otherRadius = other.edgeRadius;
  return event;
}

/// Rounding error a b - product of a product (Dekker 1971): exact below 1e290.
double roundingOf(double a, double b, double product) {
  constexpr double kSplit = 0x1.0p+27 + 1.0;
  const double a1 = kSplit * a - (kSplit * a - a);
  const double b1 = kSplit * b - (kSplit * b - b);
  const double a2 = a - a1;
  const double b2 = b - b1;
  return ((a1 * b1 - product) + a1 * b2 + a2 * b1) + a2 * b2;
}

/// A time in samples, without loss: the product's rounding error is recovered and kept.
struct SampleTime {
  std::int64_t whole = 0;
  double fraction = 0.0;
};

SampleTime samplesOf(double seconds, double further, double sampleRate) {
  const double product = seconds * sampleRate;
  const double rounding = roundingOf(seconds, sampleRate, product);
  const double floor = std::floor(product);
  const double rest = (product - floor) + rounding + further * sampleRate;
  const double carry = std::floor(rest);
  return {static_cast<std::int64_t>(floor) + static_cast<std::int64_t>(carry), rest - carry};
}

SampleTime shifted(SampleTime time, const SampleShift& shift) {
  time.whole += shift.whole;
  time.fraction += shift.fraction;
  if (time.fraction >= 1.0) {
    time.fraction -= 1.0;
    ++time.whole;
  }
  return time;
}

/// Delay (s) of an ear's response against that of the middle of the head.
double earDelay(const HrtfSet& set, const SphereWeights& where, Ear ear) {
  double delay = -set.latency();
  for (std::size_t i = 0; i < where.index.size(); ++i)
    delay += where.weight[i] * set.delay(where.index[i], ear);
  return delay;
}

/// A quantity at the begin, the middle and the end of a contact, as a parabola in u.
struct Parabola {
  double at0 = 0.0;
  double slope = 0.0;
  double curve = 0.0;

  Parabola(double begin, double middle, double end)
      : at0(begin),
        slope(4.0 * middle - 3.0 * begin - end),
        curve(2.0 * (begin - 2.0 * middle + end)) {}
};

}  // namespace

ContactSoundScheduler::ContactSoundScheduler(std::shared_ptr<const SoundPaths> paths)
    : paths_(std::move(paths)),
      settings_(paths_->settings),
      hasMoved_(paths_->listeners.size(), false),
      filters_(settings_.sampling == Sampling::bandLimited ? RadiationFilter::Input::spread
                                                           : RadiationFilter::Input::bare),
      rings_(paths_) {
  for (const Listener& listener : paths_->listeners)
    tracks_.emplace_back(ListenerPose{0.0, listener.position, listener.orientation});
}

void ContactSoundScheduler::restartListeners() {
  for (std::size_t index = 0; index < tracks_.size(); ++index) {
    const Listener& listener = paths_->listeners[index];
    tracks_[index].restart({0.0, listener.position, listener.orientation});
  }
  hasMoved_.assign(tracks_.size(), false);
}

Status ContactSoundScheduler::setBody(BodyId id, const SoundBody& body) {
  const auto refuse = [id](const std::string& why) {
    return Error{"sound body " + std::to_string(id) + ": " + why};
  };
  if (const Status valid = validate(body); !valid) return refuse(valid.error().message);
  if (body.modal != nullptr && !rings_.knows(*body.modal))
    if (const Status valid = validate(*body.modal); !valid)
      return refuse("modal model: " + valid.error().message);
  Body known{body, nullptr};
  if (std::isfinite(body.mass))
    known.filters = &filtersOf(body.shape ? body.shape->radius() : body.radius);
  if (body.modal != nullptr) known.rings = &rings_.sourceOf(body.modal);
  anyRings_ = anyRings_ || known.rings != nullptr;
  anyTextures_ = anyTextures_ || body.texture != nullptr || body.material.roughness.rmsHeight > 0.0;
  bodies_.insert_or_assign(id, std::move(known));
  return std::monostate{};
}

/// Returns the radiation filters for a radius (m); the compact model has one for all radii.
const RadiationBank::Mix& ContactSoundScheduler::filtersOf(double radius) {
  if (settings_.radiation == Radiation::compact)
    return filters_.mixOf(std::numeric_limits<double>::infinity());
  return filters_.mixOf(settings_.medium.speedOfSound /
                        (std::min(radius, kLargestFilteredRadius) * settings_.sampleRate));
}

Status ContactSoundScheduler::moveListener(std::size_t listener, const ListenerPose& pose) {
  if (listener >= tracks_.size()) return noListener(listener);
  PoseTrack& track = tracks_[listener];
  const bool accepted = hasMoved_[listener] ? track.append(pose) : track.restart(pose);
  if (!accepted)
    return Error{
        "synth: pose of listener " + std::to_string(listener) + " at " + std::to_string(pose.time) +
        " s: expected finite values, a unit quaternion, a later time than the last pose's, "
        "and at most 180 m/s from there"};
  hasMoved_[listener] = true;
  return std::monostate{};
}

Status ContactSoundScheduler::placeListener(std::size_t listener, const ListenerPose& pose) {
  if (listener >= tracks_.size()) return noListener(listener);
  if (!tracks_[listener].restart(pose))
    return Error{"synth: pose of listener " + std::to_string(listener) +
                 ": expected finite values and a unit quaternion"};
  hasMoved_[listener] = true;
  return std::monostate{};
}

Error ContactSoundScheduler::noListener(std::size_t listener) const {
  return Error{"synth: there is no listener " + std::to_string(listener) + "; there are " +
               std::to_string(tracks_.size())};
}

const ContactSoundScheduler::Body* ContactSoundScheduler::findBody(BodyId id) const {
  const auto entry = bodies_.find(id);
  return entry == bodies_.end() ? nullptr : &entry->second;
}

ContactSoundScheduler::Body* ContactSoundScheduler::findBody(BodyId id) {
  const auto entry = bodies_.find(id);
  return entry == bodies_.end() ? nullptr : &entry->second;
}

double ContactSoundScheduler::restitutionOf(const ImpulseEvent& event) const {
  const double bounce = event.impulse.norm() / (event.effectiveMass * event.approachSpeed) - 1.0;
  return std::clamp(bounce, kLowestRestitution, 1.0);
}

const Pulse& ContactSoundScheduler::pulseOf(const ImpulseEvent& event) const {
  return settings_.dissipative ? lossyOf(event).pulse : Pulse::of(settings_.pulse);
}

/// Returns the dissipative pulse of the event's restitution, made once for each; beyond
/// kMostRestitutions, the one of the nearest of a few.
const ContactSoundScheduler::Lossy& ContactSoundScheduler::lossyOf(
    const ImpulseEvent& event) const {
  double restitution = restitutionOf(event);
  if (lossy_.size() >= kMostRestitutions && !lossy_.contains(restitution))
    restitution = std::round(restitution * kFewRestitutions) / kFewRestitutions;
  if (const auto known = lossy_.find(restitution); known != lossy_.end()) return known->second;
  Lossy made{Pulse::dissipativeHertz(restitution), dissipativeDuration(restitution)};
  return lossy_.emplace(restitution, std::move(made)).first->second;
}

double ContactSoundScheduler::contactDuration(const ImpulseEvent& event) const {
  const Body* body = findBody(event.body);
  const Body* other = findBody(event.other);
  if (body == nullptr || other == nullptr || !isContact(event)) return 0.0;
  const double elastic = hertzDuration(blunted(event, body->sound, other->sound),
                                       body->sound.material, other->sound.material);
  return settings_.dissipative ? elastic * lossyOf(event).stretch : elastic;
}

double ContactSoundScheduler::leadTime(double contactDuration) const {
  const double pulse = -Pulse::of(settings_.pulse).begin() * contactDuration;
  // The 2 stands for the whole samples that the pulse falls between.
  const auto filter = static_cast<double>(kReach - RadiationFilter::kFirstTap + 2);
  return pulse + filter / settings_.sampleRate + paths_->earliestEar;
}

ScheduledSound ContactSoundScheduler::lay(const ImpulseEvent& event, const SampleShift& shift) {
  if (settings_.impulse != ImpulseChoice::applied || !event.hasAppliedImpulse)
    return layImpulse(event, shift);
  ImpulseEvent applied = event;
  applied.impulse = event.appliedImpulse;
  return layImpulse(applied, shift);
}

ScheduledSound ContactSoundScheduler::layImpulse(const ImpulseEvent& event,
                                                 const SampleShift& shift) {
  const double duration = isFinite(event) ? contactDuration(event) : 0.0;
  if (!isPositive(duration)) {
    ++counters_.rejected;
    return {};
  }
  const Body& body = *findBody(event.body);
  if (body.filters == nullptr && body.rings == nullptr) {
    ++counters_.immovable;
    return {};
  }
  Contact contact = contactOf(event, body, duration, shift);
  contact.pulse = &pulseOf(event);
  if (!layContact(contact)) {
    ++counters_.rejected;
    return {};
  }
  ++counters_.events;
  if (settings_.sampling == Sampling::naive && duration * settings_.sampleRate < kWellSampled)
    ++counters_.undersampled;
  const ScheduledSound sound = soundOf();
  if (!sound.rings.empty()) ++counters_.rings;
  if (sound.clicks.empty() && sound.rings.empty()) ++counters_.inaudible;
  return sound;
}

/// Returns the clicks and the rings laid last, each only if they can be heard.
ScheduledSound ContactSoundScheduler::soundOf() const {
  ScheduledSound sound;
  if (peak_ > 0.0 && peak_ >= settings_.audibleThreshold) {
    sound.peak = peak_;
    sound.clicks = laid_;
    sound.ears = laidEars_;
  }
  if (ringPeak_ > 0.0 && ringPeak_ >= settings_.audibleThreshold) {
    sound.rings = rings_.rings();
    sound.taps = rings_.taps();
  }
  return sound;
}

ContactSoundScheduler::Contact ContactSoundScheduler::contactOf(const ImpulseEvent& event,
                                                                const Body& body, double duration,
                                                                const SampleShift& shift) {
  Contact contact{.time = event.time,
                  .duration = duration,
                  .strike = makeStrike(event, body.sound, settings_.medium),
                  .filters = body.filters,
                  .shift = shift};
  contact.dipoleBefore = contact.strike.dipole;
  if (settings_.radiation == Radiation::exact)
    contact.ahead = std::min(contact.strike.radius, kLargestFilteredRadius);
  if (body.rings == nullptr || !rings_.strike(event, body.sound, *body.rings)) return contact;
  contact.rings = true;
  if (body.filters == nullptr) {
    contact.strike.position = rings_.position();
    contact.strike.radius = rings_.radius();  // receivers count as outside of the body
    contact.ahead = 0.0;
  }
  return contact;
}

/// Lays the clicks and rings of a contact for all channels and paths; false if its numbers are so
/// large that a click cannot be placed on the clock.
bool ContactSoundScheduler::layContact(const Contact& contact) {
  laid_.clear();
  laidEars_.clear();
  peak_ = ringPeak_ = 0.0;
  for (std::uint32_t channel = 0; channel < paths_->channels.size(); ++channel) {
    for (const SoundPaths::Path& path : paths_->paths) {
      Way way;
      if (!findWay(contact, paths_->channels[channel], path.image, way)) continue;
      if (!isPlaceable(contact, way)) return false;
      const Place place{path.chain, channel, path.image};
      if (contact.filters != nullptr) {
        const double ear = paths_->channels[channel].isEar ? kLoudestEar : 1.0;
        peak_ = std::max(peak_, ear * boundOf(contact, way));
        layClick(contact, way, place);
      }
      if (contact.rings) layRing(contact, way, place);
    }
  }
  if (settings_.reverb && !laySend(contact)) return false;
  if (!contact.rings) return true;
  ringPeak_ = contact.train.empty() ? rings_.peak(*contact.pulse, contact.duration)
                                    : rings_.peak(contact.train);
  return true;
}

/// Lays what is sent into the reverberation: the mean over all directions, at 1 m, without the near
/// field, which carries no power. False as for layContact.
bool ContactSoundScheduler::laySend(const Contact& contact) {
  Way send;
  for (std::size_t part = 0; part < send.gains.size(); ++part)
    send.gains[part] = dipoleAt(contact, part).norm() / std::numbers::sqrt3;
  send.distance = std::numeric_limits<double>::infinity();
  if (!isPlaceable(contact, send)) return false;
  const Place place{.channel = static_cast<std::uint32_t>(paths_->channels.size())};
  if (contact.filters != nullptr) {
    peak_ = std::max(peak_, boundOf(contact, send) * tailOver(contact));
    layClick(contact, send, place);
  }
  if (contact.rings) rings_.laySend(ringDrive(contact, send, place));
  return true;
}

/// Dipole at the begin, middle or end of the contact, for `part` 0, 1 or 2.
Vec3 ContactSoundScheduler::dipoleAt(const Contact& contact, std::size_t part) {
  const double share = 0.5 * static_cast<double>(part);
  return contact.dipoleBefore + share * (contact.strike.dipole - contact.dipoleBefore);
}

/// Finds delays and gains of a contact's sound over one path; false if a wall blocks the path.
bool ContactSoundScheduler::findWay(const Contact& contact, const SoundPaths::Channel& channel,
                                    const Image* image, Way& way) const {
  const Strike& strike = contact.strike;
  const Vec3 velocity = image != nullptr ? image->vector(strike.velocity) : strike.velocity;
  const Vec3 from = image != nullptr ? image->position(strike.position) : strike.position;
  for (const std::size_t part : {0u, 1u, 2u}) {
    if (part > 0 && !settings_.doppler) {
      way.delays[part] = way.delays[0];
      // The dipole of a lasting contact may be another one at its end.
      const Vec3 turned = dipoleAt(contact, part);
      way.gains[part] =
          -(image != nullptr ? image->vector(turned) : turned).dot(way.towardsSource) *
          way.receiverGain / std::max(way.distance, strike.radius);
      continue;
    }
    const Vec3 pushed = dipoleAt(contact, part);
    const Vec3 dipole = image != nullptr ? image->vector(pushed) : pushed;
    const double later = 0.5 * static_cast<double>(part) * contact.duration / contact.shift.stretch;
    const Arrival arrival = arrivalAt(channel, contact.time + later, from + later * velocity);
    if (part == 0 && image != nullptr) {
      const Vec3 ear = from - arrival.distance * arrival.towardsSource;
      if (!isVisible(settings_.room, *image, strike.position, ear)) return false;
    }
    const double distance = std::max(arrival.distance, strike.radius);
    if (part < 2) way.distance = distance;
    way.gains[part] = -dipole.dot(arrival.towardsSource) / distance;
    if (part == 0) way.towardsSource = arrival.towardsSource;
    way.delays[part] = (distance - contact.ahead) / settings_.medium.speedOfSound;
    if (channel.isEar) {
      const HrtfSet& set = *paths_->listeners[channel.listener].hrtf;
      const SphereWeights ears =
          set.lookup(arrival.orientation.conjugate() * arrival.towardsSource);
      if (part == 0) way.ears = ears;
      way.delays[part] += earDelay(set, ears, channel.ear);
    } else if (channel.receiver.pattern != 0.0) {
      const double heard = gain(channel.receiver, arrival.orientation, arrival.towardsSource);
      way.gains[part] *= heard;
      if (part == 0) way.receiverGain = heard;
    }
    if (!settings_.doppler) continue;
    // A click is stretched as it is laid, with the integral of its force kept, as is right for a
    // moving body. A moving listener hears the pressure that is there, only faster or slower.
    const bool overtaken = !(arrival.stretch > kLeastStretch && arrival.stretch < kMostStretch);
    const double stretch = overtaken ? 1.0 : arrival.stretch;
    way.gains[part] *= stretch * stretch;
    if (part < 2) way.stretch = stretch;  // in the end, that of the middle
  }
  return true;
}

/// Returns how the wave that leaves `from` at `time` arrives. For a listener at rest nothing has to
/// be solved.
Arrival ContactSoundScheduler::arrivalAt(const SoundPaths::Channel& channel, double time,
                                         const Vec3& from) const {
  if (hasMoved_[channel.listener]) {
    return arrivalOf(tracks_[channel.listener], {.time = time, .position = from},
                     settings_.medium.speedOfSound, channel.receiver.offset);
  }
  Arrival arrival;
  const Vec3 towards = from - channel.place;
  arrival.distance = towards.norm();
  if (arrival.distance > 0.0) arrival.towardsSource = towards / arrival.distance;
  arrival.orientation = paths_->listeners[channel.listener].orientation;
  return arrival;
}

/// Upper bound (Pa) of a click, from the pulse's slope, what the band holds of it, and what a body
/// of that size lets through (its response's total variation is 1.35 c/a).
double ContactSoundScheduler::boundOf(const Contact& contact, const Way& way) const {
  const double rate = settings_.sampleRate;
  const bool naive = settings_.sampling == Sampling::naive;
  const double inBand = std::numbers::pi * (naive ? 1e6 : 0.5);
  double force = std::min(contact.pulse->peakForce() / contact.duration, inBand * rate);
  double slope = std::min(contact.pulse->peakSlope() / (contact.duration * contact.duration),
                          inBand * rate * rate);
  if (!contact.train.empty()) {
    force = contact.loudest * rate;
    slope = contact.loudest * 0.5 * std::numbers::pi * rate * rate;
  }
  if (settings_.radiation == Radiation::exact) {
    const double corner = settings_.medium.speedOfSound / contact.strike.radius;
    slope = std::min(1.1 * slope, 1.35 * corner * force);
    slope += 1.1 * force * settings_.medium.speedOfSound / way.distance;
  }
  const double gain =
      std::max({std::abs(way.gains[0]), std::abs(way.gains[1]), std::abs(way.gains[2])});
  return gain * slope;
}

/// Peak of the reverberation's tail over that of the sound sent into it: the diffuse field's level
/// (Reverb) for a click that is at its peak while it lasts, times the field's peaks over its level.
double ContactSoundScheduler::tailOver(const Contact& contact) const {
  const ReverbSettings& reverb = *settings_.reverb;
  const double lasting =
      (contact.pulse->end() - contact.pulse->begin()) * contact.duration +
      static_cast<double>(kSpreadWidth + RadiationFilter::kTaps) / settings_.sampleRate +
      5.0 * contact.strike.radius / settings_.medium.speedOfSound;
  const double density = 4.0 * std::numbers::pi * reverb.speedOfSound / reverb.volume;  // 1/s
  return reverb.gain * kTailPeaks * std::sqrt(density * lasting);
}

/// True if the clock can represent the contact's times, and its loudness is finite.
bool ContactSoundScheduler::isPlaceable(const Contact& contact, const Way& way) const {
  const double rate = settings_.sampleRate;
  const double extent = std::abs(contact.time) + way.delays[0] + way.delays[2] +
                        (contact.pulse->end() - contact.pulse->begin()) * contact.duration;
  const double loudness = (std::abs(way.gains[0]) + std::abs(way.gains[2])) * rate * rate;
  const bool isFar = !(extent * rate < kExactSamples);
  const bool isLong = !(contact.duration <= kLongestContact);
  return !isFar && !isLong && std::isfinite(loudness);
}

void ContactSoundScheduler::layClick(const Contact& contact, const Way& way, const Place& place) {
  const double rate = settings_.sampleRate;
  if (std::abs(way.gains[0]) + std::abs(way.gains[2]) == 0.0 && way.gains[1] == 0.0) return;
  Click click = placed(contact, way);
  const Parabola gain(way.gains[0], way.gains[1], way.gains[2]);
  click.track.gain = gain.at0 * rate * rate;
  click.track.slope = gain.slope * rate * rate;
  click.track.curve = gain.curve * rate * rate;
  if (paths_->isFiltered()) click.first += RadiationFilter::kFirstTap;
  click.near = settings_.medium.speedOfSound / (way.distance * way.stretch * rate);
  click.channel = place.channel;
  click.filters = contact.filters;
  click.chain = place.chain;
  laid_.push_back(click);
  if (paths_->hasHeads) laidEars_.push_back(way.ears);
}

/// Returns the contact's pulse on the samples with gain 1: a click without filters.
Click ContactSoundScheduler::ringDrive(const Contact& contact, Way way, const Place& place) const {
  for (double& delay : way.delays)
    delay += contact.ahead / settings_.medium.speedOfSound;
  Click drive = placed(contact, way);
  drive.track.gain = 1.0;
  drive.channel = place.channel;
  drive.chain = place.chain;
  return drive;
}

void ContactSoundScheduler::layRing(const Contact& contact, const Way& way, const Place& place) {
  const SoundPaths::Channel& channel = paths_->channels[place.channel];
  RingWay ring{.toReceiver = -way.distance * way.towardsSource,
               .gain = way.receiverGain,
               .ears = way.ears,
               .ear = channel.ear,
               .chain = place.chain};
  if (place.image != nullptr) ring.toReceiver = place.image->linear.transpose() * ring.toReceiver;
  if (channel.isEar) ring.head = paths_->listeners[channel.listener].hrtf.get();
  rings_.lay(ringDrive(contact, way, place), ring);
}

Click ContactSoundScheduler::placed(const Contact& contact, const Way& way) const {
  const double rate = settings_.sampleRate;
  Click click;
  click.pulse = contact.pulse;
  const SampleTime start = shifted(samplesOf(contact.time, way.delays[0], rate), contact.shift);
  const Parabola delay(0.0, way.delays[1] - way.delays[0], way.delays[2] - way.delays[0]);
  click.track = {.start = start.fraction,
                 .length = (contact.duration + delay.slope) * rate,
                 .bend = delay.curve * rate};
  const double still = contact.duration * rate;
  // Motion at nearly the speed of sound or above would fold time.
  if (!(click.track.length > kLeastStretch * still) ||
      !(click.track.length < kMostStretch * still) ||
      !(std::abs(click.track.bend) < 0.1 * click.track.length)) {
    click.track.length = still;
    click.track.bend = 0.0;
  }
  const std::int64_t first =
      static_cast<std::int64_t>(std::floor(click.track.at(contact.pulse->begin()))) - kReach;
  click.track.start -= static_cast<double>(first);
  const double last = click.track.at(contact.pulse->end());
  click.samples =
      static_cast<std::uint32_t>(std::ceil(last)) + static_cast<std::uint32_t>(kReach) + 1;
  click.first = start.whole + first;
  if (!contact.train.empty())
    click.nodes = contact.train;
  else if (settings_.sampling == Sampling::bandLimited)
    chooseRule(click);
  if (click.nodes.empty()) click.pulse->forceTable();  // made now, not while rendering
  return click;
}

void ContactSoundScheduler::removeBody(BodyId id) {
  bodies_.erase(id);
  rings_.forgetTouches(id);
  slidingNow_ = nullptr;
  std::erase_if(sliding_, [id](const auto& entry) {
    return entry.first.first == id || entry.first.second == id;
  });
}

ScheduledSound ContactSoundScheduler::updateContact(const ContactState& contact,
                                                    const SampleShift& shift) {
  if (!anyRings_) return {};  // quickly, as worlds have many contacts
  dampings_.clear();
  dampingTaps_.clear();
  const bool isFinite = std::isfinite(contact.time) && contact.pathStart.allFinite() &&
                        contact.otherPathStart.allFinite() && contact.normalLoad >= 0.0;
  const double rate = settings_.sampleRate;
  if (!isFinite || settings_.contactLoss == 0.0 || !(std::abs(contact.time) * rate < kExactSamples))
    return {};
  const std::int64_t sample = shifted(samplesOf(contact.time, 0.0, rate), shift).whole;
  for (const bool first : {true, false}) {
    if (!touchOne(contact, first, sample)) continue;
    ModalExcitation damping = rings_.rings().front();
    damping.taps = dampingTaps_.size();
    dampings_.push_back(damping);
    dampingTaps_.insert(dampingTaps_.end(), rings_.taps().begin(), rings_.taps().end());
  }
  ScheduledSound changes;
  changes.rings = dampings_;
  changes.taps = dampingTaps_;
  return changes;
}

/// Lays the change of damping of the contact's first body, or of the other one; false if nothing
/// changes.
bool ContactSoundScheduler::touchOne(const ContactState& contact, bool first, std::int64_t sample) {
  const BodyId id = first ? contact.body : contact.other;
  const BodyId otherId = first ? contact.other : contact.body;
  const Body* body = findBody(id);
  const Body* other = findBody(otherId);
  if (body == nullptr || other == nullptr || body->rings == nullptr) return false;
  const ModalModel& model = *body->sound.modal;
  const Vec3& point = first ? contact.pathStart : contact.otherPathStart;
  const bool isOver = contact.phase == ContactPhase::end;
  return rings_.touch({.body = id,
                       .other = otherId,
                       .point = point + body->sound.modalOrigin.value_or(model.centreOfMass),
                       .stiffness = isOver ? 0.0 : hertzStiffness(hertzOf(contact, *body, *other))},
                      *body->rings, sample);
}

/// True if all numbers of the contact are finite, its step is not too long and its time is on the
/// clock.
bool ContactSoundScheduler::isDriven(const ContactState& contact) const {
  const bool isNumber = std::isfinite(contact.time) && isPositive(contact.duration) &&
                        contact.normal.allFinite() && contact.position.allFinite() &&
                        contact.normalLoad >= 0.0 && std::isfinite(contact.normalLoad) &&
                        contact.radius >= 0.0 && contact.otherRadius >= 0.0 &&
                        contact.slipVelocity.allFinite() && contact.appliedImpulse.allFinite() &&
                        contact.bodyPosition.allFinite() && contact.otherPosition.allFinite() &&
                        contact.bodyVelocity.allFinite() && contact.otherVelocity.allFinite() &&
                        contact.bodyOrientation.coeffs().allFinite() &&
                        contact.otherOrientation.coeffs().allFinite() &&
                        contact.pathStart.allFinite() && contact.pathEnd.allFinite() &&
                        contact.otherPathStart.allFinite() && contact.otherPathEnd.allFinite();
  return isNumber && contact.duration <= kLongestStep &&
         std::abs(contact.time) * settings_.sampleRate < kExactSamples;
}

/// Returns the pair's slide with the nodes of this step; null if the pair does not slide or cannot
/// be heard.
ContactSoundScheduler::Sliding* ContactSoundScheduler::advanced(const ContactState& contact,
                                                                double stretch) {
  const std::pair key(contact.body, contact.other);
  const double loudest = steepestImpulse(contact);
  if (loudest == 0.0) {
    if (!sliding_.empty()) sliding_.erase(key);
    return nullptr;
  }
  Body* const body = findBody(contact.body);
  Body* const other = findBody(contact.other);
  if (isInaudible(contact, loudest, *body, *other)) {
    ++counters_.inaudibleSlides;
    sliding_.erase(key);
    return nullptr;
  }
  const HertzContact hertz = hertzOf(contact, *body, *other);
  Sliding& sliding = sliding_[key];
  const Material& material = body->sound.material;
  const Material& otherMaterial = other->sound.material;
  sliding.drive.advance(
      {.duration = contact.duration,
       .load = contact.normalLoad,
       .mass = massOf(contact, *body, *other),
       .radius = hertz.radius,
       .modulus = hertz.modulus,
       .restitution = combinedRestitution(material.restitution, otherMaterial.restitution),
       .work = workOf(contact),
       .sampleRate = stretch * settings_.sampleRate,
       .surfaces = {{{textureOf(*body), coordinatesOf(*body), contact.pathStart, contact.pathEnd,
                      contact.bodyOrientation.conjugate() * contact.normal, ballRadius(*body)},
                     {textureOf(*other), coordinatesOf(*other), contact.otherPathStart,
                      contact.otherPathEnd, contact.otherOrientation.conjugate() * contact.normal,
                      ballRadius(*other)}}}},
      sliding.nodes);
  follow(contact, sliding);
  if (!sliding.sounds) fadeIn(sliding.nodes, contact.duration);
  sliding.sounds = !sliding.nodes.empty();
  return &sliding;
}

/// Fades in the nodes of a slide's first step, so that its force does not begin with a jump.
void ContactSoundScheduler::fadeIn(std::vector<PulseNode>& nodes, double duration) {
  for (PulseNode& node : nodes)
    node.weight *= std::min(1.0, node.u * duration / kFadingIn);
}

/// Smooths the contact points: for a body with many of them, stepped mechanics reports now one and
/// now another. The point that is pushed moves on steadily, and approaches the reported one with
/// the time constant kTurning.
void ContactSoundScheduler::follow(const ContactState& contact, Sliding& sliding) {
  const double kept = std::exp(-contact.duration / kTurning);
  const auto followOne = [kept](Sliding::Side& side, const Vec3& start, const Vec3& end) {
    side.offset = side.isKnown ? Vec3(kept * (side.offset + side.end - start)) : Vec3::Zero();
    if (side.offset.norm() > kFarthestOffset) side.offset.setZero();
    side.isKnown = true;
    side.end = end;
  };
  followOne(sliding.sides[0], contact.pathStart, contact.pathEnd);
  followOne(sliding.sides[1], contact.otherPathStart, contact.otherPathEnd);
}

/// True if the contact point moves over a surface fast enough to sound.
bool ContactSoundScheduler::isMoving(const ContactState& contact) {
  const double farthest = std::max((contact.pathEnd - contact.pathStart).squaredNorm(),
                                   (contact.otherPathEnd - contact.otherPathStart).squaredNorm());
  const double least = 0.5 * ContactDrive::kSlowest * contact.duration;
  return farthest >= least * least;
}

/// Effective mass (kg) of the pair along the normal; 0 if neither body can move.
double ContactSoundScheduler::massOf(const ContactState& contact, const Body& body,
                                     const Body& other) {
  const auto inverseMass = [&contact](const SoundBody& sound, const Vec3& at, const Quat& turn) {
    if (std::isinf(sound.mass)) return 0.0;
    const Vec3 lever = turn.conjugate() * (contact.position - at).cross(contact.normal);
    return 1.0 / sound.mass + (sound.shape ? lever.dot(sound.inverseInertia * lever) : 0.0);
  };
  const double inverse = inverseMass(body.sound, contact.bodyPosition, contact.bodyOrientation) +
                         inverseMass(other.sound, contact.otherPosition, contact.otherOrientation);
  return isPositive(inverse) ? 1.0 / inverse : 0.0;
}

/// Energy (J) that friction takes in the step; at least what rolling loses.
double ContactSoundScheduler::workOf(const ContactState& contact) {
  const double farthest = std::max((contact.pathEnd - contact.pathStart).norm(),
                                   (contact.otherPathEnd - contact.otherPathStart).norm());
  return std::max(-contact.appliedImpulse.dot(contact.slipVelocity),
                  kRollingLoss * contact.normalLoad * farthest);
}

/// Upper bound (N s) of the impulse that comes at once in the step: to twice the speed at which the
/// steepest bumps push, and back. 0 unless the contact slides.
double ContactSoundScheduler::steepestImpulse(const ContactState& contact) {
  if (contact.phase == ContactPhase::end || !isMoving(contact) || !isDriven(contact)) return 0.0;
  Body* const body = findBody(contact.body);
  Body* const other = findBody(contact.other);
  if (body == nullptr || other == nullptr) return 0.0;
  const auto pushed = [this, &contact](Body& scanned, const Vec3& from, const Vec3& to) {
    const SurfaceTexture* texture = textureOf(scanned);
    return texture == nullptr ? 0.0 : texture->steepest() * (to - from).norm() / contact.duration;
  };
  return 4.0 * massOf(contact, *body, *other) *
         (pushed(*body, contact.pathStart, contact.pathEnd) +
          pushed(*other, contact.otherPathStart, contact.otherPathEnd));
}

double ContactSoundScheduler::slideRank(const ContactState& contact) {
  const double loudest = anyTextures_ ? steepestImpulse(contact) : 0.0;
  if (loudest == 0.0) return 0.0;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t index = 0; index < tracks_.size(); ++index)
    nearest =
        std::min(nearest, (tracks_[index].at(contact.time).position - contact.position).norm());
  const bool slides = sliding_.contains({contact.body, contact.other});
  return (slides ? kSlidesOn : 1.0) * loudest / std::max(nearest, kNearest);
}

/// True if neither body can be heard, whatever impulses up to `loudest` (N s) the bumps give.
bool ContactSoundScheduler::isInaudible(const ContactState& contact, double loudest,
                                        const Body& body, const Body& other) {
  if (settings_.audibleThreshold == 0.0) return false;
  for (const bool first : {true, false}) {
    const Body& sounding = first ? body : other;
    // A body that rings may gather energy for longer than a step.
    if (sounding.rings != nullptr) return false;
    if (sounding.filters == nullptr) continue;
    Contact probe =
        contactOf(slidingEvent(contact, first, Vec3::Zero()), sounding, contact.duration, {});
    probe.pulse = &Pulse::of(PulseShape::hertz);
    const std::array<PulseNode, 1> train = {{{0.0, loudest}}};
    probe.train = train;
    probe.loudest = loudest;
    if (!layContact(probe) || peak_ >= settings_.audibleThreshold) return false;
  }
  return true;
}

/// Returns the body's texture, or one made from its material's roughness; null if it is smooth.
const SurfaceTexture* ContactSoundScheduler::textureOf(Body& body) {
  if (body.sound.texture != nullptr) return body.sound.texture.get();
  const Roughness& roughness = body.sound.material.roughness;
  if (body.rough == nullptr && roughness.rmsHeight > 0.0)
    body.rough =
        std::make_shared<const SurfaceTexture>(*SurfaceTexture::rough(roughness, kRoughSeed));
  return body.rough.get();
}

/// Returns the coordinates of the body's own texture; null for roughness, the same all over.
const TextureCoordinates* ContactSoundScheduler::coordinatesOf(const Body& body) {
  return body.sound.texture != nullptr ? body.sound.textureCoordinates.get() : nullptr;
}

/// Returns the event of an impulse of 1 N s along the normal, with the friction that goes with it,
/// at `offset` (m, body frame) from the reported contact point.
ImpulseEvent ContactSoundScheduler::slidingEvent(const ContactState& contact, bool first,
                                                 const Vec3& offset) {
  const double pressed = contact.appliedImpulse.dot(contact.normal);
  Vec3 along = Vec3::Zero();
  if (pressed > 0.0) along = contact.appliedImpulse / pressed - contact.normal;
  if (along.norm() > kMostFriction) along *= kMostFriction / along.norm();
  const double sign = first ? 1.0 : -1.0;
  ImpulseEvent event;
  event.time = contact.time;
  event.body = first ? contact.body : contact.other;
  event.other = first ? contact.other : contact.body;
  event.normal = sign * contact.normal;
  event.impulse = sign * (contact.normal + along);
  event.bodyPosition = first ? contact.bodyPosition : contact.otherPosition;
  event.bodyOrientation = first ? contact.bodyOrientation : contact.otherOrientation;
  event.bodyVelocity = first ? contact.bodyVelocity : contact.otherVelocity;
  event.position = contact.position + event.bodyOrientation * offset;
  return event;
}

ScheduledSound ContactSoundScheduler::slide(const ContactState& state, bool first,
                                            const SampleShift& shift) {
  // The naive compact model has no filter that could take a force.
  if (!anyTextures_ || !paths_->isFiltered()) return {};
  const bool isStretched = !(shift.stretch > kLeastStretch && shift.stretch < kMostStretch);
  if (first) slidingNow_ = isStretched ? nullptr : advanced(state, shift.stretch);
  if (slidingNow_ == nullptr || slidingNow_->nodes.empty()) return {};
  const Body& body = *findBody(first ? state.body : state.other);
  if (body.filters == nullptr && body.rings == nullptr) return {};
  Sliding::Side& side = slidingNow_->sides[first ? 0 : 1];
  const ImpulseEvent event = slidingEvent(state, first, side.offset);
  Contact contact = contactOf(event, body, state.duration * shift.stretch, shift);
  contact.pulse = &Pulse::of(PulseShape::hertz);  // spans the step from begin to end
  contact.train = slidingNow_->nodes;
  contact.loudest = loudestOf(contact.train);
  contact.strike.velocity = event.bodyVelocity;
  // The dipole changes gradually from that of the last step: a jump would click.
  contact.dipoleBefore = side.dipole.value_or(contact.strike.dipole);
  side.dipole = contact.strike.dipole;
  if (!layContact(contact)) {
    ++counters_.rejected;
    return {};
  }
  ScheduledSound sound = soundOf();
  ++(sound.clicks.empty() && sound.rings.empty() ? counters_.inaudibleSlides : counters_.slides);
  sound.train = slidingNow_->nodes;
  return sound;
}

/// Radius (m) of the contact's curvature. Edges are blunt, and flat faces touch where they are not
/// flat, as in an impact; so does an edge on a face, as stepped mechanics reports the same face now
/// as lying flat and now as standing on its edge.
double ContactSoundScheduler::contactRadius(const ContactState& contact, const Body& body,
                                            const Body& other) {
  const double radius = ballRadius(body) > 0.0 ? ballRadius(body) : contact.radius;
  const double otherRadius = ballRadius(other) > 0.0 ? ballRadius(other) : contact.otherRadius;
  const bool isCurved = isPositive(radius) || isPositive(otherRadius);
  const auto blunt = [isCurved](double given, const Body& touched) {
    return isCurved && given > 0.0 ? given : touched.sound.edgeRadius;
  };
  return 1.0 / (1.0 / blunt(radius, body) + 1.0 / blunt(otherRadius, other));
}

/// Radius in m; 0 unless the body is a sphere.
double ContactSoundScheduler::ballRadius(const Body& body) {
  return body.sound.shape == nullptr ? body.sound.radius : 0.0;
}

HertzContact ContactSoundScheduler::hertzOf(const ContactState& contact, const Body& body,
                                            const Body& other) {
  return {.load = contact.normalLoad,
          .radius = contactRadius(contact, body, other),
          .modulus = contactModulus(body.sound.material, other.sound.material)};
}

/// Chooses the smallest Gauss rule that is right up to the sample rate, beyond which the kernel
/// lets nothing through. A rule's errors there grow with its size; long contacts do better without.
void ContactSoundScheduler::chooseRule(Click& click) const {
  const double bandwidth = 2.0 * std::numbers::pi * click.track.length;
  const std::size_t size = click.pulse->ruleSize(bandwidth);
  if (size > 0 && size <= kMostNodes) click.nodes = click.pulse->rule(size);
}

}  // namespace carom::audio
