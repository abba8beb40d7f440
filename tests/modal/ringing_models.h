#pragma once

#include <cmath>
#include <complex>
#include <cstdint>
#include <functional>
#include <numbers>

#include "audio/radiation/multipole.h"
#include "carom/audio/modal_model.h"
#include "tests/audio/meshes.h"

namespace carom::test {

/// Shape of a mode at a place, in 1/sqrt(kg).
using Shape = std::function<Vec3(const Vec3&)>;

/// A usable model of a surface, still without modes.
inline ModalModel modelOf(const SurfaceMesh& surface) {
  ModalModel model;
  model.material = *findMaterial("steel");
  model.mass = 1.0;
  model.inertia.setIdentity();
  model.surface = surface;
  return model;
}

inline void addMode(ModalModel& model, double frequency, const Shape& shape) {
  model.modes.push_back({frequency, 1.0, {}});
  for (const Vec3& vertex : model.surface.vertices)
    for (const double component : shape(vertex))
      model.shapes.push_back(static_cast<float>(component));
}

/// Frequency in Hz of the wave number in the model's medium.
inline double frequencyOf(const ModalModel& model, double waveNumber) {
  return waveNumber * model.medium.speedOfSound / (2.0 * std::numbers::pi);
}

/// Transfer function times distance, far away.
inline std::complex<double> farField(const ModeRadiation& radiation, const Vec3& direction) {
  const double farAway = 1e9;
  return farAway * multipoleTransfer(radiation, audio::DirectionHarmonics(direction), 1.0, farAway);
}

/// A bar along x with a regular section: `along` slices with `around` corners on the ellipse with
/// the semi-axes half.y and half.z (if `around` is 4, on the one through the corners of the box);
/// closed by fans.
inline SurfaceMesh barMesh(const Vec3& half, int along, int around) {
  SurfaceMesh mesh;
  const auto at = [&](int slice, int corner) {
    return static_cast<std::uint32_t>(slice * around + corner % around);
  };
  const double grow = around == 4 ? std::numbers::sqrt2 : 1.0;
  for (int slice = 0; slice <= along; ++slice) {
    for (int corner = 0; corner < around; ++corner) {
      const double turn = 2.0 * std::numbers::pi * (corner + 0.5) / around;
      mesh.vertices.emplace_back(half.x() * (2.0 * slice / along - 1.0),
                                 half.y() * grow * std::cos(turn),
                                 half.z() * grow * std::sin(turn));
      if (slice == along) continue;
      mesh.triangles.push_back({at(slice, corner), at(slice, corner + 1), at(slice + 1, corner)});
      mesh.triangles.push_back(
          {at(slice, corner + 1), at(slice + 1, corner + 1), at(slice + 1, corner)});
    }
  }
  for (const int slice : {0, along}) {
    const auto middle = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.emplace_back(slice == 0 ? -half.x() : half.x(), 0.0, 0.0);
    for (int corner = 0; corner < around; ++corner) {
      const int next = corner + 1;
      mesh.triangles.push_back(
          {middle, at(slice, slice == 0 ? next : corner), at(slice, slice == 0 ? corner : next)});
    }
  }
  return signedVolume(mesh) > 0.0 ? mesh : turnedInsideOut(mesh);
}

}  // namespace carom::test
