#include "carom/native/recording_format.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "native/recording/recording_archive.h"
#include "tests/native/recorded_worlds.h"

namespace carom {

using namespace native;

namespace {

using namespace test;
using Bytes = std::vector<std::byte>;

constexpr std::size_t kChecksumSize = 8;

/// Returns the bytes with a fitting checksum, as a malicious author would make them.
Bytes resealed(Bytes bytes) {
  if (bytes.size() < kChecksumSize) return bytes;
  bytes.resize(bytes.size() - kChecksumSize);
  const std::uint64_t checksum = recordingChecksum(bytes);
  ByteWriter(bytes).fixed(checksum, kChecksumSize);
  return bytes;
}

void play(const Recording& recording) {
  for (const double share : {0.0, 0.3, 1.0}) {
    const double time = recording.begin() + share * (recording.end() - recording.begin());
    for (std::size_t sphere = 0; sphere < recording.sphereCount(); ++sphere) {
      const SphereState state = recording.state(sphere, std::min(time, recording.end()));
      EXPECT_TRUE(state.position.allFinite() && state.velocity.allFinite());
    }
  }
  for (const ImpulseEvent& event : recording.eventsBetween(-1.0, recording.end()))
    EXPECT_TRUE(event.impulse.allFinite() && event.position.allFinite());
}

Recording shortRun() {
  SphereWorld world = cradle(3, 0.01, 1.0);
  world.gravity = kEarthGravity;
  for (Sphere& sphere : world.spheres) {
    sphere.restitution = 0.9;
    sphere.position.y() = 0.06;
  }
  world.planes = {floorPlane(0.8)};
  Recording recording = recordedRun(world, 0.1);
  recording.setPayload("three balls");
  return recording;
}

class RecordingFiles : public testing::TestWithParam<NamedWorld> {};

TEST_P(RecordingFiles, HoldEveryBit) {
  const Recording recording = recordedRun(GetParam().world, kRunTime);
  const Recording again = redecoded(recording);
  EXPECT_EQ(again.trajectoryHash(), recording.trajectoryHash());
  ASSERT_EQ(again.segmentCount(), recording.segmentCount());
  for (std::size_t sphere = 0; sphere < recording.sphereCount(); ++sphere) {
    for (std::size_t index = 0; index < recording.segments(sphere).size(); ++index) {
      const auto& one = recording.segments(sphere)[index];
      const auto& other = again.segments(sphere)[index];
      ASSERT_TRUE(one.since == other.since && sameBits(one.position, other.position) &&
                  sameBits(one.velocity, other.velocity) &&
                  sameBits(one.acceleration, other.acceleration));
    }
  }
  ASSERT_EQ(again.collisionCount(), recording.collisionCount());
  for (std::size_t collision = 0; collision < recording.collisionCount(); ++collision) {
    for (const std::size_t share : {0U, 1U})
      ASSERT_TRUE(sameBits(again.events(collision)[share], recording.events(collision)[share]));
  }
  EXPECT_EQ(encodedBytes(again), encodedBytes(recording));
}

INSTANTIATE_TEST_SUITE_P(Worlds, RecordingFiles, testing::ValuesIn(recordedWorlds()),
                         [](const auto& instance) { return instance.param.name; });

// For an elastic gas only the partners of each collision, and the times of exceptional records,
// have to be stored.
TEST(RecordingFormat, TakesFewBytesForACollision) {
  for (const NamedWorld& named : recordedWorlds()) {
    const Recording none = recordedRun(named.world, 0.0);
    const Recording recording = recordedRun(named.world, kRunTime);
    const double bytes =
        static_cast<double>(encodedBytes(recording).size() - encodedBytes(none).size());
    const auto collisions = static_cast<double>(recording.collisionCount());
    const auto segments = static_cast<double>(recording.log().size() - recording.collisionCount());
    std::printf("%-14s %6.0f collisions, %.2f segments and %.1f bytes for each\n",
                named.name.c_str(), collisions, segments / collisions, bytes / collisions);
    if (named.name == "ElasticGas") {
      EXPECT_LT(bytes / collisions, 8.0);
    }
  }
}

TEST(RecordingFormat, CarriesThePayloadWhateverItsBytes) {
  Recording recording = shortRun();
  std::string payload;
  for (int byte = 0; byte < 300; ++byte)
    payload += static_cast<char>(byte);
  for (const std::string& text : {std::string(), payload}) {
    recording.setPayload(text);
    EXPECT_EQ(redecoded(recording).payload(), text);
  }
}

TEST(RecordingFormat, RefusesEveryChangeOfAByteAndSaysWhichFile) {
  const Bytes whole = encodedBytes(shortRun());
  for (std::size_t at = 0; at < whole.size(); ++at) {
    for (const unsigned flip : {0x01U, 0x80U, 0xFFU}) {
      Bytes bytes = whole;
      bytes[at] ^= static_cast<std::byte>(flip);
      const Result<Recording> result = decoded(bytes, "run.carom");
      ASSERT_FALSE(result) << at;
      ASSERT_TRUE(result.error().message.starts_with("run.carom: ")) << result.error().message;
    }
  }
}

TEST(RecordingFormat, RefusesEveryPrefixAndWhatFollowsTheEnd) {
  const Bytes whole = encodedBytes(shortRun());
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const Bytes prefix(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
    ASSERT_FALSE(decoded(prefix, "run.carom")) << size;
    ASSERT_FALSE(decoded(resealed(prefix), "run.carom")) << size;
  }
  Bytes more = whole;
  more.push_back(std::byte{0});
  EXPECT_FALSE(decoded(more, "run.carom"));
  EXPECT_FALSE(decoded(resealed(more), "run.carom"));
}

TEST(RecordingFormat, WithAForgedChecksumIsASoundRecordingOrAnError) {
  const Bytes whole = encodedBytes(shortRun());
  int sound = 0;
  for (std::size_t at = 0; at + kChecksumSize < whole.size(); ++at) {
    for (int value = 0; value < 256; ++value) {
      Bytes bytes = whole;
      bytes[at] = static_cast<std::byte>(value);
      const Result<Recording> result = decoded(resealed(bytes), "run.carom");
      if (!result) continue;
      ++sound;
      play(*result);
    }
  }
  EXPECT_GT(sound, 0);
}

// The file is from a fuzzer: a collision with a body that does not exist, whose events are those
// that would be rebuilt.
TEST(RecordingFormat, WhatIsAcceptedCanBeWrittenAgain) {
  std::ifstream file(CAROM_SOURCE_DIR "/tests/fuzz/corpus/recording/nobody.carom",
                     std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(file)), {});
  const auto given = std::as_bytes(std::span(text));
  const Result<Recording> recording = decoded(resealed({given.begin(), given.end()}), "a.carom");
  ASSERT_TRUE(recording) << recording.error().message;
  const Result<Recording> again = decoded(encodedBytes(*recording), "b.carom");
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->trajectoryHash(), recording->trajectoryHash());
}

