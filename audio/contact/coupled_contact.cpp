#include "audio/contact/coupled_contact.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <limits>
#include <optional>

namespace carom::audio {
namespace {

using Complex = std::complex<double>;

constexpr double kFewestSteps = 32.0;  ///< in the duration without modes
constexpr double kMostSteps = 1024.0;  ///< in the duration without modes
/// s. The force is heard as impulses, one for each step: their rhythm must be no sound.
constexpr double kLongestStep = 25e-6;
constexpr double kStepAngle = 0.5;       ///< rad by which the fastest mode turns, at most
constexpr double kLongestRun = 16384.0;  ///< steps until a run counts as over
constexpr double kLongestTime = 0.02;    ///< s of a run, or four elastic durations
constexpr std::size_t kMostLeaps = 11;   ///< lengths of leaps: 2^0 to 2^10 steps
/// sqrt(2) - 1, rounded up: by what share of the smaller of two parts a number is longer than the
/// larger, at most.
constexpr double kDiagonal = 0.4142135623730951;
/// Steps. To look for a leap and to take it costs as much as some steps of which each is taken.
constexpr std::size_t kLeastLeap = 12;
constexpr double kImpulseTolerance = 1e-2;  ///< of the impulse, relative
constexpr int kMostRuns = 6;                ///< of one impact, to find its damping
constexpr int kMostIterations = 40;         ///< of Newton's method, which takes three
constexpr double kRootPrecision = 1e-13;    ///< of a root for a depth, relative
constexpr int kFewIterations = 8;           ///< of the quick one, which takes one or two
/// Of a depth, relative: how far Newton's method may have moved last. It squares that.
constexpr double kDepthTolerance = 1e-6;
constexpr double kRootTolerance = 1e-5;  ///< the same of the root of a depth
/// The modes above the known ones are taken to give this share of what the octave below gives: see
/// giveBeyond.
constexpr double kShareBeyond = 0.5;
/// By how much more than rigid bodies would need the restitution is lowered, to come below the
/// wanted one.
constexpr double kReach = 1.2;

/// A force, and how it grows with what it is a function of.
struct Growing {
  double value = 0.0;
  double slope = 0.0;
};

}  // namespace

/// Hertz's spring and one that gives way in proportion, in series: at a root b (m^(1/2)) of Hertz's
/// depth the force is K b^3 and the depth of both b^2 + c b^3.
class CoupledContact::SpringInSeries {
 public:
  SpringInSeries(double stiffness, double give) : stiffness_(stiffness), c_(stiffness * give) {}

  double depth(double root) const { return root * root * (1.0 + c_ * root); }
  double force(double root) const { return stiffness_ * root * root * root; }
  double potential(double root) const {
    const double square = root * root;
    return stiffness_ * square * square * root * (0.4 + 0.5 * c_ * root);
  }
  /// Returns the root at a depth (m); 0 for none.
  double rootOf(double depth) const {
    if (depth <= 0.0) return 0.0;
    double root = std::sqrt(depth);
    if (c_ == 0.0) return root;
    // From above, Newton's method falls towards it.
    root = std::min(root, std::cbrt(depth / c_));
    for (int iteration = 0; iteration < kMostIterations; ++iteration) {
      const double moved = (depth - this->depth(root)) / slopeOfDepth(root);
      root += moved;
      if (std::abs(moved) <= kRootPrecision * root) break;
    }
    return root;
  }
  /// Returns how the depth grows with the root.
  double slopeOfDepth(double root) const { return root * (2.0 + 3.0 * c_ * root); }
  /// Returns the mean force over a change of depth from that of the root `a` to that of `b`, both
  /// above 0, which is that of the potential over it, and its slope by b.
  Growing meanOver(double a, double b) const {
    // Quotients of differences by b - a: of the depth's parts, and of the potential's.
    const double two = a + b;
    const double three = two * b + a * a;
    const double five = (b * b + a * a) * b * two + a * a * a * a;
    const double six = two * three * ((b - a) * b + a * a);
    const double slopeOfFive = 4.0 * b * b * b + a * (3.0 * b * b + a * (2.0 * b + a));
    const double slopeOfSix = 5.0 * b * b * b * b + a * slopeOfFive;
    const double inverse = 1.0 / (two + c_ * three);
    const double value = stiffness_ * (0.4 * five + 0.5 * c_ * six) * inverse;
    const double ofPotential = stiffness_ * (0.4 * slopeOfFive + 0.5 * c_ * slopeOfSix);
    return {value, (ofPotential - value * (1.0 + c_ * (two + b))) * inverse};
  }

