#include "plugin/pybullet/server_sound.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdio>
#include <limits>
#include <sstream>
#include <utility>

#include <unistd.h>

#include "audio/propagation/sound_paths.h"
#include "carom/audio/modal_model_file.h"
#include "carom/audio/normal_map.h"
#include "carom/audio/room.h"
#include "plugin/pybullet/body_description.h"

namespace carom::plugin {
namespace {

constexpr int kBase = -1;
constexpr int kMostBodies = 10'000'000;  // a number beyond is none

// Tolerances (share of the way, and m) within which a body is where its velocity has brought it.
constexpr double kStrayShare = 0.1;
constexpr double kStray = 1e-5;  // m

// Least latency in substeps: contacts become known two substeps late, three where the solver runs
// late; the rest is for the device's blocks.
constexpr double kSubstepsLate = 4.0;
constexpr double kLatency = 0.05;  // s, at least

double substepOf(const b3::SimulationParameters& parameters) {
  return parameters.deltaTime / std::max(1, parameters.substeps);
}

double latencyFor(double substep) {
  return std::max(kLatency, kSubstepsLate * substep);
}

SoundSettings settingsFor(const b3::SimulationParameters& parameters) {
  SoundSettings settings;
  settings.latency = latencyFor(substepOf(parameters));
  settings.listeners = {SoundSettings::defaultListener()};
  settings.listeners.front().position = {0.0, -1.0, 1.0};
  settings.listeners.front().orientation = uprightOrientation();
  settings.onMessage = [](const std::string&) {};  // the command's answer says it
  return settings;
}

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

void write(std::ostream& out, const SoundStatistics& statistics) {
  out << " events=" << statistics.events << " immovable=" << statistics.immovable
      << " rejected=" << statistics.rejected << " inaudible=" << statistics.inaudible
      << " stolen=" << statistics.stolen << " over_budget=" << statistics.overBudget
      << " no_bus=" << statistics.noBus << " too_long=" << statistics.tooLong
      << " skipped=" << statistics.skipped << " queue_faults=" << statistics.queueFaults
      << " late=" << statistics.late << " stalls=" << statistics.stalls
      << " jumps=" << statistics.jumps << " voices=" << statistics.voices
      << " cpu_share=" << statistics.cpuShare;
}

/// Makes `listener` what the parts that are set in `place` say.
Status receiveAs(const command::PlaceListener& place, double sampleRate, Listener& listener) {
  listener.format = place.format.value_or(listener.format);
  listener.spacing = place.spacing.value_or(listener.spacing);
  listener.halfAngle = place.halfAngle.value_or(listener.halfAngle);
  if (place.pattern) listener.pattern = place.pattern;
  if (place.head.empty()) return std::monostate{};
  auto head = loadHrtf(place.head, sampleRate);
  if (!head) return head.error();
  listener.hrtf = *std::move(head);
  return std::monostate{};
}

Room boxRoom(const command::SetRoom& box) {
  Room room;
  room.order = box.order;
  for (int axis = 0; axis < 3; ++axis) {
    room.reflectors.push_back({Vec3::Unit(axis), box.least[axis], box.absorption});
    room.reflectors.push_back({-Vec3::Unit(axis), -box.most[axis], box.absorption});
  }
  return room;
}

/// Numbers as text that any server hands on: two hexadecimal digits for each byte, as they lie in
/// memory.
template <class Number>
std::string inHexadecimal(std::span<const Number> numbers) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (const std::byte each : std::as_bytes(numbers)) {
    const auto value = std::to_integer<unsigned>(each);
    text += kDigits[value >> 4U];
    text += kDigits[value & 15U];
  }
  return text;
}

/// Most frames and events in one answer.
constexpr std::size_t kMostFrames = 48000;
constexpr std::size_t kMostEvents = 10000;

Result<std::string> answer(const Status& status, std::string text) {
  if (!status) return status.error();
  return text;
}

}  // namespace

Result<std::unique_ptr<ServerSound>> ServerSound::create(b3::ServerFunctions server,
                                                         b3::Client client, int name) {
  ServerClient asking(std::move(server), client);
  const std::optional<b3::SimulationParameters> parameters = asking.parameters();
  if (!parameters) return Error{"the physics server does not tell its time step"};
  std::unique_ptr<ServerSound> made(
      new ServerSound(std::move(asking), name, settingsFor(*parameters)));
  if (const Status configured = made->configure(made->settings_); !configured)
    return configured.error();
  for (const int body : made->client_.bodies())
    made->addBody(body);
  return made;
}

