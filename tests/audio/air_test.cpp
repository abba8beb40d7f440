#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <functional>
#include <limits>
#include <numbers>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "audio/model/third_octaves.h"
#include "audio/propagation/air_filter.h"
#include "audio/propagation/listener_tracks.h"
#include "audio/propagation/sound_paths.h"
#include "audio/scheduling/noise_propagation.h"
#include "carom/audio/absorption.h"
#include "carom/audio/synth.h"
#include "tests/audio/ball_drop.h"
#include "tests/audio/ringing_box.h"
#include "tests/support/click_spectrum.h"
#include "tests/support/constants.h"
#include "tests/support/noisy_slides.h"

// Tests the absorption by air: its formula against the table of the standard, its filter against
// the formula, and what is heard against both.

namespace carom {

using namespace audio;

namespace {

using namespace test;

using Samples = std::vector<double>;

constexpr double kZeroCelsius = 273.15;  // K
const double kDecibels = 10.0 / std::numbers::ln10;

Medium airAt(double celsius, double percent) {
  return {.temperature = celsius + kZeroCelsius, .humidity = percent / 100.0};
}

/// dB/m.
double lossAt(const Medium& air, double frequency) {
  return kDecibels * airAttenuation(air, frequency);
}

struct TableValue {
  double celsius;
  double percent;
  int band;            // b: the exact midband frequency is 10^(b/10) kHz (NOTE 5 of 6.4)
  double attenuation;  // dB/km
};

/// Values of ISO 9613-1:1993, table 1, at 101.325 kPa. It has three digits.
constexpr std::array<TableValue, 62> kTable = {{
    {-20, 10, -13, 0.589}, {-20, 100, -13, 0.0992}, {-20, 15, -9, 1.43},   {-20, 70, -9, 0.514},
    {-20, 10, 0, 1.65},    {-20, 50, 0, 9.14},      {-20, 100, 0, 11.1},   {-20, 10, 6, 3.86},
    {-20, 70, 6, 20.2},    {-20, 10, 9, 10.9},      {-20, 100, 9, 41.1},   {-15, 10, 0, 2.67},
    {-15, 70, 6, 37.9},    {-10, 10, -9, 1.86},     {-10, 70, -9, 0.332},  {-10, 10, 0, 4.65},
    {-10, 100, 0, 5.91},   {-10, 10, 9, 14.2},      {-10, 70, 9, 86.2},    {-5, 10, 0, 8.29},
    {-5, 70, 6, 65.0},     {0, 10, -9, 1.30},       {0, 100, -9, 0.354},   {0, 10, 0, 14.0},
    {0, 15, 0, 18.3},      {0, 20, 0, 17.7},        {0, 100, 0, 3.37},     {0, 10, 9, 26.4},
    {5, 10, 0, 20.0},      {5, 70, 0, 3.80},        {10, 10, -9, 0.788},   {10, 70, -9, 0.411},
    {10, 10, 0, 21.6},     {10, 50, 0, 4.26},       {10, 100, 0, 3.55},    {10, 70, 6, 32.8},
    {10, 10, 9, 69.4},     {15, 10, 0, 18.4},       {15, 70, 6, 26.4},     {20, 10, -13, 0.270},
    {20, 80, -13, 0.0501}, {20, 50, -10, 0.294},    {20, 50, -9, 0.445},   {20, 10, -7, 1.22},
    {20, 80, 0, 5.15},     {20, 100, 0, 5.42},      {20, 10, 6, 109.0},    {20, 100, 6, 19.4},
    {20, 15, 8, 175.0},    {20, 80, 10, 105.0},     {25, 10, 0, 10.7},     {25, 100, 0, 6.47},
    {30, 70, -9, 0.256},   {30, 50, 0, 7.03},       {30, 100, 6, 24.0},    {35, 70, 0, 8.30},
    {40, 10, 0, 7.68},     {40, 70, 0, 8.66},       {50, 70, -10, 0.0913}, {50, 50, 0, 10.0},
    {50, 10, 9, 155.0},    {50, 70, 9, 80.3},
}};

TEST(AirAttenuation, IsThatOfTheStandardsTable) {
  for (const TableValue& value : kTable) {
    const double frequency = 1000.0 * std::pow(10.0, value.band / 10.0);
    const double made = 1000.0 * lossAt(airAt(value.celsius, value.percent), frequency);
    EXPECT_NEAR(made / value.attenuation, 1.0, 0.006)
        << value.celsius << " C, " << value.percent << " %, " << frequency << " Hz";
  }
}

/// At a third of the pressure and of the frequency, a molecule meets as many others in a period
/// (with three times the share of water, as many of them are water): per wavelength, the same is
/// lost.
TEST(AirAttenuation, OfAWavelengthIsAFunctionOfFrequencyOverPressure) {
  const Medium thick = airAt(15.0, 30.0);
  Medium thin = thick;
  thin.pressure /= 3.0;
  thin.humidity /= 3.0;
  for (const double frequency : {60.0, 900.0, 12000.0})
    EXPECT_NEAR(airAttenuation(thin, frequency / 3.0) * 3.0, airAttenuation(thick, frequency),
                1e-12 * airAttenuation(thick, frequency));
}

TEST(AirAttenuation, InTheBandsIsThatOfTheirCentres) {
  const Medium air = airAt(20.0, 50.0);
  const auto bands = airAttenuation(air);
  for (std::size_t band = 0; band < kBandCount; ++band)
    EXPECT_EQ(bands[band], airAttenuation(air, kOctaveBands[band]));
}

// --- The filter
// -----------------------------------------------------------------------------------

std::vector<double> tapsOf(const AirFilter& filter, double heard) {
  std::vector<double> room(filter.mostTaps());
  const auto taps = filter.taps(heard, room);
  return {taps.begin(), taps.end()};
}

/// Largest error (dB) of the filter up to 16 kHz where up to 50 dB are lost.
double largestError(const AirFilter& filter, const Medium& air, double distance, double rate) {
  std::vector<double> frequencies;
  for (double f = 20.0; f <= std::min(16000.0, 0.4 * rate); f *= 1.05)
    frequencies.push_back(f);
  // The transform of spectrumOf has the length of a sample as a factor.
  const auto response = spectrumOf(tapsOf(filter, distance), rate, frequencies);
  double largest = 0.0;
  for (std::size_t i = 0; i < frequencies.size(); ++i) {
    const double wanted = -distance * lossAt(air, frequencies[i]);
    const double made = 20.0 * std::log10(std::abs(response[i]) * rate);
    // Where more is lost, that much at least is.
    largest = std::max(largest, wanted > -50.0 ? std::abs(made - wanted) : made + 49.5);
  }
  return largest;
}

TEST(AirFilter, IsTheFormulasWithinHalfADecibelUpToAKilometre) {
  for (const double rate : {8000.0, 44100.0, 48000.0, 96000.0, 192000.0})
    for (const auto& [celsius, percent] : {std::pair(20.0, 50.0), {0.0, 80.0}, {35.0, 20.0}}) {
      const Medium air = airAt(celsius, percent);
      const AirFilter filter(air, rate);
      for (const double distance : {1.0, 10.0, 100.0, 1000.0})
        EXPECT_LT(largestError(filter, air, distance, rate), 0.5)
            << distance << " m, " << celsius << " C, " << percent << " %, " << rate << " Hz";
    }
}

TEST(AirFilter, DelaysLowFrequenciesByItsSlowness) {
  const AirFilter filter(airAt(20.0, 50.0), kRate);
  for (const double distance : {10.0, 100.0, 1000.0}) {
    const auto low = spectrumOf(tapsOf(filter, distance), kRate, {40.0}).front();
    const double delay = -std::arg(low) / (2.0 * kPi * 40.0);
    EXPECT_NEAR(delay, distance * filter.slowness(), 10e-6) << distance;
  }
}

TEST(AirFilter, IsLeftOutWhereItIsInaudibleAndBeginsWithoutAStep) {
  const Medium air = airAt(20.0, 50.0);
  const AirFilter filter(air, kRate);
  EXPECT_EQ(filter.heardDistance(1.0), 0.0);
  EXPECT_EQ(filter.codeOf(1.0), 0);
  double last = 0.0;
  for (double distance = 1.0; distance < 10.0; distance += 0.001) {
    const double heard = filter.heardDistance(distance);
    EXPECT_LE(std::abs(heard - last), 0.0021) << distance;
    EXPECT_LE((distance - heard) * lossAt(air, 16000.0), 0.501) << distance;
    last = heard;
  }
  EXPECT_EQ(filter.heardDistance(9.0), 9.0);
  EXPECT_EQ(filter.heardDistance(std::numeric_limits<double>::infinity()), filter.farthest());
}

TEST(AirFilter, CodesKeepDistances) {
  const AirFilter filter(airAt(20.0, 50.0), kRate);
  for (double distance = 2.8; distance < filter.farthest(); distance *= 1.07)
    EXPECT_NEAR(AirFilter::heardDistanceOf(filter.codeOf(distance)), distance,
                3e-4 * (1.0 + distance));
}

/// A listener who walks a centimetre hears taps that differ by little, at any distance.
TEST(AirFilter, ChangesEvenlyWithTheDistance) {
  const AirFilter filter(airAt(20.0, 50.0), kRate);
  std::vector<double> last = {1.0};
  for (double distance = 1.3; distance < 60.0; distance += 0.01) {
    const std::uint16_t code = filter.codeOf(distance);
    std::vector<double> now = {1.0};
    if (code != 0) now = tapsOf(filter, AirFilter::heardDistanceOf(code));
    const std::size_t size = std::max(now.size(), last.size());
    now.resize(size);
    last.resize(size);
    double change = 0.0;
    for (std::size_t tap = 0; tap < size; ++tap)
      change += std::abs(now[tap] - last[tap]);
    ASSERT_LT(change, 0.01) << distance;
    last = now;
  }
}

// --- What is heard
// ---------------------------------------------------------------------------------

SynthSettings withAir(bool on) {
  SynthSettings settings;
  settings.audibleThreshold = 0.0;
  settings.airAbsorption = on;
  return settings;
}

/// Renders a ball's click at a distance (m) along its axis.
Samples clickAt(double distance, const SynthSettings& settings) {
  const BallDrop drop{.radius = 0.002, .time = 0.02 - distance / 343.0};
  Synth synth = makeSynth(drop, {{"seat", {0.0, 0.0, distance}}}, settings);
  synth.schedule(drop.event());
  return renderMono(synth, 4000);
}

/// Expects that the air takes from `without` what the formula says of `distance`.
void expectAbsorbed(const Samples& with, const Samples& without, double distance, double most) {
  const Medium air;
  std::vector<double> frequencies;
  for (double f = 100.0; f <= 16000.0; f *= 1.1)
    if (distance * lossAt(air, f) < most) frequencies.push_back(f);
  const auto made = spectrumOf(with, kRate, frequencies);
  const auto free = spectrumOf(without, kRate, frequencies);
  ASSERT_GT(frequencies.size(), 10U);
  for (std::size_t i = 0; i < frequencies.size(); ++i)
    EXPECT_NEAR(20.0 * std::log10(std::abs(made[i] / free[i])),
                -distance * lossAt(air, frequencies[i]), 0.5)
        << frequencies[i] << " Hz at " << distance << " m";
}

TEST(SynthAir, AbsorbsFromAClickWhatTheFormulaSays) {
  for (const double distance : {3.0, 10.0, 100.0, 1000.0})
    expectAbsorbed(clickAt(distance, withAir(true)), clickAt(distance, withAir(false)), distance,
                   40.0);
}

TEST(SynthAir, IsLeftOutAtAMetreToTheBit) {
  EXPECT_EQ(clickAt(1.0, withAir(true)), clickAt(1.0, withAir(false)));
}

/// What the filter delays is made up for: 200 Hz come as late as without air, but for the
/// dispersion that goes with absorption, here below 20 millionths of the time on the way.
TEST(SynthAir, DoesNotDelayAClick) {
  for (const double distance : {10.0, 100.0, 1000.0}) {
    const auto with = spectrumOf(clickAt(distance, withAir(true)), kRate, {200.0}).front();
    const auto without = spectrumOf(clickAt(distance, withAir(false)), kRate, {200.0}).front();
    EXPECT_NEAR(std::arg(with / without) / (2.0 * kPi * 200.0), 0.0,
                5e-6 + 20e-6 * distance / 343.0)
        << distance;
  }
}

/// A listener beside the ball, across its axis, hears the wall's image alone.
TEST(SynthAir, AbsorbsFromAnImageByTheLengthOfItsPath) {
  const auto imageAlone = [](bool on) {
    SynthSettings settings = withAir(on);
    settings.room.reflectors = {{-Vec3::UnitX(), -20.0, {}}};  // at x = 20
    const BallDrop drop{.radius = 0.002, .time = 0.0};
    Synth synth = makeSynth(drop, {{"seat", {-2.0, 0.0, 15.0}}}, settings);
    synth.schedule(drop.event());
    const Samples all = renderMono(synth, 9600);
    const auto late = static_cast<std::ptrdiff_t>(0.06 * kRate);  // after the direct sound
    return Samples(all.begin() + late, all.end());
  };
  expectAbsorbed(imageAlone(true), imageAlone(false), std::hypot(42.0, 15.0), 40.0);
}

TEST(SynthAir, AbsorbsFromAModeWhatTheFormulaSaysOfItsFrequency) {
  const auto ringing = [](double frequency, bool on) {
    SynthSettings settings = withAir(on);
    const BallDrop drop = dropOnBox(0.01);
    Synth synth = *Synth::create(settings, {{"seat", {0.0, 0.0, 80.0}}});
    SoundBody floor = drop.floor();
    floor.modal = boxOf({{frequency, 10.0}});
    EXPECT_TRUE(synth.setBody(kBall, {.material = drop.material}));  // its click is left out
    EXPECT_TRUE(synth.setBody(kFloor, floor));
    synth.schedule(floorShare(drop));
    const Samples all = renderMono(synth, 24000);
    return Samples(all.begin() + 14000, all.end());  // long after the blow
  };
  for (const double frequency : {500.0, 3000.0, 9000.0})
    EXPECT_NEAR(
        20.0 * std::log10(peakOf(ringing(frequency, true)) / peakOf(ringing(frequency, false))),
        -80.0 * lossAt({}, frequency), 0.01)
        << frequency;
}

TEST(SynthAir, AbsorbsFromASlideWhatTheFormulaSays) {
  const double distance = 25.0;
  const NoisySlides slides{
      .count = 12, .material = "steel", .speed = 3.0, .duration = 1.5, .distance = distance};
  const auto octaves = [&](bool on) {
    SynthCounters counters;
    const Samples sound = slides.sound(withAir(on), &counters).front();
    return thirdOctavesOf(sound, sound.size() / 4, sound.size());
  };
  const auto with = octaves(true);
  const auto without = octaves(false);
  for (const int n : {27, 30, 33, 36, 39}) {  // 500 Hz to 8 kHz
    const auto band = static_cast<std::size_t>(n - 17);
    EXPECT_NEAR(10.0 * std::log10(with[band] / without[band]),
                -distance * lossAt({}, std::pow(10.0, 0.1 * n)), 0.3)
        << n;
  }
}

/// Sliding as noise of third octaves loses what the formula says in the middle of each.
TEST(SynthAir, AbsorbsFromNoiseWhatTheFormulaSays) {
  const auto powers = [](bool on) {
    const auto paths = *makeSoundPaths(withAir(on), {{"seat", {0.0, 0.0, 200.0}}});
    const ListenerTracks tracks(paths);
    NoisePropagation noise(paths, tracks);
    const std::vector<Strike> strikes = {{.dipole = Vec3::UnitZ(), .radius = 0.01}};
    BandPowers force;
    force.fill(1.0);
    noise.propagate(0.0, strikes, force);
    return Samples(noise.powers().begin(), noise.powers().end());
  };
  const Samples with = powers(true);
  const Samples without = powers(false);
  for (std::size_t band = 0; band < kThirdOctaves; ++band) {
    if (without[band] == 0.0) continue;  // above the band
    EXPECT_NEAR(10.0 * std::log10(with[band] / without[band]),
                -200.0 * lossAt({}, thirdOctaves()[band]), 1e-9);
  }
}

double sinc(double x) {
  return x == 0.0 ? 1.0 : std::sin(kPi * x) / (kPi * x);
}

/// Passes each sample through the taps of the distance (m) at its own time.
Samples absorbedSampleBySample(const Samples& sound, const std::function<double(double)>& at) {
  const AirFilter filter({}, kRate);
  Samples out(sound.size());
  constexpr std::ptrdiff_t kReach = 40;
  for (std::size_t n = 0; n < sound.size(); ++n) {
    const double heard = filter.heardDistance(at(static_cast<double>(n) / kRate));
    const auto taps = heard == 0.0 ? Samples{1.0} : tapsOf(filter, heard);
    const double earlier = heard * filter.slowness() * kRate;  // samples
    for (std::ptrdiff_t to = -kReach; to < kReach + std::ssize(taps); ++to) {
      double tap = 0.0;
      for (std::size_t k = 0; k < taps.size(); ++k) {
        const double x = static_cast<double>(to) - static_cast<double>(k) + earlier;
        const double window = std::cos(0.5 * kPi * x / (kReach + 2.0));
        if (std::abs(x) < kReach) tap += taps[k] * sinc(x) * window * window;
      }
      const auto place = static_cast<std::ptrdiff_t>(n) + to;
      if (place >= 0 && place < std::ssize(out))
        out[static_cast<std::size_t>(place)] += tap * sound[n];
    }
  }
  return out;
}

Samples thriceDifferenced(Samples sound) {
  for (int pass = 0; pass < 3; ++pass)
    std::adjacent_difference(sound.begin(), sound.end(), sound.begin());
  return sound;
}

/// A listener walks away from something that slides, from where the air is left out to 6 m: what is
/// heard is what the taps of each sample's own distance leave, without a click.
TEST(SynthAir, FollowsAListenerWhoWalksWithoutClicks) {
  const NoisySlides slides{.material = "steel", .speed = 3.0, .duration = 0.5};
  const auto placeAt = [](double time) { return Vec3(0.0, -(1.0 + 10.0 * time), 0.0); };
  const auto walking = [&](bool on) {
    SynthSettings settings = withAir(on);
    settings.doppler = false;
    Synth synth = slides.synth(settings);
    for (double time = 0.01; time < 1.0; time += 0.01)
      EXPECT_TRUE(synth.moveListener(0, {time, placeAt(time)}));
    for (std::size_t index = 0; index < 30; ++index)
      synth.updateContact(slides.state(0, index));
    return renderPlanes(synth, 24000).front();
  };
  const Samples all = walking(false);
  // What the air takes least of is the loudest by far: the high frequencies are brought out.
  const Samples free = thriceDifferenced(all);
  const Samples made = thriceDifferenced(walking(true));
  const Samples wanted = thriceDifferenced(
      absorbedSampleBySample(all, [&](double time) { return placeAt(time - 0.01).norm(); }));
  const auto largestDifference = [&](const Samples& one, const Samples& other) {
    double largest = 0.0;
    for (std::size_t n = 1000; n + 1000 < one.size(); ++n)
      largest = std::max(largest, std::abs(one[n] - other[n]));
    return largest;
  };
  const double peak = peakOf(free);
  EXPECT_GT(largestDifference(made, free), 0.05 * peak);
  EXPECT_LT(largestDifference(made, wanted), 0.01 * peak);
}

// --- Late reverberation
// ---------------------------------------------------------------------------

/// Mean power of sounds around a frequency (Hz), every millisecond, in Gaussian windows.
Samples powerAround(double frequency, const std::vector<Samples>& sounds) {
  constexpr std::ptrdiff_t kHop = 48;
  constexpr double kWidth = 24.0;  // samples, of the window: 320 Hz
  const auto hops = std::ssize(sounds.front()) / kHop - 8;
  Samples powers(static_cast<std::size_t>(hops), 0.0);
  for (const Samples& sound : sounds)
    for (std::ptrdiff_t hop = 4; hop < hops; ++hop) {
      std::complex<double> sum = 0.0;
      for (std::ptrdiff_t n = -4 * kHop; n <= 4 * kHop; ++n) {
        const auto time = static_cast<double>(n);
        sum += sound[static_cast<std::size_t>(hop * kHop + n)] *
               std::exp(-0.5 * time * time / (kWidth * kWidth)) *
               std::polar(1.0, -2.0 * kPi * frequency * time / kRate);
      }
      powers[static_cast<std::size_t>(hop)] += std::norm(sum);
    }
  return powers;
}

/// Decay time in s from the energy that is yet to come, between 5 and 35 dB below all of it.
double decayTimeOf(const Samples& powers) {
  Samples coming(powers.size() + 1);
  for (std::size_t n = powers.size(); n-- > 0;)
    coming[n] = coming[n + 1] + powers[n];
  const auto after = [&](double decibels) {
    const double level = coming.front() * std::pow(10.0, -0.1 * decibels);
    const auto place = std::ranges::find_if(coming, [&](double energy) { return energy < level; });
    return 1e-3 * static_cast<double>(place - coming.begin());
  };
  return 2.0 * (after(35.0) - after(5.0));
}

Room nave() {  // of 14,400 m^3
  Room room;
  room.order = 0;
  const Vec3 size(60.0, 16.0, 15.0);
  for (int axis = 0; axis < 3; ++axis) {
    const Absorption marble = findSurface("marble")->absorption;
    room.reflectors.push_back({Vec3::Unit(axis), 0.0, marble});
    room.reflectors.push_back({-Vec3::Unit(axis), -size[axis], marble});
  }
  return room;
}

TEST(SynthAir, ANaveRingsAsLongAsWallsAndAirLetIt) {
  const double volume = 14400.0;
  const double surface = 2.0 * (60.0 * 16.0 + 60.0 * 15.0 + 16.0 * 15.0);
  SynthSettings settings = withAir(true);
  settings.room = nave();
  settings.reverb = *reverbOfBox(settings.room, 343.0);
  const BallDrop drop{.radius = 0.002, .time = 0.01, .centre = {10.0, 8.0, 2.0}};
  const std::vector<Listener> seats(8, {"seat", {40.0, 6.0, 1.7}});
  Synth synth = makeSynth(drop, seats, settings);
  synth.schedule(drop.event());
  std::vector<Samples> tails = renderPlanes(synth, 5 * 48000);
  for (Samples& tail : tails)
    tail.erase(tail.begin(), tail.begin() + 12000);
  for (const double frequency : {4000.0, 8000.0, 16000.0}) {
    const double alpha = 0.02;  // of marble, from 1 kHz on
    const double area =
        -surface * std::log(1.0 - alpha) + 4.0 * airAttenuation({}, frequency) * volume;
    const double wanted = 24.0 * std::numbers::ln10 * volume / (343.0 * area);
    EXPECT_NEAR(decayTimeOf(powerAround(frequency, tails)) / wanted, 1.0, 0.05) << frequency;
  }
}

// --- What is refused
// ------------------------------------------------------------------------------

TEST(SynthAir, RefusesAirThatThereIsNot) {
  struct Case {
    double Medium::*field;
    std::vector<double> values;
    std::string what;
  };
  const std::vector<Case> cases = {
      {&Medium::temperature, {kNaN, 0.0, -1.0, 20.0, 1e9}, "temperature of the air"},
      {&Medium::humidity, {kNaN, -0.01, 2.0, 50.0}, "relative humidity of the air"},
      {&Medium::pressure, {kNaN, 0.0, 101.325, 1e6}, "pressure of the air"}};
  for (const Case& which : cases)
    for (const double value : which.values)
      for (const bool on : {true, false}) {
        SynthSettings settings = withAir(on);
        settings.medium.*which.field = value;
        const auto synth = Synth::create(settings, {{"seat", {0.0, 0.0, 1.0}}});
        ASSERT_FALSE(synth) << which.what << ' ' << value;
        EXPECT_THAT(synth.error().message, testing::HasSubstr(which.what));
        EXPECT_THAT(synth.error().message, testing::HasSubstr("must be"));
      }
}

}  // namespace
}  // namespace carom
