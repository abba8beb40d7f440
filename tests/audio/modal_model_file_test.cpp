#include "carom/audio/modal_model_file.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <fstream>
#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace carom::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

/// A model in which each field has a value of its own, among them some that a careless conversion
/// changes: -0, the smallest number, thirds.
ModalModel chime() {
  ModalModel model;
  model.name = "chime \"7\"\n";
  model.material = {"bell bronze", 8600.0, 105e9, 1.0 / 3.0, 0.75, 0.5, 3e-8};
  model.mass = 0.1;
  model.centreOfMass = {0.125, -0.0, 1.0 / 3.0};
  model.inertia << 1e-5, 2e-7, -3e-7, 2e-7, 4e-5, 5e-7, -3e-7, 5e-7, 6e-5;
  model.surface.vertices = {Vec3(0.1, 0.2, 0.3), Vec3(-0.1, 0.0, 1e-300), Vec3(0.0, 0.4, -0.0),
                            Vec3(5e-324, -0.2, 0.1)};
  model.surface.triangles = {{0, 1, 2}, {3, 2, 1}};
  model.modes = {
      {20.0, 0.0, {}},
      {440.0 / 3.0, 0.7, {-1e-3, {{1.0, -2.0}, {0.5, 0.25}, {-0.0, 3.0}, {4.0, 1e-9}}, 0.3}}};
  for (int value = 0; value < 24; ++value)
    model.shapes.push_back(static_cast<float>(value - 11) / 7.0F);
  for (int value = 0; value < 12; ++value)
    model.residualVolumes.push_back(static_cast<float>(5 - value) / 3.0F);
  model.residualFrequency = 2e5 / 3.0;
  model.material.lossFactor = 1.0 / 300.0;
  model.material.lossExponent = -1.0 / 3.0;
  model.modes[1].frequencyError = 1.0 / 700.0;
  model.material.thermal = {7e-6 / 3.0, 100.0 / 3.0, 1000.0 / 3.0};
  model.modes[1].heatDecayRate = 0.1 / 3.0;
  model.medium = {1.19, 344.5};
  model.leftOut = {6, 1, 70000, 3};
  return model;
}

/// True if the numbers have the same bits: -0 is not 0.
template <class Number>
bool same(Number one, Number other) {
  if constexpr (sizeof(Number) == sizeof(std::uint64_t))
    return std::bit_cast<std::uint64_t>(one) == std::bit_cast<std::uint64_t>(other);
  else
    return std::bit_cast<std::uint32_t>(one) == std::bit_cast<std::uint32_t>(other);
}
template <class Matrix>
bool sameMatrix(const Matrix& one, const Matrix& other) {
  return std::equal(one.data(), one.data() + one.size(), other.data(), same<double>);
}

