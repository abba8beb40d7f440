#include "native/mechanics/cluster.h"

#include <algorithm>
#include <cmath>

#include "native/math/disjoint_sets.h"
#include "native/math/vector_math.h"
#include "native/mechanics/velocity_projection.h"

namespace carom::native {
namespace {

constexpr std::size_t kMostRounds = 100'000;     ///< rounds if all contacts are elastic
constexpr std::size_t kMostDampedRounds = 1000;  ///< rounds otherwise, plus one for each contact
constexpr int kMostEndings = 4;  ///< passes over all contacts that end what still approaches
/// Approach, relative to the fastest first one, below which damped contacts are ended.
constexpr double kCollapsed = 1e-9;
/// Approach, relative to the fastest one, below which contacts wait for the next round.
constexpr double kTogether = 1e-3;

using Indices = std::vector<std::uint32_t>;

class Reflections {
 public:
  Reflections(std::span<const ClusterBody> bodies, std::span<const ClusterContact> contacts)
      : system_(bodies, contacts), impulses_(contacts.size(), 0.0) {
    for (const ClusterContact& contact : contacts)
      elastic_ = elastic_ && contact.restitution == 1.0;
    collapsed_ = kCollapsed * fastest(approaching());
  }

  ClusterImpulses run(std::span<ClusterBody> bodies);

 private:
  Indices approaching() const;
  Indices foremost() const;
  double fastest(const Indices& chosen) const;
  bool goesOn(const Indices& chosen, std::size_t round) const;
  std::vector<Indices> independent(const Indices& chosen) const;
  double givenBack(const Indices& chosen, const std::vector<double>& impulses) const;
  double energyOf(const Indices& chosen, const std::vector<double>& impulses) const;
  void reflect(const Indices& chosen);
  void end();
  void apply(const Indices& chosen, const std::vector<double>& impulses);

