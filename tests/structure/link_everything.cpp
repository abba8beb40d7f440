// Links all layers whole in one program: types with one name meet here, where -flto -Werror=odr
// (.ci/one_meaning) looks at every type of every source.
#include <cstdio>

int main() {
  std::puts("linked");
  return 0;
}
