#include "plugin/bullet/material_guess.h"

#include <algorithm>
#include <cmath>

namespace carom::plugin {

const Material& materialByDensity(double density) {
  const auto table = materialTable();
  return *std::min_element(table.begin(), table.end(), [&](const Material& a, const Material& b) {
    return std::abs(std::log(a.density / density)) < std::abs(std::log(b.density / density));
  });
}

}  // namespace carom::plugin
