#include "carom/sound.h"

#include <utility>

#include "plugin/bullet/world_session.h"

namespace carom {

using namespace plugin;

namespace {

/// The session of a Sound, which attach makes.
WorldSession& worldOf(SoundSession& session) {
  return static_cast<WorldSession&>(session);
}

}  // namespace

Sound::Sound(std::unique_ptr<SoundSession> session) : SoundOutput(std::move(session)) {}

Result<Sound> Sound::attach(btDynamicsWorld& world, const SoundSettings& settings,
                            const WorldSoundSettings& worldSettings) {
  auto session = std::make_unique<WorldSession>(world, settings, worldSettings);
  WorldSession& attached = *session;
  if (const Status prepared = attached.prepare(); !prepared) return prepared.error();
  Sound sound(std::move(session));
  if (settings.play)
    if (const Status playing = sound.play(); !playing) return playing.error();
  if (const Status following = attached.attach(); !following) return following.error();
  // The recording comes last: once begun, it replaces the file, whatever comes of the rest.
  if (!settings.record.empty())
    if (const Status recording = sound.record(settings.record); !recording)
      return recording.error();
  return sound;
}

Status Sound::assign(const btCollisionObject& object, const BodySound& sound) {
  return worldOf(*session_).assign(object, sound);
}
Status Sound::assign(const btCollisionShape& shape, const BodySound& sound) {
  return worldOf(*session_).assign(shape, sound);
}
Status Sound::assign(UserIndex userIndex, const BodySound& sound) {
  return worldOf(*session_).assign(userIndex, sound);
}

Status Sound::unassign(const btCollisionObject& object) {
  return worldOf(*session_).unassign(object);
}
Status Sound::unassign(const btCollisionShape& shape) {
  return worldOf(*session_).unassign(shape);
}
Status Sound::unassign(UserIndex userIndex) {
  return worldOf(*session_).unassign(userIndex);
}

void Sound::prepare() {
  worldOf(*session_).readBodies();
  worldOf(*session_).finishShapes();
}

}  // namespace carom
