#include "scenes/stability_cases.h"

namespace carom {

void addBulletCases(std::vector<StabilityCase>& /*cases*/) {}

}  // namespace carom
