#include "audio/propagation/hrtf.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/constants.h"
#include "tests/support/no_alloc_scope.h"

namespace carom {

using namespace audio;

namespace {

using namespace test;

using std::numbers::pi;
using testing::HasSubstr;

/// A spiral of directions, nearly even over the sphere.
std::vector<Vec3> spiral(std::size_t count) {
  std::vector<Vec3> points;
  for (std::size_t index = 0; index < count; ++index) {
    const double y = 1.0 - (2.0 * static_cast<double>(index) + 1.0) / static_cast<double>(count);
    const double angle = pi * (3.0 - std::sqrt(5.0)) * static_cast<double>(index);
    const double radius = std::sqrt(1.0 - y * y);
    points.emplace_back(radius * std::sin(angle), y, radius * std::cos(angle));
  }
  return points;
}

/// Rings of equal elevation every 10 degrees, as in many measured sets: many points lie on one
/// circle.
std::vector<Vec3> rings(double lowest) {
  std::vector<Vec3> points;
  for (double elevation = lowest; elevation < 89.0; elevation += 10.0)
    for (double azimuth = 0.0; azimuth < 359.0; azimuth += 15.0) {
      const double up = elevation * pi / 180.0;
      const double right = azimuth * pi / 180.0;
      points.emplace_back(std::cos(up) * std::sin(right), std::sin(up),
                          -std::cos(up) * std::cos(right));
    }
  return points;
}

Vec3 atAzimuth(double degreesToTheRight, double degreesUp = 0.0) {
  const double right = degreesToTheRight * pi / 180.0;
  const double up = degreesUp * pi / 180.0;
  return {std::cos(up) * std::sin(right), std::sin(up), -std::cos(up) * std::cos(right)};
}

/// Time in s by which an ear hears after the middle of the head: the ears are two points in free
/// air, 18 cm apart.
double pointDelay(const Vec3& direction, Ear ear) {
  const double side = ear == Ear::left ? -1.0 : 1.0;
  return -side * 0.09 * direction.x() / 343.0;
}

/// A smooth pulse, with energy up to some 6 kHz, that arrives `pointDelay` after the middle of the
/// head.
HrtfMeasurements twoPoints(const std::vector<Vec3>& directions, double rate) {
  HrtfMeasurements set;
  set.sampleRate = rate;
  for (const Vec3& direction : directions) {
    HrtfMeasurement item;
    item.direction = 1.4 * direction;
    for (const Ear ear : {Ear::left, Ear::right}) {
      auto& response = item.response[static_cast<std::size_t>(ear)];
      for (int sample = 0; sample < 200; ++sample) {
        const double time = sample / rate - 1.5e-3 - pointDelay(direction, ear);
        response.push_back(static_cast<float>(std::exp(-0.5 * std::pow(time / 6e-5, 2.0))));
      }
    }
    set.items.push_back(item);
  }
  return set;
}

std::vector<double> responseOf(const HrtfSet& set, const Vec3& direction, Ear ear) {
  std::vector<double> response(set.length());
  set.blend(set.lookup(direction), ear, response);
  return response;
}

double energy(const std::vector<double>& response) {
  double sum = 0.0;
  for (const double sample : response)
    sum += sample * sample;
  return sum;
}

std::complex<double> spectrum(const std::vector<double>& response, double frequency, double rate) {
  std::complex<double> sum = 0.0;
  for (std::size_t sample = 0; sample < response.size(); ++sample)
    sum += response[sample] *
           std::polar(1.0, -2.0 * pi * frequency / rate * static_cast<double>(sample));
  return sum;
}

/// Time in s by which `later` lags `earlier`, from the difference of their phases at `frequency`.
double phaseDelay(const std::vector<double>& earlier, const std::vector<double>& later,
                  double frequency, double rate) {
  return std::arg(spectrum(earlier, frequency, rate) / spectrum(later, frequency, rate)) /
         (2.0 * pi * frequency);
}

TEST(SphereMesh, NoOtherPointLiesInTheCircleOfATriangle) {
  for (const auto& points : {spiral(300), rings(-80.0)}) {
    const auto mesh = SphereMesh::create(points);
    ASSERT_TRUE(mesh.has_value());
    EXPECT_EQ(mesh->triangles(), 2 * points.size() - 4);  // Euler
    for (std::size_t triangle = 0; triangle < mesh->triangles(); ++triangle) {
      const auto& corner = mesh->corners(triangle);
      const Vec3 axis = (points[corner[1]] - points[corner[0]])
                            .cross(points[corner[2]] - points[corner[0]])
                            .normalized();
      const double height = axis.dot(points[corner[0]]);
      for (const Vec3& point : points)
        ASSERT_LT(axis.dot(point), height + 1e-4);
    }
  }
}

TEST(SphereMesh, WeightsRebuildEveryDirection) {
  for (const auto& points : {spiral(12), spiral(300), rings(-80.0)}) {
    const auto mesh = SphereMesh::create(points);
    ASSERT_TRUE(mesh.has_value());
    for (const Vec3& direction : spiral(5000)) {
      const SphereWeights where = mesh->weights(3.0 * direction);
      Vec3 sum = Vec3::Zero();
      double total = 0.0;
      for (std::size_t corner = 0; corner < 3; ++corner) {
        ASSERT_GE(where.weight[corner], 0.0);
        total += where.weight[corner];
        sum += where.weight[corner] * points[where.index[corner]];
      }
      ASSERT_NEAR(total, 1.0, 1e-12);
      ASSERT_LT((sum.normalized() - direction).norm(), 1e-5);
    }
    for (std::size_t index = 0; index < points.size(); ++index) {
      const SphereWeights where = mesh->weights(points[index]);
      const auto most = std::max_element(where.weight.begin(), where.weight.end());
      ASSERT_NEAR(*most, 1.0, 1e-9);
      ASSERT_EQ(where.index[static_cast<std::size_t>(most - where.weight.begin())], index);
    }
  }
}

TEST(SphereMesh, RefusesPointsThatDoNotSurround) {
  EXPECT_FALSE(SphereMesh::create({}).has_value());
  EXPECT_FALSE(SphereMesh::create(std::vector<Vec3>(9, Vec3::UnitX())).has_value());
  EXPECT_FALSE(SphereMesh::create(rings(20.0)).has_value());
  EXPECT_FALSE(SphereMesh::create({Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ()}).has_value());
}

TEST(SphereMesh, AnythingCanBeAsked) {
  const auto mesh = SphereMesh::create(spiral(50));
  ASSERT_TRUE(mesh.has_value());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const Vec3& direction : {Vec3(0, 0, 0), Vec3(nan, 1, 0), Vec3(infinity, 0, 0)})
    EXPECT_EQ(mesh->weights(direction).weight[0], 1.0);
}

// Between directions, time differences must be those of two points in free air, though the nearest
// measurements are up to 15 degrees away: adding responses would make a comb filter there.
TEST(Hrtf, BetweenDirectionsLevelAndDelayAreThoseOfTheField) {
  for (const double rate : {44100.0, 48000.0, 96000.0}) {
    const auto set = HrtfSet::create(twoPoints(spiral(400), rate), kRate);
    ASSERT_TRUE(set) << set.error().message;
    for (const Vec3& direction : spiral(97)) {
      const auto left = responseOf(*set, direction, Ear::left);
      const auto right = responseOf(*set, direction, Ear::right);
      const double expected = pointDelay(direction, Ear::right) - pointDelay(direction, Ear::left);
      EXPECT_NEAR(phaseDelay(left, right, 500.0, kRate), expected, 5e-6);
      EXPECT_NEAR(std::abs(spectrum(left, 500.0, kRate)), 1.0, 0.02);
      const double loss =
          std::abs(spectrum(left, 6000.0, kRate)) /
          std::abs(spectrum(responseOf(*set, direction, Ear::right), 6000.0, kRate));
      EXPECT_NEAR(loss, 1.0, 0.02);
    }
  }
}

TEST(Hrtf, LatencyIsTheArrivalInTheMiddleOfTheHead) {
  const auto set = HrtfSet::create(twoPoints(spiral(400), kRate), kRate);
  ASSERT_TRUE(set) << set.error().message;
  const Vec3 front = -Vec3::UnitZ();
  const auto response = responseOf(*set, front, Ear::left);
  const auto peak = std::max_element(response.begin(), response.end());
  // The onset of the pulse, a tenth of its peak, is sigma sqrt(2 ln 10) before the peak.
  const double onset =
      static_cast<double>(peak - response.begin()) / kRate - 6e-5 * std::sqrt(2.0 * std::log(10.0));
  EXPECT_NEAR(onset, set->latency(), 1.0 / kRate);
}

TEST(Hrtf, AMeasuredDirectionGivesWhatWasMeasured) {
  const auto measured = twoPoints(spiral(100), kRate);
  const auto set = HrtfSet::create(measured, kRate, {1e-6});
  ASSERT_TRUE(set) << set.error().message;
  const auto& response = measured.items[42].response[1];
  const std::vector<double> wanted(response.begin(), response.end());
  const auto given = responseOf(*set, measured.items[42].direction, Ear::right);
  const double scale = std::sqrt(energy(wanted) / energy(given));
  // The responses are equal but for their common delay: their magnitudes are compared up to 15 kHz.
  const double top = std::abs(spectrum(wanted, 500.0, kRate));
  for (double frequency = 500.0; frequency < 15000.0; frequency += 500.0)
    EXPECT_NEAR(scale * std::abs(spectrum(given, frequency, kRate)) / top,
                std::abs(spectrum(wanted, frequency, kRate)) / top, 2e-3);
}

TEST(Hrtf, AHorizontalRingIsEnough) {
  std::vector<Vec3> ring;
  for (double azimuth = 0.0; azimuth < 359.0; azimuth += 15.0)
    ring.push_back(atAzimuth(azimuth));
  const auto set = HrtfSet::create(twoPoints(ring, kRate), kRate);
  ASSERT_TRUE(set) << set.error().message;
  EXPECT_EQ(set->directions(), ring.size() + 2);
  std::vector<double> aligned(set->alignedLength());
  const SphereWeights up = set->lookup(Vec3::UnitY());
  EXPECT_NEAR(set->blendAligned(up, Ear::left, aligned), set->blendAligned(up, Ear::right, aligned),
              1e-6);
}

TEST(Hrtf, LookupAndBlendDoNotAllocate) {
  const auto set = HrtfSet::create(twoPoints(spiral(100), kRate), kRate);
  ASSERT_TRUE(set);
  std::vector<double> response(set->length());
  const test::NoAllocScope scope;
  const SphereWeights where = set->lookup(Vec3(1.0, 2.0, 3.0));
  set->blend(where, Ear::left, response);
  set->blendAligned(where, Ear::right, response);
  EXPECT_EQ(scope.allocations(), 0u);
}

TEST(Hrtf, RefusesWhatIsNoSet) {
  const auto good = twoPoints(spiral(20), kRate);
  const auto reason = [](const HrtfMeasurements& set, double rate = kRate) {
    const auto result = HrtfSet::create(set, rate);
    return result ? std::string() : result.error().message;
  };
  EXPECT_EQ(reason(good), "");
  EXPECT_THAT(reason(good, 100.0), HasSubstr("wanted sample rate"));
  EXPECT_THAT(reason(good, std::nan("")), HasSubstr("wanted sample rate"));
  EXPECT_THAT(reason({}), HasSubstr("0 directions"));
  EXPECT_FALSE(HrtfSet::create(good, kRate, {-1.0}));
  auto bad = good;
  bad.sampleRate = -1.0;
  EXPECT_THAT(reason(bad), HasSubstr("own sample rate"));
  bad = good;
  bad.items[3].response[1].pop_back();
  EXPECT_THAT(reason(bad), HasSubstr("measurement 3"));
  bad = good;
  bad.items[4].response[0][7] = std::numeric_limits<float>::infinity();
  EXPECT_THAT(reason(bad), HasSubstr("measurement 4: it holds a value that is not finite"));
  bad = good;
  std::fill(bad.items[5].response[0].begin(), bad.items[5].response[0].end(), 0.0F);
  EXPECT_THAT(reason(bad), HasSubstr("measurement 5: it is silent"));
  bad = good;
  bad.items[6].direction.setZero();
  EXPECT_THAT(reason(bad), HasSubstr("measurement 6: its direction"));
  bad = good;
  bad.items[7].delay[1] = 1e9;
  EXPECT_THAT(reason(bad), HasSubstr("measurement 7: its delay"));
  EXPECT_THAT(reason(twoPoints(std::vector<Vec3>(9, Vec3::UnitX()), kRate)), HasSubstr("surround"));
  // 25 directions of two ears, 16384 samples at 8 kHz each, are 48 times as many at 384 kHz.
  bad = twoPoints(spiral(25), kRate);
  bad.sampleRate = 8000.0;
  for (HrtfMeasurement& item : bad.items)
    for (std::vector<float>& response : item.response)
      response.resize(16384);
  EXPECT_THAT(reason(bad, 384000.0), HasSubstr("39321600 samples"));
}

}  // namespace
}  // namespace carom
