#include "tests/support/vibration_references.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <numbers>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "tests/support/constants.h"
#include "tests/support/special_functions.h"

namespace carom::test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

double shearModulus(const Material& material) {
  return material.youngsModulus / (2.0 * (1.0 + material.poissonsRatio));
}

// Derivatives of Legendre polynomials: column n has that of the n-th in terms of the others, all
// scaled to integral p^2 = 1 over -1 to 1. So the integral of p_m' p_n' is (B^T B)(m, n).
MatrixXd derivatives(int degree) {
  MatrixXd matrix = MatrixXd::Zero(degree + 1, degree + 1);
  for (int of = 1; of <= degree; ++of)
    for (int in = of - 1; in >= 0; in -= 2)
      matrix(in, of) = std::sqrt((2.0 * of + 1.0) * (2.0 * in + 1.0));
  return matrix;
}

// The operator on products of two polynomials; the degree of the second factor runs fastest.
MatrixXd kronecker(const MatrixXd& first, const MatrixXd& second) {
  MatrixXd product(first.rows() * second.rows(), first.cols() * second.cols());
  for (Index row = 0; row < first.rows(); ++row)
    for (Index column = 0; column < first.cols(); ++column)
      product.block(row * second.rows(), column * second.cols(), second.rows(), second.cols()) =
          first(row, column) * second;
  return product;
}

// Frequencies in Hz of K x = omega^2 M x, without the lowest `rigid` ones.
std::vector<double> frequenciesOf(const MatrixXd& stiffness, const MatrixXd& mass, Index rigid,
                                  std::size_t count) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> solver(stiffness, mass,
                                                                  Eigen::EigenvaluesOnly);
  assert(rigid + static_cast<Index>(count) <= solver.eigenvalues().size());
  std::vector<double> frequencies;
  for (std::size_t mode = 0; mode < count; ++mode)
    frequencies.push_back(std::sqrt(solver.eigenvalues()[rigid + static_cast<Index>(mode)]) /
                          (2.0 * kPi));
  return frequencies;
}

// A polynomial degree for more than twice `count` modes, the lower half of which is accurate.
int degreeFor(std::size_t count) {
  return static_cast<int>(2 * count) + 16;
}

double besselOf(unsigned order, double at) {
  return test::sphericalBessel(order, at);
}

// This is 0 at the twisting modes of a sphere, k = omega radius / (speed of shear waves).
double twistingEquation(unsigned order, double k) {
  return (order - 1.0) * besselOf(order, k) - k * besselOf(order + 1, k);
}

// This is 0 at the modes with a radial motion. `slowness`: speed of shear over pressure waves.
double spheroidalEquation(unsigned order, double k, double slowness) {
  const double h = slowness * k;
  const double n = order;
  const double radial =
      (n * n - n - 0.5 * k * k) * besselOf(order, h) + 2.0 * h * besselOf(order + 1, h);
  if (order == 0) return radial;
  const double shear = n * (n + 1.0) * twistingEquation(order, k);
  const double alongPressure = (n - 1.0) * besselOf(order, h) - h * besselOf(order + 1, h);
  const double alongShear =
      (n * n - 1.0 - 0.5 * k * k) * besselOf(order, k) + k * besselOf(order + 1, k);
  return radial * alongShear - shear * alongPressure;
}

// Arguments between 1 and `highest` where the function changes sign: no mode of the sphere is below
// 1.
template <class Function>
std::vector<double> roots(const Function& function, double highest) {
  constexpr double kStep = 0.01;  // no two roots of one order are that close
  std::vector<double> found;
  for (double start = 1.0; start < highest; start += kStep) {
    double low = start;
    double high = start + kStep;
    if (std::signbit(function(low)) == std::signbit(function(high))) continue;
    while (high - low > 1e-12) {
      const double middle = 0.5 * (low + high);
      (std::signbit(function(middle)) == std::signbit(function(low)) ? low : high) = middle;
    }
    found.push_back(low);
  }
  return found;
}

