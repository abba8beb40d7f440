// Plays a list of calls of the C API on the library of this machine, for module_test.mjs, which
// makes the same calls in the module. Usage:
//
//     web_call_player play CALLS SAMPLES    writes what is rendered, 32-bit floats; says how long
//     web_call_player model FILE            writes a modal model
//     web_call_player head FILE             writes libmysofa's default head
//
// A list has one step a line: `struct TYPE NAME`, `set NAME FIELD VALUE...`,
// `numbers NAME KIND VALUE...`, `file NAME PATH`, `call FUNCTION VALUE...`, `render SOUND FRAMES`.
// A value is a number, "text, @name for an address or a handle, @name+bytes for one behind it, or
// >name for a handle to be made. `struct TYPE NAME COUNT` makes an array, whose elements are set as
// NAME:INDEX.

#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <numbers>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "audio/propagation/sofa_file.h"
#include "carom/audio/modal_model_file.h"
#include "carom/carom.h"
#include "web/layout_table.h"

namespace carom::test {
namespace {

using web::PlacedField;

[[noreturn]] void fail(const std::string& why) {
  std::fprintf(stderr, "web_call_player: %s\n", why.c_str());
  std::exit(1);
}

const web::PlacedStruct& structNamed(const std::string& name) {
  for (const web::PlacedStruct& each : web::kStructs)
    if (name == each.name) return each;
  fail("there is no struct " + name);
}

const PlacedField& fieldNamed(const std::string& structName, const std::string& name) {
  for (const PlacedField& field : web::kFields)
    if (structName == field.structName && name == field.name) return field;
  fail("there is no field " + structName + "." + name);
}

template <class Number>
void append(std::vector<std::byte>& bytes, Number number) {
  const auto* const from = reinterpret_cast<const std::byte*>(&number);
  bytes.insert(bytes.end(), from, from + sizeof number);
}

void append(std::vector<std::byte>& bytes, const std::string& kind, double value) {
  if (kind == "f64") return append(bytes, value);
  if (kind == "f32") return append(bytes, static_cast<float>(value));
  if (kind == "i32") return append(bytes, static_cast<std::int32_t>(value));
  if (kind == "u32") return append(bytes, static_cast<std::uint32_t>(value));
  append(bytes, static_cast<std::uint64_t>(value));
}

class CallPlayer {
 public:
  explicit CallPlayer(const std::string& output) : output_(output, std::ios::binary) {}

  void step(std::istringstream words) {
    std::string step;
    std::string name;
    words >> step >> name;
    std::vector<std::string> values(std::istream_iterator<std::string>(words), {});
    if (step == "struct")
      return makeStructs(name, values.at(0), values.size() > 1 ? std::stoul(values[1]) : 1);
    if (step == "set") return set(name, values);
    if (step == "numbers") return makeNumbers(name, values);
    if (step == "file") return readFile(name, values.at(0));
    if (step == "call") return call(name, values);
    if (step == "render") return render(name, std::stoul(values.at(0)));
    fail("there is no step " + step);
  }

  double renderingTime() const { return renderingTime_; }

 private:
  using Values = std::vector<std::string>;

  void makeStructs(const std::string& type, const std::string& name, std::size_t count) {
    const std::size_t size = structNamed(type).size;
    std::vector<std::byte>& bytes = memory_[name];
    bytes.assign(count * size, std::byte{0});
    typeOf_[name] = type;
    const auto init = inits().find(type);
    for (std::size_t at = 0; at < bytes.size(); at += size) {
      std::memcpy(bytes.data() + at, &size, sizeof size);
      if (init != inits().end()) check(type, init->second(bytes.data() + at, size));
    }
  }

  using Init = std::function<carom_status(void*, std::size_t)>;
  template <class Struct>
  static Init initBy(carom_status (*init)(Struct*, std::size_t)) {
    return [init](void* to, std::size_t size) { return init(static_cast<Struct*>(to), size); };
  }
  static const std::map<std::string, Init>& inits() {
    static const std::map<std::string, Init> all = {
        {"carom_settings", initBy(carom_settings_init)},
        {"carom_listener", initBy(carom_listener_init)},
        {"carom_body", initBy(carom_body_init)},
        {"carom_event", initBy(carom_event_init)},
        {"carom_contact", initBy(carom_contact_init)},
        {"carom_room", initBy(carom_room_init)},
        {"carom_reflector", initBy(carom_reflector_init)},
        {"carom_reverb", initBy(carom_reverb_init)},
        {"carom_roughness", initBy(carom_roughness_init)}};
    return all;
  }

  void set(const std::string& element, const Values& values) {
    const std::string name = element.substr(0, element.find(':'));
    const std::string& type = typeOf_.at(name);
    const PlacedField& field = fieldNamed(type, values.at(0));
    const std::size_t index = name == element ? 0 : std::stoul(element.substr(name.size() + 1));
    std::vector<std::byte> bytes;
    for (std::size_t at = 1; at < values.size(); ++at) {
      const std::string& value = values[at];
      if (value[0] == '@' || value[0] == '"')
        append(bytes, addressOf(value));
      else
        append(bytes, field.kind, std::stod(value));
    }
    std::byte* const to = memory_.at(name).data() + index * structNamed(type).size;
    std::memcpy(to + field.offset, bytes.data(), bytes.size());
  }

