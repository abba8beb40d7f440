#include "lab/batch/batch_rows.h"

#include <filesystem>
#include <string>
#include <vector>

#include "lab/batch/file_hash.h"
#include "lab/batch/manifest.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/batch/batch_files.h"

namespace carom::lab {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::contents;
using test::TemporaryFolder;
using testing::ElementsAre;

/// A plan of two branches of three samples, in a folder.
class BatchRowsTest : public testing::Test {
 protected:
  BatchRowsTest() {
    json batch = test::ballBatch(3);
    batch["branches"] = {{{"name", "a"}}, {{"name", "b"}}};
    plan_ = *makePlan(writeBatch(folder_, batch), folder_ / "plan", {});
    EXPECT_TRUE(savePlan(plan_));
  }

  /// The row of a branch whose file is there.
  nlohmann::ordered_json rowOf(std::uint64_t index, const std::string& branch) {
    const std::string name = sampleFile(index, branch, ".wav");
    const std::string text = "sound of " + name;
    fs::create_directories((plan_.folder / name).parent_path());
    test::write(plan_.folder / name, text);
    return {{"index", index},       {"branch", branch},       {"file", name},
            {"bytes", text.size()}, {"sha256", sha256(text)}, {"version", "1"}};
  }

  void log(const std::vector<nlohmann::ordered_json>& lines) {
    RowLog log = *RowLog::create(plan_);
    for (const auto& line : lines)
      EXPECT_TRUE(log.add(line));
  }

  std::vector<bool> done(const DoneRules& rules = {}) {
    return doneSamples(plan_, *readRows(plan_), rules);
  }

