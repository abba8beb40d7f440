// The module's functions that run a scene while a page shows it (carom_live_*); docs/web.md has
// them all. They are no part of the C API, and may change with the page.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include <nlohmann/json.hpp>

#include "audio/io/held_files.h"
#include "audio/run/playable_run.h"
#include "audio/run/run_encoder.h"
#include "carom/carom.h"
#include "plugin/c_api/c_error.h"
#include "scenes/format/scene_loader.h"
#include "scenes/live/live_run.h"
#include "scenes/live/number_table.h"
#include "scenes/live/scene_drawing.h"

namespace {

using namespace carom;
using namespace carom::audio;
using namespace carom::plugin;
using namespace carom::scenes;
using nlohmann::ordered_json;

/// The parts that a page may ask for, as bytes.
enum class Part : std::uint32_t {
  drawing,   // JSON: a run of the manifest, see sceneDrawing
  opening,   // what carom_run_open takes: the run without portions
  sound,     // what carom_run_append takes, and all below: since the last carom_live_take
  events,    // rows of 14 doubles, as in a page
  poses,     // rows of 9 floats
  contacts,  // rows of 6 doubles, a step each
  pictures,  // of the jello: a double, then three floats for each point
  bodies,    // JSON: a list of bodies
  states,    // rows of 14 doubles: body, place, orientation, velocity, spin
  file,      // the run as a file, see RunWriter
  jello,     // places of all its points, then their velocities: rows of 3 doubles
};
constexpr std::size_t kParts = 11;

/// Files that scenes may name, by their paths.
using FileTable = std::map<std::string, std::vector<std::byte>, std::less<>>;

FileTable& fileTable() {
  static FileTable files;
  return files;
}

const std::vector<std::byte>* fileInTable(std::string_view path) {
  const auto found = fileTable().find(path);
  return found == fileTable().end() ? nullptr : &found->second;
}

Vec3 vectorFrom(const double* numbers) {
  return {numbers[0], numbers[1], numbers[2]};
}

std::vector<std::byte> bytesOf(const std::string& text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

std::vector<std::byte> bytesOf(const NumberTable& table) {
  return {table.bytes().begin(), table.bytes().end()};
}

}  // namespace

struct carom_live {
  explicit carom_live(LiveRun begun) : run(std::move(begun)) {
    if (const JelloShape* const jello = jelloOf(run.scene())) outline.emplace(*jello);
  }

  LiveRun run;
  std::optional<JelloOutline> outline;
  std::size_t bodies = 0;  // entries of the run's bodies that have been taken
  std::array<std::vector<std::byte>, kParts> parts;
  std::vector<std::vector<std::byte>> blobs;

  std::vector<std::byte>& part(Part kind) { return parts.at(static_cast<std::size_t>(kind)); }

  std::vector<DrawnBody> drawnFrom(std::size_t entry) const {
    std::vector<DrawnBody> drawn;
    for (; entry < run.run().bodies.size(); ++entry)
      for (const HostBody& body : run.run().bodies[entry].bodies)
        drawn.push_back(drawnBody(run.scene(), body));
    return drawn;
  }
  std::size_t keep(std::span<const std::byte> bytes) {
    blobs.emplace_back(bytes.begin(), bytes.end());
    return blobs.size() - 1;
  }
  ordered_json drawing(std::span<const DrawnBody> drawn) {
    return sceneDrawing(run.scene(), drawn,
                        [this](std::span<const std::byte> bytes) { return keep(bytes); });
  }

  void makeDrawing() {
    blobs.clear();
    ordered_json object = drawing(drawnFrom(0));
    object["stepper"] = run.scene().stepper.type == StepperType::bullet ? "bullet" : "native";
    if (outline)
      object["jello"] = outline->drawing(
          run.scene(), {}, [this](std::span<const std::byte> bytes) { return keep(bytes); });
    part(Part::drawing) = bytesOf(object.dump());
  }

  Status makeOpening() {
    PlayableRun opening = run.run();
    opening.portions.clear();
    opening.bodies.clear();
    // As where a plugin plays: many contacts at once are heard for a share of what they cost.
    opening.world.synth.lasting = LastingDetail::heard;
    Result<std::vector<std::byte>> bytes = encodedRun(opening);
    if (!bytes) return bytes.error();
    part(Part::opening) = *std::move(bytes);
    return std::monostate{};
  }

