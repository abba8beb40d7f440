#include "plugin/sound.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <unordered_set>
#include <utility>

#include <btBulletDynamicsCommon.h>

#include "bullet_bridge/bullet_bridge.h"

namespace carom {
namespace {

const Material& nearestByDensity(double density) {
  const auto table = materialTable();
  return *std::min_element(table.begin(), table.end(), [&](const Material& a, const Material& b) {
    return std::abs(std::log(a.density / density)) < std::abs(std::log(b.density / density));
  });
}

double boxVolume(const btVector3& size) {
  return static_cast<double>(size.x()) * static_cast<double>(size.y()) *
         static_cast<double>(size.z());
}

// m^3. Hulls and other shapes without a short formula fill about half of the box around them.
double volumeOf(const btCollisionShape& shape) {
  constexpr double kPi = std::numbers::pi;
  btVector3 low;
  btVector3 high;
  shape.getAabb(btTransform::getIdentity(), low, high);
  const double box = boxVolume(high - low);
  switch (shape.getShapeType()) {
    case SPHERE_SHAPE_PROXYTYPE:
      return kPi / 6.0 * box;
    case BOX_SHAPE_PROXYTYPE:
      return box;
    case CYLINDER_SHAPE_PROXYTYPE:
      return kPi / 4.0 * box;
    case CONE_SHAPE_PROXYTYPE:
      return kPi / 12.0 * box;
    case CAPSULE_SHAPE_PROXYTYPE: {
      const auto& capsule = static_cast<const btCapsuleShape&>(shape);
      const auto radius = static_cast<double>(capsule.getRadius());
      const double length = 2.0 * static_cast<double>(capsule.getHalfHeight());
      return kPi * radius * radius * (length + 4.0 / 3.0 * radius);
    }
    case COMPOUND_SHAPE_PROXYTYPE: {
      const auto& compound = static_cast<const btCompoundShape&>(shape);
      double sum = 0.0;
      for (int i = 0; i < compound.getNumChildShapes(); ++i)
        sum += volumeOf(*compound.getChildShape(i));
      return sum;
    }
    default:
      return 0.5 * box;
  }
}

SoundBody guessBody(const btCollisionObject& object) {
  SoundBody body;
  const btRigidBody* rigid = btRigidBody::upcast(&object);
  const bool movable = rigid != nullptr && rigid->getInvMass() > 0;
  const double volume = movable ? volumeOf(*object.getCollisionShape()) : 0.0;
  if (movable && volume > 0.0 && std::isfinite(volume)) {
    body.mass = 1.0 / static_cast<double>(rigid->getInvMass());
    body.radius = std::cbrt(volume * 0.75 / std::numbers::pi);
    body.material = nearestByDensity(body.mass / volume);
  } else {
    body.material = *findMaterial("concrete");
  }
  body.material.restitution = std::clamp(static_cast<double>(object.getRestitution()), 0.0, 1.0);
  return body;
}

}  // namespace

class Sound::Impl {
 public:
  Impl(btDynamicsWorld& world, const SoundSettings& settings, BulletBridge bridge, Synth synth)
      : world_(world), settings_(settings), bridge_(std::move(bridge)), synth_(std::move(synth)) {}

  Status setMaterial(const btCollisionObject& object, const Material& material) {
    const Result<BodyId> id = bridge_.bodyId(object);
    if (!id) return id.error();
    SoundBody body = guessBody(object);
    body.material = material;
    Status set = synth_.setBody(*id, body);
    if (set) bodies_.insert(*id);
    return set;
  }

  std::size_t framesReady() const {
    const double ahead = bridge_.time() - settings_.latency - synth_.time();
    return ahead > 0.0 ? static_cast<std::size_t>(ahead * settings_.sampleRate) : 0;
  }

  std::size_t render(std::span<float* const> channels, std::size_t room) {
    for (const ImpulseEvent& event : bridge_.events()) {
      if (!bodies_.contains(event.body) || !bodies_.contains(event.other)) guessNewBodies();
      synth_.schedule(event);
    }
    bridge_.clear();
    const std::size_t frames = std::min(room, framesReady());
    synth_.render<float>(channels, frames);
    return frames;
  }

  const SynthCounters& counters() const { return synth_.counters(); }
  std::uint64_t unsupportedContacts() const { return bridge_.counters().unsupported; }

 private:
  void guessNewBodies() {
    const auto& objects = world_.getCollisionObjectArray();
    for (int i = 0; i < objects.size(); ++i) {
      const Result<BodyId> id = bridge_.bodyId(*objects[i]);
      if (!id || bodies_.contains(*id)) continue;
      if (synth_.setBody(*id, guessBody(*objects[i]))) bodies_.insert(*id);
    }
  }

  btDynamicsWorld& world_;
  SoundSettings settings_;
  BulletBridge bridge_;
  Synth synth_;
  std::unordered_set<BodyId> bodies_;  // that the synth knows
};

Result<Sound> Sound::attach(btDynamicsWorld& world, const SoundSettings& settings) {
  if (!(settings.latency >= 0.0) || !std::isfinite(settings.latency)) {
    return Error{"Sound: latency is " + std::to_string(settings.latency) +
                 "; expected a finite number of seconds, not negative"};
  }
  SynthSettings synthSettings;
  synthSettings.sampleRate = settings.sampleRate;
  synthSettings.medium = settings.medium;
  synthSettings.impulse = settings.impulse;
  Result<Synth> synth = Synth::create(synthSettings, settings.listeners);
  if (!synth) return synth.error();
  BulletBridgeSettings bridgeSettings;
  bridgeSettings.restSpeed = settings.restSpeed;
  if (settings.impulse == ImpulseChoice::physical) bridgeSettings.delivery = EventDelivery::prompt;
  Result<BulletBridge> bridge = BulletBridge::attach(world, bridgeSettings);
  if (!bridge) return bridge.error();
  return Sound(std::make_unique<Impl>(world, settings, *std::move(bridge), *std::move(synth)));
}

Sound::Sound(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Sound::Sound(Sound&&) noexcept = default;
Sound& Sound::operator=(Sound&&) noexcept = default;
Sound::~Sound() = default;

Status Sound::setMaterial(const btCollisionObject& object, const Material& material) {
  return impl_->setMaterial(object, material);
}
std::size_t Sound::framesReady() const {
  return impl_->framesReady();
}
std::size_t Sound::render(std::span<float* const> channels, std::size_t room) {
  return impl_->render(channels, room);
}
const SynthCounters& Sound::counters() const {
  return impl_->counters();
}

std::uint64_t Sound::unsupportedContacts() const {
  return impl_->unsupportedContacts();
}

}  // namespace carom
