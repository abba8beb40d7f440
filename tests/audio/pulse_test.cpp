#include "audio/model/pulse.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "audio/model/acceleration_noise.h"
#include "tests/support/no_alloc_scope.h"

namespace carom {

using namespace audio;

namespace {

using std::numbers::pi;

struct NamedPulse {
  std::string name;
  Pulse pulse;
};

const std::vector<NamedPulse>& shapes() {
  static const std::vector<NamedPulse> list = {{"hertz", Pulse::of(PulseShape::hertz)},
                                               {"half-sine", Pulse::of(PulseShape::halfSine)},
                                               {"gaussian", Pulse::of(PulseShape::gaussian)},
                                               {"cubic", Pulse::of(PulseShape::mitchellNetravali)},
                                               {"hand-out", Pulse::of(PulseShape::courseGaussian)}};
  return list;
}

std::vector<NamedPulse> allPulses() {
  std::vector<NamedPulse> list = shapes();
  for (const double e : {0.99, 0.9, 0.7, 0.5, 0.3, 0.15, 0.05}) {
    list.push_back({"restitution " + std::to_string(e), Pulse::dissipativeHertz(e)});
  }
  return list;
}

// ---- Oracles -----------------------------------------------------------------------------------

/// Returns a pulse as points with masses, by five-point Gauss-Legendre in many cells. The cells are
/// finest where the pulse begins and ends, and meet at the knots of the cubic.
std::vector<PulseNode> fineGrid(const Pulse& pulse, int cellsPerQuarter) {
  const double inner = std::sqrt(5.0 - 2.0 * std::sqrt(10.0 / 7.0)) / 3.0;
  const double outer = std::sqrt(5.0 + 2.0 * std::sqrt(10.0 / 7.0)) / 3.0;
  const double near = (322.0 + 13.0 * std::sqrt(70.0)) / 900.0;
  const double far = (322.0 - 13.0 * std::sqrt(70.0)) / 900.0;
  const std::array<PulseNode, 5> five = {
      {{-outer, far}, {-inner, near}, {0.0, 128.0 / 225.0}, {inner, near}, {outer, far}}};
  const double length = pulse.end() - pulse.begin();
  std::vector<PulseNode> grid;
  for (int quarter = 0; quarter < 4; ++quarter) {
    const double from = std::acos(1.0 - 0.5 * quarter);
    const double half = 0.5 * (std::acos(0.5 - 0.5 * quarter) - from) / cellsPerQuarter;
    for (int cell = 0; cell < cellsPerQuarter; ++cell) {
      for (const PulseNode& node : five) {
        const double angle = from + half * (2 * cell + 1 + node.u);
        const double u = pulse.begin() + length * 0.5 * (1.0 - std::cos(angle));
        grid.push_back({u, pulse.force(u) * length * 0.5 * std::sin(angle) * half * node.weight});
      }
    }
  }
  return grid;
}

std::complex<double> transform(std::span<const PulseNode> nodes, double w) {
  std::complex<double> sum;
  for (const PulseNode& node : nodes)
    sum += std::polar(node.weight, w * (node.u - 0.5));
  return sum;
}

double mean(std::span<const PulseNode> nodes) {
  double total = 0.0;
  double sum = 0.0;
  for (const PulseNode& node : nodes) {
    total += node.weight;
    sum += node.weight * node.u;
  }
  return sum / total;
}

/// Returns the moments of Legendre polynomials of degrees 0 to `degree` over the support.
std::vector<double> moments(std::span<const PulseNode> nodes, const Pulse& pulse,
                            std::size_t degree) {
  std::vector<double> sums(degree + 1);
  for (const PulseNode& node : nodes) {
    const double x = 2.0 * (node.u - pulse.begin()) / (pulse.end() - pulse.begin()) - 1.0;
    double before = 0.0;
    double value = 1.0;
    for (std::size_t k = 0; k <= degree; ++k) {
      sums[k] += node.weight * value;
      const auto order = static_cast<double>(k);
      const double next = ((2.0 * order + 1.0) * x * value - order * before) / (order + 1.0);
      before = value;
      value = next;
    }
  }
  return sums;
}

/// A state of Hunt and Crossley's contact with m = K = v0 = 1, d'' = -d^(3/2) (1 + x d'), which
/// runContact integrates by RK4 in long double with equal steps of time.
struct ContactSample {
  long double time = 0.0L;
  long double depth = 0.0L;
  long double speed = 1.0L;
};

struct ContactRun {
  long double x = 0.0L;
  std::vector<ContactSample> samples;
  long double duration = 0.0L;
  long double lastSpeed = 0.0L;
  long double dissipated = 0.0L;  // work of the damping part of the force

