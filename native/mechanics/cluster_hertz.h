#pragma once

#include <span>

#include "native/mechanics/cluster.h"

namespace carom::native {

/// Resolves the contacts by following their forces until all are open and none approaches,
/// including contacts that only touch at first, which distinguish a row of touching balls from one
/// with gaps. Leaves the new velocities in `bodies`.
///
/// Model. Each contact pushes along its normal with the force of Hertz' spring and the damper of
/// Hunt and Crossley (1975, J. Appl. Mech. 42, 440):
///     F = K d^1.5 (1 + x d' / V),   never below 0,
/// where d is the overlap and V the fastest approach of the cluster. x follows from the restitution
/// e alone: x (1 + e) = ln((1 + x) / (1 - e x)), so that a pair by itself parts with e. (An e below
/// 0.05 counts as 0.05.) In a cluster, contacts slower than V lose less.
///
/// The bodies are taken to move by much less than their size: the normals stay, as for every impact
/// at an instant. So impulses are along the normals, and momentum is conserved.
///
/// Method. Runge-Kutta pairs of order 5 (Dormand and Prince 1980, J. Comput. Appl. Math. 6, 19); a
/// step is halved when its error exceeds 1e-13 of the cluster's speeds and overlaps, which also
/// finds where contacts open and close. Energy is right to some 1e-11 if e = 1. No force is left
/// out and no contact is skipped; between contacts the bodies fly free.
///
/// Contacts that approach by less than 1e-11 of V are left to reflectCluster, and so are all that
/// still approach after 1,000,000 steps. [any thread]
ClusterImpulses followHertz(std::span<ClusterBody> bodies,
                            std::span<const ClusterContact> contacts);

}  // namespace carom::native
