#pragma once

#include <cstdint>

namespace carom::bullet {

/// Start and length (s, simulation clock) of a substep.
struct SubstepTime {
  double start = 0.0;
  double length = 0.0;
};

/// The simulation clock of a bridge: the sum of all substeps since it was attached. [physics
/// thread]
class SubstepClock {
 public:
  /// Begins the next substep; `length` is in s.
  void begin(double length) {
    ++number_;
    current_.length = length;
    isOpen_ = true;
  }

  /// Ends the substep. The sum is compensated (Kahan 1965, Commun. ACM 8, 40): the roundings of
  /// millions of equal steps, as of a host in double precision that runs for a day, are mostly to
  /// one side.
  void end() {
    previous_ = current_;
    isOpen_ = false;
    const double step = current_.length + rest_;
    const double next = current_.start + step;
    rest_ = step - (next - current_.start);
    current_.start = next;
  }

  std::uint64_t number() const { return number_; }  ///< of the current substep; the first has 1
  /// The substep between `begin` and `end`; from `end` on, its start is where the next begins.
  const SubstepTime& current() const { return current_; }
  const SubstepTime& previous() const { return previous_; }
  /// The substep that was begun last, whether it has ended or not.
  const SubstepTime& latest() const { return isOpen_ ? current_ : previous_; }

 private:
  std::uint64_t number_ = 0;
  SubstepTime current_, previous_;
  bool isOpen_ = false;  // between `begin` and `end`
  double rest_ = 0.0;    // s, what rounding has left out of current_.start
};

}  // namespace carom::bullet
