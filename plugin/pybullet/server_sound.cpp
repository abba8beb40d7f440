#include "plugin/pybullet/server_sound.h"

#include <algorithm>
#include <cstddef>
#include <cstdio>
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
constexpr double kMoves = 1e-3;  // m/s: in a substep, more than the rounding of places

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
  if (const Status told = tellAll(); !told) return told;
  if (isCapturing_)
    if (const Status begun = startCapture(); !begun) return begun;
  return wasPlaying ? sound_->play() : std::monostate{};
}

Status ServerSound::startCapture() {
  isCapturing_ = true;
  const auto paths = audio::makeSoundPaths(settings_.synth, settings_.listeners);
  if (!paths) return paths.error();
  events_.emplace(*paths);
  if (const Status told = tellAll(); !told) return told;
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
  finishSubstep();
  const std::optional<b3::SimulationParameters> parameters = client_.parameters();
  duration_ = parameters ? substepOf(*parameters) : 0.0;
  if (!(duration_ > 0.0)) return;
  outer_ = parameters->deltaTime;
  if (duration_ != counted_) {
    epoch_ = time_;
    steps_ = 0;
    counted_ = duration_;
  }
  suitLatency();
  listener_.begin({time_,
                   duration_,
                   vectorOf(parameters->gravity),
                   {.restitutionSpeed = parameters->restitutionSpeed,
                    .erp = parameters->contactErp,
                    .slop = parameters->contactSlop}});
  for (auto& [number, body] : bodies_) {
    if (!body.mayMove) continue;
    int link = kBase;
    const std::span<const BodyState> states = client_.states(number);
    for (const BodyState& state : states) {
      const ServerPart& part = partOf({number, link++});
      listener_.state(part.id, state);
      if (part.rings) (void)sound_->moveBody(part.id, {time_, state.position, state.orientation});
    }
    const bool moves = !states.empty() && states.front().velocity.norm() > kMoves;
    if (!solverComesLater_ && !probe_ && moves) probe_ = {number, states.front().position};
  }
}

/// Has the latency cover the substeps, unless it was given, as long as nothing has been heard yet.
void ServerSound::suitLatency() {
  if (hasLatency_ || steps_ > 0 || epoch_ > 0.0 || isRecording_) return;
  if (latencyFor(duration_) == settings_.latency) return;
  SoundSettings settings = settings_;
  settings.latency = latencyFor(duration_);
  (void)configure(settings);  // differs in nothing else from what there is
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
  time_ = epoch_ + static_cast<double>(++steps_) * duration_;
  sound_->advanceTo(time_);
}

/// Hears the impacts of the substep, once the solver has run.
void ServerSound::finishSubstep() {
  if (!std::exchange(isOpen_, false)) return;
  readContacts();
  const std::span<const ImpulseEvent> events =
      listener_.finish(points_, [this](BodyId id) { return stateOf(id); });
  for (const ImpulseEvent& event : events)
    post(event);
  impacts_ += events.size() / 2;
}

void ServerSound::post(const ImpulseEvent& event) {
  sound_->post(event);
  if (!events_) return;
  const Key body = keys_.at(event.body);
  const Key other = keys_.at(event.other);
  events_->add(event, {body.body, body.link}, {other.body, other.link});
}

void ServerSound::readContacts() {
  points_.clear();
  for (const b3::ContactPoint& contact : client_.contacts()) {
    const Key body{contact.bodyA, contact.linkA};
    const Key other{contact.bodyB, contact.linkB};
    if (body.body < 0 || other.body < 0 || body == other) continue;
    points_.push_back({described(body).id, described(other).id, vectorOf(contact.positionOnA),
                       vectorOf(contact.positionOnB), vectorOf(contact.normalOnB), contact.distance,
                       contact.normalForce * outer_});
  }
}

/// Returns the present state of a body or link.
std::optional<BodyState> ServerSound::stateOf(BodyId id) {
  const auto key = keys_.find(id);
  if (key == keys_.end()) return std::nullopt;
  return stateOf(key->second);
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
      while (!bodies_.empty())
        removeBody(bodies_.begin()->first);
      resetTo(0.0);
    } else if (each.type == b3::kBodyAdded) {
      addBody(each.body);
    } else if (each.type == b3::kBodyRemoved) {
      removeBody(each.body);
    } else if (each.type == b3::kLinkDynamicsChanged) {
      const auto body = bodies_.find(each.body);
      if (body == bodies_.end() || each.link < kBase) continue;
      body->second.mayMove = true;
      partOf({each.body, each.link}).isDescribed = false;
    }
  }
}

void ServerSound::addBody(int body) {
  removeBody(body);  // the number may have been that of another body
  bodies_[body] = {};
}

void ServerSound::removeBody(int body) {
  const auto found = bodies_.find(body);
  if (found == bodies_.end()) return;
  for (const ServerPart& part : found->second.parts) {
    if (!part.isKnown) continue;
    sound_->removeBody(part.id);
    listener_.removeBody(part.id);
    if (events_) events_->scheduler().removeBody(part.id);
    keys_.erase(part.id);
  }
  bodies_.erase(found);
}

/// Returns the part of a body or link, which gets its id if it has none.
ServerPart& ServerSound::partOf(Key key) {
  ServerPart& part = bodies_[key.body].part(key.link);
  if (!std::exchange(part.isKnown, true)) {
    part.id = nextId_++;
    keys_[part.id] = key;
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
  ShapeSigns signs{.dynamics = *dynamics, .halfBounds = client_.halfBounds(key)};
  if (const auto state = stateOf(key)) signs.orientation = state->orientation;
  const BodyDescription description =
      describeBody(signs, listener_.isHeld(part.id), key.link != kBase, radiators_);
  listener_.setBody(part.id, description.contact);
  part.sound = description.sound;
  ServerBody& body = bodies_[key.body];
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
  for (auto& [number, body] : bodies_)
    for (ServerPart& part : body.parts)
      if (part.isDescribed)
        if (const Status told = tell(body, part); !told) return told;
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
  ServerBody& body = bodies_[target.body];
  if (target.link) {
    partOf({target.body, *target.link}).assigned.*part = value;
  } else {
    body.assigned.*part = value;
    for (ServerPart& each : body.parts)
      (each.assigned.*part).reset();
  }
  for (ServerPart& each : body.parts)
    if (each.isDescribed)
      if (const Status told = tell(body, each); !told) return told;
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
  text << "time=" << time_ << " bodies=" << bodies_.size() << " impacts=" << impacts_;
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
