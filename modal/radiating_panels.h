#pragma once

#include <Eigen/SparseCore>

#include "carom/audio/modal_model.h"
#include "carom/audio/result.h"

namespace carom::modal {

/// The surface of a model as panels that sound is computed from, and how they move.
struct RadiatingPanels {
  SurfaceMesh surface;  ///< m, model frame, closed, normals outwards; neighbours need not fit
  /// What they were made of: the model's surface without what lies inside, or both sides of a
  /// sheet. Its vertices are the model's, then those of the other side in the same order.
  SurfaceMesh solid;
  /// A row for each panel: times the shape of a mode (three numbers for each vertex of the model's
  /// surface) the mean of its component along the normal, 1/sqrt(kg).
  Eigen::SparseMatrix<double, Eigen::RowMajor> normalShape;
  double thickness = 0.0;  ///< m, of the sheet that the surface was taken for; 0: a solid
};

/// At most `most` panels, at least half as many. A coarser surface is split (halvedSurface), so the
/// panels are its shape exactly. A finer one is clustered (clusteredSurface), and each of its
/// triangles gives what it moves to the panel that is nearest and faces the same way, so that no
/// part of the flow is lost.
///
/// An open surface is taken for a sheet in the middle of its thickness, mass / (density x area),
/// and gets two sides and a rim.
///
/// Errors: those of cleanSurface (indices, numbers, neighbours that face opposite ways, no volume),
/// and clustering that changes the volume by 30 %. [any thread]
Result<RadiatingPanels> radiatingPanels(const ModalModel& model, std::size_t most);

/// How much of a shape's motion along the normal the panels' means still have: the mean square over
/// the panels by that over the surface, 1 at best; 1 for a shape without any. [any thread]
double resolvedShare(const RadiatingPanels& panels, const Eigen::VectorXd& shape);

}  // namespace carom::modal
