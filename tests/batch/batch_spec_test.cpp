#include "lab/batch/batch_spec.h"

#include <filesystem>
#include <string>
#include <vector>

#include "lab/batch/batch_plan.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validator.hpp>

#include "tests/batch/batch_files.h"

namespace carom::lab {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::contents;
using test::TemporaryFolder;
using testing::ElementsAre;
using testing::HasSubstr;

const fs::path kSource = CAROM_SOURCE_DIR;

/// True if the schema in the repository accepts the document.
bool isValid(const json& document) {
  const json text = json::parse(contents(kSource / "scenes/batch.schema.json"));
  valijson::Schema schema;
  valijson::SchemaParser().populateSchema(valijson::adapters::NlohmannJsonAdapter(text), schema);
  return valijson::Validator().validate(schema, valijson::adapters::NlohmannJsonAdapter(document),
                                        nullptr);
}

std::string refusal(const json& document) {
  const Result<BatchSpec> spec = parseBatch(document.dump(), "b.json");
  return spec ? "" : spec.error().message;
}

json withParameter(const json& parameter) {
  return {{"scene", "s.json"}, {"count", 3}, {"parameters", {parameter}}};
}

struct Refused {
  json document;
  std::string message;    // part of it
  bool schemaToo = true;  // the schema refuses it as well
};

std::vector<Refused> refused() {
  const auto one = [](const json& parameter, const std::string& message, bool schemaToo = true) {
    return Refused{withParameter(parameter), message, schemaToo};
  };
  return {
      {json::array(), "expected an object"},
      {{{"count", 1}}, "scene"},
      {{{"scene", "s.json"}},
       "/count: missing; expected a number of samples, as there is no grid",
       false},
      {{{"scene", "s.json"}, {"count", 0}}, "/count: 0 is not a number of samples"},
      {{{"scene", "s.json"}, {"count", 1.5}}, "/count: 1.5 is not a number of samples"},
      {{{"scene", "s.json"}, {"count", 1}, {"colour", 1}}, "colour"},
      {{{"scene", {{"choice", {1}}}}, {"count", 1}}, "/scene: has a value that is no text"},
      one({{"name", "a"}}, "/parameters/0: says not how it is drawn"),
      one({{"name", "a"}, {"grid", {1}}, {"choice", {1}}}, "says in several ways", false),
      one({{"name", "A"}, {"grid", {1}}}, "\"A\" is no name"),
      one({{"name", "1a"}, {"grid", {1}}}, "\"1a\" is no name"),
      one({{"name", "scene"}, {"grid", {1}}}, "expected another name", false),
      one({{"name", "a"}, {"grid", json::array()}}, "a list of values"),
      one({{"name", "a"}, {"uniform", {2, 1}}}, "/parameters/0/uniform", false),
      one({{"name", "a"}, {"uniform", {0.2, 0.8}}, {"whole", true}}, "no whole number", false),
      one({{"name", "a"}, {"log_uniform", {0, 1}}}, "expected both ends above 0"),
      one({{"name", "a"}, {"normal", {0, 0}}}, "/parameters/0/normal/1"),
      one({{"name", "a"}, {"normal", {0, 1}}, {"within", {4, 5}}}, "three deviations", false),
      one({{"name", "a"}, {"uniform", {0, 1}}, {"within", {0, 1}}}, "\"normal\" only", false),
      one({{"name", "a"}, {"choice", {1, 2}}, {"weights", {1}}}, "/parameters/0/weights", false),
      one({{"name", "a"}, {"choice", {1, 2}}, {"weights", {0, 0}}}, "are all 0", false),
      one({{"name", "a"}, {"grid", {1, 2}}, {"weights", {1, 1}}}, "\"choice\" only", false),
      one({{"name", "a"}, {"grid", {1}}, {"at", "bodies"}}, "is no JSON pointer"),
      one({{"name", "a"}, {"grid", {1}}, {"at", ""}}, "/parameters/0/at"),
      one({{"name", "a"}, {"permutation", {1, 2, 3}}, {"at", {"/a", "/b"}}},
          "2 pointers for 3 values", false),
      one({{"name", "a"}, {"grid", {{"files", "none/*.obj"}}}}, "no file is like", false),
      {{{"scene", "s.json"}, {"count", 1}, {"branches", json::array()}}, "/branches"},
      {{{"scene", "s.json"}, {"count", 1}, {"branches", {{{"name", "a"}}, {{"name", "a"}}}}},
       "is taken",
       false},
      {{{"scene", "s.json"}, {"count", 1}, {"reject_if", {{"silent", -1}}}}, "/reject_if/silent"},
      {{{"scene", "s.json"}, {"count", 1}, {"split", {{"by", {"x"}}}}},
       "no parameter \"x\"",
       false},
      {{{"scene", "s.json"}, {"count", 1}, {"split", {{"test", 0.6}, {"validation", 0.6}}}},
       "more than 1 together",
       false},
      {{{"scene", "s.json"}, {"count", 1}, {"limits", {{"time", 0}}}}, "/limits/time"},
  };
}

TEST(BatchSpec, RefusesWhatItCannotDoAndSaysWhere) {
  for (const Refused& one : refused()) {
    EXPECT_THAT(refusal(one.document), HasSubstr(one.message)) << one.document;
    EXPECT_THAT(refusal(one.document), HasSubstr("xpected")) << one.document;
    EXPECT_EQ(isValid(one.document), !one.schemaToo) << one.document;
  }
}

TEST(BatchSpec, ReadsEveryKindOfParameter) {
  const json document = {
      {"scene", "s.json"},
      {"seed", 9},
      {"parameters",
       {{{"name", "a"}, {"grid", {1, 2, 3}}, {"at", "/a"}},
        {{"name", "b"}, {"grid", {"x", "y"}}, {"at", {"/b", "/c"}}},
        {{"name", "c"}, {"choice", {1, 2}}, {"weights", {1, 3}}},
        {{"name", "d"}, {"uniform", {0, 1}}},
        {{"name", "e"}, {"uniform", {1, 6}}, {"whole", true}},
        {{"name", "f"}, {"log_uniform", {0.1, 10}}},
        {{"name", "g"}, {"normal", {1, 0.1}}, {"within", {0.8, 1.2}}},
        {{"name", "h"}, {"permutation", {1, 2}}, {"at", {"/d", "/e"}}},
        {{"name", "i"}, {"expression", "2 * d"}}}},
      {"branches", {{{"name", "one"}}, {{"name", "two"}, {"set", {{"/a", 4}}}}}},
      {"reject_if",
       {{"overlap", true}, {"silent", 0.001}, {"expression", "a > b"}, {"attempts", 7}}},
      {"outputs", {{"events", false}}},
      {"split", {{"by", {"a"}}, {"validation", 0.2}, {"test", 0.3}}},
      {"limits", {{"time", 5}, {"memory", 1e9}, {"events", 1000}}}};
  EXPECT_TRUE(isValid(document));
  const Result<BatchSpec> spec = parseBatch(document.dump(), "b.json");
  ASSERT_TRUE(spec) << spec.error().message;
  EXPECT_EQ(spec->name, "b");
  EXPECT_EQ(spec->seed, 9U);
  EXPECT_EQ(spec->count, 6U);  // points of both grids
  EXPECT_EQ(spec->parameters.size(), 9U);
  EXPECT_THAT(spec->parameters[1].at, ElementsAre("/b", "/c"));
  EXPECT_TRUE(spec->parameters[4].whole);
  EXPECT_EQ(spec->parameters[6].low, 0.8);
  EXPECT_EQ(spec->branches[1].set.front().second, 4);
  EXPECT_EQ(spec->rejections.attempts, 7U);
  EXPECT_FALSE(spec->outputs.events);
  EXPECT_EQ(spec->limits.events, 1000U);
}

TEST(BatchSpec, PatternsStandForTheFilesThatAreThere) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "meshes");
  for (const char* const name : {"b.obj", "a.obj", "a.stl"})
    test::write(folder / "meshes" / name, "");
  json batch = withParameter({{"name", "mesh"}, {"grid", {{"files", "meshes/*.obj"}}}});
  batch.erase("count");
  EXPECT_TRUE(isValid(batch));
  const Result<BatchSpec> spec = parseBatch(batch.dump(), (folder / "b.json").string());
  ASSERT_TRUE(spec) << spec.error().message;
  EXPECT_EQ(spec->parameters[0].values, json({"meshes/a.obj", "meshes/b.obj"}));
  EXPECT_EQ(spec->count, 2U);
}

