// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/compute/executor.h"
#include "core/image/image.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/optical_setup.h"
#include "design/energy/objective_options.h"
#include "design/energy/two_face_objective.h"
#include "design/schedule/levels.h"
#include "design/transport/semi_discrete.h"

namespace lensforge {

/// Both faces of a lens for two pictures, and the record of their design.
struct TwoFaceResult {
  LensFaces faces;
  GridShape net;                  ///< Of the control points of faces.exit.
  std::uint64_t fingerprint = 0;  ///< design_fingerprint()
  std::vector<ConvergenceRow> convergence;
  bool done = false;  ///< False if the control stopped it; the faces are then the best so far.
};

/// Shapes both faces for the task's picture and `second`, from the faces that transport finds
/// (two_plane_map()), or coarse to fine from plane faces where the barriers refuse those.
///
/// From plane faces, the coarsest pictures come out of even light by degrees: their targets are
/// mixed with what the plane lens projects, less of it from stage to stage, so that the light never
/// has to jump. The faces of each resolution are refined for the next. At the end the front is at z
/// = 0 or below and the exit face at the task's thickness or above. The checkpoint is written
/// before and after transport and after every round.
/// @pre task.setup.second; second has the size of the task's picture.
/// @throw InputError if the barriers refuse the lens that the design starts from, or if a
/// checkpoint
///        to resume from is missing, corrupt, or belongs to another picture or other options.
TwoFaceResult shape_two_faces(const DesignTask& task, const Image& second);

/// A picture, linear light, on the screen of a setup.
struct PlanePicture {
  const OpticalSetup& setup;  ///< Its front counts for nothing.
  const Image& light;         ///< setup.pixels, not all black.
};

/// Rays of equal light through a lens of two faces. A column per ray, in lens-frame mm.
struct RayBundle {
  Eigen::Matrix2Xd entry;   ///< Where the ray meets the entry face,
  Eigen::Matrix2Xd exit;    ///< and where it leaves the lens.
  Eigen::Matrix3Xd first;   ///< Its point on the first screen,
  Eigen::Matrix3Xd second;  ///< and on the second.
  bool converged = false;   ///< All transports converged.
};

/// The rays of a lens that makes one picture on a screen and another on a second one behind it.
///
/// Notation: a and b a ray's points on the two screens, D their distance; e its point on the exit
/// face, z below the first screen; p its point on the entry face.
///
/// Light from one lamp stays normal to its wavefronts (Malus and Dupin), so a ↦ b is a gradient
/// for small angles, a + D ∇ψ(a): the optimal transport of one picture to the other. It leaves the
/// lens at e = a − (z/D)(b − a). That this does not fold asks that b stretches nowhere by more
/// than 1 + D/z. In the lens p ↦ e is a gradient, too: the optimal transport of the even light on
/// the front to what leaves the exit face. So there is essentially one such bundle. Each transport
/// is semi-discrete (solve_semi_discrete()), from `rays` to a picture: of an even grid to the first
/// picture, from there to the second, and of the points e to the even light on the front.
/// @param rays  columns and rows of the grid.
/// @param exit_height  z of the exit face, mm.
/// @pre both setups are those of one lens and lamp.
/// @throw Interrupted
RayBundle two_plane_map(const PlanePicture& first, const PlanePicture& second,
                        const GridShape& rays, double exit_height, const Executor& executor,
                        const RunControl& control);

/// The spline whose slopes are nearest to those wanted at points: minimises their squared
/// differences plus a thousandth of the squared changes of slope from cell to cell, which continue
/// it where there are no points. Its mean height is 0.
/// @param points, slopes  a column per point; mm, and without unit.
/// @param cells  knot cells along x and y. @return coefficients, cells + 3 each way, rows along x.
/// @throw Interrupted
Eigen::MatrixXd fit_spline_slopes(const Eigen::Matrix2Xd& points, const Eigen::Matrix2Xd& slopes,
                                  const Eigen::Vector2d& size, const Eigen::Vector2i& cells,
                                  const RunControl& control = {});

/// Where the faces of a lens begin: shapes, and the least distances from their limits.
struct FacePlan {
  GridShape net;           ///< Control points of the exit face.
  GridShape front;         ///< Samples of the front.
  double thickness = 0.0;  ///< mm
  double room = 0.0;       ///< mm; both faces' least distance from z = 0 and from the thickness.
};

/// Faces that send a bundle's light along its rays, by Snell's law as near as splines of these
/// shapes can.
/// @param setup  the first screen's. @throw Interrupted
LensFaces faces_along(const RayBundle& bundle, const OpticalSetup& setup, const FacePlan& plan,
                      const RunControl& control = {});

}  // namespace lensforge
