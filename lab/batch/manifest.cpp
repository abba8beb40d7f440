#include "lab/batch/manifest.h"

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <utility>

#include "lab/batch/file_hash.h"
#include "lab/batch/sample_run.h"
#include "lab/report/csv_cell.h"

namespace carom::lab {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t kMostFaults = 20;  // named one by one

std::string textOf(const ordered_json& row, const char* key) {
  const auto value = row.find(key);
  return value != row.end() && value->is_string() ? value->get<std::string>() : "";
}

std::string nameOf(const BranchId& id) {
  return id.second.empty() ? std::to_string(id.first) : std::to_string(id.first) + '.' + id.second;
}

/// Columns of the CSV, without those of the parameters.
constexpr std::array kBefore = {"index", "branch", "split", "file", "sha256"};
constexpr std::array kAfter = {"attempt", "duration_s",    "sample_rate_hz", "channels",
                               "peak_pa", "full_scale_pa", "events",         "events_file",
                               "version", "cpu_features"};

std::string csvOf(const BatchPlan& plan, const BatchRows& rows) {
  std::string text;
  const auto put = [&text](const std::string& cell) {
    if (!text.empty() && text.back() != '\n') text += ',';
    text += cell;
  };
  for (const char* const column : kBefore)
    put(column);
  for (const BatchParameter& parameter : plan.spec.parameters)
    put(csvCell(parameter.name));
  for (const char* const column : kAfter)
    put(column);
  text += "\r\n";
  const auto cell = [](const ordered_json& object, const std::string& key) {
    return object.contains(key) ? csvCell(object.at(key)) : std::string();
  };
  for (const auto& [id, row] : rows.rows) {
    text += cell(row, kBefore[0]);
    for (std::size_t column = 1; column < kBefore.size(); ++column)
      text += ',' + cell(row, kBefore[column]);
    const ordered_json parameters = row.value("parameters", ordered_json::object());
    for (const BatchParameter& parameter : plan.spec.parameters)
      text += ',' + cell(parameters, parameter.name);
    for (const char* const column : kAfter)
      text += ',' + cell(row, column);
    text += "\r\n";
  }
  return text;
}

std::string linesOf(const std::map<BranchId, ordered_json>& objects) {
  std::string text;
  for (const auto& [id, object] : objects)
    text += object.dump() + '\n';
  return text;
}

/// The hash of a batch, of the hashes of its files.
class ContentHash {
 public:
  void add(const BranchId& id, const ordered_json& row) {
    hash_.add(nameOf(id));
    for (const RowFile& keys : kRowFiles)
      if (const std::string hash = textOf(row, keys.hash); !hash.empty())
        hash_.add(std::string(" ") + keys.name + ' ' + hash);
    hash_.add("\n");
  }
  std::string digits() { return hash_.digits(); }

 private:
  FileHash hash_;
};

}  // namespace

std::string contentHash(const BatchRows& rows) {
  ContentHash hash;
  for (const auto& [id, row] : rows.rows)
    hash.add(id, row);
  return hash.digits();
}

Status writeManifest(const BatchPlan& plan, const BatchRows& rows) {
  const std::array<std::pair<const char*, std::string>, 3> files = {
      std::pair{"manifest.jsonl", linesOf(rows.rows)},
      {"manifest.csv", csvOf(plan, rows)},
      {"failures.jsonl", linesOf(rows.failures)}};
  for (const auto& [name, text] : files)
    if (Status written = writeSampleFile(plan.folder / name, text); !written) return written;
  return std::monostate{};
}

Result<BatchCheck> verifyBatch(const BatchPlan& plan) {
  const Result<BatchRows> rows = readRows(plan);
  if (!rows) return rows.error();
  BatchCheck check;
  BatchRows whole{{}, rows->failures};
  std::set<std::string> machines;
  const auto blame = [&check](const BranchId& id, const std::string& what) {
    if (check.faults.size() < kMostFaults) check.faults.push_back(nameOf(id) + ": " + what);
  };
  for (const auto& [id, row] : rows->rows) {
    bool isMissing = false;
    bool isDamaged = false;
    for (const RowFile& keys : kRowFiles) {
      const std::string name = textOf(row, keys.name);
      if (name.empty()) continue;
      const Result<std::string> now = sha256OfFile(plan.folder / name);
      if (!now) {
        isMissing = true;
        blame(id, name + " " + now.error().message);
      } else if (*now != textOf(row, keys.hash)) {
        isDamaged = true;
        blame(id, name + " has another hash than when it was made");
      }
    }
    machines.insert(machineOf(row));
    if (isMissing) {
      ++check.missing;
    } else if (isDamaged) {
      ++check.damaged;
    } else {
      ++check.whole;
      whole.rows.emplace(id, row);
    }
  }
  for (std::uint64_t index = 0; index < plan.spec.count; ++index)
    for (const BatchBranch& branch : plan.spec.branches)
      if (const BranchId id{index, branch.name}; !rows->rows.contains(id)) {
        ++check.missing;
        const bool hasFailed =
            rows->failures.contains(id) || rows->failures.contains(BranchId{index, ""});
        blame(id, hasFailed ? "has failed, see failures.jsonl" : "has not been made yet");
      }
  check.machines.assign(machines.begin(), machines.end());
  check.contentHash = contentHash(whole);
  if (Status written = writeManifest(plan, whole); !written) return written.error();
  return check;
}

}  // namespace carom::lab