TEST(BatchPlan, StaysAsItWasWhenFilesComeAndGo) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "meshes");
  test::write(folder / "meshes/a.obj", "");
  json batch = {{"parameters", {{{"name", "mesh"}, {"grid", {{"files", "meshes/*.obj"}}}}}}};
  const Result<BatchPlan> made = makePlan(writeBatch(folder, batch), folder / "plan", {});
  ASSERT_TRUE(made) << made.error().message;
  ASSERT_TRUE(savePlan(*made));
  test::write(folder / "meshes/b.obj", "");
  test::write(folder / "ball.json", "{}");
  const Result<BatchPlan> loaded = loadPlan(folder / "plan");
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_EQ(loaded->spec.parameters[0].values, json({"meshes/a.obj"}));
  EXPECT_EQ(loaded->scenes, made->scenes);
  EXPECT_EQ(loaded->hash, made->hash);
}

TEST(BatchPlan, ItsHashIsOfWhatSamplesDependOn) {
  const TemporaryFolder folder;
  const auto hashOf = [&](const json& batch, const json& scene) {
    const Result<BatchPlan> plan = makePlan(writeBatch(folder, batch, scene), folder / "plan", {});
    return plan ? plan->hash : plan.error().message;
  };
  const std::string hash = hashOf(test::ballBatch(3), test::ballScene());
  EXPECT_EQ(hashOf(test::ballBatch(4), test::ballScene()), hash);
  json seeded = test::ballBatch(3);
  seeded["seed"] = 6;
  EXPECT_NE(hashOf(seeded, test::ballScene()), hash);
  json longer = test::ballScene();
  longer["duration"] = 0.6;
  EXPECT_NE(hashOf(test::ballBatch(3), longer), hash);
}

