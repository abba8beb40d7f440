#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "native/bodies.h"
#include "native/cell_grid.h"
#include "native/contact_queue.h"

namespace carom::native {

/// What every sphere does next, and which is the first: it meets another or a wall, or leaves its
/// cell. A contact is predicted from the motions of the two that meet, taken at the later of the
/// instants since which they hold, and from nothing else. So it is the same, bit for bit, whenever
/// and however it is found: from either side, after any crossing, with any cells or none.
///
/// As in event-driven molecular dynamics with one entry per sphere (Lubachevsky 1991, J. Comput.
/// Phys. 94, 255). A contact that is found is entered for both; a prediction with a partner whose
/// motion has changed since is told by the partner's count of changes, and made again when due.
///
/// Internal to native/. Construction allocates, and the first setTurn; nothing else does.
class Agenda {
 public:
  static constexpr std::uint32_t kNobody = CellGrid::kNobody;

  struct Contact {
    Instant time = Instant::never();
    /// A sphere; after those a wall; after those a box. A box's face (a wall) means that the
    /// sphere, which holds it, comes to its border.
    std::uint32_t partner = kNobody;
    std::uint32_t partnerChanges = 0;  ///< how many the partner had had when it was predicted
  };

  /// Looks at `bodies` whenever it predicts; they must outlive it.
  explicit Agenda(const Bodies& bodies);

  std::uint32_t first() { return queue_.earliest(); }  ///< kNobody if nothing will happen
  const Instant& time(std::uint32_t sphere) const { return queue_.time(sphere); }
  /// Whether the sphere leaves its cell next, instead of meeting another or a wall.
  bool crosses(std::uint32_t sphere) const {
    return futures_[sphere].crossing < futures_[sphere].contact.time && !turns(sphere);
  }
  /// Whether its motion changes by itself next.
  bool turns(std::uint32_t sphere) const {
    if (turns_.empty()) return false;
    const Future& future = futures_[sphere];
    return turns_[sphere] < future.contact.time && turns_[sphere] < future.crossing;
  }
  const Contact& contact(std::uint32_t sphere) const { return futures_[sphere].contact; }
  /// Whether the contact may be one of several at its instant: another of one of the two is due
  /// within kTieReach of it, or it has been found due at once.
  bool tied(std::uint32_t sphere) const { return (flags_[sphere] & kTied) != 0; }
  /// Whether the contact's partner, a sphere, still moves as it did when this was predicted.
  bool upToDate(const Contact& contact) const;

  /// Forgets what was predicted for a sphere whose motion has changed, and what others predicted
  /// with it: both must be called, for all that have changed, before anything is predicted.
  void forget(std::uint32_t sphere);
  /// Finds the sphere's next contact and crossing from `now` on.
  void predict(std::uint32_t sphere, const Instant& now);
  /// The sphere's motion changes by itself at `time`, unless something else changes it before. To
  /// be set, or taken back with never, before what is predicted then.
  void setTurn(std::uint32_t sphere, const Instant& time);
  /// Takes the sphere to the next cell at `now`, its time of crossing.
  void cross(std::uint32_t sphere, const Instant& now);

  /// Nothing touches the sphere from now on; to be followed by forget and predict.
  void remove(std::uint32_t sphere);
  bool removed(std::uint32_t sphere) const { return (flags_[sphere] & kRemoved) != 0; }

  /// Calls visit(other) for all spheres that are within `way` m of this one at `position`, and some
  /// more.
  template <class Visit>
  void visitNear(std::uint32_t sphere, const Vec3& position, double way, const Visit& visit) const {
    grid_.visitNear(sphere, {position, bodies_.radii[sphere], way}, visit);
  }

  bool validate(std::uint32_t sphere, double time, std::string* why) const;
  bool queueValid() const { return queue_.valid(); }

 private:
  static constexpr unsigned kFaces = 0x07;
  static constexpr unsigned kRemoved = 0x40;
  static constexpr unsigned kTied = 0x80;

  struct Search;
  struct Look;
  template <bool kPulled, bool kFresh>
  struct LookStraight;
  struct Future {
    Contact contact;
    Instant crossing = Instant::never();
    std::uint32_t changes = 0;  ///< of motion; may wrap round: only compared for equality
    std::uint32_t lastPartner = kNobody;
  };

  void lookForWalls(Search& search) const;
  void lookForShakenWalls(Search& search) const;
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
  std::vector<Instant> turns_;   ///< by sphere; empty until there is one
  /// By sphere, through which face it leaves its cell: 2 axis + (1 if up); kTied and kRemoved.
  std::vector<std::uint8_t> flags_;
  ContactQueue queue_;
};

}  // namespace carom::native
