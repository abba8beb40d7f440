#include "carom/sound.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include <btBulletDynamicsCommon.h>

#include "bullet_bridge/geometry/to_vec3.h"
#include "plugin/bullet/world_session.h"

namespace carom {

using namespace plugin;
using namespace bullet;

namespace {

/// VoiceBudget::buses of a world whose bodies click by recoils: see WorldSoundSettings::recoil.
constexpr std::size_t kBusesForRecoils = 1024;

/// Runs `action` on the session of a Sound, which attach makes, as onOpen does.
template <class Action>
Status onWorld(const std::shared_ptr<SoundSession>& session, const Action& action) {
  return onOpen(session,
                [&](SoundSession& open) { return action(static_cast<WorldSession&>(open)); });
}

}  // namespace

Sound::Sound(std::shared_ptr<SoundSession> session) : SoundOutput(std::move(session)) {}

Result<Sound> Sound::attach(btDynamicsWorld& world, const SoundSettings& settings,
                            const WorldSoundSettings& worldSettings) {
  SoundSettings own = settings;
  if (worldSettings.recoil) own.budget.buses = std::max(own.budget.buses, kBusesForRecoils);
  const auto session = std::make_shared<WorldSession>(world, own, worldSettings);
  if (const Status prepared = session->told(session->prepare()); !prepared) return prepared.error();
  if (const Status following = session->told(session->attach()); !following)
    return following.error();
  Sound sound(session);
  if (const Status begun = session->told(session->begin()); !begun) return begun.error();
  return sound;
}

Status Sound::assign(const btCollisionObject& object, const BodySound& sound) {
  return onWorld(session_, [&](WorldSession& world) { return world.assign(object, sound); });
}
Status Sound::assign(const btCollisionShape& shape, const BodySound& sound) {
  return onWorld(session_, [&](WorldSession& world) { return world.assign(shape, sound); });
}
Status Sound::assign(UserIndex userIndex, const BodySound& sound) {
  return onWorld(session_, [&](WorldSession& world) { return world.assign(userIndex, sound); });
}

Status Sound::unassign(const btCollisionObject& object) {
  return onWorld(session_, [&](WorldSession& world) { return world.unassign(object); });
}
Status Sound::unassign(const btCollisionShape& shape) {
  return onWorld(session_, [&](WorldSession& world) { return world.unassign(shape); });
}
Status Sound::unassign(UserIndex userIndex) {
  return onWorld(session_, [&](WorldSession& world) { return world.unassign(userIndex); });
}

Status Sound::placeListener(const btVector3& position, const btQuaternion* orientation,
                            std::size_t listener) {
  if (session_ == nullptr) return movedFrom();
  const double metres = static_cast<WorldSession&>(*session_).metresPerUnit();
  const Quat turn =
      toQuat(btTransform(orientation == nullptr ? btQuaternion::getIdentity() : *orientation));
  return setListener(metres * toVec3(position), turn, listener);
}

Result<BodyMaterial> Sound::materialOf(const btCollisionObject& object) const {
  if (session_ == nullptr) return movedFrom();
  return static_cast<const WorldSession&>(*session_).materialOf(object);
}

void Sound::prepare() {
  if (session_ == nullptr) return;
  auto& world = static_cast<WorldSession&>(*session_);
  world.readBodies();
  world.finishShapes();
}

Status Sound::onCollision(std::function<void(const SoundCollision&)> function) {
  return onWorld(session_, [&](WorldSession& world) -> Status {
    world.onCollision(std::move(function));
    return std::monostate{};
  });
}

}  // namespace carom
