#pragma once

#include <Eigen/SparseCore>

#include "carom/audio/modal_model.h"
#include "carom/audio/result.h"

namespace carom::modal {

/// Largest share of its volume that a surface may lose or gain where it is clustered.
inline constexpr double kMostVolumeLost = 0.3;

/// The surface of a model as the panels from which its sound is computed, and their motion.
struct RadiatingPanels {
  SurfaceMesh surface;  ///< m, model frame, closed, normals outwards; neighbours need not fit
  /// The surface from which the panels were made: the model's without inner parts, or both sides of
  /// a sheet. Its vertices are the model's, then those of the other side in the same order.
  SurfaceMesh solid;
  /// One row for each panel. Its product with the shape of a mode (three numbers for each vertex of
  /// the model's surface) is the mean over the panel of the component along the normal, 1/sqrt(kg).
  Eigen::SparseMatrix<double, Eigen::RowMajor> normalShape;
  double thickness = 0.0;  ///< m, of the sheet for which the surface was taken; 0: a solid
};

/// Makes at most `most` panels, at least half as many. A coarser surface is split (halvedSurface),
/// so the panels are its shape exactly. A finer one is clustered (clusteredSurface), and each of
/// its triangles adds the flow that it drives to the nearest panel that faces the same way, so that
/// no part of the flow is lost.
///
/// An open surface is taken for a sheet in the middle of its thickness, mass / (density x area),
/// and gets two sides and a rim.
///
/// Errors: those of cleanSurface (indices, numbers, neighbours that face opposite ways, no volume),
/// and clustering that changes the volume by 30 %. [any thread]
Result<RadiatingPanels> radiatingPanels(const ModalModel& model, std::size_t most);

/// Share of a shape's motion along the normal that the panels' means resolve: the mean square over
/// the panels divided by that over the surface, 1 at best; 1 for a shape without such motion. [any
/// thread]
double resolvedShare(const RadiatingPanels& panels, const Eigen::VectorXd& shape);

}  // namespace carom::modal
