#pragma once

namespace carom {

/// The fluid that carries the sound: dry air at 20 degrees C and 101.325 kPa unless set.
struct Medium {
  double density = 1.20;        ///< kg/m^3, rho0
  double speedOfSound = 343.0;  ///< m/s, c; the seed document computes with 330

  bool operator==(const Medium&) const = default;
};

}  // namespace carom
