#pragma once

// GCC tells of its sanitizers by macros, Clang by features.
#if defined(__has_feature)
#define CAROM_HAS_FEATURE(name) __has_feature(name)
#else
#define CAROM_HAS_FEATURE(name) 0
#endif

namespace carom {

/// True where accesses to memory, or races, are looked for: all takes 2 to 40 times as long, and
/// there are system calls of the sanitizer's own at any place.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || \
    CAROM_HAS_FEATURE(address_sanitizer) || CAROM_HAS_FEATURE(thread_sanitizer)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

}  // namespace carom
