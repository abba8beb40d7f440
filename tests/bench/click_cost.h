#pragma once

#include <vector>

#include "tests/support/click_spectrum.h"

namespace carom::bench {

/// CPU time per click in ns, for each of `clicks`: schedule and render for one listener, 200,000
/// clicks a second of that kind at random places between samples. The result is the least of
/// several rounds; in each round all kinds take their turn, so that disturbances of the machine
/// affect all of them.
std::vector<double> clickCosts(const std::vector<test::ClickCase>& clicks);

}  // namespace carom::bench
