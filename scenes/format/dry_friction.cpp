#include "scenes/format/dry_friction.h"

#include <algorithm>
#include <array>

namespace carom::scenes {
namespace {

struct Row {
  std::string_view material;
  double friction;
};

// docs/materials.md repeats these, with a source for each; a test compares them.
constexpr auto kRows = std::to_array<Row>({
    {"steel", 0.57},
    {"ceramic", 0.4},
    {"glass", 0.4},
    {"plastic", 0.4},
    {"wood", 0.4},
    {"concrete", 0.6},
    {"rubber", 1.0},
    {"aluminium", 0.34},
    {"carbon_steel", 0.57},
    {"stainless_steel", 0.57},
    {"cast_iron", 0.15},
    {"brass", 0.34},
    {"bronze", 0.32},
    {"copper", 1.0},
    {"titanium", 0.3},
    {"magnesium", 0.6},
    {"nickel", 0.53},
    {"zinc", 0.6},
    {"tin", 0.7},
    {"lead", 1.5},
    {"silver", 1.4},
    {"gold", 1.4},
    {"platinum", 1.2},
    {"tungsten", 0.57},
    {"tungsten_carbide", 0.2},
    {"alumina", 0.4},
    {"soda_lime_glass", 0.4},
    {"borosilicate_glass", 0.4},
    {"fused_silica", 0.4},
    {"granite", 0.6},
    {"marble", 0.6},
    {"ice", 0.05},
    {"acrylic", 0.8},
    {"abs", 0.4},
    {"nylon", 0.2},
    {"polycarbonate", 0.4},
    {"polystyrene", 0.5},
    {"hdpe", 0.2},
    {"ptfe", 0.04},
    {"billiard_ball", 0.06},
    {"sitka_spruce", 0.4},
    {"red_oak", 0.4},
    {"balsa", 0.4},
    {"cork", 0.4},
    {"bone", 0.4},
});

}  // namespace

double dryFriction(std::string_view material) {
  const auto row = std::ranges::find(kRows, material, &Row::material);
  return row == kRows.end() ? 0.0 : row->friction;
}

}  // namespace carom::scenes
