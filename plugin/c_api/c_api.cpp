// The functions of carom.h on sounds.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#if CAROM_BULLET
#include <LinearMath/btScalar.h>
#endif

#include "carom/carom.h"
#include "carom/event_sound.h"
#include "carom/sound.h"
#include "plugin/c_api/c_body.h"
#include "plugin/c_api/c_error.h"
#include "plugin/c_api/c_settings.h"
#include "plugin/c_api/c_structs.h"

using namespace carom::plugin;
using carom::Error;
using carom::EventSound;
using carom::Result;
using carom::Sound;
using carom::SoundOutput;
using carom::SoundStatistics;
using carom::Status;

static_assert(CAROM_VERSION_MAJOR == CAROM_PROJECT_MAJOR &&
                  CAROM_VERSION_MINOR == CAROM_PROJECT_MINOR &&
                  CAROM_VERSION_PATCH == CAROM_PROJECT_PATCH,
              "carom.h has another version than project() in CMakeLists.txt");

/// The object that a handle points to.
struct carom_sound {
  template <class Kind>
  carom_sound(Kind made, carom::RadiatorChoice radiators)
      : sound(std::move(made)), reader(radiators) {}

  SoundOutput& output() {
    return std::visit([](auto& kind) -> SoundOutput& { return kind; }, sound);
  }
  const SoundOutput& output() const {
    return std::visit([](const auto& kind) -> const SoundOutput& { return kind; }, sound);
  }

  std::variant<EventSound, Sound> sound;
  CBodyReader reader;  // for bodies of posted events
};

