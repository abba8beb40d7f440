#include "scenes/run/scene_sound.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <unordered_map>
#include <utility>

#include <Eigen/Dense>

#include "carom/audio/listener.h"
#include "carom/audio/panel_radiator.h"
#include "carom/audio/room.h"
#include "carom/modal/mesh_analysis.h"
#include "scenes/run/scene_modes.h"
#include "scenes/run/solid_surface.h"

namespace carom::scenes {

using namespace audio;

namespace {

// The sound of a contact begins before the contact (see Synth::leadTime), by at most 2 tau and some
// samples, so contacts of up to 50 ms are heard whole. The synth counts longer ones.
constexpr double kLookahead = 0.1;  // s

constexpr double kDecays = 2.0;             // number of reverberation times: 60 dB each
constexpr std::int64_t kSkipFrames = 4096;  // rendered at a time

/// Makes SoundBodies of a scene's bodies. The added mass and the recoil of solids of equal shape
/// are solved once, and a normal map is read once for all bodies that have it with the same
/// settings.
class SoundBodies {
 public:
  SoundBodies(const Scene& scene, const Progress& progress)
      : hasRecoils_(hearsRecoils(scene)), progress_(progress) {}

  Result<SoundBody> make(const SceneBody& body, const BodyModes& modes) {
    if (const auto* given = std::get_if<GivenShape>(&body.shape)) return given->body->sound;
    SoundBody sound;
    if (body.normalMap) {
      if (Status laid = layTexture(body, sound); !laid) return laid.error();
    }
    sound.material = body.material;
    sound.modal = modes.model;
    sound.modalOrigin = modes.origin;
    if (const auto* sphere = std::get_if<SphereShape>(&body.shape)) {
      sound.mass = sphere->mass;
      sound.radius = sphere->radius;
    }
    if (const auto* solid = std::get_if<SolidShape>(&body.shape); solid && solid->canMove()) {
      const SurfaceMesh surface = surfaceOf(*solid);
      const Result<RigidRadiator>& radiator = radiators_->radiatorOf(surface);
      if (!radiator) return radiator.error();
      sound.mass = solid->mass;
      sound.shape = std::shared_ptr<const RigidRadiator>(radiators_, &*radiator);
      sound.inverseInertia = solid->inertia.inverse();
      if (hasRecoils_) {
        auto recoil = recoilOf(body.name, surface);
        if (!recoil) return recoil.error();
        sound.recoil = *std::move(recoil);
      }
    }
    return sound;
  }

  /// A sentence for each shape whose recoil cannot be solved.
  std::vector<std::string> takeNotes() { return std::move(notes_); }

 private:
  /// Returns the recoil of a body's shape; null, with a note, if it cannot be solved. An error is
  /// that of a run that was cancelled.
  Result<std::shared_ptr<const RigidRecoil>> recoilOf(const std::string& name,
                                                      const SurfaceMesh& surface) {
    const auto [known, isNew] = recoils_.try_emplace(surface);
    if (!isNew) return known->second;
    Result<RigidRecoil> recoil = analyseRecoil(surface, &cache_, progress_);
    if (recoil)
      known->second = std::make_shared<const RigidRecoil>(*std::move(recoil));
    else if (recoil.error().message == kCancelled)
      return recoil.error();
    else
      notes_.push_back(name + ": clicks as the sphere of equal dipole, as its recoil has none: " +
                       recoil.error().message);
    return known->second;
  }

  Status layTexture(const SceneBody& body, SoundBody& sound) {
    NormalMapFile map = *body.normalMap;
    if (map.byCoordinates) {
      auto coordinates = coordinatesOf(std::get<SolidShape>(body.shape));
      if (!coordinates) return coordinates.error();
      sound.textureCoordinates = *std::move(coordinates);
      map.settings.size = sound.textureCoordinates->size();
    }
    auto texture = textureOf(map);
    if (!texture) return texture.error();
    sound.texture = *std::move(texture);
    return std::monostate{};
  }

