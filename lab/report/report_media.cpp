#include "lab/report/report_media.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <complex>
#include <cstdint>
#include <cstring>
#include <numbers>
#include <vector>

#include <nlohmann/json.hpp>
#include <sndfile.h>
#include <unsupported/Eigen/FFT>

#include "carom/audio/synth_settings.h"

namespace carom::lab {

using namespace scenes;
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kWaveformColumns = 400;
constexpr std::size_t kSpectrogramColumns = 200;
constexpr std::size_t kSpectrogramRows = 64;
constexpr std::size_t kWindow = 1024;    // samples at least; more if columns are farther apart
constexpr double kHighestShown = 0.45;   // share of the sample rate
constexpr double kReferencePeak = 0.25;  // share of full scale

/// A file in memory, as libsndfile writes it.
struct MemoryFile {
  std::string bytes;
  std::size_t position = 0;

  static sf_count_t size(void* file) {
    return static_cast<sf_count_t>(static_cast<MemoryFile*>(file)->bytes.size());
  }
  static sf_count_t seek(sf_count_t offset, int whence, void* file) {
    auto& self = *static_cast<MemoryFile*>(file);
    sf_count_t from = 0;
    if (whence == SEEK_CUR) from = static_cast<sf_count_t>(self.position);
    if (whence == SEEK_END) from = size(file);
    self.position = static_cast<std::size_t>(std::max<sf_count_t>(0, from + offset));
    return static_cast<sf_count_t>(self.position);
  }
  static sf_count_t read(void* data, sf_count_t count, void* file) {
    auto& self = *static_cast<MemoryFile*>(file);
    if (self.position >= self.bytes.size()) return 0;
    const auto part = std::min(static_cast<std::size_t>(count), self.bytes.size() - self.position);
    std::memcpy(data, self.bytes.data() + self.position, part);
    self.position += part;
    return static_cast<sf_count_t>(part);
  }
  static sf_count_t write(const void* data, sf_count_t count, void* file) {
    auto& self = *static_cast<MemoryFile*>(file);
    const auto size = static_cast<std::size_t>(count);
    if (self.position + size > self.bytes.size()) self.bytes.resize(self.position + size);
    std::memcpy(self.bytes.data() + self.position, data, size);
    self.position += size;
    return count;
  }
  static sf_count_t tell(void* file) {
    return static_cast<sf_count_t>(static_cast<MemoryFile*>(file)->position);
  }
};

/// Returns a sound file of the samples; empty if libsndfile cannot write this format.
std::string encoded(const std::vector<std::int16_t>& samples, double sampleRate, int format) {
  SF_INFO info = {};
  info.samplerate = static_cast<int>(std::lround(sampleRate));
  info.channels = 1;
  info.format = format | SF_FORMAT_PCM_16;
  if (sf_format_check(&info) == 0) return {};
  SF_VIRTUAL_IO calls = {MemoryFile::size, MemoryFile::seek, MemoryFile::read, MemoryFile::write,
                         MemoryFile::tell};
  MemoryFile file;
  SNDFILE* sound = sf_open_virtual(&calls, SFM_WRITE, &info, &file);
  if (sound == nullptr) return {};
  const auto count = static_cast<sf_count_t>(samples.size());
  const bool whole = sf_write_short(sound, samples.data(), count) == count;
  sf_close(sound);
  return whole ? file.bytes : std::string();
}

/// Samples are 16-bit words whose last three bits are 0, which FLAC does not store: the page gets
/// half as large, and the error of this rounding is 60 dB below the reference's peak.
constexpr int kLeftOut = 8;
constexpr double kLoudestWord = 4095.0;

std::string audioUri(const std::vector<float>& samples, double sampleRate, double fullScale) {
  std::vector<std::int16_t> words;
  words.reserve(samples.size());
  for (const float sample : samples) {
    const double value = kLoudestWord * static_cast<double>(sample) / fullScale;
    const double kept = std::clamp(value, -kLoudestWord, kLoudestWord);
    words.push_back(static_cast<std::int16_t>(kLeftOut * std::lround(kept)));
  }
  if (const std::string flac = encoded(words, sampleRate, SF_FORMAT_FLAC); !flac.empty())
    return "data:audio/flac;base64," + base64(flac);
  return "data:audio/wav;base64," + base64(encoded(words, sampleRate, SF_FORMAT_WAV));
}

// Rounds to three digits, which are enough for a picture.
double rounded(double value) {
  if (value == 0.0 || !std::isfinite(value)) return 0.0;
  const double unit = std::pow(10.0, std::floor(std::log10(std::abs(value))) - 2.0);
  return std::round(value / unit) * unit;
}

Json waveformJson(const std::vector<float>& samples, double sampleRate) {
  Json low = Json::array();
  Json high = Json::array();
  const std::size_t columns = std::min(kWaveformColumns, samples.size());
  for (std::size_t column = 0; column < columns; ++column) {
    const std::size_t from = column * samples.size() / columns;
    const std::size_t to = (column + 1) * samples.size() / columns;
    const auto [least, most] =
        std::minmax_element(samples.begin() + static_cast<std::ptrdiff_t>(from),
                            samples.begin() + static_cast<std::ptrdiff_t>(to));
    low.push_back(static_cast<float>(rounded(static_cast<double>(*least))));
    high.push_back(static_cast<float>(rounded(static_cast<double>(*most))));
  }
  return {{"columns", columns},
          {"seconds", static_cast<double>(samples.size()) / sampleRate},
          {"low", low},
          {"high", high}};
}

Json spectrogramJson(const std::vector<float>& samples, double sampleRate) {
  const Spectrogram picture = spectrogramOf(samples, sampleRate);
  return {{"columns", picture.columns},
          {"rows", picture.rows},
          {"seconds", static_cast<double>(samples.size()) / sampleRate},
          {"low_frequency", kLowestShown},
          {"high_frequency", kHighestShown * sampleRate},
          {"low_db", kQuietestShown},
          {"high_db", kLoudestShown},
          {"data", base64(picture.data)}};
}

std::vector<float> heardOf(const Signal& signal, double sampleRate) {
  if (signal.empty()) return {};
  const std::vector<float>& first = signal.front();
  const auto most = static_cast<std::size_t>(kHeard * sampleRate);
  return {first.begin(), first.begin() + static_cast<std::ptrdiff_t>(std::min(most, first.size()))};
}

double peakOf(const std::vector<float>& samples) {
  double peak = 0.0;
  for (const float sample : samples)
    peak = std::max(peak, std::abs(static_cast<double>(sample)));
  return peak;
}

/// The levels of one window in the rows of a spectrogram, dB above 20 uPa.
class Levels {
 public:
  Levels(std::size_t window, double sampleRate) : samples_(window) {
    double weights = 0.0;
    window_.reserve(window);
    for (std::size_t i = 0; i < window; ++i) {
      const double turn = 2.0 * std::numbers::pi * static_cast<double>(i);
      window_.push_back(0.5 - 0.5 * std::cos(turn / static_cast<double>(window)));
      weights += window_.back() * window_.back();
    }
    // With this scale the sum of a band is its mean square in the window.
    scale_ = 2.0 / (weights * static_cast<double>(window));
    const double bin = sampleRate / static_cast<double>(window);
    const double ratio = kHighestShown * sampleRate / kLowestShown;
    edges_.reserve(kSpectrogramRows + 1);
    for (std::size_t row = 0; row <= kSpectrogramRows; ++row) {
      const double share = static_cast<double>(row) / static_cast<double>(kSpectrogramRows);
      edges_.push_back(kLowestShown * std::pow(ratio, share) / bin);
    }
  }

