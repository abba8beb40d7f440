// A host with tick callbacks and an audio callback of its own: Carom leaves the one alone and
// serves the other. Runs in real time for a second and a half; writes what was heard to
// own_tick.wav.

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <thread>
#include <vector>

#include <btBulletDynamicsCommon.h>
#include <carom/audio/sound_file.h>
#include <carom/sound.h>

namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

constexpr std::size_t kBlock = 256;       // frames, as an audio device asks for
constexpr std::size_t kLongest = 192000;  // frames
constexpr double kSampleRate = 48000.0;
constexpr std::size_t kChannels = 2;  // the default listener has two

// The host's own data: its callbacks blow wind before each substep and count after it.
struct Host {
  btRigidBody* ball = nullptr;
  int forces = 0;
  int substeps = 0;
};

void beforeSubstep(btDynamicsWorld* world, btScalar) {
  Host& host = *static_cast<Host*>(world->getWorldUserInfo());
  host.ball->applyCentralForce(btVector3(btScalar(0.01), 0, 0));  // N
  ++host.forces;
}

void afterSubstep(btDynamicsWorld* world, btScalar) {
  ++static_cast<Host*>(world->getWorldUserInfo())->substeps;
}

// Stands for an audio device: a thread that asks for a block whenever one has gone by.
class AudioThread {
 public:
  explicit AudioThread(carom::Sound& sound)
      : left_(kLongest), right_(kLongest), thread_([this, &sound] { run(sound); }) {}
  ~AudioThread() { stop(); }
  AudioThread(const AudioThread&) = delete;
  AudioThread& operator=(const AudioThread&) = delete;

  void stop() {
    running_ = false;
    if (thread_.joinable()) thread_.join();
  }

  // Writes all that was heard. To be called after stop.
  carom::Status write(carom::SoundFileWriter& file) const {
    return file.write(std::array{left_.data(), right_.data()}, frames_);
  }

 private:
  void run(carom::Sound& sound) {
    const Clock::time_point start = Clock::now();
    while (running_ && frames_ + kBlock <= kLongest) {
      sound.render(std::array{left_.data() + frames_, right_.data() + frames_}, kBlock);
      frames_ += kBlock;
      std::this_thread::sleep_until(start + std::chrono::duration_cast<Clock::duration>(Seconds(
                                                static_cast<double>(frames_) / kSampleRate)));
    }
  }

  std::vector<float> left_;  // Pa
  std::vector<float> right_;
  std::size_t frames_ = 0;  // belongs to the thread until it has ended
  std::atomic<bool> running_ = true;
  std::thread thread_;  // last: it uses the rest
};

carom::Status playAndWrite(btDynamicsWorld& world, carom::Sound& sound) {
  if (carom::Status ready = sound.prepareRendering(kSampleRate); !ready) return ready;
  AudioThread audio(sound);
  Clock::time_point next = Clock::now();
  for (int frame = 0; frame < 90; ++frame) {
    world.stepSimulation(btScalar(1.0 / 60.0), 4, btScalar(1.0 / 240.0));
    next += std::chrono::microseconds(16667);
    std::this_thread::sleep_until(next);
  }
  audio.stop();
  sound.stop();

  carom::Result<carom::SoundFileWriter> file = carom::SoundFileWriter::create(
      "own_tick.wav", {.sampleRate = kSampleRate, .channels = kChannels});
  if (!file) return file.error();
  if (carom::Status written = audio.write(*file); !written) return written;
  return file->finish();
}

}  // namespace

int main() {
  btStaticPlaneShape floorShape(btVector3(0, 1, 0), 0);
  btSphereShape ballShape(btScalar(0.02));
  btRigidBody floor(0, nullptr, &floorShape);
  btRigidBody ball(btScalar(0.08), nullptr, &ballShape);
  ball.setWorldTransform(btTransform(btQuaternion::getIdentity(), btVector3(0, btScalar(0.5), -1)));
  floor.setRestitution(btScalar(0.9));
  ball.setRestitution(btScalar(0.9));

  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  world.addRigidBody(&floor);
  world.addRigidBody(&ball);

  Host host = {&ball};
  world.setInternalTickCallback(beforeSubstep, &host, true);
  world.setInternalTickCallback(afterSubstep, &host);  // both share the user info

  carom::Result<carom::Sound> sound = carom::Sound::attach(world);
  const carom::Status done = sound ? playAndWrite(world, *sound) : sound.error();
  if (!done) {
    std::fprintf(stderr, "own_tick: %s\n", done.error().message.c_str());
    return 1;
  }
  std::printf("own_tick.wav: %d substeps, %d with wind, %llu clicks\n", host.substeps, host.forces,
              static_cast<unsigned long long>(sound->statistics().events));
  return host.substeps == host.forces ? 0 : 1;
}
