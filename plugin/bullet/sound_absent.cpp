// Takes the place of sound.cpp in a build without Bullet, where no Sound can be made.

#include <utility>

#include "carom/sound.h"

namespace carom {
namespace {

Error noWorlds() {
  return Error{"sound: this build knows no Bullet worlds (CAROM_BULLET is off); post events"};
}

}  // namespace

Sound::Sound(std::shared_ptr<plugin::SoundSession> session) : SoundOutput(std::move(session)) {}

Result<Sound> Sound::attach(btDynamicsWorld&, const SoundSettings&, const WorldSoundSettings&) {
  return noWorlds();
}

Status Sound::assign(const btCollisionObject&, const BodySound&) {
  return noWorlds();
}
Status Sound::assign(const btCollisionShape&, const BodySound&) {
  return noWorlds();
}
Status Sound::assign(UserIndex, const BodySound&) {
  return noWorlds();
}

Status Sound::unassign(const btCollisionObject&) {
  return noWorlds();
}
Status Sound::unassign(const btCollisionShape&) {
  return noWorlds();
}
Status Sound::unassign(UserIndex) {
  return noWorlds();
}

Status Sound::placeListener(const btVector3&, const btQuaternion*, std::size_t) {
  return noWorlds();
}

Result<BodyMaterial> Sound::materialOf(const btCollisionObject&) const {
  return noWorlds();
}

void Sound::prepare() {}

Status Sound::onCollision(
    std::function<void(const SoundCollision&)>) {  // NOLINT(performance-unnecessary-value-param)
  return noWorlds();
}

}  // namespace carom
