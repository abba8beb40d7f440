#include "native/jello/jello_choice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
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

/// Largest number of evaluations of the force on a point that runs at whole steps may take for a
/// choice: some minutes on one core.
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

/// A promise of any error: steps stay whole, and the jello's first contact is noticed.
constexpr JelloPromise kAnyError = {std::numeric_limits<double>::infinity(), 1.0};

/// Root mean square distance in m between the points of two steppers.
double apart(const JelloStepper& one, const JelloStepper& two) {
  const std::size_t points = one.world().pointCount();
  double sum = 0.0;
  for (std::size_t point = 0; point < points; ++point)
    sum += (one.position(point) - two.position(point)).squaredNorm();
  return std::sqrt(sum / static_cast<double>(points));
}

/// Two runs at whole steps of leapfrog, of which one takes three steps where the other takes two.
///
/// While errors grow, by the second order, they are 9/4 of each other, so the distance of the runs
/// is 5/4 of the finer one's error. When what swings is out of phase, both are wrong by about as
/// much as they are apart: the error no longer grows, whatever the single steps add.
class PairOfRuns {
 public:
  /// `coarse` in s: the longer of the two steps.
  static Result<PairOfRuns> create(const JelloWorld& jello, const SphereWorld& spheres,
                                   double coarse) {
    PairOfRuns pair;
    pair.fineStep_ = coarse * kCoarseSteps / kFineSteps;
    for (const double step : {coarse, pair.fineStep_}) {
      auto run =
          JelloCoupling::create(jello, spheres, {JelloIntegrator::leapfrog, step, kAnyError});
      if (!run) return run.error();
      pair.runs_.push_back(*std::move(run));
    }
    return pair;
  }

  /// Runs on to `time` (s), or to the first contact, or until the two are further apart than
  /// `most` (m). Error: one of them has blown up, or the choice is stopped.
  Status runTo(double time, double most, const JelloWish& wish) {
    while (fine().time() < time && !hasMet() && distance_ <= most) {
      if (isStopped(wish)) return stopped();
      for (std::size_t run = 0; run < runs_.size(); ++run)
        for (int step = 0; step < (run == 0 ? kCoarseSteps : kFineSteps); ++step)
          if (Status stepped = runs_[run].advance(); !stepped) return stepped;
      if (!hasMet()) distance_ = std::max(distance_, apart(runs_.front().jello(), fine()));
    }
    return std::monostate{};
  }

  bool hasMet() const { return std::isfinite(metAt()); }
  /// Time in s of the first contact of either run.
  double metAt() const { return std::min(runs_.front().jello().metAt(), fine().metAt()); }
  double distance() const { return distance_; }  ///< m, the largest so far
  double fineStep() const { return fineStep_; }  ///< s
  const JelloStepper& fine() const { return runs_.back().jello(); }
  std::size_t evaluations() const {
    return runs_.front().jello().evaluations() + fine().evaluations();
  }

 private:
  static constexpr int kCoarseSteps = 2;  // in the time of kFineSteps of the fine run
  static constexpr int kFineSteps = 3;

  double fineStep_ = 0.0;
  double distance_ = 0.0;
  std::vector<JelloCoupling> runs_;  // the coarse and the fine one
};

/// A choice of steps that are followed, tried for some of them.
struct Followed {
  JelloChoice choice;
  /// Evaluations for a second where a jello goes on as it begins, once the half of the error is
  /// spent that is there for where it is needed: no less than the choice's cost.
  double lasting = 0.0;
};

/// How far a method that is followed is tried: to whichever end comes first.
struct TrialLength {
  std::size_t steps = 64;
  std::size_t evaluations = std::numeric_limits<std::size_t>::max();
};

Result<Followed> tryFollowed(const JelloWorld& jello, const SphereWorld& spheres,
                             const JelloWish& wish, const JelloStepping& stepping,
                             const TrialLength& trial = {}) {
  Result<JelloCoupling> coupling = JelloCoupling::create(jello, spheres, stepping);
  if (!coupling) return coupling.error();
  const JelloStepper& stepper = coupling->jello();
  const auto runTo = [&](std::size_t steps, std::size_t evaluations) -> Status {
    do {
      if (isStopped(wish)) return stopped();
      if (Status stepped = coupling->advance(); !stepped) return stepped;
    } while (stepper.steps() < steps && stepper.evaluations() < evaluations &&
             coupling->time() < wish.seconds);
    return std::monostate{};
  };
  // A jello that is let go is at its stiffest first: the cost is that of the second half.
  if (const Status begun = runTo(trial.steps / 2, trial.evaluations / 2); !begun)
    return begun.error();
  const double begin = std::min(stepper.time(), wish.seconds - stepper.step());
  const auto before = static_cast<double>(stepper.evaluations());
  const double errorBefore = stepper.followedError();
  if (const Status ended = runTo(trial.steps, trial.evaluations); !ended) return ended.error();
  const double spent = static_cast<double>(stepper.evaluations()) - before;
  const double seconds = std::max(stepper.step(), stepper.time() - begin);
  JelloChoice choice{.stepping = stepping, .error = wish.error, .spent = stepper.evaluations()};
  choice.cost = spent / seconds;
  if (!stepper.isKept())
    choice.error = std::max(wish.error, stepper.followedError() * wish.seconds / stepper.time());
  const double evenly = 0.5 * wish.error * seconds / wish.seconds;
  const double finer = std::pow((stepper.followedError() - errorBefore) / evenly,
                                1.0 / static_cast<double>(orderOf(stepping.integrator)));
  return Followed{choice, choice.cost * std::max(1.0, finer)};
}

