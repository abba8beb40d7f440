// The module's functions that run a scene (carom_live_*), for the page of `carom view`; docs/web.md
// has them all. They are no part of the C API.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "audio/io/held_files.h"
#include "carom/carom.h"
#include "plugin/c_api/c_error.h"
#include "scenes/format/scene_loader.h"
#include "scenes/run/scene_stepper.h"

namespace {

using namespace carom;
using namespace carom::plugin;
using namespace carom::scenes;

constexpr std::size_t kNumbersOfEvent = 8;

using FileTable = std::map<std::string, std::vector<std::byte>, std::less<>>;

FileTable& fileTable() {
  static FileTable files;
  return files;
}

const std::vector<std::byte>* fileInTable(std::string_view path) {
  const auto found = fileTable().find(path);
  return found == fileTable().end() ? nullptr : &found->second;
}

}  // namespace

struct carom_live {
  Scene scene;
  std::unique_ptr<SceneStepper> stepper;
  std::vector<ImpulseEvent> events;  // that were not fetched yet
};

extern "C" {

/// Gives scenes a file, by the path that they name it by.
CAROM_API void carom_live_hold_file(const char* path, const std::byte* bytes, std::size_t size) {
  fileTable()[path].assign(bytes, bytes + size);
  audio::setHeldFiles(fileInTable);
}

/// Opens a scene, from its JSON text; null with a message if it is refused.
CAROM_API carom_live* carom_live_open(const char* json, std::size_t size) {
  auto live = std::make_unique<carom_live>();
  Result<Scene> scene = parseScene({json, size}, "the scene");
  if (!scene) {
    (void)failed(CAROM_ERROR_ARGUMENT, scene.error().message);
    return nullptr;
  }
  live->scene = *std::move(scene);
  Result<std::unique_ptr<SceneStepper>> stepper = makeStepper(live->scene);
  if (!stepper) {
    (void)failed(CAROM_ERROR_ARGUMENT, stepper.error().message);
    return nullptr;
  }
  live->stepper = *std::move(stepper);
  return live.release();
}

CAROM_API void carom_live_close(carom_live* live) {
  const std::unique_ptr<carom_live> owner(live);
}

/// Runs on until every event before `time` (s) is known.
CAROM_API carom_status carom_live_advance(carom_live* live, double time) {
  SceneStepper& stepper = *live->stepper;
  while (stepper.settledTime() < time) {
    const auto known = stepper.advanceTo(time);
    live->events.insert(live->events.end(), known.begin(), known.end());
    if (const std::string why = stepper.failure(); !why.empty())
      return failed(CAROM_ERROR_ARGUMENT, why);
  }
  return CAROM_OK;
}

/// Takes at most `most` events, in the order in which they became known: of each the time (s), the
/// body, the other one, the impulse (N s, three numbers), the approach speed (m/s) and the
/// effective mass (kg).
CAROM_API std::size_t carom_live_events(carom_live* live, double* numbers, std::size_t most) {
  const std::size_t count = std::min(most, live->events.size());
  for (std::size_t index = 0; index < count; ++index) {
    const ImpulseEvent& event = live->events[index];
    const double row[kNumbersOfEvent] = {event.time,
                                         static_cast<double>(event.body),
                                         static_cast<double>(event.other),
                                         event.impulse.x(),
                                         event.impulse.y(),
                                         event.impulse.z(),
                                         event.approachSpeed,
                                         event.effectiveMass};
    std::ranges::copy(row, numbers + kNumbersOfEvent * index);
  }
  live->events.erase(live->events.begin(),
                     live->events.begin() + static_cast<std::ptrdiff_t>(count));
  return count;
}

}  // extern "C"
