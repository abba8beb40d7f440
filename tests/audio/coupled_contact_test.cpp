// Tests the impact of two bodies together with their modes against direct integration, closed forms
// and Zener's plate.

#include "audio/contact/coupled_contact.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <numeric>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "audio/model/pulse.h"

namespace carom::audio {
namespace {

CoupledImpact impactOf(const std::vector<ContactMode>& modes) {
  return {.stiffness = 1e9, .mass = 0.01, .speed = 1.0, .impulse = 0.02, .modes = modes};
}

/// Integrates the equations in the header by the classical Runge-Kutta method, in small steps.
class DirectIntegration {
 public:
  DirectIntegration(const CoupledImpact& impact, double damping)
      : impact_(impact), damping_(damping), state_(2 + 2 * impact.modes.size(), 0.0) {
    state_[1] = impact.speed;
  }

  void run(double until, double step) {
    const auto steps = static_cast<std::size_t>(std::ceil(until / step));
    for (std::size_t n = 0; n < steps; ++n)
      advance(step);
  }
  double impulse() const { return impact_.mass * (impact_.speed - state_[1]); }
  double modalEnergy() const {
    double sum = 0.0;
    for (std::size_t i = 0; i < impact_.modes.size(); ++i) {
      const double square = squareOf(i);
      sum += 0.5 * (state_[3 + 2 * i] * state_[3 + 2 * i] +
                    square * state_[2 + 2 * i] * state_[2 + 2 * i]);
    }
    return sum;
  }

 private:
  using State = std::vector<double>;

  double squareOf(std::size_t mode) const {
    const ContactMode& m = impact_.modes[mode];
    return m.frequency * m.frequency + m.decay * m.decay;
  }
  double elasticForce(double depth) const {
    return depth > 0.0 ? impact_.stiffness * std::pow(depth, 1.5) : 0.0;
  }
  State rateOf(const State& state) const {
    double depth = state[0];
    double rate = state[1];
    for (std::size_t i = 0; i < impact_.modes.size(); ++i) {
      depth -= impact_.modes[i].shape * state[2 + 2 * i];
      rate -= impact_.modes[i].shape * state[3 + 2 * i];
    }
    const double force = std::max(0.0, elasticForce(depth) * (1.0 + damping_ * rate));
    State rates(state.size());
    rates[0] = state[1];
    rates[1] = -force / impact_.mass;
    for (std::size_t i = 0; i < impact_.modes.size(); ++i) {
      rates[2 + 2 * i] = state[3 + 2 * i];
      rates[3 + 2 * i] = impact_.modes[i].shape * force -
                         2.0 * impact_.modes[i].decay * state[3 + 2 * i] -
                         squareOf(i) * state[2 + 2 * i];
    }
    return rates;
  }
  static State sum(const State& state, double step, const State& rates) {
    State moved = state;
    for (std::size_t i = 0; i < state.size(); ++i)
      moved[i] += step * rates[i];
    return moved;
  }
  void advance(double step) {
    const State k1 = rateOf(state_);
    const State k2 = rateOf(sum(state_, 0.5 * step, k1));
    const State k3 = rateOf(sum(state_, 0.5 * step, k2));
    const State k4 = rateOf(sum(state_, step, k3));
    for (std::size_t i = 0; i < state_.size(); ++i)
      state_[i] += step / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
  }

