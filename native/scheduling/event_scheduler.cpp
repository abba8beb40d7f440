#include "native/scheduling/event_scheduler.h"

#include <algorithm>
#include <cmath>

#include "native/math/contact_time.h"
#include "native/math/vector_math.h"
#include "native/scheduling/quick_reject.h"

namespace carom::native {
namespace {

constexpr double kTimeRounding = 1e-9;  ///< share of a time that certainly covers its rounding
constexpr double kResolution = 4e-16;   ///< share of a time that its seconds alone cannot resolve
constexpr double kTieReach = 1e-9;      ///< radii that a sphere travels between tied contacts
constexpr double kHeightRounding = 1e-15;  ///< rounding of a height, relative to the coordinates

std::vector<Vec3> positionsOf(const Bodies& bodies) {
  std::vector<Vec3> positions;
  positions.reserve(bodies.count());
  for (const Motion& motion : bodies.motions)
    positions.push_back(motion.position);
  return positions;
}

const Instant& earlierOf(const Instant& one, const Instant& other) {
  return other < one ? other : one;
}

/// True if two spheres under the same acceleration touch; `time` is then the instant at which they
/// first do, never before the later of the instants since which they move as they do.
bool straightContact(const Motion& motion, const Motion& other, const Vec3& acceleration,
                     double radiusSum, Instant& time) {
  const double lag = elapsed(other.since, motion.since);
  // The motion with the earlier `since` is advanced to the later one; QuickReject does the same.
  const bool later = lag >= 0.0;
  const Vec3& flown = later ? other.velocity : motion.velocity;
  const double half = later ? 0.5 * lag : -0.5 * lag;
  const auto apart = [&](int axis) {
    return motion.position[axis] - other.position[axis] -
           lag * (flown[axis] + half * acceleration[axis]);
  };
  const auto faster = [&](int axis) {  // relative velocity, then and always
    return motion.velocity[axis] - other.velocity[axis] - lag * acceleration[axis];
  };
  const double wait = sphereContactTime({apart(0), apart(1), apart(2)},
                                        {faster(0), faster(1), faster(2)}, radiusSum);
  if (wait == kNever) return false;
  time = after(later ? motion.since : other.since, wait);
  return true;
}

/// The first contact of two spheres under different accelerations; never if there is none, or if it
/// is certainly not before `best`.
Instant curvedContact(const Motion& motion, const Vec3& acceleration, const Motion& other,
                      const Vec3& otherAcceleration, double radiusSum, const Instant& best) {
  const bool later = elapsed(other.since, motion.since) >= 0.0;
  const Instant& from = later ? motion.since : other.since;
  const Motion here = later ? motion : motion.at(from, acceleration);
  const Motion there = later ? other.at(from, otherAcceleration) : other;
  const Vec3 separation = here.position - there.position;
  const Vec3 velocity = here.velocity - there.velocity;
  const Vec3 relative = acceleration - otherAcceleration;
  const double horizon = elapsed(from, best) * (1.0 + kTimeRounding);
  const double way = horizon * (lengthOf(velocity) + horizon * lengthOf(relative));
  const double reach = (radiusSum + way) * (1.0 + kTimeRounding);
  if (dotInOrder(separation, separation) > reach * reach) return Instant::never();
  const double wait = sphereContactTime(separation, velocity, relative, radiusSum, horizon);
  return wait == kNever ? Instant::never() : after(from, wait);
}

}  // namespace

EventScheduler::EventScheduler(const Bodies& bodies)
    : bodies_(bodies),
      grid_(positionsOf(bodies), bodies.radii),
      futures_(bodies.count()),
      flags_(bodies.count()),
      queue_(bodies.count()) {}

bool EventScheduler::upToDate(const Contact& contact) const {
  return contact.partnerChanges == futures_[contact.partner].changes;
}

void EventScheduler::forget(std::uint32_t sphere) {
  Future& future = futures_[sphere];
  ++future.changes;
  if (future.contact.partner != kNobody) future.lastPartner = future.contact.partner;
  future.contact = {};
}

void EventScheduler::remove(std::uint32_t sphere) {
  grid_.remove(sphere);
  flags_[sphere] = static_cast<std::uint8_t>(kRemoved);
  futures_[sphere].crossing = Instant::never();
}

BodyId EventScheduler::idOf(const Contact& contact) const {
  if (contact.partner == kNobody) return kNobody;
  const std::size_t count = bodies_.count();
  if (contact.partner < count) return bodies_.ids[contact.partner];
  const std::size_t index = contact.partner - count;
  const std::size_t walls = bodies_.walls.size();
  return index < walls ? bodies_.walls[index].plane.id : bodies_.solids[index - walls].box.id;
}

/// The search for the next contact of one sphere, with the data that it reads again and again in
/// one place.
struct EventScheduler::Search {
  Motion motion;
  Instant now;
  Vec3 pull;                ///< m/s^2
  double radius;            ///< m
  double window;            ///< s, contacts within it may be tied
  double limit = kNever;    ///< s, a later contact is neither the best nor tied with it
  double horizon = kNever;  ///< s, from the motion's beginning to `limit`
  Contact best;
  std::uint32_t sphere;
  bool tied = false;

