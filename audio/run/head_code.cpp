#include "audio/run/head_code.h"

#include <algorithm>
#include <cstdint>

#include "audio/io/field_code.h"

namespace carom::audio {
namespace {

constexpr std::uint32_t kHeadMagic = 0x64616568;  // "head"
constexpr std::size_t kLeastItem = 5 * sizeof(double);

void codeHead(auto& archive, auto& magic, auto& head) {
  archive.number(magic);
  archive.number(head.sampleRate);
  archive.count(head.items, kLeastItem);
  for (auto& item : head.items) {
    codeMatrix(archive, item.direction);
    for (auto& delay : item.delay)
      archive.number(delay);
    for (auto& response : item.response) {
      archive.count(response, sizeof(float));
      for (auto& sample : response)
        archive.number(sample);
    }
  }
}

}  // namespace

std::vector<std::byte> encodedHead(const HrtfMeasurements& head, std::size_t most) {
  HrtfMeasurements cut = head;
  for (HrtfMeasurement& item : cut.items)
    for (std::vector<float>& response : item.response)
      response.resize(std::min(response.size(), most));
  std::vector<std::byte> bytes;
  FieldWriter writer(bytes);
  codeHead(writer, kHeadMagic, cut);
  return bytes;
}

Result<HrtfMeasurements> decodedHead(std::span<const std::byte> bytes) {
  HrtfMeasurements head;
  FieldReader reader(bytes, 0);
  std::uint32_t magic = 0;
  codeHead(reader, magic, head);
  reader.end();
  if (!reader.fault().empty()) return Error{reader.fault()};
  if (magic != kHeadMagic) return Error{"does not begin as a head does"};
  return head;
}

}  // namespace carom::audio
