#include "audio/radiation/radiation_bank.h"

#include <cmath>
#include <complex>

namespace carom::audio {

const RadiationBank::Mix& RadiationBank::mixOf(double corner) {
  if (const auto known = mixes_.find(corner); known != mixes_.end()) return known->second;
  Mix mix{.corner = corner, .count = 1, .weights = {1.0}};
  if (mixes_.size() < kOwn || std::isinf(corner)) {
    mix.filters[0] = make(corner);
  } else {
    mix = interpolated(corner);
  }
  for (std::size_t i = 0; i < mix.count; ++i)
    mix.responses[i] = filters_[mix.filters[i]].get();
  return mixes_.emplace(corner, mix).first->second;
}

const RadiationBank::Mix& RadiationBank::ofPole(std::complex<double> pole) {
  const auto [known, isNew] = poles_.try_emplace({pole.real(), pole.imag()});
  Mix& mix = known->second;
  if (!isNew) return mix;
  mix = {.corner = std::abs(pole), .count = 1, .weights = {1.0}};
  mix.filters[0] = make(pole);
  mix.responses[0] = filters_[mix.filters[0]].get();
  return mix;
}

template <class Kind>
std::uint32_t RadiationBank::make(Kind kind) {
  filters_.push_back(std::make_unique<RadiationFilter>(kind, input_));
  return static_cast<std::uint32_t>(filters_.size() - 1);
}

// Interpolates by Lagrange's polynomial through the two rungs on either side.
RadiationBank::Mix RadiationBank::interpolated(double corner) {
  const double place = kPerOctave * std::log2(corner);
  const double below = std::floor(place);
  const double t = place - below;
  Mix mix{.corner = corner, .count = 4};
  mix.weights = {-t * (t - 1.0) * (t - 2.0) / 6.0, (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0,
                 -(t + 1.0) * t * (t - 2.0) / 2.0, (t + 1.0) * t * (t - 1.0) / 6.0};
  for (int i = 0; i < 4; ++i) {
    const int rung = static_cast<int>(below) - 1 + i;
    auto known = ofRung_.find(rung);
    if (known == ofRung_.end())
      known = ofRung_.emplace(rung, make(std::exp2(static_cast<double>(rung) / kPerOctave))).first;
    mix.filters[static_cast<std::size_t>(i)] = known->second;
  }
  return mix;
}

}  // namespace carom::audio
