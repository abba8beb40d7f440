// A jointed mannequin and a dumbbell fall down stairs: constraints, a compound body, materials by
// body, by shape and by user index, a listener that follows. Writes ragdoll.wav, three seconds.

#include <cstdio>
#include <memory>
#include <vector>

#include <btBulletDynamicsCommon.h>
#include <carom/sound.h>

namespace {

constexpr int kStairs = 7;  // user index of every step
constexpr btScalar kStepHeight = btScalar(0.18);
constexpr btScalar kStepDepth = btScalar(0.28);

btTransform at(btScalar x, btScalar y, btScalar z = 0) {
  return btTransform(btQuaternion::getIdentity(), btVector3(x, y, z));
}

// Owns what Bullet's world only points to. Bodies outlive the world, which is the last member.
struct Scene {
  std::vector<std::unique_ptr<btRigidBody>> bodies;
  std::vector<std::unique_ptr<btTypedConstraint>> joints;
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world{&dispatcher, &broadphase, &solver, &configuration};

  btRigidBody& add(btCollisionShape& shape, btScalar mass, const btTransform& pose) {
    btVector3 inertia(0, 0, 0);
    if (mass > 0) shape.calculateLocalInertia(mass, inertia);
    bodies.push_back(std::make_unique<btRigidBody>(mass, nullptr, &shape, inertia));
    bodies.back()->setWorldTransform(pose);
    bodies.back()->setRestitution(btScalar(0.6));
    world.addRigidBody(bodies.back().get());
    return *bodies.back();
  }

  // A limb hangs from `body` at a place in the world, and swings and twists within half a radian
  // or so.
  void join(btRigidBody& body, btRigidBody& limb, const btVector3& place) {
    const btTransform pivot(btQuaternion(btVector3(0, 0, 1), SIMD_HALF_PI), place);  // x along it
    auto joint = std::make_unique<btConeTwistConstraint>(
        body, limb, body.getWorldTransform().inverse() * pivot,
        limb.getWorldTransform().inverse() * pivot);
    joint->setLimit(btScalar(0.7), btScalar(0.7), btScalar(0.4));
    world.addConstraint(joint.get(), true);
    joints.push_back(std::move(joint));
  }
};

struct Shapes {
  btBoxShape step{btVector3(kStepDepth / 2, kStepHeight / 2, 1)};
  btCapsuleShape torso{btScalar(0.09), btScalar(0.28)};
  btSphereShape head{btScalar(0.08)};
  btCapsuleShape limb{btScalar(0.035), btScalar(0.22)};
  btSphereShape weight{btScalar(0.05)};
  btCapsuleShape bar{btScalar(0.012), btScalar(0.2)};
  btCompoundShape dumbbell;

  Shapes() {
    dumbbell.addChildShape(at(0, btScalar(-0.12)), &weight);
    dumbbell.addChildShape(at(0, btScalar(0.12)), &weight);
    dumbbell.addChildShape(at(0, 0), &bar);
  }
};

void buildStairs(Scene& scene, Shapes& shapes) {
  for (int step = 0; step < 12; ++step) {
    const auto down = btScalar(step);
    scene.add(shapes.step, 0, at(down * kStepDepth, -down * kStepHeight)).setUserIndex(kStairs);
  }
}

// Returns the torso of the mannequin, at `x` and `y`: the rest hangs from it.
btRigidBody& buildMannequin(Scene& scene, Shapes& shapes, btScalar x, btScalar y) {
  btRigidBody& torso = scene.add(shapes.torso, 4, at(x, y));
  const btScalar neck = y + btScalar(0.24);
  scene.join(torso, scene.add(shapes.head, 1, at(x, neck + btScalar(0.08))), {x, neck, 0});
  for (const btScalar side : {btScalar(-0.14), btScalar(0.14)}) {
    for (const btScalar top : {y + btScalar(0.15), y - btScalar(0.2)}) {  // an arm, a leg
      btRigidBody& upper = scene.add(shapes.limb, 1, at(x, top - btScalar(0.11), side));
      btRigidBody& lower = scene.add(shapes.limb, 1, at(x, top - btScalar(0.41), side));
      scene.join(torso, upper, {x, top + btScalar(0.03), side});
      scene.join(upper, lower, {x, top - btScalar(0.26), side});
    }
  }
  return torso;
}

carom::Status assignMaterials(carom::Sound& sound, const Shapes& shapes,
                              const btRigidBody& dumbbell) {
  carom::Status set = sound.assign(carom::UserIndex{kStairs}, {.material = "concrete"});
  if (set) set = sound.assign(shapes.limb, {.material = "wood"});  // all eight limbs
  if (set) set = sound.assign(shapes.torso, {.material = "plastic"});
  if (set) set = sound.assign(dumbbell, {.material = "steel"});
  return set;
}

int run() {
  Shapes shapes;
  Scene scene;
  buildStairs(scene, shapes);
  btRigidBody& torso = buildMannequin(scene, shapes, btScalar(0.1), btScalar(1.2));
  torso.setLinearVelocity(btVector3(2, 0, 0));
  const btRigidBody& dumbbell = scene.add(shapes.dumbbell, 8, at(btScalar(0.5), btScalar(1.4)));

  carom::SoundSettings settings;
  settings.record = "ragdoll.wav";
  carom::Result<carom::Sound> sound = carom::Sound::attach(scene.world, settings);
  carom::Status status = sound ? assignMaterials(*sound, shapes, dumbbell) : sound.error();
  for (int frame = 0; status && frame < 180; ++frame) {
    scene.world.stepSimulation(btScalar(1.0 / 60.0), 4, btScalar(1.0 / 240.0));
    const btVector3& place = torso.getWorldTransform().getOrigin();
    status = sound->setListener({place.x(), place.y() + 0.5, 2.0});  // m
  }
  const carom::SoundStatistics heard = status ? sound->statistics() : carom::SoundStatistics();
  if (status) status = sound->close();
  if (!status) {
    std::fprintf(stderr, "ragdoll: %s\n", status.error().message.c_str());
    return 1;
  }
  std::printf("ragdoll.wav: %llu clicks, %llu shapes solved\n",
              static_cast<unsigned long long>(heard.events),
              static_cast<unsigned long long>(heard.solvedShapes));
  return 0;
}

}  // namespace

int main() {
  return run();
}
