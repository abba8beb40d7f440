#include "audio/contact/coupled_contact.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>

namespace carom::audio {
namespace {

constexpr double kFewestSteps = 24.0;  ///< in the duration without modes
/// The same of a contact that is to lose energy: at first, its force leaps.
constexpr double kFewestLossySteps = 32.0;
constexpr double kMostSteps = 1024.0;  ///< in the duration without modes
/// s. The force is heard as impulses, one for each step: their rhythm must be no sound.
constexpr double kLongestStep = 25e-6;
constexpr double kStepAngle = 1.0;  ///< rad by which the fastest mode turns, at most
/// rad: by how much a mode may turn in a step for its share of that step's error to be known. Where
/// the contact is long beside the mode, steps are longer, and it follows the force like a spring.
constexpr double kMostAngle = 2.0;
/// By what share of Hertz's depth, at its greatest, the spring is made less deep for the step.
constexpr double kMostHardening = 0.3;
/// The restitution of a contact from which on it is elastic enough for the error of a step to be
/// that of its spring. What loses more is as well off without the amendment.
constexpr double kLeastElastic = 0.8;
constexpr double kLongestRun = 16384.0;  ///< steps until a run counts as over
constexpr double kLongestTime = 0.02;    ///< s of a run, or four elastic durations
constexpr std::size_t kMostLeaps = 11;   ///< lengths of leaps: 2^0 to 2^10 steps
/// sqrt(2) - 1, rounded up: by what share of the smaller of two parts a number is longer than the
/// larger, at most.
constexpr double kDiagonal = 0.4142135623730951;
/// Steps. To look for a leap and to take it costs as much as some steps of which each is taken.
constexpr std::size_t kLeastLeap = 12;
constexpr double kImpulseTolerance = 1e-2;  ///< of the impulse, relative
/// Another damping is tried if the impulse may change by more than this share of it.
constexpr double kLeastChange = 2.5e-3;
constexpr int kMostRuns = 6;         ///< of one impact, to find its damping
constexpr int kMostIterations = 40;  ///< of Newton's method, which takes three
constexpr int kFewIterations = 8;    ///< of the quick one, which takes one or two
/// Of a depth, relative: how far Newton's method may have moved last. It squares that.
constexpr double kDepthTolerance = 1e-6;
constexpr double kRootTolerance = 1e-5;  ///< the same of the root of a depth
constexpr std::size_t kMostBeyond = 4;   ///< modes that stand for those above the known ones
/// Those modes decay by this share of their distance (rad/s). So a body that has more modes there
/// than four, evenly spread, answers once: of what four give back when they are in step
/// again, e^(-2 pi 0.4) is left.
constexpr double kDecayBeyond = 0.4;
/// By how much more than rigid bodies would need the restitution is lowered, to come below the
/// wanted one.
constexpr double kReach = 1.2;
/// By how much more than that of rigid bodies the loss of a contact may grow with its damping, as
/// modes that swing back touch again.
constexpr double kMoreLoss = 4.0;

/// A number, and how it grows with what it is a function of.
struct Growing {
  double value = 0.0;
  double slope = 0.0;
};

std::span<const ContactMode> knownModes(const CoupledImpact& impact) {
  return impact.modes.first(impact.modes.size() - impact.beyond);
}

/// Returns the greatest depth (m) of an impact of rigid bodies.
double elasticDepth(const CoupledImpact& impact) {
  return std::pow(1.25 * impact.mass * impact.speed * impact.speed / impact.stiffness, 0.4);
}

}  // namespace

/// Hertz's spring, made harder: its potential at a depth b^2 is K (2/5 b^5 + 1/2 c b^6 + 3/4 c^2
/// b^7). With c = K g, these are the first orders of a spring that gives way less by g (m/N) in
/// proportion to the force; all of them would be no spring at large depths.
class CoupledContact::Spring {
 public:
  Spring(double stiffness, double lessGive)
      : stiffness_(stiffness), six_(0.5 * stiffness * lessGive), seven_(3.0 * six_ * six_) {}

