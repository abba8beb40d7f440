#include "audio/dsp/resonator_kernels.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/random.h"

namespace carom {

using namespace audio;

namespace {

constexpr long double kTwoPi = 2.0L * std::numbers::pi_v<long double>;

/// One mode: amplitude exp(-decay t) cos(w t + phase), t in samples.
struct Tone {
  long double w = 0.0L;
  long double decay = 0.0L;
  long double amplitude = 0.0L;
  long double phase = 0.0L;

  long double at(long double t) const {
    return amplitude * std::exp(-decay * t) * std::cos(w * t + phase);
  }
};

/// A bank of resonators with the arrays that it borrows; its first sample is at t = 0.
class Bank {
 public:
  explicit Bank(const std::vector<Tone>& tones)
      : count_((tones.size() + kWidth - 1) / kWidth * kWidth), values_(6 * count_, 0.0) {
    for (std::size_t i = 0; i < tones.size(); ++i) {
      const Tone& tone = tones[i];
      // t counts samples, so that the sample rate is 1 Hz.
      const TwoPole pole =
          TwoPole::of(static_cast<double>(tone.w), static_cast<double>(tone.decay), 1.0);
      at(0, i) = pole.a1;
      at(1, i) = pole.a2;
      at(2, i) = static_cast<double>(tone.at(-1.0L));
      at(3, i) = static_cast<double>(tone.at(-2.0L));
    }
  }

  static constexpr std::size_t kWidth = ResonatorKernels::kWidth;
  Resonators view() {
    return {values_.data(), values_.data() + count_, values_.data() + 2 * count_,
            values_.data() + 3 * count_, count_};
  }
  ResonatorInput input(const std::vector<double>& x) {
    return {values_.data() + 4 * count_, values_.data() + 5 * count_, x.data() + 1};
  }
  double& y1(std::size_t i) { return at(2, i); }
  double& y2(std::size_t i) { return at(3, i); }
  double& b0(std::size_t i) { return at(4, i); }
  double& b1(std::size_t i) { return at(5, i); }
  const std::vector<double>& values() const { return values_; }
  std::size_t padded() const { return count_; }

 private:
  double& at(std::size_t array, std::size_t i) { return values_[array * count_ + i]; }

  std::size_t count_;
  std::vector<double> values_;
};

class ResonatorBank : public testing::TestWithParam<std::size_t> {
 protected:
  const ResonatorKernels& kernels() const { return allResonators()[GetParam()]; }
  Random& random() { return random_; }

  std::vector<Tone> tones(std::size_t count) {
    std::vector<Tone> made(count);
    for (Tone& tone : made)
      tone = {random_.logBetween(0.003, 3.0), random_.logBetween(1e-6, 1e-2),
              random_.between(0.1, 1.0), random_.between(-3.0, 3.0)};
    return made;
  }
  std::vector<double> noise(std::size_t count) {
    std::vector<double> values(count);
    for (double& value : values)
      value = random_.between(-1.0, 1.0);
    return values;
  }
  Bank drivenBank(std::size_t count) {
    Bank bank(tones(count));
    for (std::size_t i = 0; i < count; ++i) {
      bank.b0(i) = random_.between(-1.0, 1.0);
      bank.b1(i) = random_.between(-1.0, 1.0);
    }
    return bank;
  }

