#include "audio/propagation/sound_paths.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "audio/dsp/decay_filter.h"
#include "audio/model/air.h"
#include "audio/model/positive.h"

namespace carom::audio {
namespace {

constexpr double kLowestRate = 8000.0;
constexpr double kHighestRate = 192000.0;

Status validate(const SynthSettings& settings, const std::vector<Listener>& listeners) {
  if (!(settings.sampleRate >= kLowestRate && settings.sampleRate <= kHighestRate))
    return Error{"sample rate " + std::to_string(settings.sampleRate) +
                 " Hz is out of range: 8000 to 192000 Hz"};
  if (!isPositive(settings.medium.density)) return Error{"density of the medium must be positive"};
  if (!isPositive(settings.medium.speedOfSound)) return Error{"speed of sound must be positive"};
  if (Status valid = validateAir(settings.medium); !valid) return valid;
  if (!(std::isfinite(settings.audibleThreshold) && settings.audibleThreshold >= 0.0))
    return Error{"audible threshold must be a finite pressure of at least 0 Pa"};
  if (listeners.empty()) return Error{"there is no listener: at least one is needed"};
  for (std::size_t index = 0; index < listeners.size(); ++index) {
    if (const Status valid = validate(listeners[index]); !valid)
      return Error{"listener " + std::to_string(index) + " ('" + listeners[index].name +
                   "'): " + valid.error().message};
  }
  return std::monostate{};
}

Status prepareListeners(SoundPaths& paths) {
  for (std::size_t index = 0; index < paths.listeners.size(); ++index) {
    Listener& listener = paths.listeners[index];
    const bool binaural = listener.format == ListenerFormat::binaural;
    if (binaural && listener.hrtf == nullptr) {
      auto set = defaultHrtf(paths.settings.sampleRate);
      if (!set) return Error{"listener '" + listener.name + "': " + set.error().message};
      listener.hrtf = *set;
    }
    if (binaural && listener.hrtf->sampleRate() != paths.settings.sampleRate)
      return Error{"listener '" + listener.name + "': its head-related responses are for " +
                   std::to_string(listener.hrtf->sampleRate()) + " Hz, not " +
                   std::to_string(paths.settings.sampleRate) + " Hz"};
    if (binaural) {
      paths.hasHeads = true;
      paths.longestResponse = std::max(paths.longestResponse, listener.hrtf->alignedLength());
      paths.earliestEar = std::max(paths.earliestEar, listener.hrtf->latency());
    }
    const Receivers receivers = receiversOf(listener);
    for (std::size_t i = 0; i < receivers.size(); ++i) {
      paths.channels.push_back(
          {.listener = static_cast<std::uint32_t>(index),
           .receiver = receivers[i],
           .place = listener.position + listener.orientation * receivers[i].offset,
           .ear = i == 0 ? Ear::left : Ear::right,
           .isEar = binaural});
    }
  }
  return std::monostate{};
}

/// Adds what the air absorbs to decay times that are the walls' alone; and at 16 kHz, where none is
/// given, what it absorbs more than at 8 kHz. By Sabine's formula as by Eyring's, the rates of
/// decay of walls and air are added.
void addAir(ReverbSettings& reverb, const Medium& medium) {
  const auto withAir = [&](double time, double attenuation) {
    const double rate =
        1.0 / time + reverb.speedOfSound * attenuation / (6.0 * std::numbers::ln10);  // 1/s
    return std::min(time, std::max(1.0 / rate, kShortestDecay));
  };
  const bool ringsForEver = reverb.includesAir && std::isinf(reverb.decayTimes.back());
  const double known = reverb.includesAir ? airAttenuation(medium, kOctaveBands.back()) : 0.0;
  if (reverb.decayTimeAt16kHz == 0.0 && !ringsForEver)
    reverb.decayTimeAt16kHz =
        withAir(reverb.decayTimes.back(), airAttenuation(medium, kTopBand) - known);
  else if (!reverb.includesAir)
    reverb.decayTimeAt16kHz = withAir(reverb.decayTimeAt16kHz, airAttenuation(medium, kTopBand));
  if (reverb.includesAir) return;
  for (std::size_t band = 0; band < kBandCount; ++band)
    reverb.decayTimes[band] =
        withAir(reverb.decayTimes[band], airAttenuation(medium, kOctaveBands[band]));
  reverb.includesAir = true;
}

/// The filters of a room's walls, each once.
struct WallFilters {
  std::vector<ReflectionFilter> filters;  // ascending in b0, b1, a1; no two alike
  std::vector<std::uint32_t> ofWall;      // index into them

