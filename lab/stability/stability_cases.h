#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "lab/stability/stability.h"

#include "carom/audio/result.h"
#include "carom/audio/synth.h"

namespace carom::lab {

// The cases of each module. Only for the files of stability_*.cpp.

void addNativeCases(std::vector<StabilityCase>& cases);
void addSoundCases(std::vector<StabilityCase>& cases);
void addModalCases(std::vector<StabilityCase>& cases);
void addContactCases(std::vector<StabilityCase>& cases);
void addJelloCases(std::vector<StabilityCase>& cases);
void addBulletCases(std::vector<StabilityCase>& cases);
void addCrossedCases(std::vector<StabilityCase>& cases);
void addRunCases(std::vector<StabilityCase>& cases);

/// Returns the value of a result that a case needs; throws its error, which makes a failed verdict.
template <class T>
T orThrow(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message);
  return *std::move(result);
}

inline void orThrow(const Status& status) {
  if (!status) throw std::runtime_error(status.error().message);
}

/// The largest of many values; NaN if one of them was NaN.
class Worst {
 public:
  void add(double value) {
    if (!(value <= value_)) value_ = std::isnan(value_) ? value_ : value;
  }
  /// Adds the relative error of a value.
  void addShare(double value, double expected) { add(std::abs(value / expected - 1.0)); }
  double value() const { return value_; }

 private:
  double value_ = 0.0;
};

/// Renders the next samples of a synth with one channel, Pa.
inline std::vector<double> rendered(Synth& synth, std::size_t frames) {
  std::vector<double> samples(frames);
  double* const channel = samples.data();
  synth.render<double>(std::span(&channel, 1), frames);
  return samples;
}

}  // namespace carom::lab