  std::vector<double> at(const std::vector<float>& signal, std::ptrdiff_t start) {
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      const std::ptrdiff_t frame = start + static_cast<std::ptrdiff_t>(i);
      const bool inside = frame >= 0 && frame < static_cast<std::ptrdiff_t>(signal.size());
      samples_[i] =
          inside ? window_[i] * static_cast<double>(signal[static_cast<std::size_t>(frame)]) : 0.0;
    }
    transform_.fwd(bins_, samples_);
    std::vector<double> levels;
    levels.reserve(kSpectrogramRows);
    for (std::size_t row = 0; row < kSpectrogramRows; ++row)
      levels.push_back(levelOf(edges_[row], edges_[row + 1]));
    return levels;
  }

 private:
  // Level (dB) of the band between two edges in bins. A row narrower than a bin takes its share of
  // it, so that low frequencies have no gaps.
  double levelOf(double from, double to) const {
    double sum = 0.0;
    for (auto bin = static_cast<std::size_t>(std::lround(from));
         static_cast<double>(bin) - 0.5 < to && bin < samples_.size() / 2; ++bin) {
      const double low = std::max(from, static_cast<double>(bin) - 0.5);
      const double high = std::min(to, static_cast<double>(bin) + 0.5);
      sum += std::max(0.0, high - low) * std::norm(bins_[bin]);
    }
    const double square = kHearingThreshold * kHearingThreshold;
    return 10.0 * std::log10(std::max(scale_ * sum / square, 1e-12));
  }

