// The parts of the module that are neither of the C API, whose functions the linker takes from
// carom::plugin, nor of the layout.

#include <new>

#include "carom/carom.h"
#include "plugin/c_api/c_error.h"

namespace carom::web {
namespace {

/// Ends the instance on a lack of memory, of which no exception can tell here. The sentence is left
/// in the instance's memory, where carom_last_message still finds it.
[[noreturn]] void endWithoutMemory() {
  (void)plugin::failed(CAROM_ERROR_MEMORY, "there is no memory left");
  __builtin_trap();
}

[[maybe_unused]] const bool isSet = [] {
  std::set_new_handler(endWithoutMemory);
  return true;
}();

}  // namespace
}  // namespace carom::web

/// Registers what ends with its thread. The module's only thread does not end before its memory.
extern "C" int __cxa_thread_atexit(void (*)(void*), void*, void*) {
  return 0;
}