  WallFilters(const Room& room, double sampleRate) {
    const auto key = [](const ReflectionFilter& f) { return std::tie(f.b0, f.b1, f.a1); };
    std::vector<ReflectionFilter> all;
    for (const Reflector& wall : room.reflectors)
      all.push_back(reflectionFilter(wall.absorption, sampleRate));
    for (const ReflectionFilter& filter : all) {
      const auto place = std::ranges::lower_bound(filters, key(filter), {}, key);
      if (place == filters.end() || key(*place) != key(filter)) filters.insert(place, filter);
    }
    for (const ReflectionFilter& filter : all)
      ofWall.push_back(static_cast<std::uint32_t>(
          std::ranges::lower_bound(filters, key(filter), {}, key) - filters.begin()));
  }
};

Status prepareRoom(SoundPaths& paths) {
  paths.chains.emplace_back();
  paths.paths.emplace_back();
  if (!paths.settings.room.reflectors.empty()) {
    Result<std::vector<Image>> images = makeImages(paths.settings.room);
    if (!images) return Error{"room: " + images.error().message};
    paths.images = *std::move(images);
  }
  const WallFilters walls(paths.settings.room, paths.settings.sampleRate);
  // Paths over walls that reflect alike share their filters.
  std::map<std::vector<std::uint32_t>, std::uint32_t> chains = {{{}, 0}};
  for (const Image& image : paths.images) {
    std::vector<std::uint32_t> chain;
    for (const std::size_t wall : image.reflectors)
      chain.push_back(walls.ofWall[wall]);
    std::ranges::sort(chain);
    const auto [known, isNew] =
        chains.try_emplace(chain, static_cast<std::uint32_t>(paths.chains.size()));
    paths.paths.push_back({&image, known->second});
    if (!isNew) continue;
    std::vector<ReflectionFilter>& filters = paths.chains.emplace_back();
    for (const std::uint32_t filter : chain)
      filters.push_back(walls.filters[filter]);
  }
  if (paths.settings.airAbsorption) {
    paths.air.emplace(paths.settings.medium, paths.settings.sampleRate);
    if (paths.settings.reverb) addAir(*paths.settings.reverb, paths.settings.medium);
  }
  if (!paths.settings.reverb) return std::monostate{};
  for (const Listener& listener : paths.listeners) {
    const std::size_t channels = channelCount(listener);
    if (paths.reverbs.contains(channels)) continue;
    Result<Reverb> reverb =
        Reverb::create(*paths.settings.reverb, paths.settings.sampleRate, channels);
    if (!reverb) return Error{"reverberation: " + reverb.error().message};
    paths.reverbs.emplace(channels, *std::move(reverb));
  }
  return std::monostate{};
}

}  // namespace

Result<std::shared_ptr<const SoundPaths>> makeSoundPaths(const SynthSettings& settings,
                                                         std::vector<Listener> listeners) {
  if (const Status valid = validate(settings, listeners); !valid)
    return Error{valid.error().message};
  auto paths = std::make_shared<SoundPaths>();
  paths->settings = settings;
  paths->listeners = std::move(listeners);
  if (const Status prepared = prepareListeners(*paths); !prepared) return prepared.error();
  if (const Status prepared = prepareRoom(*paths); !prepared) return prepared.error();
  return std::shared_ptr<const SoundPaths>(std::move(paths));
}

}  // namespace carom::audio
