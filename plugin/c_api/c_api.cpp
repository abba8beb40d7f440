#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <memory>
#include <new>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <unordered_map>
#include <utility>
#include <variant>

#include <LinearMath/btScalar.h>

#include "carom/audio/modal_model_file.h"
#include "carom/carom.h"
#include "carom/event_sound.h"
#include "carom/sound.h"
#include "plugin/c_api/c_body.h"
#include "plugin/c_api/c_structs.h"

using carom::Error;
using carom::EventSound;
using carom::Material;
using carom::ModalModel;
using carom::Result;
using carom::Sound;
using carom::Status;
using carom::plugin::CBodyReader;

static_assert(CAROM_VERSION_MAJOR == CAROM_PROJECT_MAJOR &&
                  CAROM_VERSION_MINOR == CAROM_PROJECT_MINOR &&
                  CAROM_VERSION_PATCH == CAROM_PROJECT_PATCH,
              "carom.h has another version than project() in CMakeLists.txt");

/// The object that a handle points to.
struct carom_sound {
  template <class Kind>
  carom_sound(Kind made, carom::RadiatorChoice radiators)
      : sound(std::move(made)), reader(radiators) {}

  std::variant<EventSound, Sound> sound;
  CBodyReader reader;                                     // for bodies of posted events
  std::unordered_map<uint32_t, carom::SoundBody> bodies;  // as set last for posted events
};

struct carom_modes {
  std::shared_ptr<const ModalModel> model;
};

namespace {

constexpr double kMostGain = 1000.0;

// The only mutable global: a caller that makes a handle has none yet to keep a message in. Its size
// is fixed, so that a lack of memory can be reported.
thread_local std::array<char, 1024> lastMessage{};

carom_status failed(carom_status status, std::string_view message) noexcept {
  const std::size_t length = std::min(message.size(), lastMessage.size() - 1);
  std::copy_n(message.begin(), length, lastMessage.begin());
  lastMessage[length] = '\0';
  return status;
}

carom_status isNull(const char* argument) noexcept {
  return failed(CAROM_ERROR_ARGUMENT, std::string_view(argument));
}

/// Turns the Status of an action into a carom_status: `refused` if it is an error.
carom_status outcome(const Status& status, carom_status refused = CAROM_ERROR_ARGUMENT) {
  return status ? CAROM_OK : failed(refused, status.error().message);
}

/// Runs `action`, which returns a carom_status; its exceptions become one, too.
template <class Action>
carom_status guarded(Action&& action) noexcept {
  try {
    return action();
  } catch (const std::bad_alloc&) {
    return failed(CAROM_ERROR_MEMORY, "there is no memory left");
  } catch (const std::exception& exception) {
    return failed(CAROM_ERROR_INTERNAL, exception.what());
  } catch (...) {
    return failed(CAROM_ERROR_INTERNAL, "an exception of unknown kind");
  }
}

/// Runs `action`, which returns a Status, on a sound of either kind.
template <class Handle, class Action>
carom_status onAny(Handle* handle, carom_status refused, Action&& action) noexcept {
  if (handle == nullptr) return isNull("the carom_sound is NULL");
  return guarded([&] { return outcome(std::visit(action, handle->sound), refused); });
}

/// Runs `action`, which returns a Status, on a sound of one kind only.
template <class Kind, class Action>
carom_status onKind(carom_sound* handle, Action&& action) noexcept {
  if (handle == nullptr) return isNull("the carom_sound is NULL");
  Kind* const sound = std::get_if<Kind>(&handle->sound);
  if (sound == nullptr)
    return failed(CAROM_ERROR_KIND, std::is_same_v<Kind, Sound>
                                        ? "this call needs a sound of carom_attach"
                                        : "this call needs a sound of carom_create");
  return guarded([&] { return outcome(action(*sound)); });
}

/// Returns a number of a sound; 0 for NULL.
template <class Number, class Getter>
Number numberOf(const carom_sound* handle, Getter&& getter) noexcept {
  if (handle == nullptr) return Number{};
  return std::visit(getter, handle->sound);
}

/// Makes a handle of the sound that `make` makes from settings.
template <class Make>
carom_status create(const carom_settings* given, carom_sound** handle, Make&& make) noexcept {
  if (handle == nullptr) return isNull("the carom_sound** is NULL");
  *handle = nullptr;
  return guarded([&] {
    const Result<carom::plugin::CSettings> settings = carom::plugin::settingsFrom(given);
    if (!settings) return failed(CAROM_ERROR_ARGUMENT, settings.error().message);
    auto sound = make(settings->sound, settings->world);
    if (!sound) return failed(CAROM_ERROR_ARGUMENT, sound.error().message);
    *handle = std::make_unique<carom_sound>(*std::move(sound), settings->world.radiators).release();
    return static_cast<carom_status>(CAROM_OK);
  });
}

Result<Material> materialOf(const char* name) {
  return carom::plugin::materialNamed(name);
}

Result<Material> materialOf(const carom_material* material) {
  return carom::plugin::materialFrom(material);
}

Status setMaterial(Sound& sound, int userIndex, const Material& material) {
  return sound.assign(carom::UserIndex{userIndex}, {.material = material});
}

template <class Object>
Status setMaterial(Sound& sound, const Object* object, const Material& material) {
  if (object == nullptr) return Error{"the object or shape to be of a material is NULL"};
  return sound.assign(*object, {.material = material});
}

/// Sets a material, given by name or by numbers, for an object, a shape or a user index.
template <class Subject, class Source>
carom_status setMaterial(carom_sound* handle, Subject subject, Source source) noexcept {
  return onKind<Sound>(handle, [&](Sound& sound) -> Status {
    const Result<Material> material = materialOf(source);
    if (!material) return material.error();
    return setMaterial(sound, subject, *material);
  });
}

std::shared_ptr<const ModalModel> modelOf(const carom_modes* modes) {
  return modes == nullptr ? nullptr : modes->model;
}

Status setModes(Sound& sound, int userIndex, const carom_modes* modes) {
  return sound.assign(carom::UserIndex{userIndex}, {.modes = modelOf(modes)});
}

template <class Object>
Status setModes(Sound& sound, const Object* object, const carom_modes* modes) {
  if (object == nullptr) return Error{"the object or shape that is to ring is NULL"};
  return sound.assign(*object, {.modes = modelOf(modes)});
}

Status done() {
  return std::monostate{};
}

std::filesystem::path pathOf(const char* utf8) {
  return {reinterpret_cast<const char8_t*>(utf8)};
}

}  // namespace

