#include "lab/fit/tap_modes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <functional>
#include <numbers>
#include <span>

#include "lab/fit/level_statistics.h"
#include "lab/fit/spectral_peaks.h"
#include "lab/fit/subband.h"
#include "lab/fit/subspace_modes.h"

namespace carom::lab {

namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

/// Bands of one width, which find the modes whose decay fits it.
struct BandScale {
  double width;         // Hz
  double window;        // s, at most
  double slowestDecay;  // 1/s
  double fastestDecay;  // 1/s
  double delay;         // s, for the early reflections to come in, each of which is an onset
};
constexpr std::array<BandScale, 5> kScales = {{{200.0, 1.5, -1.0, 45.0, 0.025},
                                               {800.0, 0.4, 8.0, 90.0, 0.012},
                                               {800.0, 0.12, 22.0, 200.0, 0.005},
                                               {3200.0, 0.1, 40.0, 250.0, 0.0},
                                               {3200.0, 0.03, 90.0, 1500.0, 0.0}}};
constexpr double kFittingWindow = 6.0;  // time constants in a window that fits a mode

constexpr double kHighestShare = 0.45;     // of the sampling rate
constexpr double kNoiseWindow = 0.5;       // s
constexpr double kLeastBackground = 0.04;  // s before the onset, to know the noise by
constexpr double kLeakage = 3e-9;          // power that passes the filters from elsewhere
constexpr double kQuantised = 8e-11;       // power of the rounding to 16 bits
constexpr double kTailGap = 6.0;           // dB: what is less faint than that is no tail
constexpr double kClearOfSkirts = 14.0;    // dB
constexpr double kReflections = 0.6;       // amplitude of early reflections, and a reserve
constexpr std::array<double, 3> kBackgroundWindows = {0.5, 0.12, 0.03};  // s
constexpr double kLeastAbove = 9.0;  // dB: less is what noise and rooms do by chance
constexpr double kSurelyAbove = 18.0;
constexpr double kFallWidth = 3.0;      // Hz of a band for 1/s of decay: it follows the fall
constexpr double kLeastFall = 12.0;     // dB; 22 where nothing else rings
constexpr double kShadow = 5.0;         // half widths of a quick mode, where its room rings on
constexpr double kSlowDecay = 14.0;     // 1/s: slower than rooms, mostly
constexpr double kClearForLate = 38.0;  // dB above the noise
constexpr std::array<double, 3> kLateDelays = {0.35, 0.2, 0.1};  // s
constexpr double kLateRatio = 2200.0;  // energy over noise: 3 % of the decay
constexpr double kLateChange = 0.5;    // of the logarithm of a decay: more is another mode
constexpr double kUnlike = 2.5;        // ratio of decays
constexpr double kHumShare = 0.3;      // of the amplitude: what was there before is no mode
constexpr double kHumDecay = 1.5;      // 1/s: a steady tone decays less

/// A mode as one band has found it.
struct BandMode {
  TapMode mode;
  std::vector<double> amplitudes;  // at the onset, by tap
  double length = 0.0;             // s, of the window
  std::size_t scale = 0;
  std::size_t band = 0;
};

/// The density of the background of a tap over frequency.
class NoiseDensity {
 public:
  explicit NoiseDensity(const TapSegment& tap) {
    const auto window = static_cast<std::size_t>(kNoiseWindow * tap.sampleRate);
    const auto least = static_cast<std::size_t>(kLeastBackground * tap.sampleRate);
    std::span<const double> quiet = tap.before;
    if (quiet.size() < least) quiet = tap.free().last(tap.free().size() / 4);
    quiet = quiet.last(std::min(window, quiet.size()));
    spectrum_ = ringSpectrum(quiet, quiet.size(), tap.sampleRate);
    double power = 0.0;
    const std::span<const double> loud = tap.free().first(
        std::min(tap.free().size(), static_cast<std::size_t>(0.03 * tap.sampleRate)));
    for (const double sample : loud)
      power += sample * sample / static_cast<double>(loud.size());
    leakage_ = kLeakage * power;
    floor_ = 2.0 * kQuantised / tap.sampleRate;
  }

