#include "scenes/live/live_run.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <variant>

#include "scenes/run/scene_sound.h"
#include "scenes/run/solid_surface.h"

namespace carom::scenes {

using namespace audio;

namespace {

constexpr std::size_t kForgets = 60;  // portions

/// Returns the form in which a page draws a body.
BodyForm formOf(const SceneBody& body) {
  BodyForm form;
  if (const auto* sphere = std::get_if<SphereShape>(&body.shape)) {
    form.kind = BodyForm::Kind::sphere;
    form.size = Vec3::Constant(sphere->radius);
  } else if (const auto* plane = std::get_if<PlaneShape>(&body.shape)) {
    form.kind = BodyForm::Kind::plane;
    form.size = plane->normal;
    form.offset = plane->offset;
  } else if (const auto* block = std::get_if<BlockShape>(&body.shape)) {
    form.kind = BodyForm::Kind::box;
    form.size = block->halfExtents;
  } else if (const auto* solid = std::get_if<SolidShape>(&body.shape)) {
    const auto* box = std::get_if<BoxForm>(&solid->form);
    form.kind = box != nullptr ? BodyForm::Kind::box : BodyForm::Kind::mesh;
    if (box != nullptr) form.size = box->halfExtents;
    if (box == nullptr) form.mesh = std::make_shared<const SurfaceMesh>(surfaceOf(*solid));
  }
  return form;
}

/// Puts the clock of a mechanics that began at `begin` (s) to that of the run.
void shift(RunPortion& portion, double begin) {
  for (ImpulseEvent& event : portion.events)
    event.time += begin;
  for (ContactState& contact : portion.contacts)
    contact.time += begin;
  for (BodyPose& pose : portion.poses)
    pose.pose.time += begin;
  for (JelloPicture& picture : portion.pictures)
    picture.time += begin;
}

}  // namespace

Result<LiveRun> LiveRun::create(Scene scene, std::span<const HostBody> sounds) {
  LiveRun live;
  live.run_.world = hostWorldOf(scene);
  live.run_.world.duration = kLongest;
  live.run_.world.bodies = static_cast<std::uint32_t>(scene.bodies.size() + kMostAdded);
  if (Status begun = live.takeOver({0.0, std::move(scene)}, 0); !begun) return begun.error();
  live.run_.keepsOrder = live.stepper_->keepsOrder();
  std::vector<Listener> listeners = live.run_.world.listeners;
  for (Listener& listener : listeners)  // a head is as loud as a pair about it
    if (listener.format == ListenerFormat::binaural) listener.format = ListenerFormat::spacedPair;
  Result<Synth> meter = Synth::create(live.run_.world.synth, std::move(listeners));
  if (!meter) return meter.error();
  live.meter_ = *std::move(meter);
  if (Status added = live.addBodies(0, sounds); !added) return added.error();
  live.keepFrame();
  return live;
}

/// Has a mechanics begin with a segment.
Status LiveRun::takeOver(Segment segment, std::size_t before) {
  Result<std::unique_ptr<LiveStepper>> stepper = makeLiveStepper(segment.scene);
  if (!stepper) return stepper.error();
  stepper_ = *std::move(stepper);
  stepper_->showAll();
  run_.deformationStep = stepper_->hearDeformations();
  isFirst_ = true;
  segments_.resize(before);
  segments_.push_back(std::move(segment));
  return std::monostate{};
}

/// Sets how the bodies from one on sound: as is known, or as they do without modes.
Status LiveRun::addBodies(std::size_t first, std::span<const HostBody> sounds) {
  Scene unknown = scene();
  unknown.recoil = RecoilModel::sphere;
  unknown.bodies.erase(unknown.bodies.begin(),
                       unknown.bodies.begin() + static_cast<std::ptrdiff_t>(first));
  std::vector<const HostBody*> known(scene().bodies.size(), nullptr);
  for (const HostBody& body : sounds)
    if (body.id < known.size()) known[body.id] = &body;
  for (std::size_t index = 0; index < unknown.bodies.size(); ++index) {
    unknown.bodies[index].ringing.reset();
    // The texture of a body whose sound is known is not read again.
    if (known[first + index] != nullptr) unknown.bodies[index].normalMap.reset();
  }
  Result<SceneSoundBodies> made = soundBodies(unknown);
  if (!made) return made.error();
  PlayableRun::Bodies bodies;
  bodies.portion = run_.portions.size();
  rings_.resize(scene().bodies.size());
  for (std::size_t index = first; index < scene().bodies.size(); ++index) {
    HostBody& body = bodies.bodies.emplace_back();
    body.id = static_cast<BodyId>(index);
    body.name = scene().bodies[index].name;
    body.sound = std::move(made->bodies[index - first]);
    body.form = formOf(scene().bodies[index]);
    if (known[index] != nullptr) body.sound = known[index]->sound;
    rings_[index] = body.sound.modal != nullptr;
    if (const Status set = meter_->setBody(body.id, body.sound); !set)
      return Error{body.name + ": " + set.error().message};
  }
  run_.bodies.push_back(std::move(bodies));
  return std::monostate{};
}

double LiveRun::time() const {
  return segments_.back().begin + stepper_->headTime();
}

double LiveRun::settled() const {
  return segments_.back().begin + stepper_->settledTime();
}

Scene LiveRun::now() const {
  Scene scene = segments_.back().scene;
  stepper_->putState(scene);
  return scene;
}

Status LiveRun::advanceTo(double time) {
  while (this->time() < time) {
    if (this->time() >= kLongest) return Error{"a live run ends after 10 minutes"};
    // A little less, so that rounding does not ask for one more step, nor end short of one.
    const double next = stepper_->settledTime() + kFrame - 1e-6;
    while (stepper_->settledTime() < next) {
      keepPortion(stepper_->advanceTo(next));
      if (const std::string failure = stepper_->failure(); !failure.empty()) return Error{failure};
    }
    keepFrame();
  }
  return std::monostate{};
}

/// Keeps what the stepper has just told.
void LiveRun::keepPortion(std::span<const ImpulseEvent> events) {
  RunPortion& portion = run_.portions.emplace_back();
  portion.settledTime = settled();
  portion.events.assign(events.begin(), events.end());
  portion.contacts.assign(stepper_->contacts().begin(), stepper_->contacts().end());
  portion.poses.assign(stepper_->poses().begin(), stepper_->poses().end());
  portion.pictures.assign(stepper_->pictures().begin(), stepper_->pictures().end());
  portion.deformations.assign(stepper_->deformations().begin(), stepper_->deformations().end());
  const double begin = segments_.back().begin;
  if (begin > 0.0) {
    // The first poses of a mechanics that takes over are the last ones of the mechanics before it.
    std::erase_if(portion.poses, [](const BodyPose& pose) { return pose.pose.time <= 0.0; });
    std::erase_if(portion.pictures,
                  [](const JelloPicture& picture) { return picture.time <= 0.0; });
    if (isFirst_ && !portion.deformations.empty())
      portion.deformations.erase(portion.deformations.begin());
    shift(portion, begin);
  }
  isFirst_ = false;
  Shown& shown = shown_.emplace_back();
  shown.poses = portion.poses;
  shown.pictures = std::exchange(portion.pictures, {});
  std::erase_if(portion.poses, [this](const BodyPose& pose) { return !rings_[pose.body]; });
  for (const ImpulseEvent& event : portion.events)
    shown.measures.push_back({meter_->contactDuration(event), meter_->schedule(event)});
  // Nothing of it is rendered, and the meter is told to forget.
  if (run_.portions.size() % kForgets == 0) static_cast<void>(meter_->seek(0.0));
}

/// Keeps the state at the head, to be rewound to.
void LiveRun::keepFrame() {
  frames_.push_back({time(), run_.portions.size(), segments_.size() - 1, statesOf(now())});
}

std::vector<LiveRun::MovingState> LiveRun::statesOf(const Scene& scene) {
  std::vector<MovingState> states;
  for (std::size_t index = 0; index < scene.bodies.size(); ++index) {
    const auto& shape = scene.bodies[index].shape;
    const auto add = [&](const auto& moving) {
      states.push_back({static_cast<BodyId>(index), moving.position, moving.orientation,
                        moving.velocity, moving.spin});
    };
    if (const auto* sphere = std::get_if<SphereShape>(&shape)) add(*sphere);
    if (const auto* solid = std::get_if<SolidShape>(&shape); solid != nullptr && solid->canMove())
      add(*solid);
    if (const auto* jello = std::get_if<std::shared_ptr<const JelloShape>>(&shape)) {
      states.emplace_back().body = static_cast<BodyId>(index);
      states.back().jello = *jello;
    }
  }
  return states;
}

void LiveRun::putStates(std::span<const MovingState> states, Scene& scene) {
  for (const MovingState& state : states) {
    auto& shape = scene.bodies[state.body].shape;
    const auto put = [&](auto& moving) {
      moving.position = state.position;
      moving.orientation = state.orientation;
      moving.velocity = state.velocity;
      moving.spin = state.spin;
    };
    if (auto* sphere = std::get_if<SphereShape>(&shape)) put(*sphere);
    if (auto* solid = std::get_if<SolidShape>(&shape)) put(*solid);
    if (state.jello != nullptr) shape = state.jello;
  }
}

Status LiveRun::change(const std::function<void(Scene&)>& edit) {
  Scene scene = now();
  edit(scene);
  if (Status taken = takeOver({time(), std::move(scene)}, segments_.size()); !taken) return taken;
  frames_.back().segment = segments_.size() - 1;  // a change is not rewound by itself
  return std::monostate{};
}

Result<BodyId> LiveRun::add(SceneBody body) {
  const std::size_t number = scene().bodies.size();
  if (number >= run_.world.bodies)
    return Error{"there are " + std::to_string(kMostAdded) + " added bodies already"};
  // Its restitution is its own: pairs are of the materials that the scene began with.
  const auto alike = std::ranges::find_if(scene().bodies, [&body](const SceneBody& other) {
    return other.material.name == body.material.name;
  });
  body.surface = alike != scene().bodies.end() ? alike->surface : 0;
  if (Status changed = change([&body](Scene& scene) { scene.bodies.push_back(std::move(body)); });
      !changed)
    return changed.error();
  if (Status added = addBodies(number, {}); !added) return added.error();
  frames_.back().bodies = statesOf(scene());
  return static_cast<BodyId>(number);
}

Status LiveRun::rewind(double time) {
  auto after = std::ranges::upper_bound(frames_, time, {}, &Frame::time);
  if (after == frames_.begin()) ++after;
  const Frame& last = *std::prev(after);
  Segment segment = segments_[last.segment];
  putStates(last.bodies, segment.scene);
  moveSurfaces(segment.scene, last.time - segment.begin);
  segment.begin = last.time;
  const std::size_t bodies = segment.scene.bodies.size();
  if (Status taken = takeOver(std::move(segment), last.segment + 1); !taken) return taken;
  frames_.erase(after, frames_.end());
  frames_.back().segment = segments_.size() - 1;
  run_.portions.resize(frames_.back().portions);
  std::erase_if(run_.bodies, [bodies](const PlayableRun::Bodies& added) {
    return added.bodies.front().id >= bodies;
  });
  shown_.clear();
  return std::monostate{};
}

}  // namespace carom::scenes
