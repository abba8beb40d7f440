#include "modal/analysis/dissection.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

namespace carom::modal {
namespace {

using Nodes = std::vector<std::uint32_t>;

constexpr std::size_t kLeast = 12;  // nodes that are divided
constexpr double kLeastSide = 0.1;  // of what is divided

class Dissection {
 public:
  Dissection(const NodeNeighbours& neighbours, const std::vector<std::array<int, 3>>& places)
      : neighbours_(neighbours), places_(places), part_(places.size(), 0) {}

  Nodes order() {
    Nodes nodes(places_.size());
    std::iota(nodes.begin(), nodes.end(), 0U);
    divide(nodes);
    return std::move(order_);
  }

 private:
  // A plane of the grid: what lies below it acts upon the rest through its layer, the nodes at it
  // or above that have neighbours below.
  struct Cut {
    std::size_t axis = 0;
    int at = 0;
    double cost = std::numeric_limits<double>::infinity();
  };

  // Returns the lowest place of a node's neighbours in its part.
  int lowestBeside(std::uint32_t node, std::size_t axis) const {
    int lowest = places_[node][axis];
    for (const std::uint32_t other : neighbours_[node])
      if (part_[other] == part_[node]) lowest = std::min(lowest, places_[other][axis]);
    return lowest;
  }

  void findCut(const Nodes& nodes, std::size_t axis, Cut& best) const {
    const auto [low, high] =
        std::ranges::minmax(nodes, {}, [&](std::uint32_t node) { return places_[node][axis]; });
    const int first = places_[low][axis];
    const auto planes = static_cast<std::size_t>(places_[high][axis] - first) + 1;
    std::vector<int> here(planes + 1, 0);    // nodes at each plane
    std::vector<int> change(planes + 1, 0);  // of the layer's size from the plane before
    for (const std::uint32_t node : nodes) {
      const auto own = static_cast<std::size_t>(places_[node][axis] - first);
      ++here[own];
      ++change[static_cast<std::size_t>(lowestBeside(node, axis) - first) + 1];
      --change[own + 1];
    }
    const auto all = static_cast<double>(nodes.size());
    double below = 0.0;
    double layer = 0.0;
    for (std::size_t plane = 0; plane < planes; ++plane) {
      layer += change[plane];
      const double above = all - below - layer;
      if (std::min(below, above) >= kLeastSide * all) {
        const double cost = layer * (1.0 + std::abs(below - above) / (below + above));
        if (cost < best.cost) best = {axis, first + static_cast<int>(plane), cost};
      }
      below += here[plane];
    }
  }

  void divide(const Nodes& nodes) {
    Cut cut;
    if (nodes.size() >= kLeast)
      for (std::size_t axis = 0; axis < 3; ++axis)
        findCut(nodes, axis, cut);
    if (!std::isfinite(cut.cost)) {
      order_.insert(order_.end(), nodes.begin(), nodes.end());
      return;
    }
    Nodes below;
    Nodes layer;
    Nodes above;
    for (const std::uint32_t node : nodes) {
      const bool isBelow = places_[node][cut.axis] < cut.at;
      const bool isBeside = !isBelow && lowestBeside(node, cut.axis) < cut.at;
      (isBelow ? below : isBeside ? layer : above).push_back(node);
    }
    for (Nodes* const side : {&below, &layer, &above}) {
      ++parts_;
      for (const std::uint32_t node : *side)
        part_[node] = parts_;
    }
    divide(below);
    divide(above);
    order_.insert(order_.end(), layer.begin(), layer.end());
  }

  const NodeNeighbours& neighbours_;
  const std::vector<std::array<int, 3>>& places_;
  std::vector<int> part_;  // of each node, those of layers included
  int parts_ = 0;
  Nodes order_;
};

}  // namespace

std::vector<std::uint32_t> dissectionOrder(const NodeNeighbours& neighbours,
                                           const std::vector<std::array<int, 3>>& places) {
  return Dissection(neighbours, places).order();
}

}  // namespace carom::modal
