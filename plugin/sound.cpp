#include "plugin/sound.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <unordered_map>
#include <utility>

#include <btBulletDynamicsCommon.h>

#include "bullet_bridge/bullet_bridge.h"
#include "plugin/body_reader.h"

namespace carom {
namespace {

std::string whyNot(const SoundSettings& settings) {
  if (!(settings.latency >= 0.0) || !std::isfinite(settings.latency)) {
    return "latency is " + std::to_string(settings.latency) +
           "; expected a finite number of seconds, not negative";
  }
  const double fullScale = settings.fullScale.value_or(1.0);
  if (!(fullScale > 0.0) || !std::isfinite(fullScale) || !std::isfinite(1.0 / fullScale)) {
    return "full scale is " + std::to_string(fullScale) + "; expected a positive pressure (Pa)";
  }
  return {};
}

BulletBridgeSettings bridgeSettings(const SoundSettings& settings) {
  BulletBridgeSettings bridge;
  bridge.restSpeed = settings.restSpeed;
  if (settings.synth.impulse == ImpulseChoice::physical) bridge.delivery = EventDelivery::prompt;
  return bridge;
}

}  // namespace

class Sound::Impl {
 public:
  Impl(btDynamicsWorld& world, const SoundSettings& settings, BulletBridge bridge, Synth synth,
       std::optional<Limiter> limiter)
      : world_(world),
        settings_(settings),
        bridge_(std::move(bridge)),
        synth_(std::move(synth)),
        limiter_(std::move(limiter)),
        reader_(settings.radiators) {}

  Status setMaterial(const btCollisionObject& object, const Material& material) {
    const Result<BodyId> id = bridge_.bodyId(object);
    if (!id) return id.error();
    BodyReading reading = reader_.read(object);
    reading.sound.material = material;
    Status set = synth_.setBody(*id, reading.sound);
    if (!set) return set;
    Known& known = noted(*id, reading);
    known.sounds = true;
    known.material = material;
    return set;
  }

  void prepare() {
    const auto& objects = world_.getCollisionObjectArray();
    for (int i = 0; i < objects.size(); ++i) {
      BodyReading reading = reader_.read(*objects[i]);
      const Result<BodyId> id = bridge_.bodyId(*objects[i]);
      if (!id) continue;  // not stepped yet: its shape is solved, and that is all that takes long
      const Known& known = noted(*id, reading);
      if (known.material) reading.sound.material = *known.material;
      if (known.sounds) (void)synth_.setBody(*id, reading.sound);
    }
  }

  Status moveListener(std::size_t listener, const ListenerPose& pose) {
    return synth_.moveListener(listener, pose);
  }

  double time() const { return bridge_.time(); }
  std::size_t channelCount() const { return synth_.channelCount(); }

  std::size_t framesReady() const {
    const double ahead = bridge_.time() - settings_.latency - synth_.time();
    return ahead > 0.0 ? static_cast<std::size_t>(ahead * settings_.synth.sampleRate) : 0;
  }

  std::size_t render(std::span<float* const> channels, std::size_t room) {
    for (const ImpulseEvent& event : bridge_.events()) {
      if (!isKnown(event.body) || !isKnown(event.other)) readNewBodies();
      synth_.schedule(event);
    }
    bridge_.clear();
    const std::size_t frames = std::min(room, framesReady());
    synth_.render<float>(channels, frames);
    if (settings_.fullScale) scale(channels, frames);
    if (limiter_) limiter_->process(channels, frames);
    return frames;
  }

  std::size_t outputDelay() const { return limiter_ ? limiter_->latency() : 0; }

  const SynthCounters& counters() const { return synth_.counters(); }
  std::uint64_t unsupportedContacts() const { return bridge_.counters().unsupported; }
  double largestReduction() const { return limiter_ ? limiter_->largestReduction() : 0.0; }

  RadiatorCounters radiators() const {
    RadiatorCounters counters;
    counters.solved = reader_.solved();
    counters.solvedInRender = solvedInRender_;
    counters.unsolvedReason = unsolvedReason_;
    for (const auto& [id, known] : bodies_) {
      counters.unsolved += known.isUnsolved ? 1 : 0;
      counters.links += known.isLink ? 1 : 0;
    }
    return counters;
  }

