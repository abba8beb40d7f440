#include "lab/batch/batch_run.h"

#include <algorithm>
#include <exception>
#include <functional>
#include <new>
#include <optional>
#include <utility>
#include <vector>

#include "lab/batch/batch_page.h"
#include "lab/batch/manifest.h"
#include "lab/batch/sample_run.h"
#include "lab/batch/worker_pool.h"

#include "scenes/run/stopwatch.h"

namespace carom::lab {
namespace {

using nlohmann::ordered_json;

/// s that a process may be silent beyond the time of a rendering, as limits are looked at now and
/// then only.
constexpr double kGrace = 10.0;

/// The text of a line; paths in messages may hold any bytes.
std::string textOf(const ordered_json& line) {
  return line.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

ordered_json failureLine(std::uint64_t index, const SampleFailure& failure) {
  ordered_json line = {{"index", index}};
  if (!failure.branch.empty()) line["branch"] = failure.branch;
  line["failure"] = failure.kind;
  line["message"] = failure.message;
  return line;
}

/// Runs a sample in a process of the pool, and tells of it in lines of JSON. An error of the disk
/// is told as {"stop": why}.
std::string answerOf(SampleRunner& runner, std::uint64_t index) {
  try {
    const Result<SampleRunner::Outcome> outcome = runner.run(index);
    if (!outcome) return textOf({{"stop", outcome.error().message}});
    std::string text;
    for (const ordered_json& row : outcome->rows)
      text += textOf(row) + '\n';
    for (const SampleFailure& failure : outcome->failures)
      text += textOf(failureLine(index, failure)) + '\n';
    return text;
  } catch (const std::bad_alloc&) {
    return textOf(failureLine(index, {"limit", "",
                                      "its memory has run out; expected a smaller scene, or more "
                                      "memory (\"limits\" in the batch)"}));
  } catch (const std::exception& error) {
    return textOf(failureLine(index, {"failed", "", error.what()}));
  }
}

/// One run of a batch.
class BatchRun {
 public:
  BatchRun(const BatchPlan& plan, const BatchRunOptions& options, RowLog log,
           const std::vector<bool>& done)
      : plan_(plan), options_(options), log_(std::move(log)) {
    for (std::uint64_t index = options.shard.index; index < plan.spec.count;
         index += options.shard.count) {
      ++progress_.samples;
      if (done[index]) {
        ++progress_.done;
      } else {
        todo_.push_back(index);
      }
    }
  }

  Status run() {
    SampleRunner runner(plan_);
    PoolWork work;
    work.next = [this]() -> std::optional<std::uint64_t> {
      if (next_ == todo_.size()) return std::nullopt;
      return todo_[next_++];
    };
    work.answer = [&runner](std::uint64_t index, const std::function<void()>& goesOn) {
      runner.onRendering(goesOn);
      return answerOf(runner, index);
    };
    work.ended = [this](const JobEnd& end) { return take(end); };
    work.tick = [this] { tell(); };
    work.begin = options_.beginProcess;
    PoolSettings settings{.processes = std::max<std::size_t>(1, options_.processes)};
    settings.longest = 1.5 * plan_.spec.limits.time + kGrace;
    settings.processes = std::min(settings.processes, std::max<std::size_t>(1, todo_.size()));
    if (Status done = runPool(work, settings); !done) return done;
    if (!stop_.empty()) return Error{stop_};
    return std::monostate{};
  }

  double soundTime() const { return soundTime_; }
  double seconds() const { return stopwatch_.seconds(); }

 private:
  /// False if no other sample can be made either.
  bool take(const JobEnd& end) {
    if (!end.hasAnswer)
      return keep(failureLine(end.job, {end.isHung ? "hung" : "crashed", "", end.text}));
    std::size_t from = 0;
    while (from < end.text.size()) {
      const std::size_t to = std::min(end.text.find('\n', from), end.text.size());
      if (!keep(ordered_json::parse(end.text.substr(from, to - from), nullptr, false)))
        return false;
      from = to + 1;
    }
    ++progress_.made;
    ++progress_.done;
    tell();
    return true;
  }

  bool keep(ordered_json line) {
    if (!line.is_object()) return true;
    if (const auto why = line.find("stop"); why != line.end()) {
      stop_ = why->get<std::string>();
      return false;
    }
    if (line.contains("failure")) {
      ++progress_.failed;
      line["repeat"] = repeatOf(line);
    }
    soundTime_ += line.value("duration_s", 0.0);
    const Status added = log_.add(line);
    if (!added) stop_ = added.error().message;
    return static_cast<bool>(added);
  }

  /// Returns the command that makes a sample again.
  std::string repeatOf(const ordered_json& line) const {
    const std::string branch = line.value("branch", plan_.spec.branches.front().name);
    return "carom batch repeat " + plan_.folder.string() + ' ' +
           std::to_string(line.at("index").get<std::uint64_t>()) +
           (branch.empty() ? "" : " --branch " + branch) + " -o sample.wav";
  }

  void tell() {
    progress_.seconds = stopwatch_.seconds();
    if (options_.progress) options_.progress(progress_);
  }

  const BatchPlan& plan_;
  const BatchRunOptions& options_;
  RowLog log_;
  std::vector<std::uint64_t> todo_;
  std::size_t next_ = 0;
  BatchProgress progress_;
  scenes::Stopwatch stopwatch_;
  double soundTime_ = 0.0;
  std::string stop_;
};

/// Adds what has become of the samples of a shard.
void count(const BatchPlan& plan, const BatchRows& rows, const BatchShard& shard,
           BatchRunReport& report) {
  const std::vector<bool> whole = doneSamples(plan, rows, {.failuresCount = false});
  std::vector<bool> failed(plan.spec.count);
  for (const auto& [id, failure] : rows.failures)
    failed[id.first] = true;
  for (std::uint64_t index = shard.index; index < plan.spec.count; index += shard.count)
    ++(failed[index] ? report.failed : whole[index] ? report.done : report.remaining);
}

}  // namespace

Result<BatchRunReport> runBatch(const BatchPlan& plan, const BatchRunOptions& options) {
  Result<BatchRows> before = readRows(plan);
  if (!before) return before.error();
  Result<RowLog> log = RowLog::create(plan);
  if (!log) return log.error();
  BatchRun run(plan, options, *std::move(log), doneSamples(plan, *before, options.done));
  const Status done = run.run();
  if (!done) return done.error();
  BatchRunReport report;
  report.soundTime = run.soundTime();
  // Other runs may have told more meanwhile; the last one to end tells of all.
  const Result<BatchRows> after = readRows(plan);
  if (!after) return after.error();
  if (Status written = writeManifest(plan, *after); !written) return written.error();
  if (Status written = writeDataCard(plan, *after); !written) return written.error();
  count(plan, *after, options.shard, report);
  report.contentHash = contentHash(*after);
  report.wallTime = run.seconds();
  return report;
}

}  // namespace carom::lab
