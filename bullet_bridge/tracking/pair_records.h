#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "bullet_bridge/tracking/contact_kinematics.h"
#include "carom/audio/contact_state.h"
#include "carom/audio/impulse_event.h"

namespace carom::bullet {

/// One place and time at which an impact happens: the events of both bodies there, and the share of
/// the place in the impact.
struct ImpactPoint {
  ImpulseEvent body;             ///< the share of the pair's `body`
  ImpulseEvent other;            ///< the share of the pair's `other`
  double impulseFraction = 1.0;  ///< fraction of the sum of all physical impulses of the impact
};

/// An impact that was found, and the impulse that Bullet has applied for it so far. It may have
/// several points, in order of time: corners that reach the other surface one after the other, but
/// which Bullet solves together.
struct Impact {
  std::vector<ImpactPoint> points;
  double restitution = 0.0;
  double foundAt = 0.0;         ///< s, start of the substep in which it was found
  Vec3 applied = Vec3::Zero();  ///< N s, on the pair's `body`
  int solved = 0;               ///< substeps in which Bullet's solver has acted
  bool parted = false;          ///< the bodies no longer approached after it
  bool delivered = false;
};

/// The state of a pair, from one substep to the next: an impact of it may be under way, or new
/// impacts may be suppressed, and either of these, or neither, within a lasting contact. Each
/// transition is a function of PairRecord:
///
///     transition       from         to           when
///     beginImpact      separate     impacting    an impact is found
///     endImpact        impacting    separate     the impact is over: ImpactTracker::update
///     suppressImpacts  separate     suppressed   an approach is rest, or goes on after its impact
///     allowImpacts     suppressed   separate     that approach has ended
///     beginContact     separate     inContact    Bullet holds the pair outside of an impact
///     endContact       inContact    separate     no load for three substeps, asleep, or apart
///
/// The first four lead from and to the states of the same name within a lasting contact, too; the
/// last two lead from each state to the one of its name within a lasting contact, and back.
enum class PairState : std::uint8_t {
  separate,             ///< nothing to remember: the record goes at the end of the substep
  impacting,            ///< an impact is under way: what Bullet applies belongs to it
  suppressed,           ///< the bodies still approach, and no new impact counts until they do not
  inContact,            ///< the pair is in lasting contact
  impactingInContact,   ///< as impacting, within a lasting contact
  suppressedInContact,  ///< as suppressed, within a lasting contact
};

/// The record that the bridge keeps of a pair from one substep to the next. A transition that the
/// state does not have is a bug, and asserted.
class PairRecord {
  PairState state_ = PairState::separate;  // first: with what follows in one cache line

 public:
  BodyId body = 0;
  BodyId other = 0;
  /// True if the last contact state that was handed out was that of a contact which does not move.
  bool isTold = false;
  int idle = 0;  ///< substeps of the lasting contact without load, up to now
  /// Number of the substep in which the pair was resolved last (SubstepClock::number). It is no
  /// part of the state: a pair in any state is resolved once in a substep.
  std::uint64_t resolvedIn = 0;
  std::size_t bodyPlace = 0;  ///< as BodyTracker::find
  std::size_t otherPlace = 0;
  Impact impact;
  PairCurvature curvature;  ///< of the lasting contact, as it was found last
  ContactState state;       ///< the contact state that was handed out last

  /// Takes the record for another pair, in the state `separate`. Its impact and its contact state
  /// stay as they are, for their memory.
  void reuse(BodyId newBody, BodyId newOther);

  bool isImpacting() const;
  bool isSuppressed() const;
  bool isInContact() const;
  bool isNeeded() const { return state_ != PairState::separate; }

  void beginImpact();
  void endImpact();
  void suppressImpacts();
  void allowImpacts();
  void beginContact();
  void endContact();

 private:
  struct Transition {
    PairState from, to;
  };
  template <std::size_t count>
  void apply(const Transition (&transitions)[count]);
};

/// The records of all pairs that need one, found by key. Memory is kept; a record stays where it is
/// until the end of the substep in which it is no longer needed.
class PairRecords {
 public:
  /// Returns nullptr if there is none. Records made in this substep are not found until its end.
  PairRecord* find(std::uint64_t key);
  /// Adds a record for a pair that has none.
  PairRecord& add(std::uint64_t key, BodyId body, BodyId other);
  /// Removes records that are no longer needed. `forEach` follows the order of the keys.
  void endSubstep();

  template <class Visit>
  void forEach(Visit visit) {
    for (const Entry& entry : entries_)
      visit(records_[entry.second]);
  }

 private:
  using Entry = std::pair<std::uint64_t, std::uint32_t>;  // key and place

  std::vector<Entry> entries_;  // sorted by key up to known_, then this substep's
  std::size_t known_ = 0;
  std::vector<PairRecord> records_;
  std::vector<std::uint32_t> free_;  // places of records_ that are free
};

}  // namespace carom::bullet
