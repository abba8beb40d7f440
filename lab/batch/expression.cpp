#include "lab/batch/expression.h"

#include <cmath>
#include <numbers>

#include <muParser.h>

namespace carom::lab {

Result<double> valueOf(const std::string& expression, const NamedNumbers& numbers) {
  try {
    mu::Parser parser;
    parser.ClearConst();  // its own pi has twelve digits
    parser.DefineConst("pi", std::numbers::pi);
    for (const auto& [name, number] : numbers)
      parser.DefineConst(name, number);
    parser.SetExpr(expression);
    const double value = parser.Eval();
    if (std::isfinite(value)) return value;
    return Error{"the value of \"" + expression + "\" is no finite number"};
  } catch (const mu::ParserError& error) {
    return Error{"\"" + expression + "\": " + error.GetMsg() +
                 " Expected numbers, the names of parameters before it, + - * / ^, comparisons and "
                 "functions such as sqrt"};
  }
}

}  // namespace carom::lab