  Status take() {
    NumberTable events;
    NumberTable poses;
    NumberTable contacts;
    NumberTable pictures;
    RunMore more;
    const PlayableRun& all = run.run();
    const std::vector<LiveRun::Shown> shown = run.takeShown();
    const std::size_t first = all.portions.size() - shown.size();
    for (std::size_t index = 0; index < shown.size(); ++index) {
      const RunPortion& portion = all.portions[first + index];
      more.portions.push_back(portion);
      for (std::size_t event = 0; event < portion.events.size(); ++event)
        addEventRow(portion.events[event], shown[index].measures[event], all.world.synth.impulse,
                    events);
      for (const auto& [body, pose] : shown[index].poses)
        addPoseRow(body, pose, poses);
      for (const ContactState& state : portion.contacts)
        for (const double number :
             {static_cast<double>(state.body), static_cast<double>(state.other), state.time,
              state.time + (state.phase == ContactPhase::end ? 0.0 : state.duration),
              state.slipVelocity.norm() > kSlides ? 1.0 : 0.0, state.normalLoad})
          contacts.add(number);
      for (const JelloPicture& picture : shown[index].pictures) {
        pictures.add(picture.time);
        outline->addPoints(picture, pictures);
      }
    }
    more.bodies.assign(all.bodies.begin() + static_cast<std::ptrdiff_t>(bodies), all.bodies.end());
    const std::vector<DrawnBody> drawn = drawnFrom(bodies);
    part(Part::bodies) = bytesOf(drawn.empty() ? "[]" : drawing(drawn)["bodies"].dump());
    bodies = all.bodies.size();
    Result<std::vector<std::byte>> sound = encodedMore(more);
    if (!sound) return sound.error();
    part(Part::sound) = *std::move(sound);
    part(Part::events) = bytesOf(events);
    part(Part::poses) = bytesOf(poses);
    part(Part::contacts) = bytesOf(contacts);
    part(Part::pictures) = bytesOf(pictures);
    return std::monostate{};
  }

  void makeStates() {
    const Scene now = run.now();
    NumberTable table;
    for (std::size_t index = 0; index < now.bodies.size(); ++index) {
      const auto add = [&](const auto& shape) {
        table.add(static_cast<double>(index));
        table.add(shape.position);
        table.add(shape.orientation);
        table.add(shape.velocity);
        table.add(shape.spin);
      };
      const auto& shape = now.bodies[index].shape;
      if (const auto* sphere = std::get_if<SphereShape>(&shape)) add(*sphere);
      if (const auto* solid = std::get_if<SolidShape>(&shape); solid && solid->canMove()) {
        SolidShape placed = *solid;  // in files, a body's place is that of its form's origin
        placed.position -= solid->orientation * solid->centreOfMass;
        add(placed);
      }
    }
    part(Part::states) = bytesOf(table);
  }

  void makeJello() {
    const Scene now = run.now();
    NumberTable table;
    if (const JelloShape* const jello = jelloOf(now))
      for (const std::vector<Vec3>* const vectors : {&jello->positions, &jello->velocities})
        for (const Vec3& vector : *vectors)
          table.add(vector);
    part(Part::jello) = bytesOf(table);
  }

