#include "bullet_bridge/shapes/shape_pair.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bullet_bridge/geometry/impact_time.h"
#include "bullet_bridge/geometry/to_vec3.h"
#include "bullet_bridge/shapes/swept_triangles.h"

namespace carom::bullet {
namespace {

// Remaining time (s) to an impact that is taken in one step.
constexpr double kNearEnough = 1e-10;

using Core = ConvexPiece::Core;

// Distance (m) by which rotation may move the centre of a piece's ball off the straight path of its
// body.
double turnOf(const MovingShape& moving, const Vec3& centre, double horizon) {
  return std::min(moving.motion.angularVelocity.norm() * horizon, 2.0) * centre.norm();
}

double sizeOf(const PlacedPiece& piece) {
  return piece.piece->core() == Core::halfSpace ? 0.0 : piece.piece->ball();
}

CoreDistance moved(CoreDistance distance, const Vec3& by) {
  distance.distance -= distance.normal.dot(by);
  distance.point -= by;
  return distance;
}

// Distance and normal of cores that touch or overlap, taken from a copy of the first that is moved
// just out of the second; the farther, the less exact. Begins along the given direction.
CoreDistance backedOff(const PlacedPiece& first, const PlacedPiece& second, Vec3 way) {
  constexpr int kAttempts = 6;
  constexpr double kSameWay = 0.999;
  const double size = sizeOf(first) + sizeOf(second);
  CoreDistance found;
  found.normal = way;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    const double depth = way.dot(second.support(way) - first.support(-way));
    const double step = 1.01 * std::max(depth, 0.0) + 1e-6 * size;
    PlacedPiece away = first;
    away.position += step * way;
    const CoreDistance distance = coreDistance(away, second, way);
    if (!(distance.distance > 0.0)) break;
    found = moved(distance, step * way);
    if (found.normal.dot(way) > kSameWay) break;
    way = found.normal;
  }
  return found;
}

}  // namespace

bool ShapePair::set(const MovingShape& body, const MovingShape& other, double horizon,
                    double reach) {
  horizon_ = horizon;
  reach_ = reach;
  leftOut_ = kNever;
  pairs_.clear();
  for (Side* side : {&body_, &other_}) {
    side->moving = side == &body_ ? body : other;
    side->posedAt = kNever;
    if (side->moving.parts != nullptr)
      static_cast<ShapeParts&>(*side) = *side->moving.parts;
    else
      side->read(*side->moving.shape);
  }
  const auto isPlane = [](const Leaf& leaf) { return leaf.type == STATIC_PLANE_PROXYTYPE; };
  const auto hasConvex = [&](const Side& side) {
    return !std::all_of(side.leaves.begin(), side.leaves.end(), isPlane);
  };
  const auto hasAny = [](const Side& side) {
    return !side.leaves.empty() || !side.concave.empty();
  };
  pairConvex();
  pairConcave(body_, other_, false);
  pairConcave(other_, body_, true);
  return (hasConvex(body_) && hasAny(other_)) || (hasConvex(other_) && hasAny(body_));
}

// Returns the piece in the form in which Bullet collides it with that other leaf.
std::uint32_t ShapePair::variantAgainst(Side& side, Leaf& leaf, const Leaf& against) {
  const ConvexPiece& piece = side.pieces[leaf.piece];
  const bool isBox = leaf.type == BOX_SHAPE_PROXYTYPE;
  const bool onPlane = against.type == STATIC_PLANE_PROXYTYPE;
  const bool sharp =
      piece.core() == Core::box && (onPlane || (isBox && against.type == BOX_SHAPE_PROXYTYPE));
  // Bullet's detector of spheres and triangles ignores the triangle's margin.
  const bool bare =
      (!isBox && leaf.polyhedron && against.polyhedron) ||
      (leaf.type == TRIANGLE_SHAPE_PROXYTYPE && against.type == SPHERE_SHAPE_PROXYTYPE);
  if (!sharp && !bare) return leaf.piece;
  if (leaf.variant == leaf.piece) {
    leaf.variant = static_cast<std::uint32_t>(side.pieces.size());
    ConvexPiece variant = sharp ? piece.withSharpEdges() : piece;
    variant.setMargin(0.0);
    side.pieces.push_back(variant);
  }
  return leaf.variant;
}

