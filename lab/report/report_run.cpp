#include "lab/report/report_run.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "lab/compare/local_reference.h"
#include "lab/report/memory_use.h"

#include "scenes/run/bullet_scene.h"
#include "scenes/run/jello_scene.h"
#include "scenes/run/scene_sound.h"
#include "scenes/run/scene_stepper.h"
#include "scenes/run/stopwatch.h"

namespace carom::lab {

using namespace scenes;

using namespace native;

namespace {

constexpr std::size_t kReportBlock = 4096;
constexpr double kReportFrame = 1.0 / 60.0;  // s
constexpr double kMostPairTests = 1e7;       // pair tests of LocalReference: some seconds

bool isSphere(const SceneBody& body) {
  return std::holds_alternative<SphereShape>(body.shape);
}

// True if LocalReference can follow the scene, and will not take too long.
bool hasExactPath(const Scene& scene) {
  const bool solids = std::ranges::any_of(scene.bodies, [](const SceneBody& body) {
    return std::holds_alternative<SolidShape>(body.shape);
  });
  const auto spheres = static_cast<double>(std::ranges::count_if(scene.bodies, isSphere));
  const double steps = scene.duration / scene.stepper.step;
  return !solids && steps * spheres * static_cast<double>(scene.bodies.size()) <= kMostPairTests;
}

double toDouble(btScalar value) {
  return static_cast<double>(value);
}

/// Has a guard, if any, look at the run, which is at `time` (s).
Status look(RunGuard* guard, double time) {
  if (guard != nullptr) guard->mayGoOn(time);
  return checkEnded(guard);
}

MechanicsRun::Energy energyOf(const BulletScene& world, std::size_t bodies, double time) {
  MechanicsRun::Energy energy = {time, 0.0, 0.0};
  for (std::size_t index = 0; index < bodies; ++index) {
    const btRigidBody& body = world.body(index);
    if (body.getInvMass() <= 0) continue;
    const double mass = 1.0 / toDouble(body.getInvMass());
    const btVector3& velocity = body.getLinearVelocity();
    const btVector3 spin =
        body.getWorldTransform().getBasis().transpose() * body.getAngularVelocity();
    const btVector3 inertia = body.getLocalInertia();
    energy.kinetic += 0.5 * mass * toDouble(velocity.length2());
    energy.kinetic += 0.5 * toDouble((inertia * spin).dot(spin));
    energy.potential -= mass * toDouble(body.getGravity().dot(body.getCenterOfMassPosition()));
  }
  return energy;
}

Status watchBullet(const Scene& scene, MechanicsRun& run, RunGuard* guard) {
  run.world = std::make_unique<BulletScene>(scene);
  run.poller = std::make_unique<ContactPoller>(*run.world);
  const bool exact = hasExactPath(scene);
  LocalReference reference(scene);
  const auto step = static_cast<btScalar>(scene.stepper.step);
  double time = 0.0;
  run.energies.push_back(energyOf(*run.world, scene.bodies.size(), time));
  while (time < scene.duration) {
    if (Status ended = look(guard, time); !ended) return ended;
    run.poller->beforeStep();
    if (exact) reference.beforeStep(*run.world);
    run.world->world().stepSimulation(step, 0);
    if (exact) reference.afterStep(*run.world, toDouble(step));
    run.poller->afterStep(toDouble(step));
    time += toDouble(step);
    run.energies.push_back(energyOf(*run.world, scene.bodies.size(), time));
  }
  if (exact) run.exact = reference.events();
  return std::monostate{};
}

Status watchSpheres(const Scene& scene, MechanicsRun& run, RunGuard* guard) {
  Result<SphereStepper> stepper = nativeStepper(scene);
  if (!stepper) return stepper.error();
  const auto pictures = static_cast<std::size_t>(scene.duration / kReportFrame);
  for (std::size_t picture = 0; picture <= pictures; ++picture) {
    const double time = kReportFrame * static_cast<double>(picture);
    static_cast<void>(stepper->advanceTo(time));
    if (Status ended = look(guard, time); !ended) return ended;
    run.energies.push_back({time, stepper->kineticEnergy(), stepper->potentialEnergy()});
  }
  return std::monostate{};
}

Status watchJello(const Scene& scene, MechanicsRun& run, RunGuard* guard) {
  double next = 0.0;
  const auto watch = [&](const JelloCoupling& coupling) {
    // Steps divide a picture into whole parts: a difference is rounding.
    if (coupling.time() < next - 1e-9) return;
    next += kReportFrame;
    const JelloStepper& jello = coupling.jello();
    const JelloEnergy energy = jello.energy();
    const SphereStepper& spheres = coupling.spheres();
    run.energies.push_back({coupling.time(), energy.kinetic + spheres.kineticEnergy(),
                            energy.total() - energy.kinetic + spheres.potentialEnergy()});
    std::vector<Vec3>& places = run.places.emplace_back();
    places.reserve(jello.world().pointCount());
    for (std::size_t point = 0; point < jello.world().pointCount(); ++point)
      places.push_back(jello.position(point));
  };
  auto stepper = JelloSceneStepper::create(scene, watch, guard);
  if (!stepper) return stepper.error();
  (*stepper)->watch(guard);
  while ((*stepper)->settledTime() < scene.duration && (*stepper)->failure().empty()) {
    static_cast<void>((*stepper)->advanceTo(scene.duration));
    if (Status ended = checkEnded(guard); !ended) return ended;
  }
  return std::monostate{};
}

Status watch(const Scene& scene, MechanicsRun& run, RunGuard* guard) {
  if (guard != nullptr) guard->restart();
  if (scene.stepper.type == StepperType::bullet) return watchBullet(scene, run, guard);
  return jelloOf(scene) != nullptr ? watchJello(scene, run, guard)
                                   : watchSpheres(scene, run, guard);
}

/// Measures the heap that is used beyond what was in use when it was constructed.
class HeapWatch {
 public:
  void look() { most_ = std::max(most_, heapInUse().value_or(0)); }
  std::optional<std::size_t> most() const {
    if (!before_) return std::nullopt;
    return most_ > *before_ ? most_ - *before_ : 0;
  }