  double restitution() const { return static_cast<double>(-lastSpeed); }
};

long double contactForce(long double x, long double depth, long double speed) {
  const long double d = std::max(depth, 0.0L);
  return d * std::sqrt(d) * (1.0L + x * speed);
}

ContactSample contactStep(long double x, const ContactSample& from, long double h) {
  const auto rate = [&](long double c, const ContactSample& k) {
    const long double depth = from.depth + c * h * k.depth;
    const long double speed = from.speed + c * h * k.speed;
    return ContactSample{0.0L, speed, -contactForce(x, depth, speed)};
  };
  const ContactSample k1 = rate(0.0L, {});
  const ContactSample k2 = rate(0.5L, k1);
  const ContactSample k3 = rate(0.5L, k2);
  const ContactSample k4 = rate(1.0L, k3);
  const auto sum = [&](auto part) {
    return h / 6.0L * (k1.*part + 2.0L * (k2.*part) + 2.0L * (k3.*part) + k4.*part);
  };
  return {from.time + h, from.depth + sum(&ContactSample::depth),
          from.speed + sum(&ContactSample::speed)};
}

ContactRun runContact(double x) {
  constexpr long double kStep = 4e-5L;
  ContactRun run;
  run.x = x;
  ContactSample state;
  while (state.depth >= 0.0L) {
    run.samples.push_back(state);
    const ContactSample next = contactStep(run.x, state, kStep);
    const auto loss = [&](const ContactSample& s) {
      const long double d = std::max(s.depth, 0.0L);
      return d * std::sqrt(d) * run.x * s.speed * s.speed;
    };
    run.dissipated += 0.5L * kStep * (loss(state) + loss(next));
    state = next;
  }
  const ContactSample& last = run.samples.back();
  run.duration = last.time - last.depth / last.speed;
  run.lastSpeed = last.speed;
  return run;
}

/// Largest errors of a pulse against an integrated contact, relative to the pulse's own peaks.
struct ContactErrors {
  double force = 0.0;
  double slope = 0.0;
};

ContactErrors compare(const Pulse& pulse, const ContactRun& run) {
  ContactErrors errors;
  const long double duration = run.duration;
  const long double momentum = 1.0L - run.lastSpeed;
  for (std::size_t index = 1; index < run.samples.size(); index += 7) {
    const ContactSample& s = run.samples[index];
    const long double force = contactForce(run.x, s.depth, s.speed);
    const long double root = std::sqrt(s.depth);
    const long double slope =
        1.5L * root * s.speed * (1.0L + run.x * s.speed) - s.depth * root * run.x * force;
    const auto u = static_cast<double>(s.time / duration);
    const auto expected = static_cast<double>(force * duration / momentum);
    const auto expectedSlope = static_cast<double>(slope * duration * duration / momentum);
    errors.force = std::max(errors.force, std::abs(pulse.force(u) - expected));
    errors.slope = std::max(errors.slope, std::abs(pulse.slope(u) - expectedSlope));
  }
  return {errors.force / pulse.peakForce(), errors.slope / pulse.peakSlope()};
}

// ---- Shapes ------------------------------------------------------------------------------------

TEST(Pulse, HertzIsTheIntegratedContact) {
  const ContactRun run = runContact(0.0);
  const double beta = std::tgamma(0.4) * std::tgamma(0.5) / std::tgamma(0.9);
  EXPECT_NEAR(static_cast<double>(run.duration), 0.8 * beta * std::pow(1.25, 0.4), 1e-12);
  const ContactErrors errors = compare(Pulse::of(PulseShape::hertz), run);
  EXPECT_LT(errors.force, 1e-12);
  EXPECT_LT(errors.slope, 1e-11);
}

TEST(Pulse, HertzPeaksWhereItsEnergySays) {
  // The greatest depth follows from (2/5) d^(5/2) = 1/2; the force there is d^(3/2), and its whole
  // impulse is 2.
  const double beta = std::tgamma(0.4) * std::tgamma(0.5) / std::tgamma(0.9);
  const double duration = 0.8 * beta * std::pow(1.25, 0.4);
  const Pulse& hertz = Pulse::of(PulseShape::hertz);
  EXPECT_NEAR(hertz.peakForce(), 0.5 * duration * std::pow(1.25, 0.6), 1e-12);
  // The slope, 3/2 d^(1/2) d', is largest where d'^2 = 2 d^(5/2), and d'^2 = 1 - (4/5) d^(5/2).
  const double depth = std::pow(1.0 / 2.8, 0.4);
  const double slope = 1.5 * std::sqrt(depth) * std::sqrt(1.0 - 0.8 * std::pow(depth, 2.5));
  EXPECT_NEAR(hertz.peakSlope(), 0.5 * duration * duration * slope, 1e-10);
}

TEST(Pulse, HertzIsSymmetric) {
  const Pulse& hertz = Pulse::of(PulseShape::hertz);
  for (int index = 0; index <= 64; ++index) {
    const double u = index / 64.0;
    EXPECT_NEAR(hertz.force(u), hertz.force(1.0 - u), 1e-13);
    EXPECT_NEAR(hertz.slope(u), -hertz.slope(1.0 - u), 1e-11);
  }
}

struct L2Errors {
  double force = 0.0;
  double slope = 0.0;
};

L2Errors againstHertz(const Pulse& pulse) {
  constexpr int kPoints = 200000;
  const Pulse& hertz = Pulse::of(PulseShape::hertz);
  const double from = std::min(0.0, pulse.begin());
  const double length = std::max(1.0, pulse.end()) - from;
  L2Errors difference;
  L2Errors reference;
  for (int point = 0; point < kPoints; ++point) {
    const double u = from + length * (point + 0.5) / kPoints;
    difference.force += std::pow(pulse.force(u) - hertz.force(u), 2.0);
    difference.slope += std::pow(pulse.slope(u) - hertz.slope(u), 2.0);
    reference.force += std::pow(hertz.force(u), 2.0);
    reference.slope += std::pow(hertz.slope(u), 2.0);
  }
  return {100.0 * std::sqrt(difference.force / reference.force),
          100.0 * std::sqrt(difference.slope / reference.slope)};
}

TEST(Pulse, ShapesErrAgainstHertzAsDocumented) {
  const std::vector<std::pair<PulseShape, L2Errors>> table = {
      {PulseShape::halfSine, {14.0, 38.8}},
      {PulseShape::courseGaussian, {22.7, 43.2}},
      {PulseShape::gaussian, {8.4, 23.3}},
      {PulseShape::mitchellNetravali, {69.3, 206.7}}};
  for (const auto& [shape, percent] : table) {
    const L2Errors errors = againstHertz(Pulse::of(shape));
    EXPECT_NEAR(errors.force, percent.force, 0.0501) << static_cast<int>(shape);
    EXPECT_NEAR(errors.slope, percent.slope, 0.0501) << static_cast<int>(shape);
  }
}

TEST(Pulse, CubicWithHalfTheDurationAsItsUnitErrsLess) {
  constexpr int kPoints = 200000;
  const Pulse& hertz = Pulse::of(PulseShape::hertz);
  const Pulse& cubic = Pulse::of(PulseShape::mitchellNetravali);
  L2Errors difference;
  L2Errors reference;
  for (int point = 0; point < kPoints; ++point) {
    const double u = -0.5 + 2.0 * (point + 0.5) / kPoints;
    const double narrow = 0.5 + 0.5 * (u - 0.5);
    difference.force += std::pow(0.5 * cubic.force(narrow) - hertz.force(u), 2.0);
    difference.slope += std::pow(0.25 * cubic.slope(narrow) - hertz.slope(u), 2.0);
    reference.force += std::pow(hertz.force(u), 2.0);
    reference.slope += std::pow(hertz.slope(u), 2.0);
  }
  EXPECT_NEAR(100.0 * std::sqrt(difference.force / reference.force), 8.0, 0.05);
  EXPECT_NEAR(100.0 * std::sqrt(difference.slope / reference.slope), 22.3, 0.05);
}

TEST(Pulse, ImpulseAndCentreAreTheIntegrals) {
  for (const auto& [name, pulse] : allPulses()) {
    const std::vector<PulseNode> grid = fineGrid(pulse, 512);
    double impulse = 0.0;
    for (const PulseNode& node : grid)
      impulse += node.weight;
    EXPECT_NEAR(impulse, pulse.impulse(), 1e-12) << name;
    EXPECT_NEAR(mean(grid), pulse.centre(), 1e-12) << name;
    EXPECT_NEAR(pulse.impulse(), name == "hand-out" ? 1.1366 : 1.0, 5e-5) << name;
  }
}

TEST(Pulse, SlopeIsTheDerivativeOfForce) {
  constexpr double kStep = 1e-5;
  for (const auto& [name, pulse] : allPulses()) {
    const double length = pulse.end() - pulse.begin();
    for (int index = 1; index < 1000; ++index) {
      const double u = pulse.begin() + length * (index + 0.3) / 1001.0;
      const double slope = (pulse.force(u - 2.0 * kStep) - 8.0 * pulse.force(u - kStep) +
                            8.0 * pulse.force(u + kStep) - pulse.force(u + 2.0 * kStep)) /
                           (12.0 * kStep);
      EXPECT_NEAR(pulse.slope(u), slope, 1e-8 * pulse.peakSlope()) << name << " at " << u;
    }
  }
}

TEST(Pulse, PeaksAreTheLargestMagnitudes) {
  for (const auto& [name, pulse] : allPulses()) {
    double force = 0.0;
    double slope = 0.0;
    for (int index = 0; index <= 100000; ++index) {
      const double u = pulse.begin() + (pulse.end() - pulse.begin()) * index / 100000.0;
      force = std::max(force, std::abs(pulse.force(u)));
      slope = std::max(slope, std::abs(pulse.slope(u)));
    }
    EXPECT_LE(force, pulse.peakForce() * (1.0 + 1e-12)) << name;
    EXPECT_LE(slope, pulse.peakSlope() * (1.0 + 1e-10)) << name;
    EXPECT_NEAR(force / pulse.peakForce(), 1.0, 1e-5) << name;
    EXPECT_NEAR(slope / pulse.peakSlope(), 1.0, 1e-5) << name;
  }
  EXPECT_NEAR(Pulse::of(PulseShape::courseGaussian).peakSlope(), 0.5 * pi * kPulsePeakSlope, 1e-14);
  EXPECT_NEAR(Pulse::of(PulseShape::halfSine).peakSlope(), 0.5 * pi * pi, 1e-14);
}

TEST(Pulse, HandOutHasTheBitsOfTheGaussianPulse) {
  const Pulse& courseGaussian = Pulse::of(PulseShape::courseGaussian);
  EXPECT_EQ(courseGaussian.begin(), 0.5 - kPulseHalfWidth);
  EXPECT_EQ(courseGaussian.end(), 0.5 + kPulseHalfWidth);
  for (int index = 0; index <= 5000; ++index) {
    const double u = -2.0 + index * 1e-3;
    EXPECT_EQ(courseGaussian.force(u), 0.5 * pi * gaussianPulse(u));
    EXPECT_EQ(courseGaussian.slope(u), 0.5 * pi * gaussianPulseSlope(u));
  }
}

TEST(Pulse, IsNoughtOutsideOfItsSupport) {
  for (const auto& [name, pulse] : allPulses()) {
    for (const double beyond : {1e-12, 0.1, 1e9, std::numeric_limits<double>::infinity()}) {
      EXPECT_EQ(pulse.force(pulse.begin() - beyond), 0.0) << name;
      EXPECT_EQ(pulse.slope(pulse.end() + beyond), 0.0) << name;
    }
    EXPECT_EQ(pulse.force(std::numeric_limits<double>::quiet_NaN()), 0.0) << name;
    EXPECT_NEAR(pulse.force(pulse.begin()), 0.0, 1e-15) << name;
    EXPECT_NEAR(pulse.force(pulse.end()), 0.0, 1e-15) << name;
  }
}

TEST(Pulse, CubicsAtEqualDistancesSumToOne) {
  const Pulse& cubic = Pulse::of(PulseShape::mitchellNetravali);
  for (int index = 0; index < 100; ++index) {
    const double u = index / 400.0;
    double sum = 0.0;
    for (int shift = 0; shift < 4; ++shift)
      sum += cubic.force(u + 0.25 * shift);
    EXPECT_NEAR(sum, 4.0, 1e-14);
  }
  EXPECT_DOUBLE_EQ(cubic.force(0.5), 4.0 * 8.0 / 9.0);
  EXPECT_DOUBLE_EQ(cubic.force(0.75), 4.0 / 18.0);
}

TEST(Pulse, CubicPullsAtItsEnds) {
  const Pulse& cubic = Pulse::of(PulseShape::mitchellNetravali);
  EXPECT_NEAR(cubic.force(1.0 / 7.0) / cubic.peakForce(), -2.0 / 49.0, 1e-14);
  EXPECT_NEAR(cubic.force(3.0 / 14.0), 0.0, 1e-14);
  EXPECT_LT(cubic.force(0.2), 0.0);
}

// ---- Contacts that lose energy -----------------------------------------------------------------

TEST(DissipativePulse, IsTheIntegratedContactOfItsRestitution) {
  const ContactRun elastic = runContact(0.0);
  for (const double x : {0.01, 0.1, 0.4, 1.0, 3.0, 8.0, 19.9}) {
    const ContactRun run = runContact(x);
    const double e = run.restitution();
    EXPECT_NEAR(x * (1.0 + e), std::log((1.0 + x) / (1.0 - e * x)), 1e-9 * (1.0 + x)) << x;
    const ContactErrors errors = compare(Pulse::dissipativeHertz(e), run);
    EXPECT_LT(errors.force, 1e-11) << e;
    EXPECT_LT(errors.slope, e > 0.1 ? 1e-10 : 5e-9) << e;
    EXPECT_NEAR(dissipativeDuration(e), static_cast<double>(run.duration / elastic.duration), 1e-10)
        << e;
  }
}

TEST(DissipativePulse, LosesWhatTheDamperTakes) {
  for (const double x : {0.1, 1.0, 8.0}) {
    const ContactRun run = runContact(x);
    const double e = run.restitution();
    EXPECT_NEAR(static_cast<double>(run.dissipated), 0.5 * (1.0 - e * e), 1e-8) << x;
  }
}

TEST(DissipativePulse, GivesTheSpeedAndTheDepthOfABounce) {
  // The force, integrated twice, must take the body from d = 0, d' = 1 to d = 0, d' = -e.
  for (const double e : {0.05, 0.2, 0.5, 0.8, 0.95, 1.0}) {
    const Pulse pulse = Pulse::dissipativeHertz(e);
    double impulse = 0.0;
    double reach = 0.0;
    for (const PulseNode& node : fineGrid(pulse, 512)) {
      impulse += node.weight;
      reach += node.weight * (1.0 - node.u);
    }
    EXPECT_NEAR(1.0 - (1.0 + e) * impulse, -e, 1e-12) << e;
    EXPECT_NEAR(1.0 - (1.0 + e) * reach, 0.0, 1e-12) << e;
  }
}

TEST(DissipativePulse, NeverPullsAndHasOnePeak) {
  for (const double e : {0.05, 0.1, 0.3, 0.6, 0.9, 0.999}) {
    const Pulse pulse = Pulse::dissipativeHertz(e);
    bool falls = false;
    for (int index = 1; index < 4000; ++index) {
      const double u = index / 4000.0;
      EXPECT_GE(pulse.force(u), 0.0) << e;
      const bool nowFalls = pulse.force(u) < pulse.force(u - 1.0 / 4000.0);
      EXPECT_TRUE(nowFalls || !falls) << e << " at " << u;
      falls = nowFalls;
    }
  }
}

double peakPosition(const Pulse& pulse) {
  double best = 0.0;
  for (int index = 0; index <= 10000; ++index) {
    if (pulse.force(index * 1e-4) > pulse.force(best)) best = index * 1e-4;
  }
  return best;
}

TEST(DissipativePulse, RisesFasterAndLastsLongerTheLessItBounces) {
  double peak = 0.5;
  double centre = 0.5;
  double duration = 1.0;
  for (const double e : {0.9, 0.7, 0.5, 0.3, 0.1, 0.05}) {
    const Pulse pulse = Pulse::dissipativeHertz(e);
    EXPECT_LT(peakPosition(pulse), peak);
    EXPECT_LT(pulse.centre(), centre);
    EXPECT_GT(dissipativeDuration(e), duration);
    peak = peakPosition(pulse);
    centre = pulse.centre();
    duration = dissipativeDuration(e);
  }
}

TEST(DissipativePulse, BecomesHertzInProportion) {
  const Pulse& hertz = Pulse::of(PulseShape::hertz);
  for (const double loss : {1e-3, 1e-6, 1e-9, 1e-13, 0.0}) {
    const Pulse pulse = Pulse::dissipativeHertz(1.0 - loss);
    for (int index = 0; index <= 100; ++index) {
      EXPECT_NEAR(pulse.force(index * 0.01), hertz.force(index * 0.01), 2.0 * loss + 1e-12) << loss;
      EXPECT_NEAR(pulse.slope(index * 0.01), hertz.slope(index * 0.01), 20.0 * loss + 1e-10)
          << loss;
    }
    EXPECT_NEAR(dissipativeDuration(1.0 - loss), 1.0 + 0.1 * loss, 2.0 * loss * loss + 1e-13);
  }
  EXPECT_EQ(dissipativeDuration(1.0), 1.0);
  EXPECT_EQ(Pulse::dissipativeHertz(1.0).force(0.3), hertz.force(0.3));
}

TEST(DissipativePulse, SmallRestitutionCountsAsTheLowest) {
  const Pulse lowest = Pulse::dissipativeHertz(kLowestRestitution);
  for (const double e : {0.0, 0.01, -1.0}) {
    EXPECT_EQ(Pulse::dissipativeHertz(e).force(0.1), lowest.force(0.1));
    EXPECT_EQ(dissipativeDuration(e), dissipativeDuration(kLowestRestitution));
  }
}

// ---- Rules -------------------------------------------------------------------------------------

TEST(PulseRule, IsExactForPolynomialsUpToTwiceItsCountLessOne) {
  for (const auto& [name, pulse] : allPulses()) {
    const std::vector<PulseNode> grid = fineGrid(pulse, 400);
    const std::vector<double> exact = moments(grid, pulse, 255);
    for (const std::size_t count : Pulse::ruleCounts()) {
      if (name == "cubic" && count > 2) break;
      const std::vector<double> sums = moments(pulse.rule(count), pulse, 2 * count - 1);
      for (std::size_t degree = 0; degree < sums.size(); ++degree) {
        EXPECT_NEAR(sums[degree], exact[degree], 2e-12) << name << ' ' << count << ' ' << degree;
      }
    }
  }
}

TEST(PulseRule, HasAscendingNodesWithinAndWeightsOfTheForcesSign) {
  for (const auto& [name, pulse] : allPulses()) {
    for (const std::size_t count : Pulse::ruleCounts()) {
      const std::span<const PulseNode> rule = pulse.rule(count);
      ASSERT_EQ(rule.size(), count) << name;
      double before = pulse.begin();
      double sum = 0.0;
      for (const PulseNode& node : rule) {
        EXPECT_GT(node.u, before) << name << ' ' << count;
        const bool mayPull = name == "cubic" && count > 2 && std::abs(node.u - 0.5) > 2.0 / 7.0;
        EXPECT_GT(mayPull ? -node.weight : node.weight, 0.0) << name << ' ' << count;
        before = node.u;
        sum += node.weight;
      }
      EXPECT_LT(before, pulse.end()) << name;
      EXPECT_NEAR(sum, pulse.impulse(), 1e-12) << name;
      EXPECT_NEAR(mean(rule), pulse.centre(), 1e-12) << name;
    }
  }
}

TEST(PulseRule, HasTheTransformsThatAreKnown) {
  const std::span<const PulseNode> halfSine = Pulse::of(PulseShape::halfSine).rule(48);
  const std::span<const PulseNode> gaussian = Pulse::of(PulseShape::gaussian).rule(48);
  for (double w = 0.3; w < 40.0; w += 0.7) {
    const double exact = std::cos(0.5 * w) / (1.0 - (w / pi) * (w / pi));
    EXPECT_NEAR(std::abs(transform(halfSine, w) - exact), 0.0, 1e-12) << w;
    EXPECT_NEAR(std::abs(transform(gaussian, w) - std::exp(-w * w / 40.0)), 0.0, 1e-7) << w;
  }
}

/// Errors of all rules of a pulse, at each frequency of a raster the largest up to it.
class RuleErrors {
 public:
  static constexpr double kStep = 0.25;

