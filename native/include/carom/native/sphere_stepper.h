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

/// State of one sphere.
struct SphereState {
  Vec3 position = Vec3::Zero();  ///< m, world frame
  Vec3 velocity = Vec3::Zero();  ///< m/s, world frame
  Vec3 spin = Vec3::Zero();      ///< rad/s, world frame; not in recordings
};

struct SphereStepperCounters {
  std::uint64_t collisions = 0;    ///< reported, two events each
  std::uint64_t restContacts = 0;  ///< slower than restSpeed, not reported
  std::uint64_t laidDown = 0;      ///< spheres put to sleep, each time
  std::uint64_t woken = 0;         ///< spheres woken, each time
  std::uint64_t collapses = 0;     ///< runs of contacts too dense to be followed; see SphereStepper
  std::uint64_t crushed = 0;       ///< spheres that nothing touches any more; see SphereStepper
  std::uint64_t staleContacts = 0;  ///< predictions found outdated, and made again
};

/// Rigid spheres among planes and boxes that nothing can push, stepped from contact to contact.
/// Nothing is quantised to a time step: each contact is found as a root of a polynomial
/// (contact_time.h), resolved at its instant, and reported as two ImpulseEvents.
///
/// Model. Flight on a parabola; an instantaneous impulse along the normal,
///     j = (1 + e) m v,   v the approach speed,   1/m = 1/m1 + 1/m2 (a wall has 1/m2 = 0),
/// with e that of the pair (RestitutionTable::of), which may depend on v (RestitutionLaw).
/// Coulomb's friction acts in the same instant, and where a sphere is held on one wall it slides,
/// rolls or pivots (rolling.h); not on edges, on planes that shake, on several walls at once, and
/// not on what has rods. Springs, rods, fields and drag bend paths in steps (Linkage). The impulse
/// between bodies that have rods is that of the whole linkage; where several contacts are resolved
/// together, and on edges and planes that shake, rods take back afterwards what would change their
/// lengths.
///
/// Simultaneous contacts. A reported contact that may be tied with another one of its spheres, or
/// that follows from a contact at the same instant, is resolved together with all that touch, from
/// sphere to sphere, within 1e-9 of the smaller radius: as SphereWorld::simultaneous says
/// (cluster.h). With Simultaneous::hertz every reported contact is. Each contact that gets an
/// impulse is one collision, all at one time, in order of ids, with its total impulse; its approach
/// speed is its own or, if greater, that of a pair by itself that needs this impulse. What sleeps
/// gives way only if it is hit as hard as wakes it. Slower contacts than restSpeed, and contacts at
/// one instant that share neither a sphere nor a cause, go one after the other, by ids; so do those
/// with boxes, but for the face that is hit first, and those with planes that shake.
///
/// Method. As in event-driven molecular dynamics (Alder and Wainwright 1959; one queue entry per
/// sphere after Lubachevsky 1991, J. Comput. Phys. 94, 255): every sphere keeps its motion since
/// its own last contact and one predicted contact, in a calendar queue; a contact changes, and has
/// predicted anew, its two partners only. A prediction with a partner that has changed since is
/// told by the partner's count of changes, and made again when it is due. Predicting looks at the
/// spheres in the neighbouring cells of a grid (CellGrid), and at all planes and boxes. So a
/// contact costs the same however many spheres there are, and memory is O(N).
///
/// Boxes. In the frame of a box a sphere's path is a parabola, and the distance from the box is a
/// polynomial between the planes of its faces: see boxContactTime. The normal is that from the
/// nearest point, and `otherRadius` in an event 0 at an edge or corner. A box's face holds a sphere
/// like a plane does, up to its border, whose time is predicted: there the sphere goes round the
/// edge. A slow contact with an edge or corner is elastic, and a hop of at least 20 us where the
/// sphere is pressed on: paid for like hops on spheres, otherwise by its own motion sideways.
///
/// Shaking. A plane may move steadily, and in a sine besides: contacts with it are found by
/// conservative advancement, see oscillatingContactTime. It holds nothing: what lies there follows
/// it in hops of 0.5 ms, which are rest and not reported, and is thrown where the plane falls away
/// faster than gravity. Hops on it that gravity and the plane make within 20 us are rest whatever
/// restSpeed is. Energy never grows but for what surfaces that move put in.
///
/// Rest. A contact that approaches more slowly than restSpeed is not reported. So a reported
/// contact with e < 1 takes at least (1 - e^2) m restSpeed^2 / 2 from the energy, there can only be
/// finitely many, and the endless sequence of ever smaller bounces ends. Such a slow contact with a
/// wall and e < 1, and any whose flight afterwards would be shorter than 10 us, has no rebound: the
/// wall holds the sphere, which moves along it, by the acceleration that is left to it (carriedBy),
/// until it is drawn or pushed off. Up to three walls hold it. A slow contact of two spheres is
/// elastic; while they are drawn together it ends in a hop of 0.5 ms if that is paid for, otherwise
/// of 20 us, otherwise at the speed of approach. What pays is the energy that contacts have taken
/// from the two, up to m restSpeed^2 / 8 of each, and at the start that of ten hops of 20 us. But
/// for these, energy never grows.
///
/// Sleep. A sphere that has kept to one place for 20 ms, within the way at a quarter of restSpeed,
/// goes to sleep with the calm ones that touch it if walls, boxes, sleepers and they themselves
/// carry each other, but for 1e-3 of gravity. It is at rest then, and does not give way. It wakes
/// when it is hit with 4 restSpeed or more or by a wall, and when nothing carries it any longer
/// because another one wakes. What is linked does not sleep, nor anything without gravity.
///
/// Collapse. With restSpeed = 0, and in a few symmetric arrangements otherwise, infinitely many
/// contacts fall into a finite time. When one sphere has had 1000 contacts in a row less than 1 us
/// apart, its own rest speed is raised to 5 mm/s for good, unless it was higher, it may hop unpaid
/// once, and if the contact at hand is rest it stands still. Each such run is counted in
/// `collapses`. After 5000 in a row, the last within 100 ps of the one before, or 1 ns where
/// surfaces move, it has no way out. Among surfaces that move, or on a rod or spring, it is
/// crushed: it stays where it is, or where its joints lead it, nothing touches it any more, and
/// `crushed` counts it. Elsewhere it is put to sleep. So advanceTo always ends.
///
/// Precision. Positions carry rounding errors only, but for the steps of springs, rods, fields and
/// drag. Contact times are kept to twice the precision of a double inside, so that they are as
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
  /// Refuses values that the fields of SphereWorld exclude, anything not finite, equal ids, joints
  /// with unknown ends, and overlaps at time 0 of more than 1e-9 of the smaller radius. Spheres may
  /// touch at the start. O(N) for N spheres of about one size.
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
  std::span<const ImpulseEvent> advanceTo(double time);

  /// An impulse (N s, finite) on a sphere, by position in SphereWorld::spheres, at time(), through
  /// its centre: no collision, and no event. It wakes what sleeps; rods take back what would change
  /// their lengths. Anything else is an error of the caller, as with advanceTo.
  void push(std::size_t sphere, const Vec3& impulse);

  /// Records all that happens from time() on. What was recorded before is dropped. Costs nothing
  /// until it is called, and changes no bit of what happens.
  void startRecording();
  /// What has been recorded up to time(), and ends it. Empty if nothing was started.
  Recording takeRecording();

  double time() const;  ///< s
  std::size_t sphereCount() const;
  SphereState state(std::size_t sphere) const;  ///< at time(), by position in SphereWorld::spheres
  const SphereStepperCounters& counters() const;
  double kineticEnergy() const;    ///< J, at time()
  double potentialEnergy() const;  ///< J, at time(), zero at the origin

  /// Whether the stepper is consistent: states finite; no overlap at time() above 1e-8 of the
  /// smaller radius or the rounding of the coordinates; queue in order, no contact due before
  /// time() or before its sphere's last one. If not, `why` (may be null) says what. O(N^2).
  bool validate(std::string* why) const;

 private:
  explicit SphereStepper(std::unique_ptr<native::Simulation> simulation);

  std::unique_ptr<native::Simulation> simulation_;
};

}  // namespace carom
