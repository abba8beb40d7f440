#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "carom/audio/contact_state.h"
#include "plugin/pybullet/contact_impact.h"
#include "plugin/pybullet/contact_listener.h"

namespace carom::plugin {

/// A body over a substep.
struct SubstepMotion {
  ContactBody body{};
  BodyState start{};
  BodyState end{};  ///< its velocities are those by which the body has moved over the substep
};

/// Tells the motion of bodies over a substep.
class SubstepMotions {
 public:
  virtual ~SubstepMotions() = default;
  /// Returns how a body has moved; nothing where that is not known.
  virtual std::optional<SubstepMotion> motionOf(BodyId id) const = 0;
  /// Returns the state at its end; null for a body that does not move, or is not known.
  virtual const BodyState* endStateOf(BodyId id) const = 0;

 protected:
  SubstepMotions() = default;
  SubstepMotions(const SubstepMotions&) = default;
  SubstepMotions& operator=(const SubstepMotions&) = default;
};

/// Follows pairs that slide, roll or rest on each other, through what a physics server tells of
/// each substep: ContactState says how. The contact of a pair is the mean of its points. Of a pair
/// that lies still, only those substeps are told in which its contact begins, comes to lie still,
/// changes its load twofold, or ends, which is three substeps after its last load. [physics thread]
class LastingPairs {
 public:
  /// Takes the contacts of a substep from `time` (s) on, `duration` (s) long, as
  /// ContactListener::contacts returns them. Returns the states of
  /// those that last, valid until the next call.
  std::span<const ContactState> finish(double time, double duration,
                                       std::span<const PairContact> contacts,
                                       const SubstepMotions& motions);
  /// Forgets the pairs of a body that is removed.
  void removeBody(BodyId id);
  /// Forgets all pairs: they are told again.
  void clear() { pairs_.clear(); }
  /// Ends all pairs at a time (s), as the host has put the world into another state. Returns the
  /// ends of those that were told, valid until the next call.
  std::span<const ContactState> end(double time);

 private:
  struct Pair {
    std::uint64_t key = 0;                  // both ids, the smaller one first
    std::uint64_t loaded = 0;               // the latest substep with load
    double load = 0.0;                      // N, as it was told last
    bool isStill = false;                   // as it was told last
    std::unique_ptr<ContactState> state{};  // as it was told last; null before that
  };
  void tell(Pair& pair, const TouchPoint& contact, const SubstepMotions& motions);
  void keep(Pair& pair);

  double time_ = 0.0;      // s
  double duration_ = 0.0;  // s
  std::uint64_t count_ = 0;
  std::vector<Pair> pairs_;      // by key
  std::vector<Pair> nextPairs_;  // scratch
  std::vector<ContactState> states_;
};

/// Returns a contact over a substep of that duration (s), of a body and the other one. Its time and
/// phase are left to the caller.
ContactState contactStateOf(const TouchPoint& contact, const SubstepMotion& body,
                            const SubstepMotion& other, double duration);

}  // namespace carom::plugin
