#include "scenes/recorded_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <limits>
#include <span>
#include <system_error>
#include <utility>
#include <variant>
#include <vector>

#include "audio/partial_file.h"
#include "native/recording_format.h"
#include "native/sphere_stepper.h"
#include "scenes/scene_loader.h"

namespace carom {
namespace {

namespace fs = std::filesystem;

constexpr int kProgressSteps = 100;
constexpr char kEndOfName = '\0';  // in the payload: the name of the scene's file, this, its text

class ReplayStepper : public SceneStepper {
 public:
  ReplayStepper(const Recording& recording, double begin)
      : recording_(recording),
        time_(begin),
        next_(recording.collisionsUntil(
            std::nextafter(begin, -std::numeric_limits<double>::infinity()))) {}

  std::span<const ImpulseEvent> advanceTo(double time) override {
    events_.clear();
    for (const std::size_t end = recording_.collisionsUntil(time); next_ < end; ++next_) {
      const Recording::Events both = recording_.events(next_);
      events_.insert(events_.end(), both.begin(), both.end());
    }
    time_ = std::max(time_, time);
    return events_;
  }
  double settledTime() const override { return time_; }

 private:
  const Recording& recording_;
  double time_;
  std::size_t next_;  // collision
  std::vector<ImpulseEvent> events_;
};

Result<std::vector<std::byte>> readBytes(const fs::path& file) {
  const auto refuse = [&](const char* why) { return Error{file.string() + ": " + why}; };
  std::error_code code;
  const auto status = fs::status(file, code);
  if (!fs::exists(status)) return refuse("no such file; expected one that 'carom record' wrote");
  if (!fs::is_regular_file(status))
    return refuse("not a regular file; expected one that 'carom record' wrote");
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return refuse("the file cannot be opened; expected one that may be read");
  std::vector<std::byte> bytes(fs::file_size(file, code));
  if (code) return refuse("the file's size cannot be told; expected one that may be read");
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): bytes are what a stream gives
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (static_cast<std::size_t>(stream.gcount()) != bytes.size())
    return refuse("the file cannot be read to its end");
  return bytes;
}

bool isBody(const Scene& scene, BodyId id) {
  return id < scene.bodies.size();
}

bool isSphereOf(const Scene& scene, const Recording::Sphere& sphere) {
  if (!isBody(scene, sphere.id)) return false;
  const auto* shape = std::get_if<SphereShape>(&scene.bodies[sphere.id].shape);
  return shape != nullptr && shape->radius == sphere.radius && shape->mass == sphere.mass;
}

/// Whether each body of the one is there in the other.
bool fits(const Recording& recording, const Scene& scene) {
  const Recording::World& world = recording.world();
  const auto spheres = std::ranges::count_if(scene.bodies, [](const SceneBody& body) {
    return std::holds_alternative<SphereShape>(body.shape);
  });
  const auto known = [&](const ImpulseEvent& event) {
    return isBody(scene, event.body) && isBody(scene, event.other);
  };
  return recording.begin() == 0.0 && recording.end() == scene.duration &&
         world.spheres.size() == static_cast<std::size_t>(spheres) &&
         std::ranges::all_of(world.spheres,
                             [&](const auto& sphere) { return isSphereOf(scene, sphere); }) &&
         std::ranges::all_of(world.walls,
                             [&](const auto& wall) { return isBody(scene, wall.id); }) &&
         std::ranges::all_of(recording.exceptions(), [&](const Recording::Events& events) {
           return std::ranges::all_of(events, known);
         });
}

Result<Scene> sceneOf(const Recording& recording, const std::string& file) {
  const std::string& payload = recording.payload();
  const std::size_t end = payload.find(kEndOfName);
  if (end == std::string::npos)
    return Error{file + ": holds no scene; expected a file that 'carom record' wrote"};
  const std::string_view text = std::string_view(payload).substr(end + 1);
  Result<Scene> scene = parseScene(text, payload.substr(0, end));
  if (!scene) return Error{file + ": the scene in it is refused: " + scene.error().message};
  scene->stepper.type = StepperType::native;
  return scene;
}

}  // namespace

std::string whyNoRecordingOf(const Scene& scene) {
  if (scene.stepper.type == StepperType::native) return {};
  return "runs on Bullet, which cannot be recorded; expected the stepper \"native\" in the scene, "
         "or "
         "--stepper native";
}

Result<Recording> recordScene(const Scene& scene, std::string_view text, std::string_view name,
                              const std::function<void(double share)>& progress) {
  if (const std::string reason = whyNoRecordingOf(scene); !reason.empty())
    return Error{scene.name + ": " + reason};
  Result<SphereStepper> stepper = nativeStepper(scene);
  if (!stepper) return stepper.error();
  stepper->startRecording();
  for (int step = 1; step <= kProgressSteps; ++step) {
    const double share = static_cast<double>(step) / kProgressSteps;
    stepper->advanceTo(step < kProgressSteps ? share * scene.duration : scene.duration);
    if (progress) progress(share);
  }
  Recording recording = stepper->takeRecording();
  std::string payload(name);
  payload += kEndOfName;
  payload += text;
  recording.setPayload(std::move(payload));
  return recording;
}

Result<std::uintmax_t> saveRecording(const Recording& recording, const fs::path& file) {
  const auto refuse = [&](const std::string& why) {
    return Error{"recording '" + file.string() + "': " + why};
  };
  if (const std::string reason = whyNoFileAt(file); !reason.empty()) return refuse(reason);
  const Result<std::vector<std::byte>> bytes = encoded(recording);
  if (!bytes) return refuse(bytes.error().message);
  PartialFile partial(file);
  std::ofstream stream(partial.path(), std::ios::binary | std::ios::trunc);
  if (!stream) return refuse("cannot be created; is its folder writable?");
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): bytes are what a stream takes
  stream.write(reinterpret_cast<const char*>(bytes->data()),
               static_cast<std::streamsize>(bytes->size()));
  stream.close();
  if (!stream) return refuse("cannot be written; is there room on the disk?");
  if (const std::error_code reason = partial.giveName(); reason)
    return refuse("cannot be given its name: " + reason.message());
  return std::uintmax_t{bytes->size()};
}

Result<RecordedScene> loadRecordedScene(const fs::path& file) {
  const Result<std::vector<std::byte>> bytes = readBytes(file);
  if (!bytes) return bytes.error();
  Result<Recording> recording = decoded(*bytes, file.string());
  if (!recording) return recording.error();
  Result<Scene> scene = sceneOf(*recording, file.string());
  if (!scene) return scene.error();
  if (!fits(*recording, *scene)) {
    return Error{file.string() +
                 ": the run is not of the scene in the file; expected the same bodies and length"};
  }
  return RecordedScene{*std::move(scene), *std::move(recording), bytes->size()};
}

bool isRecording(const fs::path& file) {
  std::error_code ignored;
  if (!fs::is_regular_file(file, ignored)) return false;
  std::array<char, kRecordingMagic.size()> beginning{};
  std::ifstream stream(file, std::ios::binary);
  stream.read(beginning.data(), static_cast<std::streamsize>(beginning.size()));
  return stream && std::ranges::equal(beginning, kRecordingMagic);
}

std::unique_ptr<SceneStepper> replayStepper(const Recording& recording, double begin) {
  return std::make_unique<ReplayStepper>(recording, begin);
}

}  // namespace carom
