#pragma once

#include <cmath>
#include <span>
#include <string>
#include <string_view>

namespace carom {

/// Statistics of a rough surface, isotropic and Gaussian: its heights' spectrum is flat for
/// waves longer than 2 pi correlation lengths and falls as q^(-2 (1 + hurst)) for shorter ones
/// (self-affine with roll-off: Persson et al. 2005, J. Phys.: Condens. Matter 17, R1, section 2).
/// Valid: 0 <= rmsHeight <= correlationLength, 0 < correlationLength, 0 < hurst <= 1.
struct Roughness {
  double rmsHeight = 0.0;           ///< m; 0: smooth
  double correlationLength = 1e-4;  ///< m
  double hurst = 0.8;               ///< 1, Hurst exponent: the larger, the weaker the short waves

  bool operator==(const Roughness&) const = default;
};

/// The thermal properties of a material, on which thermoelastic damping depends. Where any of the
/// three is 0, there is none. Valid: all finite and at least 0.
struct ThermalProperties {
  double expansion = 0.0;     ///< 1/K, linear
  double conductivity = 0.0;  ///< W/(m K)
  double heatCapacity = 0.0;  ///< J/(kg K), at constant pressure

  bool operator==(const ThermalProperties&) const = default;
};

/// The properties of a body's material that contact and its sound need.
/// Valid: density > 0, Young's modulus > 0, 0 <= Poisson's ratio < 0.5, 0 <= restitution <= 1,
/// dampingAlpha >= 0, dampingBeta >= 0, lossFactor from 0 to 2, lossExponent from -2 to 2, valid
/// roughness and thermal properties.
struct Material {
  std::string name;
  double density = 0.0;        ///< kg/m^3
  double youngsModulus = 0.0;  ///< Pa
  double poissonsRatio = 0.0;  ///< 1
  double restitution = 0.0;    ///< 1, of two bodies of this material; see combinedRestitution
  /// 1/s and s, Rayleigh damping: C = alpha M + beta K. Only used for bodies that ring; see
  /// dampingRate.
  double dampingAlpha = 0.0;
  double dampingBeta = 0.0;
  Roughness roughness = {};  ///< roughness of the surface as commonly made; smooth unless given
  /// 1, loss factor at 1 kHz of a law that is added to Rayleigh's: eta(f) = lossFactor times
  /// (f / 1 kHz)^lossExponent. That of most solids hardly depends on frequency, an exponent of 0,
  /// which Rayleigh's two numbers cannot follow over the audible band.
  double lossFactor = 0.0;
  double lossExponent = 0.0;
  ThermalProperties thermal = {};  ///< for losses by heat that flows, in addition to these

  bool operator==(const Material&) const = default;
};

/// The common materials, eight rows: the first of builtInMaterials(). Density, Young's modulus and
/// Poisson's ratio of the first four are those of Chadwick, Zheng, James 2012 ("Precomputed
/// acceleration noise"), which the seed document repeats as its table 1. [any thread]
std::span<const Material> materialTable();

/// All built-in materials, the common ones first. Each row names its sources in docs/materials.md.
/// [any thread]
std::span<const Material> builtInMaterials();

/// The built-in material of that name, or nullptr. [any thread]
const Material* findMaterial(std::string_view name);

/// Returns the rate (1/s) at which the material lets the amplitude of a mode of that frequency (Hz,
/// above 0) decay: with w = 2 pi f, (alpha + beta w^2) / 2 by Rayleigh, and eta(f) w / 2 by the
/// loss factor, the part of its energy that an oscillation loses in a radian. [any thread]
double dampingRate(const Material& material, double frequency);

/// Returns the loss factor (1) of a beam of that thickness (m) that bends at that frequency (Hz) by
/// the heat which flows from its pressed side to its stretched one, at 20 degrees C: largest where
/// that takes about a sixth of a period. C. Zener, "Internal friction in solids I", Phys. Rev. 52,
/// 1937; R. Lifshitz, M. L. Roukes, "Thermoelastic damping in micro- and nanomechanical systems",
/// Phys. Rev. B 61, 2000, in closed form. 0 where a thermal property is. [any thread]
double thermoelasticLossFactor(const Material& material, double thickness, double frequency);

/// Restitution of a pair: the geometric mean, so that a pair of one material has that material's
/// own value. Bullet multiplies instead: hand it sqrt(restitution) per body and it agrees.
/// Inline, so that `native/` needs this header alone. [any thread]
inline double combinedRestitution(double restitution, double otherRestitution) {
  return std::sqrt(restitution * otherRestitution);
}

/// Contact modulus E* of Hertz: 1/E* = (1-nu1^2)/E1 + (1-nu2^2)/E2 (Johnson 1985, eq. 4.5), Pa.
/// [any thread]
double contactModulus(const Material& material, const Material& other);

/// The fluid that carries the sound: air at 20 degrees C and 101.325 kPa unless set. Its density
/// and speed of sound are as given; they do not follow temperature, humidity and pressure, of which
/// the absorption alone is a function (airAttenuation).
struct Medium {
  double density = 1.20;        ///< kg/m^3, rho0
  double speedOfSound = 343.0;  ///< m/s, c; the seed document computes with 330
  double temperature = 293.15;  ///< K, 200 to 350; the standard is sure from 253.15 to 323.15
  double humidity = 0.5;        ///< relative humidity, 0 to 1 (100 %)
  double pressure = 101325.0;   ///< Pa, 1e3 to 2e5: of the atmosphere

  bool operator==(const Medium&) const = default;
};

}  // namespace carom
