#pragma once

#include <span>
#include <vector>

#include "bullet_bridge/bodies/multibody_link.h"
#include "bullet_bridge/tracking/pair_motion.h"

namespace carom::bullet {

/// A point at which two bodies meet.
struct ContactPoint {
  Vec3 position = Vec3::Zero();  ///< m, world frame
  Vec3 normal = Vec3::UnitX();   ///< 1, world frame, towards the pair's `body`
  double approachSpeed = 0.0;    ///< m/s, at the first contact, > 0
  double delay = 0.0;            ///< s, from the first contact of the pair until this point lands
};

/// The sum over all points of one impact.
struct ImpactSolution {
  Vec3 impulse = Vec3::Zero();   ///< N s, world frame, on the pair's `body`
  Vec3 position = Vec3::Zero();  ///< m, world frame: mean of the points, weighted by impulse
  Vec3 normal = Vec3::UnitX();   ///< 1, world frame: direction of the impulse
  double approachSpeed = 0.0;    ///< m/s: mean of the points, weighted by impulse
  double effectiveMass = 0.0;    ///< kg: impulse / ((1 + e) approachSpeed)
};

/// The response of a pair to impulses at a given time. If a link of a multibody is one of the two,
/// `at` and `by` must be the same point.
class PairInertia {
 public:
  PairInertia(const PairMotion& motion, double s, MultibodyMass& multibodies);
  bool hasLink() const { return body_.link != nullptr || other_.link != nullptr; }
  /// Change (1/kg) of the approach speed at one point for a unit impulse at another.
  double between(const ContactPoint& at, const ContactPoint& by) const;

 private:
  struct Response {
    Vec3 centre = Vec3::Zero();
    Vec3 inverseMass = Vec3::Zero();                           ///< 1/kg, per world axis
    Eigen::Matrix3d inverseInertia = Eigen::Matrix3d::Zero();  ///< 1/(kg m^2), world frame
    const btMultiBodyLinkCollider* link = nullptr;             ///< responds through its joints
  };
  static Response responseOf(const TrackedBody& body, const RigidMotion& motion, double s);
  double response(const Response& body, const ContactPoint& at, const ContactPoint& by) const;

  Response body_, other_;
  MultibodyMass* multibodies_;
};

/// Newton's impact at one point or at several at once, without friction: every point ends at -e
/// times its approach speed or more, and no point pulls. For a single point,
///
///     j = (1 + e) m |vn|,   1/m = sum over both bodies of 1/m_i + (r x n) . I_i^-1 (r x n)
///
/// Several points make the linear complementarity problem of Stronge 2018 (Impact Mechanics,
/// chapter 5), solved by projected Gauss-Seidel. Links of multibodies are limited to one point.
class ImpactSolver {
 public:
  /// Returns the impulse of each point in N s; valid until the next call.
  std::span<const double> solve(std::span<const ContactPoint> points, const PairInertia& inertia,
                                double restitution);
  /// Returns one point in place of several, at their mean.
  static ContactPoint meanOf(std::span<const ContactPoint> points);
  /// Sums over some of those points; returns an ImpactSolution without impulse if they carry none.
  static ImpactSolution sum(std::span<const ContactPoint> points, std::span<const double> impulses,
                            double restitution);

 private:
  struct Sweep {
    double change = 0.0;   // N s, largest change of an impulse
    double largest = 0.0;  // N s, largest impulse
  };
  void shareEvenly(std::span<const ContactPoint> points, double restitution);
  Sweep sweep(std::span<const ContactPoint> points, double restitution);

  std::vector<double> matrix_;  // both kept for their memory
  std::vector<double> impulses_;
};

}  // namespace carom::bullet
