#include "command/output/sound_name.h"

#include <filesystem>

#include "audio/model/decimal.h"

namespace carom::command {

namespace fs = std::filesystem;

ReadFile openSound(const std::string& file, SF_INFO& info) {
  return {sf_open(file.c_str(), SFM_READ, &info), &sf_close};
}

std::optional<double> fullScaleIn(SNDFILE* file) {
  const char* const comment = sf_get_string(file, SF_STR_COMMENT);
  if (comment == nullptr) return std::nullopt;
  const std::string text = comment;  // "full scale 1.25 Pa"
  const std::string before = "full scale ";
  const std::size_t found = text.find(before);
  if (found == std::string::npos) return std::nullopt;
  double number = 0.0;
  const char* const first = text.data() + found + before.size();
  const auto read = audio::readDecimal(first, text.data() + text.size(), number);
  if (read.ec != std::errc()) return std::nullopt;
  return number;
}

Result<std::string> soundNameOf(const std::string& input) {
  const std::string name = fs::path(input).stem().string() + ".wav";
  std::error_code ignored;
  if (!fs::exists(fs::symlink_status(name, ignored))) return name;
  SF_INFO info = {};
  const bool isRegular = fs::is_regular_file(name, ignored);
  const ReadFile file = isRegular ? openSound(name, info) : ReadFile(nullptr, &sf_close);
  if (file != nullptr && fullScaleIn(file.get())) return name;
  return Error{"'" + name +
               "' is there already, and Carom has not written it; expected another name, by -o "
               "FILE.wav"};
}

}  // namespace carom::command
