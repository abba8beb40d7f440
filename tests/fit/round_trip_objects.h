#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "carom/audio/material.h"
#include "carom/audio/surface_mesh.h"
#include "tests/audio/meshes.h"

namespace carom::test {

/// Numbers that are the same with every compiler. [one thread]
class ObjectDice {
 public:
  explicit ObjectDice(std::uint32_t seed) : random_(seed) {}
  double between(double low, double high) {
    return low + (high - low) * (static_cast<double>(random_()) / 4294967296.0);
  }
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(between(1e-12, 1.0)));
    return radius * std::cos(2.0 * std::numbers::pi * between(0.0, 1.0));
  }
  std::size_t below(std::size_t count) { return random_() % count; }

 private:
  std::mt19937 random_;
};

/// Turns a closed profile of (radius, height) about z. Points on the axis become one vertex; the
/// profile runs so that the body is on its left. Closed in itself if it does not begin on the axis.
inline SurfaceMesh latheMesh(const std::vector<std::pair<double, double>>& profile,
                             std::uint32_t segments) {
  SurfaceMesh mesh;
  std::vector<std::vector<std::uint32_t>> rings;
  for (const auto& [radius, height] : profile) {
    std::vector<std::uint32_t> ring;
    for (std::uint32_t at = 0; at < segments; ++at) {
      if (radius > 0.0 || at == 0) {
        const double angle = 2.0 * std::numbers::pi * at / segments;
        mesh.vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle), height);
      }
      ring.push_back(static_cast<std::uint32_t>(mesh.vertices.size() - 1));
    }
    rings.push_back(std::move(ring));
  }
  const bool isLoop = profile.front().first > 0.0;
  const std::size_t bands = isLoop ? rings.size() : rings.size() - 1;
  for (std::size_t band = 0; band < bands; ++band) {
    const auto& low = rings[band];
    const auto& high = rings[(band + 1) % rings.size()];
    for (std::uint32_t at = 0; at < segments; ++at) {
      const std::uint32_t next = (at + 1) % segments;
      if (low[at] != low[next]) mesh.triangles.push_back({low[at], low[next], high[next]});
      if (high[at] != high[next]) mesh.triangles.push_back({low[at], high[next], high[at]});
    }
  }
  return signedVolume(mesh) < 0.0 ? turnedInsideOut(std::move(mesh)) : mesh;
}

/// An object of the round trip.
struct RoundTripObject {
  std::string kind;
  SurfaceMesh mesh;
  Material material;  ///< the truth; its damping is `law`
  double alpha = 0.0, beta = 0.0, lossFactor = 0.0, lossExponent = 0.0;

  double materialDecay(double frequency) const {
    const double w = 2.0 * std::numbers::pi * frequency;
    return 0.5 * (alpha + beta * w * w) +
           0.5 * lossFactor * std::pow(frequency / 1000.0, lossExponent) * w;
  }
};

inline SurfaceMesh cupMesh(ObjectDice& dice) {
  const double radius = dice.between(0.03, 0.06);
  const double height = radius * dice.between(1.2, 2.4);
  const double wall = radius * dice.between(0.06, 0.12);
  const double bottom = wall * dice.between(1.0, 1.6);
  const double flare = dice.between(0.75, 1.1);
  std::vector<std::pair<double, double>> profile = {{0.0, 0.0}};
  constexpr int kSteps = 10;
  for (int step = 0; step <= kSteps; ++step)
    profile.emplace_back(radius * (flare + (1.0 - flare) * step / kSteps), height * step / kSteps);
  for (int step = kSteps; step >= 0; --step)
    profile.emplace_back(radius * (flare + (1.0 - flare) * step / kSteps) - wall,
                         bottom + (height - bottom) * step / kSteps);
  profile.emplace_back(0.0, bottom);
  return latheMesh(profile, 48);
}

