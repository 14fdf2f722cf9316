// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "core/compute/executor.h"
#include "core/lens/optical_surface.h"
#include "core/mesh/surface_mesh.h"
#include "core/spline/control_net.h"
#include "design/optics/averaging_grid.h"
#include "design/optics/made_by.h"

namespace lensforge {

/// What comes off the machine where a spline is cut and polished: the average of the spline with a
/// Gaussian, less what polish takes off at the rim.
///
/// Along the rows the Gaussian's variance is the polish's σ²; across them p²/12 is added. A ball of
/// radius R whose axis runs over y touches f at y + R f′, so that contacts are p (1 + R f″) apart.
/// At the distance d of one it leaves (1/R − f″) d²/2 more than f, on average
/// (1/R − f″) (1 + R f″)² p²/24 = p²/24R + f″ p²/24 + …, of which the first part is the same
/// everywhere. What that leaves out are waves of the pitch, of which polishing leaves
/// exp(−2π²σ²/p²), and what the ball fills of valleys sharper than itself. In a mould it is the
/// same, with f turned over. Beyond the rim the surface goes on turned about it, as PolishedField
/// has it.
///
/// Averages are sums over an AveragingGrid: of waves at least 2σ long they are off by less than
/// 1e-5 of the height, of a spline with bumps of 1 µm by 5e-8 mm and 1e-6 rad
/// (MadeSurface.IsTheAverageOfTheSpline).
class MadeSurface {
 public:
  /// @pre made.polish_sigma ≥ AveragingGrid::least_sigma(the lens's size). @throw Interrupted.
  MadeSurface(const ControlNet& net, const MadeBy& made, const Executor& executor);

  /// @pre xy is on the lens.
  [[nodiscard]] SurfacePoint at(const Eigen::Vector2d& xy) const;

 private:
  void sample_row(const ControlNet& net, int row);

  AveragingGrid grid_;
  Eigen::MatrixXd heights_;  ///< AveragingGrid::make_heights()
};

/// The made surface above the nodes of its spline, spline_nodes().
SampledSurface made_nodes(const ControlNet& net, const MadeBy& made, int samples,
                          const Executor& executor);

}  // namespace lensforge
