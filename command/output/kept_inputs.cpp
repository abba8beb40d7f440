#include "command/output/kept_inputs.h"

#include "audio/io/partial_file.h"

namespace carom::command {

Status checkKept(const std::vector<WrittenFile>& written,
                 const std::vector<std::filesystem::path>& read) {
  for (const auto& [option, output] : written)
    for (const std::filesystem::path& file : read)
      if (!output.empty() && !file.empty() && audio::isSameFile(output, file))
        return Error{option + ": " + output.string() + " would take the place of " + file.string() +
                     ", which is read; expected another name"};
  return std::monostate{};
}

}  // namespace carom::command