inline SurfaceMesh bowlMesh(ObjectDice& dice) {
  const double radius = dice.between(0.04, 0.08);
  const double depth = radius * dice.between(0.5, 1.0);
  const double wall = radius * dice.between(0.05, 0.1);
  std::vector<std::pair<double, double>> profile;
  constexpr int kSteps = 16;
  for (int step = 0; step <= kSteps; ++step) {
    const double angle = 0.5 * std::numbers::pi * step / kSteps;
    profile.emplace_back(step == 0 ? 0.0 : radius * std::sin(angle), -depth * std::cos(angle));
  }
  for (int step = kSteps; step >= 0; --step) {
    const double angle = 0.5 * std::numbers::pi * step / kSteps;
    profile.emplace_back(step == 0 ? 0.0 : (radius - wall) * std::sin(angle),
                         -(depth - wall) * std::cos(angle));
  }
  return latheMesh(profile, 48);
}

inline SurfaceMesh ringMesh(ObjectDice& dice, double leastHeight, double mostHeight) {
  const double radius = dice.between(0.025, 0.07);
  const double wall = radius * dice.between(0.1, 0.25);
  const double height = radius * dice.between(leastHeight, mostHeight);
  std::vector<std::pair<double, double>> profile;
  constexpr int kSteps = 8;
  for (int step = 0; step <= kSteps; ++step)
    profile.emplace_back(radius, height * step / kSteps);
  for (int step = kSteps; step >= 0; --step)
    profile.emplace_back(radius - wall, height * step / kSteps);
  return latheMesh(profile, 48);
}

inline std::pair<std::string, SurfaceMesh> objectMesh(std::size_t kind, ObjectDice& dice) {
  switch (kind) {
    case 0: {
      const double length = dice.between(0.05, 0.15);
      return {"box",
              boxMesh(0.5 * length * Vec3(1.0, dice.between(0.4, 0.95), dice.between(0.2, 0.4)))};
    }
    case 1: {
      const double length = dice.between(0.1, 0.3);
      return {"bar", boxMesh(0.5 * length *
                             Vec3(1.0, dice.between(0.06, 0.14), dice.between(0.03, 0.055)))};
    }
    case 2: {
      const double length = dice.between(0.1, 0.25);
      return {"plate",
              boxMesh(0.5 * length * Vec3(1.0, dice.between(0.5, 0.95), dice.between(0.02, 0.05)))};
    }
    case 3:
      return {"cup", cupMesh(dice)};
    case 4:
      return {"bowl", bowlMesh(dice)};
    case 5:
      return {"ring", ringMesh(dice, 0.1, 0.4)};
    case 6:
      return {"tube", ringMesh(dice, 2.0, 5.0)};
    default: {
      const double length = dice.between(0.04, 0.12);
      return {
          "ellipsoid",
          ellipsoidMesh(length * Vec3(1.0, dice.between(0.5, 0.95), dice.between(0.3, 0.5)), 4)};
    }
  }
}

/// The object of that number: its kind in turn, all else at random.
inline RoundTripObject roundTripObject(std::size_t index) {
  ObjectDice dice(static_cast<std::uint32_t>(1000 + index));
  static const std::array<const char*, 7> kMaterials = {
      "carbon_steel", "soda_lime_glass", "ceramic", "aluminium", "brass", "acrylic", "red_oak"};
  RoundTripObject object;
  auto [kind, mesh] = objectMesh(index % 8, dice);
  object.kind = kind;
  object.mesh = std::move(mesh);
  object.material = *findMaterial(kMaterials[dice.below(kMaterials.size())]);
  object.material.youngsModulus *= dice.between(0.8, 1.25);
  object.material.density *= dice.between(0.95, 1.05);
  object.material.poissonsRatio =
      std::min(0.4, object.material.poissonsRatio + dice.between(-0.03, 0.03));
  const bool isSoft = object.material.youngsModulus < 20e9;
  if (index % 2 == 0) {
    object.alpha = isSoft ? dice.between(5.0, 30.0) : dice.between(0.5, 6.0);
    object.beta = isSoft ? dice.between(3e-7, 1.5e-6) : dice.between(3e-9, 5e-8);
  } else {
    object.lossFactor = isSoft ? dice.between(5e-3, 2e-2) : dice.between(2e-4, 2e-3);
    object.lossExponent = dice.between(-0.3, 0.4);
  }
  object.material.dampingAlpha = 0.0;
  object.material.dampingBeta = 0.0;
  return object;
}

}  // namespace carom::test
