#include "carom/native/restitution.h"

#include <limits>
#include <string>

#include <gtest/gtest.h>

namespace carom {
namespace {

TEST(RestitutionTable, PairsItHoldsHaveTheirOwnAndAllOthersTheMean) {
  RestitutionTable table;
  EXPECT_TRUE(table.empty());
  ASSERT_TRUE(table.set(7, 2, 0.3));
  ASSERT_TRUE(table.set(2, 2, 0.1));
  ASSERT_TRUE(table.set(1, 9, 1.0));
  EXPECT_EQ(table.size(), 3u);
  EXPECT_EQ(table.of(2, 0.9, 7, 0.8), 0.3);
  EXPECT_EQ(table.of(7, 0.8, 2, 0.9), 0.3);
  EXPECT_EQ(table.of(2, 0.9, 2, 0.9), 0.1);
  EXPECT_EQ(table.of(9, 0.0, 1, 0.0), 1.0);
  EXPECT_DOUBLE_EQ(table.of(7, 0.25, 7, 1.0), 0.5);
  EXPECT_DOUBLE_EQ(table.of(0, 0.81, 0, 0.81), 0.81);
}

TEST(RestitutionTable, AnEmptyOneIsTheMeanBitForBit) {
  const RestitutionTable table;
  for (double restitution = 0.0; restitution <= 1.0; restitution += 0.013)
    EXPECT_EQ(table.of(3, restitution, 4, 0.7), combinedRestitution(restitution, 0.7));
}

TEST(RestitutionTable, RefusesASecondRestitutionOfAPairAndImpossibleOnes) {
  RestitutionTable table;
  ASSERT_TRUE(table.set(1, 2, 0.5));
  for (const Status& twice : {table.set(1, 2, 0.5), table.set(2, 1, 0.6)}) {
    ASSERT_FALSE(twice);
    EXPECT_NE(twice.error().message.find("have a restitution already, 0.5"), std::string::npos);
  }
  for (const double bad : {-0.1, 1.1, std::numeric_limits<double>::quiet_NaN()}) {
    const Status refused = table.set(1, 3, bad);
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().message.find("from 0 to 1"), std::string::npos);
  }
  EXPECT_EQ(table.size(), 1u);
}

}  // namespace
}  // namespace carom
