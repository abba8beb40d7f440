#include <gtest/gtest.h>

#include "tests/bullet_bridge/random_scene.h"

namespace carom {
namespace {

// Scenes of `./bench bridge_stress`, fewer of them.
TEST(RandomScenes, WhatTheBridgeSaysIsFiniteConsistentInTimeAndComplete) {
  std::uint64_t collisions = 0;
  for (std::uint64_t seed = 0; seed < 400; ++seed) {
    for (const bool prompt : {false, true}) {
      const RandomSceneResult result = runRandomScene(seed, prompt);
      EXPECT_EQ(result.failure, "") << "bench_bridge_stress --seed " << seed;
      collisions += result.collisions;
    }
  }
  EXPECT_GT(collisions, 50u);
}

TEST(RandomScenes, TheSameSeedGivesTheSameEventsBitForBit) {
  for (std::uint64_t seed = 0; seed < 20; ++seed)
    EXPECT_EQ(runRandomScene(seed).digest, runRandomScene(seed).digest) << "seed " << seed;
}

}  // namespace
}  // namespace carom
