// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cam/contact/ball_blend.h"
#include "cam/contact/cut_surface.h"
#include "cam/milled/ball_sweep.h"
#include "cam/path/finish_raster.h"
#include "cam/path/operation.h"
#include "cam/path/pencil.h"
#include "cam/plan/cam_options.h"
#include "cam/tolerance/part_error.h"
#include "cam/workshop/workshop.h"
#include "core/compute/executor.h"
#include "core/lens/optical_surface.h"
#include "core/optics/optical_setup.h"
#include "machine/gcode/gcode_dialect.h"

namespace lensforge {

/// The finishing ball.
const Tool& finishing_ball(const CamOptions& options);

/// The larger ball, which finishes all that it can reach; null if the finishing ball works alone.
const Tool* larger_ball(const CamOptions& options);

/// Width of the continuation that is cut around the surface, mm: the finishing ball's radius and 8
/// σ of the polish, 16 with order 4, those of a mould's cast. Nothing beyond has an effect on the
/// light.
double apron_to_cut(const CamOptions& options);

/// Digits after the point in the programs: as chosen, or as many as the tolerances require.
int decimals_of(const CamOptions& options);

/// Unit of the programs' last decimal, mm.
double resolution_of(const CamOptions& options);

/// Target for the error of the path's direction, rad: the workshop's slope tolerance, or the error
/// that the programs' decimals allow if that is larger.
double aimed_slope(const CamOptions& options);

/// Warning that the decimals are too few for the slope tolerance; empty if they are not.
std::string decimals_warning(const CamOptions& options);

/// Minimum length of a tool's moves, mm, given the controller's maximum lines per second. 0 without
/// such a limit.
double shortest_move(const CamOptions& options, const Tool& tool);

/// Extent of the surface to be finished, without its apron; mm, lens frame.
struct FinishGround {
  Eigen::AlignedBox2d rectangle;  ///< Of the surface to cut.
  double steepest = 0.0;          ///< Rise over run at its steepest place.
  double z_offset = 0.0;          ///< Program Z − lens-frame z.
  double apron = 0.0;             ///< Width of the continuation cut around it.
};

/// Stands for the surface as long as it is not known: the lens's rectangle, or the mould's, with
/// kUnknownSlope. For estimates.
FinishGround unknown_ground(const CamOptions& options, const OpticalSetup& setup);

/// The finishing raster, and the crossing one if enabled.
std::vector<RasterPlan> finish_rasters(const CamOptions& options, const FinishGround& ground);

/// Stepover of the finishing ball's rows as cut, mm: max_pitch() on the ground's slope, fitted to
/// its width. The one value that balls, samples, drawn parts, remedies and report take.
double finish_pitch(const CamOptions& options, const FinishGround& ground);

/// The finishing ball's rows on the lens. A mould is larger than its cast by the shrinkage.
Passes passes_on_lens(const CamOptions& options, const FinishGround& ground);

/// Options of the pencil pass. @param top  highest point of the surface to cut, mm, lens frame.
PencilOptions pencil_options(const CamOptions& options, double z_offset, double top);

/// The surface that a ball of this radius (mm, > 0) cuts.
std::unique_ptr<CutSurface> surface_to_cut(std::shared_ptr<const OpticalSurface> surface,
                                           double radius, const Executor& executor);

/// One finishing raster.
struct FinishPass {
  std::string name;  ///< "finish", "cross", "large" or "rest": OperationSummary::name.
  Tool tool;         ///< A ball.
  const CutSurface* surface = nullptr;
  RasterPlan plan;
};

/// The ball, or the two balls, that finish a surface.
class FinishBalls {
 public:
  /// @throw InputError naming finish.large_tool if a larger ball is chosen and the surface has
  ///        creases.
  FinishBalls(const std::shared_ptr<const OpticalSurface>& surface, const CamOptions& options,
              const FinishGround& ground, const Executor& executor);
  FinishBalls(const FinishBalls&) = delete;
  FinishBalls& operator=(const FinishBalls&) = delete;

  /// The surface for the finishing ball alone.
  [[nodiscard]] const CutSurface& surface() const { return *surface_; }
  /// What the larger ball leaves; null without one.
  [[nodiscard]] const RestMap* rest() const { return shared_ ? &shared_->rest : nullptr; }
  /// Passes in cutting order. @pre `options` have the same balls, pitch and rows.
  [[nodiscard]] std::vector<FinishPass> passes(const CamOptions& options,
                                               const FinishGround& ground) const;

 private:
  struct Shared {
    Shared(std::unique_ptr<CutSurface> larger, const CutSurface& smaller,
           const BallBlend::Rows& rows, const Executor& executor);

    std::unique_ptr<CutSurface> large;
    RestMap rest;
    BallBlend blend;
    SharedLift small_lift;
    SharedLift large_lift;
    LiftedSurface lifted_small;
    LiftedSurface lifted_large;
  };

  std::unique_ptr<CutSurface> surface_;
  std::unique_ptr<const Shared> shared_;
};

/// True if the balls of one set of options are also valid for the other on the same ground.
bool same_balls(const CamOptions& one, const CamOptions& other, const FinishGround& ground);

/// The finishing ball's paths in the lens frame, from the exact ones to the written ones.
struct FinishPaths {
  std::vector<BallPath> ideal;    ///< Along the drop curves, to kExactRow.
  std::vector<BallPath> fitted;   ///< The moves before rounding.
  std::vector<BallPath> written;  ///< As in the programs.
  /// As made by a machine that goes too far across the passes; empty if it does not.
  std::vector<BallPath> stretched;
};

/// Scale error of an axis: it moves `factor` times as far from the program's zero.
struct AxisStretch {
  int axis = 1;
  double factor = 1.0;

  /// Stretch by FinishProcess::pitch_error.
  static AxisStretch of(const FinishProcess& finish);
  [[nodiscard]] bool any() const { return factor != 1.0; }
};

/// Adds a motion as made by a machine with a stretched axis. Arcs in a plane with this axis become
/// ellipses, approximated by arcs within 1e-6 mm.
void add_stretched(const GcodeMotion& motion, const AxisStretch& stretch, BallPath& path);

/// Adds a way's moves, made by such a machine.
void add_way(const RasterWay& way, const AxisStretch& stretch, BallPath& path);

/// Adds a row's exact path and that of its moves before rounding to the last of `ideal` and of
/// `fitted`. @pre the row has traces.
void add_row(const RasterRow& row, FinishPaths& paths);

/// A MoveSink that adds moves at feed to a path.
MoveSink path_sink(BallPath& path, const AxisStretch& stretch = {});

/// Passes a program's motions at feed with one tool to `take`.
/// @throw InputError, RunError if the program cannot be read; Interrupted.
void read_path(const std::filesystem::path& program, const GcodeDialect& dialect, int tool,
               const std::function<void(const GcodeMotion&)>& take, const RunControl& control);

}  // namespace lensforge
