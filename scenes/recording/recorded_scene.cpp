#include "scenes/recording/recorded_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <limits>
#include <optional>
#include <span>
#include <system_error>
#include <utility>
#include <variant>
#include <vector>

#include "audio/io/byte_file.h"
#include "carom/native/recording_format.h"
#include "carom/native/sphere_stepper.h"
#include "scenes/format/scene_loader.h"

namespace carom::scenes {

using namespace audio;

namespace {

namespace fs = std::filesystem;

constexpr int kProgressSteps = 100;
constexpr char kEndOfName = '\0';  // ends the scene's file name in the payload; its text follows

class ReplayStepper : public SceneStepper {
 public:
  ReplayStepper(const Recording& recording, std::vector<BodyId> rings, double begin)
      : recording_(recording),
        rings_(std::move(rings)),
        instants_(begin),
        time_(begin),
        next_(recording.collisionsUntil(
            std::nextafter(begin, -std::numeric_limits<double>::infinity()))) {}

  std::span<const ImpulseEvent> advanceTo(double target) override {
    events_.clear();
    poses_.clear();
    const double time = rings_.empty() ? target : PoseInstants::from(target);
    const std::size_t end = recording_.collisionsUntil(time);
    for (; next_ < end && events_.size() < kEventsAtATime; ++next_) {
      const Recording::Events both = recording_.events(next_);
      events_.insert(events_.end(), both.begin(), both.end());
    }
    time_ = std::max(time_, next_ < end ? events_.back().time : time);
    count(events_, time_);
    for (; instants_.next() <= std::min(time_, recording_.end()); instants_.pass())
      keepPoses(std::max(instants_.next(), recording_.begin()));
    return events_;
  }
  std::span<const BodyPose> poses() const override { return poses_; }
  double settledTime() const override { return time_; }

 private:
  void keepPoses(double time) {
    for (const BodyId id : rings_)
      if (const std::optional<std::size_t> sphere = recording_.sphereOf(id))
        poses_.push_back({id, {time, recording_.state(*sphere, time).position}});
  }

  const Recording& recording_;
  std::vector<BodyId> rings_;
  PoseInstants instants_;
  double time_;
  std::size_t next_;  // index of the next collision
  std::vector<ImpulseEvent> events_;
  std::vector<BodyPose> poses_;
};

/// Advances in parts that a guard may look at between. False if it ends the run.
bool advance(SphereStepper& stepper, double time, RunGuard* guard) {
  if (guard == nullptr) {
    stepper.advanceTo(time);
    return true;
  }
  while (stepper.time() < time) {
    const auto events = stepper.advanceTo(time, kEventsAtATime);
    if (!guard->add(events, stepper.time())) return false;
  }
  return true;
}

bool isBody(const Scene& scene, BodyId id) {
  return id < scene.bodies.size();
}

bool isSphereOf(const Scene& scene, const Recording::Sphere& sphere) {
  if (!isBody(scene, sphere.id)) return false;
  const auto* shape = std::get_if<SphereShape>(&scene.bodies[sphere.id].shape);
  return shape != nullptr && shape->radius == sphere.radius && shape->mass == sphere.mass;
}

/// True if the recording has the scene's length and spheres, and its walls and events name bodies
/// of the scene.
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

Result<Scene> sceneOf(const Recording& recording, const fs::path& path, bool confined) {
  const std::string file = path.string();
  const std::string& payload = recording.payload();
  const std::size_t end = payload.find(kEndOfName);
  if (end == std::string::npos)
    return Error{file + ": holds no scene; expected a file that 'carom record' wrote"};
  // The name of the scene in it is a stranger's, too.
  FileAccess access{.confined = confined};
  if (confined) access.folder = path.parent_path();
  const std::string_view text = std::string_view(payload).substr(end + 1);
  Result<Scene> scene = parseScene(text, payload.substr(0, end), access);
  if (!scene) return Error{file + ": the scene in it is refused: " + scene.error().message};
  scene->stepper.type = StepperType::native;
  return scene;
}

}  // namespace

Status validateForRecording(const Scene& scene) {
  if (jelloOf(scene) != nullptr)
    return Error{"has a jello, which cannot be recorded; expected rigid bodies only"};
  if (scene.stepper.type == StepperType::native) return std::monostate{};
  return Error{
      "runs on Bullet, which cannot be recorded; expected the stepper \"native\" in the scene, "
      "or "
      "--stepper native"};
}

Result<Recording> recordScene(const Scene& scene, std::string_view text, std::string_view name,
                              const std::function<void(double share)>& progress, RunGuard* guard) {
  if (const Status valid = validateForRecording(scene); !valid)
    return Error{scene.name + ": " + valid.error().message};
  Result<SphereStepper> stepper = nativeStepper(scene);
  if (!stepper) return stepper.error();
  stepper->startRecording();
  for (int step = 1; step <= kProgressSteps; ++step) {
    const double share = static_cast<double>(step) / kProgressSteps;
    const double end = step < kProgressSteps ? share * scene.duration : scene.duration;
    if (!advance(*stepper, end, guard)) return Error{scene.name + ": " + guard->ended()->what};
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
  const Result<std::vector<std::byte>> bytes = encoded(recording);
  if (!bytes) return Error{file.string() + ": " + bytes.error().message};
  if (Status written = writeBytes(file, *bytes); !written) return written.error();
  return std::uintmax_t{bytes->size()};
}

Result<RecordedScene> loadRecordedScene(const fs::path& file, bool confined) {
  const Result<std::vector<std::byte>> bytes = readBytes(file);
  if (!bytes)
    return Error{file.string() + ": " + bytes.error().message +
                 " (of one that 'carom record' wrote)"};
  Result<Recording> recording = decoded(*bytes, file.string());
  if (!recording) return recording.error();
  Result<Scene> scene = sceneOf(*recording, file, confined);
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

std::unique_ptr<SceneStepper> replayStepper(const Recording& recording, const Scene& scene,
                                            double begin) {
  return std::make_unique<ReplayStepper>(recording, movingRings(scene), begin);
}

Replay replayOf(const Recording& recording, const Scene& scene) {
  return [&recording, &scene](double begin) { return replayStepper(recording, scene, begin); };
}

}  // namespace carom::scenes
