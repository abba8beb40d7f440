#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>

#include <gtest/gtest.h>

#include "plugin/realtime/statistics_fields.h"

namespace carom::plugin {
namespace {

/// Number of the members of the list that are at this address.
template <class Fields, class Number>
auto timesListed(const Fields& fields, const SoundStatistics& statistics, const Number& member) {
  return std::ranges::count_if(
      fields, [&](const auto& field) { return &(statistics.*field.member) == &member; });
}

// Every member of SoundStatistics is in the lists once. Those of its base are named, and this does
// not compile when there is one more or less; its own are counted by its size.
TEST(Statistics, ListsHoldEveryMemberOnce) {
  const SoundStatistics statistics;
  const SynthCounters& base = statistics;
  const auto& [events, rings, immovable, inaudible, late, undersampled, rejected, slides,
               inaudibleSlides, stolen, overBudget, noBus, tooLong, modalVoicesExhausted,
               slidesLeftOut, notFinite, unknownBody, noContact, longer, tooFar, slidesInBed,
               maskedSlides, masked, heard, lost, ringsLeftOut, rejectedSlides, silencedFrames] =
      base;
  for (const std::uint64_t* count : {&events,
                                     &rings,
                                     &immovable,
                                     &inaudible,
                                     &late,
                                     &undersampled,
                                     &rejected,
                                     &slides,
                                     &inaudibleSlides,
                                     &stolen,
                                     &overBudget,
                                     &noBus,
                                     &tooLong,
                                     &modalVoicesExhausted,
                                     &slidesLeftOut,
                                     &notFinite,
                                     &unknownBody,
                                     &noContact,
                                     &longer,
                                     &tooFar,
                                     &slidesInBed,
                                     &maskedSlides,
                                     &masked,
                                     &heard,
                                     &lost,
                                     &ringsLeftOut,
                                     &rejectedSlides,
                                     &silencedFrames})
    EXPECT_EQ(timesListed(kStatisticsCounts, statistics, *count), 1)
        << "member " << count - &events << "; add it to plugin/realtime/statistics_fields.h";
  for (const auto& field : kStatisticsCounts)
    EXPECT_EQ(timesListed(kStatisticsCounts, statistics, statistics.*field.member), 1);
  for (const auto& field : kStatisticsMeasures)
    EXPECT_EQ(timesListed(kStatisticsMeasures, statistics, statistics.*field.member), 1);
  EXPECT_EQ(sizeof(SoundStatistics), sizeof(std::uint64_t) * kStatisticsCounts.size() +
                                         sizeof(double) * kStatisticsMeasures.size() +
                                         3 * sizeof(std::string))
      << "a member is not in plugin/realtime/statistics_fields.h";
}

// The sum of two counters is the sum of every member.
TEST(Statistics, EveryCounterOfTheSoundLayerIsAdded) {
  SynthCounters some;
  auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x, y, z, aa, bb] =
      some;
  std::uint64_t next = 1;
  for (std::uint64_t* count : {&a, &b, &c, &d, &e, &f, &g, &h, &i, &j, &k, &l, &m,  &n,
                               &o, &p, &q, &r, &s, &t, &u, &v, &w, &x, &y, &z, &aa, &bb})
    *count = next++;
  const SynthCounters sum = some + some;
  const auto& [a2, b2, c2, d2, e2, f2, g2, h2, i2, j2, k2, l2, m2, n2, o2, p2, q2, r2, s2, t2, u2,
               v2, w2, x2, y2, z2, aa2, bb2] = sum;
  next = 2;
  for (const std::uint64_t* count :
       {&a2, &b2, &c2, &d2, &e2, &f2, &g2, &h2, &i2, &j2, &k2, &l2, &m2,  &n2,
        &o2, &p2, &q2, &r2, &s2, &t2, &u2, &v2, &w2, &x2, &y2, &z2, &aa2, &bb2}) {
    EXPECT_EQ(*count, next);
    next += 2;
  }
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