 private:
  std::optional<std::size_t> before_ = heapInUse();
  std::size_t most_ = 0;
};

Status measureMemory(const Scene& scene, MechanicsRun& run, RunGuard* guard) {
  HeapWatch heap;
  if (guard != nullptr) guard->restart();
  Result<std::unique_ptr<SceneStepper>> stepper = makeStepper(scene, guard);
  if (!stepper) return stepper.error();
  (*stepper)->watch(guard);
  while ((*stepper)->settledTime() < scene.duration && (*stepper)->failure().empty()) {
    static_cast<void>((*stepper)->advanceTo((*stepper)->settledTime() + kReportFrame));
    heap.look();
    if (Status ended = checkEnded(guard); !ended) return ended;
  }
  run.memory = heap.most();
  return std::monostate{};
}

}  // namespace

Scene withAllImpulses(const Scene& scene) {
  Scene complete = scene;
  complete.sound.impulse = ImpulseChoice::applied;
  return complete;
}

Result<double> expectedSeconds(const Scene& scene, RunGuard* guard) {
  if (jelloOf(scene) == nullptr) return 0.0;
  Result<std::unique_ptr<SceneStepper>> stepper = makeStepper(scene, guard);
  if (!stepper) return stepper.error();
  constexpr double kTrial = 0.05;  // s of wall time
  const Stopwatch stopwatch;
  while (stopwatch.seconds() < kTrial && (*stepper)->settledTime() < scene.duration &&
         (*stepper)->failure().empty())
    static_cast<void>((*stepper)->advanceTo((*stepper)->settledTime() + 1e-5 * scene.duration));
  return stopwatch.seconds() * scene.duration / std::max((*stepper)->settledTime(), 1e-9);
}

Result<MechanicsRun> runMechanics(const Scene& scene, const RunsOptions& options) {
  MechanicsRun run;
  const Scene complete = withAllImpulses(scene);
  const Stopwatch stopwatch;
  if (Status measured = measureMemory(complete, run, options.guard); !measured)
    return measured.error();
  const std::size_t timed = stopwatch.seconds() > kLongRun ? 1 : options.runs;
  for (std::size_t i = 0; i < timed; ++i) {
    Result<std::unique_ptr<SceneStepper>> stepper = makeStepper(complete, options.guard);
    if (!stepper) return stepper.error();
    Result<EventTape> tape = recordTape(**stepper, scene.duration, options.guard);
    if (!tape) return tape.error();
    run.seconds.push_back(tape->seconds);
    if (run.tape == nullptr) run.tape = std::make_shared<const EventTape>(*std::move(tape));
  }
  if (Status watched = watch(scene, run, options.guard); !watched) return watched.error();
  return run;
}

double heardTime(const ImpulseEvent& event, const MechanicsRun& run, const ReportChoice& choice) {
  if (choice.stepper.type != StepperType::bullet || choice.eventTime == EventTime::exact)
    return event.time;
  const double step = choice.stepper.step;
  const auto polled = run.poller->nearest(event.body, event.other, event.time, 2.0 * step);
  // A contact that Bullet did not push, but that the bridge
  // knows of, is seen at the end of its step.
  const PolledContact contact =
      polled.value_or(PolledContact{std::ceil(event.time / step) * step, event.time});
  return choice.eventTime == EventTime::step ? contact.seen : std::max(0.0, contact.backDated);
}

EventTape chosenTape(const MechanicsRun& run, const ReportChoice& choice) {
  EventTape tape = *run.tape;
  for (audio::RunPortion& portion : tape.portions)
    for (ImpulseEvent& event : portion.events)
      event.time = heardTime(event, run, choice);
  return tape;
}

EventTape withEvents(const EventTape& tape, const std::vector<ImpulseEvent>& events) {
  EventTape changed = tape;
  for (audio::RunPortion& portion : changed.portions)
    portion.events.clear();
  for (const ImpulseEvent& event : events) {
    const auto portion = std::ranges::find_if(
        changed.portions,
        [&event](const audio::RunPortion& one) { return one.settledTime >= event.time; });
    if (portion != changed.portions.end()) portion->events.push_back(event);
  }
  return changed;
}

Result<SoundRun> runSound(const Scene& scene, const std::shared_ptr<const EventTape>& tape,
                          const RunsOptions& options) {
  SoundRun run;
  const auto frames = static_cast<std::size_t>(std::llround(scene.duration * scene.sampleRate));
  std::vector<std::vector<float>> block(channelsOf(scene), std::vector<float>(kReportBlock));
  run.signal.resize(block.size());
  for (std::vector<float>& channel : run.signal)
    channel.reserve(frames);
  // The first run is not counted: it finds caches cold and tables still to be made.
  for (std::size_t i = 0; i <= options.runs; ++i) {
    HeapWatch heap;
    Result<SceneSound> sound =
        SceneSound::create(scene, tapeStepper(tape), {}, withinLimits(options.guard, {}));
    if (!sound) return sound.error();
    if (options.guard != nullptr) sound->watch(*options.guard);
    for (std::vector<float>& channel : run.signal)
      channel.clear();
    const Stopwatch stopwatch;
    while (const std::size_t count = sound->render(block)) {
      for (std::size_t channel = 0; channel < block.size(); ++channel)
        run.signal[channel].insert(run.signal[channel].end(), block[channel].begin(),
                                   block[channel].begin() + static_cast<std::ptrdiff_t>(count));
      if (i == 0) heap.look();
    }
    if (Status ended = checkEnded(options.guard); !ended) return ended.error();
    if (i == 0) run.memory = heap.most();
    if (i > 0) run.seconds.push_back(stopwatch.seconds());
  }
  return run;
}

}  // namespace carom::lab
