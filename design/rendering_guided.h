// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>

#include "core/executor.h"
#include "core/image.h"
#include "core/optical_setup.h"
#include "core/surface_mesh.h"
#include "design/energy/objective.h"
#include "design/optimize/grid_preconditioner.h"
#include "design/optimize/lbfgs.h"

namespace lensforge {

/// Rendering-guided optimisation of a grid mesh at one resolution (Sun et al., section 3.3): L-BFGS
/// on the objective with a biharmonic preconditioner whose scales are measured, not guessed.
class RenderingGuided {
 public:
  /// @param mesh  a grid mesh; it gives connectivity and which coordinates are held.
  RenderingGuided(const SurfaceMesh& mesh, const OpticalSetup& setup, const Image& target,
                  const ObjectiveOptions& options, const Executor& executor);

  /// Told after every iteration; false ends the run.
  using Observer = std::function<bool(int iteration, const DesignObjective::Evaluation&)>;

  /// Improves `mesh` by at most `options.max_iterations` steps, from scratch: the outcome depends
  /// on the mesh alone, so that a run resumed from it goes the same way.
  /// @throw Interrupted if the executor is stopped; `mesh` then holds the best surface so far.
  LbfgsSummary run(const LbfgsOptions& options, const Observer& observe, SurfaceMesh& mesh);

  /// True if the objective is finite there.
  [[nodiscard]] bool feasible(const SurfaceMesh& mesh);

 private:
  void calibrate(const Eigen::Matrix3Xd& vertices);
  [[nodiscard]] double preconditioned_curvature(const Eigen::Matrix3Xd& vertices, bool heights);
  [[nodiscard]] Eigen::Matrix3Xd probe(bool heights);

  OpticalSetup setup_;
  Executor executor_;
  DesignObjective objective_;
  GridPreconditioner preconditioner_;
  double cell_;  ///< Width of a grid cell, mm.
};

}  // namespace lensforge
