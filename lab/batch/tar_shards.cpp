#include "lab/batch/tar_shards.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <string_view>
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

/// True for a name that packBatch gives.
bool isShardName(const std::string& name) {
  const std::size_t dash = name.rfind('-');
  constexpr std::string_view kEnding = ".tar";
  if (dash == name.npos || !name.ends_with(kEnding)) return false;
  const std::string_view split = std::string_view(name).substr(0, dash);
  const std::string_view number =
      std::string_view(name).substr(dash + 1, name.size() - dash - 1 - kEnding.size());
  return (split == "train" || split == "validation" || split == "test") && number.size() >= 6 &&
         number.find_first_not_of("0123456789") == number.npos;
}

/// Removes shards of an earlier packing, whose samples are in others now.
void removeOthers(const fs::path& folder, const std::vector<std::string>& shards) {
  std::vector<fs::path> others;
  std::error_code failed;
  for (fs::directory_iterator entry(folder / "shards", failed), none; !failed && entry != none;
       entry.increment(failed)) {
    const std::string name = entry->path().filename().string();
    if (isShardName(name) && std::ranges::find(shards, "shards/" + name) == shards.end())
      others.push_back(entry->path());
  }
  for (const fs::path& other : others)
    fs::remove(other, failed);
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
  // Rows that are gone do not mean that the samples of older shards are.
  if (!shards.empty()) removeOthers(plan.folder, shards);
  return shards;
}

}  // namespace carom::lab
