#pragma once

#include "bullet_bridge/tracking/bridge_context.h"
#include "bullet_bridge/tracking/event_log.h"
#include "bullet_bridge/tracking/impact_events.h"
#include "bullet_bridge/tracking/impact_finder.h"
#include "bullet_bridge/tracking/pair_records.h"
#include "bullet_bridge/tracking/solved_contact.h"

namespace carom::bullet {

/// Follows impacts from the substep in which they are found until Bullet has solved them, and hands
/// out their events. [physics thread]
class ImpactTracker {
 public:
  /// Borrows both, which must outlive the tracker.
  ImpactTracker(BridgeContext& context, EventLog& log) : context_(context), log_(log) {}

  /// Begins an impact of a pair that has none, or suppresses it if neither body can be moved.
  /// `restitution` is what Bullet holds for the pair.
  void begin(PairRecord& record, const FoundImpact& found, double restitution);
  /// Adds what Bullet applied in the current substep to the impact under way.
  static void addApplied(PairRecord& record, const PairMotion& now, const SolvedContact& solved);
  /// Adds what Bullet applied in the current substep, and ends the impact if it is over: when the
  /// pair no longer approaches and is apart, or has been solved often enough; when it is well apart
  /// anyway, because it tunnelled or the host moved it; or after the longest wait.
  void update(PairRecord& record, const PairMotion& now, const SolvedContact& solved);
  /// Ends the impact and hands out its events.
  void end(PairRecord& record);
  /// Hands out the events of the impact, which stays under way.
  void flush(PairRecord& record) { log_.deliver(record.impact); }

  /// Normal of the impact under way, towards the body that is now the pair's first.
  static Vec3 normalOf(const PairRecord& record, const PairMotion& now);

 private:
  void count(const Impact& impact, const FoundImpact& found);
  // The pair at the end of the substep.
  struct Separation {
    double approach = 0.0;  // m/s
    double gap = 0.0;       // m
    bool isFarApart = false;
  };
  void endIfOver(PairRecord& record, const Separation& after);

  BridgeContext& context_;
  EventLog& log_;
  ImpactEvents events_;
};

}  // namespace carom::bullet
