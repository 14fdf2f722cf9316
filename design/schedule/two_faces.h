// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "core/mesh/surface_mesh.h"
#include "design/energy/objective_options.h"
#include "design/energy/two_face_objective.h"
#include "design/schedule/levels.h"

namespace lensforge {

/// Both faces of a lens for two pictures, and the record of their design.
struct TwoFaceResult {
  LensFaces faces;
  GridShape net;  ///< Of the control points of faces.exit.
  std::vector<ConvergenceRow> convergence;
  bool done = false;  ///< False if the control stopped it; the faces are then the best so far.
};

/// Shapes both faces for the task's picture and `second`, from the faces that transport finds
/// (two_plane_map()), or coarse to fine from plane faces where the barriers refuse those.
///
/// From plane faces, the coarsest pictures come out of even light by degrees: their targets are
/// mixed with what the plane lens projects, less of it from stage to stage, so that the light never
/// has to jump. The faces of each resolution are refined for the next. At the end the front is at z
/// = 0 or below and the exit face at the task's thickness or above.
/// @pre task.setup.second; second has the size of the task's picture.
/// @throw InputError if the barriers refuse the lens that the design starts from.
TwoFaceResult shape_two_faces(const DesignTask& task, const Image& second);

}  // namespace lensforge
