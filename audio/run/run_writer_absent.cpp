#include "audio/run/run_writer.h"

// Takes the place of run_writer.cpp in a build without Zstandard.

namespace carom::audio {

namespace {

Error withoutRuns() {
  return Error{"this build of Carom writes no runs (CAROM_RUNS is off)"};
}

}  // namespace

Result<std::vector<std::byte>> packedPortions(std::span<const RunPortion>, Packing) {
  return withoutRuns();
}

Result<RunWriter> RunWriter::create(const std::filesystem::path& file, std::uint32_t) {
  return Error{file.string() + ": " + withoutRuns().message};
}

Status RunWriter::add(RunPortion) {
  return withoutRuns();
}

Status RunWriter::put(char, std::span<const std::byte>) {
  return withoutRuns();
}

Status RunWriter::putPacked(std::span<const std::byte>, std::uint64_t) {
  return withoutRuns();
}

Status RunWriter::goBackTo(const Place&) {
  return withoutRuns();
}

Result<std::uintmax_t> RunWriter::finish() {
  return withoutRuns();
}

}  // namespace carom::audio