  /// Returns the variance of the noise in the outputs of a band: by the median, which lines of hum
  /// and modes do not change.
  double in(const Subband& band) const {
    const auto from = static_cast<std::size_t>(
        std::max(0.0, (band.centre() - 0.5 * band.width()) / spectrum_.step));
    const auto to = std::min(
        spectrum_.power.size(),
        static_cast<std::size_t>((band.centre() + 0.5 * band.width()) / spectrum_.step) + 2);
    const double median = medianOf(spectrum_.power, std::min(from, to - 1), to);
    const double density = std::max(median / std::numbers::ln2, floor_);
    return std::max(0.5 * density * band.noiseBandwidth(), leakage_);
  }

 private:
  PowerSpectrum spectrum_;
  double leakage_ = 0.0;
  double floor_ = 0.0;
};

/// The spectra of a ring, by which modes are told from what is dense: noise and the tail of a room.
class RingBackground {
 public:
  explicit RingBackground(const TapSegment& tap) {
    for (const double window : kBackgroundWindows) {
      const auto size = static_cast<std::size_t>(window * tap.sampleRate);
      spectra_.push_back(ringSpectrum(tap.free(), size, tap.sampleRate));
    }
  }

  /// Returns how far (dB) the spectrum at the mode stands above its median around, with the window
  /// that fits its decay.
  double above(double frequency, double decayRate) const {
    std::size_t best = 0;
    for (std::size_t window = 1; window < kBackgroundWindows.size(); ++window) {
      if (kBackgroundWindows.at(window) * decayRate > 1.5) best = window;
    }
    const PowerSpectrum& spectrum = spectra_[best];
    const double around = std::max(0.06 * frequency, 12.0 / kBackgroundWindows.at(best));
    const auto binOf = [&](double at) {
      const double bin =
          std::clamp(at / spectrum.step, 1.0, static_cast<double>(spectrum.power.size()) - 2.0);
      return static_cast<std::size_t>(std::lround(bin));
    };
    const std::size_t middle = binOf(frequency);
    const double peak =
        std::max({spectrum.power[middle - 1], spectrum.power[middle], spectrum.power[middle + 1]});
    return decibels(
        peak / medianOf(spectrum.power, binOf(frequency - around), binOf(frequency + around) + 1));
  }

