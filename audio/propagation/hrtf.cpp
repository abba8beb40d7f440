#include "audio/propagation/hrtf.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <complex>
#include <cstddef>
#include <map>
#include <numbers>
#include <numeric>
#include <utility>

#include "audio/model/immortal.h"
#include "audio/model/mutex.h"
#include "audio/propagation/sofa_file.h"
#include "carom/audio/listener.h"

namespace carom {

using namespace audio;

namespace {

using std::numbers::pi;

constexpr std::array<Ear, 2> kEars = {Ear::left, Ear::right};
constexpr double kMinSampleRate = 8000.0;    // Hz
constexpr double kMaxSampleRate = 384000.0;  // Hz
constexpr std::size_t kMaxSamples = HrtfMeasurements::kMostSamples;
constexpr std::size_t kMaxDirections = HrtfMeasurements::kMostDirections;
constexpr double kMostSamples = HrtfMeasurements::kMostTogether;
constexpr double kSameDirection = 1e-3;  // rad
constexpr double kOnsetLevel = 0.1;      // share of the peak
constexpr std::size_t kLead = 16;        // samples before the onset: half of the blending kernel
constexpr std::size_t kFade = 16;        // samples
constexpr double kPoleGap = 30.0 * pi / 180.0;
constexpr double kRingWidth = 5.0 * pi / 180.0;
constexpr double kKaiserBeta = 8.0;
constexpr std::size_t kResampleHalfWidth = 32;
constexpr std::size_t kBlendHalfWidth = 16;
constexpr std::size_t kBlendTaps = 2 * kBlendHalfWidth;

Status validate(const HrtfMeasurement& item, std::size_t samples) {
  const double distance = item.direction.norm();
  if (!(std::isfinite(distance) && distance > 0.0))
    return Error{"its direction is zero or not finite"};
  for (const Ear ear : kEars) {
    const auto channel = static_cast<std::size_t>(ear);
    const std::vector<float>& response = item.response[channel];
    if (response.size() != samples) return Error{"its length differs from that of the first"};
    if (!(item.delay[channel] >= 0.0 && item.delay[channel] <= static_cast<double>(kMaxSamples)))
      return Error{"its delay is not from 0 to " + std::to_string(kMaxSamples) + " samples"};
    const auto isFinite = [](float sample) { return std::isfinite(sample); };
    if (!std::all_of(response.begin(), response.end(), isFinite))
      return Error{"it holds a value that is not finite"};
    // Values as small as this count as silence: their onset would mean nothing.
    const auto isHeard = [](float sample) { return std::abs(sample) > 1e-20F; };
    if (std::none_of(response.begin(), response.end(), isHeard)) return Error{"it is silent"};
    const auto isHuge = [](float sample) { return std::abs(sample) > 1e20F; };
    if (std::any_of(response.begin(), response.end(), isHuge))
      return Error{"it holds a value above 1e20"};
  }
  return std::monostate{};
}

/// Refuses sets whose responses, at the wanted rate or their own, would take minutes and gigabytes:
/// the largest sets that are published have a fifth of this.
Status validateSize(const HrtfMeasurements& measurements, double sampleRate) {
  const double responses = 2.0 * static_cast<double>(measurements.items.size());
  const double samples = static_cast<double>(measurements.items.front().response[0].size());
  const double all = responses * samples * std::max(1.0, sampleRate / measurements.sampleRate);
  if (all <= kMostSamples) return std::monostate{};
  return Error{"responses of " + std::to_string(std::llround(all)) +
               " samples together at the wanted rate; it takes " +
               std::to_string(std::llround(kMostSamples))};
}

bool isSampleRate(double rate) {
  return rate >= kMinSampleRate && rate <= kMaxSampleRate;
}

Status validate(const HrtfMeasurements& measurements, double sampleRate) {
  const auto rateError = [](const std::string& whose, double rate) {
    return whose + " sample rate is " + std::to_string(rate) + " Hz; it takes 8000 to 384000 Hz";
  };
  if (!isSampleRate(sampleRate)) return Error{rateError("the wanted", sampleRate)};
  if (!isSampleRate(measurements.sampleRate))
    return Error{rateError("the set's own", measurements.sampleRate)};
  const auto& items = measurements.items;
  if (items.size() < 4 || items.size() > kMaxDirections)
    return Error{std::to_string(items.size()) + " directions; it takes 4 to " +
                 std::to_string(kMaxDirections)};
  const std::size_t samples = items.front().response.front().size();
  if (samples < 1 || samples > kMaxSamples)
    return Error{"responses of " + std::to_string(samples) + " samples; it takes 1 to " +
                 std::to_string(kMaxSamples)};
  if (Status valid = validateSize(measurements, sampleRate); !valid) return valid;
  for (std::size_t index = 0; index < items.size(); ++index)
    if (const Status valid = validate(items[index], samples); !valid)
      return Error{"measurement " + std::to_string(index) + ": " + valid.error().message};
  return std::monostate{};
}

/// Returns the indices of the measurements, in their order, with only the farthest one in each
/// direction.
std::vector<std::size_t> distinct(const std::vector<HrtfMeasurement>& items) {
  std::vector<std::size_t> order(items.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t one, std::size_t two) {
    return items[one].direction.norm() > items[two].direction.norm();
  });
  std::vector<std::size_t> kept;
  std::vector<Vec3> directions;
  for (const std::size_t index : order) {
    const Vec3 direction = items[index].direction.normalized();
    const auto isSame = [&](const Vec3& other) {
      return (other - direction).squaredNorm() < kSameDirection * kSameDirection;
    };
    if (std::any_of(directions.begin(), directions.end(), isSame)) continue;
    kept.push_back(index);
    directions.push_back(direction);
  }
  std::sort(kept.begin(), kept.end());
  return kept;
}

/// A response as a band-limited function of time.
class Continuous {
 public:
  Continuous(const SincKernel& kernel, const std::vector<float>& samples)
      : kernel_(kernel), samples_(samples) {}