namespace {

constexpr double kMostGain = 1000.0;

carom_status isNull(const char* sentence) noexcept {
  return failed(CAROM_ERROR_ARGUMENT, sentence);
}

/// Runs `action`, which returns a Status, on a sound of either kind.
template <class Handle, class Action>
carom_status onAny(Handle* handle, carom_status refused, Action&& action) noexcept {
  if (handle == nullptr) return isNull("the carom_sound is NULL");
  return guarded([&] { return outcome(action(handle->output()), refused); });
}

/// Runs `action`, which returns nothing, on a sound of either kind.
template <class Action>
carom_status always(carom_sound* handle, Action&& action) noexcept {
  return onAny(handle, CAROM_ERROR_ARGUMENT, [&](SoundOutput& output) -> Status {
    action(output);
    return std::monostate{};
  });
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

/// Makes a handle of the sound that `make` makes from settings.
template <class Make>
carom_status create(const carom_settings* input, carom_sound** handle, Make&& make) noexcept {
  if (handle == nullptr) return isNull("the carom_sound** is NULL");
  *handle = nullptr;
  return guarded([&] {
    const Result<CSettings> settings = settingsFrom(input);
    if (!settings) return outcome(settings.error());
    auto sound = make(*settings);
    if (!sound) return outcome(sound.error());
    *handle = std::make_unique<carom_sound>(*std::move(sound), settings->world.radiators).release();
    return static_cast<carom_status>(CAROM_OK);
  });
}

/// A target of Sound::assign, or an error where the caller's is NULL.
template <class Object>
Result<const Object*> targetOf(const Object* object) {
  if (object == nullptr) return Error{"the body or shape is NULL"};
  return object;
}

/// Assigns to what `target` points to.
template <class Object>
carom_status assign(carom_sound* handle, const Object* target,
                    const carom_body_sound* input) noexcept {
  return onKind<Sound>(handle, [&](Sound& sound) -> Status {
    const Result<const Object*> object = targetOf(target);
    if (!object) return object.error();
    const Result<carom::BodySound> read = bodySoundFrom(input);
    if (!read) return read.error();
    return sound.assign(**object, *read);
  });
}

template <class Object>
carom_status unassign(carom_sound* handle, const Object* target) noexcept {
  return onKind<Sound>(handle, [&](Sound& sound) -> Status {
    const Result<const Object*> object = targetOf(target);
    if (!object) return object.error();
    return sound.unassign(**object);
  });
}

/// Returns the quaternion x, y, z, w of a caller; that of the world for NULL.
carom::Quat orientationFrom(const double* numbers) {
  if (numbers == nullptr) return carom::Quat::Identity();
  return carom::Quat(numbers[3], numbers[0], numbers[1], numbers[2]);
}

Status done() {
  return std::monostate{};
}

/// Writes a text of the statistics into a buffer, cut short where it is longer; returns its length.
template <class TextOf>
std::size_t writeText(const carom_sound* sound, std::span<char> buffer, TextOf textOf) noexcept {
  std::size_t length = 0;
  (void)onAny(sound, CAROM_ERROR_ARGUMENT, [&](const SoundOutput&) {
    const std::string whole = textOf(*sound);
    length = whole.size();
    if (buffer.data() != nullptr && !buffer.empty()) {
      const std::size_t part = std::min(length, buffer.size() - 1);
      std::memcpy(buffer.data(), whole.data(), part);
      buffer[part] = '\0';
    }
    return done();
  });
  return length;
}

}  // namespace

extern "C" {

int32_t carom_version(void) noexcept {
  return CAROM_VERSION;
}

size_t carom_bullet_scalar_size(void) noexcept {
#if CAROM_BULLET
  return sizeof(btScalar);
#else
  return 0;
#endif
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
  return lastFailure();
}

carom_status carom_create(const carom_settings* settings, carom_sound** sound) noexcept {
  return create(settings, sound,
                [](const CSettings& wanted) { return EventSound::create(wanted.sound); });
}

carom_status carom_attach(btDynamicsWorld* world, const carom_settings* settings,
                          carom_sound** sound) noexcept {
  return create(settings, sound, [&](const CSettings& wanted) -> Result<Sound> {
    if (world == nullptr) return Error{"the btDynamicsWorld is NULL"};
    return Sound::attach(*world, wanted.sound, wanted.world);
  });
}

carom_status carom_destroy(carom_sound* sound) noexcept {
  if (sound == nullptr) return CAROM_OK;
  const std::unique_ptr<carom_sound> owner(sound);
  return onAny(sound, CAROM_ERROR_FILE, [](SoundOutput& output) { return output.close(); });
}

carom_status carom_set_body(carom_sound* sound, uint32_t id, const carom_body* body) noexcept {
  return onKind<EventSound>(sound, [&](EventSound& events) -> Status {
    const Result<carom::SoundBody> read = sound->reader.read(body);
    if (!read) return read.error();
    return events.setBody(id, *read);
  });
}

carom_status carom_remove_body(carom_sound* sound, uint32_t id) noexcept {
  return onKind<EventSound>(sound, [&](EventSound& events) {
    events.removeBody(id);
    return done();
  });
}

carom_status carom_post(carom_sound* sound, const carom_event* event) noexcept {
  return onKind<EventSound>(sound, [&](EventSound& events) -> Status {
    const Result<carom::ImpulseEvent> read = eventFrom(event);
    if (!read) return read.error();
    events.post(*read);
    return done();
  });
}

carom_status carom_update_contact(carom_sound* sound, const carom_contact* contact) noexcept {
  return onKind<EventSound>(sound, [&](EventSound& events) -> Status {
    const Result<carom::ContactState> read = contactFrom(contact);
    if (!read) return read.error();
    events.updateContact(*read);
    return done();
  });
}

carom_status carom_move_body(carom_sound* sound, uint32_t id, double seconds,
                             const double position[3], const double orientation[4]) noexcept {
  return onKind<EventSound>(sound, [&](EventSound& events) -> Status {
    if (position == nullptr) return Error{"the position of the body is NULL"};
    const carom::Vec3 place(position[0], position[1], position[2]);
    return events.moveBody(id, {seconds, place, orientationFrom(orientation)});
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

carom_status carom_assign_body(carom_sound* sound, const btCollisionObject* body,
                               const carom_body_sound* body_sound) noexcept {
  return assign(sound, body, body_sound);
}

carom_status carom_assign_shape(carom_sound* sound, const btCollisionShape* shape,
                                const carom_body_sound* body_sound) noexcept {
  return assign(sound, shape, body_sound);
}

carom_status carom_assign_user_index(carom_sound* sound, int user_index,
                                     const carom_body_sound* body_sound) noexcept {
  const carom::UserIndex target{user_index};
  return assign(sound, &target, body_sound);
}

carom_status carom_unassign_body(carom_sound* sound, const btCollisionObject* body) noexcept {
  return unassign(sound, body);
}

carom_status carom_unassign_shape(carom_sound* sound, const btCollisionShape* shape) noexcept {
  return unassign(sound, shape);
}

carom_status carom_unassign_user_index(carom_sound* sound, int user_index) noexcept {
  const carom::UserIndex target{user_index};
  return unassign(sound, &target);
}

carom_status carom_material_of(carom_sound* sound, const btCollisionObject* body,
                               carom_material* material, int32_t* is_guessed,
                               double* density) noexcept {
  return onKind<Sound>(sound, [&](Sound& world) -> Status {
    if (body == nullptr) return Error{"the body is NULL"};
    const auto found = world.materialOf(*body);
    if (!found) return found.error();
    static thread_local carom::Material told;  // has the name
    static thread_local carom_roughness roughness;
    told = found->material;
    roughness = toC(told.roughness);
    carom_material shown = toC(told);
    shown.roughness = &roughness;
    if (const Status written = writeStruct(shown, material, "carom_material"); !written)
      return written;
    if (is_guessed != nullptr) *is_guessed = found->isGuessed ? 1 : 0;
    if (density != nullptr) *density = found->density;
    return done();
  });
}

carom_status carom_prepare_bodies(carom_sound* sound) noexcept {
  return onKind<Sound>(sound, [](Sound& world) {
    world.prepare();
    return done();
  });
}

carom_status carom_on_collision(carom_sound* sound, carom_collision_function function,
                                void* user) noexcept {
  return onKind<Sound>(sound, [&](Sound& world) {
    if (function == nullptr) return world.onCollision(nullptr);
    return world.onCollision([function, user](const carom::SoundCollision& collision) {
      std::vector<double> peaks;
      std::vector<double> levels;
      for (const carom::HeardCollision& heard : collision.heard) {
        peaks.push_back(heard.peak);
        levels.push_back(heard.level);
      }
      carom_collision shown = toC(collision);
      shown.peaks = peaks.data();
      shown.levels = levels.data();
      function(user, &shown);
    });
  });
}

carom_status carom_set_listener(carom_sound* sound, size_t listener, const double position[3],
                                const double orientation[4]) noexcept {
  if (position == nullptr) return isNull("the position of the listener is NULL");
  const carom::Vec3 place(position[0], position[1], position[2]);
  const carom::Quat turn = orientationFrom(orientation);
  return onAny(sound, CAROM_ERROR_ARGUMENT,
               [&](SoundOutput& output) { return output.setListener(place, turn, listener); });
}

double carom_time(const carom_sound* sound) noexcept {
  return sound == nullptr ? 0.0 : sound->output().time();
}

carom_status carom_pause(carom_sound* sound) noexcept {
  return always(sound, [](SoundOutput& output) { output.pause(); });
}

carom_status carom_set_time_scale(carom_sound* sound, double scale) noexcept {
  return onAny(sound, CAROM_ERROR_ARGUMENT,
               [&](SoundOutput& output) { return output.setTimeScale(scale); });
}

carom_status carom_play(carom_sound* sound) noexcept {
  return onAny(sound, CAROM_ERROR_DEVICE, [](SoundOutput& output) { return output.play(); });
}

int32_t carom_is_playing(const carom_sound* sound) noexcept {
  return sound != nullptr && sound->output().isPlaying() ? 1 : 0;
}

carom_status carom_prepare_rendering(carom_sound* sound, double sample_rate) noexcept {
  return onAny(sound, CAROM_ERROR_ARGUMENT,
               [&](SoundOutput& output) { return output.prepareRendering(sample_rate); });
}

carom_status carom_stop(carom_sound* sound) noexcept {
  return always(sound, [](SoundOutput& output) { output.stop(); });
}

carom_status carom_record(carom_sound* sound, const char* path) noexcept {
  if (path == nullptr) return isNull("the path of the recording is NULL");
  return onAny(sound, CAROM_ERROR_FILE,
               [&](SoundOutput& output) { return output.record(filePath(path)); });
}

carom_status carom_record_run(carom_sound* sound, const char* path) noexcept {
  if (path == nullptr) return isNull("the path of the run is NULL");
  return onAny(sound, CAROM_ERROR_FILE,
               [&](SoundOutput& output) { return output.recordRun(filePath(path)); });
}

carom_status carom_finish_run(carom_sound* sound) noexcept {
  return onAny(sound, CAROM_ERROR_FILE, [](SoundOutput& output) { return output.finishRun(); });
}

carom_status carom_keep_run(carom_sound* sound, double seconds) noexcept {
  return onAny(sound, CAROM_ERROR_ARGUMENT,
               [&](SoundOutput& output) { return output.keepRun(seconds); });
}

carom_status carom_save_run(carom_sound* sound, const char* path) noexcept {
  if (path == nullptr) return isNull("the path of the run is NULL");
  return onAny(sound, CAROM_ERROR_FILE,
               [&](SoundOutput& output) { return output.saveRun(filePath(path)); });
}

carom_status carom_finish_recording(carom_sound* sound) noexcept {
  return onAny(sound, CAROM_ERROR_FILE,
               [](SoundOutput& output) { return output.finishRecording(); });
}

carom_status carom_set_gain(carom_sound* sound, double gain) noexcept {
  return onAny(sound, CAROM_ERROR_ARGUMENT, [&](SoundOutput& output) -> Status {
    if (!(gain >= 0.0 && gain <= kMostGain))
      return Error{"the gain is " + std::to_string(gain) + "; expected 0 to 1000"};
    output.setGain(gain);
    return done();
  });
}

carom_status carom_set_muted(carom_sound* sound, int32_t muted) noexcept {
  return always(sound, [&](SoundOutput& output) { output.setMuted(muted != 0); });
}

carom_status carom_get_statistics(const carom_sound* sound, carom_statistics* statistics) noexcept {
  return onAny(sound, CAROM_ERROR_ARGUMENT, [&](const SoundOutput& output) {
    return writeStruct(toC(output.statistics()), statistics, "carom_statistics");
  });
}

size_t carom_unsolved_reason(const carom_sound* sound, char* text, size_t size) noexcept {
  return writeText(sound, {text, size}, [](const carom_sound& told) {
    return told.output().statistics().unsolvedReason;
  });
}

size_t carom_report(const carom_sound* sound, char* text, size_t size) noexcept {
  return writeText(sound, {text, size},
                   [](const carom_sound& told) { return told.output().report(); });
}

size_t carom_warning(const carom_sound* sound, char* text, size_t size) noexcept {
  return writeText(sound, {text, size},
                   [](const carom_sound& told) { return told.output().statistics().warning; });
}

size_t carom_recording_error(const carom_sound* sound, char* text, size_t size) noexcept {
  return writeText(sound, {text, size}, [](const carom_sound& told) {
    return told.output().statistics().recordingError;
  });
}

size_t carom_channel_count(const carom_sound* sound) noexcept {
  return sound == nullptr ? 0 : sound->output().channelCount();
}

double carom_sample_rate(const carom_sound* sound) noexcept {
  return sound == nullptr ? 0.0 : sound->output().sampleRate();
}

size_t carom_frames_ready(const carom_sound* sound) noexcept {
  return sound == nullptr ? 0 : sound->output().framesReady();
}

carom_status carom_capture(carom_sound* sound) noexcept {
  return onAny(sound, CAROM_ERROR_ARGUMENT, [](SoundOutput& output) { return output.capture(); });
}

size_t carom_captured_frames(const carom_sound* sound) noexcept {
  return sound == nullptr ? 0 : sound->output().capturedFrames();
}

size_t carom_take_captured(carom_sound* sound, float* samples, size_t count) noexcept {
  if (sound == nullptr || samples == nullptr) return 0;
  return sound->output().takeCaptured({samples, count});
}

size_t carom_output_delay(const carom_sound* sound) noexcept {
  return sound == nullptr ? 0 : sound->output().outputDelay();
}

carom_status carom_render(carom_sound* sound, float* const* channels, size_t channel_count,
                          size_t frames) noexcept {
  if (sound == nullptr || channels == nullptr) return CAROM_ERROR_ARGUMENT;
  if (channel_count != carom_channel_count(sound)) return CAROM_ERROR_ARGUMENT;
  const std::span<float* const> to(channels, channel_count);
  if (std::ranges::find(to, nullptr) != to.end()) return CAROM_ERROR_ARGUMENT;
  sound->output().render(to, frames);
  return CAROM_OK;
}

carom_status carom_render_interleaved(carom_sound* sound, float* samples, size_t channel_count,
                                      size_t frames) noexcept {
  if (sound == nullptr || samples == nullptr) return CAROM_ERROR_ARGUMENT;
  if (channel_count != carom_channel_count(sound)) return CAROM_ERROR_ARGUMENT;
  sound->output().renderInterleaved(samples, frames);
  return CAROM_OK;
}

}  // extern "C"