void ShapePair::pairConvex() {
  for (Leaf& leaf : body_.leaves) {
    for (Leaf& against : other_.leaves) {
      const bool onPlane = against.type == STATIC_PLANE_PROXYTYPE;
      const bool isPlane = leaf.type == STATIC_PLANE_PROXYTYPE;
      if (onPlane && isPlane) continue;
      const std::uint32_t piece = variantAgainst(body_, leaf, against);
      const std::uint32_t otherPiece = variantAgainst(other_, against, leaf);
      if (isPlane) {
        addPair(otherPiece, piece, true);
      } else {
        addPair(piece, otherPiece, false);
      }
    }
  }
}

void ShapePair::pairConcave(Side& convex, Side& concave, bool flipped) {
  for (const ConcaveLeaf& mesh : concave.concave) {
    for (const Leaf& leaf : convex.leaves) {
      if (leaf.type != STATIC_PLANE_PROXYTYPE) pairTriangles(convex, leaf, concave, mesh, flipped);
    }
  }
}

void ShapePair::pairTriangles(Side& convex, const Leaf& leaf, Side& concave,
                              const ConcaveLeaf& mesh, bool flipped) {
  const bool isSphere = leaf.type == SPHERE_SHAPE_PROXYTYPE;
  const double margin = isSphere ? 0.0 : static_cast<double>(mesh.shape->getMargin());
  const MeshFrameBox box = meshFrameBox(convex.pieces[leaf.piece], convex.moving.motion,
                                        concave.moving.motion, mesh.rotation, mesh.offset, horizon_)
                               .grownBy(margin + reach_);
  forEachTriangle(*mesh.shape, box, [&](const std::array<Vec3, 3>& corners) {
    // Bullet's detector of spheres ignores triangles of no area.
    const double area = (corners[1] - corners[0]).cross(corners[2] - corners[0]).norm();
    if (isSphere && area < static_cast<double>(SIMD_EPSILON)) return;
    const auto index = static_cast<std::uint32_t>(concave.pieces.size());
    concave.pieces.push_back(ConvexPiece::from(corners, margin));
    concave.pieces.back().place(mesh.rotation, mesh.offset);
    addPair(leaf.piece, index, flipped);
  });
}

void ShapePair::addPair(std::uint32_t first, std::uint32_t second, bool flipped) {
  Pair pair;
  pair.first = first;
  pair.second = second;
  pair.flipped = flipped;
  if (mayMeet(pair)) pairs_.push_back(pair);
}

// Tests the balls around the pieces.
bool ShapePair::mayMeet(const Pair& pair) {
  const Side& first = firstOf(pair);
  const Side& second = secondOf(pair);
  const Placed placed = place(pair, 0.0);
  const Motion relative = first.moving.motion.centre - second.moving.motion.centre;
  double travel =
      horizon_ * (relative.velocity.norm() + 0.5 * horizon_ * relative.acceleration.norm()) +
      turnOf(first.moving, first.pieces[pair.first].ballCentre(), horizon_);
  if (second.pieces[pair.second].core() == Core::halfSpace) {
    travel += turnOf(second.moving, placed.centres, horizon_);
  } else {
    travel += turnOf(second.moving, second.pieces[pair.second].ballCentre(), horizon_);
  }
  const double gap = leastGap(placed);
  if (!(gap > travel + reach_)) return true;
  leftOut_ = std::min(leftOut_, gap);
  return false;
}

const Pose& ShapePair::Side::poseAt(double s) const {
  if (posedAt != s) pose = moving.motion.poseAt(s);
  posedAt = s;
  return pose;
}

