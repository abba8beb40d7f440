#include "lab/compare/collision_match.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace carom::test {

using namespace lab;
using namespace scenes;

namespace {

using Collisions = std::vector<Collision>;

TEST(CollisionMatch, CountsWhatIsMissedAndWhatIsSpurious) {
  const Collisions exact = {{0, 1, 0.10, 2.0}, {0, 1, 0.20, 2.0}, {1, 2, 0.15, 1.0}};
  const Collisions reported = {{0, 1, 0.101, 2.2}, {0, 2, 0.15, 1.0}, {1, 2, 0.19, 1.0}};
  const CollisionMatch match = matchCollisions(reported, exact, 0.01);
  EXPECT_EQ(match.reference, 3u);
  EXPECT_EQ(match.matched, 1u);
  EXPECT_EQ(match.missed, 2u);
  EXPECT_EQ(match.spurious, 2u);
  EXPECT_NEAR(match.timeError.max, 1e-3, 1e-12);
  EXPECT_NEAR(match.impulseError.max, 0.1, 1e-12);
}

TEST(CollisionMatch, GivesEachOfTheReferenceAwayOnce) {
  const Collisions exact = {{0, 1, 0.10, 1.0}};
  const Collisions reported = {{0, 1, 0.10, 1.0}, {0, 1, 0.10, 1.0}};
  const CollisionMatch match = matchCollisions(reported, exact, 0.01);
  EXPECT_EQ(match.matched, 1u);
  EXPECT_EQ(match.spurious, 1u);
}

TEST(CollisionMatch, SumsErrorsAsRootOfTheMeanSquare) {
  const Collisions exact = {{0, 1, 0.1, 1.0}, {0, 1, 0.3, 1.0}};
  const Collisions reported = {{0, 1, 0.103, 1.0}, {0, 1, 0.296, 1.0}};
  const CollisionMatch match = matchCollisions(reported, exact, 0.01);
  EXPECT_NEAR(match.timeError.rms, std::sqrt(12.5) * 1e-3, 1e-12);
  EXPECT_NEAR(match.timeError.max, 4e-3, 1e-12);
}

TEST(CommonRun, EndsAtTheFirstCollisionThatOnlyOneHas) {
  const Collisions exact = {{0, 1, 0.1, 1.0}, {0, 1, 0.3, 1.0}, {1, 2, 0.5, 1.0}};
  const Collisions run = {{0, 1, 0.101, 1.0}, {1, 2, 0.5, 1.0}};
  const CommonRun common = commonRun(run, exact, 0.01);
  EXPECT_EQ(common.divergedAt, 0.3);
  EXPECT_EQ(common.compared, 1u);
  EXPECT_NEAR(common.difference.max, 1e-3, 1e-12);
}

TEST(CommonRun, EndsWhereOneIsTooLate) {
  const Collisions exact = {{0, 1, 0.1, 1.0}, {0, 1, 0.3, 1.0}};
  const Collisions run = {{0, 1, 0.1, 1.0}, {0, 1, 0.35, 1.0}};
  EXPECT_EQ(commonRun(run, exact, 0.01).divergedAt, 0.3);
  EXPECT_TRUE(std::isinf(commonRun(run, exact, 0.1).divergedAt));
}

TEST(CommonRun, SeesPairsThatTheReferenceDoesNotKnow) {
  const Collisions exact = {{0, 1, 0.1, 1.0}};
  const Collisions run = {{0, 1, 0.1, 1.0}, {2, 3, 0.05, 1.0}};
  EXPECT_EQ(commonRun(run, exact, 0.01).divergedAt, 0.05);
}

TEST(CollisionsOf, TakeTheShareOfTheLowerIdInOrderOfTime) {
  std::vector<ImpulseEvent> events(4);
  events[0].time = 0.2;
  events[0].body = 1;
  events[0].other = 2;
  events[0].impulse = {3.0, 4.0, 0.0};
  events[1] = events[0];
  std::swap(events[1].body, events[1].other);
  events[2].time = 0.1;
  events[2].body = 5;
  events[2].other = 0;
  events[3] = events[2];
  std::swap(events[3].body, events[3].other);
  const Collisions collisions = collisionsOf(events);
  ASSERT_EQ(collisions.size(), 2u);
  EXPECT_EQ(collisions[0].body, 0u);
  EXPECT_EQ(collisions[0].other, 5u);
  EXPECT_EQ(collisions[1].impulse, 5.0);
}

}  // namespace
}  // namespace carom::test
