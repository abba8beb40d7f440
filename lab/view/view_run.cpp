#include "lab/view/view_run.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <utility>

#include "lab/view/rounding.h"

#include "audio/propagation/pose_track.h"
#include "scenes/live/scene_drawing.h"
#include "scenes/recording/event_tape.h"
#include "scenes/recording/recorded_run.h"
#include "scenes/recording/recorded_scene.h"
#include "scenes/run/scene_sound.h"
#include "scenes/run/scene_stepper.h"

namespace carom::lab {

using namespace scenes;
using namespace audio;

namespace {

/// Poses that may be left out one after another.
constexpr std::size_t kLongestGap = 64;

/// Returns a scene's run, still without bodies and portions.
ViewRun emptyRun(const Scene& scene, double deformationStep) {
  ViewRun view;
  view.scene = scene;
  view.run.world = hostWorldOf(scene);
  view.run.deformationStep = deformationStep;
  return view;
}

/// Adds how the bodies of a scene sound.
Status addSounds(ViewRun& view, const Progress& progress) {
  Result<SceneSoundBodies> sounds = soundBodies(view.scene, progress);
  if (!sounds) return sounds.error();
  PlayableRun::Bodies bodies;
  for (std::size_t index = 0; index < sounds->bodies.size(); ++index) {
    HostBody& body = bodies.bodies.emplace_back();
    body.id = static_cast<BodyId>(index);
    body.name = view.scene.bodies[index].name;
    body.sound = std::move(sounds->bodies[index]);
  }
  view.run.bodies.insert(view.run.bodies.begin(), std::move(bodies));
  return std::monostate{};
}

/// True if a body between two poses is where a third says, to what can be seen: a thousandth of a
/// radian, and of the way in `scale` (m).
bool isBetween(const ListenerPose& pose, const ListenerPose& before, const ListenerPose& after,
               double scale) {
  const double share = (pose.time - before.time) / (after.time - before.time);
  const Vec3 place = before.position + share * (after.position - before.position);
  return (place - pose.position).norm() < 1e-3 * scale &&
         before.orientation.slerp(share, after.orientation).angularDistance(pose.orientation) <
             2e-3;
}

/// Leaves out the poses that lie between the others.
void thin(std::vector<ListenerPose>& poses, double scale) {
  if (poses.size() < 3) return;
  std::vector<ListenerPose> kept = {poses.front()};
  std::size_t last = 0;
  for (std::size_t next = 2; next < poses.size(); ++next) {
    bool isStraight = next - last <= kLongestGap;
    for (std::size_t between = last + 1; isStraight && between < next; ++between)
      isStraight = isBetween(poses[between], poses[last], poses[next], scale);
    if (isStraight) continue;
    last = next - 1;
    kept.push_back(poses[last]);
  }
  kept.push_back(poses.back());
  poses = std::move(kept);
}

/// Returns a length by which an error of a body's place is seen, m.
double scaleOf(const SceneBody& body) {
  if (const auto* sphere = std::get_if<SphereShape>(&body.shape)) return 4.0 * sphere->radius;
  if (const auto* given = std::get_if<GivenShape>(&body.shape)) {
    const BodyForm& form = given->body->form;
    if (form.kind == BodyForm::Kind::sphere) return 4.0 * form.size.x();
    if (form.kind == BodyForm::Kind::box) return 2.0 * form.size.minCoeff();
  }
  if (const auto* solid = std::get_if<SolidShape>(&body.shape))
    if (const auto* box = std::get_if<BoxForm>(&solid->form))
      return 2.0 * box->halfExtents.minCoeff();
  return 0.1;
}

/// Joins the steps of lasting contacts.
std::vector<ContactBar> barsOf(const std::vector<RunPortion>& portions) {
  struct Open {
    ContactBar bar;
    double impulse = 0.0;  // N s
  };
  std::map<std::pair<BodyId, BodyId>, Open> open;
  std::vector<ContactBar> bars;
  const auto close = [&bars](Open& contact) {
    const double lasts = contact.bar.end - contact.bar.begin;
    contact.bar.meanForce = lasts > 0.0 ? contact.impulse / lasts : 0.0;
    if (lasts > 0.0) bars.push_back(contact.bar);
  };
  for (const RunPortion& portion : portions)
    for (const ContactState& state : portion.contacts) {
      const auto [found, isNew] = open.try_emplace(std::pair(state.body, state.other));
      Open& contact = found->second;
      if (isNew) contact.bar = {state.body, state.other, state.time, state.time};
      if (state.phase == ContactPhase::end) {
        close(contact);
        open.erase(found);
        continue;
      }
      contact.bar.end = state.time + state.duration;
      contact.bar.slides = contact.bar.slides || state.slipVelocity.norm() > kSlides;
      contact.impulse += state.normalLoad * state.duration;
    }
  for (auto& [pair, contact] : open)
    close(contact);
  std::ranges::stable_sort(bars, {}, &ContactBar::begin);
  return bars;
}

// A place to 32 digits is 1e-10 of its distance from the origin: at 10 m a delay of 3e-12 s. Sizes
// to 26 digits are within -156 dB.
constexpr int kPlaceDigits = 32;
constexpr int kSizeDigits = 26;

void round(Quat& turn) {
  for (double& number : turn.coeffs())
    number = rounded(number, kPlaceDigits);
}

/// Rounds all but times. States of what deforms stay as they are, as their second differences
/// count; so do contacts: pageSound.
void round(RunPortion& portion) {
  for (ImpulseEvent& event : portion.events) {
    for (Vec3* const place : {&event.position, &event.bodyPosition, &event.otherPosition})
      roundVector(*place, kPlaceDigits);
    for (Vec3* const size : {&event.impulse, &event.appliedImpulse, &event.normal,
                             &event.bodyVelocity, &event.bodyAngularVelocity})
      roundVector(*size, kSizeDigits);
    for (double* const size :
         {&event.approachSpeed, &event.effectiveMass, &event.radius, &event.otherRadius})
      *size = rounded(*size, kSizeDigits);
    round(event.bodyOrientation);
    round(event.otherOrientation);
  }
  for (BodyPose& pose : portion.poses) {
    roundVector(pose.pose.position, kPlaceDigits);
    round(pose.pose.orientation);
  }
}

/// Moves what is only drawn out of the run, and measures its events.
Status finish(ViewRun& view) {
  std::vector<bool> rings(view.scene.bodies.size());
  for (const PlayableRun::Bodies& bodies : view.run.bodies)
    for (const HostBody& body : bodies.bodies)
      rings[body.id] = rings[body.id] || body.sound.modal != nullptr;
  view.poses.resize(view.scene.bodies.size());
  for (RunPortion& portion : view.run.portions) {
    for (const BodyPose& pose : portion.poses)
      if (pose.pose.time <= view.scene.duration) view.poses[pose.body].push_back(pose.pose);
    std::erase_if(portion.poses, [&rings](const BodyPose& pose) { return !rings[pose.body]; });
    std::ranges::move(portion.pictures, std::back_inserter(view.pictures));
    portion.pictures.clear();
    round(portion);
  }
  for (std::size_t body = 0; body < view.poses.size(); ++body)
    thin(view.poses[body], scaleOf(view.scene.bodies[body]));
  view.contacts = barsOf(view.run.portions);
  PlayableRun copy = view.run;
  for (Listener& listener : copy.world.listeners)  // a head is as loud as a pair about it
    if (listener.format == ListenerFormat::binaural) listener.format = ListenerFormat::spacedPair;
  Result<RunPlayer> player = RunPlayer::create(std::move(copy), view.scene.sampleRate);
  if (!player) return player.error();
  auto events = player->measureEvents();
  if (!events) return events.error();
  view.events = *std::move(events);
  return std::monostate{};
}

/// Returns what a stepper tells up to its end.
Result<ViewTape> tapeOf(const Scene& scene, SceneStepper& stepper, const ViewOptions& options) {
  stepper.showAll();
  ViewTape tape;
  tape.stepper = scene.stepper.type == StepperType::bullet ? "bullet" : "native";
  tape.deformationStep = stepper.hearDeformations();
  tape.keepsOrder = stepper.keepsOrder();
  const Status ran = runInPortions(stepper, scene.duration, tape.deformationStep, options.guard,
                                   [&](RunPortion portion) -> Status {
                                     if (options.progress)
                                       options.progress(portion.settledTime / scene.duration);
                                     tape.portions.push_back(std::move(portion));
                                     return std::monostate{};
                                   });
  if (!ran) return ran.error();
  return tape;
}

/// Reads all portions of a run file, and the bodies of a host that change on the way.
Status readPortions(RunReader& reader, ViewRun& view) {
  while (true) {
    Result<std::vector<RunPortion>> portions = reader.next();
    if (!portions) return portions.error();
    if (portions->empty()) return std::monostate{};
    if (!reader.changes().empty()) {
      PlayableRun::Bodies& bodies =
          view.run.bodies.emplace_back(PlayableRun::Bodies{view.run.portions.size(), {}});
      for (const std::size_t body : reader.changes())
        bodies.bodies.push_back(reader.host()->bodies[body]);
    }
    std::ranges::move(*portions, std::back_inserter(view.run.portions));
  }
}

}  // namespace

Result<ViewTape> recordView(const Scene& scene, const ViewOptions& options) {
  Result<std::unique_ptr<SceneStepper>> stepper = makeStepper(scene, options.guard);
  if (!stepper) return stepper.error();
  Result<ViewTape> tape = tapeOf(scene, **stepper, options);
  if (!tape) return Error{scene.name + ": " + tape.error().message};
  return tape;
}

Result<ViewRun> viewTape(const Scene& scene, ViewTape tape, const ViewOptions& options) {
  ViewRun view = emptyRun(scene, tape.deformationStep);
  view.stepper = std::move(tape.stepper);
  view.run.keepsOrder = tape.keepsOrder;
  view.run.portions = std::move(tape.portions);
  if (options.heardAt)
    for (RunPortion& portion : view.run.portions)
      for (ImpulseEvent& event : portion.events)
        event.time = std::min(options.heardAt(event), scene.duration);
  if (Status sounds = addSounds(view, withinLimits(options.guard, options.analysis)); !sounds)
    return Error{scene.name + ": " + sounds.error().message};
  if (Status finished = finish(view); !finished)
    return Error{scene.name + ": " + finished.error().message};
  return view;
}

Result<ViewRun> viewScene(const Scene& scene, const ViewOptions& options) {
  Result<ViewTape> tape = recordView(scene, options);
  if (!tape) return tape.error();
  return viewTape(scene, *std::move(tape), options);
}

void hearAsTold(Scene& scene) {
  scene.sound.impulse = ImpulseChoice::applied;
  scene.sound.comparison.sampling = Sampling::naive;
  scene.sound.comparison.radiation = Radiation::compact;
}

void setSceneText(ViewRun& run, const std::string& text, const std::filesystem::path& sceneFile) {
  Result<HeldScene> held = heldScene(text, sceneFile);
  if (!held) {
    run.notLive = "This page has not all that the scene needs: " + held.error().message + '.';
    return;
  }
  run.sceneText = text;
  if (held->text != text) run.held = *std::move(held);
}

double endOfStep(const ImpulseEvent& event, double step) {
  return step * std::ceil(event.time / step);
}

Result<ViewRun> viewRecorded(const std::filesystem::path& file, bool confined,
                             const ViewOptions& options) {
  if (!isRunFile(file)) {
    const Result<RecordedScene> recorded = loadRecordedScene(file, confined);
    if (!recorded) return recorded.error();
    const auto stepper = replayStepper(recorded->recording, recorded->scene, 0.0);
    Result<ViewTape> tape = tapeOf(recorded->scene, *stepper, options);
    if (!tape) return Error{file.string() + ": " + tape.error().message};
    return viewTape(recorded->scene, *std::move(tape), options);
  }
  Result<RecordedRun> recorded = openRun(file, confined);
  if (!recorded) return recorded.error();
  ViewRun view = emptyRun(recorded->scene, recorded->reader->header().deformationStep);
  view.stepper = recorded->reader->header().stepper;
  view.run.keepsOrder = recorded->reader->host() != nullptr;
  if (Status read = readPortions(*recorded->reader, view); !read) return read.error();
  if (const std::string& text = recorded->reader->header().sceneText; !text.empty())
    setSceneText(view, text,
                 confined ? file : std::filesystem::path(recorded->reader->header().sceneFile));
  if (Status sounds = addSounds(view, options.analysis); !sounds)
    return Error{file.string() + ": " + sounds.error().message};
  if (Status finished = finish(view); !finished)
    return Error{file.string() + ": " + finished.error().message};
  return view;
}

}  // namespace carom::lab
