#include "audio/propagation/sofa_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "audio/propagation/hrtf.h"
#include "tests/support/constants.h"
#include "tests/support/temporary_folder.h"

namespace carom {

using namespace audio;

namespace {

using namespace test;

namespace fs = std::filesystem;
using std::numbers::pi;
using testing::HasSubstr;

Vec3 atAzimuth(double degreesToTheRight, double degreesUp = 0.0) {
  const double right = degreesToTheRight * pi / 180.0;
  const double up = degreesUp * pi / 180.0;
  return {std::cos(up) * std::sin(right), std::sin(up), -std::cos(up) * std::cos(right)};
}

/// The default set: MIT's KEMAR, measured at 1.4 m every 5 degrees around (Gardner and Martin
/// 1995), left and right mirrored.
class DefaultHrtf : public testing::Test {
 protected:
  void SetUp() override {
    auto set = defaultHrtf(kRate);
    ASSERT_TRUE(set) << set.error().message;
    set_ = *set;
  }

  std::vector<double> response(const Vec3& direction, Ear ear) const {
    std::vector<double> result(set_->length());
    set_->blend(set_->lookup(direction), ear, result);
    return result;
  }

  /// Time in s by which the left ear hears the sound later than the right one.
  double leftIsLater(const Vec3& direction) const {
    std::vector<double> aligned(set_->alignedLength());
    const SphereWeights where = set_->lookup(direction);
    return set_->blendAligned(where, Ear::left, aligned) -
           set_->blendAligned(where, Ear::right, aligned);
  }

  std::shared_ptr<const HrtfSet> set_;
};

double energy(const std::vector<double>& response) {
  double sum = 0.0;
  for (const double sample : response)
    sum += sample * sample;
  return sum;
}

double power(const std::vector<double>& response, double frequency) {
  std::complex<double> sum = 0.0;
  for (std::size_t sample = 0; sample < response.size(); ++sample)
    sum += response[sample] *
           std::polar(1.0, -2.0 * pi * frequency / kRate * static_cast<double>(sample));
  return std::norm(sum);
}

double difference(const std::vector<double>& one, const std::vector<double>& other) {
  double sum = 0.0;
  for (std::size_t sample = 0; sample < one.size(); ++sample)
    sum += (one[sample] - other[sample]) * (one[sample] - other[sample]);
  return std::sqrt(sum / std::max(energy(one), energy(other)));
}

TEST_F(DefaultHrtf, IsSharedAndSmall) {
  EXPECT_EQ(*defaultHrtf(kRate), set_);
  EXPECT_NE(*defaultHrtf(44100.0), set_);
  EXPECT_EQ(set_->directions(), 711u);  // 710 were measured; straight down is added
  EXPECT_LT(set_->length(), 350u);
  RecordProperty("aligned", static_cast<int>(set_->alignedLength()));
  RecordProperty("whole", static_cast<int>(set_->length()));
  RecordProperty("latency_us", static_cast<int>(1e6 * set_->latency()));
}

TEST_F(DefaultHrtf, SourceOnTheRightIsLouderAndEarlierInTheRightEar) {
  const double louder =
      energy(response(atAzimuth(90.0), Ear::right)) / energy(response(atAzimuth(90.0), Ear::left));
  EXPECT_GT(10.0 * std::log10(louder), 8.0);
  // Woodworth's formula for a sphere of 8.75 cm gives a / c (pi / 2 + 1) = 0.66 ms.
  EXPECT_GT(leftIsLater(atAzimuth(90.0)), 0.6e-3);
  EXPECT_LT(leftIsLater(atAzimuth(90.0)), 0.8e-3);
  EXPECT_NEAR(leftIsLater(atAzimuth(-90.0)), -leftIsLater(atAzimuth(90.0)), 1e-6);
}

TEST_F(DefaultHrtf, FollowsWoodworthAroundTheFront) {
  for (double azimuth = 0.0; azimuth <= 90.0; azimuth += 7.5) {
    const double angle = azimuth * pi / 180.0;
    EXPECT_NEAR(leftIsLater(atAzimuth(azimuth)), 0.0875 / 343.0 * (angle + std::sin(angle)), 0.1e-3)
        << azimuth;
  }
}

TEST_F(DefaultHrtf, AheadBothEarsHearTheSameAtUnitGain) {
  const auto left = response(atAzimuth(0.0), Ear::left);
  const auto right = response(atAzimuth(0.0), Ear::right);
  EXPECT_LT(difference(left, right), 1e-6);
  double sum = 0.0;
  int count = 0;
  for (double frequency = 200.0; frequency <= 1000.0; frequency += 12.5, count += 2)
    sum += power(left, frequency) + power(right, frequency);
  EXPECT_NEAR(10.0 * std::log10(sum / count), 0.0, 0.05);
}

TEST_F(DefaultHrtf, MirroredDirectionsSwapTheEars) {
  for (const double elevation : {-40.0, 0.0, 30.0, 50.0})
    for (double azimuth = 0.0; azimuth < 180.0; azimuth += 11.0)
      EXPECT_NEAR(leftIsLater(atAzimuth(azimuth, elevation)),
                  -leftIsLater(atAzimuth(-azimuth, elevation)), 40e-6)
          << azimuth << ' ' << elevation;
}

TEST_F(DefaultHrtf, IsContinuousAllAround) {
  for (const double elevation : {-75.0, -33.0, 0.0, 44.0}) {
    auto before = response(atAzimuth(0.0, elevation), Ear::left);
    double worst = 0.0;
    for (double azimuth = 0.02; azimuth <= 360.0; azimuth += 0.02) {
      auto now = response(atAzimuth(azimuth, elevation), Ear::left);
      worst = std::max(worst, difference(before, now));
      before = std::move(now);
    }
    EXPECT_LT(worst, 0.006) << elevation;
  }
}

// The set, resampled and aligned, gives back the file's own response at the file's own rate.
TEST_F(DefaultHrtf, AMeasuredDirectionGivesWhatTheFileHolds) {
  const auto file = readSofaFile(defaultSofaFile());
  ASSERT_TRUE(file) << file.error().message;
  const auto set = HrtfSet::load({}, file->sampleRate, {1e-4});
  ASSERT_TRUE(set) << set.error().message;
  double worst = 0.0;
  double scale = 0.0;
  for (std::size_t index = 0; index < file->items.size(); index += 7) {
    const HrtfMeasurement& item = file->items[index];
    for (const Ear ear : {Ear::left, Ear::right}) {
      const auto& response = item.response[static_cast<std::size_t>(ear)];
      const std::vector<double> wanted(response.begin(), response.end());
      std::vector<double> given(set->length());
      set->blend(set->lookup(item.direction), ear, given);
      for (double frequency = 200.0; frequency < 16000.0; frequency += 300.0) {
        const double turns = frequency * kRate / file->sampleRate;
        const double ratio = std::sqrt(power(given, turns) / power(wanted, turns));
        const double weight = std::sqrt(power(wanted, turns) / energy(wanted));
        if (scale == 0.0) scale = ratio;
        worst = std::max(worst, weight * std::abs(ratio / scale - 1.0));
      }
    }
  }
  EXPECT_LT(worst, 0.02);
}

class SofaFile : public testing::Test {
 protected:
  std::string errorOf(const std::string& bytes) const {
    const fs::path path = folder_ / "head.sofa";
    std::ofstream(path, std::ios::binary) << bytes;
    const auto set = HrtfSet::load(path, kRate);
    if (set) return "";
    EXPECT_THAT(set.error().message, HasSubstr("head.sofa"));
    EXPECT_EQ(set.error().message.find('\n'), std::string::npos);
    return set.error().message;
  }

