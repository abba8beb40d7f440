#include "modal/analysis/grid_axis.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace carom::test {

using namespace modal;

namespace {

const std::vector<AxisLine> kUneven = {{.at = 0.0},  {.at = 0.1}, {.at = 0.13, .kinks = true},
                                       {.at = 0.17}, {.at = 0.3}, {.at = 0.31, .kinks = true},
                                       {.at = 0.5}};

// Sum of coefficients times the functions at a place, of which a cell knows those that are not
// zero; derivatives are by the place in m.
template <class Coefficient>
double fieldIn(const AxisCell& cell, double place, int derivative, const Coefficient& coefficient) {
  const Eigen::Vector4d values = cell.at((place - cell.begin) / cell.size, derivative);
  double sum = 0.0;
  for (int function = 0; function < 4; ++function)
    sum += coefficient(cell.first + function) * values[function];
  return sum / std::pow(cell.size, derivative);
}

TEST(GridAxis, EqualCellsHaveTheUniformCubicSplines) {
  const GridAxis axis = GridAxis::equal(2.0, 5);
  ASSERT_EQ(axis.cells(), 5);
  EXPECT_EQ(axis.functions(), 8);
  for (int cell = 0; cell < 5; ++cell) {
    EXPECT_EQ(axis[cell].kind, 0);
    EXPECT_EQ(axis[cell].first, cell);
    // Piegl and Tiller, The NURBS Book: the uniform cubic, from the far end of its support.
    const Eigen::Vector4d begin = axis[cell].at(0.0);
    const Eigen::Vector4d middle = axis[cell].at(0.5);
    EXPECT_LT((begin - Eigen::Vector4d(1.0, 4.0, 1.0, 0.0) / 6.0).norm(), 1e-14);
    EXPECT_LT((middle - Eigen::Vector4d(1.0, 23.0, 23.0, 1.0) / 48.0).norm(), 1e-14);
  }
}

TEST(GridAxis, FunctionsSumToOneAndTheirMiddlesMakeThePlace) {
  for (const GridAxis& axis : {GridAxis(kUneven), GridAxis::equal(0.5, 1)}) {
    EXPECT_DOUBLE_EQ(axis.length(), 0.5);
    for (int step = 0; step <= 500; ++step) {
      const double place = 1e-3 * step;
      const AxisCell& cell = axis[axis.cellAt(place)];
      EXPECT_LE(cell.begin, place);
      EXPECT_LE(place, cell.begin + cell.size + 1e-12);
      EXPECT_NEAR(fieldIn(cell, place, 0, [](int) { return 1.0; }), 1.0, 1e-13);
      EXPECT_NEAR(fieldIn(cell, place, 0, [&](int function) { return axis.middle(function); }),
                  place, 1e-13);
      EXPECT_NEAR(fieldIn(cell, place, 1, [&](int function) { return axis.middle(function); }), 1.0,
                  1e-12);
    }
  }
}

// Whatever the coefficients, a field has two continuous derivatives, and where it may have a kink
// it is continuous, and has one for nearly any coefficients.
TEST(GridAxis, FieldsAreSmoothButAtLinesThatMayHaveKinks) {
  const GridAxis axis(kUneven);
  ASSERT_EQ(axis.cells(), 6);
  EXPECT_EQ(axis.functions(), 6 + 3 + 2 * 2);
  const auto some = [](int function) { return std::sin(2.0 + 5.0 * function * function); };
  for (int cell = 1; cell < axis.cells(); ++cell) {
    const double place = axis[cell].begin;
    const auto jump = [&](int derivative) {
      return std::abs(fieldIn(axis[cell], place, derivative, some) -
                      fieldIn(axis[cell - 1], place, derivative, some));
    };
    EXPECT_LT(jump(0), 1e-12) << cell;
    if (kUneven[static_cast<std::size_t>(cell)].kinks) {
      EXPECT_GT(jump(1), 0.1) << cell;
    } else {
      EXPECT_LT(jump(1), 1e-10) << cell;
      EXPECT_LT(jump(2), 1e-8) << cell;
    }
  }
}

TEST(GridAxis, PlacesBeyondTheEndsAreOfTheCellsThere) {
  const GridAxis axis(kUneven);
  EXPECT_EQ(axis.cellAt(-1.0), 0);
  EXPECT_EQ(axis.cellAt(0.0999), 0);
  EXPECT_EQ(axis.cellAt(0.1001), 1);
  EXPECT_EQ(axis.cellAt(7.0), 5);
}

}  // namespace
}  // namespace carom::test