ShapePair::Placed ShapePair::place(const Pair& pair, double s) const {
  const Side& first = firstOf(pair);
  const Side& second = secondOf(pair);
  const Pose& pose = first.poseAt(s);
  const Pose& secondPose = second.poseAt(s);
  const ConvexPiece& piece = first.pieces[pair.first];
  const ConvexPiece& against = second.pieces[pair.second];
  Placed placed;
  placed.origin = pose.position;
  placed.centres = (first.moving.motion.centre - second.moving.motion.centre).positionAt(s);
  placed.first = {&piece, pose.rotation * piece.rotation(), pose.rotation * piece.offset()};
  placed.second = {&against, secondPose.rotation * against.rotation(),
                   secondPose.rotation * against.offset() - placed.centres};
  return placed;
}

// Centre of the ball around a piece. place() rotates the piece's own frame, but the ball's centre
// is in the body's frame: it is taken back first.
Vec3 ShapePair::ballOf(const PlacedPiece& placed) {
  const ConvexPiece& piece = *placed.piece;
  return placed.position +
         placed.rotation * (piece.rotation().transpose() * (piece.ballCentre() - piece.offset()));
}

// Lower bound (m) of the gap, from the balls around the pieces.
double ShapePair::leastGap(const Placed& placed) {
  const ConvexPiece& piece = *placed.first.piece;
  const ConvexPiece& against = *placed.second.piece;
  const Vec3 centre = ballOf(placed.first);
  if (against.core() == Core::halfSpace) {
    const Vec3 normal = placed.second.rotation * against.planeNormal();
    return normal.dot(centre - placed.second.position) - against.planeConstant() - piece.ball();
  }
  return (centre - ballOf(placed.second)).norm() - piece.ball() - against.ball();
}

double ShapePair::gapAt(Pair& pair, double s) {
  const Placed placed = place(pair, s);
  return proximityOf(pair, placed, kNever).gap;
}

Proximity ShapePair::proximityOf(Pair& pair, const Placed& placed, double enough) {
  const double margin = placed.first.piece->margin();
  const double otherMargin = placed.second.piece->margin();
  if (pair.axis.isZero(0.0)) pair.axis = ballOf(placed.first) - ballOf(placed.second);
  if (!(pair.axis.squaredNorm() > 0.0)) pair.axis = Vec3::UnitY();
  CoreDistance found = coreDistance(
      placed.first, placed.second,
      {.guess = pair.axis, .corners = &pair.corners, .farthest = enough + margin + otherMargin});
  const double size = sizeOf(placed.first) + sizeOf(placed.second);
  double distance = found.distance;
  if (placed.second.piece->core() != Core::halfSpace && !(distance > 1e-9 * size)) {
    found = backedOff(placed.first, placed.second, pair.axis.normalized());
    distance = distance > 0.0 ? distance : std::min(found.distance, 0.0);
  }
  pair.axis = found.normal;
  Proximity proximity;
  proximity.gap = distance - margin - otherMargin;
  proximity.normal = found.normal;
  proximity.point = placed.origin + found.point - margin * found.normal;
  proximity.otherPoint = placed.origin + found.otherPoint + otherMargin * found.normal;
  if (pair.flipped) {
    proximity.normal = -proximity.normal;
    std::swap(proximity.point, proximity.otherPoint);
  }
  return proximity;
}

Proximity ShapePair::proximityAt(double s) {
  Proximity nearest;
  nearest.gap = kNever;
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    const Placed placed = place(pairs_[i], s);
    if (leastGap(placed) > nearest.gap) continue;
    Proximity proximity = proximityOf(pairs_[i], placed, nearest.gap);
    proximity.pair = i;
    if (proximity.gap < nearest.gap) nearest = proximity;
  }
  return nearest;
}

void ShapePair::guess(const Vec3& direction) {
  for (Pair& pair : pairs_)
    pair.axis = pair.flipped ? Vec3(-direction) : direction;
}

Vec3 ShapePair::direction() const {
  if (pairs_.empty()) return Vec3::Zero();
  return pairs_.front().flipped ? Vec3(-pairs_.front().axis) : pairs_.front().axis;
}

