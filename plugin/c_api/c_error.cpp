#include "plugin/c_api/c_error.h"

#include <algorithm>
#include <array>
#include <cstddef>

namespace carom::plugin {
namespace {

// The only mutable global: a caller that makes a handle has none yet to keep a message in. Its size
// is fixed, so that a lack of memory can be reported.
thread_local std::array<char, 1024> lastMessage{};

}  // namespace

const char* lastFailure() noexcept {
  return lastMessage.data();
}

carom_status failed(carom_status status, std::string_view message) noexcept {
  const std::size_t length = std::min(message.size(), lastMessage.size() - 1);
  std::copy_n(message.begin(), length, lastMessage.begin());
  lastMessage[length] = '\0';
  return status;
}

}  // namespace carom::plugin