  const CoupledImpact& impact_;
  double damping_;
  State state_;
};

/// Modes from 200 Hz to 20 kHz of a body of about `mass` kg.
std::vector<ContactMode> randomModes(std::mt19937& random, std::size_t count, double mass) {
  std::uniform_real_distribution<double> share(0.0, 1.0);
  std::vector<ContactMode> modes;
  for (std::size_t i = 0; i < count; ++i)
    modes.push_back({.frequency = 2.0 * std::numbers::pi * 200.0 * std::pow(100.0, share(random)),
                     .decay = 2.0 + 30.0 * share(random),
                     .shape = (2.0 * share(random) - 1.0) / std::sqrt(mass)});
  return modes;
}

/// The modes of a thin plate, simply supported, as a push at one place has them: 6 mm of steel, 180
/// by 140 mm, `count` half waves each way.
std::vector<ContactMode> plateModes(int count) {
  const double speedOfBending = 9.0;  // m^2/s, sqrt(D / (rho h))
  const double mass = 1.2;            // kg
  const double length = 0.18;         // m
  const double width = 0.14;          // m
  std::vector<ContactMode> modes;
  for (int i = 1; i < count; ++i)
    for (int k = 1; k < count; ++k) {
      const double wave =
          std::pow(std::numbers::pi, 2) * (std::pow(i / length, 2) + std::pow(k / width, 2));
      const double place =
          std::sin(std::numbers::pi * i * 0.33) * std::sin(std::numbers::pi * k * 0.41);
      modes.push_back({.frequency = speedOfBending * wave,
                       .decay = 0.0,
                       .shape = 2.0 * place / std::sqrt(mass)});
    }
  std::ranges::sort(modes, {}, &ContactMode::frequency);
  return modes;
}

std::vector<ContactMode> lowOnes(std::vector<ContactMode> modes, double highest) {
  std::erase_if(modes, [highest](const ContactMode& mode) {
    return mode.frequency > 2.0 * std::numbers::pi * highest;
  });
  return modes;
}

/// The impulse (N s) of a course up to a time (s); a node's force lasts for a step about it.
double impulseUntil(const ContactCourse& course, double time) {
  const double step = 2.0 * course.nodes.front().u * course.duration;
  double sum = 0.0;
  for (const PulseNode& node : course.nodes) {
    const double begin = node.u * course.duration - 0.5 * step;
    sum += node.weight * std::clamp((time - begin) / step, 0.0, 1.0);
  }
  return sum;
}

/// By how much modes give way to a force that lasts, in m/N.
double giveOf(const std::vector<ContactMode>& modes) {
  double sum = 0.0;
  for (const ContactMode& mode : modes)
    sum += std::pow(mode.shape / mode.frequency, 2);
  return sum;
}

/// The restitution of Zener's equation for a large plate, by the classical Runge-Kutta method.
/// `speed` is the ball's: s' is that less lambda s^(3/2), with which the plate gives way.
double zenerRestitution(double inelasticity) {
  constexpr double kStep = 1e-4;
  struct Rate {
    double depth;
    double speed;
  };
  const auto rateOf = [inelasticity](double depth, double speed) {
    const double force = std::pow(std::max(depth, 0.0), 1.5);
    return Rate{speed - inelasticity * force, -force};
  };
  double depth = 0.0;
  double speed = 1.0;
  do {
    const Rate a = rateOf(depth, speed);
    const Rate b = rateOf(depth + 0.5 * kStep * a.depth, speed + 0.5 * kStep * a.speed);
    const Rate c = rateOf(depth + 0.5 * kStep * b.depth, speed + 0.5 * kStep * b.speed);
    const Rate d = rateOf(depth + kStep * c.depth, speed + kStep * c.speed);
    depth += kStep / 6.0 * (a.depth + 2.0 * b.depth + 2.0 * c.depth + d.depth);
    speed += kStep / 6.0 * (a.speed + 2.0 * b.speed + 2.0 * c.speed + d.speed);
  } while (depth > 0.0);
  return -speed;
}

/// The force (N) at each step of an impact without losses, from Timoshenko's integral equation. All
/// that a force does at its own instant is the dent, so the trapezoidal rule needs no iteration.
std::vector<double> timoshenkoForce(const CoupledImpact& impact, double until, double step) {
  const auto count = static_cast<std::size_t>(until / step) + 1;
  std::vector<double> retreat(count, 0.0);  // m/(N s): by how much an impulse parts the two
  for (std::size_t n = 0; n < count; ++n) {
    const double time = static_cast<double>(n) * step;
    retreat[n] = time / impact.mass;
    for (const ContactMode& mode : impact.modes)
      retreat[n] += mode.shape * mode.shape / mode.frequency * std::sin(mode.frequency * time);
  }
  std::vector<double> force(count, 0.0);
  std::vector<std::size_t> pushes;  // steps with a force
  for (std::size_t n = 1; n < count; ++n) {
    double depth = impact.speed * static_cast<double>(n) * step;
    for (const std::size_t push : pushes)
      depth -= step * force[push] * retreat[n - push];
    if (depth <= 0.0) continue;
    force[n] = impact.stiffness * std::pow(depth, 1.5);
    pushes.push_back(n);
  }
  return force;
}

/// The largest difference (N) between the force of a course, a mean over each of its steps, and
/// that of small steps.
double largestDifference(const ContactCourse& course, const std::vector<double>& force,
                         double step) {
  double largest = 0.0;
  for (std::size_t node = 1; node + 1 < course.nodes.size(); ++node) {
    const double before = course.nodes[node].u - course.nodes[node - 1].u;
    const double after = course.nodes[node + 1].u - course.nodes[node].u;
    if (std::abs(before - after) > 1e-6 * after) continue;  // at the end of a touch
    const double length = after * course.duration;
    const double begin = course.nodes[node].u * course.duration - 0.5 * length;
    const auto first = static_cast<std::size_t>(std::ceil(begin / step));
    const auto last = static_cast<std::size_t>((begin + length) / step);
    double mean = 0.0;
    for (std::size_t n = first; n <= last && n < force.size(); ++n)
      mean += force[n] / static_cast<double>(last - first + 1);
    largest = std::max(largest, std::abs(course.nodes[node].weight / length - mean));
  }
  return largest;
}

}  // namespace

TEST(CoupledContact, WithoutModesIsHertzContact) {
  CoupledContact contact;
  const CoupledImpact impact = impactOf({});
  const ContactCourse& course = contact.solve(impact);
  EXPECT_NEAR(course.impulse, 0.02, 1e-12);
  EXPECT_NEAR(course.duration, elasticDuration(impact), 0.02 * elasticDuration(impact));
  EXPECT_EQ(course.touches, 1U);
  EXPECT_EQ(course.energy.modes, 0.0);
  // The shape of the force is that of the tabulated pulse.
  const Pulse& pulse = Pulse::of(PulseShape::hertz);
  const double stretch = course.duration / elasticDuration(impact);
  const double spacing = (course.nodes[1].u - course.nodes[0].u) * stretch;
  for (const PulseNode& node : course.nodes)
    EXPECT_NEAR(node.weight / course.impulse, pulse.force(node.u * stretch) * spacing, 3e-4);
}

// The modes that stand for those above 20 kHz give way as a thin plate's own do between 20 and 40
// kHz, which is half of what all above 20 kHz give.
TEST(CoupledContact, ModesBeyondGiveWayAsTheNextOctaveDoes) {
  const std::vector<ContactMode> all = plateModes(120);
  std::vector<ContactMode> modes = lowOnes(all, 20e3);
  const std::size_t known = modes.size();
  const double next = giveOf(lowOnes(all, 40e3)) - giveOf(modes);
  addModesBeyond(modes, 0, known);
  ASSERT_EQ(modes.size(), known + 4);
  const std::vector<ContactMode> beyond(modes.begin() + static_cast<std::ptrdiff_t>(known),
                                        modes.end());
  EXPECT_GT(giveOf(beyond), 0.7 * next);
  EXPECT_LT(giveOf(beyond), 1.3 * next);
  for (const ContactMode& mode : beyond) {
    EXPECT_GT(mode.frequency, modes[known - 1].frequency);
    EXPECT_LT(mode.frequency, 2.0 * modes[known - 1].frequency);
  }
}

TEST(CoupledContact, FewModesSayLittleOfOthers) {
  std::vector<ContactMode> none;
  addModesBeyond(none, 0, 0);
  EXPECT_TRUE(none.empty());
  std::vector<ContactMode> modes = {{.frequency = 500.0, .decay = 1.0, .shape = 3.0},
                                    {.frequency = 3000.0, .decay = 1.0, .shape = 2.0}};
  addModesBeyond(modes, 1, 1);
  ASSERT_EQ(modes.size(), 4U);  // one in the highest octave: twice as many in the next
  EXPECT_NEAR(modes[2].shape * modes[2].shape + modes[3].shape * modes[3].shape, 4.0, 1e-12);
  std::vector<ContactMode> still = {{.frequency = 500.0, .decay = 1.0, .shape = 0.0}};
  addModesBeyond(still, 0, 1);
  EXPECT_EQ(still.size(), 1U);
}

// A blow of half a period of 20 kHz on a body that has a thin plate's modes up to 40 kHz.
TEST(CoupledContact, ModesBeyondMakeUpForThoseThatAModelLacks) {
  const std::vector<ContactMode> all = lowOnes(plateModes(40), 40e3);
  std::vector<ContactMode> modes = lowOnes(all, 20e3);
  const std::size_t known = modes.size();
  CoupledImpact impact = impactOf(modes);
  impact.stiffness = 1.25 * impact.mass * std::pow(2.9432 * 40e3, 2.5);
  CoupledContact contact;
  const ContactCourse without = contact.solve(impact);
  addModesBeyond(modes, 0, known);
  impact.modes = modes;
  impact.beyond = modes.size() - known;
  const ContactCourse with = contact.solve(impact);
  EXPECT_EQ(with.modes.size(), known);
  EXPECT_GT(with.energy.beyond, 0.0);
  EXPECT_NEAR(with.energy.balance(), 0.0, 1e-9 * with.energy.approach);

  impact.modes = all;
  impact.beyond = 0;
  DirectIntegration direct(impact, 0.0);
  double worst = 0.0;         // N s, of the impulse so far
  double worstWithout = 0.0;  // N s
  const double stretch = with.duration / 16.0;
  for (int part = 1; part <= 16; ++part) {
    direct.run(stretch, with.duration / 4000.0);
    worst = std::max(worst, std::abs(impulseUntil(with, part * stretch) - direct.impulse()));
    worstWithout =
        std::max(worstWithout, std::abs(impulseUntil(without, part * stretch) - direct.impulse()));
  }
  EXPECT_LT(worst, 0.03 * direct.impulse());
  EXPECT_LT(3.0 * worst, worstWithout);
}

TEST(CoupledContact, LosesInTheContactWhatTheImpulseAsksFor) {
  CoupledContact contact;
  CoupledImpact impact = impactOf({});
  for (const double restitution : {0.2, 0.5, 0.9}) {
    impact.impulse = impact.mass * impact.speed * (1.0 + restitution);
    const ContactCourse& course = contact.solve(impact);
    EXPECT_NEAR(course.impulse, impact.impulse, 0.01 * impact.impulse);
    const double left = course.impulse / (impact.mass * impact.speed) - 1.0;
    EXPECT_NEAR(course.energy.lost, course.energy.approach * (1.0 - left * left),
                1e-9 * course.energy.approach);
    EXPECT_NEAR(course.duration, elasticDuration(impact) * dissipativeDuration(left),
                0.03 * course.duration);
  }
}

TEST(CoupledContact, AgreesWithDirectIntegration) {
  std::mt19937 random(25);
  CoupledContact contact;
  for (std::size_t blow = 0; blow < 24; ++blow) {
    const std::vector<ContactMode> modes = randomModes(random, 1 + blow % 8 * 4, 0.5);
    CoupledImpact impact = impactOf(modes);
    impact.mass = 0.003 * std::pow(10.0, static_cast<double>(blow % 3));
    impact.impulse = impact.mass * impact.speed * (blow % 2 == 0 ? 2.0 : 1.6);
    const ContactCourse course = contact.solve(impact);
    if (course.touches != 1) continue;
    DirectIntegration direct(impact, course.damping);
    direct.run(course.duration, course.duration / 4000.0);
    EXPECT_NEAR(course.impulse, direct.impulse(), (blow % 2 == 0 ? 5e-5 : 1e-3) * direct.impulse())
        << blow;
    EXPECT_NEAR(course.energy.modes, direct.modalEnergy(), 0.005 * direct.modalEnergy()) << blow;
  }
}

// Modes that are fast beside the contact follow it like springs and keep hardly anything: what they
// keep depends on how well the course of the force is resolved.
TEST(CoupledContact, FollowsManyFastModesThatTakeLittle) {
  std::vector<ContactMode> modes;
  for (int n = 1; n <= 60; ++n)
    modes.push_back({.frequency = 2.0 * std::numbers::pi * (8e3 + 200.0 * n),
                     .decay = 5.0,
                     .shape = std::sqrt(10.0 / 60.0 / 0.01)});
  CoupledImpact impact = impactOf(modes);
  const double duration = 4.0 / 20e3;  // four periods of the highest
  impact.stiffness = 1.25 * impact.mass * std::pow(2.9432 / duration, 2.5);
  CoupledContact contact;
  const ContactCourse& course = contact.solve(impact);
  DirectIntegration direct(impact, course.damping);
  direct.run(course.duration, course.duration / 4000.0);
  EXPECT_NEAR(course.impulse, direct.impulse(), 1e-3 * direct.impulse());
  EXPECT_LT(course.energy.modes, 0.02 * course.energy.approach);
  EXPECT_NEAR(course.energy.modes, direct.modalEnergy(), 0.015 * direct.modalEnergy());
}

// A lossy contact lets go of a surface that recedes faster than its force can follow, while there
// is still a dent, and takes hold again as the modes swing back.
TEST(CoupledContact, TakesHoldAgainWhereALossyContactHasLetGo) {
  const std::vector<ContactMode> modes = {{.frequency = 22610.0, .decay = 5.5, .shape = -0.438},
                                          {.frequency = 40698.0, .decay = 396.0, .shape = -0.669}};
  const CoupledImpact impact{
      .stiffness = 5.6e9, .mass = 3.56, .speed = 0.2728, .impulse = 1.12, .modes = modes};
  CoupledContact contact;
  const ContactCourse course = contact.solve(impact);
  DirectIntegration direct(impact, course.damping);
  direct.run(4e-3, 2e-8);
  EXPECT_NEAR(course.impulse, direct.impulse(), 2e-3 * direct.impulse());
}

// A heavy body on a light and lithe one touches several times.
TEST(CoupledContact, TouchesAgainWhereTheSurfaceSwingsBack) {
  const std::vector<ContactMode> modes = {{.frequency = 6000.0, .decay = 10.0, .shape = 10.0}};
  CoupledImpact impact = impactOf(modes);
  impact.mass = 0.1;
  impact.impulse = 0.2;
  CoupledContact contact;
  const ContactCourse course = contact.solve(impact);
  EXPECT_GT(course.touches, 1U);
  DirectIntegration direct(impact, course.damping);
  direct.run(course.duration, course.duration / 40000.0);
  EXPECT_NEAR(course.impulse, direct.impulse(), 0.01 * direct.impulse());
}

TEST(CoupledContact, GivesModesNoMoreThanApproaches) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  CoupledContact contact;
  for (std::size_t blow = 0; blow < 3000; ++blow) {
    const double body = std::pow(10.0, 4.0 * share(random) - 3.0);
    const std::vector<ContactMode> modes = randomModes(random, 1 + blow % 24, body);
    CoupledImpact impact = impactOf(modes);
    impact.stiffness = std::pow(10.0, 6.0 + 4.0 * share(random));
    impact.mass = body * std::pow(10.0, 4.0 * share(random) - 2.0);
    impact.speed = std::pow(10.0, 3.0 * share(random) - 2.0);
    impact.impulse = impact.mass * impact.speed * (1.0 + share(random));
    if (blow % 3 == 0) impact.beyond = modes.size() / 2;
    const ContactCourse& course = contact.solve(impact);
    const ContactLedger& energy = course.energy;
    const double rounding = 1e-9 * energy.approach;
    ASSERT_NEAR(energy.approach, 0.5 * impact.mass * impact.speed * impact.speed, rounding);
    ASSERT_LE(energy.modes, energy.approach + rounding) << blow;
    ASSERT_GE(energy.beyond, 0.0) << blow;
    ASSERT_GE(energy.damped, -rounding) << blow;
    ASSERT_GE(energy.lost, -rounding) << blow;
    ASSERT_NEAR(energy.balance(), 0.0, rounding) << blow;
    if (course.energyBound) {
      ASSERT_LT(course.impulse, impact.impulse);
    }
  }
}

