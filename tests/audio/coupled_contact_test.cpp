// Tests the impact of two bodies together with their modes against direct integration, closed forms
// and Zener's plate.

#include "audio/contact/coupled_contact.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
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
  State rateOf(const State& state) const {
    double depth = state[0];
    double rate = state[1];
    for (std::size_t i = 0; i < impact_.modes.size(); ++i) {
      depth -= impact_.modes[i].shape * state[2 + 2 * i];
      rate -= impact_.modes[i].shape * state[3 + 2 * i];
    }
    const double force =
        depth <= 0.0
            ? 0.0
            : std::max(0.0, impact_.stiffness * std::pow(depth, 1.5) * (1.0 + damping_ * rate));
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
    EXPECT_NEAR(course.impulse, direct.impulse(), 1e-3 * direct.impulse()) << blow;
    EXPECT_NEAR(course.energy.modes, direct.modalEnergy(), 0.02 * direct.modalEnergy()) << blow;
  }
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
    const ContactCourse& course = contact.solve(impact);
    const ContactLedger& energy = course.energy;
    const double rounding = 1e-9 * energy.approach;
    ASSERT_NEAR(energy.approach, 0.5 * impact.mass * impact.speed * impact.speed, rounding);
    ASSERT_LE(energy.modes, energy.approach + rounding) << blow;
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
// momentum as a dashpot of 8 sqrt(D rho h) would; the restitution follows from one number.
TEST(CoupledContact, BallOnALargePlateBouncesAsZenerSays) {
  const double thickness = 0.003;
  const double density = 7850.0;
  const double stiffness = 210e9 / (12.0 * (1.0 - 0.09)) * std::pow(thickness, 3);  // D
  const double area = density * thickness;                                          // kg/m^2
  const double speedOfBending = std::sqrt(stiffness / area);
  const double impedance = 8.0 * std::sqrt(stiffness * area);
  CoupledContact contact;
  for (const double mass : {5e-4, 2e-3, 8e-3}) {
    CoupledImpact impact = impactOf({});
    impact.stiffness = 1e10;
    impact.mass = mass;
    impact.impulse = 2.0 * mass;
    const double duration = elasticDuration(impact);
    // A simply supported square: its odd modes move the centre. Its first echo comes after eight
    // durations, its highest mode turns by 600 rad in one.
    const double side = std::sqrt(64.0 * speedOfBending * duration);
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
    const double restitution = course.impulse / mass - 1.0;
    // The reference: m x'' = -F, d' = x' - F / Z, F = K d^(3/2), in small steps.
    double depth = 0.0;
    double speed = 1.0;
    const double step = duration / 200'000.0;
    do {
      const double middle = depth + 0.5 * step * speed;
      const double force = impact.stiffness * std::pow(std::max(middle, 0.0), 1.5);
      depth += step * (speed - 0.5 * step * force / mass - force / impedance);
      speed -= step * force / mass;
    } while (depth > 0.0);
    EXPECT_NEAR(restitution, -speed, 0.02) << mass << " kg, " << modes.size() << " modes";
    EXPECT_LT(restitution, 0.97);
  }
}

}  // namespace carom::audio
