#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <btBulletDynamicsCommon.h>

#include "carom/audio/material.h"
#include "carom/sound.h"
#include "tests/fuzz/fuzz_bullet.h"
#include "tests/fuzz/fuzz_files.h"
#include "tests/fuzz/fuzz_host.h"
#include "tests/fuzz/fuzz_numbers.h"

namespace carom::fuzz {
namespace {

constexpr std::size_t kMostCalls = 120;
constexpr std::size_t kMostBodies = 6;

btVector3 bulletOf(const Vec3& v) {
  return {static_cast<btScalar>(v.x()), static_cast<btScalar>(v.y()), static_cast<btScalar>(v.z())};
}

/// A small world whose bodies come and go: a floor, and spheres, boxes and capsules.
class World {
 public:
  World() {
    world_.setGravity({0, btScalar(-9.81), 0});
    add(floor_, 0.0, Vec3::Zero());
  }
  World(const World&) = delete;
  World& operator=(const World&) = delete;
  ~World() {
    for (const auto& body : bodies_)
      world_.removeRigidBody(body.get());
  }

  btDiscreteDynamicsWorld& bullet() { return world_; }
  btCollisionShape& shape(std::size_t index) {
    const std::array<btCollisionShape*, 4> shapes = {&sphere_, &box_, &capsule_, &floor_};
    return *shapes[index % shapes.size()];
  }
  /// A body, or one that is not in the world.
  btRigidBody& body(std::size_t index) {
    return index < bodies_.size() ? *bodies_[index] : stranger_;
  }
  void add(btCollisionShape& shape, double mass, const Vec3& place) {
    if (bodies_.size() > kMostBodies) return;
    btVector3 inertia(0, 0, 0);
    if (mass > 0.0 && shape.getShapeType() != STATIC_PLANE_PROXYTYPE)
      shape.calculateLocalInertia(static_cast<btScalar>(mass), inertia);
    bodies_.push_back(
        std::make_unique<btRigidBody>(static_cast<btScalar>(mass), nullptr, &shape, inertia));
    btRigidBody& body = *bodies_.back();
    body.setRestitution(btScalar(0.7));
    body.setCenterOfMassTransform(btTransform(btQuaternion::getIdentity(), bulletOf(place)));
    body.setUserIndex(static_cast<int>(bodies_.size() % 3));
    world_.addRigidBody(&body);
  }
  void remove(std::size_t index) {
    if (index >= bodies_.size()) return;
    world_.removeRigidBody(bodies_[index].get());
    bodies_.erase(bodies_.begin() + static_cast<std::ptrdiff_t>(index));
  }

 private:
  btDefaultCollisionConfiguration configuration_{smallPools()};
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_{&dispatcher_, &broadphase_, &solver_, &configuration_};
  btStaticPlaneShape floor_{btVector3(0, 1, 0), 0};
  btSphereShape sphere_{btScalar(0.03)};
  btBoxShape box_{btVector3(btScalar(0.02), btScalar(0.03), btScalar(0.05))};
  btCapsuleShape capsule_{btScalar(0.02), btScalar(0.05)};
  btRigidBody stranger_{btScalar(1), nullptr, &sphere_};
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
};

/// A host that calls in any order, with numbers that are mostly sound.
class Host {
 public:
  Host(World& world, Sound& sound, FuzzNumbers& numbers)
      : world_(world), sound_(sound), numbers_(numbers) {}

  void run(bool isPulled) {
    isPulled_ = isPulled;
    callInAnyOrder(numbers_, kMostCalls, [this] { callOne(); });
  }

