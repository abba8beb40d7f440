#pragma once

#include <filesystem>

#include "audio/hrtf.h"
#include "carom/audio/result.h"

namespace carom::audio {

/// The measurements in a SOFA file (AES69) of convention SimpleFreeFieldHRIR, turned into the
/// listener's frame: SOFA has x ahead, y left and z up. The length of each direction is the
/// distance of the source, m.
///
/// libmysofa takes the file apart; what comes out of it is checked here, since it is not known to
/// agree with itself. Errors, each one sentence with the name of the file: it is missing or no
/// regular file, libmysofa cannot read it, another convention or data type, other than two
/// receivers, sizes that contradict each other, values that are not finite, a listener that does
/// not look along x with z up. In a build without libmysofa: always. [any thread but the audio
/// thread]
Result<HrtfMeasurements> readSofaFile(const std::filesystem::path& path);

/// The default set of libmysofa; where it was when Carom was built, if it is nowhere.
std::filesystem::path defaultSofaFile();

}  // namespace carom::audio
