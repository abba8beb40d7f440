#include "audio/scheduling/modal_exciter.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "audio/dsp/resonator_kernels.h"
#include "audio/dsp/spread_kernel.h"
#include "audio/model/pulse.h"
#include "audio/propagation/hrtf.h"
#include "audio/radiation/mode_transfer.h"
#include "audio/radiation/multipole.h"
#include "audio/synthesis/modal_bank.h"
#include "carom/audio/absorption.h"

namespace carom::audio {
namespace {

using Complex = std::complex<double>;

/// m: least distance of a receiver from the centre of mass of a body that rings.
constexpr double kNearestListener = 1e-6;
/// A contact that has changed by less counts as unchanged.
constexpr double kNewStiffness = 1.25;  // factor on its stiffness
constexpr double kMoved = 0.05;         // distance, as a share of the body's radius
/// Share of the mean over directions at 1 m with which a blow is heard at least if its ring is
/// followed, so that the oscillation of a mode at a node of its pattern is not lost in a 0.
constexpr double kNode = 1e-12;
constexpr double kForever = 1e9;  ///< s, for modes that nothing damps
/// The loudest modes, whose drive is that of the very force; that of others is bounded.
constexpr std::size_t kExactModes = 8;
constexpr double kCounts = 0.05;  // share of the loudest one's: quieter ones add little
/// rad^2: the phase of a mode, squared, by which its stiffness holds what a force moves.
constexpr double kHolding = 8.0;

/// Unit normal of the triangle that the point is in.
Vec3 normalAt(const SurfaceMesh& surface, const SurfacePoint& point) {
  const Vec3& a = surface.vertices[point.vertices[0]];
  const Vec3& b = surface.vertices[point.vertices[1]];
  const Vec3& c = surface.vertices[point.vertices[2]];
  return (b - a).cross(c - a).normalized();
}

/// Returns the displacement of a mode at the point, for a coordinate of 1, along a vector: the mean
/// of its triangle's corners.
double shapeAlong(const ModalModel& model, std::size_t mode, const SurfacePoint& point,
                  const Vec3& vector) {
  double along = 0.0;
  for (std::size_t corner = 0; corner < point.vertices.size(); ++corner)
    along += point.weights[corner] * model.shape(mode, point.vertices[corner]).dot(vector);
  return along;
}

/// Returns the loss in a spring of a stiffness (N/m) and loss factor whose far end is free but for
/// a mass (kg), over that of one whose end is held, at w (rad/s): what is light swings along. At
/// most 1, as a resonance of the two would be more than a damping.
double lossBehind(double mass, double stiffness, double loss, double w) {
  if (std::isinf(mass)) return 1.0;
  const double inertia = mass * w * w;
  const double off = std::hypot(stiffness - inertia, loss * stiffness);
  return off > inertia ? inertia / off * (inertia / off) : 1.0;
}

/// Returns what a contact adds to the decay rate (1/s) of each mode.
std::vector<double> ratesOf(const ModalExciter::DampingContact& contact,
                            const ModalExciter::Source& source, double loss) {
  const ResonatorSet& set = *source.resonators;
  const SurfacePoint point = source.locator.nearest(contact.point);
  const Vec3 normal = normalAt(set.model->surface, point);
  std::vector<double> rates(set.modes);
  for (std::size_t mode = 0; mode < set.modes; ++mode) {
    const double along = shapeAlong(*set.model, mode, point, normal);
    const double w = set.pole[mode].imag();
    rates[mode] = lossBehind(contact.mass, contact.stiffness, loss, w) * loss * contact.stiffness *
                  along * along / (2.0 * w);
  }
  return rates;
}

/// Frequency response of an ear's aligned response at w (rad per sample).
Complex earResponse(std::span<const double> response, double w) {
  const Complex turn = std::polar(1.0, -w);
  Complex sum = 0.0;
  for (std::size_t tap = response.size(); tap-- > 0;)
    sum = sum * turn + response[tap];
  return sum;
}

}  // namespace

ModalExciter::Source::Source(const ResonatorSet& modes)
    : resonators(&modes),
      locator(modes.model->surface),
      radius(enclosingRadius(modes.model->surface, modes.model->centreOfMass)) {}

ModalExciter::ModalExciter(std::shared_ptr<const SoundPaths> paths) : paths_(std::move(paths)) {
  if (paths_->hasHeads) response_.resize(paths_->longestResponse);
}

const ModalExciter::Source& ModalExciter::sourceOf(const std::shared_ptr<const ModalModel>& model) {
  std::unique_ptr<Source>& source = sources_[model.get()];
  if (source != nullptr) return *source;
  const SynthSettings& settings = paths_->settings;
  sets_.push_back(std::make_unique<ResonatorSet>(model, settings));
  ResonatorSet& set = *sets_.back();
  set.order = static_cast<std::uint32_t>(sets_.size());
  source = std::make_unique<Source>(set);
  if (paths_->air)
    for (const Complex& pole : set.pole)
      source->air.push_back(
          0.5 * airAttenuation(settings.medium, pole.imag() / (2.0 * std::numbers::pi)));
  for (const auto& chain : paths_->chains) {
    for (const Complex& pole : set.pole) {
      const double frequency = pole.imag() / (2.0 * std::numbers::pi);
      Complex response = 1.0;
      for (const ReflectionFilter& wall : chain)
        response *= frequencyResponse(wall, frequency, settings.sampleRate);
      source->walls.push_back(response);
    }
  }
  amplitudes_.resize(set.modes);
  meanTransfers(*model, settings.modalRadiation, settings.medium, amplitudes_);
  for (const Complex& mean : amplitudes_)
    source->means.push_back(std::abs(mean) > 0.0 ? std::abs(mean) : 1.0);
  return *source;
}

void ModalExciter::addModes(const Push& push, const SoundBody& body, const Source& source,
                            std::vector<ContactMode>& modes) {
  const ResonatorSet& set = *source.resonators;
  const ModalModel& model = *set.model;
  const Quat toBody = push.orientation.conjugate();
  const Vec3 origin = body.modalOrigin.value_or(model.centreOfMass);
  const SurfacePoint point = source.locator.nearest(toBody * (push.point - push.position) + origin);
  const Vec3 direction = toBody * push.direction;
  for (std::size_t mode = 0; mode < set.modes; ++mode) {
    modes.push_back({.frequency = set.pole[mode].imag(),
                     .decay = -set.pole[mode].real(),
                     .shape = shapeAlong(model, mode, point, direction)});
  }
}

bool ModalExciter::strike(const ImpulseEvent& event, const SoundBody& body, const Source& source) {
  const ModalModel& model = *source.resonators->model;
  body_ = event.body;
  source_ = &source;
  orientation_ = event.bodyOrientation;
  const Vec3 origin = body.modalOrigin.value_or(model.centreOfMass);
  position_ = event.bodyPosition + orientation_ * (model.centreOfMass - origin);
  excitations_.clear();
  taps_.clear();
  loudest_.assign(source.resonators->modes, 0.0);

  const Vec3 impulse = orientation_.conjugate() * event.impulse;
  const Vec3 where = orientation_.conjugate() * (event.position - event.bodyPosition) + origin;
  const SurfacePoint point = source.locator.nearest(where);
  excitation_.assign(source.resonators->modes, 0.0);
  bool any = false;
  for (std::size_t mode = 0; mode < excitation_.size(); ++mode) {
    excitation_[mode] = shapeAlong(model, mode, point, impulse);
    any = any || excitation_[mode] != 0.0;
  }
  residual_ = 0.0;
  loudestRest_ = 0.0;
  for (std::size_t corner = 0; corner < point.vertices.size(); ++corner)
    residual_ += point.weights[corner] * model.residualVolume(point.vertices[corner]).dot(impulse);
  return any;
}

void ModalExciter::excite(const Click& drive, const ModalRoute& route) {
  findTransfers(route, *source_, orientation_);
  if (route.isFollowed) {
    const double distance = std::max(route.toReceiver.norm(), source_->radius);
    for (std::size_t mode = 0; mode < amplitudes_.size(); ++mode) {
      const double mean = source_->means[mode];
      if (std::abs(amplitudes_[mode]) < kNode * mean) amplitudes_[mode] = kNode * mean;
      boundRing(mode, mean / distance);
    }
  }
  addExcitation(drive, route);
}

/// Finds how each mode is heard over a route, as amplitudes_.
void ModalExciter::findTransfers(const ModalRoute& route, const Source& source,
                                 const Quat& orientation) {
  const ResonatorSet& set = *source.resonators;
  // A receiver within the sphere around the body is put onto it; one in its very middle, on top.
  const bool isCentre = route.toReceiver.isZero(0.0);
  const Vec3 leaving = isCentre ? Vec3::UnitZ() : Vec3(orientation.conjugate() * route.toReceiver);
  const double distance =
      std::max({isCentre ? 0.0 : leaving.norm(), source.radius, kNearestListener});
  amplitudes_.resize(set.modes);
  modeTransfers(*set.model, paths_->settings.modalRadiation, paths_->settings.medium,
                leaving.normalized() * distance, amplitudes_);
  const std::span<const Complex> walls =
      std::span(source.walls).subspan(route.chain * set.modes, set.modes);
  for (std::size_t mode = 0; mode < set.modes; ++mode)
    amplitudes_[mode] *= route.gain * walls[mode];
  const double air = paths_->air ? paths_->air->heardDistance(distance) : 0.0;
  if (air != 0.0)
    for (std::size_t mode = 0; mode < set.modes; ++mode)
      amplitudes_[mode] *= std::exp(-air * source.air[mode]);
  hears_ = route.gain / distance;
  if (set.modes > 0) {
    hears_ *= std::abs(walls.back());
    if (air != 0.0) hears_ *= std::exp(-air * source.air.back());
  }
  if (route.head != nullptr) {
    const std::span<double> response = std::span(response_).first(route.head->alignedLength());
    route.head->blendAligned(route.ears, route.ear, response);
    Complex ear = 1.0;
    for (std::size_t mode = 0; mode < set.modes; ++mode) {
      ear = earResponse(response, set.pole[mode].imag() / paths_->settings.sampleRate);
      amplitudes_[mode] *= ear;
    }
    hears_ *= std::abs(ear);
  }
}

/// Adds what the modes that the model leaves out do to the pulse.
void ModalExciter::addResidual(RestTaps<double>& rest) {
  if (residual_ == 0.0) return;
  const double level =
      paths_->settings.medium.density / (4.0 * std::numbers::pi) * residual_ * hears_;
  double sum = 0.0;
  for (std::size_t tap = 0; tap < rest.size(); ++tap) {
    const double pressure = level * source_->resonators->residual[tap];
    rest[tap] += pressure;
    sum += std::abs(pressure);
  }
  loudestRest_ = std::max(loudestRest_, sum);
}

/// Enters how loud a mode of the event may be heard: through a transfer, in any direction.
void ModalExciter::boundRing(std::size_t mode, double transfer) {
  const Complex pole = source_->resonators->pole[mode];
  loudest_[mode] = std::max(loudest_[mode],
                            std::norm(pole) * std::abs(excitation_[mode] * transfer) / pole.imag());
}

void ModalExciter::exciteReverb(const Click& drive, bool isFollowed) {
  amplitudes_.resize(source_->resonators->modes);
  meanTransfers(*source_->resonators->model, paths_->settings.modalRadiation,
                paths_->settings.medium, amplitudes_);
  ModalRoute everywhere;
  everywhere.isFollowed = isFollowed;
  hears_ = 1.0;
  addExcitation(drive, everywhere);
}

void ModalExciter::move(const Motion& motion, std::span<const View> views, const Source& source) {
  const ResonatorSet& set = *source.resonators;
  powers_.assign(set.modes, 0.0);
  for (const View& view : views) {
    findTransfers(view.route, source, view.orientation);
    for (std::size_t mode = 0; mode < set.modes; ++mode)
      powers_[mode] += std::norm(amplitudes_[mode]);
  }
  if (views.size() > 1)
    for (std::size_t mode = 0; mode < set.modes; ++mode)
      amplitudes_[mode] = std::sqrt(powers_[mode]);
  ModalExcitation excitation;
  excitation.drive.first = motion.first;
  excitation.drive.channel = motion.channel;
  excitation.body = motion.body;
  excitation.resonators = &set;
  excitation.count = set.padded;
  excitation.path = motion.path;
  excitation.length = motion.length;
  excitation.rate = motion.rate;
  taps_.assign(2 * set.padded, 0.0);
  putFactors(source, taps_);
  excitations_.assign(1, excitation);
}

/// Puts amplitudes_ against the means, real parts before imaginary ones.
void ModalExciter::putFactors(const Source& source, std::span<double> taps) const {
  for (std::size_t mode = 0; mode < amplitudes_.size(); ++mode) {
    const Complex factor = amplitudes_[mode] / source.means[mode];
    taps[mode] = factor.real();
    taps[taps.size() / 2 + mode] = factor.imag();
  }
}

double ModalExciter::longestRing() const {
  const double silence = ModalBank::silence(paths_->settings);
  double longest = 0.0;
  for (std::size_t mode = 0; mode < loudest_.size(); ++mode) {
    const double decay = -source_->resonators->pole[mode].real();
    longest = std::max(longest, std::log(std::max(loudest_[mode] / silence, 1.0)) / decay);
  }
  return std::isfinite(longest) ? longest : kForever;
}

double ModalExciter::longestRingAnywhere() {
  const std::vector<double> heard = loudest_;
  for (std::size_t mode = 0; mode < loudest_.size(); ++mode)
    boundRing(mode, source_->means[mode]);
  const double longest = longestRing();
  loudest_ = heard;
  return longest;
}

/// Returns how a mode of the event is tuned while it is driven, at a rate of the body's time.
ModalExciter::Tuning ModalExciter::tuningOf(std::size_t mode, double rate) const {
  const ResonatorSet& set = *source_->resonators;
  const Complex pole = set.pole[mode] * rate / paths_->settings.sampleRate;
  const Complex step = std::exp(pole);
  if (rate == 1.0) return {step, set.a1[mode], set.dimming[mode]};
  const bool isSpread = paths_->settings.comparison.sampling == Sampling::bandLimited;
  return {step, 2.0 * step.real(), isSpread ? spreadTransform(pole) : 1.0};
}

/// Turns amplitudes_, transfers so far, into the taps of resonators.
///
/// After a unit impulse at time 0, q'' = delta(t) e + Re(-i s^2 e / w exp(s t)), where s is the
/// pole, w its imaginary part and e the excitation. Each resonator is the second term's samples;
/// the first, which keeps q'' still where the pulse is much longer than the period, is in the rest.
void ModalExciter::addExcitation(const Click& drive, const ModalRoute& route) {
  const ResonatorSet& set = *source_->resonators;
  ModalExcitation excitation;
  excitation.drive = drive;
  excitation.drive.first -= static_cast<std::int64_t>(kRestReach);
  excitation.drive.track.start += static_cast<double>(kRestReach);
  excitation.drive.samples += static_cast<std::uint32_t>(2 * kRestReach);
  excitation.body = body_;
  excitation.resonators = &set;
  excitation.count = set.padded;
  excitation.taps = taps_.size();
  excitation.isFollowed = route.isFollowed;
  excitation.path = route.path;
  excitation.rate = route.rate;
  taps_.resize(taps_.size() + excitation.arrays() * set.padded, 0.0);
  const std::span<double> b0 = std::span(taps_).subspan(excitation.taps, set.padded);
  const std::span<double> b1 = std::span(taps_).subspan(excitation.taps + set.padded, set.padded);
  if (excitation.isFollowed)
    putFactors(*source_, std::span(taps_).subspan(excitation.taps + 2 * set.padded));
  for (std::size_t mode = 0; mode < set.modes; ++mode) {
    const Complex pole = set.pole[mode];
    const Complex heard =
        Complex(0.0, -1.0) * pole * pole * excitation_[mode] / pole.imag() * amplitudes_[mode];
    loudest_[mode] = std::max(loudest_[mode], std::abs(heard));
    const Tuning tuning = tuningOf(mode, route.rate);
    const Complex amplitude = heard / tuning.dimming;
    b0[mode] = amplitude.real();
    b1[mode] = (amplitude * tuning.step).real() - tuning.a1 * b0[mode];
    for (std::size_t tap = 0; tap < excitation.rest.size(); ++tap)
      excitation.rest[tap] += (heard * set.rest[mode][tap]).real() / route.rate;
  }
  addResidual(excitation.rest);
  excitations_.push_back(excitation);
}

bool ModalExciter::updateContact(const DampingContact& contact, const Source& source,
                                 std::int64_t first) {
  excitations_.clear();
  taps_.clear();
  const std::pair key(contact.body, contact.other);
  const auto known = dampers_.find(key);
  if (!(contact.stiffness > 0.0)) {
    if (known == dampers_.end()) return false;
    dampers_.erase(known);
  } else {
    Damper& now = dampers_[key];
    const double ratio = contact.stiffness / now.stiffness;
    const bool isNew = now.modes != source.resonators ||
                       !(ratio > 1.0 / kNewStiffness && ratio < kNewStiffness) ||
                       (contact.point - now.point).norm() > kMoved * source.radius;
    if (!isNew) return false;
    now = {source.resonators, contact.stiffness, contact.point, contact.place,
           ratesOf(contact, source, paths_->settings.contactLoss)};
  }
  addDamping(contact.body, *source.resonators, first);
  return true;
}

std::vector<ModalExciter::Damped> ModalExciter::forgetContacts(BodyId body) {
  std::vector<Damped> damped;
  std::erase_if(dampers_, [&](const auto& entry) {
    const auto [one, other] = entry.first;
    if (one != body && other != body) return false;
    if (damped.empty() || damped.back().body != one) damped.push_back({one, entry.second.place});
    return true;
  });
  return damped;
}

void ModalExciter::undamp(BodyId body, const ResonatorSet& set, std::int64_t first) {
  excitations_.clear();
  taps_.clear();
  addDamping(body, set, first);
}

std::span<const double> ModalExciter::addedDamping(BodyId body, const ResonatorSet& set) {
  added_.clear();
  for (auto at = dampers_.lower_bound({body, 0}); at != dampers_.end(); ++at) {
    if (at->first.first != body) break;
    if (at->second.modes != &set) continue;
    const std::vector<double>& rates = at->second.rates;
    added_.resize(std::max(added_.size(), rates.size()), 0.0);
    for (std::size_t mode = 0; mode < rates.size(); ++mode)
      added_[mode] += rates[mode];
  }
  return added_;
}

void ModalExciter::addDamping(BodyId body, const ResonatorSet& set, std::int64_t first) {
  // A bank takes changes of one sample in any order: the last one has to come last.
  const auto [change, isFirst] = lastChanges_.try_emplace(body, first);
  std::int64_t& last = change->second;
  if (!isFirst) last = std::max(last + 1, first);
  ModalExcitation excitation;
  excitation.drive.first = last;
  excitation.body = body;
  excitation.resonators = &set;
  excitation.count = set.padded;
  taps_.assign(2 * set.padded, 0.0);
  const double rate = paths_->settings.sampleRate;
  const std::span<const double> added = addedDamping(body, set);
  for (std::size_t mode = 0; mode < set.modes; ++mode) {
    const double free = -set.pole[mode].real();
    double decay = free + (mode < added.size() ? added[mode] : 0.0);
    // A mode may have lost more than that by itself.
    const double most = std::max(free, kMostDamping * set.pole[mode].imag());
    if (!(decay < most)) decay = most;  // also where it is no number
    const TwoPole two = TwoPole::of(set.pole[mode].imag(), decay, rate);
    taps_[mode] = two.a1;
    taps_[set.padded + mode] = two.a2;
  }
  excitations_.push_back(excitation);
}

double ModalExciter::peak(const Pulse& pulse, double duration) {
  const PulseSpectrum& spectrum = spectra_.try_emplace(&pulse, pulse).first->second;
  const double mostInASample = pulse.peakForce() / (duration * paths_->settings.sampleRate);
  double sum = loudestRest_ * std::min(mostInASample, 1.0);
  for (std::size_t mode = 0; mode < loudest_.size(); ++mode)
    sum += loudest_[mode] * spectrum.bound(source_->resonators->pole[mode].imag() * duration);
  return sum;
}

double ModalExciter::loudness(const Force& force) {
  const PulseSpectrum& spectrum = spectra_.try_emplace(&force.pulse, force.pulse).first->second;
  driven_.clear();
  for (std::size_t mode = 0; mode < loudest_.size(); ++mode) {
    const double bound = spectrum.bound(source_->resonators->pole[mode].imag() * force.touch);
    driven_.emplace_back(loudest_[mode] * bound, mode);
  }
  const std::size_t exact = force.nodes.empty() ? 0 : std::min(kExactModes, driven_.size());
  std::ranges::partial_sort(driven_, driven_.begin() + static_cast<std::ptrdiff_t>(exact),
                            std::ranges::greater());
  const double duration = force.nodes.empty() ? force.touch : force.duration;
  const double strongest =
      std::min(force.pulse.peakForce() / duration, paths_->settings.sampleRate);
  double ringing = 0.0;
  double pushed = 0.0;
  for (std::size_t i = 0; i < driven_.size(); ++i) {
    const auto [bound, mode] = driven_[i];
    const double w = source_->resonators->pole[mode].imag();
    const double turn = w * duration;
    const bool isExact = i < exact && bound >= kCounts * driven_.front().first;
    const double level =
        isExact ? loudest_[mode] * std::abs(transformOf(force.nodes, turn)) : bound;
    ringing += level * level;
    // A force accelerates a mode until its stiffness holds it, after a part of the period.
    const double push = loudest_[mode] / w * strongest / (1.0 + turn * turn / kHolding);
    pushed += push * push;
  }
  const double rest = loudestRest_ * strongest / paths_->settings.sampleRate;
  return std::sqrt(std::max(2.0 * ringing, pushed)) + rest;
}

double ModalExciter::peak(std::span<const PulseNode> train) const {
  double impulses = 0.0;
  for (const PulseNode& node : train)
    impulses += std::abs(node.weight);
  return impulses * std::accumulate(loudest_.begin(), loudest_.end(), loudestRest_);
}

}  // namespace carom::audio
