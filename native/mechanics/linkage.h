#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "carom/native/motion.h"
#include "carom/native/sphere_world.h"

namespace carom::native {

/// Angle (rad) by which a group's fastest motion turns in one step, unless SphereWorld::forceStep
/// says otherwise: a spring's frequency is then off by 1.0e-6. The fastest motion is estimated at
/// the start; motion that fields make faster later is not known then, but rods that turn faster
/// shorten their steps.
inline constexpr double kForceStepAngle = 0.005;

/// Angle (rad) by which what a taut rod holds may swing across it in one step, at most: its
/// frequency is then off by 1.7e-5.
inline constexpr double kTautStepAngle = 0.02;

/// Springs, rods, fields and drag, which bend the paths of spheres between their contacts. Spheres
/// that springs and rods connect form a group, which is stepped together; where there are fields or
/// drag, every other sphere is a group of its own. Spheres without any of these are in no group.
///
/// Method. In each step the acceleration of a sphere is constant, so its path is a parabola and its
/// contacts are in closed form as everywhere. The acceleration is that of the forces at the middle
/// of the step, x + v h / 2: position Verlet, which is of second order, reversible, and keeps
/// energy without drift (Hairer, Lubich, Wanner 2003, Acta Numerica 12, 399, eq. 1.6). A contact
/// begins a new step of the whole group. A spring's frequency w is off by (w h)^2 / 24. The forces
/// of rods act along their directions at the middle too, and are such that every rod has its length
/// at the end: a position Verlet with the constraints of SHAKE (Ryckaert, Ciccotti, Berendsen 1977,
/// J. Comput. Phys. 23, 327). Within the step a rod that turns at w is off its length by (w h)^4 /
/// 32 of it. Drag and dampers act at the velocity at the middle.
///
/// Taut rods. A sphere of mass m on rods of length L under a tension T moves across them as a bead
/// on a string, at w = sqrt(sum T / (m L)), which no rate above foresees: a light sphere between
/// two heavy ones that pull its rods straight is thrown across within a moment. So the tensions are
/// solved for first, and the step is halved until w h is at most kTautStepAngle for each sphere and
/// every rod has its length. (Position Verlet is unstable from w h = 2 on.)
///
/// Internal to native/. [any thread]
class Linkage {
 public:
  static constexpr std::uint32_t kNoGroup = 0xFFFFFFFF;

  /// `ids` are those of the spheres, ascending; spheres are numbered in this order.
  Linkage(const SphereWorld& world, std::span<const BodyId> ids);

  std::size_t groupCount() const { return groups_.size(); }
  /// Group of the sphere; kNoGroup for a free sphere.
  std::uint32_t groupOf(std::size_t sphere) const {
    return groupOf_.empty() ? kNoGroup : groupOf_[sphere];
  }
  bool hasRods(std::size_t sphere) const {
    return groupOf(sphere) != kNoGroup && !groups_[groupOf(sphere)].rods.empty();
  }
  std::span<const std::uint32_t> members(std::uint32_t group) const {
    return groups_[group].spheres;
  }
  struct Step {
    double duration = 0.0;            ///< s
    std::vector<Vec3> accelerations;  ///< m/s^2, of the group's members
  };
  /// Returns the group's step that begins with `motions` (all at one instant).
  Step step(std::uint32_t group, std::span<const Motion> motions) const;
  /// Changes (m/s) of the members' velocities by impulses (N s, one per member): rods cancel any
  /// rate of change of their lengths. Only the positions of `motions` matter.
  std::vector<Vec3> response(std::uint32_t group, std::span<const Motion> motions,
                             std::span<const Vec3> impulses) const;
  /// Energy in J of the springs and fields.
  double potentialEnergy(std::uint32_t group, std::span<const Motion> motions) const;

 private:
  static constexpr std::uint32_t kFixed = 0xFFFFFFFF;

  /// The ends of a joint: two members, or one and a fixed point.
  struct Ends {
    std::uint32_t one = 0;  ///< index of a member in its group
    std::uint32_t other = kFixed;
    Vec3 anchor = Vec3::Zero();
  };
  struct Coil {
    Ends ends;
    Spring spring;
  };
  struct Bar {
    Ends ends;
    double square = 0.0;  ///< m^2, the squared length
  };
  struct Group {
    std::vector<std::uint32_t> spheres;  ///< ascending
    std::vector<double> masses;          ///< kg, by sphere of the group
    std::vector<Coil> springs;
    std::vector<Bar> rods;
    double step = 0.0;  ///< s, the longest step
  };

  /// The forces of a group's rods over a step, and how far these are from the truth.
  struct RodPull {
    std::vector<double> forces;  ///< N, by rod; positive drives its ends apart
    double error = 0.0;          ///< largest of a squared length at the end, relative to it
  };

  /// Vector in m from the other end to the first.
  static Vec3 between(const Ends& ends, std::span<const Vec3> positions);
  static double inverseMass(const Group& group, const Ends& ends);
  /// Directions by rod: along `seen` its change is measured, along `directions` a push acts.
  struct RodAxes {
    std::span<const Vec3> seen;
    std::span<const Vec3> directions;
  };
  static void pushRods(const Group& group, const RodAxes& axes, std::vector<double>& changes,
                       std::vector<Vec3>& pushed);
  static double coupling(const Group& group, const Ends& one, const Ends& other);
  static void push(const Group& group, const Ends& ends, const Vec3& force,
                   std::vector<Vec3>& changes);
  void connect(const SphereWorld& world, std::span<const BodyId> ids);
  double stepOf(const SphereWorld& world, const Group& group,
                std::span<const Motion> motions) const;
  Vec3 fieldAt(const Vec3& position) const;
  static double turningRate(const Bar& rod, std::span<const Motion> motions);
  double longestStep(const Group& group, std::span<const Motion> motions) const;
  std::vector<Vec3> accelerations(const Group& group, std::span<const Motion> motions,
                                  double step) const;
  bool holdRods(const Group& group, std::span<const Motion> motions, Step& step) const;
  static double tautness(const Group& group, std::span<const double> tensions);
  /// Both act over a step of `step` s.
  static void damp(const Group& group, double step, std::span<const Vec3> middles,
                   std::span<const Vec3> velocities, std::vector<Vec3>& pulls);
  static RodPull pullByRods(const Group& group, double step, std::span<const Motion> motions,
                            std::vector<Vec3>& pulls);

  std::vector<std::uint32_t> groupOf_;  ///< by sphere; empty if there are no groups
  std::vector<Group> groups_;
  std::vector<ForceField> fields_;
  Drag drag_;
  Vec3 gravity_;
  bool stepGiven_ = false;  ///< true if SphereWorld::forceStep sets the step
};

}  // namespace carom::native
