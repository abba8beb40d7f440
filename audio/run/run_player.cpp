#include "audio/run/run_player.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "audio/run/open_contacts.h"

namespace carom::audio {
namespace {

constexpr std::size_t kBlock = 1024;  // frames that are rendered at a time
/// s, within which a listener at the end of its path comes to rest: PoseTrack would go on longer.
constexpr double kStop = 1e-3;
/// s: the sound of a contact begins so long before it, or less, see Synth::leadTime; of contacts
/// above 10 ms a part is cut where a sound begins.
constexpr double kLead = 0.02;
/// s: what deforms is known so long before it is heard, so that its beginning is no sound.
constexpr double kDeformed = 0.1;

/// True for both shares of one collision.
bool isOfOne(const ImpulseEvent& event, const ImpulseEvent& share) {
  return event.time == share.time && ((event.body == share.body && event.other == share.other) ||
                                      (event.body == share.other && event.other == share.body));
}

}  // namespace

RunPlayer::RunPlayer(PlayableRun run, double sampleRate)
    : run_(std::move(run)), sampleRate_(sampleRate), isMuted_(run_.world.bodies) {
  run_.world.synth.sampleRate = sampleRate;
  ear_.position = run_.world.listeners.front().position;
  ear_.orientation = run_.world.listeners.front().orientation;
  placed_ = ear_;
}

/// Brings the order of events up to date.
void RunPlayer::orderEvents() {
  if (isOrdered_) return;
  isOrdered_ = true;
  firstEvents_.clear();
  std::size_t events = 0;
  for (const RunPortion& portion : run_.portions) {
    firstEvents_.push_back(events);
    events += portion.events.size();
  }
  order_ = eventsInOrder(run_);
}

Status RunPlayer::append(RunMore more) {
  for (const PlayableRun::Bodies& bodies : more.bodies)
    for (const HostBody& body : bodies.bodies)
      if (body.id >= run_.world.bodies) return Error{"the run has no room for another body"};
  isOrdered_ = false;
  std::ranges::move(more.bodies, std::back_inserter(run_.bodies));
  std::ranges::move(more.portions, std::back_inserter(run_.portions));
  return std::monostate{};
}

void RunPlayer::cut(std::size_t portions) {
  isOrdered_ = false;
  run_.portions.resize(std::min(portions, run_.portions.size()));
  std::erase_if(run_.bodies,
                [portions](const PlayableRun::Bodies& added) { return added.portion > portions; });
}

Result<RunPlayer> RunPlayer::create(PlayableRun run, double sampleRate) {
  RunPlayer player(std::move(run), sampleRate);
  if (const Status begun = player.seek({}); !begun) return begun.error();
  return player;
}

void RunPlayer::setAudible(BodyId body, bool isAudible) {
  if (body < isMuted_.size()) isMuted_[body] = !isAudible;
}

Status RunPlayer::placeEar(const ListenerPose& pose) {
  if (!isPose(pose))
    return Error{"the ear's pose is not finite, or its orientation of unit length"};
  ear_ = placed_ = pose;
  isMoved_ = false;
  if (followed_ || !synth_) return std::monostate{};
  if (voice_) voice_->track(0).restart(pose);
  return synth_->placeListener(0, pose);
}

Status RunPlayer::moveEar(const ListenerPose& pose) {
  if (!isPose(pose))
    return Error{"the ear's pose is not finite, or its orientation of unit length"};
  ear_ = pose;
  isMoved_ = true;
  return std::monostate{};
}

/// Returns the listeners of the next sound.
Result<std::vector<Listener>> RunPlayer::chosenListeners() const {
  std::vector<Listener> listeners;
  if (followed_) {
    if (*followed_ >= run_.world.listeners.size()) return Error{"the run has no such listener"};
    listeners = run_.world.listeners;
  } else {
    listeners.push_back({"ear", ear_.position});
    listeners.front().orientation = ear_.orientation;
    listeners.front().format = format_;
  }
  for (std::size_t index = 0; index < listeners.size(); ++index) {
    Listener& listener = listeners[index];
    if (listener.format != ListenerFormat::binaural) continue;
    listener.hrtf = head_;
    if (head_ != nullptr) continue;
    if (index == followed_.value_or(0)) return Error{"a binaural listener needs a head"};
    listener.format = ListenerFormat::spacedPair;  // beside the one that is heard
  }
  return listeners;
}

Status RunPlayer::chooseListeners() {
  Result<std::vector<Listener>> listeners = chosenListeners();
  if (!listeners) return listeners.error();
  listeners_ = *std::move(listeners);
  firstChannel_ = 0;
  for (std::size_t index = 0; index < followed_.value_or(0); ++index)
    firstChannel_ += channelCount(listeners_[index]);
  channelCount_ = channelCount(listeners_[followed_.value_or(0)]);
  return std::monostate{};
}

/// True if the synthesis was made for the listeners of the next sound, of which the run's own are
/// always the same.
bool RunPlayer::isHeardSo() const {
  const std::vector<Listener>& made = synth_->listeners();
  if (made.size() != listeners_.size()) return false;
  for (std::size_t index = 0; index < made.size(); ++index) {
    const Listener& one = made[index];
    const Listener& other = listeners_[index];
    if (one.name != other.name || one.format != other.format || one.hrtf != other.hrtf ||
        one.position != other.position || one.orientation.coeffs() != other.orientation.coeffs())
      return false;
  }
  return true;
}

/// Makes the synthesis of the next sound, with its listeners but without bodies.
Status RunPlayer::makeSynth() {
  SynthSettings settings = run_.world.synth;
  isWhole_ = std::ranges::all_of(stems_, [](bool isHeard) { return isHeard; });
  settings.stems = !isWhole_;
  if (synth_ && settings.stems == hasStems_ && isHeardSo()) {
    synth_ = synth_->fresh();
  } else {
    Result<Synth> synth = Synth::create(settings, listeners_);
    if (!synth) return synth.error();
    synth_ = *std::move(synth);
    hasStems_ = settings.stems;
  }
  planes_.assign(synth_->channelCount(), std::vector<float>(kBlock));
  voice_.reset();
  if (!(run_.deformationStep > 0.0) || only_ || !stems_[static_cast<std::size_t>(Stem::rings)])
    return std::monostate{};
  Result<DeformingVoice> voice =
      DeformingVoice::create({.step = run_.deformationStep / start_.speed,
                              .sampleRate = sampleRate_,
                              .medium = settings.medium},
                             listeners_);
  if (!voice) return voice.error();
  voice_ = *std::move(voice);
  return std::monostate{};
}

Status RunPlayer::seek(const Start& start) {
  if (!(start.speed >= kSlowest && start.speed <= kFastest)) return Error{"no such speed"};
  if (!std::isfinite(start.time) || !(start.prelude >= 0.0 && start.prelude < 1e6))
    return Error{"no such time"};
  orderEvents();
  if (only_ && *only_ >= order_.size()) return Error{"the run has no such event"};
  start_ = start;
  placed_ = ear_;
  if (only_) onlyEvent_ = run_.portions[order_[*only_].portion].events[order_[*only_].event];
  if (Status chosen = chooseListeners(); !chosen) return chosen;
  if (Status made = makeSynth(); !made) return made;
  const double begin = std::max(start.time - start.prelude, heardAt(0.0));
  const double clock = begin > 0.0 ? std::max(0.0, begin - kLead) : begin;
  if (clock > 0.0)
    if (Status sought = synth_->seek(clock); !sought) return sought;
  firstEvent_ = start_.time + (begin - start_.time) * start_.speed;
  voiceBegin_ = voice_ ? voiceBegin(firstEvent_) : 0.0;
  if (followed_) {
    for (std::size_t index = 0; index < run_.world.paths.size(); ++index)
      if (Status moved = followPath(index); !moved) return moved;
  }
  isMoved_ = hasMoved_ = false;
  known_.clear();
  next_ = nextBodies_ = 0;
  isRinging_.assign(run_.world.bodies, false);
  settled_ = 0.0;
  bringBodies(firstEvent_);
  synth_->advanceTo(clock);
  const auto frameOf = [this](double time) { return std::llround(time * sampleRate_); };
  for (std::int64_t left = frameOf(start.time) - frameOf(synth_->time()); left > 0;) {
    const auto frames = static_cast<std::size_t>(std::min<std::int64_t>(left, kBlock));
    renderBlock(frames);
    left -= static_cast<std::int64_t>(frames);
  }
  return std::monostate{};
}

/// Gives the synthesis the whole path of a listener of the run.
Status RunPlayer::followPath(std::size_t listener) {
  const std::vector<ListenerPose>& path = run_.world.paths[listener];
  if (path.empty()) return std::monostate{};
  const Listener& from = run_.world.listeners[listener];
  std::vector<ListenerPose> poses = {{0.0, from.position, from.orientation}};
  poses.insert(poses.end(), path.begin(), path.end());
  poses.push_back(path.back());
  poses.back().time += kStop;
  PoseTrack track({0.0, from.position, from.orientation}, {.capacity = poses.size() + 1});
  for (ListenerPose& pose : poses) {
    pose.time = heardAt(pose.time);
    if (Status moved = synth_->moveListener(listener, pose); !moved) return moved;
    pose.time -= heardAt(voiceBegin_);
    track.append(pose);
  }
  if (voice_) voice_->follow(listener, std::move(track));
  return std::monostate{};
}

/// Tells the synthesis where the ear is now.
void RunPlayer::tellEar() {
  if (!isMoved_) return;
  // The first pose is where the ear was, so that it is on its way from there. While it stands, it
  // has none, and rings are heard as by a microphone.
  ListenerPose pose = std::exchange(hasMoved_, true) ? ear_ : placed_;
  pose.time = synth_->time();
  // One that comes too soon after the last, or that is too far away to have moved there, jumps.
  const bool isOnItsWay = static_cast<bool>(synth_->moveListener(0, pose));
  if (!isOnItsWay) static_cast<void>(synth_->placeListener(0, pose));
  isMoved_ = (pose.position - ear_.position).norm() > 0.0 ||
             pose.orientation.angularDistance(ear_.orientation) > 0.0;
  if (!voice_) return;
  pose.time -= heardAt(voiceBegin_);
  if (!voice_->track(0).append(pose)) voice_->track(0).restart(pose);
}

/// Returns the time (s) of the run from which on the states of what deforms are needed for a sound
/// that begins at `time`.
double RunPlayer::voiceBegin(double time) const {
  double farthest = 0.0;  // m, the way of the sound
  for (const RunPortion& portion : run_.portions)
    for (const Listener& listener : listeners_)
      if (!portion.deformations.empty())
        farthest =
            std::max(farthest, (portion.deformations.front().position - listener.position).norm());
  const double way =
      std::min(farthest / run_.world.synth.medium.speedOfSound, DeformingVoice::kLongestWay);
  const double begin = time - (way + kDeformed) * start_.speed;
  return run_.deformationStep * std::max(0.0, std::floor(begin / run_.deformationStep));
}

/// Gives the voice of what deforms the states of a portion, from voiceBegin_ on.
void RunPlayer::addStates(const RunPortion& portion) {
  const auto first = static_cast<std::size_t>(std::llround(voiceBegin_ / run_.deformationStep));
  const std::size_t skipped = first - std::min(first, states_);
  states_ += portion.deformations.size();
  if (skipped < portion.deformations.size())
    voice_->add(std::span(portion.deformations).subspan(skipped));
}

/// Sets bodies, those that are muted as such that make no sound.
void RunPlayer::setBodies(const PlayableRun::Bodies& bodies) {
  for (const HostBody& body : bodies.bodies) {
    SoundBody sound = body.sound;
    isRinging_[body.id] = sound.modal != nullptr;
    if (isMuted_[body.id]) sound = {.material = sound.material};
    static_cast<void>(synth_->setBody(body.id, sound));  // has been validated
  }
}

/// Sets all bodies that are others from a portion on, or from one before it.
void RunPlayer::setBodiesUpTo(std::size_t portion) {
  for (; bodiesChange(portion); ++nextBodies_)
    setBodies(run_.bodies[nextBodies_]);
}

/// Tells the synthesis where a body is, at its time on the synthesis' clock.
void RunPlayer::moveBody(const BodyPose& pose) {
  ListenerPose heard = pose.pose;
  heard.time = heardAt(heard.time);
  static_cast<void>(synth_->moveBody(pose.body, heard));
}

/// True if one of the bodies of a contact rings.
bool RunPlayer::rings(const ContactState& contact) const {
  return isRinging_[contact.body] || isRinging_[contact.other];
}

/// Sets the bodies as they are at a time (s) of the run, and takes the portions before it, of which
/// only places, deformations, what lies on something that rings and the events behind that time are
/// used.
void RunPlayer::bringBodies(double time) {
  states_ = 0;
  std::vector<const BodyPose*> last(run_.world.bodies, nullptr);
  OpenContacts open;
  for (; next_ < run_.portions.size() && run_.portions[next_].settledTime <= time; ++next_) {
    setBodiesUpTo(next_);
    const RunPortion& portion = run_.portions[next_];
    for (const BodyPose& pose : portion.poses)
      last[pose.body] = &pose;
    for (const ContactState& contact : portion.contacts)
      if (rings(contact)) open.note(contact);
    if (voice_) addStates(portion);
    settled_ = portion.settledTime;
  }
  setBodiesUpTo(next_);
  for (const BodyPose* const pose : last)
    if (pose != nullptr) moveBody(*pose);
  if (only_) return;
  for (const ContactState& contact : open.at(time))
    synth_->updateContact(atSpeed(contact));
}

ImpulseEvent RunPlayer::atSpeed(const ImpulseEvent& event) const {
  ImpulseEvent heard = event;
  heard.time = heardAt(event.time);
  return heard;
}

/// Returns a step of a contact that lasts longer at the same forces and speeds.
ContactState RunPlayer::atSpeed(const ContactState& contact) const {
  ContactState heard = contact;
  heard.time = heardAt(contact.time);
  if (start_.speed == 1.0) return heard;
  heard.duration /= start_.speed;
  heard.appliedImpulse /= start_.speed;
  heard.pathEnd = contact.pathStart + (contact.pathEnd - contact.pathStart) / start_.speed;
  heard.otherPathEnd =
      contact.otherPathStart + (contact.otherPathEnd - contact.otherPathStart) / start_.speed;
  return heard;
}

/// True if there are bodies to be set before a portion.
bool RunPlayer::bodiesChange(std::size_t portion) const {
  return nextBodies_ < run_.bodies.size() && run_.bodies[nextBodies_].portion <= portion;
}

/// Hands over a portion, but for its events.
void RunPlayer::take(std::size_t index) {
  setBodiesUpTo(index);
  const RunPortion& portion = run_.portions[index];
  for (const ImpulseEvent& told : portion.events)
    if (told.time >= firstEvent_ && (!only_ || isOfOne(told, onlyEvent_)))
      known_.push_back(atSpeed(told));
  if (!only_)
    for (const ContactState& contact : portion.contacts) {
      if (contact.time >= firstEvent_)
        synth_->updateContact(atSpeed(contact));
      else if (rings(contact))
        synth_->updateContact(atSpeed(stillAt(contact, firstEvent_)));
    }
  for (const BodyPose& pose : portion.poses)
    if (pose.pose.time <= run_.world.duration) moveBody(pose);
  if (voice_) addStates(portion);
  settled_ = portion.settledTime;
}

void RunPlayer::scheduleSettled() {
  const double duration = run_.world.duration;
  const double settled = heardAt(settled_);
  const bool isOver = settled_ >= duration;
  const bool keepsOrder = run_.keepsOrder;
  if (!keepsOrder) std::ranges::stable_sort(known_, {}, &ImpulseEvent::time);
  const auto open = std::ranges::find_if(known_, [&](const ImpulseEvent& event) {
    return !keepsOrder && !isOver && event.time >= settled;
  });
  for (auto event = known_.begin(); event != open; ++event)
    // A host has heard what Bullet solved before the bodies touched, after its last substep.
    if (event->time <= heardAt(duration) || keepsOrder) synth_->schedule(*event);
  known_.erase(known_.begin(), open);
  synth_->advanceTo(std::min(settled, heardAt(duration)));
}

/// Hands over what is known up to a time (s) on the synthesis' clock.
void RunPlayer::runAhead(double heard) {
  const double ahead = voice_ ? voice_->lookahead() : 0.0;
  const double time = start_.time + (heard - start_.time) * start_.speed;
  const double target = std::min(time, run_.world.duration) + ahead * start_.speed;
  while (settled_ < target && next_ < run_.portions.size()) {
    // Portions of one time are one step: all of its contacts come before its events are heard.
    const double before = settled_;
    take(next_++);
    while (settled_ <= before && next_ < run_.portions.size() && !bodiesChange(next_))
      take(next_++);
    if (settled_ < target) scheduleSettled();
  }
  if (next_ == run_.portions.size() && !isOpen_) settled_ = std::numeric_limits<double>::infinity();
  scheduleSettled();
}

/// Renders the next frames, at most kBlock, into planes_.
void RunPlayer::renderBlock(std::size_t frames) {
  if (!followed_) tellEar();
  const double now = synth_->time();
  runAhead(now + static_cast<double>(frames) / sampleRate_ + kLookahead);
  std::vector<float*> all;
  for (std::vector<float>& plane : planes_)
    all.push_back(plane.data());
  synth_->render<float>(all, frames);
  if (!isWhole_) mixStems(frames);
  if (voice_)
    voice_->addTo(std::span(all).first(planes_.size() / parts()),
                  std::llround((now - heardAt(voiceBegin_)) * sampleRate_), frames);
}

/// Puts the sum of the stems that are heard in the place of the whole.
void RunPlayer::mixStems(std::size_t frames) {
  const std::size_t count = planes_.size() / parts();
  for (std::size_t channel = 0; channel < count; ++channel)
    for (std::size_t frame = 0; frame < frames; ++frame) {
      float sum = 0.0F;
      for (std::size_t stem = 0; stem < kStems; ++stem)
        if (stems_[stem]) sum += planes_[(1 + stem) * count + channel][frame];
      planes_[channel][frame] = sum;
    }
}

void RunPlayer::render(std::span<float* const> channels, std::size_t frames) {
  for (std::size_t done = 0; done < frames;) {
    const std::size_t part = std::min(kBlock, frames - done);
    renderBlock(part);
    for (std::size_t channel = 0; channel < channelCount_; ++channel)
      std::copy_n(planes_[firstChannel_ + channel].begin(), part, channels[channel] + done);
    done += part;
  }
}

double RunPlayer::time() const {
  return start_.time + (synth_->time() - start_.time) * start_.speed;
}

Result<std::vector<RunPlayer::EventMeasure>> RunPlayer::measureEvents() {
  const std::optional<std::size_t> followed = std::exchange(followed_, 0);
  const Status chosen = chooseListeners();
  followed_ = followed;
  if (!chosen) return chosen.error();
  start_ = {};
  orderEvents();
  if (Status made = makeSynth(); !made) return made.error();
  std::vector<EventMeasure> measures(order_.size());
  std::vector<std::pair<std::size_t, std::size_t>> rows;  // number and row
  nextBodies_ = 0;
  std::size_t row = 0;
  for (const EventPlace& place : order_)
    rows.emplace_back(firstEvents_[place.portion] + place.event, row++);
  std::ranges::sort(rows);
  auto at = rows.begin();
  for (std::size_t index = 0; index < run_.portions.size(); ++index) {
    setBodiesUpTo(index);
    for (std::size_t event = 0; event < run_.portions[index].events.size(); ++event) {
      if (at == rows.end() || at->first != firstEvents_[index] + event) continue;
      const ImpulseEvent& told = run_.portions[index].events[event];
      measures[at->second] = {synth_->contactDuration(told), synth_->schedule(told)};
      ++at;
    }
  }
  return measures;
}

}  // namespace carom::audio
