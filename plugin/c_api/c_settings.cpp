#include "plugin/c_api/c_settings.h"

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "carom/audio/limiter.h"
#include "carom/audio/listener.h"

namespace carom::plugin {
namespace {

/// Heads that are loaded, by file: listeners of one file share them.
using Heads = std::map<std::string, std::shared_ptr<const HrtfSet>>;

Status checkListener(const carom_listener& given) {
  return checkChoices(
      {{"carom_listener.format", given.format, 4}, {"carom_listener.reserved", given.reserved, 1}});
}

Listener listenerFrom(const carom_listener& given) {
  Listener listener;
  if (given.name != nullptr) listener.name = given.name;
  listener.position = vectorFrom(given.position);
  listener.orientation = quaternionFrom(given.orientation);
  listener.format = static_cast<ListenerFormat>(given.format);
  listener.spacing = given.spacing;
  listener.halfAngle = given.half_angle;
  if (!(given.pattern < 0.0)) listener.pattern = given.pattern;
  return listener;
}

/// Reads settings, one listener after another.
class ListenerReader {
 public:
  explicit ListenerReader(double sampleRate) : sampleRate_(sampleRate) {}

  Result<Listener> read(const carom_listener& given) {
    const Result<carom_listener> known = readStruct(&given, defaultListener(), "carom_listener");
    if (!known) return known.error();
    if (const Status checked = checkListener(*known); !checked) return checked.error();
    Listener listener = listenerFrom(*known);
    if (known->sofa_file == nullptr) return listener;
    if (listener.format != ListenerFormat::binaural)
      return Error{"carom_listener.sofa_file is for CAROM_LISTENER_BINAURAL only"};
    if (const Status loaded = loadHead(known->sofa_file, listener); !loaded) return loaded.error();
    return listener;
  }

 private:
  Status loadHead(const std::string& file, Listener& listener) {
    if (!heads_.contains(file)) {
      const auto* const utf8 = reinterpret_cast<const char8_t*>(file.c_str());
      auto loaded = loadHrtf(std::filesystem::path(utf8), sampleRate_);
      if (!loaded) return Error{"carom_listener.sofa_file: " + loaded.error().message};
      heads_.emplace(file, *std::move(loaded));
    }
    listener.hrtf = heads_.at(file);
    return std::monostate{};
  }

