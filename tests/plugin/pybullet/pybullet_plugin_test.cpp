#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include <dlfcn.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "plugin/pybullet/server_abi.h"
#include "tests/plugin/pybullet/pybullet_stub.h"
#include "tests/support/onset_detector.h"
#include "tests/support/recording.h"
#include "tests/support/temporary_folder.h"

namespace carom::test {
namespace {

using testing::HasSubstr;
using testing::StartsWith;
using Form = ServerStub::Body::Form;

constexpr double kGravity = 9.81;            // m/s^2, gravity of the stub
constexpr double kSpeedOfSound = 343.2;      // m/s, at 20 degrees Celsius
constexpr double kRadius = 0.05;             // m
constexpr double kHeight = 0.3;              // m, fall of the ball
constexpr double kListener = 2.0;            // m, height of the listener above the floor
constexpr double kHalfSpacing = 0.085;       // m, half the default microphones' spacing
constexpr double kTick = 1.0 / 240.0;        // s
constexpr std::size_t kImpulseColumn = 5;    // jx_Ns of EventTable
constexpr std::size_t kApproachColumn = 14;  // approach_speed_m_s

/// The stub's library, loaded while this object lives.
class StubLibrary {
 public:
  StubLibrary() : library_(dlopen(CAROM_PYBULLET_STUB, RTLD_NOW | RTLD_LOCAL)) {
    if (library_ == nullptr) ADD_FAILURE() << dlerror();
  }
  StubLibrary(const StubLibrary&) = delete;
  StubLibrary& operator=(const StubLibrary&) = delete;
  ~StubLibrary() { dlclose(library_); }

  std::unique_ptr<ServerStub> make() const {
    using Make = ServerStub* (*)();
    return std::unique_ptr<ServerStub>(reinterpret_cast<Make>(dlsym(library_, "makeServerStub"))());
  }

 private:
  void* library_;
};

class PybulletPlugin : public testing::Test {
 protected:
  PybulletPlugin() { server->add({.form = Form::floor, .mass = 0.0, .restitution = 0.8}); }

  void load() { ASSERT_EQ(server->load(CAROM_PYBULLET_PLUGIN, "_carom"), 0); }
  int addBall(double height = kHeight) {
    return server->add({.position = {0.0, 0.0, kRadius + height}});
  }
  void run(double seconds, double step = kTick) {
    for (int count = static_cast<int>(std::lround(seconds / step)); count > 0; --count)
      server->step();
  }
  std::string done(const std::string& command) {
    const ServerStub::Reply reply = server->execute(command);
    EXPECT_EQ(reply.result, 0) << reply.text;
    EXPECT_EQ(reply.type, 1);
    return reply.text;
  }
  std::string refused(const std::string& command) {
    const ServerStub::Reply reply = server->execute(command);
    EXPECT_EQ(reply.result, -1) << reply.text;
    return reply.text;
  }
  std::size_t statistic(const std::string& name) {
    const std::string stats = done("stats");
    std::smatch found;
    if (std::regex_search(stats, found, std::regex("\\b" + name + "=([0-9]+)")))
      return std::stoul(found[1]);
    ADD_FAILURE() << stats << " has no " << name;
    return 0;
  }
  std::string file(const std::string& name) const { return (folder / name).string(); }
  /// Takes all events that wait; returns a column of the first.
  double numberOfEvent(std::size_t column) {
    const std::string text = done("events").substr(std::string("events=").size());
    if (text.size() < 2 * sizeof(double) * (column + 1)) {
      ADD_FAILURE() << "there is no event";
      return 0.0;
    }
    std::array<unsigned char, sizeof(double)> bytes{};
    for (std::size_t byte = 0; byte < bytes.size(); ++byte)
      bytes.at(byte) = static_cast<unsigned char>(
          std::stoul(text.substr(2 * (column * sizeof(double) + byte), 2), nullptr, 16));
    double value = 0.0;
    std::memcpy(&value, bytes.data(), sizeof(value));
    return value;
  }

