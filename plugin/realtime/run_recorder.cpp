#include "plugin/realtime/run_recorder.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "audio/run/run_tables.h"
#include "audio/scheduling/slide_tracker.h"

namespace carom::plugin {

using namespace audio;

namespace {

/// Bytes, about, of portions in memory that are packed together.
constexpr std::size_t kPieceSize = std::size_t{1} << 20U;
/// m/s at which a listener that has jumped goes there in the run: a little less than paths allow.
constexpr double kWaySpeed = 170.0;
/// Places at which a file could end that are kept in mind.
constexpr std::size_t kMostPlaces = 16;

bool isSame(const SoundBody& a, const SoundBody& b) {
  return a.material == b.material && a.mass == b.mass && a.radius == b.radius &&
         a.edgeRadius == b.edgeRadius && a.shape == b.shape &&
         a.inverseInertia == b.inverseInertia && a.texture == b.texture &&
         a.textureCoordinates == b.textureCoordinates && a.modal == b.modal &&
         a.modalOrigin == b.modalOrigin && a.recoil == b.recoil;
}

bool isSame(const ListenerPose& a, const ListenerPose& b) {
  return a.position == b.position && a.orientation.coeffs() == b.orientation.coeffs();
}

/// Adds bodies to a file.
Status putBodies(RunWriter& writer, HostEncoder& encoder, const std::vector<HostBody>& bodies) {
  std::vector<std::byte> bytes;
  for (const HostBody& body : bodies) {
    if (const Status added = encoder.add(body, bytes); !added)
      return Error{writer.file().string() + ": " + added.error().message};
    if (bytes.size() < kPieceSize && &body != &bodies.back()) continue;
    if (Status put = writer.put('b', bytes); !put) return put;
    bytes.clear();
  }
  return std::monostate{};
}

/// Ends a file.
Status complete(RunWriter& writer, HostWorld world) {
  for (const PathPiece& piece : takeLongPaths(world))
    if (Status put = writer.put('l', encodedPath(piece)); !put) return put;
  if (Status put = writer.put('w', encodedWorld(world)); !put) return put;
  const Result<std::uintmax_t> size = writer.finish();
  if (!size) return size.error();
  return std::monostate{};
}

Error withoutStep(const std::filesystem::path& file) {
  return Error{file.string() + ": no step was made, so there is no run to write"};
}

/// Has an orientation the unit length that a run asks for, which is more than the sound does.
void straighten(Quat& orientation) {
  constexpr double kTolerance = 1e-6;
  if (std::abs(orientation.norm() - 1.0) > kTolerance) orientation.normalize();
}
void straighten(ImpulseEvent& event) {
  straighten(event.bodyOrientation);
  if (!event.hasOtherPose) {
    event.otherPosition = Vec3::Zero();
    event.otherOrientation = Quat::Identity();
  }
  straighten(event.otherOrientation);
}
void straighten(ContactState& contact) {
  straighten(contact.bodyOrientation);
  straighten(contact.otherOrientation);
}

bool isEmpty(const RunPortion& portion) {
  return portion.events.empty() && portion.contacts.empty() && portion.poses.empty();
}

}  // namespace

RunRecorder::RunRecorder(const SoundSettings& settings, std::optional<double> kept)
    : synth_(settings.synth), listeners_(settings.listeners), kept_(kept) {
  for (Listener& listener : listeners_) {
    hasOwnHeads_ = hasOwnHeads_ || listener.hrtf != nullptr;
    listener.hrtf = nullptr;
  }
  paths_.resize(listeners_.size());
  isOnItsWay_.resize(listeners_.size());
  toldAt_.resize(listeners_.size());
}

Result<std::unique_ptr<RunRecorder>> RunRecorder::toFile(const std::filesystem::path& file,
                                                         const SoundSettings& settings) {
  Result<RunWriter> writer = RunWriter::create(file, kHostRun);
  if (!writer) return writer.error();
  std::unique_ptr<RunRecorder> recorder(new RunRecorder(settings, std::nullopt));
  recorder->writer_.emplace(*std::move(writer));
  return recorder;
}

std::unique_ptr<RunRecorder> RunRecorder::inMemory(double seconds, const SoundSettings& settings) {
  return std::unique_ptr<RunRecorder>(new RunRecorder(settings, seconds));
}

void RunRecorder::fail(Error error) {
  if (!failure_) failure_ = std::move(error);
}

void RunRecorder::startAt(double seconds) {
  time_ = seconds;
  shift_ = -seconds;
}

void RunRecorder::setBody(BodyId id, const SoundBody& body) {
  const auto [entry, isNew] = bodies_.try_emplace(id);
  Body& known = entry->second;
  if (!isNew && isSame(known.record.sound, body)) return;
  // The portion so far is heard with the body as it was then.
  if (known.isNumbered && !isEmpty(portion_)) closePortion(time_);
  known.record.sound = body;
  known.isWritten = false;
  if (isNew) fresh_.push_back(id);
}

void RunRecorder::describe(BodyId id, std::string name, const BodyForm& form) {
  const auto found = bodies_.find(id);
  if (found == bodies_.end()) return;
  found->second.record.name = std::move(name);
  found->second.record.form = form;
}

void RunRecorder::removeBody(BodyId id) {
  const auto found = bodies_.find(id);
  if (found == bodies_.end()) return;
  if (found->second.isNumbered) removed_.push_back({found->second.record.id, seconds()});
  bodies_.erase(found);
  std::erase_if(moving_, [id](const auto& pair) { return pair.first == id || pair.second == id; });
}

/// Returns a number for a body; none if there are too many. In a file, numbers of bodies that are
/// gone are given again only where there are no others.
std::optional<BodyId> RunRecorder::takeNumber() {
  if (!free_.empty() && (kept_ || count_ == kMostRunBodies)) {
    const BodyId number = free_.front();
    free_.pop_front();
    before_.erase(number);
    return number;
  }
  if (count_ == kMostRunBodies) {
    if (lack_) return std::nullopt;
    lack_ = Error{(writer_ ? writer_->file().string() : "the run in memory") + ": it has " +
                  std::to_string(kMostRunBodies) +
                  " bodies at once, the most that a run can have; others are left out of it"};
    return std::nullopt;
  }
  return count_++;
}

/// Returns a body's number in the run, and has it written as it is now; none if it was not set, or
/// there are too many.
std::optional<BodyId> RunRecorder::numberOf(BodyId id) {
  const auto found = bodies_.find(id);
  if (found == bodies_.end()) return std::nullopt;
  Body& body = found->second;
  if (!body.isNumbered) {
    const std::optional<BodyId> number = takeNumber();
    if (!number) return std::nullopt;
    body.record.id = *number;
    body.isNumbered = true;
  }
  if (!std::exchange(body.isWritten, true)) changes_.push_back(body.record);
  return body.record.id;
}

/// Adds an event or contact to the step in hand, by the numbers of its bodies. What no run can
/// tell, as it is no number, is left out: nor is it heard.
template <class Record>
void RunRecorder::add(Record record, std::vector<Record>& records) {
  record.time += shift_;
  const std::optional<BodyId> body = numberOf(record.body);
  const std::optional<BodyId> other = numberOf(record.other);
  if (!body || !other || !(record.time >= 0.0)) return;
  record.body = *body;
  record.other = *other;
  straighten(record);
  if (isReadable(record)) records.push_back(record);
}

void RunRecorder::post(const ImpulseEvent& event) {
  add(event, portion_.events);
}

/// True if one of the bodies of a contact rings.
bool RunRecorder::rings(const ContactState& contact) const {
  const auto rings = [this](BodyId id) {
    const auto found = bodies_.find(id);
    return found != bodies_.end() && found->second.record.sound.modal != nullptr;
  };
  return rings(contact.body) || rings(contact.other);
}

/// True if a step of a contact is heard, or may damp what rings. What lies still makes no sound:
/// only that it has come to lie is told.
bool RunRecorder::isOfUse(const ContactState& contact) {
  const std::pair<BodyId, BodyId> pair(contact.body, contact.other);
  if (contact.phase != ContactPhase::end && isMoving(contact)) {
    moving_.insert(pair);
    return true;
  }
  return moving_.erase(pair) > 0 || rings(contact);
}

void RunRecorder::updateContact(const ContactState& contact) {
  if (!isOfUse(contact)) return;
  const std::size_t before = portion_.contacts.size();
  add(contact, portion_.contacts);
  if (kept_ && portion_.contacts.size() > before && rings(contact))
    lasting_.note(portion_.contacts.back());
}

void RunRecorder::moveBody(BodyId id, const ListenerPose& pose) {
  const std::optional<BodyId> number = numberOf(id);
  if (!number) return;
  ListenerPose shifted = pose;
  shifted.time += shift_;
  straighten(shifted.orientation);
  const BodyPose told{*number, shifted};
  if (isReadable(told)) portion_.poses.push_back(told);
}

void RunRecorder::moveListener(std::size_t listener, const ListenerPose& pose) {
  std::vector<ListenerPose>& path = paths_[listener];
  Listener& start = listeners_[listener];
  ListenerPose now = pose;
  now.time += shift_;
  ListenerPose before =
      path.empty() ? ListenerPose{since_, start.position, start.orientation} : path.back();
  if (!(now.time > since_)) {
    start.position = now.position;
    start.orientation = now.orientation;
    return;
  }
  if (isSame(before, now)) {
    toldAt_[listener] = now.time;
    return;
  }
  if (!(now.time > before.time)) {
    path.back() = now;
    return;
  }
  if (path.size() >= kMostPathPoses / paths_.size()) return;
  // Until then it was said to stand still.
  if (toldAt_[listener] > before.time && toldAt_[listener] < now.time) {
    before.time = toldAt_[listener];
    path.push_back(before);
  }
  // A path leads from pose to pose. A listener that has jumped stays until the time that is left
  // is as long as the way there takes: it comes late.
  const double way = (now.position - before.position).norm() / kWaySpeed;
  isOnItsWay_[listener] = isOnItsWay_[listener] || now.time - before.time < way;
  if (now.time - before.time < way) return;
  if (isOnItsWay_[listener] && now.time - way > before.time)
    path.push_back({now.time - way, before.position, before.orientation});
  isOnItsWay_[listener] = false;
  path.push_back(now);
}

void RunRecorder::leapTo(double seconds) {
  closePortion(time_);
  shift_ += time_ - seconds;
  time_ = seconds;
}

void RunRecorder::advanceTo(double seconds, double settled) {
  for (const BodyId id : std::exchange(fresh_, {}))
    (void)numberOf(id);
  time_ = seconds;
  closePortion(settled);
}

/// Ends what was told before that time of the simulation.
void RunRecorder::closePortion(double settled) {
  RunPortion portion = std::exchange(portion_, {});
  settled_ = std::max(settled_, settled + shift_);
  portion.settledTime = settled_;
  if (failure_) {
    changes_.clear();
    removed_.clear();
  } else if (writer_) {
    write(std::move(portion));
  } else {
    keep(std::move(portion));
  }
}

void RunRecorder::write(RunPortion portion) {
  if (const Status put = putBodies(*writer_, encoder_, changes_); !put) return fail(put.error());
  changes_.clear();
  if (const Status added = writer_->add(std::move(portion)); !added) return fail(added.error());
  notePlace();
  for (const Removed& body : std::exchange(removed_, {}))
    free_.push_back(body.number);
}

void RunRecorder::keep(RunPortion portion) {
  const double begin = pieces_.empty() ? 0.0 : pieces_.back().begin;
  const bool isLong = portion.settledTime > begin + kPiece || openSize_ > kPieceSize;
  if (pieces_.empty() || !changes_.empty() || isLong) {
    closePiece();
    Piece& piece = pieces_.emplace_back();
    piece.begin = open_.empty() ? 0.0 : open_.back().settledTime;
    piece.changes = std::exchange(changes_, {});
    open_.clear();
  }
  openSize_ += sizeOf(portion);
  open_.push_back(std::move(portion));
  dropOld();
}

/// Packs the portions of the latest piece.
void RunRecorder::closePiece() {
  openSize_ = 0;
  if (pieces_.empty()) return;
  Result<std::vector<std::byte>> packed = packedPortions(open_, Packing::quick);
  if (!packed) return fail(packed.error());
  Piece& piece = pieces_.back();
  piece.portions = *std::move(packed);
  piece.count = open_.size();
  std::map<BodyId, ListenerPose> ends;
  for (const RunPortion& portion : open_)
    for (const BodyPose& pose : portion.poses)
      ends.insert_or_assign(pose.body, pose.pose);
  for (const auto& [body, pose] : ends)
    piece.ends.push_back({body, pose});
  piece.lasting = lasting_.at(open_.empty() ? piece.begin : open_.back().settledTime);
}

/// Drops pieces that have become too old, but for how they leave bodies, listeners and contacts.
void RunRecorder::dropOld() {
  const auto isOld = [this] {
    return pieces_.size() > 1 && pieces_[1].begin <= seconds() - *kept_;
  };
  if (!isOld()) return;
  while (isOld()) {
    Piece& old = pieces_.front();
    for (HostBody& body : old.changes)
      before_.insert_or_assign(body.id, std::move(body));
    for (const BodyPose& pose : old.ends)
      poses_.insert_or_assign(pose.body, pose.pose);
    contacts_ = std::move(old.lasting);
    pieces_.pop_front();
  }
  const double first = pieces_.front().begin;
  for (std::size_t listener = 0; listener < paths_.size(); ++listener) {
    std::vector<ListenerPose>& path = paths_[listener];
    const auto next =
        std::ranges::find_if(path, [first](const ListenerPose& pose) { return pose.time > first; });
    Listener& start = listeners_[listener];
    const ListenerPose before = next == path.begin()
                                    ? ListenerPose{since_, start.position, start.orientation}
                                    : *std::prev(next);
    start.position = before.position;
    start.orientation = before.orientation;
    if (next != path.end()) {
      const double share = (first - before.time) / (next->time - before.time);
      start.position += share * (next->position - before.position);
      start.orientation = before.orientation.slerp(share, next->orientation);
    }
    path.erase(path.begin(), next);
  }
  since_ = first;
  // A body that was gone before keeps its number until another needs it, and nothing else.
  std::erase_if(removed_, [&](const Removed& body) {
    const auto found = before_.find(body.number);
    if (body.time >= first || found == before_.end()) return false;
    HostBody& old = found->second;
    old.sound = {.material = old.sound.material};
    old.form = {};
    poses_.erase(body.number);
    free_.push_back(body.number);
    return true;
  });
}

/// Takes note of where the file could end, where there is a new place.
void RunRecorder::notePlace() {
  const RunWriter::Place place = writer_->place();
  const bool isNew =
      places_.empty() ? place.portions > 0 : place.portions > places_.back().place.portions;
  if (isNew) {
    const double packed = writer_->hasPending() ? written_.seconds : seconds();
    places_.push_back({place, {.seconds = packed, .bodies = count_}});
    if (places_.size() > kMostPlaces) places_.pop_front();
  }
  written_ = {.seconds = seconds(), .bodies = count_};
}

/// Ends a file after an error, or at the last place where that can be done. Returns up to when (s)
/// it has the run; 0: it cannot be had.
double RunRecorder::cutShort() {
  if (written_.seconds > 0.0 && complete(*writer_, world(0.0, written_))) return written_.seconds;
  for (; !places_.empty(); places_.pop_back()) {
    const auto& [place, extent] = places_.back();
    if (!(extent.seconds > 0.0) || !writer_->goBackTo(place)) continue;
    if (complete(*writer_, world(0.0, extent))) return extent.seconds;
  }
  return 0.0;
}

/// Returns the settings and the listeners' paths, with the bodies and up to the time given.
HostWorld RunRecorder::world(double begin, const Extent& extent) const {
  HostWorld world{.synth = synth_,
                  .listeners = listeners_,
                  .paths = paths_,
                  .hasOwnHeads = hasOwnHeads_,
                  .begin = begin,
                  .duration = extent.seconds - begin,
                  .bodies = extent.bodies};
  for (std::vector<ListenerPose>& path : world.paths)
    for (ListenerPose& pose : path)
      pose.time -= begin;
  return world;
}

Status RunRecorder::finish() {
  closePortion(time_);
  if (!failure_ && !(seconds() > 0.0)) return withoutStep(writer_->file());
  if (!failure_) return complete(*writer_, world(0.0, {seconds(), count_}));
  const double seconds = cutShort();
  if (!(seconds > 0.0)) return *failure_;
  return Error{failure_->message + "; the file has the run up to " + std::to_string(seconds) +
               " s"};
}

Status RunRecorder::save(const std::filesystem::path& file) {
  if (failure_) return Error{file.string() + ": " + failure_->message};
  closePortion(time_);
  if (pieces_.empty() || !(seconds() > pieces_.front().begin)) return withoutStep(file);
  Result<RunWriter> writer = RunWriter::create(file, kHostRun);
  if (!writer) return writer.error();
  HostEncoder encoder;
  std::vector<HostBody> before;
  for (const auto& [number, body] : before_)
    before.push_back(body);
  if (Status put = putBodies(*writer, encoder, before); !put) return put;
  const double begin = pieces_.front().begin;
  RunPortion first;
  first.settledTime = begin;
  for (const auto& [body, pose] : poses_)
    first.poses.push_back({body, {begin, pose.position, pose.orientation}});
  for (const ContactState& contact : contacts_)
    first.contacts.push_back(stillAt(contact, begin));
  if (Status added = writer->add(std::move(first)); !added) return added;
  for (const Piece& piece : pieces_) {
    if (Status put = putBodies(*writer, encoder, piece.changes); !put) return put;
    if (&piece == &pieces_.back()) break;
    if (Status put = writer->putPacked(piece.portions, piece.count); !put) return put;
  }
  for (const RunPortion& portion : open_)
    if (Status added = writer->add(portion); !added) return added;
  return complete(*writer, world(begin, {seconds(), count_}));
}

}  // namespace carom::plugin
