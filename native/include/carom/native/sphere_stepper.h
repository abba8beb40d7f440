#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <carom/audio/impulse_event.h>
#include <carom/audio/result.h>
#include <carom/native/sphere_world.h>

namespace carom {

class Recording;

namespace native {
class Simulation;
}

/// The state of one sphere.
struct SphereState {
  Vec3 position = Vec3::Zero();  ///< m, world frame
  Vec3 velocity = Vec3::Zero();  ///< m/s, world frame
  Vec3 spin = Vec3::Zero();      ///< rad/s, world frame; not in recordings
};

struct SphereStepperCounters {
  std::uint64_t collisions = 0;     ///< reported collisions, two events each
  std::uint64_t restContacts = 0;   ///< contacts slower than restSpeed, not reported
  std::uint64_t putToSleep = 0;     ///< times that a sphere was put to sleep
  std::uint64_t woken = 0;          ///< times that a sphere was woken
  std::uint64_t collapses = 0;      ///< runs of contacts too dense to follow; see SphereStepper
  std::uint64_t jammed = 0;         ///< jammed spheres, which no longer collide; see SphereStepper
  std::uint64_t staleContacts = 0;  ///< outdated predictions that were made again
};

/// Steps rigid spheres among immovable planes and boxes, from one contact to the next. Between
/// contacts a sphere flies on a parabola, so the instant of its next contact can be computed ahead:
/// it is the root of a polynomial. The stepper goes to the earliest of these instants, gives the
/// bodies in contact their new velocities, reports two ImpulseEvents, and computes the next
/// contacts of these few bodies anew. No time is quantised to a step, and nobody else is looked at.
///
///     predict    the next contact of each sphere, from its motion and those of its neighbours
///        |
///     queue      all predictions by time  <------------------+
///        |                                                   |
///     advance    to the earliest one                         |
///        |                                                   |
///     resolve    the contact: impulse, friction, rest        |
///        |                                                   |
///     predict    again the spheres whose motion has changed -+
///
/// The rest of this comment is the specification, by topic.
///
/// Model. Between contacts a sphere flies on a parabola. A contact is an instantaneous impulse
/// along the normal,
///     j = (1 + e) m v,   v the approach speed,   1/m = 1/m1 + 1/m2 (a wall has 1/m2 = 0),
/// with e the restitution of the pair (RestitutionTable::of), which may depend on v
/// (RestitutionLaw). Coulomb's friction acts in the same instant, and a sphere that one wall holds
/// slides, rolls or pivots on it (rolling.h). Friction is not modelled on edges, on planes that
/// oscillate, on several walls at once, and for spheres that have rods. Springs, rods, fields and
/// drag bend paths in steps (Linkage). The impulse between bodies that have rods is that of the
/// whole linkage; where several contacts are resolved together, and on edges and planes that
/// oscillate, rods afterwards take back any velocity that would change their lengths.
///
/// Simultaneous contacts. A reported contact that may be tied with another one of its spheres, or
/// that follows from a contact at the same instant, is resolved together with its cluster: all
/// bodies that touch, from sphere to sphere, within 1e-9 of the smaller radius.
/// SphereWorld::simultaneous chooses the method (cluster.h). With Simultaneous::hertz every
/// reported contact is resolved in this way. Each contact that gets an impulse is one collision
/// with its total impulse; all are at one time, in order of ids. Its reported approach speed is its
/// own or, if greater, the one at which a pair by itself would need this impulse. A sleeping sphere
/// yields only if the impact is hard enough to wake it. Contacts slower than restSpeed, and
/// contacts at one instant that share neither a sphere nor a cause, are resolved one after the
/// other, by ids; so are contacts with boxes, except for the face that is hit first, and contacts
/// with planes that oscillate.
///
/// Method. Event-driven molecular dynamics (Alder and Wainwright 1959; one queue entry per sphere
/// after Lubachevsky 1991, J. Comput. Phys. 94, 255): every sphere keeps its motion since its own
/// last contact and one predicted contact, in a calendar queue. A contact changes its two partners
/// only, and only these are predicted anew. A prediction whose partner has changed since is
/// recognised by the partner's count of changes, and made again when it is due. Predicting looks at
/// the spheres in the neighbouring cells of a grid (CellGrid), and at all planes and boxes. So a
/// contact costs the same however many spheres there are, and memory is O(N).
///
/// Boxes. In the frame of a box a sphere's path is a parabola, and the distance from the box is a
/// polynomial between the planes of its faces: see boxContactTime. The contact normal points from
/// the nearest point of the box, and `otherRadius` in an event is 0 at an edge or corner. A box's
/// face holds a sphere like a plane does, up to the face's border, whose time is predicted: there
/// the sphere goes round the edge. A slow contact with an edge or corner is elastic, and becomes a
/// hop of at least 20 us if the sphere is pressed on. The energy of this hop is paid for like that
/// of hops on spheres, otherwise by the sphere's own motion sideways.
///
/// Oscillation. A plane may move steadily, and also in a sine: contacts with it are found by
/// conservative advancement, see oscillatingContactTime. Such a plane holds no sphere: a sphere
/// that lies on it follows in hops of 0.5 ms, which are rest and not reported, and is thrown where
/// the plane falls away faster than gravity. Hops that gravity and the plane make within 20 us are
/// rest, whatever restSpeed is. Energy never grows except by what moving surfaces put in.
///
/// Rest. A contact that approaches more slowly than restSpeed is not reported. So a reported
/// contact with e < 1 takes at least (1 - e^2) m restSpeed^2 / 2 from the energy, there can only be
/// finitely many, and the endless sequence of ever smaller bounces ends. A slow contact with a wall
/// and e < 1, and any contact whose flight afterwards would be shorter than 10 us, has no rebound:
/// the wall holds the sphere, which moves along it with the acceleration that is left to it
/// (carriedBy), until it is drawn or pushed off. Up to three walls hold a sphere. A slow contact of
/// two spheres is elastic; if they are drawn together it ends in a hop of 0.5 ms if there is energy
/// for it, otherwise of 20 us, otherwise at the speed of approach. Hops are paid for with the
/// energy that contacts have taken from the two, up to m restSpeed^2 / 8 of each, and at the start
/// with the energy of ten hops of 20 us. Apart from these, energy never grows.
///
/// Sleep. A sphere is at rest in its place if for 20 ms it has not moved farther than it would at a
/// quarter of restSpeed. It is put to sleep together with the resting spheres in contact with it if
/// walls, boxes, sleeping spheres and they themselves carry each other, up to 1e-3 of gravity. A
/// sleeping sphere stands still and does not yield. It wakes when it is hit at 4 restSpeed or more
/// or by a wall, and when another sphere wakes and nothing else carries it. Spheres with springs,
/// rods, fields or drag do not sleep, nor does any sphere without gravity.
///
/// Collapse. With restSpeed = 0, and in a few symmetric arrangements otherwise, infinitely many
/// contacts fall into a finite time. When one sphere has had 1000 contacts in a row less than 1 us
/// apart, its own rest speed is raised to 5 mm/s for good, unless it was higher, it may hop unpaid
/// once, and if the contact at hand is rest it stands still. Each such run is counted in
/// `collapses`. After 5000 in a row, the last within 100 ps of the one before, or 1 ns where
/// surfaces move, it has no way out. Among surfaces that move, or on a rod or spring, it is then
/// jammed: it stays where it is, or where its joints lead it, nothing touches it any more, and
/// `jammed` counts it. Elsewhere it is put to sleep. So advanceTo always ends.
///
/// Precision. Positions carry rounding errors only, except for the steps of springs, rods, fields
/// and drag. Contact times are kept to twice the precision of a double inside, so that they are as
/// accurate a day after the start as just after it; events round them to double (7 ps after a day).
/// The state of a sphere is re-based at its own contacts and turns only, so results do not depend
/// on where advanceTo stops: not by one bit. Only + - * / and sqrt are used: compiled without
/// contraction and fast-math, the results are the same bits on every compiler and at every
/// optimisation level.
///
/// Valid for radii, speeds and masses whose squares and products stay normal doubles (1e-100 to
/// 1e100). A moved-from stepper can only be assigned to or destroyed. Not thread-safe: one thread
/// at a time; [physics thread] throughout.
class SphereStepper {
 public:
  static constexpr std::size_t kWorkPerEvent = 16;  ///< see advanceTo

