#include "scenes/rows/events_file.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "tests/support/csv.h"
#include "tests/support/temporary_folder.h"

namespace carom::test {

using namespace scenes;

namespace {

namespace fs = std::filesystem;

enum Column {
  kTime,
  kBody,
  kOther,
  kImpulse,
  kPoint = 6,
  kNormal = 9,
  kSpeed = 12,
  kMass,
  kTau,
  kCollision,
  kPeak,
  kHeard
};

Scene sceneWith(const std::vector<std::string>& names) {
  Scene scene;
  for (const std::string& name : names)
    scene.bodies.push_back({name, {}, SphereShape{}});
  return scene;
}

ImpulseEvent anEvent() {
  ImpulseEvent event;
  event.time = 0.25;
  event.body = 0;
  event.other = 1;
  event.impulse = {1.0, 2.0, 3.0};
  event.position = {4.0, 5.0, 6.0};
  event.normal = {0.0, 1.0, 0.0};
  event.approachSpeed = 7.0;
  event.effectiveMass = 8.0;
  return event;
}

using Rows = std::vector<std::vector<std::string>>;

/// The rows of a file that these events were written to, the header first.
Rows written(const std::vector<ImpulseEvent>& events, const Scene& scene, double duration) {
  const TemporaryFolder folder;
  Result<EventsFileWriter> writer = EventsFileWriter::create(folder / "events.csv");
  EXPECT_TRUE(writer);
  for (const ImpulseEvent& event : events)
    writer->write(event, scene, {duration, 0.5, true});
  const Status finished = writer->finish();
  EXPECT_TRUE(finished) << finished.error().message;
  EXPECT_EQ(folder.entries(), 1u);
  return parseCsv(contents(folder / "events.csv"));
}

void expectSameBits(double value, const std::string& field) {
  EXPECT_EQ(std::bit_cast<std::uint64_t>(numberOf(field)), std::bit_cast<std::uint64_t>(value))
      << field << " for " << value;
}

TEST(EventsFile, HeaderNamesEveryColumnWithItsUnit) {
  const Rows rows = written({anEvent()}, sceneWith({"ball", "floor"}), 1e-4);
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0], (std::vector<std::string>{"time_s", "body", "other", "jx_Ns", "jy_Ns", "jz_Ns",
                                               "px_m", "py_m", "pz_m", "nx", "ny", "nz",
                                               "approach_speed_m_s", "effective_mass_kg",
                                               "duration_s", "collision", "peak_pa", "heard"}));
  EXPECT_EQ(rows[1],
            (std::vector<std::string>{"0.25", "ball", "floor", "1", "2", "3", "4", "5", "6", "0",
                                      "1", "0", "7", "8", "1e-04", "1", "0.5", "1"}));
}

TEST(EventsFile, NumbersReadBackAreTheSameBits) {
  const double values[] = {0.1,
                           1.0 / 3.0,
                           -0.0,
                           std::nextafter(1.0, 2.0),
                           86400.0 + 1e-9,
                           std::numeric_limits<double>::denorm_min(),
                           std::numeric_limits<double>::max(),
                           -5e-324,
                           1e22,
                           123456789.0};
  for (const double value : values) {
    ImpulseEvent event = anEvent();
    event.time = value;
    event.impulse = {value, -value, 2.0};
    event.position = {1.0, value, -value};
    event.approachSpeed = value;
    event.effectiveMass = -value;
    const Rows rows = written({event}, sceneWith({"a", "b"}), value);
    ASSERT_EQ(rows.size(), 2u);
    const std::vector<std::string>& row = rows[1];
    ASSERT_EQ(row.size(), 18u);
    expectSameBits(value, row[kTime]);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto component = static_cast<Eigen::Index>(axis);
      expectSameBits(event.impulse[component], row[kImpulse + axis]);
      expectSameBits(event.position[component], row[kPoint + axis]);
      expectSameBits(event.normal[component], row[kNormal + axis]);
    }
    expectSameBits(value, row[kSpeed]);
    expectSameBits(-value, row[kMass]);
    expectSameBits(value, row[kTau]);
  }
}

TEST(EventsFile, NamesReadBackAreTheSameWhateverIsInThem) {
  const std::vector<std::string> names = {"ball, red", "\"",         "\"quoted\", and more",
                                          " blank ",   "two\nlines", "K\xc3\xbcgel;tab\t",
                                          "a\r"};
  const Scene scene = sceneWith(names);
  std::vector<ImpulseEvent> events;
  for (BodyId body = 0; body < names.size(); ++body) {
    events.push_back(anEvent());
    events.back().body = body;
    events.back().other = static_cast<BodyId>(names.size()) - 1 - body;
  }
  const Rows rows = written(events, scene, 1e-4);
  ASSERT_EQ(rows.size(), names.size() + 1);
  for (std::size_t row = 0; row < names.size(); ++row) {
    ASSERT_EQ(rows[row + 1].size(), rows[0].size());
    EXPECT_EQ(rows[row + 1][kBody], names[row]);
    EXPECT_EQ(rows[row + 1][kOther], names[names.size() - 1 - row]);
  }
}