double ShapePair::impactTime() {
  double earliest = kNever;
  for (Pair& pair : pairs_)
    earliest = std::min(earliest, impactTime(pair, std::min(earliest, horizon_)));
  return earliest;
}

ShapePair::Relative ShapePair::relativeAt(const Pair& pair, const Placed& placed, double s) const {
  const RigidMotion& first = firstOf(pair).moving.motion;
  const RigidMotion& second = secondOf(pair).moving.motion;
  const Motion centres = first.centre - second.centre;
  PlacedPiece own = placed.second;
  own.position += placed.centres;
  return {{placed.first, first.angularVelocity},
          {own, second.angularVelocity},
          {placed.centres, centres.velocityAt(s), centres.acceleration}};
}

// The bounds hold along any direction: one that is nearly the normal will do.
CoreDistance ShapePair::nearDistance(Pair& pair, const Placed& placed) {
  constexpr double kGapTolerance = 0.02;
  return coreDistance(
      placed.first, placed.second,
      {.guess = pair.axis, .gapTolerance = kGapTolerance, .corners = &pair.corners});
}

double ShapePair::impactTime(Pair& pair, double horizon) {
  constexpr int kMaxSteps = 100;
  constexpr int kSteadySteps = 1;
  double s = 0.0;
  if (clearsAlong(pair, horizon)) return kNever;
  if (pair.axis.isZero(0.0)) pair.axis = Vec3::UnitY();
  for (int step = 0; step < kMaxSteps; ++step) {
    const Placed placed = place(pair, s);
    const CoreDistance distance = nearDistance(pair, placed);
    const double gap =
        distance.distance - placed.first.piece->margin() - placed.second.piece->margin();
    if (std::isnan(gap)) return kNever;
    const double size = sizeOf(placed.first) + sizeOf(placed.second);
    if (gap <= 4.0 * std::numeric_limits<double>::epsilon() * size) return s;
    pair.axis = distance.normal;
    const double left = horizon - s;
    const Clear clear =
        clearTime(relativeAt(pair, placed, s), pair.axis, left, step >= kSteadySteps);
    if (!(clear.until < left)) return kNever;
    if (clear.estimated < kNearEnough) return s + clear.until;
    s += clear.until;
  }
  return searchImpact(pair, s, horizon);
}

// Returns how long two pieces stay apart. If `turning`, directions are tried that turn with one of
// the bodies, too: where a face of it slides, rolls or rocks close to contact, they stay clear
// longest, and lead to an impact in the fewest steps.
ShapePair::Clear ShapePair::clearTime(const Relative& relative, const Vec3& normal, double left,
                                      bool turning) {
  constexpr double kGood = 0.7;  // of what the two nearest points would need to meet
  const auto& [first, second, centres] = relative;
  Clear best = SeparationBound(first, second, centres, normal, left).clearTime(left);
  if (!turning || second.piece.piece->core() == Core::halfSpace) return best;
  const auto keepLonger = [&](const SeparationBound& bound) {
    const Clear clear = bound.clearTime(left);
    if (clear.until > best.until) best = clear;
  };
  if (best.until < std::min(left, kGood * best.estimated))
    keepLonger(SeparationBound::turningWithOther(first, second, centres, normal, left));
  if (best.until < std::min(left, kGood * best.estimated))
    keepLonger(SeparationBound::turningWithOther(second, first, Motion{} - centres, -normal, left));
  return best;
}

// True if two pieces surely do not meet, by the direction in which they were apart when that was
// looked at last, or from centre to centre. A half space's own normal is found at once.
bool ShapePair::clearsAlong(const Pair& pair, double horizon) const {
  if (secondOf(pair).pieces[pair.second].core() == Core::halfSpace) return false;
  const Placed placed = place(pair, 0.0);
  const Vec3 direction = pair.axis.isZero(0.0)
                             ? Vec3(ballOf(placed.first) - ballOf(placed.second)).normalized()
                             : pair.axis;
  const auto [first, second, centres] = relativeAt(pair, placed, 0.0);
  return SeparationBound(first, second, centres, direction, horizon).isClear(horizon);
}

