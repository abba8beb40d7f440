#include "tests/plugin/pybullet/pybullet_stub.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <utility>

#include <BulletCollision/CollisionShapes/btMultiSphereShape.h>
#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>
#include <btBulletDynamicsCommon.h>
#include <dlfcn.h>

#include "plugin/pybullet/server_abi.h"

// NOLINTBEGIN(*-owning-memory): Bullet's colliders belong to their creator alone

namespace carom::test {
namespace {

using b3::PluginContext;

constexpr double kGravity = 9.81;
constexpr int kServersMagicNumber = 202010061;

btVector3 toBullet(const Vec3& v) {
  return {btScalar(v.x()), btScalar(v.y()), btScalar(v.z())};
}

void copy(const btVector3& from, std::array<double, 3>& to) {
  for (int axis = 0; axis < 3; ++axis)
    to[static_cast<std::size_t>(axis)] = static_cast<double>(from[axis]);
}

/// A rigid or multibody; its collider is in the world.
struct Held {
  ServerStub::Body what;
  std::unique_ptr<btCollisionShape> shape;
  std::unique_ptr<btMultiBody> multi;
  std::unique_ptr<btMultiBodyLinkCollider> collider;
  std::unique_ptr<btRigidBody> rigid;
  std::vector<double> rising;

  int link() const { return collider ? collider->m_link : -1; }
  btVector3 velocity() const {
    if (link() == 0) return {0, 0, multi->getJointVel(0)};
    return multi ? multi->getBaseVel() : rigid->getLinearVelocity();
  }
};

/// A state as the server gives it: position and orientation, velocities.
struct State {
  std::array<double, 7> pose{};
  std::array<double, 6> speeds{};
};

State stateOf(const btVector3& position, const btQuaternion& orientation, const btVector3& velocity,
              const btVector3& turning) {
  State state;
  for (int axis = 0; axis < 3; ++axis) {
    const auto at = static_cast<std::size_t>(axis);
    state.pose[at] = static_cast<double>(position[axis]);
    state.speeds[at] = static_cast<double>(velocity[axis]);
    state.speeds[at + 3] = static_cast<double>(turning[axis]);
  }
  for (int part = 0; part < 4; ++part) {
    const auto at = static_cast<std::size_t>(part);
    state.pose[at + 3] = static_cast<double>(orientation[part]);
  }
  return state;
}

State baseState(const Held& body) {
  if (body.rigid) {
    return stateOf(body.rigid->getWorldTransform().getOrigin(),
                   body.rigid->getWorldTransform().getRotation(), body.rigid->getLinearVelocity(),
                   body.rigid->getAngularVelocity());
  }
  return stateOf(body.multi->getBasePos(), body.multi->getWorldToBaseRot().inverse(),
                 body.multi->getBaseVel(), body.multi->getBaseOmega());
}

/// A world that can say when its solver is about to run.
class World : public btMultiBodyDynamicsWorld {
 public:
  using btMultiBodyDynamicsWorld::btMultiBodyDynamicsWorld;
  std::function<void()> beforeSolver;

