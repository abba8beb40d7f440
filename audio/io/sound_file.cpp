#include "carom/audio/sound_file.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <sndfile.h>

#include "audio/io/partial_file.h"
#include "audio/io/wav_stream.h"
#include "carom/audio/limiter.h"

namespace carom {

using namespace audio;

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kBlockSamples = 8192;

struct CloseSound {
  void operator()(SNDFILE* file) const { sf_close(file); }
};
using SoundHandle = std::unique_ptr<SNDFILE, CloseSound>;

Error failure(const fs::path& path, const std::string& reason) {
  return Error{"sound file '" + path.string() + "': " + reason};
}

std::string numberText(double number) {
  std::ostringstream text;
  text << number;
  return text.str();
}

WavStream::Format formatOf(const SoundFileSettings& settings, double fullScale) {
  return {.samples = settings.format,
          .sampleRate = static_cast<int>(std::lround(settings.sampleRate)),
          .channels = settings.channels,
          .fullScale = fullScale};
}

SoundHandle openToRead(const fs::path& path) {
  SF_INFO info = {};
  return SoundHandle(sf_open(path.c_str(), SFM_READ, &info));
}

/// True if there is any sound in a file that a dead program has left.
bool hasSound(const fs::path& path) {
  SF_INFO info = {};
  const SoundHandle file(sf_open(path.c_str(), SFM_READ, &info));
  return file != nullptr && info.frames > 0;
}

Status validate(const SoundFileSettings& settings) {
  if (!(settings.sampleRate >= 1.0 && settings.sampleRate <= 1e6))
    return Error{"sample rate " + std::to_string(settings.sampleRate) +
                 " Hz is not from 1 to 1000000 Hz"};
  if (settings.channels < 1 || settings.channels > 1024)
    return Error{std::to_string(settings.channels) + " channels; it takes 1 to 1024"};
  if (!(settings.fullScalePressure > 0.0 && std::isfinite(settings.fullScalePressure)))
    return Error{"full scale of " + numberText(settings.fullScalePressure) +
                 " Pa; expected a pressure above 0"};
  if (settings.limit && settings.normalize)
    return Error{
        "is to be limited and normalised; expected one of the two, a normalised file has "
        "nothing "
        "to limit"};
  if (!(settings.normalizedPeak > 0.0 && std::isfinite(settings.normalizedPeak)))
    return Error{"normalised peak of " + numberText(settings.normalizedPeak) +
                 "; expected a sample above 0"};
  if (!(settings.leastFullScale >= 0.0 && std::isfinite(settings.leastFullScale)))
    return Error{"least full scale of " + numberText(settings.leastFullScale) +
                 " Pa; expected a pressure of 0 or above"};
  if (!WavStream::canWrite(formatOf(settings, settings.fullScalePressure)))
    return Error{"libsndfile cannot write this format"};
  return std::monostate{};
}

}  // namespace

struct SoundFileWriter::State {
  State(fs::path finalPath, const SoundFileSettings& wanted)
      : path(std::move(finalPath)),
        settings(wanted),
        partial(path, wanted.keepIncomplete ? Leftover::kept : Leftover::removed) {}

  Status open();
  Status fail(const std::string& reason);
  Status close();
  std::string salvage();
  Status append(std::span<const float* const> channels, std::size_t begin, std::size_t frames);
  float take(float pressure);
  Status appendScaled(std::size_t frames);
  Status flushLimiter();
  double fullScale() const;
  float loudestSample() const;
  Status normalizeInto(const PartialFile& target);
  Status finishNormalized();
  Status giveName(PartialFile& file);

  fs::path path;
  SoundFileSettings settings;
  PartialFile partial;  // declared before `file`, which is closed before this is removed
  std::optional<WavStream> file;
  std::uint64_t total = 0;  // frames of the partial file, once that is closed
  std::vector<fs::path> recovered;
  std::optional<Limiter> limiter;
  std::size_t delay = 0;  // frames of the limiter's delay that are still to come out
  std::vector<std::vector<float>> scaled;  // by channel, 1.0 is full scale
  std::vector<float*> scaledPointers;
  std::vector<float> block;  // interleaved
  double peak = 0.0;         // Pa
  std::uint64_t clipped = 0;
  std::uint64_t notFinite = 0;
  bool failed = false;
};

Status SoundFileWriter::State::fail(const std::string& reason) {
  failed = true;
  return failure(path, reason + salvage());
}

/// Closes the partial file, if it is open.
Status SoundFileWriter::State::close() {
  if (!file) return std::monostate{};
  total = file->frames();
  return std::exchange(file, std::nullopt)->close();
}

