#include "lab/compare/collision_match.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace carom::lab {
namespace {

using ByPair = std::map<std::pair<BodyId, BodyId>, std::vector<Collision>>;

ByPair byPair(std::span<const Collision> collisions) {
  ByPair sorted;
  for (const Collision& collision : collisions)
    sorted[{collision.body, collision.other}].push_back(collision);
  return sorted;
}

// Time (s) at which the collisions of one pair stop agreeing between two runs; infinite if never.
double divergence(const std::vector<Collision>& a, const std::vector<Collision>& b, double limit) {
  for (std::size_t i = 0; i < std::max(a.size(), b.size()); ++i) {
    if (i >= a.size()) return b[i].time;
    if (i >= b.size()) return a[i].time;
    if (std::abs(a[i].time - b[i].time) > limit) return std::min(a[i].time, b[i].time);
  }
  return std::numeric_limits<double>::infinity();
}

}  // namespace

void ErrorSum::add(double error) {
  sumOfSquares_ += error * error;
  max_ = std::max(max_, std::abs(error));
  ++count_;
}

ErrorSummary ErrorSum::summary() const {
  return count_ == 0 ? ErrorSummary{}
                     : ErrorSummary{std::sqrt(sumOfSquares_ / static_cast<double>(count_)), max_};
}

std::vector<Collision> collisionsOf(std::span<const ImpulseEvent> events) {
  std::vector<Collision> collisions;
  for (const ImpulseEvent& event : events) {
    if (event.body > event.other) continue;
    collisions.push_back({event.body, event.other, event.time, event.impulse.norm()});
  }
  std::stable_sort(collisions.begin(), collisions.end(),
                   [](const auto& a, const auto& b) { return a.time < b.time; });
  return collisions;
}

CollisionMatch matchCollisions(std::span<const Collision> reported,
                               std::span<const Collision> reference, double window) {
  CollisionMatch match;
  ByPair open = byPair(reference);
  ErrorSum time;
  ErrorSum impulse;
  for (const Collision& collision : reported) {
    auto& candidates = open[{collision.body, collision.other}];
    const auto nearest =
        std::min_element(candidates.begin(), candidates.end(), [&](const auto& a, const auto& b) {
          return std::abs(a.time - collision.time) < std::abs(b.time - collision.time);
        });
    if (nearest == candidates.end() || std::abs(nearest->time - collision.time) > window) {
      ++match.spurious;
      continue;
    }
    time.add(collision.time - nearest->time);
    impulse.add(collision.impulse / nearest->impulse - 1.0);
    candidates.erase(nearest);
  }
  match.reference = reference.size();
  match.matched = time.count();
  match.missed = match.reference - match.matched;
  match.timeError = time.summary();
  match.impulseError = impulse.summary();
  return match;
}

CommonRun commonRun(std::span<const Collision> run, std::span<const Collision> reference,
                    double limit) {
  CommonRun common;
  ByPair mine = byPair(run);
  ByPair exact = byPair(reference);
  for (const auto& [pair, collisions] : mine)
    exact[pair];
  for (const auto& [pair, collisions] : exact)
    common.divergedAt = std::min(common.divergedAt, divergence(collisions, mine[pair], limit));
  ErrorSum difference;
  for (const auto& [pair, collisions] : exact) {
    const auto& other = mine[pair];
    for (std::size_t i = 0; i < std::min(collisions.size(), other.size()); ++i) {
      if (std::max(collisions[i].time, other[i].time) >= common.divergedAt) break;
      difference.add(other[i].time - collisions[i].time);
    }
  }
  common.compared = difference.count();
  common.difference = difference.summary();
  return common;
}

}  // namespace carom::lab
