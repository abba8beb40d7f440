// A recording keeps what it holds: on a disk that is full, and after a program that has died.

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "audio/io/partial_file.h"
#include "carom/audio/sound_file.h"
#include "tests/support/full_disk.h"
#include "tests/support/recording.h"
#include "tests/support/temporary_folder.h"

namespace carom {
namespace {

namespace fs = std::filesystem;

using test::contents;
using test::FullDisk;
using test::Recording;

constexpr std::size_t kBlock = 1000;  // frames

class KeptSound : public testing::Test {
 protected:
  fs::path path() const { return folder_ / "drum.wav"; }
  fs::path beside() const { return folder_ / "drum.incomplete.wav"; }

  /// Writes blocks of a constant pressure until one is refused, at most so many.
  static Status fill(SoundFileWriter& writer, std::size_t blocks, float pressure = 10.0F) {
    const std::vector<float> block(kBlock, pressure);
    for (std::size_t i = 0; i < blocks; ++i)
      if (Status written = writer.write(std::array{block.data()}, kBlock); !written) return written;
    return std::monostate{};
  }

  /// Ends a program in the midst of writing.
  void die(bool keepIncomplete, std::size_t blocks) const {
    const pid_t child = fork();
    if (child == 0) {
      auto writer = SoundFileWriter::create(path(), {.keepIncomplete = keepIncomplete});
      (void)fill(*writer, blocks);
      _exit(0);
    }
    waitpid(child, nullptr, 0);
  }

  void expectConstant(const fs::path& file, double sample, std::size_t least) const {
    const Recording recording = test::readRecording(file);
    EXPECT_GE(recording.samples.size(), least);
    for (const double heard : recording.samples)
      ASSERT_EQ(heard, sample);
  }