  RuleErrors(const Pulse& pulse, double bandwidth) {
    const std::vector<PulseNode> grid = fineGrid(pulse, 160);
    for (const std::size_t count : Pulse::ruleCounts())
      largest_.push_back({count, {}});
    for (double w = kStep; w <= bandwidth; w += kStep) {
      const std::complex<double> exact = transform(grid, w);
      for (auto& [count, errors] : largest_) {
        const double error = std::abs(transform(pulse.rule(count), w) - exact);
        errors.push_back(std::max(error, errors.empty() ? 0.0 : errors.back()));
      }
    }
  }

  /// Largest error up to the first raster frequency at or above `bandwidth`.
  double upTo(double bandwidth, std::size_t count) const {
    const auto index = static_cast<std::size_t>(std::max(0.0, std::ceil(bandwidth / kStep) - 1.0));
    for (const auto& [known, errors] : largest_) {
      if (known == count) return errors.at(index);
    }
    return std::numeric_limits<double>::infinity();
  }

 private:
  std::vector<std::pair<std::size_t, std::vector<double>>> largest_;
};

/// Largest bandwidth for which ruleSize() gives `count` or less, on a raster of 1/16.
double documentedLimit(const Pulse& pulse, std::size_t count) {
  double limit = 0.0;
  for (double w = 0.0625; w < 500.0; w += 0.0625) {
    const std::size_t size = pulse.ruleSize(w);
    if (size != 0 && size <= count) limit = w;
  }
  return limit;
}

TEST(PulseRule, SizeKeepsItsPromise) {
  for (const auto& [name, pulse] : allPulses()) {
    const RuleErrors errors(pulse, 440.0);
    for (double w = RuleErrors::kStep; w <= 439.0; w += RuleErrors::kStep) {
      const std::size_t count = pulse.ruleSize(w);
      if (count == 0) continue;
      EXPECT_LE(errors.upTo(w, count), ruleTolerance(w)) << name << ' ' << count << " at " << w;
    }
  }
}

TEST(PulseRule, SizeIsTheSmallest) {
  for (const auto& [name, pulse] : shapes()) {
    const RuleErrors errors(pulse, 450.0);
    for (const std::size_t count : Pulse::ruleCounts()) {
      const double beyond = 1.01 * documentedLimit(pulse, count) + 0.25;
      EXPECT_GT(errors.upTo(beyond, count), ruleTolerance(beyond)) << name << ' ' << count;
    }
  }
}

TEST(PulseRule, SizeGrowsAsAQuarterOfTheBandwidth) {
  const Pulse& hertz = Pulse::of(PulseShape::hertz);
  for (double w = 1.0; w <= 430.0; w += 1.0) {
    const std::size_t size = hertz.ruleSize(w);
    ASSERT_GT(size, 0U) << w;
    EXPECT_GE(static_cast<double>(size), 0.25 * w) << w;
    EXPECT_LE(static_cast<double>(size), 1.5 * (0.25 * w + 8.0)) << w;
  }
}

TEST(PulseRule, SizeIsNoneWhereNoRuleIsGoodEnough) {
  for (const auto& [name, pulse] : shapes()) {
    EXPECT_EQ(pulse.ruleSize(0.0), 2U) << name;
    EXPECT_EQ(pulse.ruleSize(1e4), 0U) << name;
    EXPECT_EQ(pulse.ruleSize(std::numeric_limits<double>::quiet_NaN()), 0U) << name;
  }
}

TEST(PulseRule, IsOneForAllThreadsAndCopies) {
  const Pulse pulse = Pulse::dissipativeHertz(0.6);
  std::array<const PulseNode*, 4> firsts{};
  std::vector<std::thread> threads;
  threads.reserve(firsts.size());
  for (const PulseNode*& first : firsts) {
    threads.emplace_back([copy = pulse, &first] { first = copy.rule(24).data(); });
  }
  for (std::thread& thread : threads)
    thread.join();
  for (const PulseNode* first : firsts)
    EXPECT_EQ(first, pulse.rule(24).data());
}

TEST(Pulse, EvaluatesWithoutAllocation) {
  for (const auto& [name, pulse] : allPulses()) {
    pulse.rule(16);
    double sum = 0.0;
    const test::NoAllocScope scope;
    for (int index = 0; index < 100; ++index) {
      sum += pulse.force(index * 0.01) + pulse.slope(index * 0.01);
    }
    sum += pulse.rule(16)[0].weight + static_cast<double>(pulse.ruleSize(10.0));
    EXPECT_EQ(scope.allocations(), 0U) << sum;
  }
}

}  // namespace
}  // namespace carom
