#include "carom/audio/sound_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <sstream>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <sndfile.h>

#include "audio/io/partial_file.h"
#include "carom/audio/limiter.h"

namespace carom {

using namespace audio;

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kBlockSamples = 8192;
constexpr double kShortScale = 32768.0;  // as in libsndfile: a sample of 1.0 reads back as 1.0
constexpr std::uint64_t kRiffLimit =
    0xFFFFFFFFu - 4096u;  // 32-bit lengths, less room for the header

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

int subtype(SampleFormat format) {
  return format == SampleFormat::float32 ? SF_FORMAT_FLOAT : SF_FORMAT_PCM_16;
}

/// Float samples have the extensible header, which other tools expect of them.
int wavFormat(SampleFormat format) {
  return (format == SampleFormat::float32 ? SF_FORMAT_WAVEX : SF_FORMAT_WAV) | subtype(format);
}

std::uint64_t bytesPerSample(SampleFormat format) {
  return format == SampleFormat::float32 ? sizeof(float) : sizeof(short);
}

SF_INFO layout(const SoundFileSettings& settings, int format) {
  SF_INFO info = {};
  info.samplerate = static_cast<int>(std::lround(settings.sampleRate));
  info.channels = static_cast<int>(settings.channels);
  info.format = format;
  return info;
}

SoundHandle openToWrite(const fs::path& path, SF_INFO info) {
  SoundHandle file(sf_open(path.c_str(), SFM_WRITE, &info));
  // The peak chunk holds the time of day, and the same sound must give the same file.
  if (file) sf_command(file.get(), SFC_SET_ADD_PEAK_CHUNK, nullptr, SF_FALSE);
  return file;
}

/// Writes the full scale (Pa) into the file's comment; false if it takes none.
bool describe(SNDFILE* file, double fullScale) {
  const std::string comment = "full scale " + numberText(fullScale) + " Pa";
  return sf_set_string(file, SF_STR_COMMENT, comment.c_str()) == 0;
}

short toShort(double sample) {
  const double scaled = std::nearbyint(sample * kShortScale);
  return static_cast<short>(std::clamp(scaled, -kShortScale, kShortScale - 1.0));
}

/// Writes interleaved full-scale values in the file's own format; false if the write fails.
bool writeSamples(SNDFILE* file, SampleFormat format, std::span<const float> samples) {
  const auto count = static_cast<sf_count_t>(samples.size());
  if (format == SampleFormat::float32) return sf_write_float(file, samples.data(), count) == count;
  std::array<short, kBlockSamples> shorts = {};
  for (std::size_t begin = 0; begin < samples.size(); begin += kBlockSamples) {
    const std::size_t part = std::min(kBlockSamples, samples.size() - begin);
    std::transform(samples.begin() + static_cast<std::ptrdiff_t>(begin),
                   samples.begin() + static_cast<std::ptrdiff_t>(begin + part), shorts.begin(),
                   toShort);
    const auto wanted = static_cast<sf_count_t>(part);
    if (sf_write_short(file, shorts.data(), wanted) != wanted) return false;
  }
  return true;
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
  const SF_INFO info = layout(settings, wavFormat(settings.format));
  if (sf_format_check(&info) != SF_TRUE) return Error{"libsndfile cannot write this format"};
  return std::monostate{};
}

}  // namespace

struct SoundFileWriter::State {
  State(fs::path finalPath, const SoundFileSettings& wanted)
      : path(std::move(finalPath)), settings(wanted), partial(path) {}

  /// Format of the partial file. The loudest sample is known only at the end, so a file to be
  /// normalised is kept in float first, in a container without a limit of size.
  SampleFormat streamFormat() const {
    return settings.normalize ? SampleFormat::float32 : settings.format;
  }
  Status open();
  Status fail(const std::string& reason);
  Status append(std::span<const float* const> channels, std::size_t begin, std::size_t frames);
  bool take(float pressure, float& sample);
  Status appendScaled(std::size_t frames);
  Status flushLimiter();
  double fullScale() const;
  float loudestSample() const;
  Status normalizeInto(const PartialFile& target);
  Status giveName(PartialFile& file);

  fs::path path;
  SoundFileSettings settings;
  PartialFile partial;  // declared before `file`, which is closed before this is removed
  SoundHandle file;
  std::optional<Limiter> limiter;
  std::size_t delay = 0;  // frames of the limiter's delay that are still to come out
  std::vector<std::vector<float>> scaled;  // by channel, 1.0 is full scale
  std::vector<float*> scaledPointers;
  std::vector<float> block;  // interleaved
  std::uint64_t framesWritten = 0;
  double peak = 0.0;  // Pa
  std::uint64_t clipped = 0;
  bool failed = false;
};

Status SoundFileWriter::State::fail(const std::string& reason) {
  failed = true;
  return failure(path, reason);
}

Status SoundFileWriter::State::open() {
  const int format =
      settings.normalize ? SF_FORMAT_W64 | subtype(streamFormat()) : wavFormat(settings.format);
  file = openToWrite(partial.path(), layout(settings, format));
  if (!file) return fail(std::string("cannot be created: ") + sf_strerror(nullptr));
  if (!settings.normalize && !describe(file.get(), fullScale())) return fail("takes no comment");
  scaled.resize(settings.channels);
  if (!settings.limit) return std::monostate{};
  Result<Limiter> made =
      Limiter::create({.sampleRate = settings.sampleRate, .channels = settings.channels});
  if (!made) return fail(made.error().message);
  limiter.emplace(*std::move(made));
  delay = limiter->latency();
  return std::monostate{};
}