  /// Creates a stepper at time 0. Refuses values that the fields of SphereWorld exclude, anything
  /// not finite, equal ids, joints with unknown ends, and overlaps at time 0 of more than 1e-9 of
  /// the smaller radius. Spheres may touch at the start. O(N) for N spheres of about one size.
  static Result<SphereStepper> create(SphereWorld world);

  SphereStepper(SphereStepper&& other) noexcept;
  SphereStepper& operator=(SphereStepper&& other) noexcept;
  SphereStepper(const SphereStepper&) = delete;
  SphereStepper& operator=(const SphereStepper&) = delete;
  ~SphereStepper();

  /// Advances to `time` (s, finite, not before time()) and returns the events of all collisions on
  /// the way, in order of time, valid until the next call. The two shares of a collision follow
  /// each other; of two spheres the lower id comes first, of sphere and plane the sphere. Any other
  /// `time` is an error of the caller: asserted, and without assertions nothing moves.
  ///
  /// Stops earlier, at the time of a collision, once there are `mostEvents` or more: time() is then
  /// before `time`, and further collisions at that instant may follow in the next call. It stops,
  /// too, once it has done kWorkPerEvent * mostEvents pieces of work, such as the steps of rods, of
  /// which there may be any number without an event.
  std::span<const ImpulseEvent> advanceTo(double time,
                                          std::size_t mostEvents = static_cast<std::size_t>(-1));

  /// Applies an impulse (N s, finite) through the centre of a sphere, given by its position in
  /// SphereWorld::spheres, at time(). It is no collision and makes no event. It wakes a sleeping
  /// sphere; rods take back any velocity that would change their lengths. Other arguments are an
  /// error of the caller, as with advanceTo.
  void push(std::size_t sphere, const Vec3& impulse);

  /// Starts recording all that happens from time() on, and drops any earlier recording. Costs
  /// nothing until it is called, and changes no bit of what happens.
  void startRecording();
  /// Ends the recording and returns it, up to time(). Empty if none was started.
  Recording takeRecording();

  double time() const;  ///< s
  std::size_t sphereCount() const;
  SphereState state(std::size_t sphere) const;  ///< at time(), by position in SphereWorld::spheres
  const SphereStepperCounters& counters() const;
  double kineticEnergy() const;    ///< J, at time()
  double potentialEnergy() const;  ///< J, at time(), zero at the origin

  /// Refuses a state that is not consistent: states finite; no overlap at time() above 1e-8 of the
  /// smaller radius or the rounding of the coordinates; queue in order, no contact due before
  /// time() or before its sphere's last one; conservation of momentum and energy. O(N^2).
  Status validate() const;

 private:
  explicit SphereStepper(std::unique_ptr<native::Simulation> simulation);

  std::unique_ptr<native::Simulation> simulation_;
};

}  // namespace carom
