#include "lab/batch/sample_values.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "lab/batch/expression.h"
#include "lab/batch/file_hash.h"
#include "lab/batch/philox.h"

#include "modal/json/json_reader.h"

namespace carom::lab {
namespace {

using nlohmann::json;

/// Returns a hash of a name, FNV-1a: it is part of what a batch's values depend on.
std::uint64_t hashOf(const std::string& name) {
  std::uint64_t hash = 14695981039346656037U;
  for (const char c : name)
    hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211U;
  return hash;
}

std::size_t chosen(const BatchParameter& parameter, RandomStream& random) {
  if (parameter.weights.empty())
    return static_cast<std::size_t>(random.below(parameter.values.size()));
  const double sum = std::accumulate(parameter.weights.begin(), parameter.weights.end(), 0.0);
  double left = sum * random.uniform();
  std::size_t last = 0;
  for (std::size_t at = 0; at < parameter.weights.size(); ++at) {
    if (!(parameter.weights[at] > 0.0)) continue;
    last = at;
    left -= parameter.weights[at];
    if (left < 0.0) break;
  }
  return last;
}

double uniform(const BatchParameter& parameter, RandomStream& random) {
  if (!parameter.whole)
    return std::min(parameter.high,
                    parameter.low + (parameter.high - parameter.low) * random.uniform());
  const double first = std::ceil(parameter.low);
  const double number = std::floor(parameter.high) - first + 1.0;
  return first + static_cast<double>(random.below(static_cast<std::uint64_t>(number)));
}

double logUniform(const BatchParameter& parameter, RandomStream& random) {
  const double ratio = std::log(parameter.high / parameter.low);
  return std::clamp(parameter.low * std::exp(ratio * random.uniform()), parameter.low,
                    parameter.high);
}

double normal(const BatchParameter& parameter, RandomStream& random) {
  constexpr int kTries = 10'000;  // of which one in 740 at least is within
  for (int attempt = 0; attempt < kTries; ++attempt) {
    const double value = parameter.mean + parameter.deviation * random.normal();
    if (value >= parameter.low && value <= parameter.high) return value;
  }
  return std::clamp(parameter.mean, parameter.low, parameter.high);
}

json permuted(const BatchParameter& parameter, RandomStream& random) {
  std::vector<json> values = parameter.values;
  for (std::size_t left = values.size(); left > 1; --left)
    std::swap(values[left - 1], values[static_cast<std::size_t>(random.below(left))]);
  return values;
}

/// A number as it is written in JSON: an integer without a point if it is one.
json numberOf(double value, bool whole) {
  return whole ? json(static_cast<std::int64_t>(value)) : json(value);
}

NamedNumbers numbersOf(const SampleValues& values) {
  NamedNumbers numbers;
  for (const auto& [name, value] : values)
    if (value.is_number()) numbers[name] = value.get<double>();
  return numbers;
}

/// The place of a sample in the grids, of which the first varies slowest.
class GridPoint {
 public:
  GridPoint(const BatchSpec& spec, std::uint64_t index) {
    for (auto one = spec.parameters.rbegin(); one != spec.parameters.rend(); ++one) {
      if (one->kind != ParameterKind::grid) continue;
      places_.push_back(static_cast<std::size_t>(index % one->values.size()));
      index /= one->values.size();
    }
  }

  /// Returns the index of the next grid's value.
  std::size_t next() {
    const std::size_t place = places_.back();
    places_.pop_back();
    return place;
  }

