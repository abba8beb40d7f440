#include "lab/video/camera_path.h"

#include <array>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scenes/values/camera_reader.h"
#include "tests/support/temporary_folder.h"

namespace carom::lab {

using scenes::CameraKey;

namespace {

using test::TemporaryFolder;
using testing::HasSubstr;

/// A key frame that looks along -Z.
CameraKey keyAt(double time, const Vec3& position) {
  CameraKey key;
  key.time = time;
  key.position = position;
  return key;
}

CameraKey keyTowards(double time, const Vec3& position, const Vec3& target) {
  CameraKey key = keyAt(time, position);
  key.hasTarget = true;
  key.target = target;
  key.orientation = Quat::FromTwoVectors(-Vec3::UnitZ(), target - position);
  return key;
}

/// Reads key frames from a text, in a world whose gravity is along -Y.
Result<std::vector<CameraKey>> readKeys(const std::string& text) {
  const TemporaryFolder folder;
  std::ofstream(folder / "way.json") << text;
  return scenes::loadCamera(folder / "way.json", {0.0, -9.81, 0.0});
}

TEST(CameraPaths, GoThroughTheirKeyFrames) {
  const std::vector<CameraKey> keys = {keyAt(1.0, {0.0, 0.0, 0.0}), keyAt(2.0, {1.0, 2.0, -1.0}),
                                       keyAt(4.0, {5.0, 2.0, 3.0})};
  const CameraPath path(keys);
  for (const CameraKey& key : keys)
    EXPECT_LT((path.at(key.time).position - key.position).norm(), 1e-12) << key.time;
  // They stand before the first and behind the last.
  EXPECT_EQ(path.at(0.0).position, keys.front().position);
  EXPECT_EQ(path.at(99.0).position, keys.back().position);
}

TEST(CameraPaths, OvershootNowhereAndStandWhereTwoKeyFramesAgree) {
  const CameraPath path({keyAt(0.0, {0.0, 1.0, 0.0}), keyAt(1.0, {3.0, 1.0, 0.0}),
                         keyAt(1.5, {3.0, 1.0, 0.0}), keyAt(2.0, {3.5, 0.0, 0.0})});
  double last = 0.0;
  for (double time = 0.0; time <= 2.0; time += 1e-3) {
    const Vec3 at = path.at(time).position;
    EXPECT_GE(at.x(), last - 1e-12) << time;
    EXPECT_LE(at.x(), 3.5 + 1e-12) << time;
    if (time > 1.0 && time < 1.5) {
      EXPECT_NEAR(at.x(), 3.0, 1e-12) << time;
    }
    last = at.x();
  }
}

TEST(CameraPaths, HaveNoCornersInTheirMotion) {
  const CameraPath path({keyAt(0.0, {0.0, 0.0, 0.0}), keyAt(1.0, {1.0, 0.0, 0.0}),
                         keyAt(3.0, {7.0, 0.0, 0.0}), keyAt(4.0, {8.0, 0.0, 0.0})});
  const double step = 1e-5;
  const auto speed = [&](double time) {
    return (path.at(time + step).position.x() - path.at(time).position.x()) / step;
  };
  for (const double key : {1.0, 3.0}) {
    EXPECT_GT(speed(key), 0.5);
    EXPECT_NEAR(speed(key - 2.0 * step), speed(key + step), 1e-3) << key;
  }
  EXPECT_NEAR(speed(0.0), 0.0, 1e-3);
  EXPECT_NEAR(speed(4.0 - step), 0.0, 1e-3);
}

TEST(CameraPaths, KeepLookingAtAPoint) {
  const Vec3 target(0.2, 0.1, -0.3);
  const CameraPath path({keyTowards(0.0, {1.0, 0.5, 1.0}, target),
                         keyTowards(1.0, {-1.0, 0.8, 1.0}, target),
                         keyTowards(2.0, {-1.0, 0.2, -2.0}, target)});
  for (double time = 0.0; time <= 2.0; time += 0.05) {
    const CameraPose pose = path.at(time);
    const Vec3 ahead = pose.orientation * -Vec3::UnitZ();
    const Vec3 wanted = (target - pose.position).normalized();
    // At the last key frame its own orientation counts.
    EXPECT_LT((ahead - wanted).norm(), 1e-9) << time;
  }
}

TEST(CameraPaths, TurnTheShorterWay) {
  CameraKey first = keyAt(0.0, Vec3::Zero());
  CameraKey second = keyAt(1.0, Vec3::Zero());
  second.orientation = Quat(Eigen::AngleAxisd(0.5, Vec3::UnitY()));
  second.orientation.coeffs() *= -1.0;  // the same orientation
  const CameraPath path({first, second});
  const double half = path.at(0.5).orientation.angularDistance(Quat::Identity());
  EXPECT_NEAR(half, 0.25, 1e-3);
}

TEST(CameraFiles, KeepWhatAKeyFrameDoesNotSay) {
  const auto keys = readKeys(
      R"([{"time": 0, "position": [0, 1, 2], "looks_at": [0, 1, 0], "field_of_view": 50},
          {"time": 1, "position": [2, 1, 0]},
          {"time": 2, "position": [2, 1, 0], "forward": [1, 0, 0], "field_of_view": 20}])");
  ASSERT_TRUE(keys) << keys.error().message;
  ASSERT_EQ(keys->size(), 3u);
  EXPECT_TRUE((*keys)[1].hasTarget);
  EXPECT_EQ((*keys)[1].target, Vec3(0.0, 1.0, 0.0));
  EXPECT_EQ((*keys)[1].fieldOfView, 50.0);
  EXPECT_LT(((*keys)[1].orientation * -Vec3::UnitZ() + Vec3::UnitX()).norm(), 1e-12);
  EXPECT_FALSE((*keys)[2].hasTarget);
  EXPECT_EQ((*keys)[2].fieldOfView, 20.0);
}

TEST(CameraFiles, AreRefusedWithThePlace) {
  for (const auto& [text, place, what] : std::vector<std::array<std::string, 3>>{
           {"[]", "way.json", "a list of key frames"},
           {R"([{"time": 0}])", "/0/position", "missing"},
           {R"([{"time": -1, "position": [0, 0, 0]}])", "/0/time", "the time of a key frame"},
           {R"([{"time": 1, "position": [0, 0, 0]}, {"time": 1, "position": [0, 0, 0]}])",
            "/1/time", "ascend"},
           {R"([{"time": 0, "position": [0, 0, 0], "fov": 3}])", "/0/fov", "field_of_view"},
           {R"([{"time": 0, "position": [0, 0, 0], "field_of_view": 180}])", "/0/field_of_view",
            "1 to 150"},
           {R"([{"time": 0, "position": [0, 5, 0], "looks_at": [0, 0, 0]}])", "/0", "up"}}) {
    const auto keys = readKeys(text);
    ASSERT_FALSE(keys) << text;
    EXPECT_THAT(keys.error().message, HasSubstr(place)) << text;
    EXPECT_THAT(keys.error().message, HasSubstr(what)) << text;
  }
}

}  // namespace
}  // namespace carom::lab
