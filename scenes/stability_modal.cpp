#include "scenes/stability_cases.h"

namespace carom {

void addModalCases(std::vector<StabilityCase>& /*cases*/) {}

}  // namespace carom
