// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "core/spline/control_net.h"
#include "core/spline/cubic_spline.h"

namespace lensforge::testing {

/// A spline over [0, 15] × [0, 10] whose knot lines are warped as `warp` (mm, fading at the rim)
/// says, wavy by `wave` mm.
inline ControlNet sample_spline(double warp = 0.4, double wave = 0.05) {
  const Eigen::Vector2i cells(11, 8);
  ControlNet net{{cells.x() + 3, cells.y() + 3}, Eigen::Matrix3Xd(3, 14 * 11)};
  for (int j = 0; j < net.shape.rows; ++j) {
    for (int i = 0; i < net.shape.columns; ++i) {
      const double u = greville_point(i, cells.x()) / cells.x();
      const double v = greville_point(j, cells.y()) / cells.y();
      const double fade = std::sin(M_PI * u) * std::sin(M_PI * v);
      const bool inside_x = i > 0 && i + 1 < net.shape.columns;
      const bool inside_y = j > 0 && j + 1 < net.shape.rows;
      net.points.col(j * net.shape.columns + i)
          << 15.0 * u + (inside_x ? warp * fade * std::cos(5.0 * v) : 0.0),
          10.0 * v + (inside_y ? warp * fade * std::sin(4.0 * u) : 0.0),
          5.2 + wave * std::sin(7.0 * u + 1.0) * std::cos(6.0 * v);
    }
  }
  return net;
}

}  // namespace lensforge::testing
