// listen_host KIND END [WORLDS]: a program with worlds of Bullet that knows nothing of Carom. Two
// bodies fall onto the ground. KIND is the class of the worlds, END how the program ends.
//
// Compiled with CAROM_ATTACHED it is the same program with a sound in its source, which records
// into attached.wav: what `carom listen` has to equal.

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolverMt.h>
#include <BulletDynamics/Dynamics/btDiscreteDynamicsWorldMt.h>
#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>
#include <BulletSoftBody/btDeformableBodySolver.h>
#include <BulletSoftBody/btDeformableMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <LinearMath/btThreads.h>
#include <btBulletDynamicsCommon.h>
#include <sys/wait.h>
#include <unistd.h>

#ifdef CAROM_ATTACHED
#include <carom/sound.h>
#endif

namespace {

constexpr int kFrames = 60;
constexpr int kExitCode = 3;

/// A world with its parts, and bodies that fall.
class FallWorld {
 public:
  explicit FallWorld(const std::string& kind) {
    make(kind);
    if (world_ == nullptr) return;
    world_->setGravity(btVector3(0, -10, 0));
    add(0, groundShape_, btVector3(0, btScalar(-0.5), 0));
    add(1, boxShape_, btVector3(btScalar(0.5), btScalar(0.6), 0));
    if (auto* const multibodies = dynamic_cast<btMultiBodyDynamicsWorld*>(world_.get()))
      addMultibody(*multibodies);
    else
      add(1, ballShape_, btVector3(btScalar(-0.5), btScalar(0.8), 0));
  }
  FallWorld(const FallWorld&) = delete;
  FallWorld& operator=(const FallWorld&) = delete;
  ~FallWorld() {
    if (world_ == nullptr) return;
    for (const auto& body : bodies_)
      world_->removeRigidBody(body.get());
    if (collider_ == nullptr) return;
    world_->removeCollisionObject(collider_.get());
    static_cast<btMultiBodyDynamicsWorld&>(*world_).removeMultiBody(multibody_.get());
  }

  bool isMade() const { return world_ != nullptr; }
  btDynamicsWorld& world() { return *world_; }

  void step(int frames = kFrames) {
    for (int frame = 0; frame < frames; ++frame)
      world_->stepSimulation(btScalar(1.0 / 60.0), 10);
  }

 private:
  void make(const std::string& kind) {
    if (kind == "discrete") {
      use<btSequentialImpulseConstraintSolver>();
      world_.reset(new btDiscreteDynamicsWorld(&dispatcher_, &broadphase_, solver_.get(), &parts_));
    } else if (kind == "mt") {
      btSetTaskScheduler(btGetSequentialTaskScheduler());
      use<btSequentialImpulseConstraintSolverMt>();
      pool_ = std::make_unique<btConstraintSolverPoolMt>(1);
      world_.reset(new btDiscreteDynamicsWorldMt(&dispatcher_, &broadphase_, pool_.get(),
                                                 solver_.get(), &parts_));
    } else if (kind == "multibody") {
      world_.reset(new btMultiBodyDynamicsWorld(&dispatcher_, &broadphase_,
                                                use<btMultiBodyConstraintSolver>(), &parts_));
    } else if (kind == "soft") {
      use<btSequentialImpulseConstraintSolver>();
      world_.reset(
          new btSoftRigidDynamicsWorld(&dispatcher_, &broadphase_, solver_.get(), &parts_));
    } else if (kind == "soft_multibody") {
      world_.reset(new btSoftMultiBodyDynamicsWorld(&dispatcher_, &broadphase_,
                                                    use<btMultiBodyConstraintSolver>(), &parts_));
    } else if (kind == "deformable") {
      deformable_ = std::make_unique<btDeformableBodySolver>();
      auto* const solver = use<btDeformableMultiBodyConstraintSolver>();
      solver->setDeformableSolver(deformable_.get());
      world_.reset(new btDeformableMultiBodyDynamicsWorld(&dispatcher_, &broadphase_, solver,
                                                          &parts_, deformable_.get()));
    }
  }

  template <class Solver>
  Solver* use() {
    auto made = std::make_unique<Solver>();
    Solver* const solver = made.get();
    solver_ = std::move(made);
    return solver;
  }

