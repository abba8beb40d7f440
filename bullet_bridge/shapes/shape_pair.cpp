#include "bullet_bridge/shapes/shape_pair.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "bullet_bridge/geometry/impact_time.h"
#include "bullet_bridge/geometry/to_vec3.h"
#include "bullet_bridge/shapes/swept_triangles.h"

namespace carom::bullet {
namespace {

// Time (s) before an impact from which on the search ends, with a part of it left: where cores
// touch, no digits of their distance are left to tell their normal.
constexpr double kNearEnough = 1e-10;
constexpr double kPartLeft = 0.1;

using Core = ConvexPiece::Core;

double sizeOf(const PlacedPiece& piece) {
  return piece.piece->core() == Core::halfSpace ? 0.0 : piece.piece->ball();
}

// Centre of the ball around a piece.
Vec3 ballOf(const PlacedPiece& placed) {
  return placed.toWorld(placed.piece->ownBallCentre());
}

// Relative to the centre of the piece's body, in axes parallel to the world's.
PlacedPiece placedPiece(const ConvexPiece& piece, const Pose& pose) {
  if (!piece.isPlaced()) return {&piece, pose.rotation, Vec3::Zero()};
  return {&piece, pose.rotation * piece.rotation(), pose.rotation * piece.offset()};
}

CoreDistance moved(CoreDistance distance, const Vec3& by) {
  distance.distance -= distance.normal.dot(by);
  distance.point -= by;
  return distance;
}

// Points of a core that its nearest point lies between.
struct Feature {
  int points = 0;
  Vec3 edge = Vec3::Zero();  // from one to another, in the frame of the piece

  Feature(const NearestCorners& corners, Vec3 NearestCorners::Corner::*side) {
    for (std::size_t i = 0; i < corners.count; ++i) {
      const Vec3& point = corners.corners[i].*side;
      bool isNew = true;
      for (std::size_t before = 0; before < i; ++before)
        isNew = isNew && corners.corners[before].*side != point;
      if (isNew && points > 0) edge = point - corners.corners[0].*side;
      points += isNew ? 1 : 0;
    }
  }
};

// Returns the angular velocity (rad/s) with which the normal of the nearest features turns: that of
// the body that has a face there; otherwise the one that keeps the normal perpendicular to an edge
// of one or of each.
Vec3 turningWithFeatures(const NearestCorners& corners, const SeparationBound::Pieces& pieces,
                         const Vec3& normal) {
  constexpr double kParallel = 0.05;
  const Feature feature(corners, &NearestCorners::Corner::body);
  const Feature otherFeature(corners, &NearestCorners::Corner::other);
  if (otherFeature.points > 2) return pieces.other.angularVelocity;
  if (feature.points > 2) return pieces.body.angularVelocity;
  const Vec3 edge = pieces.body.piece.rotation * feature.edge;
  const Vec3 otherEdge = pieces.other.piece.rotation * otherFeature.edge;
  // The speed along each edge at which the normal's end must move.
  const double along = -normal.dot(pieces.body.angularVelocity.cross(edge));
  const double alongOther = -normal.dot(pieces.other.angularVelocity.cross(otherEdge));
  const double across = normal.dot(edge.cross(otherEdge));
  Vec3 change = Vec3::Zero();
  if (std::abs(across) > kParallel * edge.norm() * otherEdge.norm())
    change = (along * otherEdge.cross(normal) + alongOther * normal.cross(edge)) / across;
  else if (feature.points == 2)
    change = (along / edge.squaredNorm()) * edge;
  else if (otherFeature.points == 2)
    change = (alongOther / otherEdge.squaredNorm()) * otherEdge;
  return normal.cross(change);
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
    side->turn = std::min(side->moving.motion.angularVelocity.norm() * horizon, 2.0);
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
  const Motion relative = body.motion.centre - other.motion.centre;
  travel_ = horizon * (relative.velocity.norm() + 0.5 * horizon * relative.acceleration.norm());
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
    pairs_.push_back(pairOf(leaf.piece, index, flipped));
  });
}

ShapePair::Pair ShapePair::pairOf(std::uint32_t first, std::uint32_t second, bool flipped) {
  Pair pair;
  pair.first = first;
  pair.second = second;
  pair.flipped = flipped;
  return pair;
}

void ShapePair::addPair(std::uint32_t first, std::uint32_t second, bool flipped) {
  const Pair pair = pairOf(first, second, flipped);
  if (mayMeet(pair)) pairs_.push_back(pair);
}

// Returns how far (m) what is as far as that from the centres of the two bodies may come towards
// each other.
double ShapePair::travelOf(const Pair& pair, double reach, double otherReach) const {
  return travel_ + firstOf(pair).turn * reach + secondOf(pair).turn * otherReach;
}

// Tests the balls around the pieces.
bool ShapePair::mayMeet(const Pair& pair) {
  const Side& first = firstOf(pair);
  const Side& second = secondOf(pair);
  const Placed placed = place(pair, 0.0);
  const bool onHalfSpace = second.pieces[pair.second].core() == Core::halfSpace;
  const Vec3& centre = onHalfSpace ? placed.centres : second.pieces[pair.second].ballCentre();
  const double travel = travelOf(pair, first.pieces[pair.first].ballCentre().norm(), centre.norm());
  const double gap = ballGap(placed);
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
  Placed placed;
  placed.origin = first.poseAt(s).position;
  placed.centres = (first.moving.motion.centre - second.moving.motion.centre).positionAt(s);
  placed.first = placedPiece(first.pieces[pair.first], first.poseAt(s));
  placed.second = placedPiece(second.pieces[pair.second], second.poseAt(s));
  placed.second.position -= placed.centres;
  return placed;
}

