#include "native/jello/jello_choice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "native/jello/jello_coupling.h"
#include "native/jello/jello_limits.h"

namespace carom::native {
namespace {

constexpr std::size_t kLooks = 16;
constexpr double kOfLimit = 0.9;     ///< largest step, as a share of the stable one
constexpr double kFirst = 0.5;       ///< first step that is tried, as a share of the stable one
constexpr double kCoarsest = 1e-2;   ///< s, largest step of a method that is stable at any step
constexpr int kMostHalvings = 6;     ///< halvings of a first step that blows up
constexpr int kMostRefinements = 2;  ///< rounds of three steps each
constexpr double kFiner = 16.0;      ///< largest ratio of the finest step tried to the step chosen
constexpr double kLeastOrder = 0.5;  ///< least order that is believed
constexpr std::size_t kTrial = 64;   ///< steps in which a method that is followed is tried
constexpr double kShortest = 0.02;   ///< s, shortest run from which an error is taken

/// Cost of a step in evaluations of all forces; that of backward Euler is measured by `bench
/// jello_accuracy`, with 8 x 8 x 8 points: 14 ms a step, beside 11 us for the forces.
double evaluationsOf(JelloIntegrator integrator) {
  switch (integrator) {
    case JelloIntegrator::midpoint:
      return 2.0;
    case JelloIntegrator::rungeKutta4:
      return 4.0;
    case JelloIntegrator::backwardEuler:
      return 1200.0;
    default:
      return 1.0;
  }
}

/// Largest number of evaluations of the force on a point that the three runs at whole steps may
/// take: some minutes on one core.
constexpr double kMostWork = 1e10;

/// Largest number of points that a run keeps: lattices of 64^3 and more would not fit into memory
/// for every run.
constexpr std::size_t kMostPoints = 32768;

bool isStopped(const JelloWish& wish) {
  return wish.goesOn && !wish.goesOn();
}
Error stopped() {
  return Error{"jello: the choice of a step was stopped"};
}

/// Refuses runs at whole steps from `first` (s) on that would not end in a reasonable time.
Status validateWork(const JelloWorld& jello, JelloIntegrator integrator, double seconds,
                    double first) {
  constexpr double kThreeRuns = 7.0;  // with twice and four times the steps of the first
  const double steps = kThreeRuns * seconds / first;
  if (steps * evaluationsOf(integrator) * static_cast<double>(jello.pointCount()) <= kMostWork)
    return std::monostate{};
  std::ostringstream text;
  text << "jello: to find out which step suits it would take " << steps << " steps of "
       << nameOf(integrator) << " with " << jello.pointCount()
       << " points; expected a step of its own, fewer points, softer springs or heavier points";
  return Error{text.str()};
}

/// Places of the points at each look, one look after the other.
using Run = std::vector<Vec3>;

/// Root mean square distance in m between two runs, at the worst of the looks.
double apart(const Run& one, const Run& two) {
  const std::size_t points = one.size() / kLooks;
  double worst = 0.0;
  for (std::size_t look = 0; look < kLooks; ++look) {
    double sum = 0.0;
    for (std::size_t at = look * points; at < (look + 1) * points; ++at)
      sum += (one[at] - two[at]).squaredNorm();
    worst = std::max(worst, sum / static_cast<double>(points));
  }
  return std::sqrt(worst);
}

/// The result of running a method at three steps.
struct Trial {
  double finest = 0.0;  // s, the finest of the three steps
  double error = 0.0;   // m, at the finest step
  double order = 1.0;
};

/// Runs a jello at whole steps of one integrator, to find the largest that will do.
class Pilot {
 public:
  Pilot(const JelloWorld& jello, const SphereWorld& spheres, const JelloWish& wish, double seconds)
      : jello_(jello),
        spheres_(spheres),
        wish_(wish),
        integrator_(*wish.integrator),
        seconds_(seconds) {}

