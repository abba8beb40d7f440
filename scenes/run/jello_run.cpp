#include "scenes/run/jello_run.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <memory>
#include <utility>
#include <vector>

#include "audio/io/partial_file.h"
#include "native/jello/jello_limits.h"
#include "scenes/run/native_only.h"
#include "scenes/run/scene_sound.h"

namespace carom::scenes {

using namespace audio;
using namespace native;

namespace {

constexpr std::size_t kJelloBlockFrames = 4096;
constexpr double kFramePeriod = 1.0 / 60.0;  ///< s
constexpr int kParts = 256;                  ///< portions of a run without sound, for its progress

/// A file that is written beside its final name, and gets that name at the end.
class Output {
 public:
  /// Opens the file; returns null if there is no path.
  static Result<std::unique_ptr<Output>> open(const std::optional<std::filesystem::path>& path) {
    if (!path) return std::unique_ptr<Output>();
    auto output = std::make_unique<Output>(*path);
    if (!output->stream_) return Error{path->string() + ": cannot be written"};
    return output;
  }
  explicit Output(const std::filesystem::path& path)
      : file_(path), stream_(file_.path(), std::ios::binary) {}

  std::ofstream& stream() { return stream_; }
  Status finish() {
    stream_.close();
    if (!stream_ || file_.giveName())
      return Error{file_.finalPath().string() + ": cannot be written"};
    return std::monostate{};
  }

 private:
  PartialFile file_;
  std::ofstream stream_;
};

/// Writes a value in little endian on any machine.
template <typename Value>
void put(std::ofstream& stream, Value value) {
  std::array<char, sizeof(Value)> bytes{};
  std::memcpy(bytes.data(), &value, sizeof(Value));
  if constexpr (std::endian::native == std::endian::big) std::ranges::reverse(bytes);
  stream.write(bytes.data(), bytes.size());
}

void put(std::ofstream& stream, const Vec3& place) {
  for (const double coordinate : place)
    put(stream, static_cast<float>(coordinate));
}

void beginTrajectory(std::ofstream& stream, const JelloCoupling& coupling, double picture) {
  const JelloWorld& world = coupling.jello().world();
  stream.write("CAROMJT1", 8);
  put(stream, static_cast<std::uint32_t>(world.pointCount()));
  put(stream, static_cast<std::uint32_t>(world.balls.size()));
  put(stream, picture);
}

void addPicture(std::ofstream& stream, const JelloStepper& stepper) {
  for (std::size_t point = 0; point < stepper.world().pointCount(); ++point)
    put(stream, stepper.position(point));
  for (std::size_t ball = 0; ball < stepper.world().balls.size(); ++ball)
    put(stream, stepper.ballPosition(ball));
}

void addRow(std::ofstream& stream, const JelloStepper& stepper) {
  const JelloEnergy energy = stepper.energy();
  const Vec3 momentum = stepper.momentum();
  stream << stepper.time() << ',' << energy.kinetic << ',' << energy.elastic << ','
         << energy.gravity << ',' << energy.contact << ',' << energy.total() << ',' << momentum.x()
         << ',' << momentum.y() << ',' << momentum.z() << '\n';
}

}  // namespace

/// The trajectory, the energies and the report of a run, kept step by step.
class JelloRun::Tables {
 public:
  static Result<std::unique_ptr<Tables>> open(const Scene& scene, const JelloOptions& options) {
    auto tables = std::make_unique<Tables>(scene.duration, jelloOf(scene)->stepsPerPicture);
    auto trajectory = Output::open(options.trajectoryFile);
    if (!trajectory) return trajectory.error();
    tables->trajectory_ = *std::move(trajectory);
    auto energies = Output::open(options.energyFile);
    if (!energies) return energies.error();
    tables->energies_ = *std::move(energies);
    return tables;
  }
  Tables(double duration, std::size_t stepsPerPicture)
      : duration_(duration), stepsPerPicture_(stepsPerPicture) {}

  void look(const JelloCoupling& coupling) {
    const JelloStepper& jello = coupling.jello();
    if (jello.steps() == 0) begin(coupling);
    for (const ImpulseEvent& event : coupling.events())
      if (event.body == jello.world().id && event.time <= duration_) ++report_.touches;
    if (jello.steps() > wanted_) return;
    if (jello.steps() == wanted_) finish(coupling);
    if (jello.steps() % stepsPerPicture_ != 0) return;
    if (trajectory_) addPicture(trajectory_->stream(), jello);
    if (energies_) addRow(energies_->stream(), jello);
  }

  /// Returns the report of the run so far, or up to the end of the scene if it has got there.
  JelloReport report(const JelloCoupling& coupling) {
    if (coupling.jello().steps() < wanted_) finish(coupling);
    return report_;
  }

  Status name() {
    for (const auto* table : {&trajectory_, &energies_}) {
      if (*table == nullptr) continue;
      if (Status finished = (*table)->finish(); !finished) return finished;
    }
    return std::monostate{};
  }

