#include "lab/estimate/run_estimate.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <unordered_set>
#include <variant>

#include "carom/audio/panel_radiator.h"
#include "carom/native/sphere_stepper.h"
#include "native/jello/jello_coupling.h"
#include "native/jello/jello_limits.h"
#include "native/mechanics/linkage.h"
#include "scenes/limits/run_guard.h"
#include "scenes/run/jello_scene.h"
#include "scenes/run/scene_modes.h"
#include "scenes/run/scene_sound.h"
#include "scenes/run/scene_stepper.h"
#include "scenes/run/solid_surface.h"

namespace carom::lab {

using namespace native;

namespace {

// Times on one core of 2020, in s.
constexpr double kPointTime = 27e-9;     // forces on a point of a jello
constexpr double kImplicitTime = 27e-6;  // a point in a step of backward Euler
constexpr double kBulletTime = 20e-6;    // a step of a Bullet world
constexpr double kBodyTime = 3e-6;       // a body in it
constexpr double kForceStepTime = 1e-6;  // a step of springs, rods, fields and drag
constexpr double kEventTime = 2e-6;      // an event's mechanics
constexpr double kClickTime = 2e-6;      // an event's sound over one path
constexpr double kFrameTime = 100e-9;    // a sample of a channel
constexpr double kMinute = 60.0;         // s

// Memory in bytes.
constexpr double kProgram = 50e6;
constexpr double kPointSize = 500.0;
constexpr double kImplicitSize = 100e3;  // a point with its share of the factors
constexpr double kBodySize = 4000.0;
constexpr double kEventSize = 200.0;  // an event that waits, for one path
constexpr double kWait = 0.2;         // s, for which an event waits at most

// The modes of a cube (./bench modal): 60 of 20,000 degrees of freedom take 3.9 s and 345 MB, of
// 60,000 27 s and 1820 MB. The exponents are those of the line through the two on logarithmic
// scales; a factor of a three-dimensional grid has the power 4/3 of its unknowns, and takes their
// square to make. Radiation solves a full system of complex numbers for each mode: 22 s and 20 MB
// for 60 modes and 800 panels. (At 5,000 and 40,000 degrees of freedom memory is right to 15 %,
// time within a factor of three; at 400 panels time within two.)
constexpr std::size_t kUsualFreedom = 5000;         // where accuracy decides, roughly
constexpr double kSolidTime = 3.9 / 60.0;           // s, for a mode of kSolidFreedom
constexpr double kSolidSize = 345e6;                // bytes, at kSolidFreedom
constexpr double kSolidFreedom = 20'000.0;          // degrees of freedom
constexpr double kSolidTimePower = 1.77;            // of the degrees of freedom
constexpr double kSolidSizePower = 1.5;             // of the degrees of freedom
constexpr double kShellTime = 4.0;                  // s, all modes of kShellFreedom: a full matrix
constexpr double kShellFreedom = 1000.0;            // degrees of freedom
constexpr double kPanelTime = 22.0 / 60.0 / 512e6;  // s, for a mode, over the panels' cube
constexpr double kPanelSize = 32.0;                 // bytes, over the panels' square

// The recoil of a shape, solved at 30 frequencies with up to 450 panels: 3 to 15 s.
constexpr double kRecoilTime = 8.0;  // s

constexpr std::size_t kPilotEvents = 4000;
constexpr double kPilotTime = 0.25;  // s, of the scene

/// Evaluations of all forces in a step.
double evaluationsOf(JelloIntegrator integrator) {
  if (integrator == JelloIntegrator::rungeKutta4) return 4.0;
  return integrator == JelloIntegrator::midpoint ? 2.0 : 1.0;
}

/// Adds up what a run takes, and remembers what takes most of it.
class Sum {
 public:
  void add(double seconds, const std::string& what) {
    estimate.wall += seconds;
    if (seconds <= longest_) return;
    longest_ = seconds;
    estimate.longest = what;
  }
  RunEstimate estimate = {.memory = kProgram, .longest = {}};

