#pragma once

#include "tests/support/click_spectrum.h"

namespace carom::bench {

/// Difference in dB, in the band, relative to the click's own energy there, between the
/// click_spectrum oracle and the click's formula sampled at 64 times the rate, without any Fourier
/// transform of a pulse or of a sphere. Compact: the mean slope of the force over each of these
/// samples, whose slight attenuation is undone. Exact: the sphere's equation in time, (a^2 / 2 c^2)
/// y'' + (a/c) y' + y = force, by Runge-Kutta, and y' + (c/r) y of it. There remain the aliases at
/// 64 times the rate and the steps' error where a force has a kink: contacts of few of these
/// samples cannot be confirmed in this way.
double oversampledDifference(const test::ClickCase& click);

}  // namespace carom::bench
