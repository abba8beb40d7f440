#include "native/jello/jello_file.h"

#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/random.h"

namespace carom::test {

using namespace native;

namespace {

using testing::HasSubstr;

/// A world in the assignment's format, with these values and so many positions.
std::string worldText(const std::string& head =
                          "RK4\n0.0005 25\n200 0.25 400 0.25\n"
                          "0.001953125\n0\n0\n",
                      std::size_t points = 512) {
  std::ostringstream text;
  text << head;
  for (std::size_t index = 0; index < points; ++index) {
    const std::size_t x = index / 64;
    const std::size_t y = index / 8 % 8;
    const std::size_t z = index % 8;
    text << static_cast<double>(x) / 7.0 - 0.5 << ' ' << static_cast<double>(y) / 7.0 << " \t"
         << static_cast<double>(z) / 7.0 << "\r\n";
  }
  for (std::size_t index = 0; index < 512; ++index)
    text << "0 0 " << index << "\n";
  return text.str();
}

std::string refusal(const std::string& text) {
  const auto file = jelloFromText(text, "my.w");
  return file ? "" : file.error().message;
}

TEST(JelloFile, ReadsWhatTheAssignmentWrites) {
  const auto file = jelloFromText(worldText(), "my.w");
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_EQ(file->integrator, JelloIntegrator::rungeKutta4);
  EXPECT_EQ(file->step, 0.0005);
  EXPECT_EQ(file->stepsPerFrame, 25u);
  const JelloWorld& world = file->world;
  EXPECT_EQ(world.lattice.count, 8u);
  EXPECT_EQ(world.lattice.size, Vec3::Ones());
  EXPECT_EQ(world.lattice.stiffness, 200.0);
  EXPECT_EQ(world.lattice.damping, 0.25);
  EXPECT_EQ(world.contact.stiffness, 400.0);
  EXPECT_EQ(world.contact.damping, 0.25);
  EXPECT_EQ(world.lattice.pointMass, 1.0 / 512.0);
  EXPECT_TRUE(world.planes.empty());
  EXPECT_EQ(world.field.count, 0u);
  EXPECT_EQ(world.room->min, Vec3(-2, -2, -2));
  EXPECT_EQ(world.room->max, Vec3(2, 2, 2));
  EXPECT_EQ(world.gravity, Vec3::Zero());
  // x is the outermost index, z the innermost.
  EXPECT_LT((world.positions[64 + 16 + 3] - Vec3(1.0 / 7 - 0.5, 2.0 / 7, 3.0 / 7)).norm(), 1e-5);
  EXPECT_EQ(world.velocities[100], Vec3(0, 0, 100));
}

TEST(JelloFile, PlaneAndFieldAreThereWhereTheirNumbersSay) {
  std::string head = "euler 1e-4 1 200 0.25 400 0.25 .001 1 0 -2 0 -1 2";
  for (int index = 0; index < 8; ++index)
    head += " " + std::to_string(index) + " 0 -9.81";
  const auto file = jelloFromText(worldText(head + "\n"), "my.w");
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_EQ(file->integrator, JelloIntegrator::explicitEuler);
  // The jello is above y = -1/2, whichever way the normal points in the file.
  ASSERT_EQ(file->world.planes.size(), 1u);
  EXPECT_EQ(file->world.planes[0].normal, Vec3(0, 1, 0));
  EXPECT_EQ(file->world.planes[0].offset, -0.5);
  EXPECT_EQ(file->world.field.count, 2u);
  EXPECT_EQ(file->world.field.forces[5], Vec3(5, 0, -9.81));
  EXPECT_EQ(file->world.field.max, Vec3(2, 2, 2));
}

TEST(JelloFile, WhatIsWrittenIsReadTheSame) {
  Random random(1);
  auto file = *jelloFromText(worldText(), "my.w");
  file.integrator = JelloIntegrator::backwardEuler;
  file.step = 1.0 / 3.0;
  for (Vec3& point : file.world.positions)
    point = random.inCube() / 3.0;
  file.world.planes = {{1, Vec3::UnitX(), -1.9}};
  file.world.field.count = 3;
  for (int index = 0; index < 27; ++index)
    file.world.field.forces.push_back(1e-7 * random.inCube());
  const auto text = jelloText(file);
  ASSERT_TRUE(text) << text.error().message;
  const auto again = jelloFromText(*text, "again.w");
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->integrator, file.integrator);
  EXPECT_EQ(again->step, file.step);
  EXPECT_EQ(again->stepsPerFrame, file.stepsPerFrame);
  EXPECT_EQ(again->world.positions, file.world.positions);
  EXPECT_EQ(again->world.velocities, file.world.velocities);
  EXPECT_EQ(again->world.field.forces, file.world.field.forces);
  EXPECT_EQ(again->world.planes[0].normal, file.world.planes[0].normal);
  EXPECT_EQ(again->world.planes[0].offset, file.world.planes[0].offset);
}

TEST(JelloFile, SaysWhatIsWrongAndOnWhichLine) {
  EXPECT_THAT(refusal(""), HasSubstr("my.w: line 1: '' is no integrator; expected Euler"));
  EXPECT_THAT(refusal("RK5\n"), HasSubstr("line 1: 'RK5' is no integrator"));
  EXPECT_THAT(refusal("RK4\n\n-1 25"),
              HasSubstr("line 3: the step dt (s) is -1; expected a number from 1e-08 to 1"));
  EXPECT_THAT(refusal("RK4\n1e-3 2.5"), HasSubstr("line 2: the number of steps to a picture"));
  EXPECT_THAT(refusal("RK4\n1e-3 2\n200 abc"),
              HasSubstr("line 3: 'abc' is no number; expected dE"));
  EXPECT_THAT(refusal("RK4\n1e-3 2\n200 nan"), HasSubstr("'nan' is no number"));
  EXPECT_THAT(refusal("RK4\n1e-3 2\n200 1e999"), HasSubstr("'1e999' is no number"));
  EXPECT_THAT(refusal("RK4\n1e-3 2\n200 .1 -4"),
              HasSubstr("kCollision (N/m) is -4; expected a number from 0 to 1e+12"));
  EXPECT_THAT(refusal("RK4\n1e-3 2\n200 .1 4 0\n1\n2\n"), HasSubstr("line 5: the flag"));
  EXPECT_THAT(refusal("RK4\n1e-3 2\n200 .1 4 0\n1\n1 0 0 0 3\n"),
              HasSubstr("line 5: the normal of"));
  EXPECT_THAT(refusal("RK4\n1e-3 2\n200 .1 4 0\n1\n0\n1000000"),
              HasSubstr("resolution of the force"));
  EXPECT_THAT(refusal(worldText("RK4 1e-3 2 200 .1 4 0 1 0 0\n", 511)),
              HasSubstr("number 512 of the 512 velocities"));
  const std::string tooMany = refusal(worldText() + "\n7\n");
  EXPECT_THAT(tooMany, HasSubstr("line 1032: after the last velocity there is '7'"));
}

// A step of 1e-30 s ended in a division by zero, one of 1e-12 s never.
TEST(JelloFile, EveryNumberHasARange) {
  for (const char* step : {"0", "-0.0", "1e-30", "1e-12", "9.9e-9", "1.1", "1e300"})
    EXPECT_THAT(refusal("RK4\n" + std::string(step) + " 25"),
                HasSubstr("expected a number from 1e-08 to 1"));
  for (const char* mass : {"0", "-1", "1e-300", "1e-22", "1e19"})
    EXPECT_THAT(refusal("RK4 1e-3 2 200 .1 4 0\n" + std::string(mass)),
                HasSubstr("line 2: the mass of a point (kg) is "));
  EXPECT_THAT(refusal("RK4 1e-3 2 1.1e12"), HasSubstr("kElastic (N/m) is 1.1e+12"));
  EXPECT_THAT(refusal("RK4 1e-3 2 1 1.1e9"), HasSubstr("dElastic (N s/m) is "));
  EXPECT_THAT(refusal("RK4 1e-3 2 1 1 1e13"), HasSubstr("kCollision (N/m) is "));
  EXPECT_THAT(refusal("RK4 1e-3 2 1 1 1 1e10"), HasSubstr("dCollision (N s/m) is "));
  EXPECT_THAT(refusal("RK4 1e-3 2 1 1 1 1 1 1 1e7"), HasSubstr("a of the inclined plane is "));
  EXPECT_THAT(refusal("RK4 1e-3 2 1 1 1 1 1 1 1e-7 0 0 1"), HasSubstr("farther than 1e6 m away"));
  EXPECT_THAT(refusal("RK4 1e-3 2 1 1 1 1 1 0 1 1e13 0 0"), HasSubstr("force 1 of 1 (N) is "));
  EXPECT_THAT(refusal("RK4 1e-3 2 1 1 1 1 1 0 0 0 1e7 0"), HasSubstr("512 positions is "));
}

TEST(JelloFile, WhatItHasNoWordsForIsNotWritten) {
  const auto reason = [](auto change) {
    JelloFile file = *jelloFromText(worldText(), "my.w");
    change(file.world);
    const auto text = jelloText(file);
    return text ? std::string() : text.error().message;
  };
  EXPECT_EQ(reason([](JelloWorld&) {}), "");
  EXPECT_THAT(reason([](JelloWorld& w) { w.lattice.pointMass = 1e-300; }),
              HasSubstr("the mass of a point (kg) is 1e-300; expected a number from 1e-21"));
  EXPECT_THAT(reason([](JelloWorld& w) { w.gravity.y() = -9.81; }), HasSubstr("no gravity"));
  EXPECT_THAT(reason([](JelloWorld& w) { w.room.reset(); }), HasSubstr("room from -2 m"));
  EXPECT_THAT(reason([](JelloWorld& w) { w.lattice.size.x() = 2.0; }), HasSubstr("cube of 1 m"));
  EXPECT_THAT(reason([](JelloWorld& w) { w.balls = {{.id = 3, .radius = 1, .mass = 1}}; }),
              HasSubstr("no balls"));
}

}  // namespace
}  // namespace carom::test