// ---- The box

/// Integrals along one axis of products of two polynomials, each with or without a derivative.
class AxisIntegrals {
 public:
  AxisIntegrals(int degree, double edge) {
    const MatrixXd slope = 2.0 / edge * derivatives(degree);
    integrals_ = {{{MatrixXd::Identity(degree + 1, degree + 1), slope},
                   {slope.transpose(), slope.transpose() * slope}}};
  }
  double of(bool firstDerived, int first, bool secondDerived, int second) const {
    return integrals_[firstDerived ? 1 : 0][secondDerived ? 1 : 0](first, second);
  }

 private:
  std::array<std::array<MatrixXd, 2>, 2> integrals_;
};

/// A displacement along one axis, given by a product of polynomials.
struct BoxTerm {
  std::size_t along = 0;
  std::array<int, 3> degrees{};
};

// If the reflection of a coordinate reverses the motion, the component along this axis is even in
// the coordinate and the other components are odd.
std::vector<BoxTerm> termsOf(const std::array<bool, 3>& odd, const std::array<int, 3>& degrees) {
  std::vector<BoxTerm> terms;
  for (std::size_t along = 0; along < 3; ++along) {
    const auto first = [&](std::size_t axis) { return odd[axis] != (axis == along) ? 1 : 0; };
    for (int x = first(0); x <= degrees[0]; x += 2)
      for (int y = first(1); y <= degrees[1]; y += 2)
        for (int z = first(2); z <= degrees[2]; z += 2)
          terms.push_back({along, {x, y, z}});
  }
  return terms;
}

class BoxStiffness {
 public:
  BoxStiffness(const Material& material, const Vec3& edges, const std::array<int, 3>& degrees)
      : shear_(shearModulus(material)),
        bulk_(2.0 * shear_ * material.poissonsRatio / (1.0 - 2.0 * material.poissonsRatio)),
        axes_{AxisIntegrals(degrees[0], edges.x()), AxisIntegrals(degrees[1], edges.y()),
              AxisIntegrals(degrees[2], edges.z())} {}

  // The integral of lambda div u div v + 2 mu e(u) : e(v).
  double of(const BoxTerm& u, const BoxTerm& v) const {
    double energy =
        bulk_ * product(u, u.along, v, v.along) + shear_ * product(u, v.along, v, u.along);
    if (u.along != v.along) return energy;
    for (std::size_t axis = 0; axis < 3; ++axis)
      energy += shear_ * product(u, axis, v, axis);
    return energy;
  }

 private:
  // The integral of the derivative of u along `ofU` times that of v along `ofV`.
  double product(const BoxTerm& u, std::size_t ofU, const BoxTerm& v, std::size_t ofV) const {
    double integral = 1.0;
    for (std::size_t axis = 0; axis < 3; ++axis)
      integral *= axes_[axis].of(axis == ofU, u.degrees[axis], axis == ofV, v.degrees[axis]);
    return integral;
  }

  double shear_;
  double bulk_;  // Lame's lambda
  std::array<AxisIntegrals, 3> axes_;
};

VectorXd eigenvaluesOf(const BoxStiffness& stiffness, const std::vector<BoxTerm>& terms) {
  const auto size = static_cast<Index>(terms.size());
  MatrixXd matrix(size, size);
  for (Index row = 0; row < size; ++row)
    for (Index column = 0; column < size; ++column)
      matrix(row, column) = stiffness.of(terms[static_cast<std::size_t>(row)],
                                         terms[static_cast<std::size_t>(column)]);
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(matrix, Eigen::EigenvaluesOnly).eigenvalues();
}

}  // namespace

