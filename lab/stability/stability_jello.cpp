// Stiff and extreme cases of the jello. In the smallest one, of 2 x 2 x 2 points, springs join each
// point to all others: 12 edges, 12 diagonals of faces and 4 of the box. If all points of a cube
// move outwards by u, these stretch by 2 u / sqrt(3), 2 sqrt(2) u / sqrt(3) and 2 u, so that the
// springs hold k / 2 (16 + 32 + 16) u^2 and the eight points 8 m u'^2 / 2. This breathing mode has
// w^2 = 8 k / m and the damping rate 8 d / m, and is the fastest mode of the jello.

#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "lab/stability/stability_cases.h"
#include <Eigen/Eigenvalues>

#include "native/jello/jello_choice.h"
#include "native/jello/jello_coupling.h"
#include "native/jello/jello_file.h"
#include "native/jello/jello_limits.h"
#include "native/jello/jello_stepper.h"

namespace carom::lab {

using namespace native;

namespace {

using Measurements = std::vector<Measurement>;

constexpr double kMass = 0.01;        // kg, of a point
constexpr double kStretched = 1e-6;   // share of the size: springs are linear then
constexpr std::size_t kSteps = 3000;  // enough to overflow a double at a growth of 1.2 a step

JelloWorld breathing(double stiffness, double damping = 0.0, std::size_t count = 2) {
  JelloWorld world;
  world.id = 1;
  world.lattice = {.count = count, .pointMass = kMass, .stiffness = stiffness, .damping = damping};
  world.positions = restingPoints(world.lattice, Vec3::Zero());
  for (Vec3& position : world.positions)
    position *= 1.0 + kStretched;
  world.velocities.assign(world.pointCount(), Vec3::Zero());
  return world;
}

double breathingFrequency(double stiffness) {
  return std::sqrt(8.0 * stiffness / kMass);
}

/// Returns the breathing displacement (real part) and its speed over w (imaginary part), as shares
/// of the displacement at the start.
std::complex<double> breath(const JelloStepper& stepper, double frequency) {
  const double size = std::sqrt(3.0) / 2.0;
  double out = 0.0;
  double speed = 0.0;
  for (std::size_t point = 0; point < 8; ++point) {
    const Vec3 direction = stepper.world().positions[point].normalized();
    out += (stepper.position(point).dot(direction) - size) / 8.0;
    speed += stepper.velocity(point).dot(direction) / 8.0;
  }
  return std::complex<double>(out, speed / frequency) / (size * kStretched);
}

/// Returns the largest breath in so many steps; infinite if the jello blows up.
double largestBreath(const JelloWorld& world, JelloIntegrator integrator, double step,
                     std::size_t steps = kSteps) {
  JelloStepper stepper = orThrow(JelloStepper::create(world, integrator, step));
  Worst largest;
  for (std::size_t index = 0; index < steps; ++index) {
    if (!stepper.advance()) return std::numeric_limits<double>::infinity();
    largest.add(std::abs(breath(stepper, breathingFrequency(world.lattice.stiffness))));
  }
  return largest.value();
}

/// Results for steps slightly below and slightly above the largest stable one.
struct Edge {
  Worst below;                                             // largest breath
  double above = std::numeric_limits<double>::infinity();  // least of the largest breaths
  Worst predicted;                                         // relative error of the library's limit

