#include "lab/batch/tar_shards.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <system_error>

#include "lab/batch/run_program.h"
#include "lab/batch/sample_run.h"

namespace carom::lab {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

/// Returns the names of a row's files, the record among them.
std::vector<std::string> filesOf(const BranchId& id, const ordered_json& row) {
  std::vector<std::string> files = {sampleFile(id.first, id.second, ".json")};
  for (const RowFile& keys : kRowFiles)
    if (const std::string name = row.value(keys.name, ""); !name.empty()) files.push_back(name);
  std::ranges::sort(files);
  return files;
}

/// Packs files, whose names are relative to the plan's folder, without their folders.
Status pack(const BatchPlan& plan, const std::string& shard, const std::string& list) {
  const fs::path names = plan.folder / "shards/names.txt";
  if (Status written = writeSampleFile(names, list); !written) return written;
  const fs::path file = plan.folder / shard;
  const fs::path partial = file.string() + ".partial";
  const int code =
      runProgram({"tar", "--create", "--file", partial.string(), "--format=ustar", "--mtime=@0",
                  "--owner=0", "--group=0", "--numeric-owner", "--mode=644", "--transform=s,.*/,,",
                  "--directory", plan.folder.string(), "--files-from", names.string()});
  std::error_code failed;
  fs::remove(names, failed);
  if (code == 0) fs::rename(partial, file, failed);
  if (code == 0 && !failed) return std::monostate{};
  fs::remove(partial, failed);
  return Error{file.string() +
               ": cannot be written; expected GNU tar in PATH, and room on the disk"};
}

}  // namespace

Result<std::vector<std::string>> packBatch(const BatchPlan& plan, const BatchRows& rows,
                                           std::uint64_t samples) {
  std::error_code failed;
  fs::create_directory(plan.folder / "shards", failed);
  // The indices of each split's samples, each with the names of its files, a line for each.
  std::map<std::string, std::map<std::uint64_t, std::string>> splits;
  for (const auto& [id, row] : rows.rows) {
    std::string& names = splits[row.value("split", "train")][id.first];
    for (const std::string& file : filesOf(id, row))
      names += file + '\n';
  }
  std::vector<std::string> shards;
  for (const auto& [split, all] : splits) {
    std::string list;
    std::uint64_t number = 0;
    std::uint64_t written = 0;
    for (const auto& [index, names] : all) {
      list += names;
      ++number;
      if (number % samples != 0 && number != all.size()) continue;
      std::string digits = std::to_string(written++);
      digits.insert(0, 6 - std::min<std::size_t>(6, digits.size()), '0');
      std::string& shard = shards.emplace_back("shards/");
      shard.append(split).append("-").append(digits).append(".tar");
      if (Status packed = pack(plan, shard, list); !packed) return packed.error();
      list.clear();
    }
  }
  return shards;
}

}  // namespace carom::lab
