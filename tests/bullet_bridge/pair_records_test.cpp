#include "bullet_bridge/tracking/pair_records.h"

#include <vector>

#include <gtest/gtest.h>

namespace carom::bullet {
namespace {

using Step = void (PairRecord::*)();

PairRecord after(const std::vector<Step>& steps) {
  PairRecord record;
  for (const Step step : steps)
    (record.*step)();
  return record;
}

TEST(PairRecord, IsNotNeededUntilSomethingBegins) {
  EXPECT_FALSE(PairRecord().isNeeded());
  for (const Step begin :
       {&PairRecord::beginImpact, &PairRecord::suppressImpacts, &PairRecord::beginContact})
    EXPECT_TRUE(after({begin}).isNeeded());
}

TEST(PairRecord, AnImpactWithinALastingContactLeavesTheContact) {
  PairRecord record = after({&PairRecord::beginContact, &PairRecord::beginImpact});
  EXPECT_TRUE(record.isImpacting());
  EXPECT_TRUE(record.isInContact());
  record.endImpact();
  EXPECT_FALSE(record.isImpacting());
  EXPECT_TRUE(record.isInContact());
}

TEST(PairRecord, AContactMayBeginAndEndWhileImpactsAreSuppressed) {
  PairRecord record = after({&PairRecord::suppressImpacts, &PairRecord::beginContact});
  EXPECT_TRUE(record.isSuppressed());
  EXPECT_TRUE(record.isInContact());
  record.endContact();
  EXPECT_TRUE(record.isSuppressed());
  EXPECT_FALSE(record.isInContact());
}

TEST(PairRecord, WhateverHasBegunAndEndedLeavesNothing) {
  using P = PairRecord;
  const std::vector<std::vector<Step>> ways = {
      {&P::beginImpact, &P::endImpact},
      {&P::suppressImpacts, &P::allowImpacts},
      {&P::beginContact, &P::endContact},
      {&P::beginImpact, &P::beginContact, &P::endImpact, &P::endContact},
      {&P::beginImpact, &P::beginContact, &P::endContact, &P::endImpact},
      {&P::beginContact, &P::suppressImpacts, &P::allowImpacts, &P::endContact},
      {&P::beginImpact, &P::endImpact, &P::suppressImpacts, &P::beginContact, &P::allowImpacts,
       &P::endContact}};
  for (const std::vector<Step>& way : ways)
    EXPECT_FALSE(after(way).isNeeded());
}

TEST(PairRecord, AnImpactAndItsSuppressionExcludeEachOther) {
  EXPECT_FALSE(after({&PairRecord::beginImpact}).isSuppressed());
  EXPECT_FALSE(after({&PairRecord::suppressImpacts}).isImpacting());
}

TEST(PairRecords, KeepWhatIsNeededInTheOrderOfTheKeys) {
  PairRecords records;
  records.add(7, 1, 7).beginContact();
  records.add(3, 1, 3).beginImpact();
  records.add(5, 1, 5);  // not needed
  EXPECT_EQ(records.find(3), nullptr) << "a record made in this substep is found at its end";
  records.endSubstep();
  std::vector<BodyId> others;
  records.forEach([&](const PairRecord& record) { others.push_back(record.other); });
  EXPECT_EQ(others, (std::vector<BodyId>{3, 7}));
  EXPECT_EQ(records.find(5), nullptr);
  ASSERT_NE(records.find(3), nullptr);
  EXPECT_TRUE(records.find(3)->isImpacting());
}

TEST(PairRecords, ARecordInNewUseHasNoState) {
  PairRecords records;
  PairRecord& first = records.add(1, 0, 1);
  first.beginImpact();
  first.idle = 2;
  records.endSubstep();
  records.find(1)->endImpact();
  records.endSubstep();
  const PairRecord& second = records.add(2, 0, 2);
  EXPECT_FALSE(second.isNeeded());
  EXPECT_EQ(second.other, 2u);
  EXPECT_EQ(second.idle, 0);
}

}  // namespace
}  // namespace carom::bullet
