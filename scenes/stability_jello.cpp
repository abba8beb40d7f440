#include "scenes/stability_cases.h"

namespace carom {

void addJelloCases(std::vector<StabilityCase>& /*cases*/) {}

}  // namespace carom
