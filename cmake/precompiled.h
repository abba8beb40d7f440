// What half of the sources include, compiled once: see carom_precompile().
// Only an aid: every source includes what it uses, and the presets for release, fuzzing and
// clang-tidy build without this file.
#ifdef __cplusplus
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <numbers>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include <Eigen/Dense>
#endif