void expectSame(const ModalModel& one, const ModalModel& other) {
  EXPECT_EQ(one.name, other.name);
  EXPECT_EQ(one.material.name, other.material.name);
  EXPECT_TRUE(same(one.material.density, other.material.density));
  EXPECT_TRUE(same(one.material.youngsModulus, other.material.youngsModulus));
  EXPECT_TRUE(same(one.material.poissonsRatio, other.material.poissonsRatio));
  EXPECT_TRUE(same(one.material.restitution, other.material.restitution));
  EXPECT_TRUE(same(one.material.dampingAlpha, other.material.dampingAlpha));
  EXPECT_TRUE(same(one.material.dampingBeta, other.material.dampingBeta));
  EXPECT_TRUE(same(one.material.lossFactor, other.material.lossFactor));
  EXPECT_TRUE(same(one.material.lossExponent, other.material.lossExponent));
  EXPECT_TRUE(same(one.material.thermal.expansion, other.material.thermal.expansion));
  EXPECT_TRUE(same(one.material.thermal.conductivity, other.material.thermal.conductivity));
  EXPECT_TRUE(same(one.material.thermal.heatCapacity, other.material.thermal.heatCapacity));
  EXPECT_TRUE(same(one.mass, other.mass));
  EXPECT_TRUE(sameMatrix(one.centreOfMass, other.centreOfMass));
  EXPECT_TRUE(sameMatrix(one.inertia, other.inertia));
  EXPECT_TRUE(same(one.medium.density, other.medium.density));
  EXPECT_TRUE(same(one.medium.speedOfSound, other.medium.speedOfSound));
  EXPECT_TRUE(std::ranges::equal(one.surface.vertices, other.surface.vertices, sameMatrix<Vec3>));
  EXPECT_EQ(one.surface.triangles, other.surface.triangles);
  EXPECT_TRUE(std::ranges::equal(one.shapes, other.shapes, same<float>));
  EXPECT_TRUE(std::ranges::equal(one.residualVolumes, other.residualVolumes, same<float>));
  EXPECT_TRUE(same(one.residualFrequency, other.residualFrequency));
  EXPECT_EQ(one.leftOut.rigid, other.leftOut.rigid);
  EXPECT_EQ(one.leftOut.below, other.leftOut.below);
  EXPECT_EQ(one.leftOut.above, other.leftOut.above);
  EXPECT_EQ(one.leftOut.overdamped, other.leftOut.overdamped);
  ASSERT_EQ(one.modes.size(), other.modes.size());
  for (std::size_t mode = 0; mode < one.modes.size(); ++mode) {
    EXPECT_TRUE(same(one.modes[mode].frequency, other.modes[mode].frequency));
    EXPECT_TRUE(same(one.modes[mode].decayRate, other.modes[mode].decayRate));
    EXPECT_TRUE(same(one.modes[mode].frequencyError, other.modes[mode].frequencyError));
    EXPECT_TRUE(same(one.modes[mode].heatDecayRate, other.modes[mode].heatDecayRate));
    EXPECT_TRUE(same(one.modes[mode].radiation.decayRate, other.modes[mode].radiation.decayRate));
    EXPECT_TRUE(same(one.modes[mode].radiation.volume, other.modes[mode].radiation.volume));
    EXPECT_TRUE(std::ranges::equal(one.modes[mode].radiation.multipoles,
                                   other.modes[mode].radiation.multipoles,
                                   [](const auto& a, const auto& b) {
                                     return same(a.real(), b.real()) && same(a.imag(), b.imag());
                                   }));
  }
}

std::vector<std::byte> chimeBytes() {
  auto bytes = encodedModalModel(chime());
  EXPECT_TRUE(bytes);
  return *bytes;
}

/// Returns the same content with a checksum that fits.
std::vector<std::byte> sealed(std::vector<std::byte> bytes) {
  const std::uint64_t checksum =
      modalModelChecksum(std::span<const std::byte>(bytes).first(bytes.size() - 8));
  for (std::size_t byte = 0; byte < 8; ++byte)
    bytes[bytes.size() - 8 + byte] = static_cast<std::byte>(checksum >> (8 * byte) & 0xFF);
  return bytes;
}

std::string refusal(std::span<const std::byte> bytes) {
  const auto model = decodedModalModel(bytes, "x.carom_modes");
  return model ? "" : model.error().message;
}

/// Returns where the 8 bytes of a section's length begin.
std::size_t lengthAt(const std::vector<std::byte>& bytes, const std::string& tag) {
  const auto found =
      std::find_end(bytes.begin(), bytes.end(), tag.begin(), tag.end(),
                    [](std::byte byte, char letter) { return byte == std::byte(letter); });
  return static_cast<std::size_t>(found - bytes.begin()) + tag.size();
}

TEST(ModalModelFile, ComesBackToTheBit) {
  const TemporaryFolder folder;
  const auto path = folder / "chime.carom_modes";
  ASSERT_TRUE(writeModalModel(path, chime()));
  EXPECT_EQ(folder.entries(), 1u);
  const auto read = readModalModel(path);
  ASSERT_TRUE(read) << read.error().message;
  expectSame(*read, chime());
}

TEST(ModalModelFile, TakesAModelWithoutModes) {
  ModalModel silent = chime();
  silent.modes.clear();
  silent.shapes.clear();
  const auto bytes = encodedModalModel(silent);
  ASSERT_TRUE(bytes);
  const auto read = decodedModalModel(*bytes, "silent");
  ASSERT_TRUE(read) << read.error().message;
  expectSame(*read, silent);
}