/// Returns the choice of whole steps in the place of steps that are followed, where they will do
/// and take less, and the followed ones otherwise; `step` in s: the longest.
Result<JelloChoice> tryWholeInstead(const JelloWorld& jello, const SphereWorld& spheres,
                                    const JelloWish& wish, const Followed& followed, double step) {
  constexpr double kTrusted = 0.8;  // of the wish: when out of phase, a distance is no bound
  const double most = kTrusted * wish.error;
  constexpr double kPilot = 0.4;  // of the run
  const double pilot = kPilot * std::min(wish.seconds, kPilotSeconds);
  constexpr double kBothRuns = 2.5;  // times the steps of the coarse one
  if (kBothRuns * pilot / step * static_cast<double>(jello.pointCount()) > kMostWork)
    return followed.choice;
  Result<PairOfRuns> pair = PairOfRuns::create(jello, spheres, step);
  if (!pair) return pair.error();
  if (const Status begun = pair->runTo(0.5 * pilot, most, wish); !begun) return begun.error();
  const double before = pair->distance();
  if (const Status ended = pair->runTo(pilot, most, wish); !ended) return ended.error();
  JelloChoice choice = followed.choice;
  choice.spent += pair->evaluations();
  // Over each doubling of the time to come it grows at most as it grew over the last.
  const double growth = pair->hasMet() || !(before > 0.0) ? 1.0 : pair->distance() / before;
  const double expected =
      pair->distance() * std::pow(growth, std::log2(std::max(1.0, wish.seconds / pilot)));
  const double met = std::min(pair->metAt(), wish.seconds);
  const double ofFollowed = followed.lasting * met + (wish.seconds - met) / step;
  if (expected > most || wish.seconds / pair->fineStep() >= ofFollowed) return choice;
  choice.stepping = {JelloIntegrator::leapfrog, pair->fineStep()};
  choice.error = wish.error;
  choice.cost = 1.0 / pair->fineStep();
  return choice;
}

Result<JelloChoice> chooseFollowed(const JelloWorld& jello, const SphereWorld& spheres,
                                   const JelloWish& wish, const JelloLimits& limits) {
  const double stable = stableStep(limits, JelloIntegrator::leapfrog);
  const double step = std::min({kOfLimit * stable, kCoarsest, wish.seconds});
  std::size_t spent = 0;
  const auto tryBoth = [&](const TrialLength& length,
                           double (*costOf)(const Followed&)) -> Result<Followed> {
    Result<Followed> best = Error{};
    for (const JelloIntegrator integrator :
         {JelloIntegrator::leapfrog, JelloIntegrator::rungeKutta4}) {
      Result<Followed> followed =
          tryFollowed(jello, spheres, wish, {integrator, step, {wish.error, wish.seconds}}, length);
      if (followed) spent += followed->choice.spent;
      const bool isBetter = !best || (followed && (followed->choice.error < best->choice.error ||
                                                   (followed->choice.error == best->choice.error &&
                                                    costOf(*followed) < costOf(*best))));
      if (isBetter) best = std::move(followed);
    }
    if (best) best->choice.spent = spent;
    return best;
  };
  constexpr double kDear = 2.5;  // times whole steps
  Result<Followed> best =
      tryBoth({}, [](const Followed& followed) { return followed.choice.cost; });
  if (!best) return best.error();
  if (best->lasting * step <= kDear) return best->choice;
  // Swings that are damped are gone after a while, and steps that are followed cost little then: so
  // both methods are tried again, for a longer part of the run.
  constexpr double kFurther = 0.05;  // of the run
  constexpr double kWork = 0.2;      // of that of whole steps
  const double steps = std::ceil(std::min(wish.seconds, kPilotSeconds) / step);
  const TrialLength further{
      .steps = std::max(TrialLength{}.steps, static_cast<std::size_t>(kFurther * steps)),
      .evaluations = static_cast<std::size_t>(kWork * steps)};
  if (further.evaluations > spent) {
    const Result<Followed> again =
        tryBoth(further, [](const Followed& followed) { return followed.lasting; });
    if (!again) return best->choice;
    best = again;
    if (best->lasting * step <= kDear) return best->choice;
  }
  Result<JelloChoice> choice = tryWholeInstead(jello, spheres, wish, *best, step);
  // A jello that blows up at whole steps is followed.
  if (!choice && !isStopped(wish)) return best->choice;
  return choice;
}

/// Time in s up to which a way can be compared: to the first contact, at least kShortest.
double comparableTime(const JelloWorld& jello, const SphereWorld& spheres, const JelloWish& wish,
                      const JelloLimits& limits) {
  const double longest = std::min(wish.seconds, kPilotSeconds);
  const double step = std::min(kOfLimit * stableStep(limits, JelloIntegrator::leapfrog), kCoarsest);
  if (!(step > 0.0)) return longest;
  auto coupling =
      JelloCoupling::create(jello, spheres, {JelloIntegrator::leapfrog, step, kAnyError});
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
