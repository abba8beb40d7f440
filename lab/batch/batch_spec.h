#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "carom/audio/result.h"
#include "scenes/limits/resource_watch.h"

namespace carom::lab {

enum class ParameterKind { grid, choice, uniform, logUniform, normal, permutation, expression };

/// A quantity that differs from sample to sample.
struct BatchParameter {
  std::string name;
  ParameterKind kind = ParameterKind::grid;
  std::vector<nlohmann::json> values = {};  ///< of a grid, a choice, a permutation
  std::vector<double> weights = {};         ///< of the values of a choice; empty: all are equal
  double low = 0.0;        ///< least value of a uniform or log-uniform one, and of a normal one
  double high = 0.0;       ///< largest value of these
  double mean = 0.0;       ///< of a normal one
  double deviation = 0.0;  ///< of a normal one, > 0
  bool whole = false;      ///< a uniform one that is an integer, both ends included
  std::string expression = {};  ///< over the parameters before it
  /// JSON pointers into the scene. A permutation with as many pointers as values gives one value to
  /// each; every other parameter gives its value to all.
  std::vector<std::string> at = {};
};

/// One of several runs of each sample, which differ in what is set after the parameters.
struct BatchBranch {
  std::string name;
  std::vector<std::pair<std::string, nlohmann::json>> set = {};  ///< JSON pointer and value
};

/// The samples that are drawn anew.
struct BatchRejections {
  bool overlap = false;              ///< bodies overlap at the start
  std::optional<double> outOfReach;  ///< m: at the end a body that moves is farther from all ears
  std::optional<double> silent;      ///< Pa: no channel of the first branch has a sample that large
  std::string expression = {};       ///< a value other than 0 rejects; empty: none
  std::size_t attempts = 100;        ///< after which the sample fails
};

/// The form of a sample's sound.
enum class SampleForm {
  float32,  ///< WAV of 32-bit floating-point numbers, 1.0 for kFullScalePressure
  flac,     ///< FLAC of 24 bits, 1.0 for the sample's own peak
};

struct BatchOutputs {
  SampleForm form = SampleForm::float32;
  bool events = true;     ///< a CSV file of every impulse event
  bool contacts = false;  ///< a CSV file of every step of lasting contacts
  double poses = 0.0;     ///< Hz, of a CSV file of the poses of all bodies that move; 0: none
  bool stems = false;     ///< a sound of each Stem beside the whole
};

/// Shares of the samples, which are told apart by a hash of the parameters `by`: samples that agree
/// in these are on one side.
struct BatchSplit {
  std::vector<std::string> by;
  double validation = 0.1;
  double test = 0.1;
};

/// The name of the parameter that chooses among several scenes.
inline constexpr const char* kSceneParameter = "scene";

/// A batch of samples: scenes that differ in parameters. docs/batch.md describes the file.
struct BatchSpec {
  std::string name;
  std::string description;
  std::uint64_t seed = 0;
  std::uint64_t count = 0;  ///< samples, each of which has all branches
  /// Scene files, relative to the folder of the batch file. Of more than one, the parameter "scene"
  /// chooses.
  std::vector<std::string> scenes;
  std::vector<BatchParameter> parameters;   ///< in the order of the file
  std::vector<BatchBranch> branches;        ///< at least one
  std::optional<nlohmann::json> listeners;  ///< replace those of the scene
  BatchRejections rejections;
  BatchOutputs outputs;
  BatchSplit split;
  scenes::RunLimits limits;  ///< of each branch of a sample
};

/// Returns the key that a parameter of this kind has in the file.
const char* nameOf(ParameterKind kind);

/// Returns the number of points of all grids together; 1 without any.
std::uint64_t gridPoints(const BatchSpec& spec);

/// Reads a batch from text. `name` stands for the file: it begins messages, and "files" patterns
/// are looked up in its folder. An error names the place as a JSON pointer, what is wrong there and
/// what would be accepted. [any thread]
Result<BatchSpec> parseBatch(std::string_view text, std::string_view name);

}  // namespace carom::lab
