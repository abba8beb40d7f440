#include "scenes/run/jello_scene.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>
#include <utility>

#include "carom/audio/panel_radiator.h"
#include "native/jello/jello_limits.h"
#include "scenes/format/jello_reader.h"
#include "scenes/run/processor_time.h"
#include "scenes/run/solid_surface.h"

namespace carom::scenes {

using namespace native;

namespace {

/// States per sample of the sound that suffice: more than these are thinned out.
constexpr double kMostStates = 8.0;
constexpr double kLeastStep = 1e-15;  // s: a clock does not count shorter ones
/// Share of the jello's size within which a hand holds its points.
constexpr double kReach = 0.3;

/// Returns the volume of the resting box and of the air that moves with it, in the mean over
/// directions, m^3.
double movedVolume(const JelloLattice& lattice) {
  SolidShape box;
  box.form = BoxForm{0.5 * lattice.size};
  const double volume = lattice.size.prod();
  const Result<RigidRadiator> radiator = panelRadiator(surfaceOf(box));
  // A box so flat that its panels cannot be solved moves next to nothing but itself.
  return radiator ? volume + radiator->addedVolume.topLeftCorner<3, 3>().trace() / 3.0 : volume;
}

Result<JelloChoice> choiceOf(const Scene& scene, const JelloShape& jello, const JelloWorld& world,
                             const SphereWorld& spheres, RunGuard* guard) {
  if (jello.integrator && jello.step > 0.0)
    return JelloChoice{.stepping = {*jello.integrator, jello.step}};
  return chooseStepping(world, spheres,
                        {.error = jello.error,
                         .seconds = scene.duration,
                         .integrator = jello.integrator,
                         .goesOn = [guard] { return guard == nullptr || guard->mayGoOn(0.0); }});
}

}  // namespace

Status validateJello(const Scene& scene) {
  if (jelloOf(scene) == nullptr) return std::monostate{};
  for (const SceneBody& body : scene.bodies) {
    const auto* plane = std::get_if<PlaneShape>(&body.shape);
    const bool moves = plane != nullptr &&
                       !(plane->velocity.isZero(0.0) && plane->oscillation.amplitude.isZero(0.0));
    const bool isBlock = std::holds_alternative<BlockShape>(body.shape);
    if (moves || isBlock)
      return Error{
          "body \"" + body.name + "\": a " + (isBlock ? "block" : "plane that moves") +
          " cannot be beside a jello; expected spheres, boxes and planes that stand still"};
  }
  return std::monostate{};
}

std::string stableText(double limit) {
  if (limit == 0.0) return "at no step";
  if (std::isinf(limit)) return "at any step";
  std::ostringstream text;
  text << "up to " << 1e3 * limit << " ms";
  return text.str();
}

std::string instabilityWarning(const JelloStepping& stepping, double limit) {
  if (stepping.step <= limit) return {};
  std::ostringstream text;
  text << nameOf(stepping.integrator) << " is stable " << stableText(limit) << ", and the step is "
       << 1e3 * stepping.step << " ms: it may blow up";
  return text.str();
}

std::string instabilityWarning(const Scene& scene) {
  const JelloShape* jello = jelloOf(scene);
  if (jello == nullptr || !jello->integrator || jello->step == 0.0) return {};
  const JelloWorld world = withSpheres(jelloWorld(scene), sphereWorld(scene));
  if (!validate(world)) return {};
  const auto which = static_cast<std::size_t>(*jello->integrator);
  return instabilityWarning({*jello->integrator, jello->step}, jelloLimits(world).touching[which]);
}

JelloWorld jelloWorld(const Scene& scene) {
  JelloWorld world;
  world.gravity = scene.gravity;
  for (std::size_t index = 0; index < scene.bodies.size(); ++index) {
    const auto& shape = scene.bodies[index].shape;
    const auto id = static_cast<BodyId>(index);
    if (const auto* plane = std::get_if<PlaneShape>(&shape))
      world.planes.push_back({id, plane->normal, plane->offset});
    const auto* jello = std::get_if<std::shared_ptr<const JelloShape>>(&shape);
    if (jello == nullptr) continue;
    world.id = id;
    world.lattice = (*jello)->lattice;
    world.contact = (*jello)->contact;
    world.field = (*jello)->field;
    world.positions = (*jello)->positions;
    world.velocities = (*jello)->velocities;
  }
  return world;
}

Result<std::unique_ptr<JelloSceneStepper>> JelloSceneStepper::create(const Scene& scene,
                                                                     Watch watch, RunGuard* guard) {
  if (const Status valid = validateJello(scene); !valid)
    return Error{scene.name + ": " + valid.error().message};
  const JelloWorld world = jelloWorld(scene);
  const SphereWorld spheres = sphereWorld(scene);
  const Result<JelloChoice> choice = choiceOf(scene, *jelloOf(scene), world, spheres, guard);
  if (!choice) return Error{scene.name + ": " + choice.error().message};
  if (choice->stepping.step < kLeastStep) {
    std::ostringstream why;
    why << scene.name << ": its jello asks for steps of " << choice->stepping.step
        << " s, as it is stiff, or damped, beside its mass; expected one for which " << kLeastStep
        << " s are short enough";
    return Error{why.str()};
  }
  Result<JelloCoupling> coupling = JelloCoupling::create(world, spheres, choice->stepping);
  if (!coupling) return Error{scene.name + ": " + coupling.error().message};
  std::unique_ptr<JelloSceneStepper> stepper(
      new JelloSceneStepper(scene, *std::move(coupling), *choice, std::move(watch)));
  stepper->SceneStepper::watch(guard);
  return stepper;
}

JelloSceneStepper::JelloSceneStepper(const Scene& scene, JelloCoupling coupling,
                                     const JelloChoice& choice, Watch watch)
    : coupling_(std::move(coupling)),
      choice_(choice),
      watch_(std::move(watch)),
      stride_(static_cast<std::size_t>(std::clamp(
          std::floor(1.0 / (choice.stepping.step * scene.sampleRate) / kMostStates), 1.0, 1e9))) {
  for (const Sphere& sphere : sphereWorld(scene).spheres)
    spheres_.push_back(sphere.id);
  look();
}

double JelloSceneStepper::hearDeformations() {
  movedVolume_ = movedVolume(coupling_.jello().world().lattice);
  keepState();
  return coupling_.jello().step() * static_cast<double>(stride_);
}

void JelloSceneStepper::showAll() {
  isShown_ = true;
  keepPicture();
}

void JelloSceneStepper::look() {
  if (watch_) watch_(coupling_);
  if (movedVolume_ > 0.0) keepState();
  if (isShown_ && coupling_.time() >= nextPicture_) keepPicture();
}

void JelloSceneStepper::keepPicture() {
  const double time = coupling_.time();
  const JelloStepper& jello = coupling_.jello();
  JelloPicture& picture = pictures_.emplace_back();
  picture.time = time;
  for (std::size_t point = 0; point < jello.world().pointCount(); ++point) {
    const Vec3 position = jello.position(point);
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      picture.points.push_back(static_cast<float>(position[axis]));
  }
  for (std::size_t sphere = 0; sphere < spheres_.size(); ++sphere)
    poses_.push_back({spheres_[sphere], {time, coupling_.spheres().state(sphere).position}});
  nextPicture_ = (std::floor(time / kPictureStep) + 1.0) * kPictureStep;
}

void JelloSceneStepper::keepState() {
  const JelloStepper& jello = coupling_.jello();
  if (jello.steps() % stride_ != 0) return;
  const double mass =
      jello.world().lattice.pointMass * static_cast<double>(jello.world().pointCount());
  states_.push_back({jello.volume(), jello.centre(), movedVolume_ / mass * jello.jelloMomentum()});
}

void JelloSceneStepper::putState(Scene& scene) const {
  const JelloStepper& jello = coupling_.jello();
  for (SceneBody& body : scene.bodies) {
    auto* const shape = std::get_if<std::shared_ptr<const JelloShape>>(&body.shape);
    if (shape == nullptr) continue;
    auto moved = std::make_shared<JelloShape>(**shape);
    for (std::size_t point = 0; point < jello.world().pointCount(); ++point) {
      moved->positions[point] = jello.position(point);
      moved->velocities[point] = jello.velocity(point);
    }
    // The integrator and the step that were chosen stay: a choice takes some tenths of a second.
    moved->integrator = choice_.stepping.integrator;
    moved->step = choice_.stepping.step;
    *shape = std::move(moved);
  }
  for (std::size_t sphere = 0; sphere < spheres_.size(); ++sphere) {
    const SphereState state = coupling_.spheres().state(sphere);
    auto& shape = std::get<SphereShape>(scene.bodies[spheres_[sphere]].shape);
    shape.position = state.position;
    shape.velocity = state.velocity;
    shape.spin = state.spin;
  }
}

void JelloSceneStepper::push(BodyId body, const Vec3& velocityChange) {
  for (std::size_t sphere = 0; sphere < spheres_.size(); ++sphere)
    if (spheres_[sphere] == body) coupling_.pushSphere(sphere, velocityChange);
  if (coupling_.jello().world().id != body) return;
  for (std::size_t point = 0; point < coupling_.jello().world().pointCount(); ++point)
    coupling_.pushPoint(point, velocityChange);
}

/// Draws the sphere, or the points of the jello about the one that is held, through one step.
void JelloSceneStepper::draw() {
  const JelloStepper& jello = coupling_.jello();
  const double step = jello.step();
  const Vec3& gravity = jello.world().gravity;
  for (std::size_t sphere = 0; sphere < spheres_.size(); ++sphere) {
    if (spheres_[sphere] != pull_->body) continue;
    const SphereState state = coupling_.spheres().state(sphere);
    coupling_.pushSphere(sphere, pullOf(*pull_, {state.position, state.velocity}, gravity, step));
  }
  if (jello.world().id != pull_->body || pull_->point >= jello.world().pointCount()) return;
  const Vec3 held = jello.position(pull_->point);
  const Vec3 change = pullOf(*pull_, {held, jello.velocity(pull_->point)}, gravity, step);
  const double reach = kReach * jello.world().lattice.size.maxCoeff();
  for (std::size_t point = 0; point < jello.world().pointCount(); ++point) {
    const double share = 1.0 - (jello.position(point) - held).norm() / reach;
    if (share > 0.0) coupling_.pushPoint(point, share * change);
  }
}

std::span<const ImpulseEvent> JelloSceneStepper::advanceTo(double time) {
  events_.clear();
  if (coupling_.time() > 0.0) {  // the first ones are kept before the first call
    states_.clear();
    poses_.clear();
    pictures_.clear();
  }
  const double begin = processorSeconds();
  while (failure_.empty() && coupling_.settledTime() < time && mayGoOn(coupling_.settledTime())) {
    if (pull_) draw();
    if (const Status stepped = coupling_.advance(); !stepped) {
      failure_ = stepped.error().message;
      break;
    }
    events_.insert(events_.end(), coupling_.events().begin(), coupling_.events().end());
    count(coupling_.events(), coupling_.settledTime());
    look();
  }
  processorTime_ += processorSeconds() - begin;
  return events_;
}

Scene sceneOf(const JelloFile& file, double duration, const Vec3& listener) {
  Scene scene;
  scene.name = "jello";
  scene.duration = duration;
  scene.gravity = file.world.gravity;
  const auto addPlane = [&](const std::string& name, const Vec3& normal, double offset) {
    SceneBody body;
    body.name = name;
    body.material = builtInMaterials().front();
    body.shape = PlaneShape{.normal = normal, .offset = offset};
    scene.bodies.push_back(std::move(body));
  };
  SceneBody body;
  body.name = "jello";
  body.material = jelloMaterial(file.world.lattice);
  body.shape =
      std::make_shared<const JelloShape>(JelloShape{.lattice = file.world.lattice,
                                                    .contact = file.world.contact,
                                                    .field = file.world.field,
                                                    .positions = file.world.positions,
                                                    .velocities = file.world.velocities,
                                                    .integrator = file.integrator,
                                                    .step = file.step,
                                                    .stepsPerPicture = file.stepsPerFrame});
  scene.bodies.push_back(std::move(body));
  if (file.world.room) {
    const char* const names[] = {"room.left", "room.right", "room.bottom",
                                 "room.top",  "room.back",  "room.front"};
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      addPlane(names[2 * axis], Vec3::Unit(axis), file.world.room->min[axis]);
      addPlane(names[2 * axis + 1], -Vec3::Unit(axis), -file.world.room->max[axis]);
    }
  }
  for (const JelloPlane& plane : file.world.planes)
    addPlane("plane", plane.normal, plane.offset);
  Listener& heard = scene.listeners.emplace_back();
  heard.name = "listener";
  heard.position = listener;
  return scene;
}

}  // namespace carom::scenes