  void look(const JelloWorld& world, JelloIntegrator integrator, double limit) {
    below.add(largestBreath(world, integrator, 0.99 * limit));
    above = std::min(above, largestBreath(world, integrator, 1.01 * limit));
    predicted.addShare(jelloLimits(world).free.at(static_cast<std::size_t>(integrator)), limit);
  }
  Measurements measured(const std::string& name, double bound) const {
    return {atMost(name + "_breath_at_0.99_of_the_limit", below.value(), bound),
            atLeast(name + "_breath_at_1.01_of_the_limit", above, 1e3),
            atMost(name + "_limit_told_beside_theory", predicted.value(), 1e-3)};
  }
};

constexpr std::array<double, 5> kStiffnesses = {1e-3, 1e1, 1e5, 1e9, 1.2e12};  // N/m

/// Bound of the breath by symplectic Euler, which conserves x^2 +
/// y^2 + 2 s x y for the displacement x, the speed y over w, and
/// s = w h / 2: from (1, 0) on, it comes no farther than this.
double symplecticBreath(double s) {
  return 1.001 / std::sqrt(1.0 - s);
}

Measurements stepLimit(StabilityForm /*form*/) {
  Edge symplectic;
  Edge rungeKutta;
  for (const double stiffness : kStiffnesses) {
    const double w = breathingFrequency(stiffness);
    symplectic.look(breathing(stiffness), JelloIntegrator::symplecticEuler, 2.0 / w);
    rungeKutta.look(breathing(stiffness), JelloIntegrator::rungeKutta4, std::sqrt(8.0) / w);
  }
  Measurements found = symplectic.measured("symplectic_euler", symplecticBreath(0.99));
  const Measurements more = rungeKutta.measured("rk4", 1.0);
  found.insert(found.end(), more.begin(), more.end());
  return found;
}

// Limits for x'' = -w^2 x - c x': up to these steps, the eigenvalues of a step are within the unit
// circle (Jury).
Measurements dampedLimit(StabilityForm /*form*/) {
  Edge explicitEuler;
  Edge symplectic;
  for (const double stiffness : kStiffnesses) {
    const double w = breathingFrequency(stiffness);
    for (const double ratio : {0.01, 0.1, 0.5, 0.7}) {  // share of critical damping
      const double rate = 2.0 * ratio * w;
      const JelloWorld world = breathing(stiffness, rate * kMass / 8.0);
      // Explicit Euler grows the more slowly above its limit
      // the less is damped: too slowly to be seen.
      if (ratio >= 0.5) explicitEuler.look(world, JelloIntegrator::explicitEuler, rate / (w * w));
      symplectic.look(world, JelloIntegrator::symplecticEuler,
                      (std::sqrt(rate * rate + 4.0 * w * w) - rate) / (w * w));
    }
  }
  Measurements found = explicitEuler.measured("explicit_euler", 3.0);
  const Measurements more = symplectic.measured("symplectic_euler", symplecticBreath(0.99));
  found.insert(found.end(), more.begin(), more.end());
  return found;
}

/// Returns the breath after `steps` steps of w h = `angle`, over that at the start.
double growth(JelloIntegrator integrator, double stiffness, double angle, std::size_t steps) {
  const double w = breathingFrequency(stiffness);
  JelloStepper stepper = orThrow(JelloStepper::create(breathing(stiffness), integrator, angle / w));
  for (std::size_t index = 0; index < steps; ++index)
    orThrow(stepper.advance());
  return std::abs(breath(stepper, w));
}

// For each integrator, the factor by which a step multiplies exp(i w t) is known.
Measurements growthByStep(StabilityForm /*form*/) {
  Worst euler;
  Worst midpoint;
  Worst implicit;
  for (const double stiffness : kStiffnesses) {
    euler.addShare(growth(JelloIntegrator::explicitEuler, stiffness, 0.1, 500),
                   std::pow(1.01, 250.0));
    midpoint.addShare(growth(JelloIntegrator::midpoint, stiffness, 0.5, 300),
                      std::pow(1.0 + std::pow(0.5, 4.0) / 4.0, 150.0));
    implicit.addShare(growth(JelloIntegrator::backwardEuler, stiffness, 0.1, 500),
                      std::pow(1.01, -250.0));
  }
  return {atMost("explicit_euler_beside_(1+w2h2)^(n/2)", euler.value(), 1e-3),
          atMost("midpoint_beside_(1+w4h4/4)^(n/2)", midpoint.value(), 1e-3),
          atMost("backward_euler_beside_(1+w2h2)^(-n/2)", implicit.value(), 1e-3)};
}

Measurements implicitSteps(StabilityForm /*form*/) {
  Worst breaths;
  for (const double stiffness : kStiffnesses)
    for (const double angle : {1e-3, 1.0, 1e3, 1e6, 1e9})
      breaths.add(largestBreath(breathing(stiffness), JelloIntegrator::backwardEuler,
                                angle / breathingFrequency(stiffness), 200));
  return {atMost("largest_breath", breaths.value(), 1.0)};
}

/// Returns the highest frequency in rad/s: the root of the largest eigenvalue of stiffness over
/// mass, from the whole matrix.
double highestFrequency(const JelloWorld& world) {
  const std::vector<Vec3> rest = restingPoints(world.lattice, Vec3::Zero());
  const auto size = static_cast<Eigen::Index>(3 * rest.size());
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(size, size);
  forEachSpring(world.lattice, [&](std::size_t first, std::size_t second, std::size_t /*which*/) {
    const Vec3 along = (rest[first] - rest[second]).normalized();
    const Eigen::Matrix3d block =
        world.lattice.stiffness / world.lattice.pointMass * along * along.transpose();
    const auto a = static_cast<Eigen::Index>(3 * first);
    const auto b = static_cast<Eigen::Index>(3 * second);
    matrix.block<3, 3>(a, a) += block;
    matrix.block<3, 3>(b, b) += block;
    matrix.block<3, 3>(a, b) -= block;
    matrix.block<3, 3>(b, a) -= block;
  });
  return std::sqrt(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(matrix, Eigen::EigenvaluesOnly)
                       .eigenvalues()
                       .maxCoeff());
}

/// Returns the largest total energy (kinetic and elastic) of a jello in small random motion, over
/// that at the start; infinite if it blows up.
double largestEnergy(JelloWorld world, JelloIntegrator integrator, double step) {
  for (std::size_t point = 0; point < world.positions.size(); ++point)
    world.velocities[point] = 1e-6 * Vec3(std::sin(12.9 * static_cast<double>(point)),
                                          std::sin(78.2 * static_cast<double>(point)),
                                          std::sin(37.7 * static_cast<double>(point)));
  JelloStepper stepper = orThrow(JelloStepper::create(std::move(world), integrator, step));
  const double first = stepper.energy().total();
  Worst energy;
  for (std::size_t index = 0; index < kSteps; ++index) {
    if (!stepper.advance()) return std::numeric_limits<double>::infinity();
    energy.add(stepper.energy().total() / first);
  }
  return energy.value();
}

Measurements lattices(StabilityForm form) {
  Worst predicted;
  Worst below;
  double above = std::numeric_limits<double>::infinity();
  std::vector<std::size_t> counts = {3, 5};
  if (form == StabilityForm::full) counts.push_back(8);
  for (const std::size_t count : counts) {
    const JelloWorld world = breathing(1e4, 0.0, count);
    const double w = highestFrequency(world);
    predicted.addShare(jelloLimits(world).highestFrequency, w);
    for (const auto& [integrator, limit] :
         {std::pair(JelloIntegrator::symplecticEuler, 2.0 / w),
          std::pair(JelloIntegrator::rungeKutta4, std::sqrt(8.0) / w)}) {
      below.add(largestEnergy(world, integrator, 0.98 * limit));
      above = std::min(above, largestEnergy(world, integrator, 1.02 * limit));
    }
  }
  return {atMost("highest_frequency_beside_the_eigenvalue", predicted.value(), 1e-3),
          // x^2 + y^2 varies by (1 + s) / (1 - s) along the ellipse of symplecticBreath, s = 0.98.
          atMost("energy_at_0.98_of_the_limit", below.value(), 1.98 / 0.02),
          atLeast("energy_at_1.02_of_the_limit", above, 1e6)};
}

/// Returns the largest and the least total energy in so many steps, over that at the start;
/// infinite if the jello blows up.
std::pair<double, double> energyRange(const JelloWorld& world, JelloIntegrator integrator,
                                      double step) {
  JelloStepper stepper = orThrow(JelloStepper::create(world, integrator, step));
  const double first = stepper.energy().total();
  Worst most;
  double least = 1.0;
  for (int index = 0; index < 500; ++index) {
    if (!stepper.advance()) return {std::numeric_limits<double>::infinity(), 0.0};
    most.add(stepper.energy().total() / first);
    least = std::min(least, stepper.energy().total() / first);
  }
  return {most.value(), least};
}

// Masses of points and stiffnesses at the ends of their ranges: w from 1e-12 to 3e17 rad/s.
Measurements rangeEnds(StabilityForm /*form*/) {
  Worst grown;
  Worst lost;
  Worst damped;
  Worst promised;
  double refused = 0.0;
  for (const double mass : {1e-21, 1.0, 1e18})
    for (const double stiffness : {1e-6, 1.0, 1e12}) {
      JelloWorld world = breathing(stiffness);
      world.lattice.pointMass = mass;
      const double w = std::sqrt(8.0 * stiffness / mass);
      for (const JelloIntegrator integrator :
           {JelloIntegrator::symplecticEuler, JelloIntegrator::leapfrog}) {
        const auto [most, least] = energyRange(world, integrator, 0.2 / w);
        grown.add(most - 1.0);
        lost.add(1.0 - least);
      }
      grown.add(energyRange(world, JelloIntegrator::rungeKutta4, 0.2 / w).first - 1.0);
      world.lattice.damping = std::min(1e9, 0.1 * std::sqrt(8.0 * stiffness * mass) / 8.0);
      damped.add(energyRange(world, JelloIntegrator::backwardEuler, 1.0 / w).first);
      const auto choice =
          chooseStepping(world, {}, {.error = 1e-9, .seconds = std::min(3600.0, 100.0 / w)});
      if (!choice) refused += 1.0;
      if (choice) promised.add(choice->error);
    }
  // By symplectic Euler x^2 + y^2 varies by (1 + s) / (1 - s), s = w h / 2.
  return {atMost("energy_grown", grown.value(), 1.1 / 0.9 - 1.0),
          atMost("energy_lost", lost.value(), 1.1 / 0.9 - 1.0),
          atMost("largest_energy_of_backward_euler", damped.value(), 1.0),
          exactly("choices_refused", refused, 0.0),
          atMost("error_promised", promised.value(), 1e-9, "m")};
}

/// Returns a world file with another time step.
std::string fileWithStep(const std::string& step) {
  JelloFile file;
  file.step = 1e-3;
  file.world = breathing(200.0, 0.0, 8);
  file.world.room = JelloBox{Vec3::Constant(-2.0), Vec3::Constant(2.0)};
  std::string text = orThrow(jelloText(file));
  const std::size_t line = text.find('\n') + 1;
  return text.replace(line, text.find(' ', line) - line, step);
}

Measurements fileSteps(StabilityForm /*form*/) {
  double taken = 0.0;
  double unnamed = 0.0;
  for (const char* step : {"1e-30", "1e-18", "1e-9", "9.999e-9", "1.001", "1e300", "nan", "-1e-3",
                           "0", "1e-400", "1e999"}) {
    const auto file = jelloFromText(fileWithStep(step), "odd.w");
    if (file) taken += 1.0;
    if (!file && file.error().message.find("the step dt (s)") == std::string::npos) unnamed += 1.0;
  }
  double odd = 0.0;
  Worst moved;
  for (const char* step : {"1e-8", "1"}) {
    const JelloFile file = orThrow(jelloFromText(fileWithStep(step), "even.w"));
    for (std::size_t which = 0; which < kJelloIntegrators; ++which) {
      JelloStepper stepper =
          orThrow(JelloStepper::create(file.world, static_cast<JelloIntegrator>(which), file.step));
      for (int count = 0; count < 20 && stepper.advance(); ++count) {
      }
      for (std::size_t point = 0; point < file.world.pointCount(); ++point) {
        if (!stepper.position(point).allFinite()) odd += 1.0;
        if (file.step == 1e-8)
          moved.add((stepper.position(point) - file.world.positions[point]).norm());
      }
    }
  }
  // In 0.2 us the points, which are stretched by 1e-6, are drawn by a part of that.
  return {exactly("steps_out_of_range_taken", taken, 0.0),
          exactly("refused_without_their_name", unnamed, 0.0),
          exactly("points_that_are_not_finite", odd, 0.0),
          atMost("moved_in_20_steps_of_1e-8_s", moved.value(), kStretched, "m")};
}

// ---- The choice of a step

/// A cube that comes at 2 m/s, turned, and meets a wall.
JelloWorld meetingAWall() {
  JelloWorld world = breathing(2000.0, 0.05, 5);
  world.positions =
      restingPoints(world.lattice, Vec3::Zero(), Quat(Eigen::AngleAxisd(0.4, Vec3(0.6, 0.0, 0.8))));
  for (Vec3& position : world.positions)
    position *= 1.1;
  world.velocities.assign(world.pointCount(), {0.0, -2.0, 0.0});
  world.contact = {.stiffness = 4000.0, .damping = 0.1};
  double lowest = 0.0;
  for (const Vec3& position : world.positions)
    lowest = std::min(lowest, position.y());
  world.planes = {{9, Vec3::UnitY(), lowest - 0.1}};
  return world;
}

struct Way {
  double error = 0.0;   // m, root mean square, the worst up to the first contact
  double energy = 0.0;  // J, at the end
  double evaluations = 0.0;
};

/// Runs the cube for `seconds`, and compares it with small steps of Runge and Kutta up to `met`.
Way wayOf(const JelloStepping& stepping, double met, double seconds) {
  const JelloWorld world = meetingAWall();
  JelloStepper run = orThrow(JelloStepper::create(world, stepping.integrator, stepping.step));
  // The reference takes whole parts of each step.
  const int parts = static_cast<int>(std::ceil(stepping.step / 2e-5));
  JelloStepper fine =
      orThrow(JelloStepper::create(world, JelloIntegrator::rungeKutta4, stepping.step / parts));
  if (stepping.promise.error > 0.0) run.follow(stepping.promise);
  Worst worst;
  while (run.time() + run.step() <= seconds) {
    if (!run.advance()) return {.error = std::numeric_limits<double>::infinity()};
    if (run.time() > met) continue;
    for (int part = 0; part < parts; ++part)
      orThrow(fine.advance());
    double sum = 0.0;
    for (std::size_t point = 0; point < world.pointCount(); ++point)
      sum += (fine.position(point) - run.position(point)).squaredNorm();
    worst.add(std::sqrt(sum / static_cast<double>(world.pointCount())));
  }
  return {worst.value(), run.energy().total(), static_cast<double>(run.evaluations())};
}

Measurements choiceAtAWall(StabilityForm form) {
  constexpr double kSeconds = 0.3;
  constexpr double kMet = 0.02;  // s, before the first contact
  const JelloLimits limits = jelloLimits(meetingAWall());
  const Way reference = wayOf({JelloIntegrator::rungeKutta4, 1e-4}, 0.0, kSeconds);
  const double first =
      orThrow(JelloStepper::create(meetingAWall(), JelloIntegrator::rungeKutta4, 1e-4))
          .energy()
          .total();
  std::vector<Way> fixed;
  for (const JelloIntegrator integrator :
       {JelloIntegrator::symplecticEuler, JelloIntegrator::midpoint, JelloIntegrator::rungeKutta4,
        JelloIntegrator::leapfrog})
    for (const double share : {0.9, 0.6, 0.3, 0.1}) {
      const double step = share * limits.touching[static_cast<std::size_t>(integrator)];
      if (step > 0.0) fixed.push_back(wayOf({integrator, step}, kMet, kSeconds));
    }
  Worst error;
  Worst work;
  Worst energy;
  std::vector<double> wishes = {1e-4};
  if (form == StabilityForm::full) wishes.insert(wishes.end(), {1e-3, 1e-6});
  for (const double wish : wishes) {
    const JelloChoice choice =
        orThrow(chooseStepping(meetingAWall(), {}, {.error = wish, .seconds = kSeconds}));
    const Way way = wayOf(choice.stepping, kMet, kSeconds);
    error.add(way.error / wish);
    energy.add(std::abs(way.energy - reference.energy) / (first - reference.energy));
    double best = std::numeric_limits<double>::infinity();
    for (const Way& other : fixed)
      if (other.error <= wish) best = std::min(best, other.evaluations);
    work.add((way.evaluations + static_cast<double>(choice.spent)) / best);
  }
  return {atMost("error_over_that_promised", error.value(), 1.0),
          atMost("work_over_that_of_the_best_fixed_choice", work.value(), 3.0),
          atMost("energy_after_the_contact_over_what_is_lost", energy.value(), 0.05)};
}

// A long run near the limit: the energy of symplectic Euler oscillates, but does not drift.
Measurements longRun(StabilityForm form) {
  const std::size_t steps = form == StabilityForm::brief ? 100'000 : 10'000'000;
  const double w = breathingFrequency(1e5);
  const double breaths =
      largestBreath(breathing(1e5), JelloIntegrator::symplecticEuler, 1.9 / w, steps);
  return {atMost("largest_breath", breaths, symplecticBreath(0.95))};
}

// A day of breathing at w h = 1/2. A cube's breathing is linear at any amplitude, since all springs
// stretch by one share. So its displacement after n steps has a closed form:
// x(n + 1) - 2 x(n) + x(n - 1) = -(w h)^2 x(n).
Measurements day(StabilityForm form) {
  const double seconds = form == StabilityForm::brief ? 3600.0 : 86400.0;
  constexpr double kStep = 0.0625;  // s
  constexpr double kAngle = 0.5;    // w h
  const double stiffness = kMass * std::pow(kAngle / kStep, 2.0) / 8.0;
  JelloStepper stepper =
      orThrow(JelloStepper::create(breathing(stiffness), JelloIntegrator::symplecticEuler, kStep));
  const auto steps = static_cast<std::size_t>(seconds / kStep);
  for (std::size_t step = 0; step < steps; ++step)
    orThrow(stepper.advance());
  const long double angle = 2.0L * std::asin(0.5L * static_cast<long double>(kAngle));
  const long double turned = angle * static_cast<long double>(steps);
  const long double sine =
      (1.0L - static_cast<long double>(kAngle * kAngle) - std::cos(angle)) / std::sin(angle);
  const auto place = static_cast<double>(std::cos(turned) + sine * std::sin(turned));
  const double breathed = breath(stepper, kAngle / kStep).real();
  return {atMost("place_error_over_the_begin", std::abs(breathed - place), 1e-5),
          atMost("centre_moved", stepper.centre().norm(), 1e-12, "m")};
}

/// A world in which a ball of `ratio` times a point's mass touches the jello from above, and
/// approaches at `speed` (m/s).
JelloWorld hitByBall(double ratio, double speed) {
  JelloWorld world = breathing(1e4, 1.0, 4);
  world.positions = restingPoints(world.lattice, Vec3::Zero());
  world.contact.stiffness = 1e4 * std::min(1.0, ratio);  // ball no faster than jello
  JelloBall ball;
  ball.id = 2;
  ball.radius = 0.2;
  ball.mass = ratio * kMass;
  ball.position = {0.0, 0.7, 0.0};
  ball.velocity = {0.0, -speed, 0.0};
  world.balls = {ball};
  return world;
}

/// Returns the sum of the magnitudes of all momenta, kg m/s.
double hustle(const JelloStepper& stepper) {
  double sum = stepper.world().balls[0].mass * stepper.ballVelocity(0).norm();
  for (std::size_t point = 0; point < stepper.world().pointCount(); ++point)
    sum += kMass * stepper.velocity(point).norm();
  return sum;
}

// Momentum is conserved; a light ball springs back, a heavy one goes on.
Measurements massRatio(StabilityForm /*form*/) {
  Worst momentum;
  Worst light;
  Worst heavy;
  double ended = 0.0;
  for (const double ratio : {1e-9, 1e-6, 1.0, 1e6, 1e9}) {
    for (const double speed : {1e-9, 1e-3, 1.0, 1e4}) {
      JelloStepper stepper = orThrow(
          JelloStepper::create(hitByBall(ratio, speed), JelloIntegrator::symplecticEuler, 1e-6));
      const Vec3 first = stepper.momentum();
      Worst scale;
      for (int step = 0; step < 5000; ++step) {
        if (!stepper.advance()) {
          ended += 1.0;
          break;
        }
        if (step % 100 == 0) scale.add(hustle(stepper));
      }
      momentum.add((stepper.momentum() - first).norm() / scale.value());
      if (speed > 1.0) continue;  // at 1e4 m/s the ball goes through the jello
      const double after = stepper.ballVelocity(0).y() / speed;
      if (ratio < 1e-3) light.add(std::abs(after - 1.0));
      if (ratio > 1e3) heavy.add(std::abs(after + 1.0));
    }
  }
  return {atMost("momentum_error", momentum.value(), 1e-11),
          atMost("light_ball_beside_springing_back", light.value(), 1e-2),
          atMost("heavy_ball_beside_going_on", heavy.value(), 1e-2),
          exactly("runs_that_ended_with_an_error", ended, 0.0)};
}

Measurements nonsense(StabilityForm /*form*/) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinite = std::numeric_limits<double>::infinity();
  std::vector<JelloWorld> worlds;
  const auto add = [&worlds](auto change) {
    JelloWorld world = breathing(1e4, 1.0, 3);
    change(world);
    worlds.push_back(std::move(world));
  };
  for (const double odd : {nan, infinite, -1.0}) {
    add([odd](JelloWorld& world) { world.lattice.pointMass = odd; });
    add([odd](JelloWorld& world) { world.lattice.stiffness = odd; });
    add([odd](JelloWorld& world) { world.lattice.damping = odd; });
    add([odd](JelloWorld& world) { world.lattice.size.y() = odd; });
    add([odd](JelloWorld& world) { world.contact.stiffness = odd; });
  }
  for (const double odd : {nan, infinite}) {
    add([odd](JelloWorld& world) { world.gravity.x() = odd; });
    add([odd](JelloWorld& world) { world.positions[5].x() = odd; });
    add([odd](JelloWorld& world) { world.velocities[5].x() = odd; });
  }
  add([](JelloWorld& world) { world.positions.pop_back(); });
  add([](JelloWorld& world) { world.lattice.count = 1; });
  add([](JelloWorld& world) { world.lattice.count = 4; });
  double taken = 0.0;
  for (const JelloWorld& world : worlds)
    if (JelloStepper::create(world, JelloIntegrator::rungeKutta4, 1e-3)) taken += 1.0;
  for (const double step : {nan, infinite, 0.0, -1e-3})
    if (JelloStepper::create(breathing(1e4), JelloIntegrator::rungeKutta4, step)) taken += 1.0;
  return {exactly("worlds_taken_of_" + std::to_string(worlds.size() + 4), taken, 0.0)};
}

// Degenerate starts: all points in one place, a jello that is inside out, a point far off. Each
// step is finite, or an error.
Measurements crushed(StabilityForm /*form*/) {
  double odd = 0.0;
  for (const auto integrator :
       {JelloIntegrator::explicitEuler, JelloIntegrator::symplecticEuler, JelloIntegrator::midpoint,
        JelloIntegrator::rungeKutta4, JelloIntegrator::backwardEuler}) {
    for (int shape = 0; shape < 3; ++shape) {
      JelloWorld world = breathing(1e4, 1.0, 3);
      for (Vec3& position : world.positions) {
        if (shape == 0) position.setZero();
        if (shape == 1) position = -position;
      }
      if (shape == 2) world.positions[4] = Vec3::Constant(1e12);
      JelloStepper stepper = orThrow(JelloStepper::create(world, integrator, 1e-4));
      for (int step = 0; step < 500 && stepper.advance(); ++step) {
      }
      for (std::size_t point = 0; point < world.pointCount(); ++point)
        if (!stepper.position(point).allFinite() || !stepper.velocity(point).allFinite())
          odd += 1.0;
    }
  }
  return {exactly("points_that_are_not_finite", odd, 0.0)};
}

}  // namespace

