#include "plugin/realtime/sound_recorder.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "audio/propagation/sound_paths.h"
#include "plugin/realtime/sound_timeline.h"
#include "plugin/realtime/statistics_fields.h"

namespace carom::plugin {

using namespace audio;

namespace {

constexpr std::size_t kRecordedBlock = 1024;  // frames
/// Samples: a sum of steps that falls short of a sample by less than this has come to it.
constexpr double kRounding = 1e-3;
/// s: a tail is cut after this time; a church has less.
constexpr double kLongestTail = 20.0;

/// Hands sounds on as those of events that are counted elsewhere.
class UncountedSink final : public SoundSink {
 public:
  explicit UncountedSink(SoundSink& to) : to_(to) {}
  void add(const ScheduledSound& sound) override {
    ScheduledSound uncounted = sound;
    uncounted.isEvent = false;
    to_.add(uncounted);
  }

 private:
  SoundSink& to_;
};

}  // namespace

SoundRecorder::SoundRecorder(const std::shared_ptr<const SoundPaths>& paths,
                             std::unique_ptr<RecordedSamples> samples,
                             const SoundSettings& settings)
    : scheduler_(paths),
      renderer_(paths),
      samples_(std::move(samples)),
      rate_(paths->settings.sampleRate),
      latency_(settings.latency),
      isAutomatic_(hasAutomaticFile(settings)),
      hasLimiter_(settings.limiter.has_value()),
      block_(paths->channels.size(), std::vector<float>(kRecordedBlock)) {
  scheduler_.followLive(std::numeric_limits<std::size_t>::max());
  for (std::vector<float>& channel : block_) {
    channels_.push_back(channel.data());
    written_.push_back(channel.data());
  }
}

SoundStatistics SoundRecorder::statistics() const {
  SoundStatistics all;
  static_cast<SynthCounters&>(all) = scheduler_.counters() + renderer_.counters();
  all.posted = posted_;
  all.waiting = waitingShares(all);
  all.peak = samples_->peakPressure();
  all.peakSample = all.peak / samples_->fullScale();
  if (!isAutomatic_) all.warning = peakWarning(all.peakSample, samples_->fullScale(), hasLimiter_);
  if (failure_) all.recordingError = failure_->message;
  return all;
}

void SoundRecorder::startAt(double seconds, double silence) {
  time_ = seconds;
  renderer_.seek(std::llround((seconds - silence) * rate_));
}

void SoundRecorder::post(const ImpulseEvent& event, bool isCounted) {
  posted_ += isCounted ? 1 : 0;
  if (!failure_) events_.push_back({event, isCounted});
}

void SoundRecorder::updateContact(const ContactState& contact, bool isCounted) {
  if (!failure_ && scheduler_.hearsContacts()) contacts_.push_back({contact, isCounted});
}

/// Runs an action on the scheduler, whose counters stay as they are unless it is counted.
template <class Action>
void SoundRecorder::counting(bool isCounted, const Action& action) {
  if (isCounted) return action(renderer_);
  const SynthCounters before = scheduler_.counters();
  UncountedSink sink(renderer_);
  action(sink);
  scheduler_.setCounters(before);
}

void SoundRecorder::schedule(const Posted<ImpulseEvent>& event) {
  counting(event.isCounted,
           [&](SoundSink& sink) { scheduler_.schedule(event.share, shift_, sink); });
}

void SoundRecorder::schedule(const Posted<ContactState>& contact) {
  counting(contact.isCounted,
           [&](SoundSink& sink) { scheduler_.updateContact(contact.share, shift_, sink); });
}

void SoundRecorder::schedulePosted() {
  for (const Posted<ContactState>& contact : contacts_)
    schedule(contact);
  for (const Posted<ImpulseEvent>& event : events_)
    schedule(event);
  contacts_.clear();
  events_.clear();
}

void SoundRecorder::leapTo(double seconds) {
  const auto scheduleOld = [&](auto& posted) {
    std::erase_if(posted, [&](const auto& one) {
      const bool isOld = isBeforeLeap(one.share.time, time_, seconds);
      if (isOld) schedule(one);
      return isOld;
    });
  };
  scheduleOld(contacts_);
  scheduleOld(events_);
  scheduler_.finishMoment(renderer_);
  scheduler_.leap(seconds - time_);
  shift_.whole += std::llround(time_ * rate_) - std::llround(seconds * rate_);
  time_ = seconds;
}

void SoundRecorder::advanceTo(double seconds) {
  schedulePosted();
  scheduler_.advanceTo(time_, shift_, renderer_);
  time_ = seconds;
  renderTo(seconds - latency_);
}

/// Renders up to a time of the simulation's clock.
void SoundRecorder::renderTo(double seconds) {
  const double end = seconds * rate_ + static_cast<double>(shift_.whole) + kRounding;
  while (!failure_) {
    const double left = std::floor(end - static_cast<double>(renderer_.position()));
    if (!(left >= 1.0)) return;
    if (!renderFrames(
            static_cast<std::size_t>(std::min(left, static_cast<double>(kRecordedBlock)))))
      return;
  }
}

bool SoundRecorder::renderFrames(std::size_t frames) {
  scheduler_.finishMoment(renderer_);
  renderer_.render<float>(channels_, frames);
  const Status written = samples_->write(written_, frames);
  if (!written) failure_ = written.error();
  return !failure_;
}

void SoundRecorder::renderTail() {
  const double end = renderedTime() + kLongestTail;
  while (!failure_ && !renderer_.isSilent() && renderedTime() < end)
    renderFrames(kRecordedBlock);
}

Status SoundRecorder::finish() {
  schedulePosted();
  scheduler_.advanceTo(time_, shift_, renderer_);
  renderTo(time_);
  renderTail();
  if (failure_) return *failure_;
  Status finished = samples_->finish();
  if (!finished) failure_ = finished.error();
  return finished;
}

}  // namespace carom::plugin
