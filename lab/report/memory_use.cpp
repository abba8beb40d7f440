#include "lab/report/memory_use.h"

#if defined(__GLIBC__) && (__GLIBC__ > 2 || (__GLIBC__ == 2 && __GLIBC_MINOR__ >= 33))
#define CAROM_HAS_MALLINFO2 1
#include <malloc.h>
#endif

namespace carom::lab {

std::optional<std::size_t> heapInUse() {
#ifdef CAROM_HAS_MALLINFO2
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
#else
  return std::nullopt;
#endif
}

}  // namespace carom::lab
