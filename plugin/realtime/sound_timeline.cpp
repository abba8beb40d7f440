#include "plugin/realtime/sound_timeline.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

namespace carom::plugin {

using namespace audio;

TimelineStep SoundTimeline::advance(double time, std::int64_t rendered) {
  if (clock_ == SoundClock::simulation) return followClock(time);
  if (rendered == 0) return TimelineStep::skipped;  // no samples have been taken yet
  const double elapsed = time - time_;
  time_ = time;
  if (!anchored_ || resting_) {
    anchor(time, rendered);
    return TimelineStep::started;
  }
  if (elapsed < 0.0) {
    anchor(time, rendered);
    return TimelineStep::jumped;
  }
  const double ahead = time * rate_ + shift(time) - static_cast<double>(rendered);
  if (ahead > latency_ + kMostAhead * rate_) {
    held_ = true;
    heldUntil_ = rendered + static_cast<std::int64_t>(latency_);
    anchor(time, rendered);
    return TimelineStep::skipped;
  }
  if (held_ && rendered < heldUntil_) {
    anchor(time, rendered);
    return TimelineStep::skipped;
  }
  if (held_) {
    anchor(time, rendered);
    held_ = false;
    return TimelineStep::started;
  }
  if (ahead < kLeast * latency_) {
    anchor(time, rendered);
    return TimelineStep::stalled;
  }
  drift_ += (latency_ - ahead - drift_) * std::min(1.0, elapsed / kSmoothing);
  if (std::abs(drift_) > kTolerance * latency_) slewing_ = true;
  if (std::abs(drift_) < kSettled * latency_) slewing_ = false;
  bend(time, slewing_ ? drift_ : 0.0);
  return TimelineStep::steady;
}

/// Goes on with the samples where the simulation's clock goes back.
TimelineStep SoundTimeline::followClock(double time) {
  const double before = std::exchange(time_, time);
  if (!(time < before)) return TimelineStep::steady;
  leapt_ += std::llround(before * rate_) - std::llround(time * rate_);  // as SoundRecorder
  return TimelineStep::jumped;
}

/// Sets the shift anew, to a whole number of samples, so that the look-ahead is the latency.
void SoundTimeline::anchor(double time, std::int64_t rendered) {
  pieces_.fill({.since = time,
                .shift = std::round(static_cast<double>(rendered) + latency_ - time * rate_),
                .slope = rate_ * (1.0 / scale_ - 1.0)});
  drift_ = 0.0;
  slewing_ = false;
  anchored_ = true;
  resting_ = false;
}

/// Continues the shift from here on with the slope that scale and drift ask for.
void SoundTimeline::bend(double time, double drift) {
  double slew = 0.0;
  if (drift != 0.0)
    slew = std::copysign(std::clamp(std::abs(drift) / (kRecovery * rate_), kLeastSlew, kMostSlew),
                         drift);
  const double wanted = rate_ * ((1.0 + slew) / scale_ - 1.0);
  if (wanted == pieces_.front().slope) return;
  const double now = shift(time);
  std::shift_right(pieces_.begin(), pieces_.end(), 1);
  pieces_.front() = {
      .since = time, .shift = wanted == 0.0 ? std::round(now) : now, .slope = wanted};
}

double SoundTimeline::shift(double time) const {
  const auto begun = [time](const Piece& piece) { return piece.since <= time; };
  const auto found = std::find_if(pieces_.begin(), std::prev(pieces_.end()), begun);
  return found->shift + found->slope * (time - found->since);
}

void SoundTimeline::setScale(double scale) {
  scale_ = scale;
  if (anchored_) bend(time_, slewing_ ? drift_ : 0.0);
}

SampleShift SoundTimeline::shiftAt(double time) const {
  if (clock_ == SoundClock::simulation) return {leapt_, 0.0};
  const double samples = shift(time);
  if (!(std::abs(samples) < kExactSamples)) return {};
  const double whole = std::floor(samples);
  return {static_cast<std::int64_t>(whole), samples - whole};
}

}  // namespace carom::plugin
