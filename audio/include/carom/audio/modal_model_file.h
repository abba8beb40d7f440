#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

#include <carom/audio/modal_model.h>
#include <carom/audio/result.h>

namespace carom {

/// The form of a ModalModel for files, exact to the bit. Little-endian on every platform, numbers
/// in IEEE 754, no padding; docs/model_file.md has it byte by byte:
///
///     8 bytes   "caromode"
///     4 bytes   version, 1
///     ...       the sections "body", "surf", "mode" and "shap", once each and in this order:
///               4 bytes tag, 8 bytes length of what follows, content
///     8 bytes   checksum of all before: FNV-1a with 64 bits, which no change of a single byte
///               escapes
///
/// Units and frames are those of ModalModel. Whatever the bytes are, reading either gives a model
/// that can be used (whyNot(ModalModel) has nothing against it) or an error that says what is wrong
/// where; memory is at most some 10 times the number of bytes. [any thread]

inline constexpr std::string_view kModalModelMagic = "caromode";
inline constexpr std::uint32_t kModalModelVersion = 1;
inline constexpr std::string_view kModalModelExtension = ".carom_modes";

/// Refuses a model that cannot be used, and nothing else.
Result<std::vector<std::byte>> encodedModalModel(const ModalModel& model);

/// `name` stands for the bytes in messages.
Result<ModalModel> decodedModalModel(std::span<const std::byte> bytes, std::string_view name);

/// The file appears whole or not at all, in place of what has the name. Blocks on the disk.
Status writeModalModel(const std::filesystem::path& path, const ModalModel& model);

/// Blocks on the disk.
Result<ModalModel> readModalModel(const std::filesystem::path& path);

/// The last 8 bytes of a model that has `bytes` before them.
std::uint64_t modalModelChecksum(std::span<const std::byte> bytes);

}  // namespace carom
