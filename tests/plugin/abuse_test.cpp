#include "tests/plugin/abuse.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "carom/audio/synth.h"
#include "tests/audio/ball_drop.h"
#include "tests/support/sanitizers.h"

namespace carom {
namespace {

using test::abuse;
using test::AbuseReport;
using test::GlitchDetector;

/// Clicks of a rubber ball, which last a millisecond or two each.
std::vector<float> someClicks() {
  const test::BallDrop rubber{.material = *findMaterial("rubber")};
  Synth synth = test::makeSynth(rubber, {{"near", {0.1, 0.2, 0.3}}});
  for (int i = 0; i < 200; ++i) {
    test::BallDrop drop = rubber;
    drop.speed = 0.05 * (1 + i % 7);
    drop.time = 0.05 + 0.0031 * i;
    synth.schedule(drop.event());
  }
  return test::renderMono<float>(synth, 40000);
}

std::uint64_t glitchesIn(const std::vector<float>& samples) {
  GlitchDetector detector;
  detector.push(samples);
  return detector.glitches();
}

TEST(GlitchDetector, HearsNoneInWhatTheOfflineRendererGives) {
  GlitchDetector detector;
  detector.push(someClicks());
  EXPECT_EQ(detector.glitches(), 0U);
  EXPECT_LT(detector.worst(), 1e-3);
}

TEST(GlitchDetector, HearsABlockThatIsLost) {
  std::vector<float> samples = someClicks();
  const auto loudest = std::ranges::max_element(samples);
  std::fill_n(loudest, 64, 0.0F);
  EXPECT_GE(glitchesIn(samples), 1U);
}

TEST(GlitchDetector, HearsAClickThatBeginsInItsMiddle) {
  std::vector<float> samples = someClicks();
  const auto loudest = std::ranges::max_element(samples);
  std::fill(samples.begin(), loudest, 0.0F);
  EXPECT_EQ(glitchesIn(samples), 1U);
}

TEST(GlitchDetector, HearsALevelThatJumps) {
  std::vector<float> samples = someClicks();
  const auto loudest = std::ranges::max_element(samples);
  std::for_each(loudest, samples.end(), [](float& sample) { sample *= 0.8F; });
  EXPECT_EQ(glitchesIn(samples), 1U);
}

TEST(Plugin, SurvivesAHostThatDoesEverythingWrong) {
  for (const std::uint64_t seed : {5U, 7U}) {  // in which there are stalls within 5 s
    const AbuseReport report = abuse({.seconds = kSanitized ? 5.0 : 20.0, .seed = seed});
    SCOPED_TRACE(report.text());
    EXPECT_EQ(report.notFinite, 0U);
    EXPECT_EQ(report.glitches, 0U);
    EXPECT_GT(report.peak, 1e-3);
    EXPECT_GT(report.stalls, 0U);
    EXPECT_GT(report.removed, 0U);
    EXPECT_GT(report.ofWorld.events, 100U);
    EXPECT_GT(report.ofEvents.stolen, 0U);
  }
}

TEST(Plugin, SoDoesWhatSlides) {
  const AbuseReport report = abuse({.seconds = 20.0, .seed = 3, .slides = true});
  SCOPED_TRACE(report.text());
  EXPECT_EQ(report.notFinite, 0U);
  EXPECT_GT(report.ofWorld.slides, 100U);
  EXPECT_LT(report.peak, 1e4);
}

}  // namespace
}  // namespace carom