TEST(BatchPlan, RefusesPointersThatNameNoPlace) {
  const TemporaryFolder folder;
  for (const char* const pointer : {"/bodies/2/radius", "/bodies/-", "/no/where", "/duration/x"}) {
    json batch = test::ballBatch(1);
    batch["parameters"][0]["at"] = pointer;
    const auto plan = makePlan(writeBatch(folder, batch), folder / "plan", {});
    ASSERT_FALSE(plan) << pointer;
    EXPECT_THAT(plan.error().message, HasSubstr("there is no place \"" + std::string(pointer)));
  }
}

TEST(BatchPlan, RefusesAFolderThatHoldsAnother) {
  const TemporaryFolder folder;
  const auto first = makePlan(writeBatch(folder, test::ballBatch(2)), folder / "plan", {});
  ASSERT_TRUE(first && savePlan(*first));
  const auto more = makePlan(folder / "batch.json", folder / "plan", 5);
  EXPECT_TRUE(more && savePlan(*more));
  EXPECT_EQ(loadPlan(folder / "plan")->spec.count, 5U);
  json other = test::ballBatch(2);
  other["seed"] = 8;
  const auto second = makePlan(writeBatch(folder, other), folder / "plan", {});
  ASSERT_TRUE(second);
  const Status saved = savePlan(*second);
  ASSERT_FALSE(saved);
  EXPECT_THAT(saved.error().message, HasSubstr("holds another plan"));
}

TEST(BatchPlan, RefusesAPlanThatWasEdited) {
  const TemporaryFolder folder;
  const auto plan = makePlan(writeBatch(folder, test::ballBatch(2)), folder / "plan", {});
  ASSERT_TRUE(plan && savePlan(*plan));
  json document = json::parse(contents(folder / "plan/plan.json"));
  document["batch"]["seed"] = 99;
  test::write(folder / "plan/plan.json", document.dump());
  const auto loaded = loadPlan(folder / "plan");
  ASSERT_FALSE(loaded);
  EXPECT_THAT(loaded.error().message, HasSubstr("its own hash"));
}

TEST(BatchLibrary, EveryBatchIsAPlanAndFitsTheSchema) {
  const TemporaryFolder folder;
  std::size_t batches = 0;
  for (const auto& entry : fs::directory_iterator(kSource / "scenes/batches")) {
    if (entry.path().extension() != ".json") continue;
    ++batches;
    const auto plan = makePlan(entry.path(), folder / "plan", {});
    EXPECT_TRUE(plan) << plan.error().message;
    EXPECT_TRUE(isValid(json::parse(contents(entry.path())))) << entry.path();
  }
  EXPECT_GE(batches, 3U);
}

}  // namespace
}  // namespace carom::lab
