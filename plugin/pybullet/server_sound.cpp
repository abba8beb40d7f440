#include "plugin/pybullet/server_sound.h"

#include <algorithm>
#include <sstream>
#include <utility>

#include "plugin/pybullet/body_description.h"

namespace carom::plugin {
namespace {

constexpr int kBase = -1;
constexpr int kAllLinks = -2;
constexpr double kMoves = 1e-3;  // m/s: in a substep, more than the rounding of places

// Least latency in substeps: contacts become known two substeps late, three where the solver runs
// late; the rest is for the device's blocks.
constexpr double kSubstepsLate = 4.0;
constexpr double kLatency = 0.05;  // s, at least

double substepOf(const b3::SimulationParameters& parameters) {
  return parameters.deltaTime / std::max(1, parameters.substeps);
}

SoundSettings settingsFor(const b3::SimulationParameters& parameters) {
  SoundSettings settings;
  settings.latency = std::max(kLatency, kSubstepsLate * substepOf(parameters));
  settings.listeners = {SoundSettings::defaultListener()};
  settings.listeners.front().position = {0.0, -1.0, 1.0};
  settings.listeners.front().orientation = uprightOrientation();
  settings.onMessage = [](const std::string&) {};  // the command's answer says it
  return settings;
}

Vec3 vectorOf(const std::array<double, 3>& values) {
  return {values[0], values[1], values[2]};
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

Result<std::string> answer(const Status& status, std::string text) {
  if (!status) return status.error();
  return text;
}

}  // namespace

Result<std::unique_ptr<ServerSound>> ServerSound::create(b3::ServerFunctions server,
                                                         b3::Client client) {
  ServerClient asking(std::move(server), client);
  const std::optional<b3::SimulationParameters> parameters = asking.parameters();
  if (!parameters) return Error{"the physics server does not tell its time step"};
  Result<EventSound> sound = EventSound::create(settingsFor(*parameters));
  if (!sound) return sound.error();
  std::unique_ptr<ServerSound> made(new ServerSound(std::move(asking), *std::move(sound)));
  for (const int body : made->client_.bodies())
    made->addBody(body);
  return made;
}

void ServerSound::beginSubstep() {
  finishSubstep();
  const std::optional<b3::SimulationParameters> parameters = client_.parameters();
  duration_ = parameters ? substepOf(*parameters) : 0.0;
  if (!(duration_ > 0.0)) return;
  outer_ = parameters->deltaTime;
  listener_.begin({time_,
                   duration_,
                   vectorOf(parameters->gravity),
                   {.restitutionSpeed = parameters->restitutionSpeed,
                    .erp = parameters->contactErp,
                    .slop = parameters->contactSlop}});
  for (const auto& [body, mayMove] : bodies_) {
    if (!mayMove) continue;
    int link = kBase;
    const std::span<const BodyState> states = client_.states(body);
    for (const BodyState& state : states)
      listener_.state(idOf({body, link++}), state);
    const bool moves = !states.empty() && states.front().velocity.norm() > kMoves;
    if (!solverComesLater_ && !probe_ && moves) probe_ = {body, states.front().position};
  }
}

/// Finds out, at the end of a substep as the server tells it, whether bodies have moved yet.
void ServerSound::lookForSolver() {
  if (solverComesLater_ || !probe_) return;
  const std::span<const BodyState> states = client_.states(probe_->body);
  if (!states.empty()) solverComesLater_ = states.front().position == probe_->position;
  probe_.reset();
}

void ServerSound::endSubstep() {
  if (!(duration_ > 0.0)) return;
  lookForSolver();
  isOpen_ = true;
  if (!solverComesLater_.value_or(false)) finishSubstep();
  time_ += duration_;
  sound_.advanceTo(time_);
}

/// Hears the impacts of the substep, once the solver has run.
void ServerSound::finishSubstep() {
  if (!std::exchange(isOpen_, false)) return;
  readContacts();
  const std::span<const ImpulseEvent> events =
      listener_.finish(points_, [this](BodyId id) { return stateOf(id); });
  for (const ImpulseEvent& event : events)
    sound_.post(event);
  impacts_ += events.size() / 2;
}

void ServerSound::readContacts() {
  points_.clear();
  for (const b3::ContactPoint& contact : client_.contacts()) {
    const Key body{contact.bodyA, contact.linkA};
    const Key other{contact.bodyB, contact.linkB};
    if (body.body < 0 || other.body < 0 || body == other) continue;
    points_.push_back({knownAs(body).id, knownAs(other).id, vectorOf(contact.positionOnA),
                       vectorOf(contact.positionOnB), vectorOf(contact.normalOnB), contact.distance,
                       contact.normalForce * outer_});
  }
}

/// Returns the present state of a body or link.
std::optional<BodyState> ServerSound::stateOf(BodyId id) {
  const auto known =
      std::ranges::find_if(known_, [id](const auto& entry) { return entry.second.id == id; });
  if (known == known_.end()) return std::nullopt;
  return stateOf(known->first);
}

std::optional<BodyState> ServerSound::stateOf(Key key) {
  const auto part = static_cast<std::size_t>(key.link - kBase);
  const std::span<const BodyState> states = client_.states(key.body);
  if (part >= states.size()) return std::nullopt;
  return states[part];
}

void ServerSound::hear(std::span<const b3::Notification> notifications) {
  for (const b3::Notification& each : notifications) {
    if (each.type == b3::kSimulationReset) {
      solverComesLater_.reset();  // the world may be another one
      probe_.reset();
      isOpen_ = false;
      while (!bodies_.empty())
        removeBody(bodies_.begin()->first);
    } else if (each.type == b3::kBodyAdded) {
      addBody(each.body);
    } else if (each.type == b3::kBodyRemoved) {
      removeBody(each.body);
    } else if (each.type == b3::kLinkDynamicsChanged) {
      if (const auto body = bodies_.find(each.body); body != bodies_.end()) body->second = true;
      if (const auto known = known_.find({each.body, each.link}); known != known_.end())
        known->second.isDescribed = false;
    }
  }
}

void ServerSound::addBody(int body) {
  removeBody(body);  // the number may have been that of another body
  bodies_[body] = true;
}

void ServerSound::removeBody(int body) {
  const auto isOfBody = [body](const auto& entry) { return entry.first.body == body; };
  for (const auto& [key, known] : known_) {
    if (key.body != body) continue;
    sound_.removeBody(known.id);
    listener_.removeBody(known.id);
  }
  std::erase_if(known_, isOfBody);
  std::erase_if(materials_, isOfBody);
  bodies_.erase(body);
}

ServerSound::Known& ServerSound::entry(Key key) {
  const auto [found, isNew] = known_.try_emplace(key);
  if (isNew) found->second.id = nextId_++;
  return found->second;
}

BodyId ServerSound::idOf(Key key) {
  return entry(key).id;
}

// Returns the entry of a body or link in a contact, described if it is not yet.
ServerSound::Known& ServerSound::knownAs(Key key) {
  Known& known = entry(key);
  if (!known.isDescribed) describe(key, known);
  return known;
}

void ServerSound::describe(Key key, Known& known) {
  known.isDescribed = true;
  bodies_.try_emplace(key.body, true);  // if no notification has come yet
  const std::optional<b3::DynamicsInfo> dynamics = client_.dynamics(key);
  if (!dynamics) return;
  ShapeSigns signs{.dynamics = *dynamics, .halfBounds = client_.halfBounds(key)};
  if (const auto state = stateOf(key)) signs.orientation = state->orientation;
  const BodyDescription body =
      describeBody(signs, listener_.isHeld(known.id), key.link != kBase, radiators_);
  listener_.setBody(known.id, body.contact);
  known.sound = body.sound;
  (void)tell(key, known);  // refused: its events are counted as rejected
  if (!body.contact.isMovable() && client_.states(key.body).size() == 1) bodies_[key.body] = false;
}

Status ServerSound::tell(Key key, const Known& known) {
  SoundBody body = known.sound;
  auto set = materials_.find(key);
  if (set == materials_.end()) set = materials_.find({key.body, kAllLinks});
  if (set != materials_.end()) {
    const double restitution = body.material.restitution;  // the server's
    body.material = *findMaterial(set->second);
    body.material.restitution = restitution;
  }
  return sound_.setBody(known.id, body);
}

Result<std::string> ServerSound::execute(std::string_view text) {
  const Result<Command> command = parseCommand(text);
  if (!command) return command.error();
  return std::visit([this](const auto& each) { return run(each); }, *command);
}

Result<std::string> ServerSound::run(const command::PlaceListener& place) {
  return answer(sound_.setListener(place.position, place.orientation), "listener placed");
}

Result<std::string> ServerSound::run(const command::SetMaterial& set) {
  const int links = static_cast<int>(client_.states(set.body).size()) - 1;  // besides the base
  if (links < 0) return Error{"material: the server has no body " + std::to_string(set.body)};
  if (set.link.value_or(kBase) >= links) {
    return Error{"material: body " + std::to_string(set.body) + " has no link " +
                 std::to_string(*set.link) + "; its links are -1 to " + std::to_string(links - 1)};
  }
  if (!set.link) {
    std::erase_if(materials_, [&](const auto& entry) { return entry.first.body == set.body; });
  }
  materials_[{set.body, set.link.value_or(kAllLinks)}] = set.name;
  for (const auto& [key, known] : known_) {
    if (key.body != set.body || !known.isDescribed) continue;
    if (const Status told = tell(key, known); !told) return told.error();
  }
  return "body " + std::to_string(set.body) + " is of " + set.name;
}

Result<std::string> ServerSound::run(const command::Record& record) {
  return answer(sound_.record(record.file), "recording to " + record.file.string());
}

Result<std::string> ServerSound::run(const command::SetGain& set) {
  sound_.setGain(set.gain);
  return std::string("gain set");
}

Result<std::string> ServerSound::run(const command::Mute& mute) {
  sound_.setMuted(mute.on);
  return std::string(mute.on ? "muted" : "not muted");
}

Result<std::string> ServerSound::run(const command::Play&) {
  return answer(sound_.play(), "playing");
}

Result<std::string> ServerSound::run(const command::Stop&) {
  sound_.stop();
  return answer(sound_.finishRecording(), "stopped");
}

Result<std::string> ServerSound::run(const command::Pause&) {
  sound_.pause();
  return std::string("paused until the next step");
}

Result<std::string> ServerSound::run(const command::Stats&) {
  std::ostringstream text;
  text << "time=" << time_ << " bodies=" << bodies_.size() << " impacts=" << impacts_;
  write(text, sound_.statistics());
  return text.str();
}

Result<std::string> ServerSound::run(const command::Help&) {
  return std::string(kCommandHelp);
}

}  // namespace carom::plugin
