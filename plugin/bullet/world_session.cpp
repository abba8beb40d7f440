#include "plugin/bullet/world_session.h"

#include <unordered_set>
#include <utility>

#include <btBulletDynamicsCommon.h>

#include "audio/contact/contact_drive.h"
#include "bullet_bridge/bodies/proxy_id.h"
#include "plugin/bullet/assigned_sound.h"

namespace carom::plugin {

using namespace bullet;

namespace {

/// Removed bodies are looked for when this many more bodies are known than twice those in the
/// world.
constexpr std::size_t kForgotten = 64;

bool isIn(const btDynamicsWorld& world, const btCollisionObject& object) {
  const auto& objects = world.getCollisionObjectArray();
  const int index = object.getWorldArrayIndex();
  return index >= 0 && index < objects.size() && objects[index] == &object;
}

}  // namespace

Status WorldSession::attach() {
  BulletBridgeSettings wanted;
  wanted.restSpeed = worldSettings_.restSpeed;
  wanted.stillSpeed = audio::ContactDrive::kSlowest;
  wanted.onSubstep = [this] { postSubstep(); };
  if (settings.synth.impulse == ImpulseChoice::physical) wanted.delivery = EventDelivery::prompt;
  Result<BulletBridge> bridge = BulletBridge::attach(world_, wanted);
  if (!bridge) return bridge.error();
  bridge_ = *std::move(bridge);
  readBodies();
  return std::monostate{};
}

/// Posts the bridge's events and contacts at the end of a substep.
void WorldSession::postSubstep() {
  postEvents();
  postContacts();
  bridge_->clear();
  advanceTo(bridge_->time());
  forgetRemoved();
}

void WorldSession::postEvents() {
  for (const ImpulseEvent& event : bridge_->events()) {
    if (!isRead(event.body) || !isRead(event.other)) readNew();
    if (isSilent(event.body) || isSilent(event.other))
      ++silenced_;
    else
      post(event);
  }
}

void WorldSession::postContacts() {
  for (const ContactState& contact : bridge_->contacts())
    if (!isSilent(contact.body) && !isSilent(contact.other)) updateContact(contact);
}

Status WorldSession::close() {
  if (bridge_) {
    bridge_->flush();
    postEvents();
    unsupported_ = bridge_->counters().unsupported;
    bridge_.reset();
  }
  return SoundSession::close();
}

/// For each part, what is assigned to the body goes before its shape's, and that before its user
/// index's.
BodySound WorldSession::assignedTo(const KnownBody& body, const btCollisionObject& object) const {
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
  if (found->second.proxyId == proxyIdOf(object)) merge(assigned, found->second.assigned);
  unseen_.erase(found);
}

void WorldSession::read(BodyId id, const btCollisionObject& object) {
  BodyReading reading = reader_.read(object);
  KnownBody& known = known_[id];
  if (isRead_.size() <= id) {
    isRead_.resize(id + 1);
    isSilent_.resize(id + 1);
  }
  isRead_[id] = true;
  mergeUnseen(object, known.assigned);
  known.isUnsolved = reading.unsolved.has_value();
  known.isLink = reading.isLink;
  if (reading.unsolved) unsolvedReason_ = reading.unsolved->message;
  const BodySound assigned = assignedTo(known, object);
  apply(assigned, reading.sound);
  isSilent_[id] = assigned.silent.value_or(false);
  // The model of a body that does not move is in the frame of its shape, wherever its centre of
  // mass may be.
  if (object.isStaticOrKinematicObject()) reading.sound.modalOrigin = Vec3::Zero();
  (void)setBody(id, reading.sound);  // refused: its events are counted as rejected
}

void WorldSession::readPresent() {
  const auto& objects = world_.getCollisionObjectArray();
  for (int i = 0; i < objects.size(); ++i)
    if (const Result<BodyId> id = bridge_->bodyId(*objects[i])) read(*id, *objects[i]);
}

void WorldSession::readNew() {
  const std::uint64_t before = reader_.solved();
  const auto& objects = world_.getCollisionObjectArray();
  for (int i = 0; i < objects.size(); ++i) {
    const Result<BodyId> id = bridge_->bodyId(*objects[i]);
    if (id && !known_.contains(*id)) read(*id, *objects[i]);
  }
  solvedInStep_ += reader_.solved() - before;
}

void WorldSession::readBodies() {
  if (!bridge_) return;
  readPresent();
  const auto& objects = world_.getCollisionObjectArray();
  for (int i = 0; i < objects.size(); ++i)
    if (!bridge_->bodyId(*objects[i])) (void)reader_.read(*objects[i]);  // solves its shape
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
  std::erase_if(known_, [&](const auto& entry) {
    if (presentIds.contains(entry.first)) return false;
    removeBody(entry.first);
    return true;
  });
}

Status WorldSession::requirePresent(const btCollisionObject& object) const {
  if (isIn(world_, object)) return std::monostate{};
  return Error{"sound: this body is not in the world; add it before anything is assigned to it"};
}

Status WorldSession::assign(const btCollisionObject& object, const BodySound& sound) {
  if (Status open = requireOpen(); !open) return open;
  const Result<BodySound> checked = resolved(sound);
  if (!checked) return checked.error();
  if (Status present = requirePresent(object); !present) return present;
  UnseenBody& unseen = unseen_[&object];
  if (unseen.proxyId != proxyIdOf(object)) unseen = {proxyIdOf(object), {}};
  merge(unseen.assigned, *checked);
  if (const Result<BodyId> id = bridge_->bodyId(object)) read(*id, object);
  return std::monostate{};
}

Status WorldSession::assign(const btCollisionShape& shape, const BodySound& sound) {
  if (Status open = requireOpen(); !open) return open;
  const Result<BodySound> checked = resolved(sound);
  if (!checked) return checked.error();
  merge(ofShape_[&shape], *checked);
  readPresent();
  return std::monostate{};
}

Status WorldSession::assign(UserIndex userIndex, const BodySound& sound) {
  if (Status open = requireOpen(); !open) return open;
  const Result<BodySound> checked = resolved(sound);
  if (!checked) return checked.error();
  merge(ofUserIndex_[userIndex.value], *checked);
  readPresent();
  return std::monostate{};
}

Status WorldSession::unassign(const btCollisionObject& object) {
  if (Status open = requireOpen(); !open) return open;
  if (Status present = requirePresent(object); !present) return present;
  unseen_.erase(&object);
  if (const Result<BodyId> id = bridge_->bodyId(object)) {
    known_[*id].assigned = {};
    read(*id, object);
  }
  return std::monostate{};
}

Status WorldSession::unassign(const btCollisionShape& shape) {
  if (Status open = requireOpen(); !open) return open;
  if (ofShape_.erase(&shape) > 0) readPresent();
  return std::monostate{};
}

Status WorldSession::unassign(UserIndex userIndex) {
  if (Status open = requireOpen(); !open) return open;
  if (ofUserIndex_.erase(userIndex.value) > 0) readPresent();
  return std::monostate{};
}

SoundStatistics WorldSession::statistics() const {
  SoundStatistics all = SoundSession::statistics();
  all.silenced = silenced_;
  all.unsupportedContacts = bridge_ ? bridge_->counters().unsupported : unsupported_;
  all.solvedShapes = reader_.solved();
  all.shapesSolvedInStep = solvedInStep_;
  all.unsolvedReason = unsolvedReason_;
  for (const auto& [id, known] : known_) {
    all.unsolvedBodies += known.isUnsolved ? 1 : 0;
    all.links += known.isLink ? 1 : 0;
  }
  return all;
}

}  // namespace carom::plugin
