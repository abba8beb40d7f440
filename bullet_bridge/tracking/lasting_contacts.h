#pragma once

#include <span>
#include <vector>

#include "bullet_bridge/tracking/bridge_context.h"
#include "bullet_bridge/tracking/pair_motion.h"
#include "bullet_bridge/tracking/pair_records.h"
#include "bullet_bridge/tracking/solved_contact.h"

namespace carom::bullet {

/// Follows the lasting contacts of pairs, and holds the states that the host has not cleared yet.
/// [physics thread]
class LastingContacts {
 public:
  /// Borrows the context, which must outlive this.
  explicit LastingContacts(BridgeContext& context) : context_(context) {}

  std::span<const ContactState> states() const { return states_; }
  void clear() { states_.clear(); }

  /// Begins the contact of a pair or goes on with it, over the current substep; ends it after three
  /// substeps without load. `start` is where the two were nearest as the substep began.
  void update(PairRecord& record, const PairMotion& now, const Proximity& start,
              const SolvedContact& solved);
  /// Goes on with the contact of a pair without a state, if it lies still and there is nothing new
  /// to tell; otherwise does nothing and returns false. `impulse` (N s) is what Bullet's solver
  /// held it by.
  bool carryStill(PairRecord& record, const ContactPair& pair, double impulse) const;
  /// As `update` for a contact that has begun, without the pieces of the pair: its curvature is
  /// taken for what it was, if the bodies have hardly moved since; otherwise does nothing and
  /// returns false.
  bool carry(PairRecord& record, const ContactPair& pair, const SolvedContact& solved);
  /// Goes on with a contact that Bullet's solver has not acted on in this substep.
  void carryUnloaded(PairRecord& record);
  /// Ends the contact of a pair that is asleep, gone or far apart.
  void end(PairRecord& record);

 private:
  bool liesStill(const ContactPair& pair) const;
  bool liesStill(const ContactState& state) const;
  void tellUnloaded(const PairRecord& record, ContactPhase phase);
  bool isNews(const PairRecord& record, double impulse) const;

  BridgeContext& context_;
  std::vector<ContactState> states_;
};

}  // namespace carom::bullet
