#pragma once

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "bullet_bridge/tracking/bridge_context.h"
#include "bullet_bridge/tracking/pair_records.h"

namespace carom::bullet {

/// The events that the host has not cleared yet; those of one substep are in order of time.
/// [physics thread]
class EventLog {
 public:
  /// Borrows the context, which must outlive the log.
  explicit EventLog(BridgeContext& context) : context_(context) {}

  std::span<const ImpulseEvent> events() const { return events_; }
  void clear() { events_.clear(); }

  void beginSubstep() { first_ = events_.size(); }
  /// Hands out the events of an impact, once: with the impulse that Bullet has applied so far, if
  /// the host wants it.
  void deliver(Impact& impact);
  /// Sorts the events of this substep by time; those at equal times keep their order.
  void endSubstep();

 private:
  BridgeContext& context_;
  std::vector<ImpulseEvent> events_;
  std::size_t first_ = 0;                              // first event of this substep
  std::vector<std::pair<double, std::size_t>> order_;  // both kept for their memory
  std::vector<ImpulseEvent> sorted_;
};

}  // namespace carom::bullet
