// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/surface/surface_mesh.h"
#include "design/energy/objective_options.h"
#include "design/setup/design_options.h"

namespace lensforge {

/// One resolution of the coarse-to-fine schedule.
struct Level {
  Eigen::Vector2i pixels{0, 0};    ///< Working picture, columns and rows.
  GridShape grid;                  ///< Vertices of the mesh.
  double nu = 0.0;                 ///< ν of the Welsch function, 1/mm.
  bool spline = false;             ///< The mesh's vertices are control points of a spline.
  double knot_share = 1.0;         ///< Of the vertices' way from an even grid, that its knots go.
  double least_area = kLeastArea;  ///< Of a triangle, share of the mean (AreaBarrier).
  int rounds = 0;                  ///< Alternations.
  int iterations = 0;              ///< Most of one round.
};

/// Size of the working picture: the longer side has options.pixels, the other follows the source's
/// shape (at least 1).
Eigen::Vector2i working_size(int source_columns, int source_rows, int longer_side);

/// Knot cells of a spline at most: a STEP file of them has 45 MB.
inline constexpr double kMaxKnotCells = 500'000.0;

/// The model of a design for which none is given: one spline, as long as its file has room for a
/// knot cell to each cell of the mesh; else smooth. With half a cell each way a 64² portrait's
/// spline has MAE 0.0097, the surface that is cut of a smooth mesh 0.0025; with one 0.0022.
/// @param options  what is asked for otherwise.
SurfaceModel default_model(const Eigen::Vector2i& pixels, const DesignOptions& options);

/// The levels for a working picture: at most options.levels, doubling up to full size, the first
/// not below about 32 pixels on the longer side (Sun et al., Appendix E); the mesh's cells double
/// with them, mesh_ratio per pixel.
///
/// ν falls from kNuStart × D_e to kNuEnd × D_e by a fixed ratio. The typical residual D_e is the
/// curvature that moves light by one pixel over one cell, (pixel / cell) / LightPath::reach(1).
///
/// A spline is designed as a smooth mesh in fewer rounds, and one more level optimises the spline
/// that follows from it, with two knot cells for each cell of the mesh; for a process, with as fine
/// ones as undo its polish, and for longer.
std::vector<Level> plan_levels(const Eigen::Vector2i& pixels, const DesignOptions& options);

}  // namespace lensforge
