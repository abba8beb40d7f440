#include "audio/run/run_tables.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <compare>
#include <limits>
#include <numeric>
#include <string>
#include <type_traits>
#include <utility>

namespace carom::audio {

namespace {

constexpr double kLargest = 1e100;       // in SI units, of any number that is not infinite
constexpr double kUnitTolerance = 1e-3;  // of the length of an orientation

/// Number of a table's first columns that say whose a record is.
template <class Record>
constexpr std::size_t kKeys = 0;
template <>
constexpr std::size_t kKeys<ContactState> = 2;
template <>
constexpr std::size_t kKeys<BodyPose> = 1;

// Each of these names the columns of a table, for whoever writes and whoever reads.

template <class Archive>
void describe(Archive& archive, ImpulseEvent& event) {
  archive.number(event.time);
  archive.body(event.body);
  archive.body(event.other);
  archive.vector(event.impulse);
  archive.vector(event.appliedImpulse);
  archive.flag(event.hasAppliedImpulse);
  archive.flag(event.hasOtherPose);
  archive.vector(event.position);
  archive.vector(event.normal);
  archive.number(event.approachSpeed);
  archive.number(event.effectiveMass);
  archive.radius(event.radius);
  archive.radius(event.otherRadius);
  archive.vector(event.bodyPosition);
  archive.rotation(event.bodyOrientation);
  archive.vector(event.bodyVelocity);
  archive.vector(event.bodyAngularVelocity);
  archive.vector(event.otherPosition);
  archive.rotation(event.otherOrientation);
}

template <class Archive>
void describe(Archive& archive, ContactState& contact) {
  archive.body(contact.body);
  archive.body(contact.other);
  archive.number(contact.time);
  archive.number(contact.duration);
  archive.phase(contact.phase);
  archive.vector(contact.normal);
  archive.vector(contact.position);
  archive.number(contact.normalLoad);
  archive.vector(contact.appliedImpulse);
  archive.radius(contact.radius);
  archive.radius(contact.otherRadius);
  archive.vector(contact.slipVelocity);
  archive.vector(contact.rollingVelocity);
  archive.vector(contact.bodyPosition);
  archive.rotation(contact.bodyOrientation);
  archive.vector(contact.bodyVelocity);
  archive.vector(contact.otherPosition);
  archive.rotation(contact.otherOrientation);
  archive.vector(contact.otherVelocity);
  archive.vector(contact.pathStart);
  archive.vector(contact.pathEnd);
  archive.vector(contact.otherPathStart);
  archive.vector(contact.otherPathEnd);
}

template <class Archive>
void describe(Archive& archive, BodyPose& pose) {
  archive.body(pose.body);
  archive.number(pose.pose.time);
  archive.vector(pose.pose.position);
  archive.rotation(pose.pose.orientation);
}

template <class Archive>
void describe(Archive& archive, DeformingState& state) {
  archive.number(state.volume);
  archive.vector(state.position);
  archive.vector(state.dipole);
}

template <class Archive>
void describe(Archive& archive, JelloPicture& picture) {
  archive.number(picture.time);
  archive.points(picture.points);
}

/// The numbers of records in a portion, and when it ends.
struct PortionRow {
  double settledTime = 0.0;
  std::array<std::uint32_t, 5> counts{};  // events, contacts, poses, states, pictures
};

template <class Archive>
void describe(Archive& archive, PortionRow& row) {
  archive.moment(row.settledTime);
  for (std::uint32_t& count : row.counts)
    archive.count(count);
}

/// Collects the numbers of records, one record after the other.
class Writer {
 public:
  void number(double value) { values_.push_back(value); }
  void radius(double value) { values_.push_back(value); }
  void moment(double value) { values_.push_back(value); }
  void body(BodyId id) { values_.push_back(id); }
  void count(std::uint32_t value) { values_.push_back(value); }
  void flag(bool value) { values_.push_back(value ? 1.0 : 0.0); }
  void phase(ContactPhase value) { values_.push_back(static_cast<double>(value)); }
  void vector(const Vec3& v) { values_.insert(values_.end(), v.data(), v.data() + 3); }
  void rotation(const Quat& q) {
    values_.insert(values_.end(), q.coeffs().data(), q.coeffs().data() + 4);
  }
  void points(const std::vector<float>& all) {
    values_.insert(values_.end(), all.begin(), all.end());
  }

