#include "native/mechanics/cluster_hertz.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "carom/native/restitution.h"
#include "native/mechanics/velocity_projection.h"

namespace carom::native {
namespace {

constexpr double kLowestRestitution =
    0.05;  ///< least e of a pair, the same as in audio/model/pulse.h
/// Error of a step, relative to the cluster's speeds and overlaps.
constexpr double kStepTolerance = 1e-13;
constexpr double kFirstStep =
    1e-3;  ///< first step, relative to the duration of the shortest contact
constexpr double kLongestStep =
    0.25;                       ///< longest step, relative to the duration of the shortest contact
constexpr int kOrderGain = 64;  ///< factor by which half a step reduces the error
constexpr int kMostClusterSteps = 1'000'000;
/// Approach, relative to the cluster's speed, below which a contact is left to reflectCluster.
constexpr double kStill = 1e-11;
/// Overlap, relative to the one that the first impact makes, up to which it is rounding.
constexpr double kOpen = 1e-10;
constexpr double kSmallArgument = 0.125;  ///< |z| up to which ln(1 + z) is summed as a series

// ---- Restitution

/// Returns ln(1 + z) - z for z > -1, with + - * / and exact operations only; relative error some
/// 1e-15.
double logarithmBeyondLinear(double z) {
  const auto series = [](double small) {  // sum of -(-small)^k / k from k = 2 on
    double sum = 0.0;
    double power = -small * small;
    for (int k = 2; std::abs(power) > 1e-40 && k < 60; ++k, power *= -small)
      sum += power / k;
    return sum;
  };
  if (std::abs(z) <= kSmallArgument) return series(z);
  constexpr double kLogTwo = 0.69314718055994530942;
  int exponent = 0;
  double mantissa = std::frexp(1.0 + z, &exponent);  // 0.5 to 1
  if (mantissa < 0.70710678118654752) {
    mantissa *= 2.0;
    --exponent;
  }
  // ln m = 2 artanh((m - 1) / (m + 1))
  const double ratio = (mantissa - 1.0) / (mantissa + 1.0);
  double sum = 0.0;
  double power = ratio;
  for (int k = 1; k < 40; k += 2, power *= ratio * ratio)
    sum += power / k;
  return 2.0 * sum + exponent * kLogTwo - z;
}

/// Returns the damping x of Hunt and Crossley, from x (1 + e) = ln((1 + x) / (1 - e x)).
double dampingOf(double restitution) {
  const double e = std::max(restitution, kLowestRestitution);
  if (e >= 1.0) return 0.0;
  double low = 0.0;
  double high = 1.0 / e;
  for (double middle = 0.5 * high; middle > low && middle < high; middle = 0.5 * (low + high)) {
    const bool tooLittle = logarithmBeyondLinear(middle) < logarithmBeyondLinear(-e * middle);
    (tooLittle ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

// ---- Time

/// Duration in s of the elastic contact of two bodies by themselves (Johnson 1985, section 11.4).
double durationOf(double mass, double stiffness, double speed) {
  const double power = 1.25 * mass * speed * speed / stiffness;  // overlap to the power 2.5
  return 2.9432 * fifthRoot(power * power) / speed;
}

// ---- Motion

/// The state by contact, in two arrays one after the other: the overlaps (m), then the impulses so
/// far.
using State = std::vector<double>;

class HertzMotion {
 public:
  HertzMotion(std::span<const ClusterBody> bodies, std::span<const ClusterContact> contacts);

  ClusterImpulses run(std::span<ClusterBody> bodies);

 private:
  static constexpr std::size_t kStages = 7;

  void rates(const State& state, State& rates);
  void takeVelocities(const State& state);
  bool pressed() const;
  bool flyToNext();
  void step();
  double tryStep();

  std::size_t count_;
  ClusterSystem system_;
  std::vector<Vec3> velocities_;  ///< m/s, by body, at the state evaluated last
  std::vector<double> dampings_;  ///< s/m, by contact
  std::vector<double> allowed_;   ///< errors allowed, laid out as State
  double speed_ = 0.0;            ///< m/s, the fastest approach
  double longest_ = std::numeric_limits<double>::infinity();  ///< s, of a step
  double length_ = 0.0;                                       ///< s, of the next step
  /// Overlap in m up to which a contact counts as open.
  double open_ = 0.0;
  State state_;
  State trial_;
  std::array<State, kStages> slopes_;
};

HertzMotion::HertzMotion(std::span<const ClusterBody> bodies,
                         std::span<const ClusterContact> contacts)
    : count_(contacts.size()),
      system_(bodies, contacts),
      velocities_(system_.velocities),
      allowed_(2 * count_, 0.0),
      state_(2 * count_, 0.0),
      trial_(2 * count_, 0.0) {
  for (State& slope : slopes_)
    slope.resize(2 * count_);
  for (std::size_t contact = 0; contact < count_; ++contact)
    speed_ = std::max(speed_, -system_.openingSpeed(contact));
  if (!(speed_ > 0.0)) return;
  double shortest = longest_;
  for (std::size_t contact = 0; contact < count_; ++contact) {
    const double mass = system_.unit / system_.compliances[contact];
    shortest = std::min(shortest, durationOf(mass, contacts[contact].stiffness, speed_));
    dampings_.push_back(dampingOf(contacts[contact].restitution) / speed_);
  }
  longest_ = kLongestStep * shortest;
  length_ = kFirstStep * shortest;
  open_ = kOpen * speed_ * shortest;
  for (std::size_t contact = 0; contact < count_; ++contact) {
    allowed_[contact] = kStepTolerance * speed_ * shortest;
    allowed_[count_ + contact] = kStepTolerance * speed_ / system_.compliances[contact];
  }
}

void HertzMotion::takeVelocities(const State& state) {
  velocities_ = system_.velocities;
  for (std::size_t contact = 0; contact < count_; ++contact)
    system_.push(contact, state[count_ + contact], velocities_);
}

void HertzMotion::rates(const State& state, State& rates) {
  takeVelocities(state);
  for (std::size_t contact = 0; contact < count_; ++contact) {
    const double closing = -system_.openingSpeed(contact, velocities_);
    const double overlap = state[contact];
    rates[contact] = closing;
    rates[count_ + contact] = 0.0;
    if (!(overlap > 0.0)) continue;
    const double spring =
        system_.contacts[contact].stiffness / system_.unit * overlap * std::sqrt(overlap);
    rates[count_ + contact] = std::max(spring * (1.0 + dampings_[contact] * closing), 0.0);
  }
}

bool HertzMotion::pressed() const {
  return std::any_of(state_.begin(), state_.begin() + static_cast<std::ptrdiff_t>(count_),
                     [&](double overlap) { return overlap > open_; });
}

/// Flies on to the next contact, if no contact is pressed; false if there will be none.
bool HertzMotion::flyToNext() {
  takeVelocities(state_);
  double wait = std::numeric_limits<double>::infinity();
  std::size_t next = count_;
  for (std::size_t contact = 0; contact < count_; ++contact) {
    const double closing = -system_.openingSpeed(contact, velocities_);
    if (!(closing > kStill * speed_)) continue;
    const double own = std::max(-state_[contact] / closing, 0.0);
    if (own >= wait) continue;
    wait = own;
    next = contact;
  }
  if (next == count_) return false;
  for (std::size_t contact = 0; contact < count_; ++contact)
    state_[contact] -= wait * system_.openingSpeed(contact, velocities_);
  state_[next] = std::max(state_[next], 0.0);  // rounding must not keep this contact open
  return true;
}

/// Sets trial_ to the state after length_, by Dormand and Prince's pair; returns its largest error
/// relative to the allowed one.
double HertzMotion::tryStep() {
  static constexpr double kNodes[kStages][kStages - 1] = {
      {},
      {1.0 / 5.0},
      {3.0 / 40.0, 9.0 / 40.0},
      {44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0},
      {19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0},
      {9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0},
      {35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0}};
  static constexpr double kErrors[kStages] = {
      71.0 / 57600.0,      0.0,          -71.0 / 16695.0, 71.0 / 1920.0,
      -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0};
  rates(state_, slopes_[0]);
  for (std::size_t stage = 1; stage < kStages; ++stage) {
    for (std::size_t at = 0; at < state_.size(); ++at) {
      double slope = 0.0;
      for (std::size_t earlier = 0; earlier < stage; ++earlier)
        slope += kNodes[stage][earlier] * slopes_[earlier][at];
      trial_[at] = state_[at] + length_ * slope;
    }
    rates(trial_, slopes_[stage]);
  }
  double worst = 0.0;
  for (std::size_t at = 0; at < state_.size(); ++at) {
    double slope = 0.0;
    for (std::size_t stage = 0; stage < kStages; ++stage)
      slope += kErrors[stage] * slopes_[stage][at];
    worst = std::max(worst, length_ * std::abs(slope) / allowed_[at]);
  }
  return worst;
}

void HertzMotion::step() {
  double error = tryStep();
  for (int halvings = 0; !(error <= 1.0) && halvings < 64; ++halvings) {
    length_ *= 0.5;
    error = tryStep();
  }
  std::swap(state_, trial_);
  if (error < 1.0 / kOrderGain) length_ = std::min(2.0 * length_, longest_);
}

ClusterImpulses HertzMotion::run(std::span<ClusterBody> bodies) {
  ClusterImpulses result;
  result.along.assign(count_, 0.0);
  if (!(speed_ > 0.0)) return result;
  int steps = 0;
  while (steps < kMostClusterSteps && (pressed() || flyToNext())) {
    step();
    ++steps;
  }
  takeVelocities(state_);
  for (std::size_t body = 0; body < bodies.size(); ++body) {
    if (system_.inverseMasses[body] > 0.0) bodies[body].velocity = velocities_[body];
  }
  for (std::size_t contact = 0; contact < count_; ++contact)
    result.along[contact] = state_[count_ + contact] * system_.unit;
  const ClusterImpulses rest = reflectCluster(bodies, system_.contacts);
  for (std::size_t contact = 0; contact < count_; ++contact)
    result.along[contact] += rest.along[contact];
  result.settled = steps < kMostClusterSteps;
  return result;
}

}  // namespace

ClusterImpulses followHertz(std::span<ClusterBody> bodies,
                            std::span<const ClusterContact> contacts) {
  return HertzMotion(bodies, contacts).run(bodies);
}

}  // namespace carom::native
