#pragma once

namespace carom::bench {

struct MomentumCase {
  double step = 0.0;  ///< s
  bool friction = false;
  int scenes = 0;
  int only = -1;  ///< run only this scene and print each body to the error stream; negative: all
};

struct MomentumResult {
  int collisions = 0;
  /// Greatest over all bodies: change of momentum that neither the impulses reported as applied nor
  /// gravity account for, relative to the sum of the impulses' magnitudes.
  double imbalance = 0.0;
  int worst = -1;  ///< number of the scene with the greatest imbalance
  bool unsupported = false;
};

/// Throws random bodies at each other over a plane. Each scene is followed from its start to a
/// random time; then all bodies are taken apart, so that all applied impulses get reported.
MomentumResult runMomentum(const MomentumCase& which);

}  // namespace carom::bench
