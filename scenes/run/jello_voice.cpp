#include "scenes/run/jello_voice.h"

#include <array>
#include <utility>

#include "audio/propagation/receiver.h"
#include "scenes/run/scene_sound.h"

namespace carom::scenes {

using namespace audio;

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

Result<JelloVoice> JelloVoice::create(const Scene& scene, double step) {
  Result<DeformingSource> source = DeformingSource::create(
      {.step = step, .sampleRate = scene.sampleRate, .medium = scene.medium});
  if (!source) return source.error();
  return JelloVoice(scene, *std::move(source));
}

JelloVoice::JelloVoice(const Scene& scene, DeformingSource source)
    : source_(std::move(source)), sampleRate_(scene.sampleRate), listeners_(scene.listeners) {
  for (const Listener& listener : listeners_)
    tracks_.emplace_back(ListenerPose{0.0, listener.position, listener.orientation});
  for (const ListenerPath& path : scene.paths)
    tracks_[path.listener] = trackOf(path, listeners_[path.listener]);
}

void JelloVoice::add(std::span<const DeformingState> states) {
  for (const DeformingState& state : states)
    source_.add(state);
}

void JelloVoice::addTo(std::span<float* const> channels, std::int64_t firstFrame,
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

}  // namespace carom::scenes
