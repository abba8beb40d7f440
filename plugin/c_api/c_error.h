#pragma once

#include <exception>
#include <new>
#include <string_view>

#include "carom/audio/result.h"
#include "carom/carom.h"

namespace carom::plugin {

// The way from errors to statuses of the C interface. [any thread]

/// Returns the message of the latest call of this thread that failed; "" if there is none.
const char* lastFailure() noexcept;

/// Keeps the message for lastFailure, and returns the status.
carom_status failed(carom_status status, std::string_view message) noexcept;

/// Turns a Status into a carom_status: `refused` if it is an error.
inline carom_status outcome(const Status& status,
                            carom_status refused = CAROM_ERROR_ARGUMENT) noexcept {
  return status ? CAROM_OK : failed(refused, status.error().message);
}

/// Runs `action`, which returns a carom_status; its exceptions become one, too. In a build without
/// exceptions a lack of memory ends the program.
template <class Action>
carom_status guarded(Action&& action) noexcept {
#if __cpp_exceptions
  try {
    return action();
  } catch (const std::bad_alloc&) {
    return failed(CAROM_ERROR_MEMORY, "there is no memory left");
  } catch (const std::exception& exception) {
    return failed(CAROM_ERROR_INTERNAL, exception.what());
  } catch (...) {
    return failed(CAROM_ERROR_INTERNAL, "an exception of unknown kind");
  }
#else
  return action();
#endif
}

}  // namespace carom::plugin
