#pragma once

#include "carom/audio/synth_settings.h"

namespace carom::scenes {

// Names of settings of the sound, as scene files and the command line have them. [any thread]

const char* nameOf(PulseShape shape);
/// Returns the name of `pulse`, or "dissipative".
const char* pulseName(PulseShape pulse, bool dissipative);
const char* samplingName(Sampling sampling);
const char* radiationName(Radiation radiation);
const char* ringingName(RingingContact ringing);

}  // namespace carom::scenes
