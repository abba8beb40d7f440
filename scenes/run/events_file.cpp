#include "scenes/run/events_file.h"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

namespace carom::scenes {

using namespace audio;

namespace {

constexpr std::string_view kHeader =
    "time_s,body,other,jx_Ns,jy_Ns,jz_Ns,px_m,py_m,pz_m,nx,ny,nz,approach_speed_m_s,"
    "effective_mass_kg,duration_s,collision,peak_pa,heard\n";

void append(std::string& row, double value) {
  char text[32];
  const auto [end, error] = std::to_chars(std::begin(text), std::end(text), value);
  row.append(text, end);
}

void append(std::string& row, const Vec3& v) {
  for (int axis = 0; axis < 3; ++axis) {
    if (axis > 0) row += ',';
    append(row, v[axis]);
  }
}

void append(std::string& row, const std::string& name) {
  if (name.find_first_of(",\"\r\n") == std::string::npos) {
    row += name;
    return;
  }
  row += '"';
  for (const char c : name)
    row.append(c == '"' ? 2 : 1, c);
  row += '"';
}

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
  std::string row;
  append(row, event.time);
  row += ',';
  append(row, scene.bodies[event.body].name);
  row += ',';
  append(row, scene.bodies[event.other].name);
  for (const Vec3& v : {event.impulse, event.position, event.normal}) {
    row += ',';
    append(row, v);
  }
  for (const double value : {event.approachSpeed, event.effectiveMass, sound.duration}) {
    row += ',';
    append(row, value);
  }
  row += ',' + std::to_string(collisionOf(event)) + ',';
  append(row, sound.peak);
  row += sound.isHeard ? ",1\n" : ",0\n";
  return row;
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
