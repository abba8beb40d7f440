#include "scenes/stability_cases.h"

namespace carom {

void addSoundCases(std::vector<StabilityCase>& /*cases*/) {}

}  // namespace carom
