#include "tests/bench/figure_comparison.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <functional>
#include <limits>
#include <sstream>
#include <utility>

#include <nlohmann/json.hpp>

namespace carom::bench {
namespace {

using Json = nlohmann::json;

// Factors by which two runs differ on a machine that others use, however small their spreads are.
constexpr double kLeastGain = 1.05;
constexpr double kLeastShortGain = 1.5;

/// Reads one document; keeps the first error and ignores everything after it.
class RunReader {
 public:
  explicit RunReader(std::string file) : file_(std::move(file)) {}

  Result<StoredRun> read(const Json& document) {
    const Json* benchmarks = member(document, "", "benchmarks", "an object", &Json::is_object);
    if (benchmarks != nullptr) {
      for (const auto& [name, benchmark] : benchmarks->items())
        readBenchmark(name, benchmark);
    }
    if (!wrong_.empty()) return Error{file_ + ": " + wrong_};
    return std::move(run_);
  }

 private:
  void readBenchmark(const std::string& name, const Json& benchmark) {
    const std::string place = "/benchmarks/" + name;
    run_.benchmarks.push_back(name);
    if (benchmark.is_null()) return;
    const Json* isShort = member(benchmark, place, "short", "true or false", &Json::is_boolean);
    const Json* figures = member(benchmark, place, "figures", "an array", &Json::is_array);
    if (isShort == nullptr || figures == nullptr) return;
    if (run_.isShort && run_.isShort != isShort->get<bool>())
      refuse(place + "/short", "is another than before; either all runs are short or none is");
    run_.isShort = isShort->get<bool>();
    for (std::size_t index = 0; index < figures->size(); ++index)
      readFigure(name, (*figures)[index], place + "/figures/" + std::to_string(index));
  }

  void readFigure(const std::string& benchmark, const Json& json, const std::string& place) {
    const Json* name = member(json, place, "name", "a string", &Json::is_string);
    const Json* unit = member(json, place, "unit", "a string", &Json::is_string);
    const Json* better = member(json, place, "better", R"("higher" or "lower")", &isSense);
    if (name == nullptr || unit == nullptr || better == nullptr) return;
    StoredFigure figure;
    figure.benchmark = benchmark;
    figure.name = *name;
    figure.unit = *unit;
    figure.higherIsBetter = *better == "higher";
    figure.value = readNumber(json, place, "value");
    figure.ratio = readNumber(json, place, "ratio");
    figure.noise = readOptional(json, place, "noise").value_or(0.0);
    run_.figures.push_back(std::move(figure));
  }

  std::optional<StoredNumber> readNumber(const Json& json, const std::string& place,
                                         const std::string& key) {
    const std::optional<double> median = readOptional(json, place, key);
    const std::optional<double> low = readOptional(json, place, key + "_low");
    const std::optional<double> high = readOptional(json, place, key + "_high");
    if (!median || !low || !high) return std::nullopt;
    return StoredNumber{*median, *low, *high};
  }

  std::optional<double> readOptional(const Json& json, const std::string& place,
                                     const std::string& key) {
    const Json* number = member(json, place, key, "a number or null", &isNumberOrNull);
    if (number == nullptr || number->is_null()) return std::nullopt;
    return number->get<double>();
  }

  template <class Accepts>
  const Json* member(const Json& json, const std::string& place, const std::string& key,
                     const char* wanted, Accepts accepts) {
    if (!json.is_object() || !json.contains(key)) {
      refuse(place + "/" + key, std::string("is missing; ") + wanted + " is wanted");
      return nullptr;
    }
    const Json& found = json[key];
    if (std::invoke(accepts, found)) return &found;
    refuse(place + "/" + key, std::string("is ") + found.type_name() + "; " + wanted +
                                  " is wanted, as ./bench --json prints it");
    return nullptr;
  }

  static bool isSense(const Json& json) { return json == "higher" || json == "lower"; }
  static bool isNumberOrNull(const Json& json) { return json.is_number() || json.is_null(); }

  void refuse(const std::string& place, const std::string& why) {
    if (wrong_.empty()) wrong_ = place + " " + why;
  }

