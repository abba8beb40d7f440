#include "audio/io/wav_stream.h"

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <iterator>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include <sndfile.h>

namespace carom::audio {

namespace fs = std::filesystem;

namespace {

static_assert(std::endian::native == std::endian::little, "samples are written as they are");

constexpr double kShortScale = 32768.0;  // as in libsndfile: a sample of 1.0 reads back as 1.0

// Places of a RIFF header, which begins with "RIFF", its length, "WAVE", "fmt " and that length.
constexpr std::size_t kRiffSize = 4;
constexpr std::size_t kFormat = 12;
constexpr std::size_t kChunkHead = 8;
constexpr std::size_t kSizes64 = 28;  // bytes of a ds64 chunk without a table

short toShort(float sample) {
  const double scaled = std::nearbyint(static_cast<double>(sample) * kShortScale);
  return static_cast<short>(std::clamp(scaled, -kShortScale, kShortScale - 1.0));
}

SF_INFO infoOf(const WavStream::Format& format) {
  // Float samples have the extensible header, which other tools expect of them.
  const bool isFloat = format.samples == SampleFormat::float32;
  SF_INFO info = {};
  info.samplerate = format.sampleRate;
  info.channels = static_cast<int>(format.channels);
  info.format = isFloat ? SF_FORMAT_WAVEX | SF_FORMAT_FLOAT : SF_FORMAT_WAV | SF_FORMAT_PCM_16;
  return info;
}

/// Writes a file without samples, with the full scale (Pa) in its comment.
Status writeEmpty(const fs::path& path, const WavStream::Format& format) {
  std::ostringstream comment;  // first, as no file may be left open where memory lacks
  comment << "full scale " << format.fullScale << " Pa";
  const std::string text = comment.str();
  SF_INFO info = infoOf(format);
  SNDFILE* const file = sf_open(path.c_str(), SFM_WRITE, &info);
  if (file == nullptr) return Error{std::string("cannot be created: ") + sf_strerror(nullptr)};
  // The peak chunk holds the time of day, and the same sound must give the same file.
  sf_command(file, SFC_SET_ADD_PEAK_CHUNK, nullptr, SF_FALSE);
  const bool isDescribed = sf_set_string(file, SF_STR_COMMENT, text.c_str()) == 0;
  const int code = sf_close(file);
  if (!isDescribed) return Error{"takes no comment"};
  if (code != SF_ERR_NO_ERROR)
    return Error{std::string("cannot be created: ") + sf_error_number(code)};
  return std::monostate{};
}

void putText(std::vector<char>& bytes, std::string_view text) {
  bytes.insert(bytes.end(), text.begin(), text.end());
}

template <class Number>
void put(std::vector<char>& bytes, Number number) {
  const char* const first = reinterpret_cast<const char*>(&number);
  bytes.insert(bytes.end(), first, first + sizeof(Number));
}

void set32(std::vector<char>& bytes, std::size_t at, std::uint64_t number) {
  const auto small = static_cast<std::uint32_t>(number);
  std::memcpy(&bytes[at], &small, sizeof small);
}

std::uint32_t get32(const std::vector<char>& bytes, std::size_t at) {
  std::uint32_t number = 0;
  std::memcpy(&number, &bytes[at], sizeof number);
  return number;
}

}  // namespace

bool WavStream::canWrite(const Format& format) {
  const SF_INFO info = infoOf(format);
  return sf_format_check(&info) == SF_TRUE;
}

Result<WavStream> WavStream::create(const fs::path& path, const Format& format) {
  if (const Status empty = writeEmpty(path, format); !empty) return empty.error();
  std::unique_ptr<std::FILE, Close> file(std::fopen(path.c_str(), "r+b"));
  if (file == nullptr) return Error{"cannot be written: " + std::generic_category().message(errno)};
  // Unbuffered: what was appended is the system's, whatever becomes of the program.
  std::setvbuf(file.get(), nullptr, _IONBF, 0);
  std::vector<char> header(4096);
  header.resize(std::fread(header.data(), 1, header.size(), file.get()));
  const auto data = std::search(header.begin(), header.end(), "data", &"data"[4]);
  if (header.end() - data < std::ptrdiff_t{kChunkHead}) return Error{"cannot be read back"};
  header.erase(data + kChunkHead, header.end());  // for no samples, libsndfile may pad
  std::error_code failed;
  fs::resize_file(path, header.size(), failed);
  if (failed) return Error{"cannot be written: " + failed.message()};
  return WavStream(std::move(file), std::move(header), format);
}

std::size_t WavStream::frameBytes() const {
  return format_.channels *
         (format_.samples == SampleFormat::float32 ? sizeof(float) : sizeof(short));
}

Status WavStream::append(std::span<const float> samples) {
  if (samples.empty()) return std::monostate{};
  const bool isWritten = writeData(samples);
  const int reason = errno;
  frames_ = bytes_ / frameBytes();
  // Brought up to date after an error too: part of the samples may be there.
  if (writeHeader() && isWritten) return std::monostate{};
  return Error{"cannot be written: " + std::generic_category().message(isWritten ? errno : reason)};
}

bool WavStream::writeData(std::span<const float> samples) {
  const void* from = samples.data();
  std::size_t size = samples.size_bytes();
  if (format_.samples == SampleFormat::pcm16) {
    shorts_.resize(samples.size());
    std::ranges::transform(samples, shorts_.begin(), toShort);
    from = shorts_.data();
    size = shorts_.size() * sizeof(short);
  }
  if (std::fseek(file_.get(), 0, SEEK_END) != 0) return false;
  const std::size_t written = std::fwrite(from, 1, size, file_.get());
  bytes_ += written;
  return written == size;
}

bool WavStream::writeHeader() {
  const std::vector<char> now = headerNow();
  return std::fseek(file_.get(), 0, SEEK_SET) == 0 &&
         std::fwrite(now.data(), 1, now.size(), file_.get()) == now.size();
}

/// Returns the header for the frames so far.
std::vector<char> WavStream::headerNow() const {
  if (isRf64()) return rf64Header();
  std::vector<char> now = header_;
  const std::uint64_t data = frames_ * frameBytes();
  set32(now, kRiffSize, now.size() - kChunkHead + data);
  set32(now, now.size() - 4, data);
  const std::size_t fact = formatEnd();
  if (std::string_view(&now[fact], 4) == "fact") set32(now, fact + kChunkHead, frames_);
  return now;
}

std::size_t WavStream::formatEnd() const {
  return kFormat + kChunkHead + get32(header_, kFormat + 4);
}

/// Returns a header of the same length with 64-bit sizes, in place of the facts and the comment.
std::vector<char> WavStream::rf64Header() const {
  const std::uint64_t data = frames_ * frameBytes();
  std::vector<char> now;
  putText(now, "RF64");
  put(now, ~std::uint32_t{0});
  putText(now, "WAVEds64");
  put(now, static_cast<std::uint32_t>(kSizes64));
  put(now, std::uint64_t{header_.size() - kChunkHead + data + trailer_});
  put(now, data);
  put(now, frames_);
  put(now, std::uint32_t{0});
  const std::size_t format = now.size();
  now.insert(now.end(), header_.begin() + kFormat,
             header_.begin() + static_cast<std::ptrdiff_t>(formatEnd()));
  const std::size_t left = header_.size() - kChunkHead - now.size();
  if (left >= kChunkHead) {
    putText(now, "JUNK");
    put(now, static_cast<std::uint32_t>(left - kChunkHead));
  } else if (left > 0) {  // too little for a chunk: the format gets an extension of that size
    set32(now, format + 4, get32(now, format + 4) + left);
    put(now, static_cast<std::uint16_t>(left - 2));
  }
  now.resize(header_.size() - kChunkHead, 0);
  putText(now, "data");
  put(now, ~std::uint32_t{0});
  return now;
}

Status WavStream::close() {
  bool isWritten = true;
  if (isRf64()) {  // whose header has no room for the comment
    const auto comment = std::search(header_.begin() + static_cast<std::ptrdiff_t>(formatEnd()),
                                     header_.end(), "LIST", &"LIST"[4]);
    const std::string rest(comment, header_.end() - kChunkHead);
    trailer_ = rest.size();
    isWritten = std::fseek(file_.get(), 0, SEEK_END) == 0 &&
                std::fwrite(rest.data(), 1, rest.size(), file_.get()) == rest.size() &&
                writeHeader();
  }
  if (std::fclose(file_.release()) == 0 && isWritten) return std::monostate{};
  return Error{"cannot be closed: " + std::generic_category().message(errno)};
}

}  // namespace carom::audio
