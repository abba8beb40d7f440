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

struct Method {
  JelloIntegrator integrator;
  double order;
  double evaluations;  ///< cost of a step, in evaluations of all forces
};
/// The integrators with order and cost. The cost of backward Euler is measured by `bench
/// jello_accuracy`, with 8 x 8 x 8 points: 14 ms a step, beside 11 us for the forces.
constexpr std::array<Method, kJelloIntegrators> kMethods = {{
    {JelloIntegrator::symplecticEuler, 1.0, 1.0},
    {JelloIntegrator::explicitEuler, 1.0, 1.0},
    {JelloIntegrator::midpoint, 2.0, 2.0},
    {JelloIntegrator::rungeKutta4, 4.0, 4.0},
    {JelloIntegrator::backwardEuler, 1.0, 1200.0},
}};

/// Largest number of points that a run keeps: lattices of 64^3 and more would not fit into memory
/// for every run.
constexpr std::size_t kMostPoints = 32768;

/// Largest number of evaluations of the force on a point that a method's three runs may take: some
/// minutes on one core.
constexpr double kMostWork = 1e10;

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
  Method method;
  double limit = 0.0;   // s, largest step allowed
  double finest = 0.0;  // s, the finest of the three steps
  double error = 0.0;   // m, at the finest step
  double order = 1.0;
  Run best = {};  // at the finest step
};

class Pilot {
 public:
  Pilot(const JelloWorld& jello, const SphereWorld& spheres, const JelloWish& wish)
      : jello_(jello),
        spheres_(spheres),
        wish_(wish),
        seconds_(std::min(wish.seconds, kPilotSeconds)) {}

  /// Runs a method at a step of about `first` (s), half and a quarter of it. Returns nothing if the
  /// first run is so far from `reference` (or null) that the method cannot be worth it; an error if
  /// it blows up at all steps.
  Result<std::optional<Trial>> tryFrom(const Method& method, double limit, double first,
                                       const Trial* reference) const {
    if (Status bounded = validateWork(method, first); !bounded) return bounded.error();
    Result<Run> coarse = Error{};
    std::size_t steps = stepsOf(first);
    for (int halving = 0; halving <= kMostHalvings; ++halving, steps *= 2) {
      coarse = run(method.integrator, steps);
      if (coarse) break;
    }
    if (!coarse) return coarse.error();
    Trial trial{.method = method, .limit = limit, .order = method.order};
    trial.finest = seconds_ / static_cast<double>(steps);
    if (reference != nullptr) {
      trial.error = apart(*coarse, reference->best);
      if (choiceOf(trial).cost > choiceOf(*reference).cost) return std::optional<Trial>();
    }
    const Result<Run> middle = run(method.integrator, 2 * steps);
    if (!middle) return middle.error();
    Result<Run> fine = run(method.integrator, 4 * steps);
    if (!fine) return fine.error();
    const double before = apart(*coarse, *middle);
    const double after = apart(*middle, *fine);
    if (before > 0.0 && after > 0.0)
      trial.order = std::clamp(std::log2(before / after), kLeastOrder, method.order);
    trial.finest /= 4.0;
    trial.error = after / (std::exp2(trial.order) - 1.0);
    trial.best = *std::move(fine);
    return std::optional<Trial>(std::move(trial));
  }

  /// Returns the choice that the trial leads to, by error = c step^order.
  JelloChoice choiceOf(const Trial& trial) const {
    const double most = std::min(trial.limit, wish_.seconds);
    const double step = trial.error > 0.0
                            ? trial.finest * std::pow(wish_.error / trial.error, 1.0 / trial.order)
                            : most;
    JelloChoice choice;
    choice.stepping = {trial.method.integrator,
                       std::min(std::max(step, trial.finest / kFiner), most)};
    choice.error = trial.error * std::pow(choice.stepping.step / trial.finest, trial.order);
    // Methods are compared by the cost of the step that would meet the wished error, even if the
    // chosen step is coarser.
    choice.cost = trial.method.evaluations / std::min(step, most);
    return choice;
  }

  /// Refuses runs that would not end in a reasonable time, before they begin.
  Status validateWork(const Method& method, double first) const {
    constexpr double kThreeRuns = 7.0;  // with twice and four times the steps of the first
    const double steps = kThreeRuns * seconds_ / first;
    if (steps * method.evaluations * static_cast<double>(jello_.pointCount()) <= kMostWork)
      return std::monostate{};
    std::ostringstream text;
    text << "jello: to find out which step suits it would take " << steps << " steps of "
         << nameOf(method.integrator) << " with " << jello_.pointCount()
         << " points; expected an integrator with a step, fewer points, softer springs or heavier "
            "points";
    return Error{text.str()};
  }

 private:
  /// Number of steps of about `step` s in the run: a multiple of the looks.
  std::size_t stepsOf(double step) const {
    const double looks = std::ceil(seconds_ / step / static_cast<double>(kLooks));
    return kLooks * static_cast<std::size_t>(std::max(1.0, looks));
  }

  Result<Run> run(JelloIntegrator integrator, std::size_t steps) const {
    const double step = seconds_ / static_cast<double>(steps);
    Result<JelloCoupling> coupling = JelloCoupling::create(jello_, spheres_, {integrator, step});
    if (!coupling) return coupling.error();
    Run places;
    const std::size_t stride = (jello_.pointCount() + kMostPoints - 1) / kMostPoints;
    places.reserve(kLooks * (jello_.pointCount() / stride + 1));
    for (std::size_t taken = 1; taken <= steps; ++taken) {
      if (wish_.goesOn && !wish_.goesOn()) return Error{"jello: the choice of a step was stopped"};
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
  double seconds_;
};

/// Tries steps near the one that the trial leads to, if that is far below those it took.
Result<JelloChoice> refined(const Pilot& pilot, Trial best) {
  JelloChoice choice = pilot.choiceOf(best);
  for (int round = 1; round < kMostRefinements && choice.stepping.step < 0.5 * best.finest;
       ++round) {
    const double first = 2.0 * choice.stepping.step;
    if (!pilot.validateWork(best.method, first)) break;
    Result<std::optional<Trial>> finer = pilot.tryFrom(best.method, best.limit, first, nullptr);
    if (!finer) return finer.error();
    best = **std::move(finer);
    choice = pilot.choiceOf(best);
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
  const Pilot pilot(jello, spheres, wish);
  std::optional<Trial> best;
  Error fault{"jello: no integrator is stable at any step"};
  for (const Method& method : kMethods) {
    if (wish.integrator && method.integrator != *wish.integrator) continue;
    const double stable = limits.touching[static_cast<std::size_t>(method.integrator)];
    if (stable == 0.0) {
      fault = Error{std::string("jello: ") + nameOf(method.integrator) +
                    " is stable at no step without damping; expected another integrator"};
      continue;
    }
    const double limit = std::isinf(stable) ? kCoarsest : kOfLimit * stable;
    if (best && pilot.choiceOf(*best).cost <= method.evaluations / limit) continue;
    const double first = std::isinf(stable) ? kCoarsest : kFirst * stable;
    Result<std::optional<Trial>> trial =
        pilot.tryFrom(method, limit, first, best ? &*best : nullptr);
    if (wish.goesOn && !wish.goesOn()) return Error{"jello: the choice of a step was stopped"};
    if (!trial) {
      fault = trial.error();
    } else if (*trial && (!best || pilot.choiceOf(**trial).cost < pilot.choiceOf(*best).cost)) {
      best = **std::move(trial);
    }
  }
  if (!best) return fault;
  return refined(pilot, *std::move(best));
}

}  // namespace carom::native
