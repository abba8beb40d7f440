#pragma once

#include "bullet_bridge/bodies/body_tracker.h"
#include "bullet_bridge/tracking/bridge_context.h"
#include "bullet_bridge/tracking/gap_memory.h"
#include "bullet_bridge/tracking/impact_finder.h"
#include "bullet_bridge/tracking/impact_tracker.h"
#include "bullet_bridge/tracking/lasting_contacts.h"
#include "bullet_bridge/tracking/pair_records.h"
#include "bullet_bridge/tracking/solved_contact.h"

namespace carom::bullet {

/// Decides what the contact of a pair was in the substep that has just ended: a new impact, part of
/// one under way, a lasting contact, or nothing. [physics thread]
///
/// Between `beginSubstep` and `endSubstep`, `resolve` is called for every candidate pair.
class ContactClassifier {
 public:
  /// Borrows the context and the tracker of bodies, which must outlive the classifier.
  ContactClassifier(BridgeContext& context, BodyTracker& bodies)
      : context_(context), bodies_(bodies), reader_(context.world) {}

  /// `pairs` is about the number of candidates.
  void beginSubstep(std::size_t pairs);
  void resolve(const ContactPair& pair);
  /// Resolves the recorded pairs that were no candidates, and drops records that are not needed.
  void endSubstep();

  /// Hands out the events of impacts that are still under way, with what is known of them so far.
  void flush();
  /// Time (s) before which every event has been handed out.
  double settledTime();

  EventLog& log() { return log_; }
  LastingContacts& contacts() { return contacts_; }

 private:
  const FoundImpact* find(const PairMotion& now, const Proximity& start,
                          const SolvedContact* solved, const PairRecord* record);
  const FoundImpact* search(const PairMotion& now, const Proximity& start,
                            const SolvedContact* solved, const ImpactFinder::Substep& substep);
  bool staysApart(const ContactPair& pair);
  bool missesFrom(const PairMotion& now);
  bool goesOn(const ContactPair& pair, PairRecord& record);
  bool mayHit(const ContactPair& pair, const PairRecord& record, const SolvedContact& solved) const;
  double leastSpeed(const ContactPair& pair, const PairRecord* record) const;
  bool mayCollide(const ContactPair& pair) const;

  void resolveContact(const PairMotion& now, const Proximity& start, PairRecord* record);
  void resolveImpacting(PairRecord& record, const PairMotion& now, const Proximity& start,
                        const SolvedContact& solved);
  bool hitsElsewhere(const PairRecord& record, const PairMotion& now,
                     const SolvedContact& solved) const;
  bool stillApproaches(const PairMotion& now, const Proximity& start) const;
  void beginUnlessRest(PairRecord& record, const FoundImpact& found, double restitution);
  PairRecord& recordOf(const ContactPair& pair, PairRecord* record);
  bool isResolved(const PairRecord& record) const;
  void revisit(PairRecord& record);
  bool restsOn(PairRecord& record, const TrackedBody& body, const TrackedBody& other);
  void drop(PairRecord& record);

  BridgeContext& context_;
  BodyTracker& bodies_;
  ContactReader reader_;
  GapMemory gaps_;
  ImpactFinder finder_;
  PairRecords records_;
  EventLog log_{context_};
  ImpactTracker impacts_{context_, log_};
  LastingContacts contacts_{context_};
};

}  // namespace carom::bullet
