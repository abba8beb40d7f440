#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <carom/audio/result.h>

class btCollisionObject;
class btDynamicsWorld;

namespace carom {

/// A setting of Bullet that falsifies collisions, and the fault that it causes.
enum class AdviceKind {
  splitImpulse,              ///< it is off: position correction becomes velocity
  splitImpulseThreshold,     ///< position correction of shallow penetrations becomes velocity
  linkPush,                  ///< the same for multibody links, which have no split impulse
  speculativeContact,        ///< bounces are slowed or lost before the bodies touch
  restitutionThreshold,      ///< quiet bounces are lost, or links at rest never stop bouncing
  impulseWriteBack,          ///< the solver does not write impulses into contact points
  relativeBreakingDistance,  ///< contact distances do not scale with the bodies
  breakingDistance,          ///< contact distances scale with the bodies, by an unusual factor
  coarseStep,                ///< fast bodies may pass through others
  hullMargin,                ///< hulls collide some way outside of their surface
  broadphaseMargin,          ///< bounding boxes of small bodies overlap by the thousand
  continuousCollision,       ///< bodies that it stops short do not bounce
};

struct Advice {
  AdviceKind kind{};
  std::string setting;  ///< name of the setting in Bullet
  /// Present value in SI units; flags are the integer that Bullet holds; the worst of several
  /// bodies.
  double current = 0.0;
  double advised = 0.0;     ///< advised value, in the units of `current`
  std::string reason;       ///< one sentence: the fault in the sound and its size in this world
  std::size_t bodies = 0;   ///< number of bodies concerned, 0 = the world
  bool applicable = false;  ///< true if `tune` would change it with these settings
};

struct AdviceSettings {
  /// Height in m: bodies are assumed to move at the speed of a fall from it, or at their own speed
  /// if that is higher.
  double dropHeight = 0.5;
  /// Lets tune change Bullet's globals, which concern all worlds of the process.
  bool processWide = false;
  /// Lets tune switch off the position correction of multibody links: their bounces become right,
  /// but a link that does not bounce stays as deep as it went in, up to |v| dt. Bullet has one
  /// number for both, so rigid bodies of that world are not pushed apart either.
  bool leaveLinksInside = false;
};

/// Returns the settings of this world that falsify its collisions, with numbers for its own
/// gravity, bodies and step (docs/bridge.md); empty if there are none. Call it with the bodies in
/// place: bodies that are added later, and shapes and speeds that change, are not covered.
///
/// `step` is the host's fixed substep in s. Fails if the step or the drop height is not positive
/// and finite. [physics thread], not inside a tick callback.
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

/// Applies the applicable advice of `recommend`, and nothing else; nothing in this library calls it
/// on its own. The world then bounces as it should, and so differently than before.
///
/// Side effect: contact points beyond the processing distance, now 0, keep their applied impulse of
/// an earlier step. A host that sums m_appliedImpulse has to skip points with a positive distance.
///
/// Bodies that are added later keep Bullet's defaults until `tune` is called again. [physics
/// thread], not inside a tick callback.
Result<Tuning> tune(btDynamicsWorld& world, double step, const AdviceSettings& settings = {});

/// Restores the settings that tune changed. Objects that have left the world are skipped.
void undo(btDynamicsWorld& world, const Tuning& tuning);

}  // namespace carom
