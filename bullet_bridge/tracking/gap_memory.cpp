#include "bullet_bridge/tracking/gap_memory.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace carom::bullet {
namespace {

constexpr std::size_t kFewest = 256;   // entries
constexpr std::size_t kSpare = 2;      // entries for each pair of a substep
constexpr double kMeasurement = 1e-9;  // error of a gap, relative to the size of the bodies

bool hasBody(const TrackedBody& body) {
  return body.shape == ContactShape::sphere ||
         (body.shape == ContactShape::other && !body.object->getCollisionShape()->isConcave());
}

bool isConvex(const TrackedBody& body) {
  return body.object->getCollisionShape()->isConvex();
}

std::uint32_t shapesOf(const ContactPair& pair) {
  return pair.body->shapeNumber + pair.other->shapeNumber;
}

Vec3 apartOf(const ContactPair& pair) {
  return pair.body->current.start - pair.other->current.start;
}

double ballsApart(const ContactPair& pair) {
  return apartOf(pair).norm() - pair.body->radius - pair.other->radius;
}

// Upper bound (m) of how much a pair comes nearer on its way, along a normal or, if that is zero,
// in any direction.
double closingOf(const ContactPair& pair, const Vec3& normal, double dt) {
  const Vec3 velocity = pair.body->current.velocityAfter - pair.other->current.velocityAfter;
  const Vec3 acceleration = pair.body->current.acceleration - pair.other->current.acceleration;
  const double turning = pair.body->turning + pair.other->turning;
  const double bulge = 0.5 * dt * dt * acceleration.norm();
  const double closing =
      normal.isZero(0.0) ? velocity.norm() : std::max(0.0, -velocity.dot(normal));
  return dt * closing + bulge + turning;
}

}  // namespace

void GapMemory::beginSubstep(std::size_t pairs) {
  const std::size_t wanted = std::bit_ceil(std::max(kFewest, kSpare * pairs));
  if (entries_.size() < wanted) entries_.assign(wanted, {});
}

// Fibonacci hashing (Knuth, The Art of Computer Programming 3, 6.4).
std::size_t GapMemory::placeOf(std::uint64_t key) const {
  const int unused = 64 - std::countr_zero(entries_.size());
  return static_cast<std::size_t>((key * 0x9E3779B97F4A7C15U) >> unused);
}

GapMemory::Gap GapMemory::of(const ContactPair& pair, double dt) const {
  const std::uint64_t key = pair.key();
  const Entry& entry = entries_[placeOf(key)];
  if (entry.key != key || entry.shapes != shapesOf(pair)) return {};
  const Vec3 moved = apartOf(pair) - entry.apart;
  const double nearer = entry.isAlongNormal ? -moved.dot(entry.normal) : moved.norm();
  const double turned = pair.body->turned + pair.other->turned - entry.turned;
  const double atStart = entry.gap - nearer - turned;
  const Vec3 direction = entry.isAlongNormal ? entry.normal : Vec3::Zero();
  return {atStart, atStart - closingOf(pair, direction, dt)};
}

// The normal is that of the whole only for two convex shapes.
void GapMemory::remember(const ContactPair& pair, const Proximity& start, double leftOut) {
  if (!(start.gap > 0.0) || !hasBody(*pair.body) || !hasBody(*pair.other)) return;
  Entry entry;
  entry.key = pair.key();
  entry.shapes = shapesOf(pair);
  entry.apart = apartOf(pair);
  entry.turned = pair.body->turned + pair.other->turned;
  entry.isAlongNormal = isConvex(*pair.body) && isConvex(*pair.other) && std::isfinite(start.gap);
  entry.gap = std::min(start.gap, leftOut);
  entry.normal = start.normal;
  const double balls = ballsApart(pair);
  if (balls > entry.gap) {
    entry.gap = balls;
    entry.normal = entry.apart.normalized();
    entry.isAlongNormal = true;
  }
  entry.gap -= kMeasurement * (pair.body->radius + pair.other->radius);
  entries_[placeOf(entry.key)] = entry;
}

}  // namespace carom::bullet