 private:
  std::vector<std::size_t> places_;  // the last grid's first
};

Status put(json& scene, const std::string& pointer, const json& value) {
  const json::json_pointer place(pointer);
  try {
    // operator[] would make arrays longer, and objects of what is missing on the way.
    json& parent = scene.at(place.parent_pointer());
    if (parent.is_object()) {
      parent[place.back()] = value;
      return std::monostate{};
    }
    if (parent.is_array() && scene.contains(place)) {
      scene.at(place) = value;
      return std::monostate{};
    }
  } catch (const json::exception&) {
    // The message below says it.
  }
  return Error{"there is no place " + modal::inQuotes(pointer) +
               " in the scene; expected the pointer of a value, or of a new member of an object"};
}

Status putAll(json& scene, const BatchParameter& parameter, const json& value) {
  const bool isOneEach = parameter.kind == ParameterKind::permutation && parameter.at.size() > 1;
  for (std::size_t at = 0; at < parameter.at.size(); ++at)
    if (Status done = put(scene, parameter.at[at], isOneEach ? value[at] : value); !done)
      return Error{"parameter " + modal::inQuotes(parameter.name) + ": " + done.error().message};
  return std::monostate{};
}

}  // namespace

Result<SampleValues> drawValues(const BatchSpec& spec, std::uint64_t index, std::size_t attempt) {
  SampleValues values;
  GridPoint point(spec, index);
  for (const BatchParameter& parameter : spec.parameters) {
    RandomStream random({spec.seed, index, hashOf(parameter.name), attempt});
    json value;
    switch (parameter.kind) {
      case ParameterKind::grid:
        value = parameter.values[point.next()];
        break;
      case ParameterKind::choice:
        value = parameter.values[chosen(parameter, random)];
        break;
      case ParameterKind::uniform:
        value = numberOf(uniform(parameter, random), parameter.whole);
        break;
      case ParameterKind::logUniform:
        value = logUniform(parameter, random);
        break;
      case ParameterKind::normal:
        value = normal(parameter, random);
        break;
      case ParameterKind::permutation:
        value = permuted(parameter, random);
        break;
      case ParameterKind::expression: {
        const Result<double> number = valueOf(parameter.expression, numbersOf(values));
        if (!number)
          return Error{"parameter " + modal::inQuotes(parameter.name) + ": " +
                       number.error().message};
        value = *number;
        break;
      }
    }
    values.emplace_back(parameter.name, std::move(value));
  }
  return values;
}

Result<bool> isRejected(const BatchSpec& spec, const SampleValues& values) {
  if (spec.rejections.expression.empty()) return false;
  const Result<double> value = valueOf(spec.rejections.expression, numbersOf(values));
  if (!value) return Error{"/reject_if/expression: " + value.error().message};
  return *value != 0.0;
}

Result<json> applied(const BatchSpec& spec, const SampleValues& values, const BatchBranch& branch,
                     json scene) {
  if (spec.listeners && scene.is_object()) scene["listeners"] = *spec.listeners;
  for (std::size_t at = 0; at < values.size(); ++at)
    if (Status done = putAll(scene, spec.parameters[at], values[at].second); !done)
      return done.error();
  for (const auto& [pointer, value] : branch.set)
    if (Status done = put(scene, pointer, value); !done)
      return Error{"branch " + modal::inQuotes(branch.name) + ": " + done.error().message};
  return scene;
}

const std::string& sceneOf(const BatchSpec& spec, const SampleValues& values) {
  for (const auto& [name, value] : values)
    if (name == kSceneParameter) return value.get_ref<const std::string&>();
  return spec.scenes.front();
}

std::string splitOf(const BatchSpec& spec, std::uint64_t index, const SampleValues& values) {
  json key = json::object();
  for (const auto& [name, value] : values)
    if (std::ranges::find(spec.split.by, name) != spec.split.by.end()) key[name] = value;
  if (spec.split.by.empty()) key = index;
  constexpr std::size_t kDigits = 13;  // of 4 bits each: 52 bits, which a double holds
  const std::string digits = sha256(key.dump()).substr(0, kDigits);
  const double share = static_cast<double>(std::stoull(digits, nullptr, 16)) * 0x1p-52;
  if (share < spec.split.test) return "test";
  if (share < spec.split.test + spec.split.validation) return "validation";
  return "train";
}

}  // namespace carom::lab