/// Returns a file of an older version, which ends before that section.
std::vector<std::byte> without(const std::string& section, std::vector<std::byte> bytes,
                               std::byte version) {
  bytes[8] = version;
  const auto tag = static_cast<std::ptrdiff_t>(lengthAt(bytes, section)) - 4;
  bytes.erase(bytes.begin() + tag, bytes.end() - 8);
  return bytes;
}

/// Returns a file of version 2, which has no section 'resi'.
std::vector<std::byte> withoutResidual(const std::vector<std::byte>& bytes) {
  return without("resi", bytes, std::byte{2});
}

ModalModel chimeWithoutHeat() {
  ModalModel model = chime();
  model.material.thermal = {};
  model.modes[1].heatDecayRate = 0.0;
  return model;
}

// Version 4 has no losses by heat.
TEST(ModalModelFile, ReadsVersion4) {
  const auto read = decodedModalModel(sealed(without("heat", chimeBytes(), std::byte{4})), "old");
  ASSERT_TRUE(read) << read.error().message;
  expectSame(*read, chimeWithoutHeat());
}

ModalModel chimeWithoutErrors() {
  ModalModel model = chimeWithoutHeat();
  model.material.lossFactor = model.material.lossExponent = 0.0;
  model.modes[1].frequencyError = 0.0;
  return model;
}

// Version 3 has neither loss factors nor errors of frequencies.
TEST(ModalModelFile, ReadsVersion3) {
  const auto read = decodedModalModel(sealed(without("loss", chimeBytes(), std::byte{3})), "old");
  ASSERT_TRUE(read) << read.error().message;
  expectSame(*read, chimeWithoutErrors());
}

ModalModel chimeWithoutResidual() {
  ModalModel model = chimeWithoutErrors();
  model.residualVolumes.clear();
  model.residualFrequency = 0.0;
  return model;
}

TEST(ModalModelFile, ReadsVersion2) {
  const auto read = decodedModalModel(sealed(withoutResidual(chimeBytes())), "old");
  ASSERT_TRUE(read) << read.error().message;
  expectSame(*read, chimeWithoutResidual());
}

// A file of version 1 has no part of the decay that is sound: the third number of each mode.
TEST(ModalModelFile, ReadsVersion1) {
  ModalModel model = chimeWithoutResidual();
  model.modes[1].radiation.decayRate = 0.0;
  std::vector<std::byte> bytes = withoutResidual(*encodedModalModel(model));
  bytes[8] = std::byte{1};
  const std::size_t length = lengthAt(bytes, "mode");
  const auto third = [&](std::size_t mode) {
    return bytes.begin() + static_cast<std::ptrdiff_t>(mode + 2 * sizeof(double));
  };
  const std::size_t first = length + 2 * sizeof(std::uint64_t);
  const std::size_t second = first + 5 * sizeof(double);
  for (const std::size_t mode : {second, first})
    bytes.erase(third(mode), third(mode) + sizeof(double));
  bytes[length] = std::byte(std::to_integer<unsigned>(bytes[length]) - 2U * sizeof(double));
  const auto read = decodedModalModel(sealed(bytes), "old");
  ASSERT_TRUE(read) << read.error().message;
  expectSame(*read, model);
}

