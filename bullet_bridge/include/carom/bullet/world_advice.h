#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <carom/audio/result.h>

class btCollisionObject;
class btDynamicsWorld;

namespace carom {

enum class AdviceKind {
  splitImpulse,              ///< off: what pushes bodies apart becomes motion
  splitImpulseThreshold,     ///< likewise, for all but deep penetrations
  linkPush,                  ///< likewise for links of multibodies, which know no split impulse
  speculativeContact,        ///< bounces are slowed or swallowed before the bodies touch
  restitutionThreshold,      ///< quiet bounces are lost, or links at rest never stop bouncing
  impulseWriteBack,          ///< the solver does not write impulses into contact points
  relativeBreakingDistance,  ///< contact distances do not scale with the bodies
  breakingDistance,          ///< they scale, by an unusual factor
  coarseStep,                ///< fast bodies may pass through others
  hullMargin,                ///< hulls collide some way outside of their surface
  broadphaseMargin,          ///< boxes of small bodies overlap by the thousand
  continuousCollision,       ///< what it catches does not bounce
};

struct Advice {
  AdviceKind kind{};
  std::string setting;  ///< its name in Bullet
  double current =
      0.0;  ///< SI; flags as the integer that Bullet holds; of several bodies the worst
  double advised = 0.0;     ///< likewise
  std::string reason;       ///< one sentence: what is wrong for sound, by how much in this world
  std::size_t bodies = 0;   ///< how many it concerns, 0 = the world
  bool applicable = false;  ///< tune would change it, with these settings
};

struct AdviceSettings {
  /// m. Bodies are taken to move at the speed of a fall from here, or at their own if that is more.
  double dropHeight = 0.5;
  /// Lets tune change Bullet's globals, which concern all worlds of the process.
  bool processWide = false;
  /// Lets tune switch off what pushes links out of what they have penetrated: bounces become right,
  /// but a link that does not bounce stays as deep as it went in, up to |v| dt. Bullet has one
  /// number for both, so rigid bodies of that world are not pushed apart either.
  bool leaveLinksInside = false;
};

/// What in the settings of this world falsifies its collisions, with numbers for its own gravity,
/// bodies and step: see docs/bridge.md. Empty if nothing does. Call it with the bodies in place;
/// what comes later, and shapes and speeds that change, it cannot know.
///
/// `step` in s, the host's fixed substep. Refuses a step or a drop height that is not positive and
/// finite. [physics thread], not inside a tick callback.
Result<std::vector<Advice>> recommend(const btDynamicsWorld& world, double step,
                                      const AdviceSettings& settings = {});

struct Tuning {
  struct Change {
    AdviceKind kind{};
    btCollisionObject* object = nullptr;  ///< nullptr for the world and for globals
    double before = 0.0;
  };
  std::vector<Advice> applied;
  std::vector<Change> changes;  ///< in the order in which they were made
};

/// Applies what is applicable of recommend, and nothing else; nothing in this library calls it on
/// its own. The world bounces as it should then, which also means otherwise than before.
///
/// Side effect: contact points beyond the processing distance, now 0, keep their applied impulse of
/// an earlier step. A host that sums m_appliedImpulse has to skip points with a positive distance.
///
/// Bodies that are added later keep Bullet's defaults until it is called again. [physics thread],
/// not inside a tick callback.
Result<Tuning> tune(btDynamicsWorld& world, double step, const AdviceSettings& settings = {});

/// Sets back what tune changed. Objects that have left the world are skipped.
void undo(btDynamicsWorld& world, const Tuning& tuning);

}  // namespace carom
