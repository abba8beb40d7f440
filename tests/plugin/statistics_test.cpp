#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <gtest/gtest.h>

#include "plugin/realtime/statistics_fields.h"

namespace carom::plugin {
namespace {

// Every member of SoundStatistics is in the lists once: names all of them, and does not compile
// when there is one more or less.
TEST(Statistics, ListsHoldEveryMemberOnce) {
  const SoundStatistics statistics;
  const auto& [events, immovable, rejected, skipped, silenced, inaudible, stolen, overBudget, noBus,
               tooLong, modalVoicesExhausted, queueFaults, rings, late, slides, slidesInaudible,
               slidesLeftOut, stalls, jumps, voices, buses, ringing, modes, cpuShare, worstBlock,
               gainReduction, solvedShapes, shapesSolvedInStep, unsolvedBodies, links,
               unsupportedContacts, unsolvedReason] = statistics;
  for (const std::uint64_t* count : {&events,
                                     &immovable,
                                     &rejected,
                                     &skipped,
                                     &silenced,
                                     &inaudible,
                                     &stolen,
                                     &overBudget,
                                     &noBus,
                                     &tooLong,
                                     &modalVoicesExhausted,
                                     &queueFaults,
                                     &rings,
                                     &late,
                                     &slides,
                                     &slidesInaudible,
                                     &slidesLeftOut,
                                     &stalls,
                                     &jumps,
                                     &voices,
                                     &buses,
                                     &ringing,
                                     &modes,
                                     &solvedShapes,
                                     &shapesSolvedInStep,
                                     &unsolvedBodies,
                                     &links,
                                     &unsupportedContacts})
    EXPECT_EQ(std::ranges::count_if(
                  kStatisticsCounts,
                  [&](const auto& field) { return &(statistics.*field.member) == count; }),
              1)
        << "member " << count - &events << "; add it to plugin/realtime/statistics_fields.h";
  for (const double* measure : {&cpuShare, &worstBlock, &gainReduction})
    EXPECT_EQ(std::ranges::count_if(
                  kStatisticsMeasures,
                  [&](const auto& field) { return &(statistics.*field.member) == measure; }),
              1);
  EXPECT_TRUE(unsolvedReason.empty());
}

TEST(Statistics, CountsOfTwoPartsAddUpAndValuesOfTheMomentAreTheLaterParts) {
  SoundStatistics later;
  later.events = 2;
  later.slidesLeftOut = 3;
  later.voices = 4;
  later.cpuShare = 0.1;
  later.worstBlock = 0.2;
  later.gainReduction = 3.0;
  SoundStatistics earlier;
  earlier.events = 20;
  earlier.slidesLeftOut = 30;
  earlier.voices = 40;
  earlier.cpuShare = 0.5;
  earlier.worstBlock = 0.1;
  earlier.gainReduction = 6.0;
  earlier.unsolvedReason = "open";
  addEarlier(later, earlier);
  EXPECT_EQ(later.events, 22U);
  EXPECT_EQ(later.slidesLeftOut, 33U);
  EXPECT_EQ(later.voices, 4U);
  EXPECT_EQ(later.cpuShare, 0.1);
  EXPECT_EQ(later.worstBlock, 0.2);
  EXPECT_EQ(later.gainReduction, 6.0);
  EXPECT_EQ(later.unsolvedReason, "open");
}

}  // namespace
}  // namespace carom::plugin