/// Makes the sound anew with other settings; what sounds is cut.
Status ServerSound::configure(const SoundSettings& settings) {
  if (isRecording_)
    return Error{"a recording is under way, which has settings of its own; stop it first"};
  Result<EventSound> made = EventSound::create(settings);
  if (!made) return made.error();
  const bool wasPlaying = sound_ && sound_->isPlaying();
  settings_ = settings;
  sound_.emplace(*std::move(made));
  sound_->advanceTo(time_);
  sound_->setGain(gain_);
  sound_->setMuted(isMuted_);
  if (Status told = tellAll(); !told) return told;
  if (isCapturing_)
    if (Status begun = startCapture(); !begun) return begun;
  return wasPlaying ? sound_->play() : std::monostate{};
}

Status ServerSound::startCapture() {
  isCapturing_ = true;
  const auto paths = audio::makeSoundPaths(settings_.synth, settings_.listeners);
  if (!paths) return paths.error();
  events_.emplace(*paths);
  if (Status told = tellAll(); !told) return told;
  return sound_->capture();
}

void ServerSound::resetTo(double seconds) {
  time_ = epoch_ = seconds;
  steps_ = 0;
  isOpen_ = false;
  sound_->advanceTo(seconds);
  if (isCapturing_) (void)startCapture();  // has begun before
}

void ServerSound::beginSubstep() {
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
  suitLatency();
  listener_.begin({time_,
                   duration_,
                   gravity_,
                   {.restitutionSpeed = parameters->restitutionSpeed,
                    .erp = parameters->contactErp,
                    .slop = parameters->contactSlop}});
  beginMotions();
}

/// Has the latency cover the substeps, unless it was given, as long as nothing has been heard yet.
void ServerSound::suitLatency() {
  if (hasLatency_ || steps_ > 0 || epoch_ > 0.0 || isRecording_) return;
  if (latencyFor(duration_) == settings_.latency) return;
  SoundSettings settings = settings_;
  settings.latency = latencyFor(duration_);
  (void)configure(settings);  // differs in nothing else from what there is
}

