// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "cam/contact/cut_surface.h"
#include "cam/path/finish_raster.h"
#include "cam/path/operation.h"
#include "core/compute/executor.h"
#include "core/compute/run_control.h"
#include "core/surface/surface_mesh.h"

namespace lensforge {

/// Which creases a pencil pass follows and how finely.
struct PencilOptions {
  double least_angle = 0.05;  ///< Between the normals of the two sides of a valley, rad, > 0.
  double least_length = 0.5;  ///< Shorter valleys are left alone, mm, ≥ 0.
  double spacing = 0.01;      ///< Of points along a valley at most, mm, > 0.
  double resolution = 1e-6;   ///< Unit of the program's last decimal, mm, > 0.
  double z_zero = 0.0;        ///< Height that the program calls 0, mm, lens frame.
  double top = 0.0;           ///< Highest point of the surface, mm, lens frame.
  double clearance = 0.5;     ///< Over it on ways between valleys, mm.
};

/// A valley as the ball follows it: places of its axis, mm.
using Valley = std::vector<Eigen::Vector2d>;

/// The valleys of a mesh: chains of edges with a facet on either side that rise away from one
/// another by least_angle or more, moved to where the axis of a ball stands that touches both
/// facets, (n₁ + n₂) R / (1 + n₁·n₂) beside the edge. Where chains branch, they go straight on.
/// Ordered: from every end on to the nearest end left, beginning with the one nearest to x = y = 0.
/// @pre every triangle faces +z.
/// @throw InputError if the mesh is not a manifold.
std::vector<Valley> find_valleys(const SurfaceMesh& mesh, double radius,
                                 const PencilOptions& options);

/// Follows every valley once at the drop height. Between points s apart the drop curve rises over
/// its chord by (1 + M²)^(3/2) s²/(8R) at most, M being its slope; the path is raised by that, so
/// that it nowhere gouges (Pencil.NeverGouges). The certificate says gouge 0 and the excess at the
/// points of the path; directions are not looked at. Valley to valley the tool goes at feed over
/// the highest point of the surface.
/// @pre the surface is finished but for its valleys and nowhere steeper than kSteepestSlope.
/// @return complete is false if `control` asked for an end.
/// @throw InputError if there is nothing under the ball somewhere on a valley.
OperationSummary cut_pencil(const CutSurface& surface, const std::vector<Valley>& valleys,
                            const PencilOptions& options, const FinishRun& run,
                            const MoveSink& sink, const RunControl& control);

}  // namespace lensforge
