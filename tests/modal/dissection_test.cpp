#include "modal/analysis/dissection.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <numeric>
#include <set>
#include <vector>

#include <gtest/gtest.h>

namespace carom::test {

using namespace modal;

namespace {

using Places = std::vector<std::array<int, 3>>;

Places placesIn(int size, const std::function<bool(int, int, int)>& isThere) {
  Places places;
  for (int z = 0; z < size; ++z)
    for (int y = 0; y < size; ++y)
      for (int x = 0; x < size; ++x)
        if (isThere(x, y, z)) places.push_back({x, y, z});
  return places;
}

NodeNeighbours neighboursOf(const Places& places) {
  NodeNeighbours neighbours(places.size());
  for (std::uint32_t node = 0; node < places.size(); ++node)
    for (std::uint32_t other = 0; other < places.size(); ++other) {
      int apart = 0;
      for (std::size_t axis = 0; axis < 3; ++axis)
        apart = std::max(apart, std::abs(places[node][axis] - places[other][axis]));
      if (apart <= 1) neighbours[node].push_back(other);
    }
  return neighbours;
}

// Eliminates nodes one after the other, each of which makes neighbours of all of its own. The sum
// of the squares of how many those are is the number of operations of a factorisation.
double operations(const NodeNeighbours& neighbours, const std::vector<std::uint32_t>& order) {
  std::vector<std::set<std::uint32_t>> left(neighbours.size());
  for (std::uint32_t node = 0; node < neighbours.size(); ++node)
    for (const std::uint32_t other : neighbours[node])
      if (other != node) left[node].insert(other);
  double sum = 0.0;
  for (const std::uint32_t node : order) {
    const auto count = static_cast<double>(left[node].size());
    sum += count * count;
    for (const std::uint32_t other : left[node]) {
      left[other].insert(left[node].begin(), left[node].end());
      left[other].erase(other);
      left[other].erase(node);
    }
  }
  return sum;
}

std::vector<std::uint32_t> asTheyCome(std::size_t count) {
  std::vector<std::uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0U);
  return order;
}

// A factorisation of a cube of n^3 nodes takes of the order of n^7 operations plane by plane, and
// n^6 by dissection; one of the faces of a cube takes n^4 and n^3.
TEST(DissectionOrder, TakesFewerOperationsThanPlaneByPlane) {
  const Places cube = placesIn(11, [](int, int, int) { return true; });
  const Places faces = placesIn(13, [](int x, int y, int z) {
    return std::min({x, y, z}) == 0 || std::max({x, y, z}) == 12;
  });
  for (const auto& [places, most] : {std::pair(cube, 0.6), std::pair(faces, 0.35)}) {
    const NodeNeighbours neighbours = neighboursOf(places);
    const std::vector<std::uint32_t> order = dissectionOrder(neighbours, places);
    std::vector<std::uint32_t> sorted = order;
    std::sort(sorted.begin(), sorted.end());
    EXPECT_EQ(sorted, asTheyCome(places.size()));
    EXPECT_LT(operations(neighbours, order),
              most * operations(neighbours, asTheyCome(places.size())));
  }
}

TEST(DissectionOrder, HasEachNodeOnceWhereNothingCanBeCut) {
  EXPECT_TRUE(dissectionOrder({}, {}).empty());
  const Places one = {{4, 5, 6}};
  EXPECT_EQ(dissectionOrder(neighboursOf(one), one), asTheyCome(1));
  const Places heap(40, {1, 2, 3});  // all at one place, as parts on both sides of a slot are
  EXPECT_EQ(dissectionOrder(neighboursOf(heap), heap), asTheyCome(40));
  Places apart = placesIn(4, [](int, int, int) { return true; });
  for (std::size_t node = 0; node < 64; ++node)
    apart.push_back({apart[node][0] + 100, apart[node][1], apart[node][2]});
  std::vector<std::uint32_t> order = dissectionOrder(neighboursOf(apart), apart);
  std::sort(order.begin(), order.end());
  EXPECT_EQ(order, asTheyCome(128));
}

}  // namespace
}  // namespace carom::test
