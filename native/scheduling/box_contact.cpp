#include "native/scheduling/box_contact.h"

#include <algorithm>
#include <cmath>

#include "native/math/polynomial.h"
#include "native/math/vector_math.h"

namespace carom::native {
namespace {

/// Least approach to an edge, relative to the speed: a slower one is rounding, and counts as none.
constexpr double kParallel = 1e-14;
constexpr double kSurely = 1.0 + 1e-9;  ///< factor that covers the rounding of a distance

/// The parabola place + speed t + pull t^2 / 2.
struct Parabola {
  double place = 0.0;
  double speed = 0.0;
  double pull = 0.0;

  double at(double t) const { return place + t * (speed + 0.5 * t * pull); }
  Parabola from(double t) const { return {at(t), speed + t * pull, pull}; }
};

Parabola parabolaOf(const BoxPath& path, Eigen::Index axis) {
  return {path.position[axis], path.velocity[axis], path.acceleration[axis]};
}

/// The times after the start, ascending, at which the path crosses the planes of the faces.
struct Crossings {
  std::array<double, 12> at{};
  std::size_t count = 0;

  void add(double t) {
    if (t > 0.0 && t < kNever) at[count++] = t;
  }
};

/// Adds the times at which the parabola has this value.
void addCrossings(const Parabola& parabola, double value, Crossings& crossings) {
  const double gap = parabola.place - value;
  const double half = -parabola.speed;  // half the sum of the roots, times the pull
  if (parabola.pull == 0.0) {
    if (half != 0.0) crossings.add(gap / half);
    return;
  }
  const double discriminant = half * half - 2.0 * parabola.pull * gap;
  if (!(discriminant > 0.0)) return;
  const double far = half + std::copysign(std::sqrt(discriminant), half);
  crossings.add(far / parabola.pull);
  crossings.add(2.0 * gap / far);
}

Crossings crossingsOf(const Vec3& halfExtents, const BoxPath& path) {
  Crossings crossings;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const Parabola parabola = parabolaOf(path, axis);
    addCrossings(parabola, halfExtents[axis], crossings);
    if (halfExtents[axis] > 0.0) addCrossings(parabola, -halfExtents[axis], crossings);
  }
  std::sort(crossings.at.begin(),
            crossings.at.begin() + static_cast<std::ptrdiff_t>(crossings.count));
  return crossings;
}

/// A piece of the path with one nearest feature; time counts from the beginning of the piece.
struct Piece {
  std::array<Parabola, 3> beyond;  ///< distance beyond the feature, by direction
  std::size_t count = 0;           ///< number of directions: 1 for a face, 2 an edge, 3 a corner
  double end = kNever;             ///< s

  /// True if the path is certainly too far away in one direction during the whole piece.
  bool far(double radius) const {
    for (std::size_t k = 0; k < count; ++k) {
      const Parabola& one = beyond[k];
      const double turn = -one.speed / one.pull;
      double least = std::min(one.place, end < kNever ? one.at(end) : atLast(one));
      if (turn > 0.0 && turn < end) least = std::min(least, one.at(turn));
      if (least > radius * kSurely) return true;
    }
    return false;
  }
  /// Clearance at `t`: height in m for a face, otherwise a difference of squares in m^2; negative
  /// in touch.
  double clearance(double t, double radius) const {
    if (count == 1) return beyond[0].at(t) - radius;
    double sum = 0.0;
    for (std::size_t k = 0; k < count; ++k) {
      const double one = beyond[k].at(t);
      sum += one * one;
    }
    return sum - radius * radius;
  }
  double squaredDistance() const {
    double sum = 0.0;
    for (std::size_t k = 0; k < count; ++k)
      sum += beyond[k].place * beyond[k].place;
    return sum;
  }
  /// True if the distance falls at the beginning of the piece, by more than its rounding.
  bool approaches() const {
    double falling = 0.0;
    double bend = 0.0;
    double speed = 0.0;
    for (std::size_t k = 0; k < count; ++k) {
      falling += beyond[k].place * beyond[k].speed;
      bend += beyond[k].place * beyond[k].pull;
      speed += beyond[k].speed * beyond[k].speed;
    }
    if (count == 1) return falling < 0.0 || (falling == 0.0 && bend < 0.0);
    const double rounding = kParallel * std::sqrt(speed * squaredDistance());
    return falling < -rounding || (falling <= rounding && bend + speed < 0.0);
  }
  Quartic square(double radius) const {
    Quartic sum{-radius * radius};
    for (std::size_t k = 0; k < count; ++k) {
      const Parabola& one = beyond[k];
      sum[0] += one.place * one.place;
      sum[1] += 2.0 * one.place * one.speed;
      sum[2] += one.speed * one.speed + one.place * one.pull;
      sum[3] += one.speed * one.pull;
      sum[4] += 0.25 * one.pull * one.pull;
    }
    return sum;
  }
  /// Time until the distance has again its value at the beginning, where it rises.
  double comeback() const {
    if (count == 1) return planeContactTime(0.0, beyond[0].speed, beyond[0].pull);
    Quartic gained = square(0.0);
    gained[0] = 0.0;
    return firstFall(gained, 0.0, end);
  }
  double fall(double radius) const {
    if (count == 1)
      return planeContactTime(beyond[0].place - radius, beyond[0].speed, beyond[0].pull);
    const double fall = firstFall(square(radius), 0.0, end);
    return fall < kNever ? settled(fall, radius) : fall;
  }

