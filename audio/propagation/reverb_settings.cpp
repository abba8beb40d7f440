#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "audio/propagation/reverb.h"
#include "carom/audio/room.h"

namespace carom {

using namespace audio;

namespace {

constexpr double kSixtyDecibel = 6.0 * std::numbers::ln10;  // logarithm of a ratio of energies

DecayTimes decayTimesOf(const RoomMeasures& room, double speedOfSound,
                        const std::array<double, kBandCount>& attenuation,
                        double (*exponent)(double)) {
  DecayTimes times{};
  for (std::size_t band = 0; band < kBandCount; ++band) {
    const double area = room.surface * exponent(room.meanAbsorption.coefficients[band]) +
                        4.0 * attenuation[band] * room.volume;
    times[band] = 4.0 * kSixtyDecibel * room.volume / (speedOfSound * area);
  }
  return times;
}

}  // namespace

DecayTimes sabineDecayTimes(const RoomMeasures& room, double speedOfSound,
                            const std::array<double, kBandCount>& attenuation) {
  return decayTimesOf(room, speedOfSound, attenuation, [](double alpha) { return alpha; });
}

DecayTimes eyringDecayTimes(const RoomMeasures& room, double speedOfSound,
                            const std::array<double, kBandCount>& attenuation) {
  return decayTimesOf(room, speedOfSound, attenuation,
                      [](double alpha) { return -std::log1p(-alpha); });
}

double onsetAfter(int order, double volume, double surface, double speedOfSound) {
  return (order + 1) * 4.0 * volume / (surface * speedOfSound);
}

Result<ReverbSettings> reverbOfBox(const Room& room, double speedOfSound) {
  const Result<RoomMeasures> measures = measureBox(room);
  if (!measures) return measures.error();
  ReverbSettings settings;
  settings.volume = measures->volume;
  settings.surface = measures->surface;
  settings.speedOfSound = speedOfSound;
  settings.decayTimes = eyringDecayTimes(*measures, speedOfSound);
  settings.includesAir = false;
  for (double& time : settings.decayTimes) {
    if (std::isinf(time)) {
      return Error{
          "reverberation: a box whose walls absorb nothing in some band rings for ever; "
          "give a wall an absorption, or set the decay times by hand"};
    }
    time = std::max(time, kShortestDecay);
  }
  settings.onset =
      std::min(1.0, onsetAfter(room.order, settings.volume, settings.surface, speedOfSound));
  if (Status checked = checkSettings(settings); !checked) return checked.error();
  return settings;
}

}  // namespace carom
