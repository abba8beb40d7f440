#include "scenes/rows/events_file.h"

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "scenes/rows/csv_row.h"

namespace carom::scenes {

using namespace audio;

namespace {

constexpr std::string_view kHeader =
    "time_s,body,other,jx_Ns,jy_Ns,jz_Ns,px_m,py_m,pz_m,nx,ny,nz,approach_speed_m_s,"
    "effective_mass_kg,duration_s,collision,peak_pa,heard\n";

/// True if these are the shares of one collision.
bool areShares(const ImpulseEvent& event, const ImpulseEvent& other) {
  return event.body == other.other && event.other == other.body && event.impulse == -other.impulse;
}

}  // namespace

std::string_view EventRows::header() {
  return kHeader;
}

/// Returns the number of the event's collision: that of its other share if that has come.
std::uint64_t EventRows::collisionOf(const ImpulseEvent& event) {
  if (!open_.empty() && open_.front().share.time != event.time) open_.clear();
  const auto other = std::ranges::find_if(
      open_, [&event](const OpenCollision& open) { return areShares(open.share, event); });
  if (other == open_.end()) {
    open_.push_back({event, ++collisions_});
    return collisions_;
  }
  const std::uint64_t number = other->number;
  open_.erase(other);
  return number;
}

std::string EventRows::row(const ImpulseEvent& event, const Scene& scene, const EventSound& sound) {
  return CsvRow()
      .add(event.time)
      .add(scene.bodies[event.body].name)
      .add(scene.bodies[event.other].name)
      .add(event.impulse)
      .add(event.position)
      .add(event.normal)
      .add(event.approachSpeed)
      .add(event.effectiveMass)
      .add(sound.duration)
      .add(std::to_string(collisionOf(event)))
      .add(sound.peak)
      .add(std::string(sound.isHeard ? "1" : "0"))
      .line();
}

EventsFileWriter::EventsFileWriter(PartialFile file, std::ofstream stream)
    : file_(std::move(file)), stream_(std::move(stream)) {}

Error EventsFileWriter::failure(const std::string& reason) const {
  return Error{"events file '" + file_.finalPath().string() + "': " + reason};
}

Result<EventsFileWriter> EventsFileWriter::create(const std::filesystem::path& path) {
  EventsFileWriter writer(PartialFile{path}, std::ofstream{});
  if (const Status valid = checkWritable(path); !valid)
    return writer.failure(valid.error().message);
  writer.stream_.open(writer.file_.path(), std::ios::binary | std::ios::trunc);
  if (!writer.stream_) return writer.failure("cannot be created; is its folder writable?");
  writer.stream_ << EventRows::header();
  return writer;
}

void EventsFileWriter::write(const ImpulseEvent& event, const Scene& scene,
                             const EventSound& sound) {
  stream_ << rows_.row(event, scene, sound);
}

Status EventsFileWriter::close() {
  stream_.close();
  if (!stream_) return failure("cannot be written; is there room on the disk?");
  return std::monostate{};
}

Status EventsFileWriter::finish() {
  if (stream_.is_open() || !stream_) {
    if (Status closed = close(); !closed) return closed;
  }
  if (const std::error_code reason = file_.giveName(); reason)
    return failure("cannot be given its name: " + reason.message());
  return std::monostate{};
}

}  // namespace carom::scenes