  /// Runs at a step of about `first` (s), half and a quarter of it. Returns an error if the jello
  /// blows up at all steps.
  Result<Trial> tryFrom(double first) const {
    Result<Run> coarse = Error{};
    std::size_t steps = stepsOf(first);
    for (int halving = 0; halving <= kMostHalvings; ++halving, steps *= 2) {
      coarse = run(steps);
      if (coarse) break;
    }
    if (!coarse) return coarse.error();
    const Result<Run> middle = run(2 * steps);
    if (!middle) return middle.error();
    const Result<Run> fine = run(4 * steps);
    if (!fine) return fine.error();
    const double before = apart(*coarse, *middle);
    const double after = apart(*middle, *fine);
    Trial trial{.finest = seconds_ / static_cast<double>(4 * steps),
                .order = static_cast<double>(orderOf(integrator_))};
    if (before > 0.0 && after > 0.0)
      trial.order = std::clamp(std::log2(before / after), kLeastOrder, trial.order);
    trial.error = after / (std::exp2(trial.order) - 1.0);
    return trial;
  }

  /// Returns the choice that the trial leads to, by error = c step^order; `limit` in s.
  JelloChoice choiceOf(const Trial& trial, double limit) const {
    const double most = std::min(limit, wish_.seconds);
    const double step = trial.error > 0.0
                            ? trial.finest * std::pow(wish_.error / trial.error, 1.0 / trial.order)
                            : most;
    JelloChoice choice;
    choice.stepping = {integrator_, std::min(std::max(step, trial.finest / kFiner), most)};
    choice.error = trial.error * std::pow(choice.stepping.step / trial.finest, trial.order);
    choice.cost = evaluationsOf(integrator_) / choice.stepping.step;
    return choice;
  }

 private:
  /// Number of steps of about `step` s in the run: a multiple of the looks.
  std::size_t stepsOf(double step) const {
    const double looks = std::ceil(seconds_ / step / static_cast<double>(kLooks));
    return kLooks * static_cast<std::size_t>(std::max(1.0, looks));
  }

  Result<Run> run(std::size_t steps) const {
    const double step = seconds_ / static_cast<double>(steps);
    Result<JelloCoupling> coupling = JelloCoupling::create(jello_, spheres_, {integrator_, step});
    if (!coupling) return coupling.error();
    Run places;
    const std::size_t stride = (jello_.pointCount() + kMostPoints - 1) / kMostPoints;
    places.reserve(kLooks * (jello_.pointCount() / stride + 1));
    for (std::size_t taken = 1; taken <= steps; ++taken) {
      if (isStopped(wish_)) return stopped();
      if (const Status stepped = coupling->advance(); !stepped) return stepped.error();
      if (taken % (steps / kLooks) != 0) continue;
      for (std::size_t point = 0; point < jello_.pointCount(); point += stride)
        places.push_back(coupling->jello().position(point));
    }
    return places;
  }