 protected:
  void solveConstraints(btContactSolverInfo& info) override {
    if (beforeSolver) beforeSolver();
    btMultiBodyDynamicsWorld::solveConstraints(info);
  }
};

enum class Asked { nothing, parameters, bodies, state, dynamics, bounds, contacts };

using Form = ServerStub::Body::Form;

/// Half the edges of the box around a shape where it stands.
btVector3 halfBounds(const Held& body) {
  btVector3 least;
  btVector3 most;
  const btTransform& pose =
      body.rigid ? body.rigid->getWorldTransform() : body.collider->getWorldTransform();
  body.shape->getAabb(pose, least, most);
  return btScalar(0.5) * (most - least);
}

std::unique_ptr<btCollisionShape> shapeOf(const ServerStub::Body& body) {
  const btVector3 half = toBullet(body.halfEdges);
  switch (body.form) {
    case Form::ball:
      return std::make_unique<btSphereShape>(half.x());
    case Form::box:
      return std::make_unique<btBoxShape>(half);
    case Form::cylinder:
      return std::make_unique<btCylinderShapeZ>(half);
    case Form::capsule:
      return std::make_unique<btCapsuleShapeZ>(half.x(), btScalar(2) * (half.z() - half.x()));
    case Form::hull: {
      auto hull = std::make_unique<btConvexHullShape>();
      for (unsigned corner = 0; corner < 8; ++corner) {
        const btVector3 sides(btScalar(corner & 1U ? 1 : -1), btScalar(corner & 2U ? 1 : -1),
                              btScalar(corner & 4U ? 1 : -1));
        hull->addPoint(half * sides);
      }
      hull->setMargin(btScalar(0.001));
      return hull;
    }
    case Form::ballPair: {
      const btVector3 end(0, 0, half.z() - half.x());
      const std::array<btVector3, 2> centres = {end, -end};
      const std::array<btScalar, 2> radii = {half.x(), half.x()};
      return std::make_unique<btMultiSphereShape>(centres.data(), radii.data(), 2);
    }
    case Form::floor:
      break;
  }
  return std::make_unique<btStaticPlaneShape>(btVector3(0, 0, 1), btScalar(0));
}

/// The server, which is also the client that it hands to plugins: it holds one command and one
/// answer at a time, whose memory the next ones reuse.
class Server final : public ServerStub {
 public:
  Server() {
    world_.setGravity(btVector3(0, 0, btScalar(-kGravity)));
    btContactSolverInfo& solver = world_.getSolverInfo();
    solver.m_erp2 = btScalar(0.08);
    solver.m_frictionERP = btScalar(0.2);
    solver.m_linearSlop = btScalar(0.00001);
    solver.m_numIterations = 50;
    solver.m_minimumSolverBatchSize = 0;
    solver.m_warmstartingFactor = btScalar(0.1);
    solver.m_leastSquaresResidualThreshold = btScalar(1e-7);
    world_.setInternalTickCallback(&Server::afterTick, this, false);
    world_.setInternalTickCallback(&Server::beforeTick, this, true);
  }
  ~Server() override {
    unload();
    while (!bodies_.empty())
      remove(bodies_.begin()->first);
  }

  int add(const Body& body) override;
  void remove(int body) override;
  void reset() override;
  int saveState() override;
  void restoreState(int state) override;
  void place(int body, const Vec3& position) override;
  void throwAt(int body, const Vec3& velocity) override;
  Vec3 positionOf(int body) const override;
  void setTimeStep(double seconds, int substeps) override {
    deltaTime_ = seconds;
    substeps_ = substeps;
  }
  void tellBeforeSolver() override {
    world_.beforeSolver = [this] { call(afterTick_); };
  }
  void tellNothing() override { isSecretive_ = true; }
  int statesAsked() const override { return statesAsked_; }
  void step() override;
  int load(const std::string& path, const std::string& postFix) override;
  Reply execute(const std::string& text) override;
  void unload() override;
  const std::vector<double>& risingSpeeds(int body) const override {
    return bodies_.at(body).rising;
  }

  // Implementation of the exported functions.
  void ask(Asked what, int body = -1, int link = -1) {
    asked_ = what;
    body_ = body;
    link_ = link;
  }
  void submit();
  Asked answered() const { return answered_; }
  b3::SimulationParameters parameters() const;
  int bodyCount() const { return static_cast<int>(synchronized_.size()); }
  int bodyAt(int index) const { return synchronized_.at(static_cast<std::size_t>(index)); }
  const State& base() const { return base_; }
  int linkCount() const { return linkCount_; }
  const State& link() const { return linkState_; }
  const b3::DynamicsInfo& dynamics() const { return dynamics_; }
  const btVector3& bounds() const { return bounds_; }
  b3::ContactInformation contacts() const {
    return {static_cast<int>(contacts_.size()), contacts_.data()};
  }

 private:
  using Call = int (*)(PluginContext*);

  static void beforeTick(btDynamicsWorld* world, btScalar) {
    auto* const server = static_cast<Server*>(world->getWorldUserInfo());
    server->call(server->beforeTick_);
  }
  static void afterTick(btDynamicsWorld* world, btScalar) {
    auto* const server = static_cast<Server*>(world->getWorldUserInfo());
    for (auto& [number, body] : server->bodies_)
      body.rising.push_back(static_cast<double>(body.velocity().z()));
    if (!server->world_.beforeSolver) server->call(server->afterTick_);
  }