double shearCoefficient(double depth, double width, double poissonsRatio) {
  const double a = 0.5 * depth;
  const double b = 0.5 * width;
  const double nu = poissonsRatio;
  double sum =
      4.0 / 45.0 * std::pow(a, 3) * b * (-12.0 * a * a - 15.0 * nu * a * a + 5.0 * nu * b * b);
  for (int term = 1; term < 100; ++term) {
    const double n = term * kPi;
    sum += 16.0 * nu * nu * std::pow(b, 5) * (n * a - b * std::tanh(n * a / b)) /
           (std::pow(n, 5) * (1.0 + nu));
  }
  return -2.0 * (1.0 + nu) /
         (9.0 / (4.0 * std::pow(a, 5) * b) * sum + nu * (1.0 - b * b / (a * a)));
}

std::vector<double> bendingFrequencies(const Material& material, double length, double depth,
                                       double width, std::size_t count) {
  const MatrixXd slope = 2.0 / length * derivatives(degreeFor(count));
  const Index size = slope.rows();
  const MatrixXd one = MatrixXd::Identity(size, size);
  const double area = depth * width;
  const double moment = area * depth * depth / 12.0;
  const double shear =
      shearCoefficient(depth, width, material.poissonsRatio) * shearModulus(material) * area;
  MatrixXd stiffness(2 * size, 2 * size);  // deflection, then rotation
  stiffness << shear * slope.transpose() * slope, -shear * slope.transpose(), -shear * slope,
      shear * one + material.youngsModulus * moment * slope.transpose() * slope;
  MatrixXd mass = MatrixXd::Zero(2 * size, 2 * size);
  mass.topLeftCorner(size, size) = material.density * area * one;
  mass.bottomRightCorner(size, size) = material.density * moment * one;
  return frequenciesOf(stiffness, mass, 2, count);
}

// Minimises the integral of (w_y - z)^2 + (w_z + y)^2 over the warping w; the minimum is the
// constant.
RectangleTorsion rectangleTorsion(double width, double thickness) {
  constexpr int kDegree = 20;
  const MatrixXd slope = derivatives(kDegree);
  const MatrixXd one = MatrixXd::Identity(kDegree + 1, kDegree + 1);
  const MatrixXd alongWidth = 2.0 / width * kronecker(slope, one);
  const MatrixXd alongThickness = 2.0 / thickness * kronecker(one, slope);
  const double area = width * thickness;
  // The coordinates y and z in scaled polynomials, over a square of sides 2, where the integral of
  // x^2 is 4/3.
  VectorXd y = VectorXd::Zero(alongWidth.rows());
  VectorXd z = y;
  y[kDegree + 1] = width / std::sqrt(3.0);
  z[1] = thickness / std::sqrt(3.0);
  MatrixXd matrix =
      alongWidth.transpose() * alongWidth + alongThickness.transpose() * alongThickness;
  matrix(0, 0) = 1.0;  // fixes the free constant of the warping at 0
  const VectorXd warp =
      matrix.ldlt().solve(alongWidth.transpose() * z - alongThickness.transpose() * y);
  const double energy =
      (alongWidth * warp - z).squaredNorm() + (alongThickness * warp + y).squaredNorm();
  return {0.25 * area * energy, 0.25 * area * warp.squaredNorm()};
}

std::vector<double> twistingFrequencies(const Material& material, double length, double width,
                                        double thickness, std::size_t count) {
  const MatrixXd slope = 2.0 / length * derivatives(degreeFor(count));
  const MatrixXd slopes = slope.transpose() * slope;
  const MatrixXd curve = slope * slope;
  const RectangleTorsion torsion = rectangleTorsion(width, thickness);
  const double polar = width * thickness * (width * width + thickness * thickness) / 12.0;
  const MatrixXd stiffness = shearModulus(material) * torsion.constant * slopes +
                             material.youngsModulus * torsion.warping * curve.transpose() * curve;
  const MatrixXd mass = material.density * (polar * MatrixXd::Identity(slope.rows(), slope.cols()) +
                                            torsion.warping * slopes);
  return frequenciesOf(stiffness, mass, 1, count);
}

