#include "scenes/recording/recorded_run.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "scenes/format/scene_loader.h"
#include "scenes/recording/event_tape.h"

namespace carom::scenes {

using namespace audio;

namespace {

namespace fs = std::filesystem;

class RunStepper : public SceneStepper {
 public:
  explicit RunStepper(std::shared_ptr<RunReader> reader) : reader_(std::move(reader)) {}

  std::span<const ImpulseEvent> advanceTo(double time) override {
    now_ = {};
    changes_.clear();
    bool isFirst = true;
    while (settledTime_ < time && failure_.empty() && mayGoOn(settledTime_)) {
      if (next_ == portions_.size() && !readMore()) break;
      // The portions before a change are heard with the bodies as they were.
      if (next_ == 0 && !isFirst && !reader_->changes().empty()) break;
      if (next_ == 0)
        for (const std::size_t body : reader_->changes())
          changes_.push_back(&reader_->host()->bodies[body]);
      isFirst = false;
      RunPortion& portion = portions_[next_++];
      count(portion.events, portion.settledTime);
      move(portion.events, now_.events);
      move(portion.contacts, now_.contacts);
      move(portion.poses, now_.poses);
      move(portion.deformations, now_.deformations);
      move(portion.pictures, now_.pictures);
      settledTime_ = portion.settledTime;
    }
    return now_.events;
  }
  std::span<const ContactState> contacts() const override { return now_.contacts; }
  bool reportsContacts() const override { return reader_->header().stepper != "native"; }
  std::span<const BodyPose> poses() const override { return now_.poses; }
  std::span<const JelloPicture> pictures() const override { return now_.pictures; }
  std::span<const DeformingState> deformations() const override { return now_.deformations; }
  double settledTime() const override { return settledTime_; }
  std::string failure() const override { return failure_; }
  double hearDeformations() override { return reader_->header().deformationStep; }
  std::span<const HostBody* const> bodyChanges() const override { return changes_; }
  bool keepsOrder() const override { return reader_->host() != nullptr; }

 private:
  template <class Record>
  static void move(std::vector<Record>& from, std::vector<Record>& to) {
    to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
  }

  /// False if nothing is to come: the run has ended, or cannot be read.
  bool readMore() {
    Result<std::vector<RunPortion>> more = reader_->next();
    portions_.clear();
    next_ = 0;
    if (!more) {
      failure_ = more.error().message;
    } else {
      portions_ = *std::move(more);
      if (portions_.empty()) settledTime_ = std::numeric_limits<double>::infinity();
    }
    return !portions_.empty();
  }

  std::shared_ptr<RunReader> reader_;
  std::vector<RunPortion> portions_;  // that were read together
  std::size_t next_ = 0;              // of these, not played yet
  double settledTime_ = 0.0;
  RunPortion now_;
  std::vector<const HostBody*> changes_;
  std::string failure_;
};

/// Returns the scene of a host's run.
Scene sceneOfHost(const HostRun& run, const fs::path& file) {
  Scene scene;
  scene.name = file.stem().string();
  scene.duration = run.world.duration;
  scene.sampleRate = run.world.synth.sampleRate;
  scene.medium = run.world.synth.medium;
  scene.stepper.type = StepperType::bullet;
  scene.sound = run.world.synth;
  scene.bodies.resize(run.world.bodies);
  for (const HostBody& body : run.bodies) {
    SceneBody& entry = scene.bodies[body.id];
    if (!entry.name.empty()) continue;  // the first counts
    entry.name = body.name.empty() ? "body" + std::to_string(body.id + 1) : body.name;
    entry.material = body.sound.material;
    entry.shape = GivenShape{std::make_shared<const HostBody>(body)};
  }
  scene.listeners = run.world.listeners;
  for (std::size_t index = 0; index < scene.listeners.size(); ++index) {
    Listener& listener = scene.listeners[index];
    if (listener.name.empty()) listener.name = "listener" + std::to_string(index + 1);
    if (!run.world.paths[index].empty()) scene.paths.push_back({index, run.world.paths[index]});
  }
  return scene;
}

}  // namespace

Result<RunReport> recordRun(const RunToRecord& run,
                            const std::function<void(double share)>& progress, RunGuard* guard) {
  const Scene& scene = *run.scene;
  Result<std::unique_ptr<SceneStepper>> stepper = makeStepper(scene, guard);
  if (!stepper) return stepper.error();
  (*stepper)->showAll();
  const RunHeader header = runHeader(scene, run.text, run.name, (*stepper)->hearDeformations());
  Result<RunWriter> writer = beginRun(run.file, header);
  if (!writer) return writer.error();
  RunReport report;
  const auto take = [&](RunPortion portion) -> Status {
    report.events += portion.events.size();
    report.contacts += portion.contacts.size();
    report.poses += portion.poses.size();
    report.pictures += portion.pictures.size();
    if (progress) progress(portion.settledTime / scene.duration);
    return writer->add(std::move(portion));
  };
  if (const Status ran =
          runInPortions(**stepper, scene.duration, header.deformationStep, guard, take);
      !ran)
    return Error{scene.name + ": " + ran.error().message};
  const Result<std::uintmax_t> bytes = writer->finish();
  if (!bytes) return bytes.error();
  report.bytes = *bytes;
  return report;
}

Result<RecordedRun> openRun(const fs::path& file, bool confined) {
  Result<RunReader> reader = RunReader::open(file);
  if (!reader) return reader.error();
  const RunHeader& header = reader->header();
  if (const HostRun* host = reader->host()) {
    Scene scene = sceneOfHost(*host, file);
    return RecordedRun{std::move(scene), std::make_shared<RunReader>(*std::move(reader))};
  }
  FileAccess access{.confined = confined};
  if (confined) access.folder = file.parent_path();  // the name in the header is a stranger's, too
  Result<Scene> scene = parseScene(header.sceneText, header.sceneFile, access);
  if (!scene)
    return Error{file.string() + ": the scene in it is refused: " + scene.error().message};
  scene->stepper.type = header.stepper == "bullet" ? StepperType::bullet : StepperType::native;
  if (scene->duration != header.duration || runShape(*scene).bodies != header.shape.bodies ||
      runShape(*scene).points != header.shape.points)
    return Error{file.string() +
                 ": the run is not of the scene in the file; expected the same bodies and length"};
  auto shared = std::make_shared<RunReader>(*std::move(reader));
  return RecordedRun{*std::move(scene), std::move(shared)};
}

std::unique_ptr<SceneStepper> runStepper(std::shared_ptr<RunReader> reader) {
  return std::make_unique<RunStepper>(std::move(reader));
}

}  // namespace carom::scenes