  TemporaryFolder folder_;
  BatchPlan plan_;
};

TEST_F(BatchRowsTest, ASampleIsDoneWhenAllItsBranchesAre) {
  log({rowOf(0, "a"), rowOf(0, "b"), rowOf(1, "a")});
  log({rowOf(2, "b")});
  EXPECT_THAT(done(), ElementsAre(true, false, false));
  log({rowOf(2, "a")});
  EXPECT_THAT(done(), ElementsAre(true, false, true));
}

TEST_F(BatchRowsTest, FailuresAreDoneUnlessTriedAgain) {
  log({rowOf(0, "a"),
       {{"index", 0}, {"branch", "b"}, {"failure", "limit"}},
       {{"index", 1}, {"failure", "crashed"}}});
  EXPECT_THAT(done(), ElementsAre(true, true, false));
  EXPECT_THAT(done({.failuresCount = false}), ElementsAre(false, false, false));
  log({rowOf(0, "b")});
  EXPECT_THAT(done({.failuresCount = false}), ElementsAre(true, false, false));
  EXPECT_EQ(readRows(plan_)->failures.size(), 1U);
}

TEST_F(BatchRowsTest, AFailureOfAllBranchesIsOverWhenAllOfThemAreMade) {
  log({{{"index", 0}, {"failure", "crashed"}}, {{"index", 1}, {"failure", "hung"}}});
  EXPECT_THAT(done(), ElementsAre(true, true, false));
  log({rowOf(0, "a"), rowOf(0, "b"), rowOf(1, "a")});
  EXPECT_THAT(done(), ElementsAre(true, true, false));
  EXPECT_EQ(readRows(plan_)->failures.size(), 1U);
  // Samples whose files are lost are to be made again, though they had failed before they were
  // made.
  fs::remove(plan_.folder / sampleFile(0, "a", ".wav"));
  fs::remove(plan_.folder / sampleFile(1, "a", ".wav"));
  EXPECT_THAT(done(), ElementsAre(false, false, false));
}

TEST_F(BatchRowsTest, ARepairThatFailsIsAFailure) {
  log({rowOf(0, "a"), rowOf(0, "b")});
  test::write(plan_.folder / sampleFile(0, "a", ".wav"), "SOUND of another length");
  log({{{"index", 0}, {"failure", "crashed"}}});
  EXPECT_EQ(readRows(plan_)->failures.size(), 1U);
  EXPECT_THAT(done(), ElementsAre(false, false, false));
  log({rowOf(0, "a"), rowOf(0, "b")});
  EXPECT_TRUE(readRows(plan_)->failures.empty());
}

// Two runs may make one sample: what one of them has made is whole, whatever became of the other.
TEST_F(BatchRowsTest, AFailureOfWhatIsWholeDoesNotCount) {
  log({rowOf(0, "a"), rowOf(0, "b")});
  log({{{"index", 0}, {"failure", "crashed"}},
       {{"index", 0}, {"branch", "b"}, {"failure", "limit"}}});
  EXPECT_TRUE(readRows(plan_)->failures.empty());
}

TEST_F(BatchRowsTest, AFailedBranchAndAFailedSampleDoNotMakeAnotherBranchDone) {
  log({rowOf(0, "a"), {{"index", 0}, {"branch", "b"}, {"failure", "limit"}}});
  log({{{"index", 0}, {"failure", "crashed"}}});
  fs::remove(plan_.folder / sampleFile(0, "a", ".wav"));
  EXPECT_THAT(done(), ElementsAre(false, false, false));
}

// Processes' numbers are no order of time, nor are the names of machines.
TEST_F(BatchRowsTest, WhatWasToldLastCounts) {
  nlohmann::ordered_json old = rowOf(0, "a");
  old["sha256"] = sha256("the sound of another version");
  test::write(plan_.folder / "rows" / "zebra.99999.1000000000.jsonl", old.dump() + "\n");
  log({rowOf(0, "a"), rowOf(0, "b")});
  EXPECT_THAT(done({.hashes = true}), ElementsAre(true, false, false));
}

TEST_F(BatchRowsTest, ALineThatARunWasKilledInIsLeftOut) {
  log({rowOf(0, "a")});
  const std::string line = rowOf(0, "b").dump();
  for (const std::size_t size : {std::size_t{1}, line.size() / 2, line.size() - 1}) {
    test::write(plan_.folder / "rows" / "torn.jsonl", line.substr(0, size));
    EXPECT_THAT(done(), ElementsAre(false, false, false)) << size;
  }
  test::write(plan_.folder / "rows" / "torn.jsonl", line + "\nnonsense\n[]\n{}\n");
  EXPECT_THAT(done(), ElementsAre(true, false, false));
}

// `carom batch pack` would pack such a file, and `carom batch verify` would read it to its end.
TEST_F(BatchRowsTest, ARowNamesItsOwnFilesOnly) {
  const auto isRead = [&](const char* key, const nlohmann::ordered_json& value) {
    nlohmann::ordered_json row = rowOf(0, "a");
    row[key] = value;
    test::write(plan_.folder / "rows" / "other.jsonl", row.dump() + "\n");
    return readRows(plan_)->rows.size() == 1;
  };
  EXPECT_TRUE(isRead("split", "test"));
  EXPECT_FALSE(isRead("split", "../../x"));
  EXPECT_FALSE(isRead("split", 7));
  EXPECT_TRUE(isRead("file", sampleFile(0, "a", ".clicks.flac")));
  for (const char* const name :
       {"/etc/passwd", "../secret", "-C", "", ".", "/dev/zero", "samples/0000/000000.a",
        "samples/0000/000000.b.wav", "samples/0000/000001.a.wav", "samples/0000/000000.a./../../x",
        "samples/0000/000000.a.wav\n/etc/passwd"})
    EXPECT_FALSE(isRead("file", name)) << name;
  for (const char* const key : {"file", "bytes", "sha256", "version", "duration_s", "parameters"})
    EXPECT_FALSE(isRead(key, nlohmann::ordered_json::array())) << key;
  EXPECT_FALSE(isRead("events_file", "samples/0000/000000.a.events.csv"));  // without its hash
  EXPECT_FALSE(isRead("branch", "../a"));
}

TEST_F(BatchRowsTest, OnlyRegularFilesAreHashed) {
  EXPECT_FALSE(sha256OfFile("/dev/zero"));
  EXPECT_FALSE(sha256OfFile(plan_.folder));
  fs::create_symlink("/dev/zero", plan_.folder / "endless.wav");
  EXPECT_FALSE(sha256OfFile(plan_.folder / "endless.wav"));
}

TEST_F(BatchRowsTest, FilesAreLookedAt) {
  log({rowOf(0, "a"), rowOf(0, "b"), rowOf(1, "a"), rowOf(1, "b"), rowOf(2, "a"), rowOf(2, "b")});
  fs::remove(plan_.folder / sampleFile(0, "a", ".wav"));
  std::string changed = contents(plan_.folder / sampleFile(1, "b", ".wav"));
  changed.front() = 'X';
  test::write(plan_.folder / sampleFile(1, "b", ".wav"), changed);
  EXPECT_THAT(done(), ElementsAre(false, true, true));
  EXPECT_THAT(done({.hashes = true}), ElementsAre(false, false, true));
  const Result<BatchCheck> check = verifyBatch(plan_);
  ASSERT_TRUE(check);
  EXPECT_EQ(check->whole, 4U);
  EXPECT_EQ(check->missing, 1U);
  EXPECT_EQ(check->damaged, 1U);
  EXPECT_EQ(check->faults.size(), 2U);
}

TEST_F(BatchRowsTest, TheContentsHashDoesNotDependOnTheOrder) {
  log({rowOf(0, "a"), rowOf(0, "b")});
  log({rowOf(1, "b")});
  const std::string hash = contentHash(*readRows(plan_));
  for (const auto& file : fs::directory_iterator(plan_.folder / "rows"))
    fs::remove(file.path());
  log({rowOf(1, "b"), rowOf(0, "b")});
  log({rowOf(0, "a")});
  EXPECT_EQ(contentHash(*readRows(plan_)), hash);
  log({rowOf(1, "a")});
  EXPECT_NE(contentHash(*readRows(plan_)), hash);
}

TEST_F(BatchRowsTest, RowsBeyondASmallerPlanDoNotCount) {
  log({rowOf(0, "a"), rowOf(0, "b"), rowOf(2, "a")});
  plan_.spec.count = 1;
  EXPECT_EQ(readRows(plan_)->rows.size(), 2U);
  EXPECT_THAT(done(), ElementsAre(true));
}

}  // namespace
}  // namespace carom::lab