 private:
  double stiffness_;  // N/m^(3/2)
  double c_;          // m^(-1/2)
};

struct CoupledContact::Law {
  SpringInSeries spring;
  double damping = 0.0;  // s/m
};

double giveBeyond(std::span<const ContactMode> modes) {
  double highest = 0.0;
  for (const ContactMode& mode : modes)
    highest = std::max(highest, mode.frequency);
  double octave = 0.0;
  double count = 0.0;
  for (const ContactMode& mode : modes) {
    if (mode.frequency <= 0.5 * highest) continue;
    octave += mode.shape * mode.shape / (mode.frequency * mode.frequency);
    count += 1.0;
  }
  return kShareBeyond * octave * count / (count + 1.0);
}

double elasticDuration(const CoupledImpact& impact) {
  const double deepest =
      std::pow(1.25 * impact.mass * impact.speed * impact.speed / impact.stiffness, 0.4);
  return 2.9432 * deepest / impact.speed;
}

const ContactCourse& CoupledContact::solve(const CoupledImpact& impact) {
  begin(impact);
  fit(impact);
  course_.energyBound = impact.impulse > course_.impulse * (1.0 + kImpulseTolerance);
  return course_;
}

/// Runs the impact with such a damping that its impulse is the wanted one, or with none if that
/// gives no more. The impulse falls as the damping grows, and about as the restitution does that
/// the same damping leaves rigid bodies: it is that restitution that is looked for, by the rule of
/// false position (Illinois).
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
    run(impact, aim < 1.0 ? dissipativeLoss(aim) / impact.speed : 0.0);
    const double excess = course_.impulse - impact.impulse;
    const bool isEnd = excess < 0.0 ? aim >= 1.0 : aim <= 0.0;
    if (isEnd || std::abs(excess) <= kImpulseTolerance * impact.impulse) return;
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

void CoupledContact::begin(const CoupledImpact& impact) {
  double fastest = 0.0;
  for (const ContactMode& mode : impact.modes)
    fastest = std::max(fastest, mode.frequency);
  const double duration = elasticDuration(impact);
  step_ = duration / kFewestSteps;
  if (fastest * step_ > kStepAngle) step_ = kStepAngle / fastest;
  step_ = std::max(std::min(step_, kLongestStep), duration / kMostSteps);
  const double longest = std::max(kLongestTime, 4.0 * duration);
  mostSteps_ = static_cast<std::size_t>(std::min(longest / step_, kLongestRun));
  compliance_ = 0.5 * step_ * step_ / impact.mass;
  const auto count = static_cast<Eigen::Index>(impact.modes.size());
  const auto padded = static_cast<Eigen::Index>(ResonatorKernels::padded(impact.modes.size()));
  for (Numbers* numbers : {&inverse_, &decay_, &bend_, &turnRe_, &turnIm_, &pushRe_, &pushIm_, &re_,
                           &im_, &nextRe_, &nextIm_})
    numbers->setZero(padded);
  leaps_.clear();
  slack_ = 1.0;
  for (Eigen::Index i = 0; i < count; ++i) {
    const ContactMode& mode = impact.modes[static_cast<std::size_t>(i)];
    const Complex pole(-mode.decay, mode.frequency);
    const Complex turn = std::exp(pole * step_);
    const Complex push = mode.shape * mode.shape * (turn - 1.0) / pole;
    inverse_[i] = 1.0 / mode.frequency;
    decay_[i] = mode.decay;
    bend_[i] = std::norm(pole) / mode.frequency;
    turnRe_[i] = turn.real();
    turnIm_[i] = turn.imag();
    pushRe_[i] = push.real();
    pushIm_[i] = push.imag();
    compliance_ += push.imag() * inverse_[i];
    slack_ = std::max(slack_, std::hypot(1.0, mode.decay * inverse_[i]));
  }
  giveRe_ = turnRe_ * inverse_;
  giveIm_ = turnIm_ * inverse_;
}

void CoupledContact::run(const CoupledImpact& impact, double damping) {
  re_.setZero();
  im_.setZero();
  state_ = {.approach = 0.0, .speed = impact.speed, .depth = 0.0, .root = 0.0};
  course_.nodes.clear();
  course_.damping = damping;
  course_.touches = 0;
  course_.modes.assign(impact.modes.size(), 0.0);
  course_.energy = {.approach = 0.5 * impact.mass * impact.speed * impact.speed};
  double retreat = 0.0;  // m: how far the modes will have given way after a step without a force
  double end = 0.0;      // s, of the last step in which they touched
  const TurningModes modes = turning();
  const Law law{{impact.stiffness, impact.give}, damping};
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
    retreat = kernels_.turn(modes, force);
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
        retreat = retreatOfModes();
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
  state_.root = law.spring.rootOf(freeDepth - compliance_ * force);
  return force;
}

/// The same for a step that begins and ends with a dent, as nearly all do, if it is found at once:
/// by Newton's method for the root at its end.
std::optional<double> CoupledContact::forceWithin(double freeDepth, const Law& law, double guess) {
  const double a = state_.root;
  const double rate = law.damping / step_;
  double b = a + (freeDepth - compliance_ * guess - state_.depth) / law.spring.slopeOfDepth(a);
  for (int iteration = 0; iteration < kFewIterations; ++iteration) {
    if (!(b > 0.0)) return std::nullopt;
    const double depth = law.spring.depth(b);
    const double loss = 1.0 + rate * (depth - state_.depth);
    if (loss <= 0.0) return std::nullopt;
    const Growing elastic = law.spring.meanOver(a, b);
    const double slopeOfDepth = law.spring.slopeOfDepth(b);
    const double force = elastic.value * loss;
    const double growth = elastic.slope * loss + elastic.value * rate * slopeOfDepth;
    const double moved =
        (freeDepth - depth - compliance_ * force) / (slopeOfDepth + compliance_ * growth);
    b += moved;
    if (std::abs(moved) > kRootTolerance * (a + b)) continue;
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
    const double root = law.spring.rootOf(depth);
    Growing elastic;
    if (state_.root > 0.0 && root > 0.0) {
      elastic = law.spring.meanOver(state_.root, root);
      elastic.slope /= law.spring.slopeOfDepth(root);
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
          .giveRe = giveRe_.data(),
          .giveIm = giveIm_.data(),
          .re = re_.data(),
          .im = im_.data(),
          .count = static_cast<std::size_t>(re_.size())};
}

/// Returns by how much (m) the modes will have given way after a step without a force.
double CoupledContact::retreatOfModes() const {
  return (giveRe_ * im_ + giveIm_ * re_).sum();
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
    const double own = 0.5 * (rate * rate + stretched) / (mode.shape * mode.shape);
    course_.modes[static_cast<std::size_t>(i)] = own;
    energy.modes += own;
  }
  energy.damped = work_ - energy.modes;
}

}  // namespace carom::audio
