#include "lab/batch/batch_trial.h"

#include <algorithm>
#include <cstdlib>
#include <sstream>
#include <string>
#include <system_error>

#include "lab/batch/sample_run.h"

#include "carom/audio/sound_file.h"
#include "scenes/run/stopwatch.h"

namespace carom::lab {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kTried = 5;

/// A folder that goes with this object, among the system's temporary ones: a trial that is ended by
/// a signal leaves nothing where its user works; or in the batch's own, if there can be none. If it
/// cannot be made, no sample of the trial can be written, which says so.
class TrialFolder {
 public:
  explicit TrialFolder(const fs::path& batch) {
    std::error_code failed;
    for (const fs::path& parent : {fs::temp_directory_path(failed), batch}) {
      std::string name = (parent / "carom_trial.XXXXXX").string();
      isMade_ = ::mkdtemp(name.data()) != nullptr;
      path_ = name;
      if (isMade_) break;
    }
    std::error_code ignored;
    if (isMade_) fs::create_directories(path_ / "samples", ignored);
  }
  TrialFolder(const TrialFolder&) = delete;
  TrialFolder& operator=(const TrialFolder&) = delete;
  ~TrialFolder() {
    std::error_code ignored;
    if (isMade_) fs::remove_all(path_, ignored);
  }

  const fs::path& path() const { return path_; }
  /// Removes the files that are there; returns how many bytes they had.
  double empty() const {
    double sum = 0.0;
    std::error_code failed;
    std::vector<fs::path> files;
    for (fs::recursive_directory_iterator entry(path_, failed), none; !failed && entry != none;
         entry.increment(failed))
      if (entry->is_regular_file(failed)) files.push_back(entry->path());
    for (const fs::path& file : files) {
      std::error_code unknown;
      const std::uintmax_t size = fs::file_size(file, unknown);
      if (!unknown) sum += static_cast<double>(size);
      fs::remove(file, unknown);
    }
    return sum;
  }

 private:
  fs::path path_;
  bool isMade_ = false;
};

void warn(BatchTrial& trial, std::uint64_t index, const std::string& what) {
  trial.warnings.push_back("sample " + std::to_string(index) + " " + what);
}

void judge(BatchTrial& trial, std::uint64_t index, const SampleRunner::Outcome& outcome) {
  for (const SampleFailure& failure : outcome.failures)
    warn(trial, index,
         "fails" + (failure.branch.empty() ? "" : " in branch \"" + failure.branch + "\"") + " (" +
             failure.kind + "): " + failure.message);
  for (const nlohmann::ordered_json& row : outcome.rows) {
    const double peak = row.value("peak_pa", 0.0);
    std::ostringstream text;
    text.precision(3);
    if (!(peak > 0.0)) {
      text << "is silent; expected something to collide, slide or roll";
    } else if (peak > kFullScalePressure) {
      text << "has a peak of " << peak << " Pa, above full scale (" << kFullScalePressure
           << " Pa): float samples above 1, which some readers clip";
    } else {
      continue;
    }
    warn(trial, index, text.str());
  }
}

}  // namespace

Result<BatchTrial> tryBatch(const BatchPlan& plan,
                            const std::function<void(double share)>& progress) {
  BatchTrial trial;
  const TrialFolder folder(plan.folder);
  BatchPlan elsewhere = plan;
  elsewhere.folder = folder.path();
  SampleRunner runner(elsewhere);
  const std::uint64_t number = std::min(kTried, plan.spec.count);
  std::size_t attempts = 0;
  std::size_t rows = 0;
  double bytes = 0.0;
  std::vector<double> seconds;
  for (std::uint64_t at = 0; at < number; ++at) {
    const std::uint64_t index = at * plan.spec.count / number;
    const scenes::Stopwatch stopwatch;
    const Result<SampleRunner::Outcome> outcome = runner.run(index);
    if (!outcome) return outcome.error();
    seconds.push_back(stopwatch.seconds());
    bytes += folder.empty();
    judge(trial, index, *outcome);
    for (const nlohmann::ordered_json& row : outcome->rows) {
      attempts += row.value("attempt", std::size_t{0});
      ++rows;
    }
    if (progress) progress(static_cast<double>(at + 1) / static_cast<double>(number));
  }
  trial.tried = static_cast<std::size_t>(number);
  // The median: the first sample may be the one that computes models for all.
  std::ranges::sort(seconds);
  trial.seconds = seconds[seconds.size() / 2];
  trial.bytes = bytes / static_cast<double>(number);
  if (attempts > 2 * rows)
    trial.warnings.push_back(
        "more than two of three attempts are rejected; expected ranges in "
        "which more can be");
  return trial;
}

}  // namespace carom::lab
