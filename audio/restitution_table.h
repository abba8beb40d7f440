#pragma once

#include <algorithm>
#include <cstdint>
#include <sstream>
#include <utility>
#include <variant>
#include <vector>

#include "audio/material.h"
#include "audio/result.h"

namespace carom {

/// What surfaces of one kind share: a number that whoever fills a RestitutionTable hands out.
using SurfaceId = std::uint32_t;

/// Restitution of pairs of surfaces, where it is known: restitution belongs to a pair, and what a
/// mean of two materials gives is only a default. Header only, so that `native/` may use it.
/// [any thread, as long as nobody calls `set`]
class RestitutionTable {
 public:
  /// Of `surface` against `other`, which may be the same, in either order. Refuses a restitution
  /// that is not from 0 to 1, and a pair that has one already. O(number of pairs).
  Status set(SurfaceId surface, SurfaceId other, double restitution) {
    if (!(restitution >= 0.0 && restitution <= 1.0)) {
      std::ostringstream text;
      text << "restitution " << restitution << " of surfaces " << surface << " and " << other
           << "; it must be from 0 to 1";
      return Error{text.str()};
    }
    const Pair pair = ordered(surface, other);
    const auto place = find(pair);
    if (place != entries_.end() && place->pair == pair) {
      std::ostringstream text;
      text << "surfaces " << surface << " and " << other << " have a restitution already, "
           << place->restitution << "; a pair may have one";
      return Error{text.str()};
    }
    entries_.insert(place, {pair, restitution});
    return std::monostate{};
  }

  /// The pair's own, or else the geometric mean of the two restitutions (combinedRestitution): bit
  /// for bit that mean where the table is empty. O(log of the number of pairs), never allocates.
  double of(SurfaceId surface, double restitution, SurfaceId other, double otherRestitution) const {
    if (!entries_.empty()) {
      const Pair pair = ordered(surface, other);
      const auto place = find(pair);
      if (place != entries_.end() && place->pair == pair) return place->restitution;
    }
    return combinedRestitution(restitution, otherRestitution);
  }

  bool empty() const { return entries_.empty(); }
  std::size_t size() const { return entries_.size(); }  ///< pairs

 private:
  using Pair = std::pair<SurfaceId, SurfaceId>;  // the lower first
  struct Entry {
    Pair pair;
    double restitution = 0.0;
  };
  using Entries = std::vector<Entry>;

  static Pair ordered(SurfaceId surface, SurfaceId other) {
    return {std::min(surface, other), std::max(surface, other)};
  }
  Entries::const_iterator find(const Pair& pair) const {
    return std::lower_bound(entries_.begin(), entries_.end(), pair,
                            [](const Entry& entry, const Pair& key) { return entry.pair < key; });
  }

  Entries entries_;  // in order of the pairs
};

}  // namespace carom
