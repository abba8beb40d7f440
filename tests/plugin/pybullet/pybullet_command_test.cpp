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
  EXPECT_EQ(body.target.body, 3);
  EXPECT_FALSE(body.target.link);
  EXPECT_EQ(body.name, "steel");
  EXPECT_EQ(parsed<command::SetMaterial>("material 3 -1 glass").target.link, -1);
  EXPECT_EQ(parsed<command::SetMaterial>("material 3 4 glass").target.link, 4);
}

TEST(PybulletCommand, ListenerIsMadeAnotherReceiver) {
  const auto moved = parsed<command::PlaceListener>("listener 1 2 3 index=2");
  EXPECT_EQ(moved.index, 2U);
  EXPECT_TRUE(moved.isOnlyMoved());
  const auto pair = parsed<command::PlaceListener>(
      "listener 1 2 3 0 0 0 1 format=coincident_pair angle=0.5 pattern=1 spacing=0.2");
  EXPECT_FALSE(pair.isOnlyMoved());
  EXPECT_EQ(pair.format, ListenerFormat::coincidentPair);
  EXPECT_EQ(pair.halfAngle, 0.5);
  EXPECT_EQ(pair.pattern, 1.0);
  EXPECT_EQ(pair.spacing, 0.2);
  const auto head = parsed<command::PlaceListener>("listener 1 2 3 index=1 head=my heads/a b.sofa");
  EXPECT_EQ(head.head, "my heads/a b.sofa");
  EXPECT_EQ(head.format, ListenerFormat::binaural);
  EXPECT_EQ(head.index, 1U);
}

TEST(PybulletCommand, ModesAndTexturesAreOfABodyOrALink) {
  const auto modes = parsed<command::SetModes>("modes 3 a bell.carom_modes");
  EXPECT_EQ(modes.target.body, 3);
  EXPECT_FALSE(modes.target.link);
  EXPECT_EQ(modes.file, "a bell.carom_modes");
  EXPECT_EQ(parsed<command::SetModes>("modes 3 link=-1 bell").target.link, -1);
  EXPECT_TRUE(parsed<command::SetModes>("modes 3 none").file.empty());
  const auto texture = parsed<command::SetTexture>("texture 4 link=2 0.5 0.25 a map.png");
  EXPECT_EQ(texture.target.body, 4);
  EXPECT_EQ(texture.target.link, 2);
  EXPECT_EQ(texture.size, Vec2(0.5, 0.25));
  EXPECT_EQ(texture.file, "a map.png");
  EXPECT_TRUE(parsed<command::SetTexture>("texture 4 none").file.empty());
}

TEST(PybulletCommand, RoomIsABoxOfOneSurface) {
  const auto room = parsed<command::SetRoom>("room -1 -2 0 1 2 3 surface=0.25 order=3 reverb=off");
  EXPECT_TRUE(room.isBox);
  EXPECT_EQ(room.least, Vec3(-1.0, -2.0, 0.0));
  EXPECT_EQ(room.most, Vec3(1.0, 2.0, 3.0));
  EXPECT_EQ(room.absorption.coefficients.front(), 0.25);
  EXPECT_EQ(room.order, 3);
  EXPECT_FALSE(room.hasReverb);
  EXPECT_EQ(parsed<command::SetRoom>("room 0 0 0 1 1 1 surface=carpet").absorption.coefficients,
            findSurface("carpet")->absorption.coefficients);
  EXPECT_FALSE(parsed<command::SetRoom>("room none").isBox);
}

TEST(PybulletCommand, ClockAndLevelTakeNumbers) {
  EXPECT_EQ(parsed<command::SetLevel>("level 20").fullScale, 20.0);
  EXPECT_FALSE(parsed<command::SetLevel>("level automatic").fullScale);
  EXPECT_EQ(parsed<command::SetLatency>("latency 0.1").seconds, 0.1);
  EXPECT_EQ(parsed<command::KeepRun>("keep-run 30").seconds, 30.0);
  EXPECT_EQ(parsed<command::Reset>("reset").time, 0.0);
  EXPECT_EQ(parsed<command::Reset>("reset 2.5").time, 2.5);
}