  const std::vector<double>& values() const { return values_; }

 private:
  std::vector<double> values_;
};

/// Looks at the numbers of a record as Reader will.
class Inspector {
 public:
  void number(double value) { isSound_ = isSound_ && std::abs(value) <= kLargest; }
  void radius(double value) { isSound_ = isSound_ && value >= 0.0; }
  void body(BodyId) {}
  void flag(bool) {}
  void phase(ContactPhase) {}
  void vector(const Vec3& v) {
    for (const double component : v)
      number(component);
  }
  void rotation(const Quat& q) { isSound_ = isSound_ && std::abs(q.norm() - 1.0) < kUnitTolerance; }

  bool isSound() const { return isSound_; }

 private:
  bool isSound_ = true;
};

template <class Record>
bool isSound(Record record) {
  Inspector inspector;
  describe(inspector, record);
  return inspector.isSound();
}

/// Reads the numbers of records, in the order in which they were collected. What cannot be is
/// remembered, and 0 in its place.
class Reader {
 public:
  Reader(std::span<const double> values, const RunShape& shape) : values_(values), shape_(shape) {}

  void number(double& value) {
    value = next();
    require(std::abs(value) <= kLargest, "a number that is none, or too large");
  }
  void radius(double& value) {
    value = next();
    require(value >= 0.0, "a radius below 0, or none");
  }
  void moment(double& value) {
    value = next();
    require(value >= -kLargest, "a time that is none");  // infinite where nothing is to come
  }
  void body(BodyId& id) { id = whole(shape_.bodies, "a body that the scene has not"); }
  void count(std::uint32_t& value) {
    value = whole(std::numeric_limits<std::uint32_t>::max(), "a number of records that is none");
  }
  void flag(bool& value) { value = whole(2, "a flag that is neither 0 nor 1") == 1; }
  void phase(ContactPhase& value) {
    value = static_cast<ContactPhase>(whole(3, "a phase of a contact that there is not"));
  }
  void vector(Vec3& v) {
    for (double& component : v)
      number(component);
  }
  void rotation(Quat& q) {
    for (double& component : q.coeffs())
      number(component);
    if (!require(std::abs(q.norm() - 1.0) < kUnitTolerance, "an orientation not of unit length"))
      q = Quat::Identity();
  }
  void points(std::vector<float>& all) {
    all.resize(std::size_t{3} * shape_.points);
    for (float& coordinate : all) {
      double value = 0.0;
      number(value);
      coordinate = static_cast<float>(value);
    }
  }

  const char* fault() const { return fault_; }  ///< null if all was well

 private:
  double next() { return values_[at_++]; }
  bool require(bool isSound, const char* fault) {
    if (!isSound && fault_ == nullptr) fault_ = fault;
    return isSound;
  }
  std::uint32_t whole(std::uint32_t below, const char* fault) {
    const double value = next();
    const bool isSound = value >= 0.0 && value < below && value == std::floor(value);
    return require(isSound, fault) ? static_cast<std::uint32_t>(value) : 0;
  }

