#include "carom/audio/sound_file.h"

// Takes the place of sound_file.cpp in a build without libsndfile.

namespace carom {

struct SoundFileWriter::State {};

Result<SoundFileWriter> SoundFileWriter::create(const std::filesystem::path& path,
                                                const SoundFileSettings&) {
  return Error{path.string() + ": this build writes no sound files (CAROM_SOUND_FILES is off)"};
}

SoundFileWriter::SoundFileWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
SoundFileWriter::SoundFileWriter(SoundFileWriter&&) noexcept = default;
SoundFileWriter& SoundFileWriter::operator=(SoundFileWriter&&) noexcept = default;
SoundFileWriter::~SoundFileWriter() = default;

Status SoundFileWriter::write(std::span<const float* const>, std::size_t) {
  return std::monostate{};
}
Status SoundFileWriter::finish() {
  return std::monostate{};
}
double SoundFileWriter::fullScale() const {
  return kFullScalePressure;
}
double SoundFileWriter::peakPressure() const {
  return 0.0;
}
std::uint64_t SoundFileWriter::clippedSamples() const {
  return 0;
}
std::uint64_t SoundFileWriter::samplesNotFinite() const {
  return 0;
}
const std::vector<std::filesystem::path>& SoundFileWriter::recovered() const {
  static const std::vector<std::filesystem::path> none;
  return none;
}
double SoundFileWriter::gainReduction() const {
  return 0.0;
}

}  // namespace carom
