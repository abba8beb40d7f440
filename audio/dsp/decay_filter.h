#pragma once

#include <cstddef>
#include <vector>

#include "carom/audio/absorption.h"

namespace carom::audio {

// The filter of a delay line that makes its sound decay in a given time in each band. All of this
// file: [any thread].

/// Returns first-order filters in series that leave 10^(-3 samples / (sampleRate T60(f))) of a
/// sound that passes `samples` of delay (Jot & Chaigne 1991, "Digital delay networks for designing
/// artificial reverberators": the absorbent filters).
///
/// They are a level and one shelf between each two neighbouring bands; their gains in dB are found
/// by Gauss-Newton, so that the decay is met at the bands' centres. Between the centres it is
/// smooth, below the lowest and above the highest band it goes on as the outermost shelf does.
/// Where times leap so much from band to band that the curve through them would somewhere decay
/// less than 0.6 times as fast as the slowest band, the curve is smoothed until it does not: so |H|
/// is at most 1 at every frequency, for any times; more than 120 dB per pass is not attempted.
/// Bands above 0.45 of the sample rate are left out.
///
/// Requires samples > 0, a sample rate (Hz) of at least 8000 and times > 0, all or none infinite.
std::vector<ReflectionFilter> decayCascade(double samples, const DecayTimes& times,
                                           double sampleRate);

/// Hz: the octave above kOctaveBands.
inline constexpr double kTopBand = 16000.0;

/// A decay that is given in the octave above kOctaveBands too, where the air makes it fall so
/// steeply that no shelf follows.
struct TopDecay {
  DecayTimes times{};           ///< s
  double timeAt16kHz = 0.0;     ///< s, > 0
  std::size_t topSections = 0;  ///< see topSectionsFor
};

/// As decayCascade, with `topSections` sections (1 + r z^-1) / (1 + r) more, 0 <= r <= 1, which
/// take from the octave above what the shelves leave too much; the shelves make up for what they
/// take from the bands. Nothing else than |H| at most 1 is warranted where they are too few.
std::vector<ReflectionFilter> decayCascade(double samples, const TopDecay& decay,
                                           double sampleRate);
/// Number of sections that `samples` of delay need, at most 4: 0 where the octave above is not in
/// the band, or falls as steeply without.
std::size_t topSectionsFor(double samples, const TopDecay& decay, double sampleRate);

/// Time in s in which a cascade that is passed once every `samples` lets `frequency` (Hz) decay by
/// 60 dB; infinity for a gain of 1.
double decayTimeOf(const std::vector<ReflectionFilter>& cascade, double samples, double frequency,
                   double sampleRate);

}  // namespace carom::audio