  std::span<const double> values_;
  RunShape shape_;
  std::size_t at_ = 0;
  const char* fault_ = nullptr;
};

/// Returns the number of columns that records of a kind have.
template <class Record>
std::size_t columnsOf(const RunShape& shape) {
  Record record{};
  if constexpr (std::is_same_v<Record, JelloPicture>)
    record.points.resize(std::size_t{3} * shape.points);
  Writer writer;
  describe(writer, record);
  return writer.values().size();
}

constexpr std::size_t kWord = sizeof(double);

void putCount(std::vector<std::byte>& bytes, std::size_t count) {
  for (unsigned shift = 0; shift < 32; shift += 8)
    bytes.push_back(static_cast<std::byte>((count >> shift) & 0xffU));
}

constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

/// Returns which row each row is told as a difference from: the latest that has the same bits in
/// its first `keys` columns, or else the one above; kNone of the first.
std::vector<std::size_t> rowsBefore(std::span<const double> values, std::size_t rows,
                                    std::size_t keys) {
  std::vector<std::size_t> before(rows);
  for (std::size_t row = 0; row < rows; ++row)
    before[row] = row == 0 ? kNone : row - 1;
  if (keys == 0 || rows == 0) return before;
  const std::size_t columns = values.size() / rows;
  const auto compareKeys = [&](std::size_t a, std::size_t b) {
    for (std::size_t at = 0; at < keys; ++at) {
      const auto ofA = std::bit_cast<std::uint64_t>(values[a * columns + at]);
      const auto ofB = std::bit_cast<std::uint64_t>(values[b * columns + at]);
      if (ofA != ofB) return ofA <=> ofB;
    }
    return std::strong_ordering::equal;
  };
  std::vector<std::size_t> byKey(rows);
  std::iota(byKey.begin(), byKey.end(), std::size_t{0});
  std::ranges::sort(byKey, [&](std::size_t a, std::size_t b) {
    const std::strong_ordering order = compareKeys(a, b);
    return order == 0 ? a < b : order < 0;
  });
  for (std::size_t at = 1; at < rows; ++at)
    if (compareKeys(byKey[at - 1], byKey[at]) == 0) before[byKey[at]] = byKey[at - 1];
  return before;
}

/// Adds a table of numbers in rows: the number of rows, then all lowest bytes of the first column's
/// differences, and so on.
void putTable(std::vector<std::byte>& bytes, std::span<const double> values, std::size_t rows,
              std::size_t keys = 0) {
  putCount(bytes, rows);
  if (rows == 0) return;
  const std::size_t columns = values.size() / rows;
  const std::vector<std::size_t> above = rowsBefore(values, rows, 0);
  const std::vector<std::size_t> alike = rowsBefore(values, rows, keys);
  std::vector<std::uint64_t> column(rows);
  std::vector<std::uint64_t> differences(rows);
  std::size_t end = bytes.size();
  bytes.resize(end + values.size() * kWord);
  for (std::size_t at = 0; at < columns; ++at) {
    const std::vector<std::size_t>& before = at < keys ? above : alike;
    for (std::size_t row = 0; row < rows; ++row) {
      column[row] = std::bit_cast<std::uint64_t>(values[row * columns + at]);
      differences[row] = column[row] ^ (before[row] == kNone ? 0 : column[before[row]]);
    }
    for (unsigned shift = 0; shift < 64; shift += 8)
      for (const std::uint64_t word : differences)
        bytes[end++] = static_cast<std::byte>((word >> shift) & 0xffU);
  }
}

template <class Record>
void putRecords(std::vector<std::byte>& bytes, std::span<const RunPortion> portions,
                std::vector<Record> RunPortion::*member) {
  Writer writer;
  std::size_t rows = 0;
  for (const RunPortion& portion : portions)
    for (Record record : portion.*member) {
      describe(writer, record);
      ++rows;
    }
  putTable(bytes, writer.values(), rows, kKeys<Record>);
}

/// Takes tables off the front of bytes.
class Tables {
 public:
  Tables(std::span<const std::byte> bytes, const RunShape& shape) : bytes_(bytes), shape_(shape) {}

  template <class Record>
  Result<std::vector<Record>> take() {
    const std::size_t columns = columnsOf<Record>(shape_);
    if (bytes_.size() < sizeof(std::uint32_t)) return tooFew();
    std::size_t rows = 0;
    for (std::size_t at = 0; at < sizeof(std::uint32_t); ++at)
      rows |= std::to_integer<std::size_t>(bytes_[at]) << (8 * at);
    bytes_ = bytes_.subspan(sizeof(std::uint32_t));
    if (rows > bytes_.size() / (kWord * columns)) return tooFew();
    std::vector<double> values(rows * columns);
    constexpr std::size_t keys = kKeys<Record>;
    std::vector<std::size_t> before = rowsBefore(values, rows, 0);
    for (std::size_t column = 0; column < columns; ++column) {
      if (keys > 0 && column == keys) before = rowsBefore(values, rows, keys);
      fill(values, column, columns, before);
    }
    bytes_ = bytes_.subspan(rows * columns * kWord);
    Reader reader(values, shape_);
    std::vector<Record> records(rows);
    for (Record& record : records)
      describe(reader, record);
    if (reader.fault() != nullptr) return Error{std::string("has ") + reader.fault()};
    return records;
  }

