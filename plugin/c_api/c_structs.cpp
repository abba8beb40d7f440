#include "plugin/c_api/c_structs.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace carom::plugin {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// True if no padding follows the last field, which an older caller would have left uninitialised.
template <class Struct, class Field>
constexpr bool endsWith(Field Struct::*, std::size_t offset) {
  return offset + sizeof(Field) == sizeof(Struct);
}
static_assert(endsWith(&carom_settings::modes, offsetof(carom_settings, modes)));
static_assert(endsWith(&carom_listener::reserved, offsetof(carom_listener, reserved)));
static_assert(endsWith(&carom_body::reserved, offsetof(carom_body, reserved)));
static_assert(endsWith(&carom_event::reserved, offsetof(carom_event, reserved)));
static_assert(endsWith(&carom_material::damping_beta, offsetof(carom_material, damping_beta)));
static_assert(endsWith(&carom_statistics::modes, offsetof(carom_statistics, modes)));
// No padding follows the last field of the first version either, where the struct ended then.
static_assert(offsetof(carom_settings, reserved) + sizeof(std::int32_t) ==
              kSizes<carom_settings>.first);
static_assert(offsetof(carom_material, restitution) + sizeof(double) ==
              kSizes<carom_material>.first);
static_assert(offsetof(carom_statistics, unsupported_contacts) + sizeof(std::uint64_t) ==
              kSizes<carom_statistics>.first);

/// Returns the `size` in a caller's struct, whatever its version.
std::size_t sizeOf(const void* given) {
  std::size_t size = 0;
  std::memcpy(&size, given, sizeof size);
  return size;
}

std::string whyNotSize(const void* given, StructSizes sizes, const std::string& name) {
  if (given == nullptr) return name + " is NULL";
  const std::size_t size = sizeOf(given);
  if (size == sizes.first || (size >= sizes.now && size <= sizes.now + kMostGrowth)) return {};
  return name + ".size is " + std::to_string(size) + "; expected sizeof(" + name + "), which is " +
         std::to_string(sizes.now) + " in this version";
}

bool isZero(const std::byte* bytes, std::size_t count) {
  return std::all_of(bytes, bytes + count, [](std::byte byte) { return byte == std::byte{0}; });
}

/// A field with a value from 0 to count - 1; the count of a reserved field is 1.
struct Choice {
  const char* field;
  std::int32_t value;
  std::int32_t count;
};

std::string whyNot(std::initializer_list<Choice> choices) {
  for (const Choice& choice : choices) {
    if (choice.value >= 0 && choice.value < choice.count) continue;
    const std::string range = choice.count == 1 ? "0" : "0 to " + std::to_string(choice.count - 1);
    return std::string(choice.field) + " is " + std::to_string(choice.value) + "; expected " +
           range;
  }
  return {};
}

Vec3 vectorFrom(const double (&given)[3]) {
  return {given[0], given[1], given[2]};
}

Quat quaternionFrom(const double (&given)[4]) {
  return {given[3], given[0], given[1], given[2]};
}

Result<Listener> listenerFrom(const carom_listener& given, const std::string& place) {
  const Result<carom_listener> read = readStruct(&given, defaultListener(), "carom_listener");
  if (!read) return Error{place + ": " + read.error().message};
  const std::string reason = whyNot(
      {{"carom_listener.format", read->format, 4}, {"carom_listener.reserved", read->reserved, 1}});
  if (!reason.empty()) return Error{place + ": " + reason};
  Listener listener;
  if (read->name != nullptr) listener.name = read->name;
  listener.position = vectorFrom(read->position);
  listener.orientation = quaternionFrom(read->orientation);
  listener.format = static_cast<ListenerFormat>(read->format);
  listener.spacing = read->spacing;
  listener.halfAngle = read->half_angle;
  if (!(read->pattern < 0.0)) listener.pattern = read->pattern;
  return listener;
}

/// Reads the listeners, which lie as far apart as the caller's struct is large.
Result<std::vector<Listener>> listenersFrom(const carom_settings& settings) {
  std::vector<Listener> listeners;
  if (settings.listener_count == 0) return SoundSettings{}.listeners;
  if (settings.listeners == nullptr)
    return Error{"carom_settings.listeners is NULL, and listener_count is " +
                 std::to_string(settings.listener_count)};
  const auto* const first = reinterpret_cast<const std::byte*>(settings.listeners);
  const std::size_t stride = sizeOf(first);
  for (std::size_t index = 0; index < settings.listener_count; ++index) {
    const std::string place = "listener " + std::to_string(index);
    const auto* const given = reinterpret_cast<const carom_listener*>(first + index * stride);
    if (sizeOf(given) != stride) return Error{place + ": its size is not that of the first"};
    Result<Listener> listener = listenerFrom(*given, place);
    if (!listener) return listener.error();
    listeners.push_back(*std::move(listener));
  }
  return listeners;
}

