#include "audio/model/hertz.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace carom {

using namespace audio;

namespace {

double sphereMass(const Material& material, double radius) {
  return 4.0 / 3.0 * std::numbers::pi * radius * radius * radius * material.density;
}

ImpulseEvent equalSpheres(const Material& material, double radius, double speed) {
  ImpulseEvent event;
  event.approachSpeed = speed;
  event.effectiveMass = 0.5 * sphereMass(material, radius);
  event.radius = radius;
  event.otherRadius = radius;
  return event;
}

struct TableRow {
  std::string material;
  std::vector<double> microseconds;  // for radii of 1 mm, 5 mm, 1 cm, 5 cm at 1 m/s
};

TEST(HertzDuration, MatchesTheTableOfEqualSpheres) {
  const std::vector<double> radii = {0.001, 0.005, 0.01, 0.05};
  const std::vector<TableRow> table = {{"steel", {7.76, 38.8, 77.6, 388.0}},
                                       {"ceramic", {6.17, 30.8, 61.7, 308.0}},
                                       {"glass", {6.54, 32.7, 65.4, 327.0}},
                                       {"plastic", {16.6, 83.2, 166.0, 832.0}}};
  for (const TableRow& row : table) {
    const Material& material = *findMaterial(row.material);
    for (std::size_t column = 0; column < radii.size(); ++column) {
      const double tau =
          hertzDuration(equalSpheres(material, radii[column], 1.0), material, material);
      const double lastDigit = std::pow(10.0, std::floor(std::log10(row.microseconds[column])) - 2);
      EXPECT_NEAR(tau * 1e6, row.microseconds[column], 0.51 * lastDigit) << row.material;
    }
  }
}

struct ContactState {
  double depth = 0.0;  // m
  double speed = 0.0;  // m/s, positive while the bodies approach
};

ContactState advance(const ContactState& from, const ContactState& slope, double step) {
  return {from.depth + step * slope.depth, from.speed + step * slope.speed};
}

/// Time until the bodies part again, from the contact equation m d'' = -K d^(3/2), by RK4.
double integratedDuration(double mass, double stiffness, double speed, double step) {
  const auto slope = [&](const ContactState& s) {
    return ContactState{s.speed, -stiffness * std::pow(std::max(s.depth, 0.0), 1.5) / mass};
  };
  ContactState state{0.0, speed};
  for (double time = 0.0;; time += step) {
    const ContactState k1 = slope(state);
    const ContactState k2 = slope(advance(state, k1, 0.5 * step));
    const ContactState k3 = slope(advance(state, k2, 0.5 * step));
    const ContactState k4 = slope(advance(state, k3, step));
    const double depth =
        state.depth + step / 6.0 * (k1.depth + 2.0 * k2.depth + 2.0 * k3.depth + k4.depth);
    if (depth < 0.0) return time + step * state.depth / (state.depth - depth);
    state.speed += step / 6.0 * (k1.speed + 2.0 * k2.speed + 2.0 * k3.speed + k4.speed);
    state.depth = depth;
  }
}

TEST(HertzDuration, IntegratedContactEquationGives2Point8683) {
  const double mass = 0.03;
  const double radius = 0.01;
  const double modulus = 7e10;
  const double speed = 0.7;
  const double stiffness = 4.0 / 3.0 * std::sqrt(radius) * modulus;
  const double duration = integratedDuration(mass, stiffness, speed, 1e-9);
  const double scale = std::pow(mass * mass / (radius * modulus * modulus * speed), 0.2);
  EXPECT_NEAR(duration / scale, 2.8683, 5e-5);
}

TEST(HertzDuration, ExceedsTheContactEquationByItsRoundingOnly) {
  const Material& steel = *findMaterial("steel");
  const Material& glass = *findMaterial("glass");
  ImpulseEvent event = equalSpheres(steel, 0.01, 2.0);
  event.otherRadius = 0.03;
  const double radius = 0.01 * 0.03 / 0.04;
  const double modulus = 1.0 / ((1.0 - 0.34 * 0.34) / 123.4e9 + (1.0 - 0.2 * 0.2) / 62e9);
  const double stiffness = 4.0 / 3.0 * std::sqrt(radius) * modulus;
  const double exact = integratedDuration(event.effectiveMass, stiffness, 2.0, 1e-9);
  EXPECT_NEAR(hertzDuration(event, steel, glass) / exact, 2.87 / 2.8683, 5e-5);
}

TEST(HertzDuration, FallsWithTheFifthRootOfSpeed) {
  const Material& steel = *findMaterial("steel");
  const double slow = hertzDuration(equalSpheres(steel, 0.01, 0.1), steel, steel);
  const double fast = hertzDuration(equalSpheres(steel, 0.01, 3.2), steel, steel);
  EXPECT_NEAR(slow / fast, 2.0, 1e-12);  // at 32 times the speed
}

TEST(HertzDuration, FlatSideCountsAsAnInfiniteRadius) {
  const Material& steel = *findMaterial("steel");
  ImpulseEvent flat = equalSpheres(steel, 0.01, 1.0);
  flat.otherRadius = std::numeric_limits<double>::infinity();
  ImpulseEvent nearlyFlat = flat;
  nearlyFlat.otherRadius = 1e9;
  EXPECT_NEAR(hertzDuration(flat, steel, steel) / hertzDuration(nearlyFlat, steel, steel), 1.0,
              1e-11);
}

}  // namespace
}  // namespace carom