void addJelloCases(std::vector<StabilityCase>& cases) {
  const std::vector<StabilityCase> all = {
      {"jello.step_limit", "jello steps",
       "undamped springs of 1e-3 to 1.2e12 N/m, 1 % below and above the largest stable step",
       "w h = 2 (symplectic Euler) and 2 sqrt(2) (RK4), w^2 = 8 k / m in closed form", stepLimit},
      {"jello.damped_limit", "jello steps", "damped at 0.01 to 0.7 of critical, likewise",
       "h = c / w^2 (explicit Euler), (sqrt(c^2 + 4 w^2) - c) / w^2 (symplectic Euler): Jury's "
       "criterion",
       dampedLimit},
      {"jello.growth", "jello steps",
       "integrators that are stable at no step, or at any, over hundreds of steps",
       "a step multiplies the amplitude by sqrt(1 + w^2 h^2), sqrt(1 + w^4 h^4 / 4), and "
       "1 / sqrt(1 + w^2 h^2)",
       growthByStep},
      {"jello.implicit", "jello steps", "backward Euler at w h from 1e-3 to 1e9",
       "never grows (A-stable)", implicitSteps},
      {"jello.lattices", "jello steps", "3^3 and 5^3 points (full: 8^3), 2 % below and above",
       "the largest eigenvalue of the whole stiffness matrix", lattices},
      {"jello.range_ends", "jello steps",
       "points of 1e-21 to 1e18 kg on springs of 1e-6 to 1e12 N/m, w h = 0.2, and what auto "
       "chooses",
       "the energy stays within (1 + s) / (1 - s), s = w h / 2; backward Euler never gains any",
       rangeEnds},
      {"jello.file_steps", "jello steps",
       "world files with steps of 1e-400 to 1e999 s, and 20 steps of 1e-8 and 1 s",
       "from 1e-8 to 1 s; beyond, each is refused by its name; finite, or an error", fileSteps},
      {"jello.choice_at_a_wall", "jello steps",
       "what auto chooses for a cube that hits a wall at 2 m/s",
       "right as promised up to the contact, at most three times the work of the best fixed "
       "choice; "
       "the same energy after it",
       choiceAtAWall},
      {"jello.long_run", "jello steps", "1e5 (full: 1e7) steps at 0.95 of the limit",
       "symplectic: bounded, by 1 / sqrt(1 - w h / 2)", longRun},
      {"jello.day", "24 hours", "an hour (full: a day) of breathing at w h = 1/2",
       "the closed form of the recursion, cos(n angle) + b sin(n angle)", day},
      {"jello.mass_ratio", "mass ratio",
       "balls of 1e-9 to 1e9 times a point's mass at 1e-9 to 1e4 m/s",
       "momentum stays; what is light springs back as fast as it came, what is heavy goes on",
       massRatio},
      {"jello.nonsense", "nonsense", "worlds with values that are no numbers, or out of range",
       "each is refused", nonsense},
      {"jello.crushed", "nonsense", "all points in one place, inside out, or one at 1e12 m",
       "finite, or an error that ends the run", crushed},
  };
  cases.insert(cases.end(), all.begin(), all.end());
}

}  // namespace carom::lab
