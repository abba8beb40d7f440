#pragma once

#include <array>
#include <limits>

namespace carom::native {

/// Coefficients of c0 + c1 t + c2 t^2 + c3 t^3 + c4 t^4, lowest first.
using Quartic = std::array<double, 5>;

/// Returns the first t from `from` to `until` at which the polynomial falls through zero: from
/// above, or from zero, to below. Infinity if it never does. A polynomial that is below zero at
/// `from` must rise above it first; the caller decides about one that is below zero and falling
/// there.
///
/// Between neighbouring zeros of its derivative the polynomial is monotone, so there is one fall in
/// an interval or none; the derivative's zeros are found in the same way from those of the second
/// derivative, which are in closed form. Each zero is bracketed and refined by Newton's method,
/// kept in its bracket by bisection, until the bracket is two neighbouring doubles or the value is
/// lost in rounding. So a near graze is a question of the coefficients' rounding, not of
/// convergence. Only + - * / and sqrt are used. Finite coefficients. [any thread]
double firstFall(const Quartic& polynomial, double from,
                 double until = std::numeric_limits<double>::infinity()) noexcept;

}  // namespace carom::native
