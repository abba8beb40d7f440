#include "scenes/recording/run_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>
#include <system_error>
#include <utility>

#include <nlohmann/json.hpp>
#include <zstd.h>

#include "carom/native/recording_format.h"
#include "modal/json/json_reader.h"

namespace carom::scenes {

using namespace audio;

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::string_view kMagic = "caromrun";
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kMostUnpacked = std::size_t{1} << 28U;  // bytes of a part
constexpr std::size_t kPartSize = std::size_t{1} << 20U;  // bytes, about, from which it is written
constexpr int kLevel = 6;         // of Zstandard: higher ones take longer and save a percent
constexpr double kLongest = 1e7;  // s
constexpr std::uint32_t kMostBodies = 200'000;
constexpr std::uint32_t kMostPoints = 20'000'000;

template <class Number>
void putNumber(std::string& to, Number number) {
  for (std::size_t at = 0; at < sizeof(Number); ++at)
    to += static_cast<char>((static_cast<std::uint64_t>(number) >> (8 * at)) & 0xffU);
}

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

std::string headerText(const RunHeader& header) {
  const json object = {{"scene_file", header.sceneFile},
                       {"scene", header.sceneText},
                       {"stepper", header.stepper},
                       {"duration_s", header.duration},
                       {"deformation_step_s", header.deformationStep},
                       {"bodies", header.shape.bodies},
                       {"points", header.shape.points}};
  // Names of files need not be UTF-8.
  return object.dump(-1, ' ', false, json::error_handler_t::replace);
}

std::span<const std::byte> bytesOf(const std::string& text) {
  return std::as_bytes(std::span(text));
}

std::string textOf(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::size_t sizeOf(const TapePortion& portion) {
  std::size_t points = 0;
  for (const JelloPicture& picture : portion.pictures)
    points += picture.points.size();
  return sizeof(portion) + portion.events.size() * sizeof(ImpulseEvent) +
         portion.contacts.size() * sizeof(ContactState) + portion.poses.size() * sizeof(BodyPose) +
         portion.deformations.size() * sizeof(DeformingState) + points * sizeof(double);
}

}  // namespace

Result<RunWriter> RunWriter::create(const fs::path& file, const RunHeader& header) {
  if (const Status valid = checkWritable(file); !valid)
    return Error{file.string() + ": " + valid.error().message};
  PartialFile partial(file);
  std::ofstream stream(partial.path(), std::ios::binary | std::ios::trunc);
  RunWriter writer(std::move(partial), std::move(stream), header.shape);
  std::string beginning(kMagic);
  putNumber(beginning, kVersion);
  writer.stream_ << beginning;
  if (Status put = writer.put('h', bytesOf(headerText(header))); !put) return put.error();
  return writer;
}

Status RunWriter::put(char kind, std::span<const std::byte> bytes) {
  std::vector<std::byte> packed(ZSTD_compressBound(bytes.size()));
  const std::size_t size =
      ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), kLevel);
  if (ZSTD_isError(size) != 0 || bytes.size() > kMostUnpacked)
    return Error{file_.finalPath().string() + ": a part of the run cannot be packed"};
  packed.resize(size);
  std::string head(1, kind);
  putNumber(head, static_cast<std::uint32_t>(size));
  putNumber(head, static_cast<std::uint32_t>(bytes.size()));
  putNumber(head, recordingChecksum(packed));
  stream_ << head;
  stream_.write(reinterpret_cast<const char*>(packed.data()),
                static_cast<std::streamsize>(packed.size()));
  if (stream_) return std::monostate{};
  return Error{file_.finalPath().string() + ": cannot be written; is there room on the disk?"};
}

Status RunWriter::flush() {
  if (portions_.empty()) return std::monostate{};
  const std::vector<std::byte> bytes = encodedPortions(portions_, shape_);
  written_ += portions_.size();
  portions_.clear();
  pending_ = 0;
  return put('p', bytes);
}

Status RunWriter::add(TapePortion portion) {
  pending_ += sizeOf(portion);
  portions_.push_back(std::move(portion));
  if (pending_ < kPartSize) return std::monostate{};
  return flush();
}

