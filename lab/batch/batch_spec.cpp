#include "lab/batch/batch_spec.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "lab/batch/expression.h"

#include "modal/json/json_reader.h"

namespace carom::lab {

using modal::FirstError;
using modal::inQuotes;
using modal::Interval;
using modal::JsonNode;
using modal::NumberRange;
using modal::TextRange;

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr double kMostSamples = 1e9;
constexpr double kMostSeed = 9007199254740992.0;  // 2^53, up to which a double has every integer
constexpr std::size_t kMostParameters = 256;
constexpr std::size_t kMostValues = 100'000;
constexpr std::size_t kMostBranches = 64;
constexpr std::size_t kMostPointers = 1000;
constexpr std::size_t kMostScenes = 1000;

constexpr NumberRange kCount{"a number of samples", 1, kMostSamples, "", false, false, true};
constexpr NumberRange kSeed{"a seed", 0, kMostSeed, "", false, false, true};
constexpr NumberRange kValue{"a value", -1e300, 1e300};
constexpr NumberRange kDeviation{"a deviation", 0, 1e300, "", true};
constexpr NumberRange kWeight{"a weight", 0, 1e9};
constexpr NumberRange kReach{"a distance", 0, 1e6, "metres", true};
constexpr NumberRange kRate{"a rate", 0, 10'000, "Hz"};
constexpr NumberRange kShare{"a share", 0, 1};
constexpr NumberRange kPressure{"a pressure", 0, 1e6, "Pa"};
constexpr NumberRange kAttempts{"a number of attempts", 1, 10'000, "", false, false, true};
constexpr NumberRange kTime{"a time", 1e-3, 1e6, "seconds"};
constexpr NumberRange kMemory{"an amount of memory", 50e6, 1e18, "bytes"};
constexpr NumberRange kEvents{"a number of events", 1, 1e15, "", false, false, true};
constexpr TextRange kFile{"a file name", 1, 1000};
constexpr TextRange kTitle{"a name", 1, 100};
constexpr TextRange kProse{"a description", 0, 10'000, true};
constexpr TextRange kPointer{"a JSON pointer", 1, 1000};
constexpr TextRange kExpression{"an expression", 1, 1000};
constexpr TextRange kWord{"a name", 1, 64};

constexpr std::size_t kKinds = 7;
constexpr const char* kKindNames[kKinds] = {"grid",   "choice",      "uniform",   "log_uniform",
                                            "normal", "permutation", "expression"};
constexpr const char* kKindList =
    "one of \"grid\", \"choice\", \"uniform\", \"log_uniform\", \"normal\", \"permutation\" and "
    "\"expression\"";

/// True for what can stand in an expression and in the name of a file.
bool isWord(const std::string& text) {
  return !text.empty() && (text.front() < '0' || text.front() > '9') &&
         text.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_") == std::string::npos;
}

/// True for what JSON can say.
bool isUtf8(const std::string& text) {
  const std::string said = json(text).dump(-1, ' ', false, json::error_handler_t::replace);
  return said.find("\xEF\xBF\xBD") == std::string::npos;
}

/// Returns the names of files that a pattern with one star in its last part stands for, in the
/// order of their bytes, as the pattern writes them.
std::vector<std::string> filesLike(const std::string& pattern, const fs::path& folder) {
  const fs::path part = fs::path(pattern).parent_path();
  const std::string last = fs::path(pattern).filename().string();
  const std::size_t star = last.find('*');
  const std::string begin = last.substr(0, star);
  const std::string end = star == std::string::npos ? "" : last.substr(star + 1);
  std::vector<std::string> names;
  std::error_code failed;
  for (fs::directory_iterator entry(folder / part, failed), none; !failed && entry != none;
       entry.increment(failed)) {
    const std::string name = entry->path().filename().string();
    if (!isUtf8(name)) continue;
    const bool fits = star == std::string::npos
                          ? name == last
                          : name.size() >= begin.size() + end.size() && name.starts_with(begin) &&
                                name.ends_with(end);
    if (fits && entry->is_regular_file(failed)) names.push_back((part / name).string());
  }
  std::ranges::sort(names);
  return names;
}

class BatchReader {
 public:
  BatchReader(const json& document, FirstError& error, fs::path folder)
      : document_(document), error_(error), folder_(std::move(folder)) {}

  BatchSpec read(const std::string& defaultName) {
    const JsonNode root(document_, "", error_);
    if (!root.expectObject(
            "a batch", {"$schema", "name", "description", "scene", "seed", "count", "parameters",
                        "branches", "listeners", "reject_if", "outputs", "split", "limits"}))
      return {};
    spec_.name = root.text("name", kTitle, defaultName);
    spec_.description = root.text("description", kProse, "");
    spec_.seed = static_cast<std::uint64_t>(root.number("seed", kSeed, 0));
    readScene(root);
    readParameters(root);
    readBranches(root);
    if (const auto listeners = root.find("listeners")) {
      listeners->elements("a list of listeners", 1, 256);
      spec_.listeners = valueAt(*listeners);
    }
    readRejections(root);
    readOutputs(root);
    readSplit(root);
    readLimits(root);
    if (!error_) readCount(root);
    return std::move(spec_);
  }

 private:
  const json& valueAt(const JsonNode& node) const {
    return document_.at(json::json_pointer(node.pointer()));
  }

  void readScene(const JsonNode& root) {
    const auto scene = root.require("scene", "a scene file, or a \"grid\" or \"choice\" of such");
    if (!scene) return;
    if (scene->isString()) {
      spec_.scenes = {scene->text(kFile)};
      return;
    }
    if (!scene->expectObject("a scene", {"grid", "choice", "weights"})) return;
    BatchParameter parameter{.name = kSceneParameter};
    readKind(*scene, parameter);
    if (error_) return;
    if (parameter.values.size() > kMostScenes)
      scene->fail("more than " + std::to_string(kMostScenes) + " scenes; expected fewer");
    for (const json& value : parameter.values) {
      if (!value.is_string()) {
        scene->fail("has a value that is no text; expected the names of scene files");
        return;
      }
      spec_.scenes.push_back(value.get<std::string>());
    }
    spec_.parameters.push_back(std::move(parameter));
  }

  void readParameters(const JsonNode& root) {
    const auto list = root.find("parameters");
    if (!list) return;
    for (const JsonNode& entry : list->elements("a list of parameters", 0, kMostParameters)) {
      if (error_) return;
      readParameter(entry);
    }
  }

  void readParameter(const JsonNode& entry) {
    if (!entry.expectObject(
            "a parameter", {"name", "grid", "choice", "weights", "uniform", "log_uniform", "normal",
                            "within", "whole", "permutation", "expression", "at"}))
      return;
    BatchParameter parameter;
    const auto name = entry.require("name", "the parameter's name");
    if (!name) return;
    parameter.name = name->text(kWord);
    if (!name->failed() && !isWord(parameter.name))
      name->fail(inQuotes(parameter.name) +
                 " is no name; expected small letters, digits and _, no digit first");
    if (parameter.name == kSceneParameter || parameter.name == "pi")
      name->fail(inQuotes(parameter.name) +
                 " has a meaning of its own (the choice among scenes, a number); expected another "
                 "name");
    if (!names_.insert(parameter.name).second)
      name->fail("the name " + inQuotes(parameter.name) + " is taken; expected names that differ");
    readKind(entry, parameter);
    readPointers(entry, parameter);
    if (!error_) spec_.parameters.push_back(std::move(parameter));
  }

  void readKind(const JsonNode& entry, BatchParameter& parameter) {
    std::size_t kinds = 0;
    for (std::size_t kind = 0; kind < kKinds; ++kind) {
      if (!entry.has(kKindNames[kind])) continue;
      parameter.kind = static_cast<ParameterKind>(kind);
      ++kinds;
    }
    if (kinds != 1) {
      entry.fail((kinds == 0 ? std::string("says not how it is drawn")
                             : std::string("says in several ways how it is drawn")) +
                 "; expected " + kKindList);
      return;
    }
    parameter.whole = entry.boolean("whole", false);
    const JsonNode drawn = *entry.find(nameOf(parameter.kind));
    switch (parameter.kind) {
      case ParameterKind::grid:
      case ParameterKind::choice:
      case ParameterKind::permutation:
        parameter.values = readValues(drawn);
        break;
      case ParameterKind::uniform:
      case ParameterKind::logUniform:
        readInterval(drawn, parameter);
        break;
      case ParameterKind::normal:
        readNormal(entry, drawn, parameter);
        break;
      case ParameterKind::expression:
        readExpression(drawn, parameter);
        break;
    }
    readWeights(entry, parameter);
    if (parameter.whole && parameter.kind != ParameterKind::uniform)
      entry.find("whole")->fail("is for \"uniform\" only; expected it there");
    if (entry.has("within") && parameter.kind != ParameterKind::normal)
      entry.find("within")->fail("is for \"normal\" only; expected it there");
  }

  std::vector<json> readValues(const JsonNode& node) {
    if (node.isObject()) return readFiles(node);
    std::vector<json> values;
    for (const JsonNode& element : node.elements("a list of values", 1, kMostValues))
      values.push_back(valueAt(element));
    return values;
  }

  std::vector<json> readFiles(const JsonNode& node) {
    if (!node.expectObject("a list of values", {"files"})) return {};
    const auto files = node.require("files", "a pattern such as \"meshes/*.obj\"");
    if (!files) return {};
    const std::string pattern = files->text(kFile);
    if (files->failed()) return {};
    std::vector<json> values;
    for (const std::string& name : filesLike(pattern, folder_))
      values.emplace_back(name);
    if (values.empty())
      files->fail("no file is like " + inQuotes(pattern) +
                  "; expected a name relative to the folder of the batch, with one * in its last "
                  "part");
    return values;
  }

  void readInterval(const JsonNode& node, BatchParameter& parameter) {
    const Interval interval = node.interval(kValue);
    if (node.failed()) return;
    parameter.low = interval.min;
    parameter.high = interval.max;
    if (parameter.whole &&
        !(std::ceil(parameter.low) <= std::floor(parameter.high) &&
          std::max(std::abs(parameter.low), std::abs(parameter.high)) <= kMostSeed))
      node.fail("holds no whole number, or too large ones; expected one at least, up to 2^53");
    if (parameter.kind == ParameterKind::logUniform && !(parameter.low > 0.0))
      node.fail("reaches down to " + modal::formatNumber(parameter.low) +
                "; expected both ends above 0");
  }

  void readNormal(const JsonNode& entry, const JsonNode& node, BatchParameter& parameter) {
    const std::vector<JsonNode> both = node.elements("a mean and a deviation", 2, 2);
    if (node.failed()) return;
    parameter.mean = both[0].number(kValue);
    parameter.deviation = both[1].number(kDeviation);
    parameter.low = -std::numeric_limits<double>::infinity();
    parameter.high = std::numeric_limits<double>::infinity();
    if (const auto within = entry.find("within")) {
      const Interval interval = within->interval(kValue);
      parameter.low = interval.min;
      parameter.high = interval.max;
      constexpr double kFar = 3.0;  // deviations; beyond, nearly all would be drawn anew
      if (!within->failed() && (parameter.low > parameter.mean + kFar * parameter.deviation ||
                                parameter.high < parameter.mean - kFar * parameter.deviation))
        within->fail("lies more than three deviations from the mean; expected it nearer");
    }
  }

  void readExpression(const JsonNode& node, BatchParameter& parameter) {
    parameter.expression = node.text(kExpression);
  }

  void readWeights(const JsonNode& entry, BatchParameter& parameter) {
    const auto weights = entry.find("weights");
    if (!weights) return;
    if (parameter.kind != ParameterKind::choice) {
      weights->fail("is for \"choice\" only; expected it there");
      return;
    }
    const std::size_t count = parameter.values.size();
    double sum = 0.0;
    for (const JsonNode& element : weights->elements("a weight for each value", count, count))
      sum += parameter.weights.emplace_back(element.number(kWeight));
    if (!weights->failed() && !(sum > 0.0))
      weights->fail("are all 0; expected one above 0 at least");
  }

  void readPointers(const JsonNode& entry, BatchParameter& parameter) {
    const auto at = entry.find("at");
    if (!at) return;
    if (at->isString()) {
      parameter.at = {readPointer(*at)};
      return;
    }
    for (const JsonNode& element : at->elements("a list of JSON pointers", 1, kMostPointers))
      parameter.at.push_back(readPointer(element));
    const std::size_t values = parameter.values.size();
    if (parameter.kind == ParameterKind::permutation && parameter.at.size() > 1 &&
        parameter.at.size() != values)
      at->fail("has " + std::to_string(parameter.at.size()) + " pointers for " +
               std::to_string(values) + " values; expected one for each, or a single one");
  }

  std::string readPointer(const JsonNode& node) {
    std::string text = node.text(kPointer);
    if (node.failed()) return {};
    try {
      const json::json_pointer pointer(text);
      if (!pointer.empty()) return text;
    } catch (const json::exception&) {
      // The message below says it.
    }
    node.fail(inQuotes(text) +
              " is no JSON pointer into a scene; expected one such as \"/bodies/0/radius\"");
    return {};
  }

  void readBranches(const JsonNode& root) {
    const auto list = root.find("branches");
    if (!list) {
      spec_.branches = {BatchBranch{}};
      return;
    }
    std::set<std::string> names;
    for (const JsonNode& entry : list->elements("a list of branches", 1, kMostBranches)) {
      if (!entry.expectObject("a branch", {"name", "set"})) return;
      BatchBranch branch;
      const auto name = entry.require("name", "the branch's name");
      if (!name) return;
      branch.name = name->text(kWord);
      if (!name->failed() && !isWord(branch.name))
        name->fail(inQuotes(branch.name) +
                   " is no name; expected small letters, digits and _, no digit first");
      if (!names.insert(branch.name).second)
        name->fail("the name " + inQuotes(branch.name) + " is taken; expected names that differ");
      if (const auto set = entry.find("set")) readSet(*set, branch);
      if (error_) return;
      spec_.branches.push_back(std::move(branch));
    }
  }

  void readSet(const JsonNode& node, BatchBranch& branch) {
    if (!node.isObject()) {
      node.failAs("what a branch sets", "an object with a value for each JSON pointer");
      return;
    }
    for (const auto& [key, value] : valueAt(node).items()) {
      const json text = key;
      branch.set.emplace_back(readPointer(JsonNode(text, node.pointer(), error_)), value);
    }
  }

  void readRejections(const JsonNode& root) {
    const auto node = root.find("reject_if");
    if (!node || !node->expectObject("a list of rejections", {"overlap", "silent", "out_of_reach",
                                                              "expression", "attempts"}))
      return;
    BatchRejections& rejections = spec_.rejections;
    rejections.overlap = node->boolean("overlap", false);
    rejections.attempts = static_cast<std::size_t>(node->number("attempts", kAttempts, 100));
    if (const auto reach = node->find("out_of_reach"))
      rejections.outOfReach = reach->number(kReach);
    if (const auto silent = node->find("silent")) rejections.silent = silent->number(kPressure);
    if (const auto expression = node->find("expression"))
      rejections.expression = expression->text(kExpression);
  }

  void readOutputs(const JsonNode& root) {
    const auto node = root.find("outputs");
    if (!node || !node->expectObject("a list of outputs",
                                     {"format", "events", "contacts", "poses", "stems"}))
      return;
    if (const auto format = node->find("format"))
      spec_.outputs.form = static_cast<SampleForm>(format->choice("a format", {"float32", "flac"}));
    spec_.outputs.events = node->boolean("events", true);
    spec_.outputs.contacts = node->boolean("contacts", false);
    spec_.outputs.poses = node->number("poses", kRate, 0.0);
    spec_.outputs.stems = node->boolean("stems", false);
  }

  void readSplit(const JsonNode& root) {
    const auto node = root.find("split");
    if (!node || !node->expectObject("a split", {"by", "validation", "test"})) return;
    BatchSplit& split = spec_.split;
    split.validation = node->number("validation", kShare, 0.1);
    split.test = node->number("test", kShare, 0.1);
    if (!error_ && split.validation + split.test > 1.0)
      node->fail("\"validation\" and \"test\" are more than 1 together; expected at most 1");
    const auto by = node->find("by");
    if (!by) return;
    for (const JsonNode& element : by->elements("a list of parameters", 0, kMostParameters)) {
      split.by.push_back(element.text(kWord));
      if (!element.failed() && !isParameter(split.by.back()))
        element.fail("there is no parameter " + inQuotes(split.by.back()) +
                     "; expected the name of one");
    }
  }

  bool isParameter(const std::string& name) const {
    return std::ranges::any_of(spec_.parameters,
                               [&](const BatchParameter& one) { return one.name == name; });
  }

  void readLimits(const JsonNode& root) {
    spec_.limits.time = kUsualTime;
    const auto node = root.find("limits");
    if (!node || !node->expectObject("limits", {"time", "memory", "events"})) return;
    spec_.limits.time = node->number("time", kTime, kUsualTime);
    spec_.limits.memory = static_cast<std::uint64_t>(node->number("memory", kMemory, 0.0));
    spec_.limits.events = static_cast<std::uint64_t>(node->number("events", kEvents, 0.0));
  }

  /// Reads the number of samples: by default the points of the grids.
  void readCount(const JsonNode& root) {
    const std::uint64_t points = gridPoints(spec_);
    const bool hasGrid = std::ranges::any_of(spec_.parameters, [](const BatchParameter& one) {
      return one.kind == ParameterKind::grid;
    });
    if (!hasGrid && !root.require("count", "a number of samples, as there is no grid")) return;
    if (points > static_cast<std::uint64_t>(kMostSamples) && !root.has("count")) {
      root.fail("the grids have more than " + modal::formatNumber(kMostSamples) +
                " points together; expected fewer, or a \"count\"");
      return;
    }
    spec_.count =
        static_cast<std::uint64_t>(root.number("count", kCount, static_cast<double>(points)));
  }

  static constexpr double kUsualTime = 600.0;  // s

  const json& document_;
  FirstError& error_;
  fs::path folder_;
  std::set<std::string> names_;
  BatchSpec spec_;
};

}  // namespace

const char* nameOf(ParameterKind kind) {
  return kKindNames[static_cast<std::size_t>(kind)];
}

std::uint64_t gridPoints(const BatchSpec& spec) {
  std::uint64_t points = 1;
  constexpr std::uint64_t kMost = std::uint64_t{1} << 40U;  // more than there are samples
  for (const BatchParameter& parameter : spec.parameters)
    if (parameter.kind == ParameterKind::grid)
      points = std::min<std::uint64_t>(kMost, points * parameter.values.size());
  return points;
}

Result<BatchSpec> parseBatch(std::string_view text, std::string_view name) {
  FirstError error(name);
  constexpr std::size_t kMostBytes = std::size_t{16} << 20U;
  if (text.size() > kMostBytes) {
    error.record({}, "larger than 16 MiB; expected a batch of at most that size");
    return error.error();
  }
  const std::optional<json> document = modal::parseJson(text, error);
  if (!document) return error.error();
  const fs::path file(name);
  BatchReader reader(*document, error, file.parent_path());
  BatchSpec spec = reader.read(file.stem().string());
  if (error) return error.error();
  return spec;
}

}  // namespace carom::lab