 private:
  void callOne() {
    switch (numbers_.below(24)) {
      case 0:
        addBody();
        break;
      case 1:
        world_.remove(numbers_.below(kMostBodies));
        break;
      case 2:
        kick();
        break;
      case 3:
        assign();
        break;
      case 4:
        unassign();
        break;
      case 5:
        setListener();
        break;
      case 6:
        setOutput();
        break;
      case 7:
        record();
        break;
      case 8:
        ask();
        break;
      case 9:
        (void)sound_.onCollision(hear);
        break;
      case 10:
        if (isPulled_ && numbers_.rarely(32)) sound_.prepare();
        break;
      case 11:
        moveBody();
        break;
      case 12:
        if (numbers_.rarely(8)) (void)sound_.close();
        break;
      default:
        step();
    }
  }
  btRigidBody& body() { return world_.body(numbers_.below(kMostBodies + 1)); }
  void addBody() {
    const double mass = numbers_.logBetween(1e-3, 10.0);
    world_.add(world_.shape(numbers_.below(3)), numbers_.rarely(16) ? numbers_.wild(mass) : mass,
               numbers_.inCube(0.5) + Vec3(0.0, 0.6, 0.0));
  }
  void kick() {
    btRigidBody& kicked = body();
    kicked.activate(true);
    kicked.setLinearVelocity(bulletOf(numbers_.wild(numbers_.inCube(20.0))));
    if (numbers_.chance(128))
      kicked.setAngularVelocity(bulletOf(numbers_.wild(numbers_.inCube(50.0))));
  }
  void moveBody() {
    btTransform place = body().getWorldTransform();
    place.setOrigin(bulletOf(numbers_.wild(numbers_.inCube(1.0))));
    body().setCenterOfMassTransform(place);
  }
  BodySound bodySound() {
    constexpr std::array kMaterials = {"steel", "glass", "rubber", "no such material"};
    BodySound sound;
    if (numbers_.chance(128)) sound.material = kMaterials[numbers_.below(kMaterials.size())];
    if (numbers_.rarely(64)) {
      Material own = *findMaterial("wood");
      own.density = numbers_.wild(own.density);
      own.youngsModulus = numbers_.wild(own.youngsModulus);
      own.restitution = numbers_.wild(own.restitution);
      sound.material = own;
    }
    if (numbers_.rarely(48)) sound.silent = numbers_.chance(128);
    return sound;
  }
  void assign() {
    switch (numbers_.below(3)) {
      case 0:
        (void)sound_.assign(body(), bodySound());
        break;
      case 1:
        (void)sound_.assign(world_.shape(numbers_.below(4)), bodySound());
        break;
      default:
        (void)sound_.assign(UserIndex{static_cast<int>(numbers_.below(4)) - 1}, bodySound());
    }
  }
  void unassign() {
    switch (numbers_.below(3)) {
      case 0:
        (void)sound_.unassign(body());
        break;
      case 1:
        (void)sound_.unassign(world_.shape(numbers_.below(4)));
        break;
      default:
        (void)sound_.unassign(UserIndex{static_cast<int>(numbers_.below(4)) - 1});
    }
  }
  void setListener() {
    const Vec3 place = numbers_.wild(numbers_.inCube(3.0));
    const Vec3 axis = numbers_.wild(numbers_.inCube(1.0));
    const Quat turn(numbers_.wild(numbers_.between(-1.0, 1.0)), axis.x(), axis.y(), axis.z());
    const std::size_t listener = numbers_.chance(250) ? 0 : 7;
    if (numbers_.chance(128))
      (void)sound_.setListener(place, turn, listener);
    else if (numbers_.chance(128))
      (void)sound_.setListener(bulletOf(place), listener);
    else
      (void)sound_.setListener(btTransform(btQuaternion::getIdentity(), bulletOf(place)), listener);
  }
  void setOutput() {
    switch (numbers_.below(5)) {
      case 0:
        sound_.pause();
        break;
      case 1:
        (void)sound_.setTimeScale(numbers_.wild(numbers_.logBetween(0.1, 4.0)));
        break;
      case 2:
        sound_.setGain(numbers_.wild(1.0));
        break;
      case 3:
        sound_.setMuted(numbers_.chance(128));
        break;
      default:
        if (!isPulled_) (void)sound_.prepareRendering(numbers_.wild(kRate));
    }
  }
  void record() {
    if (numbers_.chance(128)) return (void)sound_.finishRecording();
    (void)sound_.record(scratchFolder() / (numbers_.chance(240) ? "fuzz.wav" : "none/fuzz.mp3"));
  }
  void ask() {
    requireOneFateEach(sound_.statistics());
    if (numbers_.rarely(64)) require(sound_.report().size() < 10000);
    const Result<BodyMaterial> material = sound_.materialOf(body());
    if (material) require(!material->material.name.empty());
  }
  static void hear(const SoundCollision& collision) {
    require(std::isfinite(collision.time) && collision.position.allFinite() &&
            collision.normal.allFinite() && collision.impulse >= 0.0);
    for (const HeardCollision& heard : collision.heard)
      require(heard.peak <= collision.peak);
  }
  void step() {
    constexpr double kStep = 1.0 / 240.0;  // s
    const double frame = numbers_.wild(kStep * static_cast<double>(1 + numbers_.below(4)));
    world_.bullet().stepSimulation(static_cast<btScalar>(std::isfinite(frame) ? frame : 0.0), 4,
                                   btScalar(kStep));
    if (!isPulled_)
      pullFinite([this](std::span<float* const> channels, std::size_t frames) {
        sound_.render(channels, frames);
      });
  }

  World& world_;
  Sound& sound_;
  FuzzNumbers& numbers_;
  bool isPulled_ = false;
};

SoundSettings settingsOf(FuzzNumbers& numbers) {
  SoundSettings settings = smallSettings(numbers);
  settings.level = static_cast<Level>(numbers.below(3));
  if (numbers.rarely(64)) settings.clock = SoundClock::simulation;
  if (numbers.rarely(32)) settings.latency = numbers.wild(0.05);
  return settings;
}

void runHost(World& world, Sound& sound, FuzzNumbers& numbers) {
  const bool isPulled = numbers.rarely(64) && sound.prepareRendering(kRate);
  Host host(world, sound, numbers);
  if (!isPulled) return host.run(false);
  const Puller puller([&](std::span<float* const> channels, std::size_t frames) {
    sound.render(channels, frames);
  });
  host.run(true);
}

void call(FuzzNumbers& numbers) {
  auto world = std::make_unique<World>();
  WorldSoundSettings worldSettings{.radiators = RadiatorChoice::equivalentSphere};
  if (numbers.rarely(2)) worldSettings.radiators = RadiatorChoice::solved;
  if (numbers.rarely(16)) worldSettings.metresPerUnit = numbers.wild(1.0);
  if (numbers.rarely(16)) worldSettings.restSpeed = numbers.wild(0.005);
  Result<Sound> sound = Sound::attach(world->bullet(), settingsOf(numbers), worldSettings);
  if (!sound) return require(!sound.error().message.empty());
  runHost(*world, *sound, numbers);
  if (numbers.rarely(32)) world.reset();
  closeWithFates(*sound);
}

}  // namespace
}  // namespace carom::fuzz

/// Calls a sound of a small Bullet world in the order and with the numbers that the bytes stand
/// for, while its bodies come, go and lose their numbers, beside a thread that pulls samples or
/// not: no sample may be anything but finite, and each share that was posted must have one fate.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  carom::fuzz::keepTables();
  carom::fuzz::FuzzNumbers numbers({data, size});
  carom::fuzz::call(numbers);
  return 0;
}
