#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "carom/audio/result.h"
#include "native/scheduling/bodies.h"
#include "native/scheduling/cell_grid.h"
#include "native/scheduling/contact_queue.h"

namespace carom::native {

/// The schedule of the spheres' next events: a sphere meets another sphere or a wall, leaves its
/// cell, or turns (its motion changes by itself). A contact is predicted from the motions of its
/// two partners only, taken at the later of the instants since which they hold. So it is the same,
/// bit for bit, whenever and however it is found: from either side, after any crossing, with any
/// cells or none.
///
/// The method is event-driven molecular dynamics with one entry per sphere (Lubachevsky 1991, J.
/// Comput. Phys. 94, 255). A contact that is found is entered for both partners; a prediction whose
/// partner's motion has changed since is recognised by the partner's count of changes, and made
/// again when due.
///
/// Internal to native/. The constructor and the first setTurn allocate; nothing else does.
class EventScheduler {
 public:
  static constexpr std::uint32_t kNobody = CellGrid::kNobody;

  struct Contact {
    Instant time = Instant::never();
    /// Number of a sphere, or sphere count + wall, or sphere count + wall count + box. A wall that
    /// is a box's face means that the sphere, which this face holds, reaches its border.
    std::uint32_t partner = kNobody;
    std::uint32_t partnerChanges = 0;  ///< the partner's count of changes at the prediction
  };

  /// Keeps a reference to `bodies`, which must outlive the scheduler.
  explicit EventScheduler(const Bodies& bodies);

  /// The sphere whose event is the next of all; kNobody if nothing will happen any more.
  std::uint32_t first() { return queue_.earliest(); }
  /// Instant of the sphere's next event.
  const Instant& time(std::uint32_t sphere) const { return queue_.time(sphere); }
  /// True if the sphere leaves its cell next, instead of meeting another sphere or a wall.
  bool crosses(std::uint32_t sphere) const {
    return futures_[sphere].crossing < futures_[sphere].contact.time && !turns(sphere);
  }
  /// True if the next event of the sphere is that its motion changes by itself.
  bool turns(std::uint32_t sphere) const {
    if (turns_.empty()) return false;
    const Future& future = futures_[sphere];
    return turns_[sphere] < future.contact.time && turns_[sphere] < future.crossing;
  }
  const Contact& contact(std::uint32_t sphere) const { return futures_[sphere].contact; }
  /// True if the contact may be one of several at its instant: another contact of one of the two
  /// bodies is due within kTieReach of it, or it has been found due at once.
  bool tied(std::uint32_t sphere) const { return (flags_[sphere] & kTied) != 0; }
  /// True if the contact's partner, a sphere, still moves as it did when the contact was predicted.
  bool upToDate(const Contact& contact) const;

  /// Discards the prediction of a sphere whose motion has changed, and marks those that others made
  /// with it as outdated. Must be called for all spheres that have changed before any is predicted.
  void forget(std::uint32_t sphere);
  /// Finds the sphere's next contact and crossing from `now` on, and queues the earlier one.
  void predict(std::uint32_t sphere, const Instant& now);
  /// Schedules that the sphere's motion changes by itself at `time`, unless something else changes
  /// it before; Instant::never() cancels this. Must be called before `predict`.
  void setTurn(std::uint32_t sphere, const Instant& time);
  /// Moves the sphere to the next cell at `now`, its time of crossing.
  void cross(std::uint32_t sphere, const Instant& now);

  /// Removes the sphere from all contacts for good; must be followed by forget and predict.
  void remove(std::uint32_t sphere);
  bool removed(std::uint32_t sphere) const { return (flags_[sphere] & kRemoved) != 0; }

  /// Calls visit(other) for all spheres that are within `way` m of this one at `position`, and for
  /// some more.
  template <class Visit>
  void visitNear(std::uint32_t sphere, const Vec3& position, double way, const Visit& visit) const {
    grid_.visitNear(sphere, {position, bodies_.radii[sphere], way}, visit);
  }

  /// Refuses what is scheduled for the sphere if it is not consistent at `time` (s).
  Status validate(std::uint32_t sphere, double time) const;
  bool isQueueValid() const { return queue_.valid(); }  ///< true if the queue is in order

 private:
  static constexpr unsigned kFaces = 0x07;
  static constexpr unsigned kRemoved = 0x40;
  static constexpr unsigned kTied = 0x80;

  struct Search;
  struct CandidateVisitor;
  template <bool kPulled, bool kFresh>
  struct RejectingVisitor;
  struct Future {
    Contact contact;
    Instant crossing = Instant::never();
    std::uint32_t changes = 0;  ///< count of motion changes; may wrap, only compared for equality
    std::uint32_t lastPartner = kNobody;
  };

  void lookForWalls(Search& search) const;
  void lookForOscillatingWalls(Search& search) const;
  void lookForBoxes(Search& search) const;
  void offerImmovable(double wait, std::uint32_t index, Search& search) const;
  void lookAt(std::uint32_t other, Search& search);
  void lookStraightAt(std::uint32_t other, Search& search);
  void offer(const Contact& contact, Search& search);
  void offerLate(const Contact& contact, Search& search);
  BodyId idOf(const Contact& contact) const;
  template <class VisitAll>
  void lookAround(const Vec3& position, Search& search, const VisitAll& visitAll);
  void tie(std::uint32_t sphere);
  void setTied(std::uint32_t sphere, bool tied) {
    const unsigned others = flags_[sphere] & ~kTied;
    flags_[sphere] = static_cast<std::uint8_t>(others | (tied ? kTied : 0U));
  }
  void predictCrossing(std::uint32_t sphere, const Motion& motion);
  void claim(std::uint32_t sphere, const Contact& found);
  void schedule(std::uint32_t sphere);
  Instant turnOf(std::uint32_t sphere) const {
    return turns_.empty() ? Instant::never() : turns_[sphere];
  }

  const Bodies& bodies_;
  CellGrid grid_;
  std::vector<Future> futures_;  ///< by sphere
  std::vector<Instant> turns_;   ///< by sphere; empty until the first setTurn
  /// Face through which each sphere leaves its cell, 2 axis + (1 if up), with kTied and kRemoved.
  std::vector<std::uint8_t> flags_;
  ContactQueue queue_;
};

}  // namespace carom::native
