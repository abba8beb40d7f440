#pragma once

#include <optional>
#include <vector>

#include "carom/audio/vector.h"
#include "tests/bench/reference_shape.h"

class btRigidBody;

namespace carom::bench {

/// The way of a body within one substep of Bullet and beyond it: a parabola, turning steadily.
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
  double speed = 0.0;    ///< m/s, of approach
  double mass = 0.0;     ///< kg, effective
  double node = 0.0;     ///< s, the node before it
  bool ahead = false;    ///< a speculative contact
};

/// The exact impacts of one pair of bodies on the path that Bullet takes.
///
/// Of Bullet it knows the bodies' states at the nodes, their masses, and the law by which it moves
/// them from node to node: x0 + (w - a dt/2) s + a s^2/2 with the velocity w after the solver, and
/// a turn at the angular velocity after the solver. The first zero of the gap (see gapOf) is found
/// by going ahead no farther than the gap allows, so that none is passed over, then by halves.
///
/// Where Bullet changes a velocity at a node by other than free flight (gravity, and the gyroscopic
/// term that it adds), and the pair has not touched, it has turned the two back before they meet: a
/// speculative contact. The impact is then that of free flight from that node on. For how a pair is
/// taken to collide only once at a time, and what is rest, see LocalReference, which this follows;
/// it differs in how it comes by the distances and by the speculative contacts, and so knows all
/// shapes.
class PairReference {
 public:
  PairReference(const btRigidBody& first, const btRigidBody& second, double restitution,
                double restitutionThreshold);

  void beforeStep(double dt);
  void afterStep(double dt);

  const std::vector<ReferenceImpact>& impacts() const { return impacts_; }
  /// How often Bullet pushed two apart that would not have touched.
  int needless() const { return needless_; }
  /// m: the greatest distance of a node from where the law of motion above puts it, over both
  /// bodies: their centres, and the points that are farthest from them. Checks the law.
  double pathError() const { return pathError_; }

 private:
  struct Body {
    const btRigidBody* body = nullptr;
    ReferenceShape shape;
    BodyPath before;  // as the node has it, before the solver; not accelerated
    BodyPath after;   // the same place, with the velocities after the solver; not accelerated
    BodyPath free;    // the way from the node on, if nothing is in it
    BodyPath actual;  // the way that it takes
    bool pushed = false;
  };
  /// How the gap changes as a body is shifted and turned: the contact's normal, and its lever arm
  /// crossed with it.
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
  /// m/s: where the bodies are on one way, with the velocities of another.
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
  bool collided_ = false;        // and still approaching
  double gap_ = 0.0;             // m, at the node
  int needless_ = 0;
  double pathError_ = 0.0;
  std::vector<ReferenceImpact> impacts_;
};

}  // namespace carom::bench
