#include "audio/propagation/sofa_file.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>

#include <mysofa.h>

namespace carom::audio {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMaxFileSize = 1u << 30;  // bytes
constexpr std::size_t kMaxMeasurements = 1u << 17;
constexpr std::size_t kMaxSamples = 1u << 16;

struct FreeSofa {
  void operator()(MYSOFA_HRTF* file) const { mysofa_free(file); }
};
using SofaHandle = std::unique_ptr<MYSOFA_HRTF, FreeSofa>;

std::string_view attribute(const MYSOFA_ATTRIBUTE* list, std::string_view name) {
  for (; list != nullptr; list = list->next)
    if (list->name != nullptr && name == list->name)
      return list->value != nullptr ? list->value : std::string_view();
  return {};
}

std::span<const float> valuesOf(const MYSOFA_ARRAY& array) {
  if (array.values == nullptr) return {};
  return {array.values, array.elements};
}

/// Quotes a value from a file, which may be long and hold anything, so that a message stays short
/// and printable.
std::string quoted(std::string_view value) {
  std::string text = "'";
  for (const char letter : value.substr(0, 40))
    text += letter >= ' ' && letter <= '~' ? letter : '?';
  return text + "'";
}

bool isSpherical(const MYSOFA_ARRAY& array, bool otherwise) {
  const std::string_view type = attribute(array.attributes, "Type");
  return type.empty() ? otherwise : type == "spherical";
}

/// Returns a triple in SOFA's frame. If spherical, it has degrees of azimuth to the left and of
/// elevation, and metres.
Vec3 cartesian(std::span<const float> triple, bool spherical) {
  Vec3 value(static_cast<double>(triple[0]), static_cast<double>(triple[1]),
             static_cast<double>(triple[2]));
  if (!spherical) return value;
  const double azimuth = value[0] * std::numbers::pi / 180.0;
  const double elevation = value[1] * std::numbers::pi / 180.0;
  return value[2] * Vec3(std::cos(elevation) * std::cos(azimuth),
                         std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
}

Vec3 toListenerFrame(const Vec3& sofa) {
  return {-sofa.y(), sofa.z(), -sofa.x()};
}

std::string reasonOf(int code) {
  switch (code) {
    case MYSOFA_READ_ERROR:
      return "it cannot be read, or ends too early";
    case MYSOFA_NO_MEMORY:
      return "it asks for more memory than there is";
    case MYSOFA_INVALID_FORMAT:
    case MYSOFA_UNSUPPORTED_FORMAT:
      return "it is not a SOFA file, or not one that libmysofa understands";
    default:
      return "libmysofa cannot read it (its error " + std::to_string(code) + ")";
  }
}

class SofaFile {
 public:
  explicit SofaFile(const MYSOFA_HRTF& file)
      : file_(file),
        positions_(valuesOf(file.SourcePosition)),
        responses_(valuesOf(file.DataIR)),
        delays_(valuesOf(file.DataDelay)) {}

  Status validate() const {
    for (const auto& check : {&SofaFile::validateConvention, &SofaFile::validateSizes,
                              &SofaFile::validateSampleRate, &SofaFile::validateListener})
      if (Status valid = (this->*check)(); !valid) return valid;
    return std::monostate{};
  }

  HrtfMeasurements measurements() const {
    HrtfMeasurements result;
    result.sampleRate = static_cast<double>(valuesOf(file_.DataSamplingRate)[0]);
    const bool spherical = isSpherical(file_.SourcePosition, true);
    const std::size_t swap = leftComesSecond() ? 1 : 0;
    result.items.resize(file_.M);
    for (std::size_t index = 0; index < result.items.size(); ++index) {
      HrtfMeasurement& item = result.items[index];
      item.direction = toListenerFrame(cartesian(positions_.subspan(3 * index, 3), spherical));
      for (std::size_t ear = 0; ear < 2; ++ear) {
        const std::size_t receiver = ear ^ swap;
        const auto samples = responses_.subspan((2 * index + receiver) * file_.N, file_.N);
        item.response[ear].assign(samples.begin(), samples.end());
        if (!delays_.empty())
          item.delay[ear] =
              static_cast<double>(delays_[delays_.size() == 2 ? receiver : 2 * index + receiver]);
      }
    }
    return result;
  }

 private:
  Status validateConvention() const {
    const std::string_view convention = attribute(file_.attributes, "SOFAConventions");
    if (convention != "SimpleFreeFieldHRIR")
      return Error{"its convention is " + quoted(convention) + "; it takes 'SimpleFreeFieldHRIR'"};
    const std::string_view type = attribute(file_.attributes, "DataType");
    if (type != "FIR") return Error{"its data type is " + quoted(type) + "; it takes 'FIR'"};
    return std::monostate{};
  }

  Status validateSizes() const {
    const std::size_t measurements = file_.M;
    const std::size_t samples = file_.N;
    if (file_.R != 2)
      return Error{"it has " + std::to_string(file_.R) + " receivers; it takes 2 ears"};
    if (measurements > kMaxMeasurements || samples > kMaxSamples)
      return Error{"it has " + std::to_string(measurements) + " measurements of " +
                   std::to_string(samples) + " samples, which is too much"};
    if (responses_.size() != measurements * 2 * samples || responses_.empty())
      return Error{"its responses are not of the size that it states"};
    if (positions_.size() != 3 * measurements)
      return Error{"it has not one source position for each measurement"};
    if (!delays_.empty() && delays_.size() != 2 && delays_.size() != 2 * measurements)
      return Error{"it has not one delay for each response"};
    return std::monostate{};
  }

  Status validateSampleRate() const {
    const std::span<const float> rates = valuesOf(file_.DataSamplingRate);
    if (rates.empty()) return Error{"it states no sample rate"};
    for (const float rate : rates)
      if (!(rate == rates[0])) return Error{"its sample rate is not one and the same"};
    const std::string_view units = attribute(file_.DataSamplingRate.attributes, "Units");
    if (!units.empty() && units != "hertz" && units != "Hertz" && units != "Hz")
      return Error{"its sample rate is in " + quoted(units) + "; it takes hertz"};
    return std::monostate{};
  }

  Status validateListener() const {
    const auto differs = [](const MYSOFA_ARRAY& array, bool spherical, const Vec3& wanted) {
      const std::span<const float> values = valuesOf(array);
      if (values.empty()) return false;
      for (std::size_t first = 0; first < values.size(); first += 3)
        if (values.size() - first < 3 ||
            !(cartesian(values.subspan(first, 3), spherical).normalized().dot(wanted) > 0.999))
          return true;
      return false;
    };
    const bool spherical = isSpherical(file_.ListenerView, false);
    if (differs(file_.ListenerView, spherical, Vec3::UnitX()) ||
        differs(file_.ListenerUp, isSpherical(file_.ListenerUp, spherical), Vec3::UnitZ()))
      return Error{"its listener is turned; it takes one that looks along x with z up"};
    return std::monostate{};
  }

  /// True if the second receiver is the left ear. The common order is left, right; the receivers'
  /// positions decide if they are given.
  bool leftComesSecond() const {
    const std::span<const float> values = valuesOf(file_.ReceiverPosition);
    if (values.size() < 6) return false;
    const bool spherical = isSpherical(file_.ReceiverPosition, false);
    return cartesian(values.first(3), spherical).y() <
           cartesian(values.subspan(3, 3), spherical).y();
  }

  const MYSOFA_HRTF& file_;
  std::span<const float> positions_;
  std::span<const float> responses_;
  std::span<const float> delays_;
};

Status checkReadable(const fs::path& path) {
  std::error_code code;
  const fs::file_status status = fs::status(path, code);
  if (!fs::exists(status)) return Error{"there is no such file"};
  if (!fs::is_regular_file(status)) return Error{"it is not a regular file"};
  if (!std::ifstream(path, std::ios::binary)) return Error{"it may not be read"};
  if (fs::file_size(path, code) > kMaxFileSize) return Error{"it is larger than 1 GiB"};
  return std::monostate{};
}

}  // namespace

Result<HrtfMeasurements> measurementsOf(const MYSOFA_HRTF& file) {
  const SofaFile sofa(file);
  if (const Status valid = sofa.validate(); !valid) return valid.error();
  return sofa.measurements();
}

/// Leaves the reading to libmysofa: its reader of bytes in memory (mysofa_load_data of 1.3.1)
/// follows addresses out of them, where that of files comes to the end of the file.
Result<HrtfMeasurements> readSofaFile(const fs::path& path) {
  const auto failure = [&](const std::string& reason) {
    return Error{"SOFA file '" + path.string() + "': " + reason};
  };
  if (const Status valid = checkReadable(path); !valid) return failure(valid.error().message);
  int code = MYSOFA_OK;
  const SofaHandle file(mysofa_load(path.c_str(), &code));
  if (!file) return failure(reasonOf(code));
  Result<HrtfMeasurements> measurements = measurementsOf(*file);
  if (!measurements) return failure(measurements.error().message);
  return measurements;
}

fs::path defaultSofaFile() {
  const std::array<fs::path, 3> places = {CAROM_DEFAULT_SOFA, "/usr/share/libmysofa/default.sofa",
                                          "/usr/local/share/libmysofa/default.sofa"};
  for (const fs::path& place : places) {
    std::error_code ignored;
    if (fs::exists(place, ignored)) return place;
  }
  return places.front();
}

}  // namespace carom::audio
