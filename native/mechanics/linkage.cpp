#include "native/mechanics/linkage.h"

#include <algorithm>
#include <cmath>

#include "native/math/contact_time.h"
#include "native/math/disjoint_sets.h"
#include "native/math/linear_system.h"
#include "native/math/vector_math.h"

namespace carom::native {
namespace {

constexpr int kMostRodIterations = 12;   ///< of Newton's method, which takes three or four
constexpr double kRodTolerance = 1e-15;  ///< of a squared length, relative to it
constexpr double kRodRounding = 1e-9;    ///< of a squared length: more is no solution
constexpr int kMostHalvings = 40;        ///< of one step

Vec3 directionOf(const Vec3& vector) {
  const double length = lengthOf(vector);
  return length > 0.0 ? Vec3(vector / length) : Vec3::Zero();
}

std::vector<Vec3> positionsOf(std::span<const Motion> motions) {
  std::vector<Vec3> positions;
  positions.reserve(motions.size());
  for (const Motion& motion : motions)
    positions.push_back(motion.position);
  return positions;
}

std::uint32_t bodyIndex(BodyId id, std::span<const BodyId> ids) {
  return static_cast<std::uint32_t>(std::ranges::lower_bound(ids, id) - ids.begin());
}

}  // namespace

Linkage::Linkage(const SphereWorld& world, std::span<const BodyId> ids)
    : fields_(world.fields),
      drag_(world.drag),
      gravity_(world.gravity),
      stepGiven_(world.forceStep > 0.0) {
  const bool everywhere = !world.fields.empty() || world.drag.rate > 0.0;
  if (!everywhere && world.springs.empty() && world.rods.empty()) return;
  DisjointSets sets(ids.size());
  std::vector<bool> linked(ids.size(), everywhere);
  const auto link = [&](BodyId one, BodyId other) {
    linked[bodyIndex(one, ids)] = true;
    if (other == kAnchor) return;
    linked[bodyIndex(other, ids)] = true;
    sets.join(bodyIndex(one, ids), bodyIndex(other, ids));
  };
  for (const Spring& spring : world.springs)
    link(spring.sphere, spring.other);
  for (const Rod& rod : world.rods)
    link(rod.sphere, rod.other);
  groupOf_.assign(ids.size(), kNoGroup);
  for (std::uint32_t sphere = 0; sphere < ids.size(); ++sphere) {
    if (!linked[sphere]) continue;
    const std::uint32_t lowest = sets.of(sphere);
    if (lowest == sphere) {
      groupOf_[sphere] = static_cast<std::uint32_t>(groups_.size());
      groups_.emplace_back();
    }
    groupOf_[sphere] = groupOf_[lowest];
    groups_[groupOf_[sphere]].spheres.push_back(sphere);
  }
  connect(world, ids);
}

void Linkage::connect(const SphereWorld& world, std::span<const BodyId> ids) {
  std::vector<Motion> motions(ids.size());
  std::vector<double> masses(ids.size());
  for (const Sphere& sphere : world.spheres) {
    motions[bodyIndex(sphere.id, ids)] = {sphere.position, sphere.velocity, Instant{}};
    masses[bodyIndex(sphere.id, ids)] = sphere.mass;
  }
  const auto member = [&](std::uint32_t sphere) {
    const auto& spheres = groups_[groupOf_[sphere]].spheres;
    return static_cast<std::uint32_t>(std::ranges::lower_bound(spheres, sphere) - spheres.begin());
  };
  const auto endsOf = [&](const auto& joint) {
    Ends ends{member(bodyIndex(joint.sphere, ids)), kFixed, joint.anchor};
    if (joint.other != kAnchor) ends.other = member(bodyIndex(joint.other, ids));
    return ends;
  };
  for (Group& group : groups_) {
    for (const std::uint32_t sphere : group.spheres)
      group.masses.push_back(masses[sphere]);
  }
  for (const Spring& spring : world.springs) {
    groups_[groupOf_[bodyIndex(spring.sphere, ids)]].springs.push_back({endsOf(spring), spring});
  }
  for (const Rod& rod : world.rods) {
    const Vec3 end =
        rod.other == kAnchor ? rod.anchor : motions[bodyIndex(rod.other, ids)].position;
    const Vec3 along = motions[bodyIndex(rod.sphere, ids)].position - end;
    groups_[groupOf_[bodyIndex(rod.sphere, ids)]].rods.push_back(
        {endsOf(rod), dotInOrder(along, along)});
  }
  for (Group& group : groups_) {
    std::vector<Motion> own;
    for (const std::uint32_t sphere : group.spheres)
      own.push_back(motions[sphere]);
    group.step = stepGiven_ ? world.forceStep : stepOf(world, group, own);
  }
}

/// Returns a fixed share of the shortest time in which a motion of the group can change, with the
/// rates estimated from above.
double Linkage::stepOf(const SphereWorld& world, const Group& group,
                       std::span<const Motion> motions) const {
  std::vector<double> squares(group.spheres.size(), 0.0);  // squared frequencies of the members
  double fastest = drag_.rate;
  for (const Coil& coil : group.springs) {
    const double square = coil.spring.stiffness * inverseMass(group, coil.ends);
    squares[coil.ends.one] += square;
    if (coil.ends.other != kFixed) squares[coil.ends.other] += square;
    fastest = std::max(fastest, coil.spring.damping * inverseMass(group, coil.ends));
  }
  for (const Bar& rod : group.rods) {
    // A rod that swings round falls by twice its length.
    const double falling = 2.0 * std::sqrt(lengthOf(world.gravity) / std::sqrt(rod.square));
    fastest = std::max(fastest, falling + turningRate(rod, motions));
  }
  for (std::size_t i = 0; i < squares.size(); ++i) {
    for (const ForceField& field : fields_) {
      const double distance = lengthOf(motions[i].position - field.centre);
      squares[i] += std::abs(field.harmonic);
      if (distance > 0.0)
        squares[i] += std::abs(field.inverseSquare) / (distance * distance * distance);
    }
    fastest = std::max(fastest, std::sqrt(squares[i]));
  }
  // Without forces that change, any step is exact.
  return fastest > 0.0 ? kForceStepAngle / fastest : 1.0;
}

/// Largest rate in rad/s at which the rod may turn.
double Linkage::turningRate(const Bar& rod, std::span<const Motion> motions) {
  Vec3 velocity = motions[rod.ends.one].velocity;
  if (rod.ends.other != kFixed) velocity -= motions[rod.ends.other].velocity;
  return lengthOf(velocity) / std::sqrt(rod.square);
}

/// Returns the length in s of a step in which no rod turns too far at its present speed.
double Linkage::longestStep(const Group& group, std::span<const Motion> motions) const {
  if (stepGiven_) return group.step;
  double fastest = 0.0;
  for (const Bar& rod : group.rods)
    fastest = std::max(fastest, turningRate(rod, motions));
  // An impact may have made the rod faster than could be foreseen.
  return fastest * group.step > kForceStepAngle ? kForceStepAngle / fastest : group.step;
}

Vec3 Linkage::between(const Ends& ends, std::span<const Vec3> positions) {
  return positions[ends.one] - (ends.other == kFixed ? ends.anchor : positions[ends.other]);
}

double Linkage::inverseMass(const Group& group, const Ends& ends) {
  const double one = 1.0 / group.masses[ends.one];
  return ends.other == kFixed ? one : one + 1.0 / group.masses[ends.other];
}

Vec3 Linkage::fieldAt(const Vec3& position) const {
  Vec3 pull = gravity_;
  for (const ForceField& field : fields_) {
    const Vec3 from = position - field.centre;
    pull -= field.harmonic * from;
    const double square = dotInOrder(from, from);
    if (field.inverseSquare != 0.0 && square > 0.0)
      pull -= (field.inverseSquare / (square * std::sqrt(square))) * from;
  }
  return pull;
}

Linkage::Step Linkage::step(std::uint32_t index, std::span<const Motion> motions) const {
  const Group& group = groups_[index];
  double duration = longestStep(group, motions);
  Step longest{duration, accelerations(group, motions, duration)};
  if (group.rods.empty() || holdRods(group, motions, longest)) return longest;
  for (int halvings = 1; halvings <= kMostHalvings; ++halvings) {
    duration *= 0.5;
    Step step{duration, accelerations(group, motions, duration)};
    if (holdRods(group, motions, step)) return step;
  }
  return longest;  // rods that contradict each other hold in no step, however short
}

/// Adds the pull of the rods to the step. False if the step is too long for them.
bool Linkage::holdRods(const Group& group, std::span<const Motion> motions, Step& step) const {
  const RodPull pull = pullByRods(group, step.duration, motions, step.accelerations);
  double farthest = 0.0;  // m, of a coordinate, for its rounding
  for (const Motion& motion : motions)
    farthest = std::max(farthest, motion.position.cwiseAbs().maxCoeff());
  double shortest = kNever;
  for (const Bar& rod : group.rods)
    shortest = std::min(shortest, rod.square);
  if (pull.error > kRodRounding + 8.0 * kRodTolerance * farthest / std::sqrt(shortest))
    return false;
  return stepGiven_ || step.duration * tautness(group, pull.forces) <= kTautStepAngle;
}

/// Returns the largest rate (rad/s) at which the rods' forces (N) swing a member across them.
double Linkage::tautness(const Group& group, std::span<const double> tensions) {
  std::vector<double> squares(group.spheres.size(), 0.0);
  for (std::size_t k = 0; k < tensions.size(); ++k) {
    const Bar& rod = group.rods[k];
    const double stiffness = std::abs(tensions[k]) / std::sqrt(rod.square);
    squares[rod.ends.one] += stiffness / group.masses[rod.ends.one];
    if (rod.ends.other != kFixed)
      squares[rod.ends.other] += stiffness / group.masses[rod.ends.other];
  }
  return std::sqrt(*std::ranges::max_element(squares));
}

/// Returns the accelerations of the group's members, but for the pull of its rods, over a step.
std::vector<Vec3> Linkage::accelerations(const Group& group, std::span<const Motion> motions,
                                         double step) const {
  const double half = 0.5 * step;
  std::vector<Vec3> middles;
  std::vector<Vec3> pulls;
  for (const Motion& motion : motions) {
    middles.push_back(motion.position + half * motion.velocity);
    pulls.push_back(fieldAt(middles.back()));
  }
  for (const Coil& coil : group.springs) {
    const Vec3 along = between(coil.ends, middles);
    const double force = coil.spring.stiffness * (coil.spring.length - lengthOf(along));
    push(group, coil.ends, force * directionOf(along), pulls);
  }
  std::vector<Vec3> velocities;  // at the middle, without dampers, drag and rods
  for (std::size_t i = 0; i < motions.size(); ++i)
    velocities.push_back(motions[i].velocity + half * pulls[i]);
  damp(group, step, middles, velocities, pulls);
  if (drag_.rate > 0.0) {  // implicit: the velocity at the middle includes the drag
    for (std::size_t i = 0; i < motions.size(); ++i)
      pulls[i] =
          (pulls[i] - drag_.rate * (motions[i].velocity - drag_.wind)) / (1.0 + drag_.rate * half);
  }
  return pulls;
}

void Linkage::damp(const Group& group, double step, std::span<const Vec3> middles,
                   std::span<const Vec3> velocities, std::vector<Vec3>& pulls) {
  for (const Coil& coil : group.springs) {
    if (coil.spring.damping == 0.0) continue;
    const Vec3 direction = directionOf(between(coil.ends, middles));
    Vec3 velocity = velocities[coil.ends.one];
    if (coil.ends.other != kFixed) velocity -= velocities[coil.ends.other];
    // Each damper also slows the velocity at the middle, as if it acted alone: so it cannot reverse
    // this velocity.
    const double slowing = 1.0 + 0.5 * step * coil.spring.damping * inverseMass(group, coil.ends);
    push(group, coil.ends,
         (-coil.spring.damping * dotInOrder(velocity, direction) / slowing) * direction, pulls);
  }
}

/// Adds the accelerations by which every rod has its length at the end of the step: Newton's method
/// for the forces.
Linkage::RodPull Linkage::pullByRods(const Group& group, double step,
                                     std::span<const Motion> motions, std::vector<Vec3>& pulls) {
  const double lever = 0.5 * step * step;  // m for each m/s^2
  const std::size_t count = group.rods.size();
  std::vector<Vec3> middles;
  for (const Motion& motion : motions)
    middles.push_back(motion.position + 0.5 * step * motion.velocity);
  std::vector<Vec3> directions;
  for (const Bar& rod : group.rods)
    directions.push_back(directionOf(between(rod.ends, middles)));
  RodPull pull{std::vector<double>(count, 0.0), kNever};
  std::vector<Vec3> ends(motions.size());
  std::vector<Vec3> along(count);
  std::vector<double> errors(count);
  for (int iteration = 0; iteration < kMostRodIterations; ++iteration) {
    for (std::size_t i = 0; i < motions.size(); ++i)
      ends[i] = motions[i].position + step * motions[i].velocity + lever * pulls[i];
    double largest = 0.0;
    for (std::size_t k = 0; k < count; ++k) {
      const Vec3 rod = between(group.rods[k].ends, ends);
      errors[k] = 0.5 * (group.rods[k].square - dotInOrder(rod, rod));
      largest = std::max(largest, std::abs(errors[k]) / group.rods[k].square);
    }
    const bool over = largest >= pull.error || largest <= kRodTolerance;
    pull.error = largest;
    if (over) return pull;
    for (std::size_t k = 0; k < count; ++k)
      along[k] = lever * between(group.rods[k].ends, ends);
    pushRods(group, {along, directions}, errors, pulls);
    for (std::size_t k = 0; k < count; ++k)
      pull.forces[k] += errors[k];
  }
  return pull;
}

/// Adds the effect of pushes along the rods' directions that change each rod, as measured along
/// `seen`, by `changes`, which is overwritten.
void Linkage::pushRods(const Group& group, const RodAxes& axes, std::vector<double>& changes,
                       std::vector<Vec3>& pushed) {
  const std::size_t count = group.rods.size();
  std::vector<double> matrix(count * count);
  for (std::size_t k = 0; k < count; ++k) {
    for (std::size_t l = 0; l < count; ++l) {
      matrix[k * count + l] = dotInOrder(axes.seen[k], axes.directions[l]) *
                              coupling(group, group.rods[k].ends, group.rods[l].ends);
    }
  }
  solveInPlace(matrix, changes);
  for (std::size_t k = 0; k < count; ++k)
    push(group, group.rods[k].ends, changes[k] * axes.directions[k], pushed);
}

/// Rate (1/kg) at which the ends of one joint part by a unit push between those of another.
double Linkage::coupling(const Group& group, const Ends& one, const Ends& other) {
  const auto share = [&](std::uint32_t at, std::uint32_t otherAt) {
    return at != kFixed && at == otherAt ? 1.0 / group.masses[at] : 0.0;
  };
  return share(one.one, other.one) + share(one.other, other.other) - share(one.one, other.other) -
         share(one.other, other.one);
}

/// Adds the effect of a push that drives both ends apart.
void Linkage::push(const Group& group, const Ends& ends, const Vec3& force,
                   std::vector<Vec3>& changes) {
  changes[ends.one] += force / group.masses[ends.one];
  if (ends.other != kFixed) changes[ends.other] -= force / group.masses[ends.other];
}

std::vector<Vec3> Linkage::response(std::uint32_t index, std::span<const Motion> motions,
                                    std::span<const Vec3> impulses) const {
  const Group& group = groups_[index];
  std::vector<Vec3> changes;
  for (std::size_t i = 0; i < impulses.size(); ++i)
    changes.push_back(impulses[i] / group.masses[i]);
  const std::size_t count = group.rods.size();
  if (count == 0) return changes;
  const std::vector<Vec3> positions = positionsOf(motions);
  std::vector<Vec3> directions;
  for (const Bar& rod : group.rods)
    directions.push_back(directionOf(between(rod.ends, positions)));
  std::vector<double> rates(count);
  for (std::size_t k = 0; k < count; ++k) {
    rates[k] = -dotInOrder(
        directions[k],
        between({group.rods[k].ends.one, group.rods[k].ends.other, Vec3::Zero()}, changes));
  }
  pushRods(group, {directions, directions}, rates, changes);
  return changes;
}

double Linkage::potentialEnergy(std::uint32_t index, std::span<const Motion> motions) const {
  const Group& group = groups_[index];
  const std::vector<Vec3> positions = positionsOf(motions);
  double energy = 0.0;
  for (const Coil& coil : group.springs) {
    const double stretch = lengthOf(between(coil.ends, positions)) - coil.spring.length;
    energy += 0.5 * coil.spring.stiffness * stretch * stretch;
  }
  for (std::size_t i = 0; i < positions.size(); ++i) {
    for (const ForceField& field : fields_) {
      const Vec3 from = positions[i] - field.centre;
      const double square = dotInOrder(from, from);
      energy += 0.5 * group.masses[i] * field.harmonic * square;
      if (field.inverseSquare != 0.0 && square > 0.0)
        energy -= group.masses[i] * field.inverseSquare / std::sqrt(square);
    }
  }
  return energy;
}

}  // namespace carom::native
