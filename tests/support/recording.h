#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sndfile.h>

namespace carom::test {

/// A sound file, read back by libsndfile.
struct Recording {
  SF_INFO info = {};
  std::vector<double> samples;  ///< interleaved, 1.0 is full scale
  std::string comment;          ///< empty if the file has none

  std::size_t channels() const { return static_cast<std::size_t>(info.channels); }

  std::vector<double> channel(std::size_t index) const {
    std::vector<double> plane;
    for (std::size_t sample = index; sample < samples.size(); sample += channels())
      plane.push_back(samples[sample]);
    return plane;
  }

  double peak() const {
    double peak = 0.0;
    for (const double sample : samples)
      peak = std::max(peak, std::abs(sample));
    return peak;
  }
};

/// Reads a sound file; if it cannot be read, the recording is empty and the test fails.
inline Recording readRecording(const std::filesystem::path& path) {
  Recording recording;
  SNDFILE* file = sf_open(path.c_str(), SFM_READ, &recording.info);
  EXPECT_NE(file, nullptr) << sf_strerror(nullptr);
  if (file == nullptr) return recording;
  recording.samples.resize(
      static_cast<std::size_t>(recording.info.frames * recording.info.channels));
  sf_readf_double(file, recording.samples.data(), recording.info.frames);
  if (const char* const comment = sf_get_string(file, SF_STR_COMMENT)) recording.comment = comment;
  sf_close(file);
  return recording;
}

/// Returns samples to write: a sine that turns by `step` radians a sample.
inline std::vector<float> sineWave(std::size_t samples, float amplitude, float step) {
  std::vector<float> wave(samples);
  for (std::size_t sample = 0; sample < samples; ++sample)
    wave[sample] = amplitude * std::sin(step * static_cast<float>(sample));
  return wave;
}

}  // namespace carom::test