  void takeOut(int body);
  static void put(Held& body, const State& state);
  void makeMulti(int number, Held& held, const btVector3& inertia);
  void makeRigid(int number, Held& held, const btVector3& inertia);
  PluginContext context();
  void call(Call function);
  void notify(b3::NotificationType type, int body);
  void addBodyChanges();
  void reportNotifications();
  bool readState();
  bool readDynamics();
  bool readBounds();
  void readContacts();
  int numberOf(const btCollisionObject& object) const;

  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  btMultiBodyConstraintSolver solver_;
  World world_{&dispatcher_, &broadphase_, &solver_, &configuration_};
  std::map<int, Held> bodies_;
  std::vector<std::map<int, State>> saved_;
  double deltaTime_ = 1.0 / 240.0;
  int substeps_ = 0;
  bool isSecretive_ = false;
  int statesAsked_ = 0;

  void* library_ = nullptr;
  std::string path_;
  bool hasUnloaded_ = false;
  void* userPointer_ = nullptr;
  Call beforeTick_ = nullptr;
  Call afterTick_ = nullptr;
  Call notifications_ = nullptr;
  void (*exit_)(PluginContext*) = nullptr;
  int (*execute_)(PluginContext*, const b3::PluginArguments*) = nullptr;
  std::vector<b3::Notification> pending_;

