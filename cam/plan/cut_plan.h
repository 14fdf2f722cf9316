// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <vector>

#include "cam/contact/cut_surface.h"
#include "cam/contact/profile_cutter.h"
#include "cam/milled/mould.h"
#include "cam/path/outline_cut.h"
#include "cam/path/stock_map.h"
#include "cam/plan/cam_options.h"
#include "cam/plan/finishing.h"
#include "cam/post/program_writer.h"
#include "cam/report/report_data.h"
#include "core/compute/executor.h"
#include "core/lens/lens.h"
#include "core/lens/optical_surface.h"
#include "core/mesh/surface_mesh.h"

/// The plan of a cut as values, each a function of those before it: cut_setup(), cut_passes(),
/// plan_programs(), and, once the programs are written, finish_paths(). Surfaces and prediction
/// (cam/predict) and report (cam/job) follow.
namespace lensforge {

/// True if a part's surfaces have creases: facets, or without polish the cusps between rows.
inline bool leaves_creases(SurfaceModel model, const PolishModel& polish) {
  return model == SurfaceModel::kFacet || polish.sigma == 0.0;
}

/// A part and its blank in a frame of the part's own.
struct CutSetup {
  const Lens* lens = nullptr;
  CamOptions options;
  /// The mould's, or the lens turned over for its front; null if the lens is cut as it lies.
  std::shared_ptr<const Lens> turned_lens;
  SurfaceModel model = SurfaceModel::kSmooth;  ///< Under which the surface is cut.
  HeightField field;                           ///< Size and steepness of the surface to cut.
  Eigen::AlignedBox3d box;  ///< The surface's from above, its heights with those of its apron.
  /// Its underside is z = 0; where it lies on the frame of its front, that lies below.
  Eigen::AlignedBox3d blank;
  double z_offset = 0.0;  ///< Program Z − lens-frame z, mm.
  double apron = 0.0;     ///< Width of the surface's continuation, mm.
  double back_top = 0.0;  ///< Of a front: z of the blank's other side, mm, the lens's frame.
  /// z of the frame that the front's cut leaves, mm, lens frame; for its front and on that frame.
  std::optional<double> frame;
  /// The surface to cut, the lens's, the mould's or the front, and its continuation around it; mm,
  /// in a lens frame of its own.
  std::shared_ptr<const OpticalSurface> optical;

  [[nodiscard]] bool is_creased() const { return leaves_creases(model, options.workshop.polish); }
  /// Mesh of the surface to cut.
  [[nodiscard]] const SurfaceMesh& mesh() const { return optical->mesh(); }
  /// Frame of the lens in what is cut, if it lies turned over: in its mould, or for its front.
  [[nodiscard]] std::optional<CastFrame> turned() const;
  [[nodiscard]] bool is_front() const { return options.face == CutFace::kFront; }
  /// Rectangle of the surface to cut without its apron, seen from above.
  [[nodiscard]] Eigen::AlignedBox2d rectangle() const {
    return {field.box.min().head<2>(), field.box.max().head<2>()};
  }
  /// The same with its apron.
  [[nodiscard]] Eigen::AlignedBox2d cut_rectangle() const;
  /// Width of the apron on the lens or cast, mm.
  [[nodiscard]] double apron_on_lens() const;
  [[nodiscard]] FinishGround ground() const {
    return {rectangle(), field.steepest, z_offset, apron};
  }
  /// Stepover of finishing rows, mm.
  [[nodiscard]] double pitch() const { return finish_pitch(options, ground()); }
  /// The finishing rows on the lens.
  [[nodiscard]] Passes passes() const { return passes_on_lens(options, ground()); }
  /// Height of rapids, mm, lens frame, on the program's grid.
  [[nodiscard]] double safe_z() const;
  [[nodiscard]] bool cuts_outline() const { return lensforge::cuts_outline(options, lens->setup); }
  /// Options of the outline cut. @pre cuts_outline().
  [[nodiscard]] OutlineCut outline_cut() const;
};

/// Box of a lens and of what is cut around it: x and y of the lens, heights with those of the
/// apron.
Eigen::AlignedBox3d box_to_cut(const Lens& lens, const CamOptions& options);

/// @param lens  must outlive the setup. @pre validate(options, lens.setup) passed.
/// @throw InputError naming the surface if it is no height field over the lens's rectangle, or the
///        light model if it is waves and the surface has creases.
CutSetup cut_setup(const Lens& lens, const CamOptions& options);

/// What the tools follow.
struct CutPasses {
  std::shared_ptr<const ProfileCutter> profile;  ///< The surface for tools before finishing.
  std::shared_ptr<const FinishBalls> balls;
  std::vector<FinishPass> finish;  ///< In cutting order.
};

/// @throw InputError naming finish.large_tool or the outline's options if they do not fit.
CutPasses cut_passes(const CutSetup& setup, const Executor& executor);

/// What is left of operations that were streamed.
struct CutRecord {
  explicit CutRecord(const CutSetup& setup);

  StockMap stock;                                     ///< The blank as far as it was cut.
  std::vector<std::unique_ptr<PathSketch>> sketches;  ///< One for each operation.
  FinishPaths rows;  ///< `ideal` and `fitted` of the finishing passes, if they are rendered.

  /// Every operation's path, thinned out.
  [[nodiscard]] std::vector<ReportPath> shown_path() const;
};

/// Plan of the programs: roughing, semi-finishing, finishing, pencil and outline, as enabled.
/// @param record  that the operations fill; each runs once, in this order. Setup, passes, record
///                and control must outlive the plan.
ProgramPlan plan_programs(const CutSetup& setup, const CutPasses& passes, CutRecord& record,
                          const Executor& executor, const RunControl& control);

/// Settings of a cut's programs, without a look at them.
ProgramSettings program_settings(const CamOptions& options);

/// The programs with the operations of one part alone, and the part's place in them.
struct PartPrograms {
  const ProgramFiles& files;
  Eigen::Vector2d corner = Eigen::Vector2d::Zero();  ///< X and Y of its lower left corner, mm.
};

/// The finishing ball's paths: exact, fitted and as written. @param rows  those of the record.
/// @pre the setup has CamOptions::render.
/// @throw Interrupted; InputError or RunError if a program cannot be read back.
FinishPaths finish_paths(const CutSetup& setup, const CutPasses& passes, FinishPaths rows,
                         const PartPrograms& programs, const RunControl& control);

}  // namespace lensforge