  const test::TemporaryFolder folder_;
};

TEST_F(KeptSound, IsAllThatFitsOnTheDisk) {
  const FullDisk disk(100'000);  // 24 blocks and 4 kB
  for (const bool limit : {false, true}) {
    fs::remove(path());
    auto writer = SoundFileWriter::create(path(), {.limit = limit, .keepIncomplete = true});
    ASSERT_TRUE(writer);
    const Status full = fill(*writer, 100);
    ASSERT_FALSE(full);
    EXPECT_NE(full.error().message.find("cannot be written: File too large"), std::string::npos)
        << full.error().message;
    EXPECT_NE(full.error().message.find("drum.wav'"), std::string::npos);
    EXPECT_FALSE(fill(*writer, 1));
    EXPECT_FALSE(writer->finish());
    expectConstant(path(), 0.5, 24'900);
    EXPECT_EQ(folder_.entries(), 1u);
  }
}

TEST_F(KeptSound, NeverReplacesAFileThatIsThere) {
  std::ofstream(path()) << "whole";
  std::ofstream(beside()) << "kept before";
  const FullDisk disk(100'000);
  auto writer = SoundFileWriter::create(path(), {.keepIncomplete = true});
  ASSERT_TRUE(writer);
  const Status full = fill(*writer, 100);
  ASSERT_FALSE(full);
  EXPECT_NE(full.error().message.find("drum.incomplete-2.wav'"), std::string::npos)
      << full.error().message;
  EXPECT_EQ(contents(path()), "whole");
  EXPECT_EQ(contents(beside()), "kept before");
  expectConstant(folder_ / "drum.incomplete-2.wav", 0.5, 24'900);
  EXPECT_EQ(folder_.entries(), 3u);
}

TEST_F(KeptSound, IsNoneWhereItCanBeMadeAgain) {
  std::ofstream(path()) << "whole";
  const FullDisk disk(100'000);
  {
    auto writer = SoundFileWriter::create(path(), {});
    ASSERT_TRUE(writer);
    ASSERT_FALSE(fill(*writer, 100));
  }
  EXPECT_EQ(contents(path()), "whole");
  EXPECT_EQ(folder_.entries(), 1u);
}

TEST_F(KeptSound, IsWholeThoughItCannotBeNormalised) {
  std::ofstream(path()) << "earlier";
  auto writer = SoundFileWriter::create(path(), {.normalize = true, .keepIncomplete = true});
  ASSERT_TRUE(writer);
  ASSERT_TRUE(fill(*writer, 20));
  const FullDisk disk(50'000);
  const Status finished = writer->finish();
  ASSERT_FALSE(finished);
  EXPECT_NE(finished.error().message.find("it is whole, with a full scale of 20 Pa"),
            std::string::npos)
      << finished.error().message;
  expectConstant(path(), 0.5, 20'000);
  EXPECT_EQ(folder_.entries(), 1u);
}

TEST_F(KeptSound, ThatIsNormalisedIsOneFile) {
  {
    auto writer = SoundFileWriter::create(path(), {.normalize = true, .keepIncomplete = true});
    ASSERT_TRUE(writer && fill(*writer, 20) && writer->finish());
  }
  expectConstant(path(), 1.0, 20'000);
  EXPECT_EQ(folder_.entries(), 1u);
}

// Whatever fails behind the last sample, the sound is there.
TEST_F(KeptSound, StaysWhereItsNameCannotBeGiven) {
  for (const bool normalize : {false, true}) {
    auto writer = SoundFileWriter::create(path(), {.normalize = normalize, .keepIncomplete = true});
    ASSERT_TRUE(writer && fill(*writer, 20));
    fs::create_directory(path());
    const Status finished = writer->finish();
    ASSERT_FALSE(finished);
    EXPECT_NE(finished.error().message.find("drum.incomplete.wav'"), std::string::npos)
        << finished.error().message;
    expectConstant(beside(), 0.5, 20'000);
    EXPECT_EQ(folder_.entries(), 2u);
    fs::remove(beside());
    fs::remove(path());
  }
}

TEST_F(KeptSound, ThatWasCutBySomebodyElseIsNotNormalisedInPart) {
  auto writer = SoundFileWriter::create(path(), {.normalize = true, .keepIncomplete = true});
  ASSERT_TRUE(writer && fill(*writer, 20));
  for (const auto& entry : fs::directory_iterator(path().parent_path()))
    fs::resize_file(entry.path(), fs::file_size(entry.path()) / 2);
  const Status finished = writer->finish();
  ASSERT_FALSE(finished);
  EXPECT_NE(finished.error().message.find("cannot be read back to its end"), std::string::npos)
      << finished.error().message;
}

TEST_F(KeptSound, OfAWriterThatIsNotFinishedIsUnderItsName) {
  {
    auto writer = SoundFileWriter::create(path(), {.keepIncomplete = true});
    ASSERT_TRUE(writer);
    ASSERT_TRUE(fill(*writer, 3));
  }
  expectConstant(path(), 0.5, 3 * kBlock);
  { auto empty = SoundFileWriter::create(path(), {.keepIncomplete = true}); }
  EXPECT_EQ(folder_.entries(), 1u) << "an empty one is not kept";
}

TEST_F(KeptSound, OfAProgramThatDiedCanBePlayedAndIsFoundByTheNext) {
  std::ofstream(path()) << "earlier";
  die(true, 7);
  EXPECT_EQ(folder_.entries(), 2u);
  for (const auto& entry : fs::directory_iterator(folder_.path()))
    if (entry.path() != path()) expectConstant(entry.path(), 0.5, 7 * kBlock);

  {
    auto writer = SoundFileWriter::create(path(), {.normalize = true});  // of another kind
    ASSERT_TRUE(writer);
    ASSERT_EQ(writer->recovered(), std::vector{beside()});
    expectConstant(beside(), 0.5, 7 * kBlock);
    ASSERT_TRUE(fill(*writer, 2, 1.0F));
    ASSERT_TRUE(writer->finish());
  }
  expectConstant(path(), 1.0, 2 * kBlock);
  EXPECT_EQ(folder_.entries(), 2u);
}

TEST_F(KeptSound, OfAProgramThatDiedWithoutSoundIsRemoved) {
  die(false, 7);
  die(true, 0);
  EXPECT_EQ(folder_.entries(), 1u);
  auto writer = SoundFileWriter::create(path(), {});
  ASSERT_TRUE(writer);
  EXPECT_TRUE(writer->recovered().empty());
  EXPECT_EQ(folder_.entries(), 1u) << "the one that is written";
}

TEST_F(KeptSound, OfAProgramThatStillRunsIsLeftAlone) {
  auto first = SoundFileWriter::create(path(), {.keepIncomplete = true});
  ASSERT_TRUE(first);
  ASSERT_TRUE(fill(*first, 3));
  auto second = SoundFileWriter::create(path(), {.keepIncomplete = true});
  ASSERT_TRUE(second);
  EXPECT_TRUE(second->recovered().empty());
  ASSERT_TRUE(fill(*second, 2));
  ASSERT_TRUE(first->finish());
  expectConstant(path(), 0.5, 3 * kBlock);
  ASSERT_TRUE(second->finish());
  expectConstant(path(), 0.5, 2 * kBlock);
  EXPECT_EQ(folder_.entries(), 1u);
}

TEST_F(KeptSound, IsWhatASignalLeavesOfPartialFiles) {
  const pid_t child = fork();
  if (child == 0) {
    auto dropped = SoundFileWriter::create(path(), {});
    auto kept = SoundFileWriter::create(folder_ / "kept.wav", {.keepIncomplete = true});
    (void)fill(*dropped, 1);
    (void)fill(*kept, 1);
    audio::PartialFile::removeAll();
    _exit(0);
  }
  waitpid(child, nullptr, 0);
  EXPECT_EQ(folder_.entries(), 1u);
  auto writer = SoundFileWriter::create(folder_ / "kept.wav", {});
  EXPECT_EQ(writer->recovered().size(), 1u);
}

}  // namespace
}  // namespace carom