  Asked asked_ = Asked::nothing;
  Asked answered_ = Asked::nothing;
  int body_ = -1;
  int link_ = -1;
  std::vector<int> synchronized_;
  State base_;
  State linkState_;
  // The server's client copies 3840 numbers for each state, whatever they hold; the stub does so
  // too, to cost the same.
  std::array<double, 3840> stateStorage_{};
  std::array<double, 3840> stateCopy_{};
  int linkCount_ = 0;
  b3::DynamicsInfo dynamics_{};
  btVector3 bounds_{0, 0, 0};
  std::vector<b3::ContactPoint> contacts_;
};

int Server::add(const Body& body) {
  int number = 0;
  while (bodies_.contains(number))
    ++number;
  Held& held = bodies_[number];
  held.what = body;
  held.shape = shapeOf(body);
  btVector3 inertia(0, 0, 0);
  if (body.form != Form::floor && body.mass > 0.0)
    held.shape->calculateLocalInertia(btScalar(body.mass), inertia);
  if (body.hasMaximalCoordinates)
    makeRigid(number, held, inertia);
  else
    makeMulti(number, held, inertia);
  notify(b3::kBodyAdded, number);
  reportNotifications();
  return number;
}

std::unique_ptr<btMultiBody> multiBodyOf(const ServerStub::Body& body, const btVector3& inertia) {
  const bool isFixed = body.isFixed || body.isOnSlider || body.mass == 0.0;
  const btScalar baseMass = body.isOnSlider ? 0 : btScalar(body.mass);
  auto multi =
      std::make_unique<btMultiBody>(body.isOnSlider ? 1 : 0, baseMass,
                                    body.isOnSlider ? btVector3(0, 0, 0) : inertia, isFixed, false);
  multi->setLinearDamping(0);
  multi->setAngularDamping(0);
  if (body.isOnSlider) {
    multi->setupPrismatic(0, btScalar(body.mass), inertia, -1, btQuaternion::getIdentity(),
                          btVector3(0, 0, 1), btVector3(0, 0, 0), btVector3(0, 0, 0), true);
  }
  multi->finalizeMultiDof();
  multi->setBasePos(toBullet(body.position));
  multi->setBaseVel(toBullet(body.velocity));
  return multi;
}

// Adds a collider as URDF2Bullet does: a base without mass is flagged static, a fixed base with
// mass is not.
void Server::makeMulti(int number, Held& held, const btVector3& inertia) {
  const Body& body = held.what;
  held.multi = multiBodyOf(body, inertia);
  held.multi->setUserIndex2(number);
  held.collider =
      std::make_unique<btMultiBodyLinkCollider>(held.multi.get(), body.isOnSlider ? 0 : -1);
  held.collider->setCollisionShape(held.shape.get());
  btTransform pose = btTransform::getIdentity();
  pose.setOrigin(toBullet(body.position));
  held.collider->setWorldTransform(pose);
  held.collider->setRestitution(btScalar(body.restitution));
  if (body.mass == 0.0) held.collider->setCollisionFlags(btCollisionObject::CF_STATIC_OBJECT);
  const bool isStatic = body.isFixed || body.mass == 0.0;
  world_.addCollisionObject(
      held.collider.get(),
      isStatic ? btBroadphaseProxy::StaticFilter : btBroadphaseProxy::DefaultFilter,
      isStatic ? btBroadphaseProxy::AllFilter ^ btBroadphaseProxy::StaticFilter
               : btBroadphaseProxy::AllFilter);
  if (body.isOnSlider)
    held.multi->getLink(0).m_collider = held.collider.get();
  else
    held.multi->setBaseCollider(held.collider.get());
  btAlignedObjectArray<btQuaternion> turns;
  btAlignedObjectArray<btVector3> places;
  held.multi->forwardKinematics(turns, places);
  world_.addMultiBody(held.multi.get());
}

void Server::makeRigid(int number, Held& held, const btVector3& inertia) {
  const Body& body = held.what;
  held.rigid = std::make_unique<btRigidBody>(btRigidBody::btRigidBodyConstructionInfo(
      btScalar(body.mass), nullptr, held.shape.get(), inertia));
  btTransform pose = btTransform::getIdentity();
  pose.setOrigin(toBullet(body.position));
  held.rigid->setCenterOfMassTransform(pose);
  held.rigid->setLinearVelocity(toBullet(body.velocity));
  held.rigid->setRestitution(btScalar(body.restitution));
  held.rigid->setUserIndex2(number);
  world_.addRigidBody(held.rigid.get());
}

void Server::remove(int body) {
  takeOut(body);
  notify(b3::kBodyRemoved, body);
  reportNotifications();
}

void Server::takeOut(int body) {
  const auto found = bodies_.find(body);
  if (found->second.multi) {
    world_.removeMultiBody(found->second.multi.get());
    world_.removeCollisionObject(found->second.collider.get());
  } else {
    world_.removeRigidBody(found->second.rigid.get());
  }
  bodies_.erase(found);
}

// The server tells of the reset alone, and of no body.
void Server::reset() {
  while (!bodies_.empty())
    takeOut(bodies_.begin()->first);
  notify(b3::kSimulationReset, 0);
  reportNotifications();
}

int Server::saveState() {
  std::map<int, State>& states = saved_.emplace_back();
  for (const auto& [number, body] : bodies_)
    states[number] = baseState(body);
  return static_cast<int>(saved_.size()) - 1;
}

void Server::restoreState(int state) {
  for (const auto& [number, saved] : saved_.at(static_cast<std::size_t>(state)))
    put(bodies_.at(number), saved);
}

// Puts a body somewhere. Nobody is told, as in the server.
void Server::put(Held& body, const State& state) {
  const auto vector = [](const auto& from, std::size_t at) {
    return btVector3(btScalar(from[at]), btScalar(from[at + 1]), btScalar(from[at + 2]));
  };
  const btTransform pose(btQuaternion(btScalar(state.pose[3]), btScalar(state.pose[4]),
                                      btScalar(state.pose[5]), btScalar(state.pose[6])),
                         vector(state.pose, 0));
  if (body.rigid) {
    body.rigid->setCenterOfMassTransform(pose);
    body.rigid->setLinearVelocity(vector(state.speeds, 0));
    body.rigid->setAngularVelocity(vector(state.speeds, 3));
    return;
  }
  body.multi->setBaseWorldTransform(pose);
  body.multi->setBaseVel(vector(state.speeds, 0));
  body.multi->setBaseOmega(vector(state.speeds, 3));
  body.collider->setWorldTransform(pose);
}

void Server::place(int body, const Vec3& position) {
  State state;
  state.pose = {position.x(), position.y(), position.z(), 0.0, 0.0, 0.0, 1.0};
  put(bodies_.at(body), state);
}

void Server::throwAt(int body, const Vec3& velocity) {
  Held& held = bodies_.at(body);
  State state = baseState(held);
  state.speeds = {velocity.x(), velocity.y(), velocity.z(), 0.0, 0.0, 0.0};
  put(held, state);
}

Vec3 Server::positionOf(int body) const {
  const State state = baseState(bodies_.at(body));
  return {state.pose[0], state.pose[1], state.pose[2]};
}

void Server::step() {
  if (substeps_ > 0)
    world_.stepSimulation(btScalar(deltaTime_), substeps_,
                          btScalar(deltaTime_) / btScalar(substeps_));
  else
    world_.stepSimulation(btScalar(deltaTime_), 0);
  addBodyChanges();
  reportNotifications();
}

// Tells where the colliders are that do not sleep.
void Server::addBodyChanges() {
  if (isSecretive_) return;
  notify(b3::kSimulationStepped, 0);
  for (const auto& [number, body] : bodies_) {
    const btCollisionObject* const collider =
        body.rigid ? static_cast<const btCollisionObject*>(body.rigid.get()) : body.collider.get();
    if (!collider->isActive()) continue;
    notify(b3::kTransformChanged, number);
    if (library_ == nullptr) continue;
    b3::Notification& told = pending_.back();
    told.link = body.link();
    const btTransform& pose = collider->getWorldTransform();
    copy(pose.getOrigin(), told.position);
    const btQuaternion turn = pose.getRotation();
    for (int part = 0; part < 4; ++part)
      told.orientation[static_cast<std::size_t>(part)] = static_cast<double>(turn[part]);
  }
}

PluginContext Server::context() {
  PluginContext context{};
  context.client = reinterpret_cast<b3::Client>(this);
  context.userPointer = userPointer_;
  return context;
}

void Server::call(Call function) {
  if (function == nullptr) return;
  PluginContext now = context();
  function(&now);
  userPointer_ = now.userPointer;
}

void Server::notify(b3::NotificationType type, int body) {
  b3::Notification notification{};
  notification.type = type;
  notification.body = body;
  if (library_ != nullptr) pending_.push_back(notification);
}

void Server::reportNotifications() {
  const std::vector<b3::Notification> told = std::exchange(pending_, {});
  if (told.empty() || notifications_ == nullptr) return;
  PluginContext now = context();
  now.notifications = told.data();
  now.notificationCount = static_cast<int>(told.size());
  notifications_(&now);
}

int Server::load(const std::string& path, const std::string& postFix) {
  if (hasUnloaded_) std::abort();  // the server closes the library of the free slot, which is null
  if (library_ != nullptr) return path == path_ ? 0 : -1;  // it has one, known by its path
  void* const library = dlopen(path.c_str(), RTLD_NOW | RTLD_GLOBAL);
  if (library == nullptr) return -1;
  const auto find = [&](const char* name) { return dlsym(library, (name + postFix).c_str()); };
  const auto init = reinterpret_cast<Call>(find("initPlugin"));
  exit_ = reinterpret_cast<decltype(exit_)>(find("exitPlugin"));
  execute_ = reinterpret_cast<decltype(execute_)>(find("executePluginCommand"));
  userPointer_ = nullptr;
  PluginContext now;  // as in the server, most of it is uninitialized
  std::memset(static_cast<void*>(&now), 0xA5, sizeof(now));
  now.client = reinterpret_cast<b3::Client>(this);
  now.userPointer = nullptr;
  const bool isComplete = init != nullptr && exit_ != nullptr && execute_ != nullptr;
  if (!isComplete || init(&now) != kServersMagicNumber) {
    dlclose(library);
    return -1;
  }
  library_ = library;
  path_ = path;
  userPointer_ = now.userPointer;
  beforeTick_ = reinterpret_cast<Call>(find("preTickPluginCallback"));
  afterTick_ = reinterpret_cast<Call>(find("postTickPluginCallback"));
  notifications_ = reinterpret_cast<Call>(find("processNotifications"));
  return 0;
}

void Server::unload() {
  if (library_ == nullptr) return;
  PluginContext now = context();
  exit_(&now);
  hasUnloaded_ = true;
  dlclose(std::exchange(library_, nullptr));
  beforeTick_ = afterTick_ = notifications_ = nullptr;
  userPointer_ = nullptr;
}

ServerStub::Reply Server::execute(const std::string& text) {
  b3::PluginArguments arguments{};
  text.copy(arguments.text.data(), arguments.text.size() - 1);
  PluginContext now = context();
  Reply reply;
  reply.result = execute_(&now, &arguments);
  userPointer_ = now.userPointer;
  if (now.returnData == nullptr) return reply;
  reply.type = now.returnData->type;
  reply.text.assign(now.returnData->data, static_cast<std::size_t>(now.returnData->length));
  return reply;
}

void Server::submit() {
  answered_ = asked_;
  if (asked_ == Asked::bodies) {
    synchronized_.clear();
    for (const auto& [number, body] : bodies_)
      synchronized_.push_back(number);
  }
  if (asked_ == Asked::contacts) readContacts();
  const bool isDone = (asked_ != Asked::state || readState()) &&
                      (asked_ != Asked::dynamics || readDynamics()) &&
                      (asked_ != Asked::bounds || readBounds());
  if (!isDone) answered_ = Asked::nothing;
}

b3::SimulationParameters Server::parameters() const {
  b3::SimulationParameters parameters{};
  parameters.deltaTime = static_cast<double>(btScalar(deltaTime_));
  parameters.substeps = substeps_;
  parameters.gravity = {0.0, 0.0, static_cast<double>(world_.getGravity().z())};
  parameters.contactErp = static_cast<double>(world_.getSolverInfo().m_erp2);
  parameters.contactSlop = static_cast<double>(world_.getSolverInfo().m_linearSlop);
  parameters.splitImpulse = world_.getSolverInfo().m_splitImpulse;
  parameters.splitImpulseDistance =
      static_cast<double>(world_.getSolverInfo().m_splitImpulsePenetrationThreshold);
  parameters.restitutionSpeed =
      static_cast<double>(world_.getSolverInfo().m_restitutionVelocityThreshold);
  return parameters;
}

bool Server::readState() {
  ++statesAsked_;
  const auto found = bodies_.find(body_);
  if (found == bodies_.end()) return false;
  const Held& body = found->second;
  base_ = baseState(body);
  linkCount_ = body.link() + 1;
  stateStorage_[0] = base_.pose[0];
  stateCopy_ = stateStorage_;
  if (linkCount_ > 0) {
    const btTransform& pose = body.multi->getLink(0).m_cachedWorldTransform;
    linkState_ = stateOf(pose.getOrigin(), pose.getRotation(), body.velocity(), {0, 0, 0});
  }
  return true;
}

bool Server::readDynamics() {
  const auto found = bodies_.find(body_);
  if (found == bodies_.end()) return false;
  const Held& body = found->second;
  if (link_ != body.link()) std::abort();  // the plugin asks for a collider that does not exist
  // Fields that the server does not know for a rigid body keep their old values.
  dynamics_.bodyType = body.multi ? b3::kMultiBody : b3::kRigidBody;
  dynamics_.mass = body.what.mass;
  btVector3 inertia(0, 0, 0);
  int flags = 0;
  if (body.multi) {
    inertia = link_ == 0 ? body.multi->getLinkInertia(0) : body.multi->getBaseInertia();
    flags = body.collider->getCollisionFlags();
    dynamics_.restitution = body.what.restitution;
  } else {
    inertia = body.rigid->getLocalInertia();
    flags = body.rigid->getCollisionFlags();
  }
  copy(inertia, dynamics_.inertia);
  dynamics_.margin = static_cast<double>(body.shape->getMargin());
  dynamics_.dynamicType =
      flags & (btCollisionObject::CF_STATIC_OBJECT | btCollisionObject::CF_KINEMATIC_OBJECT);
  return true;
}

bool Server::readBounds() {
  const auto found = bodies_.find(body_);
  if (found == bodies_.end()) return false;
  bounds_ = halfBounds(found->second);
  return true;
}

int Server::numberOf(const btCollisionObject& object) const {
  if (const auto* const rigid = btRigidBody::upcast(&object)) return rigid->getUserIndex2();
  const auto* const link = btMultiBodyLinkCollider::upcast(&object);
  return link != nullptr ? link->m_multiBody->getUserIndex2() : -1;
}

void Server::readContacts() {
  contacts_.clear();
  for (int index = 0; index < dispatcher_.getNumManifolds(); ++index) {
    const btPersistentManifold& manifold = *dispatcher_.getManifoldByIndexInternal(index);
    for (int point = 0; point < manifold.getNumContacts(); ++point) {
      const btManifoldPoint& found = manifold.getContactPoint(point);
      b3::ContactPoint contact{};
      contact.bodyA = numberOf(*manifold.getBody0());
      contact.bodyB = numberOf(*manifold.getBody1());
      contact.linkA = bodies_.at(contact.bodyA).link();
      contact.linkB = bodies_.at(contact.bodyB).link();
      copy(found.getPositionWorldOnA(), contact.positionOnA);
      copy(found.getPositionWorldOnB(), contact.positionOnB);
      copy(found.m_normalWorldOnB, contact.normalOnB);
      contact.distance = static_cast<double>(found.getDistance());
      contact.normalForce = static_cast<double>(found.getAppliedImpulse()) / deltaTime_;
      contact.frictionForces = {static_cast<double>(found.m_appliedImpulseLateral1) / deltaTime_,
                                static_cast<double>(found.m_appliedImpulseLateral2) / deltaTime_};
      copy(found.m_lateralFrictionDir1, contact.frictionDirection);
      copy(found.m_lateralFrictionDir2, contact.secondFrictionDirection);
      contacts_.push_back(contact);
    }
  }
}

Server& serverOf(const void* client) {
  return *static_cast<Server*>(const_cast<void*>(client));
}

void* asked(void* client, Asked what, int body = -1, int link = -1) {
  serverOf(client).ask(what, body, link);
  return client;
}

bool answers(const void* answer, Asked what) {
  return answer != nullptr && serverOf(answer).answered() == what;
}

}  // namespace
}  // namespace carom::test

