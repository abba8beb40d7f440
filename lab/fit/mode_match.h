#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "lab/fit/tap_modes.h"

namespace carom::lab {

/// A mode of a body as computed: measured ones are to be at `frequency` times a common factor.
struct ComputedLine {
  double frequency = 0.0;  ///< Hz
  double error = 0.01;     ///< 1, bound of its relative error but for the common factor
};

/// The bounds of the search for the common factor, and the bars of acceptance.
struct ModeMatchSettings {
  double leastFactor = 0.1;
  double mostFactor = 10.0;
  double leastExplained = 0.4;   ///< share of the confident measured modes, by confidence
  std::size_t leastMatched = 3;  ///< modes
  /// Scrambled bodies that the match is compared with, and the number of standard deviations by
  /// which it has to stand above them. 0 scrambles: no comparison.
  std::size_t scrambles = 120;
  double leastDistance = 4.0;
  std::uint32_t seed = 1;  ///< of the scrambles
};

/// An assignment of measured to computed modes.
struct ModeMatch {
  bool accepted = false;
  std::string reason;        ///< one sentence: why it was not accepted; empty if it was
  double factor = 1.0;       ///< measured over computed frequency
  double factorError = 0.0;  ///< 1, relative standard deviation
  /// The index of the computed mode, for each measured one that has one.
  std::vector<std::optional<std::size_t>> computed;
  std::size_t matched = 0;
  double explained = 0.0;       ///< 1, share of the measured modes below the highest computed one
  double residual = 0.0;        ///< 1, weighted rms of measured over fitted frequency, less 1
  double score = 0.0;           ///< nats, log likelihood ratio over a body with other ratios
  double chanceScore = 0.0;     ///< nats, the mean of the best scores of scrambled bodies
  double chanceDistance = 0.0;  ///< standard deviations of the score above chanceScore
};

/// Matches measured modes with computed ones up to a common factor, as Young's modulus and size
/// have it. For each factor that pairs one of the clearest low measured modes with a computed one,
/// the best monotone assignment is found by dynamic programming: a pair counts with the logarithm
/// of its likelihood (Gaussian in log frequency) over the density of computed modes there, times
/// the confidence; a measured mode without a partner costs as one in ten is spurious, a computed
/// one that was not heard costs little, as the blow may have met a node. The best factors are
/// refined by weighted least squares.
///
/// Accepted if it explains enough of the modes and stands far above chance: the scores that the
/// same search finds with computed modes moved at random by about their distance, which is a body
/// of like size and other shape. Both lists ascend in frequency. [any thread]
ModeMatch matchModes(std::span<const TapMode> measured, std::span<const ComputedLine> computed,
                     const ModeMatchSettings& settings = {});

}  // namespace carom::lab
