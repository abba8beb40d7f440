#include "scenes/stability_cases.h"

namespace carom {

void addContactCases(std::vector<StabilityCase>& /*cases*/) {}

}  // namespace carom