// Searches for the impact that advancement could not settle, of a pair that slides within rounding
// of contact.
double ShapePair::searchImpact(Pair& pair, double from, double horizon) {
  constexpr int kPieces = 64;
  double low = from;
  for (int piece = 1; piece <= kPieces; ++piece) {
    double high = from + (horizon - from) * piece / kPieces;
    if (gapAt(pair, high) > 0.0) {
      low = high;
      continue;
    }
    for (double middle = 0.5 * (low + high); low < middle && middle < high;
         middle = 0.5 * (low + high)) {
      (gapAt(pair, middle) > 0.0 ? low : high) = middle;
    }
    return high;
  }
  return kNever;
}

// Appends the corners of one piece that are near the other, the farthest out if there are many.
void ShapePair::appendPatch(const PlacedPiece& of, const PlacedPiece& on, const Vec3& towards,
                            double depth) {
  if (of.piece->core() == Core::halfSpace) return;
  corners_.clear();
  of.piece->appendCorners(of.rotation.transpose() * towards, depth, corners_);
  const double margins = of.piece->margin() + on.piece->margin();
  ConvexPiece point;
  const auto tooFar = [&](Vec3& corner) {
    corner = of.position + of.rotation * corner;
    const PlacedPiece placed{&point, Eigen::Matrix3d::Identity(), corner};
    const bool far = coreDistance(placed, on, -towards).distance - margins > depth;
    corner += of.piece->margin() * towards;
    return far;
  };
  corners_.erase(std::remove_if(corners_.begin(), corners_.end(), tooFar), corners_.end());
  if (corners_.size() <= kPatchPoints) {
    patch_.insert(patch_.end(), corners_.begin(), corners_.end());
    return;
  }
  const Vec3 across = towards.unitOrthogonal();
  const Vec3 beside = towards.cross(across);
  for (std::size_t i = 0; i < kPatchPoints; ++i) {
    const double angle = 2.0 * 3.14159265358979323846 * static_cast<double>(i) / kPatchPoints;
    const Vec3 way = std::cos(angle) * across + std::sin(angle) * beside;
    const Vec3 extreme =
        *std::max_element(corners_.begin(), corners_.end(),
                          [&](const Vec3& a, const Vec3& b) { return way.dot(a) < way.dot(b); });
    if (std::find(patch_.begin(), patch_.end(), extreme) == patch_.end()) {
      patch_.push_back(extreme);
    }
  }
}

std::span<const Vec3> ShapePair::patchAt(double s, const Proximity& around, double depth) {
  patch_.clear();
  for (Pair& pair : pairs_) {
    const Placed placed = place(pair, s);
    if (leastGap(placed) > depth) continue;
    const Vec3 normal = pair.flipped ? Vec3(-around.normal) : around.normal;
    const std::size_t first = patch_.size();
    appendPatch(placed.first, placed.second, -normal, depth);
    appendPatch(placed.second, placed.first, normal, depth);
    for (std::size_t i = first; i < patch_.size(); ++i)
      patch_[i] += placed.origin;
  }
  return patch_;
}

LocalShape ShapePair::localShape(PairSide side, double s, const Proximity& at) const {
  constexpr double kFlat = std::numeric_limits<double>::infinity();
  if (at.pair >= pairs_.size()) return {kFlat, kFlat};  // nothing near
  const Pair& pair = pairs_[at.pair];
  const Placed placed = place(pair, s);
  const bool isFirst = (side == PairSide::body) != pair.flipped;
  const PlacedPiece& piece = isFirst ? placed.first : placed.second;
  const Vec3 outwards = side == PairSide::body ? Vec3(-at.normal) : at.normal;
  LocalShape shape = piece.piece->shapeFacing(piece.rotation.transpose() * outwards);
  shape.rimAxis = piece.rotation * shape.rimAxis;
  return shape;
}

}  // namespace carom::bullet
