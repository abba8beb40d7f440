#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <vector>

#include <mysofa.h>

#include "audio/propagation/hrtf.h"
#include "audio/propagation/sofa_file.h"
#include "tests/fuzz/fuzz_numbers.h"

namespace carom::fuzz {
namespace {

/// A file as libmysofa hands it over: mostly a set of measurements all around, of which any number,
/// size or attribute may be wild. Owns what the file points to.
class FileMaker {
 public:
  explicit FileMaker(FuzzNumbers& numbers) : numbers_(numbers) {
    measurements_ = 6 + numbers_.below(20);
    samples_ = 1 + numbers_.below(24);
    file_.I = 1;
    file_.C = 3;
    file_.E = 1;
    file_.M = wildSize(measurements_);
    file_.N = wildSize(samples_);
    file_.R = wildSize(2);
    file_.attributes = attribute("DataType", "FIR", attribute(nullptr, nullptr, nullptr));
    file_.attributes = attribute("SOFAConventions", "SimpleFreeFieldHRIR", file_.attributes);
    addPositions();
    addResponses();
    addListener();
  }

  const MYSOFA_HRTF& file() const { return file_; }
  std::size_t measurements() const { return measurements_; }

 private:
  unsigned wildSize(std::size_t sound) {
    constexpr std::array kWild = {0U, 1U, 3U, 65536U, 0x7fffffffU, 0xffffffffU};
    const std::uint8_t choice = numbers_.byte();
    return choice < 244 ? static_cast<unsigned>(sound) : kWild[(choice - 244U) % kWild.size()];
  }
  float wildNumber(double sound) {
    const double number = numbers_.wild(sound);
    return std::abs(number) <= 3e38 ? static_cast<float>(number) : std::copysign(HUGE_VALF, 1.0F);
  }
  char* text(const char* sound) {
    if (sound == nullptr || numbers_.rarely(2)) return nullptr;
    std::string made = sound;
    if (numbers_.rarely(2)) made = "cartesian";
    if (numbers_.rarely(2)) made.assign(100, '\n');
    return texts_.emplace_back(made).data();
  }
  MYSOFA_ATTRIBUTE* attribute(const char* name, const char* value, MYSOFA_ATTRIBUTE* next) {
    return &attributes_.emplace_back(MYSOFA_ATTRIBUTE{next, text(name), text(value)});
  }
  /// Hands over values, sometimes more or fewer of them, or none at all.
  void give(MYSOFA_ARRAY& array, std::vector<float> values, const char* type) {
    if (numbers_.rarely(4)) values.resize(numbers_.below(8), 1.0F);
    std::vector<float>& kept = values_.emplace_back(std::move(values));
    array.elements = static_cast<unsigned>(kept.size());
    array.values = numbers_.rarely(2) || kept.empty() ? nullptr : kept.data();
    if (type != nullptr) array.attributes = attribute("Type", type, nullptr);
  }
  /// The six axes first, so that the listener is surrounded, then anything; some are there twice.
  void addPositions() {
    constexpr std::array<std::array<double, 2>, 6> kAxes = {
        {{0, 0}, {90, 0}, {180, 0}, {270, 0}, {0, 90}, {0, -90}}};
    std::vector<float> values;
    for (std::size_t index = 0; index < measurements_; ++index) {
      const double azimuth = numbers_.between(-360.0, 360.0);
      const double elevation = numbers_.between(-90.0, 90.0);
      const bool isAxis = index < kAxes.size() || numbers_.rarely(32);
      const auto& axis = kAxes[index % kAxes.size()];
      values.push_back(wildNumber(isAxis ? axis[0] : azimuth));
      values.push_back(wildNumber(isAxis ? axis[1] : elevation));
      values.push_back(wildNumber(1.4));
    }
    give(file_.SourcePosition, std::move(values), "spherical");
  }
  void addResponses() {
    std::vector<float> values;
    std::vector<float> delays;
    const bool isWild = numbers_.rarely(64);
    for (std::size_t index = 0; index < 2 * measurements_; ++index) {
      for (std::size_t sample = 0; sample < samples_; ++sample) {
        const double sound = numbers_.between(-1.0, 1.0) + 1e-3;
        values.push_back(isWild ? wildNumber(sound) : static_cast<float>(sound));
      }
      delays.push_back(wildNumber(numbers_.between(0.0, 50.0)));
    }
    give(file_.DataIR, std::move(values), nullptr);
    const std::uint8_t choice = numbers_.byte();
    if (choice < 192) delays.resize(choice < 64 ? 0 : 2);
    give(file_.DataDelay, std::move(delays), nullptr);
    constexpr std::array kRates = {44100.0, 48000.0, 8000.0, 96000.0};
    give(file_.DataSamplingRate, {wildNumber(kRates[numbers_.below(kRates.size())])}, nullptr);
    if (numbers_.chance(128))
      file_.DataSamplingRate.attributes = attribute("Units", "hertz", nullptr);
  }
  void addListener() {
    if (numbers_.chance(128)) {
      give(file_.ListenerView, {wildNumber(1.0), wildNumber(0.0), wildNumber(0.0)}, "cartesian");
      give(file_.ListenerUp, {wildNumber(0.0), wildNumber(0.0), wildNumber(1.0)}, "cartesian");
    }
    if (!numbers_.chance(128)) return;
    const double left = numbers_.rarely(64) ? -0.09 : 0.09;
    give(file_.ReceiverPosition, {0.0F, wildNumber(left), 0.0F, 0.0F, wildNumber(-left), 0.0F},
         "cartesian");
  }

