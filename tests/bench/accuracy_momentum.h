#pragma once

namespace carom::bench {

struct MomentumCase {
  double step = 0.0;  ///< s
  bool friction = false;
  int scenes = 0;
  int only = -1;  ///< this scene alone, told to the error stream body by body
};

struct MomentumResult {
  int collisions = 0;
  /// Greatest over all bodies: of what they changed in momentum beyond what was reported as
  /// applied and what gravity gave, relative to the sum of the impulses' magnitudes.
  double imbalance = 0.0;
  int worst = -1;  ///< the scene of it
  bool unsupported = false;
};

/// Random bodies thrown at each other over a plane. Each scene is followed from its start to a
/// random time; then all bodies are taken apart, so that whatever was applied gets reported.
MomentumResult runMomentum(const MomentumCase& which);

}  // namespace carom::bench