/// Scales a pressure to a sample, and updates peak and clipping; false if the sample is not finite.
bool SoundFileWriter::State::take(float pressure, float& sample) {
  const double fullScale = settings.normalize ? kFullScalePressure : settings.fullScalePressure;
  const double magnitude = std::abs(static_cast<double>(pressure));
  peak = std::max(peak, magnitude);
  if (magnitude > fullScale && streamFormat() == SampleFormat::pcm16 && !limiter) ++clipped;
  sample = static_cast<float>(static_cast<double>(pressure) / fullScale);
  return std::isfinite(sample);
}

Status SoundFileWriter::State::append(std::span<const float* const> channels, std::size_t begin,
                                      std::size_t frames) {
  for (std::size_t channel = 0; channel < channels.size(); ++channel) {
    scaled[channel].resize(frames);
    for (std::size_t frame = 0; frame < frames; ++frame) {
      if (!take(channels[channel][begin + frame], scaled[channel][frame]))
        return fail("pressure of channel " + std::to_string(channel) + ", frame " +
                    std::to_string(framesWritten + frame) + " is not finite");
    }
  }
  framesWritten += frames;
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
  if (!writeSamples(file.get(), streamFormat(), block))
    return fail(std::string("cannot be written: ") + sf_strerror(file.get()));
  return std::monostate{};
}

/// Writes the samples that are still inside the limiter.
Status SoundFileWriter::State::flushLimiter() {
  if (!limiter || framesWritten == 0) return std::monostate{};
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

Status SoundFileWriter::State::normalizeInto(const PartialFile& target) {
  SF_INFO info = {};
  const SoundHandle source(sf_open(partial.path().c_str(), SFM_READ, &info));
  if (!source) return fail(std::string("cannot be read back: ") + sf_strerror(nullptr));
  SoundHandle louder = openToWrite(target.path(), layout(settings, wavFormat(settings.format)));
  if (!louder) return fail(std::string("cannot be created: ") + sf_strerror(nullptr));
  if (!describe(louder.get(), fullScale())) return fail("takes no comment");

  const float loudest = loudestSample();
  block.resize(kBlockSamples / settings.channels * settings.channels);
  for (;;) {
    const sf_count_t count =
        sf_read_float(source.get(), block.data(), static_cast<sf_count_t>(block.size()));
    if (count <= 0) break;
    const std::span<float> part(block.data(), static_cast<std::size_t>(count));
    // Divided, not multiplied by a reciprocal: the loudest sample is then 1 exactly.
    for (float& sample : part)
      sample /= loudest;
    if (!writeSamples(louder.get(), settings.format, part))
      return fail(std::string("cannot be written: ") + sf_strerror(louder.get()));
  }
  if (const int code = sf_close(louder.release()); code != SF_ERR_NO_ERROR)
    return fail(std::string("cannot be closed: ") + sf_error_number(code));
  return std::monostate{};
}

Status SoundFileWriter::State::giveName(PartialFile& finished) {
  if (const std::error_code reason = finished.giveName(); reason)
    return fail("cannot be given its name: " + reason.message());
  return std::monostate{};
}

SoundFileWriter::SoundFileWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
SoundFileWriter::SoundFileWriter(SoundFileWriter&&) noexcept = default;
SoundFileWriter& SoundFileWriter::operator=(SoundFileWriter&&) noexcept = default;
SoundFileWriter::~SoundFileWriter() = default;

Result<SoundFileWriter> SoundFileWriter::create(const fs::path& path,
                                                const SoundFileSettings& settings) {
  if (const Status valid = validate(settings); !valid) return failure(path, valid.error().message);
  if (const Status valid = checkWritable(path); !valid) return failure(path, valid.error().message);
  PartialFile::removeLeftovers(path);
  auto state = std::make_unique<State>(path, settings);
  if (const Status opened = state->open(); !opened) return opened.error();
  return SoundFileWriter(std::move(state));
}

Status SoundFileWriter::write(std::span<const float* const> channels, std::size_t frames) {
  State& state = *state_;
  if (!state.file || state.failed) return failure(state.path, "is finished or has failed");
  if (channels.size() != state.settings.channels)
    return state.fail("got " + std::to_string(channels.size()) + " channels, has " +
                      std::to_string(state.settings.channels));
  const std::uint64_t frameBytes = bytesPerSample(state.settings.format) * channels.size();
  if (frames > kRiffLimit / frameBytes - state.framesWritten)
    return state.fail("a WAV file holds 4 GiB, here " + std::to_string(kRiffLimit / frameBytes) +
                      " frames; write a shorter sound, fewer channels or PCM16");
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
  if (const int code = sf_close(state.file.release()); code != SF_ERR_NO_ERROR)
    return state.fail(std::string("cannot be closed: ") + sf_error_number(code));
  if (!state.settings.normalize) return state.giveName(state.partial);
  PartialFile louder(state.partial.finalPath());  // absolute: the folder may have changed
  if (Status done = state.normalizeInto(louder); !done) return done;
  return state.giveName(louder);
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
double SoundFileWriter::gainReduction() const {
  return state_->limiter ? state_->limiter->largestReduction() : 0.0;
}

}  // namespace carom
