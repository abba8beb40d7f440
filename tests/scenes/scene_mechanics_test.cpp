// The mechanics of a scene file beyond frictionless impacts: closed forms show that the stepper
// gets them, and Bullet refuses those that it cannot do.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "lab/compare/compare.h"
#include <gtest/gtest.h>

#include "scenes/run/bullet_scene.h"
#include "scenes/run/native_only.h"
#include "scenes/run/scene_sound.h"
#include "scenes/run/scene_stepper.h"
#include "tests/scenes/library.h"

namespace carom::test {

using namespace lab;
using namespace scenes;

namespace {

constexpr double kGravity = 9.81;  // m/s^2
/// Error bound of the default steps for forces, in m, s or m/s: the fastest motion determines their
/// length, and they are of second order.
constexpr double kForceError = 2e-5;
const double kHalfRoot = std::sqrt(0.5);

/// A scene of 2 s with these bodies and these further members of its root.
Scene sceneOf(const std::string& bodies, const std::string& members = "") {
  const std::string text = R"({"duration": 2, "listeners": [{"position": [0, 1, 1]}],)" + members +
                           R"("materials": {
        "hard": {"density": 7800, "youngs_modulus": 2e11, "poissons_ratio": 0.3, "restitution": 1},
        "rough": {"density": 7800, "youngs_modulus": 2e11, "poissons_ratio": 0.3, "restitution": 1,
                  "friction": 0.2}
      }, "bodies": [)" + bodies +
                           "]}";
  return orAbort(parseScene(text, "mechanics.json"));
}

constexpr const char* kWeightless = R"("gravity": [0, 0, 0],)";

/// A hard ball of 1 cm radius and 1 kg at (x, 0, 0).
std::string ball(const std::string& x, const std::string& more = "") {
  return R"({"type": "sphere", "radius": 0.01, "mass": 1, "material": "hard", "position": [)" + x +
         ", 0, 0]" + more + "}";
}

/// A hard plane that a ball at (0, 0, 0) touches from the left.
constexpr const char* kStop =
    R"({"type": "plane", "normal": [-1, 0, 0], "offset": -0.01, "material": "hard"})";

std::vector<ImpulseEvent> eventsOf(const Scene& scene) {
  const auto events = sceneEvents(scene);
  EXPECT_TRUE(events) << events.error().message;
  return events ? *events : std::vector<ImpulseEvent>{};
}

ImpulseEvent firstEvent(const Scene& scene) {
  const std::vector<ImpulseEvent> events = eventsOf(scene);
  EXPECT_FALSE(events.empty());
  return events.empty() ? ImpulseEvent{} : events.front();
}

SphereState stateAt(const Scene& scene, double time) {
  Result<SphereStepper> stepper = nativeStepper(scene);
  EXPECT_TRUE(stepper);
  stepper->advanceTo(time);
  return stepper->state(0);
}

TEST(SceneMechanics, ASlidingBallWithBackspinRollsAtFiveSeventhsLessTwoSevenths) {
  const auto scene = [](const std::string& floor) {
    return sceneOf(R"({"type": "sphere", "radius": 0.05, "material": "rough",
                       "position": [0, 0.05, 0], "velocity": [2, 0, 0], "spin": [0, 0, 10]},
                      {"type": "plane", "normal": [0, 1, 0], "offset": 0, "material": ")" +
                   floor + "\"}");
  };
  // The angular momentum about the line of contact is conserved: v = 5/7 v0 - 2/7 R w0.
  const double rolling = 5.0 / 7.0 * 2.0 - 2.0 / 7.0 * 0.05 * 10.0;
  const SphereState state = stateAt(scene("rough"), 1.0);
  EXPECT_NEAR(state.velocity.x(), rolling, 1e-9);
  EXPECT_NEAR(state.spin.z(), -rolling / 0.05, 1e-7);
  // The friction of a pair is the geometric mean: a floor without friction leaves the ball sliding.
  EXPECT_NEAR(stateAt(scene("hard"), 1.0).velocity.x(), 2.0, 1e-12);
}

TEST(SceneMechanics, RollingAndPivotingFrictionSlowABallAsTheirDefinitionsSay) {
  const std::string material =
      R"({"density": 1000, "youngs_modulus": 1e9, "poissons_ratio": 0.3, "restitution": 0.5,
          "friction": 0.5, "rolling_friction": 0.02, "pivoting_friction": 0.001})";
  const Scene scene = sceneOf(R"({"type": "sphere", "radius": 0.05, "material": )" + material +
                              R"(, "position": [0, 0.05, 0], "velocity": [1, 0, 0],
                                  "spin": [0, 20, -20]},
    {"type": "plane", "normal": [0, 1, 0], "offset": 0, "material": "rough"})");
  const SphereState state = stateAt(scene, 0.5);
  EXPECT_NEAR(state.velocity.x(), 1.0 - 0.02 * kGravity * 0.5, 1e-6);
  const double inertia = 0.4 * 0.05 * 0.05;  // m^2, per mass
  EXPECT_NEAR(state.spin.y(), 20.0 - 0.001 * kGravity / inertia * 0.5, 1e-4);
}

