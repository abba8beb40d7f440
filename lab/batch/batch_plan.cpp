#include "lab/batch/batch_plan.h"

#include <array>
#include <span>
#include <system_error>

#include "lab/batch/file_hash.h"
#include "lab/batch/sample_values.h"

#include "audio/io/byte_file.h"
#include "modal/json/json_reader.h"
#include "scenes/format/scene_loader.h"

namespace carom::lab {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* kPlanFile = "plan.json";
constexpr int kPlanFormat = 1;
/// Names in the folder of a batch that are written anew, by this and other commands.
constexpr std::array kBatchFiles = {"manifest.jsonl", "manifest.csv", "failures.jsonl", "README.md",
                                    "read.py",        "trial.json",   "report.html",    "slurm.sh",
                                    "parallel.sh",    "Snakefile"};

Result<json> documentOf(const std::string& text, const std::string& name) {
  modal::FirstError error(name);
  std::optional<json> document = modal::parseJson(text, error);
  if (!document) return error.error();
  return *std::move(document);
}

/// Returns the batch file's document with the lists of files as they are now, and without the
/// number of samples.
json frozen(json document, const BatchSpec& spec) {
  document.erase("count");
  document.erase("$schema");
  for (const char* const kind : {"grid", "choice", "permutation"}) {
    std::size_t at = 0;
    const auto freeze = [&](json& entry) {
      const auto list = entry.find(kind);
      if (list != entry.end() && list->is_object()) *list = spec.parameters[at].values;
    };
    if (json& scene = document.at("scene"); scene.is_object()) {
      freeze(scene);
      ++at;
    }
    if (document.contains("parameters"))
      for (json& entry : document.at("parameters")) {
        freeze(entry);
        ++at;
      }
  }
  return document;
}

/// Returns the hash of what samples depend on.
std::string hashOf(const json& batch, const std::map<std::string, json>& scenes) {
  return sha256(json{{"batch", batch}, {"scenes", scenes}}.dump());
}

json planJson(const BatchPlan& plan) {
  std::error_code ignored;
  const fs::path folder = fs::weakly_canonical(fs::absolute(plan.folder, ignored), ignored);
  const fs::path home = fs::weakly_canonical(fs::absolute(plan.home, ignored), ignored);
  return {{"carom_batch_plan", kPlanFormat},
          {"version", CAROM_VERSION},
          {"plan_hash", plan.hash},
          {"count", plan.spec.count},
          {"home", home.lexically_relative(folder).string()},
          {"batch", plan.document},
          {"scenes", plan.scenes}};
}

/// Refuses a plan that cannot make its first sample, as pointers that name no place would fail all.
Status validatePointers(const BatchPlan& plan) {
  const Result<SampleValues> values = drawValues(plan.spec, 0, 0);
  if (!values) return values.error();
  if (const Result<bool> rejected = isRejected(plan.spec, *values); !rejected)
    return rejected.error();
  for (const auto& [name, scene] : plan.scenes)
    for (const BatchBranch& branch : plan.spec.branches)
      if (const auto document = applied(plan.spec, *values, branch, scene); !document)
        return Error{name + ": " + document.error().message};
  return std::monostate{};
}

std::string padded(std::uint64_t number, std::size_t digits) {
  const std::string text = std::to_string(number);
  return std::string(text.size() < digits ? digits - text.size() : 0, '0') + text;
}

}  // namespace

Result<BatchPlan> makePlan(const fs::path& batchFile, const fs::path& folder,
                           std::optional<std::uint64_t> count) {
  const std::string file = batchFile.string();
  Result<std::string> text = scenes::readSceneText(batchFile);
  if (!text) return text.error();
  Result<BatchSpec> spec = parseBatch(*text, file);
  if (!spec) return spec.error();
  BatchPlan plan;
  plan.folder = folder;
  plan.spec = *std::move(spec);
  plan.home = batchFile.parent_path();
  if (count) plan.spec.count = *count;
  for (const std::string& name : plan.spec.scenes) {
    if (plan.scenes.contains(name)) continue;
    const Result<std::string> scene = scenes::readSceneText(plan.home / name);
    if (!scene) return Error{file + ": /scene: " + scene.error().message};
    Result<json> document = documentOf(*scene, (plan.home / name).string());
    if (!document) return document.error();
    plan.scenes[name] = *std::move(document);
  }
  plan.document = frozen(*documentOf(*text, file), plan.spec);
  plan.hash = hashOf(plan.document, plan.scenes);
  if (const Status valid = validatePointers(plan); !valid)
    return Error{file + ": " + valid.error().message};
  return plan;
}

