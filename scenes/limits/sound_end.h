#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace carom::scenes {

/// Decides when a sound has ended: when its last 50 ms are 60 dB below its peak. [one thread]
class SoundEnd {
 public:
  static constexpr double kWindow = 0.05;  ///< s, also the length of a fade
  static constexpr double kQuiet = 1e-3;   ///< of the peak, -60 dB

  explicit SoundEnd(double sampleRate);

  /// Takes the next `frames` samples of all channels.
  void add(std::span<const std::vector<float>> channels, std::size_t frames);

  bool isQuiet() const { return last() <= kQuiet * peak_; }
  /// Returns the peak of the last 50 ms over that of all, in dB; minus infinity if they, or all,
  /// are silent.
  double level() const;

  /// Fades samples out, of which the first is number `first` of a sound that ends at `end`.
  void fade(std::span<std::vector<float>> channels, std::size_t frames, std::int64_t first,
            std::int64_t end) const;

 private:
  double last() const;

  std::vector<float> recent_;  // largest of all channels by sample, the last 50 ms in a ring
  std::size_t next_ = 0;
  double peak_ = 0.0;
};

}  // namespace carom::scenes