  std::string file_;
  std::string wrong_;
  StoredRun run_;
};

bool overlap(const StoredNumber& one, const StoredNumber& other) {
  return one.low <= other.high && other.low <= one.high;
}

/// Factor by which `now` is better than `then`.
double gainOf(double then, double now, bool higherIsBetter) {
  if (then == now) return 1.0;
  const double more = higherIsBetter ? now : then;
  const double less = higherIsBetter ? then : now;
  // A ratio is meaningless if one of the values is zero or they differ in sign.
  if (!(more > 0.0 && less > 0.0))
    return more > less ? std::numeric_limits<double>::infinity() : 0.0;
  return more / less;
}

FigureVerdict judge(const StoredFigure& then, const StoredFigure& now, double gain, double least) {
  if (std::abs(now.value->median - then.value->median) < now.noise) return FigureVerdict::same;
  const bool byRatio = then.ratio && now.ratio;
  if (byRatio ? overlap(*then.ratio, *now.ratio) : overlap(*then.value, *now.value))
    return FigureVerdict::same;
  if (gain < least && gain > 1.0 / least) return FigureVerdict::same;
  return gain > 1.0 ? FigureVerdict::better : FigureVerdict::worse;
}

ComparedFigure compared(const StoredFigure* then, const StoredFigure* now, double least) {
  ComparedFigure figure;
  if (then != nullptr) figure.then = *then;
  if (now != nullptr) figure.now = *now;
  const bool wasThere = then != nullptr && then->value;
  const bool isThere = now != nullptr && now->value;
  if (!wasThere || !isThere) {
    figure.verdict = wasThere ? FigureVerdict::onlyThen : FigureVerdict::onlyNow;
    return figure;
  }
  const bool byRatio = then->ratio && now->ratio;
  figure.gain = gainOf(byRatio ? then->ratio->median : then->value->median,
                       byRatio ? now->ratio->median : now->value->median, now->higherIsBetter);
  figure.verdict = judge(*then, *now, figure.gain, least);
  return figure;
}

bool isSame(const StoredFigure& one, const StoredFigure& other) {
  return one.benchmark == other.benchmark && one.name == other.name && one.unit == other.unit;
}

template <class Figures>
const StoredFigure* find(const Figures& figures, const StoredFigure& wanted) {
  const auto found = std::ranges::find_if(
      figures, [&](const StoredFigure& figure) { return isSame(figure, wanted); });
  return found == figures.end() ? nullptr : &*found;
}

const char* lengthOf(bool isShort) {
  return isShort ? "short" : "full";
}

}  // namespace

Result<StoredRun> parseRun(const std::string& text, const std::string& name) {
  const Json document = Json::parse(text, nullptr, false);
  if (document.is_discarded())
    return Error{name + ": is not JSON; what ./bench --json prints is wanted"};
  return RunReader(name).read(document);
}

Result<StoredRun> readRun(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  if (!file || !(text << file.rdbuf()))
    return Error{path + ": cannot be read; what ./bench --json has printed is wanted"};
  return parseRun(text.str(), path);
}

const char* nameOf(FigureVerdict verdict) {
  switch (verdict) {
    case FigureVerdict::better:
      return "better";
    case FigureVerdict::same:
      return "same";
    case FigureVerdict::worse:
      return "worse";
    case FigureVerdict::onlyThen:
      return "only then";
    case FigureVerdict::onlyNow:
      return "only now";
  }
  return "";
}

Result<std::vector<ComparedFigure>> compareRuns(const StoredRun& then, const StoredRun& now) {
  if (then.isShort && now.isShort && then.isShort != now.isShort)
    return Error{std::string("a ") + lengthOf(*then.isShort) + " run cannot be compared with a " +
                 lengthOf(*now.isShort) + " one; either both or none is made with --short"};
  const double least = now.isShort.value_or(false) ? kLeastShortGain : kLeastGain;
  std::vector<ComparedFigure> figures;
  for (const StoredFigure& figure : now.figures)
    figures.push_back(compared(find(then.figures, figure), &figure, least));
  for (const StoredFigure& figure : then.figures) {
    const bool isAskedFor =
        std::ranges::find(now.benchmarks, figure.benchmark) != now.benchmarks.end();
    if (isAskedFor && find(now.figures, figure) == nullptr)
      figures.push_back(compared(&figure, nullptr, least));
  }
  return figures;
}

std::vector<ComparedFigure> failing(const std::vector<std::vector<ComparedFigure>>& runs,
                                    double factor) {
  std::vector<ComparedFigure> all;
  if (runs.empty()) return all;
  for (const ComparedFigure& figure : runs.front()) {
    const auto isBelow = [&](const std::vector<ComparedFigure>& run) {
      const auto again = std::ranges::find_if(
          run, [&](const ComparedFigure& other) { return isSame(other.any(), figure.any()); });
      return again != run.end() && again->isBelow(factor);
    };
    if (std::ranges::all_of(runs, isBelow)) all.push_back(figure);
  }
  return all;
}

}  // namespace carom::bench
