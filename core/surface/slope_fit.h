// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>

#include "core/compute/executor.h"
#include "core/compute/run_control.h"
#include "core/surface/grid_warp.h"
#include "core/surface/smooth_surface.h"
#include "core/surface/spline_grid.h"

namespace lensforge {

/// Side of a square with the mean area of two of the surface's triangles, mm.
double mesh_cell(const SmoothSurface& surface);

/// The vertex-normal model's height and slopes, at the nearest point of the surface's box.
SurfacePoint model_near(const SmoothSurface& surface, const Eigen::Vector2d& xy);

/// Least-squares heights of one spline over a surface's whole rectangle, all parameters weighted
/// equally.
class SlopeFit {
 public:
  /// Keeps references. @param cells  knot cells along u and v, ≥ 1.
  /// @param most_share  maximum share of the vertices' movement that the knot lines follow, 0 … 1;
  ///        less where they would fold.
  SlopeFit(const SmoothSurface& surface, const GridWarp& warp, const std::array<int, 2>& cells,
           double most_share, const Executor& executor, const RunControl& control);

  /// Coefficients of z, mm, with the surface's volume. @throw Interrupted.
  [[nodiscard]] Eigen::MatrixXd solve() const;

  /// The coefficients that have these moments: the last step of solve().
  [[nodiscard]] Eigen::MatrixXd heights_of(const Eigen::MatrixXd& moments) const;

  /// A change of heights less the constant that would change the volume.
  [[nodiscard]] Eigen::MatrixXd without_volume(const Eigen::MatrixXd& change) const;

  [[nodiscard]] const SmoothSurface& surface() const { return surface_; }
  [[nodiscard]] const SplinePlan& plan() const { return plan_; }
  [[nodiscard]] const SplineGrid& grid() const { return grid_; }
  /// Weight of a squared height against a squared slope, 1/mm².
  [[nodiscard]] double height_weight() const { return height_weight_; }

 private:
  [[nodiscard]] SplinePlan make_plan(const GridWarp& warp, double most_share) const;
  [[nodiscard]] double least_area(const SplinePlan& plan) const;
  [[nodiscard]] Eigen::MatrixXd area_moments() const;

  const SmoothSurface& surface_;
  const Executor& executor_;
  const RunControl& control_;
  SplineGrid grid_;
  std::array<AxisModes, 2> modes_;
  SplinePlan plan_;
  Eigen::MatrixXd areas_;
  double height_weight_;
};

}  // namespace lensforge