VoiceBudget budgetFrom(const carom_settings& given) {
  return {.cpuShare = given.cpu_share,
          .voices = given.voices,
          .buses = given.buses,
          .longestContact = given.longest_contact,
          .ringingBodies = given.ringing_bodies,
          .modes = given.modes};
}

SynthSettings synthFrom(const carom_settings& given) {
  SynthSettings synth;
  synth.sampleRate = given.sample_rate;
  synth.impulse = static_cast<ImpulseChoice>(given.impulse);
  synth.medium = {given.air_density, given.speed_of_sound};
  synth.audibleThreshold = given.audible_threshold;
  synth.doppler = given.doppler != 0;
  return synth;
}

std::string whyNotChoices(const carom_settings& given) {
  return whyNot({{"carom_settings.limiter", given.limiter, 2},
                 {"carom_settings.clock", given.clock, 2},
                 {"carom_settings.impulse", given.impulse, 2},
                 {"carom_settings.radiators", given.radiators, 2},
                 {"carom_settings.doppler", given.doppler, 2},
                 {"carom_settings.reserved", given.reserved, 1}});
}

SoundSettings settingsFrom(const carom_settings& given, std::vector<Listener> listeners) {
  SoundSettings settings;
  settings.synth = synthFrom(given);
  settings.listeners = std::move(listeners);
  settings.latency = given.latency;
  settings.clock = static_cast<SoundClock>(given.clock);
  settings.budget = budgetFrom(given);
  if (given.full_scale != 0.0) settings.fullScale = given.full_scale;
  if (given.limiter != 0)
    settings.limiter.emplace().ceiling = static_cast<float>(given.limiter_ceiling);
  return settings;
}

}  // namespace

Status readStruct(const void* given, void* known, StructSizes sizes, const char* name) {
  if (std::string reason = whyNotSize(given, sizes, name); !reason.empty()) return Error{reason};
  const auto* const bytes = static_cast<const std::byte*>(given);
  const std::size_t shared = std::min(sizes.now, sizeOf(given));
  if (!isZero(bytes + shared, sizeOf(given) - shared))
    return Error{std::string(name) + " sets a field that this version of the library, " +
                 std::to_string(CAROM_VERSION) + ", does not know"};
  std::memcpy(known, given, shared);
  return std::monostate{};
}

Status writeStruct(const void* known, void* given, StructSizes sizes, const char* name) {
  if (std::string reason = whyNotSize(given, sizes, name); !reason.empty()) return Error{reason};
  const std::size_t callers = sizeOf(given);
  std::memset(given, 0, callers);
  std::memcpy(given, known, std::min(sizes.now, callers));
  std::memcpy(given, &callers, sizeof callers);
  return std::monostate{};
}

carom_settings defaultSettings() {
  const SoundSettings settings;
  const WorldSoundSettings world;
  carom_settings given = {};
  given.size = sizeof given;
  given.sample_rate = settings.synth.sampleRate;
  given.latency = settings.latency;
  given.air_density = settings.synth.medium.density;
  given.speed_of_sound = settings.synth.medium.speedOfSound;
  given.audible_threshold = settings.synth.audibleThreshold;
  given.cpu_share = settings.budget.cpuShare;
  given.voices = settings.budget.voices;
  given.buses = settings.budget.buses;
  given.longest_contact = settings.budget.longestContact;
  given.limiter_ceiling = static_cast<double>(LimiterSettings{}.ceiling);
  given.rest_speed = world.restSpeed;
  given.clock = static_cast<std::int32_t>(settings.clock);
  given.impulse = static_cast<std::int32_t>(settings.synth.impulse);
  given.radiators = static_cast<std::int32_t>(world.radiators);
  given.doppler = settings.synth.doppler ? 1 : 0;
  given.ringing_bodies = settings.budget.ringingBodies;
  given.modes = settings.budget.modes;
  return given;
}

carom_listener defaultListener() {
  const Listener listener;
  carom_listener given = {};
  given.size = sizeof given;
  given.orientation[3] = 1.0;
  given.spacing = listener.spacing;
  given.half_angle = listener.halfAngle;
  given.pattern = -1.0;
  return given;
}

carom_body defaultBody() {
  const SoundBody body;
  carom_body given = {};
  given.size = sizeof given;
  given.mass = body.mass;
  given.edge_radius = body.edgeRadius;
  return given;
}

carom_event defaultEvent() {
  carom_event given = {};
  given.size = sizeof given;
  given.normal[0] = 1.0;
  given.radius = kInfinity;
  given.other_radius = kInfinity;
  given.body_orientation[3] = 1.0;
  return given;
}

