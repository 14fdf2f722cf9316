// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "core/mesh/surface_mesh.h"
#include "core/optics/optical_setup.h"
#include "design/energy/two_face_objective.h"
#include "design/transport/two_plane_map.h"

namespace lensforge {

/// The spline whose slopes are nearest to those wanted at points: minimises their squared
/// differences plus a thousandth of the squared changes of slope from cell to cell, which continue
/// it where there are no points. Its mean height is 0.
/// @param points, slopes  a column per point; mm, and without unit.
/// @param cells  knot cells along x and y. @return coefficients, cells + 3 each way, rows along x.
Eigen::MatrixXd fit_spline_slopes(const Eigen::Matrix2Xd& points, const Eigen::Matrix2Xd& slopes,
                                  const Eigen::Vector2d& size, const Eigen::Vector2i& cells);

/// Where the faces of a lens begin: shapes, and the least distances from their limits.
struct FacePlan {
  GridShape net;           ///< Control points of the exit face.
  GridShape front;         ///< Samples of the front.
  double thickness = 0.0;  ///< mm
  double room = 0.0;       ///< mm; both faces' least distance from z = 0 and from the thickness.
};

/// Faces that send a bundle's light along its rays, by Snell's law as near as splines of these
/// shapes can.
/// @param setup  the first screen's.
LensFaces faces_along(const RayBundle& bundle, const OpticalSetup& setup, const FacePlan& plan);

}  // namespace lensforge