 private:
  struct Known {
    std::optional<Material> material;  // that was set
    bool sounds = false;               // the synth was told of it
    bool isUnsolved = false;
    bool isLink = false;
  };

  bool isKnown(BodyId id) const {
    const auto found = bodies_.find(id);
    return found != bodies_.end() && found->second.sounds;
  }

  Known& noted(BodyId id, const BodyReading& reading) {
    Known& known = bodies_[id];
    known.isUnsolved = reading.unsolved.has_value();
    known.isLink = reading.isLink;
    if (reading.unsolved) unsolvedReason_ = reading.unsolved->message;
    return known;
  }

  void readNewBodies() {
    const std::uint64_t before = reader_.solved();
    const auto& objects = world_.getCollisionObjectArray();
    for (int i = 0; i < objects.size(); ++i) {
      const Result<BodyId> id = bridge_.bodyId(*objects[i]);
      if (!id || isKnown(*id)) continue;
      const BodyReading reading = reader_.read(*objects[i]);
      noted(*id, reading).sounds = true;
      (void)synth_.setBody(*id, reading.sound);  // refused: its events are counted as rejected
    }
    solvedInRender_ += reader_.solved() - before;
  }

  void scale(std::span<float* const> channels, std::size_t frames) const {
    const double perPascal = 1.0 / *settings_.fullScale;
    for (float* const channel : channels) {
      std::transform(channel, channel + frames, channel, [perPascal](float pressure) {
        return static_cast<float>(perPascal * static_cast<double>(pressure));
      });
    }
  }

  btDynamicsWorld& world_;
  SoundSettings settings_;
  BulletBridge bridge_;
  Synth synth_;
  std::optional<Limiter> limiter_;
  BodyReader reader_;
  std::unordered_map<BodyId, Known> bodies_;
  std::string unsolvedReason_;
  std::uint64_t solvedInRender_ = 0;
};

Result<Sound> Sound::attach(btDynamicsWorld& world, const SoundSettings& settings) {
  if (const std::string reason = whyNot(settings); !reason.empty())
    return Error{"Sound: " + reason};
  Result<Synth> synth = Synth::create(settings.synth, settings.listeners);
  if (!synth) return synth.error();
  std::optional<Limiter> limiter;
  if (settings.limiter) {
    LimiterSettings wanted = *settings.limiter;
    wanted.sampleRate = settings.synth.sampleRate;
    wanted.channels = synth->channelCount();
    Result<Limiter> made = Limiter::create(wanted);
    if (!made) return made.error();
    limiter = *std::move(made);
  }
  Result<BulletBridge> bridge = BulletBridge::attach(world, bridgeSettings(settings));
  if (!bridge) return bridge.error();
  auto impl = std::make_unique<Impl>(world, settings, *std::move(bridge), *std::move(synth),
                                     std::move(limiter));
  impl->prepare();
  return Sound(std::move(impl));
}

Sound::Sound(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Sound::Sound(Sound&&) noexcept = default;
Sound& Sound::operator=(Sound&&) noexcept = default;
Sound::~Sound() = default;

Status Sound::setMaterial(const btCollisionObject& object, const Material& material) {
  return impl_->setMaterial(object, material);
}
void Sound::prepare() {
  impl_->prepare();
}
Status Sound::moveListener(std::size_t listener, const ListenerPose& pose) {
  return impl_->moveListener(listener, pose);
}
double Sound::time() const {
  return impl_->time();
}
std::size_t Sound::channelCount() const {
  return impl_->channelCount();
}
std::size_t Sound::framesReady() const {
  return impl_->framesReady();
}
std::size_t Sound::render(std::span<float* const> channels, std::size_t room) {
  return impl_->render(channels, room);
}
std::size_t Sound::outputDelay() const {
  return impl_->outputDelay();
}
const SynthCounters& Sound::counters() const {
  return impl_->counters();
}
RadiatorCounters Sound::radiators() const {
  return impl_->radiators();
}
double Sound::largestReduction() const {
  return impl_->largestReduction();
}
std::uint64_t Sound::unsupportedContacts() const {
  return impl_->unsupportedContacts();
}

}  // namespace carom
