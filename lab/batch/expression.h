#pragma once

#include <map>
#include <string>

#include "carom/audio/result.h"

namespace carom::lab {

/// Numbers by the names that expressions have for them.
using NamedNumbers = std::map<std::string, double>;

/// Returns the value of an expression in the language of muParser: + - * / ^, comparisons (1 or 0),
/// && || ?:, and its functions (sin, sqrt, min, log10, exp, ...), and pi. The error, the
/// second half of a sentence, names an unknown word or the place of a mistake, or a value that is
/// no finite number. [any thread]
Result<double> valueOf(const std::string& expression, const NamedNumbers& numbers);

}  // namespace carom::lab