  Eigen::FFT<double> transform_;
  std::vector<double> window_;
  std::vector<double> samples_;
  std::vector<std::complex<double>> bins_;
  std::vector<double> edges_;  // in bins
  double scale_ = 1.0;
};

}  // namespace

std::string base64(std::string_view bytes) {
  static constexpr char kDigits[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t j = 0; j < 3; ++j) {
      const std::uint32_t byte =
          i + j < bytes.size() ? static_cast<unsigned char>(bytes[i + j]) : 0;
      group = group << 8 | byte;
    }
    for (std::size_t j = 0; j < 4; ++j) {
      const bool padding = j > bytes.size() - i;
      text += padding ? '=' : kDigits[group >> (18 - 6 * j) & 63];
    }
  }
  return text;
}

Spectrogram spectrogramOf(const std::vector<float>& samples, double sampleRate) {
  Spectrogram picture;
  picture.columns = std::min(kSpectrogramColumns, samples.size());
  picture.rows = kSpectrogramRows;
  if (picture.columns == 0) return picture;
  const std::size_t apart = samples.size() / picture.columns;
  // Windows overlap by a half, so that no click falls between two.
  const std::size_t window = std::bit_ceil(std::max(kWindow, 2 * apart));
  Levels levels(window, sampleRate);
  picture.data.reserve(picture.columns * picture.rows);
  for (std::size_t column = 0; column < picture.columns; ++column) {
    const std::size_t middle = (2 * column + 1) * samples.size() / (2 * picture.columns);
    const auto start =
        static_cast<std::ptrdiff_t>(middle) - static_cast<std::ptrdiff_t>(window / 2);
    for (const double level : levels.at(samples, start)) {
      const double share = (level - kQuietestShown) / (kLoudestShown - kQuietestShown);
      picture.data += static_cast<char>(std::lround(255.0 * std::clamp(share, 0.0, 1.0)));
    }
  }
  return picture;
}

Json mediaJson(const SceneReport& report) {
  Json media = Json::object();
  const double rate = report.scene.sampleRate;
  const double peak = peakOf(heardOf(report.variants.front().signal, rate));
  const double fullScale = peak > 0.0 ? peak / kReferencePeak : 1.0;
  for (const VariantReport& variant : report.variants) {
    const std::vector<float> heard = heardOf(variant.signal, rate);
    if (heard.empty()) continue;
    media[variant.choice.id] = {{"audio", audioUri(heard, rate, fullScale)},
                                {"waveform", waveformJson(heard, rate)},
                                {"spectrogram", spectrogramJson(heard, rate)}};
  }
  return media;
}

}  // namespace carom::lab
