#pragma once

#include <filesystem>
#include <optional>
#include <string_view>

#include "carom/audio/result.h"
#include "carom/audio/rigid_radiator.h"

namespace carom::modal {

/// Ending of the files of recoils.
inline constexpr std::string_view kRecoilExtension = ".carom_recoil";

/// Returns the recoil in a file; nothing if there is none, if it is damaged (its last 32 bytes are
/// the SHA-256 of those before), or of another version. The bytes are those of this machine: a
/// cache is not carried to others. [any thread] Blocks on the disk.
std::optional<RigidRecoil> readRecoil(const std::filesystem::path& file);

/// Writes a recoil, whole or not at all. [any thread] Blocks on the disk.
Status writeRecoil(const std::filesystem::path& file, const RigidRecoil& recoil);

}  // namespace carom::modal