extern "C" {

int32_t carom_version(void) noexcept {
  return CAROM_VERSION;
}

size_t carom_bullet_scalar_size(void) noexcept {
  return sizeof(btScalar);
}

const char* carom_status_text(carom_status status) noexcept {
  switch (status) {
    case CAROM_OK:
      return "done";
    case CAROM_ERROR_ARGUMENT:
      return "refused";
    case CAROM_ERROR_KIND:
      return "not for this kind of sound";
    case CAROM_ERROR_FILE:
      return "no such file";
    case CAROM_ERROR_DEVICE:
      return "no audio device";
    case CAROM_ERROR_MEMORY:
      return "no memory";
    case CAROM_ERROR_INTERNAL:
      return "fault of the library";
    default:
      return "unknown status";
  }
}

const char* carom_last_message(void) noexcept {
  return lastMessage.data();
}

carom_status carom_settings_init(carom_settings* settings, size_t size) noexcept {
  return guarded([&] {
    return outcome(carom::plugin::initStruct(carom::plugin::defaultSettings(), settings, size,
                                             "carom_settings"));
  });
}

carom_status carom_listener_init(carom_listener* listener, size_t size) noexcept {
  return guarded([&] {
    return outcome(carom::plugin::initStruct(carom::plugin::defaultListener(), listener, size,
                                             "carom_listener"));
  });
}

carom_status carom_body_init(carom_body* body, size_t size) noexcept {
  return guarded([&] {
    return outcome(
        carom::plugin::initStruct(carom::plugin::defaultBody(), body, size, "carom_body"));
  });
}

carom_status carom_event_init(carom_event* event, size_t size) noexcept {
  return guarded([&] {
    return outcome(
        carom::plugin::initStruct(carom::plugin::defaultEvent(), event, size, "carom_event"));
  });
}

size_t carom_material_count(void) noexcept {
  return carom::builtInMaterials().size();
}

carom_status carom_material_at(size_t index, carom_material* material) noexcept {
  return guarded([&] {
    const std::span<const Material> all = carom::builtInMaterials();
    if (index >= all.size())
      return failed(CAROM_ERROR_ARGUMENT, "there is no material " + std::to_string(index) +
                                              "; there are " + std::to_string(all.size()));
    return outcome(
        carom::plugin::writeStruct(carom::plugin::toC(all[index]), material, "carom_material"));
  });
}

carom_status carom_find_material(const char* name, carom_material* material) noexcept {
  return guarded([&] {
    const Result<Material> known = carom::plugin::materialNamed(name);
    if (!known) return failed(CAROM_ERROR_ARGUMENT, known.error().message);
    // From the table's own material, as its name stays valid.
    return outcome(carom::plugin::writeStruct(carom::plugin::toC(*carom::findMaterial(name)),
                                              material, "carom_material"));
  });
}

carom_status carom_load_modes(const char* path, carom_modes** modes) noexcept {
  if (modes == nullptr) return isNull("the carom_modes** is NULL");
  *modes = nullptr;
  if (path == nullptr) return isNull("the path of the modes is NULL");
  return guarded([&] {
    Result<ModalModel> model = carom::readModalModel(pathOf(path));
    if (!model) return failed(CAROM_ERROR_FILE, model.error().message);
    auto read = std::make_unique<carom_modes>();
    read->model = std::make_shared<const ModalModel>(*std::move(model));
    *modes = read.release();
    return static_cast<carom_status>(CAROM_OK);
  });
}

void carom_free_modes(carom_modes* modes) noexcept {
  const std::unique_ptr<carom_modes> owner(modes);
}

size_t carom_mode_count(const carom_modes* modes) noexcept {
  return modes == nullptr ? 0 : modes->model->modes.size();
}

carom_status carom_mode_at(const carom_modes* modes, size_t index, double* frequency,
                           double* decay_rate) noexcept {
  if (modes == nullptr) return isNull("the carom_modes is NULL");
  return guarded([&] {
    if (index >= carom_mode_count(modes))
      return failed(CAROM_ERROR_ARGUMENT, "there is no mode " + std::to_string(index) +
                                              "; there are " +
                                              std::to_string(carom_mode_count(modes)));
    const carom::Mode& mode = modes->model->modes[index];
    if (frequency != nullptr) *frequency = mode.frequency;
    if (decay_rate != nullptr) *decay_rate = mode.decayRate;
    return static_cast<carom_status>(CAROM_OK);
  });
}

carom_status carom_create(const carom_settings* settings, carom_sound** sound) noexcept {
  return create(settings, sound,
                [](const carom::SoundSettings& wanted, const carom::WorldSoundSettings&) {
                  return EventSound::create(wanted);
                });
}

carom_status carom_attach(btDynamicsWorld* world, const carom_settings* settings,
                          carom_sound** sound) noexcept {
  return create(settings, sound,
                [&](const carom::SoundSettings& wanted,
                    const carom::WorldSoundSettings& worldSettings) -> Result<Sound> {
                  if (world == nullptr) return Error{"the btDynamicsWorld is NULL"};
                  return Sound::attach(*world, wanted, worldSettings);
                });
}

carom_status carom_destroy(carom_sound* sound) noexcept {
  if (sound == nullptr) return CAROM_OK;
  const std::unique_ptr<carom_sound> owner(sound);
  return onAny(sound, CAROM_ERROR_FILE, [](auto& kind) { return kind.close(); });
}

carom_status carom_set_body(carom_sound* sound, uint32_t id, const carom_body* body) noexcept {
  return onKind<EventSound>(sound, [&](EventSound& events) -> Status {
    Result<carom::SoundBody> read = sound->reader.read(body);
    if (!read) return read.error();
    const auto known = sound->bodies.find(id);
    if (known != sound->bodies.end()) read->modal = known->second.modal;
    if (Status set = events.setBody(id, *read); !set) return set;
    sound->bodies.insert_or_assign(id, *std::move(read));
    return done();
  });
}

carom_status carom_set_body_modes(carom_sound* sound, uint32_t id,
                                  const carom_modes* modes) noexcept {
  return onKind<EventSound>(sound, [&](EventSound& events) -> Status {
    const auto known = sound->bodies.find(id);
    if (known == sound->bodies.end())
      return Error{"there is no body " + std::to_string(id) +
                   " to ring; carom_set_body comes first"};
    carom::SoundBody ringing = known->second;
    ringing.modal = modelOf(modes);
    if (Status set = events.setBody(id, ringing); !set) return set;
    known->second = std::move(ringing);
    return done();
  });
}

carom_status carom_remove_body(carom_sound* sound, uint32_t id) noexcept {
  return onKind<EventSound>(sound, [&](EventSound& events) {
    events.removeBody(id);
    sound->bodies.erase(id);
    return done();
  });
}

carom_status carom_post(carom_sound* sound, const carom_event* event) noexcept {
  return onKind<EventSound>(sound, [&](EventSound& events) -> Status {
    const Result<carom::ImpulseEvent> read = carom::plugin::eventFrom(event);
    if (!read) return read.error();
    events.post(*read);
    return done();
  });
}

carom_status carom_advance(carom_sound* sound, double seconds) noexcept {
  return onKind<EventSound>(sound, [&](EventSound& events) -> Status {
    if (!(std::abs(seconds) <= 1e9))
      return Error{"the time is " + std::to_string(seconds) + "; expected seconds, at most 1e9"};
    events.advanceTo(seconds);
    return done();
  });
}

carom_status carom_set_object_material(carom_sound* sound, const btCollisionObject* object,
                                       const char* name) noexcept {
  return setMaterial(sound, object, name);
}

carom_status carom_set_shape_material(carom_sound* sound, const btCollisionShape* shape,
                                      const char* name) noexcept {
  return setMaterial(sound, shape, name);
}

carom_status carom_set_user_index_material(carom_sound* sound, int user_index,
                                           const char* name) noexcept {
  return setMaterial(sound, user_index, name);
}

carom_status carom_set_object_own_material(carom_sound* sound, const btCollisionObject* object,
                                           const carom_material* material) noexcept {
  return setMaterial(sound, object, material);
}

carom_status carom_set_shape_own_material(carom_sound* sound, const btCollisionShape* shape,
                                          const carom_material* material) noexcept {
  return setMaterial(sound, shape, material);
}

carom_status carom_set_user_index_own_material(carom_sound* sound, int user_index,
                                               const carom_material* material) noexcept {
  return setMaterial(sound, user_index, material);
}

carom_status carom_set_object_modes(carom_sound* sound, const btCollisionObject* object,
                                    const carom_modes* modes) noexcept {
  return onKind<Sound>(sound, [&](Sound& world) { return setModes(world, object, modes); });
}

carom_status carom_set_shape_modes(carom_sound* sound, const btCollisionShape* shape,
                                   const carom_modes* modes) noexcept {
  return onKind<Sound>(sound, [&](Sound& world) { return setModes(world, shape, modes); });
}

carom_status carom_set_user_index_modes(carom_sound* sound, int user_index,
                                        const carom_modes* modes) noexcept {
  return onKind<Sound>(sound, [&](Sound& world) { return setModes(world, user_index, modes); });
}

carom_status carom_prepare_bodies(carom_sound* sound) noexcept {
  return onKind<Sound>(sound, [](Sound& world) {
    world.prepare();
    return done();
  });
}

carom_status carom_set_listener(carom_sound* sound, size_t listener, const double position[3],
                                const double orientation[4]) noexcept {
  if (position == nullptr) return isNull("the position of the listener is NULL");
  const carom::Vec3 place(position[0], position[1], position[2]);
  carom::Quat turn = carom::Quat::Identity();
  if (orientation != nullptr)
    turn = carom::Quat(orientation[3], orientation[0], orientation[1], orientation[2]);
  return onAny(sound, CAROM_ERROR_ARGUMENT,
               [&](auto& kind) { return kind.setListener(place, turn, listener); });
}

double carom_time(const carom_sound* sound) noexcept {
  return numberOf<double>(sound, [](const auto& kind) { return kind.time(); });
}

carom_status carom_pause(carom_sound* sound) noexcept {
  return onAny(sound, CAROM_ERROR_ARGUMENT, [](auto& kind) {
    kind.pause();
    return done();
  });
}

carom_status carom_set_time_scale(carom_sound* sound, double scale) noexcept {
  return onAny(sound, CAROM_ERROR_ARGUMENT, [&](auto& kind) { return kind.setTimeScale(scale); });
}

carom_status carom_play(carom_sound* sound) noexcept {
  return onAny(sound, CAROM_ERROR_DEVICE, [](auto& kind) { return kind.play(); });
}

carom_status carom_prepare_rendering(carom_sound* sound, double sample_rate) noexcept {
  return onAny(sound, CAROM_ERROR_ARGUMENT,
               [&](auto& kind) { return kind.prepareRendering(sample_rate); });
}

carom_status carom_stop(carom_sound* sound) noexcept {
  return onAny(sound, CAROM_ERROR_ARGUMENT, [](auto& kind) {
    kind.stop();
    return done();
  });
}

carom_status carom_record(carom_sound* sound, const char* path) noexcept {
  if (path == nullptr) return isNull("the path of the recording is NULL");
  return onAny(sound, CAROM_ERROR_FILE, [&](auto& kind) { return kind.record(pathOf(path)); });
}

carom_status carom_finish_recording(carom_sound* sound) noexcept {
  return onAny(sound, CAROM_ERROR_FILE, [](auto& kind) { return kind.finishRecording(); });
}

carom_status carom_set_gain(carom_sound* sound, double gain) noexcept {
  return onAny(sound, CAROM_ERROR_ARGUMENT, [&](auto& kind) -> Status {
    if (!(gain >= 0.0 && gain <= kMostGain))
      return Error{"the gain is " + std::to_string(gain) + "; expected 0 to 1000"};
    kind.setGain(gain);
    return done();
  });
}

carom_status carom_set_muted(carom_sound* sound, int32_t muted) noexcept {
  return onAny(sound, CAROM_ERROR_ARGUMENT, [&](auto& kind) {
    kind.setMuted(muted != 0);
    return done();
  });
}

carom_status carom_get_statistics(const carom_sound* sound, carom_statistics* statistics) noexcept {
  return onAny(sound, CAROM_ERROR_ARGUMENT, [&](const auto& kind) {
    return carom::plugin::writeStruct(carom::plugin::toC(kind.statistics()), statistics,
                                      "carom_statistics");
  });
}

size_t carom_channel_count(const carom_sound* sound) noexcept {
  return numberOf<size_t>(sound, [](const auto& kind) { return kind.channelCount(); });
}

double carom_sample_rate(const carom_sound* sound) noexcept {
  return numberOf<double>(sound, [](const auto& kind) { return kind.sampleRate(); });
}

size_t carom_frames_ready(const carom_sound* sound) noexcept {
  return numberOf<size_t>(sound, [](const auto& kind) { return kind.framesReady(); });
}

size_t carom_output_delay(const carom_sound* sound) noexcept {
  return numberOf<size_t>(sound, [](const auto& kind) { return kind.outputDelay(); });
}

carom_status carom_render(carom_sound* sound, float* const* channels, size_t channel_count,
                          size_t frames) noexcept {
  if (sound == nullptr || channels == nullptr) return CAROM_ERROR_ARGUMENT;
  if (channel_count != carom_channel_count(sound)) return CAROM_ERROR_ARGUMENT;
  const std::span<float* const> to(channels, channel_count);
  if (std::ranges::find(to, nullptr) != to.end()) return CAROM_ERROR_ARGUMENT;
  std::visit([&](auto& kind) { kind.render(to, frames); }, sound->sound);
  return CAROM_OK;
}

carom_status carom_render_interleaved(carom_sound* sound, float* samples, size_t channel_count,
                                      size_t frames) noexcept {
  if (sound == nullptr || samples == nullptr) return CAROM_ERROR_ARGUMENT;
  if (channel_count != carom_channel_count(sound)) return CAROM_ERROR_ARGUMENT;
  std::visit([&](auto& kind) { kind.renderInterleaved(samples, frames); }, sound->sound);
  return CAROM_OK;
}

}  // extern "C"
