#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace carom::modal {

// Constants of glTF 2.0 and GLB (Khronos, glTF 2.0 specification, 3.6.2 and 4.4), which the reader
// and the writer share.

// glTF and GLB are little-endian, and so is all that this project is built on; a float and an
// integer are copied as they are.
static_assert(std::endian::native == std::endian::little);

inline constexpr std::size_t kUnsignedByte = 5121;
inline constexpr std::size_t kUnsignedShort = 5123;
inline constexpr std::size_t kUnsignedInt = 5125;
inline constexpr std::size_t kFloat = 5126;

inline constexpr std::uint32_t kGlbMagic = 0x46546C67;   // "glTF"
inline constexpr std::uint32_t kJsonChunk = 0x4E4F534A;  // "JSON"
inline constexpr std::uint32_t kBinChunk = 0x004E4942;   // "BIN\0"
inline constexpr std::size_t kGlbHeaderSize = 12;
inline constexpr std::size_t kChunkHeaderSize = 8;
inline constexpr std::size_t kWord = 4;  ///< bytes; the alignment of glTF

/// Digits of base64 (RFC 4648, section 4).
inline constexpr std::string_view kBase64 =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
/// Returns bytes as text in base64, with its padding. [any thread]
std::string toBase64(std::span<const std::byte> bytes);

}  // namespace carom::modal
