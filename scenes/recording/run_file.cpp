#include "scenes/recording/run_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <span>
#include <string_view>
#include <system_error>
#include <utility>

#include <nlohmann/json.hpp>
#include <zstd.h>

#include "carom/audio/modal_model_file.h"
#include "modal/json/json_reader.h"

namespace carom::scenes {

using namespace audio;

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr double kLongest = 1e7;  // s
constexpr std::uint32_t kMostPoints = 20'000'000;
constexpr std::uint64_t kMostBodyBytes = std::uint64_t{1} << 32U;  // of all of a host's run
constexpr std::size_t kMostEndBytes = 1024;

/// Reads a little-endian number. False if there are too few bytes.
template <class Number>
bool getNumber(std::istream& from, Number& number) {
  std::array<char, sizeof(Number)> bytes{};
  from.read(bytes.data(), bytes.size());
  std::uint64_t value = 0;
  for (std::size_t at = 0; at < bytes.size(); ++at)
    value |= std::uint64_t{static_cast<unsigned char>(bytes[at])} << (8 * at);
  number = static_cast<Number>(value);
  return static_cast<bool>(from);
}

std::string textOf(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

Result<RunWriter> beginRun(const fs::path& file, const RunHeader& header) {
  Result<RunWriter> writer = RunWriter::create(file, kSceneRun);
  if (!writer) return writer.error();
  const std::string text = headerText(header);
  const Status put = writer->put(kHeaderPart, std::as_bytes(std::span(text)));
  if (!put) return put.error();
  return writer;
}

Error RunReader::fault(const std::string& what) const {
  return Error{name_ + ": part " + std::to_string(parts_) + ": " + what +
               "; expected a run as 'carom record' wrote it"};
}

Result<RunReader> RunReader::open(const fs::path& file) {
  auto stream = std::make_unique<std::ifstream>(file, std::ios::binary);
  if (!*stream)
    return Error{file.string() + ": cannot be opened; expected a file of 'carom record'"};
  return read(std::move(stream), file.string());
}

Result<RunReader> RunReader::read(std::unique_ptr<std::istream> stream, std::string name) {
  RunReader reader(std::move(name), std::move(stream));
  std::array<char, kRunMagic.size()> beginning{};
  reader.stream_->read(beginning.data(), beginning.size());
  std::uint32_t version = 0;
  if (!std::ranges::equal(beginning, kRunMagic) || !getNumber(*reader.stream_, version))
    return Error{reader.name_ + ": is no run; expected a file of 'carom record'"};
  if (version != kSceneRun && version != kHostRun)
    return Error{reader.name_ + ": is of version " + std::to_string(version) + "; expected " +
                 std::to_string(kSceneRun) + " or " + std::to_string(kHostRun)};
  if (const Status whole = reader.checkWhole(); !whole) return whole.error();
  const Status read = version == kHostRun ? reader.readHost() : reader.readHeader();
  if (!read) return read.error();
  return reader;
}

/// Refuses a file that was cut, or has something behind its end: a run that is heard in part would
/// not notice.
Status RunReader::checkWhole() {
  const std::istream::pos_type first = stream_->tellg();
  for (bool ended = false; !ended;) {
    const Result<PartHead> head = takeHead();
    if (!head) return head.error();
    ended = head->kind == 'e';
    if (ended) {
      if (const Result<Part> part = takeBody(*head); !part) return part.error();
    } else {
      stream_->seekg(static_cast<std::istream::off_type>(head->stored), std::ios::cur);
    }
  }
  if (stream_->peek() != std::char_traits<char>::eof())
    return fault("there is more behind the run's end");
  stream_->clear();
  stream_->seekg(first);
  parts_ = 0;
  return std::monostate{};
}

Result<RunReader::PartHead> RunReader::takeHead() {
  ++parts_;
  PartHead head;
  if (!stream_->get(head.kind) || !getNumber(*stream_, head.stored) ||
      !getNumber(*stream_, head.unpacked) || !getNumber(*stream_, head.checksum))
    return fault("the file ends before the run does");
  if (head.unpacked > kMostUnpacked || head.stored > ZSTD_compressBound(kMostUnpacked))
    return fault("it is larger than any part can be");
  return head;
}

Result<RunReader::Part> RunReader::takeBody(const PartHead& head) {
  // Memory grows with what is there, whatever the numbers say.
  std::vector<std::byte> packed;
  constexpr std::size_t kPiece = std::size_t{1} << 20U;
  while (packed.size() < head.stored) {
    const std::size_t before = packed.size();
    const std::size_t size = std::min<std::size_t>(kPiece, head.stored - before);
    packed.resize(before + size);
    if (!stream_->read(reinterpret_cast<char*>(packed.data() + before),
                       static_cast<std::streamsize>(size)))
      return fault("the file ends before the run does");
  }
  if (modalModelChecksum(packed) != head.checksum)
    return fault("it was changed: its checksum differs");
  if (ZSTD_getFrameContentSize(packed.data(), packed.size()) != head.unpacked)
    return fault("its size is not the one it states");
  Part part{head.kind, std::vector<std::byte>(head.unpacked)};
  const std::size_t size =
      ZSTD_decompress(part.bytes.data(), part.bytes.size(), packed.data(), packed.size());
  if (ZSTD_isError(size) != 0 || size != head.unpacked) return fault("it cannot be unpacked");
  return part;
}

Result<RunReader::Part> RunReader::take() {
  const Result<PartHead> head = takeHead();
  if (!head) return head.error();
  return takeBody(*head);
}

/// Reads what a host's run has beside portions, and goes back to the first part.
Status RunReader::readHost() {
  const std::istream::pos_type first = stream_->tellg();
  host_.emplace();
  if (Status read = readHostParts(); !read) return read;
  if (Status checked = checkBodies(); !checked) return checked;
  stream_->clear();
  stream_->seekg(first);
  parts_ = 0;
  header_.stepper = "host";
  header_.duration = host_->world.duration;
  header_.shape.bodies = host_->world.bodies;
  isKnown_.resize(host_->world.bodies);
  return std::monostate{};
}

Status RunReader::readHostParts() {
  HostDecoder decoder;
  std::vector<PathPiece> pieces;
  std::size_t poses = 0;
  std::uint64_t bodyBytes = 0;
  for (;;) {
    const Result<PartHead> head = takeHead();
    if (!head) return head.error();
    if (head->kind == 'p') {
      stream_->seekg(static_cast<std::istream::off_type>(head->stored), std::ios::cur);
      continue;
    }
    const Result<Part> part = takeBody(*head);
    if (!part) return part.error();
    if (part->kind == 'w') {
      Result<HostWorld> world = decodedWorld(part->bytes);
      if (!world) return fault("it " + world.error().message);
      host_->world = *std::move(world);
      if (const Status put = putBack(pieces, host_->world); !put)
        return fault("it " + put.error().message);
      return std::monostate{};
    }
    if (part->kind == 'l') {
      Result<PathPiece> piece = decodedPath(part->bytes);
      if (!piece) return fault("it " + piece.error().message);
      poses += piece->poses.size();
      if (poses > kMostPathPoses) return fault("paths of listeners are longer than they can be");
      pieces.push_back(*std::move(piece));
      continue;
    }
    if (part->kind != 'b') return fault("it is none of a host's run");
    bodyBytes += part->bytes.size();
    if (bodyBytes > kMostBodyBytes) return fault("the run's bodies are larger than 4 GiB");
    Result<std::vector<HostBody>> bodies = decoder.take(part->bytes);
    if (!bodies) return fault("it " + bodies.error().message);
    counts_.push_back(bodies->size());
    std::ranges::move(*bodies, std::back_inserter(host_->bodies));
  }
}

/// Refuses bodies that the run has not, and a run with bodies that were never told of.
Status RunReader::checkBodies() const {
  const std::uint32_t count = host_->world.bodies;
  if (count > kMostRunBodies) return fault("the run has more bodies than there can be");
  std::vector<bool> isTold(count);
  for (const HostBody& body : host_->bodies) {
    if (body.id >= count) return fault("the run has a body that it does not count");
    isTold[body.id] = true;
  }
  if (!std::ranges::all_of(isTold, std::identity()))
    return fault("the run counts a body that it does not have");
  return std::monostate{};
}

Status RunReader::readHeader() {
  const Result<Part> part = take();
  if (!part) return part.error();
  if (part->kind != kHeaderPart) return fault("it is no header");
  modal::FirstError error(name_ + ": header");
  const std::optional<json> document = modal::parseJson(textOf(part->bytes), error);
  if (!document) return error.error();
  using modal::NumberRange;
  using modal::TextRange;
  constexpr TextRange kText{"a text", 0, std::numeric_limits<std::size_t>::max(), true};
  constexpr NumberRange kDuration{"a duration", 0, kLongest, "seconds", true};
  constexpr NumberRange kStep{"a step", 0, 1, "seconds"};
  constexpr NumberRange kBodies{"a number of bodies", 0, kMostRunBodies, "", false, false, true};
  constexpr NumberRange kPoints{"a number of points", 0, kMostPoints, "", false, false, true};
  const modal::JsonNode root(*document, "", error);
  root.expectObject("a header", {"scene_file", "scene", "stepper", "duration_s",
                                 "deformation_step_s", "bodies", "points"});
  header_.sceneFile = root.text("scene_file", kText, "");
  header_.sceneText = root.text("scene", kText, "");
  const char* const steppers[] = {"native", "bullet"};
  header_.stepper = steppers[root.member("stepper").choice("a stepper", {"native", "bullet"})];
  header_.duration = root.number("duration_s", kDuration);
  header_.deformationStep = root.number("deformation_step_s", kStep, 0.0);
  header_.shape.bodies = static_cast<std::uint32_t>(root.number("bodies", kBodies));
  header_.shape.points = static_cast<std::uint32_t>(root.number("points", kPoints, 0.0));
  if (error) return error.error();
  return std::monostate{};
}

/// Takes note of the next bodies of a host's run, which are known already.
void RunReader::noteBodies() {
  const std::size_t end = body_ + counts_.at(count_++);
  for (; body_ < end; ++body_) {
    const BodyId id = host_->bodies[body_].id;
    if (isKnown_[id]) changes_.push_back(body_);
    isKnown_[id] = true;
  }
}

/// Has the times of a host's run begin at 0.
void RunReader::shift(std::vector<RunPortion>& portions) const {
  const double begin = host_ ? host_->world.begin : 0.0;
  if (begin == 0.0) return;
  for (RunPortion& portion : portions) {
    portion.settledTime -= begin;
    for (ImpulseEvent& event : portion.events)
      event.time -= begin;
    for (ContactState& contact : portion.contacts)
      contact.time -= begin;
    for (BodyPose& pose : portion.poses)
      pose.pose.time -= begin;
    // The mechanics tell of what was before the begin until shortly after it.
    const auto isEarlier = [](const auto& record) { return record.time < 0.0; };
    std::erase_if(portion.events, isEarlier);
    std::erase_if(portion.contacts, isEarlier);
  }
}

Result<std::vector<RunPortion>> RunReader::next() {
  if (ended_) return std::vector<RunPortion>{};
  changes_.clear();
  for (;;) {
    const Result<PartHead> head = takeHead();
    if (!head) return head.error();
    if (host_ && (head->kind == 'b' || head->kind == 'l' || head->kind == 'w')) {
      stream_->seekg(static_cast<std::istream::off_type>(head->stored), std::ios::cur);
      if (head->kind == 'b' && count_ == counts_.size()) return fault("it is behind the run's end");
      if (head->kind == 'b') noteBodies();
      continue;
    }
    const Result<Part> part = takeBody(*head);
    if (!part) return part.error();
    if (part->kind == 'e') return end(part->bytes);
    if (part->kind != 'p') return fault("its kind is unknown");
    Result<std::vector<RunPortion>> portions = decodedPortions(part->bytes, header_.shape);
    if (!portions) return fault("it " + portions.error().message);
    if (portions->empty()) return fault("it has no portions");
    portions_ += portions->size();
    shift(*portions);
    return portions;
  }
}

/// Takes note of the end.
Result<std::vector<RunPortion>> RunReader::end(const std::vector<std::byte>& bytes) {
  ended_ = true;
  if (bytes.size() > kMostEndBytes) return fault("the run's end is larger than it can be");
  const json end = json::parse(textOf(bytes), nullptr, false);
  if (!end.is_object() || end.value("portions", json()) != portions_)
    return fault("the run has another number of portions than its end says");
  return std::vector<RunPortion>{};
}

bool isRunFile(const fs::path& file) {
  std::error_code ignored;
  if (!fs::is_regular_file(file, ignored)) return false;
  std::array<char, kRunMagic.size()> beginning{};
  std::ifstream stream(file, std::ios::binary);
  stream.read(beginning.data(), beginning.size());
  return stream && std::ranges::equal(beginning, kRunMagic);
}

}  // namespace carom::scenes
