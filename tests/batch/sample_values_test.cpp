#include "lab/batch/sample_values.h"

#include <cmath>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "lab/batch/batch_spec.h"
#include "lab/batch/expression.h"
#include "lab/batch/file_hash.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace carom::lab {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::UnorderedElementsAre;

BatchSpec specOf(const json& parameters, int count = 100) {
  json document = {{"scene", "s.json"}, {"seed", 3}, {"count", count}};
  // Braces around one object are that object.
  document["parameters"] = parameters.is_object() ? json::array({parameters}) : parameters;
  return *parseBatch(document.dump(), "b.json");
}

json valueOf(const BatchSpec& spec, std::uint64_t index, const std::string& name,
             std::size_t attempt = 0) {
  const Result<SampleValues> values = drawValues(spec, index, attempt);
  EXPECT_TRUE(values);
  for (const auto& [known, value] : *values)
    if (known == name) return value;
  return {};
}

// FIPS 180-4; NIST's examples of SHA-256.
TEST(Sha256, HasThePublishedValues) {
  EXPECT_EQ(sha256(std::string_view("abc")),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256(std::string_view("")),
            "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
}

TEST(SampleValues, AreTheSameWhateverElseThereIs) {
  const json height = {{"name", "height"}, {"uniform", {0, 1}}};
  const json other = {{"name", "a"}, {"normal", {0, 1}}};
  const BatchSpec alone = specOf({height}, 10);
  const BatchSpec among = specOf({other, height, {{"name", "z"}, {"grid", {1, 2, 3}}}}, 1000);
  for (const std::uint64_t index : {0U, 1U, 9U})
    EXPECT_EQ(valueOf(alone, index, "height"), valueOf(among, index, "height"));
}

TEST(SampleValues, DifferFromSampleToSampleAndFromAttemptToAttempt) {
  const BatchSpec spec =
      specOf({{{"name", "a"}, {"uniform", {0, 1}}}, {{"name", "b"}, {"uniform", {0, 1}}}});
  std::set<double> seen;
  for (std::uint64_t index = 0; index < 100; ++index)
    for (std::size_t attempt = 0; attempt < 3; ++attempt)
      for (const char* const name : {"a", "b"})
        seen.insert(valueOf(spec, index, name, attempt).get<double>());
  EXPECT_EQ(seen.size(), 600U);
}

TEST(SampleValues, TheFirstGridVariesSlowestAndMayGrow) {
  const auto gridOf = [](const json& first) {
    return specOf({{{"name", "a"}, {"grid", first}}, {{"name", "b"}, {"grid", {10, 20}}}});
  };
  const BatchSpec three = gridOf({1, 2, 3});
  std::vector<int> seen;
  for (std::uint64_t index = 0; index < 8; ++index)
    seen.push_back(valueOf(three, index, "a").get<int>() + valueOf(three, index, "b").get<int>());
  EXPECT_EQ(seen, (std::vector<int>{11, 21, 12, 22, 13, 23, 11, 21}));  // it begins anew after six
  const BatchSpec four = gridOf({1, 2, 3, 4});
  for (std::uint64_t index = 0; index < 6; ++index)
    EXPECT_EQ(valueOf(three, index, "a"), valueOf(four, index, "a"));
  EXPECT_EQ(valueOf(four, 6, "a"), 4);
}

// More points than a number of 64 bits counts.
TEST(SampleValues, ManyGridsHaveTheirPlaces) {
  json pairs = json::array();
  for (int at = 0; at < 100; ++at)
    pairs.push_back({{"name", "g" + std::to_string(at)}, {"grid", {0, 1}}});
  const BatchSpec spec = specOf(pairs);
  for (const std::uint64_t index : {std::uint64_t{0}, std::uint64_t{5}, ~std::uint64_t{0}})
    for (unsigned at = 0; at < 100; ++at) {
      const unsigned fromLast = 99 - at;
      const std::uint64_t bit = fromLast < 64 ? index >> fromLast & 1U : 0U;
      EXPECT_EQ(valueOf(spec, index, "g" + std::to_string(at)), bit) << index << ' ' << at;
    }
  json thousands = json::array();
  json values = json::array();
  for (int value = 0; value < 1000; ++value)
    values.push_back(value);
  for (const char* const name : {"a", "b", "c", "d", "e"})
    thousands.push_back({{"name", name}, {"grid", values}});
  const BatchSpec large = specOf(thousands);
  EXPECT_EQ(valueOf(large, 123'456'789, "e"), 789);
  EXPECT_EQ(valueOf(large, 123'456'789, "d"), 456);
  EXPECT_EQ(valueOf(large, 123'456'789, "c"), 123);
  EXPECT_EQ(valueOf(large, 123'456'789, "b"), 0);
}

TEST(SampleValues, KeepToTheirRangesAndFillThem) {
  const BatchSpec spec = specOf({{{"name", "u"}, {"uniform", {-2, 3}}},
                                 {{"name", "w"}, {"uniform", {1, 6}}, {"whole", true}},
                                 {{"name", "l"}, {"log_uniform", {0.001, 1000}}},
                                 {{"name", "n"}, {"normal", {5, 1}}, {"within", {4, 7}}}});
  std::map<int, int> dice;
  int decades = 0;
  for (std::uint64_t index = 0; index < 3000; ++index) {
    const double u = valueOf(spec, index, "u").get<double>();
    EXPECT_TRUE(u >= -2 && u <= 3);
    const json w = valueOf(spec, index, "w");
    EXPECT_TRUE(w.is_number_integer());
    ++dice[w.get<int>()];
    const double l = valueOf(spec, index, "l").get<double>();
    EXPECT_TRUE(l >= 0.001 && l <= 1000);
    decades += l < 0.1 ? 1 : 0;
    const double n = valueOf(spec, index, "n").get<double>();
    EXPECT_TRUE(n >= 4 && n <= 7);
  }
  EXPECT_EQ(dice.size(), 6U);
  EXPECT_TRUE(dice.contains(1) && dice.contains(6));
  EXPECT_NEAR(decades, 1000, 110);  // two of six decades, within four deviations
}

TEST(SampleValues, ChoicesFollowTheirWeights) {
  const BatchSpec spec =
      specOf({{{"name", "c"}, {"choice", {"a", "b", "c"}}, {"weights", {0, 1, 3}}}});
  std::map<std::string, int> counts;
  for (std::uint64_t index = 0; index < 4000; ++index)
    ++counts[valueOf(spec, index, "c").get<std::string>()];
  EXPECT_EQ(counts.count("a"), 0U);
  EXPECT_NEAR(counts["b"], 1000, 110);  // within four deviations
}

TEST(SampleValues, PermutationsHaveAllValuesInEveryOrder) {
  const BatchSpec spec = specOf({{{"name", "p"}, {"permutation", {1, 2, 3}}}});
  std::map<std::string, int> orders;
  for (std::uint64_t index = 0; index < 1200; ++index) {
    const json value = valueOf(spec, index, "p");
    ++orders[value.dump()];
    EXPECT_THAT(value.get<std::vector<int>>(), UnorderedElementsAre(1, 2, 3));
  }
  EXPECT_EQ(orders.size(), 6U);
  for (const auto& [order, count] : orders)
    EXPECT_NEAR(count, 200, 52) << order;  // within four deviations
}

TEST(SampleValues, ExpressionsKnowTheNumbersBeforeThem) {
  const BatchSpec spec = specOf({{{"name", "r"}, {"grid", {2}}},
                                 {{"name", "area"}, {"expression", "4 * pi * r^2"}},
                                 {{"name", "large"}, {"expression", "area > 50 ? 1 : 0"}}});
  EXPECT_NEAR(valueOf(spec, 0, "area").get<double>(), 50.265482457436690, 1e-12);
  EXPECT_EQ(valueOf(spec, 0, "large"), 1.0);
  const BatchSpec wrong = specOf({{{"name", "a"}, {"expression", "b + 1"}}});
  const auto values = drawValues(wrong, 0, 0);
  ASSERT_FALSE(values);
  EXPECT_THAT(values.error().message, HasSubstr("parameter \"a\": \"b + 1\""));
}

TEST(SampleValues, ExpressionsThatAreNoNumberAreRefused) {
  for (const char* const text : {"1 / 0", "sqrt(-1)", "log(-1)", "", "1 +", "(", "a", "1 2"})
    EXPECT_FALSE(carom::lab::valueOf(text, {})) << text;
}

TEST(SampleValues, AreAppliedToTheirPlaces) {
  const json scene = {{"bodies", {{{"radius", 1}}, {{"radius", 1}}}}, {"listeners", {1}}};
  BatchSpec spec =
      specOf({{{"name", "r"}, {"grid", {2}}, {"at", {"/bodies/0/radius"}}},
              {{"name", "m"}, {"grid", {"wood"}}, {"at", "/bodies/1/material"}},
              {{"name", "p"}, {"permutation", {7, 7}}, {"at", {"/bodies/0/x", "/bodies/1/x"}}}});
  spec.listeners = json({5, 6});
  const BatchBranch branch{"other", {{"/bodies/1/radius", 9}}};
  const auto made = applied(spec, *drawValues(spec, 0, 0), branch, scene);
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(*made,
            json({{"bodies",
                   {{{"radius", 2}, {"x", 7}}, {{"radius", 9}, {"material", "wood"}, {"x", 7}}}},
                  {"listeners", {5, 6}}}));
}

TEST(SampleValues, SplitsKeepEqualValuesTogether) {
  BatchSpec spec = specOf({{{"name", "m"}, {"choice", {1, 2, 3, 4, 5, 6, 7, 8, 9, 10}}}}, 2000);
  spec.split = {.by = {"m"}, .validation = 0.2, .test = 0.3};
  std::map<json, std::set<std::string>> sides;
  for (std::uint64_t index = 0; index < 300; ++index) {
    const SampleValues values = *drawValues(spec, index, 0);
    sides[values[0].second].insert(splitOf(spec, index, values));
  }
  for (const auto& [value, side] : sides)
    EXPECT_EQ(side.size(), 1U) << value;
  spec.split.by.clear();
  std::map<std::string, int> shares;
  for (std::uint64_t index = 0; index < 2000; ++index)
    ++shares[splitOf(spec, index, *drawValues(spec, index, 0))];
  EXPECT_NEAR(shares["validation"], 400, 72);  // within four deviations
  EXPECT_NEAR(shares["test"], 600, 82);
}

}  // namespace
}  // namespace carom::lab
