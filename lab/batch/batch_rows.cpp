#include "lab/batch/batch_rows.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include "lab/batch/file_hash.h"
#include <unistd.h>

namespace carom::lab {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using nlohmann::ordered_json;

constexpr const char* kRowFolder = "rows";

std::string hostName() {
  char name[256] = {};
  if (::gethostname(name, sizeof name - 1) != 0) return "host";
  std::string host = name;
  std::ranges::replace_if(
      host,
      [](char c) {
        return (c < 'a' || c > 'z') && (c < 'A' || c > 'Z') && (c < '0' || c > '9') && c != '-';
      },
      '_');
  return host;
}

/// Returns when the run began that wrote a file of rows, in ns since 1970, as its name says: the
/// last number before ".jsonl". Other names are of no time.
std::uint64_t beginOf(const fs::path& file) {
  const std::string stem = file.stem().string();
  const std::string digits = stem.substr(stem.rfind('.') + 1);
  std::uint64_t time = 0;
  const auto [end, fault] = std::from_chars(digits.data(), digits.data() + digits.size(), time);
  return fault == std::errc() && end == digits.data() + digits.size() ? time : 0;
}

/// Returns the branch that a line tells of; nothing if it tells of none.
std::optional<BranchId> idOf(const ordered_json& line) {
  const auto index = line.find("index");
  if (index == line.end() || !index->is_number_unsigned()) return std::nullopt;
  const auto branch = line.find("branch");
  const bool isNamed = branch != line.end() && branch->is_string();
  return BranchId{index->get<std::uint64_t>(), isNamed ? branch->get<std::string>() : ""};
}

/// True if a run of this plan may have told of that branch; failures may be of whole samples.
bool isOfPlan(const BatchPlan& plan, const BranchId& id, bool isFailure) {
  if (isFailure && id.second.empty()) return true;
  return std::ranges::any_of(plan.spec.branches,
                             [&](const BatchBranch& branch) { return branch.name == id.second; });
}

/// True for the name of a file as a run gives it: a row cannot have another one read or packed.
bool isOwnFile(const BranchId& id, std::string_view name) {
  const std::string begin = sampleFile(id.first, id.second, ".");
  return name.starts_with(begin) && name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789._",
                                                           begin.size()) == name.npos;
}

/// True for a row as a run writes it, but for what nothing is read from.
bool isRow(const BranchId& id, const ordered_json& line) {
  const auto isText = [&](const char* key) { return !line.contains(key) || line[key].is_string(); };
  const auto isNumber = [&](const char* key) {
    return !line.contains(key) || line[key].is_number();
  };
  if (!line.contains(kRowFiles.front().name)) return false;
  for (const RowFile& keys : kRowFiles) {
    if (!line.contains(keys.name)) continue;
    if (!line[keys.name].is_string() || !isOwnFile(id, line[keys.name].get<std::string>()))
      return false;
    if (!line.contains(keys.bytes) || !line[keys.bytes].is_number_unsigned()) return false;
    if (!line.contains(keys.hash) || !line[keys.hash].is_string()) return false;
  }
  constexpr std::array kSplits = {"train", "validation", "test"};
  if (!isText("split") ||
      (line.contains("split") && std::ranges::count(kSplits, line["split"]) == 0))
    return false;
  if (line.contains("parameters") && !line["parameters"].is_object()) return false;
  constexpr std::array kNumbers = {"duration_s", "wall_s", "peak_pa", "events"};
  return isText("version") && isText("cpu_features") && std::ranges::all_of(kNumbers, isNumber);
}

/// Numbers of lines in the order in which they were told.
struct LineOrder {
  std::size_t lines = 0;
  std::map<BranchId, std::size_t> rows;
  std::map<BranchId, std::size_t> failures;
};

void add(const std::string& text, const BatchPlan& plan, BatchRows& rows, LineOrder& order) {
  ordered_json line = ordered_json::parse(text, nullptr, false);
  if (!line.is_object()) return;
  const auto id = idOf(line);
  const bool isFailure = line.contains("failure");
  if (!id || !isOfPlan(plan, *id, isFailure)) return;
  if (isFailure) {
    rows.failures[*id] = std::move(line);
    order.failures[*id] = ++order.lines;
  } else if (isRow(*id, line)) {
    rows.rows[*id] = std::move(line);
    order.rows[*id] = ++order.lines;
  }
}

