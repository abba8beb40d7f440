#include "audio/propagation/receiver.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "carom/audio/listener.h"
#include "tests/support/constants.h"

namespace carom {

using namespace audio;

namespace {

using namespace test;

using std::numbers::pi;
using testing::HasSubstr;

Listener listenerOf(ListenerFormat format) {
  Listener listener{"ear", Vec3::Zero()};
  listener.format = format;
  return listener;
}

/// Direction in the world frame, `azimuth` rad to the right of ahead for a listener that is not
/// turned.
Vec3 towards(double azimuth) {
  return {std::sin(azimuth), 0.0, -std::cos(azimuth)};
}

double decibels(double ratio) {
  return 20.0 * std::log10(ratio);
}

TEST(Receiver, APlainListenerIsOneOmnidirectionalMicrophone) {
  const Listener plain{"ear", Vec3(1.0, 2.0, 3.0)};
  EXPECT_TRUE(validate(plain));
  EXPECT_EQ(channelCount(plain), 1u);
  const Receivers receivers = receiversOf(plain);
  ASSERT_EQ(receivers.size(), 1u);
  EXPECT_EQ(receivers[0].offset, Vec3::Zero());
  for (double azimuth = 0.0; azimuth < 6.3; azimuth += 0.1)
    EXPECT_EQ(gain(receivers[0], Quat::Identity(), towards(azimuth)), 1.0);
}

TEST(Receiver, EveryFormatFillsItsChannels) {
  for (const auto format :
       {ListenerFormat::spacedPair, ListenerFormat::coincidentPair, ListenerFormat::binaural}) {
    EXPECT_EQ(channelCount(listenerOf(format)), 2u);
    EXPECT_EQ(receiversOf(listenerOf(format)).size(), 2u);
    EXPECT_TRUE(validate(listenerOf(format)));
  }
}

// Published characteristics: a cardioid is 6 dB down at 90 degrees and deaf at 180; a figure of
// eight is deaf at 90 and inverted at 180; a supercardioid (0.63) is deaf at 126 degrees.
TEST(Receiver, PatternsHaveTheirNulls) {
  Receiver receiver;
  receiver.pattern = 0.5;
  EXPECT_DOUBLE_EQ(gain(receiver, Quat::Identity(), towards(0.0)), 1.0);
  EXPECT_NEAR(decibels(gain(receiver, Quat::Identity(), towards(pi / 2.0))), -6.02, 0.01);
  EXPECT_NEAR(gain(receiver, Quat::Identity(), towards(pi)), 0.0, 1e-15);
  receiver.pattern = 1.0;
  EXPECT_NEAR(gain(receiver, Quat::Identity(), 5.0 * towards(pi / 2.0)), 0.0, 1e-15);
  EXPECT_NEAR(gain(receiver, Quat::Identity(), 5.0 * towards(pi)), -1.0, 1e-15);
  receiver.pattern = 0.63;
  EXPECT_NEAR(gain(receiver, Quat::Identity(), towards(126.0 * pi / 180.0)), 0.0, 1e-3);
}

TEST(Receiver, NoDirectionLeavesTheOmnidirectionalShare) {
  Receiver receiver;
  receiver.pattern = 0.75;
  EXPECT_DOUBLE_EQ(gain(receiver, Quat::Identity(), Vec3::Zero()), 0.25);
}

TEST(Receiver, LeftComesFirstAndLooksOutwards) {
  const Receivers pair = receiversOf(listenerOf(ListenerFormat::coincidentPair));
  const Vec3 left = towards(-pi / 4.0);
  EXPECT_DOUBLE_EQ(gain(pair[0], Quat::Identity(), left), 1.0);
  EXPECT_DOUBLE_EQ(gain(pair[1], Quat::Identity(), left), 0.5);  // 90 degrees off a cardioid's axis
  EXPECT_EQ(pair[0].offset, Vec3::Zero());
}

TEST(Receiver, SpacedPairIsLeftAndRightOfThePosition) {
  Listener listener = listenerOf(ListenerFormat::spacedPair);
  listener.spacing = 0.4;
  const Receivers pair = receiversOf(listener);
  EXPECT_TRUE(pair[0].offset.isApprox(Vec3(-0.2, 0.0, 0.0)));
  EXPECT_TRUE(pair[1].offset.isApprox(Vec3(0.2, 0.0, 0.0)));
  EXPECT_EQ(gain(pair[1], Quat::Identity(), towards(-2.0)), 1.0);
}

// A Blumlein pair, two figures of eight at right angles, receives the same power from every
// direction.
TEST(Receiver, BlumleinPairKeepsThePowerOfEveryDirection) {
  Listener listener = listenerOf(ListenerFormat::coincidentPair);
  listener.pattern = 1.0;
  const Receivers pair = receiversOf(listener);
  for (double azimuth = 0.0; azimuth < 6.3; azimuth += 0.1) {
    const double left = gain(pair[0], Quat::Identity(), towards(azimuth));
    const double right = gain(pair[1], Quat::Identity(), towards(azimuth));
    EXPECT_NEAR(left * left + right * right, 1.0, 1e-12);
  }
}

TEST(Receiver, TurnsWithTheListener) {
  Receiver receiver;
  receiver.pattern = 0.5;
  // The listener turns left, by a quarter around +Y: ahead is now the world's -X.
  const Quat turned(Eigen::AngleAxisd(pi / 2.0, Vec3::UnitY()));
  EXPECT_NEAR(gain(receiver, turned, -Vec3::UnitX()), 1.0, 1e-15);
  EXPECT_NEAR(gain(receiver, turned, Vec3::UnitX()), 0.0, 1e-15);
}

TEST(Listener, SaysWhatIsWrong) {
  Listener listener{"ear", Vec3(0.0, kNaN, 0.0)};
  EXPECT_THAT(validate(listener).error().message, HasSubstr("position"));
  listener = {"ear", Vec3::Zero()};
  listener.orientation = Quat(0.5, 0.0, 0.0, 0.0);
  EXPECT_THAT(validate(listener).error().message, HasSubstr("orientation"));
  listener.orientation = Quat(kNaN, 0.0, 0.0, 0.0);
  EXPECT_THAT(validate(listener).error().message, HasSubstr("orientation"));
  listener = listenerOf(ListenerFormat::mono);
  listener.pattern = 1.5;
  EXPECT_THAT(validate(listener).error().message, HasSubstr("pattern"));
  listener = listenerOf(ListenerFormat::spacedPair);
  for (const double spacing : {0.0, -1.0, 1e3, kNaN}) {
    listener.spacing = spacing;
    EXPECT_THAT(validate(listener).error().message, HasSubstr("spacing"));
  }
  listener = listenerOf(ListenerFormat::coincidentPair);
  listener.pattern = 0.0;
  EXPECT_THAT(validate(listener).error().message, HasSubstr("the same"));
  listener = listenerOf(ListenerFormat::coincidentPair);
  listener.halfAngle = -0.1;
  EXPECT_THAT(validate(listener).error().message, HasSubstr("halfAngle"));
  listener = listenerOf(static_cast<ListenerFormat>(9));
  EXPECT_THAT(validate(listener).error().message, HasSubstr("format"));
}

}  // namespace
}  // namespace carom
