// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/optical_setup.h"
#include "design/energy/objective.h"
#include "design/energy/objective_options.h"
#include "design/energy/spline_objective.h"
#include "design/waves/wave_picture.h"

namespace lensforge {

/// SplineObjectiveOn with the picture of a wave (NodeWaves) instead of that of rays; barriers and
/// E_bdr stay those of its rays. Its gradient is that of NodeWaves: good to about 1 % of it. Same
/// interface, on the CPU.
class WaveObjective {
 public:
  /// @pre goal is a picture, options.waves is set.
  WaveObjective(const SurfaceMesh& net, const OpticalSetup& setup, const DesignGoal& goal,
                const ObjectiveOptions& options, const Executor& executor);

  /// @throw Interrupted.
  void relinearize(const double* points);
  /// @throw Interrupted.
  ObjectiveEvaluation evaluate(const double* points, double* gradient);

  [[nodiscard]] const Eigen::Matrix3Xd& movable() const { return rays_.movable(); }

 private:
  /// Adds a share of the picture's error of one part.
  void add_picture(const double* points, SplinePart<Executor>& part, double share,
                   ObjectiveEvaluation& sum, double* gradient);

  Executor executor_;
  ObjectiveWeights weights_;
  SplineObjectiveOn<Executor> rays_;
  std::vector<SplinePart<Executor>> parts_;
  std::unique_ptr<NodeWaves> waves_;
  int columns_, rows_;          ///< Pixels.
  double total_;                ///< Light of the target.
  std::vector<double> target_;  ///< Display-encoded.
  std::vector<double> error_, by_pixel_;
  std::vector<double> positions_, normals_, positions_bar_, normals_bar_;
  std::vector<double> gradient_;
};

}  // namespace lensforge
