#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "scenes/run/render.h"
#include "tests/scenes/library.h"
#include "tests/support/temporary_folder.h"

namespace carom::test {

using namespace scenes;

namespace {

namespace fs = std::filesystem;

/// A sound as a rendering hands it over: every block of each channel, one behind the other.
struct Heard {
  std::vector<float> whole;
  std::array<std::vector<float>, kStems> stems;

  float peak() const {
    float peak = 0.0F;
    for (const float sample : whole)
      peak = std::max(peak, std::abs(sample));
    return peak;
  }
  const std::vector<float>& stem(Stem stem) const { return stems[static_cast<std::size_t>(stem)]; }
};

class Ear : public RenderSink {
 public:
  explicit Ear(Heard& heard) : heard_(heard) {}
  Status write(std::span<const float* const> channels, std::size_t frames) override {
    append(heard_.whole, channels, frames);
    return std::monostate{};
  }
  Status writeStem(Stem stem, std::span<const float* const> channels, std::size_t frames) override {
    append(heard_.stems[static_cast<std::size_t>(stem)], channels, frames);
    return std::monostate{};
  }
  void add(const ImpulseEvent&, const EventSound&) override {}

 private:
  static void append(std::vector<float>& to, std::span<const float* const> channels,
                     std::size_t frames) {
    for (const float* const channel : channels)
      to.insert(to.end(), channel, channel + frames);
  }

  Heard& heard_;
};

Heard heard(Scene scene, bool stems, double tail = 0.1) {
  scene.sound.stems = stems;
  RenderOptions options;
  options.tail = tail;
  Heard sound;
  Ear ear(sound);
  const Result<RenderReport> report = renderScene(scene, options, ear);
  EXPECT_TRUE(report) << report.error().message;
  return sound;
}

bool isSilent(const std::vector<float>& samples) {
  return std::ranges::all_of(samples, [](float sample) { return sample == 0.0F; });
}

/// The scene, for no longer than `duration` s.
Scene shortened(Scene scene, double duration) {
  scene.duration = std::min(scene.duration, duration);
  return scene;
}

/// Expects that the whole is what it is without stems, and that the stems add up to it: each is
/// rounded to float, 6e-8 of itself.
void expectSum(const Scene& scene, const Heard& parts) {
  const Heard alone = heard(scene, false);
  EXPECT_EQ(alone.whole, parts.whole) << scene.name;
  for (const std::vector<float>& stem : alone.stems)
    EXPECT_TRUE(stem.empty());
  for (const std::vector<float>& stem : parts.stems)
    ASSERT_EQ(stem.size(), parts.whole.size());
  double worst = 0.0;
  double loudest = parts.peak();
  for (std::size_t index = 0; index < parts.whole.size(); ++index) {
    double sum = 0.0;
    for (const std::vector<float>& stem : parts.stems) {
      sum += stem[index];
      loudest = std::max(loudest, std::abs(static_cast<double>(stem[index])));
    }
    worst = std::max(worst, std::abs(sum - parts.whole[index]));
  }
  EXPECT_GT(loudest, 0.0) << scene.name;
  EXPECT_LT(worst, 4.0 * 6e-8 * loudest) << scene.name;
}

TEST(Stems, AddUpToTheWholeWhichStaysAsItIs) {
  for (const Scene& scene :
       {fewMarbles(), shortened(libraryScene("marbles_in_a_room"), 0.5),
        shortened(libraryScene("wood_blocks"), 1.0), shortened(libraryScene("coin_spin"), 0.5),
        shortened(libraryScene("jello_and_marbles"), 0.3)})
    expectSum(scene, heard(scene, true));
}

TEST(Stems, OfWhatNeitherRingsNorSlidesIsItsClicksAlone) {
  const Heard sound = heard(fewMarbles(), true);
  EXPECT_EQ(sound.stem(Stem::clicks), sound.whole);
  EXPECT_TRUE(isSilent(sound.stem(Stem::rings)));
  EXPECT_TRUE(isSilent(sound.stem(Stem::contacts)));
}

TEST(Stems, OfABallOnAPlateThatRingsAreClicksAndRings) {
  const Heard sound = heard(shortened(libraryScene("glass_and_plate"), 0.6), true);
  EXPECT_FALSE(isSilent(sound.stem(Stem::clicks)));
  EXPECT_FALSE(isSilent(sound.stem(Stem::rings)));
  // Long after a blow the plate rings, and the click is over.
  const std::vector<float>& clicks = sound.stem(Stem::clicks);
  const std::vector<float>& rings = sound.stem(Stem::rings);
  const auto quietClicks = std::ranges::count(clicks, 0.0F);
  const auto quietRings = std::ranges::count(rings, 0.0F);
  EXPECT_GT(quietClicks, quietRings);
}

TEST(Stems, OfWhatSlidesAreContacts) {
  const Heard sound = heard(shortened(libraryScene("pen_scrapes_brick"), 0.6), true);
  EXPECT_FALSE(isSilent(sound.stem(Stem::contacts)));
}

TEST(Stems, OfAJelloAreItsOwnVibrationAmongTheRings) {
  const Heard sound = heard(shortened(libraryScene("jello_drop"), 0.7), true);
  EXPECT_FALSE(isSilent(sound.stem(Stem::rings)));
  EXPECT_EQ(sound.stem(Stem::rings), sound.whole);
}

TEST(Stems, LieBesideTheSoundAsFilesOfOneUnit) {
  const TemporaryFolder folder;
  Scene scene = shortened(libraryScene("wood_blocks"), 0.4);
  scene.sound.stems = true;
  RenderOptions options;
  options.soundFile = folder / "blocks.wav";
  const Result<RenderReport> report = renderScene(scene, options);
  ASSERT_TRUE(report) << report.error().message;
  const std::vector<fs::path> expected = {folder / "blocks.clicks.wav", folder / "blocks.rings.wav",
                                          folder / "blocks.contacts.wav"};
  EXPECT_EQ(report->stems, expected);
  for (const fs::path& file : expected)
    EXPECT_EQ(fs::file_size(file), fs::file_size(options.soundFile)) << file;
}

TEST(Stems, OfANormalisedSoundAreRefusedAndNothingIsWritten) {
  const TemporaryFolder folder;
  Scene scene = fewMarbles();
  scene.sound.stems = true;
  RenderOptions options;
  options.soundFile = folder / "marbles.wav";
  options.normalize = true;
  const Result<RenderReport> report = renderScene(scene, options);
  ASSERT_FALSE(report);
  EXPECT_NE(report.error().message.find("expected a full scale"), std::string::npos);
  EXPECT_EQ(folder.entries(), 0U);
}

}  // namespace
}  // namespace carom::test
