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
constexpr double kStepAngle = 0.5;          ///< rad by which the fastest mode turns, at most
constexpr double kLongestRun = 16384.0;     ///< steps until a run counts as over
constexpr double kLongestTime = 0.02;       ///< s of a run, or four elastic durations
constexpr std::size_t kMostLeaps = 11;      ///< lengths of leaps: 2^0 to 2^10 steps
constexpr double kImpulseTolerance = 1e-2;  ///< of the impulse, relative
constexpr int kMostRuns = 6;                ///< of one impact, to find its damping
constexpr int kMostIterations = 40;         ///< of Newton's method, which takes three
/// Of a depth, relative: how far Newton's method may have moved last. It squares that.
constexpr double kDepthTolerance = 1e-6;
/// By how much more than rigid bodies would need the restitution is lowered, to come below the
/// wanted one.
constexpr double kReach = 1.2;

/// Potential (J) of the contact at a depth (m).
double potentialOf(double depth, double stiffness) {
  return depth > 0.0 ? 0.4 * stiffness * depth * depth * std::sqrt(depth) : 0.0;
}

/// A force, and how it grows with the depth (m).
struct Growing {
  double value = 0.0;
  double slope = 0.0;
};

/// The mean of the elastic force over a change of depth that begins at `begin`: the discrete
/// gradient of the potential.
class MeanForce {
 public:
  MeanForce(double begin, double stiffness)
      : begin_(begin), root_(std::sqrt(std::max(begin, 0.0))), stiffness_(stiffness) {}

  Growing to(double end) const {
    if (begin_ <= 0.0 && end <= 0.0) return {};
    if (begin_ <= 0.0 || end <= 0.0) {
      const double change = end - begin_;
      const double atEnd = end > 0.0 ? stiffness_ * end * std::sqrt(end) : 0.0;
      const double value =
          (potentialOf(end, stiffness_) - potentialOf(begin_, stiffness_)) / change;
      return {value, (atEnd - value) / change};
    }
    // The quotient of differences, without the factor in which both vanish.
    const double a = root_;
    const double b = std::sqrt(end);
    const double above = (((b + a) * b + begin_) * b + begin_ * a) * b + begin_ * begin_;
    const double slope = ((4.0 * b + 3.0 * a) * b + 2.0 * begin_) * b + begin_ * a;
    const double inverse = 1.0 / (a + b);
    const double value = 0.4 * stiffness_ * above * inverse;
    return {value, (0.4 * stiffness_ * slope - value) * inverse / (2.0 * b)};
  }

 private:
  double begin_;
  double root_;  // of begin_
  double stiffness_;
};

}  // namespace

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
  for (Numbers* numbers :
       {&inverse_, &turnRe_, &turnIm_, &pushRe_, &pushIm_, &re_, &im_, &nextRe_, &nextIm_})
    numbers->resize(count);
  leaps_.clear();
  slack_ = 1.0;
  for (Eigen::Index i = 0; i < count; ++i) {
    const ContactMode& mode = impact.modes[static_cast<std::size_t>(i)];
    const Complex pole(-mode.decay, mode.frequency);
    const Complex turn = std::exp(pole * step_);
    const Complex push = mode.shape * mode.shape * (turn - 1.0) / pole;
    inverse_[i] = 1.0 / mode.frequency;
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
  state_ = {0.0, impact.speed, 0.0};
  course_.nodes.clear();
  course_.damping = damping;
  course_.touches = 0;
  course_.modes.assign(impact.modes.size(), 0.0);
  course_.energy = {.approach = 0.5 * impact.mass * impact.speed * impact.speed};
  double retreat = 0.0;  // m: how far the modes will have given way after a step without a force
  double end = 0.0;      // s, of the last step in which they touched
  double forceBefore = 0.0;  // N, of the step before the last
  double lastForce = 0.0;
  bool isOpen = false;  // they have touched since the ledger was closed
  work_ = 0.0;
  for (std::size_t n = 0; n < mostSteps_; ++n) {
    const double begin = static_cast<double>(n) * step_;
    const double freeDepth = state_.approach + step_ * state_.speed - retreat;
    const double guess = std::max(2.0 * lastForce - forceBefore, 0.0);
    const double force = forceTo(freeDepth, {impact.stiffness, damping}, guess);
    const State before = state_;
    state_.depth = freeDepth - compliance_ * force;
    state_.approach += step_ * (state_.speed - 0.5 * step_ * force / impact.mass);
    state_.speed -= step_ * force / impact.mass;
    retreat = advanceModes(force);
    const double change = state_.depth - before.depth;
    const double gaveWay = (state_.approach - before.approach) - change;
    work_ += force * gaveWay;
    course_.energy.lost += force * change - potentialOf(state_.depth, impact.stiffness) +
                           potentialOf(before.depth, impact.stiffness);
    if (force > 0.0) {
      const bool parts = before.depth > 0.0 && state_.depth < 0.0;  // within the step
      end = begin + step_ * (parts ? before.depth / (before.depth - state_.depth) : 1.0);
      course_.nodes.push_back({0.5 * (begin + end), force * step_});
      if (lastForce == 0.0) ++course_.touches;
      isOpen = true;
    } else {
      if (isOpen) close(impact, end);
      isOpen = false;
      const double idle = idleSteps();
      if (idle >= static_cast<double>(mostSteps_ - n)) break;
      if (idle >= 2.0) {
        const std::size_t leap = leapBy(static_cast<std::size_t>(idle));
        n += leap;
        retreat = retreatOfModes();
      }
    }
    forceBefore = lastForce;
    lastForce = force;
  }
  if (isOpen) close(impact, end);
  course_.energy.lost += potentialOf(state_.depth, impact.stiffness);  // where they never part
  for (PulseNode& node : course_.nodes)
    node.u /= course_.duration;
}

