#include "lab/fit/fit_files.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <iomanip>
#include <memory>
#include <numbers>
#include <span>
#include <sstream>
#include <string_view>
#include <system_error>

#include "lab/fit/png_picture.h"
#include "lab/fit/spectral_peaks.h"
#include <nlohmann/json.hpp>

#include "audio/io/partial_file.h"
#include "carom/audio/modal_model_file.h"

namespace carom::lab {

namespace {

constexpr double kLongestHeard = 5.0;  // s
constexpr double kPeak = 0.7;          // of full scale, in the page's sounds
constexpr double kLead = 0.05;         // s of silence before a synthesised tap
constexpr int kWidth = 1100;           // pixels
constexpr int kHeight = 480;
constexpr int kLeft = 52;
constexpr int kBottom = 34;
constexpr int kLabel = 26;              // the widest of an axis
constexpr double kShownLevels = 100.0;  // dB
constexpr double kShownFrom = 80.0;     // Hz
constexpr PictureColour kInk = {40, 40, 40};
constexpr PictureColour kGrid = {224, 224, 224};
constexpr PictureColour kCurve = {30, 90, 160};
constexpr PictureColour kMatched = {20, 150, 70};
constexpr PictureColour kUnheard = {205, 205, 205};
constexpr PictureColour kUnexplained = {205, 50, 40};

const TapSegment& loudestOf(const std::vector<TapSegment>& taps) {
  const auto peak = [](const TapSegment& tap) {
    double most = 0.0;
    for (const double sample : tap.ring)
      most = std::max(most, std::abs(sample));
    return most;
  };
  return *std::ranges::max_element(taps, {}, peak);
}

std::string wavBytes(const std::vector<double>& samples, double sampleRate) {
  const auto rate = static_cast<std::uint32_t>(std::lround(sampleRate));
  const auto size = static_cast<std::uint32_t>(2 * samples.size());
  std::string bytes;
  const auto add = [&bytes](std::uint32_t number, int count) {
    for (int at = 0; at < count; ++at)
      bytes += static_cast<char>((number >> (8 * at)) & 0xFFu);
  };
  bytes += "RIFF";
  add(36 + size, 4);
  bytes += "WAVEfmt ";
  add(16, 4);
  add(1, 2);  // PCM
  add(1, 2);  // channel
  add(rate, 4);
  add(2 * rate, 4);
  add(2, 2);
  add(16, 2);
  bytes += "data";
  add(size, 4);
  for (const double sample : samples) {
    const auto word =
        static_cast<std::int16_t>(std::lround(32767.0 * std::clamp(sample, -1.0, 1.0)));
    add(static_cast<std::uint16_t>(word), 2);
  }
  return bytes;
}

/// Returns the tap with a little of what was before it.
std::vector<double> heardTap(const TapSegment& tap) {
  const auto lead = static_cast<std::size_t>(kLead * tap.sampleRate);
  std::vector<double> samples(lead, 0.0);
  const std::size_t known = std::min(lead, tap.before.size());
  std::copy_n(tap.before.end() - static_cast<std::ptrdiff_t>(known), known,
              samples.end() - static_cast<std::ptrdiff_t>(known));
  const auto most = static_cast<std::size_t>(kLongestHeard * tap.sampleRate);
  const std::span<const double> ring = std::span(tap.ring).first(std::min(most, tap.ring.size()));
  samples.insert(samples.end(), ring.begin(), ring.end());
  return samples;
}

double rmsOf(std::span<const double> samples) {
  double sum = 0.0;
  for (const double sample : samples)
    sum += sample * sample;
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, samples.size())));
}

void toPeak(std::vector<double>& samples) {
  double peak = 1e-30;
  for (const double sample : samples)
    peak = std::max(peak, std::abs(sample));
  for (double& sample : samples)
    sample *= kPeak / peak;
}

int pixelOf(double frequency, double highest) {
  const double share = std::log(frequency / kShownFrom) / std::log(highest / kShownFrom);
  return kLeft + static_cast<int>(std::lround(share * (kWidth - kLeft - 10)));
}

int levelPixel(double level) {
  const double share = std::clamp(-level / kShownLevels, 0.0, 1.0);
  return 10 + static_cast<int>(std::lround(share * (kHeight - kBottom - 10)));
}