/// Keeps what was written so far, if that is wanted. Returns the end of a sentence that says where.
std::string SoundFileWriter::State::salvage() {
  if (!settings.keepIncomplete || partial.path().empty()) return {};
  (void)close();  // its header says what is there
  if (total == 0) return {};
  const double seconds = static_cast<double>(total) / settings.sampleRate;
  const Result<fs::path> kept = partial.keepIncomplete();
  const std::string where = kept ? "are in '" + kept->string() + "'" : kept.error().message;
  return "; the " + numberText(seconds) + " s before " + where;
}

/// Opens the partial file. The loudest sample is known only at the end, so a file to be normalised
/// is kept in float first.
Status SoundFileWriter::State::open() {
  WavStream::Format format = formatOf(settings, settings.fullScalePressure);
  if (settings.normalize) {
    format.samples = SampleFormat::float32;
    format.fullScale = kFullScalePressure;
  }
  Result<WavStream> opened = WavStream::create(partial.path(), format);
  if (!opened) return fail(opened.error().message);
  file = *std::move(opened);
  scaled.resize(settings.channels);
  if (!settings.limit) return std::monostate{};
  Result<Limiter> made =
      Limiter::create({.sampleRate = settings.sampleRate, .channels = settings.channels});
  if (!made) return fail(made.error().message);
  limiter.emplace(*std::move(made));
  delay = limiter->latency();
  return std::monostate{};
}

/// Returns the sample of a pressure, and updates peak, clipping and what is not finite.
float SoundFileWriter::State::take(float pressure) {
  const double fullScale = settings.normalize ? kFullScalePressure : settings.fullScalePressure;
  const auto sample = static_cast<float>(static_cast<double>(pressure) / fullScale);
  if (!std::isfinite(sample)) {
    ++notFinite;
    return 0.0F;
  }
  const double magnitude = std::abs(static_cast<double>(pressure));
  peak = std::max(peak, magnitude);
  const bool clips = settings.format == SampleFormat::pcm16 && !settings.normalize && !limiter;
  if (magnitude > fullScale && clips) ++clipped;
  return sample;
}

Status SoundFileWriter::State::append(std::span<const float* const> channels, std::size_t begin,
                                      std::size_t frames) {
  for (std::size_t channel = 0; channel < channels.size(); ++channel) {
    scaled[channel].resize(frames);
    for (std::size_t frame = 0; frame < frames; ++frame)
      scaled[channel][frame] = take(channels[channel][begin + frame]);
  }
  return appendScaled(frames);
}

/// Limits and writes the samples in `scaled`.
Status SoundFileWriter::State::appendScaled(std::size_t frames) {
  std::size_t first = 0;
  if (limiter) {
    scaledPointers.clear();
    for (std::vector<float>& channel : scaled)
      scaledPointers.push_back(channel.data());
    limiter->process(scaledPointers, frames);
    first = std::min(delay, frames);
    delay -= first;
  }
  const std::size_t channels = scaled.size();
  block.resize((frames - first) * channels);
  for (std::size_t channel = 0; channel < channels; ++channel) {
    for (std::size_t frame = first; frame < frames; ++frame)
      block[(frame - first) * channels + channel] = scaled[channel][frame];
  }
  if (const Status written = file->append(block); !written) return fail(written.error().message);
  return std::monostate{};
}

/// Writes the samples that are still inside the limiter.
Status SoundFileWriter::State::flushLimiter() {
  if (!limiter || scaled.front().empty()) return std::monostate{};
  for (std::vector<float>& channel : scaled)
    channel.assign(limiter->latency(), 0.0F);
  return appendScaled(limiter->latency());
}

/// Returns Pa for 1.0 in the file.
double SoundFileWriter::State::fullScale() const {
  if (!settings.normalize) return settings.fullScalePressure;
  if (peak == 0.0 && settings.leastFullScale == 0.0) return kFullScalePressure;
  return std::max(peak / settings.normalizedPeak, settings.leastFullScale);
}

/// Returns the sample of the partial file that becomes 1.0 in the normalised one.
float SoundFileWriter::State::loudestSample() const {
  return static_cast<float>(fullScale() / kFullScalePressure);
}

