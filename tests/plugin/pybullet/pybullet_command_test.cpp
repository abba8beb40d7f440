#include <cmath>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "plugin/pybullet/command.h"

namespace carom {

using namespace plugin;

namespace {

using testing::HasSubstr;

template <class Expected>
Expected parsed(const std::string& text) {
  const Result<Command> command = parseCommand(text);
  EXPECT_TRUE(command) << text;
  if (!command || !std::holds_alternative<Expected>(*command)) {
    ADD_FAILURE() << text << " is something else";
    return {};
  }
  return std::get<Expected>(*command);
}

std::string refusal(const std::string& text) {
  const Result<Command> command = parseCommand(text);
  EXPECT_FALSE(command) << text;
  return command ? "" : command.error().message;
}

TEST(PybulletCommand, ListenerIsUprightUnlessToldOtherwise) {
  const auto listener = parsed<command::PlaceListener>("listener 0 -1.5 2e-1");
  EXPECT_EQ(listener.position, Vec3(0.0, -1.5, 0.2));
  // The listener looks along its own -z; its +y is up.
  EXPECT_NEAR((listener.orientation * -Vec3::UnitZ() - Vec3::UnitY()).norm(), 0.0, 1e-12);
  EXPECT_NEAR((listener.orientation * Vec3::UnitY() - Vec3::UnitZ()).norm(), 0.0, 1e-12);
}

TEST(PybulletCommand, ListenerTakesPyBulletsQuaternion) {
  const auto listener = parsed<command::PlaceListener>("listener 1 2 3 0 0 0.70711 0.70711");
  // The quaternion is a quarter turn about z.
  EXPECT_NEAR((listener.orientation * Vec3::UnitX() - Vec3::UnitY()).norm(), 0.0, 1e-6);
}

TEST(PybulletCommand, MaterialIsOfABodyOrOfALink) {
  const auto body = parsed<command::SetMaterial>("  material 3 steel ");
  EXPECT_EQ(body.body, 3);
  EXPECT_FALSE(body.link);
  EXPECT_EQ(body.name, "steel");
  EXPECT_EQ(parsed<command::SetMaterial>("material 3 -1 glass").link, -1);
  EXPECT_EQ(parsed<command::SetMaterial>("material 3 4 glass").link, 4);
}

TEST(PybulletCommand, FileNameMayHoldBlanks) {
  EXPECT_EQ(parsed<command::Record>("record a take/of the ball.wav\n").file,
            "a take/of the ball.wav");
}

TEST(PybulletCommand, PlainOnesTakeNothing) {
  parsed<command::Play>("play");
  parsed<command::Stop>("stop");
  parsed<command::Pause>("pause");
  parsed<command::Stats>("stats");
  parsed<command::Help>("help");
  EXPECT_THAT(refusal("stop it"), HasSubstr("takes nothing, not 'it'"));
}

TEST(PybulletCommand, SwitchesAndFactors) {
  EXPECT_EQ(parsed<command::SetGain>("gain 0.25").gain, 0.25);
  EXPECT_TRUE(parsed<command::Mute>("mute on").on);
  EXPECT_FALSE(parsed<command::Mute>("mute off").on);
}

TEST(PybulletCommand, RefusalSaysWhatIsWrongAndWhatIsTaken) {
  EXPECT_THAT(refusal("listen 1 2 3"), HasSubstr("no command 'listen'; expected listener"));
  EXPECT_THAT(refusal(""), HasSubstr("'help' lists them"));
  EXPECT_THAT(refusal("listener 1 2"), HasSubstr("X Y Z"));
  EXPECT_THAT(refusal("listener 1 2 north"), HasSubstr("'north' is not a finite number"));
  EXPECT_THAT(refusal("listener 1 2 nan"), HasSubstr("'nan' is not a finite number"));
  EXPECT_THAT(refusal("listener 1 2 3 0 0 0 2"), HasSubstr("has length 2.0"));
  EXPECT_THAT(refusal("listener 1 2 3 0 0 0 0"), HasSubstr("expected 1"));
  EXPECT_THAT(refusal("material steel"), HasSubstr("BODY NAME"));
  EXPECT_THAT(refusal("material ball steel"), HasSubstr("body 'ball'"));
  EXPECT_THAT(refusal("material 3 -2 steel"), HasSubstr("link '-2'"));
  EXPECT_THAT(refusal("material 3 unobtainium"), HasSubstr("expected one of"));
  EXPECT_THAT(refusal("record"), HasSubstr("name of a file"));
  EXPECT_THAT(refusal("gain loud"), HasSubstr("0 to 1000"));
  EXPECT_THAT(refusal("gain -1"), HasSubstr("0 to 1000"));
  EXPECT_THAT(refusal("mute maybe"), HasSubstr("on or off"));
}

}  // namespace
}  // namespace carom