// The expected bytes are typed by hand from docs/model_file.md.
TEST(ModalModelFile, IsLaidOutAsDocumented) {
  ModalModel model;
  model.name = "m";
  model.material = {"", 1.0, 2.0, 0.25, 0.5, 0.0, 0.0};
  model.mass = 1.0;
  model.surface.vertices = {Vec3::Zero()};
  model.medium = {1.0, 2.0};
  model.leftOut = {6, 0, 0, 0};
  const auto zeros = [](std::size_t count) { return std::string(count, '\0'); };
  const auto tall = [](char sixth, char seventh) {  // a double of which only two bytes are not 0
    return std::string(6, '\0') + sixth + seventh;
  };
  const std::string one = tall('\xF0', '\x3F');
  const std::string two = tall('\x00', '\x40');
  const std::string body = '\x01' + zeros(7) + "m" + zeros(8) + one + two + tall('\xD0', '\x3F') +
                           tall('\xE0', '\x3F') + zeros(16) + one + zeros(3 * 8 + 9 * 8) + one +
                           two + '\x06' + zeros(15);
  ASSERT_EQ(body.size(), 0xC9u);
  const std::string content =
      "caromode" + ('\x05' + zeros(3)) + "body" + ('\xC9' + zeros(7)) + body + "surf" +
      ('\x28' + zeros(7)) + ('\x01' + zeros(7)) + zeros(24) + zeros(8) + "mode" +
      ('\x08' + zeros(7)) + zeros(8) + "shap" + ('\x08' + zeros(7)) + zeros(8) + "resi" +
      ('\x10' + zeros(7)) + zeros(8) + zeros(8) + "loss" + ('\x10' + zeros(7)) + zeros(16) +
      "errs" + zeros(8) + "heat" + ('\x18' + zeros(7)) + zeros(24);
  const auto bytes = encodedModalModel(model);
  ASSERT_TRUE(bytes) << bytes.error().message;
  ASSERT_EQ(bytes->size(), content.size() + 8);
  const std::string text(reinterpret_cast<const char*>(bytes->data()), content.size());
  EXPECT_EQ(text, content);
}

// The hash of "a" is from the published test vectors of 64-bit FNV-1a (Fowler, Noll, Vo).
TEST(ModalModelFile, ChecksumIsFnv1a) {
  const std::byte letter{'a'};
  EXPECT_EQ(modalModelChecksum({&letter, 1}), 0xAF63DC4C8601EC8CU);
  EXPECT_EQ(modalModelChecksum({}), 0xCBF29CE484222325U);
}

TEST(ModalModelFile, RefusesWhateverIsCutOff) {
  const std::vector<std::byte> bytes = chimeBytes();
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_THAT(refusal(std::span(bytes).first(size)), StartsWith("x.carom_modes: ")) << size;
}

TEST(ModalModelFile, RefusesWhateverIsCutOffThoughItsChecksumFits) {
  const std::vector<std::byte> bytes = chimeBytes();
  for (std::size_t size = 20; size < bytes.size(); ++size)
    EXPECT_THAT(refusal(sealed({bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)})),
                StartsWith("x.carom_modes: "))
        << size;
}

TEST(ModalModelFile, NoticesEveryChangedByte) {
  const std::vector<std::byte> bytes = chimeBytes();
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    std::vector<std::byte> changed = bytes;
    changed[at] ^= std::byte{0x10};
    EXPECT_NE(refusal(changed), "") << at;
  }
}

TEST(ModalModelFile, SaysWhatIsWrong) {
  const std::vector<std::byte> bytes = chimeBytes();
  EXPECT_THAT(refusal({}), HasSubstr("is no modal model; expected a file that begins with"));

  std::vector<std::byte> newer = bytes;
  newer[8] = std::byte{6};
  EXPECT_THAT(refusal(newer), HasSubstr("is a modal model of version 6; expected version 1 to 5"));

  std::vector<std::byte> damaged = bytes;
  damaged[40] ^= std::byte{1};
  EXPECT_THAT(refusal(damaged), HasSubstr("its checksum does not fit"));

  std::vector<std::byte> longer = bytes;
  longer.insert(longer.end() - 8, 3, std::byte{0});
  EXPECT_THAT(refusal(sealed(longer)), HasSubstr("has 3 bytes too many"));

  std::vector<std::byte> other = bytes;
  other[12] = std::byte{'B'};
  EXPECT_THAT(refusal(sealed(other)), HasSubstr("has no section 'body' here (byte 12)"));
}

TEST(ModalModelFile, TrustsNoLength) {
  const std::vector<std::byte> bytes = chimeBytes();
  std::vector<std::byte> section = bytes;
  section[lengthAt(bytes, "surf") + 6] = std::byte{0x7F};
  EXPECT_THAT(refusal(sealed(section)), HasSubstr("section 'surf' is longer than the file"));

  for (const std::string tag : {"surf", "mode", "shap"}) {
    std::vector<std::byte> count = bytes;
    count[lengthAt(bytes, tag) + 8 + 7] = std::byte{0xFF};
    EXPECT_THAT(refusal(sealed(count)),
                AllOf(HasSubstr("section '" + tag + "'"), HasSubstr("counts more elements")));
  }

  std::vector<std::byte> name = bytes;
  name[lengthAt(bytes, "body") + 8 + 5] = std::byte{1};
  EXPECT_THAT(refusal(sealed(name)), HasSubstr("a text that is longer than what is left"));

  std::vector<std::byte> shorter = bytes;
  shorter[lengthAt(bytes, "surf") + 8] = std::byte{3};  // 3 vertices instead of 4
  EXPECT_THAT(refusal(sealed(shorter)), HasSubstr("section 'surf'"));
}