  /// @param time in samples
  double operator()(double time) const {
    const double reach = static_cast<double>(kernel_.halfWidth());
    const double end = static_cast<double>(samples_.size()) - 1.0;
    const auto first = static_cast<std::ptrdiff_t>(std::max(0.0, std::ceil(time - reach)));
    const auto last = static_cast<std::ptrdiff_t>(std::min(end, std::floor(time + reach)));
    double sum = 0.0;
    for (std::ptrdiff_t sample = first; sample <= last; ++sample)
      sum += static_cast<double>(samples_[static_cast<std::size_t>(sample)]) *
             kernel_(time - static_cast<double>(sample));
    return sum;
  }

 private:
  const SincKernel& kernel_;
  const std::vector<float>& samples_;
};

/// Samples until the response first reaches a tenth of its peak, to a fraction of a sample.
double onsetOf(const Continuous& response, const std::vector<float>& samples) {
  const auto magnitude = [](float sample) { return std::abs(static_cast<double>(sample)); };
  double peak = 0.0;
  for (const float sample : samples)
    peak = std::max(peak, magnitude(sample));
  const double level = kOnsetLevel * peak;
  const auto first = std::find_if(samples.begin(), samples.end(),
                                  [&](float sample) { return magnitude(sample) >= level; });
  const double end = static_cast<double>(first - samples.begin());
  constexpr int kParts = 16;
  double before = 0.0;
  for (int part = 0; part < kParts; ++part) {
    const double time = end - 1.0 + static_cast<double>(part) / kParts;
    const double now = std::abs(response(time));
    if (now >= level) return part == 0 ? time : time - (now - level) / (now - before) / kParts;
    before = now;
  }
  return end;
}

/// Energy of the response around a frequency, over that of a unit impulse.
double energyAt(std::span<const double> response, double cyclesPerSample) {
  std::complex<double> sum = 0.0;
  for (std::size_t sample = 0; sample < response.size(); ++sample)
    sum += response[sample] *
           std::polar(1.0, -2.0 * pi * cyclesPerSample * static_cast<double>(sample));
  return std::norm(sum);
}

}  // namespace