// Modes without damping keep all the work that the force has done on them.
TEST(CoupledContact, ModesWithoutDampingKeepWhatTheyGet) {
  std::mt19937 random(3);
  std::vector<ContactMode> modes = randomModes(random, 20, 0.05);
  for (ContactMode& mode : modes)
    mode.decay = 0.0;
  CoupledContact contact;
  const ContactCourse& course = contact.solve(impactOf(modes));
  EXPECT_GT(course.energy.modes, 0.01 * course.energy.approach);
  EXPECT_NEAR(course.energy.damped, 0.0, 1e-12 * course.energy.approach);
}

// Zener (1941): a ball on a plate so large that nothing comes back from its edges. The plate takes
// momentum as a dashpot of Z = 8 sqrt(D rho h) would, so that the restitution follows from one
// number, the inelasticity lambda = m / (Z T) with T = (m / (K sqrt(V)))^(2/5), by
// s'' + (1 + lambda d/dt) s^(3/2) = 0, s = 0 and s' = 1 at first.
TEST(CoupledContact, BallOnALargePlateBouncesAsZenerSays) {
  const double thickness = 0.003;
  const double density = 7850.0;
  const double stiffness = 210e9 / (12.0 * (1.0 - 0.09)) * std::pow(thickness, 3);  // D
  const double area = density * thickness;                                          // kg/m^2
  const double speedOfBending = std::sqrt(stiffness / area);
  const double impedance = 8.0 * std::sqrt(stiffness * area);
  CoupledContact contact;
  for (const double inelasticity : {0.05, 0.1, 0.2, 0.4, 0.7, 1.0}) {
    CoupledImpact impact = impactOf({});
    impact.stiffness = 1e10;
    impact.mass = std::pow(inelasticity * impedance, 5.0 / 3.0) * std::pow(1e10, -2.0 / 3.0);
    impact.impulse = 2.0 * impact.mass;
    const double duration = elasticDuration(impact);
    // A simply supported square: its odd modes move the centre. Its waves come back after the
    // contact, but for those too fast to matter; the highest mode turns by 600 rad meanwhile.
    const double side = std::sqrt(256.0 * speedOfBending * duration);
    std::vector<ContactMode> modes;
    for (int m = 1; m < 400; m += 2)
      for (int n = 1; n < 400; n += 2) {
        const double wave = std::numbers::pi / side;
        const double frequency = speedOfBending * wave * wave * (m * m + n * n);
        if (frequency * duration > 600.0) break;
        modes.push_back(
            {.frequency = frequency, .decay = 0.0, .shape = 2.0 / std::sqrt(area * side * side)});
      }
    impact.modes = modes;
    const ContactCourse& course = contact.solve(impact);
    const double restitution = course.impulse / impact.mass - 1.0;
    const double zener = zenerRestitution(inelasticity);
    EXPECT_EQ(course.touches, 1U);
    EXPECT_NEAR(restitution, zener, 5e-3 * zener)
        << inelasticity << ", " << modes.size() << " modes";
  }
}