void drawAxes(PngPicture& picture, double highest) {
  const auto label = [](double frequency) {
    std::ostringstream text;
    if (frequency >= 1000.0)
      text << frequency / 1000.0 << 'k';
    else
      text << frequency;
    return text.str();
  };
  for (const double frequency : {100.0, 200.0, 500.0, 1000.0, 2000.0, 5000.0, 10000.0, 20000.0}) {
    if (frequency > highest) continue;
    const int x = pixelOf(frequency, highest);
    picture.line(x, 10, x, kHeight - kBottom, kGrid);
    picture.text(std::min(x - 8, kWidth - kLabel), kHeight - kBottom + 6, label(frequency), kInk);
  }
  for (int tick = 0; 20 * tick <= kShownLevels; ++tick) {
    const double level = -20.0 * tick;
    picture.line(kLeft, levelPixel(level), kWidth - 10, levelPixel(level), kGrid);
    picture.text(4, levelPixel(level) - 5, std::to_string(static_cast<int>(level)), kInk);
  }
  picture.text(kWidth - 28, kHeight - 14, "Hz", kInk);
  picture.text(4, kHeight - 26, "dB", kInk);
}

void drawModes(PngPicture& picture, const FitOutcome& outcome, double highest) {
  if (!outcome.fit) return;
  const auto draw = [&](double frequency, int from, int to, PictureColour colour) {
    if (frequency <= kShownFrom || frequency >= highest) return;
    const int x = pixelOf(frequency, highest);
    picture.line(x, from, x, to, colour);
  };
  for (const Mode& mode : outcome.fit->model.modes)
    draw(mode.frequency, 10, kHeight - kBottom, kUnheard);
  for (const FittedMode& mode : outcome.fit->modes) {
    if (mode.computed)
      draw(*mode.computed, 10, kHeight - kBottom, kMatched);
    else if (mode.measured.confidence >= 0.3)
      draw(mode.measured.frequency, kHeight - kBottom - 24, kHeight - kBottom, kUnexplained);
  }
}

void drawCurve(PngPicture& picture, const PowerSpectrum& spectrum, double highest) {
  const double most = *std::ranges::max_element(spectrum.power);
  int lastX = -1;
  int top = kHeight;
  int lastY = kHeight - kBottom;
  for (std::size_t bin = 1; bin < spectrum.power.size(); ++bin) {
    const double frequency = spectrum.step * static_cast<double>(bin);
    if (frequency < kShownFrom || frequency > highest) continue;
    const int x = pixelOf(frequency, highest);
    const int y = levelPixel(10.0 * std::log10(std::max(spectrum.power[bin] / most, 1e-30)));
    if (x != lastX) {
      if (lastX >= 0) {
        picture.line(lastX - 1, lastY, lastX, top, kCurve);
        lastY = top;
      }
      lastX = x;
      top = y;
    }
    top = std::min(top, y);
  }
}

/// Writes the text with the letters that mean something in HTML replaced.
std::string escaped(std::string_view text) {
  std::string safe;
  for (const char letter : text) {
    if (letter == '<')
      safe += "&lt;";
    else if (letter == '&')
      safe += "&amp;";
    else if (letter == '"')
      safe += "&quot;";
    else
      safe += letter;
  }
  return safe;
}

constexpr std::string_view kPageHead = R"(<!doctype html>
<html lang="en"><head><meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>carom fit</title>
<style>
body { font: 16px/1.45 system-ui, sans-serif; margin: 2rem auto; max-width: 70rem; padding: 0 1rem; color: #222; }
.sounds { display: grid; grid-template-columns: repeat(auto-fit, minmax(16rem, 1fr)); gap: 1rem; }
.sounds audio { width: 100%; }
img { max-width: 100%; height: auto; }
pre { overflow-x: auto; background: #f5f5f5; padding: 1rem; font-size: 13px; }
</style></head><body>
)";

void addSound(std::ostringstream& page, std::string_view file, std::string_view title,
              std::string_view text) {
  page << "<div><h2>" << title << "</h2><audio controls preload=\"auto\" src=\"" << file
       << "\"></audio><p>" << text << "</p></div>\n";
}

std::string fitPage(const FitOutcome& outcome) {
  std::ostringstream page;
  page << kPageHead << "<h1>" << escaped(outcome.name) << "</h1>\n<div class=\"sounds\">\n";
  addSound(page, "tap.wav", "Tap", "as recorded");
  if (outcome.fit)
    addSound(page, "fitted.wav", "Fitted",
             "its modes at the levels of the tap, with the frequencies and decays of the mesh and "
             "the fitted material");
  addSound(page, "measured.wav", "Measured", "the same with the frequencies and decays found");
  page << "</div>\n<img src=\"spectrum.png\" alt=\"Spectrum of the tap\">\n<p>Blue: the tap. ";
  if (outcome.fit)
    page << "Green: computed modes that the tap has; grey: those that it does not; red, below: "
            "modes of the tap that the mesh does not have.";
  page << "</p>\n<pre>" << escaped(fitText(outcome)) << "</pre>\n</body></html>\n";
  return page.str();
}

const ModalModel& modelOf(const FitOutcome& outcome) {
  return outcome.fit ? outcome.fit->model : outcome.alone->model;
}

/// The files of a folder, which get their names together.
class FitFolder {
 public:
  explicit FitFolder(std::filesystem::path folder) : folder_(std::move(folder)) {}

  Status add(const std::string& name, std::string_view bytes) {
    const std::filesystem::path path = folder_ / name;
    if (const Status valid = audio::checkWritable(path); !valid)
      return Error{path.string() + ": " + valid.error().message};
    auto file = std::make_unique<audio::PartialFile>(path);
    std::ofstream stream(file->path(), std::ios::binary);
    stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    stream.close();
    if (!stream) return Error{path.string() + ": cannot be written"};
    files_.push_back(std::move(file));
    return std::monostate{};
  }

  Status giveNames() {
    for (const auto& file : files_) {
      if (const std::error_code error = file->giveName())
        return Error{file->finalPath().string() + ": " + error.message()};
    }
    return std::monostate{};
  }

 private:
  std::filesystem::path folder_;
  std::vector<std::unique_ptr<audio::PartialFile>> files_;
};

}  // namespace

