#include "tests/bench/figure_comparison.h"

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace carom::test {
namespace {

using namespace bench;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// A document with figures like those of ./bench, but without the keys that no comparison uses.
std::string document(const std::string& figures, const char* isShort = "false") {
  return std::string(R"({"benchmarks": {"native": {"short": )") + isShort + R"(, "figures": [)" +
         figures + "]}}}";
}

std::string figure(const std::string& name, const std::string& value, const std::string& ratio,
                   const std::string& better, const std::string& noise = "0") {
  return R"({"name": ")" + name + R"(", "unit": "1", "better": ")" + better + R"(", "noise": )" +
         noise + ", " + value + ", " + ratio + "}";
}

const std::string kNoRatio = R"("ratio": null, "ratio_low": null, "ratio_high": null)";
const std::string kNoValue = R"("value": null, "value_low": null, "value_high": null)";
const std::string kHundred = R"("value": 100, "value_low": 99, "value_high": 101)";

StoredRun runOf(const std::string& figures, const char* isShort = "false") {
  const Result<StoredRun> run = parseRun(document(figures, isShort), "hand.json");
  EXPECT_TRUE(run) << run.error().message;
  return *run;
}

ComparedFigure onlyFigure(const std::string& then, const std::string& now) {
  const auto figures = compareRuns(runOf(then), runOf(now));
  EXPECT_TRUE(figures);
  EXPECT_EQ(figures->size(), 1u);
  return figures->front();
}

TEST(FigureComparison, JudgesByTheRatioToTheYardstickAndNotByTheValue) {
  // The machine is half as fast, and its yardstick is as well.
  const std::string then = figure("gas", R"("value": 100, "value_low": 99, "value_high": 101)",
                                  R"("ratio": 2, "ratio_low": 1.99, "ratio_high": 2.01)", "higher");
  const std::string slower =
      figure("gas", R"("value": 50, "value_low": 49, "value_high": 51)",
             R"("ratio": 2.02, "ratio_low": 2.0, "ratio_high": 2.03)", "higher");
  EXPECT_EQ(onlyFigure(then, slower).verdict, FigureVerdict::same);
  const std::string worse =
      figure("gas", kHundred, R"("ratio": 1, "ratio_low": 0.99, "ratio_high": 1.01)", "higher");
  EXPECT_EQ(onlyFigure(then, worse).verdict, FigureVerdict::worse);
  EXPECT_DOUBLE_EQ(onlyFigure(then, worse).gain, 0.5);
  EXPECT_EQ(onlyFigure(worse, then).verdict, FigureVerdict::better);
  EXPECT_DOUBLE_EQ(onlyFigure(worse, then).gain, 2.0);
}

TEST(FigureComparison, KnowsThatLessIsBetterWhereItIs) {
  const std::string few =
      figure("time", kHundred, R"("ratio": 4, "ratio_low": 3.9, "ratio_high": 4.1)", "lower");
  const std::string many =
      figure("time", kHundred, R"("ratio": 5, "ratio_low": 4.9, "ratio_high": 5.1)", "lower");
  EXPECT_EQ(onlyFigure(few, many).verdict, FigureVerdict::worse);
  EXPECT_DOUBLE_EQ(onlyFigure(few, many).gain, 0.8);
  EXPECT_EQ(onlyFigure(many, few).verdict, FigureVerdict::better);
  EXPECT_DOUBLE_EQ(onlyFigure(many, few).gain, 1.25);
}

TEST(FigureComparison, IsTheSameWhereTheSpreadsOverlap) {
  const std::string wide =
      figure("gas", kHundred, R"("ratio": 1, "ratio_low": 0.4, "ratio_high": 1.5)", "higher");
  const std::string half =
      figure("gas", kHundred, R"("ratio": 0.5, "ratio_low": 0.45, "ratio_high": 0.55)", "higher");
  EXPECT_EQ(onlyFigure(wide, half).verdict, FigureVerdict::same);
  EXPECT_FALSE(onlyFigure(wide, half).isBelow(0.6));
}

TEST(FigureComparison, IsTheSameBelowFivePercent) {
  const auto exact = [](const char* ratio) {
    return figure("gas", kHundred,
                  std::string(R"("ratio": )") + ratio + R"(, "ratio_low": )" + ratio +
                      R"(, "ratio_high": )" + ratio,
                  "higher");
  };
  EXPECT_EQ(onlyFigure(exact("1"), exact("0.96")).verdict, FigureVerdict::same);
  EXPECT_EQ(onlyFigure(exact("1"), exact("0.94")).verdict, FigureVerdict::worse);
  EXPECT_EQ(onlyFigure(exact("1"), exact("1.06")).verdict, FigureVerdict::better);
}

TEST(FigureComparison, IsTheSameInShortRunsUntilItIsHalfAsMuchAgain) {
  const auto exact = [](const std::string& ratio) {
    return runOf(figure("time", kHundred,
                        R"("ratio": )" + ratio + R"(, "ratio_low": )" + ratio +
                            R"(, "ratio_high": )" + ratio,
                        "lower"),
                 "true");
  };
  EXPECT_EQ(compareRuns(exact("1"), exact("1.4"))->front().verdict, FigureVerdict::same);
  EXPECT_EQ(compareRuns(exact("1"), exact("1.6"))->front().verdict, FigureVerdict::worse);
  EXPECT_EQ(compareRuns(exact("1"), exact("0.6"))->front().verdict, FigureVerdict::better);
}

TEST(FigureComparison, IsTheSameWithinTheFiguresOwnNoise) {
  // The figure is a share of Bullet's step in percent, which may be negative near 0.
  const auto share = [](const char* value, const char* ratio) {
    return figure("bridge",
                  std::string(R"("value": )") + value + R"(, "value_low": )" + value +
                      R"(, "value_high": )" + value,
                  std::string(R"("ratio": )") + ratio + R"(, "ratio_low": )" + ratio +
                      R"(, "ratio_high": )" + ratio,
                  "lower", "3");
  };
  EXPECT_EQ(onlyFigure(share("-0.5", "-0.005"), share("2", "0.02")).verdict, FigureVerdict::same);
  const ComparedFigure worse = onlyFigure(share("-0.5", "-0.005"), share("9", "0.09"));
  EXPECT_EQ(worse.verdict, FigureVerdict::worse);
  EXPECT_TRUE(worse.isBelow(0.5));
}

TEST(FigureComparison, OfNothingSomethingIsWorseWhereLessIsBetter) {
  const auto allocations = [](const char* count) {
    return figure("allocations",
                  std::string(R"("value": )") + count + R"(, "value_low": )" + count +
                      R"(, "value_high": )" + count,
                  kNoRatio, "lower");
  };
  EXPECT_EQ(onlyFigure(allocations("0"), allocations("0")).verdict, FigureVerdict::same);
  const ComparedFigure worse = onlyFigure(allocations("0"), allocations("5"));
  EXPECT_EQ(worse.verdict, FigureVerdict::worse);
  EXPECT_EQ(worse.gain, 0.0);
  const ComparedFigure better = onlyFigure(allocations("5"), allocations("0"));
  EXPECT_EQ(better.verdict, FigureVerdict::better);
  EXPECT_TRUE(std::isinf(better.gain));
}

TEST(FigureComparison, NamesWhatIsMissingOnEitherSide) {
  const std::string one = figure("one", kHundred, kNoRatio, "higher");
  const std::string two = figure("two", kHundred, kNoRatio, "higher");
  const auto figures = *compareRuns(runOf(one), runOf(two));
  ASSERT_EQ(figures.size(), 2u);
  EXPECT_EQ(figures[0].verdict, FigureVerdict::onlyNow);
  EXPECT_EQ(figures[0].any().name, "two");
  EXPECT_EQ(figures[1].verdict, FigureVerdict::onlyThen);
  EXPECT_EQ(figures[1].any().name, "one");
  EXPECT_FALSE(figures[1].isBelow(0.5));
}

TEST(FigureComparison, TakesWhatWasNotMeasuredForMissing) {
  const std::string measured = figure("gas", kHundred, kNoRatio, "higher");
  const std::string failed = figure("gas", kNoValue, kNoRatio, "higher");
  EXPECT_EQ(onlyFigure(measured, failed).verdict, FigureVerdict::onlyThen);
  EXPECT_EQ(onlyFigure(failed, measured).verdict, FigureVerdict::onlyNow);
}

TEST(FigureComparison, LeavesOutBenchmarksThatWereNotAskedForButNotThoseThatGaveNothing) {
  const StoredRun then = runOf(figure("gas", kHundred, kNoRatio, "higher"));
  EXPECT_THAT(*compareRuns(then, *parseRun(R"({"benchmarks": {}})", "")), IsEmpty());
  const auto figures = *compareRuns(then, *parseRun(R"({"benchmarks": {"native": null}})", ""));
  ASSERT_EQ(figures.size(), 1u);
  EXPECT_EQ(figures[0].verdict, FigureVerdict::onlyThen);
}

TEST(FigureComparison, RefusesAShortRunBesideAFullOne) {
  const std::string gas = figure("gas", kHundred, kNoRatio, "higher");
  const auto figures = compareRuns(runOf(gas, "true"), runOf(gas, "false"));
  ASSERT_FALSE(figures);
  EXPECT_THAT(figures.error().message, AllOf(HasSubstr("a short run"), HasSubstr("--short")));
}

/// Figures that are worse than the stored ones by these gains.
std::vector<ComparedFigure> withGains(const std::vector<std::pair<std::string, double>>& gains) {
  std::vector<ComparedFigure> figures;
  for (const auto& [name, gain] : gains) {
    StoredFigure stored;
    stored.benchmark = "native";
    stored.name = name;
    ComparedFigure figure;
    figure.then = figure.now = stored;
    figure.gain = gain;
    figure.verdict = FigureVerdict::worse;
    figures.push_back(figure);
  }
  return figures;
}

TEST(FigureComparison, FailsOnlyOnWhatIsBelowInEveryRun) {
  const auto first = withGains({{"one", 0.4}, {"two", 0.4}, {"three", 0.6}});
  const auto second = withGains({{"one", 0.7}, {"two", 0.3}, {"three", 0.1}});
  std::vector<std::string> names;
  for (const ComparedFigure& figure : failing({first, second}, 0.5))
    names.push_back(figure.any().name);
  EXPECT_THAT(names, ElementsAre("two"));
  EXPECT_EQ(failing({first}, 0.5).size(), 2u);
  EXPECT_THAT(failing({first, {}}, 0.5), IsEmpty());
}

std::string refusal(const std::string& text) {
  const Result<StoredRun> run = parseRun(text, "bad.json");
  return run ? "" : run.error().message;
}

TEST(FigureComparison, RefusesABadFileWithWhatWhereAndWhatIsWanted) {
  EXPECT_THAT(refusal("{"), AllOf(HasSubstr("bad.json"), HasSubstr("not JSON")));
  EXPECT_THAT(refusal("[]"), AllOf(HasSubstr("/benchmarks is missing"), HasSubstr("an object")));
  EXPECT_THAT(refusal(R"({"benchmarks": 3})"), HasSubstr("/benchmarks is number; an object"));
  EXPECT_THAT(refusal(R"({"benchmarks": {"a": {"short": false}}})"),
              HasSubstr("/benchmarks/a/figures is missing; an array"));
  EXPECT_THAT(refusal(document(figure("gas", R"("value": "fast")", kNoRatio, "higher"))),
              HasSubstr("/benchmarks/native/figures/0/value is string; a number or null"));
  EXPECT_THAT(refusal(document(figure("gas", kHundred, kNoRatio, "faster"))),
              HasSubstr(R"(/figures/0/better is string; "higher" or "lower")"));
  EXPECT_THAT(refusal(R"({"benchmarks": {"a": {"short": false, "figures": []},
                                         "b": {"short": true, "figures": []}}})"),
              HasSubstr("/benchmarks/b/short"));
}

TEST(FigureComparison, RefusesAFileThatIsNotThere) {
  const Result<StoredRun> run = readRun("/nowhere/baseline.json");
  ASSERT_FALSE(run);
  EXPECT_THAT(run.error().message, AllOf(HasSubstr("/nowhere/baseline.json"), HasSubstr("cannot")));
}

}  // namespace
}  // namespace carom::test
