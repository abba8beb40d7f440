// The functions of carom.h that need no sound: structs with their defaults, materials, surfaces,
// modes and textures.

#include <bit>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "audio/propagation/hrtf.h"
#include "carom/audio/modal_model_file.h"
#include "carom/audio/normal_map.h"
#include "carom/carom.h"
#include "plugin/c_api/c_error.h"
#include "plugin/c_api/c_handles.h"
#include "plugin/c_api/c_settings.h"
#include "plugin/c_api/c_structs.h"

using namespace carom::plugin;
using carom::Error;
using carom::Material;
using carom::Result;
using carom::Status;
using carom::SurfaceTexture;

namespace {

/// Fills a struct with what `defaults` returns.
template <class Struct>
carom_status fill(Struct (*defaults)(), Struct* output, std::size_t size,
                  const char* name) noexcept {
  return guarded([&] { return outcome(initStruct(defaults(), output, size, name)); });
}

Error noSuch(const char* kind, std::size_t index, std::size_t count) {
  return Error{std::string("there is no ") + kind + " " + std::to_string(index) + "; there are " +
               std::to_string(count)};
}

/// Hands a new handle to the caller.
template <class Handle>
carom_status handOver(std::unique_ptr<Handle> made, Handle** handle) noexcept {
  *handle = made.release();
  return CAROM_OK;
}

/// Makes a texture's handle of what `make` returns; `refused` is the status of its errors.
template <class Make>
carom_status makeTexture(carom_texture** texture, carom_status refused, Make&& make) noexcept {
  if (texture == nullptr) return failed(CAROM_ERROR_ARGUMENT, "the carom_texture** is NULL");
  *texture = nullptr;
  return guarded([&] {
    Result<SurfaceTexture> made = make();
    if (!made) return failed(refused, made.error().message);
    auto handle = std::make_unique<carom_texture>();
    handle->texture = std::make_shared<const SurfaceTexture>(*std::move(made));
    return handOver(std::move(handle), texture);
  });
}

Result<SurfaceTexture> roughTexture(const carom_roughness* input, std::uint64_t seed) {
  const Result<carom::Roughness> roughness = roughnessFrom(input);
  if (!roughness) return roughness.error();
  return SurfaceTexture::rough(*roughness, seed);
}

Result<SurfaceTexture> textureOfSlopes(SurfaceTexture::Size size, const double* texel,
                                       const float* slopes) {
  if (texel == nullptr) return Error{"the size of a texel is NULL"};
  if (slopes == nullptr) return Error{"the slopes of the texture are NULL"};
  const auto isSide = [](std::size_t texels) {
    return std::has_single_bit(texels) && texels <= SurfaceTexture::kMostTexels;
  };
  // Slopes of a size that is refused are not read: there may be fewer.
  if (!isSide(size.width) || !isSide(size.height))
    return SurfaceTexture::ofSlopes(size, {texel[0], texel[1]}, {});
  std::vector<SurfaceTexture::Slope> read;
  read.reserve(size.width * size.height);
  for (std::size_t index = 0; index < size.width * size.height; ++index)
    read.emplace_back(slopes[2 * index], slopes[2 * index + 1]);
  return SurfaceTexture::ofSlopes(size, {texel[0], texel[1]}, std::move(read));
}

/// Makes the handle of a model that `read` reads; `refused` is the status of its errors.
template <class Read>
carom_status makeModes(carom_modes** modes, carom_status refused, Read&& read) noexcept {
  return guarded([&] {
    Result<carom::ModalModel> model = read();
    if (!model) return outcome(model.error(), refused);
    auto handle = std::make_unique<carom_modes>();
    handle->model = std::make_shared<const carom::ModalModel>(*std::move(model));
    return handOver(std::move(handle), modes);
  });
}

/// Returns the measurements of a struct whose arrays and counts are in order.
carom::HrtfMeasurements measurementsFrom(const carom_head_responses& input) {
  carom::HrtfMeasurements measurements;
  measurements.sampleRate = input.sample_rate;
  for (std::size_t index = 0; index < input.direction_count; ++index) {
    const double* const direction = input.directions + 3 * index;
    const float* const left = input.samples + 2 * index * input.length;
    carom::HrtfMeasurement& item = measurements.items.emplace_back();
    item.direction = {direction[0], direction[1], direction[2]};
    item.response[0].assign(left, left + input.length);
    item.response[1].assign(left + input.length, left + 2 * input.length);
    if (input.delays != nullptr)
      item.delay = {input.delays[2 * index], input.delays[2 * index + 1]};
  }
  return measurements;
}

Result<carom::HrtfSet> headFrom(const carom_head_responses* input, double sampleRate) {
  const auto read = readStruct(input, zeroed<carom_head_responses>(), "carom_head_responses");
  if (!read) return read.error();
  if (read->directions == nullptr || read->samples == nullptr)
    return Error{"the directions or the samples of carom_head_responses are NULL"};
  // Arrays of a size that is refused are not read: there may be less.
  using Limits = carom::HrtfMeasurements;
  if (read->direction_count > Limits::kMostDirections || read->length > Limits::kMostSamples ||
      2 * read->direction_count * read->length > Limits::kMostTogether)
    return Error{"carom_head_responses has " + std::to_string(read->direction_count) +
                 " directions of " + std::to_string(read->length) + " samples; expected up to " +
                 std::to_string(Limits::kMostDirections) + " of up to " +
                 std::to_string(Limits::kMostSamples) + ", and up to " +
                 std::to_string(Limits::kMostTogether) + " samples together"};
  return carom::HrtfSet::create(measurementsFrom(*read), sampleRate);
}

Result<carom::TextureCoordinates> coordinatesOf(const carom_mesh* input, const double* corners) {
  const Result<carom_mesh> read = readStruct(input, zeroed<carom_mesh>(), "carom_mesh");
  if (!read) return read.error();
  if (corners == nullptr) return Error{"the corners of the texture coordinates are NULL"};
  Result<carom::SurfaceMesh> mesh = meshFrom(*read);
  if (!mesh) return Error{"carom_mesh: " + mesh.error().message};
  std::vector<carom::TextureCoordinates::Corners> places(read->triangle_count);
  for (auto& triangle : places)
    for (carom::Vec2& corner : triangle) {
      corner = {corners[0], corners[1]};
      corners += 2;
    }
  return carom::TextureCoordinates::of(*std::move(mesh), std::move(places));
}

}  // namespace

