#include "audio/run/run_encoder.h"

#include <string>
#include <utility>

#include "audio/io/field_code.h"
#include "audio/run/run_tables.h"
#include "carom/audio/modal_model_file.h"

namespace carom::audio {

namespace {

constexpr std::size_t kPartSize = std::size_t{1} << 20U;  // bytes, about, from which it is packed

}  // namespace

Result<std::vector<std::byte>> packedPart(char kind, std::span<const std::byte> bytes,
                                          Packing packing) {
  if (bytes.size() > kMostUnpacked) return Error{"a part of the run cannot be packed"};
  const Result<std::vector<std::byte>> packed = zstdFrame(bytes, packing);
  if (!packed) return packed.error();
  std::vector<std::byte> part;
  FieldWriter head(part);
  head.number(static_cast<std::uint8_t>(kind));
  head.number(static_cast<std::uint32_t>(packed->size()));
  head.number(static_cast<std::uint32_t>(bytes.size()));
  head.number(modalModelChecksum(*packed));
  part.insert(part.end(), packed->begin(), packed->end());
  return part;
}

std::size_t sizeOf(const RunPortion& portion) {
  std::size_t points = 0;
  for (const JelloPicture& picture : portion.pictures)
    points += picture.points.size();
  return sizeof(portion) + portion.events.size() * sizeof(ImpulseEvent) +
         portion.contacts.size() * sizeof(ContactState) + portion.poses.size() * sizeof(BodyPose) +
         portion.deformations.size() * sizeof(DeformingState) + points * sizeof(double);
}

RunEncoder::RunEncoder(std::uint32_t version) {
  FieldWriter fields(bytes_);
  for (const char letter : kRunMagic)
    fields.number(static_cast<std::uint8_t>(letter));
  fields.number(version);
}

Status RunEncoder::append(const Result<std::vector<std::byte>>& part) {
  if (!part) return part.error();
  bytes_.insert(bytes_.end(), part->begin(), part->end());
  return std::monostate{};
}

Status RunEncoder::putPacked(std::span<const std::byte> part, std::uint64_t portions) {
  if (Status flushed = flush(); !flushed) return flushed;
  packed_ += portions;
  bytes_.insert(bytes_.end(), part.begin(), part.end());
  return std::monostate{};
}

Status RunEncoder::put(char kind, std::span<const std::byte> bytes) {
  if (Status flushed = flush(); !flushed) return flushed;
  return append(packedPart(kind, bytes));
}

Status RunEncoder::flush() {
  if (portions_.empty()) return std::monostate{};
  Status appended = append(packedPart('p', encodedPortions(portions_)));
  if (appended) packed_ += portions_.size();
  portions_.clear();
  pending_ = 0;
  return appended;
}

void RunEncoder::goBackTo(std::uint64_t packed) {
  bytes_.clear();
  portions_.clear();
  pending_ = 0;
  packed_ = packed;
}

Status RunEncoder::add(RunPortion portion) {
  pending_ += sizeOf(portion);
  portions_.push_back(std::move(portion));
  if (pending_ < kPartSize) return std::monostate{};
  return flush();
}

Status RunEncoder::finish() {
  if (Status flushed = flush(); !flushed) return flushed;
  const std::string end = "{\"portions\":" + std::to_string(packed_) + "}";
  return put('e', std::as_bytes(std::span(end)));
}

std::vector<std::byte> RunEncoder::take() {
  return std::exchange(bytes_, {});
}

}  // namespace carom::audio
