#include "audio/material.h"

#include <algorithm>
#include <array>

namespace carom {
namespace {

constexpr double kGiga = 1e9;
constexpr double kMega = 1e6;

/// Rows: name, density (kg/m^3), Young's modulus (Pa), Poisson's ratio, restitution.
///
/// Restitution is a property of a pair, a speed and a surface, not of a material. One row has a
/// published value: glass on glass, 15/16 (Newton, Principia, scholium to the laws of motion). All
/// others are defaults that we chose within what such balls are commonly seen to do; set your own.
const std::array<Material, 8>& rows() {
  static const std::array<Material, 8> table = {{
      // Chadwick, Zheng, James 2012, "Precomputed acceleration noise", as in the seed's table 1.
      {"steel", 8940.0, 123.4 * kGiga, 0.34, 0.90},
      {"ceramic", 2700.0, 72.0 * kGiga, 0.19, 0.90},
      {"glass", 2700.0, 62.0 * kGiga, 0.20, 15.0 / 16.0},
      {"plastic", 1200.0, 2.4 * kGiga, 0.37, 0.80},
      // Sugar maple at 12 % moisture, its grain's modulus and nu_LR in every direction: USDA Forest
      // Products Laboratory, Wood Handbook, FPL-GTR-190 (2010), tables 5-3a and 5-2; the specific
      // gravity of 0.63 is of dry mass, hence 630 * 1.12.
      {"wood", 706.0, 12.6 * kGiga, 0.424, 0.60},
      // Strength class C30/37, uncracked: EN 1992-1-1:2004, table 3.1 and clause 3.1.3 (4);
      // density of plain concrete: CEB-FIP Model Code 1990, clause 2.1.2.
      {"concrete", 2400.0, 33.0 * kGiga, 0.20, 0.70},
      // Natural rubber of 60 IRHD: Lindley, Engineering Design with Natural Rubber (1974), table 3:
      // E 4.45 MPa, bulk modulus 1150 MPa; nu = 1/2 - E / (6 bulk modulus). Density is rounded.
      {"rubber", 1100.0, 4.45 * kMega, 0.4994, 0.80},
      // Alloy 6061-T6: ASM Handbook, volume 2 (1990).
      {"aluminium", 2700.0, 68.9 * kGiga, 0.33, 0.70},
  }};
  return table;
}

}  // namespace

std::span<const Material> materialTable() {
  return rows();
}

const Material* findMaterial(std::string_view name) {
  const auto row = std::ranges::find(rows(), name, &Material::name);
  return row == rows().end() ? nullptr : &*row;
}

double contactModulus(const Material& material, const Material& other) {
  const double compliance =
      (1.0 - material.poissonsRatio * material.poissonsRatio) / material.youngsModulus +
      (1.0 - other.poissonsRatio * other.poissonsRatio) / other.youngsModulus;
  return 1.0 / compliance;
}

}  // namespace carom
