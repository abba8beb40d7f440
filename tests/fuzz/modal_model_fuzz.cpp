#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string_view>
#include <vector>

#include "carom/audio/modal_model_file.h"

namespace {

constexpr std::size_t kChecksumSize = 8;

void require(bool promise) {
  if (!promise) std::abort();
}

/// Requires that an accepted model can be used and has only one encoding in each version: it is
/// written as it was read.
void read(std::span<const std::byte> bytes) {
  const auto model = carom::decodedModalModel(bytes, "fuzz");
  if (!model) {
    require(std::string_view(model.error().message).starts_with("fuzz: "));
    return;
  }
  require(static_cast<bool>(carom::validate(*model)));
  for (std::size_t mode = 0; mode < model->modes.size(); ++mode)
    for (std::size_t vertex = 0; vertex < model->surface.vertices.size(); ++vertex)
      require(model->shape(mode, vertex).allFinite());
  const auto again = carom::encodedModalModel(*model);
  require(static_cast<bool>(again));
  if (bytes[carom::kModalModelMagic.size()] == std::byte{carom::kModalModelVersion}) {
    require(std::ranges::equal(bytes, *again));
    return;
  }
  const auto renewed =
      carom::decodedModalModel(*again, "fuzz");  // an older version became this one
  require(renewed && *carom::encodedModalModel(*renewed) == *again);
}

}  // namespace

/// Requires that any bytes, with a fitting checksum or without, give either a model that can be
/// used or an error.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto given = std::as_bytes(std::span(data, size));
  read(given);
  if (size < kChecksumSize) return 0;
  std::vector<std::byte> sealed(given.begin(), given.end() - kChecksumSize);
  const std::uint64_t checksum = carom::modalModelChecksum(sealed);
  for (std::size_t byte = 0; byte < kChecksumSize; ++byte)
    sealed.push_back(static_cast<std::byte>(checksum >> (8 * byte) & 0xFFU));
  read(sealed);
  return 0;
}
