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

namespace carom::plugin {
namespace {

// Least latency in substeps: contacts become known two substeps late, three where the solver runs
// late; the rest is for the device's blocks.
constexpr double kSubstepsLate = 4.0;
constexpr double kLatency = 0.05;  // s, at least

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
                                                         b3::Client client) {
  ServerClient asking(std::move(server), client);
  const std::optional<b3::SimulationParameters> parameters = asking.parameters();
  if (!parameters) return Error{"the physics server does not tell its time step"};
  std::unique_ptr<ServerSound> made(new ServerSound(std::move(asking), settingsFor(*parameters)));
  if (const Status configured = made->configure(made->settings_); !configured)
    return configured.error();
  made->world_.begin();
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
  sound_->advanceTo(world_.time());
  sound_->setGain(gain_);
  sound_->setMuted(isMuted_);
  world_.tellParts();
  if (keptRun_ > 0.0)
    if (Status kept = sound_->keepRun(keptRun_); !kept) return kept;
  if (isCapturing_)
    if (Status begun = startCapture(); !begun) return begun;
  return wasPlaying ? sound_->play() : std::monostate{};
}

Status ServerSound::startCapture() {
  isCapturing_ = true;
  const auto paths = audio::makeSoundPaths(settings_.synth, settings_.listeners);
  if (!paths) return paths.error();
  events_.emplace(*paths);
  world_.tellParts();
  return sound_->capture();
}

/// Lets the sound follow a clock that was set.
void ServerSound::followClock() {
  sound_->advanceTo(world_.time());
  if (isCapturing_) (void)startCapture();  // has begun before
}

/// Has the latency cover the substeps, unless it was given, as long as nothing has been heard yet.
void ServerSound::beginSubstep(double duration) {
  if (hasLatency_ || latencyFor(duration) == settings_.latency) return;
  if (!world_.isAtStart() || isRecording_) {
    if (latencyFor(duration) > settings_.latency && !std::exchange(hasWarned_, true))
      (void)std::fprintf(stderr,
                         "carom: the time step has grown: contacts become known too late for the "
                         "latency of %g s; set the time step before the first step\n",
                         settings_.latency);
    return;
  }
  SoundSettings settings = settings_;
  settings.latency = latencyFor(duration);
  (void)configure(settings);  // differs in nothing else from what there is
}

void ServerSound::takePart(const ServerBody& body, ServerPart& part) {
  // Refused, its events are counted as rejected; nobody waits for an answer here.
  const Status told = tell(body, part);
  const Key key = world_.keyOf(part.id);
  if (!told)
    (void)std::fprintf(stderr, "carom: body %d, link %d: %s\n", key.body, key.link,
                       told.error().message.c_str());
}

void ServerSound::removePart(BodyId id) {
  sound_->removeBody(id);
  if (events_) events_->scheduler().removeBody(id);
}

void ServerSound::movePart(BodyId id, const ListenerPose& pose) {
  (void)sound_->moveBody(id, pose);  // refused: the part was refused before
}

void ServerSound::hear(const ImpulseEvent& share) {
  sound_->post(share);
  if (!events_) return;
  events_->add(share, world_.keyOf(share.body), world_.keyOf(share.other));
}

void ServerSound::hear(const ContactState& contact) {
  sound_->updateContact(contact);
}

void ServerSound::advanceTo(double time) {
  sound_->advanceTo(time);
}

void ServerSound::restart() {
  followClock();
}

/// Tells the sound how a part sounds.
Status ServerSound::tell(const ServerBody& body, ServerPart& part) {
  const SoundBody sound = soundOf(part, body.assigned);
  part.rings = sound.modal != nullptr;
  if (events_) (void)events_->scheduler().setBody(part.id, sound);
  return sound_->setBody(part.id, sound);
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
                                             {world_.time(), place.position, place.orientation});
  return std::string("listener placed");
}

/// Assigns a part of what is heard to a body or one link of it.
template <class Part>
Status ServerSound::assign(std::string_view command, const command::Target& target,
                           std::optional<Part> AssignedParts::*part, const Part& value) {
  const int links = world_.linkCount(target.body);
  const std::string name(command);
  if (links < 0) return Error{name + ": the server has no body " + std::to_string(target.body)};
  if (target.link.value_or(kBaseLink) >= links) {
    return Error{name + ": body " + std::to_string(target.body) + " has no link " +
                 std::to_string(*target.link) + "; its links are -1 to " +
                 std::to_string(links - 1)};
  }
  ServerBody& body = world_.body(target.body);
  if (target.link) {
    world_.partOf({target.body, *target.link}).assigned.*part = value;
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
  world_.setTime(reset.time);
  followClock();
  return std::string("reset");
}

Result<std::string> ServerSound::run(const command::Record& record) {
  const Status begun = sound_->record(record.file);
  isRecording_ = isRecording_ || begun;
  return answer(begun, "recording to " + record.file.string());
}

Result<std::string> ServerSound::run(const command::RecordRun& record) {
  const Status begun = sound_->recordRun(record.file);
  isRecording_ = isRecording_ || begun;
  return answer(begun, "recording the run to " + record.file.string());
}

Result<std::string> ServerSound::run(const command::KeepRun& keep) {
  const Status begun = sound_->keepRun(keep.seconds);
  if (begun) keptRun_ = keep.seconds;
  return answer(begun, "the run is kept");
}

Result<std::string> ServerSound::run(const command::SaveRun& save) {
  return answer(sound_->saveRun(save.file), "saved to " + save.file.string());
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
  const Status run = sound_->finishRun();
  const Status recording = sound_->finishRecording();
  return answer(recording ? run : recording, "stopped");
}

Result<std::string> ServerSound::run(const command::Pause&) {
  sound_->pause();
  return std::string("paused until the next step");
}

Result<std::string> ServerSound::run(const command::Stats&) {
  std::ostringstream text;
  text << "time=" << world_.time() << " bodies=" << world_.bodyCount()
       << " impacts=" << world_.impacts() << " soft_contacts=" << world_.softContacts();
  write(text, sound_->statistics());
  return text.str();
}

Result<std::string> ServerSound::run(const command::Describe&) {
  std::ostringstream text;
  text.precision(17);
  text << "process=" << getpid() << " instance=" << name_ << " rate=" << settings_.synth.sampleRate
       << " channels=" << channels() << " listeners=" << settings_.listeners.size()
       << " latency=" << settings_.latency << " time=" << world_.time();
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

Result<std::string> ServerSound::run(const command::Report&) {
  return sound_->report();
}
Result<std::string> ServerSound::run(const command::Help&) {
  return std::string(kCommandHelp);
}

}  // namespace carom::plugin
