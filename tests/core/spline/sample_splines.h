// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "core/spline/control_net.h"

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

/// The same with knots a few micrometres apart at a corner, as optimal transport leaves them, and
/// heights that are rough at their scale: derivatives of fourth order reach 1e7/mm³ there.
inline ControlNet crowded_spline() {
  ControlNet net = sample_spline();
  const auto crowd = [&](int i, int j) -> Eigen::Ref<Eigen::Vector3d> {
    return net.points.col(j * net.shape.columns + i);
  };
  for (int k = 1; k <= 3; ++k) {
    for (int j = 0; j < net.shape.rows; ++j) {
      crowd(k, j).x() = 0.003 * k;
      crowd(k, j).z() = crowd(0, j).z();
    }
    for (int i = 0; i < net.shape.columns; ++i) {
      crowd(i, k).y() = 0.003 * k;
      crowd(i, k).z() = crowd(i, 0).z();
    }
  }
  for (int j = 0; j <= 3; ++j) {
    for (int i = 0; i <= 3; ++i) crowd(i, j).z() += (i * 7 + j * 5) % 3 == 0 ? 1e-4 : -1e-4;
  }
  return net;
}

}  // namespace lensforge::testing
