#include "carom/audio/limiter.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/no_alloc_scope.h"

namespace carom {
namespace {

using Channels = std::vector<std::vector<float>>;

Limiter made(const LimiterSettings& settings) {
  Result<Limiter> limiter = Limiter::create(settings);
  EXPECT_TRUE(limiter) << (limiter ? "" : limiter.error().message);
  return *std::move(limiter);
}

/// Returns the output of the limiter, fed in blocks, with zeros after the input until all of it has
/// come out.
Channels limited(Limiter& limiter, Channels channels, std::size_t block = 256) {
  for (std::vector<float>& channel : channels)
    channel.resize(channel.size() + limiter.latency());
  const std::size_t frames = channels.front().size();
  for (std::size_t begin = 0; begin < frames; begin += block) {
    std::vector<float*> pointers;
    for (std::vector<float>& channel : channels)
      pointers.push_back(channel.data() + begin);
    limiter.process(pointers, std::min(block, frames - begin));
  }
  for (std::vector<float>& channel : channels)
    channel.erase(channel.begin(),
                  channel.begin() + static_cast<std::ptrdiff_t>(limiter.latency()));
  return channels;
}

std::vector<float> noise(std::size_t frames, float level, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<float> samples(frames);
  for (float& sample : samples)
    sample = level * (static_cast<float>(random()) / 2147483648.0F - 1.0F);
  return samples;
}

/// Quiet noise with clicks of a few samples, 0 to 40 dB above 1, at random places.
std::vector<float> clicks(std::size_t frames, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<float> samples = noise(frames, 0.3F, seed + 1);
  for (std::size_t click = 0; click < frames / 997; ++click) {
    const std::size_t place = random() % (frames - 8);
    const double level = std::pow(10.0, 2.0 * static_cast<double>(random()) / 4294967296.0);
    for (std::size_t sample = 0; sample < 8; ++sample)
      samples[place + sample] +=
          static_cast<float>(level * std::sin(0.9 * static_cast<double>(sample)));
  }
  return samples;
}

float peakOf(const std::vector<float>& samples) {
  float peak = 0.0F;
  for (const float sample : samples)
    peak = std::max(peak, std::abs(sample));
  return peak;
}

TEST(Limiter, WhatStaysBelowTheCeilingPassesBitForBit) {
  for (const std::size_t count : {1U, 2U, 7U}) {
    Channels channels;
    for (std::size_t channel = 0; channel < count; ++channel) {
      channels.push_back(noise(20'000, 1.0F, static_cast<unsigned>(channel)));
      channels.back()[500 * channel + 17] = 1.0F;  // the ceiling itself, which must pass too
      channels.back()[500 * channel + 18] = -1.0F;
      channels.back()[500 * channel + 19] = 1e-30F;
    }
    Limiter limiter = made({.channels = count});
    EXPECT_EQ(limiter.latency(), 95u);  // 2 ms at 48 kHz, including the sample itself
    EXPECT_EQ(limited(limiter, channels), channels);
    EXPECT_EQ(limiter.leastGain(), 1.0);
    EXPECT_EQ(limiter.largestReduction(), 0.0);
  }
}

TEST(Limiter, NothingExceedsTheCeiling) {
  for (const float ceiling : {1.0F, 0.891251F, 20.0F}) {
    for (const double lookAhead : {1e-4, 0.002, 0.02}) {
      LimiterSettings settings{.channels = 3, .ceiling = ceiling};
      settings.lookAhead = lookAhead;
      Limiter limiter = made(settings);
      Channels channels = {clicks(40'000, 1), noise(40'000, 50.0F, 2), clicks(40'000, 3)};
      channels[2][7] = std::numeric_limits<float>::max();
      channels[2][20'000] = -1e9F;
      for (const std::vector<float>& channel : limited(limiter, channels))
        EXPECT_LE(peakOf(channel), ceiling);
    }
  }
}

TEST(Limiter, IsWhatTheSlowAndObviousOneIs) {
  // The limiter by its definition: only the release is kept from frame to frame.
  const LimiterSettings settings{.sampleRate = 44100.0, .channels = 2, .release = 0.01};
  const Channels channels = {clicks(30'000, 5), clicks(30'000, 6)};
  Limiter limiter = made(settings);
  const Channels fast = limited(limiter, channels);
  const std::ptrdiff_t window = std::lround(0.002 * 44100.0);
  ASSERT_EQ(limiter.latency(), static_cast<std::size_t>(window - 1));
  const auto frames = static_cast<std::ptrdiff_t>(channels[0].size());
  const auto wanted = [&](std::ptrdiff_t frame) {
    if (frame < 0 || frame >= frames) return 1.0;
    const auto at = static_cast<std::size_t>(frame);
    const float loudest = std::max(std::abs(channels[0][at]), std::abs(channels[1][at]));
    return std::min(1.0, 1.0 / static_cast<double>(loudest));
  };
  std::vector<double> released;  // gain from frame -window on
  double gain = 1.0;
  for (std::ptrdiff_t frame = -window; frame < frames + window; ++frame) {
    gain += (1.0 - gain) * -std::expm1(-1.0 / (0.01 * 44100.0));
    for (std::ptrdiff_t back = 0; back < window; ++back)
      gain = std::min(gain, wanted(frame - back));
    released.push_back(gain);
  }
  const std::ptrdiff_t early = window / 2;
  double largest = 0.0;
  for (std::ptrdiff_t frame = 0; frame < frames; ++frame) {
    double sum = 0.0;
    for (std::ptrdiff_t first = 0; first < early; ++first) {
      for (std::ptrdiff_t second = 0; second <= window - early; ++second)
        sum += released[static_cast<std::size_t>(frame + 2 * window - 1 - first - second)];
    }
    const double mean = sum / static_cast<double>(early * (window - early + 1));
    for (std::size_t channel = 0; channel < 2; ++channel) {
      const auto at = static_cast<std::size_t>(frame);
      largest = std::max(largest, std::abs(static_cast<double>(fast[channel][at]) -
                                           mean * static_cast<double>(channels[channel][at])));
    }
  }
  EXPECT_LT(largest, 1e-6);
}

TEST(Limiter, TurnsDownSmoothlyJustInTimeAndAllChannelsTogether) {
  // A second channel that is small and constant shows the gain.
  Channels channels(2, std::vector<float>(60'000, 0.0F));
  std::ranges::fill(channels[1], 0.5F);
  channels[0][10'000] = 4.0F;
  Limiter limiter = made({.channels = 2});
  const Channels out = limited(limiter, channels);
  EXPECT_NEAR(out[0][10'000], 1.0F, 1e-6F);
  EXPECT_NEAR(out[1][10'000], 0.125F, 1e-6F);
  EXPECT_NEAR(limiter.largestReduction(), 20.0 * std::log10(4.0), 1e-6);
  for (std::size_t frame = 1; frame < 60'000; ++frame) {
    const float change = out[1][frame] - out[1][frame - 1];
    if (frame <= 10'000)
      EXPECT_LE(change, 0.0F) << frame;
    else
      EXPECT_GE(change, 0.0F) << frame;
    EXPECT_LE(std::abs(change), 0.5F * 0.75F * 2.1F / 96.0F) << frame;  // the height of a triangle
  }
  EXPECT_EQ(out[1][10'000 - 96], 0.5F);      // untouched until the look-ahead
  EXPECT_EQ(out[1][10'000 + 41'000], 0.5F);  // and again after 17 times 50 ms
}

TEST(Limiter, ReleaseIsExponentialWithItsTime) {
  Channels channels(2, std::vector<float>(20'000, 0.0F));
  std::ranges::fill(channels[1], 0.5F);
  channels[0][1000] = 2.0F;
  LimiterSettings settings{.channels = 2};
  settings.lookAhead = 1e-4;
  settings.release = 0.1;
  Limiter limiter = made(settings);
  const Channels out = limited(limiter, channels);
  for (const std::size_t after : {480U, 4800U, 9600U}) {
    const double expected = 0.5 * (1.0 - 0.5 * std::exp(-static_cast<double>(after) / 4800.0));
    EXPECT_NEAR(out[1][1000 + after], expected, 2e-3 * expected);
  }
}

TEST(Limiter, SizesOfBlocksDoNotMatterByOneBit) {
  const Channels channels = {clicks(30'000, 8), clicks(30'000, 9)};
  Limiter whole = made({.channels = 2});
  const Channels expected = limited(whole, channels, 1'000'000);
  for (const std::size_t block : {1U, 7U, 64U, 95U, 96U, 4096U}) {
    Limiter limiter = made({.channels = 2});
    EXPECT_EQ(limited(limiter, channels, block), expected) << block;
    EXPECT_EQ(limiter.leastGain(), whole.leastGain());
  }
}

TEST(Limiter, ResetForgetsAll) {
  Limiter limiter = made({.channels = 1});
  const Channels first = limited(limiter, {clicks(5000, 10)});
  EXPECT_LT(limiter.leastGain(), 1.0);
  limiter.reset();
  EXPECT_EQ(limiter.leastGain(), 1.0);
  EXPECT_EQ(limited(limiter, {clicks(5000, 10)}), first);
}

TEST(Limiter, ProcessDoesNotAllocate) {
  Limiter limiter = made({.channels = 2});
  std::vector<float> left = clicks(9600, 11);
  std::vector<float> right = clicks(9600, 12);
  float* const channels[] = {left.data(), right.data()};
  const test::NoAllocScope scope;
  limiter.process(channels, left.size());
  limiter.reset();
  EXPECT_EQ(scope.allocations(), 0u);
}

TEST(Limiter, SamplesThatAreNotFiniteCountAsSilence) {
  std::vector<float> bad(1000, 0.5F);
  bad[100] = std::numeric_limits<float>::quiet_NaN();
  bad[200] = -std::numeric_limits<float>::infinity();
  Limiter limiter = made({});
  const Channels out = limited(limiter, {bad});
  EXPECT_EQ(limiter.notFinite(), 2u);
  EXPECT_EQ(limiter.leastGain(), 1.0);
  for (std::size_t frame = 0; frame < bad.size(); ++frame)
    EXPECT_EQ(out[0][frame], frame == 100 || frame == 200 ? 0.0F : 0.5F);
}

TEST(Limiter, RefusesWhatItCannotDoAndSaysWhatItCan) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto message = [](const LimiterSettings& settings) {
    const Result<Limiter> limiter = Limiter::create(settings);
    return limiter ? std::string() : limiter.error().message;
  };
  EXPECT_NE(message({.sampleRate = 0.0}).find("sample rate 0 Hz"), std::string::npos);
  EXPECT_NE(message({.sampleRate = nan}).find("up to 1e6 Hz"), std::string::npos);
  EXPECT_NE(message({.channels = 0}).find("1 to 1024"), std::string::npos);
  EXPECT_NE(message({.ceiling = 0.0F}).find("above 0"), std::string::npos);
  EXPECT_NE(message({.ceiling = static_cast<float>(nan)}).find("above 0"), std::string::npos);
  EXPECT_NE(message({.lookAhead = 0.05}).find("0.02 s"), std::string::npos);
  EXPECT_NE(message({.release = 0.0}).find("1e-3 to 10 s"), std::string::npos);
}

/// Returns by how many dB the band-limited signal through the samples exceeds 1: at 16 places in
/// each interval, by a sum of 64 windowed sincs.
double overshoot(const std::vector<float>& samples) {
  constexpr int kReach = 32;
  double peak = 1e-30;
  for (int frame = kReach; frame + kReach < static_cast<int>(samples.size()); ++frame) {
    if (std::abs(samples[static_cast<std::size_t>(frame)]) < 0.3F) continue;
    for (int place = 0; place < 16; ++place) {
      double value = 0.0;
      for (int tap = 1 - kReach; tap <= kReach; ++tap) {
        const double x = std::numbers::pi * (place / 16.0 - tap);
        const double window = 0.5 + 0.5 * std::cos(x / kReach);
        const double sinc = std::abs(x) < 1e-12 ? 1.0 : std::sin(x) / x;
        const int sample = frame + tap;
        value += window * sinc * static_cast<double>(samples[static_cast<std::size_t>(sample)]);
      }
      peak = std::max(peak, std::abs(value));
    }
  }
  return 20.0 * std::log10(peak);
}

/// One click after another at random phases, each the derivative of a Gaussian with the standard
/// deviation of a contact that lasts `tau` s, 12 dB above the ceiling.
std::vector<float> loudClicks(double tau, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<float> samples(48'000, 0.0F);
  for (std::size_t start = 1000; start + 1500 < samples.size(); start += 1500) {
    const double centre = static_cast<double>(start) + static_cast<double>(random()) / 4294967296.0;
    for (std::size_t frame = start - 500; frame < start + 500; ++frame) {
      const double u = (static_cast<double>(frame) - centre) / (48'000.0 * tau);
      samples[frame] =
          static_cast<float>(4.0 * std::sqrt(12.0 * std::numbers::e) * u * std::exp(-6.0 * u * u));
    }
  }
  return samples;
}

TEST(Limiter, TruePeakOvershootsByWhatTheContactsLengthLeaves) {
  const struct {
    double tau, most;  // s, dB
  } cases[] = {{50e-6, 1.3}, {100e-6, 0.7}, {200e-6, 0.1}, {1e-3, 0.01}};
  for (const auto& [tau, most] : cases) {
    Limiter limiter = made({});
    const Channels out = limited(limiter, {loudClicks(tau, 13)});
    EXPECT_LT(overshoot(out[0]), most) << tau;
  }
}

}  // namespace
}  // namespace carom
