#include "plugin/pybullet/event_table.h"

#include <algorithm>
#include <array>
#include <utility>

namespace carom::plugin {

EventTable::EventTable(const std::shared_ptr<const audio::SoundPaths>& paths)
    : listeners_(paths->listeners.size()),
      threshold_(paths->settings.audibleThreshold),
      bounds_(paths) {}

void EventTable::add(const ImpulseEvent& share, ServerClient::Key body, ServerClient::Key other) {
  peaks_.assign(listeners_, 0.0);
  bounds_.add(share, peaks_);
  const double peak = *std::ranges::max_element(peaks_);
  const double collision = static_cast<double>(shares_++ / 2 + 1);
  const Vec3& j = share.impulse;
  const Vec3& p = share.position;
  const Vec3& n = share.normal;
  const std::array<double, kColumns> row = {share.time,
                                            static_cast<double>(body.body),
                                            static_cast<double>(body.link),
                                            static_cast<double>(other.body),
                                            static_cast<double>(other.link),
                                            j.x(),
                                            j.y(),
                                            j.z(),
                                            p.x(),
                                            p.y(),
                                            p.z(),
                                            n.x(),
                                            n.y(),
                                            n.z(),
                                            share.approachSpeed,
                                            share.effectiveMass,
                                            bounds_.scheduler().contactDuration(share),
                                            collision,
                                            peak,
                                            peak > 0.0 && peak >= threshold_ ? 1.0 : 0.0};
  rows_.insert(rows_.end(), row.begin(), row.end());
  rows_.insert(rows_.end(), peaks_.begin(), peaks_.end());
}

std::size_t EventTable::take(std::span<double> numbers) {
  const std::size_t rows = std::min(ready(), numbers.size() / columns());
  const auto begin = rows_.begin() + static_cast<std::ptrdiff_t>(taken_);
  std::copy_n(begin, rows * columns(), numbers.begin());
  taken_ += rows * columns();
  // To move what is left is worth it once that is the smaller part.
  if (2 * taken_ >= rows_.size())
    rows_.erase(rows_.begin(),
                rows_.begin() + static_cast<std::ptrdiff_t>(std::exchange(taken_, 0)));
  return rows;
}

void EventTable::clear() {
  rows_.clear();
  taken_ = 0;
  shares_ = 0;
}

}  // namespace carom::plugin
