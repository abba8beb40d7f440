#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <functional>
#include <vector>

#include "carom/audio/result.h"
#include "carom/audio/rigid_radiator.h"
#include "carom/audio/surface_mesh.h"
#include "carom/modal/analysis_settings.h"

namespace carom::modal {

/// The steady sound of a body's six rigid motions at some frequencies, in units of RigidRecoil.
struct RecoilSamples {
  using Complex = std::complex<double>;
  struct Motion {
    std::vector<std::size_t> harmonics;  ///< those that may differ from 0
    /// h by [frequency][harmonic], in order of `harmonics`.
    std::vector<std::vector<Complex>> values;
  };

  double radius = 0.0;              ///< m
  std::vector<double> frequencies;  ///< k radius, ascending
  std::array<Motion, 6> motions;
  /// Integral over the surface of v_i.n v_j.n dS over radius^2, v the unit motions: far above all
  /// frequencies the mean of |h|^2 over directions is a^T beam a / (4 pi (k radius)^2).
  Mat6 beam = Mat6::Zero();
  std::size_t panels = 0;  ///< of the finest solution
};

/// The resolution of a solution.
struct RecoilSettings {
  double highest = 10.0;  ///< k radius up to which the exterior problem is solved
  double spacing = 0.36;  ///< of the frequencies, above the lowest ones
  /// The most panels at the highest frequency: of the part between the mirror planes that a body
  /// has, so that three of them make a solution of up to eight times as many.
  std::size_t panels = 450;
  /// Frequencies that are solved at a time, each in a thread of its own: 0 for as many as the
  /// machine has processors. Results do not depend on it.
  std::size_t threads = 0;
};

/// Solves the exterior problem of each rigid motion at each frequency (ExteriorSolver). `surface`
/// is in m, about the centre of mass. Errors: those of cleanSurface, a volume that is
/// lost where the mesh is simplified, and kCancelled. [any thread]
Result<RecoilSamples> sampleRecoil(const SurfaceMesh& surface, const RecoilSettings& settings,
                                   const Progress& progress = {});

}  // namespace carom::modal