/// Velocity and spin of the scene's first body on Bullet.
SphereState bulletStateAt(const Scene& scene, double time) {
  BulletScene bullet(scene);
  const double step = 1e-3;
  for (int index = 0; index < std::lround(time / step); ++index)
    bullet.world().stepSimulation(static_cast<btScalar>(step), 0);
  const btVector3& velocity = bullet.body(0).getLinearVelocity();
  const btVector3& spin = bullet.body(0).getAngularVelocity();
  SphereState state;
  state.velocity = Vec3(velocity.x(), velocity.y(), velocity.z());
  state.spin = Vec3(spin.x(), spin.y(), spin.z());
  return state;
}

/// A ball that slides with backspin, then rolls, and also turns about the normal.
Scene slidingBall(const std::string& rollingFriction) {
  const std::string material =
      R"({"density": 1000, "youngs_modulus": 1e9, "poissons_ratio": 0.3, "restitution": 0,
          "friction": 0.4, "pivoting_friction": 0.001, "rolling_friction": )" +
      rollingFriction + "}";
  return sceneOf(R"({"type": "sphere", "radius": 0.05, "material": )" + material +
                 R"(, "position": [0, 0.05, 0], "velocity": [2, 0, 0], "spin": [0, 20, 10]},
    {"type": "plane", "normal": [0, 1, 0], "offset": 0, "material": )" +
                 material + "}");
}

TEST(SceneMechanics, FrictionOnBulletIsThatOfTheNativeStepper) {
  const Scene scene = slidingBall("0");
  for (const double time : {0.05, 0.3, 0.8}) {  // it slides, rolls, rolls on
    const SphereState native = stateAt(scene, time);
    const SphereState bullet = bulletStateAt(scene, time);
    EXPECT_NEAR((bullet.velocity - native.velocity).norm(), 0.0, 0.01) << time;
    EXPECT_NEAR(bullet.spin.z(), native.spin.z(), 0.2) << time;
  }
}

// Bullet's rolling friction slows a sliding ball's rotation too, so that only the rolling ball is
// compared. Bullet has pivoting friction only together with rolling friction.
TEST(SceneMechanics, RollingFrictionOnBulletSlowsABallAsItsDefinitionSays) {
  const Scene scene = slidingBall("0.02");
  const Vec3 change = bulletStateAt(scene, 0.8).velocity - bulletStateAt(scene, 0.3).velocity;
  EXPECT_NEAR(change.x(), -0.02 * kGravity * 0.5, 1e-3);
  EXPECT_NEAR(bulletStateAt(scene, 0.8).spin.y(), stateAt(scene, 0.8).spin.y(), 0.2);
}

