#pragma once

#include <cstdint>

#include "native/spheres/contact_parts.h"

namespace carom::native {

/// Resolves contacts that happen at one instant together with the cluster of bodies that are in
/// contact with each other. SphereStepper documents the rules under Simultaneous contacts,
/// cluster.h and cluster_hertz.h the mechanics.
///
/// Reads the bodies, their properties and neighbourhoods. Changes the motions of the cluster's
/// spheres and of spheres on rods with them, their rest and sleep; reports collisions. Internal to
/// native/.
class ClusterContacts {
 public:
  explicit ClusterContacts(const ContactParts& parts);

  /// Resolves the contact of a sphere at now() with its cluster, if it may be `tied` with another
  /// one or if all contacts are resolved in this way (Simultaneous::hertz). `partner` is a sphere,
  /// or sphere count + index of a wall. False, with nothing changed but spheres woken, if this
  /// contact is alone.
  bool resolve(std::uint32_t sphere, std::uint32_t partner, bool tied) {
    return (tied || properties_.isHertz()) && resolveCluster(sphere, partner);
  }

 private:
  struct Cluster;

  bool isSphere(std::uint32_t partner) const { return partner < bodies_.count(); }
  const Wall& wallOf(std::uint32_t partner) const {
    return bodies_.walls[partner - bodies_.count()];
  }

  bool resolveCluster(std::uint32_t sphere, std::uint32_t partner);
  Cluster clusterAt(std::uint32_t sphere, std::uint32_t partner) const;
  void gather(Cluster& cluster) const;
  bool isInContact(std::uint32_t sphere, const Vec3& position, std::uint32_t other) const;
  void describeBodies(Cluster& cluster) const;
  void describeContacts(Cluster& cluster) const;
  double restitution(std::uint32_t sphere, std::uint32_t partner, double approachSpeed) const;
  double hertzStiffness(std::uint32_t sphere, std::uint32_t partner) const;
  bool wakeByImpacts(const Cluster& cluster);
  void report(const Cluster& cluster);
  void reportContact(const Cluster& cluster, std::size_t pair);
  bool apply(const Cluster& cluster);

  const Bodies& bodies_;
  const SphereProperties& properties_;
  const EventScheduler& scheduler_;
  Trajectories& trajectories_;
  RestTracker& rest_;
  SleepController& sleep_;
  CollisionReporter& reporter_;
};

}  // namespace carom::native
