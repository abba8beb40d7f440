#pragma once

#include <vector>

#include "tests/support/click_spectrum.h"

namespace carom::bench {

/// ns of CPU time per click, for each of `clicks`: schedule and render, one listener, 200,000
/// clicks a second of that kind at random places between samples. The least of several rounds, in
/// each of which all of them take their turn, so that what disturbs the machine disturbs all.
std::vector<double> clickCosts(const std::vector<test::ClickCase>& clicks);

}  // namespace carom::bench