  const test::TemporaryFolder folder_;
};

TEST_F(SofaFile, MissingFilesAndFoldersAreNamed) {
  const auto missing = HrtfSet::load(folder_ / "none.sofa", kRate);
  ASSERT_FALSE(missing);
  EXPECT_THAT(missing.error().message, HasSubstr("none.sofa': there is no such file"));
  const auto folder = HrtfSet::load(folder_.path(), kRate);
  ASSERT_FALSE(folder);
  EXPECT_THAT(folder.error().message, HasSubstr("not a regular file"));
}

TEST_F(SofaFile, NonsenseIsRefused) {
  EXPECT_NE(errorOf(""), "");
  EXPECT_NE(errorOf("RIFF____WAVEfmt "), "");
  EXPECT_NE(errorOf(std::string(100000, '\0')), "");
  std::string noise;
  std::uint32_t state = 1;
  for (int byte = 0; byte < 100000; ++byte)
    noise += static_cast<char>((state = state * 1664525u + 1013904223u) >> 24);
  EXPECT_NE(errorOf(noise), "");
  EXPECT_NE(errorOf("\x89HDF\r\n\x1a\n" + noise), "");
}

TEST_F(SofaFile, ATruncatedFileIsRefused) {
  const std::string whole = test::contents(defaultSofaFile());
  ASSERT_GT(whole.size(), 100000u);
  EXPECT_EQ(errorOf(whole), "");
  for (const double part : {0.0001, 0.001, 0.01, 0.1, 0.3, 0.5, 0.9})
    EXPECT_NE(errorOf(whole.substr(
                  0, static_cast<std::size_t>(part * static_cast<double>(whole.size())))),
              "")
        << part;
}

TEST_F(SofaFile, AnotherConventionIsRefusedByName) {
  std::string bytes = test::contents(defaultSofaFile());
  const std::string name = "SimpleFreeFieldHRIR";
  const std::size_t place = bytes.find(name);
  ASSERT_NE(place, std::string::npos);
  bytes.replace(place, name.size(), "SimpleFreeFieldHRXX");
  EXPECT_THAT(errorOf(bytes), HasSubstr("its convention is 'SimpleFreeFieldHRXX'"));
}

}  // namespace
}  // namespace carom
