#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "audio/radiation/radiation_bank.h"
#include "carom/audio/rigid_radiator.h"

namespace carom::audio {

/// A RigidRecoil on samples: a filter for each of its pairs of poles, those far above the band left
/// out. What they add in the band goes to the poles that are kept, by least squares of equal
/// relative weight at each frequency. Immutable. [any thread]
class RecoilFilters {
 public:
  static constexpr std::size_t kMost = RigidRecoil::kMostPoles;

  /// `corner` is c / (radius * sample rate), 1 / samples. The bank, which makes the filters, must
  /// outlive this.
  RecoilFilters(std::shared_ptr<const RigidRecoil> recoil, double corner, RadiationBank& bank);

  double radius() const { return recoil_->radius; }  ///< m
  std::size_t size() const { return mixes_.size(); }
  const RadiationBank::Mix& filter(std::size_t index) const { return *mixes_[index]; }

  /// The residues of a motion by harmonic and filter, rho0 left out.
  struct Motion {
    std::vector<std::complex<double>> residues;
  };
  /// Computes the residues for a change of motion: m/s and rad/s, body frame.
  void combine(const Vec3& linear, const Vec3& angular, Motion& motion) const;

  /// The weights of the filters in one direction: the pressure over rho0 and 1 / distance.
  struct Weights {
    std::array<double, kMost> far{};   ///< of RadiationFilter's far part
    std::array<double, kMost> near{};  ///< of its near part
  };
  /// Computes the weights towards a point (m, body frame, from the origin): the near field of its
  /// dipoles is that of the distance, the other multipoles are as far away.
  void weigh(const Motion& motion, const Vec3& to, Weights& weights) const;

  /// Upper bound of the peak of a response to a force of integral 1, per rho0 and 1 / distance:
  /// the force's own peak and that of its slope in 1/samples and 1/samples^2.
  double bound(const Weights& weights, double peakForce, double peakSlope) const;

 private:
  using Complex = std::complex<double>;

  void reduce(std::span<const Complex> poles, double corner);

  std::shared_ptr<const RigidRecoil> recoil_;
  double corner_;
  std::size_t harmonics_ = 0;  // number of them that occur
  int order_ = 0;
  std::vector<Complex> poles_;  // kept, 1 / samples
  std::vector<const RadiationBank::Mix*> mixes_;
  std::vector<Complex> residues_;  // of each term, 1 / samples, size() in a row
  Eigen::MatrixXcd responses_;     // of each pole, far and near part, by frequency of the bound
};

}  // namespace carom::audio
