#pragma once

#include <cstdint>

#include "native/spheres/cluster_contacts.h"
#include "native/spheres/contact_parts.h"

namespace carom::native {

/// Resolves contacts of two spheres: a collision with restitution, friction and rods, or a contact
/// too slow to be reported, which is elastic or ends in a hop.
///
/// Reads the bodies, their properties and responses. Changes the motions of the two and of spheres
/// linked with them, their rest and sleep; reports collisions, and records them in the ledger.
/// Internal to native/.
class SphereContacts {
 public:
  /// `clusters` resolves contacts that are not alone at their instant.
  SphereContacts(const ContactParts& parts, ClusterContacts& clusters);

  /// Resolves the contact of two spheres at now(); `sphere` is the lower one. `tied`: it may be one
  /// of several at this instant.
  void meet(std::uint32_t sphere, std::uint32_t other, bool tied);

 private:
  ContactPair pairOf(std::uint32_t sphere, std::uint32_t other) const;
  double pull(const ContactPair& pair) const;
  void wakeByImpact(const ContactPair& pair);
  void collide(const ContactPair& pair);
  void collideFree(const ContactPair& pair, double restitution);
  void collideLinked(const ContactPair& pair, double restitution);
  void resolveRest(const ContactPair& pair);
  double restingRebound(const ContactPair& pair, double effectiveMass);
  bool hopsAreDamped(std::uint32_t sphere) const;
  void applyFriction(const ContactPair& pair, double impulse, Motion& motion, Motion& otherMotion);
  void report(const ContactPair& pair, double mass, double impulse);

  const Bodies& bodies_;
  const SphereProperties& properties_;
  const Linkage& linkage_;
  const ResponseModel& responses_;
  Trajectories& trajectories_;
  RestTracker& rest_;
  SleepController& sleep_;
  CollisionReporter& reporter_;
  ConservationLedger& ledger_;
  ClusterContacts& clusters_;
};

}  // namespace carom::native
