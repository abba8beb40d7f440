#pragma once

#include <filesystem>

#include "audio/propagation/hrtf.h"
#include "carom/audio/result.h"

struct MYSOFA_HRTF;

namespace carom::audio {

/// Reads the measurements in a SOFA file (AES69) of convention SimpleFreeFieldHRIR, turned into the
/// listener's frame: SOFA has x ahead, y left and z up. The length of each direction is the
/// distance of the source, m.
///
/// libmysofa parses the file; its output is checked here, since it may contradict itself. Errors,
/// each one sentence with the name of the file: it is missing or no regular file, libmysofa cannot
/// read it, another convention or data type, other than two receivers, sizes that contradict each
/// other, values that are not finite, a listener that does not look along x with z up. A build
/// without libmysofa always returns an error. [any thread but the audio thread]
Result<HrtfMeasurements> readSofaFile(const std::filesystem::path& path);

/// Checks what libmysofa found in a file, and turns it into the listener's frame. Errors, without
/// the name of the file, as those of `readSofaFile` behind libmysofa. A build without libmysofa has
/// no such function. [any thread but the audio thread]
Result<HrtfMeasurements> measurementsOf(const MYSOFA_HRTF& file);

/// Returns the path of libmysofa's default set; if there is none, its path when Carom was built.
std::filesystem::path defaultSofaFile();

}  // namespace carom::audio
