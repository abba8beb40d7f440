#include "plugin/c_api/c_settings.h"

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "carom/audio/limiter.h"
#include "carom/audio/listener.h"
#include "plugin/c_api/c_handles.h"
#include "plugin/c_api/c_structs.h"

namespace carom::plugin {
namespace {

/// Heads that are loaded, by file: listeners of one file share them.
using Heads = std::map<std::string, std::shared_ptr<const HrtfSet>>;

Status checkListener(const carom_listener& input) {
  return checkChoices(
      {{"carom_listener.format", input.format, 4}, {"carom_listener.reserved", input.reserved, 1}});
}

Listener listenerFrom(const carom_listener& input) {
  Listener listener;
  if (input.name != nullptr) listener.name = input.name;
  listener.position = vectorFrom(input.position);
  listener.orientation = quaternionFrom(input.orientation);
  listener.format = static_cast<ListenerFormat>(input.format);
  listener.spacing = input.spacing;
  listener.halfAngle = input.half_angle;
  if (!(input.pattern < 0.0)) listener.pattern = input.pattern;
  return listener;
}

/// Reads settings, one listener after another.
class ListenerReader {
 public:
  explicit ListenerReader(double sampleRate) : sampleRate_(sampleRate) {}

  Result<Listener> read(const carom_listener& input) {
    const Result<carom_listener> known = readStruct(&input, defaultListener(), "carom_listener");
    if (!known) return known.error();
    if (const Status checked = checkListener(*known); !checked) return checked.error();
    Listener listener = listenerFrom(*known);
    if (const Status head = readHead(*known, listener); !head) return head.error();
    return listener;
  }

 private:
  Status readHead(const carom_listener& input, Listener& listener) {
    const auto refused = [](const std::string& field) {
      return Error{"carom_listener." + field + " is for CAROM_LISTENER_BINAURAL only"};
    };
    const bool isBinaural = listener.format == ListenerFormat::binaural;
    if (input.head != nullptr) {
      if (!isBinaural) return refused("head");
      if (input.sofa_file != nullptr)
        return Error{"carom_listener has both head and sofa_file; expected one of them"};
      listener.hrtf = input.head->set;
      return std::monostate{};
    }
    if (input.sofa_file == nullptr) return std::monostate{};
    if (!isBinaural) return refused("sofa_file");
    return loadHead(input.sofa_file, listener);
  }