 private:
  void begin(const JelloCoupling& coupling) {
    const double step = coupling.jello().step();
    wanted_ = static_cast<std::size_t>(std::ceil(duration_ / step - 1e-9));
    if (stepsPerPicture_ == 0)
      stepsPerPicture_ = static_cast<std::size_t>(std::max(1.0, std::round(kFramePeriod / step)));
    report_.start = coupling.jello().energy();
    if (trajectory_)
      beginTrajectory(trajectory_->stream(), coupling,
                      step * static_cast<double>(stepsPerPicture_));
    if (energies_) {
      energies_->stream().precision(12);
      energies_->stream() << "time_s,kinetic_J,elastic_J,gravity_J,contact_J,total_J,"
                             "momentum_x_Ns,momentum_y_Ns,momentum_z_Ns\n";
    }
  }
  void finish(const JelloCoupling& coupling) {
    report_.steps = coupling.jello().steps();
    report_.evaluations = coupling.jello().evaluations();
    report_.metAt = coupling.jello().metAt();
    report_.end = coupling.jello().energy();
    report_.momentum = coupling.jello().momentum();
  }

  double duration_;
  std::size_t stepsPerPicture_;
  std::size_t wanted_ = 0;  // steps
  JelloReport report_;
  std::unique_ptr<Output> trajectory_;
  std::unique_ptr<Output> energies_;
};

JelloRun::JelloRun(const Scene& scene, const JelloOptions& options)
    : scene_(scene), options_(options) {}
JelloRun::JelloRun(JelloRun&&) noexcept = default;
JelloRun::~JelloRun() = default;

Result<JelloRun> JelloRun::create(const Scene& scene, const JelloOptions& options) {
  if (jelloOf(scene) == nullptr)
    return Error{scene.name + ": has no jello; expected a body of type \"jello\""};
  if (scene.stepper.type != StepperType::native)
    return Error{scene.name + ": " + validateForBullet(scene).error().message};
  JelloRun run(scene, options);
  Result<std::unique_ptr<Tables>> tables = Tables::open(scene, options);
  if (!tables) return tables.error();
  run.tables_ = *std::move(tables);
  auto stepper = JelloSceneStepper::create(
      scene, [kept = run.tables_.get()](const JelloCoupling& coupling) { kept->look(coupling); },
      options.guard);
  if (!stepper) return stepper.error();
  run.stepper_ = *std::move(stepper);
  const JelloCoupling& coupling = run.stepper_->coupling();
  run.choice_ = run.stepper_->choice();
  const auto which = static_cast<std::size_t>(run.choice_.stepping.integrator);
  run.limit_ = jelloLimits(coupling.jello().world()).touching[which];
  return run;
}

Result<JelloReport> JelloRun::run() {
  // The sound takes ownership of the stepper, and is destroyed before this JelloRun is.
  JelloSceneStepper& stepper = *stepper_;
  JelloReport heard;
  if (options_.soundFile) {
    if (Status written = hear(heard); !written) return written.error();
    return heard;
  }
  for (int part = 1; part <= kParts && stepper.failure().empty(); ++part) {
    const double share = static_cast<double>(part) / kParts;
    stepper.advanceTo(share * scene_.duration);
    if (isEnded()) break;
    if (options_.progress) options_.progress(share);
  }
  JelloReport report = reportOf(stepper);
  if (report.endedEarly && !options_.keepPartial) return report;
  if (Status named = tables_->name(); !named) return named.error();
  return report;
}

bool JelloRun::isEnded() const {
  return options_.guard != nullptr && options_.guard->ended();
}

JelloReport JelloRun::reportOf(const JelloSceneStepper& stepper) const {
  JelloReport report = tables_->report(stepper.coupling());
  const double spent = stepper.processorTime();
  if (spent > 0.0)
    report.stepsPerSecond = static_cast<double>(stepper.coupling().jello().steps()) / spent;
  if (stepper.coupling().time() < scene_.duration) report.blowUp = stepper.failure();
  if (isEnded()) report.endedEarly = options_.guard->ended();
  return report;
}

Status JelloRun::hear(JelloReport& report) {
  const JelloSceneStepper& stepper = *stepper_;
  Result<SceneSound> sound = SceneSound::create(scene_, std::move(stepper_), {});
  if (!sound) return sound.error();
  if (options_.guard != nullptr) sound->watch(*options_.guard);
  options_.sound.sampleRate = scene_.sampleRate;
  options_.sound.channels = channelsOf(scene_);
  Result<SoundFileWriter> writer = SoundFileWriter::create(*options_.soundFile, options_.sound);
  if (!writer) return writer.error();
  std::vector<std::vector<float>> channels(channelsOf(scene_),
                                           std::vector<float>(kJelloBlockFrames));
  std::vector<const float*> pointers;
  pointers.reserve(channels.size());
  for (const auto& channel : channels)
    pointers.push_back(channel.data());
  while (const std::size_t frames = sound->render(channels)) {
    if (Status written = writer->write(pointers, frames); !written) return written;
    if (options_.progress)
      options_.progress(static_cast<double>(sound->framesDone()) /
                        static_cast<double>(std::max<std::int64_t>(1, sound->frames())));
  }
  report = reportOf(stepper);
  report.peak = writer->peakPressure();
  if (report.endedEarly && !options_.keepPartial) return std::monostate{};
  if (Status named = tables_->name(); !named) return named;
  return writer->finish();
}

}  // namespace carom::scenes
