// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/compute/executor.h"
#include "core/image/image.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/optical_setup.h"
#include "core/spline/control_net.h"
#include "design/energy/objective_options.h"
#include "design/render/source_picture.h"
#include "design/schedule/guided_optimization.h"
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

/// What a design is to do, at full size; no step changes it.
struct DesignTask {
  const DesignOptions& options;
  const RunControl& control;
  Executor executor;  ///< Stops when the control does.
  Image target;       ///< Working picture.
  OpticalSetup setup;
  std::vector<Level> levels;
  std::optional<SourceLimit> limit;  ///< Of an extended source.
};

/// The picture at the size that the options ask for. @throw Interrupted
Image working_picture(const Image& target, const DesignOptions& options, const RunControl& run);

/// Options and control must outlive the task.
/// @param target  linear light, any size.
/// @pre validate(options, target) passes. @throw Interrupted
DesignTask make_task(const Image& target, const DesignOptions& options, const Executor& executor,
                     const RunControl& control);

/// What is to be solved at one resolution.
struct LevelProblem {
  OpticalSetup setup;
  Image target;
  Image aim;  ///< What transport makes: under an extended source the light that is best blurred.
  ObjectiveOptions objective;
};

/// @param triangles  of the level's mesh; a spline's follow from its nodes.
LevelProblem make_problem(const DesignTask& task, const Level& level, std::int64_t triangles);

/// Evens out a grid mesh that has been interpolated from a coarser one: vertices move to the middle
/// of their neighbours, those on the border along it, all of them kEveningSweeps times and then
/// those of triangles that are folded or too small. Cubics overshoot where neighbouring vertices
/// have moved differently, and fold triangles over; heights that are fitted to a folded mesh are
/// those of no surface.
/// @param least  area that every triangle has in the end, mm², well below the mean.
/// @pre mesh.grid is set; border vertices lie on the border.
void even_out(double least, SurfaceMesh& mesh);

/// Vertices that an optimisation has moved stand unevenly by whole cells. MAE in thousandths of
/// 48² at draft quality, two levels, 6 rounds, with 0, 1, 3 and 10 sweeps: smooth, rings 2.4, 1.0,
/// 0.3 and 0.1, logo 13, 11, 11 and 12, portrait 2.6, 2.2, 1.9 and 2.2; facets, logo 0.9, 0.9, 0.5
/// and 0.5, portrait 8.2, 8.8, 9.3 and 8.5.
inline constexpr int kEveningSweeps = 3;

/// Control points that follow a mesh as a grid mesh of their own, for which the stages of a design
/// are made.
SurfaceMesh net_mesh(const ControlNet& net);

/// The spline nearest to what a grid mesh projects by its vertex normals: its knot lines follow
/// the vertices, its slopes theirs (SlopeFit).
/// @param size   of the lens, mm. @param shape  control points each way, ≥ 4.
/// @param share  of the vertices' movement that the knot lines take part in, 0 … 1.
/// @throw Interrupted.
ControlNet spline_through(const SurfaceMesh& mesh, const Eigen::Vector2d& size,
                          const GridShape& shape, double share, const Executor& executor,
                          const RunControl& control);

/// The net on coordinates that a file of a solid writes in few digits: x and y of inner points on
/// whole 1e-7 mm, heights on whole 1e-9 mm, which turns normals by up to 1e-6 rad where knots are
/// densest. Lifted so that the lowest node is `thickness` above the entry face.
ControlNet settled(ControlNet net, double thickness);

/// What a level begins with: the surface of the one before on its own grid. A mesh has no folded
/// and no tiny triangles (even_out()). A spline's knot lines follow the vertices as far as no
/// barrier refuses it. @throw Interrupted
SurfaceMesh level_start(const DesignTask& task, const Level& level, const SurfaceMesh& mesh);

/// Draws the first `coordinates` of x, y and z towards another surface on the same grid, no farther
/// than it needs until no barrier refuses the mesh. @return false if one still does.
bool draw_towards(const SurfaceMesh& other, int coordinates, GuidedOptimization& stage,
                  SurfaceMesh& mesh);

}  // namespace lensforge
