#include "plugin/realtime/sound_recorder.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace carom::plugin {
namespace {

constexpr std::size_t kRecordedBlock = 1024;  // frames
/// s: a tail is cut after this time; a church has less.
constexpr double kLongestTail = 20.0;

}  // namespace

Result<SoundRecorder> SoundRecorder::create(const std::filesystem::path& file,
                                            const SoundSettings& settings) {
  Result<Synth> synth = Synth::create(settings.synth, settings.listeners);
  if (!synth) return synth.error();
  SoundFileSettings wanted;
  wanted.sampleRate = settings.synth.sampleRate;
  wanted.channels = synth->channelCount();
  wanted.fullScalePressure = settings.fullScale.value_or(kFullScalePressure);
  wanted.limit = settings.limiter.has_value();
  Result<SoundFileWriter> writer = SoundFileWriter::create(file, wanted);
  if (!writer) return writer.error();
  return SoundRecorder(*std::move(synth), *std::move(writer), settings.latency);
}

SoundRecorder::SoundRecorder(Synth synth, SoundFileWriter file, double latency)
    : synth_(std::move(synth)),
      file_(std::move(file)),
      latency_(latency),
      block_(synth_.channelCount(), std::vector<float>(kRecordedBlock)) {
  for (std::vector<float>& channel : block_) {
    channels_.push_back(channel.data());
    written_.push_back(channel.data());
  }
}

void SoundRecorder::startAt(double seconds) {
  const Status sought = synth_.seek(seconds);
  if (!sought && !failure_) failure_ = sought.error();
}

void SoundRecorder::advanceTo(double seconds) {
  renderTo(seconds - latency_);
}

void SoundRecorder::renderTo(double seconds) {
  const double rate = synth_.sampleRate();
  while (!failure_) {
    const double left = std::floor((seconds - synth_.time()) * rate);
    if (!(left >= 1.0)) return;
    if (!renderFrames(
            static_cast<std::size_t>(std::min(left, static_cast<double>(kRecordedBlock)))))
      return;
  }
}

bool SoundRecorder::renderFrames(std::size_t frames) {
  synth_.render<float>(channels_, frames);
  const Status written = file_.write(written_, frames);
  if (!written) failure_ = written.error();
  return !failure_;
}

void SoundRecorder::renderTail() {
  const double end = synth_.time() + kLongestTail;
  while (!failure_ && !synth_.isSilent() && synth_.time() < end)
    renderFrames(kRecordedBlock);
}

Status SoundRecorder::finish(double seconds) {
  renderTo(seconds);
  renderTail();
  if (failure_) return *failure_;
  return file_.finish();
}

}  // namespace carom::plugin
