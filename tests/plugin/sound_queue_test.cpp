#include "plugin/realtime/sound_queue.h"

#include <cstddef>
#include <deque>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/no_alloc_scope.h"
#include "tests/support/random.h"

// The tests compare each sound that a SoundQueue gives back with a copy of it, kept in a
// std::deque.

namespace carom::plugin {

using namespace audio;

namespace {

constexpr std::size_t kModes = 16;

/// A sound with arrays of its own, of which every number tells where it belongs.
struct OwnedSound {
  double peak = 0.0;
  std::vector<Click> clicks;
  std::vector<SphereWeights> ears;
  std::vector<ModalExcitation> excitations;
  std::vector<double> taps;
  std::vector<PulseNode> train;

  ScheduledSound view() const {
    return {.peak = peak,
            .clicks = clicks,
            .ears = ears,
            .excitations = excitations,
            .taps = taps,
            .train = train};
  }
};

OwnedSound randomSound(Random& random, std::size_t modesOfBody) {
  OwnedSound sound;
  sound.peak = random.between(0.0, 1.0);
  for (int click = random.below(5); click > 0; --click) {
    sound.clicks.emplace_back().first = random.below(1000);
    sound.ears.emplace_back().weight[1] = random.between(0.0, 1.0);
  }
  for (int rings = random.below(4); rings > 0; --rings) {
    ModalExcitation& excitation = sound.excitations.emplace_back();
    excitation.body = static_cast<BodyId>(random.below(100));
    excitation.count = modesOfBody;
    excitation.taps = sound.taps.size();
    for (std::size_t tap = 0; tap < 2 * modesOfBody; ++tap)
      sound.taps.push_back(random.between(-1.0, 1.0));
  }
  for (int nodes = random.below(20); nodes > 0; --nodes)
    sound.train.push_back({random.between(0.0, 1.0), random.between(-1.0, 1.0)});
  return sound;
}

SoundQueue::Capacity smallCapacity() {
  return {.clicks = 8,
          .excitations = 8,
          .modes = kModes,
          .nodes = 32,
          .waitingClicks = 16,
          .waitingExcitations = 8,
          .waitingNodes = 64,
          .hasEars = true};
}

void expectEqual(const ScheduledSound& taken, const OwnedSound& given, std::size_t modes) {
  EXPECT_EQ(taken.peak, given.peak);
  ASSERT_EQ(taken.clicks.size(), given.clicks.size());
  ASSERT_EQ(taken.ears.size(), given.ears.size());
  for (std::size_t click = 0; click < given.clicks.size(); ++click) {
    EXPECT_EQ(taken.clicks[click].first, given.clicks[click].first);
    EXPECT_EQ(taken.ears[click].weight, given.ears[click].weight);
  }
  ASSERT_EQ(taken.excitations.size(), given.excitations.size());
  for (std::size_t index = 0; index < given.excitations.size(); ++index) {
    const ModalExcitation& excitation = taken.excitations[index];
    const ModalExcitation& original = given.excitations[index];
    EXPECT_EQ(excitation.body, original.body);
    ASSERT_EQ(excitation.count, modes);
    for (std::size_t mode = 0; mode < modes; ++mode) {
      EXPECT_EQ(taken.taps[excitation.taps + mode], given.taps[original.taps + mode]);
      EXPECT_EQ(taken.taps[excitation.taps + modes + mode],
                given.taps[original.taps + original.count + mode]);
    }
  }
  ASSERT_EQ(taken.train.size(), given.train.size());
  for (std::size_t node = 0; node < given.train.size(); ++node)
    EXPECT_EQ(taken.train[node].weight, given.train[node].weight);
}

TEST(SoundQueue, GivesBackEverySoundWholeAndInOrderThroughManyTurnsOfTheRing) {
  Random random(11);
  SoundQueue queue(smallCapacity());
  std::deque<OwnedSound> waiting;
  std::size_t refused = 0;
  for (int step = 0; step < 20000; ++step) {
    if (random.chance(0.6)) {
      OwnedSound sound = randomSound(random, kModes);
      if (queue.put(sound.view()))
        waiting.push_back(std::move(sound));
      else
        ++refused;
      queue.publish();
    } else if (const ScheduledSound* taken = queue.take(); taken != nullptr) {
      ASSERT_FALSE(waiting.empty());
      expectEqual(*taken, waiting.front(), kModes);
      waiting.pop_front();
    } else {
      EXPECT_TRUE(waiting.empty());
    }
  }
  EXPECT_GT(refused, 100U);
}

TEST(SoundQueue, KeepsTheFirstModesOfABodyThatHasMoreThanCross) {
  Random random(3);
  SoundQueue queue(smallCapacity());
  for (int trial = 0; trial < 100; ++trial) {
    const OwnedSound sound = randomSound(random, 3 * kModes);
    ASSERT_TRUE(queue.put(sound.view()));
    queue.publish();
    const ScheduledSound* taken = queue.take();
    ASSERT_NE(taken, nullptr);
    expectEqual(*taken, sound, kModes);
  }
}

TEST(SoundQueue, ShowsNothingBeforeItIsPublished) {
  SoundQueue queue(smallCapacity());
  OwnedSound sound;
  sound.clicks.resize(3);
  sound.ears.resize(3);
  ASSERT_TRUE(queue.put(sound.view()));
  EXPECT_EQ(queue.take(), nullptr);
  queue.publish();
  ASSERT_NE(queue.take(), nullptr);
  EXPECT_EQ(queue.take(), nullptr);
}

TEST(SoundQueue, HasRoomForWhatItsCapacityPromises) {
  SoundQueue queue(smallCapacity());
  OwnedSound sound;
  sound.clicks.resize(8);
  sound.ears.resize(8);
  EXPECT_GE(queue.roomForClicks(8, 0), 2U);
  std::size_t put = 0;
  while (queue.roomForClicks(8, 0) > 0 && put < 1000) {
    ASSERT_TRUE(queue.put(sound.view()));
    ++put;
  }
  EXPECT_GE(put, 2U);
  EXPECT_LT(put, 1000U);
}

TEST(SoundQueue, RefusesMoreClicksAndExcitationsThanItsCapacityAndTakesTheNextSound) {
  SoundQueue queue(smallCapacity());
  OwnedSound clicks;
  clicks.clicks.resize(9);
  EXPECT_FALSE(queue.put(clicks.view()));
  OwnedSound rings;
  rings.excitations.resize(9);
  EXPECT_FALSE(queue.put(rings.view()));
  clicks.clicks.resize(8);
  EXPECT_TRUE(queue.put(clicks.view()));
}

TEST(SoundQueue, RefusesATrainLongerThanItsCapacityAndTakesTheNextSound) {
  SoundQueue queue(smallCapacity());
  OwnedSound sound;
  sound.train.resize(33);
  EXPECT_FALSE(queue.put(sound.view()));
  sound.train.resize(32);
  EXPECT_TRUE(queue.put(sound.view()));
}

TEST(SoundQueue, NeitherSideAllocates) {
  Random random(5);
  SoundQueue queue(smallCapacity());
  std::vector<OwnedSound> sounds;
  for (int index = 0; index < 200; ++index)
    sounds.push_back(randomSound(random, kModes));
  const test::NoAllocScope scope;
  for (const OwnedSound& sound : sounds) {
    (void)queue.put(sound.view());
    queue.publish();
    while (queue.take() != nullptr) {
    }
  }
  EXPECT_EQ(scope.allocations(), 0U);
}

TEST(SoundQueue, CrossesBetweenThreadsInOrder) {
  SoundQueue queue(smallCapacity());
  constexpr int kSounds = 20000;
  std::thread simulation([&queue] {
    OwnedSound sound;
    for (int number = 0; number < kSounds;) {
      sound.peak = number;
      sound.clicks.assign(static_cast<std::size_t>(number % 5), Click{});
      sound.ears.resize(sound.clicks.size());
      for (Click& click : sound.clicks)
        click.first = number;
      if (queue.put(sound.view())) ++number;
      queue.publish();
    }
  });
  for (int number = 0; number < kSounds;) {
    const ScheduledSound* taken = queue.take();
    if (taken == nullptr) continue;
    EXPECT_EQ(taken->peak, number);
    ASSERT_EQ(taken->clicks.size(), static_cast<std::size_t>(number % 5));
    for (const Click& click : taken->clicks)
      ASSERT_EQ(click.first, number);
    ++number;
  }
  simulation.join();
}

}  // namespace
}  // namespace carom::plugin