// Returns the normal of the second piece towards the first if that is a triangle, otherwise zero.
Vec3 ShapePair::faceTowards(const Placed& placed) {
  if (placed.second.piece->core() != Core::triangle) return Vec3::Zero();
  const Vec3 normal = placed.second.rotation * placed.second.piece->planeNormal();
  const bool isAbove = normal.dot(ballOf(placed.first) - ballOf(placed.second)) >= 0.0;
  return isAbove ? normal : Vec3(-normal);
}

// A lower bound of the gap from the balls around the pieces.
double ShapePair::ballGap(const Placed& placed) {
  const ConvexPiece& piece = *placed.first.piece;
  const ConvexPiece& against = *placed.second.piece;
  const Vec3 centre = ballOf(placed.first);
  if (against.core() == Core::halfSpace) {
    const Vec3 normal = placed.second.rotation * against.planeNormal();
    return normal.dot(centre - placed.second.position) - against.planeConstant() - piece.ball();
  }
  return (centre - ballOf(placed.second)).norm() - piece.ball() - against.ball();
}

// A lower bound of the gap from balls and, of a triangle, from its plane.
double ShapePair::leastGap(const Placed& placed) {
  const double gap = ballGap(placed);
  const Vec3 normal = faceTowards(placed);
  if (normal.isZero(0.0)) return gap;
  const ConvexPiece& piece = *placed.first.piece;
  const ConvexPiece& against = *placed.second.piece;
  const double height =
      normal.dot(placed.first.support(-normal) - placed.second.toWorld(against.anyCorner()));
  return std::max(gap, height - piece.margin() - against.margin());
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

// Puts the pieces first whose bounds are least: most of the others need not be looked at then.
void ShapePair::orderByBounds(double s) {
  order_.clear();
  const bool isAlone = pairs_.size() == 1;
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    const double least = isAlone ? -kNever : leastGap(place(pairs_[i], s));
    pairs_[i].least = std::isnan(least) ? -kNever : least;
    order_.push_back(i);
  }
  std::ranges::sort(order_, {}, [this](std::size_t i) { return std::pair(pairs_[i].least, i); });
}

Proximity ShapePair::proximityAt(double s) {
  orderByBounds(s);
  Proximity nearest;
  nearest.gap = kNever;
  for (const std::size_t i : order_) {
    Pair& pair = pairs_[i];
    if (!(pair.least < nearest.gap)) break;
    Proximity proximity = proximityOf(pair, place(pair, s), nearest.gap);
    proximity.pair = i;
    pair.least = std::min(proximity.gap, nearest.gap);
    if (proximity.gap < nearest.gap) nearest = proximity;
  }
  if (s == 0.0) {
    for (Pair& pair : pairs_)
      pair.apart = pair.least;
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

SeparationBound::Pieces ShapePair::piecesAt(const Pair& pair, const Placed& placed,
                                            double s) const {
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
    const Clear clear = clearTime(pair, piecesAt(pair, placed, s), left);
    if (!(clear.until < left)) return kNever;
    if (clear.latest < kNearEnough) return s + (1.0 - kPartLeft) * clear.until;
    s += std::max(clear.until - 0.5 * kNearEnough, 0.5 * clear.until);
  }
  return searchImpact(pair, s, horizon);
}

// Returns how long two pieces stay apart, along the direction that lasts longest of those that fit:
// one that turns with the features which are nearest, one that keeps still, and those that turn
// with either body.
ShapePair::Clear ShapePair::clearTime(const Pair& pair, const SeparationBound::Pieces& pieces,
                                      double left) {
  constexpr double kGood = 0.7;  // of what the two nearest points would need to meet
  if (pieces.other.piece.piece->core() == Core::halfSpace)
    return SeparationBound(pieces, {pair.axis}, left).clearTime(left);
  Clear best;
  const std::array<Vec3, 4> turnings{turningWithFeatures(pair.corners, pieces, pair.axis),
                                     Vec3::Zero(), pieces.other.angularVelocity,
                                     pieces.body.angularVelocity};
  for (std::size_t i = 0; i < turnings.size(); ++i) {
    if (i > 0 && turnings[i] == turnings[0]) continue;
    const Clear clear = SeparationBound(pieces, {pair.axis, turnings[i]}, left).clearTime(left);
    if (i == 0 || clear.until > best.until) best = clear;
    if (!(best.until < std::min(left, kGood * best.nearest))) break;
  }
  return best;
}

// True if two pieces surely do not meet: they are too far apart, or stay apart along the direction
// in which they were when that was looked at last, or along a triangle's normal, or from centre to
// centre. A half space's own normal is found at once.
bool ShapePair::clearsAlong(const Pair& pair, double horizon) const {
  const ConvexPiece& piece = firstOf(pair).pieces[pair.first];
  const ConvexPiece& against = secondOf(pair).pieces[pair.second];
  if (against.core() == Core::halfSpace) return false;
  const Placed placed = place(pair, 0.0);
  const double apart = pair.apart > 0.0 ? pair.apart : leastGap(placed);
  if (apart > travelOf(pair, piece.coreReach(), against.coreReach())) return true;
  Vec3 direction = pair.axis;
  if (direction.isZero(0.0)) direction = faceTowards(placed);
  if (direction.isZero(0.0))
    direction = Vec3(ballOf(placed.first) - ballOf(placed.second)).normalized();
  return SeparationBound(piecesAt(pair, placed, 0.0), {direction}, horizon).isClear(horizon);
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
