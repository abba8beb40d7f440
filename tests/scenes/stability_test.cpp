// The runner of `carom stability`, and the coverage of its cases. The cases themselves are run by
// the test stability_short.

#include "lab/stability/stability.h"

#include <algorithm>
#include <limits>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace carom {

using namespace lab;
using namespace scenes;

namespace {

using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;

StabilityCase caseOf(const std::string& id, const std::vector<Measurement>& found,
                     StabilityForm least = StabilityForm::brief) {
  return {id,
          "speed",
          "something is done",
          "something is expected",
          [found](StabilityForm /*form*/) { return found; },
          least};
}

StabilityCase throwing(const std::string& id) {
  StabilityCase item = caseOf(id, {});
  item.measure = [](StabilityForm /*form*/) -> std::vector<Measurement> {
    throw std::runtime_error("it broke");
  };
  return item;
}

StabilityReport reportOf(const std::vector<StabilityCase>& cases) {
  return runStability(cases, StabilityForm::full);
}

TEST(Measurement, HoldsBetweenItsBoundsAndNotWhereItIsNoNumber) {
  EXPECT_TRUE(atMost("a", 1.0, 1.0).holds());
  EXPECT_FALSE(atMost("a", 1.0 + 1e-15, 1.0).holds());
  EXPECT_TRUE(atLeast("a", 1.0, 1.0).holds());
  EXPECT_FALSE(atLeast("a", 1.0 - 1e-15, 1.0).holds());
  EXPECT_TRUE(exactly("a", 3.0, 3.0).holds());
  EXPECT_FALSE(exactly("a", 3.0, 4.0).holds());
  EXPECT_TRUE(nearly("a", -99.0, -100.0, 0.02).holds());
  EXPECT_FALSE(nearly("a", -97.0, -100.0, 0.02).holds());
  EXPECT_FALSE(atMost("a", std::numeric_limits<double>::quiet_NaN(), 1.0).holds());
  EXPECT_FALSE(atLeast("a", std::numeric_limits<double>::quiet_NaN(), 1.0).holds());
}

TEST(Stability, OneMeasurementBeyondItsBoundFailsTheRun) {
  const StabilityCase good = caseOf("m.good", {atMost("a", 1.0, 2.0)});
  const StabilityCase bad = caseOf("m.bad", {atMost("a", 1.0, 2.0), atMost("b", 3.0, 2.0, "Pa")});
  EXPECT_EQ(reportOf({good}).exitCode(), 0);
  const StabilityReport report = reportOf({good, bad});
  EXPECT_EQ(report.exitCode(), 1);
  EXPECT_EQ(report.failed(), 1U);
  EXPECT_TRUE(report.verdicts[0].passed());
  EXPECT_FALSE(report.verdicts[1].passed());
  const std::string text = stabilityText(report);
  EXPECT_THAT(text, HasSubstr("1 passed, 1 failed"));
  EXPECT_THAT(text,
              HasSubstr("m.bad failed: something is done\n  expected: something is expected"));
  EXPECT_THAT(text, HasSubstr("<= 2 Pa"));
}

TEST(Stability, ACaseThatThrowsHasFailedAndTheOthersRun) {
  StabilityCase odd = throwing("m.odd");
  odd.measure = [](StabilityForm /*form*/) -> std::vector<Measurement> { throw 7; };
  const StabilityReport report =
      reportOf({throwing("m.broken"), odd, caseOf("m.good", {atMost("a", 1.0, 2.0)})});
  EXPECT_EQ(report.exitCode(), 1);
  ASSERT_THAT(report.verdicts, SizeIs(3));
  EXPECT_EQ(report.verdicts[0].error, "it broke");
  EXPECT_THAT(report.verdicts[1].error, Not(IsEmpty()));
  EXPECT_TRUE(report.verdicts[2].passed());
  EXPECT_THAT(stabilityText(report), HasSubstr("error: it broke"));
}

TEST(Stability, ACaseThatMeasuresNothingHasFailed) {
  EXPECT_EQ(reportOf({caseOf("m.empty", {})}).exitCode(), 1);
}

TEST(Stability, ProgressNamesEachCaseAndEndsAtOne) {
  std::vector<std::string> names;
  std::vector<double> shares;
  runStability({caseOf("m.one", {}), caseOf("m.two", {})}, StabilityForm::full,
               [&](std::string_view id, double share) {
                 names.emplace_back(id);
                 shares.push_back(share);
                 return true;
               });
  EXPECT_EQ(names, (std::vector<std::string>{"m.one", "m.two", ""}));
  EXPECT_EQ(shares, (std::vector<double>{0.0, 0.5, 1.0}));
}

TEST(Stability, ProgressEndsTheRunBeforeACase) {
  const StabilityReport report =
      runStability({caseOf("m.one", {}), caseOf("m.two", {})}, StabilityForm::full,
                   [](std::string_view id, double /*share*/) { return id != "m.two"; });
  ASSERT_EQ(report.verdicts.size(), 1U);
  EXPECT_EQ(report.verdicts[0].of.id, "m.one");
}

std::vector<std::string> idsOf(const std::vector<StabilityCase>& cases) {
  std::vector<std::string> ids;
  ids.reserve(cases.size());
  for (const StabilityCase& item : cases)
    ids.push_back(item.id);
  return ids;
}

TEST(Stability, PatternsSelectByPartsOfIds) {
  const std::vector<StabilityCase> cases = {caseOf("native.mass_ratio", {}),
                                            caseOf("native.after_a_day", {}),
                                            caseOf("click.mass_ratio", {}, StabilityForm::full)};
  const auto select = [&](std::string_view pattern, StabilityForm form = StabilityForm::full) {
    return idsOf(selectCases(cases, form, pattern));
  };
  using Ids = std::vector<std::string>;
  EXPECT_THAT(select(""), SizeIs(3));
  EXPECT_THAT(select("", StabilityForm::brief), SizeIs(2));
  EXPECT_EQ(select("native"), (Ids{"native.mass_ratio", "native.after_a_day"}));
  EXPECT_EQ(select("mass"), (Ids{"native.mass_ratio", "click.mass_ratio"}));
  EXPECT_EQ(select("mass", StabilityForm::brief), (Ids{"native.mass_ratio"}));
  EXPECT_EQ(select("native*day"), (Ids{"native.after_a_day"}));
  EXPECT_EQ(select("native*"), (Ids{"native.mass_ratio", "native.after_a_day"}));
  EXPECT_THAT(select("day*native"), IsEmpty());
  EXPECT_THAT(select("jello"), IsEmpty());
}

TEST(Stability, JsonHasItsKeysAndNullForWhatIsUnbounded) {
  const nlohmann::ordered_json report = stabilityJson(
      reportOf({caseOf("m.one", {atMost("a", 1.0, 2.0, "Pa"),
                                 exactly("b", std::numeric_limits<double>::infinity(), 0.0)}),
                throwing("m.two")}));
  const auto keysOf = [](const nlohmann::ordered_json& object) {
    std::set<std::string> keys;
    for (const auto& [key, value] : object.items())
      keys.insert(key);
    return keys;
  };
  using Keys = std::set<std::string>;
  EXPECT_EQ(keysOf(report), (Keys{"form", "passed", "failed", "took_s", "cases"}));
  EXPECT_EQ(report["form"], "full");
  EXPECT_EQ(report["passed"], 0);
  EXPECT_EQ(report["failed"], 2);
  const nlohmann::ordered_json& one = report["cases"][0];
  EXPECT_EQ(keysOf(one), (Keys{"case", "module", "topic", "summary", "expected", "short", "passed",
                               "took_s", "measurements"}));
  EXPECT_EQ(one["module"], "m");
  const nlohmann::ordered_json& a = one["measurements"][0];
  EXPECT_EQ(keysOf(a), (Keys{"name", "value", "unit", "low", "high", "passed"}));
  EXPECT_TRUE(a["low"].is_null());
  EXPECT_EQ(a["high"], 2.0);
  EXPECT_EQ(a["unit"], "Pa");
  EXPECT_EQ(a["passed"], true);
  EXPECT_TRUE(one["measurements"][1]["value"].is_null());
  EXPECT_EQ(report["cases"][1]["error"], "it broke");
}

// ---- Coverage of the cases

TEST(StabilityCases, HaveUniqueIdsOfAModuleAndSayWhatTheyDoAndExpect) {
  std::set<std::string> ids;
  for (const StabilityCase& item : stabilityCases()) {
    EXPECT_TRUE(ids.insert(item.id).second) << item.id;
    EXPECT_EQ(std::ranges::count(item.id, '.'), 1) << item.id;
    EXPECT_THAT(item.module(),
                testing::AnyOf("native", "bullet", "hertz", "click", "modal", "contact", "jello",
                               "room", "head", "moving", "crossed", "run"));
    EXPECT_THAT(stabilityTopics(), Contains(item.topic)) << item.id;
    EXPECT_FALSE(item.summary.empty()) << item.id;
    EXPECT_FALSE(item.expectation.empty()) << item.id;
    EXPECT_TRUE(item.measure) << item.id;
  }
}

struct Range {
  std::string topic;
  std::string module;
};

// The cases cover each promised range in each module that has it, in the short form too.
TEST(StabilityCases, CoverEachTopicInTheModulesThatHaveIt) {
  const std::vector<StabilityCase> cases = selectCases(stabilityCases(), StabilityForm::brief, "");
  for (const Range& range : std::vector<Range>{{"stiffness", "native"},
                                               {"stiffness", "hertz"},
                                               {"stiffness", "click"},
                                               {"mass ratio", "native"},
                                               {"mass ratio", "bullet"},
                                               {"mass ratio", "click"},
                                               {"mass ratio", "jello"},
                                               {"radius", "native"},
                                               {"radius", "bullet"},
                                               {"radius", "hertz"},
                                               {"radius", "click"},
                                               {"speed", "native"},
                                               {"speed", "bullet"},
                                               {"speed", "hertz"},
                                               {"speed", "click"},
                                               {"speed", "contact"},
                                               {"restitution", "native"},
                                               {"restitution", "bullet"},
                                               {"restitution", "click"},
                                               {"grazing", "native"},
                                               {"grazing", "bullet"},
                                               {"simultaneous contacts", "native"},
                                               {"simultaneous contacts", "bullet"},
                                               {"simultaneous contacts", "click"},
                                               {"stacks and piles", "native"},
                                               {"stacks and piles", "bullet"},
                                               {"sample rate", "click"},
                                               {"sample rate", "modal"},
                                               {"sample rate", "contact"},
                                               {"distance", "click"},
                                               {"jello steps", "jello"},
                                               {"modes", "modal"},
                                               {"rooms", "room"},
                                               {"heads", "head"},
                                               {"moving listeners", "moving"},
                                               {"limits of runs", "run"},
                                               {"nonsense", "crossed"},
                                               {"24 hours", "native"},
                                               {"24 hours", "bullet"},
                                               {"24 hours", "click"},
                                               {"24 hours", "modal"},
                                               {"24 hours", "contact"},
                                               {"nonsense", "native"},
                                               {"nonsense", "bullet"},
                                               {"nonsense", "click"},
                                               {"nonsense", "modal"},
                                               {"nonsense", "contact"},
                                               {"nonsense", "jello"}}) {
    const bool covered = std::ranges::any_of(cases, [&](const StabilityCase& item) {
      return item.topic == range.topic && item.module() == range.module;
    });
    EXPECT_TRUE(covered) << range.topic << " in " << range.module;
  }
}

TEST(StabilityCases, AreListedWithWhatTheyExpect) {
  const std::string text = stabilityListText(stabilityCases());
  EXPECT_THAT(text, AllOf(HasSubstr("native.galperin\n"), HasSubstr("  expected: ")));
  const nlohmann::ordered_json list = stabilityListJson(stabilityCases());
  EXPECT_EQ(list["cases"].size(), stabilityCases().size());
}

}  // namespace
}  // namespace carom
