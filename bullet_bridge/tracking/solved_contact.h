#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <btBulletDynamicsCommon.h>

#include "bullet_bridge/tracking/contact_pair.h"

namespace carom::bullet {

/// One contact point as Bullet holds it after its solver: its place at the start of the substep,
/// and the impulse that the solver applied there.
struct SolvedPoint {
  Vec3 position = Vec3::Zero();  ///< m, world frame, at the start of the substep, on `other`
  Vec3 normal = Vec3::UnitX();   ///< 1, world frame, towards the pair's `body`
  double gap = 0.0;              ///< m
  double impulse = 0.0;          ///< N s, along the normal
};

/// All contacts that Bullet holds for a pair: several points, several manifolds (compounds), and
/// the manifold that it predicted (CCD).
struct SolvedContact {
  double restitution = 0.0;     ///< for a pair without points, the one that Bullet will give it
  double impulse = 0.0;         ///< N s, sum over the points
  Vec3 applied = Vec3::Zero();  ///< N s, world frame, on `body`, friction included
  std::vector<SolvedPoint> points;
};

/// Restitution that Bullet will give a pair for which it holds no contact yet.
double combinedRestitution(const ContactPair& pair);

/// Reads the impulses that Bullet's solver applied to a pair in the substep that has just ended.
/// [physics thread]
///
/// Stale impulses are left out: those of points that the solver skipped (a gap above the processing
/// threshold), and of sleeping pairs. The reader never follows a body pointer that a manifold
/// holds, since that body may be gone.
class ContactReader {
 public:
  explicit ContactReader(btDynamicsWorld& world) : world_(world) {}

  /// Must be called once per substep, before the first read. `continuous`: some body may be stopped
  /// short.
  void beginReading(bool continuous);
  /// Returns the contacts of a pair, valid until the next read.
  const SolvedContact& read(const ContactPair& pair);
  /// Returns only what `read` would give for SolvedContact::impulse (N s), at a fraction of its
  /// cost; negative if that is zero and nothing else was applied either.
  double impulseOf(const ContactPair& pair);
  /// Returns the pairs on which Bullet's solver has acted in this substep, in the order of their
  /// keys, without those of which both are at rest; valid until the next call. Completes their
  /// bodies.
  std::span<const ContactPair> pushedPairs(BodyTracker& tracker);
  /// Counts the nodes and faces by which soft bodies touch others; no manifold holds them.
  std::uint64_t softContacts() const;
  /// True if Bullet would let the two collide: groups and masks, ignored pairs, contact response.
  bool collides(const ContactPair& pair) const;

 private:
  // A pair that the solver has acted on, once for each of its manifolds.
  struct Pushed {
    std::uint64_t key = 0;
    ContactPair pair;
  };

  void gatherManifolds(const ContactPair& pair);
  void addManifold(const ContactPair& pair, const btPersistentManifold& manifold, bool predicted);
  void addPushed(const btPersistentManifold& manifold, const TrackedBody* first,
                 const TrackedBody* second);
  void addPoint(const btManifoldPoint& point, double sign, bool solved);

  btDynamicsWorld& world_;
  btManifoldArray manifolds_;  // manifolds of one pair that are not predicted; kept for its memory
  std::vector<const btPersistentManifold*> predicted_;  // CCD manifolds of this substep
  std::vector<Pushed> pushed_;  // in this substep, like what follows; kept for its memory
  std::vector<ContactPair> pairs_;
  ContactPair latest_;     // the pair that was read last in this substep
  SolvedContact contact_;  // of that pair
};

}  // namespace carom::bullet
