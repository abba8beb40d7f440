#pragma once

#include <complex>
#include <cstddef>
#include <memory>
#include <vector>

#include "carom/audio/modal_model.h"
#include "carom/audio/rigid_radiator.h"
#include "tests/support/free_bar.h"
#include "tests/support/hertz_contact.h"

namespace carom::test {

/// Resolution at which the library computes a bar.
struct BarDetail {
  std::size_t degreesOfFreedom = 20000;
  Eigen::Index modes = 13;
  int sides = 16;  ///< of the section, which has the circle's area
  int slices = 44;
};

/// A bar that is hit by a ball at x = `hit` across its axis, computed by the library from mesh to
/// pascals.
struct StruckBar {
  FreeBar bar;
  std::shared_ptr<const ModalModel> model;
  RigidRadiator shape;
  BallStrike strike;
};
StruckBar struckBar(const FreeBar& bar, const BallStrike& ball, double hit,
                    const BarDetail& detail);

/// Sound in Pa at 48 kHz: the ring from the first touch on, without the sound's delay to the
/// listener, and the whole click.
std::vector<double> ringOf(const StruckBar& bar, const Vec3& listener, std::size_t frames);
std::vector<double> clickOf(const StruckBar& bar, const Vec3& listener, std::size_t frames);

/// One decaying oscillation of a ring. partialsOf() fits one for each distinct frequency of the
/// model to the samples from 3 ms on, by least squares; modes closer than 3 Hz are one.
struct Partial {
  double frequency = 0.0;  ///< Hz
  double amplitude = 0.0;  ///< Pa, at first touch
};
std::vector<Partial> partialsOf(const StruckBar& bar, const std::vector<double>& samples);

/// The partial of one bending mode in closed form.
Partial partialOf(const StruckBar& bar, const BendingMode& mode, const Vec3& listener,
                  double endLoss);

/// Energy between two frequencies in Pa^2 s, of the spectrum's positive half only: of samples, and
/// of the rigid bar's click in closed form.
double bandEnergy(const std::vector<double>& samples, double low, double high);
double bandEnergy(const StruckBar& bar, const Vec3& listener, double endLoss, double low,
                  double high);

}  // namespace carom::test
