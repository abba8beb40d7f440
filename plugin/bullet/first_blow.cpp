#include "plugin/bullet/first_blow.h"

#include <algorithm>

#include "audio/propagation/sound_paths.h"
#include "audio/scheduling/contact_sound_scheduler.h"

namespace carom::plugin {

using namespace audio;

namespace {

constexpr BodyId kFaller = 0;
constexpr BodyId kFloor = 1;

struct FirstBlowPeak final : SoundSink {
  double peak = 0.0;
  void add(const ScheduledSound& sound) override {
    peak = std::max({peak, sound.peak, sound.modalPeak});
  }
};

ImpulseEvent landing(const FallingBody& body, const Vec3& up) {
  const double restitution = body.sound.material.restitution;
  return {.body = kFaller,
          .other = kFloor,
          .impulse = (1.0 + restitution) * body.sound.mass * body.speed * up,
          .position = body.position - body.sound.radius * up,
          .normal = up,
          .approachSpeed = body.speed,
          .effectiveMass = body.sound.mass,
          .radius = body.sound.radius,
          .bodyPosition = body.position,
          .bodyVelocity = -body.speed * up};
}

}  // namespace

double peakOfFirstBlow(const SoundSettings& settings, const ListenerPose& listener, const Vec3& up,
                       std::span<const FallingBody> bodies) {
  const auto paths = makeSoundPaths(settings.synth, settings.listeners);
  if (!paths) return 0.0;
  ContactSoundScheduler scheduler(*paths);
  ListenerPose pose = listener;
  pose.time = 0.0;
  (void)scheduler.placeListener(0, pose);
  (void)scheduler.setBody(kFloor, {.material = *findMaterial("concrete")});
  FirstBlowPeak sink;
  for (const FallingBody& body : bodies)
    if (scheduler.setBody(kFaller, body.sound)) scheduler.schedule(landing(body, up), {}, sink);
  return sink.peak;
}

}  // namespace carom::plugin