 private:
  Random random_{7};
};

constexpr std::size_t kCounts[] = {0, 1, 7, 8, 9, 16, 17, 24, 31, 40, 48, 56, 64, 65, 100};

TEST_P(ResonatorBank, RingsAsTheSumOfItsTones) {
  for (const std::size_t count : kCounts) {
    const std::vector<Tone> tones = this->tones(count);
    Bank bank(tones);
    std::vector<double> out = noise(301);
    const std::vector<double> before = out;
    kernels().ring(bank.view(), out);
    for (std::size_t n = 0; n < out.size(); ++n) {
      long double sum = before[n];
      for (const Tone& tone : tones)
        sum += tone.at(static_cast<long double>(n));
      ASSERT_NEAR(out[n], static_cast<double>(sum), 1e-11 * static_cast<double>(count))
          << count << " modes, sample " << n;
    }
    for (std::size_t i = count; i < bank.padded(); ++i)
      EXPECT_TRUE(bank.y1(i) == 0.0 && bank.y2(i) == 0.0) << "padding is silent";
  }
}

/// The oscillation of the rounded poles; the effect of rounding is tested with the pitch.
Tone toneOf(double a1, double a2) {
  const long double radius = std::sqrt(static_cast<long double>(-a2));
  return {.w = std::acos(a1 / (2.0L * radius)), .decay = -std::log(radius)};
}

/// Impulse response of the recursion, sample by sample.
std::vector<long double> responseOf(const Tone& tone, std::size_t samples) {
  std::vector<long double> response(samples);
  for (std::size_t n = 0; n < samples; ++n) {
    const auto time = static_cast<long double>(n);
    response[n] =
        std::exp(-tone.decay * time) * std::sin(tone.w * (time + 1.0L)) / std::sin(tone.w);
  }
  return response;
}

// The expected output sums the responses to each sample of input, in the closed form of a damped
// oscillator.
TEST_P(ResonatorBank, AnswersAnInputAsTheConvolutionWithItsImpulseResponse) {
  for (const std::size_t count : {5u, 16u, 37u}) {
    Bank bank(tones(count));
    std::vector<std::vector<long double>> responses;
    for (std::size_t i = 0; i < count; ++i) {
      const Tone tone = toneOf(bank.view().a1[i], bank.view().a2[i]);
      responses.push_back(responseOf(tone, 200));
      const double unit = static_cast<double>(std::sin(tone.w));  // scales the responses to order 1
      bank.y1(i) = bank.y2(i) = 0.0;
      bank.b0(i) = unit * random().between(-1.0, 1.0);
      bank.b1(i) = unit * random().between(-1.0, 1.0);
    }
    const std::vector<double> x = noise(200);
    std::vector<double> out(x.size() - 1, 0.0);
    kernels().drive(bank.view(), bank.input(x), out);
    for (std::size_t n = 0; n < out.size(); ++n) {
      long double sum = 0.0L;
      for (std::size_t i = 0; i < count; ++i) {
        for (std::size_t m = 0; m <= n; ++m)
          sum += responses[i][n - m] * (bank.b0(i) * x[m + 1] + bank.b1(i) * x[m]);
      }
      ASSERT_NEAR(out[n], static_cast<double>(sum), 1e-11) << count << " modes, sample " << n;
    }
  }
}

/// Deviation of the last two values of a bank's resonator from the tone's at t = n.
struct Deviation {
  long double phase = 0.0L;      ///< rad
  long double amplitude = 0.0L;  ///< relative
};

Deviation deviation(const Tone& tone, long double y1, long double y2, long double n) {
  const long double scale = tone.amplitude * std::exp(-tone.decay * n);
  const long double real = y1 / scale;
  const long double before = y2 / scale * std::exp(-tone.decay);
  const long double imaginary = (before - real * std::cos(tone.w)) / std::sin(tone.w);
  const long double meant = std::remainder(tone.w * n + tone.phase, kTwoPi);
  return {std::abs(std::remainder(std::atan2(imaginary, real) - meant, kTwoPi)),
          std::abs(std::hypot(real, imaginary) - 1.0L)};
}

constexpr double kRates[] = {8000.0, 44100.0, 48000.0, 192000.0};
constexpr double kFrequencies[] = {20.0, 27.5, 110.0, 440.0, 1000.0, 3999.0, 12345.6, 20000.0};

// Rounding moves a1 by at most 1 to 3 of its last bits, 2^-53 each, and so the phase, with every
// sample, by that over 2 sin w: 5e-7 rad after 10 s of 20 Hz at 192 kHz, which is the worst case.
// Rounding moves the amplitude by about one last bit with every sample, 2e-10.
TEST_P(ResonatorBank, KeepsPitchAndDecayFor10Seconds) {
  for (const double rate : kRates) {
    std::vector<Tone> tones;
    for (const double frequency : kFrequencies) {
      if (frequency >= 0.5 * rate) continue;
      for (const double decayRate : {0.1, 3.0})
        tones.push_back(
            {kTwoPi * frequency / rate, static_cast<long double>(decayRate) / rate, 0.7L, 0.3L});
    }
    // The expected tones are those that the bank is given, in double precision.
    for (Tone& tone : tones) {
      tone.w = static_cast<double>(tone.w);
      tone.decay = static_cast<double>(tone.decay);
    }
    Bank bank(tones);
    std::vector<double> out(static_cast<std::size_t>(rate) / 10);
    for (int tenth = 0; tenth < 100; ++tenth)
      kernels().ring(bank.view(), out);
    for (std::size_t i = 0; i < tones.size(); ++i) {
      const long double samples = 10.0L * rate;
      const Deviation off = deviation(tones[i], bank.y1(i), bank.y2(i), samples - 1.0L);
      EXPECT_LT(off.phase, 1e-6L) << tones[i].w << " rad at " << rate << " Hz";
      EXPECT_LT(off.amplitude, 1e-9L) << tones[i].w << " rad at " << rate << " Hz";
    }
  }
}

TEST_P(ResonatorBank, GivesTheSameBitsHoweverARunIsCut) {
  const std::vector<double> x = noise(1001);
  for (const std::size_t count : {8u, 24u, 72u}) {
    const Bank begin = drivenBank(count);
    Bank whole = begin;
    std::vector<double> expected(1000, 0.0);
    kernels().ring(whole.view(), expected);
    kernels().drive(whole.view(), whole.input(x), expected);
    for (int attempt = 0; attempt < 5; ++attempt) {
      Bank cut = begin;
      std::vector<double> out(expected.size(), 0.0);
      const auto inPieces = [&](auto render) {
        for (std::size_t at = 0; at < out.size();) {
          const std::size_t size =
              std::min(static_cast<std::size_t>(random().below(200)), out.size() - at);
          render(at, std::span(out).subspan(at, size));
          at += size;
        }
      };
      inPieces([&](std::size_t, std::span<double> piece) { kernels().ring(cut.view(), piece); });
      inPieces([&](std::size_t at, std::span<double> piece) {
        ResonatorInput input = cut.input(x);
        input.x += at;
        kernels().drive(cut.view(), input, piece);
      });
      EXPECT_EQ(out, expected);
      EXPECT_EQ(cut.values(), whole.values());
    }
  }
}

TEST_P(ResonatorBank, RingsWithTheSameBitsAsItIsDrivenBySilence) {
  Bank ringing = drivenBank(40);
  Bank driven = ringing;
  std::vector<double> rung(333, 0.0);
  std::vector<double> out(333, 0.0);
  kernels().ring(ringing.view(), rung);
  kernels().drive(driven.view(), driven.input(std::vector<double>(334, 0.0)), out);
  EXPECT_EQ(out, rung);
}

// Kernels round in two ways only, not in one way for each instruction set.
TEST_P(ResonatorBank, GivesTheBitsOfTheFastestOrOfThePlainKernels) {
  const Bank begin = drivenBank(104);
  const std::vector<double> x = noise(500);
  const auto rendered = [&](const ResonatorKernels& kernels) {
    Bank bank = begin;
    std::vector<double> out(499, 0.0);
    kernels.drive(bank.view(), bank.input(x), out);
    kernels.ring(bank.view(), out);
    return out;
  };
  const std::vector<double> out = rendered(kernels());
  EXPECT_TRUE(out == rendered(fastestResonators()) || out == rendered(plainResonators()));
}

TEST_P(ResonatorBank, TurnsModesAsComplexNumbers) {
  constexpr std::size_t kCount = 24;
  using Numbers = std::vector<double>;
  using Number = std::complex<double>;
  Random random(4);
  const auto numbers = [&] {
    Numbers some(kCount);
    for (double& number : some)
      number = random.between(-0.7, 0.7);
    return some;
  };
  const Numbers turnRe = numbers(), turnIm = numbers(), pushRe = numbers(), pushIm = numbers();
  const Numbers giveRe = numbers(), giveIm = numbers();
  Numbers re = numbers(), im = numbers();
  std::vector<Number> states;
  for (std::size_t i = 0; i < kCount; ++i)
    states.emplace_back(re[i], im[i]);
  const TurningModes modes{turnRe.data(), turnIm.data(), pushRe.data(),
                           pushIm.data(), giveRe.data(), giveIm.data(),
                           re.data(),     im.data(),     kCount};
  for (const double push : {1.0, -0.3, 0.0, 2.5}) {
    Number sum;
    for (std::size_t i = 0; i < kCount; ++i) {
      states[i] = states[i] * Number(turnRe[i], turnIm[i]) + push * Number(pushRe[i], pushIm[i]);
      sum += states[i] * Number(giveRe[i], giveIm[i]);
    }
    EXPECT_NEAR(kernels().turn(modes, push), sum.imag(), 1e-13);
  }
  for (std::size_t i = 0; i < kCount; ++i) {
    EXPECT_NEAR(re[i], states[i].real(), 1e-13);
    EXPECT_NEAR(im[i], states[i].imag(), 1e-13);
  }
}

TEST_P(ResonatorBank, FlushesWhatIsNotAboveTheThreshold) {
  const double threshold = 1e-9;
  std::vector<Tone> tones;
  for (const long double w : {0.0006L, 0.1L, 1.5L, 3.0L}) {
    for (long double phase = -3.0L; phase < 3.0L; phase += 0.37L) {
      const long double decay = 0.01L * w;
      // The threshold applies to the amplitude at the last sample, which is at t = -1.
      const long double there = threshold * std::exp(-decay);
      tones.push_back({w, decay, there * 1.000001L, phase});
      tones.push_back({w, decay, there * 0.999999L, phase});
    }
  }
  Bank bank(tones);
  const Bank before = bank;
  EXPECT_EQ(kernels().flush(bank.view(), threshold), tones.size() / 2);
  for (std::size_t i = 0; i < tones.size(); i += 2) {
    Bank untouched = before;
    EXPECT_TRUE(bank.y1(i) == untouched.y1(i) && bank.y2(i) == untouched.y2(i)) << i;
    EXPECT_TRUE(bank.y1(i + 1) == 0.0 && bank.y2(i + 1) == 0.0) << i;
  }
}

TEST_P(ResonatorBank, FlushesWhatIsNotFinite) {
  Bank bank(tones(8));
  bank.y1(2) = std::numeric_limits<double>::quiet_NaN();
  bank.y2(3) = std::numeric_limits<double>::infinity();
  bank.y1(5) = bank.y2(5) = -std::numeric_limits<double>::infinity();
  EXPECT_EQ(kernels().flush(bank.view(), 1e-9), 5u);
  for (const std::size_t i : {2u, 3u, 5u})
    EXPECT_TRUE(bank.y1(i) == 0.0 && bank.y2(i) == 0.0) << i;
}

bool holdsDenormal(std::span<const double> values) {
  return std::ranges::any_of(values,
                             [](double value) { return std::fpclassify(value) == FP_SUBNORMAL; });
}

/// Rings for so many blocks of 128 samples; true if a denormal number came up.
bool reachesDenormals(const ResonatorKernels& kernels, Bank bank, double threshold, int blocks) {
  bool reached = false;
  std::vector<double> out(128);
  for (int block = 0; block < blocks; ++block) {
    std::ranges::fill(out, 0.0);
    kernels.ring(bank.view(), out);
    reached = reached || holdsDenormal(bank.values()) || holdsDenormal(out);
    if (threshold > 0.0) kernels.flush(bank.view(), threshold);
  }
  return reached;
}

TEST_P(ResonatorBank, NeverReachesDenormalsIfItIsFlushed) {
  std::vector<Tone> tones;
  for (const long double w : {0.0026L, 0.1L, 1.0L, 3.14L}) {
    for (const long double damping : {0.01L, 0.1L, 0.5L, 0.99L})
      tones.push_back({w, damping * w, 1.0L, 0.2L});
  }
  constexpr int kBlocks = 300;
  EXPECT_TRUE(reachesDenormals(kernels(), Bank(tones), 0.0, kBlocks)) << "or this tests nothing";
  EXPECT_FALSE(reachesDenormals(kernels(), Bank(tones), 1e-9, kBlocks));
  EXPECT_FALSE(reachesDenormals(kernels(), Bank(tones), 1e-100, kBlocks));
}

INSTANTIATE_TEST_SUITE_P(All, ResonatorBank, testing::Range<std::size_t>(0, allResonators().size()),
                         [](const auto& tested) {
                           return std::string(allResonators()[tested.param].name);
                         });

}  // namespace
}  // namespace carom
