#include "lab/page/packed_text.h"

#include <limits>
#include <vector>

#include <zlib.h>

#include "modal/gltf/gltf_format.h"

namespace carom::lab {
namespace {

constexpr int kGzip = 15 + 16;  // window bits, and gzip's header about them

}  // namespace

Result<std::string> packedText(std::span<const std::byte> bytes) {
  if (bytes.size() > std::numeric_limits<uInt>::max() / 2)
    return Error{"more than 2 GB cannot be packed at once"};
  z_stream stream = {};
  if (deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, kGzip, 9, Z_DEFAULT_STRATEGY) != Z_OK)
    return Error{"zlib cannot begin: is there no memory?"};
  std::vector<unsigned char> packed(deflateBound(&stream, bytes.size()));
  const auto* const first = reinterpret_cast<const Bytef*>(bytes.data());
  stream.next_in = const_cast<Bytef*>(first);  // NOLINT: it is not written to
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = packed.data();
  stream.avail_out = static_cast<uInt>(packed.size());
  const int ended = deflate(&stream, Z_FINISH);
  const std::size_t size = packed.size() - stream.avail_out;
  deflateEnd(&stream);
  if (ended != Z_STREAM_END) return Error{"zlib cannot pack: its error " + std::to_string(ended)};
  return modal::toBase64(std::as_bytes(std::span(packed).first(size)));
}

}  // namespace carom::lab
