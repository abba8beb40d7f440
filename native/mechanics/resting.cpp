#include "native/mechanics/resting.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <optional>

#include "native/math/vector_math.h"

namespace carom::native {
namespace {

constexpr double kPullRounding = 1e-12;    ///< relative to the pull
constexpr double kParallelNormals = 1e-9;  ///< normals that differ by less count as equal

/// An orthonormal basis of the space that the chosen normals span; at most three vectors.
struct Basis {
  std::array<Vec3, 3> along;
  std::size_t count = 0;

  void add(const Vec3& normal) {
    if (count == along.size()) return;
    Vec3 rest = normal;
    for (std::size_t i = 0; i < count; ++i)
      rest -= dotInOrder(rest, along[i]) * along[i];
    const double length = lengthOf(rest);
    if (length > kParallelNormals) along[count++] = rest / length;
  }
  Vec3 without(Vec3 vector) const {
    if (count == along.size()) return Vec3::Zero();
    for (std::size_t i = 0; i < count; ++i)
      vector -= dotInOrder(vector, along[i]) * along[i];
    return vector;
  }
};

/// A choice of up to three surfaces: more are never needed to carry (Caratheodory).
struct Choice {
  std::array<std::size_t, 3> at{};
  std::size_t count = 0;

  bool has(std::size_t surface) const {
    return std::find(at.begin(), at.begin() + static_cast<std::ptrdiff_t>(count), surface) !=
           at.begin() + static_cast<std::ptrdiff_t>(count);
  }
};

/// True if pushes along the chosen normals, whose span contains `force`, add up to it.
bool pushes(const Vec3& force, std::span<const Vec3> normals, const Choice& choice,
            double tolerance) {
  if (choice.count == 0) return true;
  const Vec3& first = normals[choice.at[0]];
  if (choice.count == 1) return dotInOrder(force, first) >= -tolerance;
  const Vec3& second = normals[choice.at[1]];
  if (choice.count == 2) {
    const double between = dotInOrder(first, second);
    const double one = dotInOrder(force, first);
    const double two = dotInOrder(force, second);
    return one - between * two >= -tolerance && two - between * one >= -tolerance;
  }
  const Vec3& third = normals[choice.at[2]];
  const double volume = dotInOrder(first, cross(second, third));
  const double side = std::copysign(1.0, volume);
  return std::abs(volume) > kParallelNormals &&
         side * dotInOrder(force, cross(second, third)) >= -tolerance &&
         side * dotInOrder(force, cross(third, first)) >= -tolerance &&
         side * dotInOrder(force, cross(first, second)) >= -tolerance;
}

/// The result if the chosen surfaces are the ones that push; nothing if they are not.
std::optional<Carried> carriedByThese(const Vec3& pull, std::span<const Vec3> normals,
                                      const Choice& choice) {
  const double tolerance = kPullRounding * lengthOf(pull);
  Basis basis;
  for (std::size_t k = 0; k < choice.count; ++k)
    basis.add(normals[choice.at[k]]);
  Carried carried{basis.without(pull)};
  if (!pushes(carried.acceleration - pull, normals, choice, tolerance)) return std::nullopt;
  for (std::size_t k = 0; k < normals.size(); ++k) {
    const double away = dotInOrder(carried.acceleration, normals[k]);
    const bool chosen = choice.has(k);
    if (!chosen && away < -tolerance) return std::nullopt;
    if (chosen || away <= tolerance) carried.touching |= 1U << k;
  }
  return carried;
}

}  // namespace

Carried carriedBy(const Vec3& pull, std::span<const Vec3> normals) {
  assert(normals.size() <= kMostSurfaces);
  const std::size_t count = normals.size();
  if (const auto none = carriedByThese(pull, normals, {})) return *none;
  for (std::size_t i = 0; i < count; ++i) {
    if (const auto one = carriedByThese(pull, normals, {{i}, 1})) return *one;
  }
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = i + 1; j < count; ++j) {
      if (const auto two = carriedByThese(pull, normals, {{i, j}, 2})) return *two;
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = i + 1; j < count; ++j) {
      for (std::size_t k = j + 1; k < count; ++k) {
        if (const auto three = carriedByThese(pull, normals, {{i, j, k}, 3})) return *three;
      }
    }
  }
  return {Vec3::Zero(), (1U << count) - 1};  // rounding has left no other answer: the sphere stays
}

Vec3 heldVelocity(const Vec3& velocity, std::span<const Vec3> normals,
                  std::span<const double> speeds) {
  // Gram and Schmidt, on the normals and the speeds along them at once.
  std::array<Vec3, 3> along;
  std::array<double, 3> wanted{};
  std::size_t count = 0;
  Vec3 held = velocity;
  for (std::size_t k = 0; k < normals.size() && count < along.size(); ++k) {
    Vec3 rest = normals[k];
    double speed = speeds[k];
    for (std::size_t i = 0; i < count; ++i) {
      const double part = dotInOrder(rest, along[i]);
      rest -= part * along[i];
      speed -= part * wanted[i];
    }
    const double length = lengthOf(rest);
    if (length <= kParallelNormals) continue;
    along[count] = rest / length;
    wanted[count] = speed / length;
    ++count;
  }
  if (count == along.size()) held = Vec3::Zero();  // exactly at rest if the surfaces are
  for (std::size_t i = 0; i < count; ++i)
    held += (wanted[i] - dotInOrder(held, along[i])) * along[i];
  return held;
}

}  // namespace carom::native
