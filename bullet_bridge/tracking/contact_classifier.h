#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "bullet_bridge/bodies/body_tracker.h"
#include "bullet_bridge/tracking/bridge_context.h"
#include "bullet_bridge/tracking/candidate_pairs.h"
#include "bullet_bridge/tracking/gap_memory.h"
#include "bullet_bridge/tracking/impact_finder.h"
#include "bullet_bridge/tracking/impact_tracker.h"
#include "bullet_bridge/tracking/lasting_contacts.h"
#include "bullet_bridge/tracking/pair_records.h"
#include "bullet_bridge/tracking/solved_contact.h"

namespace carom::bullet {

/// Decides what the contact of each pair was in the substep that has just ended: a new impact, part
/// of one under way, a lasting contact, or nothing. [physics thread]
class ContactClassifier {
 public:
  /// Borrows the context and the tracker of bodies, which must outlive the classifier.
  ContactClassifier(BridgeContext& context, BodyTracker& bodies)
      : context_(context), bodies_(bodies), reader_(context.world) {}

  /// Resolves the pairs that may have met, or that Bullet's solver has acted on, then the recorded
  /// ones that are not among them; drops records that are not needed.
  void resolveAll();

  /// Hands out the events of impacts that are still under way, with what is known of them so far.
  void flush(bool isWorldThere);
  /// Time (s) before which every event has been handed out.
  double settledTime();

  EventLog& log() { return log_; }
  LastingContacts& contacts() { return contacts_; }

 private:
  /// When a pair has last hit, or been pushed together again. Pairs that share a place forget each
  /// other's.
  struct Hit {
    std::uint64_t key = 0;
    double time = -std::numeric_limits<double>::infinity();  // s
  };
  static constexpr unsigned kHitBits = 12;

  std::span<const ContactPair> pairsToResolve();
  void resolve(const ContactPair& pair);
  bool waitsForSolver() const { return context_.settings.search == ImpactSearch::contacts; }
  const FoundImpact* find(const PairMotion& now, const Proximity& start,
                          const SolvedContact* solved, const PairRecord* record);
  const FoundImpact* search(const PairMotion& now, const Proximity& start,
                            const SolvedContact* solved, const ImpactFinder::Substep& substep,
                            bool looksBack);
  bool staysApart(const ContactPair& pair);
  bool missesFrom(const PairMotion& now);
  PairRecord* beginBefore(const PairMotion& now);
  void beginUnsolved();
  ImpactFinder::PreviousSubstep previousOf(const ContactPair& pair) const;
  bool goesOn(const ContactPair& pair, PairRecord& record);
  bool isHit(const ContactPair& pair, double least, const SolvedContact& solved) const;
  bool mayHit(const ContactPair& pair, const PairRecord& record, const SolvedContact& solved) const;
  double leastSpeed(const ContactPair& pair, const PairRecord* record) const;
  bool mayCollide(const ContactPair& pair) const;

  void resolveContact(const PairMotion& now, const Proximity& start, PairRecord* record);
  void resolveImpacting(PairRecord& record, const PairMotion& now, const Proximity& start,
                        const SolvedContact& solved);
  bool hitsElsewhere(const PairRecord& record, const PairMotion& now,
                     const SolvedContact& solved) const;
  bool stillApproaches(const PairMotion& now, const Proximity& start) const;
  bool isPushedAgain(const ContactPair& pair, const FoundImpact& found);
  void begin(PairRecord& record, const FoundImpact& found, double restitution);
  Hit& hitOf(std::uint64_t key);
  void beginUnlessRest(PairRecord& record, const FoundImpact& found, double restitution);
  PairRecord& recordOf(const ContactPair& pair, PairRecord* record);
  bool isResolved(const PairRecord& record) const;
  void revisit(PairRecord& record);
  bool restsOn(PairRecord& record, const TrackedBody& body, const TrackedBody& other);
  void drop(PairRecord& record);

  BridgeContext& context_;
  BodyTracker& bodies_;
  CandidatePairs candidates_;
  ContactReader reader_;
  GapMemory gaps_;
  ImpactFinder finder_;
  PairRecords records_;
  EventLog log_{context_};
  ImpactTracker impacts_{context_, log_};
  LastingContacts contacts_{context_};
  std::vector<Hit> hits_ = std::vector<Hit>(std::size_t{1} << kHitBits);
};

}  // namespace carom::bullet