extern "C" {

carom_status carom_settings_init(carom_settings* settings, size_t size) noexcept {
  return fill(defaultSettings, settings, size, "carom_settings");
}

carom_status carom_listener_init(carom_listener* listener, size_t size) noexcept {
  return fill(defaultListener, listener, size, "carom_listener");
}

carom_status carom_body_init(carom_body* body, size_t size) noexcept {
  return fill(defaultBody, body, size, "carom_body");
}

carom_status carom_body_sound_init(carom_body_sound* sound, size_t size) noexcept {
  return fill(defaultBodySound, sound, size, "carom_body_sound");
}

carom_status carom_event_init(carom_event* event, size_t size) noexcept {
  return fill(defaultEvent, event, size, "carom_event");
}

carom_status carom_contact_init(carom_contact* contact, size_t size) noexcept {
  return fill(defaultContact, contact, size, "carom_contact");
}

carom_status carom_room_init(carom_room* room, size_t size) noexcept {
  return fill(defaultRoom, room, size, "carom_room");
}

carom_status carom_reflector_init(carom_reflector* reflector, size_t size) noexcept {
  return fill(defaultReflector, reflector, size, "carom_reflector");
}

carom_status carom_reverb_init(carom_reverb* reverb, size_t size) noexcept {
  return fill(defaultReverb, reverb, size, "carom_reverb");
}

carom_status carom_roughness_init(carom_roughness* roughness, size_t size) noexcept {
  return fill(defaultRoughness, roughness, size, "carom_roughness");
}

carom_status carom_normal_map_init(carom_normal_map* map, size_t size) noexcept {
  return fill(defaultNormalMap, map, size, "carom_normal_map");
}

size_t carom_material_count(void) noexcept {
  return carom::builtInMaterials().size();
}

carom_status carom_material_at(size_t index, carom_material* material) noexcept {
  return guarded([&] {
    const std::span<const Material> all = carom::builtInMaterials();
    if (index >= all.size()) return outcome(noSuch("material", index, all.size()));
    return outcome(writeStruct(toC(all[index]), material, "carom_material"));
  });
}

carom_status carom_find_material(const char* name, carom_material* material) noexcept {
  return guarded([&] {
    const Result<Material> known = materialNamed(name);
    if (!known) return outcome(known.error());
    // From the table's own material, as its name stays valid.
    return outcome(writeStruct(toC(*carom::findMaterial(name)), material, "carom_material"));
  });
}

size_t carom_surface_count(void) noexcept {
  return carom::surfaceTable().size();
}

carom_status carom_surface_at(size_t index, carom_surface* surface) noexcept {
  return guarded([&] {
    const std::span<const carom::Surface> all = carom::surfaceTable();
    if (index >= all.size()) return outcome(noSuch("surface", index, all.size()));
    return outcome(writeStruct(toC(all[index]), surface, "carom_surface"));
  });
}

carom_status carom_find_surface(const char* name, carom_surface* surface) noexcept {
  return guarded([&] {
    const Result<const carom::Surface*> known = surfaceNamed(name);
    if (!known) return outcome(known.error());
    return outcome(writeStruct(toC(**known), surface, "carom_surface"));
  });
}

carom_status carom_default_surface(const char* material, carom_surface* surface) noexcept {
  return guarded([&] {
    const Result<Material> known = materialNamed(material);
    if (!known) return outcome(known.error());
    return outcome(writeStruct(toC(*carom::defaultSurface(known->name)), surface, "carom_surface"));
  });
}

carom_status carom_reverb_of_box(const carom_room* room, double speed_of_sound,
                                 carom_reverb* reverb) noexcept {
  return guarded([&] {
    const Result<carom::Room> read = roomFrom(room);
    if (!read) return outcome(read.error());
    const Result<carom::ReverbSettings> made = carom::reverbOfBox(*read, speed_of_sound);
    if (!made) return outcome(made.error());
    return outcome(writeStruct(toC(*made), reverb, "carom_reverb"));
  });
}

carom_status carom_load_modes(const char* path, carom_modes** modes) noexcept {
  if (modes == nullptr) return failed(CAROM_ERROR_ARGUMENT, "the carom_modes** is NULL");
  *modes = nullptr;
  if (path == nullptr) return failed(CAROM_ERROR_ARGUMENT, "the path of the modes is NULL");
  return makeModes(modes, CAROM_ERROR_FILE, [&] { return carom::readModalModel(filePath(path)); });
}

carom_status carom_read_modes(const void* bytes, size_t byte_count, const char* name,
                              carom_modes** modes) noexcept {
  if (modes == nullptr) return failed(CAROM_ERROR_ARGUMENT, "the carom_modes** is NULL");
  *modes = nullptr;
  if (bytes == nullptr) return failed(CAROM_ERROR_ARGUMENT, "the bytes of the modes are NULL");
  return makeModes(modes, CAROM_ERROR_ARGUMENT, [&] {
    const std::span<const std::byte> model(static_cast<const std::byte*>(bytes), byte_count);
    return carom::decodedModalModel(model, name == nullptr ? "modal model" : name);
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
  if (modes == nullptr) return failed(CAROM_ERROR_ARGUMENT, "the carom_modes is NULL");
  return guarded([&] {
    const std::size_t count = carom_mode_count(modes);
    if (index >= count) return outcome(noSuch("mode", index, count));
    const carom::Mode& mode = modes->model->modes[index];
    if (frequency != nullptr) *frequency = mode.frequency;
    if (decay_rate != nullptr) *decay_rate = mode.decayRate;
    return static_cast<carom_status>(CAROM_OK);
  });
}

carom_status carom_make_head(const carom_head_responses* responses, double sample_rate,
                             carom_head** head) noexcept {
  if (head == nullptr) return failed(CAROM_ERROR_ARGUMENT, "the carom_head** is NULL");
  *head = nullptr;
  return guarded([&] {
    Result<carom::HrtfSet> made = headFrom(responses, sample_rate);
    if (!made) return outcome(made.error());
    auto handle = std::make_unique<carom_head>();
    handle->set = std::make_shared<const carom::HrtfSet>(*std::move(made));
    return handOver(std::move(handle), head);
  });
}

void carom_free_head(carom_head* head) noexcept {
  const std::unique_ptr<carom_head> owner(head);
}

carom_status carom_make_rough_texture(const carom_roughness* roughness, uint64_t seed,
                                      carom_texture** texture) noexcept {
  return makeTexture(texture, CAROM_ERROR_ARGUMENT, [&] { return roughTexture(roughness, seed); });
}

carom_status carom_make_texture(size_t width, size_t height, const double texel[2],
                                const float* slopes, carom_texture** texture) noexcept {
  return makeTexture(texture, CAROM_ERROR_ARGUMENT, [&] {
    return textureOfSlopes({width, height}, texel, slopes);
  });
}

carom_status carom_load_normal_map(const char* path, const carom_normal_map* map,
                                   carom_texture** texture) noexcept {
  if (texture != nullptr) *texture = nullptr;
  if (path == nullptr) return failed(CAROM_ERROR_ARGUMENT, "the path of the normal map is NULL");
  const carom_status checked = guarded([&] {
    const auto settings = normalMapFrom(map);
    return settings ? carom_status{CAROM_OK} : outcome(settings.error());
  });
  if (checked != CAROM_OK) return checked;
  return makeTexture(texture, CAROM_ERROR_FILE,
                     [&] { return carom::readNormalMap(filePath(path), *normalMapFrom(map)); });
}

carom_status carom_read_normal_map(const void* bytes, size_t byte_count, const char* name,
                                   const carom_normal_map* map, carom_texture** texture) noexcept {
  return makeTexture(texture, CAROM_ERROR_ARGUMENT, [&]() -> Result<SurfaceTexture> {
    if (bytes == nullptr) return Error{"the bytes of the normal map are NULL"};
    const auto settings = normalMapFrom(map);
    if (!settings) return settings.error();
    const std::span<const std::byte> picture(static_cast<const std::byte*>(bytes), byte_count);
    return carom::normalMapFromBytes(picture, name == nullptr ? "normal map" : name, *settings);
  });
}

void carom_free_texture(carom_texture* texture) noexcept {
  const std::unique_ptr<carom_texture> owner(texture);
}

carom_status carom_make_texture_coordinates(const carom_mesh* mesh, const double* corners,
                                            carom_texture_coordinates** coordinates) noexcept {
  if (coordinates == nullptr)
    return failed(CAROM_ERROR_ARGUMENT, "the carom_texture_coordinates** is NULL");
  *coordinates = nullptr;
  return guarded([&] {
    Result<carom::TextureCoordinates> made = coordinatesOf(mesh, corners);
    if (!made) return outcome(made.error());
    auto handle = std::make_unique<carom_texture_coordinates>();
    handle->coordinates = std::make_shared<const carom::TextureCoordinates>(*std::move(made));
    return handOver(std::move(handle), coordinates);
  });
}

carom_status carom_texture_coordinates_size(const carom_texture_coordinates* coordinates,
                                            double size[2]) noexcept {
  if (coordinates == nullptr)
    return failed(CAROM_ERROR_ARGUMENT, "the carom_texture_coordinates is NULL");
  if (size == nullptr) return failed(CAROM_ERROR_ARGUMENT, "the size to be written is NULL");
  size[0] = coordinates->coordinates->size().x();
  size[1] = coordinates->coordinates->size().y();
  return CAROM_OK;
}

void carom_free_texture_coordinates(carom_texture_coordinates* coordinates) noexcept {
  const std::unique_ptr<carom_texture_coordinates> owner(coordinates);
}

}  // extern "C"
