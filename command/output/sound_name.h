#pragma once

#include <memory>
#include <optional>
#include <string>

#include <sndfile.h>

#include "carom/audio/result.h"

namespace carom::command {

using ReadFile = std::unique_ptr<SNDFILE, decltype(&sf_close)>;

/// Opens a sound file; null if it is none.
ReadFile openSound(const std::string& file, SF_INFO& info);

/// Returns the full scale (Pa) that Carom's sound files have in their comment; nothing if it has
/// none.
std::optional<double> fullScaleIn(SNDFILE* file);

/// Returns the name of the sound of a scene or a recording that no name was given for: that of its
/// file with .wav, in the current folder. Refuses to replace a file that is no sound of Carom's.
Result<std::string> soundNameOf(const std::string& input);

}  // namespace carom::command
