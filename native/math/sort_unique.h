#pragma once

#include <algorithm>
#include <vector>

namespace carom::native {

/// Sorts the values and removes all but one of equal ones. [any thread]
template <class Value>
void sortUnique(std::vector<Value>& values) {
  std::sort(values.begin(), values.end());
  // Not std::ranges::unique: Clang 14 does not compile that of libstdc++ 12.
  values.erase(std::unique(values.begin(), values.end()), values.end());
}

}  // namespace carom::native
