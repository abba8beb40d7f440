#pragma once

namespace carom {

/// Returns the trials of a random test: `count`, or a twentieth of it where the compiler does not
/// optimise, since Eigen's expressions take a hundred times as long then. At least 1.
constexpr int trials(int count) {
#ifdef __OPTIMIZE__
  return count;
#else
  return count < 20 ? 1 : count / 20;
#endif
}

}  // namespace carom