// NOLINTEND(*-owning-memory)

#define CAROM_EXPORT extern "C" __attribute__((visibility("default")))

using carom::test::answers;
using carom::test::Asked;
using carom::test::asked;
using carom::test::serverOf;
namespace b3 = carom::b3;

CAROM_EXPORT carom::test::ServerStub* makeServerStub() {
  return std::make_unique<carom::test::Server>().release();
}

// The stub for programs in other languages: see stub_client.py.

namespace {

carom::Vec3 vectorAt(const double* values) {
  return {values[0], values[1], values[2]};
}

/// The latest answer to a command, of any server.
carom::test::ServerStub::Reply& latestReply() {
  static carom::test::ServerStub::Reply reply;
  return reply;
}

}  // namespace

CAROM_EXPORT void destroyServerStub(carom::test::ServerStub* server) {
  const std::unique_ptr<carom::test::ServerStub> ended(server);
}
CAROM_EXPORT int stubAdd(carom::test::ServerStub* server, int form, const double* numbers,
                         int isRigid) {
  return server->add({.form = static_cast<carom::test::ServerStub::Body::Form>(form),
                      .halfEdges = vectorAt(numbers),
                      .mass = numbers[3],
                      .position = vectorAt(numbers + 4),
                      .velocity = vectorAt(numbers + 7),
                      .restitution = numbers[10],
                      .hasMaximalCoordinates = isRigid != 0});
}
CAROM_EXPORT void stubRemove(carom::test::ServerStub* server, int body) {
  server->remove(body);
}
CAROM_EXPORT void stubReset(carom::test::ServerStub* server) {
  server->reset();
}
CAROM_EXPORT int stubSaveState(carom::test::ServerStub* server) {
  return server->saveState();
}
CAROM_EXPORT void stubRestoreState(carom::test::ServerStub* server, int state) {
  server->restoreState(state);
}
CAROM_EXPORT void stubPlace(carom::test::ServerStub* server, int body, const double* position) {
  server->place(body, vectorAt(position));
}
CAROM_EXPORT void stubThrow(carom::test::ServerStub* server, int body, const double* velocity) {
  server->throwAt(body, vectorAt(velocity));
}
CAROM_EXPORT void stubPosition(carom::test::ServerStub* server, int body, double* position) {
  const carom::Vec3 at = server->positionOf(body);
  std::copy_n(at.data(), 3, position);
}
CAROM_EXPORT void stubSetTimeStep(carom::test::ServerStub* server, double seconds, int substeps) {
  server->setTimeStep(seconds, substeps);
}
CAROM_EXPORT void stubTellNothing(carom::test::ServerStub* server) {
  server->tellNothing();
}
CAROM_EXPORT int stubStatesAsked(carom::test::ServerStub* server) {
  return server->statesAsked();
}
CAROM_EXPORT void stubStep(carom::test::ServerStub* server) {
  server->step();
}
CAROM_EXPORT int stubLoad(carom::test::ServerStub* server, const char* path, const char* postFix) {
  return server->load(path, postFix);
}
CAROM_EXPORT void stubUnload(carom::test::ServerStub* server) {
  server->unload();
}
CAROM_EXPORT int stubExecute(carom::test::ServerStub* server, const char* text) {
  latestReply() = server->execute(text);
  return latestReply().result;
}
CAROM_EXPORT int stubReplyLength() {
  return static_cast<int>(latestReply().text.size());
}
CAROM_EXPORT void stubReplyText(char* to) {
  latestReply().text.copy(to, latestReply().text.size());
}