  Status loadHead(const std::string& file, Listener& listener) {
    if (!heads_.contains(file)) {
      auto loaded = loadHrtf(filePath(file.c_str()), sampleRate_);
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
    const carom_listener* const input = elementOf(settings.listeners, index);
    if (sizeOf(input) != sizeOf(settings.listeners))
      return Error{place + ": its size is not that of the first"};
    Result<Listener> listener = reader.read(*input);
    if (!listener) return Error{place + ": " + listener.error().message};
    listeners.push_back(*std::move(listener));
  }
  return listeners;
}

Result<Reflector> reflectorFrom(const carom_reflector& input) {
  const Result<carom_reflector> read = readStruct(&input, defaultReflector(), "carom_reflector");
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

Status readReflectors(const carom_room& input, Room& room) {
  if (input.reflector_count > 0 && input.reflectors == nullptr)
    return Error{"carom_room.reflectors is NULL, and reflector_count is " +
                 std::to_string(input.reflector_count)};
  for (std::size_t index = 0; index < input.reflector_count; ++index) {
    const std::string place = "reflector " + std::to_string(index);
    const carom_reflector* const reflector = elementOf(input.reflectors, index);
    if (sizeOf(reflector) != sizeOf(input.reflectors))
      return Error{place + ": its size is not that of the first"};
    const Result<Reflector> read = reflectorFrom(*reflector);
    if (!read) return Error{place + ": " + read.error().message};
    room.reflectors.push_back(*read);
  }
  return std::monostate{};
}

VoiceBudget budgetFrom(const carom_settings& input) {
  return {.cpuShare = input.cpu_share,
          .voices = input.voices,
          .buses = input.buses,
          .longestContact = input.longest_contact,
          .ringingBodies = input.ringing_bodies,
          .slidingContacts = input.sliding_contacts,
          .modes = input.modes};
}

Status readRoom(const carom_settings& input, SynthSettings& synth) {
  if (input.room != nullptr) {
    Result<Room> room = roomFrom(input.room);
    if (!room) return room.error();
    synth.room = *std::move(room);
  }
  if (input.reverb != nullptr) {
    const Result<ReverbSettings> reverb = reverbFrom(input.reverb);
    if (!reverb) return reverb.error();
    synth.reverb = *reverb;
  }
  return std::monostate{};
}

Medium mediumFrom(const carom_settings& input) {
  return {.density = input.air_density,
          .speedOfSound = input.speed_of_sound,
          .temperature = input.air_temperature,
          .humidity = input.air_humidity,
          .pressure = input.air_pressure};
}

Result<SynthSettings> synthFrom(const carom_settings& input) {
  SynthSettings synth;
  synth.sampleRate = input.sample_rate;
  synth.impulse = static_cast<ImpulseChoice>(input.impulse);
  synth.medium = mediumFrom(input);
  synth.audibleThreshold = input.audible_threshold;
  synth.doppler = input.doppler != 0;
  synth.airAbsorption = input.air_absorption != 0;
  synth.comparison.pulse = static_cast<PulseShape>(input.pulse);
  synth.comparison.sampling = static_cast<Sampling>(input.sampling);
  synth.comparison.radiation = static_cast<Radiation>(input.radiation);
  synth.modalRadiation = static_cast<ModalRadiation>(input.modal_radiation);
  synth.ringingContact = static_cast<RingingContact>(input.ringing_contact);
  synth.dissipative = input.dissipative != 0;
  synth.contactLoss = input.contact_loss;
  synth.lasting = static_cast<LastingDetail>(input.lasting);
  synth.slideVoices = input.slide_voices;
  if (const Status room = readRoom(input, synth); !room) return room.error();
  return synth;
}

LimiterSettings limiterFrom(const carom_settings& input) {
  LimiterSettings limiter;
  limiter.ceiling = static_cast<float>(input.limiter_ceiling);
  limiter.lookAhead = input.limiter_look_ahead;
  limiter.release = input.limiter_release;
  return limiter;
}

Status checkSettings(const carom_settings& input) {
  return checkChoices({{"carom_settings.limiter", input.limiter, 2},
                       {"carom_settings.clock", input.clock, 2},
                       {"carom_settings.impulse", input.impulse, 2},
                       {"carom_settings.radiators", input.radiators, 2},
                       {"carom_settings.doppler", input.doppler, 2},
                       {"carom_settings.reserved", input.reserved, 1},
                       {"carom_settings.pulse", input.pulse, 5},
                       {"carom_settings.sampling", input.sampling, 2},
                       {"carom_settings.radiation", input.radiation, 2},
                       {"carom_settings.modal_radiation", input.modal_radiation, 3},
                       {"carom_settings.dissipative", input.dissipative, 2},
                       {"carom_settings.level", input.level, 3},
                       {"carom_settings.lasting", input.lasting, 2},
                       {"carom_settings.ringing_contact", input.ringing_contact, 2},
                       {"carom_settings.air_absorption", input.air_absorption, 2},
                       {"carom_settings.air_reserved", input.air_reserved, 1}});
}

Result<SoundSettings> soundFrom(const carom_settings& input) {
  Result<SynthSettings> synth = synthFrom(input);
  if (!synth) return synth.error();
  Result<std::vector<Listener>> listeners = listenersFrom(input);
  if (!listeners) return listeners.error();
  SoundSettings settings;
  settings.synth = *std::move(synth);
  settings.listeners = *std::move(listeners);
  settings.latency = input.latency;
  settings.clock = static_cast<SoundClock>(input.clock);
  settings.budget = budgetFrom(input);
  settings.level = static_cast<Level>(input.level);
  if (input.full_scale != 0.0) settings.fullScale = input.full_scale;
  if (input.limiter != 0) settings.limiter = limiterFrom(input);
  if (input.on_message != nullptr)
    settings.onMessage = [told = input.on_message, user = input.message_user](
                             const std::string& sentence) { told(user, sentence.c_str()); };
  return settings;
}

void writeSynth(const SynthSettings& synth, carom_settings& made) {
  made.sample_rate = synth.sampleRate;
  made.air_density = synth.medium.density;
  made.speed_of_sound = synth.medium.speedOfSound;
  made.air_temperature = synth.medium.temperature;
  made.air_humidity = synth.medium.humidity;
  made.air_pressure = synth.medium.pressure;
  made.air_absorption = synth.airAbsorption ? 1 : 0;
  made.audible_threshold = synth.audibleThreshold;
  made.impulse = static_cast<std::int32_t>(synth.impulse);
  made.doppler = synth.doppler ? 1 : 0;
  made.pulse = static_cast<std::int32_t>(synth.comparison.pulse);
  made.sampling = static_cast<std::int32_t>(synth.comparison.sampling);
  made.radiation = static_cast<std::int32_t>(synth.comparison.radiation);
  made.modal_radiation = static_cast<std::int32_t>(synth.modalRadiation);
  made.ringing_contact = static_cast<std::int32_t>(synth.ringingContact);
  made.dissipative = synth.dissipative ? 1 : 0;
  made.contact_loss = synth.contactLoss;
  made.lasting = static_cast<std::int32_t>(synth.lasting);
  made.slide_voices = synth.slideVoices;
}

void writeBudget(const VoiceBudget& budget, carom_settings& made) {
  made.cpu_share = budget.cpuShare;
  made.voices = budget.voices;
  made.buses = budget.buses;
  made.longest_contact = budget.longestContact;
  made.ringing_bodies = budget.ringingBodies;
  made.sliding_contacts = budget.slidingContacts;
  made.modes = budget.modes;
}

}  // namespace

carom_settings defaultSettings() {
  const SoundSettings settings;
  const WorldSoundSettings world;
  const LimiterSettings limiter;
  auto made = zeroed<carom_settings>();
  writeSynth(settings.synth, made);
  writeBudget(settings.budget, made);
  made.latency = settings.latency;
  made.clock = static_cast<std::int32_t>(settings.clock);
  made.level = static_cast<std::int32_t>(settings.level);
  made.limiter_ceiling = static_cast<double>(limiter.ceiling);
  made.limiter_look_ahead = limiter.lookAhead;
  made.limiter_release = limiter.release;
  made.rest_speed = world.restSpeed;
  made.radiators = static_cast<std::int32_t>(world.radiators);
  made.metres_per_unit = world.metresPerUnit;
  return made;
}

carom_listener defaultListener() {
  const Listener listener;
  auto made = zeroed<carom_listener>();
  made.orientation[3] = 1.0;
  made.spacing = listener.spacing;
  made.half_angle = listener.halfAngle;
  made.pattern = -1.0;
  return made;
}

carom_room defaultRoom() {
  auto made = zeroed<carom_room>();
  made.order = Room{}.order;
  return made;
}

carom_reflector defaultReflector() {
  auto made = zeroed<carom_reflector>();
  made.normal[2] = 1.0;
  return made;
}

carom_reverb defaultReverb() {
  return toC(ReverbSettings{});
}

Result<CSettings> settingsFrom(const carom_settings* input) {
  if (input == nullptr) return CSettings();
  const Result<carom_settings> read = readStruct(input, defaultSettings(), "carom_settings");
  if (!read) return read.error();
  if (const Status checked = checkSettings(*read); !checked) return checked.error();
  Result<SoundSettings> sound = soundFrom(*read);
  if (!sound) return sound.error();
  return CSettings{.sound = *std::move(sound),
                   .world = {.restSpeed = read->rest_speed,
                             .radiators = static_cast<RadiatorChoice>(read->radiators),
                             .metresPerUnit = read->metres_per_unit}};
}

Result<Room> roomFrom(const carom_room* input) {
  const Result<carom_room> read = readStruct(input, defaultRoom(), "carom_room");
  if (!read) return read.error();
  const Status checked = checkChoices({{"carom_room.reserved", read->reserved, 1}});
  if (!checked) return checked.error();
  Room room;
  room.order = read->order;
  if (const Status reflectors = readReflectors(*read, room); !reflectors)
    return Error{"carom_room: " + reflectors.error().message};
  return room;
}

Result<ReverbSettings> reverbFrom(const carom_reverb* input) {
  const Result<carom_reverb> read = readStruct(input, defaultReverb(), "carom_reverb");
  if (!read) return read.error();
  const Status checked = checkChoices({{"carom_reverb.includes_air", read->includes_air, 2},
                                       {"carom_reverb.reserved", read->reserved, 1}});
  if (!checked) return checked.error();
  ReverbSettings reverb{.volume = read->volume,
                        .surface = read->surface,
                        .decayTimeAt16kHz = read->decay_time_16khz,
                        .includesAir = read->includes_air != 0,
                        .onset = read->onset,
                        .gain = read->gain,
                        .speedOfSound = read->speed_of_sound,
                        .silence = read->silence};
  std::ranges::copy(read->decay_times, reverb.decayTimes.begin());
  return reverb;
}

carom_reverb toC(const ReverbSettings& reverb) {
  auto made = zeroed<carom_reverb>();
  made.volume = reverb.volume;
  made.surface = reverb.surface;
  std::ranges::copy(reverb.decayTimes, made.decay_times);
  made.decay_time_16khz = reverb.decayTimeAt16kHz;
  made.includes_air = reverb.includesAir ? 1 : 0;
  made.onset = reverb.onset;
  made.gain = reverb.gain;
  made.speed_of_sound = reverb.speedOfSound;
  made.silence = reverb.silence;
  return made;
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
  auto made = zeroed<carom_surface>();
  made.name = surface.name.data();
  made.source = surface.source.data();
  std::ranges::copy(surface.absorption.coefficients, made.absorption);
  return made;
}

}  // namespace carom::plugin