Result<CSettings> settingsFrom(const carom_settings* given) {
  if (given == nullptr) return CSettings();
  const Result<carom_settings> read = readStruct(given, defaultSettings(), "carom_settings");
  if (!read) return read.error();
  if (std::string reason = whyNotChoices(*read); !reason.empty()) return Error{reason};
  Result<std::vector<Listener>> listeners = listenersFrom(*read);
  if (!listeners) return listeners.error();
  return CSettings{
      settingsFrom(*read, *std::move(listeners)),
      {.restSpeed = read->rest_speed, .radiators = static_cast<RadiatorChoice>(read->radiators)}};
}

Result<ImpulseEvent> eventFrom(const carom_event* given) {
  const Result<carom_event> read = readStruct(given, defaultEvent(), "carom_event");
  if (!read) return read.error();
  const std::string reason =
      whyNot({{"carom_event.has_applied_impulse", read->has_applied_impulse, 2},
              {"carom_event.reserved", read->reserved, 1}});
  if (!reason.empty()) return Error{reason};
  return ImpulseEvent{.time = read->time,
                      .body = read->body,
                      .other = read->other,
                      .impulse = vectorFrom(read->impulse),
                      .appliedImpulse = vectorFrom(read->applied_impulse),
                      .hasAppliedImpulse = read->has_applied_impulse != 0,
                      .position = vectorFrom(read->position),
                      .normal = vectorFrom(read->normal),
                      .approachSpeed = read->approach_speed,
                      .effectiveMass = read->effective_mass,
                      .radius = read->radius,
                      .otherRadius = read->other_radius,
                      .bodyPosition = vectorFrom(read->body_position),
                      .bodyOrientation = quaternionFrom(read->body_orientation),
                      .bodyVelocity = vectorFrom(read->body_velocity),
                      .bodyAngularVelocity = vectorFrom(read->body_angular_velocity)};
}

Result<Material> materialFrom(const carom_material* given) {
  const Result<carom_material> read = readStruct(given, carom_material{}, "carom_material");
  if (!read) return read.error();
  const Material* known = read->name != nullptr ? findMaterial(read->name) : nullptr;
  return Material{.name = read->name != nullptr ? read->name : "",
                  .density = read->density,
                  .youngsModulus = read->youngs_modulus,
                  .poissonsRatio = read->poissons_ratio,
                  .restitution = read->restitution,
                  .dampingAlpha = read->damping_alpha,
                  .dampingBeta = read->damping_beta,
                  .roughness = known != nullptr ? known->roughness : Roughness{}};
}

Result<Material> materialNamed(const char* name) {
  const Material* const found = name == nullptr ? nullptr : findMaterial(name);
  if (found != nullptr) return *found;
  std::string message = name == nullptr
                            ? "the name of a material is NULL; expected one of"
                            : "there is no material '" + std::string(name) + "'; there are";
  const char* separator = " ";
  for (const Material& material : builtInMaterials()) {
    message += separator + material.name;
    separator = ", ";
  }
  return Error{message};
}

carom_material toC(const Material& material) {
  return {.size = sizeof(carom_material),
          .name = material.name.c_str(),
          .density = material.density,
          .youngs_modulus = material.youngsModulus,
          .poissons_ratio = material.poissonsRatio,
          .restitution = material.restitution,
          .damping_alpha = material.dampingAlpha,
          .damping_beta = material.dampingBeta};
}

carom_statistics toC(const SoundStatistics& statistics) {
  carom_statistics given = {};
  given.size = sizeof given;
  given.events = statistics.events;
  given.immovable = statistics.immovable;
  given.rejected = statistics.rejected;
  given.inaudible = statistics.inaudible;
  given.stolen = statistics.stolen;
  given.over_budget = statistics.overBudget;
  given.no_bus = statistics.noBus;
  given.too_long = statistics.tooLong;
  given.skipped = statistics.skipped;
  given.queue_faults = statistics.queueFaults;
  given.late = statistics.late;
  given.stalls = statistics.stalls;
  given.jumps = statistics.jumps;
  given.voices = statistics.voices;
  given.buses = statistics.buses;
  given.cpu_share = statistics.cpuShare;
  given.worst_block = statistics.worstBlock;
  given.gain_reduction = statistics.gainReduction;
  given.rings = statistics.rings;
  given.modal_voices_exhausted = statistics.modalVoicesExhausted;
  given.ringing = statistics.ringing;
  given.modes = statistics.modes;
  given.solved_shapes = statistics.solvedShapes;
  given.shapes_solved_late = statistics.shapesSolvedInStep;
  given.unsolved_bodies = statistics.unsolvedBodies;
  given.links = statistics.links;
  given.unsupported_contacts = statistics.unsupportedContacts;
  return given;
}

}  // namespace carom::plugin
