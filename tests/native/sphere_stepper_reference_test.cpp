#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "tests/native/sphere_worlds.h"

namespace carom {
namespace {

using namespace test;

using Wide = long double;
using WideVec3 = Eigen::Matrix<Wide, 3, 1>;

/// The slow and obvious stepper: all spheres are at one time, with 64-bit mantissas; all pairs are
/// tested after every contact, by textbook quadratics; nothing is predicted or kept.
class AllPairsReference {
 public:
  struct Hit {
    BodyId first = 0;
    BodyId second = 0;
    double time = 0.0;
  };

  explicit AllPairsReference(const SphereWorld& world)
      : world_(world), gravity_(world.gravity.cast<Wide>()) {
    for (const Sphere& sphere : world.spheres) {
      positions_.push_back(sphere.position.cast<Wide>());
      velocities_.push_back(sphere.velocity.cast<Wide>());
    }
  }

  Hit next() {
    Wide soonest = INFINITY;
    std::size_t sphere = 0;
    std::size_t partner = 0;
    const std::size_t count = positions_.size();
    for (std::size_t first = 0; first < count; ++first) {
      for (std::size_t second = first + 1; second < count + world_.planes.size(); ++second) {
        const Wide wait =
            second < count ? pairTime(first, second) : planeTime(first, second - count);
        if (wait >= soonest) continue;
        soonest = wait;
        sphere = first;
        partner = second;
      }
    }
    fly(soonest);
    if (partner < count) {
      hitPair(sphere, partner);
      return {world_.spheres[sphere].id, world_.spheres[partner].id, static_cast<double>(time_)};
    }
    hitPlane(sphere, partner - count);
    return {world_.spheres[sphere].id, world_.planes[partner - count].id,
            static_cast<double>(time_)};
  }

 private:
  Wide pairTime(std::size_t first, std::size_t second) const {
    const WideVec3 d = positions_[first] - positions_[second];
    const WideVec3 v = velocities_[first] - velocities_[second];
    const Wide sum =
        static_cast<Wide>(world_.spheres[first].radius) + world_.spheres[second].radius;
    const Wide a = v.dot(v);
    const Wide b = 2.0L * d.dot(v);
    const Wide c = d.dot(d) - sum * sum;
    if (b >= 0.0L) return INFINITY;
    const Wide discriminant = b * b - 4.0L * a * c;
    if (discriminant < 0.0L) return INFINITY;
    return std::max(0.0L, (-b - std::sqrt(discriminant)) / (2.0L * a));
  }

  Wide planeTime(std::size_t sphere, std::size_t index) const {
    const Plane& plane = world_.planes[index];
    const WideVec3 n = plane.normal.cast<Wide>();
    const Wide h = n.dot(positions_[sphere]) - plane.offset - world_.spheres[sphere].radius;
    const Wide v = n.dot(velocities_[sphere]);
    const Wide a = n.dot(gravity_);
    if (std::abs(a) < 1e-15L) return v < 0.0L ? std::max(0.0L, -h / v) : INFINITY;
    const Wide discriminant = v * v - 2.0L * a * h;
    if (discriminant < 0.0L) return INFINITY;
    // At the contact on the way in the velocity is -sqrt, whatever the signs.
    const Wide time = (-std::sqrt(discriminant) - v) / a;
    return time >= 0.0L ? time : (v < 0.0L && h < 1e-12L ? 0.0L : INFINITY);
  }

  void fly(Wide duration) {
    time_ += duration;
    for (std::size_t sphere = 0; sphere < positions_.size(); ++sphere) {
      positions_[sphere] += duration * velocities_[sphere] + 0.5L * duration * duration * gravity_;
      velocities_[sphere] += duration * gravity_;
    }
  }

  void hitPair(std::size_t first, std::size_t second) {
    const Sphere& one = world_.spheres[first];
    const Sphere& two = world_.spheres[second];
    const WideVec3 n = (positions_[first] - positions_[second]).normalized();
    const Wide e = std::sqrt(static_cast<Wide>(one.restitution) * two.restitution);
    const Wide total = static_cast<Wide>(one.mass) + two.mass;
    const Wide closing = n.dot(velocities_[first] - velocities_[second]);
    velocities_[first] -= (1.0L + e) * (two.mass / total) * closing * n;
    velocities_[second] += (1.0L + e) * (one.mass / total) * closing * n;
  }

  void hitPlane(std::size_t sphere, std::size_t index) {
    const Plane& plane = world_.planes[index];
    const WideVec3 n = plane.normal.cast<Wide>();
    const Wide e =
        std::sqrt(static_cast<Wide>(world_.spheres[sphere].restitution) * plane.restitution);
    velocities_[sphere] -= (1.0L + e) * n.dot(velocities_[sphere]) * n;
  }

  SphereWorld world_;
  WideVec3 gravity_;
  std::vector<WideVec3> positions_;
  std::vector<WideVec3> velocities_;
  Wide time_ = 0.0L;
};

/// Compares contacts until chaos has amplified the rounding of double (1e-16) to the tolerance.
/// Spheres as dense as these lose a digit in some two contacts each: 1e-16 becomes 1e-8 after some
/// 15 per sphere. Eight per sphere are compared, at 1e-9 s.
void expectSameContacts(const SphereWorld& world) {
  AllPairsReference reference(world);
  SphereStepper stepper = stepperOf(world);
  std::vector<ImpulseEvent> events;
  double time = 0.0;
  const std::size_t contacts = 4 * world.spheres.size();
  for (std::size_t contact = 0; contact < contacts; ++contact) {
    while (events.size() <= 2 * contact) {
      time += 0.01;
      const auto more = stepper.advanceTo(time);
      events.insert(events.end(), more.begin(), more.end());
      ASSERT_TRUE(stepper.validate());
    }
    const AllPairsReference::Hit hit = reference.next();
    ASSERT_EQ(events[2 * contact].body, hit.first) << "contact " << contact;
    ASSERT_EQ(events[2 * contact].other, hit.second) << "contact " << contact;
    ASSERT_NEAR(events[2 * contact].time, hit.time, 1e-9) << "contact " << contact;
  }
}

class AgainstAllPairs : public ::testing::TestWithParam<int> {};

TEST_P(AgainstAllPairs, ElasticMixedSpheresInABoxMeetInTheSameOrder) {
  SphereWorld world = gasInBox(3, 1.0, static_cast<std::uint64_t>(GetParam()));
  expectSameContacts(world);
}

TEST_P(AgainstAllPairs, DampedMixedSpheresUnderGravityMeetInTheSameOrder) {
  const std::uint64_t seed = 100 + static_cast<std::uint64_t>(GetParam());
  SphereWorld world = gasInBox(4, 0.9, seed);
  world.spheres.resize(20 + seed % 41);
  world.gravity = {1.0, -9.81, 0.5};
  world.restSpeed = 0.0;
  expectSameContacts(world);
}

INSTANTIATE_TEST_SUITE_P(Seeds, AgainstAllPairs, ::testing::Range(1, 13));

}  // namespace
}  // namespace carom