 private:
  std::vector<PowerSpectrum> spectra_;
};

/// Returns how many samples later a scale begins in a tap.
std::size_t delayOf(const TapSegment& tap, const BandScale& scale) {
  const auto delay = static_cast<std::size_t>(scale.delay * tap.sampleRate);
  return std::min(delay, tap.free().size() / 8);
}

/// Makes a mode of a pole, or nothing where the band is not the one for it.
bool toBandMode(const BandPole& pole, const Subband& band, const std::vector<TapSegment>& taps,
                const BandScale& scale, BandMode& made) {
  TapMode& mode = made.mode;
  mode.frequency = band.centre() + pole.s.imag() / kTurn;
  mode.decayRate = -pole.s.real();
  if (std::abs(mode.frequency - band.centre()) > 0.51 * band.width()) return false;
  if (mode.decayRate < scale.slowestDecay || mode.decayRate > scale.fastestDecay) return false;
  if (mode.decayRate * pole.length < -0.2 || mode.decayRate > 0.5 * mode.frequency) return false;
  mode.decayRate = std::max(mode.decayRate, 1e-3);
  const std::complex<double> s(-mode.decayRate, kTurn * mode.frequency);
  const double gain = std::abs(band.gain(s));
  for (std::size_t tap = 0; tap < taps.size(); ++tap)
    made.amplitudes.push_back(
        2.0 * std::abs(pole.amplitudes[tap]) / gain *
        std::exp(mode.decayRate *
                 (taps[tap].beginTime() +
                  static_cast<double>(delayOf(taps[tap], scale)) / taps[tap].sampleRate)));
  // Energy over density: outputs are `rate` a second, and their noise fills the noise bandwidth.
  const double ratio = pole.energyRatio * band.noiseBandwidth() / band.rate();
  mode.overNoise = decibels(ratio);
  mode.stability = pole.stability;
  mode.bySubspace = true;
  const double slow = std::max(mode.decayRate, 1.5 / pole.length);
  mode.decayError = slow * std::sqrt(2.0 / std::max(ratio, 1e-3));
  mode.frequencyError = mode.decayError / kTurn;
  made.length = pole.length;
  return true;
}

/// The taps and settings that a search for modes goes through band by band. `goesOn` is told the
/// share of the search that is done; false ends it.
struct BandSearch {
  const std::vector<TapSegment>& taps;
  const std::vector<NoiseDensity>& noises;
  const TapModeSettings& settings;
  std::function<bool(double)> goesOn;
};

std::vector<BandMode> modesOfScale(const BandSearch& search, std::size_t scaleIndex) {
  const auto& [taps, noises, settings, goesOn] = search;
  const BandScale& scale = kScales[scaleIndex];
  const double sampleRate = taps.front().sampleRate;
  const double highest = std::min(settings.highest, kHighestShare * sampleRate);
  std::vector<BandMode> found;
  std::size_t index = 0;
  const auto bands =
      static_cast<std::size_t>(std::ceil(std::max(highest - settings.lowest, 0.0) / scale.width));
  for (; index < bands; ++index) {
    const double share = static_cast<double>(index) / static_cast<double>(bands);
    if (!goesOn((static_cast<double>(scaleIndex) + share) / kScales.size())) return found;
    const double from = settings.lowest + static_cast<double>(index) * scale.width;
    const Subband band(from + 0.5 * scale.width, scale.width, sampleRate);
    std::vector<BandSignal> signals;
    for (std::size_t tap = 0; tap < taps.size(); ++tap)
      signals.push_back({band.of(taps[tap].free().subspan(delayOf(taps[tap], scale)),
                                 static_cast<std::size_t>(scale.window * band.rate())),
                         noises[tap].in(band)});
    for (const BandPole& pole : subspaceModes(signals, band.rate())) {
      BandMode mode;
      mode.scale = scaleIndex;
      mode.band = index;
      if (toBandMode(pole, band, taps, scale, mode)) found.push_back(std::move(mode));
    }
  }
  return found;
}

bool isDuplicate(const BandMode& mode, const BandMode& known) {
  if (mode.scale == known.scale && mode.band == known.band) return false;
  // A clear slow mode in the width of a faint quick one is no part of it.
  if (kUnlike * mode.mode.decayRate < known.mode.decayRate &&
      mode.mode.overNoise > known.mode.overNoise)
    return false;
  const double apart = std::abs(mode.mode.frequency - known.mode.frequency);
  const double decay = std::max(mode.mode.decayRate, known.mode.decayRate);
  if (mode.scale == known.scale) return apart < decay / kTurn + 0.3 / mode.length;
  return apart < 2.0 * decay / kTurn + 0.7 / mode.length;
}

/// Takes frequency and decay of a slow mode from later on, when the room is silent that began to
/// ring with it: from the latest of a few beginnings at which the mode still stands clear of the
/// noise.
void refineLate(BandMode& mode, const std::vector<TapSegment>& taps,
                const std::vector<NoiseDensity>& noises) {
  if (mode.mode.decayRate > kSlowDecay || mode.mode.overNoise < kClearForLate) return;
  const Subband band(mode.mode.frequency, kScales[0].width, taps.front().sampleRate);
  for (const double delay : kLateDelays) {
    std::vector<BandSignal> signals;
    for (std::size_t tap = 0; tap < taps.size(); ++tap) {
      const std::span<const double> ring = taps[tap].free();
      const auto skipped = static_cast<std::size_t>(delay * taps[tap].sampleRate);
      signals.push_back({band.of(ring.subspan(std::min(skipped, ring.size())),
                                 static_cast<std::size_t>(kScales[0].window * band.rate())),
                         noises[tap].in(band)});
    }
    for (const BandPole& pole : subspaceModes(signals, band.rate())) {
      const double ratio = pole.energyRatio * band.noiseBandwidth() / band.rate();
      const double decay = -pole.s.real();
      const double off = std::abs(pole.s.imag()) / kTurn;  // from the mode, which is the centre
      if (decay <= 0.0 || ratio < kLateRatio || off > 0.1 + 0.2 * mode.mode.decayRate / kTurn)
        continue;
      if (std::abs(std::log(decay / mode.mode.decayRate)) > kLateChange) continue;
      mode.mode.frequency += pole.s.imag() / kTurn;
      mode.mode.decayRate = decay;
      mode.mode.decayError = decay * std::sqrt(2.0 / ratio);
      mode.mode.frequencyError = mode.mode.decayError / kTurn;
      return;
    }
  }
}

/// Returns by how much (dB) the level around a mode falls from its first time constant to the
/// third.
double fallOf(const TapSegment& tap, const TapMode& mode) {
  const Subband band(mode.frequency, kFallWidth * mode.decayRate, tap.sampleRate);
  const double constant = band.rate() / mode.decayRate;  // outputs
  const std::vector<std::complex<double>> outputs =
      band.of(tap.free(), static_cast<std::size_t>(3.5 * constant) + 1);
  const auto power = [&](double from, double to) {
    double sum = 0.0;
    double count = 0.0;
    for (auto at = static_cast<std::size_t>(from * constant);
         at < std::min(outputs.size(), static_cast<std::size_t>(to * constant) + 1); ++at) {
      sum += std::norm(outputs[at]);
      count += 1.0;
    }
    return count > 0.0 ? sum / count : 0.0;
  };
  const double late = power(2.3, 3.3);
  return late > 0.0 ? decibels(power(0.0, 0.6) / late) : 0.0;
}

/// True for a quick mode that is surely one: its ring is over within the window, and its band does
/// fall as fast. Many slow modes that run out of step look like a quick one for a while, but do
/// not.
bool isSurelyQuick(const BandMode& mode, const std::vector<TapSegment>& taps) {
  if (mode.scale == 0 || mode.mode.overNoise < 22.0 || mode.mode.stability < 0.6) return false;
  if (mode.mode.decayRate * kScales.at(mode.scale).window < 2.5) return false;
  const auto loudest = std::ranges::max_element(mode.amplitudes) - mode.amplitudes.begin();
  return fallOf(taps[static_cast<std::size_t>(loudest)], mode.mode) > kLeastFall;
}

/// True if a mode is what the room makes of a quicker one.
bool isShadow(const BandMode& mode, const BandMode& quick) {
  const double apart = std::abs(mode.mode.frequency - quick.mode.frequency);
  return mode.mode.decayRate < 0.7 * quick.mode.decayRate &&
         mode.mode.overNoise < quick.mode.overNoise - 3.0 &&
         apart < kShadow * quick.mode.decayRate / kTurn;
}

/// Joins what bands have found: quick modes that are sure come first, for a room rings on where
/// they were; of two that are one, that of the window that fits its decay stays, of equal ones the
/// clearer.
std::vector<BandMode> joinedModes(std::vector<BandMode> found,
                                  const std::vector<TapSegment>& taps) {
  std::vector<BandMode> quick;
  for (const BandMode& mode : found) {
    if (isSurelyQuick(mode, taps)) quick.push_back(mode);
  }
  std::erase_if(found, [&](const BandMode& mode) {
    return std::ranges::any_of(quick, [&](const BandMode& one) { return isShadow(mode, one); });
  });
  const auto misfit = [](const BandMode& mode) {
    const double constants = mode.mode.decayRate * kScales.at(mode.scale).window;
    return std::lround(3.0 * std::abs(std::log(std::max(constants, 0.01) / kFittingWindow)));
  };
  std::ranges::stable_sort(found, [&](const BandMode& one, const BandMode& other) {
    if (misfit(one) != misfit(other)) return misfit(one) < misfit(other);
    return one.mode.overNoise > other.mode.overNoise;
  });
  std::vector<BandMode> joined;
  for (BandMode& mode : found) {
    if (std::ranges::none_of(joined,
                             [&](const BandMode& known) { return isDuplicate(mode, known); }))
      joined.push_back(std::move(mode));
  }
  return joined;
}

/// Sets the levels, of each mode its highest over the taps, relative to the tap's strongest.
void setLevels(std::vector<BandMode>& modes) {
  if (modes.empty()) return;
  std::vector<double> strongest(modes.front().amplitudes.size(), 1e-300);
  for (const BandMode& mode : modes) {
    for (std::size_t tap = 0; tap < strongest.size(); ++tap)
      strongest[tap] = std::max(strongest[tap], mode.amplitudes[tap]);
  }
  for (BandMode& mode : modes) {
    mode.mode.level = -300.0;
    for (std::size_t tap = 0; tap < strongest.size(); ++tap)
      mode.mode.level =
          std::max(mode.mode.level, 2.0 * decibels(mode.amplitudes[tap] / strongest[tap]));
  }
}

/// Returns the amplitude of a steady tone in the background, or nothing if that is too short.
double toneBefore(const TapSegment& tap, double frequency) {
  const auto longest = static_cast<std::size_t>(tap.sampleRate);
  const std::span<const double> quiet =
      std::span(tap.before).last(std::min(longest, tap.before.size()));
  if (static_cast<double>(quiet.size()) < 0.15 * tap.sampleRate) return 0.0;
  std::complex<double> sum = 0.0;
  double weights = 0.0;
  for (std::size_t at = 0; at < quiet.size(); ++at) {
    const double share = (static_cast<double>(at) + 0.5) / static_cast<double>(quiet.size());
    const double weight = 0.5 - 0.5 * std::cos(kTurn * share);
    sum += weight * quiet[at] *
           std::polar(1.0, -kTurn * frequency * static_cast<double>(at) / tap.sampleRate);
    weights += weight;
  }
  return 2.0 * std::abs(sum) / weights;
}

/// True if the frequency is a harmonic of the mains.
bool isMains(double frequency) {
  const auto near = [frequency](double mains) {
    return std::abs(frequency - mains * std::round(frequency / mains)) < 0.4;
  };
  return frequency > 45.0 && frequency < 1300.0 && (near(50.0) || near(60.0));
}

bool isHum(const BandMode& mode, const std::vector<TapSegment>& taps) {
  if (mode.mode.decayRate > kHumDecay) return false;
  for (std::size_t tap = 0; tap < taps.size(); ++tap) {
    const double amplitude = toneBefore(taps[tap], mode.mode.frequency);
    if (amplitude > kHumShare * mode.amplitudes[tap]) return true;
  }
  return isMains(mode.mode.frequency);
}

/// Returns how far (dB) the peak of a mode stands above the skirt that another one's onset, its
/// reflections and the tail of the room leave there.
double overSkirt(const BandMode& mode, const BandMode& other) {
  const double gap = other.mode.level - mode.mode.level;
  const double apart = std::abs(mode.mode.frequency - other.mode.frequency);
  const double wide = std::max(apart, other.mode.decayRate / kTurn);
  const double skirt = std::pow(10.0, gap / 20.0) * kReflections / (kTurn * wide);
  return -2.0 * decibels(mode.mode.decayRate * skirt);
}

/// True if a fainter mode is what a room, or a fit that is not perfect, leaves beside another.
bool isTail(const BandMode& mode, const BandMode& other) {
  return other.mode.level - mode.mode.level > kTailGap && overSkirt(mode, other) < 0.0;
}

/// Returns how far (dB) a mode stands above the skirts of all that are louder.
double overSkirts(const BandMode& mode, const std::vector<BandMode>& modes) {
  double least = kClearOfSkirts;
  for (const BandMode& other : modes) {
    if (other.mode.level > mode.mode.level) least = std::min(least, overSkirt(mode, other));
  }
  return least;
}

void dropTails(std::vector<BandMode>& modes) {
  std::vector<BandMode> kept;
  for (const BandMode& mode : modes) {
    if (std::ranges::none_of(modes, [&](const BandMode& other) { return isTail(mode, other); }))
      kept.push_back(mode);
  }
  modes = std::move(kept);
}

double rampOf(double value, double low, double high) {
  return std::clamp((value - low) / (high - low), 0.0, 1.0);
}

/// Sets the confidence: nothing counts for more than the height above noise, room and neighbours.
void setConfidence(TapMode& mode, double aboveSkirts) {
  const double clear = rampOf(mode.overNoise, 8.0, 32.0);
  double agreement = mode.byPeak ? 0.6 : 0.0;
  if (mode.byPeak && mode.peakDecayRate > 0.0) {
    const double ratio = mode.peakDecayRate / mode.decayRate;
    if (ratio > 0.7 && ratio < 1.0 / 0.7) agreement = 1.0;
  }
  const double single = 0.2 + 0.8 * rampOf(mode.overAround, kLeastAbove, kSurelyAbove);
  const double apart = 0.3 + 0.7 * rampOf(aboveSkirts, 0.0, kClearOfSkirts);
  mode.confidence = clear * single * apart * (0.1 + 0.55 * mode.stability + 0.35 * agreement);
}

/// Sets beside each mode the nearest plain peak, and returns the peaks that are left.
std::vector<SpectralPeak> pairWithPeaks(std::vector<BandMode>& modes,
                                        const std::vector<SpectralPeak>& peaks) {
  std::vector<SpectralPeak> left;
  for (const SpectralPeak& peak : peaks) {
    bool isTaken = false;
    for (BandMode& found : modes) {
      const double reach =
          std::max(3.0, found.mode.decayRate / kTurn + 0.5 * peak.decayRate / kTurn);
      if (std::abs(found.mode.frequency - peak.frequency) > reach) continue;
      isTaken = true;
      found.mode.byPeak = true;
      found.mode.peakDecayRate = peak.decayRate;
    }
    if (!isTaken) left.push_back(peak);
  }
  return left;
}

/// Makes modes of the peaks that no subspace has found, for those are modes too where many lie in
/// one band.
void addPeakModes(const std::vector<SpectralPeak>& peaks, double strongest,
                  const std::vector<BandMode>& joined, std::vector<TapMode>& modes) {
  for (const SpectralPeak& peak : peaks) {
    if (!(peak.decayRate > 0.0) || peak.overNoise < 20.0) continue;
    const bool isBeside = std::ranges::any_of(modes, [&](const TapMode& known) {
      return known.bySubspace && known.decayRate > peak.decayRate &&
             std::abs(known.frequency - peak.frequency) < kShadow * known.decayRate / kTurn;
    });
    if (isBeside) continue;
    BandMode single;
    TapMode& mode = single.mode;
    mode.frequency = peak.frequency;
    mode.decayRate = peak.decayRate;
    mode.level = decibels(peak.power / strongest);
    mode.overNoise = peak.overNoise;
    mode.overAround = peak.overAround;
    mode.frequencyError = 0.3 * std::max(1.0, peak.decayRate / kTurn);
    mode.decayError = 0.3 * peak.decayRate;
    mode.byPeak = true;
    mode.peakDecayRate = peak.decayRate;
    const double clear = overSkirts(single, joined);
    if (clear < 0.0) continue;
    setConfidence(mode, clear);
    modes.push_back(mode);
  }
}

void setAround(std::vector<BandMode>& modes, const std::vector<TapSegment>& taps) {
  const std::vector<RingBackground> backgrounds(taps.begin(), taps.end());
  for (BandMode& mode : modes) {
    mode.mode.overAround = 0.0;
    for (const RingBackground& background : backgrounds)
      mode.mode.overAround = std::max(mode.mode.overAround,
                                      background.above(mode.mode.frequency, mode.mode.decayRate));
  }
}

std::size_t loudestTap(const std::vector<TapSegment>& taps) {
  std::size_t loudest = 0;
  double most = 0.0;
  for (std::size_t tap = 0; tap < taps.size(); ++tap) {
    double peak = 0.0;
    for (const double sample : taps[tap].ring)
      peak = std::max(peak, std::abs(sample));
    if (peak > most) loudest = tap;
    most = std::max(most, peak);
  }
  return loudest;
}

Status checkTaps(const std::vector<TapSegment>& taps) {
  if (taps.empty()) return Error{"there is no tap; expected at least one"};
  for (const TapSegment& tap : taps) {
    if (tap.sampleRate != taps.front().sampleRate)
      return Error{"the taps have different sampling rates; expected one for all"};
  }
  return std::monostate{};
}

}  // namespace

