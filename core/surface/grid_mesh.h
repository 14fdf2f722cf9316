// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "core/surface/grid_layout.h"
#include "core/surface/surface_mesh.h"

namespace lensforge {

/// Rows per column of a grid of near-equilateral triangles, 2/√3 rounded so that the usual sizes
/// stay whole under halving (641 × 737 vertices: 640 × 1.15 = 736).
inline constexpr double kRowsPerColumn = 1.15;

/// A flat mesh over [0, size.x] × [0, size.y] at height z: `shape` vertices in rows, every other
/// row moved half a cell to the right so that the triangles are nearly equilateral. Near the left
/// and right border the shift fades out over kShiftFade cells, so that all rows end on the border.
/// @pre shape.columns, shape.rows ≥ 2.
SurfaceMesh make_grid_mesh(const Eigen::Vector2d& size, const GridShape& shape, double z);

/// The same surface on another grid over the same rectangle: displacements from the flat mesh's
/// positions and heights are interpolated by cubics (Catmull–Rom), once along rows and once across.
/// Planes are preserved, except in the cells of unequal width next to the left and right border
/// (error about 1 % of a cell's rise). Border vertices stay on the border. @pre mesh.grid is set
/// and at least 2 × 2.
SurfaceMesh regrid(const SurfaceMesh& mesh, const Eigen::Vector2d& size, const GridShape& shape);

}  // namespace lensforge
