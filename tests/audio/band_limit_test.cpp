#include <algorithm>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/click_spectrum.h"

// Tests that in the band the click is that of the wave equation, whatever the contact's duration,
// the sample rate and the place between two samples. The oracle (click_spectrum) shares no
// rendering with the synth.

namespace carom::test {
namespace {

constexpr double kErrorBound = -80.0;  // dB

struct Ladder {
  double duration;
  double sampleRate;
};

void PrintTo(const Ladder& ladder, std::ostream* out) {
  *out << ladder.duration * 1e6 << " us at " << ladder.sampleRate << " Hz";
}

class BandLimit : public testing::TestWithParam<Ladder> {
 protected:
  static ClickCase click(PulseShape pulse, Radiation radiation) {
    const Ladder& ladder = GetParam();
    ClickCase click;
    click.pulse = pulse;
    click.radiation = radiation;
    click.duration = ladder.duration;
    click.sampleRate = ladder.sampleRate;
    click.radius = std::clamp(ladder.duration * 130.0, 0.001, 1.0);
    click.distance = click.radius + 0.4;
    click.time = 0.05 + 3.0 * click.duration;  // a Gaussian begins well before its time
    return click;
  }
};

TEST_P(BandLimit, HertzIsRightAtEveryPhaseInEitherRadiation) {
  for (const Radiation radiation : {Radiation::exact, Radiation::compact}) {
    for (const double phase : {0.0, 0.13, 0.51, 0.97}) {
      ClickCase moved = click(PulseShape::hertz, radiation);
      moved.time += phase / moved.sampleRate;
      EXPECT_LT(inBandError(moved, moved), kErrorBound) << phase;
    }
  }
}

TEST_P(BandLimit, SoIsEveryOtherPulse) {
  for (const PulseShape pulse : {PulseShape::halfSine, PulseShape::gaussian,
                                 PulseShape::mitchellNetravali, PulseShape::courseGaussian}) {
    ClickCase any = click(pulse, Radiation::exact);
    any.time += 0.37 / any.sampleRate;
    EXPECT_LT(inBandError(any, any), kErrorBound) << static_cast<int>(pulse);
  }
}

INSTANTIATE_TEST_SUITE_P(Synth, BandLimit,
                         testing::Values(Ladder{1e-6, 48000.0}, Ladder{8e-6, 8000.0},
                                         Ladder{8e-6, 48000.0}, Ladder{8e-6, 192000.0},
                                         Ladder{50e-6, 44100.0}, Ladder{165e-6, 48000.0},
                                         Ladder{170e-6, 48000.0}, Ladder{200e-6, 48000.0},
                                         Ladder{320e-6, 48000.0}, Ladder{1e-3, 48000.0},
                                         Ladder{5e-3, 48000.0}, Ladder{0.1, 8000.0}));

// The contact's nodes, or its raster, fall on samples, and its loudest frequency is 5 Hz.
TEST(BandLimitOfLongContacts, HoldsWhereAContactLastsWholeSamples) {
  for (const double phase : {0.0, 0.25, 0.5}) {
    ClickCase click{.radiation = Radiation::compact,
                    .duration = 0.1,
                    .radius = 1.0,
                    .distance = 2.0,
                    .sampleRate = 48000.0};
    click.time = (4800.0 + phase) / click.sampleRate;
    EXPECT_LT(inBandError(click, click), kErrorBound) << phase;
  }
}

TEST(BandLimitOfLossyContacts, HoldsForAnyRestitution) {
  for (const double restitution : {0.1, 0.5, 0.9}) {
    for (const double duration : {5e-6, 60e-6, 150e-6, 400e-6, 2e-3}) {
      ClickCase click{.radiation = Radiation::compact, .duration = duration, .radius = 0.01};
      click.restitution = restitution;
      click.time += 0.37 / click.sampleRate;
      EXPECT_LT(inBandError(click, click), kErrorBound) << restitution << " " << duration;
    }
  }
}

// The oracle is slow at 192 kHz, so that it runs only once.
TEST(BandLimitOfLongContacts, HoldsFor100MillisecondsAt192Kilohertz) {
  ClickCase longest{.duration = 0.1, .radius = 1.0, .distance = 2.0, .sampleRate = 192000.0};
  EXPECT_LT(inBandError(longest, longest), kErrorBound);
}

TEST(BandLimitedLevel, DoesNotDependOnThePlaceBetweenTwoSamples) {
  for (const double duration : {1e-6, 5e-6, 20e-6, 80e-6}) {
    double lowest = 1e3;
    double highest = -1e3;
    for (double phase = 0.0; phase < 1.0; phase += 1.0 / 16.0) {
      ClickCase click{.duration = duration, .radius = 0.002};
      click.time += phase / click.sampleRate;
      const double level = inBandLevel(click);
      lowest = std::min(lowest, level);
      highest = std::max(highest, level);
    }
    EXPECT_NEAR(lowest, 0.0, 1e-3) << duration;  // dB
    EXPECT_NEAR(highest, 0.0, 1e-3) << duration;
  }
}

// The expected errors (dB) of naive sampling of the hand-out pulse were computed apart from this
// code.
TEST(NaiveSampling, IsWrongByAsMuchAsWasMeasuredElsewhere) {
  const struct {
    double duration;
    double worst;  // dB
  } rows[] = {{5e-6, 30.5}, {8e-6, 22.4}, {20e-6, 6.5}, {40e-6, -12.7}};
  for (const auto& row : rows) {
    double worst = -1e3;
    for (double phase = 0.0; phase < 1.0; phase += 1.0 / 64.0) {
      ClickCase click{.pulse = PulseShape::courseGaussian,
                      .sampling = Sampling::naive,
                      .radiation = Radiation::compact,
                      .duration = row.duration};
      click.time += phase / click.sampleRate;
      worst = std::max(worst, inBandError(click, click));
    }
    EXPECT_NEAR(worst, row.worst, 0.3) << row.duration;
  }
}

}  // namespace
}  // namespace carom::test
