#include "lab/video/film_encoder.h"

#include <chrono>
#include <fstream>
#include <utility>
#include <vector>

#include <unistd.h>

namespace carom::lab {

namespace {

constexpr std::chrono::hours kEncoderEnds(24);
constexpr std::chrono::milliseconds kEncoderFails(2000);

/// JPEGs have the colours of BT.601 in full range; films have those of BT.709 in that of video.
constexpr const char* kColours =
    "scale=in_color_matrix=bt601:in_range=pc:out_color_matrix=bt709:out_range=tv";

std::vector<std::string> encoderWords(const EncoderSettings& settings) {
  std::vector<std::string> words = {
      settings.program.string(), "-hide_banner", "-nostdin", "-loglevel", "error", "-y"};
  const auto add = [&words](std::initializer_list<std::string> more) {
    words.insert(words.end(), more);
  };
  add({"-f", "image2pipe", "-c:v", "mjpeg", "-framerate", std::to_string(settings.rate), "-i",
       "pipe:0"});
  add({"-f", "f32le", "-ar", std::to_string(settings.sampleRate), "-ac",
       std::to_string(settings.channels), "-i", settings.sound.string()});
  add({"-map", "0:v", "-map", "1:a", "-vf", kColours, "-pix_fmt", "yuv420p"});
  add({"-color_range", "tv", "-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc",
       "bt709", "-map_metadata", "-1", "-fflags", "+bitexact"});
  const std::string kilobits = settings.channels > 1 ? "192k" : "128k";
  if (settings.format == FilmFormat::mp4) {
    add({"-c:v", "libx264", "-preset", "medium", "-crf", settings.isLossless ? "0" : "17"});
    add({"-c:a", "aac", "-b:a", kilobits, "-movflags", "+faststart", "-f", "mp4"});
  } else {
    add({"-c:v", "libvpx-vp9", "-crf", "26", "-b:v", "0", "-deadline", "good", "-cpu-used", "4",
         "-row-mt", "1"});
    add({"-c:a", "libopus", "-b:a", kilobits, "-f", "webm"});
  }
  words.push_back("file:" + settings.output.string());
  return words;
}

/// Returns the first line of a file, at most 200 characters.
std::string firstLine(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::string line;
  std::getline(stream, line);
  return line.substr(0, 200);
}

}  // namespace

Result<FilmEncoder> FilmEncoder::start(const EncoderSettings& settings, void (*prepare)()) {
  auto [ours, theirs] = connectedPair();
  if (ours.number() < 0) return Error{"cannot be started: there are no descriptors left"};
  ChildProcess process({.words = encoderWords(settings),
                        .channels = {{STDIN_FILENO, theirs.number()}},
                        .messages = settings.messages,
                        .prepare = prepare});
  if (!process.runs()) return Error{"cannot be started"};
  return FilmEncoder(std::move(ours), std::move(process), settings.messages);
}

Status FilmEncoder::add(std::span<const std::byte> picture) {
  if (!sendAll(pictures_, picture)) return failure();
  return std::monostate{};
}

Status FilmEncoder::finish() {
  pictures_.close();
  if (process_.wait(kEncoderEnds) != 0) return failure();
  return std::monostate{};
}

/// Returns what ffmpeg says about its end.
Error FilmEncoder::failure() {
  process_.wait(kEncoderFails);
  const std::string words = firstLine(messages_);
  return Error{"has failed" + (words.empty() ? "" : ": " + words)};
}

}  // namespace carom::lab
