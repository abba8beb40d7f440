#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <sstream>
#include <utility>
#include <variant>
#include <vector>

#include <carom/audio/material.h>
#include <carom/audio/result.h>

namespace carom {

/// Laws by which a body's restitution depends on the approach speed.
enum class SpeedLaw : std::uint8_t {
  constant,      ///< restitution does not depend on the speed
  viscoelastic,  ///< 1/e - 1 grows with v^(1/5): slow impacts lose little
  plastic,       ///< e falls with v^(-1/4) above the law's speed, where a body yields
};

/// The dependence of a body's restitution e on the approach speed v, around the speed at which e
/// was measured.
struct RestitutionLaw {
  SpeedLaw law = SpeedLaw::constant;
  double speed = 1.0;  ///< m/s, > 0: where the body's restitution holds; plastic: and below

  friend bool operator==(const RestitutionLaw&, const RestitutionLaw&) = default;
};

/// Returns x^(1/5) for x >= 0, to rounding, by Newton's method from above: the same bits
/// everywhere, which std::pow does not promise. [any thread]
inline double fifthRoot(double x) {
  if (!(x > 0.0)) return 0.0;
  double root = std::ldexp(1.0, static_cast<int>(std::floor(std::ilogb(x) / 5.0)) + 1);
  for (;;) {
    const double square = root * root;
    const double next = 0.2 * (4.0 * root + x / (square * square));
    if (!(next < root)) return root;
    root = next;
  }
}

/// Returns the restitution, from 0 to 1, at `approachSpeed` (m/s, >= 0) of a body that has
/// `restitution` (0 to 1) at the law's speed. [any thread]
inline double restitutionAt(double restitution, const RestitutionLaw& law, double approachSpeed) {
  if (law.law == SpeedLaw::viscoelastic) {
    const double loss = (1.0 - restitution) * fifthRoot(approachSpeed / law.speed);
    return restitution > 0.0 ? restitution / (restitution + loss) : 0.0;
  }
  if (law.law == SpeedLaw::plastic && approachSpeed > law.speed)
    return restitution * std::sqrt(std::sqrt(law.speed / approachSpeed));
  return restitution;
}

/// Number of a kind of surface, chosen by the code that fills a RestitutionTable.
using SurfaceId = std::uint32_t;

/// The known restitutions of pairs of surfaces. Restitution belongs to a pair; a mean of two
/// materials is only a default. Header only, so that `native/` may use it. [any thread, as long as
/// no thread calls `set`]
class RestitutionTable {
 public:
  /// Sets the restitution of `surface` against `other` (the order does not matter, and both may be
  /// the same). Refuses a restitution that is not from 0 to 1, and a pair that has one already.
  /// O(number of pairs).
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

  /// Returns the pair's restitution, or else the geometric mean of the two bodies' own
  /// (combinedRestitution): bit for bit that mean if the table is empty. O(log of the number of
  /// pairs), never allocates.
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
