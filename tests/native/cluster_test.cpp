#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include <gtest/gtest.h>

#include "native/mechanics/cluster_hertz.h"
#include "tests/native/sphere_worlds.h"
#include "tests/support/trials.h"

namespace carom {

using namespace native;

namespace {

using namespace test;

constexpr double kImmovable = std::numeric_limits<double>::infinity();

struct Cluster {
  std::vector<ClusterBody> bodies;
  std::vector<ClusterContact> contacts;

  std::uint32_t body(double mass, const Vec3& velocity = Vec3::Zero()) {
    bodies.push_back({mass, velocity});
    return static_cast<std::uint32_t>(bodies.size() - 1);
  }
  void touch(std::uint32_t body, std::uint32_t other, const Vec3& normal, double e = 1.0) {
    contacts.push_back({body, other, normal, e, 1e9});
  }
  ClusterImpulses reflect() { return reflectCluster(bodies, contacts); }
  ClusterImpulses followForces() { return followHertz(bodies, contacts); }

  double energy() const {
    double sum = 0.0;
    for (const ClusterBody& body : bodies) {
      if (std::isfinite(body.mass)) sum += 0.5 * body.mass * body.velocity.squaredNorm();
    }
    return sum;
  }
  Vec3 momentum() const {
    Vec3 sum = Vec3::Zero();
    for (const ClusterBody& body : bodies) {
      if (std::isfinite(body.mass)) sum += body.mass * body.velocity;
    }
    return sum;
  }
  double fastestApproach() const {
    double fastest = 0.0;
    for (const ClusterContact& contact : contacts) {
      const Vec3 relative = bodies[contact.body].velocity - bodies[contact.other].velocity;
      fastest = std::max(fastest, -contact.normal.dot(relative));
    }
    return fastest;
  }
};

/// A row of touching equal balls along x, the first `moving` of them at 1.5 m/s.
Cluster row(int count, int moving, double restitution = 1.0) {
  Cluster cluster;
  for (int ball = 0; ball < count; ++ball)
    cluster.body(0.2, {ball < moving ? 1.5 : 0.0, 0.0, 0.0});
  for (std::uint32_t ball = 1; ball < cluster.bodies.size(); ++ball)
    cluster.touch(ball - 1, ball, -Vec3::UnitX(), restitution);
  return cluster;
}

// ---- Reflections

TEST(ReflectCluster, AsManyBallsLeaveATouchingCradleAsCameIn) {
  for (const int moving : {1, 2, 3, 4}) {
    Cluster cluster = row(5, moving);
    const double energy = cluster.energy();
    const double momentum = cluster.momentum().x();
    EXPECT_TRUE(cluster.reflect().settled);
    for (int ball = 0; ball < 5; ++ball) {
      const double expected = ball >= 5 - moving ? 1.5 : 0.0;
      EXPECT_NEAR(cluster.bodies[static_cast<std::size_t>(ball)].velocity.x(), expected, 1e-14);
    }
    EXPECT_NEAR(cluster.energy() / energy, 1.0, 1e-14);
    EXPECT_NEAR(cluster.momentum().x() / momentum, 1.0, 1e-14);
  }
}

TEST(ReflectCluster, AHundredBallsPassTheSpeedOn) {
  Cluster cluster = row(100, 1);
  EXPECT_TRUE(cluster.reflect().settled);
  EXPECT_NEAR(cluster.bodies.back().velocity.x(), 1.5, 1e-13);
}

// The striker's new speed u and the others' w along their lines of centres follow from momentum
// along x and energy: u - 2 w cos(30) = v and u^2 + 2 w^2 = v^2 give u = -v / 5, w = 2 sqrt(3) v /
// 5.
TEST(ReflectCluster, ABallThatHitsTwoAtSixtyDegreesComesBackWithAFifth) {
  const double s = std::sqrt(0.75);
  for (const bool forces : {false, true}) {
    Cluster cluster;
    cluster.body(0.3, {2.0, 0.0, 0.0});
    cluster.body(0.3);
    cluster.body(0.3);
    cluster.touch(1, 0, {s, 0.5, 0.0});
    cluster.touch(2, 0, {s, -0.5, 0.0});
    cluster.touch(1, 2, Vec3::UnitY());
    const ClusterImpulses impulses = forces ? cluster.followForces() : cluster.reflect();
    const double tolerance = forces ? 1e-10 : 1e-14;
    const double side = 2.0 * std::sqrt(3.0) * 2.0 / 5.0;
    EXPECT_NEAR(cluster.bodies[0].velocity.x(), -0.4, tolerance);
    EXPECT_NEAR(cluster.bodies[0].velocity.y(), 0.0, tolerance);
    EXPECT_NEAR(cluster.bodies[1].velocity.x(), side * s, tolerance);
    EXPECT_NEAR(cluster.bodies[1].velocity.y(), side * 0.5, tolerance);
    EXPECT_NEAR(cluster.bodies[2].velocity.y(), -side * 0.5, tolerance);
    EXPECT_NEAR(impulses.along[0], 0.3 * side, tolerance);
    EXPECT_EQ(impulses.along[2], 0.0);
  }
}

TEST(ReflectCluster, ACornerOfAnyAngleConservesEnergyAndLetsGo) {
  for (const double degrees : {20.0, 60.0, 75.0, 90.0, 110.0, 150.0, 179.0}) {
    const double half = 0.5 * degrees * 3.14159265358979323846 / 180.0;
    for (const double along : {0.0, 0.1, -0.3}) {
      Cluster cluster;
      cluster.body(0.3, {along, -1.0, 0.2});
      cluster.body(kImmovable);
      cluster.body(kImmovable);
      cluster.touch(0, 1, {std::cos(half), std::sin(half), 0.0});
      cluster.touch(0, 2, {-std::cos(half), std::sin(half), 0.0});
      const double energy = cluster.energy();
      EXPECT_TRUE(cluster.reflect().settled);
      EXPECT_NEAR(cluster.energy() / energy, 1.0, 1e-14) << degrees;
      EXPECT_LE(cluster.fastestApproach(), 1e-14) << degrees;
      if (along == 0.0) {
        EXPECT_NEAR(cluster.bodies[0].velocity.y(), 1.0, 1e-14) << "back along the bisector";
      }
      EXPECT_NEAR(cluster.bodies[0].velocity.z(), 0.2, 1e-15);
    }
  }
}

TEST(ReflectCluster, ThreeBallsThatMeetInAPointTurnBackWithE) {
  for (const double e : {1.0, 0.6, 0.0}) {
    Cluster cluster;
    std::array<Vec3, 3> outward;
    for (std::size_t ball = 0; ball < 3; ++ball) {
      const double angle = 2.0 * 3.14159265358979323846 * static_cast<double>(ball) / 3.0;
      outward[ball] = {std::cos(angle), std::sin(angle), 0.0};
      cluster.body(0.3, -1.5 * outward[ball]);
    }
    for (const auto& [one, two] : {std::pair{0U, 1U}, {1U, 2U}, {2U, 0U}})
      cluster.touch(one, two, (outward[one] - outward[two]).normalized(), e);
    const ClusterImpulses impulses = cluster.reflect();
    for (std::size_t ball = 0; ball < 3; ++ball)
      EXPECT_LT((cluster.bodies[ball].velocity - 1.5 * e * outward[ball]).norm(), 1e-14);
    EXPECT_NEAR(impulses.along[0], impulses.along[1], 1e-14);
    EXPECT_NEAR(impulses.along[0], impulses.along[2], 1e-14);
  }
}

// A light ball between two heavy ones, seen from either of these, is a billiard in a wedge
// (Galperin 2003, Regul. Chaotic Dyn. 8, 375): the heavy ones swap their speeds.
TEST(ReflectCluster, ALightBallBetweenTwoABillionTimesHeavierPassesTheMomentumOn) {
  Cluster cluster;
  cluster.body(1e9, {1.0, 0.0, 0.0});
  cluster.body(1.0);
  cluster.body(1e9);
  cluster.touch(0, 1, -Vec3::UnitX());
  cluster.touch(1, 2, -Vec3::UnitX());
  const double energy = cluster.energy();
  EXPECT_TRUE(cluster.reflect().settled);
  EXPECT_NEAR(cluster.bodies[0].velocity.x(), 0.0, 1e-8);
  EXPECT_NEAR(cluster.bodies[2].velocity.x(), 1.0, 1e-8);
  EXPECT_NEAR(cluster.energy() / energy, 1.0, 1e-12);
  EXPECT_LE(cluster.fastestApproach(), 1e-14);
}

TEST(ReflectCluster, ALightBallSqueezedByTwoABillionTimesHeavierStaysInTheMiddle) {
  Cluster cluster;
  cluster.body(1e9, {1.0, 0.0, 0.0});
  cluster.body(1.0);
  cluster.body(1e9, {-1.0, 0.0, 0.0});
  cluster.touch(0, 1, -Vec3::UnitX());
  cluster.touch(1, 2, -Vec3::UnitX());
  EXPECT_TRUE(cluster.reflect().settled);
  EXPECT_NEAR(cluster.bodies[0].velocity.x(), -1.0, 1e-14);
  EXPECT_NEAR(cluster.bodies[1].velocity.x(), 0.0, 1e-6) << "1e-16 of the impulse on it";
  EXPECT_NEAR(cluster.bodies[2].velocity.x(), 1.0, 1e-14);
}

/// A cluster of bodies at random places, some of them immovable, with all near pairs in contact.
Cluster randomCluster(SplitMix& random, bool elastic) {
  Cluster cluster;
  const int count = 3 + static_cast<int>(random.between(0.0, 17.99));
  std::vector<Vec3> places;
  for (int body = 0; body < count; ++body) {
    places.push_back(random.inCube(1.0));
    const bool fixed = random.between(0.0, 1.0) < 0.1;
    const double size = random.between(0.1, 3.0);
    cluster.body(fixed ? kImmovable : size * size * size,
                 fixed ? Vec3::Zero() : random.inCube(1.0));
  }
  for (std::uint32_t body = 0; body < places.size(); ++body) {
    for (std::uint32_t other = body + 1; other < places.size(); ++other) {
      const Vec3 apart = places[body] - places[other];
      const bool fixed =
          !std::isfinite(cluster.bodies[body].mass) && !std::isfinite(cluster.bodies[other].mass);
      const double e = elastic ? 1.0 : random.between(0.0, 1.0);
      if (apart.norm() < 1.0 && !fixed) cluster.touch(body, other, apart.normalized(), e);
    }
  }
  return cluster;
}

double speedScale(const Cluster& cluster) {
  double fastest = 0.0;
  for (const ClusterBody& body : cluster.bodies)
    fastest = std::max(fastest, body.velocity.norm());
  return fastest;
}

TEST(ReflectCluster, EnergyNeverGrowsAndNothingApproachesInThreeThousandRandomClusters) {
  SplitMix random(17);
  int unsettled = 0;
  for (int trial = 0; trial < trials(3000); ++trial) {
    const bool elastic = trial % 3 == 0;
    Cluster cluster = randomCluster(random, elastic);
    const Cluster start = cluster;
    const ClusterImpulses impulses = cluster.reflect();
    if (elastic && !impulses.settled) ++unsettled;
    ASSERT_LE(cluster.energy(), start.energy() * (1.0 + 1e-13)) << trial;
    if (elastic) {
      ASSERT_GE(cluster.energy(), start.energy() * (1.0 - 1e-13)) << trial;
    }
    ASSERT_LE(cluster.fastestApproach(), 1e-13 * speedScale(cluster)) << trial;
    std::vector<Vec3> momenta;
    for (std::size_t body = 0; body < cluster.bodies.size(); ++body) {
      const double mass = cluster.bodies[body].mass;
      momenta.push_back(Vec3::Zero());
      if (std::isfinite(mass))
        momenta[body] = mass * (cluster.bodies[body].velocity - start.bodies[body].velocity);
    }
    for (std::size_t at = 0; at < cluster.contacts.size(); ++at) {
      const ClusterContact& contact = cluster.contacts[at];
      ASSERT_GE(impulses.along[at], 0.0);
      if (std::isfinite(cluster.bodies[contact.body].mass))
        momenta[contact.body] -= impulses.along[at] * contact.normal;
      if (std::isfinite(cluster.bodies[contact.other].mass))
        momenta[contact.other] += impulses.along[at] * contact.normal;
    }
    for (const Vec3& left : momenta)
      ASSERT_LT(left.norm(), 1e-11) << trial << ": impulses are not what moved it";
  }
  EXPECT_EQ(unsettled, 0);
}

TEST(ReflectCluster, OrderOfBodiesAndContactsDoesNotMatter) {
  SplitMix random(18);
  for (int trial = 0; trial < trials(300); ++trial) {
    Cluster cluster = randomCluster(random, trial % 2 == 0);
    Cluster reversed;
    const auto last = static_cast<std::uint32_t>(cluster.bodies.size() - 1);
    reversed.bodies.assign(cluster.bodies.rbegin(), cluster.bodies.rend());
    for (auto contact = cluster.contacts.rbegin(); contact != cluster.contacts.rend(); ++contact)
      reversed.touch(last - contact->other, last - contact->body, -contact->normal,
                     contact->restitution);
    cluster.reflect();
    reversed.reflect();
    for (std::uint32_t body = 0; body <= last; ++body) {
      const Vec3 difference = cluster.bodies[body].velocity - reversed.bodies[last - body].velocity;
      ASSERT_LT(difference.norm(), 1e-9) << trial;
    }
  }
}

// ---- Hertz

TEST(FollowHertz, APairPartsWithItsRestitution) {
  for (const double e : {1.0, 0.999, 0.9, 0.7, 0.5, 0.2, 0.05}) {
    Cluster cluster;
    cluster.body(0.2, {1.5, 0.3, 0.0});
    cluster.body(0.7, {-0.5, 0.0, 0.0});
    cluster.touch(0, 1, -Vec3::UnitX(), e);
    const ClusterImpulses impulses = cluster.followForces();
    EXPECT_TRUE(impulses.settled);
    const double impulse = (1.0 + e) * 2.0 * 0.2 * 0.7 / 0.9;
    EXPECT_NEAR(impulses.along[0], impulse, 1e-10) << e;
    EXPECT_NEAR(cluster.bodies[0].velocity.x(), 1.5 - impulse / 0.2, 1e-9) << e;
    EXPECT_NEAR(cluster.bodies[1].velocity.x(), -0.5 + impulse / 0.7, 1e-9) << e;
    EXPECT_EQ(cluster.bodies[0].velocity.y(), 0.3);
  }
}

/// The expected final velocities of touching equal balls, the first at speed 1, are from scipy
/// 1.10.1's solve_ivp (DOP853, rtol 1e-12, atol 1e-14, steps of at most 0.01) on x'' = d^1.5 with
/// unit masses, for a time of 12 per ball; its energy is right to 3e-11.
TEST(FollowHertz, TouchingCradlesAreThoseOfAnotherIntegrator) {
  const std::vector<std::vector<double>> expected{
      {-0.07095235365, 0.07640303907, 0.99454931458},
      {-0.07108501708, -0.03027376410, -0.01446362903, 0.12704498608, 0.98877742413}};
  for (const std::vector<double>& speeds : expected) {
    Cluster cluster = row(static_cast<int>(speeds.size()), 1);
    const double energy = cluster.energy();
    EXPECT_TRUE(cluster.followForces().settled);
    for (std::size_t ball = 0; ball < speeds.size(); ++ball)
      EXPECT_NEAR(cluster.bodies[ball].velocity.x() / 1.5, speeds[ball], 1e-10) << ball;
    EXPECT_NEAR(cluster.energy() / energy, 1.0, 1e-11);
    EXPECT_NEAR(cluster.momentum().x(), 0.3, 1e-15);
  }
}

TEST(FollowHertz, TheResultDependsOnNeitherSpeedNorStiffness) {
  Cluster slow = row(3, 1);
  Cluster soft = row(3, 1);
  for (ClusterBody& body : slow.bodies)
    body.velocity *= 1e-3;
  for (ClusterContact& contact : soft.contacts)
    contact.stiffness *= 1e-6;
  slow.followForces();
  soft.followForces();
  for (std::size_t ball = 0; ball < 3; ++ball) {
    EXPECT_NEAR(slow.bodies[ball].velocity.x() / 1e-3, soft.bodies[ball].velocity.x(), 1e-9);
  }
}

TEST(FollowHertz, EnergyNeverGrowsInRandomClustersAndStaysInElasticOnes) {
  SplitMix random(19);
  for (int trial = 0; trial < trials(60); ++trial) {
    const bool elastic = trial % 2 == 0;
    Cluster cluster = randomCluster(random, elastic);
    const double energy = cluster.energy();
    EXPECT_TRUE(cluster.followForces().settled) << trial;
    EXPECT_LE(cluster.energy(), energy * (1.0 + 1e-9)) << trial;
    if (elastic) {
      EXPECT_GE(cluster.energy(), energy * (1.0 - 1e-9)) << trial;
    }
    EXPECT_LE(cluster.fastestApproach(), 1e-9) << trial;
  }
}

}  // namespace
}  // namespace carom