/// The steps of HrtfSet::create.
class HrtfBuilder {
 public:
  HrtfBuilder(const HrtfMeasurements& measurements, double sampleRate, const HrtfSettings& settings)
      : measurements_(measurements),
        settings_(settings),
        sampleRate_(sampleRate),
        ratio_(measurements.sampleRate / sampleRate),
        kernel_(kResampleHalfWidth, ratio_ > 1.0 ? 0.95 / ratio_ : 1.0, kKaiserBeta),
        kept_(distinct(measurements.items)) {}

  Result<HrtfSet> build() {
    alignAll();
    addPole(Vec3::UnitY());
    addPole(-Vec3::UnitY());
    std::optional<SphereMesh> mesh = SphereMesh::create(directions_);
    if (!mesh)
      return Error{"the directions do not surround the listener: there is a gap of more than " +
                   std::to_string(std::lround(2.0 * SphereMesh::kMaxGap * 180.0 / pi)) +
                   " degrees"};
    trim();
    return finish(std::move(*mesh));
  }

 private:
  /// Both ears of one direction, at the wanted rate.
  struct Pair {
    std::array<double, 2> onset = {0.0, 0.0};  // s
    std::array<std::vector<double>, 2> aligned;
  };

  void alignAll() {
    const double samples = static_cast<double>(measurements_.items.front().response[0].size());
    const auto length = static_cast<std::size_t>(std::ceil(samples / ratio_)) + 2 * kLead;
    for (const std::size_t index : kept_) {
      const HrtfMeasurement& item = measurements_.items[index];
      directions_.push_back(item.direction.normalized());
      pairs_.emplace_back();
      for (std::size_t ear = 0; ear < 2; ++ear)
        pairs_.back().onset[ear] =
            (item.delay[ear] + align(item.response[ear], length, pairs_.back().aligned[ear])) /
            measurements_.sampleRate;
    }
  }

  /// Writes the response aligned by its onset, and returns the onset in samples of the
  /// measurements.
  double align(const std::vector<float>& samples, std::size_t length,
               std::vector<double>& aligned) const {
    const Continuous response(kernel_, samples);
    const double onset = onsetOf(response, samples);
    aligned.resize(length);
    for (std::size_t sample = 0; sample < length; ++sample) {
      const double since = static_cast<double>(sample) - static_cast<double>(kLead);
      aligned[sample] = response(onset + since * ratio_);
    }
    return onset;
  }

  void addPole(const Vec3& pole) {
    std::vector<double> angles;
    for (const Vec3& direction : directions_)
      angles.push_back(std::acos(std::clamp(direction.dot(pole), -1.0, 1.0)));
    const double nearest = *std::min_element(angles.begin(), angles.end());
    if (nearest <= kPoleGap) return;
    std::vector<std::size_t> ring;
    for (std::size_t index = 0; index < angles.size(); ++index)
      if (angles[index] <= nearest + kRingWidth) ring.push_back(index);
    directions_.push_back(pole);
    pairs_.push_back(mean(ring));
  }

  Pair mean(const std::vector<std::size_t>& ring) const {
    Pair sum;
    const double share = 1.0 / static_cast<double>(ring.size());
    for (std::size_t ear = 0; ear < 2; ++ear) {
      sum.aligned[ear].resize(pairs_.front().aligned[ear].size(), 0.0);
      for (const std::size_t index : ring) {
        sum.onset[ear] += share * pairs_[index].onset[ear];
        for (std::size_t sample = 0; sample < sum.aligned[ear].size(); ++sample)
          sum.aligned[ear][sample] += share * pairs_[index].aligned[ear][sample];
      }
    }
    return sum;
  }

  static double energyOf(const std::vector<double>& response) {
    return std::inner_product(response.begin(), response.end(), response.begin(), 0.0);
  }

  /// Samples after which less than `allowed` energy follows.
  static std::size_t neededLength(const std::vector<double>& response, double allowed) {
    double tail = 0.0;
    std::size_t length = response.size();
    for (; length > 0; --length) {
      tail += response[length - 1] * response[length - 1];
      if (tail > allowed) break;
    }
    return length;
  }

