#include "plugin/c_api/struct_versions.h"

#include <algorithm>
#include <cstring>

namespace carom::plugin {
namespace {

// True if a version of the struct ended with this field, without padding behind it, which an older
// caller would have left uninitialised. Pointers of 32 bits leave some: a WebAssembly module has
// callers of its own version alone.
template <class Struct, class Field>
constexpr bool endsWith(Field Struct::*, std::size_t offset) {
  if (sizeof(void*) < sizeof(double)) return true;
  return std::ranges::find(kSizes<Struct>, offset + sizeof(Field)) != kSizes<Struct>.end();
}
#define CAROM_ENDS_WITH(Struct, field) \
  static_assert(endsWith(&Struct::field, offsetof(Struct, field)))
CAROM_ENDS_WITH(carom_listener, reserved);
CAROM_ENDS_WITH(carom_listener, sofa_file);
CAROM_ENDS_WITH(carom_listener, head);
CAROM_ENDS_WITH(carom_head_responses, length);
CAROM_ENDS_WITH(carom_reflector, surface);
CAROM_ENDS_WITH(carom_room, reserved);
CAROM_ENDS_WITH(carom_reverb, silence);
CAROM_ENDS_WITH(carom_reverb, reserved);
CAROM_ENDS_WITH(carom_surface, absorption);
CAROM_ENDS_WITH(carom_settings, reserved);
CAROM_ENDS_WITH(carom_settings, modes);
CAROM_ENDS_WITH(carom_settings, level);
CAROM_ENDS_WITH(carom_settings, metres_per_unit);
CAROM_ENDS_WITH(carom_settings, air_reserved);
CAROM_ENDS_WITH(carom_roughness, hurst);
CAROM_ENDS_WITH(carom_material, restitution);
CAROM_ENDS_WITH(carom_material, damping_beta);
CAROM_ENDS_WITH(carom_material, roughness);
CAROM_ENDS_WITH(carom_material, loss_exponent);
CAROM_ENDS_WITH(carom_material, heat_capacity);
CAROM_ENDS_WITH(carom_mesh, triangle_count);
CAROM_ENDS_WITH(carom_normal_map, reserved);
CAROM_ENDS_WITH(carom_body, reserved);
CAROM_ENDS_WITH(carom_body, texture_coordinates);
CAROM_ENDS_WITH(carom_body_sound, silent);
CAROM_ENDS_WITH(carom_event, has_other_pose);
CAROM_ENDS_WITH(carom_event, other_orientation);
CAROM_ENDS_WITH(carom_contact, reserved);
CAROM_ENDS_WITH(carom_statistics, unsupported_contacts);
CAROM_ENDS_WITH(carom_statistics, modes);
CAROM_ENDS_WITH(carom_statistics, undersampled);
CAROM_ENDS_WITH(carom_collision, listener_count);
CAROM_ENDS_WITH(carom_statistics, masked);
CAROM_ENDS_WITH(carom_statistics, waiting);
#undef CAROM_ENDS_WITH

Status checkSize(const void* callers, std::span<const std::size_t> sizes, const std::string& name) {
  if (callers == nullptr) return Error{name + " is NULL"};
  const std::size_t size = sizeOf(callers);
  const std::size_t now = sizes.back();
  const bool isLater = size >= now && size <= now + kMostGrowth;
  if (isLater || std::ranges::find(sizes, size) != sizes.end()) return std::monostate{};
  return Error{name + ".size is " + std::to_string(size) + "; expected sizeof(" + name +
               "), which is " + std::to_string(now) + " in this version"};
}

bool isZero(const std::byte* bytes, std::size_t count) {
  return std::all_of(bytes, bytes + count, [](std::byte byte) { return byte == std::byte{0}; });
}

}  // namespace

std::size_t sizeOf(const void* callers) {
  std::size_t size = 0;
  std::memcpy(&size, callers, sizeof size);
  return size;
}

Status readStruct(const void* input, void* known, std::span<const std::size_t> sizes,
                  const char* name) {
  if (Status checked = checkSize(input, sizes, name); !checked) return checked;
  const auto* const bytes = static_cast<const std::byte*>(input);
  const std::size_t shared = std::min(sizes.back(), sizeOf(input));
  if (!isZero(bytes + shared, sizeOf(input) - shared))
    return Error{std::string(name) + " sets a field that this version of the library, " +
                 std::to_string(CAROM_VERSION) + ", does not know"};
  std::memcpy(known, input, shared);
  return std::monostate{};
}

Status writeStruct(const void* known, void* output, std::span<const std::size_t> sizes,
                   const char* name) {
  if (Status checked = checkSize(output, sizes, name); !checked) return checked;
  const std::size_t callers = sizeOf(output);
  std::memset(output, 0, callers);
  std::memcpy(output, known, std::min(sizes.back(), callers));
  std::memcpy(output, &callers, sizeof callers);
  return std::monostate{};
}

Status checkChoices(std::initializer_list<Choice> choices) {
  for (const Choice& choice : choices) {
    if (choice.value >= 0 && choice.value < choice.count) continue;
    const std::string range = choice.count == 1 ? "0" : "0 to " + std::to_string(choice.count - 1);
    return Error{std::string(choice.field) + " is " + std::to_string(choice.value) + "; expected " +
                 range};
  }
  return std::monostate{};
}

}  // namespace carom::plugin
