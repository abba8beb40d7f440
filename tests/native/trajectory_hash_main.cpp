#include <cinttypes>
#include <cstdio>

#include "tests/native/trajectory_hash.h"

int main() {
  std::printf("%016" PRIx64 "\n", carom::test::trajectoryHash());
  return 0;
}