/// The other body's share of a collision.
ImpulseEvent otherShare(const ImpulseEvent& event) {
  ImpulseEvent other = event;
  std::swap(other.body, other.other);
  other.impulse = -event.impulse;
  other.normal = -event.normal;
  return other;
}

TEST(EventsFile, BothSharesOfACollisionHaveItsNumber) {
  const ImpulseEvent first = anEvent();
  ImpulseEvent second = anEvent();  // the same bodies at the same time, at another point
  second.impulse *= 2.0;
  ImpulseEvent third = anEvent();  // at the same time, of another pair
  third.other = 2;
  ImpulseEvent fourth = anEvent();  // later
  fourth.time = 0.5;
  const Rows rows = written({first, second, third, otherShare(second), otherShare(third),
                             otherShare(first), fourth, otherShare(fourth), otherShare(fourth)},
                            sceneWith({"a", "b", "c"}), 1e-4);
  std::vector<std::string> numbers;
  for (std::size_t row = 1; row < rows.size(); ++row)
    numbers.push_back(rows[row][kCollision]);
  EXPECT_EQ(numbers, (std::vector<std::string>{"1", "2", "3", "2", "3", "1", "4", "4", "5"}));
}

TEST(EventsFile, PeakAndWhetherItIsHeardAreTheLastColumns) {
  const TemporaryFolder folder;
  Result<EventsFileWriter> writer = EventsFileWriter::create(folder / "events.csv");
  ASSERT_TRUE(writer);
  const Scene scene = sceneWith({"a", "b"});
  writer->write(anEvent(), scene, {.duration = 1e-4, .peak = 0.1, .isHeard = true});
  writer->write(otherShare(anEvent()), scene, {.duration = 1e-4, .peak = 1e-9, .isHeard = false});
  ASSERT_TRUE(writer->finish());
  const Rows rows = parseCsv(contents(folder / "events.csv"));
  EXPECT_EQ(rows.at(1).at(kPeak), "0.1");
  EXPECT_EQ(rows.at(1).at(kHeard), "1");
  EXPECT_EQ(rows.at(2).at(kPeak), "1e-09");
  EXPECT_EQ(rows.at(2).at(kHeard), "0");
}

TEST(EventsFile, OfNoEventsIsAHeader) {
  EXPECT_EQ(written({}, sceneWith({}), 0.0).size(), 1u);
}

TEST(EventsFile, LeavesWhatWasThereUntilItIsFinished) {
  const TemporaryFolder folder;
  std::ofstream(folder / "events.csv") << "old";
  {
    Result<EventsFileWriter> writer = EventsFileWriter::create(folder / "events.csv");
    ASSERT_TRUE(writer);
    writer->write(anEvent(), sceneWith({"a", "b"}), {});
    EXPECT_EQ(contents(folder / "events.csv"), "old");
  }
  EXPECT_EQ(contents(folder / "events.csv"), "old");
  EXPECT_EQ(folder.entries(), 1u);
}

TEST(EventsFile, DoesNotTouchItsNeighbours) {
  const TemporaryFolder folder;
  std::ofstream(folder / "events.csv.part") << "somebody's";
  Result<EventsFileWriter> writer = EventsFileWriter::create(folder / "events.csv");
  ASSERT_TRUE(writer);
  ASSERT_TRUE(writer->finish());
  EXPECT_EQ(contents(folder / "events.csv.part"), "somebody's");
  EXPECT_EQ(folder.entries(), 2u);
}

TEST(EventsFile, TwoWritersOfOnePathDoNotMix) {
  const TemporaryFolder folder;
  const Scene scene = sceneWith({"a", "b"});
  Result<EventsFileWriter> first = EventsFileWriter::create(folder / "events.csv");
  Result<EventsFileWriter> second = EventsFileWriter::create(folder / "events.csv");
  ASSERT_TRUE(first);
  ASSERT_TRUE(second);
  first->write(anEvent(), scene, {});
  for (int row = 0; row < 3; ++row)
    second->write(anEvent(), scene, {});
  ASSERT_TRUE(first->finish());
  EXPECT_EQ(parseCsv(contents(folder / "events.csv")).size(), 2u);
  ASSERT_TRUE(second->finish());
  EXPECT_EQ(parseCsv(contents(folder / "events.csv")).size(), 4u);
  EXPECT_EQ(folder.entries(), 1u);
}

TEST(EventsFile, RefusesATargetThatIsNoFileBeforeAnythingIsWritten) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "directory");
  ASSERT_EQ(mkfifo((folder / "fifo").c_str(), 0600), 0);
  for (const fs::path& target :
       {folder / "directory", folder / "fifo", folder / "no" / "events.csv", folder.path() / "",
        fs::path("/proc/events.csv")}) {
    const Result<EventsFileWriter> writer = EventsFileWriter::create(target);
    ASSERT_FALSE(writer) << target;
    EXPECT_NE(writer.error().message.find(std::string("'") + target.string() + "': "),
              std::string::npos)
        << writer.error().message;
  }
  EXPECT_TRUE(fs::is_fifo(folder / "fifo"));
  EXPECT_EQ(folder.entries(), 2u);
}

}  // namespace
}  // namespace carom::test