  void trim() {
    double energy = 0.0;
    for (const Pair& pair : pairs_)
      energy += energyOf(pair.aligned[0]) + energyOf(pair.aligned[1]);
    const double allowed =
        settings_.tailEnergy * energy / (2.0 * static_cast<double>(pairs_.size()));
    std::size_t needed = 0;
    for (const Pair& pair : pairs_)
      for (const std::vector<double>& response : pair.aligned)
        needed = std::max(needed, neededLength(response, allowed));
    for (Pair& pair : pairs_)
      for (std::vector<double>& response : pair.aligned)
        fadeOut(response, needed);
  }

  static void fadeOut(std::vector<double>& response, std::size_t needed) {
    response.resize(needed + kFade, 0.0);
    for (std::size_t sample = 0; sample < kFade; ++sample) {
      const double phase = (static_cast<double>(sample) + 1.0) / (static_cast<double>(kFade) + 1.0);
      response[needed + sample] *= 0.5 + 0.5 * std::cos(pi * phase);
    }
  }

  HrtfSet finish(SphereMesh mesh) const {
    HrtfSet set(std::move(mesh));
    set.sampleRate_ = sampleRate_;
    set.alignedLength_ = pairs_.front().aligned[0].size();
    double earliest = pairs_.front().onset[0];
    for (const Pair& pair : pairs_)
      earliest = std::min({earliest, pair.onset[0], pair.onset[1]});
    double latest = 0.0;
    for (const Pair& pair : pairs_) {
      for (std::size_t ear = 0; ear < 2; ++ear) {
        set.delays_.push_back(pair.onset[ear] - earliest);
        latest = std::max(latest, set.delays_.back());
        for (const double sample : pair.aligned[ear])
          set.aligned_.push_back(static_cast<float>(sample));
      }
    }
    set.length_ =
        set.alignedLength_ + static_cast<std::size_t>(std::ceil(latest * sampleRate_)) + kBlendTaps;
    normalise(set);
    return set;
  }

  static void normalise(HrtfSet& set) {
    const SphereWeights front = set.lookup(-Vec3::UnitZ());
    std::vector<double> response(set.alignedLength_);
    double energy = 0.0;
    double delay = 0.0;
    int count = 0;
    for (const Ear ear : kEars) {
      delay += 0.5 * set.blendAligned(front, ear, response);
      for (int frequency = 200; frequency <= 1000; frequency += 10, ++count)
        energy += energyAt(response, frequency / set.sampleRate_);
    }
    set.latency_ = delay + static_cast<double>(kLead) / set.sampleRate_;
    // A set that is silent in front at these frequencies has no level to go by.
    const double gain = energy > 0.0 ? std::sqrt(static_cast<double>(count) / energy) : 1.0;
    for (float& sample : set.aligned_)
      sample = static_cast<float>(gain * static_cast<double>(sample));
  }

  const HrtfMeasurements& measurements_;
  HrtfSettings settings_;
  double sampleRate_;  // Hz
  double ratio_;       // samples of the set for each sample wanted
  SincKernel kernel_;
  std::vector<std::size_t> kept_;
  std::vector<Vec3> directions_;
  std::vector<Pair> pairs_;
};

HrtfSet::HrtfSet(SphereMesh mesh)
    : mesh_(std::move(mesh)), kernel_(kBlendHalfWidth, 1.0, kKaiserBeta) {}

Result<HrtfSet> HrtfSet::create(const HrtfMeasurements& measurements, double sampleRate,
                                const HrtfSettings& settings) {
  if (!(settings.tailEnergy >= 0.0 && settings.tailEnergy < 1.0))
    return Error{"head-related responses: tailEnergy is " + std::to_string(settings.tailEnergy) +
                 "; it takes 0 to below 1"};
  if (const Status valid = validate(measurements, sampleRate); !valid)
    return Error{"head-related responses: " + valid.error().message};
  Result<HrtfSet> set = HrtfBuilder(measurements, sampleRate, settings).build();
  if (!set) return Error{"head-related responses: " + set.error().message};
  return set;
}

