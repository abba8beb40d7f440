#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include "audio/radiation_filter.h"

namespace carom::audio {

/// The filters of bodies of many sizes, at a cost that does not grow with how many there are. The
/// first kOwn sizes have filters of their own. Any further one is interpolated, by a cubic in the
/// logarithm of the size, from a ladder of kPerOctave sizes: within -98 dB of the response at
/// every frequency in the band.
///
/// Immovable once made; [one thread] for `mixOf`, [any thread] for the rest.
class RadiationBank {
 public:
  static constexpr std::size_t kOwn = 16;
  static constexpr int kPerOctave = 14;

  /// What a size is made of: filters and their weights, of sum 1.
  struct Mix {
    double corner = 0.0;  ///< 1/samples, what it stands for
    std::size_t count = 0;
    std::array<std::uint32_t, 4> filters{};
    std::array<const RadiationFilter*, 4> responses{};  ///< theirs; they live as long as the bank
    std::array<double, 4> weights{};
  };

  explicit RadiationBank(RadiationFilter::Input input) : input_(input) {}

  /// `corner` as in RadiationFilter: above 0, or infinite. The same one is the same object,
  /// which lives as long as the bank. Makes the filters that are missing.
  const Mix& mixOf(double corner);

  const RadiationFilter& operator[](std::uint32_t filter) const { return *filters_[filter]; }

 private:
  std::uint32_t make(double corner);
  Mix interpolated(double corner);

  RadiationFilter::Input input_;
  std::vector<std::unique_ptr<const RadiationFilter>> filters_;
  std::unordered_map<double, Mix> mixes_;          // by corner
  std::unordered_map<int, std::uint32_t> ofRung_;  // the ladder's
};

}  // namespace carom::audio
