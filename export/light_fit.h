// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "core/compute/executor.h"
#include "core/compute/run_control.h"
#include "core/surface/slope_fit.h"
#include "export/picture_goal.h"

namespace lensforge {

/// Changes the heights of a spline until it projects the picture that the vertex-normal model
/// projects.
class LightFit {
 public:
  /// Keeps references.
  LightFit(const SlopeFit& slopes, const PictureGoal& goal, const Executor& executor,
           const RunControl& control);

  /// The best heights found, `start` at worst. @throw Interrupted.
  [[nodiscard]] Eigen::MatrixXd follow(const Eigen::MatrixXd& start);

 private:
  using Weights = Eigen::MatrixXf;  ///< One column per line along u.

  [[nodiscard]] Eigen::Matrix2d stretch_at(const Eigen::Vector2d& xy) const;
  void weigh_samples();
  void weigh_points();
  [[nodiscard]] SampledSurface sampled(const Eigen::MatrixXd& heights) const;
  [[nodiscard]] Eigen::MatrixXd weighted_moments(const Eigen::MatrixXd& heights,
                                                 bool of_misfit) const;
  [[nodiscard]] Eigen::MatrixXd missing_moments(const PictureMiss& miss) const;
  [[nodiscard]] Eigen::MatrixXd solve(Eigen::MatrixXd residual) const;

  const SlopeFit& slopes_;
  const PictureGoal& goal_;
  const Executor& executor_;
  const RunControl& control_;
  SplineGrid points_;         ///< Where the picture is sampled.
  Weights uu_, uv_, vv_;      ///< Of the derivatives' products at the samples.
  double mean_weight_ = 1.0;  ///< By which they were divided: they are 1 on average.
  Weights load_;              ///< What a unit of missing flux weighs at a point.
};

}  // namespace lensforge