/// Returns the force over the step that ends at `freeDepth` (m), less what the force takes from it.
/// `guess` (N) is where to look first.
double CoupledContact::forceTo(double freeDepth, const Law& law, double guess) const {
  const double begin = state_.depth;
  if (begin <= 0.0 && freeDepth <= 0.0) return 0.0;
  const MeanForce mean(begin, law.stiffness);
  const double rate = law.damping / step_;
  const auto forceAt = [&](double depth) {
    const Growing elastic = mean.to(depth);
    const double loss = 1.0 + rate * (depth - begin);
    if (loss <= 0.0) return Growing{};
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

/// Moves the modes on by a step under a force. Returns by how much (m) they will have given way
/// after one more step, if that has no force.
double CoupledContact::advanceModes(double force) {
  nextRe_ = turnRe_ * re_ - turnIm_ * im_ + force * pushRe_;
  nextIm_ = turnRe_ * im_ + turnIm_ * re_ + force * pushIm_;
  re_.swap(nextRe_);
  im_.swap(nextIm_);
  return retreatOfModes();
}

double CoupledContact::retreatOfModes() const {
  return (giveRe_ * im_ + giveIm_ * re_).sum();
}

/// Returns in how many steps from now the bodies cannot touch, whatever the phases of the modes: by
/// how fast the surface may come, or how far. 0 while there is a dent, of which a lossy contact may
/// have let go; infinity if the bodies have parted for good.
double CoupledContact::idleSteps() {
  if (state_.depth > 0.0) return 0.0;
  nextRe_ = (re_.square() + im_.square()).sqrt();
  const double fastest = nextRe_.sum() * slack_ + state_.speed;       // m/s, towards each other
  const double room = -state_.approach - (nextRe_ * inverse_).sum();  // m, beyond the modes' reach
  if (fastest <= 0.0 || (room > 0.0 && state_.speed <= 0.0))
    return std::numeric_limits<double>::infinity();
  const double byReach = state_.speed > 0.0 ? room / state_.speed : 0.0;
  return std::max(-state_.depth / fastest, byReach) / step_;
}

/// Moves bodies that are apart on by as many steps as the longest leap has that is not longer than
/// `steps`, of at least 2. Returns how many.
std::size_t CoupledContact::leapBy(std::size_t steps) {
  const auto length = std::min<std::size_t>(std::bit_width(steps) - 1, kMostLeaps - 1);
  if (leaps_.empty()) leaps_.push_back({turnRe_, turnIm_});
  while (leaps_.size() <= length) {
    const auto& [re, im] = leaps_.back();
    leaps_.push_back({re.square() - im.square(), 2.0 * re * im});
  }
  const auto& [turnRe, turnIm] = leaps_[length];
  nextRe_ = turnRe * re_ - turnIm * im_;
  nextIm_ = turnRe * im_ + turnIm * re_;
  re_.swap(nextRe_);
  im_.swap(nextIm_);
  const std::size_t taken = std::size_t{1} << length;
  state_.approach += static_cast<double>(taken) * step_ * state_.speed;
  state_.depth = state_.approach - (im_ * inverse_).sum();
  return taken;
}

/// Enters what the touches so far have come to, of which the last one ends at `end` (s).
void CoupledContact::close(const CoupledImpact& impact, double end) {
  course_.duration = end;
  course_.impulse = impact.mass * (impact.speed - state_.speed);
  ContactLedger& energy = course_.energy;
  energy.rigid = 0.5 * impact.mass * state_.speed * state_.speed;
  energy.modes = 0.0;
  course_.modes.assign(impact.modes.size(), 0.0);
  for (Eigen::Index i = 0; i < re_.size(); ++i) {
    const ContactMode& mode = impact.modes[static_cast<std::size_t>(i)];
    if (mode.shape == 0.0) continue;
    const double rate = re_[i] - mode.decay * im_[i] * inverse_[i];
    const double stretched = im_[i] * std::hypot(1.0, mode.decay * inverse_[i]);
    const double own = 0.5 * (rate * rate + stretched * stretched) / (mode.shape * mode.shape);
    course_.modes[static_cast<std::size_t>(i)] = own;
    energy.modes += own;
  }
  energy.damped = work_ - energy.modes;
}

}  // namespace carom::audio
