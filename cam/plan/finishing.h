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
#include "cam/workshop/workshop.h"
#include "core/compute/executor.h"
#include "core/compute/run_control.h"
#include "core/surface/optical_surface.h"
#include "machine/gcode/gcode_dialect.h"

namespace lensforge {

/// The finishing ball.
const Tool& finishing_ball(const CamOptions& options);

/// The larger ball that finishes wherever it reaches; none if the finishing ball does it alone.
const Tool* larger_ball(const CamOptions& options);

/// Digits after the point in the programs: as chosen, or what the tolerances ask for.
int decimals_of(const CamOptions& options);

/// Unit of the programs' last decimal, mm.
double resolution_of(const CamOptions& options);

/// What the path's direction is aimed at, rad: the workshop's slope tolerance, or what the
/// programs' decimals can hold if that is more.
double aimed_slope(const CamOptions& options);

/// That the decimals are too few for the slope tolerance, in a sentence; empty if they are not.
std::string decimals_warning(const CamOptions& options);

/// Length that moves of a tool should have at least, mm: the controller takes no more lines a
/// second. 0 where it has no such limit.
double shortest_move(const CamOptions& options, const Tool& tool);

/// What the finishing is laid out on; mm, lens frame.
struct FinishGround {
  Eigen::AlignedBox2d rectangle;  ///< Of what is cut.
  double steepest = 0.0;          ///< Rise over run of its steepest place.
  double z_offset = 0.0;          ///< Program Z − lens-frame z.
};

/// The finishing raster, and the one across if it is wanted.
std::vector<RasterPlan> finish_rasters(const CamOptions& options, const FinishGround& ground);

/// For the pass along the creases. @param top  highest point of what is cut, mm, lens frame.
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

/// The ball, or the two, that finish a surface.
class FinishBalls {
 public:
  /// @throw InputError naming finish.large_tool if a larger ball is asked for and the surface has
  ///        creases.
  FinishBalls(const std::shared_ptr<const OpticalSurface>& surface, const CamOptions& options,
              const Executor& executor);
  FinishBalls(const FinishBalls&) = delete;
  FinishBalls& operator=(const FinishBalls&) = delete;

  /// For the finishing ball on its own.
  [[nodiscard]] const CutSurface& surface() const { return *surface_; }
  /// What the larger ball leaves, if there is one.
  [[nodiscard]] const RestMap* rest() const { return shared_ ? &shared_->rest : nullptr; }
  /// In the order in which they are cut. @pre `options` have the same balls, pitch and rows.
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

/// Whether balls for one set of options cut a surface for the other as well.
bool same_balls(const CamOptions& one, const CamOptions& other);

/// The finishing ball's ways in the lens frame, from what is meant to what is written.
struct FinishPaths {
  std::vector<BallPath> ideal;    ///< Along the exact drop curves, to kExactRow.
  std::vector<BallPath> fitted;   ///< The moves before their numbers are rounded.
  std::vector<BallPath> written;  ///< As the programs have them.
  /// As a machine makes them that goes too far across the passes; empty for one that does not.
  std::vector<BallPath> stretched;
};

/// An axis that goes farther than a program says: from the program's zero, `factor` times as far.
struct AxisStretch {
  int axis = 1;
  double factor = 1.0;

  /// What FinishProcess::pitch_error does.
  static AxisStretch of(const FinishProcess& finish);
  [[nodiscard]] bool any() const { return factor != 1.0; }
};

/// Adds a motion as a machine makes it whose axis is stretched. Arcs in a plane that holds this
/// axis are ellipses then: arcs within 1e-6 mm of them.
void add_stretched(const GcodeMotion& motion, const AxisStretch& stretch, BallPath& path);

/// Adds a row's exact way and that of its moves before rounding to the last of `ideal` and of
/// `fitted`. @pre the row has traces.
void add_row(const RasterRow& row, FinishPaths& paths);

/// A MoveSink that hands moves at feed to a path.
MoveSink path_sink(BallPath& path, const AxisStretch& stretch = {});

/// Hands a program's motions at feed with one tool to `take`.
/// @throw InputError, RunError if the program cannot be read; Interrupted.
void read_path(const std::filesystem::path& program, const GcodeDialect& dialect, int tool,
               const std::function<void(const GcodeMotion&)>& take, const RunControl& control);

}  // namespace lensforge