Result<std::uintmax_t> RunWriter::finish() {
  if (Status flushed = flush(); !flushed) return flushed.error();
  const std::string end = json{{"portions", written_}}.dump();
  if (Status put = this->put('e', bytesOf(end)); !put) return put.error();
  stream_.close();
  const std::string name = file_.finalPath().string();
  if (!stream_) return Error{name + ": cannot be written; is there room on the disk?"};
  if (const std::error_code failed = file_.giveName(); failed)
    return Error{name + ": cannot be given its name: " + failed.message()};
  std::error_code ignored;
  return fs::file_size(name, ignored);
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
  std::array<char, kMagic.size()> beginning{};
  reader.stream_->read(beginning.data(), beginning.size());
  std::uint32_t version = 0;
  if (!std::ranges::equal(beginning, kMagic) || !getNumber(*reader.stream_, version))
    return Error{reader.name_ + ": is no run; expected a file of 'carom record'"};
  if (version != kVersion)
    return Error{reader.name_ + ": is of version " + std::to_string(version) + "; expected " +
                 std::to_string(kVersion) + ", the only one"};
  if (Status read = reader.readHeader(); !read) return read.error();
  return reader;
}

Result<RunReader::Part> RunReader::take() {
  ++parts_;
  char kind = 0;
  std::uint32_t stored = 0;
  std::uint32_t unpacked = 0;
  std::uint64_t checksum = 0;
  if (!stream_->get(kind) || !getNumber(*stream_, stored) || !getNumber(*stream_, unpacked) ||
      !getNumber(*stream_, checksum))
    return fault("the file ends before the run does");
  if (unpacked > kMostUnpacked || stored > ZSTD_compressBound(kMostUnpacked))
    return fault("it is larger than any part can be");
  // Memory grows with what is there, whatever the numbers say.
  std::vector<std::byte> packed;
  constexpr std::size_t kPiece = std::size_t{1} << 20U;
  while (packed.size() < stored) {
    const std::size_t before = packed.size();
    const std::size_t size = std::min<std::size_t>(kPiece, stored - before);
    packed.resize(before + size);
    if (!stream_->read(reinterpret_cast<char*>(packed.data() + before),
                       static_cast<std::streamsize>(size)))
      return fault("the file ends before the run does");
  }
  if (recordingChecksum(packed) != checksum) return fault("it was changed: its checksum differs");
  if (ZSTD_getFrameContentSize(packed.data(), packed.size()) != unpacked)
    return fault("its size is not the one it states");
  Part part{kind, std::vector<std::byte>(unpacked)};
  const std::size_t size =
      ZSTD_decompress(part.bytes.data(), part.bytes.size(), packed.data(), packed.size());
  if (ZSTD_isError(size) != 0 || size != unpacked) return fault("it cannot be unpacked");
  return part;
}

Status RunReader::readHeader() {
  const Result<Part> part = take();
  if (!part) return part.error();
  if (part->kind != 'h') return fault("it is no header");
  modal::FirstError error(name_ + ": header");
  const std::optional<json> document = modal::parseJson(textOf(part->bytes), error);
  if (!document) return error.error();
  using modal::NumberRange;
  using modal::TextRange;
  constexpr TextRange kText{"a text", 0, std::numeric_limits<std::size_t>::max(), true};
  constexpr NumberRange kDuration{"a duration", 0, kLongest, "seconds", true};
  constexpr NumberRange kStep{"a step", 0, 1, "seconds"};
  constexpr NumberRange kBodies{"a number of bodies", 0, kMostBodies, "", false, false, true};
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

Result<std::vector<TapePortion>> RunReader::next() {
  if (ended_) return std::vector<TapePortion>{};
  Result<Part> part = take();
  if (!part) return part.error();
  if (part->kind == 'e') {
    ended_ = true;
    const json end = json::parse(textOf(part->bytes), nullptr, false);
    if (!end.is_object() || end.value("portions", json()) != portions_)
      return fault("the run has another number of portions than its end says");
    return std::vector<TapePortion>{};
  }
  if (part->kind != 'p') return fault("its kind is unknown");
  Result<std::vector<TapePortion>> portions = decodedPortions(part->bytes, header_.shape);
  if (!portions) return fault("it " + portions.error().message);
  if (portions->empty()) return fault("it has no portions");
  portions_ += portions->size();
  return portions;
}

bool isRunFile(const fs::path& file) {
  std::error_code ignored;
  if (!fs::is_regular_file(file, ignored)) return false;
  std::array<char, kMagic.size()> beginning{};
  std::ifstream stream(file, std::ios::binary);
  stream.read(beginning.data(), beginning.size());
  return stream && std::ranges::equal(beginning, kMagic);
}

}  // namespace carom::scenes
