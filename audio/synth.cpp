#include "audio/synth.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <string>
#include <tuple>
#include <utility>

#include "audio/hertz.h"

namespace carom {
namespace {

/// Frames summed in double before they are handed on: small enough to stay in the first cache.
constexpr std::size_t kMixFrames = 256;
/// Shorter contacts alias; docs/acceleration_noise.md has the error.
constexpr double kWellSampled = 4.0;
constexpr double kLowestRate = 8000.0;
constexpr double kHighestRate = 192000.0;

/// A total order by content: equal clicks are interchangeable, so the order of two calls of
/// `schedule` can never be heard.
bool soundsLater(const SampledClick& click, const SampledClick& than) {
  const auto key = [](const SampledClick& c) {
    return std::tie(c.first, c.centre, c.fraction, c.duration, c.amplitude, c.channel);
  };
  return key(click) > key(than);
}

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
  if (std::isfinite(body.mass) && !isPositive(body.radius))
    return "radius must be positive (m) for a body that can move";
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
  for (std::size_t channel = 0; channel < listeners.size(); ++channel) {
    if (!listeners[channel].position.allFinite())
      return "position of listener " + std::to_string(channel) + " ('" + listeners[channel].name +
             "') must be finite";
  }
  return {};
}

}  // namespace

Synth::Synth(const SynthSettings& settings, std::vector<Listener> listeners)
    : settings_(settings),
      listeners_(std::move(listeners)),
      clicks_(listeners_.size()),
      mix_(kMixFrames * listeners_.size()) {}

Result<Synth> Synth::create(const SynthSettings& settings, std::vector<Listener> listeners) {
  if (std::string reason = whyNot(settings, listeners); !reason.empty())
    return Error{"synth: " + reason};
  return Synth(settings, std::move(listeners));
}

Status Synth::setBody(BodyId id, const SoundBody& body) {
  if (const std::string reason = whyNot(body); !reason.empty())
    return Error{"sound body " + std::to_string(id) + ": " + reason};
  bodies_.insert_or_assign(id, body);
  return std::monostate{};
}

const SoundBody* Synth::findBody(BodyId id) const {
  const auto entry = bodies_.find(id);
  return entry == bodies_.end() ? nullptr : &entry->second;
}

double Synth::contactDuration(const ImpulseEvent& event) const {
  const SoundBody* body = findBody(event.body);
  const SoundBody* other = findBody(event.other);
  if (body == nullptr || other == nullptr || !isContact(event)) return 0.0;
  return hertzDuration(blunted(event, *body, *other), body->material, other->material);
}

void Synth::schedule(const ImpulseEvent& event) {
  if (settings_.impulse == ImpulseChoice::applied && event.hasAppliedImpulse) {
    ImpulseEvent applied = event;
    applied.impulse = event.appliedImpulse;
    scheduleImpulse(applied);
  } else {
    scheduleImpulse(event);
  }
}

void Synth::scheduleImpulse(const ImpulseEvent& event) {
  const double duration = isFinite(event) ? contactDuration(event) : 0.0;
  if (!isPositive(duration)) {
    ++counters_.rejected;
    return;
  }
  const SoundBody& body = *findBody(event.body);
  if (std::isinf(body.mass)) {
    ++counters_.immovable;
    return;
  }
  if (!makeClicks(event, body, duration)) {
    ++counters_.rejected;
    return;
  }
  ++counters_.events;
  countTiming(duration);
  if (anyAudible())
    enqueueClicks();
  else
    ++counters_.inaudible;
}

/// False where numbers so large came together that the click cannot be placed on the clock.
bool Synth::makeClicks(const ImpulseEvent& event, const SoundBody& body, double duration) {
  for (std::size_t channel = 0; channel < listeners_.size(); ++channel) {
    const Click click =
        makeClick(event, body, duration, listeners_[channel].position, settings_.medium);
    if (!std::isfinite(click.peak()) || !canSample(click, settings_.sampleRate)) return false;
    clicks_[channel] =
        sampleClick(click, settings_.sampleRate, static_cast<std::uint32_t>(channel));
  }
  return true;
}

bool Synth::anyAudible() const {
  return std::ranges::any_of(clicks_, [this](const SampledClick& click) {
    const double peak = std::abs(click.amplitude) * kPulsePeakSlope;
    return peak > 0.0 && peak >= settings_.audibleThreshold;
  });
}

void Synth::countTiming(double duration) {
  const auto begun = [this](const SampledClick& click) { return click.first < position_; };
  if (std::ranges::any_of(clicks_, begun)) ++counters_.late;
  if (duration * settings_.sampleRate < kWellSampled) ++counters_.undersampled;
}

void Synth::enqueueClicks() {
  for (const SampledClick& click : clicks_) {
    const bool over = click.end <= position_ || click.end == click.first;
    if (over || click.amplitude == 0.0) continue;
    waiting_.push_back(click);
    std::ranges::push_heap(waiting_, soundsLater);
  }
  reserveSounding();
}

/// Every click may come to sound at once; `render` must then find the room ready.
void Synth::reserveSounding() {
  const std::size_t needed = pendingClicks();
  if (sounding_.capacity() < needed) sounding_.reserve(std::max(needed, 2 * sounding_.capacity()));
}

void Synth::beginUntil(std::int64_t end) noexcept {
  while (!waiting_.empty() && waiting_.front().first < end) {
    std::ranges::pop_heap(waiting_, soundsLater);
    sounding_.push_back(waiting_.back());
    waiting_.pop_back();
  }
}

/// Sums what sounds into mix_ and advances the clock. The order of the sum is that of sounding_:
/// by first sample, whatever the blocks, because who begins in a later block comes later anyway.
void Synth::mix(std::size_t frames) noexcept {
  const std::int64_t end = position_ + static_cast<std::int64_t>(frames);
  for (std::size_t channel = 0; channel < listeners_.size(); ++channel)
    std::fill_n(&mix_[channel * kMixFrames], frames, 0.0);
  beginUntil(end);
  for (const SampledClick& click : sounding_)
    addClick(click, position_, {&mix_[click.channel * kMixFrames], frames});
  std::erase_if(sounding_, [end](const SampledClick& click) { return click.end <= end; });
  position_ = end;
}

Status Synth::seek(double seconds) {
  if (!(std::abs(seconds) * settings_.sampleRate < kExactSamples))
    return Error{"synth: cannot seek to " + std::to_string(seconds) +
                 " s; the clock counts up to 2^53 samples"};
  position_ = std::llround(seconds * settings_.sampleRate);
  waiting_.clear();
  sounding_.clear();
  return std::monostate{};
}

template <class Sample>
void Synth::render(std::span<Sample* const> channels, std::size_t frames) noexcept {
  assert(channels.size() == listeners_.size());
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

template void Synth::render<float>(std::span<float* const>, std::size_t) noexcept;
template void Synth::render<double>(std::span<double* const>, std::size_t) noexcept;

}  // namespace carom