Result<TapModes> tapModes(const std::vector<TapSegment>& taps, const TapModeSettings& settings,
                          const Progress& progress) {
  if (const Status valid = checkTaps(taps); !valid) return valid.error();
  const std::vector<NoiseDensity> noises(taps.begin(), taps.end());
  std::vector<BandMode> found;
  bool isCancelled = false;
  const BandSearch search{taps, noises, settings, [&](double share) {
                            isCancelled = progress && !progress("modes of the tap", share);
                            return !isCancelled;
                          }};
  for (std::size_t scale = 0; scale < kScales.size() && !isCancelled; ++scale) {
    std::vector<BandMode> more = modesOfScale(search, scale);
    std::ranges::move(more, std::back_inserter(found));
  }
  if (isCancelled) return Error{kCancelled};
  std::vector<BandMode> joined = joinedModes(std::move(found), taps);
  TapModes result;
  std::erase_if(joined, [&](const BandMode& mode) {
    const bool isSteady = isHum(mode, taps);
    if (isSteady) result.hum.push_back(mode.mode.frequency);
    return isSteady;
  });
  setLevels(joined);
  setAround(joined, taps);
  dropTails(joined);
  std::erase_if(joined, [&](const BandMode& mode) {
    if (mode.mode.overAround < kLeastAbove) return true;
    return mode.mode.level < settings.leastLevel || mode.mode.overNoise < settings.leastOverNoise;
  });
  for (BandMode& mode : joined)
    refineLate(mode, taps, noises);
  const TapSegment& loudest = taps[loudestTap(taps)];
  const double highest = std::min(settings.highest, kHighestShare * loudest.sampleRate);
  std::vector<SpectralPeak> peaks = spectralPeaks(loudest, settings.lowest, highest);
  std::erase_if(peaks, [&](const SpectralPeak& peak) {
    return std::ranges::any_of(result.hum,
                               [&](double hum) { return std::abs(hum - peak.frequency) < 3.0; });
  });
  double strongest = 1e-300;
  for (const SpectralPeak& peak : peaks)
    strongest = std::max(strongest, peak.power);
  const std::vector<SpectralPeak> left = pairWithPeaks(joined, peaks);
  for (BandMode& mode : joined) {
    setConfidence(mode.mode, overSkirts(mode, joined));
    result.modes.push_back(mode.mode);
  }
  addPeakModes(left, strongest, joined, result.modes);
  std::ranges::sort(result.modes, {}, &TapMode::frequency);
  std::ranges::sort(result.hum);
  if (result.modes.empty())
    return Error{"nothing rings: no mode stands above the noise; expected a tap that rings"};
  return result;
}

}  // namespace carom::lab