  void makeNumbers(const std::string& name, const Values& values) {
    std::vector<std::byte>& bytes = memory_[name];
    bytes.clear();
    for (std::size_t index = 1; index < values.size(); ++index)
      append(bytes, values.front(), std::stod(values[index]));
  }

  void readFile(const std::string& name, const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    const std::string text(std::istreambuf_iterator<char>(file), {});
    if (text.empty()) fail("cannot read " + path);
    const auto* const from = reinterpret_cast<const std::byte*>(text.data());
    memory_[name].assign(from, from + text.size());
  }

  const void* addressOf(const std::string& value) {
    const std::string name = value.substr(1);
    if (value[0] == '"') return texts_.emplace(name, name).first->second.c_str();
    if (const auto handle = handles_.find(name); handle != handles_.end()) return handle->second;
    const std::string base = name.substr(0, name.find('+'));
    const std::size_t offset = base == name ? 0 : std::stoul(name.substr(base.size() + 1));
    return memory_.at(base).data() + offset;
  }
  template <class Object>
  Object* object(const std::string& value) {
    return static_cast<Object*>(const_cast<void*>(addressOf(value)));
  }
  template <class Handle>
  carom_status made(const std::string& value, const std::function<carom_status(Handle**)>& make) {
    Handle* handle = nullptr;
    const carom_status status = make(&handle);
    handles_[value.substr(1)] = handle;
    return status;
  }
  static std::uint32_t id(const std::string& value) {
    return static_cast<std::uint32_t>(std::stoul(value));
  }

  carom_status statusOf(const std::string& function, const Values& v) {
    if (function == "carom_create")
      return made<carom_sound>(
          v.at(1), [&](auto** to) { return carom_create(object<carom_settings>(v[0]), to); });
    if (function == "carom_read_modes")
      return made<carom_modes>(v.at(3), [&](auto** to) {
        return carom_read_modes(addressOf(v[0]), std::stoul(v[1]), object<const char>(v[2]), to);
      });
    if (function == "carom_make_head")
      return made<carom_head>(v.at(2), [&](auto** to) {
        return carom_make_head(object<carom_head_responses>(v[0]), std::stod(v[1]), to);
      });
    if (function == "carom_make_texture")
      return made<carom_texture>(v.at(4), [&](auto** to) {
        return carom_make_texture(std::stoul(v[0]), std::stoul(v[1]), object<double>(v[2]),
                                  object<float>(v[3]), to);
      });
    if (function == "carom_reverb_of_box")
      return carom_reverb_of_box(object<carom_room>(v.at(0)), std::stod(v.at(1)),
                                 object<carom_reverb>(v.at(2)));
    return statusOfSound(function, object<carom_sound>(v.at(0)), v);
  }

  carom_status statusOfSound(const std::string& function, carom_sound* sound, const Values& v) {
    if (function == "carom_set_body")
      return carom_set_body(sound, id(v.at(1)), object<carom_body>(v.at(2)));
    if (function == "carom_post") return carom_post(sound, object<carom_event>(v.at(1)));
    if (function == "carom_update_contact")
      return carom_update_contact(sound, object<carom_contact>(v.at(1)));
    if (function == "carom_move_body")
      return carom_move_body(sound, id(v.at(1)), std::stod(v.at(2)), object<double>(v.at(3)),
                             object<double>(v.at(4)));
    if (function == "carom_set_listener")
      return carom_set_listener(sound, id(v.at(1)), object<double>(v.at(2)),
                                object<double>(v.at(3)));
    if (function == "carom_prepare_rendering")
      return carom_prepare_rendering(sound, std::stod(v.at(1)));
    if (function == "carom_advance") return carom_advance(sound, std::stod(v.at(1)));
    if (function == "carom_destroy") return carom_destroy(sound);
    fail("there is no function " + function);
  }

  void call(const std::string& function, const Values& values) {
    check(function, statusOf(function, values));
  }

  void render(const std::string& name, std::size_t frames) {
    auto* const sound = object<carom_sound>(name);
    const std::size_t channels = carom_channel_count(sound);
    std::vector<float> samples(frames * channels);
    const auto begin = std::chrono::steady_clock::now();
    check("carom_render_interleaved",
          carom_render_interleaved(sound, samples.data(), channels, frames));
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;
    renderingTime_ += taken.count();
    output_.write(reinterpret_cast<const char*>(samples.data()),
                  static_cast<std::streamsize>(samples.size() * sizeof(float)));
  }

  static void check(const std::string& what, carom_status status) {
    if (status != CAROM_OK) fail(what + ": " + carom_last_message());
  }

