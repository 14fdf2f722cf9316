// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "cam/contact/cut_surface.h"
#include "cam/path/finish_raster.h"
#include "cam/path/operation.h"
#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"

namespace lensforge {

/// Options of a pencil pass.
struct PencilOptions {
  double least_angle = 0.05;  ///< Minimum angle between the normals of a valley's sides, rad, > 0.
  double least_length = 0.5;  ///< Shorter valleys are left alone, mm, ≥ 0.
  double spacing = 0.01;      ///< Maximum distance of points along a valley, mm, > 0.
  double resolution = 1e-6;   ///< Unit of the program's last decimal, mm, > 0.
  double z_zero = 0.0;        ///< Height that the program calls 0, mm, lens frame.
  double top = 0.0;           ///< Highest point of the surface, mm, lens frame.
  double clearance = 0.5;     ///< Height over it on links between valleys, mm.
};

/// A valley's path: places of the ball's axis, mm.
using Valley = std::vector<Eigen::Vector2d>;

/// The valleys of a mesh: chains of edges whose two facets form a valley of least_angle or more,
/// offset to the axis of a ball that touches both facets, (n₁ + n₂) R / (1 + n₁·n₂) beside the
/// edge. At branches a chain goes straight on. Order: from the end of each valley to the nearest
/// end left, beginning with the one nearest to x = y = 0.
/// @pre every triangle faces +z.
/// @throw InputError if the mesh is not a manifold.
std::vector<Valley> find_valleys(const SurfaceMesh& mesh, double radius,
                                 const PencilOptions& options);

/// Follows every valley once at the drop height. Between points s apart the drop curve rises over
/// its chord by at most (1 + M²)^(3/2) s²/(8R), M being its slope; the path is raised by that, so
/// it never gouges (Pencil.NeverGouges). The certificate states gouge 0 and the excess at the
/// points of the path; slopes are not checked. Links between valleys run at feed over the highest
/// point of the surface.
/// @pre the surface is finished except in its valleys, and nowhere steeper than kSteepestSlope.
/// @return complete is false if `control` asked for an end.
/// @throw InputError if there is nothing under the ball somewhere on a valley.
OperationSummary cut_pencil(const CutSurface& surface, const std::vector<Valley>& valleys,
                            const PencilOptions& options, const FinishRun& run,
                            const MoveSink& sink, const RunControl& control);

}  // namespace lensforge
