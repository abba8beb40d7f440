#include "plugin/realtime/recorded_samples.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <string>
#include <utility>

#include "plugin/realtime/exposure.h"

namespace carom::plugin {
namespace {

SoundFileSettings fileSettings(const SoundSettings& settings, std::size_t channels) {
  SoundFileSettings wanted;
  wanted.sampleRate = settings.synth.sampleRate;
  wanted.channels = channels;
  wanted.normalize = hasAutomaticFile(settings);
  wanted.normalizedPeak = SamplesInFile::kAutomaticPeak;
  wanted.leastFullScale = Exposure::kLeastFullScale;
  wanted.fullScalePressure = settings.fullScale.value_or(kFullScalePressure);
  wanted.limit = settings.limiter.has_value() && !wanted.normalize;
  wanted.keepIncomplete = true;
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

bool hasAutomaticFile(const SoundSettings& settings) {
  return settings.level == Level::automatic ||
         (settings.level == Level::standard && !settings.fullScale);
}

Result<std::unique_ptr<SamplesInFile>> SamplesInFile::create(const std::filesystem::path& file,
                                                             const SoundSettings& settings,
                                                             std::size_t channels) {
  if (const Status named = requireWav(file); !named) return named.error();
  Result<SoundFileWriter> writer = SoundFileWriter::create(file, fileSettings(settings, channels));
  if (!writer) return writer.error();
  return std::unique_ptr<SamplesInFile>(new SamplesInFile(*std::move(writer)));
}

std::size_t SamplesInMemory::take(std::span<float> samples) {
  const std::size_t frames = std::min(ready(), samples.size() / channels_);
  const auto from = samples_.begin() + static_cast<std::ptrdiff_t>(taken_);
  std::copy_n(from, frames * channels_, samples.begin());
  taken_ += frames * channels_;
  if (taken_ == samples_.size()) {
    samples_.clear();
    taken_ = 0;
  }
  return frames;
}

Status SamplesInMemory::write(std::span<const float* const> channels, std::size_t frames) {
  // Samples that were taken make room for as many, such that a reader who never quite catches up
  // does not fill the memory.
  if (taken_ > samples_.size() / 2) {
    samples_.erase(samples_.begin(), samples_.begin() + static_cast<std::ptrdiff_t>(taken_));
    taken_ = 0;
  }
  for (std::size_t frame = 0; frame < frames; ++frame) {
    for (const float* const channel : channels) {
      samples_.push_back(channel[frame]);
      peak_ = std::max(peak_, std::abs(static_cast<double>(channel[frame])));
    }
  }
  return std::monostate{};
}

}  // namespace carom::plugin
