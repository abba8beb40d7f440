// Two Bullet worlds, a sound each, mixed by the host: it pulls the samples of both as far as they
// are known, and adds them. Writes two_worlds.wav, two seconds.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdio>
#include <span>

#include <btBulletDynamicsCommon.h>
#include <carom/audio/sound_file.h>
#include <carom/sound.h>

namespace {

constexpr std::size_t kBlock = 512;  // frames
constexpr std::size_t kChannels = 2;
constexpr double kSampleRate = 48000.0;

// A ball that bounces on a floor. Another radius and place for each world.
struct BallWorld {
  btStaticPlaneShape floorShape{btVector3(0, 1, 0), 0};
  btSphereShape ballShape;
  btRigidBody floor{0, nullptr, &floorShape};
  btRigidBody ball;
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world{&dispatcher, &broadphase, &solver, &configuration};

  BallWorld(btScalar radius, btScalar mass, const btVector3& place)
      : ballShape(radius), ball(mass, nullptr, &ballShape) {
    ball.setWorldTransform(btTransform(btQuaternion::getIdentity(), place));
    floor.setRestitution(btScalar(0.9));
    ball.setRestitution(btScalar(0.9));
    world.setGravity(btVector3(0, btScalar(-9.81), 0));
    world.addRigidBody(&floor);
    world.addRigidBody(&ball);
  }
};

carom::Result<carom::Sound> attach(btDynamicsWorld& world) {
  carom::SoundSettings settings;
  settings.clock = carom::SoundClock::simulation;  // as fast as the worlds step
  carom::Result<carom::Sound> sound = carom::Sound::attach(world, settings);
  if (!sound) return sound;
  if (carom::Status ready = sound->prepareRendering(kSampleRate); !ready) return ready.error();
  return sound;
}

using Planes = std::array<std::array<float, kBlock>, kChannels>;  // Pa

std::array<float*, kChannels> pointers(Planes& planes) {
  return {planes[0].data(), planes[1].data()};
}

void mixInto(Planes& mix, const Planes& other) {
  for (std::size_t channel = 0; channel < kChannels; ++channel)
    std::ranges::transform(mix[channel], other[channel], mix[channel].begin(), std::plus<>());
}

// Mixes and writes the frames that are ready in both sounds.
carom::Status writeReady(carom::SoundOutput& first, carom::SoundOutput& second,
                         carom::SoundFileWriter& file) {
  Planes mix{};
  Planes other{};
  while (const std::size_t frames = std::min({first.framesReady(), second.framesReady(), kBlock})) {
    first.render(pointers(mix), frames);
    second.render(pointers(other), frames);
    mixInto(mix, other);
    const std::array<const float*, kChannels> channels = {mix[0].data(), mix[1].data()};
    if (carom::Status written = file.write(channels, frames); !written) return written;
  }
  return std::monostate();
}

carom::Status run() {
  BallWorld marble(btScalar(0.008), btScalar(0.0055), btVector3(-1, btScalar(0.6), -1));
  BallWorld bowl(btScalar(0.05), btScalar(0.4), btVector3(1, btScalar(0.4), -1));
  carom::Result<carom::Sound> first = attach(marble.world);
  if (!first) return first.error();
  carom::Result<carom::Sound> second = attach(bowl.world);
  if (!second) return second.error();
  carom::Result<carom::SoundFileWriter> file = carom::SoundFileWriter::create(
      "two_worlds.wav", {.sampleRate = kSampleRate, .channels = kChannels});
  if (!file) return file.error();

  for (int frame = 0; frame < 120; ++frame) {
    marble.world.stepSimulation(btScalar(1.0 / 60.0), 4, btScalar(1.0 / 240.0));
    bowl.world.stepSimulation(btScalar(1.0 / 60.0), 2, btScalar(1.0 / 120.0));
    if (carom::Status written = writeReady(*first, *second, *file); !written) return written;
  }
  std::printf("two_worlds.wav: %llu clicks and %llu, peak %.3f Pa\n",
              static_cast<unsigned long long>(first->statistics().events),
              static_cast<unsigned long long>(second->statistics().events), file->peakPressure());
  return file->finish();
}

}  // namespace

int main() {
  const carom::Status done = run();
  if (!done) std::fprintf(stderr, "two_worlds: %s\n", done.error().message.c_str());
  return done ? 0 : 1;
}
