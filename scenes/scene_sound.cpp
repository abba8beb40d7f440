#include "scenes/scene_sound.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <utility>

#include <Eigen/Dense>

#include "audio/hrtf.h"
#include "audio/panel_radiator.h"
#include "audio/room.h"
#include "scenes/bullet_solid.h"
#include "scenes/scene_modes.h"

namespace carom {
namespace {

// The sound of a contact begins before it (see Synth::leadTime): at most 2 tau and some samples, so
// contacts of up to 50 ms are heard whole. The synth counts those that are not.
constexpr double kLookahead = 0.1;  // s

constexpr double kLongestWay = 1.0;         // s, of sound through the air; see firstEventTime
constexpr double kDecays = 2.0;             // of 60 dB each
constexpr std::int64_t kSkipFrames = 4096;  // at a time

/// Scene bodies as SoundBodies. The added mass of a solid is solved once for all of equal shape.
class SoundBodies {
 public:
  Result<SoundBody> make(const SceneBody& body, const BodyModes& modes) {
    SoundBody sound;
    sound.material = body.material;
    sound.modal = modes.model;
    sound.modalOrigin = modes.origin;
    if (const auto* sphere = std::get_if<SphereShape>(&body.shape)) {
      sound.mass = sphere->mass;
      sound.radius = sphere->radius;
    }
    if (const auto* solid = std::get_if<SolidShape>(&body.shape); solid && solid->canMove()) {
      const Result<RigidRadiator>& radiator = radiators_->radiatorOf(surfaceOf(*solid));
      if (!radiator) return radiator.error();
      sound.mass = solid->mass;
      sound.shape = std::shared_ptr<const RigidRadiator>(radiators_, &*radiator);
      sound.inverseInertia = solid->inertia.inverse();
    }
    return sound;
  }

 private:
  std::shared_ptr<RadiatorCache> radiators_ = std::make_shared<RadiatorCache>();
};

Status setBodies(const Scene& scene, Synth& synth, const Progress& progress) {
  const Result<std::vector<BodyModes>> modes = sceneModes(scene, progress);
  if (!modes) return modes.error();
  SoundBodies bodies;
  for (std::size_t index = 0; index < scene.bodies.size(); ++index) {
    const Result<SoundBody> sound = bodies.make(scene.bodies[index], (*modes)[index]);
    Status set = sound ? synth.setBody(static_cast<BodyId>(index), *sound) : sound.error();
    if (!set) return Error{scene.bodies[index].name + ": " + set.error().message};
  }
  return std::monostate{};
}

/// s, in which a listener that gets to the end of its path comes to rest there: PoseTrack would
/// go on for longer.
constexpr double kStop = 1e-3;

/// The scene's listeners, with the heads that they name.
Result<std::vector<Listener>> equippedListeners(const Scene& scene) {
  std::vector<Listener> listeners = scene.listeners;
  std::map<std::filesystem::path, std::shared_ptr<const HrtfSet>> heads;
  for (const HeadFile& head : scene.headFiles) {
    std::shared_ptr<const HrtfSet>& set = heads[head.sofa];
    if (set == nullptr) {
      Result<HrtfSet> loaded = HrtfSet::load(head.sofa, scene.sampleRate);
      if (!loaded) return loaded.error();
      set = std::make_shared<const HrtfSet>(*std::move(loaded));
    }
    listeners.at(head.listener).hrtf = set;
  }
  return listeners;
}

/// All of a path at once: what is heard of an event depends on where a listener is when the sound
/// gets there, which can be any time after it.
Status follow(const ListenerPath& path, Synth& synth) {
  const Listener& start = synth.listeners()[path.listener];
  const ListenerPose first{0.0, start.position, start.orientation};
  if (Status moved = synth.moveListener(path.listener, first); !moved) return moved;
  for (const ListenerPose& pose : path.poses) {
    if (Status moved = synth.moveListener(path.listener, pose); !moved) return moved;
  }
  if (path.poses.empty()) return std::monostate{};
  ListenerPose rest = path.poses.back();
  rest.time += kStop;
  return synth.moveListener(path.listener, rest);
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

std::size_t imageCount(const Scene& scene) {
  if (scene.sound.room.reflectors.empty()) return 0;
  const Result<std::vector<Image>> images = makeImages(scene.sound.room);
  return images ? images->size() : 0;
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
  // Ahead of the first event, at least as far as in the midst of a whole scene.
  const double start = std::max(0.0, firstEventTime(scene, span) - 2.0 * kLookahead);
  if (start > 0.0) {
    if (const Status sought = synth->seek(start); !sought)
      return Error{scene.name + ": " + sought.error().message};
  }
  for (const ListenerPath& path : scene.paths) {
    if (const Status followed = follow(path, *synth); !followed)
      return Error{scene.name + ": " + followed.error().message};
  }
  if (const Status set = setBodies(scene, *synth, progress); !set)
    return Error{scene.name + ": " + set.error().message};
  SceneSound sound(scene, std::move(stepper), *std::move(synth), span);
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
      synth_(std::move(synth)) {}

/// What is heard before is not wanted, but the synth must have been through it.
void SceneSound::skipTo(std::int64_t frame) {
  std::vector<std::vector<float>> channels(synth_.channelCount());
  while (framesDone_ < frame) {
    const auto count = static_cast<std::size_t>(std::min(kSkipFrames, frame - framesDone_));
    for (std::vector<float>& channel : channels)
      channel.resize(count);
    if (render(channels) == 0) return;
    early_ = std::move(settled_);  // the mechanics are ahead: these may be wanted
  }
}

std::size_t SceneSound::render(std::span<std::vector<float>> channels) {
  settled_ = std::exchange(early_, {});
  const auto room = static_cast<std::int64_t>(channels.front().size());
  const std::int64_t count = std::min(room, frames_ - framesDone_);
  if (count <= 0) return 0;
  runAhead(static_cast<double>(framesDone_ + count) / sampleRate_ + kLookahead);
  std::vector<float*> pointers;
  for (std::vector<float>& channel : channels)
    pointers.push_back(channel.data());
  synth_.render<float>(pointers, static_cast<std::size_t>(count));
  framesDone_ += count;
  return static_cast<std::size_t>(count);
}

void SceneSound::runAhead(double time) {
  const double target = std::min(time, duration_);
  while (stepper_->settledTime() < target) {
    const auto events = stepper_->advanceTo(target);
    known_.insert(known_.end(), events.begin(), events.end());
    for (const ContactState& contact : stepper_->contacts())
      synth_.touch(contact);
  }
  std::stable_sort(known_.begin(), known_.end(), earlier);
  const double settledTime = stepper_->settledTime();
  const auto open = std::find_if(known_.begin(), known_.end(), [&](const ImpulseEvent& event) {
    return event.time >= settledTime && settledTime < duration_;
  });
  for (auto event = known_.begin(); event != open; ++event) {
    if (event->time > duration_) continue;
    synth_.schedule(*event);
    if (event->time >= span_.from && event->time <= span_.to) settled_.push_back(*event);
  }
  known_.erase(known_.begin(), open);
}

}  // namespace carom
