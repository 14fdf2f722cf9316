// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>

#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/optical_setup.h"
#include "design/energy/objective.h"
#include "design/optimize/lbfgs.h"
#include "design/schedule/guided_stage.h"

namespace lensforge {

/// How far vertices step, measured on one surface; see GuidedOptimization::run(). Further rounds
/// keep them: where the surface fits already there is little curvature to measure. MAE in
/// thousandths after six rounds, measured anew for each and kept: 256 × 128 calligraphy 3.4 and
/// 2.9, 64² city 0.45 and 0.35, 128² portrait 2.7 and 2.5; smooth, 128² portrait 0.88 and 0.82.
struct StepScales {
  Eigen::Matrix3Xd reach;  ///< 3 × V, factors of the preconditioner's x, y and z; empty: unknown.
  double xy = 1.0;         ///< Scales of its x, y and z parts.
  double z = 1.0;

  [[nodiscard]] bool known() const { return reach.cols() > 0; }
};

/// Optimisation of a grid mesh at one resolution: rendering-guided if the goal is a picture (Sun et
/// al., section 3.3), correspondence-guided if it is a correspondence (section 3.4). L-BFGS with a
/// preconditioner whose scales are measured, not guessed. Works on the executor's device.
class GuidedOptimization {
 public:
  /// @param mesh  a grid mesh; it gives connectivity and which coordinates are held.
  GuidedOptimization(const SurfaceMesh& mesh, const OpticalSetup& setup, const DesignGoal& goal,
                     const ObjectiveOptions& options, const Executor& executor);

  /// Told after every iteration; false ends the run.
  using Observer = GuidedStage::Observer;

  /// Improves `mesh` by at most `options.max_iterations` steps. Scales that are not known are
  /// measured on the mesh first. The outcome depends on mesh and scales alone, so that a run
  /// resumed from them goes the same way.
  /// @throw Interrupted if the executor is stopped; `mesh` then holds the best surface so far.
  LbfgsSummary run(const LbfgsOptions& options, const Observer& observe, StepScales& scales,
                   SurfaceMesh& mesh);
  LbfgsSummary run(const LbfgsOptions& options, const Observer& observe, SurfaceMesh& mesh) {
    StepScales scales;
    return run(options, observe, scales, mesh);
  }

  /// The objective there, its Welsch weights taken from there too; infinite where it is not
  /// allowed.
  [[nodiscard]] double value(const SurfaceMesh& mesh);

 private:
  [[nodiscard]] StepScales measure_scales(const SurfaceMesh& mesh);
  void calibrate(const Eigen::Matrix3Xd& vertices);
  void begin_preconditioner(const SurfaceMesh& mesh, Eigen::Matrix3Xd& reach);
  void level_shifts(const Eigen::Matrix3Xd& vertices, Eigen::Matrix3Xd& reach);
  [[nodiscard]] Eigen::VectorXd squared_curvatures(const Eigen::Matrix3Xd& vertices, bool heights,
                                                   std::uint64_t number);
  [[nodiscard]] Eigen::Matrix3Xd probe(bool heights, std::uint64_t number);

  OpticalSetup setup_;
  GridShape grid_;
  double cell_;  ///< Width of a grid cell, mm.
  GridSymbol xy_;
  GridSymbol z_;
  std::unique_ptr<GuidedStage> stage_;
};

}  // namespace lensforge
