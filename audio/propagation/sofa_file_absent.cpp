// Takes the place of sofa_file.cpp in a build without libmysofa.

#include "audio/propagation/sofa_file.h"

namespace carom::audio {

Result<HrtfMeasurements> readSofaFile(const std::filesystem::path& path) {
  return Error{"SOFA file '" + path.string() +
               "': this build of Carom reads none; build it with CAROM_HRTF=ON"};
}

std::filesystem::path defaultSofaFile() {
  return "default.sofa";
}

}  // namespace carom::audio
