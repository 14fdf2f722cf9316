// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "core/compute/executor.h"
#include "core/surface/control_net.h"
#include "export/spline_net.h"

namespace lensforge {

/// One bicubic spline over a rectangle of parameters, even knots clamped at the rim.
struct WholeSpline {
  Eigen::AlignedBox2d box;  ///< Of the parameters.
  /// Coefficients of x, y and z in mm, row index along u.
  std::array<Eigen::MatrixXd, 3> coefficients;
};

/// Where the spline is cut, numbers of knots, ascending, the first and last one included.
struct CutLines {
  std::vector<int> u;
  std::vector<int> v;
};

/// The same surface as a net of patches. Inner coefficients stay as they are but for rounding;
/// those next to a cut follow by the Oslo algorithm.
/// @param step  mm, on whole multiples of which coefficients are rounded.
SplineNet cut_spline(const WholeSpline& whole, const CutLines& lines, double step,
                     const Executor& executor);

/// A lens's own spline as a net of patches: nothing is fitted. Its coordinates are those of the
/// control points to 1e-10 mm.
SplineNet net_of(const ControlNet& spline, const Executor& executor);

/// The same as one patch.
SplineNet patch_of(const ControlNet& spline, const Executor& executor);

/// Control points of net_of().
std::int64_t control_points_of_net(const ControlNet& spline);

}  // namespace lensforge