/// Restitution of the first bounce of a ball that moves at `speed` between two walls.
double firstRestitution(const std::string& law, const std::string& speed) {
  const std::string material =
      R"({"density": 7800, "youngs_modulus": 2e11, "poissons_ratio": 0.3, "restitution": 0.8,
          "restitution_speed": 0.25, "restitution_law": ")" +
      law + "\"}";
  const std::string plane = R"(, {"type": "plane", "offset": -0.1, "material": )" + material;
  const Scene scene =
      sceneOf(R"({"type": "sphere", "radius": 0.01, "position": [0, 0, 0],
                                  "velocity": [)" +
                  speed + R"(, 0, 0], "material": )" + material + "}" + plane +
                  R"(, "normal": [1, 0, 0]})" + plane + R"(, "normal": [-1, 0, 0]})",
              kWeightless);
  const std::vector<ImpulseEvent> events = eventsOf(scene);
  EXPECT_GE(events.size(), 3U);
  return events.size() < 3 ? 0.0 : events[2].approachSpeed / events[0].approachSpeed;
}

TEST(SceneMechanics, RestitutionFallsWithSpeedByItsLaw) {
  for (const char* law : {"plastic", "viscoelastic"})
    EXPECT_NEAR(firstRestitution(law, "0.25"), 0.8, 1e-12) << law;
  EXPECT_NEAR(firstRestitution("plastic", "4"), 0.4, 1e-12);  // 16 times the speed: by 16^(1/4)
  // At 32 times the speed the loss 1/e - 1 doubles, from 1/4 to 1/2.
  EXPECT_NEAR(firstRestitution("viscoelastic", "8"), 2.0 / 3.0, 1e-12);
}

TEST(SceneMechanics, APendulumOnARodFallsLikeItsHeight) {
  const Scene scene = sceneOf(ball("-0.5") + "," + kStop,
                              R"("mechanics": {"rods": [{"bodies": ["sphere1"],
                                  "anchor": [0, 0, 0]}]},)");
  // On its rod the ball swings from the side of the anchor to half a metre below it.
  const ImpulseEvent event = firstEvent(scene);
  EXPECT_NEAR(event.position.y(), -0.5, 1e-3);
  EXPECT_NEAR(event.approachSpeed, std::sqrt(2.0 * kGravity * 0.5), kForceError);
}

TEST(SceneMechanics, TwoBallsOnARodKeepTheirDistance) {
  const Scene scene =
      sceneOf(ball("0", R"(, "velocity": [0, 1, 0])") + "," + ball("0.5"),
              std::string(kWeightless) + R"("mechanics": {"rods": [{"bodies": ["sphere1",
                "sphere2"]}]},)");
  // The pair moves at 1/2 m/s and turns by 1 m/s / 0.5 m = 2 rad/s.
  const double time = 0.75;
  const Vec3 expected(0.25 - 0.25 * std::cos(2.0 * time), 0.5 * time + 0.25 * std::sin(2.0 * time),
                      0.0);
  EXPECT_NEAR((stateAt(scene, time).position - expected).norm(), 0.0, kForceError);
}

TEST(SceneMechanics, SpringsAndHarmonicFieldsBringABallInAQuarterOfAPeriod) {
  // Springs and field have 4 1/s^2: the ball moves as sine and cosine of 2 t and meets the stop
  // after pi / 4 s at 2 1/s times 0.5 m.
  for (const char* members :
       {R"("mechanics": {"springs": [{"bodies": ["sphere1"], "anchor": [0, 0, 0], "length": 0,
                                      "stiffness": 4}]},)",
        R"("mechanics": {"springs": [{"bodies": ["sphere1"], "anchor": [0.7, 0, 0], "length": 0.7,
                                      "stiffness": 4}]},)",
        R"("mechanics": {"fields": [{"harmonic": 4}]},)"}) {
    const ImpulseEvent event =
        firstEvent(sceneOf(ball("-0.5") + "," + kStop, std::string(kWeightless) + members));
    EXPECT_NEAR(event.time, std::numbers::pi / 4.0, kForceError) << members;
    EXPECT_NEAR(event.approachSpeed, 1.0, kForceError) << members;
  }
}

TEST(SceneMechanics, ASpringWithDampingLosesItsAmplitude) {
  const Scene scene = sceneOf(ball("-0.5"), std::string(kWeightless) +
                                                R"("mechanics": {"springs": [{"bodies": ["sphere1"],
                      "anchor": [0, 0, 0], "length": 0, "stiffness": 4, "damping": 4}]},)");
  // The motion is critically damped at 2 1/s: (1 + 2 t) exp(-2 t).
  EXPECT_NEAR(stateAt(scene, 1.0).position.x(), -0.5 * 3.0 * std::exp(-2.0), kForceError);
}

