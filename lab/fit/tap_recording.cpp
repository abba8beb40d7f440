#include "lab/fit/tap_recording.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <numeric>
#include <sstream>

#include "lab/fit/level_statistics.h"
#include <sndfile.h>

namespace carom::lab {

namespace {

constexpr double kHop = 1e-3;           // s, of the course of levels
constexpr double kRise = 10.0;          // of power: what an onset rises by
constexpr double kFall = 4.0;           // of power: what a ring that begins at once falls by
constexpr double kOnsetShare = 1e-3;    // of the peak's power: where the onset begins
constexpr double kBlow = 1e-3;          // s, from the onset on: hammer and body are in contact
constexpr double kNextBlow = 0.05;      // s, the least from one blow to the next
constexpr double kNextShare = 0.02;     // of the peak's power: a blow as loud ends the ring
constexpr double kLargestSample = 1e6;  // of full scale: squares and spectra stay numbers
constexpr double kMargin = 2e-3;        // s, from the background to the onset
constexpr double kClipSearch = 0.3;     // s, after the onset: clipping later is another sound's

Error refusal(const std::string& name, const std::string& why) {
  return {name + ": " + why};
}

/// Returns the mean squares of stretches of kHop.
std::vector<double> powers(std::span<const double> samples, std::size_t hop) {
  std::vector<double> levels;
  for (std::size_t from = 0; from + hop <= samples.size(); from += hop) {
    double sum = 0.0;
    for (std::size_t at = from; at < from + hop; ++at)
      sum += samples[at] * samples[at];
    levels.push_back(sum / static_cast<double>(hop));
  }
  return levels;
}

double meanOf(std::span<const double> values) {
  if (values.empty()) return 0.0;
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// Returns the stretch in which the loudest blow begins.
std::size_t onsetOf(const std::vector<double>& levels, std::size_t loudest) {
  std::vector<double> earlier(levels.begin(),
                              levels.begin() + static_cast<std::ptrdiff_t>(loudest));
  const double background = earlier.size() > 10 ? medianOf(std::move(earlier)) : 0.0;
  const double least = std::max(4.0 * background, kOnsetShare * levels[loudest]);
  std::size_t onset = loudest;
  while (onset > 0 && levels[onset - 1] > least)
    --onset;
  return onset;
}

/// Returns the stretch at which another blow begins after the one at `onset`, or the end.
std::size_t endOf(const std::vector<double>& levels, std::size_t onset, std::size_t loudest) {
  const auto least = static_cast<std::size_t>(kNextBlow / kHop);
  const double loud = kNextShare * levels[loudest];
  for (std::size_t at = std::max(onset + least, loudest + least); at < levels.size(); ++at) {
    const std::size_t from = at > 12 ? at - 12 : 0;
    const std::vector<double> earlier(levels.begin() + static_cast<std::ptrdiff_t>(from),
                                      levels.begin() + static_cast<std::ptrdiff_t>(at - 2));
    if (levels[at] > loud && levels[at] > 8.0 * *std::ranges::max_element(earlier)) return at - 1;
  }
  return levels.size();
}

/// Finds where clipping ends: the index after the last sample at the limit; 0 if none is there. A
/// limit is a value that three neighbours in a row reach.
std::size_t clippedUntil(std::span<const double> ring, std::size_t within, std::size_t& clipped) {
  double peak = 0.0;
  for (const double sample : ring)
    peak = std::max(peak, std::abs(sample));
  const double limit = 0.999 * peak;
  std::size_t run = 0;
  std::size_t last = 0;
  clipped = 0;
  for (std::size_t at = 0; at < std::min(within, ring.size()); ++at) {
    run = std::abs(ring[at]) >= limit ? run + 1 : 0;
    if (run < 3) continue;
    clipped += run == 3 ? 3 : 1;
    last = at + 1;
  }
  return last;
}

bool risesOrFalls(const std::vector<double>& levels, std::size_t onset, std::size_t loudest) {
  if (onset >= 10) {
    const std::vector<double> earlier(levels.begin(),
                                      levels.begin() + static_cast<std::ptrdiff_t>(onset));
    return levels[loudest] > kRise * medianOf(earlier);
  }
  const std::size_t part = std::min<std::size_t>(50, std::max<std::size_t>(1, levels.size() / 4));
  const auto size = static_cast<std::ptrdiff_t>(part);
  return meanOf(std::span(levels).first(part)) >
         kFall * medianOf(std::vector<double>(levels.end() - size, levels.end()));
}

Status checkFormat(const SF_INFO& info, const std::string& name) {
  std::ostringstream why;
  const double seconds = static_cast<double>(info.frames) / info.samplerate;
  if (info.samplerate < static_cast<int>(kLowestTapRate)) {
    why << info.samplerate << " samples a second are too few; expected at least " << kLowestTapRate;
  } else if (seconds < kShortestTap) {
    why << "a sound of " << 1e3 * seconds << " ms is too short; expected at least "
        << 1e3 * kShortestTap << " ms";
  } else if (seconds > kLongestTapFile) {
    why << "a sound of " << seconds << " s is too long; expected at most " << kLongestTapFile
        << " s, with the tap in it";
  } else if (info.channels > 32) {
    why << info.channels << " channels are too many; expected at most 32";
  }
  if (!why.str().empty()) return refusal(name, why.str());
  return std::monostate{};
}

}  // namespace

Result<TapRecording> readTap(const std::filesystem::path& file) {
  const std::string name = file.string();
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) return refusal(name, "there is no such file");
  if (std::filesystem::is_directory(file, ignored))
    return refusal(name, "it is a folder; expected a sound file");
  SF_INFO info = {};
  const std::unique_ptr<SNDFILE, int (*)(SNDFILE*)> sound(sf_open(file.c_str(), SFM_READ, &info),
                                                          &sf_close);
  if (!sound) return refusal(name, "it is not a sound file that can be read; expected WAV or FLAC");
  if (const Status valid = checkFormat(info, name); !valid) return valid.error();
  const auto channels = static_cast<std::size_t>(info.channels);
  std::vector<double> frames(static_cast<std::size_t>(info.frames) * channels);
  const sf_count_t got = sf_readf_double(sound.get(), frames.data(), info.frames);
  TapRecording recording{name, static_cast<double>(info.samplerate), {}};
  recording.channels.assign(channels, std::vector<double>(static_cast<std::size_t>(got)));
  bool silent = true;
  for (std::size_t frame = 0; frame < static_cast<std::size_t>(got); ++frame) {
    for (std::size_t channel = 0; channel < channels; ++channel) {
      const double sample = frames[frame * channels + channel];
      if (!std::isfinite(sample)) return refusal(name, "it has samples that are not finite");
      if (std::abs(sample) > kLargestSample)
        return refusal(name, "it has samples beyond 1e6; expected full scale at 1");
      silent = silent && sample == 0.0;
      recording.channels[channel][frame] = sample;
    }
  }
  if (silent) return refusal(name, "it is silent; expected a tap");
  return recording;
}

Result<TapSegment> findTap(std::span<const double> samples, double sampleRate) {
  const auto hop = static_cast<std::size_t>(std::max(1.0, std::round(kHop * sampleRate)));
  std::vector<double> centred(samples.begin(), samples.end());
  const double mean = meanOf(centred);
  for (double& sample : centred)
    sample -= mean;
  const std::vector<double> levels = powers(centred, hop);
  if (levels.empty()) return Error{"it is too short; expected at least 50 ms"};
  const auto loudest = static_cast<std::size_t>(std::ranges::max_element(levels) - levels.begin());
  const std::size_t onset = onsetOf(levels, loudest);
  if (!(levels[loudest] > 0.0) || !risesOrFalls(levels, onset, loudest))
    return Error{"there is no onset; expected a tap that stands 10 dB above what is before it"};
  TapSegment tap;
  tap.sampleRate = sampleRate;
  const std::size_t first = onset * hop;
  const std::size_t end = endOf(levels, onset, loudest) == levels.size()
                              ? samples.size()
                              : endOf(levels, onset, loudest) * hop;
  tap.onset = static_cast<double>(first) / sampleRate;
  tap.ring.assign(centred.begin() + static_cast<std::ptrdiff_t>(first),
                  centred.begin() + static_cast<std::ptrdiff_t>(end));
  const auto margin = static_cast<std::size_t>(kMargin * sampleRate);
  if (first > margin)
    tap.before.assign(centred.begin(),
                      centred.begin() + static_cast<std::ptrdiff_t>(first - margin));
  const std::size_t clippedEnd =
      clippedUntil(tap.ring, static_cast<std::size_t>(kClipSearch * sampleRate), tap.clipped);
  const std::size_t blow =
      (loudest - onset + 1) * hop + static_cast<std::size_t>(kBlow * sampleRate);
  tap.begin = std::max(std::min(blow, static_cast<std::size_t>(0.02 * sampleRate)), clippedEnd);
  if (static_cast<double>(tap.ring.size()) < kShortestTap * sampleRate ||
      tap.begin + hop * 20 > tap.ring.size())
    return Error{"less than 50 ms of ring are left after its onset; expected more"};
  return tap;
}

Result<std::vector<TapSegment>> tapsOf(const TapRecording& recording) {
  std::vector<TapSegment> taps;
  std::string why;
  for (const std::vector<double>& channel : recording.channels) {
    if (std::ranges::all_of(channel, [](double sample) { return sample == 0.0; })) continue;
    Result<TapSegment> tap = findTap(channel, recording.sampleRate);
    if (tap)
      taps.push_back(*std::move(tap));
    else if (why.empty())
      why = tap.error().message;
  }
  if (taps.empty()) return refusal(recording.name, why);
  return taps;
}

}  // namespace carom::lab
