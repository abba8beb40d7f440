#include "bullet_bridge/tracking/event_log.h"

#include <algorithm>

namespace carom::bullet {

void EventLog::deliver(Impact& impact) {
  if (impact.delivered) return;
  impact.delivered = true;
  for (ImpactPoint& point : impact.points) {
    if (context_.settings.delivery == EventDelivery::complete) {
      point.body.appliedImpulse = point.impulseFraction * impact.applied;
      point.other.appliedImpulse = -point.body.appliedImpulse;
      point.body.hasAppliedImpulse = point.other.hasAppliedImpulse = true;
    }
    events_.push_back(point.body);
    events_.push_back(point.other);
    ++context_.counters.delivered;
  }
}

void EventLog::endSubstep() {
  order_.clear();
  for (std::size_t i = first_; i < events_.size(); ++i)
    order_.emplace_back(events_[i].time, i);
  if (std::is_sorted(order_.begin(), order_.end())) return;
  std::sort(order_.begin(), order_.end());
  sorted_.clear();
  for (const auto& [time, i] : order_)
    sorted_.push_back(events_[i]);
  std::copy(sorted_.begin(), sorted_.end(), events_.begin() + static_cast<std::ptrdiff_t>(first_));
}

}  // namespace carom::bullet
