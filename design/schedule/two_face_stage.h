// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/optical_setup.h"
#include "design/energy/objective_options.h"
#include "design/energy/two_face_objective.h"
#include "design/optimize/grid_preconditioner.h"
#include "design/optimize/lbfgs.h"
#include "design/schedule/guided_optimization.h"

namespace lensforge {

/// Optimisation of both faces of a lens at one resolution: L-BFGS on a TwoFaceObjective.
///
/// The exit face's heights are counted from the front's: bending both faces alike moves light only
/// across the lens's thickness, bending one alone moves it across the distance of a screen, some
/// hundred times as far. In these variables the two are scaled apart, each by its measured
/// curvature.
class TwoFaceStage {
 public:
  /// @param net, front  shapes of LensFaces.
  TwoFaceStage(const GridShape& net, const GridShape& front, const std::vector<ScreenGoal>& goals,
               const ObjectiveOptions& options, const FaceLimits& limits, const Executor& executor);

  /// Improves both faces by at most `options.max_iterations` steps.
  /// @throw Interrupted if the executor is stopped; `faces` are then the best so far.
  LbfgsSummary run(const LbfgsOptions& options, const GuidedStage::Observer& observe,
                   LensFaces& faces);

  /// MAE of every screen.
  [[nodiscard]] std::vector<double> errors(const LensFaces& faces);

 private:
  /// Variables that are scaled together.
  enum class Part { kShifts, kHeights, kFront };
  using Vector = std::vector<double>;

  [[nodiscard]] Vector variables_of(const LensFaces& faces) const;
  void set_faces(std::span<const double> x, LensFaces& faces) const;
  double evaluate(std::span<const double> x, std::span<double> gradient);
  void precondition(std::span<const double> g, double exponent, std::span<double> r);
  void calibrate(const Vector& x);
  [[nodiscard]] double curvature(const Vector& x, Part part);
  [[nodiscard]] Vector signs(Part part) const;
  [[nodiscard]] double& scale(Part part);

  Executor executor_;
  OpticalSetup setup_;  ///< Of the first screen.
  double thickness_;
  GridShape net_;
  GridShape front_;
  Eigen::Index exit_size_;  ///< Variables of the exit face, which come first.
  Eigen::MatrixXd lift_x_;  ///< The front's heights at the control points' even places.
  Eigen::MatrixXd lift_y_;
  TwoFaceObjective objective_;
  GridPreconditionerOn<Executor> exit_preconditioner_;
  GridPreconditionerOn<Executor> front_preconditioner_;
  LensFaces faces_;
  LensFaces gradient_;
  ObjectiveEvaluation last_;
};

}  // namespace lensforge