TEST(SceneMechanics, AShorterForceStepIsMoreExact) {
  const auto error = [](const std::string& step) {
    const Scene scene =
        sceneOf(ball("-0.5"), std::string(kWeightless) +
                                  R"("mechanics": {"fields": [{"harmonic": 4}], "force_step": )" +
                                  step + "},");
    return std::abs(stateAt(scene, 1.0).position.x() + 0.5 * std::cos(2.0));
  };
  EXPECT_LT(error("0.001"), 1e-5);
  EXPECT_LT(error("0.001"), 0.05 * error("0.01"));
}

TEST(SceneMechanics, ABallOrbitsACentreOfInverseSquare) {
  const Scene scene =
      sceneOf(ball("1", R"(, "velocity": [0, 2, 0])"),
              std::string(kWeightless) + R"("mechanics": {"fields": [{"inverse_square": 4}]},)");
  const Vec3 expected(std::cos(2.0), std::sin(2.0), 0.0);  // a circle at 2 rad/s
  EXPECT_NEAR((stateAt(scene, 1.0).position - expected).norm(), 0.0, kForceError);
}

TEST(SceneMechanics, DragTakesABallToTheSpeedOfTheWind) {
  const Scene scene =
      sceneOf(ball("0"), std::string(kWeightless) +
                             R"("mechanics": {"drag": {"rate": 2, "wind": [0, 0, 3]}},)");
  EXPECT_NEAR(stateAt(scene, 1.0).velocity.z(), 3.0 * (1.0 - std::exp(-2.0)), kForceError);
}

TEST(SceneMechanics, AMovingPlaneOrBlockMeetsABallAtItsSpeed) {
  for (const char* wall :
       {R"({"type": "plane", "normal": [1, 0, 0], "offset": -0.51, "velocity": [2, 9, 0],
            "material": "hard"})",
        R"({"type": "block", "min": [-1, -50, -1], "max": [-0.51, 1, 1], "velocity": [2, 9, 0],
            "material": "hard"})"}) {
    const ImpulseEvent event = firstEvent(sceneOf(ball("0") + "," + wall, kWeightless));
    EXPECT_NEAR(event.time, 0.25, 1e-12);
    EXPECT_NEAR(event.approachSpeed, 2.0, 1e-12);
    EXPECT_NEAR(event.impulse.x(), 4.0, 1e-12);
  }
}

TEST(SceneMechanics, AnOscillatingPlaneMeetsABallWhereItsSineGetsThere) {
  const auto meeting = [](const std::string& phase) {
    return firstEvent(sceneOf(ball("0") + R"(, {"type": "plane", "normal": [1, 0, 0],
        "offset": -0.02, "material": "hard",
        "oscillation": {"amplitude": [0.02, 0, 0], "frequency": 5, "phase": )" +
                                  phase + "}}",
                              kWeightless));
  };
  const double fastest = 0.02 * 2.0 * std::numbers::pi * 5.0;  // m/s
  // The plane meets the ball at a sine of 1/2, a twelfth of a turn on its way up.
  EXPECT_NEAR(meeting("0").time, 1.0 / 60.0, 1e-10);
  EXPECT_NEAR(meeting("0").approachSpeed, fastest * std::sqrt(0.75), 1e-9);
  EXPECT_NEAR(meeting("-1.5707963267948966").time, 1.0 / 60.0 + 1.0 / 20.0, 1e-10);
}

TEST(SceneMechanics, ARotatedBlockIsHitOnItsSlope) {
  Scene scene = sceneOf(R"({"type": "sphere", "radius": 0.01, "mass": 1, "material": "hard",
                            "position": [0.1, 1, 0], "velocity": [0, -2, 0]},
      {"type": "block", "min": [-0.5, -0.25, -1], "max": [0.5, 0.25, 1], "material": "hard",
       "rotation": {"axis": [0, 0, 7], "angle": 45}})",
                        kWeightless);
  // The upper face is 0.5 m wide to either side and 0.25 m from the centre, and its normal is (-1,
  // 1) / sqrt 2.
  const double way = 1.0 - (0.1 + (0.25 + 0.01) / kHalfRoot);
  for (const StepperType type : {StepperType::native, StepperType::bullet}) {
    const bool exact = type == StepperType::native;
    const ImpulseEvent event = firstEvent(onStepper(scene, type));
    EXPECT_NEAR(event.time, way / 2.0, exact ? 1e-12 : 1e-5);
    EXPECT_NEAR(event.approachSpeed, 2.0 * kHalfRoot, exact ? 1e-12 : 1e-5);
    EXPECT_NEAR((event.normal - Vec3(-kHalfRoot, kHalfRoot, 0.0)).norm(), 0.0,
                exact ? 1e-12 : 1e-5);
  }
}