  Search(std::uint32_t searcher, const Bodies& bodies, const Instant& from, const Contact& known)
      : motion(bodies.motions[searcher]),
        now(from),
        pull(bodies.accelerations[searcher]),
        radius(bodies.radii[searcher]),
        window(0.0),
        sphere(searcher) {
    const Vec3& velocity = motion.velocity;
    const double speed = std::abs(velocity.x()) + std::abs(velocity.y()) + std::abs(velocity.z());
    window = kResolution * now.seconds;  // at rest, the motion of the others decides
    if (speed > 0.0) window += kTieReach * radius / speed;
    prefer(known, false);
  }
  void prefer(const Contact& contact, bool withAnother) {
    best = contact;
    limit = best.time.seconds + window;
    horizon = elapsed(motion.since, best.time) + window;
    tied = withAnother;
  }
  bool together(const Instant& one, const Instant& other) const {
    return std::abs(one.seconds - other.seconds) <= window;
  }
  /// Distance in m that the sphere can travel at most before its best contact.
  double way() const {
    return horizon < kNever ? horizon * (lengthOf(motion.velocity) + horizon * lengthOf(pull))
                            : kNever;
  }
};

void EventScheduler::lookForWalls(Search& search) const {
  const Motion& motion = search.motion;
  const Holds& holds = bodies_.holds[search.sphere];
  const double way = search.way();
  for (std::uint32_t index = 0; index < bodies_.steady; ++index) {
    const Wall& wall = bodies_.walls[index];
    const Vec3& normal = wall.plane.normal;
    const double height = bodies_.height(search.sphere, wall, motion.position, motion.since);
    const double reach = wall.speed == 0.0 ? way : way + std::abs(wall.speed) * search.horizon;
    if (height > reach * (1.0 + kTimeRounding)) continue;  // out of reach before the best contact
    const double pull = bodies_.alongNormal(normal, search.pull);
    const double velocity = dotInOrder(normal, motion.velocity) - wall.speed;
    if ((velocity >= 0.0 && pull >= 0.0) || holds.has(index)) continue;
    const double wait = planeContactTime(height, velocity, pull);
    if (wait == kNever) continue;
    const Instant time = std::max(after(motion.since, wait), search.now);
    const Contact& best = search.best;
    if (best.time < time || (best.time == time && wall.plane.id > idOf(best))) {
      search.tied = search.tied || search.together(time, best.time);
      continue;
    }
    search.prefer({time, static_cast<std::uint32_t>(bodies_.count() + index), 0},
                  search.together(time, best.time));
  }
}

/// Offers a contact with a wall or box, or the crossing of a face's border, `wait` s after the
/// beginning of the motion.
void EventScheduler::offerImmovable(double wait, std::uint32_t index, Search& search) const {
  if (wait == kNever) return;
  const auto partner = static_cast<std::uint32_t>(bodies_.count() + index);
  const Contact contact{std::max(after(search.motion.since, wait), search.now), partner, 0};
  const Contact& best = search.best;
  if (best.time < contact.time) return;
  if (best.time == contact.time && idOf(best) < idOf(contact)) return;
  search.prefer(contact, false);
}

void EventScheduler::lookForOscillatingWalls(Search& search) const {
  const Motion& motion = search.motion;
  for (std::uint32_t index = bodies_.steady; index < bodies_.faces; ++index) {
    const Wall& wall = bodies_.walls[index];
    const Vec3& normal = wall.plane.normal;
    const double middle = bodies_.height(search.sphere, wall, motion.position, motion.since);
    const double size = std::abs(dotInOrder(normal, motion.position)) +
                        std::abs(wall.plane.offset) + search.radius +
                        std::abs(wall.oscillation.amplitude);
    const SmoothHeight smooth{middle, dotInOrder(normal, motion.velocity) - wall.speed,
                              bodies_.alongNormal(normal, search.pull), kHeightRounding * size};
    const double horizon = elapsed(motion.since, search.best.time) * (1.0 + kTimeRounding);
    offerImmovable(oscillatingContactTime(smooth, wall.oscillation, motion.since, horizon), index,
                   search);
  }
}

void EventScheduler::lookForBoxes(Search& search) const {
  const Motion& motion = search.motion;
  const auto walls = static_cast<std::uint32_t>(bodies_.walls.size());
  const Holds& holds = bodies_.holds[search.sphere];
  for (std::uint32_t index = 0; index < bodies_.solids.size(); ++index) {
    const Solid& solid = bodies_.solids[index];
    const double horizon = elapsed(motion.since, search.best.time) * (1.0 + kTimeRounding);
    const Vec3 separation = motion.position - solid.centreAt(motion.since);
    const double way = horizon * (lengthOf(motion.velocity - solid.box.velocity) +
                                  horizon * lengthOf(search.pull));
    const double reach = (solid.reach + search.radius + way) * (1.0 + kTimeRounding);
    if (dotInOrder(separation, separation) > reach * reach) continue;
    const BoxPath path = bodies_.pathBy(solid, motion, search.pull);
    const std::uint32_t face = holds.faceOf(solid.firstFace);
    if (face != Holds::kNone) {
      const double exit = faceExitTime(solid.box.halfExtents, path, face - solid.firstFace);
      offerImmovable(exit, face, search);
    } else {
      const double wait = boxContactTime(solid.box.halfExtents, path, search.radius, horizon);
      offerImmovable(wait, walls + index, search);
    }
  }
}

void EventScheduler::lookAt(std::uint32_t other, Search& search) {
  if (bodies_.apart == 0 || search.pull == bodies_.accelerations[other]) {
    lookStraightAt(other, search);
    return;
  }
  const Instant time = curvedContact(search.motion, search.pull, bodies_.motions[other],
                                     bodies_.accelerations[other],
                                     search.radius + bodies_.radii[other], search.best.time);
  if (time < Instant::never())
    offer({std::max(time, search.now), other, futures_[other].changes}, search);
}

void EventScheduler::lookStraightAt(std::uint32_t other, Search& search) {
  Instant time;
  if (straightContact(search.motion, bodies_.motions[other], search.pull,
                      search.radius + bodies_.radii[other], time))
    offer({std::max(time, search.now), other, futures_[other].changes}, search);
}

/// Offers a contact with a sphere as the best so far.
void EventScheduler::offer(const Contact& contact, Search& search) {
  const double seconds = contact.time.seconds;
  if (search.limit < seconds) return;
  const Contact& best = search.best;
  const Contact& other = futures_[contact.partner].contact;
  const double clear = seconds + search.window;
  if (clear < best.time.seconds && clear < other.time.seconds) {
    search.prefer(contact, false);
    return;
  }
  if (other.time.seconds < seconds - search.window) return;  // the partner will find it
  offerLate(contact, search);
}

/// Offers a contact that is not certainly before all others: it may be tied with one or come after
/// it.
void EventScheduler::offerLate(const Contact& contact, Search& search) {
  const Contact& best = search.best;
  const Contact& other = futures_[contact.partner].contact;
  const bool tied = other.partner != search.sphere && search.together(contact.time, other.time);
  if (tied) tie(contact.partner);
  if (best.time < contact.time || (best.time == contact.time && idOf(contact) >= idOf(best))) {
    if (contact.partner != best.partner && search.together(contact.time, best.time))
      search.tied = true;
    return;
  }
  // A partner whose own contact is earlier looks for this sphere itself after that contact. But the
  // contact that it has may be this very one.
  const bool known = other.partner == search.sphere && other.time == contact.time &&
                     other.partnerChanges == futures_[search.sphere].changes;
  if (contact.time < other.time || known)
    search.prefer(contact, tied || search.together(contact.time, best.time));
}

/// Marks the sphere's next contact as one of several at its instant.
void EventScheduler::tie(std::uint32_t sphere) {
  setTied(sphere, true);
  const std::uint32_t partner = futures_[sphere].contact.partner;
  if (partner < bodies_.count() && futures_[partner].contact.partner == sphere)
    setTied(partner, true);
}

/// Looks at each sphere that the grid visits.
struct EventScheduler::CandidateVisitor {
  EventScheduler& scheduler;
  Search& search;
  void operator()(std::uint32_t other) const { scheduler.lookAt(other, search); }
  void soon(std::uint32_t other) const { __builtin_prefetch(&scheduler.bodies_.motions[other]); }
};

/// Looks at the spheres that the grid visits, two at a time through QuickReject. Only if all
/// spheres have the same acceleration.
template <bool kPulled, bool kFresh>
struct EventScheduler::RejectingVisitor : CandidateVisitor {
  using Reject = QuickReject<kPulled, kFresh>;
  Reject reject;

