#include "audio/contact/contact_drive.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "audio/model/hertz.h"
#include "tests/support/random.h"

namespace carom {

using namespace audio;

namespace {

constexpr double kTexel = 1e-3;
constexpr double kWave = 32.0 * kTexel;

SurfaceTexture waves(float steepness) {
  std::vector<SurfaceTexture::Slope> slopes;
  for (std::size_t v = 0; v < 2; ++v)
    for (std::size_t u = 0; u < 64; ++u)
      slopes.emplace_back(
          steepness * static_cast<float>(
                          std::cos(2.0 * std::numbers::pi * (static_cast<double>(u) + 0.5) / 32.0)),
          0.0F);
  return *SurfaceTexture::ofSlopes({64, 2}, {kTexel, kTexel}, slopes);
}

/// A step that slides along x at `speed` (m/s), beginning at x = `from` (m).
ContactDrive::Step slideAlong(const SurfaceTexture& texture, double from, double speed,
                              double duration) {
  ContactDrive::Step step;
  step.duration = duration;
  step.load = 1e6;
  step.mass = 0.3;
  step.radius = 1e-9;  // touches at a point, and is rigid
  step.sampleRate = 48000.0;
  step.surfaces[1].texture = &texture;
  step.surfaces[1].from = {from, 0.0, 0.0};
  step.surfaces[1].to = {from + speed * duration, 0.0, 0.0};
  return step;
}

/// Gives the contact that stiffness (N/m) at its load, by Hertz (Johnson 1985, eq. 4.23).
void soften(ContactDrive::Step& step, double stiffness) {
  step.modulus = 0.75 * std::sqrt(std::pow(stiffness / 1.5, 3) / (step.load * step.radius));
}

/// Share of a wave's amplitude that a quadratic spline through its texels keeps: the spline's
/// transform.
const double kKept = std::pow(std::sin(std::numbers::pi / 32.0) / (std::numbers::pi / 32.0), 3);

// On a wave of slope s cos(k x), the momentum given between any two nodes is m v s (cos(k x2) -
// cos(k x1)).
TEST(ContactDrive, ImpulsesAddUpToTheMomentumThatTheSlopeAsksFor) {
  const SurfaceTexture texture = waves(0.1F);
  ContactDrive drive;
  const double speed = 0.7;
  const double duration = 0.01;
  std::vector<PulseNode> nodes;
  double momentum = 0.0;
  double first = 0.0;
  for (int index = 0; index < 20; ++index) {
    drive.advance(slideAlong(texture, index * speed * duration, speed, duration), nodes);
    const std::vector<PulseNode> train = nodes;
    ASSERT_FALSE(train.empty());
    const double dt = duration / static_cast<double>(train.size());
    for (const PulseNode& node : train) {
      momentum += node.weight;
      const double x = speed * (duration * (index + node.u) + 0.5 * dt);
      const double expected =
          kKept * 0.3 * speed * 0.1 * std::cos(2.0 * std::numbers::pi * x / kWave);
      if (index == 0 && node.u == 0.0) first = expected;
      EXPECT_NEAR(momentum + first, expected, 0.3 * speed * 0.1 * 1e-3);
    }
  }
}

// The contact slides from the waves onto a side on which they run across its way: the bumps end at
// once.
TEST(ContactDrive, AfterAKnockItIsQuietAgainHoweverStiffTheContact) {
  const SurfaceTexture texture = waves(0.1F);
  for (const double load : {1.0, 1e3, 1e6}) {
    ContactDrive drive;
    std::vector<PulseNode> nodes;
    for (int index = 0; index < 10; ++index) {
      ContactDrive::Step step = slideAlong(texture, index * 0.007, 0.7, 0.01);
      step.load = load;
      if (index > 0) step.surfaces[1].normal = Vec3::UnitY();
      drive.advance(step, nodes);
      ASSERT_EQ(nodes.size(), 480u);
    }
    const double knock = 0.3 * 0.7 * 0.1;
    for (const PulseNode& node : nodes)
      ASSERT_LT(std::abs(node.weight), 1e-6 * knock) << load << " N at " << node.u;
  }
}

TEST(ContactDrive, NothingPullsHarderThanTheLoad) {
  const SurfaceTexture texture = waves(0.5F);
  for (const double load : {0.0, 0.1, 3.0, 100.0}) {
    ContactDrive drive;
    std::vector<PulseNode> nodes;
    double momentum = 0.0;
    double pulls = 0.0;
    for (int index = 0; index < 200; ++index) {
      ContactDrive::Step step = slideAlong(texture, index * 0.02, 2.0, 0.01);
      step.load = load;
      step.restitution = 0.6;
      drive.advance(step, nodes);
      const std::vector<PulseNode> train = nodes;
      const double dt = 0.01 / static_cast<double>(train.size());
      for (const PulseNode& node : train) {
        EXPECT_GE(node.weight, -load * dt - 1e-12);
        momentum += node.weight;
        pulls = std::min(pulls, momentum);
      }
    }
    // The body never takes off for good: the bumps throw it up at most at the steepest slope's
    // speed.
    EXPECT_LT(std::abs(momentum), 3.0 * 0.3 * 2.0 * 0.5 + load * 2.0);
  }
}

// In flight the load is the only force, so that the impulses of a long chatter balance it on
// average.
TEST(ContactDrive, AChatteringContactIsHeldUpByItsImpacts) {
  const SurfaceTexture texture = waves(0.5F);
  ContactDrive drive;
  std::vector<PulseNode> nodes;
  double sum = 0.0;
  double strongest = 0.0;
  std::size_t falling = 0;
  std::size_t count = 0;
  for (int index = 0; index < 2000; ++index) {
    ContactDrive::Step step = slideAlong(texture, index * 0.02, 2.0, 0.01);
    step.load = 20.0;
    step.restitution = 0.5;
    drive.advance(step, nodes);
    const double dt = 0.01 / static_cast<double>(nodes.size());
    for (const PulseNode& node : nodes) {
      sum += node.weight;
      strongest = std::max(strongest, node.weight);
      ++count;
      if (std::abs(node.weight + 20.0 * dt) < 1e-9) ++falling;
    }
  }
  EXPECT_GT(static_cast<double>(falling) / static_cast<double>(count), 0.3);  // the body does fly
  EXPECT_GT(strongest, 0.02);  // the impacts are hard, beside m v s = 0.3
  EXPECT_LT(strongest, 2.0 * 0.3 * 2.0);
  EXPECT_LT(std::abs(sum), 0.02 * 20.0 * 20.0);  // 2 % of the load's impulse over 20 s
}

TEST(ContactDrive, AtRestThereIsNothing) {
  const SurfaceTexture texture = waves(0.5F);
  ContactDrive drive;
  std::vector<PulseNode> nodes = {{0.0, 1.0}};
  for (int index = 0; index < 1000; ++index) {
    drive.advance(slideAlong(texture, 0.0, 0.9e-3, 1e-3), nodes);
    EXPECT_TRUE(nodes.empty());
  }
  for (int index = 0; index < 12; ++index)  // gets beyond a step's fall, 10 um
    drive.advance(slideAlong(texture, 1.1e-6 * index, 1.1e-3, 1e-3), nodes);
  EXPECT_FALSE(nodes.empty());
  drive.advance(slideAlong(texture, 0.0, 0.6e-3, 0.01), nodes);  // hysteresis keeps it sliding
  EXPECT_FALSE(nodes.empty());
  drive.advance(slideAlong(texture, 0.0, 0.4e-3, 0.01), nodes);
  EXPECT_TRUE(nodes.empty());
  drive.advance(slideAlong(texture, 0.0, 2000.0, 0.01), nodes);  // a teleport
  EXPECT_TRUE(nodes.empty());
}

// A body that rests on a solver moves to and fro by up to the distance that it falls from rest in a
// step: 0.7 mm at 1/120 s. A sliding body gets farther.
TEST(ContactDrive, WhatRattlesInPlaceRests) {
  const SurfaceTexture texture = waves(0.5F);
  const double dt = 1.0 / 120.0;
  ContactDrive drive;
  std::vector<PulseNode> nodes;
  for (int index = 0; index < 240; ++index) {
    drive.advance(slideAlong(texture, 0.0, index % 2 == 0 ? 0.07 : -0.07, dt), nodes);
    EXPECT_TRUE(nodes.empty());
  }
  drive.advance(slideAlong(texture, 0.0, 0.07, dt), nodes);
  EXPECT_TRUE(nodes.empty());
  drive.advance(slideAlong(texture, 0.07 * dt, 0.07, dt), nodes);
  EXPECT_FALSE(nodes.empty());
}

// A mass m on a spring k whose base is shaken at the speed h w cos(w t): the mass's speed is that
// of a driven oscillator, 1 / (1 - (w / w0)^2) times as large. It is measured as the largest
// impulse, w m v per unit of time, once the transient has died out.
TEST(ContactDrive, BumpsTooFastForTheContactsSpringArePressedIn) {
  const SurfaceTexture texture = waves(1e-3F);
  const double speed = 3.2;  // 100 Hz
  const double mass = 0.3;
  const double w = 2.0 * std::numbers::pi * speed / kWave;
  for (const double ratio : {0.3, 0.6, 2.0, 5.0}) {
    const double w0 = w / ratio;
    ContactDrive drive;
    std::vector<PulseNode> nodes;
    double strongest = 0.0;
    double dt = 0.0;
    for (int index = 0; index < 400; ++index) {
      ContactDrive::Step step = slideAlong(texture, index * 0.01 * speed, speed, 0.01);
      soften(step, mass * w0 * w0);
      step.restitution = 0.9;
      drive.advance(step, nodes);
      dt = 0.01 / static_cast<double>(nodes.size());
      for (const PulseNode& node : nodes)
        if (index >= 300) strongest = std::max(strongest, std::abs(node.weight));
    }
    const double rigid = kKept * mass * speed * 1e-3 * w * dt;
    const double decay = -std::log(0.9);
    const double zeta = decay / std::hypot(std::numbers::pi, decay);
    const double loss = 2.0 * zeta * ratio;
    const double expected = rigid * std::hypot(1.0, loss) / std::hypot(1.0 - ratio * ratio, loss);
    EXPECT_NEAR(strongest, expected, 0.01 * expected) << ratio;
  }
}

/// Steady state of a mass that a spring with losses holds on a wave.
struct Steady {
  double strongest = 0.0;  // N s
  double taken = 0.0;      // J per step, work that the undeformed bumps do
};

Steady steadyOf(double work) {
  const SurfaceTexture texture = waves(1e-3F);
  const double speed = 3.2;  // 100 Hz
  ContactDrive drive;
  std::vector<PulseNode> nodes;
  Steady steady;
  constexpr int kSteps = 800;
  for (int index = 0; index < kSteps; ++index) {
    ContactDrive::Step step = slideAlong(texture, index * 0.01 * speed, speed, 0.01);
    soften(step, step.mass * std::pow(2.0 * std::numbers::pi * 150.0, 2));
    step.restitution = 0.3;
    step.work = work;
    drive.advance(step, nodes);
    if (index < kSteps / 2) continue;
    const std::vector<PulseNode> train = nodes;
    const double dt = 0.01 / static_cast<double>(train.size());
    for (const PulseNode& node : train) {
      const double x = speed * (0.01 * (index + node.u) + 0.5 * dt);
      const double pushed = kKept * speed * 1e-3 * std::cos(2.0 * std::numbers::pi * x / kWave);
      steady.taken += (node.weight + step.load * dt) * pushed / (0.5 * kSteps);
      steady.strongest = std::max(steady.strongest, std::abs(node.weight));
    }
  }
  return steady;
}

// The system is linear: a quarter of the energy means half of the force.
TEST(ContactDrive, TakesNoMoreOfTheMotionThanItLoses) {
  const Steady free = steadyOf(std::numeric_limits<double>::infinity());
  EXPECT_GT(free.taken, 0.0);
  EXPECT_EQ(steadyOf(1.1 * free.taken).strongest, free.strongest);
  EXPECT_NEAR(steadyOf(0.25 * free.taken).strongest, 0.5 * free.strongest, 0.03 * free.strongest);
  EXPECT_LT(steadyOf(0.0).strongest, 2e-3 * free.strongest);
}

// Two bodies that roll on each other scan both surfaces; a body that slides scans only the other's.
TEST(ContactDrive, BothSurfacesCount) {
  const SurfaceTexture texture = waves(0.1F);
  std::vector<PulseNode> one;
  std::vector<PulseNode> both;
  ContactDrive::Step step = slideAlong(texture, 0.003, 1.0, 0.01);
  ContactDrive().advance(step, one);
  step.surfaces[0] = step.surfaces[1];
  ContactDrive().advance(step, both);
  ASSERT_EQ(one.size(), both.size());
  for (std::size_t index = 0; index < one.size(); ++index)
    EXPECT_NEAR(both[index].weight, 2.0 * one[index].weight, 1e-9);
}

// The width of a rigid contact under a load that is finite, and too large to be multiplied, is no
// number.
TEST(ContactDrive, ALoadThatIsTooLargeBeginsAnew) {
  const SurfaceTexture texture = waves(0.1F);
  const auto stepAt = [&texture](int index) {
    ContactDrive::Step step = slideAlong(texture, 0.01 * index, 1.0, 0.01);
    step.radius = 1e3;
    return step;
  };
  ContactDrive drive;
  ContactDrive fresh;
  std::vector<PulseNode> nodes;
  std::vector<PulseNode> expected;
  drive.advance(stepAt(0), nodes);
  ContactDrive::Step heavy = stepAt(1);
  heavy.load = 1e308;
  drive.advance(heavy, nodes);
  EXPECT_TRUE(nodes.empty());
  for (int index = 2; index < 5; ++index) {
    drive.advance(stepAt(index), nodes);
    fresh.advance(stepAt(index), expected);
    ASSERT_EQ(nodes.size(), expected.size());
    for (std::size_t i = 0; i < nodes.size(); ++i)
      EXPECT_EQ(nodes[i].weight, expected[i].weight) << index << ", " << i;
  }
  EXPECT_FALSE(nodes.empty());
}

// A ground without a shape has an infinite radius.
TEST(ContactDrive, ABallOfInfiniteRadiusIsFlat) {
  const SurfaceTexture texture = waves(0.1F);
  ContactDrive drive;
  ContactDrive flat;
  std::vector<PulseNode> nodes;
  std::vector<PulseNode> expected;
  ContactDrive::Step step = slideAlong(texture, 0.0, 1.0, 0.01);
  flat.advance(step, expected);
  step.surfaces[1].ballRadius = std::numeric_limits<double>::infinity();
  drive.advance(step, nodes);
  ASSERT_FALSE(expected.empty());
  ASSERT_EQ(nodes.size(), expected.size());
  for (std::size_t i = 0; i < nodes.size(); ++i)
    EXPECT_EQ(nodes[i].weight, expected[i].weight) << i;
}

// The way of one side that is no number stood behind that of the other, in the larger of the two.
TEST(ContactDrive, APathThatIsNoNumberBeginsAnew) {
  const SurfaceTexture texture = waves(0.1F);
  for (const double strange :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e200}) {
    ContactDrive drive;
    std::vector<PulseNode> nodes;
    drive.advance(slideAlong(texture, 0.0, 1.0, 0.01), nodes);
    ASSERT_FALSE(nodes.empty());
    ContactDrive::Step step = slideAlong(texture, 0.01, 1.0, 0.01);
    step.surfaces[0] = step.surfaces[1];
    step.surfaces[1].from.x() = step.surfaces[1].to.x() = strange;
    drive.advance(step, nodes);
    EXPECT_TRUE(nodes.empty()) << strange;
  }
}

TEST(ContactDrive, AnyHistoryStaysBounded) {
  const SurfaceTexture rough = *SurfaceTexture::rough({1e-3, 1e-3, 0.5}, 3);
  Random random(4);
  for (int history = 0; history < 10000; ++history) {
    ContactDrive drive;
    std::vector<PulseNode> nodes;
    Vec3 at = Vec3::Zero();
    double fastest = 0.0;
    double heaviest = 0.0;
    const double mass = std::pow(10.0, random.between(-4.0, 4.0));
    const double radius = std::pow(10.0, random.between(-6.0, 3.0));
    const double modulus = std::pow(10.0, random.between(6.0, 12.0));
    for (int index = 0; index < 20; ++index) {
      ContactDrive::Step step =
          slideAlong(rough, 0.0, 0.0, std::pow(10.0, random.between(-4.0, -1.5)));
      step.mass = mass;
      step.load = random.between(0.0, 1.0) < 0.2 ? 0.0 : std::pow(10.0, random.between(-6.0, 6.0));
      step.radius = radius;
      step.modulus = modulus;
      step.restitution = random.between(0.0, 1.0);
      const double speed = std::pow(10.0, random.between(-4.0, 2.0));
      step.surfaces[1].from = at;
      at += speed * step.duration * random.inCube();
      if (random.between(0.0, 1.0) < 0.1) at = 1e6 * random.inCube();
      step.surfaces[1].to = at;
      step.surfaces[1].normal = random.inCube().normalized();
      fastest =
          std::max(fastest, (step.surfaces[1].to - step.surfaces[1].from).norm() / step.duration);
      heaviest = std::max(heaviest, step.load);
      drive.advance(step, nodes);
      for (const PulseNode& node : nodes) {
        ASSERT_TRUE(std::isfinite(node.weight));
        // Worst case: the body meets the steepest slope at the highest speed, after another slope
        // threw it up and it fell the largest possible distance; and it bounces back.
        const double slope = std::min(fastest, ContactDrive::kFastest) * 15.0;
        // The spring, too, throws it up: the depth to which the heaviest load presses it, with its
        // asperities.
        const double pressed =
            heaviest / hertzStiffness({heaviest + 1e-9, radius, modulus}) + 0.4e-3;
        const double fallen =
            std::sqrt(2.0 * heaviest * (1.0 + pressed) / mass + 4.0 * slope * slope);
        ASSERT_LE(node.weight, 2.0 * mass * (slope + fallen + heaviest / mass * step.duration));
      }
    }
  }
}

}  // namespace
}  // namespace carom
