#include "audio/run/run_writer.h"

#include <fstream>
#include <string>
#include <system_error>
#include <utility>

#include <zstd.h>

#include "audio/io/field_code.h"
#include "audio/run/run_tables.h"
#include "carom/audio/modal_model_file.h"

namespace carom::audio {

namespace {

constexpr std::size_t kPartSize = std::size_t{1} << 20U;  // bytes, about, from which it is written
constexpr int kSmall = 6;  // level of Zstandard: higher ones take longer and save a percent
constexpr int kQuick = 1;  // the same

/// Returns a part as it stands in the file.
Result<std::vector<std::byte>> packedPart(char kind, std::span<const std::byte> bytes,
                                          int level = kSmall) {
  std::vector<std::byte> packed(ZSTD_compressBound(bytes.size()));
  const std::size_t size =
      ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), level);
  if (ZSTD_isError(size) != 0 || bytes.size() > kMostUnpacked)
    return Error{"a part of the run cannot be packed"};
  packed.resize(size);
  std::vector<std::byte> part;
  FieldWriter head(part);
  head.number(static_cast<std::uint8_t>(kind));
  head.number(static_cast<std::uint32_t>(size));
  head.number(static_cast<std::uint32_t>(bytes.size()));
  head.number(modalModelChecksum(packed));
  part.insert(part.end(), packed.begin(), packed.end());
  return part;
}

}  // namespace

Result<std::vector<std::byte>> packedPortions(std::span<const RunPortion> portions,
                                              Packing packing) {
  return packedPart('p', encodedPortions(portions), packing == Packing::small ? kSmall : kQuick);
}

std::size_t sizeOf(const RunPortion& portion) {
  std::size_t points = 0;
  for (const JelloPicture& picture : portion.pictures)
    points += picture.points.size();
  return sizeof(portion) + portion.events.size() * sizeof(ImpulseEvent) +
         portion.contacts.size() * sizeof(ContactState) + portion.poses.size() * sizeof(BodyPose) +
         portion.deformations.size() * sizeof(DeformingState) + points * sizeof(double);
}

Result<RunWriter> RunWriter::create(const std::filesystem::path& file, std::uint32_t version) {
  if (const Status valid = checkWritable(file); !valid)
    return Error{file.string() + ": " + valid.error().message};
  PartialFile partial(file);
  auto stream = std::make_shared<std::ofstream>(partial.path(), std::ios::binary | std::ios::trunc);
  RunWriter writer(std::move(partial), std::move(stream));
  std::vector<std::byte> beginning;
  FieldWriter fields(beginning);
  for (const char letter : kRunMagic)
    fields.number(static_cast<std::uint8_t>(letter));
  fields.number(version);
  if (Status put = writer.writeBytes(beginning); !put) return put.error();
  return writer;
}

Error RunWriter::cannotWrite() const {
  return Error{file().string() + ": cannot be written; is there room on the disk?"};
}

Status RunWriter::writeBytes(std::span<const std::byte> bytes) {
  stream_->write(reinterpret_cast<const char*>(bytes.data()),
                 static_cast<std::streamsize>(bytes.size()));
  if (!*stream_) return cannotWrite();
  return std::monostate{};
}

Status RunWriter::putPacked(std::span<const std::byte> part, std::uint64_t portions) {
  if (Status flushed = flush(); !flushed) return flushed;
  written_ += portions;
  return writeBytes(part);
}

Status RunWriter::put(char kind, std::span<const std::byte> bytes) {
  if (Status flushed = flush(); !flushed) return flushed;
  const Result<std::vector<std::byte>> part = packedPart(kind, bytes);
  if (!part) return Error{file().string() + ": " + part.error().message};
  return writeBytes(*part);
}

Status RunWriter::flush() {
  if (portions_.empty()) return std::monostate{};
  const Result<std::vector<std::byte>> part = packedPortions(portions_, Packing::small);
  if (!part) return Error{file().string() + ": " + part.error().message};
  const std::size_t count = portions_.size();
  portions_.clear();
  pending_ = 0;
  written_ += count;
  return writeBytes(*part);
}

Status RunWriter::add(RunPortion portion) {
  pending_ += sizeOf(portion);
  portions_.push_back(std::move(portion));
  if (pending_ < kPartSize) return std::monostate{};
  return flush();
}

Result<std::uintmax_t> RunWriter::finish() {
  if (Status flushed = flush(); !flushed) return flushed.error();
  const std::string end = "{\"portions\":" + std::to_string(written_) + "}";
  if (Status put = this->put('e', std::as_bytes(std::span(end))); !put) return put.error();
  stream_->close();
  if (!*stream_) return cannotWrite();
  if (const std::error_code failed = file_.giveName(); failed)
    return Error{file().string() + ": cannot be given its name: " + failed.message()};
  std::error_code ignored;
  return std::filesystem::file_size(file(), ignored);
}

}  // namespace carom::audio