  bool isEmpty() const { return bytes_.empty(); }

 private:
  static Error tooFew() { return Error{"has fewer bytes than its tables say"}; }

  void fill(std::vector<double>& values, std::size_t column, std::size_t columns,
            std::span<const std::size_t> before) const {
    const std::size_t rows = before.size();
    const std::byte* const first = bytes_.data() + column * rows * kWord;
    for (std::size_t row = 0; row < rows; ++row) {
      std::uint64_t word = 0;
      if (before[row] != kNone)
        word = std::bit_cast<std::uint64_t>(values[before[row] * columns + column]);
      for (std::size_t at = 0; at < kWord; ++at)
        word ^= std::to_integer<std::uint64_t>(first[at * rows + row]) << (8 * at);
      values[row * columns + column] = std::bit_cast<double>(word);
    }
  }

  std::span<const std::byte> bytes_;
  RunShape shape_;
};

/// Moves the next `count` records from `from` into a portion. False if there are fewer.
template <class Record>
bool deal(std::vector<Record>& from, std::size_t& at, std::size_t count, std::vector<Record>& to) {
  if (count > from.size() - at) return false;
  to.reserve(count);
  for (std::size_t record = 0; record < count; ++record)
    to.push_back(std::move(from[at++]));
  return true;
}

}  // namespace

std::vector<std::byte> encodedPortions(std::span<const RunPortion> portions) {
  std::vector<std::byte> bytes;
  Writer writer;
  for (const RunPortion& portion : portions) {
    const auto count = [](const auto& records) {
      return static_cast<std::uint32_t>(records.size());
    };
    PortionRow row{portion.settledTime,
                   {count(portion.events), count(portion.contacts), count(portion.poses),
                    count(portion.deformations), count(portion.pictures)}};
    describe(writer, row);
  }
  putTable(bytes, writer.values(), portions.size());
  putRecords(bytes, portions, &RunPortion::events);
  putRecords(bytes, portions, &RunPortion::contacts);
  putRecords(bytes, portions, &RunPortion::poses);
  putRecords(bytes, portions, &RunPortion::deformations);
  putRecords(bytes, portions, &RunPortion::pictures);
  return bytes;
}

Result<std::vector<RunPortion>> decodedPortions(std::span<const std::byte> bytes,
                                                const RunShape& shape) {
  Tables tables(bytes, shape);
  auto rows = tables.take<PortionRow>();
  if (!rows) return rows.error();
  auto events = tables.take<ImpulseEvent>();
  if (!events) return events.error();
  auto contacts = tables.take<ContactState>();
  if (!contacts) return contacts.error();
  auto poses = tables.take<BodyPose>();
  if (!poses) return poses.error();
  auto states = tables.take<DeformingState>();
  if (!states) return states.error();
  auto pictures = tables.take<JelloPicture>();
  if (!pictures) return pictures.error();
  if (!tables.isEmpty()) return Error{"has more bytes than its tables say"};
  std::array<std::size_t, 5> at{};
  std::vector<RunPortion> portions(rows->size());
  for (std::size_t index = 0; index < portions.size(); ++index) {
    RunPortion& portion = portions[index];
    const auto& [settledTime, counts] = (*rows)[index];
    portion.settledTime = settledTime;
    if (!deal(*events, at[0], counts[0], portion.events) ||
        !deal(*contacts, at[1], counts[1], portion.contacts) ||
        !deal(*poses, at[2], counts[2], portion.poses) ||
        !deal(*states, at[3], counts[3], portion.deformations) ||
        !deal(*pictures, at[4], counts[4], portion.pictures))
      return Error{"has fewer records than its portions say"};
  }
  if (at !=
      std::array{events->size(), contacts->size(), poses->size(), states->size(), pictures->size()})
    return Error{"has more records than its portions say"};
  return portions;
}

bool isReadable(const ImpulseEvent& event) {
  return isSound(event);
}
bool isReadable(const ContactState& contact) {
  return isSound(contact);
}
bool isReadable(const BodyPose& pose) {
  return isSound(pose);
}

}  // namespace carom::audio
