#include "tests/plugin/c_api_support.h"

#include <atomic>
#include <cstdlib>
#include <limits>
#include <memory>
#include <new>
#include <span>

#include <btBulletDynamicsCommon.h>

#include "carom/audio/impulse_event.h"
#include "carom/audio/listener.h"
#include "carom/audio/material.h"
#include "carom/audio/modal_model_file.h"
#include "carom/audio/synth.h"
#include "tests/audio/ringing_box.h"

namespace {

std::atomic<long> piecesLeft{-1};

void* allocate(std::size_t size) noexcept {
  if (piecesLeft.load() >= 0 && piecesLeft.fetch_sub(1) == 0) return nullptr;
  return std::malloc(size > 0 ? size : 1);  // NOLINT: this is operator new
}

carom::ImpulseEvent strike() {
  const double impulse = (1.0 + STRIKE_RESTITUTION) * STRIKE_MASS * STRIKE_SPEED;
  carom::ImpulseEvent event;
  event.time = STRIKE_TIME;
  event.body = 3;
  event.other = 4;
  event.impulse = {0.0, impulse, 0.0};
  event.position = {0.0, -STRIKE_RADIUS, 0.0};
  event.normal = carom::Vec3::UnitY();
  event.approachSpeed = STRIKE_SPEED;
  event.effectiveMass = STRIKE_MASS;
  event.radius = STRIKE_RADIUS;
  event.otherRadius = std::numeric_limits<double>::infinity();
  event.bodyVelocity = {0.0, -STRIKE_SPEED, 0.0};
  return event;
}

}  // namespace

void* operator new(std::size_t size) {
  void* const memory = allocate(size);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}
// A sanitizer's own form would take memory elsewhere, which the forms below may not give back.
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  return allocate(size);
}
void operator delete(void* memory) noexcept {
  std::free(memory);  // NOLINT: as above
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);  // NOLINT: as above
}

void support_set_audio_driver(const char* name) {
  setenv("SDL_AUDIODRIVER", name, 1);  // NOLINT(concurrency-mt-unsafe): there is one thread
}

void support_fail_after(long pieces) {
  piecesLeft = pieces;
}

void support_render_strike(float* samples, std::size_t frames) {
  carom::Listener microphone;
  microphone.position = {0.0, STRIKE_HEIGHT, 0.0};
  auto synth = carom::Synth::create({}, {microphone});
  if (!synth) std::abort();
  const bool known = synth->setBody(3, {.material = *carom::findMaterial("steel"),
                                        .mass = STRIKE_MASS,
                                        .radius = STRIKE_RADIUS}) &&
                     synth->setBody(4, {.material = *carom::findMaterial("wood")});
  if (!known) std::abort();
  synth->schedule(strike());
  float* const channel = samples;
  synth->render<float>(std::span<float* const>(&channel, 1), frames);
}

void support_write_modes(const char* path, double frequency, double decay_rate) {
  const auto model = carom::test::boxOf(
      {{.frequency = frequency, .decayRate = decay_rate, .volume = 0.2}}, carom::Vec3::UnitY());
  if (!carom::writeModalModel(path, *model)) std::abort();
}

struct support_world {
  support_world() {
    bullet.setGravity(btVector3(0, btScalar(-9.81), 0));
    ball.setWorldTransform(
        btTransform(btQuaternion::getIdentity(), btVector3(0, btScalar(0.21), 0)));
    ball.setRestitution(btScalar(0.8));
    floor.setRestitution(1);
    ball.setUserIndex(7);
    bullet.addRigidBody(&floor);
    bullet.addRigidBody(&ball);
  }

  btStaticPlaneShape floorShape{btVector3(0, 1, 0), 0};
  btSphereShape ballShape{btScalar(0.01)};
  btRigidBody floor{0, nullptr, &floorShape};
  btRigidBody ball{btScalar(STRIKE_MASS), nullptr, &ballShape};
  btRigidBody absent{btScalar(STRIKE_MASS), nullptr, &ballShape};
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld bullet{&dispatcher, &broadphase, &solver, &configuration};
};

support_world* support_world_make() {
  return std::make_unique<support_world>().release();
}
void support_world_free(support_world* world) {
  const std::unique_ptr<support_world> owner(world);
}
btDynamicsWorld* support_world_bullet(support_world* world) {
  return &world->bullet;
}
const btCollisionObject* support_world_ball(support_world* world) {
  return &world->ball;
}
const btCollisionShape* support_world_shape(support_world* world) {
  return &world->ballShape;
}
const btCollisionObject* support_world_absent(support_world* world) {
  return &world->absent;
}
void support_world_step(support_world* world, double seconds) {
  world->bullet.stepSimulation(static_cast<btScalar>(seconds), 1000, btScalar(1.0 / 240.0));
}
