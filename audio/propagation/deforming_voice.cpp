#include "audio/propagation/deforming_voice.h"

#include <array>
#include <utility>

#include "audio/propagation/receiver.h"

namespace carom::audio {

namespace {

constexpr double kHalfHead = 0.0875;  // m, from the middle to either ear

/// Returns the ears (receivers) of a listener, in the order of its channels.
Receivers earsOf(const Listener& listener) {
  Receivers ears = receiversOf(listener);
  if (listener.format == ListenerFormat::binaural) {
    ears.items[0].offset = {-kHalfHead, 0.0, 0.0};
    ears.items[1].offset = {kHalfHead, 0.0, 0.0};
  }
  return ears;
}

}  // namespace

Result<DeformingVoice> DeformingVoice::create(const DeformingSettings& settings,
                                              const std::vector<Listener>& listeners) {
  Result<DeformingSource> source = DeformingSource::create(settings);
  if (!source) return source.error();
  return DeformingVoice(*std::move(source), settings.sampleRate, listeners);
}

DeformingVoice::DeformingVoice(DeformingSource source, double sampleRate,
                               const std::vector<Listener>& listeners)
    : source_(std::move(source)), sampleRate_(sampleRate), listeners_(listeners) {
  for (const Listener& listener : listeners_)
    tracks_.emplace_back(ListenerPose{0.0, listener.position, listener.orientation});
}

void DeformingVoice::add(std::span<const DeformingState> states) {
  for (const DeformingState& state : states)
    source_.add(state);
}

void DeformingVoice::addTo(std::span<float* const> channels, std::int64_t firstFrame,
                           std::size_t frames) {
  source_.forgetBefore(static_cast<double>(firstFrame) / sampleRate_ - kLongestWay);
  std::size_t channel = 0;
  for (std::size_t index = 0; index < listeners_.size(); ++index) {
    for (const Receiver& ear : earsOf(listeners_[index])) {
      float* samples = channels[channel++];
      for (std::size_t frame = 0; frame < frames; ++frame) {
        const double time =
            static_cast<double>(firstFrame + static_cast<std::int64_t>(frame)) / sampleRate_;
        const ListenerPose pose = tracks_[index].at(time);
        const auto heard = source_.at(pose.position + pose.orientation * ear.offset, time);
        samples[frame] +=
            static_cast<float>(gain(ear, pose.orientation, heard.towardsSource) * heard.pressure);
      }
    }
  }
}

}  // namespace carom::audio