/// Writes the partial file, scaled, into another. Errors are the second half of a sentence.
Status SoundFileWriter::State::normalizeInto(const PartialFile& target) {
  const SoundHandle source = openToRead(partial.path());
  if (!source) return Error{std::string("cannot be read back: ") + sf_strerror(nullptr)};
  Result<WavStream> louder = WavStream::create(target.path(), formatOf(settings, fullScale()));
  if (!louder) return louder.error();
  const float loudest = loudestSample();
  block.resize(kBlockSamples / settings.channels * settings.channels);
  std::uint64_t left = total * settings.channels;
  while (left > 0) {
    const sf_count_t count =
        sf_read_float(source.get(), block.data(), static_cast<sf_count_t>(block.size()));
    if (count <= 0) return Error{"cannot be read back to its end"};
    const std::span<float> part(block.data(),
                                std::min<std::uint64_t>(left, static_cast<std::uint64_t>(count)));
    left -= part.size();
    // Divided, not multiplied by a reciprocal: the loudest sample is then 1 exactly.
    for (float& sample : part)
      sample /= loudest;
    if (Status written = louder->append(part); !written) return written;
  }
  return louder->close();
}

/// Gives the normalised sound the file's name; where there is no room for that, the sound as it
/// was written, if that is to be kept: it is whole.
Status SoundFileWriter::State::finishNormalized() {
  PartialFile louder(partial.finalPath());  // absolute: the folder may have changed
  const Status done = normalizeInto(louder);
  if (done) {
    Status named = giveName(louder);
    if (named) total = 0;  // the partial file has nothing to keep
    return named;
  }
  if (!settings.keepIncomplete) return fail(done.error().message);
  if (Status named = giveName(partial); !named) return named;
  failed = true;
  return failure(path, done.error().message + "; it is whole, with a full scale of " +
                           numberText(kFullScalePressure) + " Pa");
}

Status SoundFileWriter::State::giveName(PartialFile& finished) {
  if (const std::error_code reason = finished.giveName(); reason)
    return fail("cannot be given its name: " + reason.message());
  return std::monostate{};
}

SoundFileWriter::SoundFileWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
SoundFileWriter::SoundFileWriter(SoundFileWriter&&) noexcept = default;
SoundFileWriter& SoundFileWriter::operator=(SoundFileWriter&& other) noexcept {
  if (this != &other && state_) (void)state_->salvage();
  state_ = std::move(other.state_);
  return *this;
}
SoundFileWriter::~SoundFileWriter() {
  if (state_) (void)state_->salvage();
}

Result<SoundFileWriter> SoundFileWriter::create(const fs::path& path,
                                                const SoundFileSettings& settings) {
  if (const Status valid = validate(settings); !valid) return failure(path, valid.error().message);
  if (const Status valid = checkWritable(path); !valid) return failure(path, valid.error().message);
  std::vector<fs::path> recovered = PartialFile::keepLeftovers(path, hasSound);
  auto state = std::make_unique<State>(path, settings);
  state->recovered = std::move(recovered);
  if (const Status opened = state->open(); !opened) return opened.error();
  return SoundFileWriter(std::move(state));
}

Status SoundFileWriter::write(std::span<const float* const> channels, std::size_t frames) {
  State& state = *state_;
  if (!state.file || state.failed) return failure(state.path, "is finished or has failed");
  if (channels.size() != state.settings.channels)
    return failure(state.path, "got " + std::to_string(channels.size()) + " channels, has " +
                                   std::to_string(state.settings.channels));
  const std::size_t step = std::max<std::size_t>(1, kBlockSamples / channels.size());
  for (std::size_t begin = 0; begin < frames; begin += step) {
    if (Status part = state.append(channels, begin, std::min(step, frames - begin)); !part)
      return part;
  }
  return std::monostate{};
}

Status SoundFileWriter::finish() {
  State& state = *state_;
  if (!state.file || state.failed) return failure(state.path, "is finished or has failed");
  if (Status flushed = state.flushLimiter(); !flushed) return flushed;
  if (const Status closed = state.close(); !closed) return state.fail(closed.error().message);
  return state.settings.normalize ? state.finishNormalized() : state.giveName(state.partial);
}

double SoundFileWriter::fullScale() const {
  return state_->fullScale();
}
double SoundFileWriter::peakPressure() const {
  return state_->peak;
}
std::uint64_t SoundFileWriter::clippedSamples() const {
  return state_->clipped;
}
std::uint64_t SoundFileWriter::samplesNotFinite() const {
  return state_->notFinite;
}
const std::vector<fs::path>& SoundFileWriter::recovered() const {
  return state_->recovered;
}
double SoundFileWriter::gainReduction() const {
  return state_->limiter ? state_->limiter->largestReduction() : 0.0;
}

}  // namespace carom
