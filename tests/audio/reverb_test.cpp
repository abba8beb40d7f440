#include "audio/propagation/reverb.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <numbers>
#include <numeric>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "audio/dsp/decay_filter.h"
#include "tests/support/constants.h"
#include "tests/support/no_alloc_scope.h"
#include "tests/support/random.h"

namespace carom {

using namespace audio;

namespace {

using namespace test;

using test::NoAllocScope;
using Signal = std::vector<double>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

DecayTimes allBands(double time) {
  DecayTimes times;
  times.fill(time);
  return times;
}

ReverbSettings livingRoom() {
  ReverbSettings settings;
  settings.volume = 60.0;
  settings.surface = 94.0;
  settings.decayTimes = {0.60, 0.55, 0.50, 0.45, 0.42, 0.38, 0.32};
  return settings;
}

ReverbSettings hall() {
  ReverbSettings settings;
  settings.volume = 12000.0;
  settings.surface = 3600.0;
  settings.decayTimes = {2.4, 2.2, 2.0, 1.9, 1.7, 1.3, 0.8};
  return settings;
}

ReverbSettings tiledRoom() {
  ReverbSettings settings;
  settings.volume = 20.0;
  settings.surface = 46.0;
  settings.decayTimes = {1.0, 1.2, 1.5, 1.8, 1.7, 1.4, 1.0};
  return settings;
}

Reverb makeReverb(const ReverbSettings& settings, std::size_t channels = 1, double rate = kRate) {
  Result<Reverb> reverb = Reverb::create(settings, rate, channels);
  EXPECT_TRUE(reverb) << (reverb ? "" : reverb.error().message);
  return *std::move(reverb);
}

/// Returns the output of each channel for `in`, processed in blocks of `block` samples.
std::vector<Signal> run(Reverb& reverb, const Signal& in, std::size_t block = 512) {
  std::vector<Signal> out(reverb.channels(), Signal(in.size(), 0.0));
  for (std::size_t begin = 0; begin < in.size(); begin += block) {
    const std::size_t count = std::min(block, in.size() - begin);
    std::vector<double*> pointers;
    pointers.reserve(out.size());
    for (Signal& channel : out)
      pointers.push_back(channel.data() + begin);
    reverb.process(std::span(in).subspan(begin, count), pointers);
  }
  return out;
}

Signal impulse(double seconds, double rate = kRate) {
  Signal in(static_cast<std::size_t>(seconds * rate), 0.0);
  in[0] = 1.0;
  return in;
}

double energy(const Signal& signal) {
  double sum = 0.0;
  for (const double value : signal)
    sum += value * value;
  return sum;
}

// --- Decay per band: band-pass, Schroeder's backward integral, line from -5 to -35 dB --------

/// Filters by three second-order band-passes in a row (bilinear, unit gain at the centre), each
/// with `quality`, the centre over the bandwidth.
Signal bandOf(Signal signal, double centre, double quality, double rate) {
  const double omega = 2.0 * std::numbers::pi * centre / rate;
  const double alpha = std::sin(omega) / (2.0 * quality);
  for (int pass = 0; pass < 3; ++pass) {
    double x1 = 0.0, x2 = 0.0, y1 = 0.0, y2 = 0.0;
    for (double& value : signal) {
      const double out =
          (alpha * (value - x2) + 2.0 * std::cos(omega) * y1 - (1.0 - alpha) * y2) / (1.0 + alpha);
      x2 = x1;
      x1 = value;
      y2 = y1;
      y1 = out;
      value = out;
    }
  }
  return signal;
}

/// Decay time in s: T30 (ISO 3382-1), by least squares.
double measuredDecay(const Signal& signal, double rate) {
  Signal remaining(signal.size());
  double sum = 0.0;
  for (std::size_t sample = signal.size(); sample-- > 0;) {
    sum += signal[sample] * signal[sample];
    remaining[sample] = sum;
  }
  double n = 0.0, t = 0.0, l = 0.0, tt = 0.0, tl = 0.0;
  for (std::size_t sample = 0; sample < signal.size(); ++sample) {
    const double level = 10.0 * std::log10(remaining[sample] / sum);
    if (level > -5.0 || level < -35.0) continue;
    const double time = static_cast<double>(sample) / rate;
    n += 1.0;
    t += time;
    l += level;
    tt += time * time;
    tl += time * level;
  }
  return -60.0 * (n * tt - t * t) / (n * tl - t * l);
}

struct DecayCase {
  std::string name;
  ReverbSettings settings;
  double rate;
};

std::vector<DecayCase> decayCases() {
  ReverbSettings flat = livingRoom();
  flat.decayTimes = allBands(1.0);
  return {{"flat", flat, kRate},
          {"living room", livingRoom(), kRate},
          {"hall", hall(), kRate},
          {"tiled room", tiledRoom(), kRate},
          {"hall at 96 kHz", hall(), 96000.0}};
}

/// Returns the largest relative error over the bands, of the mean of four channels; records the
/// errors in percent.
double largestDecayError(const DecayCase& which, double quality) {
  const ReverbSettings& settings = which.settings;
  Reverb reverb = makeReverb(settings, 4, which.rate);
  const double longest = std::ranges::max(settings.decayTimes);
  const auto out = run(reverb, impulse(1.2 * longest, which.rate));
  double largest = 0.0;
  for (std::size_t band = 0; band < kBandCount; ++band) {
    double mean = 0.0;
    for (const Signal& channel : out) {
      const Signal part = bandOf(channel, kOctaveBands[band], quality, which.rate);
      mean += 0.25 * measuredDecay(part, which.rate);
    }
    const double error = mean / settings.decayTimes[band] - 1.0;
    testing::Test::RecordProperty(
        which.name + " " + std::to_string(static_cast<int>(kOctaveBands[band])),
        std::to_string(100.0 * error));
    largest = std::max(largest, std::abs(error));
  }
  return largest;
}

TEST(Reverb, DecaysAtTheBandsCentresInTheTimeThatWasAskedFor) {
  for (const DecayCase& which : decayCases()) {
    EXPECT_LT(largestDecayError(which, 4.0), 0.05) << which.name;
  }
}

/// Where the times fall steeply within an octave, its slower edge and the neighbour that leaks
/// through the filter's skirts decay more slowly than its centre, as in a real room.
TEST(Reverb, DecaysInWholeOctavesInTheTimeThatWasAskedFor) {
  for (const DecayCase& which : decayCases()) {
    EXPECT_LT(largestDecayError(which, 1.2), 0.10) << which.name;
  }
}

/// The decay is computed from the filters alone, without the scatter of one impulse response.
TEST(Reverb, FiltersMeetTheDecayAtTheBandsCentres) {
  for (const ReverbSettings& settings : {livingRoom(), hall(), tiledRoom()}) {
    for (const double rate : {8000.0, 44100.0, 192000.0}) {
      const Reverb reverb = makeReverb(settings, 1, rate);
      for (std::size_t band = 0; band < kBandCount && kOctaveBands[band] < 0.45 * rate; ++band) {
        EXPECT_NEAR(reverb.decayTime(kOctaveBands[band]) / settings.decayTimes[band], 1.0, 0.002)
            << kOctaveBands[band] << " Hz at " << rate;
      }
    }
  }
}

TEST(DecayCascade, NeverAmplifiesWhateverIsAsked) {
  Random random(1);
  for (int trial = 0; trial < 300; ++trial) {
    DecayTimes times;
    for (double& time : times)
      time = random.logBetween(0.05, 50.0);
    const double rate = trial % 2 ? 48000.0 : 8000.0;
    const double samples = random.logBetween(17.0, 20000.0);
    const auto cascade = decayCascade(samples, times, rate);
    for (int point = 0; point <= 300; ++point) {
      const double frequency = 1.0 + (0.5 * rate - 1.0) * point / 300.0;
      double gain = 1.0;
      for (const ReflectionFilter& filter : cascade) {
        EXPECT_LT(std::abs(filter.a1), 1.0);
        gain *= std::abs(frequencyResponse(filter, frequency, rate));
      }
      ASSERT_LE(gain, 1.0) << frequency;
    }
  }
}

TEST(Reverb, WithoutDecayConservesTheEnergyThatItHolds) {
  ReverbSettings settings = livingRoom();
  settings.decayTimes = allBands(kInfinity);
  Reverb reverb = makeReverb(settings);
  run(reverb, impulse(0.1));
  const double before = reverb.storedEnergy();
  run(reverb, Signal(100000, 0.0));
  EXPECT_NEAR(before, 1.0, 1e-12);  // the input's own energy
  EXPECT_NEAR(reverb.storedEnergy(), before, 1e-11);
  EXPECT_EQ(reverb.decayTime(1000.0), kInfinity);
}

/// Barron & Lee 1988: reflected over direct energy at 10 m is 31200 T / V exp(-0.04 r / T); at r =
/// 0 and for a direct sound at 1 m, 312 T / V. The energy before the onset is missing.
TEST(Reverb, HasTheEnergyOfTheDiffuseField) {
  for (const double onset : {0.0, 0.02, 0.06}) {
    for (ReverbSettings settings : {livingRoom(), hall(), tiledRoom()}) {
      settings.onset = onset;
      settings.decayTimes = allBands(settings.volume > 1000.0 ? 2.0 : 0.7);
      const double decay = settings.decayTimes[0];
      Reverb reverb = makeReverb(settings, 16);
      const auto out = run(reverb, impulse(1.5 * decay));
      double mean = 0.0;
      for (const Signal& channel : out)
        mean += energy(channel) / 16.0;
      // Without an onset the tail begins after its shortest lines, about half a mean free time.
      const double freeTime = 4.0 * settings.volume / (settings.surface * 343.0);
      const double begin = std::max(onset, 0.45 * freeTime);
      const double expected = 312.0 * decay / settings.volume * std::exp(-13.8155 * begin / decay);
      EXPECT_NEAR(10.0 * std::log10(mean / expected), 0.0, 0.5) << settings.volume << ' ' << onset;
    }
  }
}

/// The tail is silent before the onset less the spread of the lines; the mean free path takes 17 ms
/// here.
TEST(Reverb, BeginsAboutItsOnset) {
  ReverbSettings settings = livingRoom();
  settings.onset = onsetAfter(3, settings.volume, settings.surface, 343.0);
  const Signal out = run(*std::make_unique<Reverb>(makeReverb(settings)), impulse(0.2))[0];
  const auto first = std::ranges::find_if(out, [](double value) { return value != 0.0; });
  const double start = static_cast<double>(first - out.begin()) / kRate;
  const double freeTime = 4.0 * 60.0 / (94.0 * 343.0);
  EXPECT_NEAR(settings.onset, 4.0 * freeTime, 1e-12);
  EXPECT_GT(start, settings.onset);
  EXPECT_LT(start, settings.onset + 0.3 * freeTime);
}

/// Share of samples beyond one standard deviation, relative to that of noise, erfc(1/sqrt(2)): Abel
/// & Huang 2006; it is 1 when the echoes can no longer be told apart.
double echoDensity(const Signal& signal, std::size_t begin, std::size_t count) {
  double sum = 0.0;
  for (std::size_t sample = begin; sample < begin + count; ++sample) {
    sum += signal[sample] * signal[sample];
  }
  const double deviation = std::sqrt(sum / static_cast<double>(count));
  double beyond = 0.0;
  for (std::size_t sample = begin; sample < begin + count; ++sample) {
    beyond += std::abs(signal[sample]) > deviation ? 1.0 : 0.0;
  }
  return beyond / static_cast<double>(count) / std::erfc(1.0 / std::numbers::sqrt2);
}

TEST(Reverb, EchoesBecomeDenserUntilTheyAreNoise) {
  for (const ReverbSettings& settings : {livingRoom(), hall()}) {
    Reverb reverb = makeReverb(settings);
    const Signal out = run(reverb, impulse(1.0))[0];
    const auto& lengths = reverb.lengths();
    const auto window = static_cast<std::size_t>(0.02 * kRate);
    const double early = echoDensity(out, lengths.front(), window);
    const double middle = echoDensity(out, std::size_t{2} * lengths.front(), window);
    const double late = echoDensity(out, std::size_t{3} * lengths.back(), window);
    EXPECT_LT(early, middle);
    EXPECT_LT(middle, late);
    EXPECT_NEAR(late, 1.0, 0.2);
  }
}

TEST(Reverb, IsTheSameHoweverItIsCutIntoBlocks) {
  Random random(2);
  Signal in(30000, 0.0);
  for (std::size_t sample = 0; sample < 9000; ++sample)
    in[sample] = random.between(-1.0, 1.0);
  ReverbSettings settings = livingRoom();
  settings.onset = 0.02;
  settings.silence = 1e-3;  // so that it ends within the run
  settings.decayTimes = allBands(0.1);
  Reverb whole = makeReverb(settings, 3);
  const auto expected = run(whole, in, in.size());
  EXPECT_TRUE(whole.isSilent());
  for (const std::size_t block : {1u, 7u, 64u, 4801u}) {
    Reverb cut = makeReverb(settings, 3);
    const auto out = run(cut, in, block);
    for (std::size_t channel = 0; channel < 3; ++channel) {
      for (std::size_t sample = 0; sample < in.size(); ++sample) {
        ASSERT_EQ(std::bit_cast<std::uint64_t>(out[channel][sample]),
                  std::bit_cast<std::uint64_t>(expected[channel][sample]));
      }
    }
  }
}

// A microphone's pattern (1 - p) + p cos, squared, in the mean over a sphere, of which rings of
// equal width in cos have equal parts.
TEST(Reverb, AMicrophoneHearsItsMeanOverAllDirections) {
  Reverb reverb = makeReverb(livingRoom(), 3);
  const std::array<double, 3> patterns = {0.0, 0.5, 1.0};
  for (std::size_t channel = 0; channel < patterns.size(); ++channel)
    reverb.setPattern(channel, patterns[channel]);
  Reverb same = makeReverb(livingRoom(), 3);
  const auto heard = run(reverb, impulse(0.5));
  const auto all = run(same, impulse(0.5));
  for (std::size_t channel = 0; channel < patterns.size(); ++channel) {
    double mean = 0.0;
    constexpr int kRings = 1000;
    for (int ring = 0; ring < kRings; ++ring) {
      const double cosine = -1.0 + (2.0 * ring + 1.0) / kRings;
      mean += std::pow(1.0 - patterns[channel] + patterns[channel] * cosine, 2.0) / kRings;
    }
    EXPECT_NEAR(energy(heard[channel]) / energy(all[channel]), mean, 1e-5) << patterns[channel];
  }
}

TEST(Reverb, AddsToWhatIsThere) {
  Reverb one = makeReverb(livingRoom());
  Reverb two = makeReverb(livingRoom());
  const Signal in = impulse(0.1);
  const Signal alone = run(one, in)[0];
  Signal sum(in.size(), 0.5);
  double* const pointer = sum.data();
  two.process(in, std::span(&pointer, 1));
  for (std::size_t sample = 0; sample < in.size(); ++sample) {
    ASSERT_EQ(sum[sample], 0.5 + alone[sample]);
  }
}

TEST(Reverb, StaysWithinBoundsForAMinuteOfNoiseAndThenDies) {
  Random random(3);
  Reverb reverb = makeReverb(tiledRoom(), 2, 16000.0);
  Signal second(16000);
  double loudest = 0.0;
  for (int count = 0; count < 60; ++count) {
    for (double& value : second)
      value = random.between(-1.0, 1.0);
    for (const Signal& channel : run(reverb, second)) {
      for (const double value : channel)
        loudest = std::max(loudest, std::abs(value));
    }
  }
  // The bound is the diffuse field's gain, 312 T / V of the energy, times noise of 1/3, at six
  // deviations.
  EXPECT_LT(loudest, 6.0 * std::sqrt(312.0 * 1.8 / 20.0 / 3.0));
  EXPECT_GT(loudest, 1.0);
  EXPECT_TRUE(reverb.validate());
  std::fill(second.begin(), second.end(), 0.0);
  for (int count = 0; count < 10; ++count)
    run(reverb, second);
  EXPECT_TRUE(reverb.isSilent());
}

TEST(Reverb, ChannelsAreDecorrelated) {
  for (const ReverbSettings& settings : {livingRoom(), hall()}) {
    Reverb reverb = makeReverb(settings, 16);
    const auto out = run(reverb, impulse(1.0));
    double largest = 0.0;
    for (std::size_t one = 0; one < out.size(); ++one) {
      for (std::size_t other = 0; other < one; ++other) {
        double product = 0.0;
        for (std::size_t sample = 0; sample < out[one].size(); ++sample) {
          product += out[one][sample] * out[other][sample];
        }
        largest =
            std::max(largest, std::abs(product) / std::sqrt(energy(out[one]) * energy(out[other])));
      }
    }
    RecordProperty("largest correlation " + std::to_string(static_cast<int>(settings.volume)),
                   std::to_string(largest));
    EXPECT_LT(largest, 0.3);
  }
}

TEST(Reverb, GivesSilenceForSilence) {
  Reverb reverb = makeReverb(livingRoom(), 2);
  EXPECT_TRUE(reverb.isSilent());
  for (const Signal& channel : run(reverb, Signal(10000, 0.0)))
    EXPECT_EQ(energy(channel), 0.0);
  EXPECT_TRUE(reverb.isSilent());
  EXPECT_TRUE(reverb.validate());
}

/// The tail is cut off below the level that was set, and the next input finds the reverberation
/// empty.
TEST(Reverb, IsSilentOnceNothingCanBeHeardAndThenStartsAfresh) {
  ReverbSettings settings = livingRoom();
  settings.onset = 0.03;
  Reverb reverb = makeReverb(settings);
  const Signal in = impulse(2.0);
  const Signal first = run(reverb, in)[0];
  EXPECT_TRUE(reverb.isSilent());
  const auto last = std::find_if(first.rbegin(), first.rend(), [](double v) { return v != 0.0; });
  for (auto at = last; at < last + 400; ++at)
    EXPECT_LT(std::abs(*at), settings.silence);
  EXPECT_EQ(run(reverb, in)[0], first);
  reverb.process(std::span(in).first(100), std::array<double*, 1>{Signal(100).data()});
  EXPECT_FALSE(reverb.isSilent());
  reverb.reset();
  EXPECT_TRUE(reverb.isSilent());
  EXPECT_EQ(run(reverb, in)[0], first);
}

/// An input that the onset delays is not forgotten while the lines are still empty.
TEST(Reverb, IsNotSilentWhileTheOnsetHoldsTheInput) {
  ReverbSettings settings = livingRoom();
  settings.onset = 0.5;
  Reverb reverb = makeReverb(settings);
  run(reverb, impulse(0.4));
  EXPECT_FALSE(reverb.isSilent());
  EXPECT_GT(energy(run(reverb, Signal(48000, 0.0))[0]), 0.0);
}

TEST(Reverb, HoldsNothingSubnormalWhileItDies) {
  ReverbSettings settings = livingRoom();
  settings.silence = 1e-15;
  settings.onset = 0.01;
  settings.decayTimes = allBands(0.05);
  Reverb reverb = makeReverb(settings);
  run(reverb, impulse(0.001));
  for (int block = 0; block < 400; ++block) {
    const Signal zeros(97, 0.0);
    const Signal out = run(reverb, zeros)[0];
    ASSERT_TRUE(reverb.validate());
    for (const double value : out)
      ASSERT_TRUE(value == 0.0 || std::isnormal(value));
  }
}

/// The input filters are idle for seconds while the lines still sound.
TEST(Reverb, HoldsNothingSubnormalAfterItsOnset) {
  ReverbSettings settings = hall();
  settings.onset = 0.2;
  Reverb reverb = makeReverb(settings);
  run(reverb, impulse(0.001));
  for (int block = 0; block < 150; ++block) {
    run(reverb, Signal(1000, 0.0));
    ASSERT_TRUE(reverb.validate());
  }
  EXPECT_FALSE(reverb.isSilent());
}

/// A line receives a quarter of the input, so that the threshold for the input is four times the
/// lines'.
TEST(Reverb, DropsWhatIsBelowTheSmallestPressure) {
  for (const double pressure : {5e-324, 1e-310, 0.9e-30, 3.9e-30, 4.1e-30}) {
    Reverb reverb = makeReverb(livingRoom());
    Signal in = impulse(0.001);
    in[0] = pressure;
    run(reverb, in);
    EXPECT_EQ(reverb.storedEnergy() > 0.0, pressure > 4e-30) << pressure;
    EXPECT_EQ(reverb.isSilent(), pressure < 1e-30) << pressure;
  }
}

TEST(Reverb, SurvivesAnInputThatIsNoNumber) {
  Reverb reverb = makeReverb(livingRoom());
  Reverb clean = makeReverb(livingRoom());
  Signal in = impulse(0.2);
  const Signal expected = run(clean, in)[0];
  in[7] = kNaN;
  in[8] = kInfinity;
  EXPECT_EQ(run(reverb, in)[0], expected);
  EXPECT_TRUE(reverb.validate());
  in[9] = 1e300;
  run(reverb, in);
  EXPECT_TRUE(reverb.validate());
}

TEST(Reverb, DoesNotAllocateWhileItRuns) {
  Reverb reverb = makeReverb(livingRoom());
  const Signal in = impulse(1.0);
  Signal out(in.size(), 0.0);
  double* const pointer = out.data();
  const NoAllocScope scope;
  reverb.process(in, std::span(&pointer, 1));
  reverb.reset();
  EXPECT_EQ(scope.allocations(), 0u);
}

TEST(Reverb, LinesHaveNoCommonFactor) {
  for (const double rate : {8000.0, 48000.0}) {
    for (const ReverbSettings& settings : {livingRoom(), hall(), tiledRoom()}) {
      const Reverb reverb = makeReverb(settings, 1, rate);
      const auto& lengths = reverb.lengths();
      for (std::size_t line = 0; line < lengths.size(); ++line) {
        for (std::size_t other = 0; other < line; ++other) {
          EXPECT_EQ(std::gcd(lengths[line], lengths[other]), 1u);
        }
      }
    }
  }
}

TEST(Reverb, RefusesWhatNoRoomHas) {
  const auto refused = [](auto change) {
    ReverbSettings settings = livingRoom();
    change(settings);
    return !Reverb::create(settings, kRate, 1);
  };
  EXPECT_FALSE(refused([](ReverbSettings&) {}));
  EXPECT_TRUE(refused([](ReverbSettings& s) { s.volume = 0.0; }));
  EXPECT_TRUE(refused([](ReverbSettings& s) { s.volume = kNaN; }));
  EXPECT_TRUE(refused([](ReverbSettings& s) { s.surface = 50.0; }));  // less than a sphere's
  EXPECT_TRUE(refused([](ReverbSettings& s) { s.decayTimes[3] = 0.0; }));
  EXPECT_TRUE(refused([](ReverbSettings& s) { s.decayTimes[3] = kNaN; }));
  EXPECT_TRUE(refused([](ReverbSettings& s) { s.decayTimes[3] = kInfinity; }));
  EXPECT_TRUE(refused([](ReverbSettings& s) { s.onset = -0.1; }));
  EXPECT_TRUE(refused([](ReverbSettings& s) { s.gain = kNaN; }));
  EXPECT_TRUE(refused([](ReverbSettings& s) { s.speedOfSound = 0.0; }));
  EXPECT_TRUE(refused([](ReverbSettings& s) { s.silence = 0.0; }));
  EXPECT_FALSE(Reverb::create(livingRoom(), 7999.0, 1));
  EXPECT_FALSE(Reverb::create(livingRoom(), kNaN, 1));
  EXPECT_FALSE(Reverb::create(livingRoom(), kRate, 0));
  EXPECT_FALSE(Reverb::create(livingRoom(), kRate, 17));
}

// --- From a room -------------------------------------------------------------------------------

/// By hand: V = 30 m^3, S = 59 m^2, alpha = 0.2, c = 343 m/s give A = 11.8 m^2 and the time 0.1611
/// V / A.
TEST(DecayTimes, OfSabineAndEyringAreTheTextbooks) {
  RoomMeasures room{30.0, 59.0, {}};
  room.meanAbsorption.coefficients = {0.2, 0.0, 1.0, 0.2, 0.2, 0.2, 0.2};
  EXPECT_NEAR(sabineDecayTimes(room, 343.0)[0], 0.1611 * 30.0 / 11.8, 1e-3);
  EXPECT_NEAR(eyringDecayTimes(room, 343.0)[0], 0.1611 * 30.0 / (59.0 * 0.22314), 1e-3);
  EXPECT_EQ(sabineDecayTimes(room, 343.0)[1], kInfinity);
  EXPECT_EQ(eyringDecayTimes(room, 343.0)[2], 0.0);
  EXPECT_NEAR(sabineDecayTimes(room, 343.0, {0, 0, 0, 0, 0, 0, 0.01})[6],
              0.1611 * 30.0 / (11.8 + 1.2), 1e-3);
}

Room box(double alpha) {
  Room room;
  for (int axis = 0; axis < 3; ++axis) {
    Reflector low{Vec3::Unit(axis), 0.0, {}};
    low.absorption.coefficients.fill(alpha);
    Reflector high = low;
    high.normal = -low.normal;
    high.offset = -4.0;
    room.reflectors.push_back(low);
    room.reflectors.push_back(high);
  }
  return room;
}

TEST(Reverb, OfABoxHasItsMeasuresAndEyringsTimes) {
  const Result<ReverbSettings> settings = reverbOfBox(box(0.3), 343.0);
  ASSERT_TRUE(settings);
  EXPECT_NEAR(settings->volume, 64.0, 1e-12);
  EXPECT_NEAR(settings->surface, 96.0, 1e-12);
  EXPECT_NEAR(settings->decayTimes[3], 0.1611 * 64.0 / (96.0 * 0.35667), 1e-3);
  EXPECT_NEAR(settings->onset, 2.0 * 4.0 * 64.0 / 96.0 / 343.0, 1e-12);
  EXPECT_TRUE(Reverb::create(*settings, kRate, 2));
  EXPECT_FALSE(reverbOfBox(box(0.0), 343.0));
  Room open = box(0.3);
  open.reflectors.pop_back();
  EXPECT_FALSE(reverbOfBox(open, 343.0));
}

}  // namespace
}  // namespace carom