std::vector<double> stretchingFrequencies(const Material& material, double length, double width,
                                          double thickness, std::size_t count) {
  const double speed = std::sqrt(material.youngsModulus / material.density);
  const double gyration = std::sqrt((width * width + thickness * thickness) / 12.0);
  std::vector<double> frequencies;
  for (std::size_t half = 1; half <= count; ++half) {
    const double wave = static_cast<double>(half) * kPi / length;
    const double lateral = material.poissonsRatio * gyration * wave;
    frequencies.push_back(wave * speed / std::sqrt(1.0 + lateral * lateral) / (2.0 * kPi));
  }
  return frequencies;
}

std::vector<double> squarePlateFrequencies(const Material& material, double side, double thickness,
                                           std::size_t count) {
  constexpr int kDegree = 17;
  const double nu = material.poissonsRatio;
  const MatrixXd slope = 2.0 / side * derivatives(kDegree);
  const MatrixXd one = MatrixXd::Identity(kDegree + 1, kDegree + 1);
  const MatrixXd xx = kronecker(slope * slope, one);
  const MatrixXd yy = kronecker(one, slope * slope);
  const MatrixXd xy = kronecker(slope, slope);
  const double rigidity =
      material.youngsModulus * std::pow(thickness, 3) / (12.0 * (1.0 - nu * nu));
  const MatrixXd stiffness = rigidity * (xx.transpose() * xx + yy.transpose() * yy +
                                         nu * (xx.transpose() * yy + yy.transpose() * xx) +
                                         2.0 * (1.0 - nu) * xy.transpose() * xy);
  const MatrixXd mass =
      material.density * thickness * MatrixXd::Identity(stiffness.rows(), stiffness.cols());
  return frequenciesOf(stiffness, mass, 3, count);
}

std::vector<double> sphereFrequencies(const Material& material, double radius, std::size_t count) {
  const double nu = material.poissonsRatio;
  const double slowness = std::sqrt((1.0 - 2.0 * nu) / (2.0 - 2.0 * nu));
  const double shearSpeed = std::sqrt(shearModulus(material) / material.density);
  // The lowest mode of an order n is above n / 2 or so, hence all modes below kHighest are found.
  constexpr unsigned kOrders = 16;
  constexpr double kHighest = 0.5 * kOrders;
  std::vector<double> frequencies;
  for (unsigned order = 0; order < kOrders; ++order) {
    const auto add = [&](const std::vector<double>& found) {
      for (const double k : found)
        frequencies.insert(frequencies.end(), 2 * order + 1, k * shearSpeed / (2.0 * kPi * radius));
    };
    add(roots([&](double k) { return spheroidalEquation(order, k, slowness); }, kHighest));
    if (order > 0) add(roots([&](double k) { return twistingEquation(order, k); }, kHighest));
  }
  std::sort(frequencies.begin(), frequencies.end());
  assert(count <= frequencies.size());
  frequencies.resize(count);
  return frequencies;
}

std::vector<BoxMode> boxModes(const Material& material, const Vec3& edges,
                              const std::array<int, 3>& degrees, std::size_t count) {
  const BoxStiffness stiffness(material, edges, degrees);
  std::vector<BoxMode> modes;
  for (unsigned kind = 0; kind < 8; ++kind) {
    const std::array<bool, 3> odd = {(kind & 1U) != 0, (kind & 2U) != 0, (kind & 4U) != 0};
    const VectorXd found = eigenvaluesOf(stiffness, termsOf(odd, degrees));
    // A translation is reversed by one reflection, a rotation by two: each of these kinds has one
    // rigid mode.
    const Index rigid = kind == 0 || kind == 7 ? 0 : 1;
    for (const double eigenvalue : found.tail(found.size() - rigid))
      modes.push_back({std::sqrt(eigenvalue / material.density) / (2.0 * kPi), odd});
  }
  std::sort(modes.begin(), modes.end(),
            [](const BoxMode& a, const BoxMode& b) { return a.frequency < b.frequency; });
  assert(count <= modes.size());
  modes.resize(count);
  return modes;
}

}  // namespace carom::test
