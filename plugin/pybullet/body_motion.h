#pragma once

#include <cstdint>
#include <vector>

#include "carom/audio/vector.h"
#include "plugin/pybullet/contact_impact.h"

namespace carom::plugin {

/// The motion of a body and its links over a substep, as far as it is known.
///
/// A server tells, after each whole step, where the bodies are that do not sleep. How they move
/// follows from that: Bullet's solver is symplectic, so that a substep's displacement is the speed
/// at its end, times its duration. Only what does not follow is asked for, as a state costs some
/// microseconds each: of bodies with links, of new ones, between the substeps of one step, and of
/// bodies that have moved otherwise than gravity and contacts have them, or that the solver has
/// pushed out of deep overlaps.
struct BodyMotion {
  /// Where a state is known from: asked for as a substep begins; or before that, so that the host
  /// may have put or thrown the body since.
  enum class Source : std::uint8_t { unknown, asked, told };

  std::vector<BodyState> starts;  ///< of the base and the links, at the start of the substep
  std::vector<BodyState> ends;    ///< at its end
  Source start = Source::unknown;
  Source end = Source::unknown;
  bool isAwake = true;
  /// The server tells places in the frame of the states that are asked for; not known before both
  /// have been compared.
  bool isTold = false;
  /// Over the substep before, the body moved as gravity and contacts alone have it.
  bool isFree = true;
  Vec3 impulse = Vec3::Zero();         ///< N s, of the contacts of this substep
  Vec3 angularImpulse = Vec3::Zero();  ///< N m s, about the centre of mass
  std::uint64_t loaded = 0;            ///< the substep to which `impulse` belongs
  /// The solver has moved it out of an overlap, in that substep, without giving it that speed.
  bool isPushed = false;

  bool hasLinks() const { return starts.size() > 1; }
  /// Has `impulse`, `angularImpulse` and `isPushed` be those of that substep: none at first.
  void loadIn(std::uint64_t substep) {
    if (loaded == substep) return;
    loaded = substep;
    impulse = angularImpulse = Vec3::Zero();
    isPushed = false;
  }
};

/// Returns the state at the end of a substep of that duration (s) that begins with `start`, by
/// where the body is then.
BodyState endOf(const BodyState& start, const Vec3& position, const Quat& orientation,
                double duration);

/// Forces over a substep that a free body follows.
struct FreeMotion {
  double duration = 0.0;        ///< s
  Vec3 gravity = Vec3::Zero();  ///< m/s^2
};

/// True if a body without links moved from `start` to `end` as gravity and its contacts have it.
/// `impulse` in N s; `mass` in kg, infinite where it is not known and no contact acts.
bool isFreeMotion(const BodyState& start, const BodyState& end, const Vec3& impulse, double mass,
                  const FreeMotion& motion);

/// Returns the state at the start of a substep of which the end is known, for a body that the host
/// has put or thrown there: back along the way of the substep, less gravity and contacts.
BodyState startOf(const BodyState& end, const BodyMotion& motion, const ContactBody& body,
                  const FreeMotion& free);

}  // namespace carom::plugin
