#include "audio/scheduling/heard_clicks.h"

#include <algorithm>
#include <cmath>

#include "audio/model/third_octaves.h"

namespace carom::audio {
namespace {

/// s: the ear adds up the energy of what is shorter (ISO 389-7 is for tones that are longer; Moore
/// 2012, An Introduction to the Psychology of Hearing, section 2.4).
constexpr double kIntegration = 0.2;
/// s: clicks of one moment come in any order, but not by so much.
constexpr double kLeap = 1.0;
/// Ratio of powers, 10 dB: what is left out, all together, is so far below the threshold.
constexpr double kBelow = 0.1;
/// Share of the energy of clicks of one kind that may be left out beside them: 0.004 dB.
constexpr double kHidden = 1e-3;
/// s: clicks up to this long are of the first kind; each other kind is up to four times as long.
constexpr double kShortestKind = 50e-6;

/// Upper bound (1/Pa^2) of the share of a click's energy in a third octave, over the threshold of
/// hearing there. Beyond the frequency 1/duration the energy of a third octave falls at least as
/// its square, as a Hertzian contact's force has no corners: the recoil of a wide body is long and
/// low, where the ear is deaf.
double audibility(double duration) {
  double most = 0.0;
  for (std::size_t band = 0; band < kThirdOctaves; ++band) {
    const double cycles = thirdOctaves()[band] * duration;
    most = std::max(most, 1.0 / ((1.0 + cycles * cycles) * hearingThreshold()[band]));
  }
  return most;
}

}  // namespace

void HeardClicks::fade(double time) {
  if (time < time_ - kLeap) {  // the clock has gone back, or was told wrong before
    recent_ = {};
    quiet_ = 0.0;
    time_ = time;
  }
  if (time <= time_) return;
  const double left = std::exp((time_ - time) / kIntegration);
  for (Recent& recent : recent_)
    recent = {recent.all * left, recent.hidden * left};
  quiet_ *= left;
  time_ = time;
}

HeardClicks::Fate HeardClicks::decide(const Candidate& click) {
  fade(click.time);
  const double energy = click.peak * click.peak * click.duration;
  const double loudness = energy * audibility(click.duration) / kIntegration;
  if (quiet_ + loudness < kBelow) {
    quiet_ += loudness;
    return Fate::inaudible;
  }
  const double kind = 0.5 * std::log2(click.duration / kShortestKind) + 1.0;
  Recent& recent = recent_[static_cast<std::size_t>(std::clamp(kind, 0.0, kKinds - 1.0))];
  recent.all += energy;
  if (recent.hidden + energy >= kHidden * recent.all) return Fate::heard;
  recent.hidden += energy;
  return Fate::masked;
}

}  // namespace carom::audio
