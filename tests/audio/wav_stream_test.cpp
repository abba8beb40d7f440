#include "audio/io/wav_stream.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sndfile.h>

#include "tests/support/recording.h"
#include "tests/support/temporary_folder.h"

namespace carom::audio {
namespace {

namespace fs = std::filesystem;

using test::contents;
using test::Recording;

/// Returns samples that turn quickly, so that each differs from its neighbours.
std::vector<float> wave(std::size_t samples) {
  return test::sineWave(samples, 0.9F, 0.1F);
}

/// Writes the same by libsndfile alone.
void writeByLibsndfile(const fs::path& path, const WavStream::Format& format,
                       const std::vector<float>& samples) {
  const bool isFloat = format.samples == SampleFormat::float32;
  SF_INFO info = {};
  info.samplerate = format.sampleRate;
  info.channels = static_cast<int>(format.channels);
  info.format = isFloat ? SF_FORMAT_WAVEX | SF_FORMAT_FLOAT : SF_FORMAT_WAV | SF_FORMAT_PCM_16;
  SNDFILE* const file = sf_open(path.c_str(), SFM_WRITE, &info);
  ASSERT_NE(file, nullptr);
  sf_command(file, SFC_SET_ADD_PEAK_CHUNK, nullptr, SF_FALSE);
  sf_set_string(file, SF_STR_COMMENT, "full scale 20 Pa");
  const auto count = static_cast<sf_count_t>(samples.size());
  if (isFloat) {
    EXPECT_EQ(sf_write_float(file, samples.data(), count), count);
  } else {
    std::vector<short> shorts;
    for (const float sample : samples)
      shorts.push_back(static_cast<short>(std::lrint(static_cast<double>(sample) * 32768.0)));
    EXPECT_EQ(sf_write_short(file, shorts.data(), count), count);
  }
  sf_close(file);
}

TEST(WavStream, GivesTheBytesOfLibsndfile) {
  const test::TemporaryFolder folder;
  for (const SampleFormat samples : {SampleFormat::float32, SampleFormat::pcm16}) {
    for (std::size_t channels = 1; channels <= 8; ++channels) {
      for (const std::size_t frames : {1U, 2U, 1000U}) {
        const WavStream::Format format{
            .samples = samples, .sampleRate = 44100, .channels = channels};
        const std::vector<float> all = wave(channels * frames);
        writeByLibsndfile(folder / "theirs.wav", format, all);
        auto stream = WavStream::create(folder / "ours.wav", format);
        ASSERT_TRUE(stream) << stream.error().message;
        const auto half = all.begin() + static_cast<std::ptrdiff_t>(channels * (frames / 2));
        ASSERT_TRUE(stream->append(std::vector<float>(all.begin(), half)));
        ASSERT_TRUE(stream->append(std::vector<float>(half, all.end())));
        ASSERT_TRUE(stream->close());
        EXPECT_TRUE(contents(folder / "ours.wav") == contents(folder / "theirs.wav"))
            << channels << " channels, " << frames << " frames";
      }
    }
  }
}

TEST(WavStream, CanBePlayedUpToTheLatestAppend) {
  const test::TemporaryFolder folder;
  auto stream = WavStream::create(folder / "a.wav", {.channels = 2});
  ASSERT_TRUE(stream);
  const std::vector<float> part = wave(200);
  for (int parts = 1; parts <= 5; ++parts) {
    ASSERT_TRUE(stream->append(part));
    const Recording now = test::readRecording(folder / "a.wav");
    ASSERT_EQ(now.info.frames, 100 * parts);
    EXPECT_EQ(now.samples.back(), static_cast<double>(part.back()));
  }
}

// The limit is lowered, so that the test needs no 4 GiB.
TEST(WavStream, BeyondTheLimitOfRiffItIsRf64) {
  const test::TemporaryFolder folder;
  const fs::path path = folder / "long.wav";
  for (const SampleFormat samples : {SampleFormat::float32, SampleFormat::pcm16}) {
    for (const double fullScale : {1.0, 20.0, 100.5, 0.00123457, 1.23457e-05}) {
      auto stream = WavStream::create(
          path, {.samples = samples, .channels = 2, .fullScale = fullScale, .riffLimit = 1000});
      ASSERT_TRUE(stream);
      const std::vector<float> part = wave(100);
      for (int parts = 1; parts <= 20; ++parts) {
        ASSERT_TRUE(stream->append(part));
        const Recording now = test::readRecording(path);
        ASSERT_EQ(now.info.frames, 50 * parts);
        EXPECT_EQ(now.samples[now.samples.size() - 100], now.samples[0]);
        EXPECT_NEAR(now.samples.back(), static_cast<double>(part.back()), 1.0 / 32768.0);
      }
      ASSERT_TRUE(stream->close());
      const Recording whole = test::readRecording(path);
      EXPECT_EQ(whole.info.format & SF_FORMAT_TYPEMASK, SF_FORMAT_RF64);
      ASSERT_EQ(whole.info.frames, 1000);
      EXPECT_NEAR(whole.samples.back(), static_cast<double>(part.back()), 1.0 / 32768.0);
      std::ostringstream comment;
      comment << "full scale " << fullScale << " Pa";
      EXPECT_EQ(whole.comment, comment.str());
    }
  }
}

}  // namespace
}  // namespace carom::audio
