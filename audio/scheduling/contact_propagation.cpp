#include "audio/scheduling/contact_propagation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "audio/dsp/spread_kernel.h"
#include "audio/propagation/hrtf.h"
#include "audio/radiation/radiation_filter.h"

namespace carom::audio {
namespace {

/// Samples: half the width of the kernel that puts instants on samples.
constexpr auto kReach = static_cast<std::int64_t>(kSpreadWidth / 2);
/// Pa: a louder sound is that of a mistake. 1e5 times the pressure of the air.
constexpr double kLoudest = 1e10;
/// s: a longer contact has nothing in the audible band, and would take memory without end.
constexpr double kLongestContact = 20.0;
/// Upper bound of a head-related response over the free field, at any frequency.
constexpr double kLoudestEar = 4.0;
/// The weight of a filter's far part over its near part, at least: any, that rounding forgives.
constexpr double kLeastFar = 1e-6;
/// Peaks of a diffuse field over the root of its mean square.
constexpr double kTailPeaks = 4.0;

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

double largest(const std::array<double, 3>& gains) {
  return std::max({std::abs(gains[0]), std::abs(gains[1]), std::abs(gains[2])});
}

double touchOf(const ContactSource& source) {
  return source.touch > 0.0 ? source.touch : source.duration;
}

Vec3 mirrored(const Image* image, const Vec3& vector) {
  return image != nullptr ? image->vector(vector) : vector;
}

/// m: a receiver that is nearer counts as so far away.
double nearestOf(const ContactSource& source) {
  return source.recoil != nullptr ? source.recoil->radius() : source.strike.radius;
}

/// Dipole at the begin, middle or end of the contact, for `part` 0, 1 or 2.
Vec3 dipoleAt(const ContactSource& source, std::size_t part) {
  const double share = 0.5 * static_cast<double>(part);
  return source.dipoleBefore + share * (source.strike.dipole - source.dipoleBefore);
}

}  // namespace

ContactPropagation::ContactPropagation(std::shared_ptr<const SoundPaths> paths,
                                       const ListenerTracks& tracks, ModalExciter& exciter)
    : paths_(std::move(paths)), settings_(paths_->settings), tracks_(tracks), exciter_(exciter) {}

bool ContactPropagation::propagate(const ContactSource& source) {
  clicks_.clear();
  ears_.clear();
  peaks_.assign(paths_->channels.size(), 0.0);
  clickPeak_ = modalPeak_ = modalBound_ = 0.0;
  if (source.recoil != nullptr)
    source.recoil->combine(source.motion.linear, source.motion.angular, recoil_);
  for (std::uint32_t channel = 0; channel < paths_->channels.size(); ++channel)
    for (std::uint32_t path = 0; path < paths_->paths.size(); ++path) {
      const auto& [image, chain] = paths_->paths[path];
      if (!propagateTo(source, {chain, channel, image, path})) return false;
    }
  if (settings_.reverb && !propagateToReverb(source)) return false;
  if (source.rings) estimateRing(source);
  refusal_ = &SynthCounters::rejectedTooFar;
  return clickPeak_ <= kLoudest && modalBound_ <= kLoudest * source.ringShare;
}

void ContactPropagation::estimateRing(const ContactSource& source) {
  const double touch = touchOf(source);
  if (source.loudest == 0.0) {
    modalBound_ = exciter_.peak(*source.pulse, touch);
    const double loudness =
        exciter_.loudness({*source.pulse, touch, source.train, source.duration});
    // Whoever compares it with the threshold finds what is decided by the bound.
    modalPeak_ = std::max(loudness, std::min(modalBound_, settings_.audibleThreshold));
  } else {
    modalPeak_ = modalBound_ = exciter_.peak(source.train);
  }
}

ScheduledSound ContactPropagation::sound() const {
  ScheduledSound sound;
  if (clickPeak_ > 0.0 && clickPeak_ >= settings_.audibleThreshold) {
    sound.peak = clickPeak_;
    sound.peaks = peaks_;
    sound.clicks = clicks_;
    sound.ears = ears_;
  }
  if (modalBound_ > 0.0 && modalBound_ >= settings_.audibleThreshold) {
    sound.excitations = exciter_.excitations();
    sound.taps = exciter_.taps();
    sound.modalPeak = modalPeak_;
  }
  return sound;
}

/// Adds the sound that takes this route, if no wall blocks it. Returns false as `propagate` does.
bool ContactPropagation::propagateTo(const ContactSource& source, const Route& route) {
  PropagationPath path;
  if (!findPath(source, route, path)) return true;
  if (!fitsOnClock(source, path)) return false;
  if (source.recoil != nullptr) {
    addRecoil(source, path, route);
  } else if (source.filters != nullptr) {
    const double ear = paths_->channels[route.channel].isEar ? kLoudestEar : 1.0;
    const double peak = ear * boundOf(source, path);
    peaks_[route.channel] = std::max(peaks_[route.channel], peak);
    clickPeak_ = std::max(clickPeak_, peak);
    addClick(source, path, route);
  }
  if (source.rings) addExcitation(source, path, route);
  return true;
}

/// Adds what is sent into the reverberation: the mean over all directions, at 1 m, without the near
/// field, which carries no power. Returns false as `propagate` does.
bool ContactPropagation::propagateToReverb(const ContactSource& source) {
  PropagationPath send;
  for (std::size_t part = 0; part < send.gains.size(); ++part)
    send.gains[part] = dipoleAt(source, part).norm() / std::numbers::sqrt3;
  send.distance = std::numeric_limits<double>::infinity();
  if (!fitsOnClock(source, send)) return false;
  const Route route{.channel = static_cast<std::uint32_t>(paths_->channels.size())};
  if (source.filters != nullptr) {
    clickPeak_ = std::max(clickPeak_, boundOf(source, send) * tailOverClick(source));
    addClick(source, send, route);
  }
  if (source.rings) exciter_.exciteReverb(modalDrive(source, send, route), source.isFollowed);
  return true;
}

/// Finds delays and gains over one route; false if a wall blocks it.
bool ContactPropagation::findPath(const ContactSource& source, const Route& route,
                                  PropagationPath& path) const {
  const Strike& strike = source.strike;
  const SoundPaths::Channel& channel = paths_->channels[route.channel];
  const Vec3 velocity = mirrored(route.image, strike.velocity);
  const Vec3 from =
      route.image != nullptr ? route.image->position(strike.position) : strike.position;
  for (const std::size_t part : {0u, 1u, 2u}) {
    if (part > 0 && !settings_.doppler) {
      keepAsAtBegin(source, route, part, path);
      continue;
    }
    const double later = 0.5 * static_cast<double>(part) * source.duration / source.shift.stretch;
    const Arrival arrival =
        tracks_.arrivalAt(channel, source.time + later, from + later * velocity);
    if (part == 0 && route.image != nullptr) {
      const Vec3 ear = from - arrival.distance * arrival.towardsSource;
      if (!isVisible(settings_.room, *route.image, strike.position, ear)) return false;
    }
    hear(source, route, arrival, part, path);
  }
  return true;
}

/// Sets the delay and gain of the middle or end without Doppler effect: the dipole of a lasting
/// contact may be another one at its end.
void ContactPropagation::keepAsAtBegin(const ContactSource& source, const Route& route,
                                       std::size_t part, PropagationPath& path) const {
  path.delays[part] = path.delays[0];
  const double strength =
      source.recoil != nullptr
          ? 1.0
          : -mirrored(route.image, dipoleAt(source, part)).dot(path.towardsSource);
  path.gains[part] = strength * path.receiverGain / std::max(path.distance, nearestOf(source));
}

/// Sets the delay and gain of the begin, middle or end as its wave arrives.
void ContactPropagation::hear(const ContactSource& source, const Route& route,
                              const Arrival& arrival, std::size_t part,
                              PropagationPath& path) const {
  const SoundPaths::Channel& channel = paths_->channels[route.channel];
  const Vec3 dipole = mirrored(route.image, dipoleAt(source, part));
  const double distance = std::max(arrival.distance, nearestOf(source));
  if (part < 2) path.distance = distance;
  path.gains[part] =
      (source.recoil != nullptr ? 1.0 : -dipole.dot(arrival.towardsSource)) / distance;
  if (part == 0) path.towardsSource = arrival.towardsSource;
  path.delays[part] = (distance - source.ahead) / settings_.medium.speedOfSound;
  if (channel.isEar) {
    const HrtfSet& set = *paths_->listeners[channel.listener].hrtf;
    const SphereWeights ears = set.lookup(arrival.orientation.conjugate() * arrival.towardsSource);
    if (part == 0) path.ears = ears;
    path.delays[part] += set.delayBetween(ears, channel.ear);
  } else if (channel.receiver.pattern != 0.0) {
    const double heard = gain(channel.receiver, arrival.orientation, arrival.towardsSource);
    path.gains[part] *= heard;
    if (part == 0) path.receiverGain = heard;
  }
  if (!settings_.doppler) return;
  // A click is stretched as it is put on the samples, with the integral of its force kept, as is
  // right for a moving body. A moving listener hears the pressure that is there, faster or slower.
  const bool overtaken = !(arrival.stretch > kLeastStretch && arrival.stretch < kMostStretch);
  const double stretch = overtaken ? 1.0 : arrival.stretch;
  path.gains[part] *= stretch * stretch;
  if (part < 2) path.stretch = stretch;  // in the end, that of the middle
}

/// Upper bound (Pa) of a click, from the pulse's slope, what the band holds of it, and what a body
/// of that size lets through (its response's total variation is 1.35 c/a).
double ContactPropagation::boundOf(const ContactSource& source, const PropagationPath& path) const {
  const double rate = settings_.sampleRate;
  const bool naive = settings_.comparison.sampling == Sampling::naive;
  const double inBand = std::numbers::pi * (naive ? 1e6 : 0.5);
  const double touch = touchOf(source);
  double force = std::min(source.pulse->peakForce() / touch, inBand * rate);
  double slope = std::min(source.pulse->peakSlope() / (touch * touch), inBand * rate * rate);
  if (source.loudest > 0.0) {
    force = source.loudest * rate;
    slope = source.loudest * 0.5 * std::numbers::pi * rate * rate;
  }
  if (settings_.comparison.radiation == Radiation::exact) {
    const double corner = settings_.medium.speedOfSound / source.strike.radius;
    slope = std::min(1.1 * slope, 1.35 * corner * force);
    slope += 1.1 * force * settings_.medium.speedOfSound / path.distance;
  }
  return largest(path.gains) * slope;
}

/// Peak of the reverberation's tail over that of the sound sent into it: the diffuse field's level
/// (Reverb) for a click that is at its peak while it lasts, times the field's peaks over its level.
double ContactPropagation::tailOverClick(const ContactSource& source) const {
  const ReverbSettings& reverb = *settings_.reverb;
  const double lasting =
      (source.pulse->end() - source.pulse->begin()) * source.duration +
      static_cast<double>(kSpreadWidth + RadiationFilter::kTaps) / settings_.sampleRate +
      5.0 * source.strike.radius / settings_.medium.speedOfSound;
  const double density = 4.0 * std::numbers::pi * reverb.speedOfSound / reverb.volume;  // 1/s
  return reverb.gain * kTailPeaks * std::sqrt(density * lasting);
}

/// True if the clock can represent the contact's times, and its loudness is finite; else says why
/// not.
bool ContactPropagation::fitsOnClock(const ContactSource& source, const PropagationPath& path) {
  const double rate = settings_.sampleRate;
  const double extent = std::abs(source.time) + path.delays[0] + path.delays[2] +
                        (source.pulse->end() - source.pulse->begin()) * source.duration;
  const double loudness = (std::abs(path.gains[0]) + std::abs(path.gains[2])) * rate * rate;
  const bool isFar = !(extent * rate < kExactSamples);
  const bool isLong = !(source.duration <= kLongestContact);
  refusal_ = isLong ? &SynthCounters::rejectedTooLong : &SynthCounters::rejectedTooFar;
  return !isFar && !isLong && std::isfinite(loudness);
}

/// Code of the distance over which the air absorbs the sound; 0 where it is left out, as in what is
/// sent into the reverberation, which has the air's part in its decay.
std::uint16_t ContactPropagation::airOf(const PropagationPath& path) const {
  return paths_->air && std::isfinite(path.distance) ? paths_->air->codeOf(path.distance)
                                                     : std::uint16_t{0};
}

/// Returns the click of a path on samples, through the air, whose delay it makes up for.
Click ContactPropagation::throughAir(const ContactSource& source, PropagationPath path) const {
  const std::uint16_t air = airOf(path);
  if (air != 0)
    for (double& delay : path.delays)
      delay -= AirFilter::heardDistanceOf(air) * paths_->air->slowness();
  Click click = onSamples(source, path);
  click.air = air;
  return click;
}

void ContactPropagation::addClick(const ContactSource& source, const PropagationPath& path,
                                  const Route& route) {
  const double rate = settings_.sampleRate;
  if (std::abs(path.gains[0]) + std::abs(path.gains[2]) == 0.0 && path.gains[1] == 0.0) return;
  Click click = throughAir(source, path);
  const Parabola gain(path.gains[0], path.gains[1], path.gains[2]);
  click.track.gain = gain.at0 * rate * rate;
  click.track.slope = gain.slope * rate * rate;
  click.track.curve = gain.curve * rate * rate;
  if (paths_->isFiltered()) click.first += RadiationFilter::kFirstTap;
  click.near = settings_.medium.speedOfSound / (path.distance * path.stretch * rate);
  click.channel = route.channel;
  click.filters = source.filters;
  click.chain = route.chain;
  clicks_.push_back(click);
  if (paths_->hasHeads) ears_.push_back(path.ears);
}

/// Adds the click of a recoil: one on the filter of each of its poles.
void ContactPropagation::addRecoil(const ContactSource& source, const PropagationPath& path,
                                   const Route& route) {
  Vec3 toReceiver = -path.distance * path.towardsSource;
  if (route.image != nullptr) toReceiver = route.image->linear.transpose() * toReceiver;
  RecoilFilters::Weights weights;
  source.recoil->weigh(recoil_, source.orientation.conjugate() * toReceiver, weights);
  const double rate = settings_.sampleRate;
  const double strength = settings_.medium.density * rate;
  const double touch = touchOf(source) * rate;
  const double ear = paths_->channels[route.channel].isEar ? kLoudestEar : 1.0;
  const double peak = ear * largest(path.gains) * strength *
                      source.recoil->bound(weights, source.pulse->peakForce() / touch,
                                           source.pulse->peakSlope() / (touch * touch));
  peaks_[route.channel] = std::max(peaks_[route.channel], peak);
  clickPeak_ = std::max(clickPeak_, peak);
  Click click = throughAir(source, path);
  click.first += RadiationFilter::kFirstTap;
  click.channel = route.channel;
  click.chain = route.chain;
  const Parabola along(path.gains[0], path.gains[1], path.gains[2]);
  for (std::size_t index = 0; index < source.recoil->size(); ++index) {
    // A click has its far part's weight, and that of the near part over it.
    const double least = kLeastFar * std::abs(weights.near[index]);
    const double far = std::max(std::abs(weights.far[index]), least);
    if (far == 0.0) continue;
    const double scale = std::copysign(far, weights.far[index]) * strength;
    click.track.gain = along.at0 * scale;
    click.track.slope = along.slope * scale;
    click.track.curve = along.curve * scale;
    click.near = weights.near[index] / std::copysign(far, weights.far[index]);
    click.filters = &source.recoil->filter(index);
    clicks_.push_back(click);
    if (paths_->hasHeads) ears_.push_back(path.ears);
  }
}

/// Returns the contact's pulse on the samples with gain 1: a click without filters.
Click ContactPropagation::modalDrive(const ContactSource& source, PropagationPath path,
                                     const Route& route) const {
  for (double& delay : path.delays)
    delay += source.ahead / settings_.medium.speedOfSound;
  Click drive = onSamples(source, path);
  drive.track.gain = 1.0;
  drive.channel = route.channel;
  drive.chain = route.chain;
  return drive;
}

void ContactPropagation::addExcitation(const ContactSource& source, const PropagationPath& path,
                                       const Route& route) {
  const SoundPaths::Channel& channel = paths_->channels[route.channel];
  ModalRoute modal{.toReceiver = -path.distance * path.towardsSource,
                   .gain = path.receiverGain,
                   .ears = path.ears,
                   .ear = channel.ear,
                   .chain = route.chain,
                   .isFollowed = source.isFollowed};
  if (source.isFollowed) {
    modal.path = route.path + 1;
    const double stretch = 1.0 + (path.delays[2] - path.delays[0]) / source.duration;
    if (stretch > kLeastStretch && stretch < kMostStretch) modal.rate = 1.0 / stretch;
  }
  if (route.image != nullptr) modal.toReceiver = route.image->linear.transpose() * modal.toReceiver;
  if (channel.isEar) modal.head = paths_->listeners[channel.listener].hrtf.get();
  exciter_.excite(modalDrive(source, path, route), modal);
}

/// Returns the contact's pulse on the samples of a receiver: its time, its stretch by motion and
/// the nodes by which it is sampled.
Click ContactPropagation::onSamples(const ContactSource& source,
                                    const PropagationPath& path) const {
  const double rate = settings_.sampleRate;
  Click click;
  click.pulse = source.pulse;
  const SampleTime start = shifted(samplesOf(source.time, path.delays[0], rate), source.shift);
  const Parabola delay(0.0, path.delays[1] - path.delays[0], path.delays[2] - path.delays[0]);
  click.track = {.start = start.fraction,
                 .length = (source.duration + delay.slope) * rate,
                 .bend = delay.curve * rate};
  const double still = source.duration * rate;
  // Motion at nearly the speed of sound or above would fold time.
  if (!(click.track.length > kLeastStretch * still) ||
      !(click.track.length < kMostStretch * still) ||
      !(std::abs(click.track.bend) < 0.1 * click.track.length)) {
    click.track.length = still;
    click.track.bend = 0.0;
  }
  const std::int64_t first =
      static_cast<std::int64_t>(std::floor(click.track.at(source.pulse->begin()))) - kReach;
  click.track.start -= static_cast<double>(first);
  const double last = click.track.at(source.pulse->end());
  click.samples =
      static_cast<std::uint32_t>(std::ceil(last)) + static_cast<std::uint32_t>(kReach) + 1;
  click.first = start.whole + first;
  if (!source.train.empty())
    click.nodes = source.train;
  else if (settings_.comparison.sampling == Sampling::bandLimited)
    chooseRule(click);
  if (click.nodes.empty()) click.pulse->forceTable();  // made now, not while rendering
  return click;
}

/// Chooses the smallest Gauss rule that is right up to the sample rate, beyond which the kernel
/// lets nothing through. A rule's errors there grow with its size; long contacts do better without.
void ContactPropagation::chooseRule(Click& click) const {
  const double bandwidth = 2.0 * std::numbers::pi * click.track.length;
  const std::size_t size = click.pulse->ruleSize(bandwidth);
  if (size > 0 && size <= kMostNodes) click.nodes = click.pulse->rule(size);
}

}  // namespace carom::audio
