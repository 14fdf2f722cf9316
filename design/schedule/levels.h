// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
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
  Eigen::Vector2i pixels{0, 0};  ///< Working picture, columns and rows.
  GridShape grid;                ///< Vertices of the mesh.
  double nu = 0.0;               ///< ν of the Welsch function, 1/mm.
  bool spline = false;           ///< The mesh's vertices are control points of a spline.
  bool waves = false;            ///< Of a spline: the picture is that of a wave, not of rays.
  double knot_share = 1.0;  ///< Share of the vertices' displacement that its knots take part in.
  double least_area = kMinArea;  ///< Of a triangle, as a share of the mean (AreaBarrier).
  int rounds = 0;                ///< Alternations.
  int iterations = 0;            ///< Maximum of one round.
};

/// Size of the working picture: the longer side has options.pixels, the other is at least 1 and
/// keeps the source's proportions.
Eigen::Vector2i working_size(int source_columns, int source_rows, int longer_side);

/// Maximum number of knot cells of a spline; its STEP file then has 45 MB.
inline constexpr double kMaxKnotCells = 500'000.0;

/// Default model: a spline if its file has room for one knot cell per cell of the mesh, else
/// smooth. With one knot cell per cell a 64² portrait's spline has MAE 0.0022, with half a cell
/// each way 0.0097.
/// @param options  all other options.
SurfaceModel default_model(const Eigen::Vector2i& pixels, const DesignOptions& options);

/// The levels for a working picture: at most options.levels, doubling up to full size, the first at
/// least about 32 pixels on the longer side (Sun et al., Appendix E). The mesh has mesh_ratio cells
/// per pixel; its cells double too.
///
/// ν falls from kNuStart × D_e to kNuEnd × D_e by a fixed ratio. The typical residual D_e is the
/// curvature that moves light by one pixel over one cell, (pixel / cell) / LightPath::reach(1).
///
/// A spline is designed as a smooth mesh in fewer rounds. One more level then optimises the spline
/// fitted to it, with two knot cells per cell of the mesh. For a process its cells are fine enough
/// to undo the polish, and it is optimised longer. Where LightOptions::model asks for waves,
/// a last level follows their picture from there.
std::vector<Level> plan_levels(const Eigen::Vector2i& pixels, const DesignOptions& options);

/// When iterations are enough: their error is then small against the floor of the picture.
class Finish {
 public:
  /// Goes on to the last iteration.
  Finish() = default;
  /// @param floor  picture_floor(), > 0.
  explicit Finish(double floor) : floor_(floor) {}

  /// MAE with which the wall's error is a tenth above the floor, at most 0.003; 0 without a floor.
  [[nodiscard]] double goal() const;

  /// True if the latest iterations have lowered the wall's error so little that more are in vain.
  /// @param errors  MAE after each iteration.
  [[nodiscard]] bool idle(std::span<const double> errors) const;

 private:
  double floor_ = 0.0;
};

/// A design's input at full size; no step changes it.
struct DesignTask {
  const DesignOptions& options;
  const RunControl& control;
  Executor executor;  ///< Stops when the control does.
  Image target;       ///< Working picture.
  OpticalSetup setup;
  std::vector<Level> levels;
  std::optional<SourceLimit> limit;  ///< Set for an extended source.
  Finish finish;
};

/// Returns the picture at the size that the options ask for. @throw Interrupted
Image working_picture(const Image& target, const DesignOptions& options, const RunControl& run);

/// Options and control must outlive the task.
/// @param target  linear light, any size.
/// @pre validate(options, target) passes. @throw Interrupted
DesignTask make_task(const Image& target, const DesignOptions& options, const Executor& executor,
                     const RunControl& control);

/// The problem at one resolution.
struct LevelProblem {
  OpticalSetup setup;
  Image target;
  Image aim;            ///< Goal of transport; an extended source blurs it to `target`.
  double enough = 0.0;  ///< MAE at which the level is done.
  ObjectiveOptions objective;
};

/// @param triangles  number in the level's mesh; not used for a spline.
LevelProblem make_problem(const DesignTask& task, const Level& level, std::int64_t triangles);

/// Evens out a grid mesh that was interpolated from a coarser one. All vertices move to the mean of
/// their neighbours (border vertices along the border) kEveningSweeps times, then those of folded
/// or too small triangles. Cubic interpolation overshoots where neighbouring vertices moved
/// differently and folds triangles over; heights fitted to a folded mesh belong to no surface.
/// @param least  minimum area of every triangle afterwards, mm², well below the mean.
/// @pre mesh.grid is set; border vertices lie on the border.
void even_out(double least, SurfaceMesh& mesh);

/// Optimisation leaves vertices uneven by whole cells. MAE in thousandths of 48² at draft quality
/// with 0, 3 and 10 sweeps: smooth, rings 2.4, 0.3 and 0.1, portrait 2.6, 1.9 and 2.2; facets,
/// portrait 8.2, 9.3 and 8.5.
inline constexpr int kEveningSweeps = 3;

/// The control points as a grid mesh, which is what the stages of a design work on.
SurfaceMesh net_mesh(const ControlNet& net);

/// The spline closest to what a grid mesh projects by its vertex normals: its knot lines follow the
/// vertices, its slopes their normals (SlopeFit).
/// @param size   of the lens, mm. @param shape  control points each way, ≥ 4.
/// @param share  of the vertices' displacement that the knot lines take part in, 0 … 1.
/// @throw Interrupted
ControlNet spline_through(const SurfaceMesh& mesh, const Eigen::Vector2d& size,
                          const GridShape& shape, double share, const Executor& executor,
                          const RunControl& control);

/// Rounds the net to coordinates that a solid's file states in few digits: x and y of inner points
/// to 1e-7 mm, heights to 1e-9 mm, which turns normals by up to 1e-6 rad where knots are densest.
/// Lifts it so that the lowest node is `thickness` above the entry face.
ControlNet settled(ControlNet net, double thickness);

/// Returns a level's first surface: the previous one on the level's grid. A mesh has no folded and
/// no tiny triangles (even_out()). A spline's knot lines follow the vertices as far as no barrier
/// refuses it. @param control  takes reports of the spline's fit. @throw Interrupted
SurfaceMesh level_start(const DesignTask& task, const Level& level, const SurfaceMesh& mesh,
                        const RunControl& control);

/// Moves the first `coordinates` of x, y and z towards another surface on the same grid, in steps,
/// until no barrier refuses the mesh. @return false if one still does.
bool draw_towards(const SurfaceMesh& other, int coordinates, GuidedOptimization& stage,
                  SurfaceMesh& mesh);

}  // namespace lensforge
