#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "carom/audio/impulse_event.h"
#include "carom/audio/vector.h"
#include "plugin/pybullet/contact_impact.h"

namespace carom::plugin {

struct ContactSubstep {
  double time = 0.0;            ///< s, of its start
  double duration = 0.0;        ///< s, > 0
  Vec3 gravity = Vec3::Zero();  ///< m/s^2
  ContactSolver solver{};
};

/// Tells the state of a body after the substep, if it is known.
using StateAfter = std::function<std::optional<BodyState>(BodyId)>;

/// A pair that the solver has acted on in a substep.
struct PairContact {
  TouchPoint mean{};      ///< its points taken for one
  bool isImpact = false;  ///< the impulse belongs to an impact
};

/// Finds impacts in what a physics server tells of each substep: states at its start, contact
/// points with impulses at its end. It knows no solver, no shapes and no world.
///
/// A pair has an impact where the solver acts on points that approach faster than the rest speed,
/// and have not done so ever since the substep before. Its points are taken for one, their mean
/// weighted by impulse. An impact has:
///
/// - Time: points that overlap have met in the substep before, where the bodies went along
///       x(s) = x - v (dt - s) - a s (dt - s) / 2,    0 <= s <= dt
///   with x and v those of its end: the parabola through the nodes of symplectic Euler. The
///   acceleration is the difference of the last two velocities, or gravity after a contact. Points
///   apart that the solver acts on ahead of time meet on the free path beyond the start of this
///   one. Two spheres are solved in closed form; everything else by the gap along the normal, with
///   the path of a corner around its centre to second order in the angle that it turns in a
///   substep. Exact for spheres on planes.
/// - Impulse: (1 + e) m_eff times the approach speed at that time. e is the product of the two
///   restitutions, 0 below the speed under which the solver lets nothing bounce. Where one is not
///   known, e follows from the motion over the substep (restitutionFrom), or else from the solver's
///   impulse, which is some percent too much where bodies overlap and too little where they do not
///   yet.
///
/// Not modelled: joints (the mass and inertia of a link are its own), friction, a second
/// impact of a pair within one substep, and of pairs that were in contact within the last four
/// substeps approaches below the speed that gravity gives in two, as pairs that rest or slide
/// tremble by that. [physics thread]
class ContactListener {
 public:
  /// `restSpeed` in m/s: slower contacts are rest.
  explicit ContactListener(double restSpeed = 0.005) : restSpeed_(restSpeed) {}

  /// Sets a body. Bodies that were not set count as immovable, without restitution.
  void setBody(BodyId id, const ContactBody& body);
  void removeBody(BodyId id);
  /// Forgets how bodies moved and which impacts are under way: the host has put the world into
  /// another state. Pairs that touched are known still, so that what rests does not click.
  void forgetPast();

  /// Begins a substep: to be called once for each, before `state`.
  void begin(const ContactSubstep& substep);
  /// Takes the state of a body that may move; one without a state rests where it is.
  void state(BodyId id, const BodyState& state);
  /// Replaces the state of this substep, of a body that the host has put there: it has no past.
  void correct(BodyId id, const BodyState& state);
  /// Ends the substep. Returns two events for each impact, valid until the next call. `after` is
  /// asked for bodies without a restitution that have an impact; it may be empty.
  std::span<const ImpulseEvent> finish(std::span<const TouchPoint> points,
                                       const StateAfter& after = {});

  /// Returns all pairs that the solver has acted on in the substep that was ended last, those of
  /// the smaller id first in TouchPoint. Valid until the next one is ended.
  std::span<const PairContact> contacts() const { return contacts_; }

  /// True if the body hangs in the air at rest, as none does that gravity can move: a fixed base
  /// whose mass is not 0.
  bool isHeld(BodyId id) const;

 private:
  // A body's motion, as far as it is known.
  struct Track {
    BodyState now;
    BodyState before;
    std::uint64_t seen = 0;          // number of the substep of `now`, from 1
    std::uint64_t seenBefore = 0;    // number of the substep of `before`
    std::uint64_t loaded = 0;        // the latest substep in which the solver pushed it
    std::uint64_t loadedBefore = 0;  // the one before that
  };
  /// A body, and its motion if a state of it has come.
  struct Entry {
    ContactBody body;
    Track track;
  };
  struct Pair {
    std::uint64_t key = 0;         // both ids, the smaller one first
    std::uint64_t impact = 0;      // the latest substep in which an impact of it began; 0: none
    std::uint64_t touched = 0;     // the latest substep in which the solver acted on it
    std::uint64_t approached = 0;  // the latest in which it approached faster than rest
  };
  /// A point of this substep that the solver acted on, of the pair with that key.
  struct Load {
    std::uint64_t pair = 0;
    std::size_t point = 0;  // in points_
  };
  using Points = std::span<const TouchPoint>;

  void hearPair(Pair& pair, Points points, const StateAfter& after);
  void load(Entry* entry) const;
  Entry* find(BodyId id);
  std::optional<double> restitutionOf(const ContactSide& body, const ContactSide& other,
                                      const TouchPoint& mean, const StateAfter& after) const;
  void stayOpen(const TouchPoint& point);
  bool begins(const ContactSide& body, const ContactSide& other, const TouchPoint& mean,
              Pair& pair) const;
  std::optional<Touch> firstTouch(const ContactSide& body, const ContactSide& other,
                                  const TouchPoint& mean, Points points) const;
  bool isOpen(const Pair& pair) const;
  ContactSide sideOf(BodyId id) const;
  Vec3 accelerationOf(const Track& track, const ContactBody& body) const;
  bool isFollowed(const Track& track) const;
  bool hasPast(const Track& track) const;

  double restSpeed_;
  ContactSubstep substep_;
  double durationBefore_ = 0.0;  // s
  std::uint64_t count_ = 0;
  std::unordered_map<BodyId, Entry> entries_;
  std::vector<Pair> pairs_;         // by key
  std::vector<Pair> nextPairs_;     // scratch
  std::vector<TouchPoint> points_;  // those of this substep that the solver acted on
  std::vector<Load> loads_;         // the same, by pair
  std::vector<PairContact> contacts_;
  std::vector<TouchPoint> pairPoints_;  // scratch, those of one pair
  std::vector<ImpulseEvent> events_;
};

}  // namespace carom::plugin
