#include "audio/synth.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "audio/acceleration_noise.h"
#include "audio/click_bus.h"
#include "audio/click_kernels.h"
#include "audio/click_queue.h"
#include "audio/hertz.h"
#include "audio/hrtf.h"
#include "audio/long_pulse.h"
#include "audio/radiation_bank.h"
#include "audio/receiver.h"
#include "audio/spread_kernel.h"

namespace carom {
namespace {

/// Frames summed in double before they are handed on: small enough to stay in the first cache.
constexpr std::size_t kMixFrames = ClickBus::kMaxFrames;
/// Shorter contacts alias if they are sampled naively; docs/acceleration_noise.md has the error.
constexpr double kWellSampled = 4.0;
constexpr double kLowestRate = 8000.0;
constexpr double kHighestRate = 192000.0;
/// Beyond this index a double, and so a time, skips whole samples: 5900 years at 48 kHz.
constexpr double kExactSamples = 0x1.0p+53;
/// Half the reach of the kernel that puts instants on samples.
constexpr auto kReach = static_cast<std::int64_t>(kSpreadWidth / 2);
/// s. A longer contact has nothing in the audible band, and would take memory without end.
constexpr double kLongestContact = 20.0;
/// Dissipative pulses are made for so many restitutions as they come, and then only in steps.
constexpr std::size_t kMostRestitutions = 256;
constexpr double kFewRestitutions = 64.0;
/// Nodes; see chooseRule.
constexpr std::size_t kLargestGaussRule = 48;
/// By how much motion may stretch a click in time; beyond, it is that of bodies at rest.
constexpr double kLeastStretch = 0.1;
constexpr double kMostStretch = 10.0;
/// A set of head-related responses may be louder than the free field by that, at some frequency.
constexpr double kLoudestEar = 4.0;
/// A diffuse field's peaks over the root of its mean square.
constexpr double kTailPeaks = 4.0;

bool isPositive(double value) {
  return std::isfinite(value) && value > 0.0;
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

// Edges are blunt, and two flat faces touch first where they are not flat.
ImpulseEvent blunted(ImpulseEvent event, const SoundBody& body, const SoundBody& other) {
  const bool flat = std::isinf(event.radius) && std::isinf(event.otherRadius);
  if (event.radius == 0.0 || flat) event.radius = body.edgeRadius;
  if (event.otherRadius == 0.0 || flat) event.otherRadius = other.edgeRadius;
  return event;
}

std::string whyNot(const Material& material) {
  if (!isPositive(material.density)) return "density must be positive (kg/m^3)";
  if (!isPositive(material.youngsModulus)) return "Young's modulus must be positive (Pa)";
  if (!(material.poissonsRatio >= 0.0 && material.poissonsRatio < 0.5))
    return "Poisson's ratio must be at least 0 and below 0.5";
  if (!(material.restitution >= 0.0 && material.restitution <= 1.0))
    return "restitution must be from 0 to 1";
  return {};
}

std::string whyNot(const SoundBody& body) {
  if (std::string reason = whyNot(body.material); !reason.empty())
    return "material '" + body.material.name + "': " + reason;
  if (!(body.mass > 0.0)) return "mass must be positive (kg), infinite for an immovable body";
  if (std::isfinite(body.mass) && !isPositive(body.shape ? body.shape->radius() : body.radius))
    return "radius must be positive (m) for a body that can move";
  if (!body.inverseInertia.allFinite()) return "inverse inertia must be finite (1/(kg m^2))";
  if (!isPositive(body.edgeRadius)) return "edge radius must be positive (m)";
  return {};
}

std::string whyNot(const SynthSettings& settings, const std::vector<Listener>& listeners) {
  if (!(settings.sampleRate >= kLowestRate && settings.sampleRate <= kHighestRate))
    return "sample rate " + std::to_string(settings.sampleRate) +
           " Hz is out of range: 8000 to 192000 Hz";
  if (!isPositive(settings.medium.density)) return "density of the medium must be positive";
  if (!isPositive(settings.medium.speedOfSound)) return "speed of sound must be positive";
  if (!(std::isfinite(settings.audibleThreshold) && settings.audibleThreshold >= 0.0))
    return "audible threshold must be a finite pressure of at least 0 Pa";
  if (listeners.empty()) return "there is no listener: at least one is needed";
  for (std::size_t index = 0; index < listeners.size(); ++index) {
    if (const std::string reason = whyNot(listeners[index]); !reason.empty())
      return "listener " + std::to_string(index) + " ('" + listeners[index].name + "'): " + reason;
  }
  return {};
}

/// What a product of two numbers has lost (Dekker 1971): exact, below 1e290.
double roundingOf(double a, double b, double product) {
  constexpr double kSplit = 0x1.0p+27 + 1.0;
  const double a1 = kSplit * a - (kSplit * a - a);
  const double b1 = kSplit * b - (kSplit * b - b);
  const double a2 = a - a1;
  const double b2 = b - b1;
  return ((a1 * b1 - product) + a1 * b2 + a2 * b1) + a2 * b2;
}

/// Asks for what will be read soon.
template <class T>
void prefetch(const T& object) {
#if defined(__GNUC__)
  const auto* bytes = reinterpret_cast<const std::byte*>(&object);
  for (std::size_t at = 0; at < sizeof(T); at += 64)
    __builtin_prefetch(bytes + at);
#else
  static_cast<void>(object);
#endif
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

/// s, of an ear's response against that of the middle of the head.
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

class Synth::Impl {
 public:
  Impl(const SynthSettings& settings, std::vector<Listener> listeners);

  Status prepare();
  Status setBody(BodyId id, const SoundBody& body);
  Status moveListener(std::size_t listener, const ListenerPose& pose);
  void schedule(const ImpulseEvent& event);
  template <class Sample>
  void render(std::span<Sample* const> channels, std::size_t frames) noexcept;
  Status seek(double seconds);
  double time() const { return static_cast<double>(position_) / settings_.sampleRate; }
  double leadTime(double contactDuration) const;
  double contactDuration(const ImpulseEvent& event) const;
  bool isSilent() const;

  const std::vector<Listener>& listeners() const { return listeners_; }
  std::size_t channelCount() const { return channels_.size(); }
  const SynthCounters& counters() const { return counters_; }
  std::size_t pendingClicks() const { return waiting_.size(); }

 private:
  struct Body {
    SoundBody sound;
    const RadiationBank::Mix* filters = nullptr;
  };
  struct Channel {
    std::uint32_t listener = 0;
    Receiver receiver;
    Vec3 place = Vec3::Zero();  // m, world frame, as long as the listener stands
    Ear ear = Ear::left;        // of a binaural listener
    bool isEar = false;
  };
  struct Path {
    const Image* image = nullptr;  // null: direct
    std::uint32_t chain = 0;       // of wall filters
  };
  /// A contact that loses energy.
  struct Lossy {
    Pulse pulse;
    double stretch = 1.0;  // of its duration over the elastic one's
  };
  /// What the clicks of one event have in common.
  struct Contact {
    double time = 0.0;      // s
    double duration = 0.0;  // s
    const Pulse* pulse = nullptr;
    Strike strike;
    double ahead = 0.0;  // m: the sound starts at the surface, and the filter lets it wait
    const RadiationBank::Mix* filters = nullptr;
  };
  /// The way of a contact's sound to one receiver, at its begin, middle and end.
  struct Way {
    std::array<double, 3> delays{};  // s
    std::array<double, 3> gains{};   // Pa s^2: of the slope of a force of integral 1
    double distance = 0.0;           // m, in the middle, not below the body's radius
    double stretch = 1.0;            // of time, in the middle, by the receiver's own motion
    SphereWeights ears;              // where a binaural channel hears it from
  };
  /// A click on its way, laid over the samples of its bus. Two lines of the cache: many wait.
  struct alignas(64) Click {
    std::int64_t first = 0;  // sample of the bus
    ClickTrack track;        // from that sample on
    double near = 0.0;       // weight of near over far
    const Pulse* pulse = nullptr;
    std::span<const PulseNode> nodes;  // empty: it is long
    const RadiationBank::Mix* filters = nullptr;
    std::array<std::uint32_t, 4> buses{};  // one for each filter
    std::uint32_t chain = 0;
    std::uint32_t channel = 0;
    std::uint32_t samples = 0;
  };
  struct Bus {
    ClickBus line;
    std::uint64_t key = 0;
    std::uint32_t pending = 0;  // clicks that wait for it
  };

  Status prepareListeners();
  Status prepareRoom();
  const RadiationBank::Mix& filtersOf(double radius);
  const Body* findBody(BodyId id) const;
  double restitutionOf(const ImpulseEvent& event) const;
  const Pulse& pulseOf(const ImpulseEvent& event) const;
  const Lossy& lossyOf(const ImpulseEvent& event) const;
  void scheduleImpulse(const ImpulseEvent& event);
  bool layClicks(const Contact& contact);
  Arrival arrivalAt(const Channel& channel, double time, const Vec3& from) const;
  bool findWay(const Contact& contact, const Channel& channel, const Image* image, Way& way) const;
  bool layClick(const Contact& contact, const Way& way, std::uint32_t chain, std::uint32_t channel);
  void chooseRule(Click& click) const;
  bool isFiltered() const;
  double boundOf(const Contact& contact, const Way& way) const;
  double tailOver(const Contact& contact) const;
  void countTiming(double duration);
  void enqueueClicks();
  std::uint64_t keyOf(std::uint32_t filter, std::uint32_t chain, std::uint32_t channel) const;
  std::uint32_t busOf(std::uint64_t key);
  std::uint32_t idleBus();
  bool isEarlier(const ClickQueue::Entry& a, const ClickQueue::Entry& b) const;
  void beginUntil(std::int64_t end) noexcept;
  void begin(std::uint32_t slot) noexcept;
  std::span<const double> samplesOf(const Click& click) noexcept;
  void mix(std::size_t frames) noexcept;
  void reverberate(std::size_t frames) noexcept;

  SynthSettings settings_;
  std::vector<Listener> listeners_;
  std::vector<PoseTrack> tracks_;  // one per listener
  std::vector<bool> hasMoved_;     // likewise: a pose has come
  std::vector<Channel> channels_;
  double earliestEar_ = 0.0;  // s before the middle of its head, no ear hears anything earlier
  std::unordered_map<BodyId, Body> bodies_;
  SynthCounters counters_;

  RadiationBank filters_;
  std::vector<Image> images_;
  std::vector<std::vector<ReflectionFilter>> chains_;  // the first is empty: the direct path
  std::vector<Path> paths_;                            // the first is direct
  mutable std::unordered_map<double, Lossy> lossy_;    // by restitution, made when first needed

  const ClickKernels& kernels_ = fastestKernels();
  std::int64_t position_ = 0;            // the next sample to be rendered
  std::vector<Click> laid_;              // of the event in hand
  double peak_ = 0.0;                    // Pa, a bound for them
  std::vector<Click> clicks_;            // by slot
  std::vector<SphereWeights> ears_;      // likewise, where there is a head
  std::vector<SphereWeights> laidEars_;  // of laid_
  bool hasHeads_ = false;
  std::vector<std::uint32_t> freeSlots_;
  ClickQueue waiting_;
  std::vector<Bus> buses_;
  std::vector<std::uint32_t> busOrder_;  // all, by key: the order in which they are summed
  std::unordered_map<std::uint64_t, std::uint32_t> busOfKey_;
  std::size_t idleCursor_ = 0;   // where the search for a bus that nobody needs goes on
  std::vector<Reverb> reverbs_;  // one per listener, or none
  std::size_t mostSamples_ = 0;  // of any click so far, its ears' responses included

  PlacedNodes placed_;
  Raster raster_;
  std::vector<double> x_;         // a click's samples, zeros in front for the response
  std::vector<double> response_;  // of an ear
  std::vector<double> heard_;     // the samples through it
  std::vector<double> mix_;       // Pa, kMixFrames per channel, planar
  std::vector<double> send_;      // Pa at 1 m, into the reverberation
};

Synth::Impl::Impl(const SynthSettings& settings, std::vector<Listener> listeners)
    : settings_(settings),
      listeners_(std::move(listeners)),
      filters_(settings.sampling == Sampling::bandLimited ? RadiationFilter::Input::spread
                                                          : RadiationFilter::Input::bare),
      send_(kMixFrames) {}

Status Synth::Impl::prepare() {
  if (Status listeners = prepareListeners(); !listeners) return listeners;
  if (Status room = prepareRoom(); !room) return room;
  mix_.resize(kMixFrames * channels_.size());
  SpreadTable::instance();  // not while rendering
  return std::monostate{};
}

Status Synth::Impl::prepareListeners() {
  std::size_t longest = 0;
  for (std::size_t index = 0; index < listeners_.size(); ++index) {
    Listener& listener = listeners_[index];
    const bool binaural = listener.format == ListenerFormat::binaural;
    if (binaural && listener.hrtf == nullptr) {
      auto set = defaultHrtf(settings_.sampleRate);
      if (!set) return Error{"listener '" + listener.name + "': " + set.error().message};
      listener.hrtf = *set;
    }
    if (binaural && listener.hrtf->sampleRate() != settings_.sampleRate)
      return Error{"listener '" + listener.name + "': its head-related responses are for " +
                   std::to_string(listener.hrtf->sampleRate()) + " Hz, not " +
                   std::to_string(settings_.sampleRate) + " Hz"};
    if (binaural) {
      hasHeads_ = true;
      longest = std::max(longest, listener.hrtf->alignedLength());
      earliestEar_ = std::max(earliestEar_, listener.hrtf->latency());
    }
    tracks_.emplace_back(ListenerPose{0.0, listener.position, listener.orientation});
    hasMoved_.push_back(false);
    const Receivers receivers = receiversOf(listener);
    for (std::size_t i = 0; i < receivers.size(); ++i) {
      channels_.push_back({.listener = static_cast<std::uint32_t>(index),
                           .receiver = receivers[i],
                           .place = listener.position + listener.orientation * receivers[i].offset,
                           .ear = i == 0 ? Ear::left : Ear::right,
                           .isEar = binaural});
    }
  }
  response_.resize(longest);
  return std::monostate{};
}

Status Synth::Impl::prepareRoom() {
  chains_.emplace_back();
  paths_.emplace_back();
  if (!settings_.room.reflectors.empty()) {
    Result<std::vector<Image>> images = makeImages(settings_.room);
    if (!images) return Error{"room: " + images.error().message};
    images_ = *std::move(images);
  }
  for (const Image& image : images_) {
    std::vector<ReflectionFilter> chain;
    for (const std::size_t wall : image.reflectors)
      chain.push_back(
          reflectionFilter(settings_.room.reflectors[wall].absorption, settings_.sampleRate));
    std::ranges::sort(chain, {},
                      [](const ReflectionFilter& f) { return std::tie(f.b0, f.b1, f.a1); });
    // Paths over walls that reflect alike share their filters.
    const auto same = std::ranges::find_if(chains_, [&](const auto& other) {
      return std::ranges::equal(chain, other, [](const auto& f, const auto& g) {
        return std::tie(f.b0, f.b1, f.a1) == std::tie(g.b0, g.b1, g.a1);
      });
    });
    paths_.push_back({&image, static_cast<std::uint32_t>(same - chains_.begin())});
    if (same == chains_.end()) chains_.push_back(std::move(chain));
  }
  if (!settings_.reverb) return std::monostate{};
  for (const Listener& listener : listeners_) {
    Result<Reverb> reverb =
        Reverb::create(*settings_.reverb, settings_.sampleRate, carom::channelCount(listener));
    if (!reverb) return Error{"reverberation: " + reverb.error().message};
    reverbs_.push_back(*std::move(reverb));
  }
  return std::monostate{};
}

Status Synth::Impl::setBody(BodyId id, const SoundBody& body) {
  if (const std::string reason = whyNot(body); !reason.empty())
    return Error{"sound body " + std::to_string(id) + ": " + reason};
  Body known{body, nullptr};
  if (std::isfinite(body.mass))
    known.filters = &filtersOf(body.shape ? body.shape->radius() : body.radius);
  bodies_.insert_or_assign(id, std::move(known));
  return std::monostate{};
}

/// The compact model has one for all.
const RadiationBank::Mix& Synth::Impl::filtersOf(double radius) {
  if (settings_.radiation == Radiation::compact)
    return filters_.mixOf(std::numeric_limits<double>::infinity());
  return filters_.mixOf(settings_.medium.speedOfSound /
                        (std::min(radius, kLargestRadius) * settings_.sampleRate));
}

Status Synth::Impl::moveListener(std::size_t listener, const ListenerPose& pose) {
  if (listener >= listeners_.size())
    return Error{"synth: there is no listener " + std::to_string(listener) + "; there are " +
                 std::to_string(listeners_.size())};
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

const Synth::Impl::Body* Synth::Impl::findBody(BodyId id) const {
  const auto entry = bodies_.find(id);
  return entry == bodies_.end() ? nullptr : &entry->second;
}

double Synth::Impl::restitutionOf(const ImpulseEvent& event) const {
  const double bounce = event.impulse.norm() / (event.effectiveMass * event.approachSpeed) - 1.0;
  return std::clamp(bounce, kLowestRestitution, 1.0);
}

const Pulse& Synth::Impl::pulseOf(const ImpulseEvent& event) const {
  return settings_.dissipative ? lossyOf(event).pulse : Pulse::of(settings_.pulse);
}

/// Made once for each restitution that there is, and beyond many of them for the nearest of a few.
const Synth::Impl::Lossy& Synth::Impl::lossyOf(const ImpulseEvent& event) const {
  double restitution = restitutionOf(event);
  if (lossy_.size() >= kMostRestitutions && !lossy_.contains(restitution))
    restitution = std::round(restitution * kFewRestitutions) / kFewRestitutions;
  if (const auto known = lossy_.find(restitution); known != lossy_.end()) return known->second;
  Lossy made{Pulse::dissipativeHertz(restitution), dissipativeDuration(restitution)};
  return lossy_.emplace(restitution, std::move(made)).first->second;
}

double Synth::Impl::contactDuration(const ImpulseEvent& event) const {
  const Body* body = findBody(event.body);
  const Body* other = findBody(event.other);
  if (body == nullptr || other == nullptr || !isContact(event)) return 0.0;
  const double elastic = hertzDuration(blunted(event, body->sound, other->sound),
                                       body->sound.material, other->sound.material);
  return settings_.dissipative ? elastic * lossyOf(event).stretch : elastic;
}

double Synth::Impl::leadTime(double contactDuration) const {
  const double pulse = -Pulse::of(settings_.pulse).begin() * contactDuration;
  // The whole samples that the pulse falls between, too.
  const auto filter = static_cast<double>(kReach - RadiationFilter::kFirstTap + 2);
  return pulse + filter / settings_.sampleRate + earliestEar_;
}

void Synth::Impl::schedule(const ImpulseEvent& event) {
  if (settings_.impulse == ImpulseChoice::applied && event.hasAppliedImpulse) {
    ImpulseEvent applied = event;
    applied.impulse = event.appliedImpulse;
    scheduleImpulse(applied);
  } else {
    scheduleImpulse(event);
  }
}

void Synth::Impl::scheduleImpulse(const ImpulseEvent& event) {
  const double duration = isFinite(event) ? contactDuration(event) : 0.0;
  if (!isPositive(duration)) {
    ++counters_.rejected;
    return;
  }
  const Body& body = *findBody(event.body);
  if (std::isinf(body.sound.mass)) {
    ++counters_.immovable;
    return;
  }
  const bool exact = settings_.radiation == Radiation::exact;
  Contact contact{.time = event.time,
                  .duration = duration,
                  .pulse = &pulseOf(event),
                  .strike = makeStrike(event, body.sound, settings_.medium),
                  .filters = body.filters};
  if (exact) contact.ahead = std::min(contact.strike.radius, kLargestRadius);
  if (!layClicks(contact)) {
    ++counters_.rejected;
    return;
  }
  ++counters_.events;
  countTiming(duration);
  if (peak_ > 0.0 && peak_ >= settings_.audibleThreshold)
    enqueueClicks();
  else
    ++counters_.inaudible;
}

/// False where numbers so large came together that a click cannot be placed on the clock.
bool Synth::Impl::layClicks(const Contact& contact) {
  laid_.clear();
  laidEars_.clear();
  peak_ = 0.0;
  for (std::uint32_t channel = 0; channel < channels_.size(); ++channel) {
    for (const Path& path : paths_) {
      Way way;
      if (!findWay(contact, channels_[channel], path.image, way)) continue;
      const double ear = channels_[channel].isEar ? kLoudestEar : 1.0;
      peak_ = std::max(peak_, ear * boundOf(contact, way));
      if (!layClick(contact, way, path.chain, channel)) return false;
    }
  }
  if (reverbs_.empty()) return true;
  // What the room gets: the mean over all directions, at 1 m, without the near field, which carries
  // no power.
  Way send;
  send.gains.fill(contact.strike.dipole.norm() / std::numbers::sqrt3);
  send.distance = std::numeric_limits<double>::infinity();
  peak_ = std::max(peak_, boundOf(contact, send) * tailOver(contact));
  return layClick(contact, send, 0, static_cast<std::uint32_t>(channels_.size()));
}

/// False where a wall is in the way.
bool Synth::Impl::findWay(const Contact& contact, const Channel& channel, const Image* image,
                          Way& way) const {
  const Strike& strike = contact.strike;
  const Vec3 dipole = image != nullptr ? image->vector(strike.dipole) : strike.dipole;
  const Vec3 velocity = image != nullptr ? image->vector(strike.velocity) : strike.velocity;
  const Vec3 from = image != nullptr ? image->position(strike.position) : strike.position;
  for (const std::size_t part : {0u, 1u, 2u}) {
    if (part > 0 && !settings_.doppler) {
      way.delays[part] = way.delays[0];
      way.gains[part] = way.gains[0];
      continue;
    }
    const double later = 0.5 * static_cast<double>(part) * contact.duration;
    const Arrival arrival = arrivalAt(channel, contact.time + later, from + later * velocity);
    if (part == 0 && image != nullptr) {
      const Vec3 ear = from - arrival.distance * arrival.towardsSource;
      if (!isVisible(settings_.room, *image, strike.position, ear)) return false;
    }
    const double distance = std::max(arrival.distance, strike.radius);
    if (part < 2) way.distance = distance;
    way.gains[part] = -dipole.dot(arrival.towardsSource) / distance;
    way.delays[part] = (distance - contact.ahead) / settings_.medium.speedOfSound;
    if (channel.isEar) {
      const HrtfSet& set = *listeners_[channel.listener].hrtf;
      const SphereWeights ears =
          set.lookup(arrival.orientation.conjugate() * arrival.towardsSource);
      if (part == 0) way.ears = ears;
      way.delays[part] += earDelay(set, ears, channel.ear);
    } else if (channel.receiver.pattern != 0.0) {
      way.gains[part] *= gain(channel.receiver, arrival.orientation, arrival.towardsSource);
    }
    if (!settings_.doppler) continue;
    // A click is stretched as it is laid, and its force keeps its integral: as for a body that
    // moves. Who moves through a field hears the pressure that is there, only faster or slower.
    const bool overtaken = !(arrival.stretch > kLeastStretch && arrival.stretch < kMostStretch);
    const double stretch = overtaken ? 1.0 : arrival.stretch;
    way.gains[part] *= stretch * stretch;
    if (part < 2) way.stretch = stretch;  // the middle's
  }
  return true;
}

/// Where the wave that leaves `from` at `time` is heard. A listener that stands needs no solving.
Arrival Synth::Impl::arrivalAt(const Channel& channel, double time, const Vec3& from) const {
  if (hasMoved_[channel.listener]) {
    return arrivalOf(tracks_[channel.listener], {.time = time, .position = from},
                     settings_.medium.speedOfSound, channel.receiver.offset);
  }
  Arrival arrival;
  const Vec3 towards = from - channel.place;
  arrival.distance = towards.norm();
  if (arrival.distance > 0.0) arrival.towardsSource = towards / arrival.distance;
  arrival.orientation = listeners_[channel.listener].orientation;
  return arrival;
}

/// An upper bound, in Pa: of the pulse's slope, of what the band holds of it, and of what a body of
/// that size lets through (its response's total variation is 1.35 c/a).
double Synth::Impl::boundOf(const Contact& contact, const Way& way) const {
  const double rate = settings_.sampleRate;
  const bool naive = settings_.sampling == Sampling::naive;
  const double inBand = std::numbers::pi * (naive ? 1e6 : 0.5);
  const double force = std::min(contact.pulse->peakForce() / contact.duration, inBand * rate);
  double slope = std::min(contact.pulse->peakSlope() / (contact.duration * contact.duration),
                          inBand * rate * rate);
  if (settings_.radiation == Radiation::exact) {
    const double corner = settings_.medium.speedOfSound / contact.strike.radius;
    slope = std::min(1.1 * slope, 1.35 * corner * force);
    slope += 1.1 * force * settings_.medium.speedOfSound / way.distance;
  }
  const double gain =
      std::max({std::abs(way.gains[0]), std::abs(way.gains[1]), std::abs(way.gains[2])});
  return gain * slope;
}

/// The peak of the tail over that of what is sent: the diffuse field's level (Reverb) for a click
/// that is at its peak while it lasts, and its peaks over its level.
double Synth::Impl::tailOver(const Contact& contact) const {
  const ReverbSettings& reverb = *settings_.reverb;
  const double lasting =
      (contact.pulse->end() - contact.pulse->begin()) * contact.duration +
      static_cast<double>(kSpreadWidth + RadiationFilter::kTaps) / settings_.sampleRate +
      5.0 * contact.strike.radius / settings_.medium.speedOfSound;
  const double density = 4.0 * std::numbers::pi * reverb.speedOfSound / reverb.volume;  // 1/s
  return reverb.gain * kTailPeaks * std::sqrt(density * lasting);
}

bool Synth::Impl::layClick(const Contact& contact, const Way& way, std::uint32_t chain,
                           std::uint32_t channel) {
  const double rate = settings_.sampleRate;
  const double extent = std::abs(contact.time) + way.delays[0] + way.delays[2] +
                        (contact.pulse->end() - contact.pulse->begin()) * contact.duration;
  const double loudness = (std::abs(way.gains[0]) + std::abs(way.gains[2])) * rate * rate;
  const bool isFar = !(extent * rate < kExactSamples);
  const bool isLong = !(contact.duration <= kLongestContact);
  if (isFar || isLong || !std::isfinite(loudness)) return false;
  if (loudness == 0.0 && way.gains[1] == 0.0) return true;

  Click click;
  click.pulse = contact.pulse;
  const SampleTime start = carom::samplesOf(contact.time, way.delays[0], rate);
  const Parabola delay(0.0, way.delays[1] - way.delays[0], way.delays[2] - way.delays[0]);
  const Parabola gain(way.gains[0], way.gains[1], way.gains[2]);
  click.track = {.start = start.fraction,
                 .length = (contact.duration + delay.slope) * rate,
                 .bend = delay.curve * rate,
                 .gain = gain.at0 * rate * rate,
                 .slope = gain.slope * rate * rate,
                 .curve = gain.curve * rate * rate};
  const double still = contact.duration * rate;
  // Faster than sound, or nearly: time would fold.
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
  click.first = start.whole + first + (isFiltered() ? RadiationFilter::kFirstTap : 0);
  click.near = settings_.medium.speedOfSound / (way.distance * way.stretch * rate);
  click.channel = channel;
  click.filters = contact.filters;
  click.chain = chain;
  if (settings_.sampling == Sampling::bandLimited) chooseRule(click);
  laid_.push_back(click);
  if (hasHeads_) laidEars_.push_back(way.ears);
  return true;
}

/// Of the Gauss rules the smallest that is right up to the sample rate, beyond which the kernel is
/// dark. What they get wrong there grows with their size; long contacts are better off without.
void Synth::Impl::chooseRule(Click& click) const {
  const double bandwidth = 2.0 * std::numbers::pi * click.track.length;
  const std::size_t size = click.pulse->ruleSize(bandwidth);
  if (size > 0 && size <= kLargestGaussRule) click.nodes = click.pulse->rule(size);
}

/// Whether pulses are put in as force, for RadiationFilter, or as pressure.
bool Synth::Impl::isFiltered() const {
  return settings_.sampling == Sampling::bandLimited || settings_.radiation == Radiation::exact;
}

void Synth::Impl::countTiming(double duration) {
  const auto begun = [this](const Click& click) { return click.first < position_; };
  if (std::ranges::any_of(laid_, begun)) ++counters_.late;
  if (settings_.sampling == Sampling::naive && duration * settings_.sampleRate < kWellSampled)
    ++counters_.undersampled;
}

std::uint64_t Synth::Impl::keyOf(std::uint32_t filter, std::uint32_t chain,
                                 std::uint32_t channel) const {
  return (static_cast<std::uint64_t>(filter) * chains_.size() + chain) * (channels_.size() + 1) +
         channel;
}

void Synth::Impl::enqueueClicks() {
  for (std::size_t index = 0; index < laid_.size(); ++index) {
    const Click& click = laid_[index];
    const std::size_t room = click.samples + response_.size();
    const auto oldest = position_ - static_cast<std::int64_t>(ClickBus::kHistory);
    if (click.first + static_cast<std::int64_t>(room) <= oldest) continue;
    std::uint32_t slot = static_cast<std::uint32_t>(clicks_.size());
    if (freeSlots_.empty()) {
      clicks_.push_back(click);
      freeSlots_.reserve(clicks_.capacity());  // for `render`, which gives all of them back
    } else {
      slot = freeSlots_.back();
      freeSlots_.pop_back();
      clicks_[slot] = click;
    }
    if (hasHeads_) {
      if (ears_.size() < clicks_.size()) ears_.resize(2 * clicks_.size());
      ears_[slot] = laidEars_[index];
    }
    for (std::size_t i = 0; i < click.filters->count; ++i) {
      const std::uint32_t bus = busOf(keyOf(click.filters->filters[i], click.chain, click.channel));
      clicks_[slot].buses[i] = bus;
      ++buses_[bus].pending;
      buses_[bus].line.reserve(kMixFrames, room);
    }
    waiting_.push({click.first, click.track.start, slot}, position_);

    mostSamples_ = std::max(mostSamples_, room);
    if (click.nodes.empty()) {
      raster_.reserve(click.samples);
      click.pulse->forceTable();  // not while rendering
    }
    placed_.reserve(click.nodes.size(), click.samples);
  }
  const std::size_t room = mostSamples_ + response_.size() + 2 * ClickKernels::kRoom;
  if (x_.size() < room) x_.resize(2 * room);
  if (heard_.size() < room && !response_.empty()) heard_.resize(2 * room);
}

/// The bus of that key: the one that has it, one that nobody needs any more, or a new one.
std::uint32_t Synth::Impl::busOf(std::uint64_t key) {
  if (const auto known = busOfKey_.find(key); known != busOfKey_.end()) return known->second;
  std::uint32_t index = idleBus();
  if (index < buses_.size()) {
    busOfKey_.erase(buses_[index].key);
    std::erase(busOrder_, index);
  } else {
    buses_.push_back({ClickBus(kernels_), 0, 0});
  }
  Bus& bus = buses_[index];
  bus.key = key;
  const std::uint64_t path = key / (channels_.size() + 1);
  bus.line.restart(
      {.radiation =
           isFiltered() ? &filters_[static_cast<std::uint32_t>(path / chains_.size())] : nullptr,
       .reflections = chains_[path % chains_.size()]},
      position_);
  busOfKey_.emplace(key, index);
  const auto place = std::ranges::upper_bound(busOrder_, key, {},
                                              [this](std::uint32_t i) { return buses_[i].key; });
  busOrder_.insert(place, index);
  return index;
}

/// One of the next few that is silent and not waited for, or the number of buses.
std::uint32_t Synth::Impl::idleBus() {
  constexpr std::size_t kLooks = 8;
  for (std::size_t look = 0; look < std::min(kLooks, buses_.size()); ++look) {
    idleCursor_ = (idleCursor_ + 1) % buses_.size();
    const Bus& bus = buses_[idleCursor_];
    if (bus.pending == 0 && bus.line.isSilent()) return static_cast<std::uint32_t>(idleCursor_);
  }
  return static_cast<std::uint32_t>(buses_.size());
}

/// A total order by content: equal clicks are interchangeable, so the order of two calls of
/// `schedule` can never be heard.
bool Synth::Impl::isEarlier(const ClickQueue::Entry& a, const ClickQueue::Entry& b) const {
  if (a.first != b.first) return a.first < b.first;
  if (a.start != b.start) return a.start < b.start;
  const auto contentOf = [this](std::uint32_t slot) {
    const Click& click = clicks_[slot];
    const ClickTrack& t = click.track;
    const SphereWeights ears = hasHeads_ ? ears_[slot] : SphereWeights{};
    return std::tuple(click.filters->corner, click.chain, click.channel, t.length, t.bend, t.gain,
                      t.slope, t.curve, click.near, click.pulse->peakForce(), ears.index,
                      ears.weight);
  };
  return contentOf(a.slot) < contentOf(b.slot);
}

void Synth::Impl::beginUntil(std::int64_t end) noexcept {
  const std::span<ClickQueue::Entry> due = waiting_.takeUntil(position_, end);
  std::ranges::sort(due, [this](const auto& a, const auto& b) { return isEarlier(a, b); });
  for (std::size_t i = 0; i < due.size(); ++i) {
    constexpr std::size_t kAhead = 6;
    if (i + kAhead < due.size()) prefetch(clicks_[due[i + kAhead].slot]);
    begin(due[i].slot);
    freeSlots_.push_back(due[i].slot);
  }
}

void Synth::Impl::begin(std::uint32_t slot) noexcept {
  const Click& click = clicks_[slot];
  std::span<const double> samples = samplesOf(click);
  if (click.channel < channels_.size() && channels_[click.channel].isEar) {
    const Channel& channel = channels_[click.channel];
    const HrtfSet& set = *listeners_[channel.listener].hrtf;
    const std::span<double> response(response_.data(), set.alignedLength());
    set.blendAligned(ears_[slot], channel.ear, response);
    const std::size_t length = samples.size() + response.size() - 1;
    std::fill_n(x_.begin() + std::ssize(response_) + std::ssize(samples),
                ClickKernels::kRoom + response.size(), 0.0);
    kernels_.convolve(response, samples.data(), {heard_.data(), length});
    samples = {heard_.data(), length};
  }
  const double near = settings_.radiation == Radiation::exact ? click.near : 0.0;
  for (std::size_t i = 0; i < click.filters->count; ++i) {
    Bus& bus = buses_[click.buses[i]];
    const double weight = click.filters->weights[i];
    bus.line.add(click.first, samples, weight, weight * near);
    --bus.pending;
  }
}

/// Behind as many zeros in x_ as an ear's response needs.
std::span<const double> Synth::Impl::samplesOf(const Click& click) noexcept {
  const std::span<double> x(x_.data() + response_.size(), click.samples);
  const ClickTrack& track = click.track;
  if (settings_.sampling == Sampling::bandLimited) {
    if (click.nodes.empty()) {
      spreadLongPulse(*click.pulse, track, kernels_, raster_, x);
    } else {
      kernels_.place(click.nodes, track, placed_);
      kernels_.spread(placed_, click.nodes.size(), x);
    }
    return x;
  }
  for (std::size_t n = 0; n < x.size(); ++n) {
    const double u = (static_cast<double>(n) - track.start) / track.length;
    const double value = isFiltered() ? click.pulse->force(u) / track.length
                                      : click.pulse->slope(u) / (track.length * track.length);
    x[n] = track.gainAt(u) * value;
  }
  return x;
}

void Synth::Impl::mix(std::size_t frames) noexcept {
  std::ranges::fill(mix_, 0.0);
  std::ranges::fill(send_, 0.0);
  beginUntil(position_ + static_cast<std::int64_t>(frames));
  for (const std::uint32_t index : busOrder_) {
    Bus& bus = buses_[index];
    const std::size_t channel = bus.key % (channels_.size() + 1);
    double* to = channel < channels_.size() ? &mix_[channel * kMixFrames] : send_.data();
    bus.line.advance({to, frames});
  }
  reverberate(frames);
  position_ += static_cast<std::int64_t>(frames);
}

void Synth::Impl::reverberate(std::size_t frames) noexcept {
  if (reverbs_.empty()) return;
  const std::span<const double> input(send_.data(), frames);
  const bool quiet = std::ranges::all_of(input, [](double sample) { return sample == 0.0; });
  std::size_t channel = 0;
  for (Reverb& reverb : reverbs_) {
    std::array<double*, Reverb::kMaxChannels> outputs{};
    for (std::size_t i = 0; i < reverb.channels(); ++i)
      outputs[i] = &mix_[(channel + i) * kMixFrames];
    if (!quiet || !reverb.isSilent()) reverb.process(input, {outputs.data(), reverb.channels()});
    channel += reverb.channels();
  }
}

bool Synth::Impl::isSilent() const {
  return waiting_.size() == 0 && std::ranges::all_of(reverbs_, &Reverb::isSilent) &&
         std::ranges::all_of(buses_, [](const Bus& bus) { return bus.line.isSilent(); });
}

Status Synth::Impl::seek(double seconds) {
  if (!(std::abs(seconds) * settings_.sampleRate < kExactSamples))
    return Error{"synth: cannot seek to " + std::to_string(seconds) +
                 " s; the clock counts up to 2^53 samples"};
  position_ = std::llround(seconds * settings_.sampleRate);
  waiting_.clear();
  clicks_.clear();
  freeSlots_.clear();
  buses_.clear();
  busOrder_.clear();
  busOfKey_.clear();
  idleCursor_ = 0;
  for (std::size_t index = 0; index < listeners_.size(); ++index)
    tracks_[index].restart({0.0, listeners_[index].position, listeners_[index].orientation});
  hasMoved_.assign(listeners_.size(), false);
  for (Reverb& reverb : reverbs_)
    reverb.reset();
  return std::monostate{};
}

template <class Sample>
void Synth::Impl::render(std::span<Sample* const> channels, std::size_t frames) noexcept {
  assert(channels.size() == channels_.size());
  for (std::size_t done = 0; done < frames;) {
    const std::size_t part = std::min(kMixFrames, frames - done);
    mix(part);
    for (std::size_t channel = 0; channel < channels.size(); ++channel)
      std::transform(&mix_[channel * kMixFrames], &mix_[channel * kMixFrames] + part,
                     channels[channel] + done,
                     [](double pressure) { return static_cast<Sample>(pressure); });
    done += part;
  }
}

Result<Synth> Synth::create(const SynthSettings& settings, std::vector<Listener> listeners) {
  if (const std::string reason = whyNot(settings, listeners); !reason.empty())
    return Error{"synth: " + reason};
  auto impl = std::make_unique<Impl>(settings, std::move(listeners));
  if (const Status prepared = impl->prepare(); !prepared)
    return Error{"synth: " + prepared.error().message};
  return Synth(std::move(impl));
}

Synth::Synth(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Synth::Synth(Synth&&) noexcept = default;
Synth& Synth::operator=(Synth&&) noexcept = default;
Synth::~Synth() = default;

Status Synth::setBody(BodyId id, const SoundBody& body) {
  return impl_->setBody(id, body);
}
Status Synth::moveListener(std::size_t listener, const ListenerPose& pose) {
  return impl_->moveListener(listener, pose);
}
void Synth::schedule(const ImpulseEvent& event) {
  impl_->schedule(event);
}
Status Synth::seek(double seconds) {
  return impl_->seek(seconds);
}
double Synth::time() const {
  return impl_->time();
}
double Synth::leadTime(double contactDuration) const {
  return impl_->leadTime(contactDuration);
}
double Synth::contactDuration(const ImpulseEvent& event) const {
  return impl_->contactDuration(event);
}
bool Synth::isSilent() const {
  return impl_->isSilent();
}
const std::vector<Listener>& Synth::listeners() const {
  return impl_->listeners();
}
std::size_t Synth::channelCount() const {
  return impl_->channelCount();
}
const SynthCounters& Synth::counters() const {
  return impl_->counters();
}
std::size_t Synth::pendingClicks() const {
  return impl_->pendingClicks();
}

template <class Sample>
void Synth::render(std::span<Sample* const> channels, std::size_t frames) noexcept {
  impl_->render<Sample>(channels, frames);
}

template void Synth::render<float>(std::span<float* const>, std::size_t) noexcept;
template void Synth::render<double>(std::span<double* const>, std::size_t) noexcept;

}  // namespace carom
