#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <btBulletDynamicsCommon.h>
#include <gtest/gtest.h>

#include "bullet_bridge/geometry/to_vec3.h"
#include "carom/bullet/bullet_bridge.h"
#include "tests/support/ordinary_worlds.h"

// ImpactSearch::contacts beside ImpactSearch::paths, which looks at all bodies and takes longer,
// and beside the momentum of the bodies.

namespace carom {
namespace {

constexpr double kRate = 60.0;     // Hz
constexpr double kDuration = 1.0;  // s: no body falls asleep in Bullet's first two

std::unique_ptr<OrdinaryWorld> worldOf(std::string_view name) {
  for (const OrdinaryWorldKind& kind : ordinaryWorlds())
    if (kind.name == name) return kind.make();
  return nullptr;
}

/// All that a bridge says of a world.
struct Told {
  std::vector<ImpulseEvent> events;
  std::vector<ContactState> contacts;
};

Told toldOf(OrdinaryWorld& world, BulletBridge& bridge) {
  Told told;
  while (world.time() < kDuration - 0.5 / kRate) {
    world.step(kRate);
    told.events.insert(told.events.end(), bridge.events().begin(), bridge.events().end());
    told.contacts.insert(told.contacts.end(), bridge.contacts().begin(), bridge.contacts().end());
    bridge.clear();
  }
  bridge.flush();
  told.events.insert(told.events.end(), bridge.events().begin(), bridge.events().end());
  return told;
}

Told toldOf(std::string_view name, ImpactSearch search) {
  const auto world = worldOf(name);
  Result<BulletBridge> bridge = BulletBridge::attach(world->world(), {.search = search});
  return toldOf(*world, *bridge);
}

using Pair = std::pair<BodyId, BodyId>;

/// Impulses of events (N s): of all of them, and of those that there are among others too, of the
/// same pair within a microsecond.
struct Common {
  double all = 0.0;
  double found = 0.0;
};

Common commonOf(const std::vector<ImpulseEvent>& events, const std::vector<ImpulseEvent>& others) {
  constexpr double kSame = 1e-6;  // s
  std::map<Pair, std::vector<double>> times;
  for (const ImpulseEvent& other : others)
    times[{other.body, other.other}].push_back(other.time);
  Common common;
  for (const ImpulseEvent& event : events) {
    // A search of contacts does not look for impacts that Bullet never acts on.
    if (event.appliedImpulse.isZero(0.0)) continue;
    const double impulse = event.impulse.norm();
    common.all += impulse;
    const std::vector<double>& known = times[{event.body, event.other}];
    const bool isFound = std::ranges::any_of(
        known, [&](double time) { return std::abs(time - event.time) < kSame; });
    common.found += isFound ? impulse : 0.0;
  }
  return common;
}

class ImpactSearches : public testing::TestWithParam<std::string_view> {};
class FreeBodies : public testing::TestWithParam<std::string_view> {};  // nothing else acts on them

TEST_P(ImpactSearches, OfContactsFindTheSameImpactsAtTheSameTimes) {
  const Told paths = toldOf(GetParam(), ImpactSearch::paths);
  const Told contacts = toldOf(GetParam(), ImpactSearch::contacts);
  const Common missed = commonOf(paths.events, contacts.events);
  const Common made = commonOf(contacts.events, paths.events);
  EXPECT_GT(missed.all, 0.0);
  EXPECT_GT(missed.found, 0.97 * missed.all);
  EXPECT_GT(made.found, 0.97 * made.all);
}

// Events and contact states together hold the whole momentum that pairs exchange: with the weight,
// that is what each body has gained.
TEST_P(FreeBodies, LoseNoMomentumToASearchOfContacts) {
  const auto world = worldOf(GetParam());
  Result<BulletBridge> bridge =
      BulletBridge::attach(world->world(), {.search = ImpactSearch::contacts});
  ASSERT_TRUE(bridge) << bridge.error().message;
  const auto& objects = world->world().getCollisionObjectArray();
  std::vector<Vec3> before;
  for (int i = 0; i < objects.size(); ++i)
    before.push_back(bullet::toVec3(btRigidBody::upcast(objects[i])->getLinearVelocity()));
  const Told told = toldOf(*world, *bridge);
  std::map<BodyId, Vec3> given;
  for (const ImpulseEvent& event : told.events)
    given.try_emplace(event.body, Vec3::Zero()).first->second += event.appliedImpulse;
  for (const ContactState& state : told.contacts) {
    given.try_emplace(state.body, Vec3::Zero()).first->second += state.appliedImpulse;
    given.try_emplace(state.other, Vec3::Zero()).first->second -= state.appliedImpulse;
  }
  for (int i = 0; i < objects.size(); ++i) {
    const auto& body = *btRigidBody::upcast(objects[i]);
    if (body.isStaticObject()) continue;
    const double mass = 1.0 / static_cast<double>(body.getInvMass());
    const Vec3 gained =
        mass * (bullet::toVec3(body.getLinearVelocity()) - before[static_cast<std::size_t>(i)] -
                kDuration * bullet::toVec3(body.getGravity()));
    const Result<BodyId> id = bridge->bodyId(body);
    ASSERT_TRUE(id);
    EXPECT_LT((gained - given.try_emplace(*id, Vec3::Zero()).first->second).norm(),
              1e-3 * mass * 9.81 * kDuration)
        << "body " << i;
  }
}

std::string nameOf(const testing::TestParamInfo<std::string_view>& test) {
  return std::string(test.param);
}

INSTANTIATE_TEST_SUITE_P(Worlds, ImpactSearches,
                         testing::Values("falling_cubes", "ragdolls", "hull_stack", "marbles",
                                         "vehicle"),
                         nameOf);
INSTANTIATE_TEST_SUITE_P(Worlds, FreeBodies,
                         testing::Values("falling_cubes", "hull_stack", "marbles", "pyramid"),
                         nameOf);

}  // namespace
}  // namespace carom
