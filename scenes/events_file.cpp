#include "scenes/events_file.h"

#include <charconv>
#include <string>
#include <string_view>
#include <utility>

namespace carom {
namespace {

constexpr std::string_view kHeader =
    "time_s,body,other,jx_Ns,jy_Ns,jz_Ns,px_m,py_m,pz_m,nx,ny,nz,approach_speed_m_s,"
    "effective_mass_kg,duration_s\n";

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

}  // namespace

EventsFileWriter::EventsFileWriter(std::filesystem::path path, std::filesystem::path partial,
                                   std::ofstream stream)
    : path_(std::move(path)), partial_(std::move(partial)), stream_(std::move(stream)) {}

EventsFileWriter::~EventsFileWriter() {
  if (!stream_.is_open()) return;
  stream_.close();
  std::error_code ignored;
  std::filesystem::remove(partial_, ignored);
}

Result<EventsFileWriter> EventsFileWriter::create(const std::filesystem::path& path) {
  std::filesystem::path partial = path;
  partial += ".part";
  std::ofstream stream(partial, std::ios::binary | std::ios::trunc);
  if (!stream) {
    return Error{
        path.string() +
        ": cannot be written; expected a file name in a folder that exists and is writable"};
  }
  stream << kHeader;
  return EventsFileWriter(path, std::move(partial), std::move(stream));
}

void EventsFileWriter::write(const ImpulseEvent& event, const Scene& scene, double duration) {
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
  for (const double value : {event.approachSpeed, event.effectiveMass, duration}) {
    row += ',';
    append(row, value);
  }
  row += '\n';
  stream_ << row;
}

Status EventsFileWriter::finish() {
  stream_.close();
  std::error_code error;
  if (!stream_) {
    std::filesystem::remove(partial_, error);
    return Error{path_.string() + ": writing failed; is there room on the disk?"};
  }
  std::filesystem::rename(partial_, path_, error);
  if (!error) return std::monostate{};
  const std::string reason = error.message();
  std::filesystem::remove(partial_, error);
  return Error{path_.string() + ": cannot be put in place: " + reason};
}

}  // namespace carom