  std::ofstream output_;
  std::map<std::string, std::vector<std::byte>> memory_;
  std::map<std::string, std::string> typeOf_;
  std::map<std::string, void*> handles_;
  std::map<std::string, std::string> texts_;
  double renderingTime_ = 0.0;  // s
};

void play(const std::string& calls, const std::string& samples) {
  std::ifstream list(calls);
  std::vector<std::string> lines;
  for (std::string line; std::getline(list, line);)
    lines.push_back(line);
  if (lines.empty()) fail("cannot read " + calls);
  CallPlayer player(samples);
  for (const std::string& line : lines)
    player.step(std::istringstream(line));
  std::printf("{\"rendering\": %.17g}\n", player.renderingTime());
}

/// Adds a face of the box [-half, half] as a grid of `count` x `count` squares.
void addFace(SurfaceMesh& mesh, const Vec3& half, int axis, double side, std::uint32_t count) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  const int across = (axis + 1) % 3;
  const int along = (axis + 2) % 3;
  for (std::uint32_t row = 0; row <= count; ++row)
    for (std::uint32_t column = 0; column <= count; ++column) {
      Vec3 vertex = side * half;
      vertex[across] = half[across] * (2.0 * column / count - 1.0);
      vertex[along] = half[along] * (2.0 * row / count - 1.0);
      mesh.vertices.push_back(vertex);
    }
  for (std::uint32_t row = 0; row < count; ++row)
    for (std::uint32_t column = 0; column < count; ++column) {
      const std::uint32_t at = first + row * (count + 1) + column;
      const std::array<std::uint32_t, 3> lower = {at, at + 1, at + count + 1};
      const std::array<std::uint32_t, 3> upper = {at + 1, at + count + 2, at + count + 1};
      for (auto triangle : {lower, upper}) {
        if (side < 0.0) std::swap(triangle[0], triangle[1]);
        mesh.triangles.push_back(triangle);
      }
    }
}

/// A block of steel of 0.2 m that rings in 64 modes; no real block does in these.
ModalModel inventedModel() {
  ModalModel model;
  model.name = "block";
  model.material = *findMaterial("steel");
  const Vec3 half(0.1, 0.02, 0.05);
  model.mass = model.material.density * 8.0 * half.prod();
  model.inertia = Eigen::Matrix3d::Identity() * model.mass * half.squaredNorm() / 5.0;
  SurfaceMesh faces;
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {-1.0, 1.0})
      addFace(faces, half, axis, side, 6);
  model.surface = welded(faces, 1e-6);
  for (int index = 0; index < 64; ++index) {
    const double frequency = 400.0 * std::pow(1.06, index);
    Mode mode{.frequency = frequency, .decayRate = 3.0 + frequency / 400.0, .radiation = {}};
    mode.radiation.volume = 1e-3 * std::cos(index);
    for (int coefficient = 0; coefficient < 9; ++coefficient)
      mode.radiation.multipoles.emplace_back(1e-3 * std::cos(index + 2.0 * coefficient),
                                             1e-4 * std::sin(3.0 * index - coefficient));
    model.modes.push_back(mode);
    for (const Vec3& vertex : model.surface.vertices) {
      const double phase = 20.0 * vertex.x() * (1 + index % 7) + 30.0 * vertex.z() * (index / 7);
      for (const double turn : {0.0, 1.0, 2.0})
        model.shapes.push_back(static_cast<float>(0.5 * std::cos(phase + turn)));
    }
  }
  return model;
}

void writeAll(const std::string& path, const std::vector<std::byte>& bytes) {
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  if (!file.flush()) fail("cannot write " + path);
}

void writeModel(const std::string& path) {
  const auto bytes = encodedModalModel(inventedModel());
  if (!bytes) fail(bytes.error().message);
  writeAll(path, *bytes);
}

/// Writes the numbers of directions and of samples of a response, and the sample rate, as doubles;
/// the directions, the delays, and the responses, as carom_head_responses has them.
void writeHead(const std::string& path) {
  const auto measured = audio::readSofaFile(audio::defaultSofaFile());
  if (!measured) fail(measured.error().message);
  const auto& items = measured->items;
  std::vector<std::byte> bytes;
  append(bytes, static_cast<double>(items.size()));
  append(bytes, static_cast<double>(items.front().response[0].size()));
  append(bytes, measured->sampleRate);
  for (const HrtfMeasurement& item : items)
    for (const int axis : {0, 1, 2})
      append(bytes, item.direction[axis]);
  for (const HrtfMeasurement& item : items)
    for (const double delay : item.delay)
      append(bytes, delay);
  for (const HrtfMeasurement& item : items)
    for (const auto& response : item.response)
      for (const float sample : response)
        append(bytes, sample);
  writeAll(path, bytes);
}

}  // namespace
}  // namespace carom::test

int main(int count, char** words) {
  const std::vector<std::string> arguments(words + 1, words + count);
  if (arguments.size() == 3 && arguments[0] == "play")
    carom::test::play(arguments[1], arguments[2]);
  else if (arguments.size() == 2 && arguments[0] == "model")
    carom::test::writeModel(arguments[1]);
  else if (arguments.size() == 2 && arguments[0] == "head")
    carom::test::writeHead(arguments[1]);
  else
    carom::test::fail("expected play CALLS SAMPLES, model FILE or head FILE");
  return 0;
}
