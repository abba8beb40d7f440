#pragma once

#include <cmath>

namespace carom::native {

/// Returns a b + c, rounded once, as instructions of processors do. WebAssembly has no such
/// instruction, and the C library's stand-in takes forty times as long: there it is rounded twice.
inline double fused(double a, double b, double c) {
#ifdef __wasm__
  return a * b + c;
#else
  return std::fma(a, b, c);
#endif
}

}  // namespace carom::native