TEST(SceneMechanics, TouchingBallsPassOnAHitByReflectionsOrByHertzsForces) {
  const auto last = [](const std::string& members) {
    std::string bodies = ball("-0.03", R"(, "velocity": [1, 0, 0])");
    for (const char* x : {"0", "0.02", "0.04", "0.06"})
      bodies += "," + ball(x);
    const Scene scene = sceneOf(bodies, std::string(kWeightless) + members);
    Result<SphereStepper> stepper = nativeStepper(scene);
    stepper->advanceTo(0.5);
    return std::pair(stepper->state(0).velocity.x(), stepper->state(4).velocity.x());
  };
  const auto rigid = last("");
  EXPECT_NEAR(rigid.first, 0.0, 1e-9);
  EXPECT_NEAR(rigid.second, 1.0, 1e-9);
  // Reference: Herrmann, Schmaelzle 1981, Am. J. Phys. 49, 761: forces of power 3/2 through five
  // equal balls.
  const auto elastic = last(R"("mechanics": {"simultaneous": "hertz"},)");
  EXPECT_NEAR(elastic.first, -0.071, 1e-3);
  EXPECT_NEAR(elastic.second, 0.989, 1e-3);
}

/// A scene, and the words by which Bullet refuses it.
struct NativeOnly {
  std::string word;
  std::string body;
  std::string members;
};

TEST(SceneMechanics, BulletRefusesWhatItCannotDoByName) {
  const std::string still = R"("type": "sphere", "radius": 0.01, "position": [0, 0, 0])";
  const std::string soft = R"("material": {"density": 1, "youngs_modulus": 1, "poissons_ratio": 0,
      "restitution": 1, "restitution_law": "viscoelastic"})";
  const std::vector<NativeOnly> cases = {
      {"restitution laws", "{" + still + ", " + soft + "}", ""},
      {"moving planes or blocks",
       ball("0") + R"(, {"type": "plane", "normal": [1, 0, 0], "offset": -1, "material": "hard",
                         "velocity": [1, 0, 0]})",
       ""},
      {"moving planes or blocks",
       ball("0") + R"(, {"type": "block", "min": [1, 1, 1], "max": [2, 2, 2], "material": "hard",
                         "velocity": [1, 0, 0]})",
       ""},
      {"oscillating planes",
       ball("0") + R"(, {"type": "plane", "normal": [1, 0, 0], "offset": -1, "material": "hard",
                         "oscillation": {"amplitude": [0.1, 0, 0], "frequency": 9}})",
       ""},
      {"rods", ball("0"), R"("rods": [{"bodies": ["sphere1"], "anchor": [1, 0, 0]}])"},
      {"springs", ball("0"),
       R"("springs": [{"bodies": ["sphere1"], "anchor": [1, 0, 0], "length": 1, "stiffness": 1}])"},
      {"fields", ball("0"), R"("fields": [{"harmonic": 1}])"},
      {"drag", ball("0"), R"("drag": {"rate": 1})"},
      {"simultaneous contacts by Hertz's forces", ball("0"), R"("simultaneous": "hertz")"}};
  for (const NativeOnly& only : cases) {
    const Scene scene = onStepper(sceneOf(only.body, R"("mechanics": {)" + only.members + "},"),
                                  StepperType::bullet);
    const std::string expected = "the scene has " + only.word +
                                 ", which Bullet's stepper cannot do; expected the native stepper";
    EXPECT_EQ(validateForBullet(scene).error().message, expected);
    const auto stepper = makeStepper(scene);
    ASSERT_FALSE(stepper) << only.word;
    EXPECT_EQ(stepper.error().message, "mechanics: " + expected);
    const std::vector<double> steps = {1.0 / 60.0};
    const auto report = compareScene(scene, steps);
    ASSERT_FALSE(report) << only.word;
    EXPECT_EQ(report.error().message, "mechanics: " + expected);
    EXPECT_TRUE(makeStepper(onStepper(scene, StepperType::native))) << only.word;
  }
}