bool hasFile(const BatchPlan& plan, const ordered_json& row, const RowFile& keys, bool hashed) {
  if (!row.contains(keys.name)) return true;
  const fs::path file = plan.folder / row.at(keys.name).get_ref<const std::string&>();
  std::error_code failed;
  const auto there = fs::file_size(file, failed);
  if (failed || there != row.at(keys.bytes).get<std::uintmax_t>()) return false;
  if (!hashed) return true;
  const Result<std::string> hash = sha256OfFile(file);
  return hash && row.value(keys.hash, "") == *hash;
}

bool hasFiles(const BatchPlan& plan, const ordered_json& row, bool hashed) {
  return std::ranges::all_of(kRowFiles,
                             [&](const RowFile& keys) { return hasFile(plan, row, keys, hashed); });
}

/// Drops the failures of what was made later, or is whole anyway, as two runs may make one sample.
/// One that came after a row whose files are damaged stays: it could not be mended.
void dropMended(const BatchPlan& plan, const LineOrder& order, BatchRows& rows) {
  std::erase_if(rows.failures, [&](const auto& entry) {
    const BranchId& id = entry.first;
    const std::size_t failed = order.failures.at(id);
    const auto isMade = [&](const std::string& branch) {
      const auto row = order.rows.find({id.first, branch});
      if (row == order.rows.end()) return false;
      return row->second > failed || hasFiles(plan, rows.rows.at(row->first), true);
    };
    if (!id.second.empty()) return isMade(id.second);
    return std::ranges::all_of(plan.spec.branches,
                               [&](const BatchBranch& branch) { return isMade(branch.name); });
  });
}

}  // namespace

std::string machineOf(const ordered_json& row) {
  return "carom " + row.value("version", "") + ", " + row.value("cpu_features", "");
}

Result<BatchRows> readRows(const BatchPlan& plan) {
  const fs::path folder = plan.folder / kRowFolder;
  std::vector<fs::path> files;
  std::error_code failed;
  for (fs::directory_iterator entry(folder, failed), none; !failed && entry != none;
       entry.increment(failed))
    if (entry->path().extension() == ".jsonl") files.push_back(entry->path());
  if (failed)
    return Error{folder.string() + ": cannot be read: " + failed.message() +
                 "; expected the folder of a batch"};
  // The latest run comes last, on whichever machine it ran: its row of a branch replaces earlier
  // ones.
  std::ranges::sort(files, {}, [](const fs::path& file) { return std::pair(beginOf(file), file); });
  BatchRows rows;
  LineOrder order;
  for (const fs::path& file : files) {
    std::ifstream stream(file, std::ios::binary);
    for (std::string line; std::getline(stream, line);)
      add(line, plan, rows, order);
  }
  const auto isBeyond = [&](const auto& entry) { return entry.first.first >= plan.spec.count; };
  std::erase_if(rows.rows, isBeyond);
  std::erase_if(rows.failures, isBeyond);
  dropMended(plan, order, rows);
  return rows;
}

std::vector<bool> doneSamples(const BatchPlan& plan, const BatchRows& rows,
                              const DoneRules& rules) {
  const auto isSettled = [&](const BranchId& id) {
    const auto row = rows.rows.find(id);
    if (row != rows.rows.end()) return hasFiles(plan, row->second, rules.hashes);
    // A failure of a whole sample settles the branches that were not made at another time.
    return rules.failuresCount &&
           (rows.failures.contains(id) || rows.failures.contains({id.first, ""}));
  };
  std::vector<bool> done(plan.spec.count);
  for (std::uint64_t index = 0; index < plan.spec.count; ++index)
    done[index] = std::ranges::all_of(plan.spec.branches, [&](const BatchBranch& branch) {
      return isSettled({index, branch.name});
    });
  return done;
}

Result<RowLog> RowLog::create(const BatchPlan& plan) {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const auto name = hostName() + '.' + std::to_string(::getpid()) + '.' +
                    std::to_string(std::chrono::nanoseconds(now).count()) + ".jsonl";
  const fs::path path = plan.folder / kRowFolder / name;
  std::ofstream stream(path, std::ios::binary | std::ios::app);
  if (!stream)
    return Error{path.string() +
                 ": cannot be created; expected the folder of a batch that may be "
                 "written"};
  return RowLog(path, std::move(stream));
}

Status RowLog::add(const ordered_json& line) {
  stream_ << line.dump(-1, ' ', false, ordered_json::error_handler_t::replace) << '\n'
          << std::flush;
  std::error_code ignored;
  if (stream_ && fs::exists(path_, ignored)) return std::monostate{};
  return Error{path_.string() + ": cannot be written; is it still there, and is there room?"};
}

}  // namespace carom::lab
