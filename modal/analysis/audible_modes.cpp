#include "modal/analysis/audible_modes.h"

#include <cassert>
#include <cmath>
#include <numbers>
#include <utility>

namespace carom::modal {

void keepAudibleModes(ModalModel& model, const EigenModes& found, double rigidBelow) {
  assert(found.shapes.cols() == found.lambda.size());
  assert(found.shapes.rows() == 3 * std::ssize(model.surface.vertices));
  for (Eigen::Index index = 0; index < found.lambda.size(); ++index) {
    const double lambda = found.lambda[index];
    if (lambda < rigidBelow) {
      ++model.leftOut.rigid;
      continue;
    }
    const double omega = std::sqrt(lambda);
    Mode mode;
    mode.frequency = omega / (2.0 * std::numbers::pi);
    mode.decayRate = 0.5 * (model.material.dampingAlpha + model.material.dampingBeta * lambda);
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
