#include "audio/run/run_writer.h"

#include <fstream>
#include <string>
#include <system_error>
#include <utility>

#include "audio/run/run_tables.h"

namespace carom::audio {

Result<std::vector<std::byte>> packedPortions(std::span<const RunPortion> portions,
                                              Packing packing) {
  return packedPart('p', encodedPortions(portions), packing);
}

Result<RunWriter> RunWriter::create(const std::filesystem::path& file, std::uint32_t version) {
  if (const Status valid = checkWritable(file); !valid)
    return Error{file.string() + ": " + valid.error().message};
  PartialFile partial(file);
  auto stream = std::make_shared<std::ofstream>(partial.path(), std::ios::binary | std::ios::trunc);
  RunWriter writer(std::move(partial), std::move(stream), version);
  if (Status put = writer.write(std::monostate{}); !put) return put.error();
  return writer;
}

Error RunWriter::cannotWrite() const {
  return Error{file().string() + ": cannot be written; is there room on the disk?"};
}

/// Writes what the encoder has made, unless it has refused something.
Status RunWriter::write(const Status& encoded) {
  if (!encoded) return Error{file().string() + ": " + encoded.error().message};
  const std::vector<std::byte> bytes = encoder_.take();
  if (bytes.empty()) return std::monostate{};
  stream_->write(reinterpret_cast<const char*>(bytes.data()), std::ssize(bytes));
  stream_->flush();  // an error is known now, and not when more has been dropped
  if (!*stream_) return cannotWrite();
  offset_ += bytes.size();
  return std::monostate{};
}

Status RunWriter::goBackTo(const Place& place) {
  stream_->close();
  std::error_code failed;
  std::filesystem::resize_file(file_.path(), place.offset, failed);
  if (failed) return cannotWrite();
  stream_->clear();
  stream_->open(file_.path(), std::ios::binary | std::ios::app);
  if (!*stream_) return cannotWrite();
  encoder_.goBackTo(place.portions);
  offset_ = place.offset;
  return std::monostate{};
}

Status RunWriter::putPacked(std::span<const std::byte> part, std::uint64_t portions) {
  return write(encoder_.putPacked(part, portions));
}

Status RunWriter::put(char kind, std::span<const std::byte> bytes) {
  return write(encoder_.put(kind, bytes));
}

Status RunWriter::add(RunPortion portion) {
  return write(encoder_.add(std::move(portion)));
}

Result<std::uintmax_t> RunWriter::finish() {
  if (const Status written = write(encoder_.finish()); !written) return written.error();
  stream_->close();
  if (!*stream_) return cannotWrite();
  if (const std::error_code failed = file_.giveName(); failed)
    return Error{file().string() + ": cannot be given its name: " + failed.message()};
  std::error_code ignored;
  return std::filesystem::file_size(file(), ignored);
}

}  // namespace carom::audio
