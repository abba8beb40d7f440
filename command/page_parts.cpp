#include "command/page_parts.h"

#include <sstream>
#include <string>
#include <system_error>
#include <variant>

#include "audio/propagation/sofa_file.h"

namespace carom::command {

namespace fs = std::filesystem;

std::vector<fs::path> pageFolders() {
  std::error_code ignored;
  const fs::path program = fs::read_symlink("/proc/self/exe", ignored);
  std::vector<fs::path> folders;
  std::istringstream names(CAROM_VIEW_FOLDERS);
  for (std::string name; std::getline(names, name, ':');)
    folders.push_back((program.parent_path() / name).lexically_normal());
  return folders;
}

Status addDefaultHead(lab::ViewPage& page) {
  const auto head = audio::readSofaFile(audio::defaultSofaFile());
  return head ? page.setHead(*head) : Status(std::monostate{});
}

}  // namespace carom::command