Status savePlan(const BatchPlan& plan) {
  const fs::path file = plan.folder / kPlanFile;
  std::error_code failed;
  for (const char* const name : kBatchFiles)
    if (!fs::exists(file, failed) && fs::exists(plan.folder / name, failed))
      return Error{plan.folder.string() + ": has a " + name +
                   " that is of no batch, and a batch would write over it; expected an empty "
                   "folder, or one that has a plan"};
  if (fs::exists(file, failed)) {
    const Result<BatchPlan> there = loadPlan(plan.folder);
    if (!there) return there.error();
    if (there->hash != plan.hash)
      return Error{plan.folder.string() +
                   ": holds another plan; expected a folder without one, or the plan of the same "
                   "batch, of which only the number of samples may differ"};
  }
  fs::create_directories(plan.folder / "samples", failed);
  if (!failed) fs::create_directories(plan.folder / "rows", failed);
  if (failed)
    return Error{plan.folder.string() + ": cannot be made: " + failed.message() +
                 "; expected a folder that may be written"};
  std::string text;
  try {
    text = planJson(plan).dump(1) + "\n";
  } catch (const json::exception&) {
    return Error{plan.folder.string() +
                 ": it, or the batch's folder, has a name that is not UTF-8, which a plan cannot "
                 "say; expected another name"};
  }
  return audio::writeBytes(file, std::as_bytes(std::span(text)));
}

Result<BatchPlan> loadPlan(const fs::path& folder) {
  const fs::path path = folder / kPlanFile;
  const std::string file = path.string();
  const Result<std::vector<std::byte>> bytes = audio::readBytes(path);
  if (!bytes)
    return Error{file + ": " + bytes.error().message + " (of one that 'carom batch plan' wrote)"};
  const std::string text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  modal::FirstError error(file);
  const std::optional<json> document = modal::parseJson(text, error);
  if (!document) return error.error();
  const modal::JsonNode root(*document, "", error);
  constexpr modal::NumberRange kFormat{
      "a version of plans", kPlanFormat, kPlanFormat, "", false, false, true};
  constexpr modal::NumberRange kCount{"a number of samples", 1, 1e9, "", false, false, true};
  constexpr modal::TextRange kText{"a text", 0, 10'000};
  root.expectObject(
      "a plan", {"carom_batch_plan", "version", "plan_hash", "count", "home", "batch", "scenes"});
  root.number("carom_batch_plan", kFormat);
  BatchPlan plan;
  plan.folder = folder;
  const auto count = static_cast<std::uint64_t>(root.number("count", kCount));
  plan.home = (folder / root.text("home", kText, "")).lexically_normal();
  const auto batch = root.require("batch", "the batch");
  const auto scenes = root.require("scenes", "its scenes");
  if (error) return error.error();
  plan.document = document->at("batch");
  if (!plan.document.is_object() || !scenes->isObject())
    return Error{file + ": is no plan; expected one that 'carom batch plan' wrote"};
  plan.scenes = document->at("scenes").get<std::map<std::string, json>>();
  json counted = plan.document;
  counted["count"] = count;
  Result<BatchSpec> spec = parseBatch(counted.dump(), file);
  if (!spec) return spec.error();
  plan.spec = *std::move(spec);
  plan.hash = hashOf(plan.document, plan.scenes);
  if (plan.hash != root.text("plan_hash", kText, ""))
    return Error{file + ": does not match its own hash; expected a plan as it was written"};
  for (const std::string& name : plan.spec.scenes)
    if (!plan.scenes.contains(name))
      return Error{file + ": /scenes: has no " + modal::inQuotes(name) + "; expected all scenes"};
  return plan;
}

std::string sampleFile(std::uint64_t index, const std::string& branch, const std::string& ending) {
  constexpr std::uint64_t kInFolder = 100;
  std::string name = "samples/" + padded(index / kInFolder, 4) + '/' + padded(index, 6);
  if (!branch.empty()) name += '.' + branch;
  return name + ending;
}

}  // namespace carom::lab