TEST(ModalModelFile, GivesNoModelThatCannotBeUsed) {
  std::vector<std::byte> bytes = chimeBytes();
  const std::size_t triangle = lengthAt(bytes, "surf") + 8 + 8 + std::size_t{4} * 24 + 8;
  bytes[triangle] = std::byte{4};
  EXPECT_THAT(refusal(sealed(bytes)), HasSubstr("surface has a triangle of vertex 4"));
}

TEST(ModalModelFile, WritesNoModelThatCannotBeUsed) {
  const TemporaryFolder folder;
  ModalModel model = chime();
  model.mass = std::numeric_limits<double>::quiet_NaN();
  const auto written = writeModalModel(folder / "m", model);
  ASSERT_FALSE(written);
  EXPECT_THAT(written.error().message, HasSubstr("mass must be from 1e-21 to 1e18 (kg)"));
  EXPECT_EQ(folder.entries(), 0u);
}

TEST(ModalModelFile, EveryNumberHasARange) {
  const auto refusalOf = [](auto spoil) {
    ModalModel model = chime();
    spoil(model);
    const auto bytes = encodedModalModel(model);
    return bytes ? std::string() : bytes.error().message;
  };
  EXPECT_EQ(refusalOf([](ModalModel&) {}), "");
  for (const double bad : {-1.0, 0.0, 1e-300, 1e300}) {
    EXPECT_THAT(refusalOf([&](ModalModel& m) { m.mass = bad; }), HasSubstr("mass must be from"));
    EXPECT_THAT(refusalOf([&](ModalModel& m) { m.medium.density = bad; }),
                HasSubstr("density of the medium must be from 1e-3 to 1e4"));
    EXPECT_THAT(refusalOf([&](ModalModel& m) { m.medium.speedOfSound = bad; }),
                HasSubstr("speed of sound must be from 1 to 1e4"));
  }
  EXPECT_THAT(refusalOf([](ModalModel& m) { m.centreOfMass.x() = 1e300; }),
              HasSubstr("centre of mass must be from -1e9 to 1e9"));
  EXPECT_THAT(refusalOf([](ModalModel& m) { m.inertia(0, 0) = 1e300; }), HasSubstr("inertia must"));
  EXPECT_THAT(refusalOf([](ModalModel& m) { m.surface.vertices[0].x() = 1e300; }),
              HasSubstr("surface has a vertex out of range"));
  EXPECT_THAT(refusalOf([](ModalModel& m) { m.shapes[0] = 1e38F; }), HasSubstr("shapes must be"));
}

TEST(ModalModelFile, NamesTheFileThatCannotBeReadOrWritten) {
  const TemporaryFolder folder;
  const auto absent = readModalModel(folder / "absent");
  ASSERT_FALSE(absent);
  EXPECT_THAT(absent.error().message,
              AllOf(StartsWith((folder / "absent").string()), HasSubstr("there is no such file")));
  const auto unwritable = writeModalModel(folder / "no" / "m", chime());
  ASSERT_FALSE(unwritable);
  EXPECT_THAT(unwritable.error().message, HasSubstr("create it first"));
  EXPECT_FALSE(readModalModel(folder.path()));
}

TEST(ModalModelFile, LeavesTheOldFileWhereTheNewOneFails) {
  const TemporaryFolder folder;
  const auto path = folder / "m";
  ASSERT_TRUE(writeModalModel(path, chime()));
  ModalModel bad = chime();
  bad.mass = -1.0;
  ASSERT_FALSE(writeModalModel(path, bad));
  EXPECT_TRUE(readModalModel(path));
}

}  // namespace
}  // namespace carom::test
