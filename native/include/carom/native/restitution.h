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

/// How a body's restitution depends on the speed of approach.
enum class SpeedLaw : std::uint8_t {
  constant,      ///< not at all
  viscoelastic,  ///< 1/e - 1 grows with v^(1/5): slow impacts lose little
  plastic,       ///< e falls with v^(-1/4) where something yields: above the law's speed
};

/// A body's restitution away from the speed at which it was measured.
///
/// viscoelastic: spheres whose stress has a part that grows with the rate of strain lose
/// 1 - e ~ v^(1/5) to first order (Kuwabara, Kono 1987, Jpn. J. Appl. Phys. 26, 1230; Ramirez,
/// Poeschel, Brilliantov, Schwager 1999, Phys. Rev. E 60, 4465, eq. 13). 1 / (1 + c v^(1/5)) is
/// the same to that order, and stays above 0 at every speed.
/// plastic: e ~ v^(-1/4) (Johnson 1985, Contact Mechanics, eq. 11.46).
struct RestitutionLaw {
  SpeedLaw law = SpeedLaw::constant;
  double speed = 1.0;  ///< m/s, > 0: at which restitution is what the body says; plastic: up to it

  friend bool operator==(const RestitutionLaw&, const RestitutionLaw&) = default;
};

/// x^(1/5) of x >= 0, to rounding, by Newton's method from above: the same bits everywhere, which
/// std::pow does not promise. [any thread]
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

/// Restitution at `approachSpeed` m/s, >= 0, of a body that has `restitution` at the law's speed:
/// from 0 to 1 as that is. [any thread]
inline double restitutionAt(double restitution, const RestitutionLaw& law, double approachSpeed) {
  if (law.law == SpeedLaw::viscoelastic) {
    const double loss = (1.0 - restitution) * fifthRoot(approachSpeed / law.speed);
    return restitution > 0.0 ? restitution / (restitution + loss) : 0.0;
  }
  if (law.law == SpeedLaw::plastic && approachSpeed > law.speed)
    return restitution * std::sqrt(std::sqrt(law.speed / approachSpeed));
  return restitution;
}

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
