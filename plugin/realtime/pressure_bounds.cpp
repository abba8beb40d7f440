#include "plugin/realtime/pressure_bounds.h"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace carom::plugin {

using namespace audio;

namespace {

/// Keeps the largest bound of each listener's channels.
class PeakSink final : public SoundSink {
 public:
  PeakSink(const SoundPaths& paths, std::size_t listeners) : paths_(paths), peaks_(listeners) {}

  void add(const ScheduledSound& sound) override {
    for (std::size_t channel = 0; channel < sound.peaks.size(); ++channel) {
      double& peak = peaks_[paths_.channels[channel].listener];
      peak = std::max(peak, sound.peaks[channel]);
    }
  }
  const std::vector<double>& peaks() const { return peaks_; }

 private:
  const SoundPaths& paths_;
  std::vector<double> peaks_;  // Pa, by listener
};

}  // namespace

void PressureBounds::add(const ImpulseEvent& share, std::span<double> peaks) {
  PeakSink sink(scheduler_.paths(), peaks.size());
  scheduler_.schedule(share, {}, sink);
  for (std::size_t listener = 0; listener < peaks.size(); ++listener)
    peaks[listener] += sink.peaks()[listener];
}

}  // namespace carom::plugin
