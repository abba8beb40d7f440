#include <gtest/gtest.h>

#include "tests/bullet_bridge/random_scene.h"
#include "tests/support/trials.h"

namespace carom {
namespace {

// Scenes of `./bench bridge_stress`, fewer of them.
TEST(RandomScenes, WhatTheBridgeSaysIsFiniteConsistentInTimeAndComplete) {
  std::uint64_t collisions = 0;
  for (int index = 0; index < trials(400); ++index) {
    const auto seed = static_cast<std::uint64_t>(index);
    for (const EventDelivery delivery : {EventDelivery::complete, EventDelivery::prompt}) {
      for (const ImpactSearch search : {ImpactSearch::paths, ImpactSearch::contacts}) {
        const RandomSceneResult result =
            runRandomScene(seed, {.delivery = delivery, .search = search});
        EXPECT_EQ(result.failure, "") << "bench_bridge_stress --seed " << seed;
        collisions += result.collisions;
      }
    }
  }
  EXPECT_GT(collisions, static_cast<unsigned>(trials(50)));
}

TEST(RandomScenes, TheSameSeedGivesTheSameEventsBitForBit) {
  for (int index = 0; index < trials(20); ++index) {
    const auto seed = static_cast<std::uint64_t>(index);
    EXPECT_EQ(runRandomScene(seed).digest, runRandomScene(seed).digest) << "seed " << seed;
  }
}

}  // namespace
}  // namespace carom
