#include "carom/audio/sound_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sndfile.h>
#include <sys/stat.h>

#include "tests/support/recording.h"
#include "tests/support/temporary_folder.h"

namespace carom {
namespace {

namespace fs = std::filesystem;

using test::contents;
using test::Recording;

class SoundFile : public testing::Test {
 protected:
  fs::path path() const { return folder_ / "clicks.wav"; }

  const test::TemporaryFolder folder_;
};

/// Returns samples that turn slowly, in Pa.
std::vector<float> slowWave(std::size_t frames, float amplitude) {
  return test::sineWave(frames, amplitude, 0.01F);
}

void writeMono(const fs::path& path, const SoundFileSettings& settings,
               const std::vector<float>& samples) {
  auto writer = SoundFileWriter::create(path, settings);
  ASSERT_TRUE(writer) << writer.error().message;
  const std::array<const float*, 1> channels = {samples.data()};
  ASSERT_TRUE(writer->write(channels, samples.size()));
  const Status finished = writer->finish();
  ASSERT_TRUE(finished) << finished.error().message;
}

TEST_F(SoundFile, TwentyPascalsAreFullScale) {
  writeMono(path(), {}, {20.0F, -10.0F, 0.02F, 0.0F});
  const Recording recording = test::readRecording(path());
  EXPECT_EQ(recording.info.samplerate, 48000);
  EXPECT_EQ(recording.info.channels, 1);
  EXPECT_EQ(recording.info.format, SF_FORMAT_WAVEX | SF_FORMAT_FLOAT);
  ASSERT_EQ(recording.samples.size(), 4u);
  EXPECT_EQ(recording.samples[0], 1.0);
  EXPECT_EQ(recording.samples[1], -0.5);
  EXPECT_NEAR(recording.samples[2], 1e-3, 1e-10);
  EXPECT_EQ(recording.samples[3], 0.0);
}

TEST_F(SoundFile, FloatKeepsWhatIsLouderThanFullScale) {
  writeMono(path(), {}, {60.0F});
  EXPECT_EQ(test::readRecording(path()).samples.at(0), 3.0);
}

TEST_F(SoundFile, FullScaleIsThePressureThatIsAskedFor) {
  SoundFileSettings settings;
  settings.fullScalePressure = 100.0;
  writeMono(path(), settings, {20.0F, -100.0F, 250.0F});
  EXPECT_EQ(test::readRecording(path()).samples,
            (std::vector<double>{static_cast<double>(0.2F), -1.0, 2.5}));
  settings.format = SampleFormat::pcm16;
  auto writer = SoundFileWriter::create(path(), settings);
  ASSERT_TRUE(writer);
  const std::vector<float> samples = {50.0F, 99.0F, -101.0F};
  ASSERT_TRUE(writer->write(std::array{samples.data()}, samples.size()));
  EXPECT_EQ(writer->clippedSamples(), 1u);
  ASSERT_TRUE(writer->finish());
  EXPECT_EQ(test::readRecording(path()).samples.at(0), 0.5);
}

/// Adds a click of that peak as a contact makes one: the derivative of a Gaussian.
void addClick(std::vector<float>& samples, std::size_t centre, double peak) {
  for (std::size_t frame = centre - 40; frame <= centre + 40; ++frame) {
    const double u = (static_cast<double>(frame) - static_cast<double>(centre)) / 6.0;
    samples[frame] += static_cast<float>(peak * u * std::exp(0.5 - 0.5 * u * u));
  }
}

/// Largest error, relative to `peak`, of the click at `centre` in the file against the same click
/// with that peak.
double clickError(const Recording& recording, std::size_t centre, double peak) {
  double largest = 0.0;
  for (std::size_t frame = centre - 40; frame <= centre + 40; ++frame) {
    const double u = (static_cast<double>(frame) - static_cast<double>(centre)) / 6.0;
    const double click = peak * u * std::exp(0.5 - 0.5 * u * u);
    largest = std::max(largest, std::abs(recording.samples[frame] * 20.0 - click));
  }
  return largest / peak;
}

TEST_F(SoundFile, A120dBQuieterClickSurvivesBesideALoudOne) {
  // The loud click has 20 Pa, full scale, and the quiet ones 20 uPa, the threshold of hearing.
  std::vector<float> samples(20'000, 0.0F);
  addClick(samples, 5000, 20.0);
  addClick(samples, 6000, 20e-6);
  addClick(samples, 4000, -20e-6);
  for (const bool limit : {false, true}) {
    SoundFileSettings settings;
    settings.limit = limit;
    writeMono(path(), settings, samples);
    const Recording recording = test::readRecording(path());
    EXPECT_LT(clickError(recording, 5000, 20.0), 1e-6);
    EXPECT_LT(clickError(recording, 6000, 20e-6), 1e-6);
    EXPECT_LT(clickError(recording, 4000, -20e-6), 1e-6);
  }
}

TEST_F(SoundFile, LimitedPeaksReachFullScaleAndNothingMoves) {
  for (const SampleFormat format : {SampleFormat::float32, SampleFormat::pcm16}) {
    SoundFileSettings settings;
    settings.format = format;
    settings.limit = true;
    std::vector<float> samples(120'000, 0.0F);
    addClick(samples, 5000, 200.0);
    addClick(samples, 4800, 2.0);     // before the look-ahead: untouched
    addClick(samples, 110'000, 2.0);  // after the release: untouched
    auto writer = SoundFileWriter::create(path(), settings);
    ASSERT_TRUE(writer);
    ASSERT_TRUE(writer->write(std::array{samples.data()}, 5003));
    ASSERT_TRUE(writer->write(std::array{samples.data() + 5003}, samples.size() - 5003));
    ASSERT_TRUE(writer->finish());
    EXPECT_EQ(writer->peakPressure(), 200.0F);
    EXPECT_EQ(writer->clippedSamples(), 0u);
    EXPECT_NEAR(writer->gainReduction(), 20.0, 1e-4);
    const Recording recording = test::readRecording(path());
    ASSERT_EQ(recording.samples.size(), samples.size());
    EXPECT_NEAR(recording.peak(), 1.0, 1.0 / 32768.0);
    const double step = format == SampleFormat::pcm16 ? 20.0 / 32768.0 / 2.0 : 1e-6;  // of 2 Pa
    EXPECT_LT(clickError(recording, 4800, 2.0), step);
    EXPECT_LT(clickError(recording, 110'000, 2.0), step);
    EXPECT_LT(clickError(recording, 5000, 20.0), 0.01);  // the release begins inside the click
  }
}

TEST_F(SoundFile, LimitedFilesShorterThanTheLookAheadAreWhole) {
  for (const std::size_t frames : {0U, 1U, 20U, 95U, 96U}) {
    SoundFileSettings settings;
    settings.limit = true;
    writeMono(path(), settings, std::vector<float>(frames, 10.0F));
    EXPECT_EQ(test::readRecording(path()).samples, std::vector<double>(frames, 0.5));
  }
}

TEST_F(SoundFile, ChannelsAreInterleavedInOrder) {
  const std::vector<float> left = slowWave(20001, 5.0F);  // longer than one block of the writer
  const std::vector<float> right = slowWave(20001, -3.0F);
  SoundFileSettings settings;
  settings.channels = 2;
  settings.sampleRate = 44100.0;
  auto writer = SoundFileWriter::create(path(), settings);
  ASSERT_TRUE(writer);
  ASSERT_TRUE(writer->write(std::array{left.data(), right.data()}, 9));
  ASSERT_TRUE(writer->write(std::array{left.data() + 9, right.data() + 9}, left.size() - 9));
  ASSERT_TRUE(writer->finish());
  const Recording recording = test::readRecording(path());
  EXPECT_EQ(recording.info.samplerate, 44100);
  ASSERT_EQ(recording.info.channels, 2);
  ASSERT_EQ(recording.samples.size(), 2 * left.size());
  for (std::size_t frame = 0; frame < left.size(); ++frame) {
    EXPECT_FLOAT_EQ(static_cast<float>(recording.samples[2 * frame]), left[frame] / 20.0F);
    EXPECT_FLOAT_EQ(static_cast<float>(recording.samples[2 * frame + 1]), right[frame] / 20.0F);
  }
}

TEST_F(SoundFile, Pcm16ClipsAndCounts) {
  SoundFileSettings settings;
  settings.format = SampleFormat::pcm16;
  const std::vector<float> samples = {10.0F, 25.0F, -25.0F, 20.0F, -20.0F, 0.001F};
  auto writer = SoundFileWriter::create(path(), settings);
  ASSERT_TRUE(writer);
  ASSERT_TRUE(writer->write(std::array{samples.data()}, samples.size()));
  EXPECT_EQ(writer->clippedSamples(), 2u);
  EXPECT_EQ(writer->peakPressure(), 25.0);
  ASSERT_TRUE(writer->finish());
  const Recording recording = test::readRecording(path());
  EXPECT_EQ(recording.info.format, SF_FORMAT_WAV | SF_FORMAT_PCM_16);
  ASSERT_EQ(recording.samples.size(), samples.size());
  const double step = 1.0 / 32768.0;
  EXPECT_EQ(recording.samples[0], 0.5);
  EXPECT_EQ(recording.samples[1], 1.0 - step);
  EXPECT_EQ(recording.samples[2], -1.0);
  EXPECT_EQ(recording.samples[3], 1.0 - step);
  EXPECT_EQ(recording.samples[4], -1.0);
  EXPECT_NEAR(recording.samples[5], 0.001 / 20.0, 0.5 * step);
}

TEST_F(SoundFile, NormalisedPeakIsOne) {
  SoundFileSettings settings;
  settings.normalize = true;
  std::vector<float> samples = slowWave(30000, 0.003F);
  samples[12345] = -0.0371F;
  writeMono(path(), settings, samples);
  const Recording recording = test::readRecording(path());
  EXPECT_EQ(recording.info.format, SF_FORMAT_WAVEX | SF_FORMAT_FLOAT);
  ASSERT_EQ(recording.samples.size(), samples.size());
  EXPECT_EQ(recording.samples[12345], -1.0);
  for (std::size_t frame = 0; frame < samples.size(); ++frame)
    EXPECT_NEAR(recording.samples[frame], samples[frame] / 0.0371F, 1e-6);
  EXPECT_EQ(folder_.entries(), 1u);
}

TEST_F(SoundFile, NormalisedPcm16OfLoudSoundDoesNotClip) {
  SoundFileSettings settings;
  settings.normalize = true;
  settings.format = SampleFormat::pcm16;
  const std::vector<float> samples = {100.0F, -200.0F, 50.0F};
  auto writer = SoundFileWriter::create(path(), settings);
  ASSERT_TRUE(writer);
  ASSERT_TRUE(writer->write(std::array{samples.data()}, samples.size()));
  ASSERT_TRUE(writer->finish());
  EXPECT_EQ(writer->clippedSamples(), 0u);
  EXPECT_EQ(test::readRecording(path()).samples, (std::vector<double>{0.5, -1.0, 0.25}));
}

TEST_F(SoundFile, NormalisedPeakIsWhatIsAskedForButNotOfWhatIsTooQuiet) {
  const SoundFileSettings settings{
      .normalize = true, .normalizedPeak = 0.5, .leastFullScale = 0.02};
  writeMono(path(), settings, {1.0F, -4.0F});
  EXPECT_EQ(test::readRecording(path()).samples, (std::vector<double>{0.125, -0.5}));
  EXPECT_EQ(test::readRecording(path()).comment, "full scale 8 Pa");
  writeMono(path(), settings, {1e-3F, -2e-3F});
  EXPECT_NEAR(test::readRecording(path()).samples[1], -0.1, 1e-7);
  EXPECT_EQ(test::readRecording(path()).comment, "full scale 0.02 Pa");
}

TEST_F(SoundFile, CommentHasTheFullScale) {
  writeMono(path(), {}, {1.0F});
  EXPECT_EQ(test::readRecording(path()).comment, "full scale 20 Pa");
  writeMono(path(), {.format = SampleFormat::pcm16, .fullScalePressure = 1.25}, {1.0F});
  EXPECT_EQ(test::readRecording(path()).comment, "full scale 1.25 Pa");
}

// RIFF (Microsoft, 1994): formats other than PCM have an extension, and a chunk "fact".
TEST_F(SoundFile, FloatHeaderHasTheExtensionAndTheFacts) {
  writeMono(path(), {}, {1.0F, 2.0F});
  const std::string bytes = contents(path());
  const std::size_t format = bytes.find("fmt ");
  ASSERT_NE(format, std::string::npos);
  EXPECT_GE(static_cast<int>(bytes[format + 4]), 18);
  const std::size_t facts = bytes.find("fact");
  ASSERT_NE(facts, std::string::npos);
  EXPECT_EQ(static_cast<int>(bytes[facts + 8]), 2);  // frames
}

TEST_F(SoundFile, NormalisedSilenceStaysSilent) {
  SoundFileSettings settings;
  settings.normalize = true;
  writeMono(path(), settings, std::vector<float>(100, 0.0F));
  EXPECT_EQ(test::readRecording(path()).samples, std::vector<double>(100, 0.0));
}

TEST_F(SoundFile, UnfinishedFileLeavesWhatWasThereAndNothingElse) {
  std::ofstream(path()) << "old";
  for (const bool normalize : {false, true}) {
    SoundFileSettings settings;
    settings.normalize = normalize;
    auto writer = SoundFileWriter::create(path(), settings);
    ASSERT_TRUE(writer);
    const std::vector<float> samples = slowWave(50000, 1.0F);
    ASSERT_TRUE(writer->write(std::array{samples.data()}, samples.size()));
    EXPECT_EQ(contents(path()), "old");
  }
  EXPECT_EQ(contents(path()), "old");
  EXPECT_EQ(folder_.entries(), 1u);
}

TEST_F(SoundFile, FinishedFileReplacesWhatWasThere) {
  std::ofstream(path()) << "old";
  writeMono(path(), {}, {1.0F, 2.0F});
  EXPECT_EQ(test::readRecording(path()).samples.size(), 2u);
  EXPECT_EQ(folder_.entries(), 1u);
}

TEST_F(SoundFile, SameSoundGivesTheSameBytes) {
  writeMono(folder_ / "one.wav", {}, slowWave(1000, 1.0F));
  writeMono(folder_ / "two.wav", {}, slowWave(1000, 1.0F));
  EXPECT_EQ(contents(folder_ / "one.wav"), contents(folder_ / "two.wav"));
}

TEST_F(SoundFile, TwoWritersOfOnePathDoNotMix) {
  auto first = SoundFileWriter::create(path(), {});
  auto second = SoundFileWriter::create(path(), {});
  ASSERT_TRUE(first);
  ASSERT_TRUE(second);
  const float one = 2.0F;
  const float two = 4.0F;
  ASSERT_TRUE(first->write(std::array{&one}, 1));
  ASSERT_TRUE(second->write(std::array{&two}, 1));
  ASSERT_TRUE(first->finish());
  ASSERT_TRUE(second->finish());
  EXPECT_FLOAT_EQ(static_cast<float>(test::readRecording(path()).samples.at(0)), 0.2F);
  EXPECT_EQ(folder_.entries(), 1u);
}

TEST_F(SoundFile, MissingFolderIsNamed) {
  const auto writer = SoundFileWriter::create(folder_ / "nowhere/clicks.wav", {});
  ASSERT_FALSE(writer);
  const std::string& message = writer.error().message;
  EXPECT_NE(message.find((folder_ / "nowhere").string()), std::string::npos) << message;
  EXPECT_NE(message.find("does not exist"), std::string::npos) << message;
}

TEST_F(SoundFile, RefusesAFolderAsItsName) {
  EXPECT_FALSE(SoundFileWriter::create(folder_.path(), {}));
  EXPECT_FALSE(SoundFileWriter::create(folder_ / "", {}));
}

TEST_F(SoundFile, RefusesToReplaceWhatIsNoFile) {
  ASSERT_EQ(mkfifo(path().c_str(), 0600), 0);
  EXPECT_FALSE(SoundFileWriter::create(path(), {}));
  EXPECT_TRUE(fs::is_fifo(path()));
  EXPECT_EQ(folder_.entries(), 1u);
}

TEST_F(SoundFile, RefusesSettingsOutOfRange) {
  EXPECT_FALSE(SoundFileWriter::create(path(), {.channels = 0}));
  EXPECT_FALSE(SoundFileWriter::create(path(), {.channels = 5000}));
  EXPECT_FALSE(SoundFileWriter::create(path(), {.sampleRate = 0.0}));
  EXPECT_FALSE(SoundFileWriter::create(path(), {.fullScalePressure = 0.0}));
  EXPECT_FALSE(SoundFileWriter::create(path(), {.normalize = true, .normalizedPeak = 0.0}));
  EXPECT_FALSE(SoundFileWriter::create(path(), {.normalize = true, .leastFullScale = -1.0}));
  EXPECT_FALSE(SoundFileWriter::create(
      path(), {.fullScalePressure = std::numeric_limits<double>::infinity()}));
  EXPECT_FALSE(SoundFileWriter::create(path(), {.limit = true, .normalize = true}));
  EXPECT_FALSE(
      SoundFileWriter::create(path(), {.sampleRate = std::numeric_limits<double>::quiet_NaN()}));
  EXPECT_EQ(folder_.entries(), 0u);
}

TEST_F(SoundFile, WhatIsNotFiniteBecomesSilenceAndNothingElseDoes) {
  for (const bool limit : {false, true}) {
    auto writer = SoundFileWriter::create(path(), {.limit = limit});
    ASSERT_TRUE(writer);
    const float infinite = std::numeric_limits<float>::infinity();
    const std::vector<float> samples = {10.0F, std::numeric_limits<float>::quiet_NaN(), infinite,
                                        -infinite, 5.0F};
    ASSERT_TRUE(writer->write(std::array{samples.data()}, samples.size()));
    EXPECT_EQ(writer->samplesNotFinite(), 3u);
    EXPECT_EQ(writer->peakPressure(), 10.0);
    ASSERT_TRUE(writer->finish());
    EXPECT_EQ(test::readRecording(path()).samples, (std::vector<double>{0.5, 0.0, 0.0, 0.0, 0.25}));
  }
}

TEST_F(SoundFile, RefusesTheWrongNumberOfChannels) {
  auto writer = SoundFileWriter::create(path(), {.channels = 2});
  ASSERT_TRUE(writer);
  const float sample = 0.0F;
  EXPECT_FALSE(writer->write(std::array{&sample}, 1));
  ASSERT_TRUE(writer->write(std::array{&sample, &sample}, 1));  // nothing else is lost
  ASSERT_TRUE(writer->finish());
  EXPECT_EQ(test::readRecording(path()).info.frames, 1);
}

TEST_F(SoundFile, FinishesOnce) {
  auto writer = SoundFileWriter::create(path(), {});
  ASSERT_TRUE(writer);
  ASSERT_TRUE(writer->finish());
  EXPECT_FALSE(writer->finish());
  EXPECT_EQ(test::readRecording(path()).info.frames, 0);
}

}  // namespace
}  // namespace carom