 private:
  /// One step of Newton's method from the fall itself. It removes the rounding of the quartic's
  /// coefficients, which is that of the whole way up to the fall.
  double settled(double fall, double radius) const {
    double falling = 0.0;
    for (std::size_t k = 0; k < count; ++k)
      falling += beyond[k].at(fall) * (beyond[k].speed + fall * beyond[k].pull);
    if (!(falling < 0.0)) return fall;
    const double before = clearance(fall, radius);
    const double next = fall - 0.5 * before / falling;
    const bool nearer = std::abs(clearance(next, radius)) < std::abs(before);
    return next >= 0.0 && nearer ? next : fall;
  }

  static double atLast(const Parabola& one) {
    const bool falls = one.pull < 0.0 || (one.pull == 0.0 && one.speed < 0.0);
    return falls ? -kNever : one.place;
  }
};

Piece pieceOf(const Vec3& halfExtents, const BoxPath& path, double from, double until) {
  Piece piece;
  piece.end = until - from;
  const double within = until < kNever ? 0.5 * (from + until) : 2.0 * from + 1.0;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const Parabola parabola = parabolaOf(path, axis);
    const double place = parabola.at(within);
    if (std::abs(place) <= halfExtents[axis]) continue;
    const Parabola start = parabola.from(from);
    const double side = place < 0.0 ? -1.0 : 1.0;
    piece.beyond[piece.count++] = {side * start.place - halfExtents[axis], side * start.speed,
                                   side * start.pull};
  }
  return piece;
}

/// The whole path and the beginnings of its pieces.
struct Way {
  const Vec3& halfExtents;
  const BoxPath& path;
  Crossings crossings;
  double until = kNever;

  double begin(std::size_t piece) const { return piece == 0 ? 0.0 : crossings.at[piece - 1]; }
  double end(std::size_t piece) const {
    return piece < crossings.count ? crossings.at[piece] : kNever;
  }
  Piece piece(std::size_t number) const {
    return pieceOf(halfExtents, path, begin(number), end(number));
  }
};

/// Returns the time at which the distance first falls through `radius`. If `returning`, the path
/// starts at exactly this distance and leaves; otherwise a start within `radius` must have come out
/// before.
double firstTouch(const Way& way, double radius, bool returning) {
  bool apart = false;
  for (std::size_t number = 0; number <= way.crossings.count; ++number) {
    const double from = way.begin(number);
    if (from > way.until) return kNever;
    if (!(way.end(number) > from)) continue;
    const Piece piece = way.piece(number);
    if (piece.count == 0) {  // inside: rounding lost the fall
      if (apart || returning) return from;
      continue;
    }
    if (piece.far(radius)) {
      apart = true;
      continue;
    }
    const bool start = returning && number == 0;
    const bool touching = start || piece.clearance(0.0, radius) <= 0.0;
    const bool grazing = touching && (apart || returning);  // within rounding
    if (grazing && !start && piece.approaches()) return from;
    const double fall = grazing ? piece.comeback() : piece.fall(radius);
    if (fall <= piece.end && fall < kNever) return from + fall;
    apart = apart || !touching || piece.clearance(piece.end, radius) > 0.0;
  }
  return kNever;
}

}  // namespace

std::array<Vec3, 3> columnsOf(const Quat& orientation) noexcept {
  const double w = orientation.w();
  const double x = orientation.x();
  const double y = orientation.y();
  const double z = orientation.z();
  return {Vec3(1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)),
          Vec3(2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)),
          Vec3(2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y))};
}

BoxNearest nearestOf(const Vec3& halfExtents, const Vec3& centre) noexcept {
  BoxNearest nearest;
  Vec3 beyond = Vec3::Zero();
  std::size_t directions = 0;  // where the point is beyond, or the box has no width
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const double excess = std::abs(centre[axis]) - halfExtents[axis];
    if (excess > 0.0) {
      beyond[axis] = std::copysign(excess, centre[axis]);
      nearest.face = 2 * static_cast<std::size_t>(axis) + (centre[axis] < 0.0 ? 1 : 0);
    }
    if (excess > 0.0 || halfExtents[axis] == 0.0) ++directions;
  }
  if (beyond == Vec3::Zero()) return nearest;
  constexpr std::array kFeatures{BoxFeature::inside, BoxFeature::face, BoxFeature::edge,
                                 BoxFeature::corner};
  nearest.feature = kFeatures[directions];
  nearest.distance = std::sqrt(dotInOrder(beyond, beyond));
  nearest.normal = beyond / nearest.distance;
  return nearest;
}

double boxContactTime(const Vec3& halfExtents, const BoxPath& path, double radius,
                      double until) noexcept {
  const Way way{halfExtents, path, crossingsOf(halfExtents, path), until};
  const Piece start = way.piece(0);
  if (start.count == 0 || start.clearance(0.0, radius) > 0.0) return firstTouch(way, radius, false);
  if (start.approaches()) return 0.0;
  // The earlier of the two: a sphere that comes out beyond `radius` falls through it first.
  return std::min(firstTouch(way, radius, false),
                  firstTouch(way, std::sqrt(start.squaredDistance()), true));
}

double faceExitTime(const Vec3& halfExtents, const BoxPath& path, std::size_t face) noexcept {
  double soonest = kNever;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (axis == face / 2) continue;
    const Parabola parabola = parabolaOf(path, static_cast<Eigen::Index>(axis));
    const double half = halfExtents[static_cast<Eigen::Index>(axis)];
    for (const double side : {1.0, -1.0}) {
      const double room = half - side * parabola.place;
      soonest =
          std::min(soonest, planeContactTime(room, -side * parabola.speed, -side * parabola.pull));
    }
  }
  return soonest;
}

}  // namespace carom::native
