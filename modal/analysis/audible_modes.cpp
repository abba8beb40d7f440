#include "modal/analysis/audible_modes.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

namespace carom::modal {

namespace {

/// Least share of the whole response that counts as more than rounding.
constexpr double kLeastResidual = 1e-9;

}  // namespace

Eigen::VectorXd outwardLoad(const SurfaceMesh& surface) {
  Eigen::VectorXd load = Eigen::VectorXd::Zero(3 * std::ssize(surface.vertices));
  for (const auto& [first, second, third] : surface.triangles) {
    const Vec3& corner = surface.vertices[first];
    const Vec3 share =
        (surface.vertices[second] - corner).cross(surface.vertices[third] - corner) / 6.0;
    for (const std::uint32_t vertex : {first, second, third})
      load.segment<3>(3 * static_cast<Eigen::Index>(vertex)) += share;
  }
  return load;
}

void keepResidual(ModalModel& model, const EigenModes& found, const StaticResponse& response,
                  double rigidBelow) {
  assert(found.shapes.rows() == response.displacement.size());
  const Eigen::VectorXd load = outwardLoad(model.surface);
  const double highest = std::pow(2.0 * std::numbers::pi * kHighestMode, 2);
  Eigen::VectorXd left = response.displacement;
  double massMoment = response.massMoment;
  for (Eigen::Index mode = 0; mode < found.lambda.size(); ++mode) {
    const bool isRigid = found.lambda[mode] < rigidBelow;
    if (found.lambda[mode] > highest || (isRigid && !response.hasRigidModes)) continue;
    const double above = found.lambda[mode] - response.shift;
    const double volume = found.shapes.col(mode).dot(load);
    const double pull = response.pulls.size() > 0 ? response.pulls[mode] : volume;
    // An elastic mode is heard to displace what its shape at the vertices does; a rigid one
    // displaces nothing, and only its own rounding takes it out.
    left -= (isRigid ? pull : volume) / above * found.shapes.col(mode);
    massMoment -= std::pow(pull / above, 2);
  }
  const double volume = load.dot(left);  // m^3/Pa
  if (!(volume > kLeastResidual * std::abs(load.dot(response.displacement)) && massMoment > 0.0))
    return;
  model.residualFrequency = std::sqrt(volume / massMoment) / (2.0 * std::numbers::pi);
  model.residualVolumes.reserve(static_cast<std::size_t>(left.size()));
  for (const double component : left)
    model.residualVolumes.push_back(static_cast<float>(component));
}

void keepAudibleModes(ModalModel& model, const EigenModes& found, double rigidBelow) {
  assert(found.shapes.cols() == found.lambda.size());
  assert(found.shapes.rows() == 3 * std::ssize(model.surface.vertices));
  const auto frequencyOf = [&found](Eigen::Index index) {  // rad/s
    const double excess = found.excess.size() > 0 ? found.excess[index] : 0.0;
    return std::sqrt(std::max(found.lambda[index], 0.0)) * (1.0 - excess);
  };
  std::vector<Eigen::Index> ascending(static_cast<std::size_t>(found.lambda.size()));
  std::iota(ascending.begin(), ascending.end(), Eigen::Index{0});
  std::ranges::stable_sort(ascending, {}, frequencyOf);
  for (const Eigen::Index index : ascending) {
    if (found.lambda[index] < rigidBelow) {
      ++model.leftOut.rigid;
      continue;
    }
    const double omega = frequencyOf(index);
    Mode mode;
    mode.frequency = omega / (2.0 * std::numbers::pi);
    if (found.heatLosses.size() > 0) mode.heatDecayRate = 0.5 * found.heatLosses[index] * omega;
    mode.decayRate = dampingRate(model.material, mode.frequency) + mode.heatDecayRate;
    if (found.errors.size() > 0) mode.frequencyError = found.errors[index];
    if (mode.frequency < kLowestMode) {
      ++model.leftOut.below;
    } else if (mode.frequency > kHighestMode) {
      ++model.leftOut.above;
    } else if (mode.decayRate >= omega) {
      ++model.leftOut.overdamped;
    } else {
      model.modes.push_back(std::move(mode));
      for (const double component : found.shapes.col(index))
        model.shapes.push_back(static_cast<float>(component));
    }
  }
}

}  // namespace carom::modal