/// Finds the states at the end of the last substep, which are those at the start of the next one.
void ServerSound::takeStates() {
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
void ServerSound::askFor(int body, BodyMotion& motion, BodyMotion::Source source) {
  const std::span<const BodyState> states = client_.states(body);
  motion.ends.assign(states.begin(), states.end());
  motion.end = source;
}

/// Begins a substep with the states in which the last one has ended.
void ServerSound::beginMotions() {
  ++substep_;
  for (std::size_t number = 0; number < bodies_.size(); ++number) {
    ServerBody& body = bodies_[number];
    if (!body.isThere || !body.mayMove) continue;
    BodyMotion& motion = body.motion;
    std::swap(motion.starts, motion.ends);
    motion.start = std::exchange(motion.end, BodyMotion::Source::unknown);
    int link = kBase;
    for (const BodyState& state : motion.starts) {
      const ServerPart& part = partOf({static_cast<int>(number), link++});
      listener_.state(part.id, state);
      if (part.rings) (void)sound_->moveBody(part.id, {time_, state.position, state.orientation});
    }
  }
}

void ServerSound::endSubstep() {
  if (!(duration_ > 0.0)) return;
  isOpen_ = true;
  time_ = epoch_ + static_cast<double>(++steps_) * duration_;
  if (!isTold_) sound_->advanceTo(time_);
}

/// Hears the impacts of the substep, once its solver has run.
void ServerSound::finishSubstep() {
  if (!std::exchange(isOpen_, false)) return;
  readContacts();
  correctMotions();
  const std::span<const ImpulseEvent> events =
      listener_.finish(points_, [this](BodyId id) { return stateAfter(id); });
  for (const ImpulseEvent& event : events)
    post(event);
  impacts_ += events.size() / 2;
  hearLasting();
  sound_->advanceTo(time_);
}

/// Hears what slides, rolls or rests.
void ServerSound::hearLasting() {
  for (const ContactState& contact :
       lasting_.finish(time_ - duration_, duration_, listener_.contacts(), *this))
    sound_->updateContact(contact);
}

/// Returns how a body has moved over the substep; one that nothing moves rests where it is.
std::optional<SubstepMotion> ServerSound::motionOf(BodyId id) const {
  const ServerBody* const body = bodyOf(id);
  if (body == nullptr) return std::nullopt;
  const auto at = static_cast<std::size_t>(keys_[id].link - kBase);
  const BodyMotion& motion = body->motion;
  SubstepMotion found;
  if (at < body->parts.size()) found.body = body->parts[at].contact;
  if (!body->mayMove) return found;
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

const BodyState* ServerSound::endStateOf(BodyId id) const {
  const ServerBody* const body = bodyOf(id);
  if (body == nullptr || !body->mayMove) return nullptr;
  const BodyMotion& motion = body->motion;
  const auto at = static_cast<std::size_t>(keys_[id].link - kBase);
  if (motion.end != BodyMotion::Source::unknown && at < motion.ends.size()) return &motion.ends[at];
  return at < motion.starts.size() ? &motion.starts[at] : nullptr;
}

/// Looks at how bodies have moved that should follow gravity and their contacts.
void ServerSound::correctMotions() {
  for (std::size_t number = 0; number < bodies_.size(); ++number) {
    ServerBody& body = bodies_[number];
    if (!body.isThere || !body.mayMove || !body.motion.isAwake || body.motion.hasLinks()) continue;
    if (body.motion.start == BodyMotion::Source::unknown ||
        body.motion.end == BodyMotion::Source::unknown || body.motion.ends.empty())
      continue;
    correct(static_cast<int>(number), body);
  }
}

/// Finds out why a body has moved otherwise than free bodies do: the host has put it elsewhere, has
/// thrown it, or something pulls at it all the time.
void ServerSound::correct(int number, ServerBody& body) {
  BodyMotion& motion = body.motion;
  const ServerPart& part = body.part(kBase);
  const FreeMotion free{duration_, gravity_};
  if (motion.loaded != substep_) {
    motion.impulse = motion.angularImpulse = Vec3::Zero();
    motion.isPushed = false;
  }
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
std::optional<BodyState> ServerSound::stateAfter(BodyId id) {
  const ServerBody* const body = bodyOf(id);
  if (body == nullptr) return std::nullopt;
  const auto part = static_cast<std::size_t>(keys_[id].link - kBase);
  if (body->motion.end != BodyMotion::Source::unknown && part < body->motion.ends.size())
    return body->motion.ends[part];
  return stateOf(keys_[id]);
}

void ServerSound::post(const ImpulseEvent& event) {
  sound_->post(event);
  if (!events_) return;
  const Key body = keys_[event.body];
  const Key other = keys_[event.other];
  events_->add(event, {body.body, body.link}, {other.body, other.link});
}

void ServerSound::readContacts() {
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
void ServerSound::addImpulse(const b3::ContactPoint& contact, ServerBody& body, double sign) {
  BodyMotion& motion = body.motion;
  if (!body.mayMove || motion.starts.size() != 1) return;
  if (std::exchange(motion.loaded, substep_) != substep_) {
    motion.impulse = motion.angularImpulse = Vec3::Zero();
    motion.isPushed = false;
  }
  motion.isPushed = motion.isPushed || contact.distance <= pushDistance_;
  const Vec3 force = contact.normalForce * vectorOf(contact.normalOnB) +
                     contact.frictionForces[0] * vectorOf(contact.frictionDirection) +
                     contact.frictionForces[1] * vectorOf(contact.secondFrictionDirection);
  const Vec3 impulse = sign * outer_ * force;
  const Vec3 place = vectorOf(sign > 0.0 ? contact.positionOnA : contact.positionOnB);
  motion.impulse += impulse;
  motion.angularImpulse += (place - motion.starts.front().position).cross(impulse);
}

/// Returns the present state of a body or link.
std::optional<BodyState> ServerSound::stateOf(Key key) {
  const auto part = static_cast<std::size_t>(key.link - kBase);
  const std::span<const BodyState> states = client_.states(key.body);
  if (part >= states.size()) return std::nullopt;
  return states[part];
}

void ServerSound::hear(std::span<const b3::Notification> notifications) {
  // Of several steps only the last has left bodies where they are.
  std::size_t stepped = notifications.size();
  for (std::size_t index = 0; index < notifications.size(); ++index) {
    const b3::Notification& each = notifications[index];
    ServerBody* const body = find(each.body);
    if (each.type == b3::kSimulationReset) {
      for (std::size_t number = 0; number < bodies_.size(); ++number)
        removeBody(static_cast<int>(number));
      resetTo(0.0);
    } else if (each.type == b3::kBodyAdded) {
      addBody(each.body);
    } else if (each.type == b3::kBodyRemoved) {
      removeBody(each.body);
    } else if (each.type == b3::kSimulationStepped) {
      stepped = index;
    } else if (each.type == b3::kSoftBodyChanged && body != nullptr) {
      body->isSoft = true;
      body->mayMove = false;
    } else if (each.type == b3::kLinkDynamicsChanged && body != nullptr && each.link >= kBase) {
      body->mayMove = !body->isSoft;
      partOf({each.body, each.link}).isDescribed = false;
    }
  }
  if (stepped < notifications.size()) hearStep(notifications.subspan(stepped));
}

/// Takes note of where bodies are after a step; those that are not among them sleep.
void ServerSound::hearStep(std::span<const b3::Notification> told) {
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

void ServerSound::hearPlace(const b3::Notification& told) {
  ServerBody* const body = find(told.body);
  if (body == nullptr || !body->mayMove) return;
  BodyMotion& motion = body->motion;
  motion.isAwake = true;
  if (told.link != kBase || motion.starts.size() != 1) return;
  const Vec3 position = vectorOf(told.position);
  const Quat orientation = orientationOf(told.orientation);
  if (!motion.isTold) {
    // The first time, the place is compared with the state that is asked for.
    askFor(told.body, motion, BodyMotion::Source::told);
    motion.isTold =
        motion.ends.size() == 1 && isPlaceOf(motion.ends.front(), position, orientation);
    return;
  }
  motion.ends.assign(1, endOf(motion.starts.front(), position, orientation, duration_));
  motion.end = BodyMotion::Source::told;
}

const ServerBody* ServerSound::find(int body) const {
  if (body < 0 || static_cast<std::size_t>(body) >= bodies_.size()) return nullptr;
  const ServerBody& found = bodies_[static_cast<std::size_t>(body)];
  return found.isThere ? &found : nullptr;
}

const ServerBody* ServerSound::bodyOf(BodyId id) const {
  return id < keys_.size() ? find(keys_[id].body) : nullptr;
}

ServerBody* ServerSound::find(int body) {
  const auto at = static_cast<std::size_t>(body);
  return std::as_const(*this).find(body) != nullptr ? &bodies_[at] : nullptr;
}

void ServerSound::addBody(int body) {
  if (body < 0 || body > kMostBodies) return;
  removeBody(body);  // the number may have been that of another body
  const auto at = static_cast<std::size_t>(body);
  if (at >= bodies_.size()) bodies_.resize(at + 1);
  bodies_[at].isThere = true;
}

void ServerSound::removeBody(int body) {
  ServerBody* const found = find(body);
  if (found == nullptr) return;
  for (const ServerPart& part : found->parts) {
    if (!part.isKnown) continue;
    sound_->removeBody(part.id);
    listener_.removeBody(part.id);
    lasting_.removeBody(part.id);
    if (events_) events_->scheduler().removeBody(part.id);
    keys_[part.id] = {};
  }
  *found = {};
}

/// Returns the part of a body or link, which gets its id if it has none.
ServerPart& ServerSound::partOf(Key key) {
  if (find(key.body) == nullptr) addBody(key.body);  // no notification has come yet
  ServerPart& part = bodies_[static_cast<std::size_t>(key.body)].part(key.link);
  if (!std::exchange(part.isKnown, true)) {
    part.id = static_cast<BodyId>(keys_.size());
    keys_.push_back(key);
  }
  return part;
}

/// Returns the part of a body or link in a contact, described if it is not yet.
const ServerPart& ServerSound::described(Key key) {
  ServerPart& part = partOf(key);
  if (!part.isDescribed) describe(key, part);
  return part;
}

void ServerSound::describe(Key key, ServerPart& part) {
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
  const BodyDescription description =
      describeBody(signs, listener_.isHeld(part.id), key.link != kBase, radiators_);
  listener_.setBody(part.id, description.contact);
  part.sound = description.sound;
  part.contact = description.contact;
  // Refused, its events are counted as rejected; nobody waits for an answer here.
  if (const Status told = tell(body, part); !told)
    (void)std::fprintf(stderr, "carom: body %d, link %d: %s\n", key.body, key.link,
                       told.error().message.c_str());
  if (!description.contact.isMovable() && client_.states(key.body).size() == 1)
    body.mayMove = false;
}

/// Tells the sound how a part sounds.
Status ServerSound::tell(const ServerBody& body, ServerPart& part) {
  const SoundBody sound = soundOf(part, body.assigned);
  part.rings = sound.modal != nullptr;
  if (events_) (void)events_->scheduler().setBody(part.id, sound);
  return sound_->setBody(part.id, sound);
}

Status ServerSound::tellAll() {
  for (ServerBody& body : bodies_)
    for (ServerPart& part : body.parts)
      if (part.isDescribed)
        if (Status told = tell(body, part); !told) return told;
  return std::monostate{};
}

Result<std::string> ServerSound::execute(std::string_view text) {
  const Result<Command> command = parseCommand(text);
  if (!command) return command.error();
  return std::visit([this](const auto& each) { return run(each); }, *command);
}

Result<std::string> ServerSound::run(const command::PlaceListener& place) {
  std::vector<Listener>& listeners = settings_.listeners;
  if (place.index > listeners.size()) {
    return Error{"listener: there is no listener " + std::to_string(place.index) +
                 "; expected 0 to " + std::to_string(listeners.size()) + ", which adds one"};
  }
  const bool isMoved = place.index < listeners.size() && place.isOnlyMoved();
  SoundSettings settings = settings_;
  if (place.index == listeners.size()) {
    settings.listeners.push_back(SoundSettings::defaultListener());
    settings.listeners.back().name += " " + std::to_string(place.index);
  }
  Listener& listener = settings.listeners[place.index];
  listener.position = place.position;
  listener.orientation = place.orientation;
  if (!isMoved) {
    if (const Status made = receiveAs(place, settings.synth.sampleRate, listener); !made)
      return made.error();
    return answer(configure(settings), "listener " + std::to_string(place.index) + " set");
  }
  if (const Status moved = sound_->setListener(place.position, place.orientation, place.index);
      !moved)
    return moved.error();
  settings_ = std::move(settings);
  if (events_)
    (void)events_->scheduler().placeListener(place.index,
                                             {time_, place.position, place.orientation});
  return std::string("listener placed");
}

/// Assigns a part of what is heard to a body or one link of it.
template <class Part>
Status ServerSound::assign(std::string_view command, const command::Target& target,
                           std::optional<Part> AssignedParts::*part, const Part& value) {
  const int links = static_cast<int>(client_.states(target.body).size()) - 1;  // besides the base
  const std::string name(command);
  if (links < 0) return Error{name + ": the server has no body " + std::to_string(target.body)};
  if (target.link.value_or(kBase) >= links) {
    return Error{name + ": body " + std::to_string(target.body) + " has no link " +
                 std::to_string(*target.link) + "; its links are -1 to " +
                 std::to_string(links - 1)};
  }
  if (find(target.body) == nullptr) addBody(target.body);
  ServerBody& body = *find(target.body);
  if (target.link) {
    partOf({target.body, *target.link}).assigned.*part = value;
  } else {
    body.assigned.*part = value;
    for (ServerPart& each : body.parts)
      (each.assigned.*part).reset();
  }
  for (ServerPart& each : body.parts)
    if (each.isDescribed)
      if (Status told = tell(body, each); !told) return told;
  return std::monostate{};
}

Result<std::string> ServerSound::run(const command::SetMaterial& set) {
  return answer(assign("material", set.target, &AssignedParts::material, set.name),
                "body " + std::to_string(set.target.body) + " is of " + set.name);
}

Result<std::string> ServerSound::run(const command::SetModes& set) {
  std::shared_ptr<const ModalModel> model;
  if (!set.file.empty()) {
    Result<ModalModel> read = readModalModel(set.file);
    if (!read) return read.error();
    model = std::make_shared<const ModalModel>(*std::move(read));
  }
  return answer(assign("modes", set.target, &AssignedParts::modes, model),
                "body " + std::to_string(set.target.body) + (model ? " rings" : " does not ring"));
}

Result<std::string> ServerSound::run(const command::SetTexture& set) {
  std::shared_ptr<const SurfaceTexture> texture;
  if (!set.file.empty()) {
    Result<SurfaceTexture> read = readNormalMap(set.file, {.size = set.size});
    if (!read) return read.error();
    texture = std::make_shared<const SurfaceTexture>(*std::move(read));
  }
  return answer(assign("texture", set.target, &AssignedParts::texture, texture),
                "body " + std::to_string(set.target.body) +
                    (texture ? " has bumps" : " has its material's roughness"));
}

Result<std::string> ServerSound::run(const command::SetRoom& set) {
  SoundSettings settings = settings_;
  settings.synth.room = set.isBox ? boxRoom(set) : Room{};
  settings.synth.reverb = std::nullopt;
  if (set.isBox && set.hasReverb) {
    const Result<ReverbSettings> reverb =
        reverbOfBox(settings.synth.room, settings.synth.medium.speedOfSound);
    if (!reverb) return Error{"room: " + reverb.error().message + "; expected reverb=off"};
    settings.synth.reverb = *reverb;
  }
  return answer(configure(settings), set.isBox ? "room set" : "no room");
}

Result<std::string> ServerSound::run(const command::SetLevel& set) {
  SoundSettings settings = settings_;
  settings.level = set.fullScale ? Level::fixed : Level::automatic;
  settings.fullScale = set.fullScale;
  return answer(configure(settings), "level set");
}

Result<std::string> ServerSound::run(const command::SetLatency& set) {
  SoundSettings settings = settings_;
  settings.latency = set.seconds;
  const Status done = configure(settings);
  hasLatency_ = hasLatency_ || done;
  return answer(done, "latency set");
}

Result<std::string> ServerSound::run(const command::Capture&) {
  return answer(startCapture(), "samples and events are kept");
}

Result<std::string> ServerSound::run(const command::Reset& reset) {
  resetTo(reset.time);
  return std::string("reset");
}

Result<std::string> ServerSound::run(const command::Record& record) {
  const Status begun = sound_->record(record.file);
  isRecording_ = isRecording_ || begun;
  return answer(begun, "recording to " + record.file.string());
}

Result<std::string> ServerSound::run(const command::SetGain& set) {
  gain_ = set.gain;
  sound_->setGain(gain_);
  return std::string("gain set");
}

Result<std::string> ServerSound::run(const command::Mute& mute) {
  isMuted_ = mute.on;
  sound_->setMuted(isMuted_);
  return std::string(mute.on ? "muted" : "not muted");
}

Result<std::string> ServerSound::run(const command::Play&) {
  return answer(sound_->play(), "playing");
}

Result<std::string> ServerSound::run(const command::Stop&) {
  sound_->stop();
  isRecording_ = false;
  return answer(sound_->finishRecording(), "stopped");
}

Result<std::string> ServerSound::run(const command::Pause&) {
  sound_->pause();
  return std::string("paused until the next step");
}

Result<std::string> ServerSound::run(const command::Stats&) {
  std::ostringstream text;
  text << "time=" << time_ << " bodies=" << std::ranges::count(bodies_, true, &ServerBody::isThere)
       << " impacts=" << impacts_ << " soft_contacts=" << softContacts_;
  write(text, sound_->statistics());
  return text.str();
}

Result<std::string> ServerSound::run(const command::Describe&) {
  std::ostringstream text;
  text.precision(17);
  text << "process=" << getpid() << " instance=" << name_ << " rate=" << settings_.synth.sampleRate
       << " channels=" << channels() << " listeners=" << settings_.listeners.size()
       << " latency=" << settings_.latency << " time=" << time_;
  return text.str();
}

Result<std::string> ServerSound::run(const command::TakeSamples&) {
  std::vector<float> samples(std::min(framesReady(), kMostFrames) * channels());
  takeFrames(samples);
  return "samples=" + inHexadecimal(std::span<const float>(samples));
}

Result<std::string> ServerSound::run(const command::TakeEvents&) {
  std::vector<double> rows(std::min(eventsReady(), kMostEvents) * eventColumns());
  takeEvents(rows);
  return "events=" + inHexadecimal(std::span<const double>(rows));
}

Result<std::string> ServerSound::run(const command::Help&) {
  return std::string(kCommandHelp);
}

}  // namespace carom::plugin
