// All layers whole in one program: what two of them call alike meets here, where -flto -Werror=odr
// (preset "odr") looks at every type of every source.
#include <cstdio>

int main() {
  std::puts("linked");
  return 0;
}
