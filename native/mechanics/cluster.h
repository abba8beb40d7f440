#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "carom/audio/vector.h"

namespace carom::native {

/// A body in a collision of several bodies at one instant.
struct ClusterBody {
  double mass = 0.0;             ///< kg, > 0; infinite: immovable
  Vec3 velocity = Vec3::Zero();  ///< m/s, world frame
};

/// A contact of two bodies of a cluster.
struct ClusterContact {
  std::uint32_t body = 0;       ///< index among the cluster's bodies
  std::uint32_t other = 0;      ///< another index; at least one of the two has a finite mass
  Vec3 normal = Vec3::UnitX();  ///< unit, from `other` to `body`
  double restitution = 1.0;     ///< 0 to 1
  double stiffness = 0.0;       ///< N / m^1.5, > 0: K of the force K d^1.5; only for Hertz
};

struct ClusterImpulses {
  std::vector<double> along;  ///< N s, by contact, >= 0: on `body` along the normal
  std::size_t rounds = 0;     ///< number of rounds of reflections
  bool settled = true;        ///< false: the remaining approaches were ended inelastically
};

/// Resolves contacts at one instant as Generalized Reflections (Smith, Kaufman, Vouga, Tamstorf and
/// Grinspun 2012, "Reflections on simultaneous impact", ACM Trans. Graph. 31, 106, section 4), and
/// leaves the new velocities in `bodies`.
///
/// Model. The contacts that approach are resolved together: the velocity v of all bodies goes to
///     v + (1 + e) (P v - v),
/// where P v is the velocity nearest to v, in the metric of the masses, in which none of them
/// approaches. A contact that approaches a thousand times more slowly than the fastest only
/// touches: it waits for the next round, so that balls at rest in a row pass a hit on whether they
/// tremble or not. A round may make others approach; so rounds are repeated until none does.
/// Contacts that have no movable body in common, not even through other approaching ones, are
/// independent of each other.
///
/// P v is unique, so the result does not depend on the order of contacts or bodies but for
/// rounding, and has whatever symmetry the cluster has. Where the impulses are not unique (more
/// contacts than degrees of freedom), those of the least sum of squares, each over the root of the
/// effective mass, are taken, within some 1e-7. Momentum is conserved; so is energy if e = 1,
/// within rounding, and it never grows.
///
/// Deviation. Smith et al. have one e. Here each contact gives back its own e times its share of
/// the impulse. Where that would give back more energy than the largest e of the contacts resolved
/// together allows, all of these shares are reduced by one factor.
///
/// Rounds end with P of all contacts (e = 0), so that nothing approaches, after 100,000 rounds;
/// elastic bodies need so many only if masses differ by more than 1e9: a light body (m) between two
/// heavy ones (M) takes some 2.2 sqrt(M / m) rounds. Where a contact has e < 1, rounds may follow
/// each other by ever less for ever (inelastic collapse): then they end in this way when nothing
/// approaches faster than 1e-9 of the first approach, or after 1000 rounds and one for each
/// contact. [any thread]
ClusterImpulses reflectCluster(std::span<ClusterBody> bodies,
                               std::span<const ClusterContact> contacts);

}  // namespace carom::native