  Result<std::shared_ptr<const SurfaceTexture>> textureOf(const NormalMapFile& map) {
    for (const auto& [known, texture] : textures_)
      if (known.file == map.file && known.settings == map.settings) return texture;
    Result<SurfaceTexture> read = readNormalMap(map.file, map.settings);
    if (!read) return read.error();
    textures_.emplace_back(map, std::make_shared<const SurfaceTexture>(*std::move(read)));
    return textures_.back().second;
  }

  Result<std::shared_ptr<const TextureCoordinates>> coordinatesOf(const SolidShape& solid) {
    const auto& mesh = std::get<std::shared_ptr<const SolidMesh>>(solid.form);
    // Bodies that move have another origin (the centre of mass) than those that do not.
    auto& known = coordinates_[{mesh.get(), solid.canMove()}];
    if (known != nullptr) return known;
    Result<TextureCoordinates> made = TextureCoordinates::of(surfaceOf(solid), mesh->coordinates);
    if (!made) return made.error();
    known = std::make_shared<const TextureCoordinates>(*std::move(made));
    return known;
  }

  std::vector<std::pair<NormalMapFile, std::shared_ptr<const SurfaceTexture>>> textures_;
  std::map<std::pair<const SolidMesh*, bool>, std::shared_ptr<const TextureCoordinates>>
      coordinates_;
  std::shared_ptr<RadiatorCache> radiators_ = std::make_shared<RadiatorCache>();
  bool hasRecoils_;
  const Progress& progress_;
  ModelCache cache_;
  std::unordered_map<SurfaceMesh, std::shared_ptr<const RigidRecoil>, RadiatorCache::Hash> recoils_;
  std::vector<std::string> notes_;
};

/// Sets the bodies of a scene, and returns what is to be said about them.
Result<std::vector<std::string>> setBodies(const Scene& scene, Synth& synth,
                                           const Progress& progress) {
  Result<SceneSoundBodies> sounds = soundBodies(scene, progress);
  if (!sounds) return sounds.error();
  for (std::size_t index = 0; index < scene.bodies.size(); ++index) {
    const Status set = synth.setBody(static_cast<BodyId>(index), sounds->bodies[index]);
    if (!set) return Error{scene.bodies[index].name + ": " + set.error().message};
  }
  return std::move(sounds->notes);
}

/// Time in s within which a listener at the end of its path comes to rest: PoseTrack would go on
/// for longer.
constexpr double kStop = 1e-3;

/// Returns the scene's listeners with the heads that they name.
Result<std::vector<Listener>> equippedListeners(const Scene& scene) {
  std::vector<Listener> listeners = scene.listeners;
  std::map<std::filesystem::path, std::shared_ptr<const HrtfSet>> heads;
  for (const HeadFile& head : scene.headFiles) {
    std::shared_ptr<const HrtfSet>& set = heads[head.sofa];
    if (set == nullptr) {
      Result<std::shared_ptr<const HrtfSet>> loaded = loadHrtf(head.sofa, scene.sampleRate);
      if (!loaded) return loaded.error();
      set = *std::move(loaded);
    }
    listeners.at(head.listener).hrtf = set;
  }
  return listeners;
}

/// Returns a path's poses, from time 0 to the one where it comes to rest.
std::vector<ListenerPose> posesOf(const ListenerPath& path, const Listener& start) {
  std::vector<ListenerPose> poses = {{0.0, start.position, start.orientation}};
  poses.insert(poses.end(), path.poses.begin(), path.poses.end());
  if (path.poses.empty()) return poses;
  poses.push_back(path.poses.back());
  poses.back().time += kStop;
  return poses;
}

/// Gives the synth a whole path at once: the sound of an event depends on where a listener is when
/// it arrives, which can be any time later.
Status follow(const ListenerPath& path, Synth& synth) {
  for (const ListenerPose& pose : posesOf(path, synth.listeners()[path.listener]))
    if (Status moved = synth.moveListener(path.listener, pose); !moved) return moved;
  return std::monostate{};
}

/// True if it is the machine that has ended the run: what the mechanics had told is not heard then.
bool isOfMachine(const RunGuard& guard) {
  return guard.ended()->limit == "time" || guard.ended()->limit == "memory";
}

bool earlier(const ImpulseEvent& a, const ImpulseEvent& b) {
  return a.time < b.time;
}

}  // namespace

std::vector<ListenerChannels> listenerChannels(const Scene& scene) {
  std::vector<ListenerChannels> channels;
  std::size_t first = 0;
  for (std::size_t index = 0; index < scene.listeners.size(); ++index) {
    const Listener& listener = scene.listeners[index];
    const bool moves = std::ranges::any_of(
        scene.paths, [index](const auto& path) { return path.listener == index; });
    channels.push_back({listener.name, listener.format, first, channelCount(listener), moves});
    first += channelCount(listener);
  }
  return channels;
}

std::size_t channelsOf(const Scene& scene) {
  std::size_t channels = 0;
  for (const Listener& listener : scene.listeners)
    channels += channelCount(listener);
  return channels;
}

bool hearsRecoils(const Scene& scene) {
  const auto& comparison = scene.sound.comparison;
  return scene.recoil == RecoilModel::shape && comparison.radiation == Radiation::exact &&
         comparison.sampling == Sampling::bandLimited;
}

Result<SceneSoundBodies> soundBodies(const Scene& scene, const Progress& progress) {
  const Result<std::vector<BodyModes>> modes = sceneModes(scene, progress);
  if (!modes) return modes.error();
  SoundBodies bodies(scene, progress);
  SceneSoundBodies sounds;
  for (std::size_t index = 0; index < scene.bodies.size(); ++index) {
    Result<SoundBody> sound = bodies.make(scene.bodies[index], (*modes)[index]);
    if (!sound) return Error{scene.bodies[index].name + ": " + sound.error().message};
    sounds.bodies.push_back(*std::move(sound));
  }
  sounds.notes = bodies.takeNotes();
  return sounds;
}

HostWorld hostWorldOf(const Scene& scene) {
  HostWorld world;
  world.synth = scene.sound;
  world.synth.sampleRate = scene.sampleRate;
  world.synth.medium = scene.medium;
  world.synth.stems = false;
  world.listeners = scene.listeners;
  world.paths.resize(scene.listeners.size());
  for (const ListenerPath& path : scene.paths)
    world.paths[path.listener] = path.poses;
  world.hasOwnHeads = !scene.headFiles.empty();
  world.duration = scene.duration;
  world.bodies = static_cast<std::uint32_t>(scene.bodies.size());
  return world;
}

std::size_t imageCount(const Scene& scene) {
  if (scene.sound.room.reflectors.empty()) return 0;
  const Result<std::vector<Image>> images = makeImages(scene.sound.room);
  return images ? images->size() : 0;
}

PoseTrack trackOf(const ListenerPath& path, const Listener& start) {
  const std::vector<ListenerPose> poses = posesOf(path, start);
  PoseTrack track(poses.front(), {.capacity = poses.size() + 1});
  for (const ListenerPose& pose : poses)
    track.append(pose);
  return track;
}

double firstEventTime(const Scene& scene, const SoundSpan& span) {
  double memory = kLongestWay;
  if (const auto& reverb = scene.sound.reverb)
    memory += kDecays * *std::ranges::max_element(reverb->decayTimes);
  return std::max(0.0, span.from - memory);
}

Result<SceneSound> SceneSound::create(const Scene& scene, const Progress& progress) {
  Result<std::unique_ptr<SceneStepper>> stepper = makeStepper(scene);
  if (!stepper) return stepper.error();
  return create(scene, *std::move(stepper), {}, progress);
}

Result<SceneSound> SceneSound::create(const Scene& scene, std::unique_ptr<SceneStepper> stepper,
                                      const SoundSpan& span, const Progress& progress) {
  SynthSettings settings = scene.sound;
  settings.sampleRate = scene.sampleRate;
  settings.medium = scene.medium;
  Result<std::vector<Listener>> listeners = equippedListeners(scene);
  if (!listeners) return Error{scene.name + ": " + listeners.error().message};
  Result<Synth> synth = Synth::create(settings, *std::move(listeners));
  if (!synth) return Error{scene.name + ": " + synth.error().message};
  // The synth starts ahead of the first event, by at least as much as within a whole scene.
  const double start = std::max(0.0, stepper->settledTime() - 2.0 * kLookahead);
  if (start > 0.0) {
    if (const Status sought = synth->seek(start); !sought)
      return Error{scene.name + ": " + sought.error().message};
  }
  for (const ListenerPath& path : scene.paths) {
    if (const Status followed = follow(path, *synth); !followed)
      return Error{scene.name + ": " + followed.error().message};
  }
  Result<std::vector<std::string>> notes = setBodies(scene, *synth, progress);
  if (!notes) return Error{scene.name + ": " + notes.error().message};
  std::optional<DeformingVoice> voice;
  if (const double step = stepper->hearDeformations(); step > 0.0) {
    Result<DeformingVoice> made = DeformingVoice::create(
        {.step = step, .sampleRate = scene.sampleRate, .medium = scene.medium}, scene.listeners);
    if (!made) return Error{scene.name + ": " + made.error().message};
    voice = *std::move(made);
    for (const ListenerPath& path : scene.paths)
      voice->follow(path.listener, trackOf(path, scene.listeners[path.listener]));
  }
  synth->advanceTo(start);  // rings are followed
  SceneSound sound(scene, std::move(stepper), *std::move(synth), span);
  sound.voice_ = std::move(voice);
  sound.notes_ = *std::move(notes);
  sound.skipTo(sound.firstFrame_);
  return sound;
}

SceneSound::SceneSound(const Scene& scene, std::unique_ptr<SceneStepper> stepper, Synth synth,
                       const SoundSpan& span)
    : span_(span),
      duration_(scene.duration),
      sampleRate_(scene.sampleRate),
      firstFrame_(std::llround(span.from * scene.sampleRate)),
      frames_(std::llround(std::min(span.to, scene.duration) * scene.sampleRate)),
      framesDone_(std::llround(synth.time() * scene.sampleRate)),
      stepper_(std::move(stepper)),
      synth_(std::move(synth)),
      hasStems_(scene.sound.stems) {}

/// Renders and drops the sound before `frame`, which the state of the synth depends on.
void SceneSound::skipTo(std::int64_t frame) {
  std::vector<std::vector<float>> channels(synth_.channelCount());
  while (framesDone_ < frame) {
    const auto count = static_cast<std::size_t>(std::min(kSkipFrames, frame - framesDone_));
    for (std::vector<float>& channel : channels)
      channel.resize(count);
    if (render(channels) == 0) return;
    early_ = std::move(settled_);  // the mechanics run ahead: these may be in the span
  }
}

std::size_t SceneSound::render(std::span<std::vector<float>> channels) {
  settled_.clear();
  for (const ScheduledEvent& event : std::exchange(early_, {}))
    settle(event);
  const auto room = static_cast<std::int64_t>(channels.front().size());
  std::int64_t count = std::min(room, frames_ - framesDone_);
  if (count <= 0) return 0;
  runAhead(static_cast<double>(framesDone_ + count) / sampleRate_ + kLookahead);
  count = std::min(room, frames_ - framesDone_);  // fewer if the mechanics failed
  if (count <= 0) return 0;
  std::vector<float*> pointers;
  for (std::vector<float>& channel : channels)
    pointers.push_back(channel.data());
  synth_.render<float>(pointers, static_cast<std::size_t>(count));
  if (voice_) addVoice(pointers, static_cast<std::size_t>(count));
  framesDone_ += count;
  return static_cast<std::size_t>(count);
}

/// Adds what a jello's vibration sounds like, with stems to that of vibration too.
void SceneSound::addVoice(std::span<float* const> channels, std::size_t frames) {
  const std::size_t parts = hasStems_ ? 1 + kStems : 1;
  const std::size_t count = channels.size() / parts;
  voice_->addTo(channels.first(count), framesDone_, frames);
  const std::size_t rings = 1 + static_cast<std::size_t>(Stem::rings);
  if (hasStems_) voice_->addTo(channels.subspan(rings * count, count), framesDone_, frames);
}

void SceneSound::renderTail(std::span<std::vector<float>> channels) {
  std::vector<float*> pointers;
  for (std::vector<float>& channel : channels)
    pointers.push_back(channel.data());
  synth_.render<float>(pointers, channels.front().size());
}

void SceneSound::watch(RunGuard& guard) {
  guard_ = &guard;
  stepper_->watch(guard_);
}

void SceneSound::tellMotion() {
  for (const ContactState& contact : stepper_->contacts())
    if (contact.time < duration_) motion_->add(contact);
  for (const BodyPose& pose : stepper_->poses())
    if (pose.pose.time <= duration_) motion_->add(pose);
}

void SceneSound::runAhead(double time) {
  const double ahead = voice_ ? voice_->lookahead() : 0.0;
  const double target = std::min(time + ahead, duration_ + ahead);
  const auto mayGoOn = [&] {
    return stepper_->failure().empty() && (guard_ == nullptr || !guard_->ended());
  };
  while (stepper_->settledTime() < target && mayGoOn()) {
    // Contacts that last are handed over step by step: what is heard then depends neither on the
    // blocks that are rendered, nor on the part.
    const double next =
        stepper_->reportsContacts() ? std::nextafter(stepper_->settledTime(), target) : target;
    const auto events = stepper_->advanceTo(next);
    for (const HostBody* const body : stepper_->bodyChanges())
      static_cast<void>(synth_.setBody(body->id, body->sound));  // has been validated
    known_.insert(known_.end(), events.begin(), events.end());
    for (const ContactState& contact : stepper_->contacts())
      synth_.updateContact(contact);
    // No stepper knows poses after the end, but some go beyond it. A pose is of a body of the
    // synth, and valid unless the mechanics have failed.
    for (const auto& [body, pose] : stepper_->poses())
      if (pose.time <= duration_) static_cast<void>(synth_.moveBody(body, pose));
    if (voice_) voice_->add(stepper_->deformations());
    if (motion_ != nullptr) tellMotion();
    if (stepper_->settledTime() < target) scheduleSettled();
  }
  if (!mayGoOn())
    frames_ = std::min(frames_, static_cast<std::int64_t>(stepper_->settledTime() * sampleRate_));
  scheduleSettled();
}

void SceneSound::scheduleSettled() {
  const double settledTime = stepper_->settledTime();
  const bool keepsOrder = stepper_->keepsOrder();
  if (!keepsOrder) std::stable_sort(known_.begin(), known_.end(), earlier);
  const auto open = std::find_if(known_.begin(), known_.end(), [&](const ImpulseEvent& event) {
    return !keepsOrder && event.time >= settledTime && settledTime < duration_;
  });
  for (auto event = known_.begin(); event != open; ++event) {
    // Where walls and listeners are many, events take longer than the mechanics.
    if (guard_ != nullptr && !guard_->mayGoOn(event->time) && isOfMachine(*guard_))
      return endAt(event->time);
    // A host has heard what Bullet solved before the bodies touched, after its last substep.
    if (event->time > duration_ && !keepsOrder) continue;
    const double peak = synth_.schedule(*event);
    if (event->time >= span_.from && event->time <= span_.to) settle({*event, peak});
  }
  known_.erase(known_.begin(), open);
  synth_.advanceTo(std::min(settledTime, duration_));
}

/// Ends the sound where the guard has ended the run, with the events before.
void SceneSound::endAt(double time) {
  known_.clear();
  frames_ = std::min(frames_, static_cast<std::int64_t>(time * sampleRate_));
  synth_.advanceTo(std::min(time, duration_));
}

void SceneSound::settle(const ScheduledEvent& event) {
  if (sink_)
    sink_(event);
  else
    settled_.push_back(event);
}

}  // namespace carom::scenes