  StubLibrary library;
  std::unique_ptr<ServerStub> server = library.make();
  TemporaryFolder folder;
};

// Time of touch on the parabola through the nodes of the ball's fall, which begins with g dt / 2.
double touchTime(double height) {
  const double first = 0.5 * kGravity * kTick;
  return (std::sqrt(first * first + 2.0 * kGravity * height) - first) / kGravity;
}

// Number of times that the speed turns from down to up within one substep.
std::size_t turns(const std::vector<double>& rising, double least) {
  std::size_t count = 0;
  for (std::size_t substep = 1; substep < rising.size(); ++substep)
    if (rising[substep - 1] < -least && rising[substep] > 0.0) ++count;
  return count;
}

std::vector<double> leftChannel(const Recording& recording) {
  return recording.channel(0);
}

/// Pressure in Pa of a sample of 1.0.
double fullScaleOf(const Recording& recording) {
  double pressure = 0.0;
  EXPECT_EQ(std::sscanf(recording.comment.c_str(), "full scale %lf Pa", &pressure), 1)
      << recording.comment;
  return pressure;
}

/// Tests with a ball that is free, or the link of another body.
class PybulletBall : public PybulletPlugin, public testing::WithParamInterface<bool> {};

TEST_P(PybulletBall, FirstBounceIsHeardWithinATenthOfAMillisecond) {
  server->add({.position = {0.0, 0.0, kRadius + kHeight}, .isOnSlider = GetParam()});
  load();
  done("listener 0 0 " + std::to_string(kListener));
  done("record " + file("bounce.wav"));
  run(0.4);
  done("stop");
  const Recording recording = readRecording(file("bounce.wav"));
  const auto onsets = findOnsets(leftChannel(recording), recording.info.samplerate);
  ASSERT_GE(onsets.size(), 1U);
  const double way = std::hypot(kListener - kRadius, kHalfSpacing);
  const double error = onsets[0].time - (touchTime(kHeight) + way / kSpeedOfSound);
  RecordProperty("error_us", std::to_string(error * 1e6));
  EXPECT_NEAR(error, 0.0, 1e-4);
}

INSTANTIATE_TEST_SUITE_P(FreeAndLink, PybulletBall, testing::Bool());

TEST_F(PybulletPlugin, EveryTurnOfTheBallIsOneClick) {
  const int ball = addBall();
  load();
  done("listener 0 0 " + std::to_string(kListener));
  done("record " + file("bounces.wav"));
  run(1.5);
  done("stop");
  const std::size_t bounces = turns(server->risingSpeeds(ball), 0.2);
  ASSERT_GE(bounces, 3U);
  const Recording recording = readRecording(file("bounces.wav"));
  EXPECT_EQ(findOnsets(leftChannel(recording), recording.info.samplerate).size(),
            statistic("impacts"));
  EXPECT_GE(statistic("impacts"), bounces);
  EXPECT_LE(statistic("impacts"), bounces + 1);  // the last impact does not turn the ball
  EXPECT_EQ(statistic("late"), 0U);
  EXPECT_EQ(statistic("rejected"), 0U);
}

TEST_F(PybulletPlugin, SubstepsWithinAStepAreAllSeen) {
  const int ball = addBall();
  load();
  server->setTimeStep(4.0 * kTick, 4);
  run(1.5, 4.0 * kTick);
  const std::size_t bounces = turns(server->risingSpeeds(ball), 0.2);
  ASSERT_GE(bounces, 3U);
  EXPECT_EQ(server->risingSpeeds(ball).size(), 360U);
  EXPECT_GE(statistic("impacts"), bounces);
  EXPECT_LE(statistic("impacts"), bounces + 1);
  EXPECT_THAT(done("stats"), StartsWith("time=1.5 bodies=2"));
  EXPECT_THAT(done("report"), StartsWith("1 body can move, 1 cannot.\nMaterials: 1 "));
}

TEST_F(PybulletPlugin, RestingAndSlidingBoxesAreSilent) {
  const Vec3 half(0.1, 0.1, 0.05);
  server->add(
      {.form = Form::box, .halfEdges = {5.0, 5.0, 0.5}, .mass = 0.0, .position = {0.0, 0.0, 0.5}});
  server->add({.form = Form::box, .halfEdges = half, .position = {0.0, 0.0, 1.05}});
  server->add({.form = Form::box,
               .halfEdges = half,
               .position = {-2.0, 1.0, 1.05},
               .velocity = {2.0, 0.0, 0.0}});
  server->add({.position = {2.0, 2.0, 1.0 + kRadius}});
  load();
  run(2.0);
  EXPECT_EQ(statistic("impacts"), 0U);
}

// Each shape is told by what can be asked: nobody asks for it, whatever its coordinates.
TEST_F(PybulletPlugin, EveryShapeIsHeard) {
  for (const Form form :
       {Form::ball, Form::box, Form::cylinder, Form::capsule, Form::hull, Form::ballPair})
    for (const bool isRigid : {false, true}) {
      server = library.make();
      server->add({.form = Form::floor, .mass = 0.0});
      server->add({.form = form,
                   .halfEdges = {0.05, 0.05, 0.1},
                   .position = {0.0, 0.0, 0.4},
                   .hasMaximalCoordinates = isRigid});
      load();
      run(0.5);
      EXPECT_GE(statistic("impacts"), 1U) << static_cast<int>(form) << isRigid;
      EXPECT_EQ(statistic("rejected"), 0U);
    }
}

// The same ball on the same floor: the server tells the restitution of the one, that of the other
// follows from its motion.
TEST_F(PybulletPlugin, MaximalCoordinatesSoundAsAnyOthers) {
  struct Pair {
    bool isBallRigid = false;
    bool isFloorRigid = false;
  };
  for (const double step : {1.0 / 60.0, 1.0 / 240.0, 1.0 / 1000.0}) {
    std::vector<double> peaks;
    for (const Pair pair : {Pair{}, Pair{true, false}, Pair{true, true}}) {
      server = library.make();
      server->add({.form = Form::floor,
                   .mass = 0.0,
                   .restitution = 0.8,
                   .hasMaximalCoordinates = pair.isFloorRigid});
      server->add(
          {.position = {0.0, 0.0, kRadius + kHeight}, .hasMaximalCoordinates = pair.isBallRigid});
      server->setTimeStep(step, 0);
      load();
      done("listener 0 0 " + std::to_string(kListener));
      done("record " + file("ball.wav"));
      run(0.4, step);
      done("stop");
      EXPECT_EQ(statistic("impacts"), 1U);
      const Recording recording = readRecording(file("ball.wav"));
      peaks.push_back(fullScaleOf(recording) * recording.peak());
    }
    std::printf("step %.5f s: %.6f %.6f of the peak with known restitution\n", step,
                peaks[1] / peaks[0], peaks[2] / peaks[0]);
    EXPECT_NEAR(peaks[1] / peaks[0], 1.0, 1e-3) << step;
    EXPECT_NEAR(peaks[2] / peaks[0], 1.0, 1e-3) << step;
  }
}

// At 3 m/s and 1/60 s two balls overlap so far that the solver moves rigid ones apart, without
// giving them that speed.
TEST_F(PybulletPlugin, DeepOverlapsDoNotChangeTheRestitutionOfRigidBodies) {
  for (const double step : {1.0 / 60.0, 1.0 / 240.0}) {
    for (const bool isRigid : {false, true}) {
      server = library.make();
      server->add({.position = {0.0, 0.0, 9.0},
                   .velocity = {2.0, 0.0, 0.0},
                   .hasMaximalCoordinates = isRigid});
      server->add({.position = {0.5, 0.0, 9.0},
                   .velocity = {-1.0, 0.0, 0.0},
                   .hasMaximalCoordinates = isRigid});
      server->setTimeStep(step, 0);
      load();
      done("capture");
      run(0.3, step);
      EXPECT_EQ(statistic("impacts"), 1U);
      const double impulse = (1.0 + 0.9 * 0.9) * 0.5 * 3.0;
      EXPECT_NEAR(std::abs(numberOfEvent(kImpulseColumn)) / impulse, 1.0, 1e-3) << isRigid << step;
    }
  }
}

// Worlds with deformable bodies tell the end of a substep before their solver has run.
TEST_F(PybulletPlugin, ASolverThatRunsLateIsWaitedFor) {
  std::vector<Recording> heard;
  for (const bool isLate : {false, true}) {
    server = library.make();
    server->add({.form = Form::floor, .mass = 0.0, .restitution = 0.8});
    addBall();
    if (isLate) server->tellBeforeSolver();
    load();
    done("listener 0 0 " + std::to_string(kListener));
    done("record " + file("late.wav"));
    run(1.5);
    done("stop");
    EXPECT_GE(statistic("impacts"), 3U);
    EXPECT_EQ(statistic("late"), 0U);
    heard.push_back(readRecording(file("late.wav")));
  }
  EXPECT_EQ(heard[0].samples, heard[1].samples);
}

TEST_F(PybulletPlugin, BodyWithMaximalCoordinatesIsHeardToo) {
  const int ball =
      server->add({.position = {0.0, 0.0, kRadius + kHeight}, .hasMaximalCoordinates = true});
  load();
  run(1.0);
  const std::size_t bounces = turns(server->risingSpeeds(ball), 0.2);
  ASSERT_GE(bounces, 2U);
  EXPECT_GE(statistic("impacts"), bounces);
  EXPECT_EQ(statistic("rejected"), 0U);
}

// A server reports a fixed base's mass as any other's, although the base does not move.
TEST_F(PybulletPlugin, FixedBaseWithAMassSoundsLikeOneWithout) {
  std::vector<std::vector<double>> heard;
  for (const double mass : {0.0, 0.5}) {
    server = library.make();
    server->add({.form = Form::box,
                 .halfEdges = {1.0, 1.0, 0.5},
                 .mass = mass,
                 .position = {0.0, 0.0, 0.5},
                 .isFixed = true});
    server->add({.position = {0.0, 0.0, 1.0 + kRadius + kHeight}});
    load();
    done("listener 0 0 3");
    done("record " + file("fixed.wav"));
    run(0.4);
    done("stop");
    EXPECT_EQ(statistic("impacts"), 1U);
    heard.push_back(readRecording(file("fixed.wav")).samples);
  }
  EXPECT_EQ(heard[0], heard[1]);
}

TEST_F(PybulletPlugin, BodyThatTakesARemovedOnesNumberIsHeard) {
  load();
  const int first = addBall();
  run(0.3);
  EXPECT_EQ(statistic("impacts"), 1U);
  server->remove(first);
  EXPECT_EQ(statistic("bodies"), 1U);
  ASSERT_EQ(addBall(), first);
  run(0.3);
  EXPECT_EQ(statistic("impacts"), 2U);
  EXPECT_EQ(statistic("rejected"), 0U);
}

TEST_F(PybulletPlugin, CommandsAnswer) {
  const int ball = addBall();
  load();
  EXPECT_THAT(done("help"), HasSubstr("record FILE"));
  EXPECT_EQ(done("listener 1 2 3"), "listener placed");
  EXPECT_EQ(done("material " + std::to_string(ball) + " glass"), "body 1 is of glass");
  EXPECT_EQ(done("material 1 -1 steel"), "body 1 is of steel");
  done("gain 0.5");
  done("mute on");
  done("mute off");
  done("pause");
  done("stop");
  EXPECT_THAT(done("stats"), StartsWith("time=0 bodies=2 impacts=0 soft_contacts=0 events=0"));
}

TEST_F(PybulletPlugin, MaterialChangesWhatIsHeard) {
  std::vector<std::vector<double>> heard;
  for (const std::string material : {"steel", "wood"}) {
    server = library.make();
    server->add({.form = Form::floor, .mass = 0.0});
    addBall();
    load();
    done("listener 0 0 " + std::to_string(kListener));
    done("material 1 " + material);
    done("record " + file("material.wav"));
    run(0.4);
    done("stop");
    heard.push_back(readRecording(file("material.wav")).samples);
  }
  EXPECT_NE(heard[0], heard[1]);
}

TEST_F(PybulletPlugin, NonsenseIsRefusedWithAReason) {
  load();
  EXPECT_THAT(refused("sing"), HasSubstr("no command 'sing'"));
  EXPECT_THAT(refused(""), HasSubstr("empty"));
  EXPECT_THAT(refused("material 9 steel"), HasSubstr("no body 9"));
  EXPECT_THAT(refused("material 0 3 steel"), HasSubstr("no link 3"));
  EXPECT_THAT(refused("record " + file("no such folder/out.wav")), HasSubstr("no such folder"));
  EXPECT_EQ(refused("record /n\xC3\xB6/out.wav").find('\xC3'), std::string::npos);
  EXPECT_EQ(folder.entries(), 0U);
}

TEST_F(PybulletPlugin, UnloadingFinishesTheRecordingAndLeavesNothing) {
  addBall();
  load();
  done("record " + file("cut.wav"));
  run(0.4);
  server->unload();
  EXPECT_GT(readRecording(file("cut.wav")).peak(), 0.0);
  EXPECT_EQ(dlopen(CAROM_PYBULLET_PLUGIN, RTLD_NOW | RTLD_NOLOAD), nullptr);
  run(0.1);
}

// A server must not load a plugin once one was unloaded: see Plugin in plugin_entry.cpp.
TEST_F(PybulletPlugin, SoundsAreOpenedAndClosedInOnePlugin) {
  addBall();
  load();
  const std::string first = done("describe");
  done("listener 0 0 1 index=1 format=mono");
  done("record " + file("first.wav"));
  run(0.4);
  EXPECT_GE(statistic("impacts"), 1U);
  EXPECT_EQ(done("close"), "stopped");
  EXPECT_GT(readRecording(file("first.wav")).peak(), 0.0);
  run(0.1);
  EXPECT_THAT(refused("stats"), HasSubstr("open another"));
  EXPECT_THAT(refused("close"), HasSubstr("open another"));
  const std::string second = done("open");
  EXPECT_THAT(second, HasSubstr("channels=2 listeners=1"));  // as it is at first
  EXPECT_EQ(statistic("impacts"), 0U);
  const auto instanceOf = [](const std::string& text) {
    std::smatch found;
    std::regex_search(text, found, std::regex("instance=([0-9]+)"));
    return found[1].str();
  };
  EXPECT_NE(instanceOf(first), instanceOf(second));
  EXPECT_EQ(done("as " + instanceOf(second) + " describe"), second);
  EXPECT_THAT(refused("as " + instanceOf(first) + " stats"), HasSubstr("in its place"));
  EXPECT_THAT(refused("as " + instanceOf(first) + " close"), HasSubstr("in its place"));
  EXPECT_THAT(refused("as x stats"), HasSubstr("no command 'as'"));
  done("open");  // takes the place of the one that there is
  EXPECT_THAT(refused("as " + instanceOf(second) + " stats"), HasSubstr("in its place"));
  addBall();
  run(0.4);
  EXPECT_GE(statistic("impacts"), 1U);
}

// A ball that hangs on something is struck, and let go: it is heard when it lands.
TEST_F(PybulletPlugin, WhatWasHeldIsHeardOnceItMoves) {
  for (const bool isRigid : {false, true}) {
    server = library.make();
    server->setTimeStep(0.001, 0);
    server->add({.form = Form::floor, .mass = 0.0, .restitution = 0.8});
    const int held = server->add({.position = {0.0, 0.0, 0.4}, .hasMaximalCoordinates = isRigid});
    const int ball = server->add({.position = {0.0, 0.0, 0.6}, .hasMaximalCoordinates = isRigid});
    load();
    for (int step = 0; step < 200; ++step) {
      server->place(held, {0.0, 0.0, 0.4});
      server->step();
    }
    EXPECT_GE(statistic("impacts"), 1U);
    server->place(ball, {1.0, 0.0, 5.0});
    const std::size_t before = statistic("impacts");
    run(0.35, 0.001);
    EXPECT_GT(statistic("impacts"), before);
    EXPECT_EQ(statistic("rejected"), 0U);
  }
}

// A body that nothing but the host moves is struck where it is now.
TEST_F(PybulletPlugin, AnImmovableBodyIsStruckWhereItWasPut) {
  const int post = server->add({.mass = 0.0, .position = {0.0, 0.0, 1.0}});
  const int ball = server->add({.position = {0.0, 0.0, 1.3}});
  load();
  done("capture");
  run(0.3);
  const double speed = std::sqrt(2.0 * kGravity * 0.2);
  EXPECT_NEAR(numberOfEvent(kApproachColumn), speed, 0.03);
  server->place(post, {2.0, 0.0, 1.0});
  run(0.1);
  done("events");
  server->place(ball, {2.0, 0.0, 1.3});
  run(0.3);
  EXPECT_NEAR(numberOfEvent(kApproachColumn), speed, 0.03);
}

// How many rounds, CAROM_ROUNDS says: rounds.sh runs 1000, and 10 under valgrind.
TEST_F(PybulletPlugin, ComesAndGoes) {
  const char* const wanted = std::getenv("CAROM_ROUNDS");
  const int rounds = wanted != nullptr ? std::atoi(wanted) : 10;
  const int ball = addBall();
  for (int round = 0; round < rounds; ++round) {
    load();
    if (round > 0) done("open");
    done("capture");
    done("listener 0 0 1 index=1 format=mono");
    done("record " + file("round.wav"));
    run(0.1);
    const int state = server->saveState();
    run(0.2);
    server->restoreState(state);
    done("reset 0.1");
    run(0.2);
    EXPECT_THAT(done("samples"), StartsWith("samples=0"));
    EXPECT_THAT(done("events"), StartsWith("events="));
    const int other = addBall(0.1);
    run(0.2);
    server->remove(other);
    run(0.05);
    if (round % 2 == 0) done("stop");
    server->reset();
    EXPECT_THAT(done("describe"), HasSubstr(" time=0"));
    server->add({.form = Form::floor, .mass = 0.0, .restitution = 0.8});
    ASSERT_EQ(addBall(), ball);
    run(0.3);
    EXPECT_GE(statistic("impacts"), 3U);
    if (round % 3 != 0) done("close");
    run(0.05);
    if (round % 10 != 9) continue;
    server = library.make();  // unloads
    server->add({.form = Form::floor, .mass = 0.0, .restitution = 0.8});
    ASSERT_EQ(addBall(), ball);
  }
}

// This program itself is the server here, and exports none of a server's functions.
TEST(PybulletPluginAlone, ServerWithoutTheFunctionsIsRefused) {
  void* const plugin = dlopen(CAROM_PYBULLET_PLUGIN, RTLD_NOW | RTLD_LOCAL);
  ASSERT_NE(plugin, nullptr) << dlerror();
  using Call = int (*)(b3::PluginContext*);
  const auto init = reinterpret_cast<Call>(dlsym(plugin, "initPlugin_carom"));
  const auto tick = reinterpret_cast<Call>(dlsym(plugin, "postTickPluginCallback_carom"));
  b3::PluginContext context{};
  testing::internal::CaptureStderr();
  EXPECT_NE(init(&context), b3::kMagicNumber);
  EXPECT_THAT(testing::internal::GetCapturedStderr(), HasSubstr("does not export b3"));
  EXPECT_EQ(context.userPointer, nullptr);
  EXPECT_EQ(tick(&context), -1);
  EXPECT_EQ(init(nullptr), -1);
  dlclose(plugin);
}

// The plugin's dynamic symbols of one kind, by `nm`.
std::set<std::string> symbols(const std::string& option) {
  const std::string command =
      "'" CAROM_NM "' -D " + option + " --format=just-symbols '" + CAROM_PYBULLET_PLUGIN "'";
  std::set<std::string> names;
  FILE* const output = popen(command.c_str(), "r");  // NOLINT(*-command-processor): our own words
  std::string line(1024, '\0');
  while (std::fgets(line.data(), static_cast<int>(line.size()), output) != nullptr)
    names.insert(line.substr(0, line.find('\n')));
  pclose(output);
  return names;
}

TEST(PybulletPluginAlone, ExportsWhatIsLookedUpAndNeedsNoBullet) {
  EXPECT_THAT(
      symbols("--defined-only"),
      testing::ElementsAre("executePluginCommand_carom", "exitPlugin_carom", "initPlugin_carom",
                           "postTickPluginCallback_carom", "preTickPluginCallback_carom",
                           "processNotifications_carom", "takeEvents_carom", "takeSamples_carom"));
  const std::set<std::string> needed = symbols("--undefined-only");
  EXPECT_GT(needed.size(), 10U);
  for (const std::string& name : needed)
    EXPECT_FALSE(std::regex_search(name, std::regex("^_ZT?[NKVIS]*[0-9]*bt[A-Z]"))) << name;
}

}  // namespace
}  // namespace carom::test
