// Takes the place of normal_map.cpp in a build without libpng.

#include <string>

#include "carom/audio/normal_map.h"

namespace carom {

Result<SurfaceTexture> normalMapFromBytes(std::span<const std::byte>, std::string_view name,
                                          const NormalMapSettings&) {
  return Error{"normal map '" + std::string(name) +
               "': this build of Carom reads none; build it with CAROM_NORMAL_MAPS=ON"};
}

Result<SurfaceTexture> readNormalMap(const std::filesystem::path& path,
                                     const NormalMapSettings& settings) {
  return normalMapFromBytes({}, path.string(), settings);
}

}  // namespace carom
