#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <span>
#include <string_view>

#include <carom/audio/material.h>

namespace carom {

// Absorption of sound by a surface that reflects it, as data, and as a filter of first order; and
// by the air. All of this file: [any thread], no allocation.

inline constexpr std::size_t kBandCount = 7;

/// Hz, the octaves' nominal centres (ISO 266).
inline constexpr std::array<double, kBandCount> kOctaveBands = {125.0,  250.0,  500.0, 1000.0,
                                                                2000.0, 4000.0, 8000.0};

/// Decay times in s, in the bands of kOctaveBands: the time in which the energy falls by 60 dB.
/// Infinity: never.
using DecayTimes = std::array<double, kBandCount>;

/// The random-incidence absorption coefficient of a surface: the share of the incident energy that
/// does not come back. Valid: each in [0, 1]. (ISO 354 can measure above 1; enter 1.)
struct Absorption {
  std::array<double, kBandCount> coefficients{};  ///< 1, alpha in the bands of kOctaveBands
};

/// True if all coefficients are numbers in [0, 1].
bool isValid(const Absorption& absorption);

/// alpha at `frequency` (Hz, > 0): linear over the logarithm of frequency between the bands'
/// centres, constant below the lowest and above the highest.
double absorptionAt(const Absorption& absorption, double frequency);

/// |R| = sqrt(1 - alpha), 1: pressure reflected over pressure incident (Kuttruff, Room Acoustics,
/// 5th ed. 2009, chapter 2).
double reflectionMagnitude(const Absorption& absorption, double frequency);

/// A kind of surface with its published absorption.
struct Surface {
  std::string_view name;
  Absorption absorption;
  std::string_view source;  ///< the surface that was measured, and the publication
};

/// The built-in surfaces. Where a source ends at 4 kHz, its value there is held at 8 kHz.
std::span<const Surface> surfaceTable();

/// Returns the built-in surface of that name, or nullptr.
const Surface* findSurface(std::string_view name);

/// Returns the surface that is assumed for a wall of a built-in material (`Material::name`) if none
/// is given; nullptr for a name that is not built in. Our choice: nothing published was found for
/// massive metal (steel, aluminium), which therefore gets the hardest row, marble; plastic gets
/// that of a smooth floor covering.
const Surface* defaultSurface(std::string_view material);

/// A first-order filter: H(z) = (b0 + b1 z^-1) / (1 + a1 z^-1).
struct ReflectionFilter {
  double b0 = 1.0;
  double b1 = 0.0;
  double a1 = 0.0;  ///< |a1| < 1: stable
};

/// Returns the first-order filter whose magnitude comes closest to |R| in the bands.
///
/// It is the bilinear transform of (g0 + gN x) / (1 + x), x = s / corner, g0 >= 0 and gN >= 0:
/// minimum phase. Its power is a weighted mean of g0^2 (at 0 Hz) and gN^2 (at half the sample
/// rate), |H|^2 = g0^2 + (gN^2 - g0^2) u(f) with u from 0 to 1, so 0 <= g <= 1 makes it passive at
/// every frequency, and for a given corner alpha = 1 - |H|^2 is linear in the unknowns g0^2 and
/// gN^2. These are fitted by least squares over the bands weighted by 1/(1 - alpha)^2, which is
/// least squares in dB as long as the errors are small; the corner is found by search. Bands above
/// 0.45 of the sample rate are left out.
///
/// Not modelled: phase of the surface (its reactance), angle of incidence. A magnitude that is not
/// monotone over frequency cannot be followed; reflectionFitError says by how much. A path with
/// several reflections has their filters in series: the product of the responses.
///
/// Requires a valid `absorption` and a sample rate (Hz) of at least 1000.
ReflectionFilter reflectionFilter(const Absorption& absorption, double sampleRate);

/// Returns H at `frequency` (Hz), for the time dependence exp(+i omega t).
std::complex<double> frequencyResponse(const ReflectionFilter& filter, double frequency,
                                       double sampleRate);

/// Largest error of the fit in dB, >= 0: |20 log10(|H| / |R|)| over the bands below 0.45 of the
/// sample rate, with |H| and |R| taken as at least 0.1 (-20 dB).
double reflectionFitError(const Absorption& absorption, const ReflectionFilter& filter,
                          double sampleRate);

/// Attenuation m of the energy of a plane wave in air, in 1/m: after x metres exp(-m x) of the
/// energy, exp(-m x / 2) of the pressure is left, which is m 10 / ln(10) dB for each metre.
///
/// ISO 9613-1:1993, equations (3) to (5) and annex B: viscosity and heat conduction, and the
/// relaxation of oxygen and nitrogen, whose frequencies depend on the water in the air. The
/// standard is sure of it to 10 % from 253.15 to 323.15 K where 0.05 to 5 % of the molecules are
/// water, and frequency over pressure is from 4e-4 to 10 Hz/Pa. Density and speed of sound of the
/// medium play no part.
///
/// Requires a frequency (Hz) of at least 0, and temperature, humidity and pressure in the ranges of
/// Medium.
double airAttenuation(const Medium& medium, double frequency);

/// The attenuation in the bands of kOctaveBands, as sabineDecayTimes takes it.
std::array<double, kBandCount> airAttenuation(const Medium& medium);

}  // namespace carom
