// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "core/compute/host_device.h"

namespace lensforge {

/// What one surface triangle projects onto the receiving plane: a triangle of uniform irradiance.
/// The same struct holds derivatives of a scalar with respect to these numbers.
struct ImageTriangle {
  Eigen::Vector2d p0{0.0, 0.0};  ///< Corners in pixel coordinates (core/optics/screen.h).
  Eigen::Vector2d p1{0.0, 0.0};
  Eigen::Vector2d p2{0.0, 0.0};
  double flux = 0.0;  ///< Share of the lens's total flux.
};

/// The same light in a picture of `scale` times as many pixels each way. Of derivatives the
/// adjoint.
LF_HD inline ImageTriangle magnified(const ImageTriangle& t, double scale) {
  return {scale * t.p0, scale * t.p1, scale * t.p2, t.flux};
}

/// Twice the signed area of (a, b, c), positive counter-clockwise in a right-handed frame.
LF_HD inline double doubled_area(const Eigen::Vector2d& a, const Eigen::Vector2d& b,
                                 const Eigen::Vector2d& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (c.x() - a.x()) * (b.y() - a.y());
}

}  // namespace lensforge
