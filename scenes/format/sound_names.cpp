#include "scenes/format/sound_names.h"

namespace carom::scenes {

const char* nameOf(PulseShape shape) {
  switch (shape) {
    case PulseShape::halfSine:
      return "half_sine";
    case PulseShape::gaussian:
      return "gaussian";
    case PulseShape::mitchellNetravali:
      return "mitchell_netravali";
    case PulseShape::courseGaussian:
      return "course_gaussian";
    case PulseShape::hertz:
      break;
  }
  return "hertz";
}

const char* pulseName(PulseShape pulse, bool dissipative) {
  return dissipative ? "dissipative" : nameOf(pulse);
}

const char* samplingName(Sampling sampling) {
  return sampling == Sampling::naive ? "naive" : "band_limited";
}

const char* radiationName(Radiation radiation) {
  return radiation == Radiation::compact ? "compact" : "exact";
}

const char* ringingName(RingingContact ringing) {
  return ringing == RingingContact::coupled ? "coupled" : "pressed";
}

}  // namespace carom::scenes
