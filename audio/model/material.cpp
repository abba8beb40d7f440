#include "carom/audio/material.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "audio/model/immortal.h"

namespace carom {
namespace {

constexpr double kGiga = 1e9;
constexpr double kMega = 1e6;
constexpr std::size_t kCommon = 8;
constexpr std::size_t kRows = 45;

/// The loss factor of a fired ceramic bowl that was struck and recorded; docs/materials.md.
constexpr double kCeramicLoss = 5e-4;

/// Roughness of surfaces as they are commonly made; docs/materials.md has the sources.
constexpr Roughness kDrawn{2e-6, 40e-6, 0.8};  // or rolled, turned, milled
constexpr Roughness kSandCast{16e-6, 200e-6, 0.8};
constexpr Roughness kGround{0.5e-6, 20e-6, 0.8};
constexpr Roughness kPolished{0.1e-6, 50e-6, 0.8};
constexpr Roughness kFired{0.05e-6, 20e-6, 0.8};  // hence smooth
constexpr Roughness kMoulded{1e-6, 50e-6, 0.8};
constexpr Roughness kPlaned{6e-6, 150e-6, 0.8};  // wood
constexpr Roughness kSawn{10e-6, 200e-6, 0.8};   // stone
constexpr Roughness kFormed{100e-6, 1e-3, 0.8};  // concrete, by boards
constexpr Roughness kRubber{10e-6, 100e-6, 0.8};
constexpr Roughness kCork{50e-6, 300e-6, 0.8};

/// Rows: name, density (kg/m^3), Young's modulus (Pa), Poisson's ratio, restitution, Rayleigh
/// damping alpha (1/s) and beta (s), roughness, loss factor at 1 kHz and the exponent of its
/// frequency, both 0 unless given; docs/materials.md has the sources.
///
/// Restitution is a property of a pair, a speed and a surface, not of a material. Glasses have a
/// published value, glass on glass, 15/16 (Newton, Principia, scholium to the laws of motion), and
/// billiard balls one within a published range, 0.92 to 0.98 (Alciatore, The Illustrated Principles
/// of Pool and Billiards). All others are defaults that we chose within what such balls are
/// commonly seen to do; set your own.
std::array<Material, kRows> makeRows() {
  return {{
      // Chadwick, Zheng, James 2012, "Precomputed acceleration noise", as in the seed's table 1.
      {"steel", 8940.0, 123.4 * kGiga, 0.34, 0.90, 5.0, 3e-8, kDrawn},
      {"ceramic", 2700.0, 72.0 * kGiga, 0.19, 0.90, 0.0, 0.0, kFired, kCeramicLoss},
      {"glass", 2700.0, 62.0 * kGiga, 0.20, 15.0 / 16.0, 1.0, 1e-7, kFired},
      {"plastic", 1200.0, 2.4 * kGiga, 0.37, 0.80, 30.0, 1e-6, kMoulded},
      // Sugar maple at 12 % moisture, its grain's modulus and nu_LR in every direction: USDA Forest
      // Products Laboratory, Wood Handbook, FPL-GTR-190 (2010), tables 5-3a and 5-2; the specific
      // gravity of 0.63 is of dry mass, hence 630 * 1.12.
      {"wood", 706.0, 12.6 * kGiga, 0.424, 0.60, 60.0, 2e-6, kPlaned},
      // Strength class C30/37, uncracked: EN 1992-1-1:2004, table 3.1 and clause 3.1.3 (4);
      // density of plain concrete: CEB-FIP Model Code 1990, clause 2.1.2.
      {"concrete", 2400.0, 33.0 * kGiga, 0.20, 0.70, 0.0, 0.0, kFormed, 1e-2},
      // Natural rubber of 60 IRHD: Lindley, Engineering Design with Natural Rubber (1974), table 3:
      // E 4.45 MPa, bulk modulus 1150 MPa; nu = 1/2 - E / (6 bulk modulus). Density is rounded.
      {"rubber", 1100.0, 4.45 * kMega, 0.4994, 0.80, 0.0, 0.0, kRubber, 0.1},
      // Alloy 6061-T6: ASM Handbook, volume 2 (1990).
      {"aluminium", 2700.0, 68.9 * kGiga, 0.33, 0.70, 0.0, 0.0, kDrawn, 1e-4},
      // From here on the sources are in docs/materials.md, row by row.
      // Metals.
      {"carbon_steel", 7850.0, 210.0 * kGiga, 0.30, 0.90, 5.0, 3e-8, kDrawn},
      {"stainless_steel", 7900.0, 200.0 * kGiga, 0.30, 0.90, 5.0, 3e-8, kDrawn},
      {"cast_iron", 7200.0, 110.0 * kGiga, 0.26, 0.70, 0.0, 0.0, kSandCast, 1e-2},
      {"brass", 8530.0, 101.0 * kGiga, 0.350, 0.70, 0.0, 0.0, kDrawn, 6e-4},
      {"bronze", 8800.0, 110.0 * kGiga, 0.34, 0.75, 0.0, 0.0, kDrawn, 6e-4},
      {"copper", 8960.0, 130.0 * kGiga, 0.343, 0.60, 0.0, 0.0, kDrawn, 2e-3},
      {"titanium", 4506.0, 120.0 * kGiga, 0.361, 0.80, 5.0, 3e-8, kDrawn},
      {"magnesium", 1740.0, 44.7 * kGiga, 0.291, 0.70, 0.0, 0.0, kDrawn, 1e-4},
      {"nickel", 8900.0, 199.5 * kGiga, 0.312, 0.75, 0.0, 0.0, kDrawn, 1e-3},
      {"zinc", 7140.0, 108.4 * kGiga, 0.249, 0.60, 0.0, 0.0, kDrawn, 3e-4},
      {"tin", 7290.0, 49.9 * kGiga, 0.357, 0.40, 0.0, 0.0, kDrawn, 2e-3},
      {"lead", 11340.0, 16.1 * kGiga, 0.44, 0.20, 0.0, 0.0, kDrawn, 2e-2},
      {"silver", 10500.0, 82.7 * kGiga, 0.367, 0.60, 0.0, 0.0, kDrawn, 4e-4},
      {"gold", 19300.0, 78.0 * kGiga, 0.44, 0.50, 0.0, 0.0, kDrawn, 3e-4},
      {"platinum", 21450.0, 168.0 * kGiga, 0.377, 0.60, 0.0, 0.0, kDrawn, 3e-4},
      {"tungsten", 19300.0, 411.0 * kGiga, 0.280, 0.80, 5.0, 3e-8, kDrawn},
      {"tungsten_carbide", 13800.0, 534.4 * kGiga, 0.22, 0.90, 5.0, 3e-8, kGround},
      // Ceramics, glasses and stones.
      {"alumina", 3970.0, 400.0 * kGiga, 0.22, 0.90, 0.0, 0.0, kGround, kCeramicLoss},
      {"soda_lime_glass", 2500.0, 70.0 * kGiga, 0.20, 15.0 / 16.0, 1.0, 1e-7, kFired},
      {"borosilicate_glass", 2230.0, 64.0 * kGiga, 0.20, 15.0 / 16.0, 1.0, 1e-7, kFired},
      {"fused_silica", 2201.0, 72.7 * kGiga, 0.16, 15.0 / 16.0, 1.0, 1e-7, kFired},
      {"granite", 2700.0, 49.6 * kGiga, 0.213, 0.80, 0.0, 0.0, kSawn, 5e-3},
      {"marble", 2700.0, 70.0 * kGiga, 0.25, 0.80, 0.0, 0.0, kSawn, 5e-3},
      {"ice", 917.0, 9.33 * kGiga, 0.325, 0.80, 0.0, 0.0, kSawn, 1e-2},
      // Plastics, as sheets and castings. Their moduli are of slow loading; in fast impacts they
      // are stiffer.
      {"acrylic", 1190.0, 2.7 * kGiga, 0.35, 0.80, 30.0, 1e-6, kMoulded},
      {"abs", 1050.0, 2.4 * kGiga, 0.35, 0.75, 30.0, 1e-6, kMoulded},
      {"nylon", 1140.0, 2.7 * kGiga, 0.41, 0.75, 30.0, 1e-6, kMoulded},
      {"polycarbonate", 1200.0, 2.4 * kGiga, 0.38, 0.80, 0.5, 4e-7, kMoulded},
      {"polystyrene", 1050.0, 2.78 * kGiga, 0.33, 0.80, 30.0, 1e-6, kMoulded},
      {"hdpe", 959.0, 1.08 * kGiga, 0.42, 0.65, 0.0, 0.0, kMoulded, 0.05},
      {"ptfe", 2170.0, 0.475 * kGiga, 0.46, 0.50, 0.0, 0.0, kMoulded, 0.02},
      {"billiard_ball", 1700.0, 5.84 * kGiga, 0.34, 0.95, 30.0, 1e-6, kPolished},
      // Grown materials. Woods at 12 % moisture, along the grain: E of bending and nu_LR in every
      // direction; density is the specific gravity of dry mass, times 1.12.
      {"sitka_spruce", 448.0, 10.8 * kGiga, 0.372, 0.50, 60.0, 2e-6, kPlaned},
      {"red_oak", 706.0, 12.5 * kGiga, 0.350, 0.60, 60.0, 2e-6, kPlaned},
      {"balsa", 179.0, 3.4 * kGiga, 0.229, 0.40, 60.0, 2e-6, kPlaned},
      {"cork", 170.0, 0.02 * kGiga, 0.05, 0.60, 0.0, 0.0, kCork, 0.13},
      {"bone", 1920.0, 17.0 * kGiga, 0.46, 0.60, 0.0, 0.0, kPlaned, 2e-2},
  }};
}

struct ThermalRow {
  std::string_view name;
  ThermalProperties thermal;
};

/// Rows: name, linear expansion (1/K), conductivity (W/(m K)), heat capacity (J/(kg K)), of all
/// that conduct heat well enough to lose something by it, and of glasses; docs/materials.md has the
/// sources.
constexpr std::array kThermalRows = {
    ThermalRow{"steel", {12e-6, 53.3, 440.0}},
    ThermalRow{"glass", {9e-6, 1.0, 720.0}},
    ThermalRow{"aluminium", {23.6e-6, 167.0, 896.0}},
    ThermalRow{"carbon_steel", {12e-6, 53.3, 440.0}},
    ThermalRow{"stainless_steel", {16e-6, 15.0, 500.0}},
    ThermalRow{"cast_iron", {11.7e-6, 48.5, 460.0}},
    ThermalRow{"brass", {19.9e-6, 120.0, 375.0}},
    ThermalRow{"bronze", {18.2e-6, 62.0, 380.0}},
    ThermalRow{"copper", {16.5e-6, 401.0, 385.0}},
    ThermalRow{"titanium", {8.6e-6, 21.9, 523.0}},
    ThermalRow{"magnesium", {24.8e-6, 156.0, 1023.0}},
    ThermalRow{"nickel", {13.4e-6, 90.9, 444.0}},
    ThermalRow{"zinc", {30.2e-6, 116.0, 388.0}},
    ThermalRow{"tin", {22.0e-6, 66.8, 228.0}},
    ThermalRow{"lead", {28.9e-6, 35.3, 129.0}},
    ThermalRow{"silver", {18.9e-6, 429.0, 235.0}},
    ThermalRow{"gold", {14.2e-6, 317.0, 129.0}},
    ThermalRow{"platinum", {8.8e-6, 71.6, 133.0}},
    ThermalRow{"tungsten", {4.5e-6, 174.0, 132.0}},
    ThermalRow{"alumina", {7.4e-6, 39.0, 775.0}},
    ThermalRow{"soda_lime_glass", {9e-6, 1.0, 720.0}},
    ThermalRow{"borosilicate_glass", {3.3e-6, 1.4, 850.0}},
    ThermalRow{"fused_silica", {0.52e-6, 1.3, 770.0}},
};

const std::array<Material, kRows>& rows() {
  static const auto& table = audio::immortal([] {
    std::array<Material, kRows> made = makeRows();
    for (const ThermalRow& row : kThermalRows)
      std::ranges::find(made, row.name, &Material::name)->thermal = row.thermal;
    return made;
  });
  return table;
}

}  // namespace

std::span<const Material> materialTable() {
  return std::span<const Material>(rows()).first(kCommon);
}

std::span<const Material> builtInMaterials() {
  return rows();
}

const Material* findMaterial(std::string_view name) {
  const auto row = std::ranges::find(rows(), name, &Material::name);
  return row == rows().end() ? nullptr : &*row;
}

double dampingRate(const Material& material, double frequency) {
  constexpr double kReference = 1000.0;  // Hz
  const double omega = 2.0 * std::numbers::pi * frequency;
  const double rayleigh = material.dampingAlpha + material.dampingBeta * omega * omega;
  if (material.lossFactor == 0.0) return 0.5 * rayleigh;
  const double lossFactor =
      material.lossFactor * std::pow(frequency / kReference, material.lossExponent);
  return 0.5 * (rayleigh + lossFactor * omega);
}

double thermoelasticLossFactor(const Material& material, double thickness, double frequency) {
  constexpr double kTemperature = 293.15;  // K
  constexpr double kSlow = 0.03;           // below, the closed form loses its digits
  constexpr double kFast = 40.0;           // above, it has reached its limit
  const auto& [expansion, conductivity, heatCapacity] = material.thermal;
  if (expansion == 0.0 || conductivity == 0.0 || heatCapacity == 0.0) return 0.0;
  const double perVolume = material.density * heatCapacity;  // J/(m^3 K)
  const double most = material.youngsModulus * expansion * expansion * kTemperature / perVolume;
  // The thickness over the depth to which heat flows in a period, divided by 2 pi.
  const double deep =
      thickness * std::sqrt(std::numbers::pi * frequency * perVolume / conductivity);
  if (deep < kSlow) return most * deep * deep / 5.0;
  const double edges =
      deep > kFast ? 1.0 : (std::sinh(deep) + std::sin(deep)) / (std::cosh(deep) + std::cos(deep));
  return most * 6.0 / (deep * deep) * (1.0 - edges / deep);
}

double contactModulus(const Material& material, const Material& other) {
  const double compliance =
      (1.0 - material.poissonsRatio * material.poissonsRatio) / material.youngsModulus +
      (1.0 - other.poissonsRatio * other.poissonsRatio) / other.youngsModulus;
  return 1.0 / compliance;
}

}  // namespace carom