TEST(PybulletCommand, FileNameMayHoldBlanks) {
  EXPECT_EQ(parsed<command::Record>("record a take/of the ball.wav\n").file,
            "a take/of the ball.wav");
  EXPECT_EQ(parsed<command::RecordRun>("record-run a take.carom\n").file, "a take.carom");
  EXPECT_EQ(parsed<command::SaveRun>("save-run a take.carom").file, "a take.carom");
}

TEST(PybulletCommand, PlainOnesTakeNothing) {
  parsed<command::Play>("play");
  parsed<command::Stop>("stop");
  parsed<command::Pause>("pause");
  parsed<command::Stats>("stats");
  parsed<command::Report>("report");
  parsed<command::Help>("help");
  parsed<command::Capture>("capture");
  parsed<command::Describe>("describe");
  parsed<command::TakeSamples>("samples");
  parsed<command::TakeEvents>("events");
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
  for (const char* name : {"record", "record-run", "save-run"})
    EXPECT_THAT(refusal(name), HasSubstr("name of a file"));
  for (const char* text : {"keep-run", "keep-run -1", "keep-run 1e9", "keep-run long"})
    EXPECT_THAT(refusal(text), HasSubstr("0 to 86400"));
  EXPECT_THAT(refusal("gain loud"), HasSubstr("0 to 1000"));
  EXPECT_THAT(refusal("gain -1"), HasSubstr("0 to 1000"));
  EXPECT_THAT(refusal("mute maybe"), HasSubstr("on or off"));
  EXPECT_THAT(refusal("listener 1 2 3 index=-1"), HasSubstr("index=-1; expected 0 to 63"));
  EXPECT_THAT(refusal("listener 1 2 3 index=0.5"), HasSubstr("whole number"));
  EXPECT_THAT(refusal("listener 1 2 3 format=quad"), HasSubstr("mono, spaced_pair"));
  EXPECT_THAT(refusal("listener 1 2 3 format=mono head=a.sofa"), HasSubstr("only a binaural one"));
  EXPECT_THAT(refusal("listener 1 2 3 pattern=2"), HasSubstr("pattern=2; expected 0 to 1"));
  EXPECT_THAT(refusal("listener 1 2 3 pattern=nan"), HasSubstr("expected 0 to 1"));
  EXPECT_THAT(refusal("listener 1 2 3 colour=red"), HasSubstr("no 'colour'; expected index"));
  EXPECT_THAT(refusal("listener 1 2 3 head="), HasSubstr("SOFA"));
  EXPECT_THAT(refusal("modes"), HasSubstr("body ''"));
  EXPECT_THAT(refusal("modes 3"), HasSubstr("BODY FILE"));
  EXPECT_THAT(refusal("modes 3 link=x bell"), HasSubstr("link 'x'"));
  EXPECT_THAT(refusal("texture 3 0.1 bumps.png"), HasSubstr("WIDTH HEIGHT FILE"));
  EXPECT_THAT(refusal("texture 3 0 1 bumps.png"), HasSubstr("above 0"));
  EXPECT_THAT(refusal("room"), HasSubstr("corners"));
  EXPECT_THAT(refusal("room 0 0 0 1 1"), HasSubstr("corners"));
  EXPECT_THAT(refusal("room 0 0 0 1 1 0"), HasSubstr("below"));
  EXPECT_THAT(refusal("room 0 0 0 1 1 1 surface=slime"), HasSubstr("0 to 1, "));
  EXPECT_THAT(refusal("room 0 0 0 1 1 1 order=33"), HasSubstr("0 to 32"));
  EXPECT_THAT(refusal("room 0 0 0 1 1 1 reverb=maybe"), HasSubstr("on or off"));
  EXPECT_THAT(refusal("level loud"), HasSubstr("automatic"));
  EXPECT_THAT(refusal("level 0"), HasSubstr("above 0"));
  EXPECT_THAT(refusal("latency 11"), HasSubstr("0 to 10"));
  EXPECT_THAT(refusal("reset -1"), HasSubstr("0 to 1e9"));
  EXPECT_THAT(refusal("capture off"), HasSubstr("takes nothing"));
}

}  // namespace
}  // namespace carom