Result<HrtfSet> HrtfSet::load(const std::filesystem::path& path, double sampleRate,
                              const HrtfSettings& settings) {
  if (!isSampleRate(sampleRate))
    return Error{"head-related responses: the wanted sample rate is " + std::to_string(sampleRate) +
                 " Hz; it takes 8000 to 384000 Hz"};
  const std::filesystem::path file = path.empty() ? defaultSofaFile() : path;
  const Result<HrtfMeasurements> measurements = readSofaFile(file);
  if (!measurements) return measurements.error();
  Result<HrtfSet> set = create(*measurements, sampleRate, settings);
  if (!set) return Error{"SOFA file '" + file.string() + "': " + set.error().message};
  return set;
}

std::span<const float> HrtfSet::aligned(std::size_t index, Ear ear) const {
  return std::span(aligned_).subspan(slot(index, ear) * alignedLength_, alignedLength_);
}

double HrtfSet::blendAligned(const SphereWeights& where, Ear ear,
                             std::span<double> response) const noexcept {
  assert(response.size() >= alignedLength_);
  double blendedDelay = 0.0;
  std::array<std::span<const float>, 3> from;
  for (std::size_t corner = 0; corner < 3; ++corner) {
    from[corner] = aligned(where.index[corner], ear);
    blendedDelay += where.weight[corner] * delay(where.index[corner], ear);
  }
  for (std::size_t sample = 0; sample < alignedLength_; ++sample)
    response[sample] = where.weight[0] * static_cast<double>(from[0][sample]) +
                       where.weight[1] * static_cast<double>(from[1][sample]) +
                       where.weight[2] * static_cast<double>(from[2][sample]);
  return blendedDelay;
}

void HrtfSet::blend(const SphereWeights& where, Ear ear,
                    std::span<double> response) const noexcept {
  assert(response.size() >= length_);
  const double samples = blendAligned(where, ear, response) * sampleRate_;
  const double whole = std::floor(samples);
  std::array<double, kBlendTaps> taps;
  for (std::size_t tap = 0; tap < kBlendTaps; ++tap)
    taps[tap] = kernel_(static_cast<double>(kBlendHalfWidth) - static_cast<double>(tap) -
                        (samples - whole));
  // The aligned response is first moved half a kernel later than it belongs, so that each sample
  // written is one that is not read again.
  const std::size_t start = static_cast<std::size_t>(whole) + kBlendHalfWidth;
  const auto begin = response.begin();
  const auto end = begin + static_cast<std::ptrdiff_t>(alignedLength_);
  std::copy_backward(begin, end, end + static_cast<std::ptrdiff_t>(start));
  std::fill_n(begin, start, 0.0);
  std::fill(end + static_cast<std::ptrdiff_t>(start), response.end(), 0.0);
  for (std::size_t sample = 0; sample < length_; ++sample) {
    const std::size_t count = std::min(kBlendTaps, length_ - sample);
    double sum = 0.0;
    for (std::size_t tap = 0; tap < count; ++tap)
      sum += taps[tap] * response[sample + tap];
    response[sample] = sum;
  }
}

static Result<std::shared_ptr<const HrtfSet>> loadShared(const std::filesystem::path& path,
                                                         double sampleRate) {
  Result<HrtfSet> loaded = HrtfSet::load(path, sampleRate);
  if (!loaded) return loaded.error();
  return std::make_shared<const HrtfSet>(*std::move(loaded));
}

Result<std::shared_ptr<const HrtfSet>> defaultHrtf(double sampleRate) {
  // This cache is the only state shared in this layer; only time and memory depend on it.
  static Mutex mutex;
  static auto& cache =
      audio::immortal([] { return std::map<double, std::weak_ptr<const HrtfSet>>(); });
  const MutexLock lock(mutex);
  if (!isSampleRate(sampleRate)) return HrtfSet::load({}, sampleRate).error();
  if (std::shared_ptr<const HrtfSet> set = cache[sampleRate].lock()) return set;
  Result<std::shared_ptr<const HrtfSet>> set = loadShared({}, sampleRate);
  if (set) cache[sampleRate] = *set;
  return set;
}

Result<std::shared_ptr<const HrtfSet>> loadHrtf(const std::filesystem::path& path,
                                                double sampleRate) {
  return path.empty() ? defaultHrtf(sampleRate) : loadShared(path, sampleRate);
}

}  // namespace carom