  const JelloWorld& jello_;
  const SphereWorld& spheres_;
  const JelloWish& wish_;
  JelloIntegrator integrator_;
  double seconds_;
};

double stableStep(const JelloLimits& limits, JelloIntegrator integrator) {
  return limits.touching[static_cast<std::size_t>(integrator)];
}

/// A choice of steps that are followed, tried for some of them.
Result<JelloChoice> tryFollowed(const JelloWorld& jello, const SphereWorld& spheres,
                                const JelloWish& wish, const JelloStepping& stepping) {
  Result<JelloCoupling> coupling = JelloCoupling::create(jello, spheres, stepping);
  if (!coupling) return coupling.error();
  const JelloStepper& stepper = coupling->jello();
  const auto run = [&](std::size_t steps) -> Status {
    for (std::size_t taken = 0; taken < steps && coupling->time() < wish.seconds; ++taken) {
      if (isStopped(wish)) return stopped();
      if (Status stepped = coupling->advance(); !stepped) return stepped;
    }
    return std::monostate{};
  };
  // A jello that is let go is at its stiffest first: the cost is that of the second half.
  if (const Status begun = run(kTrial / 2); !begun) return begun.error();
  const double begin = std::min(stepper.time(), wish.seconds - stepper.step());
  const auto before = static_cast<double>(stepper.evaluations());
  if (const Status ended = run(kTrial / 2); !ended) return ended.error();
  const double spent = static_cast<double>(stepper.evaluations()) - before;
  JelloChoice choice{.stepping = stepping, .error = wish.error};
  choice.cost = spent / std::max(stepper.step(), stepper.time() - begin);
  if (!stepper.isKept())
    choice.error = std::max(wish.error, stepper.followedError() * wish.seconds / stepper.time());
  return choice;
}

Result<JelloChoice> chooseFollowed(const JelloWorld& jello, const SphereWorld& spheres,
                                   const JelloWish& wish, const JelloLimits& limits) {
  const double stable = stableStep(limits, JelloIntegrator::leapfrog);
  const double step = std::min({kOfLimit * stable, kCoarsest, wish.seconds});
  std::optional<JelloChoice> best;
  Error fault;
  for (const JelloIntegrator integrator :
       {JelloIntegrator::leapfrog, JelloIntegrator::rungeKutta4}) {
    Result<JelloChoice> choice =
        tryFollowed(jello, spheres, wish, {integrator, step, {wish.error, wish.seconds}});
    if (!choice) {
      fault = choice.error();
      continue;
    }
    const bool isBetter = !best || choice->error < best->error ||
                          (choice->error == best->error && choice->cost < best->cost);
    if (isBetter) best = *choice;
  }
  if (!best) return fault;
  return *best;
}

/// Time in s up to which a way can be compared: to the first contact, at least kShortest.
double comparableTime(const JelloWorld& jello, const SphereWorld& spheres, const JelloWish& wish,
                      const JelloLimits& limits) {
  const double longest = std::min(wish.seconds, kPilotSeconds);
  const double step = std::min(kOfLimit * stableStep(limits, JelloIntegrator::leapfrog), kCoarsest);
  constexpr double kAnyError = 1e300;  // m
  if (!(step > 0.0)) return longest;
  auto coupling = JelloCoupling::create(jello, spheres,
                                        {JelloIntegrator::leapfrog, step, {kAnyError, longest}});
  if (!coupling) return longest;
  while (coupling->time() < longest && std::isinf(coupling->jello().metAt()))
    if (isStopped(wish) || !coupling->advance()) return longest;
  return std::min(longest, std::max(kShortest, coupling->time()));
}

Result<JelloChoice> chooseWhole(const JelloWorld& jello, const SphereWorld& spheres,
                                const JelloWish& wish, const JelloLimits& limits) {
  const double stable = stableStep(limits, *wish.integrator);
  if (stable == 0.0)
    return Error{std::string("jello: ") + nameOf(*wish.integrator) +
                 " is stable at no step without damping; expected another integrator"};
  const double limit = std::isinf(stable) ? kCoarsest : kOfLimit * stable;
  const double first = std::isinf(stable) ? kCoarsest : kFirst * stable;
  const double longest = std::min(wish.seconds, kPilotSeconds);
  if (const Status bounded = validateWork(jello, *wish.integrator, longest, first); !bounded)
    return bounded.error();
  const Pilot pilot(jello, spheres, wish, comparableTime(jello, spheres, wish, limits));
  Result<Trial> trial = pilot.tryFrom(first);
  if (!trial) return trial.error();
  JelloChoice choice = pilot.choiceOf(*trial, limit);
  for (int round = 1; round < kMostRefinements && choice.stepping.step < 0.5 * trial->finest;
       ++round) {
    const double next = 2.0 * choice.stepping.step;
    if (!validateWork(jello, *wish.integrator, longest, next)) break;
    trial = pilot.tryFrom(next);
    if (!trial) return trial.error();
    choice = pilot.choiceOf(*trial, limit);
  }
  return choice;
}

}  // namespace

Result<JelloChoice> chooseStepping(const JelloWorld& jello, const SphereWorld& spheres,
                                   const JelloWish& wish) {
  if (!(std::isfinite(wish.error) && wish.error > 0.0) ||
      !(std::isfinite(wish.seconds) && wish.seconds > 0.0))
    return Error{"jello: error and duration must be positive (m, s)"};
  // An unsound world is refused before anything is run.
  const auto sound = JelloCoupling::create(jello, spheres, {JelloIntegrator::midpoint, 1.0});
  if (!sound) return sound.error();
  const JelloLimits limits = jelloLimits(withSpheres(jello, spheres));
  return wish.integrator ? chooseWhole(jello, spheres, wish, limits)
                         : chooseFollowed(jello, spheres, wish, limits);
}

}  // namespace carom::native
