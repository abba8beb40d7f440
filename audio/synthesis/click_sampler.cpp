#include "audio/synthesis/click_sampler.h"

namespace carom::audio {

void ClickSampler::reserve(std::size_t nodes, std::size_t samples) {
  if (nodes == 0) raster_.reserve(samples);
  placed_.reserve(nodes, samples);
}

void ClickSampler::sample(const Click& click, Drive drive, std::span<double> x) noexcept {
  const ClickTrack& track = click.track;
  if (!click.nodes.empty()) {
    kernels_->place(click.nodes, track, placed_);
    kernels_->spread(placed_, click.nodes.size(), x);
    return;
  }
  if (sampling_ == Sampling::bandLimited)
    return spreadLongPulse(*click.pulse, track, *kernels_, raster_, x);
  for (std::size_t n = 0; n < x.size(); ++n) {
    const double u = (static_cast<double>(n) - track.start) / track.length;
    const double value = drive == Drive::force
                             ? click.pulse->force(u) / track.length
                             : click.pulse->slope(u) / (track.length * track.length);
    x[n] = track.gainAt(u) * value;
  }
}

}  // namespace carom::audio