TEST(RecordingFormat, SaysWhatIsWrongAndWhatIsExpected) {
  const Bytes whole = encodedBytes(shortRun());
  const auto message = [](const Bytes& bytes) {
    const Result<Recording> result = decoded(bytes, "run.carom");
    return result ? std::string() : result.error().message;
  };
  EXPECT_EQ(message({}),
            "run.carom: is no recording; expected a file that 'carom record' has written");
  Bytes newer = whole;
  newer[8] = std::byte{9};
  EXPECT_EQ(message(resealed(newer)), "run.carom: is a recording of version 9; expected version 1");
  Bytes bent = whole;
  bent[20] ^= std::byte{1};
  EXPECT_NE(message(bent).find("checksum"), std::string::npos);
  Bytes huge(whole.begin(), whole.begin() + 12);
  ByteWriter writer(huge);
  double number = 0.0;
  for (int count = 0; count < 5; ++count)
    writer.number(number);
  std::uint64_t size = std::uint64_t{1} << 60U;
  writer.count(size);
  huge.resize(huge.size() + kChecksumSize);
  EXPECT_EQ(message(resealed(huge)), "run.carom: byte 61: the text is longer than what is left");
}

TEST(RecordingFormat, RefusesToWriteWhatCannotBeRead) {
  const Recording plain = shortRun();
  Recording recording(
      plain.world(), 0.0,
      std::vector{plain.segments(0).front(), plain.segments(1).front(), plain.segments(2).front()});
  Recording::Segment segment = plain.segments(0).front();
  segment.velocity.x() = std::numeric_limits<double>::infinity();
  recording.addSegment(0, segment);
  EXPECT_FALSE(encoded(recording));
}

// The bytes of one run. If they change, older files can no longer be read: raise kRecordingVersion,
// then update them.
TEST(RecordingFormat, GoldenBytes) {
  const Bytes bytes = encodedBytes(shortRun());
  EXPECT_EQ(bytes.size(), 454U);
  EXPECT_EQ(recordingChecksum(bytes), 3337292250191603107U);
}

TEST(RecordingArchive, CountsAndResidualsOfAllSizesComeBack) {
  SplitMix random(31);
  Bytes bytes;
  ByteWriter writer(bytes);
  std::vector<std::uint64_t> counts{0, 127, 128, ~std::uint64_t{0}};
  std::vector<double> numbers{
      0.0, -0.0, 1.0, -1.0, 5e-324, -1.7e308, std::numeric_limits<double>::infinity()};
  for (int shift = 0; shift < 64; ++shift)
    counts.push_back(std::uint64_t{0x9E3779B97F4A7C15} >> shift);
  for (int number = 0; number < 100; ++number)
    numbers.push_back(random.between(-1.0, 1.0) * std::pow(10.0, random.between(-300.0, 300.0)));
  for (std::uint64_t& count : counts)
    writer.count(count);
  for (double& number : numbers) {
    for (const double known : numbers)
      writer.residual(number, known);
  }
  ByteReader reader(bytes);
  for (const std::uint64_t expected : counts) {
    std::uint64_t count = 0;
    reader.count(count);
    EXPECT_EQ(count, expected);
  }
  for (const double expected : numbers) {
    for (const double known : numbers) {
      double number = 0.0;
      reader.residual(number, known);
      EXPECT_TRUE(sameBits(number, expected));
    }
  }
  EXPECT_TRUE(reader.atEnd() && !reader.failed());
}

TEST(RecordingArchive, NeighboursTakeOneByte) {
  Bytes bytes;
  ByteWriter writer(bytes);
  for (const double number : {1.0, -3.7, 1e-200}) {
    double next = std::nextafter(number, 10.0);
    writer.residual(next, number);
  }
  EXPECT_EQ(bytes.size(), 3U);
}

}  // namespace
}  // namespace carom
