// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cam/contact/cut_surface.h"
#include "cam/contact/profile_cutter.h"
#include "cam/milled/mould.h"
#include "cam/path/collision.h"
#include "cam/path/finish_raster.h"
#include "cam/path/outline_cut.h"
#include "cam/path/pencil.h"
#include "cam/path/rough.h"
#include "cam/path/stock_map.h"
#include "cam/plan/cam_options.h"
#include "cam/plan/finishing.h"
#include "cam/plan/program_watch.h"
#include "cam/post/program_writer.h"
#include "cam/report/report_data.h"
#include "core/compute/executor.h"
#include "core/lens/lens.h"
#include "core/lens/optical_surface.h"
#include "core/mesh/surface_mesh.h"

namespace lensforge {

/// Place of a lens in programs that cut several.
struct CutPlace {
  Eigen::Vector2d corner = Eigen::Vector2d::Zero();  ///< X and Y of its lower left corner, mm.
  /// Shared checks of the programs of all lenses; both must outlive the plan. Null: the plan's own.
  const CollisionCheck* collisions = nullptr;
  const ProgramWatch* watch = nullptr;

  [[nodiscard]] bool shared() const { return watch != nullptr; }
};

/// A part, its blank, and the operations that cut it.
class CutPlan {
 public:
  /// @param lens  must outlive the plan. @pre validate(options, lens.setup) passed.
  /// @throw InputError naming the surface if it is no height field over the lens's rectangle.
  CutPlan(const Lens& lens, const CamOptions& options, const Executor& executor,
          const CutPlace& place = {});
  CutPlan(const CutPlan&) = delete;
  CutPlan& operator=(const CutPlan&) = delete;

  /// Plan of the programs: roughing, semi-finishing and finishing, as enabled. Its operations use
  /// this object, one after the other, and can run once.
  [[nodiscard]] ProgramPlan programs(const RunControl& control);
  /// Settings of the programs, whose read-back lines go to this object's checks.
  [[nodiscard]] ProgramSettings settings();

  /// Returns the finishing ball's paths: exact, fitted and as written. Moves the first two out of
  /// this plan. @param programs  with this plan's operations alone, in its place.
  /// @pre programs() was streamed, and CamOptions::render is set.
  /// @throw Interrupted; InputError or RunError if a program cannot be read back.
  [[nodiscard]] FinishPaths take_finish_paths(const ProgramFiles& programs,
                                              const RunControl& control);

  [[nodiscard]] const CamOptions& options() const { return options_; }
  [[nodiscard]] const CutPlace& place() const { return place_; }
  /// The surface to cut: the lens's or the mould's; mm, in a lens frame of its own.
  [[nodiscard]] const SurfaceMesh& mesh() const { return cut().surface; }
  /// Model under which the surface is cut.
  [[nodiscard]] SurfaceModel model() const { return model_; }
  /// The optical surface behind mesh().
  [[nodiscard]] const std::shared_ptr<const OpticalSurface>& optical() const { return optical_; }
  /// The surface for the finishing ball.
  [[nodiscard]] const CutSurface& surface() const { return balls_.surface(); }
  [[nodiscard]] const FinishBalls& balls() const { return balls_; }
  /// Frame of the lens in the mould, if there is one.
  [[nodiscard]] std::optional<CastFrame> mould() const;
  [[nodiscard]] const Eigen::AlignedBox3d& part_box() const { return field_.box; }
  /// Size and steepness of the surface to cut.
  [[nodiscard]] const HeightField& field() const { return field_; }
  [[nodiscard]] const Eigen::AlignedBox3d& blank() const { return blank_; }
  [[nodiscard]] double z_offset() const { return z_offset_; }
  /// Rectangle of the surface to cut, seen from above.
  [[nodiscard]] Eigen::AlignedBox2d rectangle() const {
    return {field_.box.min().head<2>(), field_.box.max().head<2>()};
  }
  [[nodiscard]] FinishGround ground() const { return {rectangle(), field_.steepest, z_offset_}; }
  /// Distance of finishing rows as cut, mm.
  [[nodiscard]] double pitch() const { return finish_rasters(options_, ground()).front().pitch; }
  [[nodiscard]] int decimals() const { return decimals_; }
  /// Collisions in the programs read back so far.
  [[nodiscard]] const std::vector<Collision>& collisions() const {
    return (place_.shared() ? *place_.collisions : collisions_).collisions();
  }
  /// Descents in them that are too steep for their feed.
  [[nodiscard]] const std::vector<SteepDescent>& descents() const {
    return (place_.shared() ? *place_.collisions : collisions_).descents();
  }
  /// Other faults in them.
  [[nodiscard]] const ProgramWatch& watch() const {
    return place_.shared() ? *place_.watch : watch_;
  }
  /// Options of the outline cut. @pre cuts_outline().
  [[nodiscard]] OutlineCut outline_cut() const;
  /// Every operation's path, thinned out, as far as programs() were streamed.
  [[nodiscard]] std::vector<ReportPath> shown_path() const;

 private:
  [[nodiscard]] const FinishProcess& finish() const { return options_.workshop.process.finish; }
  [[nodiscard]] const Tool& ball() const { return finishing_ball(options_); }
  /// The lens, or its mould as a lens.
  [[nodiscard]] const Lens& cut() const { return mould_lens_ ? *mould_lens_ : lens_; }
  [[nodiscard]] double safe_z() const;
  ProgramOperation rough_operation(const RunControl& control);
  ProgramOperation semi_operation(const RunControl& control);
  ProgramOperation finish_operation(const FinishPass& pass, const RunControl& control);
  ProgramOperation pencil_operation(const RunControl& control);
  ProgramOperation outline_operation(const RunControl& control);
  OperationSummary run_pencil(double resolution, const MoveSink& sink,
                              const RunControl& control) const;
  /// Passes all motions at feed with a tool in the plan's operations to `take`, x and y in the lens
  /// frame.
  void read_motions(const ProgramFiles& programs, int tool,
                    const std::function<void(const GcodeMotion&)>& take,
                    const RunControl& control) const;
  /// A sink that sketches the operation and passes its moves to `sink`.
  MoveSink sketched(const std::string& operation, const MoveSink& sink);

  const Lens& lens_;
  CamOptions options_;
  CutPlace place_;
  Executor executor_;
  std::optional<Lens> mould_lens_;  ///< None if the lens itself is cut.
  SurfaceModel model_;
  HeightField field_;
  Eigen::AlignedBox3d blank_;
  double z_offset_ = 0.0;
  int decimals_ = 5;
  ProfileCutter profile_;
  StockMap stock_;
  std::shared_ptr<const OpticalSurface> optical_;
  FinishBalls balls_;
  CollisionCheck collisions_;
  ProgramWatch watch_;
  std::vector<WatchedOperation> watched_;
  std::vector<std::unique_ptr<PathSketch>> sketches_;
  FinishPaths paths_;  ///< As far as programs() were streamed.
};

}  // namespace lensforge
