// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>

#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/optical_setup.h"
#include "design/energy/objective_options.h"
#include "design/optimize/grid_preconditioner.h"
#include "design/optimize/lbfgs.h"

namespace lensforge {

/// The numerical half of a GuidedOptimization: objective, preconditioner and minimiser on one
/// device. Vectors cross its border before and after a minimisation, not during it.
class GuidedStage {
 public:
  using Observer = std::function<bool(int iteration, const ObjectiveEvaluation&)>;

  GuidedStage() = default;
  virtual ~GuidedStage() = default;
  GuidedStage(const GuidedStage&) = delete;
  GuidedStage& operator=(const GuidedStage&) = delete;

  /// See DesignObjective.
  [[nodiscard]] virtual const Eigen::Matrix3Xd& movable() const = 0;
  virtual void relinearize(const Eigen::Matrix3Xd& vertices) = 0;
  virtual ObjectiveEvaluation evaluate(const Eigen::Matrix3Xd& vertices,
                                       Eigen::Matrix3Xd& gradient) = 0;

  /// See GridPreconditioner.
  virtual void set_symbols(const GridSymbol& xy, const GridSymbol& z) = 0;
  virtual void set_reach(const Eigen::Matrix3Xd& reach) = 0;
  virtual Eigen::Matrix3Xd apply_root(const Eigen::Matrix3Xd& g) = 0;

  /// Moves `vertices` to the best surface found, also where an exception ends the run.
  virtual LbfgsSummary minimize(const LbfgsOptions& options, const Observer& observe,
                                Eigen::Matrix3Xd& vertices) = 0;
};

#if defined(LENSFORGE_CUDA)
/// The stage on the GPU; see the constructor of GuidedStageOn. @throw RunError if its memory does
/// not suffice.
std::unique_ptr<GuidedStage> make_cuda_stage(const SurfaceMesh& mesh, const OpticalSetup& setup,
                                             double aspect, const DesignGoal& goal,
                                             const ObjectiveOptions& options,
                                             const Executor& executor);
#endif

}  // namespace lensforge
