#pragma once

#include <optional>
#include <vector>

#include <Eigen/Dense>

#include "audio/radiation/source_panel.h"

namespace carom::audio {

/// The panel equations of a closed surface for several motions: matrix * potential = right, a row
/// per panel. [any thread]
struct PanelEquations {
  using Matrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  Matrix matrix;
  Eigen::MatrixXd right;  ///< a column per motion
};

/// Returns the equations with panels that are farther than a few of their edges by their area and
/// second moments, to 1e-4 of an influence; the solid angles in each row still sum to the whole.
/// `motions` are v.n, a row per panel.
PanelEquations momentEquations(const std::vector<SourcePanel>& panels,
                               const Eigen::MatrixXd& motions);

/// A solution on panels four times as large, of which panel k is split into 4 k to 4 k + 3.
struct CoarseSolution {
  Eigen::PartialPivLU<Eigen::MatrixXd> matrix;
  Eigen::MatrixXd potential;
};

/// Solves by iteration, which the coarse equations guide if there are any. Returns nothing where
/// that does not settle within a few rounds, as on bodies far thinner than a panel.
std::optional<Eigen::MatrixXd> solvedFrom(const std::optional<CoarseSolution>& coarse,
                                          const PanelEquations& equations);

}  // namespace carom::audio
