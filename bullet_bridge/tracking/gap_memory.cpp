#include "bullet_bridge/tracking/gap_memory.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace carom::bullet {
namespace {

constexpr std::size_t kFewest = 256;   // entries
constexpr std::size_t kSpare = 2;      // entries for each pair of a substep
constexpr double kMeasurement = 1e-6;  // error of a gap, relative to the size of the bodies

bool hasBody(const TrackedBody& body) {
  return body.parts != nullptr && !body.parts->leaves.empty() && body.parts->concave.empty();
}

// Height (m) of the highest point of a piece along a unit direction, as it is collided by what
// takes it for largest; the direction is in the frame of the body.
double heightOf(const ConvexPiece& piece, const Vec3& direction) {
  const Vec3 own = piece.rotation().transpose() * direction;
  const double core = own.dot(piece.support(own)) + direction.dot(piece.offset());
  // Bullet takes boxes with sharp edges against boxes.
  const bool isBox = piece.core() == ConvexPiece::Core::box;
  return core + piece.margin() * (isBox ? own.lpNorm<1>() : 1.0);
}

// Height (m) of the highest point of a body above its centre, along a unit direction.
double heightOf(const TrackedBody& body, const Vec3& direction) {
  if (body.shape == ContactShape::sphere) return body.radius;
  const Vec3 own = body.current.orientation.conjugate() * direction;
  double highest = std::numeric_limits<double>::lowest();
  for (const ConvexPiece& piece : body.parts->pieces)
    highest = std::max(highest, heightOf(piece, own));
  return highest;
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

GapMemory::Gap GapMemory::measureAlong(const ContactPair& pair, double dt) {
  if (!hasBody(*pair.body) || !hasBody(*pair.other)) return {};
  const Vec3 apart = apartOf(pair);
  Gap best;
  for (const Vec3& normal : {directionOf(pair), Vec3(apart.normalized())}) {
    if (!(normal.squaredNorm() > 0.5)) continue;
    const double gap =
        apart.dot(normal) - heightOf(*pair.body, -normal) - heightOf(*pair.other, normal);
    const double least = gap - closingOf(pair, normal, dt);
    if (!(gap > 0.0) || !(least > best.least)) continue;
    rememberAlong(pair, normal, gap);
    best = of(pair, dt);
    if (least > 0.0) break;
  }
  return best;
}

Vec3 GapMemory::directionOf(const ContactPair& pair) const {
  const std::uint64_t key = pair.key();
  const Entry& entry = entries_[placeOf(key)];
  return entry.key == key && entry.isAlongNormal ? entry.normal : Vec3::Zero();
}

void GapMemory::setDirection(const ContactPair& pair, const Vec3& direction) {
  if (!hasBody(*pair.body) || !hasBody(*pair.other) || direction.isZero(0.0)) return;
  const double gap = apartOf(pair).dot(direction) - heightOf(*pair.body, -direction) -
                     heightOf(*pair.other, direction);
  rememberAlong(pair, direction, gap);
}

void GapMemory::rememberAlong(const ContactPair& pair, const Vec3& normal, double gap) {
  const double error = kMeasurement * (pair.body->radius + pair.other->radius);
  entries_[placeOf(pair.key())] = {.key = pair.key(),
                                   .shapes = shapesOf(pair),
                                   .isAlongNormal = true,
                                   .gap = gap - error,
                                   .turned = pair.body->turned + pair.other->turned,
                                   .apart = apartOf(pair),
                                   .normal = normal};
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
  entry.gap -= kMeasurement * (pair.body->radius + pair.other->radius);
  entries_[placeOf(entry.key)] = entry;
}

}  // namespace carom::bullet
