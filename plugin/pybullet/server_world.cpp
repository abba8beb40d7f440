#include "plugin/pybullet/server_world.h"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "plugin/pybullet/body_description.h"

namespace carom::plugin {
namespace {

constexpr int kMostBodies = 10'000'000;  // a number beyond is none

// Tolerances (share of the way, and m) within which a body is where its velocity has brought it.
constexpr double kStrayShare = 0.1;
constexpr double kStray = 1e-5;  // m

Vec3 vectorOf(const std::array<double, 3>& values) {
  return {values[0], values[1], values[2]};
}

Quat orientationOf(const std::array<double, 4>& values) {
  return Quat(values[3], values[0], values[1], values[2]).normalized();
}

/// Returns the force (N) of friction on the body A.
Vec3 frictionOf(const b3::ContactPoint& contact) {
  return contact.frictionForces[0] * vectorOf(contact.frictionDirection) +
         contact.frictionForces[1] * vectorOf(contact.secondFrictionDirection);
}

/// True if a state is there, but for rounding.
bool isPlaceOf(const BodyState& state, const Vec3& position, const Quat& orientation) {
  constexpr double kRounding = 1e-5;
  return (state.position - position).norm() <= kRounding * (1.0 + position.norm()) &&
         state.orientation.angularDistance(orientation) <= 1e-3;
}

/// Has a body end the substep at rest.
void rest(BodyMotion& motion) {
  motion.ends = motion.starts;
  for (BodyState& state : motion.ends)
    state.velocity = state.angularVelocity = Vec3::Zero();
  motion.end = BodyMotion::Source::told;
}

}  // namespace

double substepOf(const b3::SimulationParameters& parameters) {
  return parameters.deltaTime / std::max(1, parameters.substeps);
}

void ServerWorld::begin() {
  for (const int number : client_.bodies())
    addBody(number);
}

void ServerWorld::setTime(double seconds) {
  time_ = epoch_ = seconds;
  steps_ = 0;
  isOpen_ = false;
  for (const ContactState& contact : lasting_.end(seconds))
    ears_.hear(contact);
  listener_.forgetPast();
}

std::size_t ServerWorld::bodyCount() const {
  return static_cast<std::size_t>(std::ranges::count(bodies_, true, &ServerBody::isThere));
}

int ServerWorld::linkCount(int body) {
  return static_cast<int>(client_.states(body).size()) - 1;
}

ServerBody& ServerWorld::body(int number) {
  if (find(number) == nullptr) addBody(number);  // no notification has come yet
  return bodies_[static_cast<std::size_t>(number)];
}

void ServerWorld::tellParts() {
  lasting_.clear();  // who hears of the parts has not heard of what they lie on
  for (ServerBody& each : bodies_)
    for (ServerPart& part : each.parts)
      if (part.isDescribed) ears_.takePart(each, part);
}

void ServerWorld::beginSubstep() {
  takeStates();
  finishSubstep();
  const std::optional<b3::SimulationParameters> parameters = client_.parameters();
  duration_ = parameters ? substepOf(*parameters) : 0.0;
  if (!(duration_ > 0.0)) return;
  outer_ = parameters->deltaTime;
  gravity_ = vectorOf(parameters->gravity);
  pushDistance_ = parameters->splitImpulse != 0 ? parameters->splitImpulseDistance
                                                : -std::numeric_limits<double>::infinity();
  if (duration_ != counted_) {
    epoch_ = time_;
    steps_ = 0;
    counted_ = duration_;
  }
  ears_.beginSubstep(duration_);
  listener_.begin({time_,
                   duration_,
                   gravity_,
                   {.restitutionSpeed = parameters->restitutionSpeed,
                    .erp = parameters->contactErp,
                    .slop = parameters->contactSlop,
                    .pushDistance = pushDistance_}});
  beginMotions();
}

/// Finds the states at the end of the last substep, which are those at the start of the next one.
void ServerWorld::takeStates() {
  for (std::size_t number = 0; number < bodies_.size(); ++number) {
    ServerBody& body = bodies_[number];
    if (!body.isThere || !body.mayMove || body.motion.end != BodyMotion::Source::unknown) continue;
    if (body.motion.isAwake || body.motion.start == BodyMotion::Source::unknown)
      askFor(static_cast<int>(number), body.motion, BodyMotion::Source::asked);
    else
      rest(body.motion);
  }
}

/// Asks how a body has ended the last substep; `source` is `told` if the host may still change that
/// before the next one begins.
void ServerWorld::askFor(int body, BodyMotion& motion, BodyMotion::Source source) {
  const std::span<const BodyState> states = client_.states(body);
  motion.ends.assign(states.begin(), states.end());
  motion.end = source;
}

/// Begins a substep with the states in which the last one has ended.
void ServerWorld::beginMotions() {
  ++substep_;
  for (std::size_t number = 0; number < bodies_.size(); ++number) {
    ServerBody& body = bodies_[number];
    if (!body.isThere || !body.mayMove) continue;
    BodyMotion& motion = body.motion;
    std::swap(motion.starts, motion.ends);
    motion.start = std::exchange(motion.end, BodyMotion::Source::unknown);
    int link = kBaseLink;
    for (const BodyState& state : motion.starts) {
      const ServerPart& part = partOf({static_cast<int>(number), link++});
      listener_.state(part.id, state);
      if (part.rings) ears_.movePart(part.id, {time_, state.position, state.orientation});
    }
  }
}

void ServerWorld::endSubstep() {
  if (!(duration_ > 0.0)) return;
  isOpen_ = true;
  time_ = epoch_ + static_cast<double>(++steps_) * duration_;
  if (!isTold_) ears_.advanceTo(time_);
}

/// Hears the impacts of the substep, once its solver has run.
void ServerWorld::finishSubstep() {
  if (!std::exchange(isOpen_, false)) return;
  readContacts();
  correctMotions();
  const std::span<const ImpulseEvent> events =
      listener_.finish(points_, [this](BodyId id) { return stateAfter(id); });
  for (const ImpulseEvent& event : events)
    ears_.hear(event);
  impacts_ += events.size() / 2;
  for (const ContactState& contact :
       lasting_.finish(time_ - duration_, duration_, listener_.contacts(), *this))
    ears_.hear(contact);
  ears_.advanceTo(time_);
}

/// Returns how a body has moved over the substep; one that nothing moves rests where it is.
std::optional<SubstepMotion> ServerWorld::motionOf(BodyId id) const {
  const ServerBody* const body = bodyOf(id);
  if (body == nullptr) return std::nullopt;
  const auto at = static_cast<std::size_t>(keys_[id].link - kBaseLink);
  const BodyMotion& motion = body->motion;
  SubstepMotion found;
  if (at < body->parts.size()) found.body = body->parts[at].contact;
  if (!body->mayMove) {
    if (motion.starts.size() == 1) found.start = found.end = motion.starts.front();
    return found;
  }
  if (at >= motion.starts.size()) return std::nullopt;
  found.start = motion.starts[at];
  if (at < motion.ends.size() && motion.end != BodyMotion::Source::unknown) {
    found.end = motion.ends[at];
  } else {  // of links, which are asked for as the next substep begins
    found.end = found.start;
    found.end.position += duration_ * found.start.velocity;
  }
  return found;
}

const BodyState* ServerWorld::endStateOf(BodyId id) const {
  const ServerBody* const body = bodyOf(id);
  if (body == nullptr || !body->mayMove) return nullptr;
  const BodyMotion& motion = body->motion;
  const auto at = static_cast<std::size_t>(keys_[id].link - kBaseLink);
  if (motion.end != BodyMotion::Source::unknown && at < motion.ends.size()) return &motion.ends[at];
  return at < motion.starts.size() ? &motion.starts[at] : nullptr;
}

/// Looks at how bodies have moved that should follow gravity and their contacts.
void ServerWorld::correctMotions() {
  for (std::size_t number = 0; number < bodies_.size(); ++number) {
    ServerBody& body = bodies_[number];
    if (!body.isThere || !body.mayMove || !body.motion.isAwake || body.motion.hasLinks()) continue;
    if (body.motion.start == BodyMotion::Source::unknown ||
        body.motion.end == BodyMotion::Source::unknown || body.motion.starts.empty() ||
        body.motion.ends.empty())
      continue;
    correct(static_cast<int>(number), body);
  }
}

/// Finds out why a body has moved otherwise than free bodies do: the host has put it elsewhere, has
/// thrown it, or something pulls at it all the time.
void ServerWorld::correct(int number, ServerBody& body) {
  BodyMotion& motion = body.motion;
  const ServerPart& part = body.part(kBaseLink);
  const FreeMotion free{duration_, gravity_};
  motion.loadIn(substep_);
  if (motion.isPushed && motion.end == BodyMotion::Source::told && part.contact.isRigid())
    askFor(number, motion, motion.end);
  const bool wasFree =
      std::exchange(motion.isFree, isFreeMotion(motion.starts.front(), motion.ends.front(),
                                                motion.impulse, part.contact.mass, free));
  if (motion.isFree) return;
  if (motion.end == BodyMotion::Source::told) askFor(number, motion, motion.end);
  if (motion.ends.size() != 1 || motion.start != BodyMotion::Source::told) return;
  const BodyState& end = motion.ends.front();
  const Vec3 way = duration_ * end.velocity;
  const bool wasPut = (end.position - motion.starts.front().position - way).norm() >
                      kStray + kStrayShare * way.norm();
  if (!wasPut && !wasFree) return;  // something pulls at it
  motion.isFree = true;
  motion.starts.front() = startOf(end, motion, part.contact, free);
  listener_.correct(part.id, motion.starts.front());
}

/// Returns the state of a body at the end of the substep.
std::optional<BodyState> ServerWorld::stateAfter(BodyId id) {
  const ServerBody* const body = bodyOf(id);
  if (body == nullptr) return std::nullopt;
  const auto part = static_cast<std::size_t>(keys_[id].link - kBaseLink);
  if (body->motion.end != BodyMotion::Source::unknown && part < body->motion.ends.size())
    return body->motion.ends[part];
  return stateOf(keys_[id]);
}

void ServerWorld::readContacts() {
  const auto sleeps = [](const ServerBody& body) { return !(body.mayMove && body.motion.isAwake); };
  points_.clear();
  for (const b3::ContactPoint& contact : client_.contacts()) {
    const Key key{contact.bodyA, contact.linkA};
    const Key otherKey{contact.bodyB, contact.linkB};
    if (key.body < 0 || otherKey.body < 0 || key == otherKey) continue;
    const BodyId id = described(key).id;
    const BodyId otherId = described(otherKey).id;
    ServerBody& body = bodies_[static_cast<std::size_t>(key.body)];
    ServerBody& other = bodies_[static_cast<std::size_t>(otherKey.body)];
    if (body.isSoft || other.isSoft) {
      ++softContacts_;
      continue;
    }
    if (sleeps(body) && sleeps(other)) continue;
    points_.push_back({id, otherId, vectorOf(contact.positionOnA), vectorOf(contact.positionOnB),
                       vectorOf(contact.normalOnB), contact.distance, contact.normalForce * outer_,
                       outer_ * frictionOf(contact)});
    addImpulse(contact, body, 1.0);
    addImpulse(contact, other, -1.0);
  }
}

/// Adds what a contact has given to one of its bodies in this substep: +1 for A, -1 for B.
void ServerWorld::addImpulse(const b3::ContactPoint& contact, ServerBody& body, double sign) {
  BodyMotion& motion = body.motion;
  if (!body.mayMove || motion.starts.size() != 1) return;
  motion.loadIn(substep_);
  motion.isPushed = motion.isPushed || contact.distance <= pushDistance_;
  const Vec3 force = contact.normalForce * vectorOf(contact.normalOnB) + frictionOf(contact);
  const Vec3 impulse = sign * outer_ * force;
  const Vec3 place = vectorOf(sign > 0.0 ? contact.positionOnA : contact.positionOnB);
  motion.impulse += impulse;
  motion.angularImpulse += (place - motion.starts.front().position).cross(impulse);
}

/// Returns the present state of a body or link.
std::optional<BodyState> ServerWorld::stateOf(Key key) {
  const auto part = static_cast<std::size_t>(key.link - kBaseLink);
  const std::span<const BodyState> states = client_.states(key.body);
  if (part >= states.size()) return std::nullopt;
  return states[part];
}

void ServerWorld::hear(std::span<const b3::Notification> notifications) {
  // If there were several steps, only the last has left bodies where they are.
  std::size_t stepped = notifications.size();
  for (std::size_t index = 0; index < notifications.size(); ++index) {
    const b3::Notification& each = notifications[index];
    ServerBody* const body = find(each.body);
    if (each.type == b3::kSimulationReset) {
      for (std::size_t number = 0; number < bodies_.size(); ++number)
        removeBody(static_cast<int>(number));
      setTime(0.0);
      ears_.restart();
    } else if (each.type == b3::kBodyAdded) {
      addBody(each.body);
    } else if (each.type == b3::kBodyRemoved) {
      removeBody(each.body);
    } else if (each.type == b3::kSimulationStepped) {
      stepped = index;
    } else if (each.type == b3::kSoftBodyChanged && body != nullptr) {
      body->isSoft = true;
      body->mayMove = false;
    } else if (each.type == b3::kLinkDynamicsChanged && body != nullptr && each.link >= kBaseLink) {
      body->mayMove = !body->isSoft;
      const auto at = static_cast<std::size_t>(each.link - kBaseLink);
      if (at < body->parts.size()) body->parts[at].isDescribed = false;
    }
  }
  if (stepped < notifications.size()) hearStep(notifications.subspan(stepped));
}

/// Takes note of where bodies are after a step; those that are not among them sleep.
void ServerWorld::hearStep(std::span<const b3::Notification> told) {
  isTold_ = true;
  if (!isOpen_) return;
  for (ServerBody& body : bodies_)
    body.motion.isAwake = false;
  for (const b3::Notification& each : told)
    if (each.type == b3::kTransformChanged) hearPlace(each);
  for (ServerBody& body : bodies_) {
    BodyMotion& motion = body.motion;
    if (body.isThere && body.mayMove && !motion.isAwake &&
        motion.start != BodyMotion::Source::unknown)
      rest(motion);
  }
  finishSubstep();
}

void ServerWorld::hearPlace(const b3::Notification& told) {
  ServerBody* const body = find(told.body);
  if (body == nullptr || body->isSoft) return;
  BodyMotion& motion = body->motion;
  motion.isAwake = true;
  if (told.link != kBaseLink || motion.starts.size() != 1) return;
  const Vec3 position = vectorOf(told.position);
  const Quat orientation = orientationOf(told.orientation);
  if (!motion.isTold) {
    // The first time, the place is compared with the state that is asked for.
    askFor(told.body, motion, BodyMotion::Source::told);
    motion.isTold =
        motion.ends.size() == 1 && isPlaceOf(motion.ends.front(), position, orientation);
    if (!body->mayMove && motion.isTold) place(*body, motion.ends.front());
    return;
  }
  if (!body->mayMove) return place(*body, {position, orientation});
  motion.ends.assign(1, endOf(motion.starts.front(), position, orientation, duration_));
  motion.end = BodyMotion::Source::told;
}

/// Takes note of where a body is that only the host moves. One that was held is free if it has
/// moved.
void ServerWorld::place(ServerBody& body, BodyState state) {
  const BodyState& before = body.motion.starts.front();
  if (state.position == before.position && state.orientation.isApprox(before.orientation, 0.0))
    return;
  state.velocity = state.angularVelocity = Vec3::Zero();
  ServerPart& part = body.part(kBaseLink);
  if (part.isHeld) {
    body.mayMove = true;
    part.isDescribed = false;
    body.motion = {};
    return;
  }
  body.motion.starts.front() = state;
  listener_.correct(part.id, state);
}

const ServerBody* ServerWorld::find(int body) const {
  if (body < 0 || static_cast<std::size_t>(body) >= bodies_.size()) return nullptr;
  const ServerBody& found = bodies_[static_cast<std::size_t>(body)];
  return found.isThere ? &found : nullptr;
}

const ServerBody* ServerWorld::bodyOf(BodyId id) const {
  return id < keys_.size() ? find(keys_[id].body) : nullptr;
}

ServerBody* ServerWorld::find(int body) {
  const auto at = static_cast<std::size_t>(body);
  return std::as_const(*this).find(body) != nullptr ? &bodies_[at] : nullptr;
}

void ServerWorld::addBody(int body) {
  if (body < 0 || body > kMostBodies) return;
  removeBody(body);  // the number may have been that of another body
  const auto at = static_cast<std::size_t>(body);
  if (at >= bodies_.size()) bodies_.resize(at + 1);
  bodies_[at].isThere = true;
}

void ServerWorld::removeBody(int body) {
  ServerBody* const found = find(body);
  if (found == nullptr) return;
  for (const ServerPart& part : found->parts) {
    if (!part.isKnown) continue;
    ears_.removePart(part.id);
    listener_.removeBody(part.id);
    lasting_.removeBody(part.id);
    keys_[part.id] = {};
  }
  *found = {};
}

/// Returns the part of a body or link, which gets its id if it has none.
ServerPart& ServerWorld::partOf(Key key) {
  ServerPart& part = body(key.body).part(key.link);
  if (!std::exchange(part.isKnown, true)) {
    part.id = static_cast<BodyId>(keys_.size());
    keys_.push_back(key);
  }
  return part;
}

/// Returns the part of a body or link in a contact, described if it is not yet.
const ServerPart& ServerWorld::described(Key key) {
  ServerPart& part = partOf(key);
  if (!part.isDescribed) describe(key, part);
  return part;
}

void ServerWorld::describe(Key key, ServerPart& part) {
  part.isDescribed = true;
  const std::optional<b3::DynamicsInfo> dynamics = client_.dynamics(key);
  if (!dynamics) return;
  ServerBody& body = *find(key.body);
  if (dynamics->bodyType == b3::kSoftBody) {
    body.isSoft = true;
    body.mayMove = false;
    return;
  }
  ShapeSigns signs{.dynamics = *dynamics, .halfBounds = client_.halfBounds(key)};
  if (const auto state = stateOf(key)) signs.orientation = state->orientation;
  part.isHeld = listener_.isHeld(part.id) && dynamics->mass > 0.0;
  const BodyDescription description =
      describeBody(signs, part.isHeld, key.link != kBaseLink, radiators_);
  listener_.setBody(part.id, description.contact);
  part.sound = description.sound;
  part.contact = description.contact;
  ears_.takePart(body, part);
  if (!description.contact.isMovable() && client_.states(key.body).size() == 1)
    body.mayMove = false;
}

}  // namespace carom::plugin