 private:
  double longest_ = 0.0;  // s
};

std::string bodyText(const SceneBody& body) {
  return '"' + body.name + '"' + (body.pointer.empty() ? "" : " (" + body.pointer + ")");
}

/// Returns the degrees of freedom of a body's analysis.
double freedomOf(const MeshAnalysisSettings& settings, const SurfaceMesh& surface) {
  if (settings.body == BodyModel::shell) {
    const auto vertices = static_cast<double>(std::clamp(
        surface.vertices.size(), settings.shell.minVertices, settings.shell.maxVertices));
    return settings.shell.springs == ShellSprings::axial ? 3.0 * vertices : vertices;
  }
  const GridSettings& grid = settings.solid.grid;
  if (!grid.cellSize) {
    return static_cast<double>(grid.degreesOfFreedom.value_or(kUsualFreedom));
  }
  const double cells = std::cbrt(std::abs(signedVolume(surface))) / *grid.cellSize;
  return 3.0 * std::pow(cells + 3.0, 3.0);
}

void addModes(const ModesToCompute& one, Sum& sum) {
  const MeshAnalysisSettings& settings = one.body->ringing->analysis;
  const double freedom = freedomOf(settings, one.surface);
  const bool isShell = settings.body == BodyModel::shell;
  const double modes = isShell ? static_cast<double>(settings.shell.maxModes)
                               : static_cast<double>(settings.solid.maxModes);
  const double share = freedom / (isShell ? kShellFreedom : kSolidFreedom);
  double seconds = isShell ? kShellTime * std::pow(share, 3.0)
                           : kSolidTime * modes * std::pow(share, kSolidTimePower);
  double size = isShell ? 3.0 * sizeof(double) * freedom * freedom
                        : kSolidSize * std::pow(share, kSolidSizePower);
  if (settings.radiation) {
    const auto panels = static_cast<double>(settings.radiation->panels);
    seconds += kPanelTime * modes * panels * panels * panels;
    size = std::max(size, kPanelSize * panels * panels);
  }
  sum.estimate.degreesOfFreedom += freedom;
  sum.estimate.memory = std::max(sum.estimate.memory, kProgram + size);
  std::ostringstream text;
  text << "the modes of " << bodyText(*one.body) << ", of " << freedom
       << " degrees of freedom, unless they are in the cache";
  sum.add(seconds, text.str());
}

void addRecoils(const Scene& scene, Sum& sum) {
  std::unordered_set<SurfaceMesh, RadiatorCache::Hash> shapes;
  for (const SceneBody& body : scene.bodies)
    if (const auto* solid = std::get_if<SolidShape>(&body.shape); solid && solid->canMove())
      shapes.insert(surfaceOf(*solid));
  std::ostringstream text;
  text << "the recoil of " << shapes.size() << (shapes.size() == 1 ? " shape" : " shapes")
       << " (/sound/recoil), unless they are in the cache";
  sum.add(kRecoilTime * static_cast<double>(shapes.size()), text.str());
}

/// Returns the step of a jello whose scene leaves it open: half of the longest that is
/// stable, as steps may be divided.
JelloStepping steppingOf(const JelloShape& jello, const JelloWorld& world) {
  const JelloIntegrator integrator = jello.integrator.value_or(JelloIntegrator::leapfrog);
  if (jello.step > 0.0) return {integrator, jello.step};
  const double stable = jelloLimits(world).touching[static_cast<std::size_t>(integrator)];
  return {integrator, std::min(5e-3, 0.45 * std::max(stable, 1e-30))};
}

void addJello(const Scene& scene, Sum& sum) {
  const auto* jello = jelloOf(scene);
  const JelloWorld world = withSpheres(jelloWorld(scene), sphereWorld(scene));
  if (!validate(world)) return;
  const JelloStepping stepping = steppingOf(*jello, world);
  const bool implicit = stepping.integrator == JelloIntegrator::backwardEuler;
  const auto points = static_cast<double>(world.pointCount());
  const double steps = std::ceil(scene.duration / stepping.step);
  sum.estimate.steps += steps;
  sum.estimate.memory += points * (implicit ? kImplicitSize : kPointSize);
  const auto body = std::ranges::find_if(scene.bodies, [](const SceneBody& of) {
    return std::holds_alternative<std::shared_ptr<const JelloShape>>(of.shape);
  });
  std::ostringstream text;
  text << "the jello " << bodyText(*body) << ", " << steps << " steps of " << points << " points";
  sum.add(
      steps * points * (implicit ? kImplicitTime : kPointTime * evaluationsOf(stepping.integrator)),
      text.str());
}

void addBullet(const Scene& scene, Sum& sum) {
  const double steps = std::ceil(scene.duration / scene.stepper.step);
  sum.estimate.steps += steps;
  std::ostringstream text;
  text << steps << " steps of Bullet with " << scene.bodies.size() << " bodies (/stepper/step)";
  sum.add(steps * (kBulletTime + kBodyTime * static_cast<double>(scene.bodies.size())), text.str());
}

/// Returns the steps of springs in a second: see Linkage.
double springRate(const Scene& scene) {
  double fastest = 0.0;  // rad/s
  for (const Spring& spring : scene.mechanics.springs) {
    double inverse = 0.0;  // 1/kg
    for (const BodyId end : {spring.sphere, spring.other}) {
      if (end >= scene.bodies.size()) continue;
      if (const auto* sphere = std::get_if<SphereShape>(&scene.bodies[end].shape))
        inverse += 1.0 / sphere->mass;
    }
    fastest = std::max(fastest, std::sqrt(spring.stiffness * inverse));
  }
  if (scene.mechanics.forceStep > 0.0) return 1.0 / scene.mechanics.forceStep;
  return fastest / kForceStepAngle;
}

/// Runs the first collisions. Returns the events in a second; of whom most are is told in `sum`.
void addCollisions(const Scene& scene, double mostTime, Sum& sum, double paths) {
  Result<SphereStepper> stepper = nativeStepper(scene);
  if (!stepper) return;
  const double end = std::min({scene.duration, kPilotTime, mostTime});
  // It stops at the events, or where steps of rods become too many to go on.
  const std::size_t events = stepper->advanceTo(end, kPilotEvents).size();
  if (events == 0) return;
  const double rate = static_cast<double>(events) / std::max(stepper->time(), 1e-12);
  const double all = std::round(rate * scene.duration);
  sum.estimate.events = all;
  sum.estimate.memory += kEventSize * rate * std::min(kWait, scene.duration) * paths;
  std::ostringstream text;
  text << all << " events, as many as in the first " << stepper->time() << " s";
  sum.add(all * (kEventTime + kClickTime * paths), text.str());
}

void addNative(const Scene& scene, double paths, Sum& sum) {
  const double rate = springRate(scene);
  if (rate > 0.0) {
    const double steps = std::ceil(rate * scene.duration);
    sum.estimate.steps += steps;
    std::ostringstream text;
    text << steps << " steps of springs (/mechanics/springs)";
    sum.add(steps * kForceStepTime * static_cast<double>(scene.mechanics.springs.size()),
            text.str());
  }
  // So many steps of springs take 10 ms.
  addCollisions(scene, rate > 0.0 ? 1e4 / rate : kPilotTime, sum, paths);
}

}  // namespace

RunEstimate estimateRun(const Scene& scene) {
  Sum sum;
  const auto channels = static_cast<double>(channelsOf(scene));
  const double paths = channels * (1.0 + static_cast<double>(imageCount(scene)));
  if (jelloOf(scene) != nullptr)
    addJello(scene, sum);
  else if (scene.stepper.type == StepperType::bullet)
    addBullet(scene, sum);
  else
    addNative(scene, paths, sum);
  // Models are computed one after the other, before the run.
  for (const ModesToCompute& one : modesToCompute(scene))
    addModes(one, sum);
  if (hearsRecoils(scene)) addRecoils(scene, sum);
  sum.estimate.memory += kBodySize * static_cast<double>(scene.bodies.size()) * (1.0 + channels);
  std::ostringstream text;
  text << scene.duration << " s of sound in " << channels << " channels (/duration)";
  sum.add(scene.duration * scene.sampleRate * channels * kFrameTime, text.str());
  return sum.estimate;
}

std::string longRunWarning(const RunEstimate& estimate) {
  if (estimate.wall <= kMinute) return {};
  std::ostringstream text;
  text.precision(2);
  text << "this may take ";
  if (estimate.wall < 120.0 * kMinute)
    text << estimate.wall / kMinute << " minutes";
  else if (estimate.wall < 48.0 * 3600.0)
    text << estimate.wall / 3600.0 << " hours";
  else
    text << estimate.wall / 86400.0 << " days";
  text << ", most of it for " << estimate.longest << "; --max-time ends it";
  return text.str();
}

}  // namespace carom::lab
