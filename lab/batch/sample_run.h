#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "lab/batch/batch_plan.h"
#include "lab/batch/sample_values.h"
#include <nlohmann/json.hpp>

#include "carom/audio/listener.h"
#include "carom/audio/result.h"
#include "scenes/format/scene.h"

namespace carom::lab {

/// The values of a sample that no rule about values rejects.
struct Sample {
  std::uint64_t index = 0;
  std::size_t attempt = 0;
  SampleValues values;
};

/// The reason why a sample has no sound.
struct SampleFailure {
  /// "refused" (no scene), "rejected" (by rules, at each attempt), "limit", "failed", or of a
  /// process: "crashed", "hung"
  std::string kind;
  std::string branch;   ///< empty if there is one only, or if all of them fail
  std::string message;  ///< one sentence
};

/// Runs samples of a plan. [one thread]
class SampleRunner {
 public:
  /// `plan` is borrowed.
  explicit SampleRunner(const BatchPlan& plan) : plan_(plan) {}

  /// Sets a function that is called before each rendering, of which each is within the limits.
  void onRendering(std::function<void()> goesOn) { goesOn_ = std::move(goesOn); }

  /// The outcome of a sample: for each branch a row, or why there is none.
  struct Outcome {
    std::vector<nlohmann::ordered_json> rows;
    std::vector<SampleFailure> failures;
  };
  /// Renders all branches of a sample into files below the plan's folder. An error is one of the
  /// disk: no fault of the sample's, and every other would fail as well.
  Result<Outcome> run(std::uint64_t index);

  /// Renders one branch of a sample again, into a file of that name, and nothing else. The row says
  /// what the sample's own file would be.
  Result<Outcome> repeat(std::uint64_t index, const std::string& branch,
                         const std::filesystem::path& soundFile);

 private:
  struct Rendered;
  /// A sample whose first branch no rule rejects, or why there is none.
  struct Accepted;
  Result<Sample> draw(std::uint64_t index, std::size_t from) const;
  Result<Rendered> render(const Sample& sample, const BatchBranch& branch);
  Result<Accepted> accept(std::uint64_t index);
  Result<nlohmann::ordered_json> write(const Sample& sample, const BatchBranch& branch,
                                       Rendered& rendered) const;

  void keepHead(const scenes::Scene& scene);

  const BatchPlan& plan_;
  std::function<void()> goesOn_;
  // The head that listeners without a file of their own have, by sample rate: a quarter of a second
  // to read, which the next sample needs too.
  std::map<double, std::shared_ptr<const HrtfSet>> heads_;
};

/// Returns the instruction set and the C library that a sample's bits depend on, beside the build.
std::string machineKind();

/// Writes a file under a temporary name beside its own, and gives it its name when it is whole. The
/// system writes it to the disk when it likes. The error is a whole sentence.
Status writeSampleFile(const std::filesystem::path& file, std::string_view bytes);

}  // namespace carom::lab