// Clients, commands and answers are all the server itself here.
CAROM_EXPORT void* b3SubmitClientCommandAndWaitStatus(void* client, void*) {
  serverOf(client).submit();
  return client;
}

CAROM_EXPORT void* b3InitRequestPhysicsParamCommand(void* client) {
  return asked(client, Asked::parameters);
}
CAROM_EXPORT int b3GetStatusPhysicsSimulationParameters(void* answer,
                                                        b3::SimulationParameters* parameters) {
  if (!answers(answer, Asked::parameters)) return 0;
  *parameters = serverOf(answer).parameters();
  return 1;
}

CAROM_EXPORT void* b3InitSyncBodyInfoCommand(void* client) {
  return asked(client, Asked::bodies);
}
CAROM_EXPORT int b3GetNumBodies(void* client) {
  return serverOf(client).bodyCount();
}
CAROM_EXPORT int b3GetBodyUniqueId(void* client, int index) {
  return serverOf(client).bodyAt(index);
}

CAROM_EXPORT void* b3RequestActualStateCommandInit(void* client, int body) {
  return asked(client, Asked::state, body);
}
CAROM_EXPORT int b3RequestActualStateCommandComputeLinkVelocity(void*, int) {
  return 0;
}
CAROM_EXPORT int b3GetStatusActualState(void* answer, int*, int*, int*, const double**,
                                        const double** position, const double** velocity,
                                        const double**) {
  if (!answers(answer, Asked::state)) return 0;
  *position = serverOf(answer).base().pose.data();
  *velocity = serverOf(answer).base().speeds.data();
  return 1;
}
CAROM_EXPORT int b3GetStatusActualState2(void* answer, int*, int* links, int*, int*, const double**,
                                         const double**, const double**, const double**,
                                         const double**, const double**, const double**,
                                         const double**) {
  *links = serverOf(answer).linkCount();
  return 1;
}
CAROM_EXPORT int b3GetLinkState(void*, void* answer, int, b3::LinkState* state) {
  const auto& [pose, speeds] = serverOf(answer).link();
  std::copy_n(pose.begin(), 3, state->position.begin());
  std::copy_n(pose.begin() + 3, 4, state->orientation.begin());
  std::copy_n(speeds.begin(), 3, state->velocity.begin());
  std::copy_n(speeds.begin() + 3, 3, state->angularVelocity.begin());
  return 1;
}

