#include "plugin/realtime/sound_recorder.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <string>
#include <utility>

#include "plugin/realtime/exposure.h"
#include "plugin/realtime/statistics_fields.h"

namespace carom::plugin {
namespace {

constexpr std::size_t kRecordedBlock = 1024;  // frames
/// s: a tail is cut after this time; a church has less.
constexpr double kLongestTail = 20.0;

bool isAutomatic(const SoundSettings& settings) {
  return settings.level == Level::automatic ||
         (settings.level == Level::standard && !settings.fullScale);
}

SoundFileSettings fileSettings(const SoundSettings& settings, std::size_t channels) {
  SoundFileSettings wanted;
  wanted.sampleRate = settings.synth.sampleRate;
  wanted.channels = channels;
  wanted.normalize = isAutomatic(settings);
  wanted.normalizedPeak = SoundRecorder::kAutomaticPeak;
  wanted.leastFullScale = Exposure::kLeastFullScale;
  wanted.fullScalePressure = settings.fullScale.value_or(kFullScalePressure);
  wanted.limit = settings.limiter.has_value() && !wanted.normalize;
  return wanted;
}

/// Refuses names of other formats, which would not be understood.
Status requireWav(const std::filesystem::path& file) {
  std::string ending = file.extension().string();
  std::ranges::transform(ending, ending.begin(),
                         [](unsigned char letter) { return std::tolower(letter); });
  if (ending == ".wav" || ending == ".wave") return std::monostate{};
  return Error{"sound file '" + file.string() +
               "': recordings are WAV files; expected a name that ends in .wav"};
}

}  // namespace

Result<SoundRecorder> SoundRecorder::create(const std::filesystem::path& file,
                                            const SoundSettings& settings) {
  if (const Status named = requireWav(file); !named) return named.error();
  Result<Synth> synth = Synth::create(settings.synth, settings.listeners);
  if (!synth) return synth.error();
  Result<SoundFileWriter> writer =
      SoundFileWriter::create(file, fileSettings(settings, synth->channelCount()));
  if (!writer) return writer.error();
  return SoundRecorder(*std::move(synth), *std::move(writer), settings);
}

SoundRecorder::SoundRecorder(Synth synth, SoundFileWriter file, const SoundSettings& settings)
    : synth_(std::move(synth)),
      file_(std::move(file)),
      latency_(settings.latency),
      isAutomatic_(isAutomatic(settings)),
      hasLimiter_(settings.limiter.has_value()),
      block_(synth_.channelCount(), std::vector<float>(kRecordedBlock)) {
  for (std::vector<float>& channel : block_) {
    channels_.push_back(channel.data());
    written_.push_back(channel.data());
  }
}

void SoundRecorder::addLevels(SoundStatistics& statistics) const {
  statistics.peak = file_.peakPressure();
  statistics.peakSample = statistics.peak / file_.fullScale();
  if (!isAutomatic_)
    statistics.warning = peakWarning(statistics.peakSample, file_.fullScale(), hasLimiter_);
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