  double sampleRate_;
  Heads heads_;
};

/// Reads the listeners, which lie as far apart as the first is large.
Result<std::vector<Listener>> listenersFrom(const carom_settings& settings) {
  if (settings.listener_count == 0) return SoundSettings{}.listeners;
  if (settings.listeners == nullptr)
    return Error{"carom_settings.listeners is NULL, and listener_count is " +
                 std::to_string(settings.listener_count)};
  std::vector<Listener> listeners;
  ListenerReader reader(settings.sample_rate);
  for (std::size_t index = 0; index < settings.listener_count; ++index) {
    const std::string place = "listener " + std::to_string(index);
    const carom_listener* const given = elementOf(settings.listeners, index);
    if (sizeOf(given) != sizeOf(settings.listeners))
      return Error{place + ": its size is not that of the first"};
    Result<Listener> listener = reader.read(*given);
    if (!listener) return Error{place + ": " + listener.error().message};
    listeners.push_back(*std::move(listener));
  }
  return listeners;
}

Result<Reflector> reflectorFrom(const carom_reflector& given) {
  const Result<carom_reflector> read = readStruct(&given, defaultReflector(), "carom_reflector");
  if (!read) return read.error();
  Reflector reflector{.normal = vectorFrom(read->normal), .offset = read->offset};
  if (read->surface == nullptr) {
    std::ranges::copy(read->absorption, reflector.absorption.coefficients.begin());
    return reflector;
  }
  const Result<const Surface*> surface = surfaceNamed(read->surface);
  if (!surface) return surface.error();
  reflector.absorption = (*surface)->absorption;
  return reflector;
}

Status readReflectors(const carom_room& given, Room& room) {
  if (given.reflector_count > 0 && given.reflectors == nullptr)
    return Error{"carom_room.reflectors is NULL, and reflector_count is " +
                 std::to_string(given.reflector_count)};
  for (std::size_t index = 0; index < given.reflector_count; ++index) {
    const std::string place = "reflector " + std::to_string(index);
    const carom_reflector* const reflector = elementOf(given.reflectors, index);
    if (sizeOf(reflector) != sizeOf(given.reflectors))
      return Error{place + ": its size is not that of the first"};
    const Result<Reflector> read = reflectorFrom(*reflector);
    if (!read) return Error{place + ": " + read.error().message};
    room.reflectors.push_back(*read);
  }
  return std::monostate{};
}

VoiceBudget budgetFrom(const carom_settings& given) {
  return {.cpuShare = given.cpu_share,
          .voices = given.voices,
          .buses = given.buses,
          .longestContact = given.longest_contact,
          .ringingBodies = given.ringing_bodies,
          .slidingContacts = given.sliding_contacts,
          .modes = given.modes};
}

Status readRoom(const carom_settings& given, SynthSettings& synth) {
  if (given.room != nullptr) {
    Result<Room> room = roomFrom(given.room);
    if (!room) return room.error();
    synth.room = *std::move(room);
  }
  if (given.reverb != nullptr) {
    const Result<ReverbSettings> reverb = reverbFrom(given.reverb);
    if (!reverb) return reverb.error();
    synth.reverb = *reverb;
  }
  return std::monostate{};
}

Result<SynthSettings> synthFrom(const carom_settings& given) {
  SynthSettings synth;
  synth.sampleRate = given.sample_rate;
  synth.impulse = static_cast<ImpulseChoice>(given.impulse);
  synth.medium = {given.air_density, given.speed_of_sound};
  synth.audibleThreshold = given.audible_threshold;
  synth.doppler = given.doppler != 0;
  synth.comparison.pulse = static_cast<PulseShape>(given.pulse);
  synth.comparison.sampling = static_cast<Sampling>(given.sampling);
  synth.comparison.radiation = static_cast<Radiation>(given.radiation);
  synth.modalRadiation = static_cast<ModalRadiation>(given.modal_radiation);
  synth.dissipative = given.dissipative != 0;
  synth.contactLoss = given.contact_loss;
  if (const Status room = readRoom(given, synth); !room) return room.error();
  return synth;
}

LimiterSettings limiterFrom(const carom_settings& given) {
  LimiterSettings limiter;
  limiter.ceiling = static_cast<float>(given.limiter_ceiling);
  limiter.lookAhead = given.limiter_look_ahead;
  limiter.release = given.limiter_release;
  return limiter;
}

Status checkSettings(const carom_settings& given) {
  return checkChoices({{"carom_settings.limiter", given.limiter, 2},
                       {"carom_settings.clock", given.clock, 2},
                       {"carom_settings.impulse", given.impulse, 2},
                       {"carom_settings.radiators", given.radiators, 2},
                       {"carom_settings.doppler", given.doppler, 2},
                       {"carom_settings.reserved", given.reserved, 1},
                       {"carom_settings.pulse", given.pulse, 5},
                       {"carom_settings.sampling", given.sampling, 2},
                       {"carom_settings.radiation", given.radiation, 2},
                       {"carom_settings.modal_radiation", given.modal_radiation, 3},
                       {"carom_settings.dissipative", given.dissipative, 2},
                       {"carom_settings.reserved_too", given.reserved_too, 1}});
}

Result<SoundSettings> soundFrom(const carom_settings& given) {
  Result<SynthSettings> synth = synthFrom(given);
  if (!synth) return synth.error();
  Result<std::vector<Listener>> listeners = listenersFrom(given);
  if (!listeners) return listeners.error();
  SoundSettings settings;
  settings.synth = *std::move(synth);
  settings.listeners = *std::move(listeners);
  settings.latency = given.latency;
  settings.clock = static_cast<SoundClock>(given.clock);
  settings.budget = budgetFrom(given);
  if (given.full_scale != 0.0) settings.fullScale = given.full_scale;
  if (given.limiter != 0) settings.limiter = limiterFrom(given);
  return settings;
}

void writeSynth(const SynthSettings& synth, carom_settings& given) {
  given.sample_rate = synth.sampleRate;
  given.air_density = synth.medium.density;
  given.speed_of_sound = synth.medium.speedOfSound;
  given.audible_threshold = synth.audibleThreshold;
  given.impulse = static_cast<std::int32_t>(synth.impulse);
  given.doppler = synth.doppler ? 1 : 0;
  given.pulse = static_cast<std::int32_t>(synth.comparison.pulse);
  given.sampling = static_cast<std::int32_t>(synth.comparison.sampling);
  given.radiation = static_cast<std::int32_t>(synth.comparison.radiation);
  given.modal_radiation = static_cast<std::int32_t>(synth.modalRadiation);
  given.dissipative = synth.dissipative ? 1 : 0;
  given.contact_loss = synth.contactLoss;
}

void writeBudget(const VoiceBudget& budget, carom_settings& given) {
  given.cpu_share = budget.cpuShare;
  given.voices = budget.voices;
  given.buses = budget.buses;
  given.longest_contact = budget.longestContact;
  given.ringing_bodies = budget.ringingBodies;
  given.sliding_contacts = budget.slidingContacts;
  given.modes = budget.modes;
}

}  // namespace

carom_settings defaultSettings() {
  const SoundSettings settings;
  const WorldSoundSettings world;
  const LimiterSettings limiter;
  auto given = zeroed<carom_settings>();
  writeSynth(settings.synth, given);
  writeBudget(settings.budget, given);
  given.latency = settings.latency;
  given.clock = static_cast<std::int32_t>(settings.clock);
  given.limiter_ceiling = static_cast<double>(limiter.ceiling);
  given.limiter_look_ahead = limiter.lookAhead;
  given.limiter_release = limiter.release;
  given.rest_speed = world.restSpeed;
  given.radiators = static_cast<std::int32_t>(world.radiators);
  return given;
}

carom_listener defaultListener() {
  const Listener listener;
  auto given = zeroed<carom_listener>();
  given.orientation[3] = 1.0;
  given.spacing = listener.spacing;
  given.half_angle = listener.halfAngle;
  given.pattern = -1.0;
  return given;
}

carom_room defaultRoom() {
  auto given = zeroed<carom_room>();
  given.order = Room{}.order;
  return given;
}

carom_reflector defaultReflector() {
  auto given = zeroed<carom_reflector>();
  given.normal[2] = 1.0;
  return given;
}

carom_reverb defaultReverb() {
  return toC(ReverbSettings{});
}

Result<CSettings> settingsFrom(const carom_settings* given) {
  if (given == nullptr) return CSettings();
  const Result<carom_settings> read = readStruct(given, defaultSettings(), "carom_settings");
  if (!read) return read.error();
  if (const Status checked = checkSettings(*read); !checked) return checked.error();
  Result<SoundSettings> sound = soundFrom(*read);
  if (!sound) return sound.error();
  return CSettings{.sound = *std::move(sound),
                   .world = {.restSpeed = read->rest_speed,
                             .radiators = static_cast<RadiatorChoice>(read->radiators)}};
}

Result<Room> roomFrom(const carom_room* given) {
  const Result<carom_room> read = readStruct(given, defaultRoom(), "carom_room");
  if (!read) return read.error();
  const Status checked = checkChoices({{"carom_room.reserved", read->reserved, 1}});
  if (!checked) return checked.error();
  Room room;
  room.order = read->order;
  if (const Status reflectors = readReflectors(*read, room); !reflectors)
    return Error{"carom_room: " + reflectors.error().message};
  return room;
}

Result<ReverbSettings> reverbFrom(const carom_reverb* given) {
  const Result<carom_reverb> read = readStruct(given, defaultReverb(), "carom_reverb");
  if (!read) return read.error();
  ReverbSettings reverb{.volume = read->volume,
                        .surface = read->surface,
                        .onset = read->onset,
                        .gain = read->gain,
                        .speedOfSound = read->speed_of_sound,
                        .silence = read->silence};
  std::ranges::copy(read->decay_times, reverb.decayTimes.begin());
  return reverb;
}

carom_reverb toC(const ReverbSettings& reverb) {
  auto given = zeroed<carom_reverb>();
  given.volume = reverb.volume;
  given.surface = reverb.surface;
  std::ranges::copy(reverb.decayTimes, given.decay_times);
  given.onset = reverb.onset;
  given.gain = reverb.gain;
  given.speed_of_sound = reverb.speedOfSound;
  given.silence = reverb.silence;
  return given;
}

Result<const Surface*> surfaceNamed(const char* name) {
  const Surface* const found = name == nullptr ? nullptr : findSurface(name);
  if (found != nullptr) return found;
  std::string message = name == nullptr
                            ? "the name of a surface is NULL; expected one of"
                            : "there is no surface '" + std::string(name) + "'; there are";
  const char* separator = " ";
  for (const Surface& surface : surfaceTable()) {
    message += separator + std::string(surface.name);
    separator = ", ";
  }
  return Error{message};
}

// The table's texts are literals, which end with a zero.
carom_surface toC(const Surface& surface) {
  auto given = zeroed<carom_surface>();
  given.name = surface.name.data();
  given.source = surface.source.data();
  std::ranges::copy(surface.absorption.coefficients, given.absorption);
  return given;
}

}  // namespace carom::plugin