  double force(double root) const {
    const double slope = 1.0 + root * (3.0 * six_ + 3.5 * seven_ * root);
    return stiffness_ * root * root * root * slope;
  }
  double potential(double root) const {
    const double square = root * root;
    return stiffness_ * square * square * root * (0.4 + root * (six_ + seven_ * root));
  }
  /// Returns the change of the potential from the root `a` to `b` over b - a, and how it grows with
  /// b: the mean force over the step between them is a + b times less.
  Growing changeBetween(double a, double b) const {
    const double square = a * a;
    const double fourth = square * square;
    const double five = (b * b + square) * b * (a + b) + fourth;
    const double six = five * b + fourth * a;
    const double seven = six * b + fourth * square;
    const double slopeOfFive = 4.0 * b * b * b + a * (3.0 * b * b + a * (2.0 * b + a));
    const double slopeOfSix = five + slopeOfFive * b;
    const double slopeOfSeven = six + slopeOfSix * b;
    return {stiffness_ * (0.4 * five + six_ * six + seven_ * seven),
            stiffness_ * (0.4 * slopeOfFive + six_ * slopeOfSix + seven_ * slopeOfSeven)};
  }

 private:
  double stiffness_;  // N/m^(3/2)
  double six_;        // m^(-1/2), the potential's factor of the sixth power, by K
  double seven_;      // m^-1, that of the seventh
};

struct CoupledContact::Law {
  Spring spring;
  double damping = 0.0;  // s/m
};

void addModesBeyond(std::vector<ContactMode>& modes, std::size_t first, std::size_t count) {
  double highest = 0.0;
  for (std::size_t i = first; i < first + count; ++i)
    highest = std::max(highest, modes[i].frequency);
  double squares = 0.0;  // 1/kg, of the shapes in the highest octave
  double known = 0.0;
  for (std::size_t i = first; i < first + count; ++i) {
    if (modes[i].frequency <= 0.5 * highest) continue;
    squares += modes[i].shape * modes[i].shape;
    known += 1.0;
  }
  if (squares == 0.0) return;
  const auto next = static_cast<std::size_t>(2.0 * known);
  const std::size_t more = std::min(next, kMostBeyond);
  const double each = 2.0 * squares * known / (known + 1.0) / static_cast<double>(more);
  const double distance = highest / static_cast<double>(more);
  for (std::size_t i = 0; i < more; ++i)
    modes.push_back({.frequency = highest + (static_cast<double>(i) + 0.5) * distance,
                     .decay = next > more ? kDecayBeyond * distance : 0.0,
                     .shape = std::sqrt(each)});
}

double elasticDuration(const CoupledImpact& impact) {
  return 2.9432 * elasticDepth(impact) / impact.speed;
}

const ContactCourse& CoupledContact::solve(const CoupledImpact& impact) {
  begin(impact);
  fit(impact);
  course_.energyBound = impact.impulse > course_.impulse * (1.0 + kImpulseTolerance);
  return course_;
}

/// Runs the impact with such a damping that its impulse is the wanted one, or with none if that
/// gives no more, or would give hardly more. The impulse falls as the damping grows, and about as
/// the restitution does that the same damping leaves rigid bodies: it is that restitution that is
/// looked for, by the rule of false position (Illinois).
void CoupledContact::fit(const CoupledImpact& impact) {
  struct Aim {
    double restitution = 0.0;
    double excess = 0.0;  // N s, of the impulse
  };
  std::optional<Aim> less;  // gives too little
  std::optional<Aim> more;  // gives too much
  const double momentum = impact.mass * impact.speed;
  double aim = std::min(impact.impulse / momentum - 1.0, 1.0);
  for (int runs = 0; runs < kMostRuns; ++runs) {
    run(impact, aim);
    const double excess = course_.impulse - impact.impulse;
    const bool isEnd = excess < 0.0 ? aim >= 1.0 : aim <= 0.0;
    if (isEnd || std::abs(excess) <= kImpulseTolerance * impact.impulse) return;
    if (mostChange(impact, aim, excess < 0.0) <= kLeastChange * course_.impulse) return;
    std::optional<Aim>& side = excess < 0.0 ? less : more;
    std::optional<Aim>& across = excess < 0.0 ? more : less;
    if (side && across) across->excess *= 0.5;
    side = {aim, excess};
    if (!more)
      aim = 1.0;
    else if (!less)
      aim = std::max(aim - kReach * excess / momentum, 0.0);
    else
      aim = less->restitution +
            (more->restitution - less->restitution) * less->excess / (less->excess - more->excess);
  }
}

/// Returns by how much (N s) the impulse of a run may change with the damping, at most: by what the
/// contact has lost if it is to lose nothing, and by an estimate of what it has not if it is to
/// lose all.
double CoupledContact::mostChange(const CoupledImpact& impact, double restitution,
                                  bool isToGrow) const {
  const double lost = std::max(course_.energy.lost, 0.0);
  const double square = restitution * restitution;
  if (!isToGrow && square >= 1.0) return std::numeric_limits<double>::infinity();
  const double change = isToGrow ? lost : kMoreLoss * lost * square / (1.0 - square);
  const double parting = course_.impulse - impact.mass * impact.speed;
  return std::hypot(parting, std::sqrt(2.0 * impact.mass * change)) - std::abs(parting);
}

void CoupledContact::begin(const CoupledImpact& impact) {
  double fastest = 0.0;
  for (const ContactMode& mode : knownModes(impact))
    fastest = std::max(fastest, mode.frequency);
  const double duration = elasticDuration(impact);
  const bool isElastic = impact.impulse >= (1.0 + kLeastElastic) * impact.mass * impact.speed;
  step_ = duration / (isElastic ? kFewestSteps : kFewestLossySteps);
  if (fastest * step_ > kStepAngle) step_ = kStepAngle / fastest;
  step_ = std::max(std::min(step_, kLongestStep), duration / kMostSteps);
  const double longest = std::max(kLongestTime, 4.0 * duration);
  mostSteps_ = static_cast<std::size_t>(std::min(longest / step_, kLongestRun));
  const auto count = static_cast<Eigen::Index>(impact.modes.size());
  const auto padded = static_cast<Eigen::Index>(ResonatorKernels::padded(impact.modes.size()));
  for (Numbers* numbers : {&inverse_, &decay_, &bend_, &turnRe_, &turnIm_, &freeRe_, &freeIm_,
                           &amends_, &re_, &im_, &nextRe_, &nextIm_})
    numbers->setZero(padded);
  leaps_.clear();
  slack_ = 1.0;
  for (Eigen::Index i = 0; i < count; ++i) {
    const ContactMode& mode = impact.modes[static_cast<std::size_t>(i)];
    const double angle = mode.frequency * step_;
    const double shrinks = std::exp(-mode.decay * step_);
    const double sine = std::sin(angle);
    turnRe_[i] = shrinks * std::cos(angle);
    turnIm_[i] = shrinks * sine;
    // (turn - 1) / (-d + i w), by the square of the shape
    const double square = mode.decay * mode.decay + mode.frequency * mode.frequency;
    const double each = mode.shape * mode.shape / square;
    freeRe_[i] = each * (mode.frequency * turnIm_[i] - mode.decay * (turnRe_[i] - 1.0));
    freeIm_[i] = -each * (mode.frequency * (turnRe_[i] - 1.0) + mode.decay * turnIm_[i]);
    amends_[i] = angle <= kMostAngle ? angle / sine : 1.0;
    inverse_[i] = 1.0 / mode.frequency;
    decay_[i] = mode.decay;
    bend_[i] = square * inverse_[i];
    const double slope = mode.decay * inverse_[i];
    slack_ = std::max(slack_, std::sqrt(1.0 + slope * slope));
  }
  giveRe_ = turnRe_ * inverse_;
  giveIm_ = turnIm_ * inverse_;
  aheadRe_ = turnRe_ * giveRe_ - turnIm_ * giveIm_;
  aheadIm_ = turnRe_ * giveIm_ + turnIm_ * giveRe_;
}

/// Makes the steps of a run ready. Returns by how much (m/N) the contact's spring is to give way
/// less. See "Method" in the header.
double CoupledContact::amend(const CoupledImpact& impact, bool isElastic) {
  amended_ = amends_;
  if (!isElastic) amended_.setOnes();
  pushRe_ = freeRe_ * amended_;
  pushIm_ = freeIm_ * amended_;
  compliance_ = 0.5 * step_ * step_ / impact.mass + (pushIm_ * inverse_).sum();
  if (!isElastic) return 0.0;
  double excess = step_ * step_ / (6.0 * impact.mass);
  for (Eigen::Index i = 0; i < std::ssize(impact.modes); ++i) {
    const double give = impact.modes[static_cast<std::size_t>(i)].shape * inverse_[i];
    excess += give * give * (amended_[i] - 1.0);
  }
  return std::min(excess, kMostHardening / (impact.stiffness * std::sqrt(elasticDepth(impact))));
}

void CoupledContact::run(const CoupledImpact& impact, double restitution) {
  const double damping = restitution < 1.0 ? dissipativeLoss(restitution) / impact.speed : 0.0;
  const double lessGive = amend(impact, restitution >= kLeastElastic);
  re_.setZero();
  im_.setZero();
  state_ = {.approach = 0.0, .speed = impact.speed, .depth = 0.0, .root = 0.0};
  course_.nodes.clear();
  course_.damping = damping;
  course_.touches = 0;
  course_.modes.assign(knownModes(impact).size(), 0.0);
  course_.energy = {.approach = 0.5 * impact.mass * impact.speed * impact.speed};
  double retreat = 0.0;  // m: how far the modes will have given way after a step without a force
  double end = 0.0;      // s, of the last step in which they touched
  double ahead = 0.0;    // m: the same after two such steps
  const double pushed = (giveRe_ * pushIm_ + giveIm_ * pushRe_).sum();  // m/N
  const TurningModes modes = turning();
  const Law law{{impact.stiffness, lessGive}, damping};
  double forces[3] = {};    // N, of the last steps, the latest first
  bool isOpen = false;      // they have touched since the ledger was closed
  std::size_t waiting = 0;  // steps until a leap is looked for again
  work_ = 0.0;
  for (std::size_t n = 0; n < mostSteps_; ++n) {
    const double begin = static_cast<double>(n) * step_;
    const double freeDepth = state_.approach + step_ * state_.speed - retreat;
    const double guess = std::max(3.0 * (forces[0] - forces[1]) + forces[2], 0.0);
    const double force = forceTo(freeDepth, law, guess);
    const State before = state_;
    state_.depth = freeDepth - compliance_ * force;
    state_.approach += step_ * (state_.speed - 0.5 * step_ * force / impact.mass);
    state_.speed -= step_ * force / impact.mass;
    // The processor can turn the modes while it looks for the next force, as that needs only what
    // the modes without this step's force will give, and what this force adds.
    retreat = ahead + pushed * force;
    ahead = kernels_.turn(modes, force);
    const double change = state_.depth - before.depth;
    const double gaveWay = (state_.approach - before.approach) - change;
    work_ += force * gaveWay;
    // A dent that is left when they part, or at the end, is lost with what made it.
    course_.energy.lost += force * change;
    if (force > 0.0) {
      const bool parts = before.depth > 0.0 && state_.depth < 0.0;  // within the step
      end = begin + step_ * (parts ? before.depth / (before.depth - state_.depth) : 1.0);
      course_.nodes.push_back({0.5 * (begin + end), force * step_});
      if (forces[0] == 0.0) ++course_.touches;
      isOpen = true;
    } else {
      if (isOpen) keepStates();
      isOpen = false;
      const double idle = waiting > 0 ? 0.0 : idleSteps();
      if (idle >= static_cast<double>(mostSteps_ - n)) break;
      if (idle >= double{kLeastLeap}) {
        n += leapBy(static_cast<std::size_t>(idle));
        retreat = (giveRe_ * im_ + giveIm_ * re_).sum();
        ahead = (aheadRe_ * im_ + aheadIm_ * re_).sum();
      } else {
        waiting = waiting > 0 ? waiting - 1 : kLeastLeap - 1;
      }
    }
    forces[2] = forces[1];
    forces[1] = forces[0];
    forces[0] = force;
  }
  if (isOpen) keepStates();
  if (course_.touches > 0) close(impact, end);
  for (PulseNode& node : course_.nodes)
    node.u /= course_.duration;
}

/// Returns the force over the step that ends at `freeDepth` (m), less what the force takes from it,
/// and moves the root of the depth on. `guess` (N) is where to look first.
double CoupledContact::forceTo(double freeDepth, const Law& law, double guess) {
  if (state_.depth <= 0.0 && freeDepth <= 0.0) return 0.0;
  if (state_.root > 0.0)
    if (const std::optional<double> force = forceWithin(freeDepth, law, guess)) return *force;
  const double force = forceAcross(freeDepth, law, guess);
  state_.root = std::sqrt(std::max(freeDepth - compliance_ * force, 0.0));
  return force;
}

/// The same for a step that begins and ends with a dent, as nearly all do, if it is found at once:
/// by Newton's method for the root at its end.
std::optional<double> CoupledContact::forceWithin(double freeDepth, const Law& law, double guess) {
  const double a = state_.root;
  const double rate = law.damping / step_;
  double b = a + (freeDepth - compliance_ * guess - state_.depth) / (2.0 * a);
  for (int iteration = 0; iteration < kFewIterations; ++iteration) {
    if (!(b > 0.0)) return std::nullopt;
    const double loss = 1.0 + rate * (b * b - state_.depth);
    if (loss <= 0.0) return std::nullopt;
    const double between = a + b;
    const Growing elastic = law.spring.changeBetween(a, b);
    const double change = elastic.value * loss;
    const double slope = elastic.slope * loss + elastic.value * rate * 2.0 * b;
    // At the root the depth is what the force leaves of the free one. Times a + b, that equation
    // has no quotient.
    const double left = freeDepth - b * b;
    const double moved =
        (left * between - compliance_ * change) / (2.0 * b * between - left + compliance_ * slope);
    b += moved;
    if (std::abs(moved) > kRootTolerance * (a + b)) continue;
    const double inverse = 1.0 / between;
    const double force = change * inverse;
    const double growth = (slope - force) * inverse;
    state_.root = std::max(b, 0.0);
    return std::max(force + growth * moved, 0.0);
  }
  return std::nullopt;
}

/// The same for any step: by Newton's method for the depth at its end, between bounds.
double CoupledContact::forceAcross(double freeDepth, const Law& law, double guess) const {
  const double begin = state_.depth;
  const double potential = law.spring.potential(state_.root);
  const double rate = law.damping / step_;
  const auto forceAt = [&](double depth) {
    const double loss = 1.0 + rate * (depth - begin);
    if (loss <= 0.0 || (begin <= 0.0 && depth <= 0.0)) return Growing{};
    const double root = std::sqrt(std::max(depth, 0.0));
    Growing elastic;
    if (state_.root > 0.0 && root > 0.0) {
      const double between = state_.root + root;
      const Growing change = law.spring.changeBetween(state_.root, root);
      elastic.value = change.value / between;
      elastic.slope = (change.slope - elastic.value) / (between * 2.0 * root);
    } else {
      elastic.value = (law.spring.potential(root) - potential) / (depth - begin);
      elastic.slope = (law.spring.force(root) - elastic.value) / (depth - begin);
    }
    return Growing{elastic.value * loss, elastic.slope * loss + elastic.value * rate};
  };
  // The end is where depth + compliance * force is freeDepth; both terms grow with the depth.
  double high = freeDepth;
  double low = -std::numeric_limits<double>::infinity();
  double depth = freeDepth - compliance_ * guess;
  for (int iteration = 0; iteration < kMostIterations; ++iteration) {
    const Growing force = forceAt(depth);
    const double error = depth + compliance_ * force.value - freeDepth;
    (error > 0.0 ? high : low) = depth;
    const double newton = depth - error / (1.0 + compliance_ * force.slope);
    const double middle = std::isinf(low) ? high : 0.5 * (low + high);
    const double next = newton >= low && newton <= high ? newton : middle;
    const double moved = next - depth;
    depth = next;
    if (std::abs(moved) <= kDepthTolerance * (std::abs(begin) + std::abs(depth)))
      return std::max(force.value + force.slope * moved, 0.0);
  }
  return forceAt(depth).value;
}

TurningModes CoupledContact::turning() {
  return {.turnRe = turnRe_.data(),
          .turnIm = turnIm_.data(),
          .pushRe = pushRe_.data(),
          .pushIm = pushIm_.data(),
          .giveRe = aheadRe_.data(),
          .giveIm = aheadIm_.data(),
          .re = re_.data(),
          .im = im_.data(),
          .count = static_cast<std::size_t>(re_.size())};
}

/// Returns in how many steps from now the bodies cannot touch, whatever the phases of the modes: by
/// how fast the surface may come, by how soon it may turn round, or by how far it comes. 0 while
/// there is a dent, of which a lossy contact may have let go; infinity if the bodies have parted
/// for good.
double CoupledContact::idleSteps() {
  if (state_.depth > 0.0) return 0.0;
  // Their absolute values, by an upper bound that is at most 8 % too large.
  nextRe_ = re_.abs().max(im_.abs()) + kDiagonal * re_.abs().min(im_.abs());
  const double fastest = nextRe_.sum() * slack_ + state_.speed;       // m/s, towards each other
  const double room = -state_.approach - (nextRe_ * inverse_).sum();  // m, beyond the modes' reach
  if (fastest <= 0.0 || (room > 0.0 && state_.speed <= 0.0))
    return std::numeric_limits<double>::infinity();
  const double byReach = state_.speed > 0.0 ? room / state_.speed : 0.0;
  // The gap g(t) is at least g + g' t - A t^2 / 2, with A the greatest acceleration of the surface.
  const double parting = (re_ - decay_ * inverse_ * im_).sum() - state_.speed;  // m/s: g'
  const double greatest = (nextRe_ * bend_).sum();
  const double byTurning =
      (parting + std::sqrt(parting * parting - 2.0 * greatest * state_.depth)) / greatest;
  return std::max({-state_.depth / fastest, byTurning, byReach}) / step_;
}

/// Moves bodies that are apart on by as many steps as the longest leap has that is not longer than
/// `steps`, of at least 2. Returns how many.
std::size_t CoupledContact::leapBy(std::size_t steps) {
  const auto length = std::min(static_cast<std::size_t>(std::bit_width(steps)) - 1, kMostLeaps - 1);
  if (leaps_.empty()) leaps_.push_back({turnRe_, turnIm_});
  while (leaps_.size() <= length) {
    const auto& [re, im] = leaps_.back();
    leaps_.push_back({re.square() - im.square(), 2.0 * re * im});
  }
  const auto& [turnRe, turnIm] = leaps_[length];
  nextRe_ = turnRe * re_ - turnIm * im_;
  nextIm_ = turnRe * im_ + turnIm * re_;
  re_ = nextRe_;  // where they are, as the kernels know them
  im_ = nextIm_;
  const std::size_t taken = std::size_t{1} << length;
  state_.approach += static_cast<double>(taken) * step_ * state_.speed;
  state_.depth = state_.approach - (im_ * inverse_).sum();
  state_.root = 0.0;
  return taken;
}

/// Keeps the states of the modes in which a touch leaves them.
void CoupledContact::keepStates() {
  leftRe_ = re_;
  leftIm_ = im_;
}

/// Enters what the touches have come to, of which the last one ends at `end` (s).
void CoupledContact::close(const CoupledImpact& impact, double end) {
  course_.duration = end;
  course_.impulse = impact.mass * (impact.speed - state_.speed);
  ContactLedger& energy = course_.energy;
  energy.rigid = 0.5 * impact.mass * state_.speed * state_.speed;
  for (Eigen::Index i = 0; i < std::ssize(impact.modes); ++i) {
    const ContactMode& mode = impact.modes[static_cast<std::size_t>(i)];
    if (mode.shape == 0.0) continue;
    const double rate = leftRe_[i] - mode.decay * leftIm_[i] * inverse_[i];
    const double stretched = leftIm_[i] * leftIm_[i] * bend_[i] * inverse_[i];
    const double own = 0.5 * (rate * rate + stretched) / (amended_[i] * mode.shape * mode.shape);
    const auto place = static_cast<std::size_t>(i);
    if (place >= course_.modes.size()) {
      energy.beyond += own;
      continue;
    }
    course_.modes[place] = own;
    energy.modes += own;
  }
  energy.damped = work_ - energy.modes - energy.beyond;
}

}  // namespace carom::audio