  ClusterSystem system_;
  std::vector<double> impulses_;
  bool elastic_ = true;     ///< true if all contacts have e = 1
  double collapsed_ = 0.0;  ///< m/s, damped contacts that approach no faster are ended
};

Indices Reflections::approaching() const {
  Indices found;
  for (std::uint32_t contact = 0; contact < system_.contacts.size(); ++contact) {
    if (system_.compliances[contact] > 0.0 &&
        system_.openingSpeed(contact) < -system_.rounding(contact, system_.velocities))
      found.push_back(contact);
  }
  return found;
}

/// The contacts that approach about as fast as the fastest. Contacts that only tremble are not
/// reflected with those that hit.
Indices Reflections::foremost() const {
  Indices found = approaching();
  const double least = kTogether * fastest(found);
  std::erase_if(found,
                [&](std::uint32_t contact) { return -system_.openingSpeed(contact) < least; });
  return found;
}

double Reflections::fastest(const Indices& chosen) const {
  double found = 0.0;
  for (const std::uint32_t contact : chosen)
    found = std::max(found, -system_.openingSpeed(contact));
  return found;
}

/// True if these contacts are reflected in another round. Damped contacts may make each other
/// approach for ever, by ever less: their rounds are cut short.
bool Reflections::goesOn(const Indices& chosen, std::size_t round) const {
  if (chosen.empty()) return false;
  if (elastic_) return round < kMostRounds;
  return round < kMostDampedRounds + system_.contacts.size() && fastest(chosen) > collapsed_;
}

/// Divides the contacts into groups that have no movable body in common.
std::vector<Indices> Reflections::independent(const Indices& chosen) const {
  if (chosen.size() == 1) return {chosen};
  DisjointSets links(system_.velocities.size());
  const auto movable = [&](std::uint32_t body) { return system_.inverseMasses[body] > 0.0; };
  for (const std::uint32_t contact : chosen) {
    const ClusterContact& pair = system_.contacts[contact];
    if (movable(pair.body) && movable(pair.other)) links.join(pair.body, pair.other);
  }
  std::vector<Indices> groups;
  Indices groupOf(system_.velocities.size(), 0);  // by root: number of its group, counted from 1
  for (const std::uint32_t contact : chosen) {
    const ClusterContact& pair = system_.contacts[contact];
    std::uint32_t& group = groupOf[links.of(movable(pair.body) ? pair.body : pair.other)];
    if (group == 0) {
      groups.emplace_back();
      group = static_cast<std::uint32_t>(groups.size());
    }
    groups[group - 1].push_back(contact);
  }
  return groups;
}

/// Twice the kinetic energy of the velocities that the impulses add.
double Reflections::energyOf(const Indices& chosen, const std::vector<double>& impulses) const {
  std::vector<Vec3> gained(system_.velocities.size(), Vec3::Zero());
  for (std::size_t index = 0; index < chosen.size(); ++index)
    system_.push(chosen[index], impulses[index], gained);
  double energy = 0.0;
  for (std::size_t body = 0; body < gained.size(); ++body) {
    if (system_.inverseMasses[body] > 0.0)
      energy += dotInOrder(gained[body], gained[body]) / system_.inverseMasses[body];
  }
  return energy;
}

/// Factor on all restitutions by which the contacts give back no more energy than with the largest
/// restitution for all of them.
double Reflections::givenBack(const Indices& chosen, const std::vector<double>& impulses) const {
  const auto restitutionOf = [&](std::uint32_t contact) {
    return system_.contacts[contact].restitution;
  };
  const auto [least, most] = std::ranges::minmax(chosen, {}, restitutionOf);
  const double highest = restitutionOf(most);
  if (restitutionOf(least) == highest) return 1.0;
  std::vector<double> returned = impulses;
  for (std::size_t index = 0; index < chosen.size(); ++index)
    returned[index] *= restitutionOf(chosen[index]);
  const double allowed = highest * highest * energyOf(chosen, impulses);
  const double wanted = energyOf(chosen, returned);
  return wanted > allowed ? std::sqrt(allowed / wanted) : 1.0;
}

void Reflections::reflect(const Indices& chosen) {
  std::vector<double> impulses = projectionImpulses(system_, chosen);
  const double share = givenBack(chosen, impulses);
  for (std::size_t index = 0; index < chosen.size(); ++index)
    impulses[index] *= 1.0 + share * system_.contacts[chosen[index]].restitution;
  apply(chosen, impulses);
}

void Reflections::apply(const Indices& chosen, const std::vector<double>& impulses) {
  for (std::size_t index = 0; index < chosen.size(); ++index) {
    system_.push(chosen[index], impulses[index], system_.velocities);
    impulses_[chosen[index]] += impulses[index];
  }
}

/// Ends all approaches inelastically; repeated for what rounding has left.
void Reflections::end() {
  Indices all;
  for (std::uint32_t contact = 0; contact < system_.contacts.size(); ++contact) {
    if (system_.compliances[contact] > 0.0) all.push_back(contact);
  }
  const std::vector<Indices> groups = independent(all);
  for (int pass = 0; pass < kMostEndings && !approaching().empty(); ++pass) {
    for (const Indices& group : groups)
      apply(group, projectionImpulses(system_, group));
  }
}

ClusterImpulses Reflections::run(std::span<ClusterBody> bodies) {
  Indices chosen = foremost();
  ClusterImpulses result;
  for (; goesOn(chosen, result.rounds); ++result.rounds) {
    for (const Indices& group : independent(chosen))
      reflect(group);
    chosen = foremost();
  }
  result.settled = chosen.empty();
  if (!result.settled) end();
  for (std::size_t body = 0; body < bodies.size(); ++body) {
    if (system_.inverseMasses[body] > 0.0) bodies[body].velocity = system_.velocities[body];
  }
  for (double& impulse : impulses_)
    impulse *= system_.unit;
  result.along = std::move(impulses_);
  return result;
}

}  // namespace

ClusterImpulses reflectCluster(std::span<ClusterBody> bodies,
                               std::span<const ClusterContact> contacts) {
  return Reflections(bodies, contacts).run(bodies);
}

}  // namespace carom::native