  void add(btScalar mass, btCollisionShape& shape, const btVector3& place) {
    btVector3 inertia(0, 0, 0);
    if (mass > 0) shape.calculateLocalInertia(mass, inertia);
    bodies_.push_back(std::make_unique<btRigidBody>(mass, nullptr, &shape, inertia));
    bodies_.back()->setWorldTransform(btTransform(btQuaternion::getIdentity(), place));
    bodies_.back()->setRestitution(btScalar(0.5));
    world_->addRigidBody(bodies_.back().get());
  }

  /// A ball that is the base of a multibody.
  void addMultibody(btMultiBodyDynamicsWorld& world) {
    btVector3 inertia(0, 0, 0);
    ballShape_.calculateLocalInertia(1, inertia);
    multibody_ = std::make_unique<btMultiBody>(0, 1, inertia, false, false);
    multibody_->setBasePos(btVector3(btScalar(-0.5), btScalar(0.8), 0));
    multibody_->finalizeMultiDof();
    world.addMultiBody(multibody_.get());
    collider_ = std::make_unique<btMultiBodyLinkCollider>(multibody_.get(), -1);
    collider_->setCollisionShape(&ballShape_);
    collider_->setWorldTransform(
        btTransform(btQuaternion::getIdentity(), multibody_->getBasePos()));
    collider_->setRestitution(btScalar(0.5));
    world.addCollisionObject(collider_.get());
    multibody_->setBaseCollider(collider_.get());
  }

  btSoftBodyRigidBodyCollisionConfiguration parts_;
  btCollisionDispatcher dispatcher_{&parts_};
  btDbvtBroadphase broadphase_;
  std::unique_ptr<btConstraintSolver> solver_;
  std::unique_ptr<btConstraintSolverPoolMt> pool_;
  std::unique_ptr<btDeformableBodySolver> deformable_;
  btBoxShape groundShape_{btVector3(5, btScalar(0.5), 5)};
  btBoxShape boxShape_{btVector3(btScalar(0.05), btScalar(0.1), btScalar(0.07))};
  btSphereShape ballShape_{btScalar(0.1)};
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
  std::unique_ptr<btMultiBody> multibody_;
  std::unique_ptr<btMultiBodyLinkCollider> collider_;
  std::unique_ptr<btDiscreteDynamicsWorld> world_;
};

/// Sounds of the program itself, if it has any.
class OwnSound {
 public:
#ifdef CAROM_ATTACHED
  explicit OwnSound(FallWorld& fall)
      : sound_(carom::Sound::attach(fall.world(), {.record = "attached.wav"})) {}
  ~OwnSound() {
    if (!sound_ || !sound_->close()) std::abort();
  }

 private:
  carom::Result<carom::Sound> sound_;
#else
  explicit OwnSound(FallWorld& /*fall*/) {}
#endif
};

/// The ends of a program that has stepped a world and does not destroy it.
int leave(const std::string& end, FallWorld& fall) {
  if (end == "exit") std::exit(kExitCode);
  if (end == "_exit") _exit(kExitCode);
  if (end == "kill") std::raise(SIGKILL);
  if (end ==
      "scrub") {  // the memory of the world goes without a destructor, as that of arenas does
    std::memset(static_cast<void*>(&fall.world()), 0x5A, sizeof(btDiscreteDynamicsWorld));
    std::exit(kExitCode);
  }
  if (end == "fork") {  // the fork goes on with its copy of the world, and ends by exit
    const pid_t fork = ::fork();
    if (fork == 0) {
      fall.step(2);
      std::exit(kExitCode);
    }
    int status = 0;
    waitpid(fork, &status, 0);
    fall.step();
    std::exit(WEXITSTATUS(status));
  }
  if (end == "thread") {  // another thread still steps at the exit
    static std::thread& stepping = *new std::thread([&fall] {
      for (;;)
        fall.step(1);
    });
    stepping.detach();
    std::exit(kExitCode);
  }
  std::fprintf(stderr, "listen_host: end '%s' is unknown\n", end.c_str());
  return 2;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) return 2;
  const std::string kind = argv[1];
  const std::string end = argv[2];
  const int count = argc > 3 ? std::atoi(argv[3]) : 1;
  for (int world = 0; world < count; ++world) {
    auto fall = std::make_unique<FallWorld>(kind);
    if (!fall->isMade()) return 2;
    {
      const OwnSound own(*fall);
      fall->step();
    }
    if (end != "destroy") return leave(end, *fall.release());
  }
  std::puts("done");
  return 0;
}
