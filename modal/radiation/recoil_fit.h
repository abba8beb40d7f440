#pragma once

#include "carom/audio/rigid_radiator.h"
#include "modal/radiation/recoil_samples.h"

namespace carom::modal {

/// Fits the sums of decaying oscillations of RigidRecoil to samples.
///
/// All shapes have the same poles, -kDamping + i (n + 1/2) kSpacing and some wide ones above: what
/// follows an impulse within the time 2 pi / kSpacing is a Fourier series over that time, times a
/// decay, so these poles hold it whatever the shape is; they are stable, and nothing is searched.
/// The residues solve linear least squares with equal relative weight at each frequency, h(0) = 0
/// and, towards 0, the dipole of `low`.
///
/// Above the highest sample only the mean power over directions is fitted: it goes on as in the
/// last octave until it reaches that of plane waves from the surface (RecoilSamples::beam). Phases
/// and directions are free there, and taken from the fit before, some times over. [any thread]
RigidRecoil fitRecoil(const RecoilSamples& samples, const RigidRadiator& low);

}  // namespace carom::modal
