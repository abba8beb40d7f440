#include "plugin/bullet/world_session.h"

#include <algorithm>
#include <cmath>
#include <unordered_set>
#include <utility>

#include <btBulletDynamicsCommon.h>

#include "audio/contact/contact_drive.h"
#include "bullet_bridge/bodies/object_identity.h"
#include "bullet_bridge/geometry/to_vec3.h"
#include "plugin/bullet/assigned_sound.h"
#include "plugin/bullet/first_blow.h"
#include "plugin/bullet/world_survey.h"
#include "plugin/bullet/world_units.h"

namespace carom::plugin {

using namespace bullet;

namespace {

/// Removed bodies are looked for when this many more bodies are known than twice those in the
/// world.
constexpr std::size_t kForgotten = 64;
/// Substeps after which no event of a body that has left the world comes any more.
constexpr int kEventsLater = 4;
/// Bodies whose landing is predicted, at most.
constexpr std::size_t kPredictedBodies = 16;

bool isIn(const btDynamicsWorld& world, const btCollisionObject& object) {
  const auto& objects = world.getCollisionObjectArray();
  const int index = object.getWorldArrayIndex();
  return index >= 0 && index < objects.size() && objects[index] == &object;
}

}  // namespace

Status WorldSession::attach() {
  const double metres = metresPerUnit();
  if (!(metres > 0.0) || !std::isfinite(metres) || !std::isfinite(1.0 / metres))
    return Error{"sound: metresPerUnit is " + std::to_string(metres) +
                 "; expected the length of the world's unit (m), above 0"};
  BulletBridgeSettings wanted;
  wanted.restSpeed = worldSettings_.restSpeed / metres;
  wanted.stillSpeed = audio::ContactDrive::kSlowest / metres;
  wanted.search = ImpactSearch::contacts;
  wanted.onSubstep = [this] { postSubstep(); };
  if (settings.synth.impulse == ImpulseChoice::physical) wanted.delivery = EventDelivery::prompt;
  Result<BulletBridge> bridge = BulletBridge::attach(world_, wanted);
  if (!bridge) return bridge.error();
  bridge_ = *std::move(bridge);
  readBodies();
  placeListener();
  return std::monostate{};
}

/// Places the automatic listener, where there is one, and predicts the first blow there.
void WorldSession::placeListener() {
  if (!hasAutomaticListener) return;
  const std::optional<ListenerPose> pose = listener_.update(world_, bridge_->time(), isQuiet_);
  if (!pose) return;
  setPose(0, pose->position, pose->orientation);
  if (isQuiet_) predictFirstBlow(*pose);
}

/// Predicts the loudest landing of the heaviest bodies.
void WorldSession::predictFirstBlow(const ListenerPose& listener) {
  std::vector<FallingBody> falling;
  for (const btCollisionObject* object : heaviestBodies(world_, kPredictedBodies)) {
    const Result<BodyId> id = bridge_->bodyId(*object);
    const auto body = id ? bodies.find(*id) : bodies.end();
    if (body == bodies.end()) continue;
    const double speed = speedOfLanding(world_, *object, metresPerUnit());
    const Vec3 place = metresPerUnit() * toVec3(object->getWorldTransform().getOrigin());
    if (speed > 0.0) falling.push_back({body->second, place, speed});
  }
  if (falling.empty()) return;
  predict(peakOfFirstBlow(settings, listener, upOf(world_), falling));
}

/// Posts the bridge's events and contacts at the end of a substep.
void WorldSession::postSubstep() {
  const auto kept = shared_from_this();  // the host's function may end the sound
  placeListener();
  readColliding();
  postEvents();
  postContacts();
  bridge_->clear();
  moveRinging();
  tellPoses();
  advanceTo(bridge_->time(), bridge_->settledTime());
  forgetRemoved();
  takeShapes();
  tellNoted();
}

/// True if what is heard must not depend on when a thread has solved a shape.
bool WorldSession::isRepeatable() const {
  return recorder || capturer || runWriter || settings.clock == SoundClock::simulation;
}

/// Has a body that is about to sound get its shape: now where that has to be, or soon.
void WorldSession::awaitShape(BodyId id) {
  if (!isPending(id)) return;
  KnownBody& known = known_[id];
  if (!isRepeatable()) {
    if (!std::exchange(known.isHastened, true)) reader_.solver().hasten(*known.pending);
    return;
  }
  if (reader_.solver().finish(*known.pending)) ++solvedInStep_;
  giveShape(id, known);
}

/// Gives bodies the shapes that the thread has solved.
void WorldSession::takeShapes() {
  const ShapeSolver& solver = reader_.solver();
  reader_.solver().takeSolved();
  if (isRepeatable() || solver.known() == givenShapes_) return;
  givenShapes_ = solver.known();
  for (auto& [id, known] : known_)
    if (known.pending) giveShape(id, known);
}

void WorldSession::giveShape(BodyId id, KnownBody& known) {
  const ShapeSolver& solver = reader_.solver();
  const auto* const radiator = solver.solution(*known.pending);
  const auto* const recoil = solver.recoil(*known.pending);
  if (radiator == nullptr) return;
  if (solver.isComplete(*known.pending)) {
    known.pending.reset();
    isPending_[id] = false;
  }
  if (recoil != nullptr && !*recoil)
    say("sound: the recoil of a shape cannot be solved, its bodies click as spheres of equal "
        "dipole: " +
        recoil->error().message);
  const auto found = bodies.find(id);
  if (!*radiator) {
    known.isUnsolved = true;
    unsolvedReason_ = radiator->error().message;
  } else if (found != bodies.end()) {
    SoundBody body = found->second;
    const bool isRecoilNew = recoil != nullptr && *recoil && body.recoil == nullptr;
    if (body.shape != nullptr && !isRecoilNew) return;
    body.shape = **radiator;
    body.inverseInertia = known.inverseInertia;
    if (isRecoilNew) body.recoil = **recoil;
    take(id, known, body);
  }
}

void WorldSession::finishShapes() {
  reader_.solver().finishAll();
  for (auto& [id, known] : known_)
    if (known.pending) giveShape(id, known);
}

void WorldSession::postEvents() {
  bool isFirst = false;  // of the two shares of a collision, which come one after the other
  for (const ImpulseEvent& reported : bridge_->events()) {
    const ImpulseEvent event = inMetres(reported, metresPerUnit());
    isQuiet_ = false;
    isFirst = !isFirst;
    if (!isRead(event.body) || !isRead(event.other)) readNew();
    readChanged(event.body);
    readChanged(event.other);
    if (isSilent(event.body) || isSilent(event.other)) {
      ++silenced_;
    } else {
      awaitShape(event.body);
      awaitShape(event.other);
      post(event);
      if (onCollision_) note(event, isFirst);
    }
  }
}

void WorldSession::onCollision(std::function<void(const SoundCollision&)> function) {
  onCollision_ = nullptr;
  if (!function) return;
  listen();
  onCollision_ =
      std::make_shared<const std::function<void(const SoundCollision&)>>(std::move(function));
}

/// Notes a share for `report`: the first one of a collision, or the other one of the latest.
void WorldSession::note(const ImpulseEvent& share, bool isFirst) {
  if (isFirst) {
    const bool isApplied =
        settings.synth.impulse == ImpulseChoice::applied && share.hasAppliedImpulse;
    reports_.push_back(
        {.collision = {.time = share.time,
                       .position = share.position,
                       .normal = share.normal,
                       .impulse = (isApplied ? share.appliedImpulse : share.impulse).norm(),
                       .approachSpeed = share.approachSpeed},
         .body = share.body,
         .other = share.other,
         .peaks = std::vector<double>(settings.listeners.size())});
  }
  if (bounds && !reports_.empty()) bounds->add(share, reports_.back().peaks);
}

/// Tells the host of the collisions that were noted, until it ends the sound.
void WorldSession::tellNoted() {
  if (std::exchange(isReporting_, true)) return;
  std::vector<Report> noted = std::exchange(reports_, {});
  for (Report& collision : noted) {
    if (!bridge_ || !onCollision_) break;
    tell(collision);
  }
  isReporting_ = false;
}

void WorldSession::tell(Report& report) {
  constexpr double kHearing = 2e-5;  // Pa, 0 dB
  std::vector<HeardCollision> heard;
  SoundCollision& collision = report.collision;
  for (const double peak : report.peaks) {
    heard.push_back({peak, 20.0 * std::log10(peak / kHearing)});
    collision.peak = std::max(collision.peak, peak);
  }
  collision.heard = heard;
  collision.body = bridge_->bodyOf(report.body);
  collision.other = bridge_->bodyOf(report.other);
  const auto function = onCollision_;
  (*function)(collision);
}

void WorldSession::postContacts() {
  // A body may have come since `attach` already in contact: no event of it comes.
  const auto isNew = [this](BodyId id) { return !isRead(id) && bridge_->bodyOf(id) != nullptr; };
  for (const ContactState& contact : bridge_->contacts()) {
    if (isNew(contact.body) || isNew(contact.other)) readNew();
    if (isSilent(contact.body) || isSilent(contact.other)) continue;
    awaitShape(contact.body);
    awaitShape(contact.other);
    updateContact(inMetres(contact, metresPerUnit()));
  }
}

/// Says where what rings is at the end of a substep.
void WorldSession::moveRinging() {
  for (const BodyId id : ringing()) {
    const btCollisionObject* const object = bridge_->bodyOf(id);
    if (object == nullptr) continue;
    const btTransform& transform = object->getWorldTransform();
    (void)moveBody(
        id, {bridge_->time(), metresPerUnit() * toVec3(transform.getOrigin()), toQuat(transform)});
  }
}

void WorldSession::describe(RunRecorder& run, BodyId id, const btCollisionObject& object) {
  run.describe(id, {}, forms_.of(*object.getCollisionShape()));
}

void WorldSession::describeBodies(RunRecorder& run) {
  toldPoses_.clear();
  forms_.beginReading();
  for (int i = 0; hasWorld() && i < world_.getNumCollisionObjects(); ++i) {
    const btCollisionObject& object = *world_.getCollisionObjectArray()[i];
    const Result<BodyId> id = bridge_->bodyId(object);
    if (id && isRead(*id)) describe(run, *id, object);
  }
  tellPoses();
}

/// Tells runs where bodies are that have moved, but for those that ring, whose poses all know.
void WorldSession::tellPoses() {
  if (!keepsRuns() || !hasWorld()) return;
  for (int i = 0; i < world_.getNumCollisionObjects(); ++i) {
    const btCollisionObject& object = *world_.getCollisionObjectArray()[i];
    const Result<BodyId> id = bridge_->bodyId(object);
    if (!id || !isRead(*id) || std::ranges::binary_search(ringingBodies, *id)) continue;
    const btTransform& transform = object.getWorldTransform();
    const auto [told, isNew] = toldPoses_.try_emplace(*id, transform);
    if (!isNew && told->second == transform) continue;
    told->second = transform;
    const ListenerPose pose = {bridge_->time(), metresPerUnit() * toVec3(transform.getOrigin()),
                               toQuat(transform)};
    if (isPose(pose)) forEachRun([&](RunRecorder& run) { run.moveBody(*id, pose); });
  }
}

Status WorldSession::close() {
  const auto kept = shared_from_this();  // the host's function may end the sound
  if (bridge_) {
    bridge_->flush();
    postEvents();
    bridge_->clear();
    tellNoted();
  }
  if (bridge_) {
    unsupported_ = bridge_->counters().unsupported;
    bridge_.reset();
  }
  reader_.solver().stop();
  return SoundSession::close();
}

/// For each part, what is assigned to the body goes before its shape's, and that before its user
/// index's.
BodySound WorldSession::assignedTo(const KnownBody& body, const btCollisionObject& object) {
  if (ofUserIndex_.contains(object.getUserIndex())) usedIndices_.insert(object.getUserIndex());
  if (ofShape_.contains(object.getCollisionShape())) usedShapes_.insert(object.getCollisionShape());
  BodySound all;
  mergeFrom(ofUserIndex_, object.getUserIndex(), all);
  mergeFrom(ofShape_, object.getCollisionShape(), all);
  merge(all, body.assigned);
  return all;
}

/// Merges what was assigned to the body before it had an id.
void WorldSession::mergeUnseen(const btCollisionObject& object, BodySound& assigned) {
  const auto found = unseen_.find(&object);
  if (found == unseen_.end()) return;
  if (isSameObject(found->second.identity, identityOf(object), true))
    merge(assigned, found->second.assigned);
  unseen_.erase(found);
}

void WorldSession::read(BodyId id, const btCollisionObject& object) {
  BodyReading reading = reader_.read(object, listener());
  KnownBody& known = known_[id];
  if (isRead_.size() <= id) {
    isRead_.resize(id + 1);
    asRead_.resize(id + 1);
    isSilent_.resize(id + 1);
    isPending_.resize(id + 1);
  }
  isRead_[id] = true;
  asRead_[id] = seenAs(object);
  mergeUnseen(object, known.assigned);
  known.isUnsolved = reading.unsolved.has_value();
  known.isLink = reading.isLink;
  known.pending = reading.pending;
  known.isHastened = false;
  known.inverseInertia = reading.inverseInertia;
  isPending_[id] = reading.pending.has_value();
  if (reading.unsolved) unsolvedReason_ = reading.unsolved->message;
  const BodySound assigned = assignedTo(known, object);
  known.density = reading.density;
  known.isGuessed = !assigned.material && assigned.modes.value_or(nullptr) == nullptr;
  apply(assigned, reading.sound);
  isSilent_[id] = assigned.silent.value_or(false);
  // The model of a body that does not move is in the frame of its shape, wherever its centre of
  // mass may be.
  if (object.isStaticOrKinematicObject()) reading.sound.modalOrigin = Vec3::Zero();
  take(id, known, reading.sound);
  if (keepsRuns()) forEachRun([&](RunRecorder& run) { describe(run, id, object); });
}

/// Sets a body, and tells if it cannot sound.
void WorldSession::take(BodyId id, KnownBody& known, const SoundBody& body) {
  const Status accepted = told(setBody(id, body));
  known.isRefused = !accepted;
  if (!accepted) unsolvedReason_ = accepted.error().message;
}

/// Forgets which shape is where: the host may have changed it since the last reading.
void WorldSession::beginReading() {
  reader_.beginReading();
  forms_.beginReading();
}

template <class IsWanted>
void WorldSession::readWhere(const IsWanted& isWanted) {
  beginReading();
  const auto& objects = world_.getCollisionObjectArray();
  for (int i = 0; i < objects.size(); ++i) {
    if (!isWanted(*objects[i])) continue;
    if (const Result<BodyId> id = bridge_->bodyId(*objects[i])) read(*id, *objects[i]);
  }
}

void WorldSession::readWithShape(const btCollisionShape& shape) {
  readWhere(
      [&shape](const btCollisionObject& object) { return object.getCollisionShape() == &shape; });
}

void WorldSession::readWithIndex(UserIndex userIndex) {
  readWhere([userIndex](const btCollisionObject& object) {
    return object.getUserIndex() == userIndex.value;
  });
}

WorldSession::AsRead WorldSession::seenAs(const btCollisionObject& object) {
  AsRead seen{.shape = object.getCollisionShape()};
  const btRigidBody* const rigid = btRigidBody::upcast(&object);
  if (rigid != nullptr) seen.inverseMass = rigid->getInvMass();
  seen.moves = !object.isStaticOrKinematicObject();
  return seen;
}

/// Reads a body again that can move, and that the host has released, or given another mass or
/// shape, since it was read.
void WorldSession::readChanged(BodyId id) {
  const bool isThere = hasWorld() && isRead(id);
  const btCollisionObject* const object = isThere ? bridge_->bodyOf(id) : nullptr;
  if (object == nullptr || object->isStaticOrKinematicObject()) return;
  if (asRead_[id] == seenAs(*object)) return;
  beginReading();
  read(id, *object);
}

void WorldSession::readNew() {
  if (!hasWorld()) return;
  beginReading();
  const auto& objects = world_.getCollisionObjectArray();
  for (int i = 0; i < objects.size(); ++i) {
    const Result<BodyId> id = bridge_->bodyId(*objects[i]);
    if (id && !isRead(*id)) read(*id, *objects[i]);
  }
}

/// Reads bodies that have just collided for the first time, as they may have left the world, or the
/// world be gone, when their events come.
void WorldSession::readColliding() {
  if (settings.synth.impulse != ImpulseChoice::applied) return;
  if (std::exchange(collisions_, bridge_->counters().collisions) != collisions_) readNew();
}

void WorldSession::readBodies() {
  if (!hasWorld()) return;
  readWhere([](const btCollisionObject&) { return true; });
  const auto& objects = world_.getCollisionObjectArray();
  for (int i = 0; i < objects.size(); ++i)
    if (!bridge_->bodyId(*objects[i]))
      (void)reader_.read(*objects[i], listener());  // its shape will be solved
}

/// Forgets bodies that have left the world: they would become ever more, as the bridge gives no id
/// twice.
void WorldSession::forgetRemoved() {
  const auto& objects = world_.getCollisionObjectArray();
  if (known_.size() <= 2 * static_cast<std::size_t>(objects.size()) + kForgotten) return;
  std::unordered_set<BodyId> presentIds;
  std::unordered_set<const btCollisionObject*> present;
  for (int i = 0; i < objects.size(); ++i) {
    present.insert(objects[i]);
    if (const Result<BodyId> id = bridge_->bodyId(*objects[i])) presentIds.insert(*id);
  }
  std::erase_if(unseen_, [&](const auto& entry) { return !present.contains(entry.first); });
  for (auto& [id, known] : known_)
    known.absent = presentIds.contains(id) ? 0 : known.absent + 1;
  std::erase_if(known_, [&](const auto& entry) {
    if (entry.second.absent < kEventsLater) return false;
    isPending_[entry.first] = false;
    removeBody(entry.first);
    toldPoses_.erase(entry.first);
    return true;
  });
  std::unordered_set<ShapeSolver::ShapeId> awaited;
  for (const auto& [id, known] : known_)
    if (known.pending) awaited.insert(*known.pending);
  reader_.solver().keepOnly(awaited);
}

Status WorldSession::requireWorld() const {
  if (Status open = requireOpen(); !open) return open;
  if (!hasWorld()) return Error{"sound: its world has been destroyed; attach another"};
  return std::monostate{};
}

Status WorldSession::requirePresent(const btCollisionObject& object) const {
  if (isIn(world_, object)) return std::monostate{};
  return Error{"sound: this body is not in the world; add it before anything is assigned to it"};
}

Status WorldSession::assign(const btCollisionObject& object, const BodySound& sound) {
  if (Status open = requireWorld(); !open) return open;
  const Result<BodySound> checked = resolved(sound);
  if (!checked) return checked.error();
  if (Status present = requirePresent(object); !present) return present;
  UnseenBody& unseen = unseen_[&object];
  const ObjectIdentity identity =
      identify(*world_.getCollisionObjectArray()[object.getWorldArrayIndex()]);
  if (!isSameObject(unseen.identity, identity, true)) unseen.assigned = {};
  unseen.identity = identity;
  merge(unseen.assigned, *checked);
  beginReading();
  if (const Result<BodyId> id = bridge_->bodyId(object)) read(*id, object);
  return std::monostate{};
}

Status WorldSession::assign(const btCollisionShape& shape, const BodySound& sound) {
  if (Status open = requireWorld(); !open) return open;
  const Result<BodySound> checked = resolved(sound);
  if (!checked) return checked.error();
  merge(ofShape_[&shape], *checked);
  readWithShape(shape);
  return std::monostate{};
}

Status WorldSession::assign(UserIndex userIndex, const BodySound& sound) {
  if (Status open = requireWorld(); !open) return open;
  const Result<BodySound> checked = resolved(sound);
  if (!checked) return checked.error();
  merge(ofUserIndex_[userIndex.value], *checked);
  readWithIndex(userIndex);
  return std::monostate{};
}

Status WorldSession::unassign(const btCollisionObject& object) {
  if (Status open = requireWorld(); !open) return open;
  if (Status present = requirePresent(object); !present) return present;
  unseen_.erase(&object);
  if (const Result<BodyId> id = bridge_->bodyId(object)) {
    known_[*id].assigned = {};
    beginReading();
    read(*id, object);
  }
  return std::monostate{};
}

Status WorldSession::unassign(const btCollisionShape& shape) {
  if (Status open = requireWorld(); !open) return open;
  usedShapes_.erase(&shape);
  if (ofShape_.erase(&shape) > 0) readWithShape(shape);
  return std::monostate{};
}

Status WorldSession::unassign(UserIndex userIndex) {
  if (Status open = requireWorld(); !open) return open;
  usedIndices_.erase(userIndex.value);
  if (ofUserIndex_.erase(userIndex.value) > 0) readWithIndex(userIndex);
  return std::monostate{};
}

/// Counts what is assigned to no body that was read, nor to one that is there.
std::uint64_t WorldSession::unusedAssignments() const {
  std::unordered_set<const btCollisionShape*> shapes;
  std::unordered_set<int> indices;
  for (const auto& [shape, sound] : ofShape_)
    if (!usedShapes_.contains(shape)) shapes.insert(shape);
  for (const auto& [index, sound] : ofUserIndex_)
    if (!usedIndices_.contains(index)) indices.insert(index);
  const bool mayBeUsed = hasWorld() && !(shapes.empty() && indices.empty());
  for (int i = 0; mayBeUsed && i < world_.getNumCollisionObjects(); ++i) {
    const btCollisionObject& object = *world_.getCollisionObjectArray()[i];
    shapes.erase(object.getCollisionShape());
    indices.erase(object.getUserIndex());
  }
  return shapes.size() + indices.size();
}

Result<BodyMaterial> WorldSession::materialOf(const btCollisionObject& object) const {
  if (Status open = requireWorld(); !open) return open.error();
  const Result<BodyId> id = bridge_->bodyId(object);
  if (!id) return Error{"sound: " + id.error().message};
  const auto known = known_.find(*id);
  const auto body = bodies.find(*id);
  if (known == known_.end() || body == bodies.end())
    return Error{"sound: this body has collided with nothing yet; call Sound::prepare before"};
  return BodyMaterial{body->second.material, known->second.isGuessed, known->second.density};
}

std::string WorldSession::report() const {
  SoundFacts facts = this->facts();
  facts.hasWorld = hasWorld();
  facts.restSpeed = worldSettings_.restSpeed;
  for (const auto& [id, known] : known_) {
    const auto body = bodies.find(id);
    if (body == bodies.end()) continue;
    const bool isMovable = known.density > 0.0;
    ++(isMovable ? facts.movable : facts.immovable);
    facts.silent += isSilent(id) ? 1U : 0U;
    if (!isMovable) continue;
    facts.light += known.density < kLightestSolid ? 1U : 0U;
    const SoundBody& sound = body->second;
    if (sound.modal) facts.compareMasses(sound.mass, sound.modal->mass);
    ++(known.isGuessed ? facts.guessed : facts.given)[body->second.material.name];
  }
  return wordsOf(facts);
}

SoundStatistics WorldSession::statistics() const {
  SoundStatistics all = SoundSession::statistics();
  all.silenced = silenced_;
  all.posted += silenced_;
  all.unsupportedContacts = bridge_ ? bridge_->counters().unsupported : unsupported_;
  all.solvedShapes = reader_.solver().solved();
  all.shapesPending = reader_.solver().pending();
  all.shapesSolvedInStep = solvedInStep_;
  all.unsolvedReason = unsolvedReason_;
  all.unusedAssignments = unusedAssignments();
  for (const auto& [id, known] : known_) {
    all.unsolvedBodies += known.isUnsolved ? 1 : 0;
    all.refusedBodies += known.isRefused ? 1 : 0;
    all.links += known.isLink ? 1 : 0;
  }
  return all;
}

}  // namespace carom::plugin