  Status makeFile() {
    const PlayableRun& all = run.run();
    RunEncoder encoder(kHostRun);
    HostEncoder bodyEncoder;
    auto next = all.bodies.begin();
    const auto putBodies = [&](std::size_t portion) -> Status {
      for (; next != all.bodies.end() && next->portion <= portion; ++next) {
        std::vector<std::byte> records;
        for (const HostBody& body : next->bodies)
          if (Status added = bodyEncoder.add(body, records); !added) return added;
        if (Status put = encoder.put('b', records); !put) return put;
      }
      return std::monostate{};
    };
    for (std::size_t index = 0; index < all.portions.size(); ++index) {
      if (Status put = putBodies(index); !put) return put;
      if (Status added = encoder.add(all.portions[index]); !added) return added;
    }
    if (Status put = putBodies(all.portions.size()); !put) return put;
    HostWorld world = all.world;
    world.duration = std::max(run.settled(), 1.0 / world.synth.sampleRate);
    world.bodies = static_cast<std::uint32_t>(run.scene().bodies.size());
    if (Status put = encoder.put('w', encodedWorld(world)); !put) return put;
    if (Status ended = encoder.finish(); !ended) return ended;
    part(Part::file) = encoder.take();
    return std::monostate{};
  }
};

extern "C" {

/// Gives scenes a file, by the path that they name it by.
CAROM_API void carom_live_hold_file(const char* path, const std::byte* bytes, std::size_t size) {
  fileTable()[path].assign(bytes, bytes + size);
  setHeldFiles(fileInTable);
}

/// Begins a scene (JSON); null with a message if it is refused. `run` are the bytes of encodedRun
/// of a run of the same scene, which tell how its bodies sound; without them nothing rings.
CAROM_API carom_live* carom_live_open(const char* json, std::size_t size, const std::byte* run,
                                      std::size_t runSize) {
  Result<Scene> scene = parseScene({json, size}, "scene.json", {.confined = true});
  if (!scene) {
    (void)failed(CAROM_ERROR_ARGUMENT, scene.error().message);
    return nullptr;
  }
  std::vector<HostBody> sounds;
  if (runSize > 0) {
    Result<PlayableRun> known = decodedRun({run, runSize});
    if (!known) {
      (void)failed(CAROM_ERROR_ARGUMENT, "the run " + known.error().message);
      return nullptr;
    }
    for (PlayableRun::Bodies& bodies : known->bodies)
      std::ranges::move(bodies.bodies, std::back_inserter(sounds));
  }
  Result<LiveRun> live = LiveRun::create(*std::move(scene), sounds);
  if (!live) {
    (void)failed(CAROM_ERROR_ARGUMENT, live.error().message);
    return nullptr;
  }
  return std::make_unique<carom_live>(*std::move(live)).release();
}

CAROM_API void carom_live_close(carom_live* live) {
  const std::unique_ptr<carom_live> owner(live);
}

/// Goes on to a time (s), or up to a frame beyond.
CAROM_API carom_status carom_live_advance(carom_live* live, double time) {
  return outcome(live->run.advanceTo(time));
}

/// Returns the time (s) of the head, where changes act.
CAROM_API double carom_live_time(const carom_live* live) {
  return live->run.time();
}

/// Returns the time (s) before which all is known.
CAROM_API double carom_live_settled(const carom_live* live) {
  return live->run.settled();
}

/// Returns the number of portions so far.
CAROM_API std::size_t carom_live_portions(const carom_live* live) {
  return live->run.run().portions.size();
}

/// Puts together what has come since the last time.
CAROM_API carom_status carom_live_take(carom_live* live) {
  return outcome(live->take());
}

/// Puts together the drawing, the opening, states, the file or the jello.
CAROM_API carom_status carom_live_make(carom_live* live, std::uint32_t part) {
  switch (static_cast<Part>(part)) {
    case Part::drawing:
      live->makeDrawing();
      return CAROM_OK;
    case Part::opening:
      return outcome(live->makeOpening());
    case Part::states:
      live->makeStates();
      return CAROM_OK;
    case Part::file:
      return outcome(live->makeFile());
    case Part::jello:
      live->makeJello();
      return CAROM_OK;
    default:
      return failed(CAROM_ERROR_ARGUMENT, "no such part can be made");
  }
}

/// Returns where a part is, until the next call that makes or takes it.
CAROM_API const std::byte* carom_live_part(const carom_live* live, std::uint32_t part) {
  return part < kParts ? live->parts[part].data() : nullptr;
}
CAROM_API std::size_t carom_live_part_size(const carom_live* live, std::uint32_t part) {
  return part < kParts ? live->parts[part].size() : 0;
}

/// Returns bytes that the drawing refers to by their number.
CAROM_API const std::byte* carom_live_blob(const carom_live* live, std::size_t blob) {
  return blob < live->blobs.size() ? live->blobs[blob].data() : nullptr;
}
CAROM_API std::size_t carom_live_blob_size(const carom_live* live, std::size_t blob) {
  return blob < live->blobs.size() ? live->blobs[blob].size() : 0;
}

/// Changes the velocity of a body by three numbers (m/s).
CAROM_API carom_status carom_live_push(carom_live* live, std::uint32_t body, const double* change) {
  const Vec3 velocity = vectorFrom(change);
  if (body >= live->run.scene().bodies.size() || !velocity.allFinite())
    return failed(CAROM_ERROR_ARGUMENT, "no such body, or no velocity");
  live->run.push(body, velocity);
  return CAROM_OK;
}

/// Draws a body towards a place (m); of a jello the point of its lattice that is nearest to `grip`
/// (m). At another rate (1/s) than 15 the hand is stiffer or softer.
CAROM_API carom_status carom_live_pull(carom_live* live, std::uint32_t body, std::uint32_t point,
                                       const double* place, double rate) {
  const Vec3 to = vectorFrom(place);
  if (body >= live->run.scene().bodies.size() || !to.allFinite() || !(rate > 0.0 && rate < 1e3))
    return failed(CAROM_ERROR_ARGUMENT, "no such body, or no place");
  live->run.pull(Pull{.body = body, .point = point, .place = to, .rate = rate});
  return CAROM_OK;
}

/// Returns the point of a jello's lattice that is nearest to a place (m).
CAROM_API std::uint32_t carom_live_nearest_point(const carom_live* live, const double* place) {
  const Scene now = live->run.now();
  const JelloShape* const jello = jelloOf(now);
  if (jello == nullptr) return 0;
  const Vec3 at = vectorFrom(place);
  const auto nearest = std::ranges::min_element(
      jello->positions, {}, [&at](const Vec3& point) { return (point - at).squaredNorm(); });
  return static_cast<std::uint32_t>(nearest - jello->positions.begin());
}

CAROM_API void carom_live_release(carom_live* live) {
  live->run.pull({});
}

/// Adds the first body of a scene (JSON), whose other bodies are not looked at. Returns its number;
/// below 0, with a message, if it is refused.
CAROM_API std::int32_t carom_live_add(carom_live* live, const char* json, std::size_t size) {
  Result<Scene> scene = parseScene({json, size}, "body.json", {.confined = true});
  if (!scene) {
    (void)failed(CAROM_ERROR_ARGUMENT, scene.error().message);
    return -1;
  }
  const Result<BodyId> added = live->run.add(std::move(scene->bodies.front()));
  if (!added) {
    (void)failed(CAROM_ERROR_ARGUMENT, added.error().message);
    return -1;
  }
  return static_cast<std::int32_t>(*added);
}

/// Sets gravity (m/s^2).
CAROM_API carom_status carom_live_set_gravity(carom_live* live, const double* gravity) {
  const Vec3 acceleration = vectorFrom(gravity);
  if (!acceleration.allFinite() || acceleration.norm() > 1e4)
    return failed(CAROM_ERROR_ARGUMENT, "gravity is up to 1e4 m/s^2");
  return outcome(live->run.change([&acceleration](Scene& scene) { scene.gravity = acceleration; }));
}

/// Sets the coefficient of restitution of all bodies, in all pairs.
CAROM_API carom_status carom_live_set_restitution(carom_live* live, double restitution) {
  if (!(restitution >= 0.0 && restitution <= 1.0))
    return failed(CAROM_ERROR_ARGUMENT, "a restitution is 0 to 1");
  return outcome(live->run.change([restitution](Scene& scene) {
    scene.restitutions = {};
    for (SceneBody& body : scene.bodies)
      body.material.restitution = restitution;
  }));
}

/// Sets the coefficient of friction of all bodies.
CAROM_API carom_status carom_live_set_friction(carom_live* live, double friction) {
  if (!(friction >= 0.0 && friction <= 10.0))
    return failed(CAROM_ERROR_ARGUMENT, "a friction is 0 to 10");
  return outcome(live->run.change([friction](Scene& scene) {
    for (SceneBody& body : scene.bodies)
      body.contact.friction = body.contact.defaultFriction = friction;
  }));
}

/// Has the native stepper go on (0), or Bullet (1) with a step (s).
CAROM_API carom_status carom_live_set_stepper(carom_live* live, std::int32_t isBullet,
                                              double step) {
  if (isBullet != 0 && !(step >= kShortestStep && step <= kLongestStep))
    return failed(CAROM_ERROR_ARGUMENT, "Bullet's step is 1e-5 to 0.1 s");
  return outcome(live->run.change([isBullet, step](Scene& scene) {
    scene.stepper.type = isBullet != 0 ? StepperType::bullet : StepperType::native;
    if (isBullet != 0) scene.stepper.step = step;
  }));
}

/// Takes back all that happened after a time (s). carom_live_portions tells how many portions stay.
CAROM_API carom_status carom_live_rewind(carom_live* live, double time) {
  const Status rewound = live->run.rewind(time);
  live->bodies = std::min(live->bodies, live->run.run().bodies.size());
  return outcome(rewound);
}

}  // extern "C"