  FuzzNumbers& numbers_;
  MYSOFA_HRTF file_ = {};
  std::size_t measurements_ = 0;
  std::size_t samples_ = 0;
  std::deque<std::string> texts_;
  std::deque<MYSOFA_ATTRIBUTE> attributes_;
  std::deque<std::vector<float>> values_;
};

void requireOneSentence(const std::string& message) {
  require(!message.empty() && message.size() < 1000 && message.find('\n') == std::string::npos);
}

/// Requires that a set answers every direction with weights that are weights, and with finite
/// samples.
void use(const HrtfSet& set, FuzzNumbers& numbers) {
  std::vector<double> response(set.length());
  for (int trial = 0; trial < 4; ++trial) {
    const Vec3 direction = numbers.wild(numbers.inCube(2.0));
    const audio::SphereWeights where = set.lookup(direction);
    double sum = 0.0;
    for (std::size_t corner = 0; corner < 3; ++corner) {
      require(where.index[corner] < set.directions() && where.weight[corner] >= -1e-9);
      sum += where.weight[corner];
    }
    require(std::abs(sum - 1.0) < 1e-6);
    for (const Ear ear : {Ear::left, Ear::right}) {
      set.blend(where, ear, response);
      for (const double sample : response)
        require(std::isfinite(sample));
    }
  }
  require(std::isfinite(set.latency()) && set.directions() >= 4);
}

void readAndUse(FuzzNumbers& numbers) {
  const FileMaker maker(numbers);
  const Result<HrtfMeasurements> read = audio::measurementsOf(maker.file());
  if (!read) return requireOneSentence(read.error().message);
  require(read->items.size() == maker.file().M);
  for (const HrtfMeasurement& item : read->items)
    require(item.response[0].size() == maker.file().N && item.response[1].size() == maker.file().N);
  constexpr std::array kRates = {48000.0, 44100.0, 16000.0};
  const Result<HrtfSet> set = HrtfSet::create(*read, kRates[numbers.below(kRates.size())]);
  if (!set) return requireOneSentence(set.error().message);
  use(*set, numbers);
}

}  // namespace
}  // namespace carom::fuzz

/// Hands a measured head over as libmysofa might after it has read any file: it must become a set
/// that answers every direction with finite samples, or one sentence.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  carom::fuzz::FuzzNumbers numbers({data, size});
  carom::fuzz::readAndUse(numbers);
  return 0;
}
