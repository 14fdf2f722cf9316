// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <memory>

#include "core/executor.h"
#include "core/optical_setup.h"
#include "core/surface_mesh.h"
#include "design/energy/objective.h"
#include "design/guided_stage.h"
#include "design/optimize/lbfgs.h"

namespace lensforge {

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

  /// Improves `mesh` by at most `options.max_iterations` steps, from scratch: the outcome depends
  /// on the mesh alone, so that a run resumed from it goes the same way.
  /// @throw Interrupted if the executor is stopped; `mesh` then holds the best surface so far.
  LbfgsSummary run(const LbfgsOptions& options, const Observer& observe, SurfaceMesh& mesh);

  /// The objective there, its Welsch weights taken from there too; infinite where it is not
  /// allowed.
  [[nodiscard]] double value(const SurfaceMesh& mesh);

 private:
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
