#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <unordered_map>
#include <utility>
#include <vector>

#include "audio/radiation/radiation_filter.h"

namespace carom::audio {

/// The radiation filters of bodies of many sizes, at a cost that does not grow with how many sizes
/// there are. The first kOwn sizes have filters of their own. Any further one is interpolated, by a
/// cubic in the logarithm of the size, from a ladder of kPerOctave sizes: within -98 dB of the
/// response at every frequency in the band.
///
/// Filters and mixes keep their addresses; [one thread] for `mixOf`, [any thread] for the rest.
class RadiationBank {
 public:
  static constexpr std::size_t kOwn = 16;
  static constexpr int kPerOctave = 14;

  /// The filters that make up a size, and their weights, of sum 1.
  struct Mix {
    double corner = 0.0;  ///< 1/samples, of that size
    std::size_t count = 0;
    std::array<std::uint32_t, 4> filters{};
    std::array<const RadiationFilter*, 4> responses{};  ///< the filters, kept by the bank
    std::array<double, 4> weights{};
  };

  explicit RadiationBank(RadiationFilter::Input input) : input_(input) {}

  /// Returns the filters for a `corner` as in RadiationFilter: above 0, or infinite. Equal corners
  /// give the same object, which lives as long as the bank. Makes the filters that are missing.
  const Mix& mixOf(double corner);

  /// Returns the filter of a pair of poles (RadiationFilter), by itself: a mix of one, its corner
  /// the pole's magnitude. Equal poles give the same object.
  const Mix& ofPole(std::complex<double> pole);

  const RadiationFilter& operator[](std::uint32_t filter) const { return *filters_[filter]; }

 private:
  template <class Kind>
  std::uint32_t make(Kind kind);
  Mix interpolated(double corner);

  RadiationFilter::Input input_;
  std::vector<std::unique_ptr<const RadiationFilter>> filters_;
  std::unordered_map<double, Mix> mixes_;           // by corner
  std::map<std::pair<double, double>, Mix> poles_;  // by real and imaginary part
  std::unordered_map<int, std::uint32_t> ofRung_;   // filters of the ladder, by rung
};

}  // namespace carom::audio