  void both(std::uint32_t one, std::uint32_t two) const {
    EventScheduler& all = this->scheduler;
    Search& mine = this->search;
    const Bodies& bodies = all.bodies_;
    const typename Reject::Two sums{mine.radius + bodies.radii[one],
                                    mine.radius + bodies.radii[two]};
    const unsigned may =
        reject.mayMeet(bodies.motions[one], bodies.motions[two], sums, mine.horizon);
    if ((may & 1U) != 0) all.lookStraightAt(one, mine);
    if ((may & 2U) != 0 && two != one) all.lookStraightAt(two, mine);
  }
};

/// Looks at all spheres that `visitAll` visits. Cells that the sphere cannot reach are not left
/// out: a sphere that comes from there into a nearer cell looks at new cells only, and would not
/// find this one.
template <class VisitAll>
void EventScheduler::lookAround(const Vec3& position, Search& search, const VisitAll& visitAll) {
  const CellGrid::Probe probe{position, search.radius};
  const auto straight = [&]<bool kPulled, bool kFresh>() {
    visitAll(probe,
             RejectingVisitor<kPulled, kFresh>{{*this, search}, {search.motion, search.pull}});
  };
  const bool pulled = search.pull != Vec3::Zero();
  const bool fresh = search.motion.since == search.now;
  if (bodies_.apart > 0) {
    visitAll(probe, CandidateVisitor{*this, search});
  } else if (pulled) {
    fresh ? straight.template operator()<true, true>()
          : straight.template operator()<true, false>();
  } else {
    fresh ? straight.template operator()<false, true>()
          : straight.template operator()<false, false>();
  }
}

void EventScheduler::predict(std::uint32_t sphere, const Instant& now) {
  if (removed(sphere)) {
    schedule(sphere);
    return;
  }
  const Motion present = bodies_.at(sphere, now);
  // A contact later than the turn is predicted anew at the turn.
  Search search(sphere, bodies_, now, {turnOf(sphere), kNobody, 0});
  // Look at the previous partner first: a hopping sphere often meets it next, and soon, and its
  // contact time bounds the search.
  const std::uint32_t last = futures_[sphere].lastPartner;
  if (bodies_.apart > 0 && last < bodies_.count() && !removed(last)) lookAt(last, search);
  lookAround(present.position, search, [&](const CellGrid::Probe& probe, const auto& visit) {
    grid_.visitNear(sphere, probe, visit);
  });
  lookForWalls(search);  // after the spheres: most are too far then
  if (bodies_.steady < bodies_.faces) lookForOscillatingWalls(search);
  if (!bodies_.solids.empty()) lookForBoxes(search);
  predictCrossing(sphere, present);
  if (search.best.partner == kNobody) search.best.time = Instant::never();
  futures_[sphere].contact = search.best;
  setTied(sphere, search.tied || search.together(now, search.best.time));
  claim(sphere, search.best);
  schedule(sphere);
}

void EventScheduler::predictCrossing(std::uint32_t sphere, const Motion& motion) {
  if (grid_.levelCount() == 0) return;
  const CellGrid::Crossing crossing =
      grid_.nextCrossing(sphere, {motion.position, motion.velocity, bodies_.accelerations[sphere]});
  Future& future = futures_[sphere];
  future.crossing = after(motion.since, crossing.wait);
  const unsigned face = 2U * crossing.axis + (crossing.up ? 1U : 0U);
  flags_[sphere] = static_cast<std::uint8_t>((flags_[sphere] & kTied) | face);
}

void EventScheduler::cross(std::uint32_t sphere, const Instant& now) {
  Future& future = futures_[sphere];
  const unsigned face = flags_[sphere] & kFaces;
  const CellGrid::Crossing crossing{0.0, static_cast<std::uint8_t>(face / 2), face % 2 == 1};
  const Motion motion = bodies_.at(sphere, now);
  grid_.cross(sphere, crossing);
  predictCrossing(sphere, motion);
  Search search(sphere, bodies_, now, future.contact);
  lookAround(motion.position, search, [&](const CellGrid::Probe& probe, const auto& visit) {
    grid_.visitNew(sphere, crossing, probe, visit);
  });
  if (search.best.time < future.contact.time) {
    future.contact = search.best;
    setTied(sphere, search.tied);
    claim(sphere, search.best);
  } else if (search.tied) {
    tie(sphere);
  }
  schedule(sphere);
}

/// Enters the sphere's next contact as its partner's too, so that other spheres no longer count on
/// the partner.
void EventScheduler::claim(std::uint32_t sphere, const Contact& found) {
  if (found.partner >= bodies_.count()) return;
  futures_[found.partner].contact = {found.time, sphere, futures_[sphere].changes};
  setTied(found.partner, tied(sphere));
  schedule(found.partner);
}

void EventScheduler::setTurn(std::uint32_t sphere, const Instant& time) {
  if (turns_.empty()) {
    if (time == Instant::never()) return;
    turns_.assign(bodies_.count(), Instant::never());
  }
  turns_[sphere] = time;
}

void EventScheduler::schedule(std::uint32_t sphere) {
  const Future& future = futures_[sphere];
  const Instant& next = earlierOf(future.contact.time, future.crossing);
  queue_.setTime(sphere, turns_.empty() ? next : earlierOf(next, turns_[sphere]));
}

Status EventScheduler::validate(std::uint32_t sphere, double time) const {
  const Future& future = futures_[sphere];
  const Motion& motion = bodies_.motions[sphere];
  if (queue_.time(sphere) !=
      earlierOf(earlierOf(future.contact.time, future.crossing), turnOf(sphere)))
    return Error{"the queue has another time than its next contact, crossing or turn"};
  if (future.contact.time < motion.since) return Error{"next contact is before its last"};
  if (future.contact.time.seconds <= time && time > 0.0) return Error{"a contact is overdue"};
  const bool partner =
      future.contact.partner < bodies_.count() + bodies_.walls.size() + bodies_.solids.size();
  if (partner == (future.contact.time == Instant::never()))
    return Error{"partner and time of the next contact disagree"};
  if (removed(sphere)) return std::monostate{};
  const Vec3 position = bodies_.at(sphere, {time, 0.0}).position;
  if (!grid_.holds(sphere, position, 1e-12 * position.cwiseAbs().maxCoeff() + 1e-12))
    return Error{"it is not in the cell where it should be"};
  return std::monostate{};
}

}  // namespace carom::native