TEST(SceneMechanics, BulletsRefusalNamesAllThereIsAtOnce) {
  const std::string reason = validateForBullet(libraryScene("swinging_cradle")).error().message;
  EXPECT_EQ(reason.find("the scene has restitution laws and rods, which"), 0U) << reason;
  EXPECT_TRUE(validateForBullet(libraryScene("marble_steps")));
}

// --- Library -------------------------------------------------------------------------------------

/// The largest pressure of the whole scene in Pa.
double peakOf(const Scene& scene) {
  Result<SceneSound> sound = SceneSound::create(scene);
  EXPECT_TRUE(sound) << sound.error().message;
  std::vector<std::vector<float>> channels(channelsOf(scene), std::vector<float>(4096));
  double peak = 0.0;
  while (const std::size_t frames = sound->render(channels)) {
    for (const std::vector<float>& channel : channels) {
      for (std::size_t frame = 0; frame < frames; ++frame)
        peak = std::max(peak, std::abs(static_cast<double>(channel[frame])));
    }
  }
  return peak;
}

TEST(SceneMechanics, LibraryScenesAreAsLoudAsSuchThingsAre) {
  for (const char* name : {"swinging_cradle", "nine_ball_break", "marble_steps"}) {
    const double peak = peakOf(libraryScene(name));
    EXPECT_GT(peak, 0.02) << name;  // 60 dB SPL
    EXPECT_LT(peak, 20.0) << name;  // 120 dB SPL
  }
}

TEST(SceneMechanics, SwingingCradleStrikesWithThePeriodOfItsPendulums) {
  const std::vector<ImpulseEvent> events = eventsOf(libraryScene("swinging_cradle"));
  ASSERT_FALSE(events.empty());
  // The quarter period from 30 degrees, by the arithmetic-geometric mean, plus the gap of 0.1 mm.
  double mean = 1.0;
  double other = std::cos(std::numbers::pi / 12.0);
  for (int round = 0; round < 5; ++round) {
    const double next = 0.5 * (mean + other);
    other = std::sqrt(mean * other);
    mean = next;
  }
  const double quarter = 0.5 * std::numbers::pi * std::sqrt(0.3 / kGravity) / mean;
  const double speed = std::sqrt(2.0 * kGravity * 0.3 * (1.0 - std::sqrt(0.75)));
  EXPECT_NEAR(events[0].time, quarter + 1e-4 / speed, 1e-6);
  EXPECT_NEAR(events[0].approachSpeed, speed, 1e-5);
}

TEST(SceneMechanics, MarbleTakesEveryStairDown) {
  const Scene scene = libraryScene("marble_steps");
  std::vector<bool> hit(scene.bodies.size(), false);
  for (const ImpulseEvent& event : eventsOf(scene))
    hit[event.body] = true;
  EXPECT_TRUE(hit.front()) << "the hall";
  EXPECT_TRUE(hit.back()) << "the marble";
  EXPECT_GE(std::ranges::count(hit, true), 6);  // the marble may jump over one step
}

TEST(SceneMechanics, NineBallsComeToRestOnTheirBed) {
  const Scene scene = libraryScene("nine_ball_break");
  Result<SphereStepper> stepper = nativeStepper(scene);
  ASSERT_TRUE(stepper);
  const double before = stepper->kineticEnergy();
  stepper->advanceTo(scene.duration);
  EXPECT_LT(stepper->kineticEnergy(), 0.02 * before);
  for (std::size_t ball = 0; ball < stepper->sphereCount(); ++ball)
    EXPECT_NEAR(stepper->state(ball).position.y(), 0.028575, 1e-3);
}

}  // namespace
}  // namespace carom::test
