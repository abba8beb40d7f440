#include "modal/mesh/printable.h"

#include <cstddef>

namespace carom::modal {
namespace {

constexpr std::size_t kMaxShown = 120;  // characters

}  // namespace

std::string printable(std::string_view text) {
  std::string result;
  for (const char letter : text.substr(0, kMaxShown))
    result += letter >= ' ' && letter <= '~' ? letter : '?';
  return result;
}

}  // namespace carom::modal