std::vector<double> resynthesised(const FitOutcome& outcome, bool byMaterial) {
  const TapSegment& tap = loudestOf(outcome.taps);
  const auto lead = static_cast<std::size_t>(kLead * tap.sampleRate);
  const auto most = static_cast<std::size_t>(kLongestHeard * tap.sampleRate);
  std::vector<double> samples(lead + std::min(most, tap.ring.size()), 0.0);
  const auto add = [&](double frequency, double decay, double level) {
    const double amplitude = std::pow(10.0, level / 20.0);
    for (std::size_t at = lead; at < samples.size(); ++at) {
      const double time = static_cast<double>(at - lead) / tap.sampleRate;
      samples[at] +=
          amplitude * std::exp(-decay * time) * std::sin(2.0 * std::numbers::pi * frequency * time);
    }
  };
  if (outcome.fit && byMaterial) {
    for (const FittedMode& mode : outcome.fit->modes) {
      if (mode.computed) add(*mode.computed, *mode.computedDecay, mode.measured.level);
    }
  } else {
    for (const TapMode& mode : outcome.found.modes)
      add(mode.frequency, mode.decayRate, mode.level);
  }
  return samples;
}

std::string spectrumPicture(const FitOutcome& outcome) {
  const TapSegment& tap = loudestOf(outcome.taps);
  const double highest = std::min(20000.0, 0.48 * tap.sampleRate);
  PngPicture picture(kWidth, kHeight);
  drawAxes(picture, highest);
  drawModes(picture, outcome, highest);
  const auto window = static_cast<std::size_t>(0.5 * tap.sampleRate);
  drawCurve(picture, ringSpectrum(tap.free(), window, tap.sampleRate), highest);
  return picture.bytes();
}

Status writeFit(const std::filesystem::path& folder, const FitOutcome& outcome) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return Error{folder.string() + ": the folder cannot be made: " + error.message()};
  const Result<std::vector<std::byte>> model = encodedModalModel(modelOf(outcome));
  if (!model) return model.error();
  const TapSegment& tap = loudestOf(outcome.taps);
  std::vector<double> heard = heardTap(tap);
  toPeak(heard);
  std::vector<std::pair<std::string, std::string>> files = {
      {"material.json", materialText(outcome)},
      {"model.carom_modes",
       std::string(reinterpret_cast<const char*>(model->data()), model->size())},
      {"modes.csv", modesCsv(outcome)},
      {"spectrum.png", spectrumPicture(outcome)},
      {"tap.wav", wavBytes(heard, tap.sampleRate)}};
  for (const bool byMaterial : {true, false}) {
    if (byMaterial && !outcome.fit) continue;
    std::vector<double> made = resynthesised(outcome, byMaterial);
    const double factor = rmsOf(heard) / std::max(rmsOf(made), 1e-30);
    for (double& sample : made)
      sample *= factor;
    files.emplace_back(byMaterial ? "fitted.wav" : "measured.wav", wavBytes(made, tap.sampleRate));
  }
  files.emplace_back("index.html", fitPage(outcome));
  FitFolder whole(folder);
  for (const auto& file : files) {
    if (const Status added = whole.add(file.first, file.second); !added) return added.error();
  }
  return whole.giveNames();
}

}  // namespace carom::lab