CAROM_EXPORT void* b3GetDynamicsInfoCommandInit(void* client, int body, int link) {
  return asked(client, Asked::dynamics, body, link);
}
CAROM_EXPORT int b3GetDynamicsInfo(void* answer, b3::DynamicsInfo* info) {
  if (!answers(answer, Asked::dynamics)) return 0;
  *info = serverOf(answer).dynamics();
  return 1;
}

CAROM_EXPORT void* b3RequestCollisionInfoCommandInit(void* client, int body) {
  return asked(client, Asked::bounds, body);
}
CAROM_EXPORT int b3GetStatusAABB(void* answer, int, double* least, double* most) {
  if (!answers(answer, Asked::bounds)) return 0;
  const btVector3& half = serverOf(answer).bounds();
  for (int axis = 0; axis < 3; ++axis) {
    most[axis] = static_cast<double>(half[axis]);
    least[axis] = -most[axis];
  }
  return 1;
}

// The server takes a set of spheres for a capsule, and reads beyond its end: nobody may ask.
CAROM_EXPORT void* b3InitRequestCollisionShapeInformation(void*, int, int) {
  std::abort();
}

CAROM_EXPORT void* b3InitRequestContactPointInformation(void* client) {
  return asked(client, Asked::contacts);
}
CAROM_EXPORT void b3GetContactPointInformation(void* client, b3::ContactInformation* contacts) {
  *contacts = serverOf(client).contacts();
}