// A steel ball on the middle of a simply supported steel beam of 1 cm square, after Timoshenko
// (1913, Z. Math. Phys. 62, 198): the approach that the force leaves is the contact's own and what
// the beam's modes give way,
//     V t - 1/m int F(s) (t - s) ds = (F/K)^(2/3) + sum of s_i^2/w_i int F(s) sin w_i (t - s) ds,
// solved step by step. The beam swings back and is touched again by the heavier balls.
TEST(CoupledContact, BallOnABeamFollowsTimoshenkosIntegralEquation) {
  constexpr double kSteel = 7850.0;   // kg/m^3
  constexpr double kModulus = 210e9;  // N/m^2
  constexpr double kSection = 0.01;   // m
  struct Case {
    double length;  // m
    double radius;  // m, of the ball
    std::size_t touches;
  };
  for (const auto& [length, radius, touches] :
       {Case{0.1535, 0.01, 1}, Case{0.1535, 0.015, 2}, Case{0.307, 0.02, 3}}) {
    const double beam = kSteel * kSection * kSection * length;
    const double bending = std::sqrt(kModulus / kSteel / 12.0) * kSection;  // m^2/s
    std::vector<ContactMode> modes;
    for (int n = 1; n < 20; n += 2)
      modes.push_back({.frequency = bending * std::pow(n * std::numbers::pi / length, 2),
                       .decay = 0.0,
                       .shape = std::sqrt(2.0 / beam)});
    CoupledImpact impact{.stiffness = 2.0 / 3.0 * std::sqrt(radius) * kModulus / (1.0 - 0.09),
                         .mass = 4.0 / 3.0 * std::numbers::pi * std::pow(radius, 3) * kSteel,
                         .speed = 0.01,
                         .modes = modes};
    impact.impulse = 2.0 * impact.mass * impact.speed;
    CoupledContact contact;
    const ContactCourse& course = contact.solve(impact);
    const double step = 0.1e-6;
    const std::vector<double> force = timoshenkoForce(impact, 1.02 * course.duration, step);
    const double peak = *std::max_element(force.begin(), force.end());
    EXPECT_EQ(course.touches, touches);
    EXPECT_NEAR(course.impulse, step * std::accumulate(force.begin(), force.end(), 0.0),
                2e-3 * course.impulse);
    EXPECT_LT(largestDifference(course, force, step), 0.01 * peak) << length;
  }
}

}  // namespace carom::audio
