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

/// The file format of a ModalModel, exact to the bit. Little-endian on every platform, numbers in
/// IEEE 754, no padding; docs/model_file.md has it byte by byte:
///
///     8 bytes   "caromode"
///     4 bytes   version, 2; files of version 1, which do not say what of a decay is
///               sound, are read too
///     ...       the sections "body", "surf", "mode" and "shap", once each and in this order:
///               4 bytes tag, 8 bytes length of what follows, content
///     8 bytes   checksum of all before: FNV-1a with 64 bits, which no change of a single byte
///               escapes
///
/// Units and frames are those of ModalModel. Whatever the bytes are, reading them gives either a
/// model that can be used (validate(ModalModel) accepts it) or an error that says what is wrong
/// where; memory is at most some 10 times the number of bytes. [any thread]

inline constexpr std::string_view kModalModelMagic = "caromode";
inline constexpr std::uint32_t kModalModelVersion = 5;
inline constexpr std::string_view kModalModelExtension = ".carom_modes";

/// Returns the bytes of a model file. Error only if the model cannot be used.
Result<std::vector<std::byte>> encodedModalModel(const ModalModel& model);

/// Reads a model from the bytes of a file; `name` stands for them in error messages.
Result<ModalModel> decodedModalModel(std::span<const std::byte> bytes, std::string_view name);

/// Writes a model file, which appears whole or not at all and replaces a file of that name. Blocks
/// on the disk.
Status writeModalModel(const std::filesystem::path& path, const ModalModel& model);

/// Reads a model file. Blocks on the disk.
Result<ModalModel> readModalModel(const std::filesystem::path& path);

/// Returns the checksum of a model file, its last 8 bytes, from the `bytes` before them.
std::uint64_t modalModelChecksum(std::span<const std::byte> bytes);

}  // namespace carom
