#pragma once

#include <optional>
#include <vector>

#include "carom/audio/vector.h"
#include "tests/bench/reference_shape.h"

class btRigidBody;

namespace carom::bench {

/// The path of a body within one substep of Bullet and beyond it: a parabola with steady rotation.
struct BodyPath {
  Vec3 position = Vec3::Zero();      ///< m, at the start
  Vec3 velocity = Vec3::Zero();      ///< m/s, at the start
  Vec3 acceleration = Vec3::Zero();  ///< m/s^2
  Quat orientation = Quat::Identity();
  Vec3 angularVelocity = Vec3::Zero();  ///< rad/s

  Placement at(double time) const;
};

struct ReferenceImpact {
  double time = 0.0;     ///< s
  double impulse = 0.0;  ///< N s, magnitude
  double speed = 0.0;    ///< m/s, speed of approach
  double mass = 0.0;     ///< kg, effective mass
  double node = 0.0;     ///< s, time of the node before it
  bool ahead = false;    ///< true for a speculative contact
};

/// The exact impacts of one pair of bodies on the path that Bullet takes.
///
/// The class knows the bodies' states at Bullet's nodes, their masses, and the law by which Bullet
/// moves them from node to node: x0 + (w - a dt/2) s + a s^2/2 with the velocity w after the
/// solver, and a turn at the angular velocity after the solver. The first zero of the gap (see
/// gapOf) is found by advancing no farther than the gap allows, so that none is passed over, then
/// by bisection.
///
/// If at a node Bullet changes a velocity by other than free flight (gravity, and the gyroscopic
/// term that it adds) while the pair has not touched, it has pushed the two back before they meet:
/// a speculative contact. The impact is then that of free flight from that node on. A pair collides
/// only once at a time, and rests, by the same rules as in LocalReference; this class differs in
/// how it finds distances and speculative contacts, and therefore knows all shapes.
class PairReference {
 public:
  PairReference(const btRigidBody& first, const btRigidBody& second, double restitution,
                double restitutionThreshold);

  void beforeStep(double dt);
  void afterStep(double dt);

  const std::vector<ReferenceImpact>& impacts() const { return impacts_; }
  /// Number of times that Bullet pushed two bodies apart that would not have touched.
  int needless() const { return needless_; }
  /// Greatest distance in m of a node from its place by the law of motion above, over both bodies:
  /// their centres, and the points that are farthest from them. Checks the law.
  double pathError() const { return pathError_; }

 private:
  struct Body {
    const btRigidBody* body = nullptr;
    ReferenceShape shape;
    BodyPath before;  // at the node, before the solver; not accelerated
    BodyPath after;   // at the node, with the velocities after the solver; not accelerated
    BodyPath free;    // from the node on, without the other body
    BodyPath actual;  // as Bullet moves the body
    bool pushed = false;
  };
  /// Derivatives of the gap as a body is shifted and turned: the contact's normal, and its lever
  /// arm crossed with it.
  struct Gradient {
    Vec3 shift = Vec3::Zero();
    Vec3 turn = Vec3::Zero();
  };
  using Way = BodyPath Body::*;

  bool pushed() const { return bodies_[0].pushed || bodies_[1].pushed; }
  static void readNode(Body& body, double dt);
  static void readAfter(Body& body, double dt);
  double gapAt(Way way, double time) const;
  Gradient gradientOf(std::size_t which, Way way, double time) const;
  /// Approach speed in m/s of the bodies at their places on one way with the velocities of another.
  double approachSpeed(Way place, double time, Way velocities) const;
  double inverseMass(Way way, double time) const;
  std::optional<double> firstTouch(Way way, double horizon) const;
  double touchBetween(Way way, double early, double late) const;
  double greatestSpeed(Way way, double horizon) const;
  bool mayCollide(double dt);
  void find(double dt);
  void comparePath(const BodyPath& way, const Body& body, double dt);
  void record(Way way, double time, double nodeSpeed);

  Body bodies_[2];
  double restitution_;
  double restitutionThreshold_;  // m/s
  double time_ = 0.0;            // s, at the start of the substep
  bool collided_ = false;        // the pair has collided and still approaches
  double gap_ = 0.0;             // m, at the node
  int needless_ = 0;
  double pathError_ = 0.0;
  std::vector<ReferenceImpact> impacts_;
};

}  // namespace carom::bench
